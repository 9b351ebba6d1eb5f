// surfrecon for C++17: thin owners of the handles of surfrecon.h, exceptions instead of status codes, lambdas for progress.
//
// Each class owns one handle, frees it, can be moved and not copied; `get()` is the handle for the functions of surfrecon.h,
// which remain the manual. A call that fails throws surfrecon::Error (surfrecon::Cancelled for a cancelled one); what a
// progress function throws comes out of the call it was handed to, which then is cancelled, and what a source of images throws
// out of the call that needed the image.

#ifndef SURFRECON_HPP
#define SURFRECON_HPP

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <iterator>
#include <memory>
#include <new>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>
#if __has_include(<version>)
#include <version>
#endif
#ifdef __cpp_lib_span
#include <span>
#endif

#include "surfrecon.h"

namespace surfrecon {

// An error of the library: what() names the thing and the remedy, status() is the number.
class Error : public std::runtime_error {
public:
    Error(srf_status status, const std::string &text) : std::runtime_error(text), status_(status) {}
    srf_status status() const noexcept { return status_; }

private:
    srf_status status_;
};

// The caller cancelled; nothing was left behind.
class Cancelled : public Error {
public:
    using Error::Error;
};

// Throws unless `status` is SRF_OK.
inline void check(srf_status status)
{
    if (status == SRF_OK) return;
    const std::string text = srf_last_error_message();
    if (status == SRF_ERR_CANCELLED) throw Cancelled(status, text);
    throw Error(status, text);
}

namespace detail {

template <typename T>
struct TypeOf;
template <>
struct TypeOf<float> { static constexpr std::uint32_t value = SRF_TYPE_F32; };
template <>
struct TypeOf<double> { static constexpr std::uint32_t value = SRF_TYPE_F64; };
template <>
struct TypeOf<std::int32_t> { static constexpr std::uint32_t value = SRF_TYPE_I32; };
template <>
struct TypeOf<std::uint32_t> { static constexpr std::uint32_t value = SRF_TYPE_U32; };
template <>
struct TypeOf<std::uint16_t> { static constexpr std::uint32_t value = SRF_TYPE_U16; };
template <>
struct TypeOf<std::uint8_t> { static constexpr std::uint32_t value = SRF_TYPE_U8; };

// Goes through the elements of a view, in any order.
template <typename T, std::size_t N>
class Elements {
public:
    using value_type = std::conditional_t<N == 1, T, std::array<T, N>>;
    using reference = value_type;
    using pointer = void;
    using difference_type = std::ptrdiff_t;
    // Elements are given by value, which older algorithms take no other iterators to do.
    using iterator_category = std::input_iterator_tag;
#ifdef __cpp_lib_ranges
    using iterator_concept = std::random_access_iterator_tag;
#endif

    Elements() = default;
    Elements(const T *first, std::size_t stride, std::size_t at) noexcept
        : first_(reinterpret_cast<const unsigned char *>(first)), stride_(stride), at_(at) {}
    value_type operator*() const noexcept
    {
        const T *numbers = reinterpret_cast<const T *>(first_ + stride_ * at_);
        if constexpr (N == 1) {
            return *numbers;
        } else {
            value_type element;
            for (std::size_t k = 0; k < N; ++k) element[k] = numbers[k];
            return element;
        }
    }
    value_type operator[](difference_type by) const noexcept { return *(*this + by); }
    Elements &operator++() noexcept { return *this += 1; }
    Elements &operator--() noexcept { return *this += -1; }
    Elements operator++(int) noexcept { return std::exchange(*this, *this + 1); }
    Elements operator--(int) noexcept { return std::exchange(*this, *this + -1); }
    Elements &operator+=(difference_type by) noexcept
    {
        at_ = static_cast<std::size_t>(static_cast<difference_type>(at_) + by);
        return *this;
    }
    Elements &operator-=(difference_type by) noexcept { return *this += -by; }
    friend Elements operator+(Elements it, difference_type by) noexcept { return it += by; }
    friend Elements operator+(difference_type by, Elements it) noexcept { return it += by; }
    friend Elements operator-(Elements it, difference_type by) noexcept { return it -= by; }
    friend difference_type operator-(const Elements &a, const Elements &b) noexcept
    {
        return static_cast<difference_type>(a.at_) - static_cast<difference_type>(b.at_);
    }
    friend bool operator==(const Elements &a, const Elements &b) noexcept { return a.at_ == b.at_; }
    friend bool operator!=(const Elements &a, const Elements &b) noexcept { return a.at_ != b.at_; }
    friend bool operator<(const Elements &a, const Elements &b) noexcept { return a.at_ < b.at_; }
    friend bool operator>(const Elements &a, const Elements &b) noexcept { return a.at_ > b.at_; }
    friend bool operator<=(const Elements &a, const Elements &b) noexcept { return a.at_ <= b.at_; }
    friend bool operator>=(const Elements &a, const Elements &b) noexcept { return a.at_ >= b.at_; }

private:
    const unsigned char *first_ = nullptr;
    std::size_t stride_ = 0, at_ = 0;
};

}  // namespace detail

// A view of `size()` elements of `N` numbers of type T each; stays as long as what it is a view of. A loop gives its elements by value:
// `for (const auto [x, y, z] : mesh.positions())`, `for (const float strength : cloud.intensities())`.
template <typename T, std::size_t N = 1>
class View {
public:
    using iterator = detail::Elements<T, N>;
    using const_iterator = iterator;
    // The entries of a loop: a number, or N of them.
    using value_type = typename iterator::value_type;

    View() = default;
    // Of numbers, N an element.
    explicit View(const std::vector<T> &numbers) : data_(numbers.data()), size_(numbers.size() / N)
    {
        if (numbers.size() % N != 0)
            throw Error(SRF_ERR_INPUT, std::to_string(numbers.size()) + " numbers are no whole number of elements of " + std::to_string(N));
    }
    // A vector that ends before the view is used leaves it without anything to show.
    explicit View(std::vector<T> &&) = delete;
    // `stride` bytes from an element to the next one, 0 if there are no gaps; elements lie where a T may.
    View(const T *data, std::size_t size, std::size_t stride = 0) : data_(data), size_(size), stride_(stride) {}
    // Throws unless the array has N numbers of type T an element.
    explicit View(const srf_array &array)
        : data_(static_cast<const T *>(array.data)), size_(array.count), stride_(array.stride)
    {
        if (size_ != 0 && (array.type != detail::TypeOf<T>::value || array.components != N))
            throw Error(SRF_ERR_INPUT, "the array has " + std::to_string(array.components) + " numbers of srf_type " +
                                           std::to_string(array.type) + " an element, not " + std::to_string(N) + " of " +
                                           std::to_string(detail::TypeOf<T>::value));
    }
    std::size_t size() const noexcept { return size_; }
    bool empty() const noexcept { return size_ == 0; }
    // Bytes from an element to the next one.
    std::size_t stride() const noexcept { return stride_ == 0 ? N * sizeof(T) : stride_; }
    // The numbers of all elements, one after the other, where there are no gaps.
    const T *data() const noexcept { return data_; }
    // The numbers of an element.
    const T *operator[](std::size_t i) const noexcept
    {
        return reinterpret_cast<const T *>(reinterpret_cast<const unsigned char *>(data_) + stride() * i);
    }
    iterator begin() const noexcept { return iterator(data_, stride(), 0); }
    iterator end() const noexcept { return iterator(data_, stride(), size_); }
    // A copy that stays.
    std::vector<value_type> to_vector() const
    {
        std::vector<value_type> all;
        all.reserve(size_);
        for (const value_type &element : *this) all.push_back(element);
        return all;
    }
#ifdef __cpp_lib_span
    // The numbers of all elements, one after the other; throws where there are gaps.
    std::span<const T> span() const
    {
        if (stride() != N * sizeof(T) && size_ > 1)
            throw Error(SRF_ERR_INPUT, "elements lie " + std::to_string(stride()) + " bytes apart, and a span has no gaps: take to_vector()");
        return std::span<const T>(data_, N * size_);
    }
#endif
    // As the functions of surfrecon.h take it.
    srf_array array() const noexcept
    {
        return srf_array{data_, size_, stride_, detail::TypeOf<T>::value, static_cast<std::uint32_t>(N)};
    }

private:
    const T *data_ = nullptr;
    std::size_t size_ = 0, stride_ = 0;
};

namespace detail {

// A handle that is freed when its owner goes.
template <typename H, srf_status (*Free)(H *)>
class Handle {
public:
    Handle() = default;
    explicit Handle(H *handle) : handle_(handle) {}
    H *get() const noexcept { return handle_.get(); }
    // Hands the handle over to whoever frees it.
    H *release() noexcept { return handle_.release(); }
    explicit operator bool() const noexcept { return static_cast<bool>(handle_); }

private:
    struct Deleter {
        void operator()(H *handle) const noexcept { Free(handle); }
    };
    std::unique_ptr<H, Deleter> handle_;
};

// A text that the library copies into our room, asked for its length first.
template <typename Call>
std::string text_of(Call call)
{
    std::size_t length = 0;
    check(call(nullptr, std::size_t{0}, &length));
    std::string text(length + 1, '\0');
    check(call(&text[0], text.size(), &length));
    text.resize(length);
    return text;
}

}  // namespace detail

// The place of a long call.
struct Tick {
    std::string_view stage;    // what is being done, for people
    double fraction;           // share of the whole call that is done, 0 to 1
    std::string_view message;  // both as one line
};

// Asked about every 30 ms on the calling thread: true goes on, false cancels. May throw.
using ProgressFunction = std::function<bool(const Tick &)>;

// Cancels the calls that it is handed to, from any thread.
class Cancel : public detail::Handle<srf_cancel, srf_cancel_free> {
public:
    Cancel()
    {
        srf_cancel *cancel = nullptr;
        check(srf_cancel_create(&cancel));
        static_cast<Handle &>(*this) = Handle(cancel);
    }
    // Calls that have it end within a tenth of a second, those that begin with it at once. A handler of a signal may call it.
    void set() const noexcept { srf_cancel_set(get()); }
    // Calls may begin with it again.
    void reset() { check(srf_cancel_reset(get())); }
    bool is_set() const
    {
        std::uint32_t is_set = 0;
        check(srf_cancel_is_set(get(), &is_set));
        return is_set != 0;
    }
};

// The watcher of a long call, and what cancels it: a function, a Cancel, both or neither.
class Progress {
public:
    Progress() = default;
    template <typename F, typename = std::enable_if_t<std::is_invocable_r_v<bool, F &, const Tick &>>>
    Progress(F &&function) : function_(std::forward<F>(function))
    {
    }
    Progress(const Cancel &cancel) : cancel_(cancel.get()) {}
    Progress(ProgressFunction function, const Cancel &cancel) : function_(std::move(function)), cancel_(cancel.get()) {}
    const ProgressFunction &function() const noexcept { return function_; }
    const srf_cancel *cancel() const noexcept { return cancel_; }

private:
    ProgressFunction function_;
    const srf_cancel *cancel_ = nullptr;
};

namespace detail {

// Hands progress to a function of C++, and what that throws past the C library.
class Watcher {
public:
    explicit Watcher(const Progress &progress)
        : function_(progress.function()), progress_{function_ ? &Watcher::report : nullptr, this, progress.cancel()}
    {
    }
    Watcher(const Watcher &) = delete;
    Watcher &operator=(const Watcher &) = delete;
    const srf_progress *get() const noexcept { return &progress_; }
    void check(srf_status status) const
    {
        if (thrown_) std::rethrow_exception(thrown_);
        surfrecon::check(status);
    }

private:
    static std::int32_t report(const char *stage, double fraction, const char *message, void *user)
    {
        auto &self = *static_cast<Watcher *>(user);
        try {
            return self.function_(Tick{stage, fraction, message}) ? 0 : 1;
        } catch (...) {
            self.thrown_ = std::current_exception();
            return 1;
        }
    }

