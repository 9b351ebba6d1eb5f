"""Aligning layers in MeshLab: matrices are found, vertices stay; what has no place, what is refused."""

import numpy as np
import pytest
import surfrecon
from conftest import ALIGN, IMPORT, length, matrix
from files import write_set
from shapes import torus


def rigid(seed):
    """A turn about any axis and a shift."""
    generator = np.random.default_rng(seed)
    q, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3] = q * np.sign(np.linalg.det(q))
    pose[:3, 3] = generator.normal(size=3) * 100
    return pose


@pytest.fixture(scope="module")
def images():
    """Four neighbours of nine views of the sculpture, with the poses that they were taken from."""
    mesh = surfrecon.sculpture(cell=3.0)
    images = surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=9, above=0, below=0, pixels=150)[:4])
    for k, image in enumerate(images):
        image.name = f"view{k}"
    return images


@pytest.fixture(scope="module")
def surfaces(images):
    """The same as meshes in their sensors' frames."""
    meshes = [image.triangulate() for image in images]
    return [(image.name, np.array(m.positions), np.array(m.triangles)) for image, m in zip(images, meshes, strict=True)]


def put(document, name, pose):
    """Places a layer by its matrix, which becomes the current one."""
    document.named(name)
    document.run("set_matrix", transformmatrix=pose, freeze=False)


@pytest.fixture
def heap(document, surfaces):
    """The meshes thrown about."""
    for k, (name, positions, triangles) in enumerate(surfaces):
        document.add(positions, triangles, name)
        put(document, name, rigid(k))
    document.named("view1")
    return document


def errors(document, images, moved=None):
    """How far vertices of each layer are from where they belong, in pixels, where the current layer is right.
    `moved`: by what the vertices of each layer were moved since they were in their sensor's frame."""
    truth = [
        image.world_from_sensor @ np.linalg.inv(m) for image, m in zip(images, moved or [np.eye(4)] * 4, strict=True)
    ]
    kept = matrix(document.named("view1")) @ np.linalg.inv(truth[1])
    off = []
    for image, pose in zip(images, truth, strict=True):
        layer = document.named(image.name)
        wrong = matrix(layer) - kept @ pose
        pixel = np.nanmedian(np.abs(np.diff(image.points[..., 0], axis=1)))
        off.append(np.linalg.norm(layer.vertex_matrix() @ wrong[:3, :3].T + wrong[:3, 3], axis=1).max() / pixel)
    document.named("view1")
    return off


def test_layers_find_their_places_and_the_current_one_stays(heap, surfaces, images):
    before = matrix(heap.named("view1")).copy()
    out = heap.run(ALIGN)
    assert out["scans_count"] == out["placed"] == 4 and out["groups_count"] == 1 and out["compared"] > 0
    assert np.array_equal(matrix(heap.named("view1")), before)
    assert max(errors(heap, images)) < 1.0
    for name, positions, triangles in surfaces:
        layer = heap.named(name)
        assert np.array_equal(layer.vertex_matrix(), positions) and np.array_equal(layer.face_matrix(), triangles)
    assert len(heap) == 4


@pytest.mark.parametrize("frozen", [False, True])
def test_imported_range_images(document, images, tmp_path, frozen):
    """Their vertices may have been moved since: their sensors were, too."""
    document.run(IMPORT, file=str(write_set(tmp_path, images)))
    moves = [rigid(10 + k) for k in range(4)]
    for image, move in zip(images, moves, strict=True):
        put(document, image.name, np.eye(4) if frozen else move)
        if frozen:
            document.run("set_matrix", transformmatrix=move, freeze=True)
    moved = moves if frozen else None
    document.named("view1")
    assert max(errors(document, images, moved)) > 5
    assert document.run(ALIGN)["placed"] == 4
    assert max(errors(document, images, moved)) < 1.0


def test_points_with_normals(heap, surfaces):
    for name, _, _ in surfaces:
        heap.named(name)
        heap.run("meshing_remove_all_faces")
    heap.named("view1")
    assert heap.run(ALIGN)["placed"] == 4


