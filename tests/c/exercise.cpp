// The owners of surfrecon.hpp: made, moved, used, thrown out of; run under sanitizers.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "surfrecon.hpp"

namespace {

void must(bool holds, const char *what)
{
    if (!holds) throw std::runtime_error(what);
}

template <typename Thrown, typename Function>
std::string text_of(Function function)
{
    try {
        function();
    } catch (const Thrown &thrown) {
        return thrown.what();
    }
    throw std::runtime_error("nothing was thrown");
}

std::string content_of(const char *path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

int main()
try {
    using namespace surfrecon;
    const std::vector<double> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const std::vector<std::uint32_t> triangles = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    Mesh made = Mesh::create(View<double, 3>(positions.data(), 4), View<std::uint32_t, 3>(triangles.data(), 4));
    const Mesh mesh = std::move(made);
    must(!made && mesh && mesh.report().genus == 0, "a moved owner is empty");
    must(mesh.positions().size() == 4 && mesh.positions()[3][2] == 1, "positions");
    double sum = 0;
    for (const auto [x, y, z] : mesh.positions()) sum += x + 10 * y + 100 * z;
    must(sum == 111, "a view is gone through");
    const std::vector<std::array<std::uint32_t, 3>> corners_of = mesh.triangles().to_vector();
    must(corners_of.size() == 4 && corners_of[1] == std::array<std::uint32_t, 3>{0, 1, 3}, "a copy of a view");
    const View<double> numbers(positions);
    must(std::vector<double>(numbers.begin(), numbers.end()) == positions && numbers.end() - numbers.begin() == 12, "numbers");
    must(Mesh::create(View<double, 3>(positions), View<std::uint32_t, 3>(triangles)).positions()[1][0] == 1, "views of vectors");
    text_of<Error>([&] { View<double, 5>{positions}; });

    const Projection projection = Projection::orthographic(-1, 1, 0.05, -0.05);
    const srf_projection by_hand = {SRF_PROJECTION_ORTHOGRAPHIC, 0, {-1, 1, 0.05, -0.05}};
    must(projection.kind == by_hand.kind && std::equal(by_hand.numbers, by_hand.numbers + 4, projection.numbers), "projections");
    text_of<Error>([] { Projection::pinhole(0, 500, 320, 240); });
    Pose from_above;
    from_above.matrix[14] = 5;
    const Image image = Image::scan(mesh, 40, 40, projection, from_above);
    must(image.valid() > 100 && image.rows() == 40 && std::isnan(image.world_points()[0]), "scan");
    must(image.to_cloud().positions().size() == image.valid(), "cloud");

    Merger merger;
    merger.add(mesh, "tetrahedron");
    MergeParams params;
    params.voxel = 0.05;
    int ticks = 0;
    const auto result = merger.run(params, [&](const Tick &tick) {
        ++ticks;
        return tick.fraction <= 1.0;
    });
    IntoFile into;
    into.workspace = ".";
    into.provenance = "{}";
    must(merger.write("exercise.ply", params, into).faces_direct == result.report.faces_direct, "into a file");
    InFiles files;
    files.workspace = ".";
    must(merger.run_in_files(params, files).report.in_files == 1, "in files");
    files.only_if_needed = true;
    must(merger.run_in_files(params, files).report.in_files == 0, "not needed");
    must(text_of<Error>([&] { merger.write("exercise.obj"); }).find("only .ply") != std::string::npos, "only PLY");
    must(result.mesh.report(true).is_manifold == 1 && result.report.voxel == 0.05, "merge");
    must(result.mesh.attribute<float>(SRF_DOMAIN_VERTICES, "confidence").size() == result.mesh.positions().size(), "attribute");
    must(result.mesh.distances(mesh.positions()).max < 0.05, "distances");

    params.voxel = 0.002;
    text_of<Cancelled>([&] { merger.run(params, [](const Tick &) { return false; }); });
    const auto thrower = [](const Tick &) -> bool { throw std::logic_error("out of the callback"); };
    must(text_of<std::logic_error>([&] { merger.run(params, thrower); }) == "out of the callback", "exceptions get through");
    params.voxel = -3;
    const std::string text = text_of<Error>([&] { merger.run(params); });
    must(text == "voxel must be a finite number > 0, got -3 (in the unit of the scans)", text.c_str());
    text_of<Error>([&] { mesh.attribute<float>(SRF_DOMAIN_VERTICES, "nothing"); });
    text_of<Error>([] { Scans::open({"missing.ply"}); });

    Frame frame;
    frame.rows = frame.cols = 30;
    frame.intrinsics[0] = frame.intrinsics[1] = 30;
    frame.intrinsics[2] = frame.intrinsics[3] = 14.5;
    frame.scale = 0.001;
    frame.reach = 1.2;
    std::vector<std::uint16_t> depths(30 * 30, 1000);
    for (std::size_t i = 0; i < depths.size(); ++i) depths[i] = static_cast<std::uint16_t>(1000 + 3 * (i % 30) + (i == 7 ? 500 : 0));
    const std::vector<std::uint8_t> paint(4 * 30 * 30, 200), levels(30 * 30, 2);
    LeftOutReport left_out;
    const auto wall = [&] {
        return Image::from_frame(frame, View<std::uint16_t>(depths.data(), depths.size()),
                                 View<std::uint8_t, 4>(paint.data(), depths.size()), View<std::uint8_t>(levels.data(), levels.size()));
    };
    must(wall().valid() == 899, "from a frame");
    must(Image::from_frame(frame, View<std::uint16_t>(depths.data(), depths.size()), {}, {}, Pose(), "wall", &left_out).name() == "wall",
         "named");
    must(left_out.of == 900 && left_out.out_of_reach == 1 && left_out.low_confidence == 0, "left out");
    text_of<Error>([&] { Image::from_frame(frame, View<float>()); });

    const Image kept = wall();
    const Mesh vertices = kept.to_mesh();
    const auto row = vertices.attribute<std::int32_t>(SRF_DOMAIN_VERTICES, "range_row");
    const auto column = vertices.attribute<std::int32_t>(SRF_DOMAIN_VERTICES, "range_col");
    const auto colours = vertices.attribute<std::uint8_t, 4>(SRF_DOMAIN_VERTICES, "colour");
    Pose larger;
    larger.matrix[0] = larger.matrix[5] = larger.matrix[10] = 2;
    const Image back = Image::from_vertices(kept.grid_camera(), row, column, vertices.positions(), colours, {}, {}, larger, "back");
    must(back.name() == "back" && back.valid() == 899 && back.projection().kind == SRF_PROJECTION_PINHOLE_DEPTH, "vertices and back");
    const Mesh bare = kept.to_mesh(false);
    must(bare.triangles().size() == 0 && bare.positions().size() == 899 && vertices.triangles().size() > 1000, "without faces");
    must(kept.grid_camera().scaled(3).anchors[5].point[2] == 3 * kept.grid_camera().anchors[5].point[2], "scaled");
    text_of<Error>([&] { Image::from_vertices(GridCamera(), row, column, vertices.positions()); });
    Merger walls;
    walls.add(wall, "wall");
    Pose aside;
    aside.matrix[12] = 0.2;
    bool is_broken = false;
    walls.add(
        [&] {
            if (is_broken) throw std::logic_error("out of the source");
            return wall();
        },
        "another", aside);
    text_of<Error>([&] { walls.add(wall, "mirrored", [] {
        Pose mirror;
        mirror.matrix[0] = -1;
        return mirror;
    }()); });
    Merger of_walls = std::move(walls);
    must(of_walls.run().report.scans == 2, "sources");
    is_broken = true;
    must(text_of<std::logic_error>([&] { of_walls.run(); }) == "out of the source", "exceptions get through");
    is_broken = false;
    must(of_walls.run().report.scans == 2, "and leave nothing behind");

    of_walls.keep();
    const auto first = of_walls.run();
    must(of_walls.size() == 2 && of_walls.renewed().bricks == of_walls.renewed().of, "all is new");
    is_broken = true;
    const auto second = of_walls.run();
    must(of_walls.renewed().bricks == 0 && second.mesh.positions().size() == first.mesh.positions().size(), "nothing is");
    of_walls.replace(0, wall, "wall", aside);
    of_walls.replace(0, wall());
    of_walls.replace(1, mesh, "tetrahedron");
    of_walls.remove(0);
    must(of_walls.run().report.scans == 1, "replaced and removed");
    text_of<Error>([&] { of_walls.remove(1); });
    Aligner lost;
    lost.add([&] { return Image(); }, "nothing");
    lost.add(wall, "wall");
    must(text_of<Error>([&] { lost.run(); }).find("nothing: the source made no image") == 0, "no image");

    Aligner aligner;
    aligner.add(image);
    aligner.add(mesh, "tetrahedron", from_above);
    aligner.fix(1);
    aligner.trust(0, 1);
    Pick corner;
    corner.scans[1] = 1;
    corner.points[0][2] = -5; // the sensor looks from above
    aligner.pick(corner);
    AlignParams rough;
    rough.start = SRF_START_ROUGH;
    text_of<Cancelled>([&] { aligner.run(rough, [](const Tick &) { return false; }); });
    Alignment found = aligner.run(rough, [](const Tick &tick) { return tick.fraction <= 1.0; });
    const Alignment alignment = std::move(found);
    must(!found && alignment.report().scans_count == 2 && alignment.lines().size() == 3 + alignment.report().messages_count, "aligned");
    must(alignment.scan(1).state == SRF_SCAN_STATE_KEPT && alignment.scan(1).world_from_scan.matrix[14] == 5, "the fixed one stays");
    must(alignment.scan(0).has_place() == alignment.reason(0).empty(), "a reason, or a place");
    for (std::size_t i = 0; i < alignment.report().pairs_count; ++i) must(alignment.pair(i).scans[1] == 1, "pair");
    must(alignment.messages().size() < alignment.lines().size(), "messages");
    must(alignment.scan(0).ways().size() == alignment.scan(0).freedoms_count && !alignment.turntable(), "ways, and no turntable");
    for (std::size_t i = 0; i < alignment.report().pairs_count; ++i) must(alignment.pair(i).ways().size() <= 6, "ways of a pair");
    text_of<Error>([&] { alignment.scan(2); });
    must(aligner.snap(0).state == SRF_PAIR_STATE_NOTHING && aligner.snap(0).touched.empty(), "too far away");
    const Mesh surface = image.triangulate();
    aligner.add(surface, "its surface", from_above);
    const Snap drawn = aligner.snap(0, {from_above, srf_pose{}, from_above}, rough);
    must(aligner.size() == 3 && drawn.touched == std::vector<std::size_t>{2} && drawn.touches_count == 1, "drawn to the other");
    must(drawn.state == SRF_PAIR_STATE_SLIDES && drawn.ways().size() == drawn.freedoms_count && drawn.freedoms_count == 3, "along its flat side");
    text_of<Error>([&] { aligner.snap(0, {Pose()}); });
    text_of<Cancelled>([&] { aligner.snap(0, {}, {}, [](const Tick &) { return false; }); });
    Aligner strangers;
    strangers.add(image);
    strangers.add(mesh, "tetrahedron", from_above);
    const Alignment near_them = strangers.run(rough);
    // The larger one is kept.
    const std::size_t other = near_them.scan(0).state == SRF_SCAN_STATE_KEPT ? 1 : 0;
    must(near_them.scan(other).state == SRF_SCAN_STATE_UNDECIDED, "stays, undecided");
    must(!near_them.reason(other).empty() && near_them.scan(other).world_from_scan.matrix[14] == 5, "as given, and why");
    AlignParams in_order;
    in_order.start = SRF_START_SEQUENCE;
    must(strangers.run(in_order).scan(other).state == SRF_SCAN_STATE_UNPLACED, "a frame that follows none");
    Pose above = from_above;
    above.matrix[14] += 0.01;
    const std::vector<double> off = aligner.misfit(2, surface.positions(), {from_above, srf_pose{}, above});
    double largest = 0;
    for (const double one : off) largest = one > largest ? one : largest;
    must(off.size() == surface.positions().size() && largest > 0.005 && largest < 0.011, "misfit");
    text_of<Cancelled>([&] { aligner.misfit(2, surface.positions(), {}, [](const Tick &) { return false; }); });
    Axis axis;
    text_of<Error>([&] { aligner.turn(axis); });
    axis.direction = {0, 0, 3};
    aligner.turn({}, {0, 0.5, 1});
    aligner.turn(axis, {0, 0, 0});
    const auto table = aligner.run().turntable();
    must(table && table->axis.direction[2] == 1 && table->angles.size() == 3, "the turntable that was told of");
    text_of<Error>([&] { aligner.reject(1, 1); });

    ClusterParams few;
    few.vertices = 4;
    ClusterReport figures;
    must(mesh.clustered(few, &figures).positions().size() == figures.vertices, "clustered");
    must(mesh.clustered({8, 4}).size() == 2, "levels");
    CloseReport filling;
    const Mesh lid = surface.closed({}, &filling);
    must(lid.triangles().size() == surface.triangles().size() + filling.added_triangles, "closed");
    must(merger.close(mesh).triangles().size() == 4, "nothing to close");
    PrintReport judged;
    const std::vector<std::string> marked = mesh.checked_for_printing({}, &judged).attributes(SRF_DOMAIN_TRIANGLES);
    must(judged.is_closed && judged.crossing_pairs == 0 && marked.size() >= 3, "checked for printing");
    PreparePrintParams printing;
    printing.printer_height = 0.3;
    PrepareReport printed;
    const Mesh cut = mesh.prepared_for_printing(printing, &printed);
    must(printed.parts > 1 && cut.part(0).triangles().size() < cut.triangles().size(), "prepared for printing");
    UnwrapReport atlas;
    const Mesh flat = mesh.unwrapped({}, &atlas);
    must(atlas.charts > 0 && flat.attribute<float>(SRF_DOMAIN_VERTICES, "s").size() == flat.positions().size(), "unwrapped");
    Pose camera_below;
    camera_below.matrix[14] = -3;
    const std::vector<std::uint8_t> red = [] {
        std::vector<std::uint8_t> pixels;
        for (int i = 0; i < 40 * 50; ++i) pixels.insert(pixels.end(), {200, 20, 10});
        return pixels;
    }();
    const Projection lens = Projection::pinhole(60, 60, 24.5, 19.5);
    const std::vector<float> far_off(4 * 5, 9.0F);
    const Photo photo = Photo::create(40, 50, lens, View<std::uint8_t, 3>(red), camera_below, "below");
    const Photo deep = Photo::create(40, 50, lens, View<std::uint8_t, 3>(red), camera_below, "deep", 4, 5, View<float>(far_off));
    TextureParams maps;
    maps.size = 64;
    maps.height_map = 1;
    TextureReport baked;
    const Textures textures = flat.textured(mesh, {&photo, &deep}, maps, &baked);
    must(textures.size() == std::pair<std::size_t, std::size_t>(64, 1) && baked.seen > 0 && baked.seen <= baked.texels, "textured");
    must(textures.colour().size() == 64 * 64 && textures.mask().size() == 64 * 64 && textures.height().size() == 64 * 64, "images");
    must(textures.normal().empty() && textures.occlusion().empty() && textures.colour()[0][0] > 150, "colours");
    must(textures.photo(0).texels > 0 && textures.reason(1).empty() && textures.pose(1).matrix[14] == -3, "photos");
    text_of<Error>([&] { textures.colour(1); });
    must(text_of<Error>([&] { mesh.textured(mesh, {&photo}); }).find("unwrap it first") != std::string::npos, "no coordinates");
    mesh.write_obj("exercise.obj");
    for (const std::string &name : {std::string(), std::string("statue")}) {
        const std::string expected = "\"name\":\"" + (name.empty() ? "mesh" : name) + "\"";
        mesh.write_glb("exercise.glb", 0.001, true, {}, name);
        must(content_of("exercise.glb").find(expected) != std::string::npos, "name in a glb");
        write_glb_levels({&mesh}, "exercise.glb", 1.0, false, {}, name);
        must(content_of("exercise.glb").find(expected) != std::string::npos, "name in a glb of levels");
    }
    check_mesh_file("exercise.glb");
    must(text_of<Error>([&] { check_mesh_file("exercise.las"); }).find("must end in .ply") != std::string::npos, "ending");
    mesh.write_stl("exercise.stl");
    image.to_cloud().write_ply("exercise_cloud.ply");
    must(text_of<Error>([&] { write_ptx({&image}, "exercise.ptx"); }).find("parallel") != std::string::npos, "no eye");
    const Image seen = Image::scan(mesh, 20, 20, {SRF_PROJECTION_PINHOLE_DEPTH, 0, {20, 20, 9.5, 9.5}}, [] {
        Pose below;
        below.matrix[14] = -3;
        return below;
    }());
    write_ptx({&seen, &seen}, "exercise.ptx");
    write_e57({&seen}, "exercise.e57", [](const Tick &) { return true; });
    must(Scans::open({"exercise.ptx"}).size() == 2, "two scans");
    ReadOptions options;
    options.scale = -1.5;
    text_of<Error>([&] { Scans::open({"exercise.e57"}, options); });
    options.scale = SRF_FROM_DATA;
    const Scans opened = Scans::open({"exercise.e57"}, options);
    const auto again = opened.read(0);
    must(again.image.valid() == seen.valid(), "read again");
    write_conf({&again.image}, "exercise.conf", SRF_ENCODING_ASCII);
    text_of<Error>([&] { Image().rows(); });

    check_abi();
    set_threads(2);
    set_memory_limit(1 << 30);
    must(threads() == 2 && memory_limit() == 1 << 30, "settings");
    set_threads(0);
    set_memory_limit(0);
    std::string told;
    must(mesh.bounds().max[0] == 1 && image.bounds().max[2] <= 1 + 1e-9 && image.to_cloud().bounds().min[0] >= -1e-9, "bounds");
    must(mesh.positions_f32(mesh.bounds().middle())[0] == -0.5f, "positions in single precision");
    must(image.to_cloud().positions_f32().size() == 3 * image.valid(), "points in single precision");
    Cancel cancel;
    must(!cancel.is_set(), "not set");
    cancel.set();
    bool was_cancelled = false;
    try {
        (void)mesh.report(false, cancel);
    } catch (const Cancelled &) {
        was_cancelled = true;
    }
    must(was_cancelled && cancel.is_set(), "cancelled");
    cancel.reset();
    {
        Context outer, inner;
        outer.set_threads(1);
        outer.set_memory_limit(1u << 30);
        must(outer.threads() == 1 && outer.memory_limit() == 1u << 30 && inner.threads() == 0, "settings of a context");
        const Use use(outer);
        const Mesh under = [&] {
            const Use nested(inner);
            return Mesh::create(View<double, 3>(positions.data(), 4), View<std::uint32_t, 3>(triangles.data(), 4));
        }();
        must(inner.held() > 0, "held");
    }
    set_log([&](srf_log_level level, const char *text) { told += std::to_string(level) + text; });
    write_ptx({&seen}, "log.ptx");
    Scans::open({"log.ptx"});
    set_log({});

    // Positions between other numbers, as vertex buffers have them.
    struct Vertex {
        float position[3];
        std::uint32_t other;
    };
    std::vector<Vertex> buffer;
    for (std::size_t i = 0; i < 4; ++i)
        buffer.push_back({{static_cast<float>(positions[3 * i]), static_cast<float>(positions[3 * i + 1]),
                           static_cast<float>(positions[3 * i + 2])}, 77});
    const View<float, 3> strided(buffer[0].position, 4, sizeof(Vertex));
    must(strided[3][0] == buffer[3].position[0] && strided.stride() == sizeof(Vertex), "strided");
    must((*(strided.begin() + 3))[0] == buffer[3].position[0] && strided.to_vector()[2][1] == strided[2][1], "a strided view is gone through");
#ifdef __cpp_lib_span
    must(mesh.positions().span().size() == 12 && mesh.positions().span()[11] == 1, "a span");
    text_of<Error>([&] { strided.span(); });
#endif
    const Mesh from_buffer = Mesh::create(strided, View<std::uint32_t, 3>(triangles.data(), 4));
    must(from_buffer.positions()[2][1] == mesh.positions()[2][1], "from a vertex buffer");
    text_of<Error>([&] { View<float, 3>(srf_array{positions.data(), 4, 0, SRF_TYPE_F64, 3}); });

    const std::vector<float> strengths(4, 0.5F);
    const View<double, 3> corners(positions.data(), 4);
    const Cloud cloud_of_four = Cloud::create(corners, {}, {}, Pose(), View<float>(strengths.data(), 4));
    must(cloud_of_four.intensities().size() == 4 && cloud_of_four.intensities()[3][0] == 0.5F, "intensities");
    const std::vector<double> eye{10, 10, 10};
    std::vector<std::uint8_t> dropped;
    const auto [skin, told_of] = Reconstructor(cloud_of_four, View<double, 3>(eye.data(), 1)).surface({}, {}, &dropped);
    must(dropped.size() == 4 && dropped[0] == SRF_DROPPED_USED && skin.positions().size() == 4 && told_of.points == 4, "none is dropped");

    Image coloured = wall();
    must(coloured.colours().size() == 900 && coloured.intensities().empty() && coloured.values().size() == 900, "what pixels have");
    const std::vector<float> doubts(900, 0.25F);
    coloured.set_attributes({}, View<float>(doubts.data(), 900));
    must(coloured.colours().empty() && coloured.intensities()[899][0] == 0.25F && coloured.confidences().empty(), "replaced");
    must(coloured.ray(0, 0).direction[2] > 0.5, "a ray looks forward");
    text_of<Error>([&] { coloured.points(); });

    Folder memory;
    write_conf({&again.image}, memory.path("set/list.conf"), SRF_ENCODING_BINARY);
    must(memory.names().size() == 2 && memory.names()[0].rfind("set/", 0) == 0, "a list and a grid");
    {
        const View<std::uint8_t> list = memory.bytes("set/list.conf");
        Folder behind;
        behind.put("list.conf", list.data(), list.size());
        const std::string grid = memory.names()[0] == "set/list.conf" ? memory.names()[1] : memory.names()[0];
        const View<std::uint8_t> bytes = memory.bytes(grid);
        std::size_t asked = 0;
        behind.put(grid.substr(4), bytes.size(), [bytes, &asked](std::uint64_t at, void *buffer, std::size_t count) {
            const std::size_t some = std::min<std::size_t>({count, bytes.size() - at, 1000});
            std::copy_n(bytes.data() + at, some, static_cast<std::uint8_t *>(buffer));
            asked += some;
            return some;
        });
        must(Scans::open({behind.path()}).read(0).image.valid() == seen.valid() && asked >= bytes.size(), "read through a function");
        behind.put("broken.ply", 1000, [](std::uint64_t, void *, std::size_t) -> std::size_t { throw std::logic_error("no line"); });
        must(text_of<Error>([&] { Scans::open({behind.path("broken.ply")}); }).find("broken.ply: no line") != std::string::npos, "no line");
        must(behind.remove("broken.ply") && !behind.remove("broken.ply"), "removed once");
    }
    std::string taken;
    bool complete = false;
    Folder sink([&](const char *name, const void *bytes, std::size_t count) {
        must(std::string(name) == "mesh.ply" && !complete, "the pieces of one file");
        bytes == nullptr ? void(complete = true) : void(taken.append(static_cast<const char *>(bytes), count));
    });
    mesh.write(sink.path("mesh.ply"));
    mesh.write(memory.path("mesh.ply"));
    const View<std::uint8_t> kept_bytes = memory.bytes("mesh.ply");
    must(complete && taken == std::string(kept_bytes.data(), kept_bytes.data() + kept_bytes.size()), "the same bytes");
    Folder full([](const char *, const void *, std::size_t) { throw std::runtime_error("no room"); });
    must(text_of<Error>([&] { mesh.write(full.path("mesh.ply")); }).find("mesh.ply: no room") != std::string::npos, "no room");

    Pose half;
    half.matrix[12] = 1;
    const Region right = Region::box(half);
    Mesh pyramid = Mesh::create(View<double, 3>(positions.data(), 4), View<std::uint32_t, 3>(triangles.data(), 4));
    must(pyramid.keep(right) == 0 && pyramid.remove(Region::below(Plane::through({{{0, 0, 0.5}, {1, 0, 0.5}, {0, 1, 0.5}}}))) == 3, "removed");
    must(pyramid.positions().size() == 1 && pyramid.triangles().size() == 0, "what is left");
    Image cropped = Image::scan(mesh, 40, 40, projection, from_above);
    const std::vector<std::uint8_t> marks(1600, 1);
    must(cropped.keep(Region::mask(View<std::uint8_t>(marks.data(), 1600), 40, 40)) == 0, "all is marked");
    must(cropped.remove(right) == image.valid() && cropped.valid() == 0, "all is to the right");
    Scans chosen = Scans::open({"exercise.ptx"});
    chosen.remove(1, right);
    chosen.transform(true_size({0, 0, 0}, {0, 0, 2}, 1));
    must(chosen.read(0).image.valid() == seen.valid() && chosen.pose(0).matrix[14] == -1.5, "half the size");
    Aligner scenery;
    scenery.add(mesh, "tetrahedron");
    PlaneParams plane_params;
    plane_params.min_share = 1;
    must(text_of<Error>([&] { scenery.dominant_plane(plane_params); }).find("plane") != std::string::npos, "no plane");
    must(ground(Plane()).matrix[0] == 1, "the ground is the ground");
    std::cout << "fine\n";
    return 0;
} catch (const std::exception &error) {
    std::cerr << error.what() << '\n';
    return 1;
}
