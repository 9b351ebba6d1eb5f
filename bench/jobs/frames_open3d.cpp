// The job of c-api/examples/cpp/tracked_camera.cpp with Open3D: frames_open3d OUT.ply [FRAMES]
// Camera and queue are the same, line by line. Frames are integrated into a truncated distance field, from which previews and the result are taken:
// one cell for both, and one that is given.

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
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <open3d/Open3D.h>

namespace {

constexpr int ROWS = 120, COLS = 160;
constexpr double FOCAL = 200, CX = 0.5 * (COLS - 1), CY = 0.5 * (ROWS - 1);  // pixels
constexpr double MILLIMETRE = 0.001, VOXEL = 0.009, REACH = 3;                // metres
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

using open3d::geometry::Image;
using open3d::geometry::TriangleMesh;
using open3d::pipelines::integration::ScalableTSDFVolume;
using open3d::pipelines::integration::TSDFVolumeColorType;

// An image of so many bytes a pixel.
Image image(const void *pixels, int channels, int bytes_a_channel)
{
    Image image;
    image.Prepare(COLS, ROWS, channels, bytes_a_channel);
    std::copy_n(static_cast<const std::uint8_t *>(pixels), image.data_.size(), image.data_.begin());
    return image;
}

// The surface of what was integrated; says what came of it.
std::shared_ptr<TriangleMesh> extract(ScalableTSDFVolume &volume, int frames)
{
    const auto started = std::chrono::steady_clock::now();
    auto mesh = volume.ExtractTriangleMesh();
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - started;
    std::cout << frames << " frames, voxel " << volume.voxel_length_ << ": " << mesh->triangles_.size() << " triangles, " << taken.count() << " s\n";
    return mesh;
}

// Takes the frames as they come until the camera ends.
void record(Queue &queue, const std::string &out)
{
    const open3d::camera::PinholeCameraIntrinsic camera(COLS, ROWS, FOCAL, FOCAL, CX, CY);
    ScalableTSDFVolume volume(VOXEL, 4 * VOXEL, TSDFVolumeColorType::RGB8, 16, 1);
    int count = 0;
    while (const auto frame = queue.take()) {
        const auto both = open3d::geometry::RGBDImage::CreateFromColorAndDepth(image(frame->colours.data(), 3, 1), image(frame->depths.data(), 1, 2),
                                                                               1 / MILLIMETRE, REACH, false);
        const Eigen::Matrix4d world_from_camera = Eigen::Map<const Eigen::Matrix4d>(frame->world_from_camera.data());
        volume.Integrate(*both, camera, world_from_camera.inverse());
        // An app draws this mesh.
        if (++count % FRAMES_A_PREVIEW == 0) extract(volume, count);
    }
    if (!open3d::io::WriteTriangleMesh(out, *extract(volume, count))) throw std::runtime_error(out + " can't be written");
}

}  // namespace

int main(int argc, char **argv)
try {
    const int frames = argc > 2 ? std::atoi(argv[2]) : 30;
    if (argc < 2 || frames < 1) {
        std::cerr << "usage: " << argv[0] << " OUT.ply [FRAMES]\n";
        return 2;
    }
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
