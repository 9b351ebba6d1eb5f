"""The merge filter in MeshLab: what it takes, what it makes, how it refuses."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import surfrecon
from conftest import IMPORT, MERGE, ROOT, length, plugins, scalars
from files import write_set
from shapes import MAJOR, MINOR, torus, torus_distance, torus_scans

# MeshLab 2022.02 hands lengths on in single precision: one that has no rounding.
VOXEL = 1 / 16


@pytest.fixture(scope="module")
def images():
    return torus_scans(pixels=90, noise=0.001, pose_shift=0.001)


@pytest.fixture(scope="module")
def surfaces(images):
    """Scans as meshes in the world."""
    made = []
    for image in images:
        mesh, pose = image.triangulate(), np.asarray(image.world_from_sensor)
        made.append((image.name, mesh.positions @ pose[:3, :3].T + pose[:3, 3], np.asarray(mesh.triangles)))
    return made


@pytest.fixture
def loaded(document, surfaces):
    for name, positions, triangles in surfaces:
        document.add(positions, triangles, name)
    return document


def surface(layer):
    """The library's mesh of a layer, for its checkers."""
    return surfrecon.Mesh(layer.vertex_matrix(), layer.face_matrix())


def by_the_library(surfaces, **parameters):
    scans = [(surfrecon.Mesh(p, t), np.eye(4), name) for name, p, t in surfaces]
    return surfrecon.merge(scans, voxel=VOXEL, **parameters)


def test_the_surface_is_the_torus(loaded, surfaces):
    out = loaded.run(MERGE, voxel=length(VOXEL))
    layer = loaded.current
    assert len(loaded) == len(surfaces) + 1 and layer.label() == "Merged"
    check = surface(layer).check()
    assert check["is_manifold"] and check["components"] == 1 and check["genus"] == 1
    distance = np.abs(torus_distance(layer.vertex_matrix()))
    assert np.quantile(distance, 0.99) < 0.01 and distance.max() < VOXEL
    assert out["scans"] == len(surfaces) and out["triangles"] == layer.face_number()
    assert out["voxel"] == pytest.approx(VOXEL) and out["holes_open"] == check["boundary_loops"]


def test_it_is_the_library_s_surface(loaded, surfaces):
    loaded.run(MERGE, voxel=length(VOXEL))
    expected = by_the_library(surfaces).mesh
    assert np.array_equal(loaded.current.vertex_matrix(), expected.positions)
    assert np.array_equal(loaded.current.face_matrix(), expected.triangles)
    confidence = expected.vertex_attributes["confidence"]
    assert np.array_equal(loaded.current.vertex_scalar_array(), confidence.astype(float))
    assert np.array_equal(scalars(loaded.current, "source_scan"), expected.vertex_attributes["source_scan"])


def test_layers_are_left_as_they_are(loaded, surfaces):
    loaded.run(MERGE, voxel=length(VOXEL))
    for layer, (name, positions, triangles) in zip(loaded.layers(), surfaces, strict=False):
        assert layer.label() == name
        assert np.array_equal(layer.vertex_matrix(), positions) and np.array_equal(layer.face_matrix(), triangles)


def test_matrices_place_layers(document, images, surfaces):
    """Imported range images lie in their sensor's frame; the matrix of the layer is the pose."""
    for image in images:
        mesh = image.triangulate()
        document.add(mesh.positions, mesh.triangles, image.name)
        document.run("set_matrix", transformmatrix=np.asarray(image.world_from_sensor), freeze=False)
    document.run(MERGE, voxel=length(VOXEL))
    distance = np.abs(torus_distance(document.current.vertex_matrix()))
    assert np.quantile(distance, 0.99) < 0.01 and distance.max() < VOXEL


def test_a_set_from_its_file(document, images, tmp_path):
    out = document.run(IMPORT, file=str(write_set(tmp_path, images)))
    assert out["layers"] == out["range_images"] == len(images) == len(document)
    assert [layer.label() for layer in document.layers()] == [image.name for image in images]
    for layer, image in zip(document.layers(), images, strict=True):
        assert layer.vertex_number() == image.valid.sum()
        assert layer.face_number() == len(image.triangulate().triangles)
    document.run(MERGE, voxel=length(VOXEL))
    assert surface(document.current).check()["is_manifold"]


