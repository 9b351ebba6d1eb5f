"""Filters that keep, remove, scale and level layers in MeshLab."""

import numpy as np
import pytest
import surfrecon
from conftest import BACKGROUND, IMPORT, MERGE, REGION, SIZE_AND_GROUND, length, matrix, scalars
from files import write_set
from shapes import torus, torus_scans


def world(layer):
    pose = matrix(layer)
    return layer.vertex_matrix() @ pose[:3, :3].T + pose[:3, 3]


def cube(low, high):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    return np.array(low) + corners * (np.array(high) - np.array(low))


@pytest.fixture
def ring(document):
    mesh = torus()
    document.add(mesh.positions, np.asarray(mesh.triangles), "ring")
    return document


@pytest.fixture
def imported(document, tmp_path):
    """Range images as layers."""
    document.run(IMPORT, file=str(write_set(tmp_path, torus_scans(pixels=90, noise=0.004))))
    return document


def test_a_layer_s_box_is_the_region(ring):
    box = surfrecon.Box.between((-2, -2, -0.1), (0.4, 2, 2))
    positions = np.asarray(torus().positions)
    ring.add(cube((-2, -2, -0.1), (0.4, 2, 2)), name="box")
    out = ring.run(REGION, what="Keep", box_layer=1)
    kept = ring.named("ring")
    expected = torus().keep(box)
    assert np.array_equal(kept.vertex_matrix(), expected.positions)
    assert np.array_equal(kept.face_matrix(), expected.triangles)
    assert out["left"] == len(expected.positions) and out["removed"] == len(positions) - len(expected.positions)
    assert ring.named("box").vertex_number() == 8
    before = kept.vertex_number()
    ring.run(REGION, region="Below a plane", plane_point=[0, 0, 0.1], plane_normal=[0, 0, 2], margin=length(0.05))
    layer = ring.named("ring")
    assert layer.vertex_matrix()[:, 2].min() > 0.15 and 0 < layer.vertex_number() < before


def test_the_selection_is_a_region(ring):
    ring.set.compute_selection_by_condition_per_vertex(condselect="(x > 0)")
    ring.run(REGION, region="Selected vertices")
    mesh = torus()
    assert np.array_equal(ring.current.vertex_matrix(), mesh.remove(np.asarray(mesh.positions)[:, 0] > 0).positions)


def test_range_images_stay_range_images(imported):
    """Only what is taken as a range image has its noise measured."""
    whole = imported.run(MERGE, voxel=length(0.08))["noise"]
    imported.set.delete_current_mesh()
    count = len(imported)
    out = imported.run(REGION, region="Below a plane", plane_point=[0, 0, 0.05], plane_normal=[0.2, 0.1, 1])
    assert out["removed"] > 0 and out["left"] > 0
    plane = surfrecon.Plane((0, 0, 0.05), (0.2, 0.1, 1))
    for layer in imported.layers():
        assert (plane.height(world(layer)) > -1e-6).all()
        assert len(scalars(layer, "range_row")) == layer.vertex_number()
    out = imported.run(MERGE, voxel=length(0.08))
    assert whole > 0 and out["noise"] == pytest.approx(whole, rel=0.4) and out["scans"] <= count


def test_layers_of_few_vertices_stay_range_images(document, tmp_path):
    """Vertices in a point or on a line do not tell where they were moved. Their matrix does."""
    images = torus_scans(pixels=90, noise=0.004)
    row, col = np.argwhere(images[1].valid)[1000]
    in_row, alone = np.zeros(images[1].valid.shape, bool), np.zeros(images[2].valid.shape, bool)
    in_row[row] = True
    alone[tuple(np.argwhere(images[2].valid)[1000])] = True
    images[1], images[2] = images[1].keep(in_row), images[2].keep(alone)
    document.run(IMPORT, file=str(write_set(tmp_path, images)))
    assert document.run(MERGE, voxel=length(0.08))["scans"] >= len(images) - 2
    document.set.delete_current_mesh()
    # A slab that leaves a vertex or a few of many layers.
    heights = np.concatenate([world(layer)[:, 2] for layer in document.layers()])
    edge = float(np.sort(heights)[40])
    out = document.run(REGION, what="Keep", region="Below a plane", plane_point=[0, 0, edge], plane_normal=[0, 0, 1])
    assert 30 < out["left"] < 60
    document.run(REGION, what="Keep", region="Below a plane", plane_point=[0, 0, edge + 1], plane_normal=[0, 0, 1])


