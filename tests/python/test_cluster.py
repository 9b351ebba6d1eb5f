"""Clustering through Python: a dense mesh in, well-shaped triangles out."""

import json

import numpy as np
import pytest
import surfrecon


@pytest.fixture(scope="module")
def bumpy():
    """A sheet with a hole, as a mesh with colours."""
    y, x = np.mgrid[:80, :90] / 20.0
    heights = 0.3 * np.sin(x) * np.cos(y)
    heights[30:45, 50:70] = np.nan
    mesh = surfrecon.RangeImage.orthographic(heights, step=(0.05, -0.05)).triangulate()
    colour = np.tile(np.array([[10, 20, 30, 255]], dtype=np.uint8), (len(mesh.positions), 1))
    return surfrecon.Mesh(mesh.positions, mesh.triangles, colour=colour)


def topology(mesh):
    check = mesh.check()
    assert check["is_manifold"]
    return check["components"], check["boundary_loops"], check["genus"]


def test_as_many_vertices_as_asked_for_and_the_same_topology(bumpy):
    result = surfrecon.cluster(bumpy, vertices=400)
    assert len(result.mesh.positions) == 400 == result.report["vertices"]
    assert topology(result.mesh) == topology(bumpy) == (1, 2, 0)
    assert np.abs(surfrecon.distances(result.mesh.positions, bumpy)).max() < 1e-9
    report = result.report
    assert np.degrees(report["after"]["mean_smallest_angle"]) > 50
    assert np.degrees(report["after"]["smallest_angle"]) > 30
    assert report["after"]["mean_smallest_angle"] > report["before"]["mean_smallest_angle"]
    assert sum(report["after"]["angles"]) == 3 * len(result.mesh.triangles)
    assert (result.mesh.vertex_attributes["colour"] == [10, 20, 30, 255]).all()


@pytest.mark.parametrize("wanted", [300, 777])
def test_as_many_triangles_as_asked_for_and_how_far_they_are_off(bumpy, wanted):
    result = surfrecon.cluster(bumpy, triangles=wanted)
    assert wanted - 1 <= len(result.mesh.triangles) == result.report["triangles"] <= wanted
    assert topology(result.mesh) == topology(bumpy)
    used = np.unique(np.asarray(bumpy.triangles))
    distances = np.abs(surfrecon.distances(np.asarray(bumpy.positions)[used], result.mesh))
    assert np.sqrt((distances**2).mean()) == pytest.approx(result.report["rms_error"], rel=1e-9)
    both = [surfrecon.surface_distance(*pair)["reached"] for pair in ((bumpy, result.mesh), (result.mesh, bumpy))]
    assert max(both) <= result.report["max_error"] <= 1.02 * max(both)
    text = repr(result)
    assert f"{len(result.mesh.triangles)} triangles, at most" in text


def test_levels_may_count_triangles(bumpy):
    levels = surfrecon.cluster_levels(bumpy, [800, 200], levels_of="triangles")
    job = surfrecon.Job.cluster(bumpy, levels=[800, 200], levels_of="triangles").result()
    for level, other, wanted in zip(levels, job, [800, 200], strict=True):
        assert wanted - 1 <= len(level.mesh.triangles) <= wanted
        assert np.array_equal(level.mesh.positions, other.mesh.positions)
    with pytest.raises(surfrecon.InputError, match='levels_of must be "vertices" or "triangles", got "edges"'):
        surfrecon.cluster_levels(bumpy, [800], levels_of="edges")


def test_patches_are_those_of_the_vertices(bumpy):
    result = surfrecon.cluster(bumpy, patches=100)
    labels = result.labels
    assert labels.dtype == np.int32 and labels.shape == (len(bumpy.positions),)
    used = np.unique(np.asarray(bumpy.triangles))
    assert set(np.unique(labels[used])) == set(range(result.report["patches"]))


def test_an_error_bound_is_kept(bumpy):
    result = surfrecon.cluster(bumpy, max_error=0.02)
    used = np.unique(np.asarray(bumpy.triangles))
    worst = np.abs(surfrecon.distances(np.asarray(bumpy.positions)[used], result.mesh)).max()
    assert worst <= result.report["max_error"] <= 0.02
    for one, other in ((bumpy, result.mesh), (result.mesh, bumpy)):
        # Between the vertices, too, and both ways.
        assert surfrecon.surface_distance(one, other)["reached"] <= result.report["max_error"]
    assert len(result.mesh.positions) < len(bumpy.positions) / 2


