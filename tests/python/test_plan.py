"""Merges that are planned as tasks: any order, twice, again, in other processes."""

import concurrent.futures
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import shapes
import surfrecon
from command_line import run
from surfrecon import distributed

OPTIONS = {"voxel": 0.02, "threads": 1}
# The least memory that two threads need.
LEAST = 24_000_000


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    """A list of scans in files."""
    return shapes.torus_files(tmp_path_factory)


@pytest.fixture(scope="module")
def by_one(scans, tmp_path_factory):
    """The bytes that one process makes, and its report."""
    path = tmp_path_factory.mktemp("one") / "surface.ply"
    report = surfrecon.merge_to_file(surfrecon.open(scans), path, **OPTIONS)
    return path.read_bytes(), report


def planned(tmp_path, scans, **given):
    given = {"tasks": 3, "max_memory": LEAST} | OPTIONS | given
    return distributed.Plan.make(tmp_path / "plan.json", scans, tmp_path / "surface.ply", **given)


def every(plan):
    return [number for stage in plan.stages for number in stage.tasks]


def test_all_tasks_make_what_one_process_makes(scans, by_one, tmp_path):
    plan = planned(tmp_path, scans)
    assert [stage.name for stage in plan.stages][:2] == ["plan", "collect"]
    assert every(plan) == list(range(plan.stages[-1].tasks.stop))
    for stage in plan.stages:
        # In another order, and each again by who reads the plan anew.
        for number in reversed(stage.tasks):
            assert plan.run(number)["stage"] == stage.name
            if stage.name != "write":
                again = distributed.Plan.read(plan.path).run(number, threads=2)
                assert (again["stage"], again["task"]) == (stage.name, number)
    found = distributed.Plan.read(plan.path).run(every(plan)[-1])
    assert (tmp_path / "surface.ply").read_bytes() == by_one[0]
    report = surfrecon.MergeReport(found["report"])
    for name in by_one[1]:
        if name not in ("seconds", "working_bytes", "voxel_reason"):
            assert json.loads(report.json())[name] == json.loads(by_one[1].json())[name], name
    plan.remove()
    assert os.listdir(tmp_path) == ["surface.ply"]


def test_tasks_that_are_late_find_all_done(scans, by_one, tmp_path):
    plan, late = planned(tmp_path, scans), distributed.Plan.read(tmp_path / "plan.json")
    for number in every(plan):
        written = plan.run(number)
    plan.clear()
    # One that has read the plan before, as does one that is run again by its scheduler.
    for reader in (late, distributed.Plan.read(plan.path)):
        assert reader.run(0) == {"stage": "plan", "task": 0, "seconds": 0.0}
        again = reader.run(every(plan)[-1])
        assert (again["output"], again["report"]) == (written["output"], written["report"])
    (tmp_path / "surface.ply").write_bytes(by_one[0][:-1])
    with pytest.raises(surfrecon.FileError, match="the folder of the tasks is not there: plan the merge anew"):
        plan.run(0)
    # Planned anew it is made anew.
    plan = planned(tmp_path, scans)
    for number in every(plan):
        plan.run(number)
    assert (tmp_path / "surface.ply").read_bytes() == by_one[0]


def test_what_is_kept_serves_scans_that_come_and_go(tmp_path):
    """Bytes as of a first merge; nothing of the workspace is removed but what nobody wants any more."""
    scans = shapes.torus_scans(pixels=60, noise=0.002)
    surface, workspace = tmp_path / "surface.ply", tmp_path / "workspace"
    workspace.mkdir()
    (workspace / "notes.txt").write_text("somebody's")
    for number, case in enumerate([scans, scans[1:], scans]):
        listed = tmp_path / f"{len(case)}-{number}" / "scans.conf"
        listed.parent.mkdir()
        surfrecon.write_scans(listed, case)
        plan = planned(tmp_path, listed, workspace=workspace, keep=True)
        for task in every(plan):
            plan.run(task)
        plan.remove()
        expected = tmp_path / "expected.ply"
        surfrecon.merge_to_file(surfrecon.open(listed), expected, **OPTIONS)
        assert surface.read_bytes() == expected.read_bytes()
        assert sorted(os.listdir(workspace)) == ["notes.txt", plan.name]
        assert not [name for name in os.listdir(plan.folder) if name.startswith("done-")]
    with pytest.raises(surfrecon.InputError, match="keep needs a workspace that is a folder, not an object store"):
        planned(tmp_path, listed, workspace="memory://work", keep=True)