    const ProgressFunction &function_;
    srf_progress progress_;
    std::exception_ptr thrown_;
};

}  // namespace detail

// Version of the loaded library.
inline std::string version() { return srf_version(); }
// Throws unless the loaded library is one that this header fits.
inline void check_abi()
{
    if (srf_abi_version() != SRF_ABI_VERSION)
        throw Error(SRF_ERR_INTERNAL, "the loaded surfrecon " + version() + " has binary interface " + std::to_string(srf_abi_version()) +
                                          ", this program was built for " + std::to_string(SRF_ABI_VERSION));
}

// Hears what the library tells: a level and a text. Must not throw. Called on the thread of the call that tells, at once on several.
using LogFunction = std::function<void(srf_log_level level, const char *text)>;

// Sets the function that is told from now on, none if empty. The one before must no longer be needed: set it while no call is running.
inline void set_log(LogFunction log)
{
    static LogFunction kept;
    check(srf_set_log(nullptr, nullptr));
    kept = std::move(log);
    if (!kept) return;
    check(srf_set_log([](std::int32_t level, const char *text,
                         void *user) { (*static_cast<LogFunction *>(user))(static_cast<srf_log_level>(level), text); },
                      &kept));
}

// Worker threads of calls whose parameters say 0; 0 for one a core.
inline void set_threads(std::uint32_t threads) { check(srf_set_threads(threads)); }
inline std::uint32_t threads() { return srf_threads(); }
inline std::uint64_t memory_limit() { return srf_memory_limit(); }
// Limits what calls take together, 0 for no limit; what they handed out before does not count once no call is running.
// See srf_set_memory_limit().
inline void set_memory_limit(std::uint64_t bytes) { check(srf_set_memory_limit(bytes)); }

// Threads, a limit on memory and a log for a part of a program: what is called while a Use of it lives is under it.
class Context : public detail::Handle<srf_context, srf_context_free> {
public:
    Context()
    {
        srf_context *context = nullptr;
        check(srf_context_create(&context));
        static_cast<Handle &>(*this) = Handle(context);
    }
    Context(Context &&) = default;
    Context &operator=(Context &&other) noexcept
    {
        // The log must stay until nobody is told any more.
        static_cast<Handle &>(*this) = std::move(static_cast<Handle &>(other));
        log_ = std::move(other.log_);
        return *this;
    }
    void set_threads(std::uint32_t threads) { check(srf_context_set_threads(get(), threads)); }
    std::uint32_t threads() const
    {
        std::uint32_t threads = 0;
        check(srf_context_threads(get(), &threads));
        return threads;
    }
    // Limits what its calls take together, 0 for as much as the process's limit; what they handed out before, which held() counts,
    // does not count once none is running.
    void set_memory_limit(std::uint64_t bytes) { check(srf_context_set_memory_limit(get(), bytes)); }
    std::uint64_t memory_limit() const
    {
        std::uint64_t limit = 0;
        check(srf_context_memory(get(), &limit, nullptr));
        return limit;
    }
    // Bytes that its calls, and what was made under it, hold now.
    std::uint64_t held() const
    {
        std::uint64_t held = 0;
        check(srf_context_memory(get(), nullptr, &held));
        return held;
    }
    // Sets the function that is told from now on, the process's if empty. Set it while no call is running under it. It must outlive those that are.
    void set_log(LogFunction log)
    {
        check(srf_context_set_log(get(), nullptr, nullptr));
        log_.reset();
        if (!log) return;
        log_ = std::make_unique<LogFunction>(std::move(log));
        check(srf_context_set_log(
            get(),
            [](std::int32_t level, const char *text, void *user) {
                (*static_cast<LogFunction *>(user))(static_cast<srf_log_level>(level), text);
            },
            log_.get()));
    }

private:
    std::unique_ptr<LogFunction> log_;
};

// While it lives, what its thread calls is under a context; what that used before comes back. Ends on the thread it began on.
class Use {
public:
    explicit Use(const Context &context) { check(srf_context_use(context.get(), &former_)); }
    Use(const Use &) = delete;
    Use &operator=(const Use &) = delete;
    ~Use()
    {
        // One that was freed meanwhile can't come back.
        if (srf_context_use(former_, nullptr) != SRF_OK) srf_context_use(nullptr, nullptr);
    }

private:
    srf_context *former_ = nullptr;
};

// The box around something.
struct Bounds {
    std::array<double, 3> min{};
    std::array<double, 3> max{};
    std::array<double, 3> middle() const noexcept
    {
        return {0.5 * (min[0] + max[0]), 0.5 * (min[1] + max[1]), 0.5 * (min[2] + max[2])};
    }
};

// Places a frame in another; the identity unless changed.
struct Pose : srf_pose {
    Pose() : srf_pose{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}} {}
    Pose(const srf_pose &pose) : srf_pose(pose) {}
};

// How the pixels of an image see, in the sensor's frame; see the functions srf_projection_...().
struct Projection : srf_projection {
    Projection() : srf_projection{} {}

    // A depth camera that looks along z, by its focal lengths and its principal point in pixels.
    static Projection pinhole(double fx, double fy, double cx, double cy, bool along_ray = false)
    {
        return filled([&](srf_projection *out) { return srf_projection_pinhole(fx, fy, cx, cy, along_ray ? 1 : 0, out); });
    }
    // A height map, by the place of its first pixel and by what lies between pixels.
    static Projection orthographic(double first_x, double first_y, double step_x, double step_y)
    {
        return filled([&](srf_projection *out) { return srf_projection_orthographic(first_x, first_y, step_x, step_y, out); });
    }
    // A terrestrial scanner, in radians.
    static Projection spherical(double azimuth, double elevation, double azimuth_step, double elevation_step)
    {
        return filled([&](srf_projection *out) {
            return srf_projection_spherical(azimuth, elevation, azimuth_step, elevation_step, out);
        });
    }
    // A point per pixel, seen along parallel rays.
    static Projection grid_parallel(const std::array<double, 3> &direction)
    {
        return filled([&](srf_projection *out) { return srf_projection_grid_parallel(direction.data(), out); });
    }
    // A point per pixel, seen from one place.
    static Projection grid_from(const std::array<double, 3> &origin)
    {
        return filled([&](srf_projection *out) { return srf_projection_grid_from(origin.data(), out); });
    }

private:
    template <typename Fill>
    static Projection filled(Fill fill)
    {
        Projection projection;
        check(fill(&projection));
        return projection;
    }
};

// Parameters and figures that are C's, made whole. Written by `make generate` from their declarations in the core, up to the mark.

// structs

// The parameters of `open`, with their defaults.
struct ReadOptions : srf_read_options {
    ReadOptions() { check(srf_read_options_init(this)); }
};

// The parameters of `write`, with their defaults.
struct WriteOptions : srf_write_options {
    WriteOptions() { check(srf_write_options_init(this)); }
};

// The parameters of `triangulate`, with their defaults.
struct TriangulateParams : srf_triangulate_params {
    TriangulateParams() { check(srf_triangulate_params_init(this)); }
};

// The parameters of `plane`, with their defaults.
struct PlaneParams : srf_plane_params {
    PlaneParams() { check(srf_plane_params_init(this)); }
};

// The parameters of `align`, with their defaults.
struct AlignParams : srf_align_params {
    AlignParams() { check(srf_align_params_init(this)); }
};

// The parameters of `merge`, with their defaults.
struct MergeParams : srf_merge_params {
    MergeParams() { check(srf_merge_params_init(this)); }
};

// The parameters of `sculpt`, with their defaults.
struct SculptParams : srf_sculpt_params {
    SculptParams() { check(srf_sculpt_params_init(this)); }
};

// The parameters of `spline`, with their defaults.
struct SplineParams : srf_spline_params {
    SplineParams() { check(srf_spline_params_init(this)); }
};

// The parameters of `reconstruct`, with their defaults.
struct ReconstructParams : srf_reconstruct_params {
    ReconstructParams() { check(srf_reconstruct_params_init(this)); }
};

// The parameters of `cluster`, with their defaults.
struct ClusterParams : srf_cluster_params {
    ClusterParams() { check(srf_cluster_params_init(this)); }
};

// The parameters of `close`, with their defaults.
struct CloseParams : srf_close_params {
    CloseParams() { check(srf_close_params_init(this)); }
};

// The parameters of `check_print`, with their defaults.
struct CheckPrintParams : srf_check_print_params {
    CheckPrintParams() { check(srf_check_print_params_init(this)); }
};

// The parameters of `prepare_print`, with their defaults.
struct PreparePrintParams : srf_prepare_print_params {
    PreparePrintParams() { check(srf_prepare_print_params_init(this)); }
};

// The parameters of `unwrap`, with their defaults.
struct UnwrapParams : srf_unwrap_params {
    UnwrapParams() { check(srf_unwrap_params_init(this)); }
};

// The parameters of `texture`, with their defaults.
struct TextureParams : srf_texture_params {
    TextureParams() { check(srf_texture_params_init(this)); }
};

// The parameters of `scan`, with their defaults.
struct ScanParams : srf_scan_params {
    ScanParams() { check(srf_scan_params_init(this)); }
};

// Scans that were aligned, and their pairs.
struct AlignReport : srf_align_report {
    AlignReport() { check(srf_align_report_init(this)); }
};

// The figures of a merge, among them those of the paper's tables.
struct MergeReport : srf_merge_report {
    MergeReport() { check(srf_merge_report_init(this)); }
};

// The figures of sculpting.
struct SculptReport : srf_sculpt_report {
    SculptReport() { check(srf_sculpt_report_init(this)); }
};

// The figures of a quad grid. Errors are distances along the samples' rays to the planes of the triangles of the pixels' quads, over all valid pixels of the image but those missed, with each quad cut along its better diagonal. On the background the grid continues the surface.
struct QuadReport : srf_quads_report {
    QuadReport() { check(srf_quads_report_init(this)); }
};

// The figures of a surface through points.
struct ReconstructReport : srf_reconstruct_report {
    ReconstructReport() { check(srf_reconstruct_report_init(this)); }
};

// The figures of clustering.
struct ClusterReport : srf_cluster_report {
    ClusterReport() { check(srf_cluster_report_init(this)); }
};