def test_noise_of_imported_images_is_measured_until_their_faces_are_changed(document, tmp_path):
    row, column = np.mgrid[0:120, 0:120]
    noise = np.random.default_rng(3).normal(0, 0.5, row.shape)
    np.save(tmp_path / "noisy.npy", 0.1 * row + 0.05 * column + noise)
    document.run(IMPORT, file=str(tmp_path / "noisy.npy"))
    out = document.run(MERGE, voxel=length(2))
    assert out["noise"] == pytest.approx(0.5, rel=0.15) and out["seen_through"] == 0
    document.set.set_current_mesh(0)
    document.run("compute_selection_by_condition_per_face", condselect="fi == 5")
    document.run("meshing_remove_selected_faces")
    document.set.set_current_mesh(1)
    document.set.set_current_mesh_visibility(False)
    assert document.run(MERGE, voxel=length(2))["noise"] == 0


def test_hidden_layers_take_no_part(loaded, surfaces):
    name, positions, _ = surfaces[0]
    loaded.named(name)
    loaded.set.set_current_mesh_visibility(False)
    out = loaded.run(MERGE, voxel=length(VOXEL))
    assert out["scans"] == len(surfaces) - 1
    assert np.array_equal(loaded.current.vertex_matrix(), by_the_library(surfaces[1:]).mesh.positions)


def test_open_holes_stay_open_on_request(document, surfaces):
    for name, positions, triangles in surfaces[:8]:
        document.add(positions, triangles, name)
    closed = document.run(MERGE, voxel=length(VOXEL), max_hole_length=length(100))
    document.set.set_current_mesh_visibility(False)
    opened = document.run(MERGE, voxel=length(VOXEL), close="None")
    assert opened["holes_closed"] == 0 < closed["holes_closed"]
    assert surface(document.current).check()["boundary_loops"] == opened["holes_open"]


def test_what_is_filled_is_selected(document, surfaces):
    for name, positions, triangles in surfaces[:8]:
        document.add(positions, triangles, name)
    out = document.run(MERGE, voxel=length(VOXEL), close="All")
    filled = document.current.selected_face_number()
    assert out["filled_area"] > 0 and 0 < filled < document.current.face_number()
    document.set.set_current_mesh_visibility(False)
    out = document.run(MERGE, voxel=length(VOXEL))
    assert document.current.selected_face_number() == 0


def test_colours_are_carried(document, surfaces):
    for name, positions, triangles in surfaces:
        colours = np.clip(np.column_stack([positions * 0.2 + 0.5, np.ones(len(positions))]), 0, 1)
        document.add(positions, triangles, name, v_color_matrix=colours)
    document.run(MERGE, voxel=length(VOXEL))
    layer = document.current
    wanted = np.clip(layer.vertex_matrix() * 0.2 + 0.5, 0, 1)
    assert np.abs(layer.vertex_color_matrix()[:, :3] - wanted).max() < 0.05


def test_a_mirrored_layer_keeps_its_outside(document):
    """A matrix that mirrors turns triangles around: the merge must not see the layer from behind."""
    mesh = torus()
    document.add(mesh.positions * [1, 1, -1], np.asarray(mesh.triangles)[:, [0, 2, 1]], "mirrored")
    document.run("set_matrix", transformmatrix=np.diag([1.0, 1, -1, 1]), freeze=False)
    document.run(MERGE, voxel=length(VOXEL))
    assert surface(document.current).check()["is_manifold"]
    a, b, c = np.moveaxis(document.current.vertex_matrix()[document.current.face_matrix()], 1, 0)
    volume = np.sum(a * np.cross(b, c)) / 6
    assert volume == pytest.approx(2 * np.pi**2 * MAJOR * MINOR**2, rel=0.1)


def test_an_empty_document_is_refused(document, refused):
    """MeshLab itself says so, before the filter is asked."""
    assert "at least one mesh" in refused(document.run, MERGE)
    assert len(document) == 0


def test_a_document_without_visible_layers_is_refused(loaded, refused):
    for layer in loaded.layers():
        loaded.named(layer.label())
        loaded.set.set_current_mesh_visibility(False)
    before = len(loaded)
    said = refused(loaded.run, MERGE)
    assert "nothing to merge" in said and "visible" in said
    assert len(loaded) == before


def test_points_without_a_grid_are_refused_by_name(loaded, refused):
    loaded.add(np.random.default_rng(0).random((50, 3)), name="a cloud")
    before = len(loaded)
    said = refused(loaded.run, MERGE)
    assert '"a cloud"' in said and "points only" in said and "Import Range Images" in said
    assert len(loaded) == before


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"voxel": length(1e-9)}, "voxel"),
        ({"min_component_share": 2.0}, "min_component_share"),
        ({"min_component_share": -0.01}, "min_component_share"),
    ],
)
def test_wrong_parameters_are_named(loaded, refused, parameters, said):
    before = len(loaded)
    assert said in refused(loaded.run, MERGE, **parameters)
    assert len(loaded) == before