def test_a_surface_in_parts(scans, by_one, tmp_path):
    plan = planned(tmp_path, scans, part_triangles=sum(by_one[1].faces) // 3 + 1)
    for task in every(plan):
        plan.run(task)
    plan.remove()
    names = sorted(os.listdir(tmp_path))
    report = by_one[1]
    most = sum(report.faces) // 3 + 1
    count = 3
    assert names == [*(f"surface-{k}-of-{count}.ply" for k in range(2, count + 1)), "surface.ply"]
    parts = [surfrecon.open(tmp_path / name)[0].read() for name in [names[-1], *names[:-1]]]
    assert all(len(part.triangles) <= most for part in parts)
    path = tmp_path / "whole.ply"
    path.write_bytes(by_one[0])
    whole = surfrecon.open(path)[0].read()
    corners = np.concatenate([part.positions[part.triangles] for part in parts])
    assert np.array_equal(corners, whole.positions[whole.triangles])


def test_the_command_line_keeps_and_cuts(scans, by_one, tmp_path):
    most = sum(by_one[1].faces) // 2 + 1
    options = ["--voxel", "0.02", "--part-triangles", str(most)]
    made = ["surface-2-of-2.ply", "surface.ply"]
    plan = [tmp_path / "merge.json", "--surface", tmp_path / "surface.ply", "--tasks", "2", "--keep", *options]
    for _ in range(2):
        run("plan", scans, "-o", *plan)
        run("task", tmp_path / "merge.json")
        (kept,) = [name for name in os.listdir(tmp_path) if name.startswith("surfrecon-merge-")]
        assert sorted(os.listdir(tmp_path)) == ["merge.json", *made, kept]
        assert [name for name in os.listdir(tmp_path / kept) if name.startswith("segment-")]
    parts = [(tmp_path / name).read_bytes() for name in made]
    folder = tmp_path / "at once"
    folder.mkdir()
    for given in ([], ["--workspace", tmp_path]):
        run("merge", scans, "-o", folder / "surface.ply", "--threads", "1", *options, *given)
        assert sorted(os.listdir(folder)) == made
        for part, name in zip(parts, made, strict=True):
            # But for the provenance that the header has.
            assert (folder / name).read_bytes().split(b"end_header")[1] == part.split(b"end_header")[1]
    refused = run("merge", scans, "-o", folder / "surface.glb", "--part-triangles", "9", check=False)
    assert refused.returncode == 2 and "surface.glb: only .ply is written piece by piece" in refused.stderr
    copies = tmp_path / "copies"
    copies.mkdir()
    (copies / "surface-1-of-2.ply").write_bytes((folder / "surface.ply").read_bytes())
    given = ["-o", copies / "surface.ply", "--workspace", tmp_path, "--part-triangles", "9"]
    refused = run("merge", copies / "surface-1-of-2.ply", *given, check=False)
    assert refused.returncode == 1 and "is a scan, and called as a part of" in refused.stderr


def in_another_process(path, number):
    return subprocess.run(
        [sys.executable, "-m", "surfrecon", "task", path, str(number)], check=False, capture_output=True
    )


def test_processes_at_once_each_task_twice(scans, by_one, tmp_path):
    plan = planned(tmp_path, scans, tasks=2)
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        for stage in plan.stages[:-1]:
            for done in pool.map(in_another_process, [plan.path] * 4, [*stage.tasks, *stage.tasks]):
                assert done.returncode == 0, done.stderr
    done = in_another_process(plan.path, every(plan)[-1])
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "surface.ply").read_bytes() == by_one[0]
    assert sorted(os.listdir(tmp_path)) == ["plan.json", "surface.ply"]


WRITE = """
import os, sys, time
from surfrecon import distributed

plan, last, go = distributed.Plan.read(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
print("ready", flush=True)
while not os.path.exists(go):
    pass
print(plan.run(last)["report"]["faces"])
"""


@pytest.mark.parametrize("keep", [False, True])
def test_two_processes_write_the_surface_at_once(scans, by_one, tmp_path, keep):
    for attempt in range(6):
        plan = planned(tmp_path, scans, tasks=2, keep=keep)
        *before, last = every(plan)
        for number in before:
            plan.run(number)
        go = tmp_path / f"go {attempt}"
        command = [sys.executable, "-c", WRITE, plan.path, str(last), go]
        both = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)]
        for process in both:
            assert process.stdout.readline() == "ready\n"
        go.touch()
        said = [process.communicate(timeout=60) for process in both]
        assert [process.returncode for process in both] == [0, 0], said
        assert said[0] == said[1] and said[0][0].strip() == str(list(by_one[1].faces)), said
        assert (tmp_path / "surface.ply").read_bytes() == by_one[0]
        plan.remove()
        (tmp_path / "surface.ply").unlink()
        go.unlink()
    assert os.listdir(tmp_path) == ([plan.name] if keep else [])