// The figures of closing.
struct CloseReport : srf_close_report {
    CloseReport() { check(srf_close_report_init(this)); }
};

// The figures of the checks for printing.
struct PrintReport : srf_check_print_report {
    PrintReport() { check(srf_check_print_report_init(this)); }
};

// The figures of preparing a print. Lengths are in the unit of the result.
struct PrepareReport : srf_prepare_print_report {
    PrepareReport() { check(srf_prepare_print_report_init(this)); }
};

// The figures of unwrapping.
struct UnwrapReport : srf_unwrap_report {
    UnwrapReport() { check(srf_unwrap_report_init(this)); }
};

// The figures of texturing.
struct TextureReport : srf_texture_report {
    TextureReport() { check(srf_texture_report_init(this)); }
};

// A mesh as a surface: counts, and what follows from them. Triangles that name a vertex out of range or a vertex twice are counted, then left out of all that follows. So are vertices without a triangle.
struct CheckReport : srf_check_report {
    CheckReport() { check(srf_check_report_init(this)); }
};

// Distances of points, or of a surface, from another surface. All figures but `bias` are of absolute values.
struct DistanceReport : srf_distance_report {
    DistanceReport() { check(srf_distance_report_init(this)); }
};

// Samples that were left out of a frame, or of several, each counted for the first reason that it has.
struct LeftOutReport : srf_left_out_report {
    LeftOutReport() { check(srf_left_out_report_init(this)); }
};

// end

// The parameters of `quads`, with their defaults.
struct QuadParams : srf_quads_params {
    QuadParams() { check(srf_quads_params_init(this)); }
};

// A point that two scans show: without normals, of weight 1 unless changed.
struct Pick : srf_pick {
    Pick() { check(srf_pick_init(this)); }
};

// The figures of a scan in an alignment.
struct AlignedScan : srf_aligned_scan {
    AlignedScan() { check(srf_aligned_scan_init(this)); }
    bool has_place() const noexcept { return state == SRF_SCAN_STATE_PLACED || state == SRF_SCAN_STATE_KEPT; }
    // Ways that nothing holds it.
    std::vector<srf_freedom> ways() const { return {freedoms, freedoms + freedoms_count}; }
};

// The figures of two scans in an alignment.
struct AlignedPair : srf_aligned_pair {
    AlignedPair() { check(srf_aligned_pair_init(this)); }
    // Ways that one may turn or slide on the other.
    std::vector<srf_freedom> ways() const { return {freedoms, freedoms + freedoms_count}; }
};

// The place that a scan was drawn to.
struct Snap : srf_snap_report {
    Snap() { check(srf_snap_report_init(this)); }
    // Numbers of the scans that it touches.
    std::vector<std::size_t> touched;
    // Ways that it may turn or slide.
    std::vector<srf_freedom> ways() const { return {freedoms, freedoms + freedoms_count}; }
};

// The figures of a photo.
struct TexturedPhoto : srf_textured_photo {
    TexturedPhoto() { check(srf_textured_photo_init(this)); }
};

// The axis of a turntable, in the frame that scans were taken in.
struct Axis {
    std::array<double, 3> point{};
    std::array<double, 3> direction{};
};

// A turntable as it was found.
struct Turntable {
    Axis axis;
    // By how much it was turned at each scan; NaN at those that have no place.
    std::vector<double> angles;
};

// How the images of a frame were taken and how they lie in memory.
struct Frame : srf_frame {
    Frame() { check(srf_frame_init(this)); }
};

// The data that a host keeps of a range image beside its vertices: how pixels see, and where some of the vertices were.
struct GridCamera : srf_grid_camera {
    GridCamera() { check(srf_grid_camera_init(this)); }

    // For vertices whose coordinates are multiplied, where the host's unit of length is another.
    GridCamera scaled(double scale) const
    {
        GridCamera camera(*this);
        check(srf_grid_camera_scale(&camera, scale));
        return camera;
    }
};

// A plane in the world; z = 0 unless changed.
struct Plane : srf_plane {
    Plane() { check(srf_plane_init(this)); }
    // Above is the side of `eye`; without it the one where the points turn counter-clockwise.
    static Plane through(const std::array<std::array<double, 3>, 3> &points, const std::optional<std::array<double, 3>> &eye = {})
    {
        Plane plane;
        check(srf_plane_through(points[0].data(), eye ? eye->data() : nullptr, &plane));
        return plane;
    }
};

// A region, by which samples are kept or removed.
class Region : public detail::Handle<srf_region, srf_region_free> {
public:
    using Handle::Handle;

    // Of the cube from -1 to 1 along each axis.
    static Region box(const Pose &world_from_box)
    {
        srf_region *region = nullptr;
        check(srf_region_box(&world_from_box, &region));
        return Region(region);
    }

    // The region below a plane, on it, and up to its margin above.
    static Region below(const srf_plane &plane)
    {
        srf_region *region = nullptr;
        check(srf_region_below(&plane, &region));
        return Region(region);
    }

    // Marked samples, those that are not 0; rows and cols of an image.
    static Region mask(View<std::uint8_t> marks, std::size_t rows = 0, std::size_t cols = 0)
    {
        const srf_array given = marks.array();
        srf_region *region = nullptr;
        check(srf_region_mask(&given, rows, cols, &region));
        return Region(region);
    }
};

// The scale that makes two places lie `distance` apart.
inline Pose true_size(const std::array<double, 3> &a, const std::array<double, 3> &b, double distance)
{
    Pose similarity;
    check(srf_true_size(a.data(), b.data(), distance, &similarity));
    return similarity;
}

// The motion that lays a plane to height 0.
inline Pose ground(const srf_plane &plane, const std::array<double, 3> &up = {0, 0, 1})
{
    Pose similarity;
    check(srf_ground(&plane, up.data(), &similarity));
    return similarity;
}

class Photo;
class Textures;

// A triangle mesh.
class Mesh : public detail::Handle<srf_mesh, srf_mesh_free> {
public:
    using Handle::Handle;

    // Three coordinates a vertex, three indices a triangle.
    template <typename Real>
    static Mesh create(View<Real, 3> positions, View<std::uint32_t, 3> triangles)
    {
        const srf_array p = positions.array(), t = triangles.array();
        srf_mesh *mesh = nullptr;
        check(srf_mesh_create(&p, &t, &mesh));
        return Mesh(mesh);
    }

    View<double, 3> positions() const
    {
        srf_array view{};
        check(srf_mesh_positions(get(), &view));
        return View<double, 3>(view);
    }

    View<std::uint32_t, 3> triangles() const
    {
        srf_array view{};
        check(srf_mesh_triangles(get(), &view));
        return View<std::uint32_t, 3>(view);
    }

    // The box around all vertices.
    Bounds bounds(const Progress &progress = {}) const
    {
        Bounds bounds;
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_bounds(get(), watcher.get(), bounds.min.data(), bounds.max.data()));
        return bounds;
    }

    // Three coordinates a vertex in single precision, relative to an origin: those far from 0 keep their digits.
    std::vector<float> positions_f32(const std::array<double, 3> &origin = {}, const Progress &progress = {}) const
    {
        std::vector<float> near(3 * positions().size());
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_positions_f32(get(), origin.data(), near.data(), near.size(), watcher.get()));
        return near;
    }

    // Names of the attributes of the vertices or of the triangles.
    std::vector<std::string> attributes(srf_domain domain) const
    {
        std::size_t count = 0;
        check(srf_mesh_attribute_count(get(), domain, &count));
        std::vector<std::string> names;
        for (std::size_t i = 0; i < count; ++i) {
            const char *name = nullptr;
            check(srf_mesh_attribute_name(get(), domain, i, &name));
            names.emplace_back(name);
        }
        return names;
    }

    // A view of an attribute; throws unless it has N numbers of type T an entry.
    template <typename T, std::size_t N = 1>
    View<T, N> attribute(srf_domain domain, const std::string &name) const
    {
        srf_array view{};
        check(srf_mesh_attribute(get(), domain, name.c_str(), &view));
        if (view.type != detail::TypeOf<T>::value || view.components != N) {
            throw Error(SRF_ERR_INPUT, "attribute " + name + " is of another type");
        }
        return View<T, N>(view);
    }

    // Sets an attribute; views of the mesh are gone.
    template <typename T, std::size_t N>
    void set_attribute(srf_domain domain, const std::string &name, View<T, N> entries)
    {
        const srf_array array = entries.array();
        check(srf_mesh_set_attribute(get(), domain, name.c_str(), &array));
    }

    // Is it what a surface must be, and what is its topology?
    srf_check_report report(bool welded = false, const Progress &progress = {}) const
    {
        srf_check_report report{};
        check(srf_check_report_init(&report));
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_check(get(), welded ? 1 : 0, watcher.get(), &report));
        return report;
    }

    // Exact distances of points to the mesh; `out`, if given, has room for one a point.
    template <typename Real>
    DistanceReport distances(View<Real, 3> points, double *out = nullptr, bool is_signed = false,
                             const Progress &progress = {}) const
    {
        const srf_array array = points.array();
        DistanceReport figures;
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_distances(get(), &array, is_signed ? 1 : 0, 0, watcher.get(), out, &figures));
        return figures;
    }

    // How far this surface lies from another: figures of its vertices, the largest distance found between them too, and a bound
    // that no point exceeds. Distances of the vertices go to `out`, if given, which has room for one each.
    DistanceReport surface_distance(const Mesh &reference, double *out = nullptr, bool is_signed = false,
                                    const Progress &progress = {}) const
    {
        DistanceReport figures;
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_surface_distance(get(), reference.get(), is_signed ? 1 : 0, 0, watcher.get(), out, &figures));
        return figures;
    }

    // A coarse mesh of well-shaped triangles with the same topology; its figures go to `report`, if given.
    Mesh clustered(const ClusterParams &params = {}, ClusterReport *report = nullptr, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_cluster(get(), &params, watcher.get(), &mesh, report));
        return Mesh(mesh);
    }

    // A chain of levels of detail from one run, one for each number of vertices; write_glb_levels() writes them.
    std::vector<Mesh> clustered(const std::vector<std::uint64_t> &vertices, const ClusterParams &params = {},
                                const Progress &progress = {}) const
    {
        if (vertices.empty()) return {};
        std::vector<srf_mesh *> handles(vertices.size(), nullptr);
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_cluster_levels(get(), vertices.data(), vertices.size(), &params, watcher.get(), handles.data()));
        std::vector<Mesh> levels;
        for (srf_mesh *handle : handles) levels.emplace_back(handle);
        return levels;
    }

    // The surface without its openings, closed by their shape alone; its figures go to `report`, if given. Merger::close() knows more.
    Mesh closed(const CloseParams &params = {}, CloseReport *report = nullptr, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_close(get(), nullptr, &params, watcher.get(), &mesh, report));
        return Mesh(mesh);
    }

    // Whether it can be printed: it with attributes of its triangles, wall, crossing and overhang. Its figures go to `report`, if given.
    Mesh checked_for_printing(const CheckPrintParams &params = {}, PrintReport *report = nullptr, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_check_print(get(), &params, watcher.get(), &mesh, report));
        return Mesh(mesh);
    }

    // Ready for printing, by the steps that are asked for. Closed, and no faces cross. Its figures go to `report`, if given.
    Mesh prepared_for_printing(const PreparePrintParams &params = {}, PrepareReport *report = nullptr, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_prepare_print(get(), &params, watcher.get(), &mesh, report));
        return Mesh(mesh);
    }

    // A part of a mesh that was cut for a printer, counted from 0.
    Mesh part(std::size_t number) const
    {
        srf_mesh *mesh = nullptr;
        check(srf_mesh_part(get(), number, &mesh));
        return Mesh(mesh);
    }

    // With texture coordinates: the attributes s and t of the vertices. Its figures go to `report`, if given.
    Mesh unwrapped(const UnwrapParams &params = {}, UnwrapReport *report = nullptr, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_unwrap(get(), &params, watcher.get(), &mesh, report));
        return Mesh(mesh);
    }

    // Images of it, which has texture coordinates, from photos and from the detailed surface that it stands for. The figures go to
    // `report`, if given.
    Textures textured(const Mesh &detail, const std::vector<const Photo *> &photos = {}, const TextureParams &params = {},
                      TextureReport *report = nullptr, const Progress &progress = {}) const;

    // By the ending of the name: .ply, .glb, .obj, .stl.
    void write(const std::string &path, const WriteOptions &options = {}, const Progress &progress = {}) const
    {
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_write(get(), path.c_str(), &options, watcher.get()));
    }

    // And says in the file where it is from: an object in JSON.
    void write_from(const std::string &path, const std::string &provenance, const WriteOptions &options = {},
                    const Progress &progress = {}) const
    {
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_write_from(get(), path.c_str(), &options, provenance.c_str(), watcher.get()));
    }

    void write_ply(const std::string &path, srf_encoding encoding = SRF_ENCODING_BINARY, const Progress &progress = {}) const
    {
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_write_ply(get(), path.c_str(), encoding, watcher.get()));
    }

    // The name is that of its node; "mesh" where it is empty.
    void write_glb(const std::string &path, double metres_per_unit, bool z_up = false, const Progress &progress = {},
                   const std::string &name = {}) const
    {
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_write_glb(get(), path.c_str(), name.empty() ? nullptr : name.c_str(), metres_per_unit, z_up ? 1 : 0,
                                         watcher.get()));
    }

    void write_obj(const std::string &path, const Progress &progress = {}) const
    {
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_write_obj(get(), path.c_str(), watcher.get()));
    }

    void write_stl(const std::string &path, const Progress &progress = {}) const
    {
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_write_stl(get(), path.c_str(), watcher.get()));
    }

    // Keeps what a region holds. All else goes. Returns how many went. remove() is the opposite.
    std::size_t keep(const Region &region, const Pose &world_from_mesh = {}, const Progress &progress = {})
    {
        return select(region, 1, world_from_mesh, progress);
    }
    std::size_t remove(const Region &region, const Pose &world_from_mesh = {}, const Progress &progress = {})
    {
        return select(region, 0, world_from_mesh, progress);
    }
    // Gives another size and place: of true_size(), of ground().
    void transform(const Pose &similarity) { check(srf_mesh_transform(get(), &similarity)); }

    // The coordinate reference system of its coordinates: well-known text, or a code as EPSG:25832; empty for none.
    std::string crs() const
    {
        return detail::text_of([&](char *text, std::size_t capacity, std::size_t *length) {
            return srf_mesh_crs(get(), text, capacity, length);
        });
    }
    void set_crs(const std::string &text) { check(srf_mesh_set_crs(get(), text.c_str())); }