def test_rough_positions(document, surfaces, images):
    generator = np.random.default_rng(3)
    for (name, positions, triangles), image in zip(surfaces, images, strict=True):
        document.add(positions, triangles, name)
        off = np.eye(4)
        off[:3, 3] = generator.normal(size=3) * 3
        put(document, name, off @ image.world_from_sensor)
    document.named("view1")
    assert document.run(ALIGN, start="Rough", reach=length(16))["placed"] == 4
    assert max(errors(document, images)) < 1.0


def test_layers_that_nothing_decides_stay(document, surfaces, images):
    for (name, positions, triangles), image in zip(surfaces, images, strict=True):
        document.add(positions, triangles, name)
        put(document, name, image.world_from_sensor)
    across, down = np.meshgrid(np.arange(40.0) * 3, np.arange(40.0) * 3, indexing="ij")
    corners = np.arange(39 * 40).reshape(39, 40)[:, :39].ravel()
    triangles = np.concatenate([corners[:, None] + [0, 40, 1], corners[:, None] + [1, 40, 41]])
    document.add(np.stack([across, down, 0 * across], -1).reshape(-1, 3), triangles, "wall")
    aside = np.eye(4)
    aside[0, 3] = 400
    put(document, "wall", aside)
    document.named("view1")
    out = document.run(ALIGN, start="Rough", reach=length(16))
    assert (out["scans_count"], out["placed"]) == (5, 4)
    assert np.array_equal(matrix(document.named("wall")), aside)


def test_layers_in_the_order_they_were_taken(heap, images):
    assert heap.run(ALIGN, start="Sequence")["placed"] == 4
    assert max(errors(heap, images)) < 1.0


def test_hidden_layers_take_no_part(heap):
    heap.named("view3")
    heap.set.set_current_mesh_visibility(False)
    before = matrix(heap.current).copy()
    heap.named("view1")
    assert heap.run(ALIGN)["scans_count"] == 3
    assert np.array_equal(matrix(heap.named("view3")), before)


def test_what_fits_nothing_stays_where_it_is(heap):
    ring = torus()
    heap.add(np.asarray(ring.positions) * 40, np.asarray(ring.triangles), "ring")
    put(heap, "ring", rigid(7))
    before = matrix(heap.current).copy()
    heap.named("view1")
    out = heap.run(ALIGN)
    assert (out["scans_count"], out["placed"]) == (5, 4)
    assert np.array_equal(matrix(heap.named("ring")), before)


def test_a_single_layer_is_refused(document, surfaces, refused):
    document.add(*surfaces[0][1:], surfaces[0][0])
    assert "at least two layers" in refused(document.run, ALIGN)


def test_a_hidden_current_layer_is_refused(heap, refused):
    heap.set.set_current_mesh_visibility(False)
    assert "current layer" in refused(heap.run, ALIGN)


@pytest.mark.parametrize("scale", [[2.0, 2, 2, 1], [1.0, 1, -1, 1], [1.0, 1, 1.01, 1]])
def test_scaled_and_mirrored_layers_are_refused_by_name(heap, refused, scale):
    put(heap, "view2", np.diag(scale))
    before = {name: matrix(heap.named(name)).copy() for name in ["view0", "view1", "view2", "view3"]}
    said = refused(heap.run, ALIGN)
    assert '"view2" is scaled, sheared or mirrored' in said
    assert all(np.array_equal(matrix(heap.named(name)), pose) for name, pose in before.items())


def test_points_without_normals_are_refused_by_name(heap, refused):
    heap.add(np.random.default_rng(0).random((50, 3)), name="a cloud")
    said = refused(heap.run, ALIGN)
    assert '"a cloud"' in said and "no normals" in said


@pytest.mark.parametrize(
    ("parameters", "said"),
    [({"min_overlap": 2.0}, "min_overlap"), ({"tolerance": length(-1)}, "tolerance"), ({"reach": length(-1)}, "reach")],
)
def test_wrong_parameters_are_named(heap, refused, parameters, said):
    assert said in refused(heap.run, ALIGN, **parameters)