@pytest.mark.skipif(sys.platform == "win32", reason="no process is killed so that it can't clean up")
def test_it_goes_on_where_it_was_killed(scans, by_one, tmp_path):
    plan = planned(tmp_path, scans, tasks=2)
    killed, wait = 0, 0.25
    while True:
        process = subprocess.Popen([sys.executable, "-m", "surfrecon", "task", "-q", plan.path])
        try:
            assert process.wait(wait) == 0
            break
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.wait()
            killed, wait = killed + 1, wait + 0.1
            if not os.path.exists(plan.folder):
                break  # all was done but for its end
    assert killed > 0
    assert (tmp_path / "surface.ply").read_bytes() == by_one[0]


def test_what_was_planned_before_goes_on(scans, tmp_path):
    first = planned(tmp_path, scans)
    first.run(0)
    first.run(1)
    # As it was planned, by another number of threads.
    again = planned(tmp_path, scans, threads=2)
    assert (again.folder, again.threads) == (first.folder, 2)
    began = time.monotonic()
    again.run(1)
    assert time.monotonic() - began < 5
    assert planned(tmp_path, scans, tasks=4).folder != first.folder
    assert planned(tmp_path, scans, voxel=0.03).folder != first.folder


def test_plans_and_their_files_may_lie_elsewhere(scans, by_one, tmp_path):
    here = tmp_path / "here"
    here.mkdir()
    surfrecon.write_scans(here / "scans.conf", shapes.torus_scans(pixels=60, noise=0.002))
    plan = planned(here, here / "scans.conf")
    for number in every(plan)[:4]:
        plan.run(number)
    here.rename(tmp_path / "there")
    plan = distributed.Plan.read(tmp_path / "there" / "plan.json")
    for number in every(plan):
        plan.run(number)
    assert (tmp_path / "there" / "surface.ply").read_bytes() == by_one[0]


def test_what_is_not_done_yet_is_named(scans, tmp_path):
    plan = planned(tmp_path, scans)
    plan.run(0)
    plan.run(2)
    for number, text in [(4, "task 1 (collect) is not done: overlap needs it first"), (9, "task 5 (fuse) is not done")]:
        with pytest.raises(surfrecon.InputError) as problem:
            plan.run(number)
        assert text in str(problem.value)
    with pytest.raises(surfrecon.InputError, match="there is no task 99: give one from 0 to"):
        plan.run(99)
    plan.clear()
    with pytest.raises(surfrecon.FileError, match="the folder of the tasks is not there: plan the merge anew"):
        plan.run(1)


def test_scans_that_change_or_vanish_are_named(tmp_path):
    folder = tmp_path / "scans"
    folder.mkdir()
    surfrecon.write_scans(folder / "scans.conf", shapes.torus_scans(pixels=40))
    plan = planned(tmp_path, folder / "scans.conf")
    plan.run(0)
    changed = sorted(folder.glob("*.ply"))[1]
    before = changed.read_bytes()
    status = changed.stat()
    changed.write_bytes(before + b" ")
    for reader in (plan, distributed.Plan.read(plan.path)):
        with pytest.raises(surfrecon.InputError) as problem:
            reader.run(1)
        assert changed.name in str(problem.value) and "has changed since" in str(problem.value)
    changed.write_bytes(before)
    os.utime(changed, ns=(status.st_atime_ns, status.st_mtime_ns))
    plan.run(1)
    changed.unlink()
    for reader in (plan, distributed.Plan.read(plan.path)):
        with pytest.raises((surfrecon.FileError, surfrecon.FormatError)) as gone:
            reader.run(2)
        assert changed.name in str(gone.value)
    changed.write_bytes(before)
    os.utime(changed, ns=(status.st_atime_ns, status.st_mtime_ns))
    pose = (folder / "scans.conf").read_text().replace("bmesh", "# another\nbmesh", 1).replace(" 0 0 0 1", " 0 0 1 0")
    if pose.endswith("\n"):
        (folder / "scans.conf").write_text(pose.rsplit("\n", 2)[0] + "\n")
    with pytest.raises(surfrecon.InputError, match="plan it anew"):
        distributed.Plan.read(plan.path).run(2)