private:
    std::size_t select(const Region &region, std::uint32_t keep, const Pose &world_from_mesh, const Progress &progress)
    {
        std::size_t removed = 0;
        detail::Watcher watcher(progress);
        watcher.check(srf_mesh_select(get(), &world_from_mesh, region.get(), keep, watcher.get(), &removed));
        return removed;
    }
};

// A photo whose camera is known.
class Photo : public detail::Handle<srf_photo, srf_photo_free> {
public:
    using Handle::Handle;

    // Three numbers a pixel, or four of which the last is passed over, row after row. The pixels are copied.
    template <std::size_t N>
    static Photo create(std::size_t rows, std::size_t cols, const srf_projection &camera, View<std::uint8_t, N> pixels,
                        const Pose &world_from_camera, const std::string &name)
    {
        return make(rows, cols, camera, pixels.array(), world_from_camera, name, 0, 0, nullptr);
    }

    // With depths along the axis of the camera, of an image of its own size.
    template <std::size_t N, typename Real>
    static Photo create(std::size_t rows, std::size_t cols, const srf_projection &camera, View<std::uint8_t, N> pixels,
                        const Pose &world_from_camera, const std::string &name, std::size_t depth_rows, std::size_t depth_cols,
                        View<Real> depths)
    {
        const srf_array array = depths.array();
        return make(rows, cols, camera, pixels.array(), world_from_camera, name, depth_rows, depth_cols, &array);
    }

private:
    static Photo make(std::size_t rows, std::size_t cols, const srf_projection &camera, const srf_array &pixels,
                      const Pose &world_from_camera, const std::string &name, std::size_t depth_rows, std::size_t depth_cols,
                      const srf_array *depths)
    {
        srf_photo *photo = nullptr;
        check(srf_photo_create(rows, cols, &camera, &pixels, &world_from_camera, name.c_str(), depth_rows, depth_cols, depths, &photo));
        return Photo(photo);
    }
};

// The images of a mesh, in square tiles of one size.
class Textures : public detail::Handle<srf_textures, srf_textures_free> {
public:
    using Handle::Handle;

    // Columns and rows of a tile, and the number of tiles.
    std::pair<std::size_t, std::size_t> size() const
    {
        std::pair<std::size_t, std::size_t> found;
        check(srf_textures_size(get(), &found.first, &found.second));
        return found;
    }

    // Images of a tile, row after row from the top. Those that were not asked for are empty.
    View<std::uint8_t, 3> colour(std::size_t tile = 0) const { return view<std::uint8_t, 3>(tile, SRF_TEXTURE_MAP_COLOUR); }
    View<std::uint8_t> mask(std::size_t tile = 0) const { return view<std::uint8_t, 1>(tile, SRF_TEXTURE_MAP_MASK); }
    View<std::uint8_t, 3> normal(std::size_t tile = 0) const { return view<std::uint8_t, 3>(tile, SRF_TEXTURE_MAP_NORMAL); }
    View<std::uint16_t> height(std::size_t tile = 0) const { return view<std::uint16_t, 1>(tile, SRF_TEXTURE_MAP_HEIGHT); }
    View<std::uint8_t> occlusion(std::size_t tile = 0) const { return view<std::uint8_t, 1>(tile, SRF_TEXTURE_MAP_OCCLUSION); }

    // Of a photo, in the order in which they were given: the pose of its camera as it was used, its figures, and why nothing was taken
    // of it, which is empty if it was used.
    Pose pose(std::size_t photo) const
    {
        Pose pose;
        check(srf_textures_pose(get(), photo, &pose));
        return pose;
    }
    TexturedPhoto photo(std::size_t photo) const
    {
        TexturedPhoto found;
        check(srf_textures_photo(get(), photo, &found));
        return found;
    }
    std::string reason(std::size_t photo) const
    {
        const char *reason = nullptr;
        check(srf_textures_reason(get(), photo, &reason));
        return reason;
    }

private:
    template <typename T, std::size_t N>
    View<T, N> view(std::size_t tile, srf_texture_map map) const
    {
        srf_array image{};
        check(srf_textures_image(get(), tile, map, &image));
        return View<T, N>(image);
    }
};

inline Textures Mesh::textured(const Mesh &detail, const std::vector<const Photo *> &photos, const TextureParams &params,
                               TextureReport *report, const Progress &progress) const
{
    std::vector<const srf_photo *> handles;
    for (const Photo *photo : photos) handles.push_back(photo->get());
    srf_textures *textures = nullptr;
    detail::Watcher watcher(progress);
    watcher.check(srf_mesh_texture(get(), detail.get(), handles.data(), handles.size(), &params, watcher.get(), &textures, report));
    return Textures(textures);
}

// Refuses, before the work that a mesh takes, a file's name or options that Mesh::write() will refuse. No file is looked at.
inline void check_mesh_file(const std::string &path, const WriteOptions &options = {})
{
    check(srf_check_mesh_file(path.c_str(), &options));
}

// Writes a mesh and coarser ones of the same surface, finest first, as binary glTF with levels of detail. The name as for
// Mesh::write_glb().
inline void write_glb_levels(const std::vector<const Mesh *> &meshes, const std::string &path, double metres_per_unit,
                             bool z_up = false, const Progress &progress = {}, const std::string &name = {})
{
    std::vector<const srf_mesh *> handles;
    for (const Mesh *mesh : meshes) handles.push_back(mesh->get());
    detail::Watcher watcher(progress);
    watcher.check(srf_meshes_write_glb_levels(handles.data(), handles.size(), path.c_str(), name.empty() ? nullptr : name.c_str(),
                                              metres_per_unit, z_up ? 1 : 0, watcher.get()));
}

// Scattered points.
class Cloud : public detail::Handle<srf_cloud, srf_cloud_free> {
public:
    using Handle::Handle;

    // Normals, colours and intensities may be empty.
    template <typename Real>
    static Cloud create(View<Real, 3> positions, View<float, 3> normals = {}, View<std::uint8_t, 4> colours = {},
                        const Pose &world_from_cloud = {}, View<float> intensities = {})
    {
        const srf_array array = positions.array(), towards = normals.array(), painted = colours.array(), strengths = intensities.array();
        srf_cloud *cloud = nullptr;
        check(srf_cloud_create(&array, normals.empty() ? nullptr : &towards, colours.empty() ? nullptr : &painted,
                               intensities.empty() ? nullptr : &strengths, &world_from_cloud, &cloud));
        return Cloud(cloud);
    }

    View<double, 3> positions() const
    {
        srf_array view{};
        check(srf_cloud_arrays(get(), &view, nullptr, nullptr, nullptr));
        return View<double, 3>(view);
    }

    // The box around the points in the world.
    Bounds bounds(const Progress &progress = {}) const
    {
        Bounds bounds;
        detail::Watcher watcher(progress);
        watcher.check(srf_cloud_bounds(get(), watcher.get(), bounds.min.data(), bounds.max.data()));
        return bounds;
    }

    // Three coordinates a point, in its own frame, in single precision, relative to an origin.
    std::vector<float> positions_f32(const std::array<double, 3> &origin = {}, const Progress &progress = {}) const
    {
        std::vector<float> near(3 * positions().size());
        detail::Watcher watcher(progress);
        watcher.check(srf_cloud_positions_f32(get(), origin.data(), near.data(), near.size(), watcher.get()));
        return near;
    }

