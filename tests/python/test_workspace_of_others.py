"""Files of others that lie in the workspace, whatever they are called: no merge touches them, however it ends."""

import pytest
import shapes
import surfrecon
from killing import killable, merge_killed, task_killed
from others import looked_at, ours, put
from surfrecon import distributed

OPTIONS = {"voxel": 0.02, "threads": 1, "max_memory": 12_000_000}


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    """A list of scans in files."""
    return shapes.torus_files(tmp_path_factory)


@pytest.fixture
def workspace(tmp_path):
    """A folder that others have files in; at the end, and whenever a test looks, these are as they were."""
    workspace = tmp_path / "workspace"
    before = put(workspace)
    yield workspace
    assert looked_at(workspace) == before


@pytest.mark.parametrize("keep", [False, True])
def test_a_merge_and_one_that_is_cancelled_leave_them(scans, workspace, tmp_path, keep):
    given = {"workspace": workspace, "keep": keep, **OPTIONS}
    cancelled = []
    for most in (0, 2, 5, 10):
        ticks = iter([True] * most)
        try:
            tick = lambda *_, ticks=ticks: next(ticks, False)  # noqa: E731
            surfrecon.merge_to_file(surfrecon.open(scans), tmp_path / "a.ply", progress=tick, **given)
        except surfrecon.Cancelled:
            cancelled.append(most)
        assert keep or not ours(workspace)
    # The kept work of one makes the next shorter.
    assert cancelled[:2] == [0, 2]
    for _ in range(2):
        surfrecon.merge_to_file(surfrecon.open(scans), tmp_path / "a.ply", **given)
        assert len(ours(workspace)) == keep


@killable
@pytest.mark.parametrize("keep", [False, True])
def test_a_merge_that_is_killed_leaves_them(scans, workspace, tmp_path, keep):
    given = {"workspace": workspace, "keep": keep, **OPTIONS}
    assert merge_killed(scans, tmp_path / "a.ply", 2, **given)
    merge_killed(scans, tmp_path / "a.ply", 8, **given)
    surfrecon.merge_to_file(surfrecon.open(scans), tmp_path / "a.ply", **given)


@killable
@pytest.mark.parametrize("keep", [False, True])
def test_tasks_leave_them(scans, workspace, tmp_path, keep):
    given = {"workspace": workspace, "keep": keep, "tasks": 2, **OPTIONS}
    plan = distributed.Plan.make(None, scans, tmp_path / "a.ply", **given)
    for stage in plan.stages:
        assert task_killed(plan, stage.tasks.start, 0)
        for number in stage.tasks:
            plan.run(number)
    plan.remove()
    assert len(ours(workspace)) == keep
    plan = distributed.Plan.make(None, scans, tmp_path / "b.ply", **given)
    plan.run(0)
    plan.clear()
    plan.remove()
    assert not ours(workspace)