def ball():
    """Points of a sphere in equal steps of height and the golden angle, by which none are near others."""
    i = np.arange(3000) + 0.5
    height, angle = 1 - 2 * i / 3000, i * np.pi * (3 - np.sqrt(5))
    around = np.sqrt(1 - height**2)
    return np.stack([around * np.cos(angle), around * np.sin(angle), height], 1)


def test_points_become_a_closed_surface():
    points = np.concatenate([ball(), [[0, 0, 0], [np.nan, 0, 0]]])
    result = surfrecon.cluster(points, vertices=300)
    assert topology(result.mesh) == (1, 0, 0) and len(result.mesh.positions) == 300
    assert result.labels.shape == (3002,) and (result.labels[:-2] >= 0).all() and (result.labels[-2:] == -1).all()
    assert result.report["off_surface"] == 2
    assert np.degrees(result.report["after"]["mean_smallest_angle"]) > 50
    fine, coarse = surfrecon.cluster_levels(points, [300, 50])
    assert len(fine.mesh.positions) == 300 and topology(coarse.mesh) == (1, 0, 0)
    bound = surfrecon.Job.cluster(points, max_error=0.02).result()
    assert np.abs(surfrecon.distances(ball(), bound.mesh)).max() <= 0.02


def test_points_without_a_surface_are_refused():
    with pytest.raises(surfrecon.InputError, match="at least 3 different points"):
        surfrecon.cluster(np.zeros((9, 3)))
    with pytest.raises(surfrecon.InputError, match="points"):
        surfrecon.cluster(np.zeros((9, 2)))


def test_levels_come_from_one_run(bumpy):
    levels = surfrecon.cluster_levels(bumpy, [100, 400, 200], seed=3)
    assert [len(level.mesh.positions) for level in levels] == [100, 400, 200]
    again = surfrecon.cluster_levels(bumpy, [100, 400, 200], seed=3, threads=1)
    for level, other in zip(levels, again, strict=True):
        assert np.array_equal(level.mesh.positions, other.mesh.positions)
        assert np.array_equal(level.mesh.triangles, other.mesh.triangles)


def test_a_chain_is_written_as_levels_of_detail(bumpy, tmp_path):
    levels = surfrecon.cluster_levels(bumpy, [400, 100, 25])
    finest, *coarser = [level.mesh for level in levels]
    finest.write(tmp_path / "chain.glb", coarser=coarser)
    data = (tmp_path / "chain.glb").read_bytes()
    document = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    assert "MSFT_lod" in document["extensionsUsed"]
    counts = {document["accessors"][m["primitives"][0]["attributes"]["POSITION"]]["count"] for m in document["meshes"]}
    assert counts == {400, 100, 25}


def test_a_job_does_the_same(bumpy):
    one = surfrecon.Job.cluster(bumpy, vertices=200).result()
    assert np.array_equal(one.mesh.positions, surfrecon.cluster(bumpy, vertices=200).mesh.positions)
    chain = surfrecon.Job.cluster(bumpy, levels=[200]).result()
    assert isinstance(chain, list) and np.array_equal(chain[0].mesh.positions, one.mesh.positions)
    with pytest.raises(surfrecon.InputError, match="levels must go without"):
        surfrecon.Job.cluster(bumpy, levels=[200], vertices=200)
    job = surfrecon.Job.cluster(bumpy, max_error=1e-6)
    job.cancel()
    with pytest.raises(surfrecon.Cancelled):
        job.result()


def test_what_cannot_be_done_is_named(bumpy):
    with pytest.raises(surfrecon.InputError, match="one of vertices, patches, max_error and triangles"):
        surfrecon.cluster(bumpy, vertices=10, patches=10)
    with pytest.raises(surfrecon.ParameterError, match="vertices must be >= 1 and <= 4000000000, got 0"):
        surfrecon.cluster(bumpy, vertices=0)
    with pytest.raises(surfrecon.ParameterError, match="max_error must be a finite number > 0, got -1"):
        surfrecon.cluster(bumpy, max_error=-1.0)
    with pytest.raises(surfrecon.InputError, match="no triangle"):
        surfrecon.cluster(surfrecon.Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)))
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.cluster(bumpy, max_error=1e-6, progress=lambda stage, fraction: False)
