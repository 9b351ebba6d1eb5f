"""More scans than memory holds, merged into a surface that it does hold."""

import numpy as np
import pytest
import shapes
import surfrecon

# The least that one thread does with: blocks of two bricks.
LEAST = 12_000_000
# Less than OPTIONS need in memory.
LITTLE = 20_000_000
OPTIONS = {"voxel": 0.012, "threads": 1}


@pytest.fixture(scope="module")
def scans():
    return shapes.torus_scans(pixels=100, noise=0.002)


@pytest.fixture
def workspace(tmp_path):
    folder = tmp_path / "workspace"
    folder.mkdir()
    yield folder
    assert not list(folder.iterdir())


@pytest.fixture(scope="module")
def in_memory(scans):
    return surfrecon.merge(scans, **OPTIONS)


def same(one, other):
    """Whether results are the same but for the way."""
    known = [
        {k: v for k, v in r.report.items() if k not in ("seconds", "working_bytes", "in_files")} for r in (one, other)
    ]
    assert known[0] == known[1]
    one, other = one.mesh, other.mesh
    np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_array_equal(one.triangles, other.triangles)
    for ones, others in (one.vertex_attributes, other.vertex_attributes), (one.face_attributes, other.face_attributes):
        assert list(ones) == list(others)
        for name in ones:
            np.testing.assert_array_equal(ones[name], others[name])


def test_the_surface_is_the_one_of_a_merge_in_memory(scans, in_memory, workspace):
    assert not in_memory.report.in_files
    for given in ({"workspace": workspace}, {"max_memory": LEAST, "workspace": workspace}, {"files": "always"}):
        found = surfrecon.merge(scans, **given, **OPTIONS)
        assert found.report.in_files
        same(found, in_memory)
    found = surfrecon.Job.merge(scans, measure=True, max_memory=LEAST, workspace=workspace, **OPTIONS).result()
    same(found, in_memory)
    assert found.distances.max() < 0.05


def test_files_are_used_where_they_are_needed(scans, in_memory, workspace):
    merger, options = surfrecon.Merger(scans), {"files": "if_needed", "workspace": workspace, **OPTIONS}
    for found in (
        surfrecon.merge(scans, **options),
        surfrecon.Job.merge(scans, **options).result(),
        merger.merge(**options),
        surfrecon.Job.merge(merger, **options).result(),
    ):
        assert not found.report.in_files
        same(found, in_memory)
    assert merger.renewed[0] == 0 < merger.renewed[1]
    merger.forget()
    with surfrecon.Context(memory_limit=LITTLE):
        with pytest.raises(surfrecon.OutOfMemoryError, match="a voxel of 0.012 .* fits"):
            surfrecon.merge(scans, **OPTIONS)
        for found in (
            surfrecon.merge(scans, measure=True, **options),
            merger.merge(**options),
            surfrecon.Job.merge(merger, **options).result(),
        ):
            assert found.report.in_files
            same(found, in_memory)
    assert merger.renewed == (0, 0)


def test_what_can_not_be_is_told(scans, workspace, tmp_path):
    def refused(error, text, **given):
        with pytest.raises(error, match=text):
            surfrecon.merge(scans, **{**OPTIONS, **given})

    none = tmp_path / "none"
    refused(surfrecon.InputError, "none: the workspace must be a folder that exists", workspace=none)
    refused(surfrecon.ParameterError, 'files must be "never", "if_needed" or "always"', files="perhaps")
    refused(surfrecon.InputError, "max_memory and workspace are for merges in files", files="never", workspace=none)
    refused(MemoryError, "merging in files needs 12 MB at least, .* 1 MB are given", max_memory=10**6)
    refused(surfrecon.InputError, "max_memory must be >= 0", max_memory=-1)
    refused(TypeError, "max_memory must be a whole number of bytes, got 'much'", max_memory="much")
    refused(MemoryError, "a voxel of 1e-7 .* fits|a voxel of 0.0000001 .* fits", voxel=1e-7, files="if_needed")
    with surfrecon.Context(memory_limit=10**7):
        refused(MemoryError, "10 MB are allowed", files="if_needed", workspace=workspace)


def test_cancelled_at_any_tick_it_leaves_nothing_and_progress_never_falls(scans, workspace):
    ticks = 0
    while True:
        left, last = ticks, 0.0

        def tick(_, fraction):
            nonlocal left, last
            assert fraction >= last
            left, last = left - 1, fraction
            return left >= 0

        given = {"files": "if_needed", "max_memory": LITTLE, "workspace": workspace}
        try:
            found = surfrecon.merge(scans, progress=tick, **given, **OPTIONS)
        except surfrecon.Cancelled:
            assert not list(workspace.iterdir())
        else:
            break
        ticks += 1 + ticks // 4
    assert found.report.in_files
    assert ticks > 2