    // A mesh of well-shaped triangles on the surface through the points; its figures go to `report`, if given.
    Mesh clustered(const ClusterParams &params = {}, ClusterReport *report = nullptr, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_cloud_cluster(get(), &params, watcher.get(), &mesh, report));
        return Mesh(mesh);
    }

    // The same as a chain of levels of detail, one for each number of vertices.
    std::vector<Mesh> clustered(const std::vector<std::uint64_t> &vertices, const ClusterParams &params = {},
                                const Progress &progress = {}) const
    {
        if (vertices.empty()) return {};
        std::vector<srf_mesh *> handles(vertices.size(), nullptr);
        detail::Watcher watcher(progress);
        watcher.check(srf_cloud_cluster_levels(get(), vertices.data(), vertices.size(), &params, watcher.get(), handles.data()));
        std::vector<Mesh> levels;
        for (srf_mesh *handle : handles) levels.emplace_back(handle);
        return levels;
    }

    View<float, 3> normals() const
    {
        srf_array view{};
        check(srf_cloud_arrays(get(), nullptr, &view, nullptr, nullptr));
        return View<float, 3>(view);
    }

    View<std::uint8_t, 4> colours() const
    {
        srf_array view{};
        check(srf_cloud_arrays(get(), nullptr, nullptr, &view, nullptr));
        return View<std::uint8_t, 4>(view);
    }

    View<float> intensities() const
    {
        srf_array view{};
        check(srf_cloud_arrays(get(), nullptr, nullptr, nullptr, &view));
        return View<float>(view);
    }

    // The place that all points were seen from, in its own frame. Three NaN where that is not known.
    std::array<double, 3> sensor() const
    {
        std::array<double, 3> place{};
        check(srf_cloud_sensor(get(), place.data()));
        return place;
    }

    Pose pose() const
    {
        Pose pose;
        check(srf_cloud_pose(get(), &pose));
        return pose;
    }

    void write_ply(const std::string &path, srf_encoding encoding = SRF_ENCODING_BINARY, const Progress &progress = {}) const
    {
        detail::Watcher watcher(progress);
        watcher.check(srf_cloud_write_ply(get(), path.c_str(), encoding, watcher.get()));
    }

    // Keeps what a region holds. All else goes. Returns how many went. remove() is the opposite.
    std::size_t keep(const Region &region, const Progress &progress = {}) { return select(region, 1, progress); }
    std::size_t remove(const Region &region, const Progress &progress = {}) { return select(region, 0, progress); }
    // Gives another size and place: of true_size(), of ground().
    void transform(const Pose &similarity) { check(srf_cloud_transform(get(), &similarity)); }

    // The coordinate reference system of the world that it lies in: well-known text, or a code as EPSG:25832; empty for none.
    std::string crs() const
    {
        return detail::text_of([&](char *text, std::size_t capacity, std::size_t *length) {
            return srf_cloud_crs(get(), text, capacity, length);
        });
    }
    void set_crs(const std::string &text) { check(srf_cloud_set_crs(get(), text.c_str())); }

private:
    std::size_t select(const Region &region, std::uint32_t keep, const Progress &progress)
    {
        std::size_t removed = 0;
        detail::Watcher watcher(progress);
        watcher.check(srf_cloud_select(get(), region.get(), keep, watcher.get(), &removed));
        return removed;
    }
};

// A range image.
class Image : public detail::Handle<srf_image, srf_image_free> {
public:
    using Handle::Handle;

    // One value a pixel, row after row.
    template <typename Real>
    static Image create(std::size_t rows, std::size_t cols, const srf_projection &projection, View<Real> values,
                        const Pose &world_from_sensor = {}, const std::string &name = {})
    {
        return make(rows, cols, projection, values.array(), world_from_sensor, name);
    }

    // One point a pixel, row after row.
    template <typename Real>
    static Image create(std::size_t rows, std::size_t cols, const srf_projection &projection, View<Real, 3> points,
                        const Pose &world_from_sensor = {}, const std::string &name = {})
    {
        return make(rows, cols, projection, points.array(), world_from_sensor, name);
    }

    // Of a frame: depths, and colours of 3 or 4 numbers and confidences where there are any. What was left out goes to `left_out`, if
    // given.
    template <typename Depth, std::size_t N = 3>
    static Image from_frame(const Frame &frame, View<Depth> depths, View<std::uint8_t, N> colours = {}, View<std::uint8_t> confidences = {},
                            const Pose &world_from_sensor = {}, const std::string &name = {}, LeftOutReport *left_out = nullptr,
                            const Progress &progress = {})
    {
        const srf_array array = depths.array(), painted = colours.array(), trusted = confidences.array();
        srf_image *image = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_image_from_frame(&frame, &array, colours.empty() ? nullptr : &painted, confidences.empty() ? nullptr : &trusted,
                                           &world_from_sensor, name.c_str(), watcher.get(), &image, left_out));
        return Image(image);
    }

    // Of a host's vertices, however its user moved them: an entry each of row, col and positions, and of colours, intensities and
    // confidences where there are any; see srf_image_from_vertices().
    template <typename Place, typename Real>
    static Image from_vertices(const GridCamera &camera, View<Place> row, View<Place> col, View<Real, 3> positions,
                               View<std::uint8_t, 4> colours = {}, View<float> intensities = {}, View<float> confidences = {},
                               const Pose &world_from_host = {}, const std::string &name = {}, const Progress &progress = {})
    {
        const srf_array rows = row.array(), cols = col.array(), points = positions.array();
        const srf_array painted = colours.array(), strengths = intensities.array(), trusted = confidences.array();
        srf_image *image = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_image_from_vertices(&camera, &rows, &cols, &points, colours.empty() ? nullptr : &painted,
                                              intensities.empty() ? nullptr : &strengths, confidences.empty() ? nullptr : &trusted,
                                              &world_from_host, name.c_str(), watcher.get(), &image));
        return Image(image);
    }

    // Scans a mesh virtually.
    static Image scan(const Mesh &mesh, std::size_t rows, std::size_t cols, const srf_projection &projection,
                      const Pose &world_from_sensor, const ScanParams &params = {}, const Progress &progress = {})
    {
        srf_image *image = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_scan_mesh(mesh.get(), rows, cols, &projection, &world_from_sensor, &params, watcher.get(), &image));
        return Image(image);
    }

    std::size_t rows() const { return size()[0]; }
    std::size_t cols() const { return size()[1]; }
    // Number of valid pixels.
    std::size_t valid() const { return size()[2]; }

    std::string name() const
    {
        const char *name = nullptr;
        check(srf_image_name(get(), &name));
        return name;
    }

    srf_projection projection() const
    {
        srf_projection projection{};
        check(srf_image_camera(get(), &projection, nullptr));
        return projection;
    }

    Pose pose() const
    {
        Pose pose;
        check(srf_image_camera(get(), nullptr, &pose));
        return pose;
    }

    // The place where its rays start, in the world. Three NaN where they are parallel.
    std::array<double, 3> sensor() const
    {
        std::array<double, 3> place{};
        check(srf_image_sensor(get(), place.data()));
        return place;
    }

    void set_pose(const Pose &world_from_sensor) { check(srf_image_set_pose(get(), &world_from_sensor)); }
    void set_name(const std::string &name) { check(srf_image_set_name(get(), name.c_str())); }

    // A value a pixel, row after row, NaN for an invalid one; throws for an image of points.
    View<double> values() const { return View<double>(samples()); }
    // A point a pixel in the sensor's frame, NaN for an invalid one; throws for an image of values.
    View<float, 3> points() const { return View<float, 3>(samples()); }

    // The ray of a pixel, in the sensor's frame.
    struct Ray {
        std::array<double, 3> origin, direction;
    };
    Ray ray(std::size_t row, std::size_t col) const
    {
        Ray ray{};
        check(srf_image_ray(get(), row, col, ray.origin.data(), ray.direction.data()));
        return ray;
    }

    // Attributes that pixels have besides their samples, an entry each. Empty where the image has none.
    View<std::uint8_t, 4> colours() const
    {
        srf_array view{};
        check(srf_image_attributes(get(), &view, nullptr, nullptr));
        return View<std::uint8_t, 4>(view);
    }
    View<float> intensities() const
    {
        srf_array view{};
        check(srf_image_attributes(get(), nullptr, &view, nullptr));
        return View<float>(view);
    }
    View<float> confidences() const
    {
        srf_array view{};
        check(srf_image_attributes(get(), nullptr, nullptr, &view));
        return View<float>(view);
    }
    // In place of what was there; what is empty is removed. Views of the image are gone.
    void set_attributes(View<std::uint8_t, 4> colours, View<float> intensities = {}, View<float> confidences = {})
    {
        const srf_array painted = colours.array(), strengths = intensities.array(), trusted = confidences.array();
        check(srf_image_set_attributes(get(), colours.empty() ? nullptr : &painted, intensities.empty() ? nullptr : &strengths,
                                       confidences.empty() ? nullptr : &trusted));
    }

    // Three doubles a pixel, NaN for an invalid one.
    std::vector<double> world_points(const Progress &progress = {}) const
    {
        const auto [rows, cols, valid] = size();
        std::vector<double> points(3 * rows * cols);
        detail::Watcher watcher(progress);
        watcher.check(srf_image_world_points(get(), points.data(), points.size(), watcher.get()));
        return points;
    }

    Mesh triangulate(const TriangulateParams &params = {}, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_image_triangulate(get(), &params, watcher.get(), &mesh));
        return Mesh(mesh);
    }

    // The valid pixels as vertices, row after row, in the sensor's frame, with or without faces: how a host keeps a range image.
    Mesh to_mesh(bool faces = true, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_image_to_mesh(get(), faces ? 1 : 0, watcher.get(), &mesh));
        return Mesh(mesh);
    }

    // The box around the samples in the world.
    Bounds bounds(const Progress &progress = {}) const
    {
        Bounds bounds;
        detail::Watcher watcher(progress);
        watcher.check(srf_image_bounds(get(), watcher.get(), bounds.min.data(), bounds.max.data()));
        return bounds;
    }

    // The data that a host keeps beside the vertices of to_mesh().
    GridCamera grid_camera(const Progress &progress = {}) const
    {
        GridCamera camera;
        detail::Watcher watcher(progress);
        watcher.check(srf_image_grid_camera(get(), watcher.get(), &camera));
        return camera;
    }

    Cloud to_cloud(const Progress &progress = {}) const
    {
        srf_cloud *cloud = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_image_to_cloud(get(), watcher.get(), &cloud));
        return Cloud(cloud);
    }

    // Keeps what a region holds. All else goes. Returns how many went. remove() is the opposite.
    std::size_t keep(const Region &region, const Progress &progress = {}) { return select(region, 1, progress); }
    std::size_t remove(const Region &region, const Progress &progress = {}) { return select(region, 0, progress); }
    // Gives another size and place: of true_size(), of ground().
    void transform(const Pose &similarity) { check(srf_image_transform(get(), &similarity)); }

    // The coordinate reference system of the world that it lies in: well-known text, or a code as EPSG:25832; empty for none.
    std::string crs() const
    {
        return detail::text_of([&](char *text, std::size_t capacity, std::size_t *length) {
            return srf_image_crs(get(), text, capacity, length);
        });
    }
    void set_crs(const std::string &text) { check(srf_image_set_crs(get(), text.c_str())); }

