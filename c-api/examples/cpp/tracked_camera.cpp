// The work of an app with a depth camera: frames arrive on a thread of the camera's, 16-bit depths in millimetres, RGB, and the pose that
// tracking found; each becomes a range image and is added, all so far are merged now and then for a preview, and in the end for good.
// Usage: tracked_camera OUT [FRAMES]      OUT ends in .glb, .ply, .obj or .stl
// Here the camera is virtual, and flies around a ball with bumps, half a metre in radius; a program with a real one puts its frames into the
// queue instead. C++17.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <exception>
#include <functional>
#include <iostream>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <surfrecon.hpp>

namespace {

constexpr int ROWS = 120, COLS = 160;
constexpr double FOCAL = 200, CX = 0.5 * (COLS - 1), CY = 0.5 * (ROWS - 1);  // pixels
constexpr double MILLIMETRE = 0.001, PREVIEW_VOXEL = 0.02;                    // metres
constexpr int FRAMES_A_PREVIEW = 12;

// The data that the camera delivers.
struct Captured {
    std::vector<std::uint16_t> depths;         // millimetres, 0 where nothing was measured
    std::vector<std::uint8_t> colours;         // RGB
    std::array<double, 16> world_from_camera;  // column after column; x right, y down, z forward
};

// Frames on their way from the thread that captures them to the one that merges.
class Queue {
public:
    void put(Captured frame)
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        frames_.push_back(std::move(frame));
        changed_.notify_one();
    }

    // No more will come; with an exception, because of it.
    void end(std::exception_ptr thrown = nullptr)
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        ended_ = true;
        thrown_ = thrown;
        changed_.notify_one();
    }

    // Waits for the next frame; nothing after the last one.
    std::optional<Captured> take()
    {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait(lock, [this] { return ended_ || !frames_.empty(); });
        if (frames_.empty()) {
            if (thrown_) std::rethrow_exception(thrown_);
            return std::nullopt;
        }
        Captured frame = std::move(frames_.front());
        frames_.pop_front();
        return frame;
    }

private:
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Captured> frames_;
    bool ended_ = false;
    std::exception_ptr thrown_;
};

// The k-th of so many frames: from a spiral over a sphere, looking at its middle.
Captured virtual_frame(int k, int count)
{
    const double height = 1 - (2 * k + 1.0) / count, angle = 2.4 * k, ring = std::sqrt(1 - height * height), away = 1.5;
    const double x[3] = {-std::sin(angle), std::cos(angle), 0}, z[3] = {-ring * std::cos(angle), -ring * std::sin(angle), -height};
    Captured frame{std::vector<std::uint16_t>(ROWS * COLS), std::vector<std::uint8_t>(3 * ROWS * COLS), {}};
    auto &m = frame.world_from_camera;
    for (int i = 0; i < 3; ++i) {
        m[i] = x[i];
        m[4 + i] = z[(i + 1) % 3] * x[(i + 2) % 3] - z[(i + 2) % 3] * x[(i + 1) % 3];
        m[8 + i] = z[i];
        m[12 + i] = -away * z[i];
    }
    m[15] = 1;
    for (int i = 0; i < ROWS * COLS; ++i) {
        const double right = (i % COLS - CX) / FOCAL, down = (i / COLS - CY) / FOCAL;
        // The ray walks until it is inside: by half of how far it is outside, since bumps are no steeper than that.
        double depth = 0.9, at[3] = {}, outside = 1;
        for (int step = 0; step < 60 && outside > 1e-5; ++step) {
            for (int axis = 0; axis < 3; ++axis) at[axis] = depth * (m[axis] * right + m[4 + axis] * down + m[8 + axis]) + m[12 + axis];
            outside = std::hypot(at[0], at[1], at[2]) - 0.5 - 0.02 * std::sin(12 * at[0]) * std::sin(12 * at[1]) * std::sin(12 * at[2]);
            depth += 0.5 * outside;
        }
        if (outside > 1e-3) continue;
        frame.depths[i] = static_cast<std::uint16_t>(std::lround(depth / MILLIMETRE));
        for (int axis = 0; axis < 3; ++axis) frame.colours[3 * i + axis] = static_cast<std::uint8_t>(128 + 220 * at[axis]);
    }
    return frame;
}

// The thread of the camera.
void capture(Queue &queue, int count) noexcept
try {
    for (int k = 0; k < count; ++k) queue.put(virtual_frame(k, count));
    queue.end();
} catch (...) {
    queue.end(std::current_exception());
}

// Merges what was added; says what came of it. A voxel of SRF_FROM_DATA is as fine as the frames.
surfrecon::Mesh merge(const surfrecon::Merger &merger, double voxel)
{
    surfrecon::MergeParams params;
    params.voxel = voxel;
    const auto started = std::chrono::steady_clock::now();
    auto [mesh, report] = merger.run(params);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - started;
    std::cout << report.scans << " frames, voxel " << report.voxel << ": " << mesh.triangles().size() << " triangles, "
              << report.holes_open << " holes left open, " << taken.count() << " s\n";
    return std::move(mesh);
}

// Takes the frames as they come until the camera ends.
void record(Queue &queue, const std::string &out)
{
    surfrecon::Frame camera;
    camera.rows = ROWS;
    camera.cols = COLS;
    std::copy_n(std::begin({FOCAL, FOCAL, CX, CY}), 4, camera.intrinsics);
    camera.scale = MILLIMETRE;

    surfrecon::Merger merger;
    merger.keep();  // each preview then reads its new frames alone, and renews what these show
    int count = 0;
    while (const auto frame = queue.take()) {
        const surfrecon::View<std::uint16_t> depths(frame->depths.data(), frame->depths.size());
        const surfrecon::View<std::uint8_t, 3> colours(frame->colours.data(), frame->colours.size() / 3);
        surfrecon::Pose pose;
        std::copy(frame->world_from_camera.begin(), frame->world_from_camera.end(), pose.matrix);
        merger.add(surfrecon::Image::from_frame(camera, depths, colours, {}, pose, "frame " + std::to_string(count)));
        // An app draws this mesh.
        if (++count % FRAMES_A_PREVIEW == 0) merge(merger, PREVIEW_VOXEL);
    }
    merge(merger, SRF_FROM_DATA).write(out);
}

}  // namespace

int main(int argc, char **argv)
try {
    const int frames = argc > 2 ? std::atoi(argv[2]) : 30;
    if (argc < 2 || frames < 1) {
        std::cerr << "usage: " << argv[0] << " OUT [FRAMES]\n";
        return 2;
    }
    surfrecon::check_abi();
    surfrecon::check_mesh_file(argv[1]);
    Queue queue;
    std::thread camera(capture, std::ref(queue), frames);
    try {
        record(queue, argv[1]);
    } catch (...) {
        camera.join();
        throw;
    }
    camera.join();
    return EXIT_SUCCESS;
} catch (const std::exception &error) {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
}