def test_bad_plans_are_refused(scans, tmp_path):
    made = planned(tmp_path, scans)
    content = json.loads(Path(made.path).read_text())
    for text, expected in [
        ("{", "this is no plan of a merge"),
        ("[]", "this is no plan of a merge"),
        ("{}", "this is no plan of a merge"),
        (json.dumps(content | {"surfrecon": "0.0.1"}), "planned by surfrecon 0.0.1"),
    ]:
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(surfrecon.FormatError, match=expected):
            distributed.Plan.read(tmp_path / "bad.json")
    with pytest.raises(surfrecon.FileError, match=r"nowhere\.json"):
        distributed.Plan.read(tmp_path / "nowhere.json")
    for given, kind, text in [
        ({"workspace": tmp_path / "nowhere"}, surfrecon.InputError, "must be a folder that exists"),
        ({"tasks": 0}, surfrecon.InputError, "tasks must lie between 1 and"),
        ({"grazing": 3}, TypeError, "unexpected keyword argument 'grazing'"),
        ({"taks": 3}, TypeError, r"unexpected keyword argument 'taks'\. Did you mean 'tasks'\?"),
        ({"workspace": "unheard://of"}, surfrecon.InputError, "unheard"),
        ({"voxel": -1.0}, surfrecon.ParameterError, "voxel must be"),
        ({"encoding": "ascii"}, surfrecon.InputError, "must be binary, got 'ascii'"),
        ({"max_memory": 0}, surfrecon.InputError, "max_memory must be bytes > 0"),
    ]:
        with pytest.raises(kind, match=text):
            planned(tmp_path, scans, **given)
    for output, text in [
        ("surface.obj", r"only \.ply is written piece by piece"),
        ("nowhere/surface.ply", "there is no folder .*nowhere"),
        (next(scans.parent.glob("*.ply")), "is a scan: give the surface another name"),
    ]:
        with pytest.raises(surfrecon.InputError, match=text):
            distributed.Plan.make(tmp_path / "p.json", scans, tmp_path / output)
    for given in ([scans, "s3://bucket/surface.ply"], ["s3://bucket/scans.conf", tmp_path / "surface.ply"]):
        with pytest.raises(surfrecon.InputError, match="s3://bucket/.*only the workspace and the plan may be URLs"):
            distributed.Plan.make(tmp_path / "p.json", *given)
    with pytest.raises(surfrecon.InputError, match="must be names of files and folders"):
        distributed.Plan.make(tmp_path / "p.json", surfrecon.open(scans), tmp_path / "surface.ply")
    made.clear()
    with pytest.raises(surfrecon.FileError, match=r"nowhere/p\.json"):
        distributed.Plan.make(tmp_path / "nowhere" / "p.json", scans, tmp_path / "surface.ply", workspace=tmp_path)
    assert sorted(os.listdir(tmp_path)) == ["bad.json", "plan.json"]
    made = planned(tmp_path, scans)
    with pytest.raises(surfrecon.OutOfMemoryError, match="merging into a file needs 12"):
        planned(tmp_path, scans, max_memory=1000).run(0)


def test_the_command_line_plans_and_does_tasks(scans, tmp_path):
    merged = run("merge", scans, "-o", tmp_path / "merged.ply", "--voxel", "0.02")
    assert merged.returncode == 0, merged.stderr
    surface, plan = tmp_path / "surface.ply", tmp_path / "plan.json"
    given = ["plan", scans, "--surface", surface, "-o", plan, "--tasks", "2", "--voxel", "0.02"]
    made = run(*given, "--json")
    assert made.returncode == 0, made.stderr
    stages = json.loads(made.stdout)["report"]["stages"]
    assert stages[1] == {"name": "collect", "first": 1, "last": 2}
    too_early = run("task", plan, "3")
    assert (too_early.returncode, too_early.stdout) == (1, "")
    assert "task 0 (plan) is not done" in too_early.stderr or "is not done" in too_early.stderr
    assert run("task", plan, "99").returncode == 2
    first = run("task", plan, "0", "1", "--json")
    assert [task["stage"] for task in json.loads(first.stdout)["tasks"]] == ["plan", "collect"]
    rest = run("task", plan, "--threads", "1", "--max-memory", "100MB")
    assert rest.returncode == 0, rest.stderr
    assert rest.stdout.splitlines()[-1].endswith("surface.ply is written")
    # Also what it says of where it is from is what the merge says.
    assert surface.read_bytes() == (tmp_path / "merged.ply").read_bytes()
    assert sorted(os.listdir(tmp_path)) == ["merged.ply", "plan.json", "surface.ply"]
    again = run("task", plan)
    assert again.returncode == 0, again.stderr
    for wrong in (
        ["plan", scans, "-o", plan],
        [*given, "--tasks", "0"],
        [*given, "--encoding", "ascii"],
        [*given, "--workspace", "nowhere"],
    ):
        assert run(*wrong).returncode == 2
    assert run("plan", scans, "--surface", scans.parent / "x.obj", "-o", plan).returncode == 2