private:
    srf_array samples() const
    {
        srf_array view{};
        check(srf_image_samples(get(), &view));
        return view;
    }

    std::size_t select(const Region &region, std::uint32_t keep, const Progress &progress)
    {
        std::size_t removed = 0;
        detail::Watcher watcher(progress);
        watcher.check(srf_image_select(get(), region.get(), keep, watcher.get(), &removed));
        return removed;
    }

    static Image make(std::size_t rows, std::size_t cols, const srf_projection &projection, const srf_array &samples,
                      const Pose &world_from_sensor, const std::string &name)
    {
        srf_image *image = nullptr;
        check(srf_image_create(rows, cols, &projection, &samples, &world_from_sensor, name.c_str(), &image));
        return Image(image);
    }

    std::array<std::size_t, 3> size() const
    {
        std::array<std::size_t, 3> size{};
        check(srf_image_size(get(), &size[0], &size[1], &size[2]));
        return size;
    }
};

// Makes the range image of a scan whenever it is needed, the same each time: called on other threads too, several at once; see
// srf_image_fn. May throw.
using ImageFunction = std::function<Image()>;

namespace detail {

// The functions of C++ that make images for a handle, and what the first of them threw past the C library.
class Sources {
public:
    // Adds one by `add`, which is handed what the C library takes.
    template <typename Add>
    void add(ImageFunction function, Add add)
    {
        if (!thrown_) thrown_ = std::make_unique<Thrown>();
        makers_.push_back(std::make_unique<Maker>(Maker{std::move(function), thrown_.get()}));
        const srf_image_source source{&Sources::make, makers_.back().get()};
        const srf_status status = add(&source);
        if (status != SRF_OK) makers_.pop_back();
        surfrecon::check(status);
    }

    void check(const Watcher &watcher, srf_status status) const
    {
        const std::unique_ptr<std::exception_ptr> thrown(thrown_ ? thrown_->first.exchange(nullptr) : nullptr);
        if (status != SRF_OK && thrown) std::rethrow_exception(*thrown);
        watcher.check(status);
    }

private:
    // No mutex: not every compiler for Windows has one.
    struct Thrown {
        std::atomic<std::exception_ptr *> first{nullptr};

        ~Thrown() { delete first.load(); }
    };
    struct Maker {
        ImageFunction function;
        Thrown *thrown;
    };

    static std::int32_t make(void *user, srf_image **out_image)
    {
        auto &maker = *static_cast<Maker *>(user);
        try {
            *out_image = maker.function().release();
            return SRF_OK;
        } catch (...) {
            auto *const thrown = new (std::nothrow) std::exception_ptr(std::current_exception());
            std::exception_ptr *none = nullptr;
            if (!maker.thrown->first.compare_exchange_strong(none, thrown)) delete thrown;
            return SRF_ERR_INPUT;
        }
    }

    // The C library has their addresses.
    std::vector<std::unique_ptr<Maker>> makers_;
    std::unique_ptr<Thrown> thrown_;
};

inline std::vector<const srf_image *> handles(const std::vector<const Image *> &images)
{
    std::vector<const srf_image *> handles;
    for (const Image *image : images) handles.push_back(image->get());
    return handles;
}

}  // namespace detail

// Writes images as range grids beside the list (.conf) that places them.
inline void write_conf(const std::vector<const Image *> &images, const std::string &path, srf_encoding encoding = SRF_ENCODING_BINARY,
                       const Progress &progress = {})
{
    const auto handles = detail::handles(images);
    detail::Watcher watcher(progress);
    watcher.check(srf_images_write_conf(handles.data(), handles.size(), path.c_str(), encoding, watcher.get()));
}

// Writes images as one PTX file.
inline void write_ptx(const std::vector<const Image *> &images, const std::string &path, const Progress &progress = {})
{
    const auto handles = detail::handles(images);
    detail::Watcher watcher(progress);
    watcher.check(srf_images_write_ptx(handles.data(), handles.size(), path.c_str(), watcher.get()));
}

// Writes images as one E57 file.
inline void write_e57(const std::vector<const Image *> &images, const std::string &path, const Progress &progress = {})
{
    const auto handles = detail::handles(images);
    detail::Watcher watcher(progress);
    watcher.check(srf_images_write_e57(handles.data(), handles.size(), path.c_str(), watcher.get()));
}

// And says in the file where it is from: an object in JSON.
inline void write_e57_from(const std::vector<const Image *> &images, const std::string &path, const std::string &provenance,
                           const Progress &progress = {})
{
    const auto handles = detail::handles(images);
    detail::Watcher watcher(progress);
    watcher.check(srf_images_write_e57_from(handles.data(), handles.size(), path.c_str(), provenance.c_str(), watcher.get()));
}

// The provenance in a file that this library wrote: an object in JSON, or empty.
inline std::string file_provenance(const std::string &path)
{
    return detail::text_of([&](char *text, std::size_t capacity, std::size_t *length) {
        return srf_file_provenance(path.c_str(), text, capacity, length);
    });
}

// A range image ready to be sculpted to one tolerance after the other.
class Sculptor : public detail::Handle<srf_sculptor, srf_sculptor_free> {
public:
    explicit Sculptor(const Image &image, const SculptParams &params = {}, const Progress &progress = {})
        : Handle(make(image, params, progress))
    {
    }

    struct Result {
        Mesh mesh;
        SculptReport report;
    };

    // The mesh of few triangles within a tolerance, by default that of the params.
    Result refine(double tolerance = SRF_FROM_DATA, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        SculptReport report;
        detail::Watcher watcher(progress);
        watcher.check(srf_sculptor_refine(get(), tolerance, watcher.get(), &mesh, &report));
        return Result{Mesh(mesh), report};
    }

    // The mesh of the smallest tolerance found that has at most so many triangles.
    Result at_most(std::size_t max_triangles, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        SculptReport report;
        detail::Watcher watcher(progress);
        watcher.check(srf_sculptor_at_most(get(), max_triangles, watcher.get(), &mesh, &report));
        return Result{Mesh(mesh), report};
    }

private:
    static srf_sculptor *make(const Image &image, const SculptParams &params, const Progress &progress)
    {
        srf_sculptor *sculptor = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_sculptor_create(image.get(), &params, watcher.get(), &sculptor));
        return sculptor;
    }
};

// Scattered points from which surfaces are made with one set of parameters after the other.
class Reconstructor : public detail::Handle<srf_reconstructor, srf_reconstructor_free> {
public:
    explicit Reconstructor(const Cloud &cloud) : Handle(make(cloud, nullptr)), points_(cloud.positions().size()) {}
    // Places that the points were seen from, in the cloud's frame, instead of its own sensor: one, or one a point.
    template <typename Real>
    Reconstructor(const Cloud &cloud, View<Real, 3> sensors) : points_(cloud.positions().size())
    {
        const srf_array places = sensors.array();
        static_cast<Handle &>(*this) = Handle(make(cloud, &places));
    }

    struct Result {
        Mesh mesh;
        ReconstructReport report;
    };

    // Of each point a value of srf_dropped, why it is not on the surface, goes to `dropped`, if given.
    Result surface(const ReconstructParams &params = {}, const Progress &progress = {},
                   std::vector<std::uint8_t> *dropped = nullptr) const
    {
        srf_mesh *mesh = nullptr;
        ReconstructReport report;
        if (dropped != nullptr) dropped->assign(points_, SRF_DROPPED_USED);
        detail::Watcher watcher(progress);
        watcher.check(srf_reconstructor_surface(get(), &params, watcher.get(), &mesh, &report,
                                                dropped != nullptr ? dropped->data() : nullptr));
        return Result{Mesh(mesh), report};
    }

private:
    static srf_reconstructor *make(const Cloud &cloud, const srf_array *sensors)
    {
        srf_reconstructor *reconstructor = nullptr;
        check(srf_reconstructor_create(cloud.get(), sensors, &reconstructor));
        return reconstructor;
    }

    std::size_t points_;
};


// A B-spline surface over 0..1 x 0..1; made by Quads::spline().
class Spline : public detail::Handle<srf_spline, srf_spline_free> {
public:
    using Handle::Handle;

    std::size_t rows() const { return size().first; }
    std::size_t cols() const { return size().second; }

    // Control points, row after row.
    View<double, 3> control() const
    {
        srf_array view{};
        check(srf_spline_control(get(), nullptr, nullptr, &view));
        return View<double, 3>(view);
    }

    std::array<double, 3> point(double u, double v) const
    {
        std::array<double, 3> found{};
        check(srf_spline_point(get(), u, v, found.data()));
        return found;
    }

    // The surface at evenly spread parameters.
    Mesh sample(std::size_t rows, std::size_t cols) const
    {
        srf_mesh *mesh = nullptr;
        check(srf_spline_sample(get(), rows, cols, &mesh));
        return Mesh(mesh);
    }

private:
    std::pair<std::size_t, std::size_t> size() const
    {
        std::pair<std::size_t, std::size_t> found;
        check(srf_spline_control(get(), &found.first, &found.second, nullptr));
        return found;
    }
};

// A regular grid of quads over a range image.
class Quads : public detail::Handle<srf_quads, srf_quads_free> {
public:
    using Handle::Handle;

    struct Result;
    static Result create(const Image &image, const QuadParams &params = {}, const Progress &progress = {});

    std::size_t rows() const { return size().first; }
    std::size_t cols() const { return size().second; }

    // All vertices, row after row, and their pixels.
    View<double, 3> grid() const
    {
        srf_array view{};
        check(srf_quads_grid(get(), nullptr, nullptr, &view, nullptr, nullptr));
        return View<double, 3>(view);
    }

    View<std::uint32_t, 2> pixels() const
    {
        srf_array view{};
        check(srf_quads_grid(get(), nullptr, nullptr, nullptr, &view, nullptr));
        return View<std::uint32_t, 2>(view);
    }

    // Vertices, image coordinates and corners of the quads that are not on the background.
    View<double, 3> positions() const
    {
        srf_array view{};
        check(srf_quads_faces(get(), &view, nullptr, nullptr, nullptr));
        return View<double, 3>(view);
    }

    View<float, 2> uvs() const
    {
        srf_array view{};
        check(srf_quads_faces(get(), nullptr, &view, nullptr, nullptr));
        return View<float, 2>(view);
    }

    View<std::uint32_t, 4> corners() const
    {
        srf_array view{};
        check(srf_quads_faces(get(), nullptr, nullptr, &view, nullptr));
        return View<std::uint32_t, 4>(view);
    }

    // Two triangles a quad.
    Mesh triangles() const
    {
        srf_mesh *mesh = nullptr;
        check(srf_quads_triangles(get(), &mesh));
        return Mesh(mesh);
    }