def test_a_parameter_that_does_not_exist_is_refused(loaded, refused):
    refused(loaded.run, MERGE, cellsize=1.0)


def test_duplicate_labels_are_two_layers(document, surfaces):
    for _, positions, triangles in surfaces:
        document.add(positions, triangles, "scan")
    assert document.run(MERGE, voxel=length(VOXEL))["scans"] == len(surfaces)


def test_non_manifold_and_unoriented_layers_do_no_harm(document):
    """Three fins on an edge, and a triangle turned over: a surface or a sentence, never a crash."""
    fins = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [1, 1, 1]], float)
    document.add(fins, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4], [1, 2, 5], [2, 1, 5]]), "fins")
    document.run(MERGE, voxel=length(0.05), min_component_share=0.0)
    assert surface(document.current).check()["is_manifold"]


@pytest.mark.skipif("SURFRECON_DATA" not in os.environ, reason="SURFRECON_DATA is not set")
def test_the_ten_scans_of_the_bunny(document):
    # The surface of the library on the same file, through its own reader.
    conf = Path(os.environ["SURFRECON_DATA"]) / "stanford_bunny" / "bun.conf"
    expected = surfrecon.merge(surfrecon.open(conf), voxel=VOXEL / 64)
    document.run(IMPORT, file=str(conf))
    assert len(document) == 10
    out = document.run(MERGE, voxel=length(VOXEL / 64))
    check = surface(document.current).check()
    assert check["is_manifold"] and check["components"] == 1
    # MeshLab hands matrices and vertices on in another precision than the file's: where scans contradict each other,
    # that may decide which side of a node the surface passes.
    assert out["triangles"] == pytest.approx(len(expected.mesh.triangles), rel=1e-3)
    off = surfrecon.distances(document.current.vertex_matrix(), expected.mesh) / (VOXEL / 64)
    assert (off < 0.3).mean() > 0.999 and off.max() < 2


SHORT = """
import os, resource, sys
sys.path[:0] = sys.argv[3:]
import numpy as np, pymeshlab, surfrecon
from shapes import torus_scans

pymeshlab.load_plugin(sys.argv[1])
length = getattr(pymeshlab, "PureValue", None) or pymeshlab.AbsoluteValue
# Its log goes to the standard error.
document = pymeshlab.MeshSet(verbose=True)
for image in torus_scans(pixels=160, noise=0.001):
    mesh, pose = image.triangulate(), np.asarray(image.world_from_sensor)
    positions = mesh.positions @ pose[:3, :3].T + pose[:3, 3]
    # Where many layers overlap, these take the memory, not the surface.
    for k in range(3):
        document.add_mesh(pymeshlab.Mesh(positions, np.asarray(mesh.triangles)), f"{image.name} {k}")
scans = len(document)
given = dict(voxel=length(1 / 128), close="None")
found = []
for room in (None, int(sys.argv[2])):
    for k in range(scans, len(document)):
        document.set_current_mesh(k)
        document.set_current_mesh_visibility(False)
    if room is not None:
        pages = int(open("/proc/self/statm").read().split()[0])
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + room, resource.RLIM_INFINITY))
    out = document.apply_filter("generate_surface_reconstruction_marching_intersections", **given)
    found.append((out["in_files"], document.current_mesh().vertex_matrix(), document.current_mesh().face_matrix()))
(one, *expected), (other, *made) = found
print(one, other, all(np.array_equal(a, b) for a, b in zip(expected, made)))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells how much address space there is")
def test_where_memory_is_short_it_works_in_files(tmp_path):
    """The memory of a process of its own is limited."""
    paths = [str(ROOT / "tests" / "python"), *sys.path]
    program = [sys.executable, "-c", SHORT, str(plugins() / "libfilter_surfrecon.so"), "180_000_000", *paths]
    environment = {**os.environ, "TMPDIR": str(tmp_path), "MALLOC_ARENA_MAX": "1"}
    done = subprocess.run(program, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "False True True"
    assert done.stderr.count("Memory was short, so the merge worked in temporary files") == 1, done.stderr
    assert not list(tmp_path.iterdir())