def table(document):
    mesh = torus()
    side = np.array([[-3, -3, -0.6], [3, -3, -0.6], [3, 3, -0.6], [-3, 3, -0.6]], float)
    i, j = np.meshgrid(np.arange(61), np.arange(61), indexing="ij")
    flat = np.stack([i * 0.1 - 3, j * 0.1 - 3, np.full(i.shape, -0.6)], -1).reshape(-1, 3)
    a = (i[:-1, :-1] * 61 + j[:-1, :-1]).reshape(-1)
    faces = np.concatenate([np.stack([a, a + 61, a + 62], 1), np.stack([a, a + 62, a + 1], 1)])
    tilt = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0], [0.48, 0.64, 0.6]])
    document.add(np.asarray(mesh.positions) @ tilt.T, np.asarray(mesh.triangles), "ring")
    document.add(flat @ tilt.T, faces, "table")
    return tilt, side


def test_the_background_goes(document):
    tilt, _ = table(document)
    out = document.run(BACKGROUND)
    ring = np.asarray(torus().positions)
    assert document.named("table").vertex_number() == 0
    assert document.named("ring").vertex_number() > 0.95 * len(ring)
    assert (document.named("ring").vertex_matrix() @ tilt)[:, 2].min() > -0.6
    assert 0.3 < out["share"] < 0.9 and out["margin"] > 0


def test_true_size_and_ground(document):
    tilt, side = table(document)
    a, b = tilt @ side[0], tilt @ side[1]
    out = document.run(SIZE_AND_GROUND, distance=12, a=a, b=b, ground="The plane most vertices lie on")
    assert out["scale"] == pytest.approx(2)
    flat, ring = world(document.named("table")), world(document.named("ring"))
    assert np.abs(flat[:, 2]).max() < 1e-5 and ring[:, 2].min() > 0
    assert np.ptp(flat, axis=0).max() > 11.9
    pose = matrix(document.named("ring"))[:3, :3]
    assert np.allclose(pose @ pose.T, np.eye(3), atol=1e-6)
    picks = [flat[0], flat[5], flat[61 * 7]]
    document.run(
        SIZE_AND_GROUND, ground="Through three places", ground_1=picks[0], ground_2=picks[1], ground_3=picks[2], up="y"
    )
    assert np.abs(world(document.named("table"))[:, 1]).max() < 1e-5
    assert world(document.named("ring"))[:, 1].min() > 0


def test_range_images_in_true_size_are_range_images(imported):
    whole = imported.run(MERGE, voxel=length(0.08))["noise"]
    merged = imported.current.vertex_matrix()
    imported.run(SIZE_AND_GROUND, distance=10, a=[0, 0, 0], b=[0, 0, 1])
    assert np.allclose(imported.current.vertex_matrix(), 10 * merged)
    imported.set.delete_current_mesh()
    out = imported.run(MERGE, voxel=length(0.8))
    assert out["noise"] == pytest.approx(10 * whole, rel=0.01) and whole > 0
    assert np.abs(imported.current.vertex_matrix()).max() > 12


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        (REGION, {"region": "Selected vertices"}, "No vertex is selected"),
        (REGION, {"box_layer": 0}, "No layer but the box is visible"),
        (REGION, {"region": "Below a plane", "plane_normal": [0, 0, 0]}, "the normal of the plane"),
        (REGION, {"region": "Below a plane", "plane_point": [0, 0, 99]}, "Nothing would be left"),
        (BACKGROUND, {"min_share": 0.9}, "no plane stands out"),
        (SIZE_AND_GROUND, {}, "Nothing is asked for"),
        (SIZE_AND_GROUND, {"distance": 3, "a": [1, 1, 1], "b": [1, 1, 1]}, "pick two that lie apart"),
        (SIZE_AND_GROUND, {"distance": -3}, "at least 0"),
        (SIZE_AND_GROUND, {"ground": "Through three places", "ground_3": [5, 0, 0]}, "on one line"),
    ],
)
def test_bad_input_is_refused(ring, refused, name, parameters, words):
    before = ring.current.vertex_matrix()
    assert words in refused(ring.run, name, **parameters)
    assert np.array_equal(ring.current.vertex_matrix(), before)
