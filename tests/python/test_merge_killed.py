"""Merges that are killed go on where they were: what was whole is not made again."""

import pytest
import shapes
import surfrecon
from killing import killable, merge_killed, task_killed
from surfrecon import distributed

pytestmark = [killable, pytest.mark.thorough]

# One thread, and the least that it does with: blocks of two bricks.
OPTIONS = {"voxel": 0.02, "threads": 1, "max_memory": 12_000_000}
# Of the times that the progress is told, counted from 0.
TIMES = (0, 1, 3, 9)


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    """A list of scans in files."""
    return shapes.torus_files(tmp_path_factory)


@pytest.fixture(scope="module")
def by_one(scans, tmp_path_factory):
    """The bytes of a merge that nobody stops."""
    path = tmp_path_factory.mktemp("one") / "surface.ply"
    surfrecon.merge_to_file(surfrecon.open(scans), path, **OPTIONS)
    return path.read_bytes()


def whole(workspace):
    """Of the files that are whole, below a workspace: when they were written."""
    files = [path for path in workspace.rglob("*") if path.is_file() and path.name != "lock"]
    return {path.name: path.stat().st_mtime_ns for path in files if not path.name.startswith("unfinished-")}


def check_stayed(before, now):
    """Files that were there are as they were, unless nobody wants them any more."""
    again = [name for name in before if now.get(name, before[name]) != before[name]]
    assert not again, again


@pytest.mark.parametrize("keep", [False, True])
def test_tasks_that_are_killed_at_any_time_go_on(scans, by_one, tmp_path, keep):
    workspace = tmp_path / "workspace"
    workspace.mkdir()
    given = {"workspace": workspace, "tasks": 2, "keep": keep, **OPTIONS}
    plan = distributed.Plan.make(tmp_path / "plan.json", scans, tmp_path / "surface.ply", **given)
    killed = set()
    for stage in plan.stages:
        for at in TIMES:
            before = whole(workspace)
            if task_killed(plan, stage.tasks.start, at):
                killed.add((stage.name, at))
            else:
                break
            check_stayed(before, whole(workspace))
        before = whole(workspace)
        for number in stage.tasks:
            plan.run(number)
        check_stayed(before, whole(workspace))
    # Each stage tells when it begins and when it ends.
    assert killed >= {(stage.name, at) for stage in plan.stages for at in TIMES[:2]}
    assert (tmp_path / "surface.ply").read_bytes() == by_one
    plan.remove()
    left = [path.name for path in tmp_path.rglob("*")]
    assert not [name for name in left if name.startswith(("unfinished-", "done-", "plan."))]
    assert keep or sorted(left) == ["surface.ply", "workspace"]


def test_a_merge_that_keeps_goes_on_where_it_was_killed(scans, by_one, tmp_path):
    workspace, path = tmp_path / "workspace", tmp_path / "surface.ply"
    workspace.mkdir()
    given = {"workspace": workspace, "keep": True, **OPTIONS}
    at, kinds = 0, set()
    while True:
        before = whole(workspace)
        if not merge_killed(scans, path, at, **given):
            break
        now = whole(workspace)
        check_stayed(before, now)
        kinds |= {name.split("-")[0] for name in now}
        at += 2
        assert not path.exists() or path.read_bytes() == by_one
    now = whole(workspace)
    check_stayed(before, now)
    # Of what was whole nothing was wanted no more but the marks.
    gone = {name.split("-")[0] for name in before.keys() - now.keys()}
    assert gone <= {"done", "scans", "known"}
    assert at > 4 and kinds >= {"segment", "block", "done"}
    assert path.read_bytes() == by_one
    assert not [file for file in tmp_path.rglob("unfinished-*")]