    // A surface through the vertices, or near them with fewer control points.
    Spline spline(const SplineParams &params = {}, const Progress &progress = {}) const
    {
        srf_spline *spline = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_spline_create(get(), &params, watcher.get(), &spline, nullptr, nullptr));
        return Spline(spline);
    }

    void write_obj(const std::string &path, const Progress &progress = {}) const
    {
        detail::Watcher watcher(progress);
        watcher.check(srf_quads_write_obj(get(), path.c_str(), watcher.get()));
    }

private:
    std::pair<std::size_t, std::size_t> size() const
    {
        std::pair<std::size_t, std::size_t> found;
        check(srf_quads_grid(get(), &found.first, &found.second, nullptr, nullptr, nullptr));
        return found;
    }
};

struct Quads::Result {
    Quads quads;
    QuadReport report;
};

inline Quads::Result Quads::create(const Image &image, const QuadParams &params, const Progress &progress)
{
    srf_quads *quads = nullptr;
    QuadReport report;
    detail::Watcher watcher(progress);
    watcher.check(srf_quads_create(image.get(), &params, watcher.get(), &quads, &report));
    return Result{Quads(quads), report};
}

// A kind of files that can be read: its name for people, the usual endings of names without the dot, and whether such files
// list, place or describe scans of other files and hold none.
struct Format {
    std::string name;
    std::vector<std::string> endings;
    bool is_side_file = false;
};

// All that Scans::open() knows.
inline std::vector<Format> formats()
{
    std::size_t count = 0;
    check(srf_format_count(&count));
    std::vector<Format> all(count);
    for (std::size_t i = 0; i < count; ++i) {
        const char *name = nullptr;
        const char *endings = nullptr;
        std::uint32_t is_side_file = 0;
        check(srf_format(i, &name, &endings, &is_side_file));
        all[i].name = name;
        all[i].is_side_file = is_side_file == 1;
        std::istringstream words(endings);
        for (std::string ending; words >> ending;) all[i].endings.push_back(ending);
    }
    return all;
}

// Reads bytes of a file from a place on into a buffer for `count` of them; how many, at least 1. Called on any thread, for a file never on
// two at once. What it throws is what the call that reads throws, as an Error with its text.
using ReadFunction = std::function<std::size_t(std::uint64_t at, void *buffer, std::size_t count)>;

// Takes the next bytes of a file of a folder, or nullptr: the file is complete. Else as ReadFunction.
using WriteFunction = std::function<void(const char *name, const void *bytes, std::size_t count)>;

// Files in memory, or behind functions: their paths are taken by whatever takes the path of a file.
class Folder : public detail::Handle<srf_folder, srf_folder_free> {
public:
    Folder() : Handle(make(nullptr)) {}
    // Hands what is written to the function, and keeps nothing.
    explicit Folder(WriteFunction write) : Handle(make(std::move(write))) {}

    // Of the folder itself; it opens as one of the disk does.
    std::string path() const { return path_of(nullptr); }
    // Of a file in it, whether it is there or not.
    std::string path(const std::string &name) const { return path_of(name.c_str()); }

    // A copy of the bytes.
    void put(const std::string &name, const void *bytes, std::size_t count)
    {
        check(srf_folder_put(get(), name.c_str(), bytes, count));
    }

    // A file whose bytes are asked for when they are read.
    void put(const std::string &name, std::uint64_t length, ReadFunction read)
    {
        auto user = std::make_unique<ReadFunction>(std::move(read));
        const srf_file_source source{length, &Folder::read, &Folder::release<ReadFunction>, user.get()};
        check(srf_folder_put_source(get(), name.c_str(), &source));
        static_cast<void>(user.release());
    }

    // The bytes that were written or put into a file. They stay until it is asked for again or removed, or this ends.
    View<std::uint8_t> bytes(const std::string &name) const
    {
        const void *bytes = nullptr;
        std::size_t count = 0;
        check(srf_folder_bytes(get(), name.c_str(), &bytes, &count));
        return View<std::uint8_t>(static_cast<const std::uint8_t *>(bytes), count);
    }

    // Whether it was there.
    bool remove(const std::string &name)
    {
        std::uint32_t removed = 0;
        check(srf_folder_remove(get(), name.c_str(), &removed));
        return removed == 1;
    }

    std::vector<std::string> names() const
    {
        std::size_t count = 0;
        check(srf_folder_count(get(), &count));
        std::vector<std::string> names;
        for (std::size_t i = 0; i < count; ++i) {
            const char *name = nullptr;
            check(srf_folder_name(get(), i, &name));
            names.emplace_back(name);
        }
        return names;
    }

private:
    static srf_folder *make(WriteFunction write)
    {
        srf_folder *folder = nullptr;
        if (!write) {
            check(srf_folder_create(nullptr, &folder));
            return folder;
        }
        auto user = std::make_unique<WriteFunction>(std::move(write));
        const srf_file_sink sink{&Folder::write, &Folder::release<WriteFunction>, user.get()};
        check(srf_folder_create(&sink, &folder));
        static_cast<void>(user.release());
        return folder;
    }

    std::string path_of(const char *name) const
    {
        const char *path = nullptr;
        check(srf_folder_path(get(), name, &path));
        return path;
    }

    // Its status, with the text of what it throws.
    template <typename Call>
    static std::int32_t answer(Call call) noexcept
    {
        try {
            call();
            return SRF_OK;
        } catch (const std::bad_alloc &) {
            return SRF_ERR_OUT_OF_MEMORY;
        } catch (const std::exception &thrown) {
            srf_set_last_error(thrown.what());
        } catch (...) {
            srf_set_last_error("the function threw what is no exception of the standard library");
        }
        return SRF_ERR_IO;
    }

    static std::int32_t read(void *user, std::uint64_t at, void *buffer, std::size_t count, std::size_t *out_count)
    {
        return answer([&] { *out_count = (*static_cast<ReadFunction *>(user))(at, buffer, count); });
    }

    static std::int32_t write(void *user, const char *name, const void *bytes, std::size_t count)
    {
        return answer([&] { (*static_cast<WriteFunction *>(user))(name, bytes, count); });
    }

    template <typename Function>
    static void release(void *user)
    {
        delete static_cast<Function *>(user);
    }
};

// Scans of files, opened and not read.
class Scans : public detail::Handle<srf_scans, srf_scans_free> {
public:
    using Handle::Handle;

    static Scans open(const std::vector<std::string> &paths, const ReadOptions &options = {}, const Progress &progress = {})
    {
        std::vector<const char *> pointers;
        for (const std::string &path : paths) pointers.push_back(path.c_str());
        srf_scans *scans = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_scans_open(pointers.data(), pointers.size(), &options, watcher.get(), &scans));
        return Scans(scans);
    }

    std::size_t size() const
    {
        std::size_t count = 0;
        check(srf_scans_count(get(), &count, nullptr));
        return count;
    }

    std::string name(std::size_t index) const
    {
        const char *name = nullptr;
        check(srf_scans_describe(get(), index, &name, nullptr));
        return name;
    }

    Pose pose(std::size_t index) const
    {
        Pose pose;
        check(srf_scans_describe(get(), index, nullptr, &pose));
        return pose;
    }

    // Places a scan, whatever its file says: where an alignment found it, for example. Add it to a merger afterwards.
    void set_pose(std::size_t index, const Pose &world_from_sensor)
    {
        check(srf_scans_set_pose(get(), index, &world_from_sensor));
    }

    // Whether it is a frame of a recording, of which there may be thousands.
    bool is_frame(std::size_t index) const
    {
        std::uint32_t is_frame = 0;
        check(srf_scans_is_frame(get(), index, &is_frame));
        return is_frame == 1;
    }

    // How the files were understood.
    std::vector<std::string> notes() const
    {
        std::size_t count = 0;
        check(srf_scans_count(get(), nullptr, &count));
        std::vector<std::string> notes;
        for (std::size_t i = 0; i < count; ++i) {
            const char *note = nullptr;
            check(srf_scans_note(get(), i, &note));
            notes.emplace_back(note);
        }
        return notes;
    }

    // Keeps what a region holds of all scans, whenever they are read, merged or aligned. All else goes. remove() is the opposite.
    void keep(const Region &region) { check(srf_scans_select(get(), SIZE_MAX, region.get(), 1)); }
    void remove(const Region &region) { check(srf_scans_select(get(), SIZE_MAX, region.get(), 0)); }
    // Of one scan, with a mask for example.
    void keep(std::size_t index, const Region &region) { check(srf_scans_select(get(), index, region.get(), 1)); }
    void remove(std::size_t index, const Region &region) { check(srf_scans_select(get(), index, region.get(), 0)); }
    // Gives all another size and place: poses now, samples whenever they are read.
    void transform(const Pose &similarity) { check(srf_scans_transform(get(), &similarity)); }

    // The coordinate reference system of a scan's world, or what all scans that name one agree on: well-known text, or a code as
    // EPSG:25832; empty for none.
    std::string crs(std::size_t index = SIZE_MAX) const
    {
        return detail::text_of([&](char *text, std::size_t capacity, std::size_t *length) {
            return srf_scans_crs(get(), index, text, capacity, length);
        });
    }
    // Of one scan, or of all, whatever their files name.
    void set_crs(const std::string &text, std::size_t index = SIZE_MAX) { check(srf_scans_set_crs(get(), index, text.c_str())); }

    // The content of a scan. One of the three is there.
    struct Content {
        Image image;
        Mesh mesh;
        Cloud cloud;
    };

    Content read(std::size_t index, const Progress &progress = {}) const
    {
        std::uint32_t content = 0;
        srf_image *image = nullptr;
        srf_mesh *mesh = nullptr;
        srf_cloud *cloud = nullptr;
        detail::Watcher watcher(progress);
        watcher.check(srf_scans_read(get(), index, watcher.get(), &content, &image, &mesh, &cloud));
        return Content{Image(image), Mesh(mesh), Cloud(cloud)};
    }
};

// The result of an alignment. Scans have the numbers in which they were added.
class Alignment : public detail::Handle<srf_alignment, srf_alignment_free> {
public:
    using Handle::Handle;

    AlignReport report() const
    {
        AlignReport report;
        check(srf_alignment_report(get(), &report));
        return report;
    }

    AlignedScan scan(std::size_t index) const
    {
        AlignedScan scan;
        check(srf_alignment_scan(get(), index, &scan));
        return scan;
    }

    AlignedPair pair(std::size_t index) const
    {
        AlignedPair pair;
        check(srf_alignment_pair(get(), index, &pair));
        return pair;
    }

    // The turntable, where there was one and it was found.
    std::optional<Turntable> turntable() const
    {
        std::uint32_t found = 0;
        Turntable table;
        srf_array angles{};
        check(srf_alignment_turntable(get(), &found, table.axis.point.data(), table.axis.direction.data(), &angles));
        if (found == 0) return std::nullopt;
        const View<double> view(angles);
        table.angles.assign(view.data(), view.data() + view.size());
        return table;
    }

    // Why a scan is not placed, and what to do; empty if it is.
    std::string reason(std::size_t scan) const
    {
        const char *reason = nullptr;
        check(srf_alignment_reason(get(), scan, &reason));
        return reason;
    }

    // Notes that a person should know, a sentence each.
    std::vector<std::string> messages() const { return texts(srf_alignment_message, report().messages_count); }
    // The whole, each scan and the messages, for logs.
    std::vector<std::string> lines() const { return texts(srf_alignment_line, 1 + report().scans_count + report().messages_count); }

private:
    std::vector<std::string> texts(srf_status (*text)(const srf_alignment *, std::size_t, const char **), std::size_t count) const
    {
        std::vector<std::string> texts;
        for (std::size_t i = 0; i < count; ++i) {
            const char *found = nullptr;
            check(text(get(), i, &found));
            texts.emplace_back(found);
        }
        return texts;
    }
};

// An alignment being put together; scans are numbered from 0 in the order of adding. What it compares of them is kept from the first
// run(), snap() or misfit() until scans are added.
class Aligner : public detail::Handle<srf_aligner, srf_aligner_free> {
public:
    Aligner() : Handle(make()) {}

    void add(const Image &image) { check(srf_aligner_add_image(get(), image.get())); }
    void add(const Scans &scans) { check(srf_aligner_add_scans(get(), scans.get())); }
    void add(const Cloud &cloud, const std::string &name) { check(srf_aligner_add_cloud(get(), cloud.get(), name.c_str())); }
    // A scan whose image is made when it is needed, so that it need not stay in memory; the function is kept as long as this is.
    void add(ImageFunction make, const std::string &name, const Pose &world_from_sensor = {})
    {
        sources_.add(std::move(make), [&](const srf_image_source *source) {
            return srf_aligner_add_source(get(), source, &world_from_sensor, name.c_str());
        });
    }
    void add(const Mesh &mesh, const std::string &name, const Pose &world_from_mesh = {})
    {
        check(srf_aligner_add_mesh(get(), mesh.get(), &world_from_mesh, name.c_str()));
    }

    // The scan stays where it is.
    void fix(std::size_t scan) { check(srf_aligner_fix(get(), scan)); }
    void pick(const Pick &pick) { check(srf_aligner_pick(get(), &pick)); }
    // The scans touch, or must not be compared.
    void trust(std::size_t a, std::size_t b) { check(srf_aligner_trust(get(), a, b)); }
    void reject(std::size_t a, std::size_t b) { check(srf_aligner_reject(get(), a, b)); }
    // The object turned on a table, about that axis and by these angles, where they are known.
    void turn(const std::optional<Axis> &axis, const std::vector<double> &angles = {})
    {
        const double *point = axis ? axis->point.data() : nullptr;
        const double *direction = axis ? axis->direction.data() : nullptr;
        check(srf_aligner_turn(get(), point, direction, angles.data(), angles.size()));
    }

    // How many scans were added.
    std::size_t size() const
    {
        std::size_t count = 0;
        check(srf_aligner_count(get(), &count));
        return count;
    }

    // The plane that most samples lie on: a table, the ground.
    Plane dominant_plane(const PlaneParams &params = {}, const Progress &progress = {}) const
    {
        Plane plane;
        detail::Watcher watcher(progress);
        watcher.check(srf_dominant_plane(get(), &params, watcher.get(), &plane));
        return plane;
    }

    Alignment run(const AlignParams &params = {}, const Progress &progress = {}) const
    {
        srf_alignment *alignment = nullptr;
        detail::Watcher watcher(progress);
        sources_.check(watcher, srf_aligner_run(get(), &params, watcher.get(), &alignment));
        return Alignment(alignment);
    }

    // One scan drawn to the others. Poses: one a scan, srf_pose{} leaves it out; none at all for those of adding.
    Snap snap(std::size_t scan, const std::vector<srf_pose> &world_from_scan = {}, const AlignParams &params = {},
              const Progress &progress = {}) const
    {
        Snap snap;
        std::vector<std::uint8_t> touches(size());
        detail::Watcher watcher(progress);
        sources_.check(watcher, srf_aligner_snap(get(), scan, poses(world_from_scan), world_from_scan.size(), &params, watcher.get(),
                                                 &snap, touches.data()));
        for (std::size_t other = 0; other < touches.size(); ++other) {
            if (touches[other] == 1) snap.touched.push_back(other);
        }
        return snap;
    }

    // How far points of a scan, in its own frame, lie outside of the others; NaN where none is near. Poses as for snap().
    template <typename Real>
    std::vector<double> misfit(std::size_t scan, View<Real, 3> points, const std::vector<srf_pose> &world_from_scan = {},
                               const Progress &progress = {}) const
    {
        const srf_array array = points.array();
        std::vector<double> distances(points.size());
        detail::Watcher watcher(progress);
        sources_.check(watcher, srf_aligner_misfit(get(), scan, poses(world_from_scan), world_from_scan.size(), &array, watcher.get(),
                                                   distances.data()));
        return distances;
    }

private:
    static const srf_pose *poses(const std::vector<srf_pose> &given) { return given.empty() ? nullptr : given.data(); }

    static srf_aligner *make()
    {
        srf_aligner *aligner = nullptr;
        check(srf_aligner_create(&aligner));
        return aligner;
    }

    detail::Sources sources_;
};

// How a surface goes into a file, and where what memory does not hold is kept meanwhile.
struct IntoFile {
    // Most bytes that are taken; 0 for what is allowed or free.
    std::uint64_t max_memory = 0;
    // A folder that exists; empty for that of the file.
    std::string workspace;
    WriteOptions options;
    // An object in JSON that the file says of where it is from; empty for none.
    std::string provenance;
};

// The place in which a merge keeps what memory does not hold, and when it does.
struct InFiles {
    // Begins in memory, and anew in files where cells as given or measured do not fit there.
    bool only_if_needed = false;
    // Most bytes that are taken; 0 for what is allowed or free.
    std::uint64_t max_memory = 0;
    // A folder that exists; empty for the system's for temporary files.
    std::string workspace;
};

// A merge being put together.
class Merger : public detail::Handle<srf_merger, srf_merger_free> {
public:
    Merger() : Handle(make()) {}

    void add(const Image &image) { check(srf_merger_add_image(get(), image.get())); }
    void add(const Scans &scans) { check(srf_merger_add_scans(get(), scans.get())); }
    void add(const Scans &scans, std::size_t of_set) { check(srf_merger_add_scan(get(), scans.get(), of_set)); }
    // A scan whose image is made when it is needed, so that it need not stay in memory; the function is kept as long as this is.
    void add(ImageFunction make, const std::string &name, const Pose &world_from_sensor = {})
    {
        sources_.add(std::move(make), [&](const srf_image_source *source) {
            return srf_merger_add_source(get(), source, &world_from_sensor, name.c_str());
        });
    }
    void add(const Mesh &mesh, const std::string &name, const Pose &world_from_mesh = {})
    {
        check(srf_merger_add_mesh(get(), mesh.get(), &world_from_mesh, name.c_str()));
    }

    // Number of scans, counted from 0 in the order of adding; those after one that is removed move up.
    std::size_t size() const
    {
        std::size_t scans = 0;
        check(srf_merger_count(get(), &scans));
        return scans;
    }
    void remove(std::size_t index) { check(srf_merger_remove(get(), index)); }

    // Another scan in the place of one. A function that makes images is kept as long as this is, also when it is replaced.
    void replace(std::size_t index, const Image &image) { check(srf_merger_replace_by_image(get(), index, image.get())); }
    void replace(std::size_t index, const Scans &scans, std::size_t of_set)
    {
        check(srf_merger_replace_by_scan(get(), index, scans.get(), of_set));
    }
    void replace(std::size_t index, ImageFunction make, const std::string &name, const Pose &world_from_sensor = {})
    {
        sources_.add(std::move(make), [&](const srf_image_source *source) {
            return srf_merger_replace_by_source(get(), index, source, &world_from_sensor, name.c_str());
        });
    }
    void replace(std::size_t index, const Mesh &mesh, const std::string &name, const Pose &world_from_mesh = {})
    {
        check(srf_merger_replace_by_mesh(get(), index, mesh.get(), &world_from_mesh, name.c_str()));
    }

    // Whether each run keeps what it found out for the next, which then renews only what scans have a part in that are new to it.
    void keep(bool keep = true) { check(srf_merger_keep(get(), keep ? 1 : 0)); }

    // How many of the bricks of space that scans speak of the last run that kept something had to renew. 0 of 0 without keep() and before the
    // first run with it: nothing is kept then, and each run finds out everything.
    struct Renewed {
        std::size_t bricks;
        std::size_t of;
    };
    Renewed renewed() const
    {
        Renewed renewed{};
        check(srf_merger_renewed(get(), &renewed.bricks, &renewed.of));
        return renewed;
    }

    struct Result {
        Mesh mesh;
        srf_merge_report report;
    };

    Result run(const MergeParams &params = {}, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        srf_merge_report report{};
        check(srf_merge_report_init(&report));
        detail::Watcher watcher(progress);
        sources_.check(watcher, srf_merger_run(get(), &params, watcher.get(), &mesh, &report));
        return Result{Mesh(mesh), report};
    }

    // A surface of these scans without its openings. Nothing is filled where one of them saw that nothing is.
    Mesh close(const Mesh &surface, const CloseParams &params = {}, CloseReport *report = nullptr, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        detail::Watcher watcher(progress);
        sources_.check(watcher, srf_mesh_close(surface.get(), get(), &params, watcher.get(), &mesh, report));
        return Mesh(mesh);
    }

    // More scans than memory holds, into a surface that it does hold.
    Result run_in_files(const MergeParams &params = {}, const InFiles &files = {}, const Progress &progress = {}) const
    {
        srf_mesh *mesh = nullptr;
        srf_merge_report report{};
        check(srf_merge_report_init(&report));
        detail::Watcher watcher(progress);
        const char *workspace = files.workspace.empty() ? nullptr : files.workspace.c_str();
        sources_.check(watcher, srf_merger_run_in_files(get(), &params, files.only_if_needed ? 1 : 0, files.max_memory, workspace,
                                                        watcher.get(), &mesh, &report));
        return Result{Mesh(mesh), report};
    }

    // More scans than memory holds, straight into a PLY file.
    srf_merge_report write(const std::string &path, const MergeParams &params = {}, const IntoFile &into = {},
                           const Progress &progress = {}) const
    {
        srf_merge_report report{};
        check(srf_merge_report_init(&report));
        detail::Watcher watcher(progress);
        const auto text = [](const std::string &given) { return given.empty() ? nullptr : given.c_str(); };
        sources_.check(watcher, srf_merger_write(get(), path.c_str(), &params, into.max_memory, text(into.workspace),
                                                 &into.options, text(into.provenance), watcher.get(), &report));
        return report;
    }

private:
    static srf_merger *make()
    {
        srf_merger *merger = nullptr;
        check(srf_merger_create(&merger));
        return merger;
    }

    detail::Sources sources_;
};

}  // namespace surfrecon

#endif
