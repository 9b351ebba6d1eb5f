"""A merge as Dask sees it: how tasks are called, what they hand over, how often they are tried, how far all is."""

import io
import json
import os
import pickle
import sys

import cloudpickle
import numpy as np
import pytest
import surfrecon
from conftest import OPTIONS
from dask.distributed import Client, LocalCluster
from others import looked_at, ours, put
from surfrecon import distributed
from surfrecon.bar import Bar
from surfrecon.distributed import client as tasks_of_dask

# Workers know no modules of tests.
cloudpickle.register_pickle_by_value(sys.modules[__name__])
# Bytes that client, scheduler and workers hand each other of a task, however many scans there are.
FEW = 4096


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """3,000 tiny frames in rows."""
    folder = tmp_path_factory.mktemp("many")
    noise = np.random.default_rng(3)
    for k in range(3000):
        np.save(folder / f"frame-{k:04}.npy", 1 + 0.01 * noise.random((4, 4), np.float32))
        pose = [[1, 0, 0, 0.3 * (k % 60)], [0, -1, 0, 0.3 * (k // 60)], [0, 0, -1, 1], [0, 0, 0, 1]]
        (folder / f"frame-{k:04}.pose.txt").write_text("\n".join(" ".join(map(str, row)) for row in pose))
    return sorted(folder.glob("*.npy"))


def test_tasks_hand_over_few_bytes_of_many_scans(many, tmp_path):
    given = {"reading": {"camera": (4, 4, 1.5, 1.5)}, "voxel": 0.1, "max_memory": 12_000_000}
    plan = distributed.Plan.make(None, many, tmp_path / "surface.ply", tasks=2, **given)
    found = {}
    for stage in plan.stages:
        for number in stage.tasks:
            found[stage.name] = tasks_of_dask._run("call", plan.path, number)
            assert stage.name == "write" or len(pickle.dumps(found[stage.name])) < FEW, stage
    # The report names all scans.
    assert len(found["write"]["report"]["scan_names"]) == len(many)
    assert len(pickle.dumps(found["write"])) < FEW + 100 * len(many)
    plan.remove()


class Listening:
    """A client that notes what is handed to it."""

    def __init__(self, client):
        self.client, self.sizes = client, []

    def __getattr__(self, name):
        return getattr(self.client, name)

    def submit(self, *given, **options):
        self.sizes.append(len(cloudpickle.dumps((given, options))))
        return self.client.submit(*given, **options)


def test_workers_are_handed_few_bytes(client, scans, by_one, workspace, tmp_path):
    listening = Listening(client)
    distributed.merge(scans, tmp_path / "surface.ply", client=listening, workspace=workspace, tasks=2, **OPTIONS)
    assert (tmp_path / "surface.ply").read_bytes() == by_one
    assert len(listening.sizes) > 10 and max(listening.sizes) < FEW


class Refreshed(Listening):
    """A client whose own refresh, which asks for no workers, comes between asking for them and the answer."""

    def scheduler_info(self, **given):
        found = self.client.scheduler_info(**given)
        self.sizes.append(len(found["workers"]))
        return dict(found) | {"workers": {}} if len(self.sizes) % 2 else found


def test_workers_that_a_refresh_hides_are_found(client):
    client.wait_for_workers(2, timeout=120)
    assert tasks_of_dask._workers(Refreshed(client)) == (2, int(0.7 * 600e6))


def be_unlucky(folder):
    """On a worker: the first call of each task fails, on whichever worker it is."""
    run = distributed.Plan.run

    def unlucky(plan, number, **given):
        try:
            open(os.path.join(folder, str(number)), "x").close()
        except FileExistsError:
            return run(plan, number, **given)
        raise surfrecon.FileError(f"task {number} had no luck")

    unlucky.run = run
    distributed.Plan.run = unlucky


def be_lucky():
    """On a worker: as before."""
    distributed.Plan.run = distributed.Plan.run.run


@pytest.mark.parametrize("retries", [0, 1])
def test_each_task_is_tried_again(client, scans, by_one, workspace, tmp_path, retries):
    (tmp_path / "tried").mkdir()
    client.wait_for_workers(2, timeout=120)
    client.run(be_unlucky, str(tmp_path / "tried"))
    given = {"client": client, "workspace": workspace, "tasks": 2, "retries": retries, **OPTIONS}
    try:
        if retries:
            distributed.merge(scans, tmp_path / "surface.ply", **given)
        else:
            with pytest.raises(surfrecon.FileError, match="task 0 had no luck"):
                distributed.merge(scans, tmp_path / "surface.ply", **given)
    finally:
        client.run(be_lucky)
    if retries:
        tasks = {str(number) for number in range(len(list((tmp_path / "tried").iterdir())))}
        assert {path.name for path in (tmp_path / "tried").iterdir()} == tasks and len(tasks) > 10
    else:
        assert not (tmp_path / "surface.ply").exists()
        # The cause of the error is gone: the same call goes on.
        distributed.merge(scans, tmp_path / "surface.ply", **given)
    assert (tmp_path / "surface.ply").read_bytes() == by_one


def test_the_memory_of_a_worker_is_of_all_its_threads(scans, workspace, tmp_path):
    given = {"threads_per_worker": 2, "memory_limit": "800MB", "dashboard_address": None}
    planned = []

    def look(*_):
        (path,) = workspace.glob("*.json")
        planned.append(json.loads(path.read_text()))
        return False

    with LocalCluster(n_workers=1, processes=False, **given) as cluster, Client(cluster) as client:
        with pytest.raises(surfrecon.Cancelled):
            distributed.merge(
                scans, tmp_path / "surface.ply", client=client, workspace=workspace, progress=look, **OPTIONS
            )
    (plan,) = planned
    assert plan["max_memory"] == pytest.approx(0.7 * 800e6 / 2, abs=1)
    assert (plan["tasks"], plan["options"]["threads"]) == (8, 1)
    (path,) = workspace.glob("*.json")
    distributed.Plan.read(path).remove()


def prefixes(dask_scheduler):
    """The names that the dashboard has for the tasks of the scheduler."""
    return list(dask_scheduler.task_prefixes)


def test_the_dashboard_and_a_bar_name_the_stages(client, scans, by_one, workspace, tmp_path):
    seen, shown, told = set(), io.StringIO(), []
    with Bar(file=shown, mininterval=0) as bar:

        def progress(stage, fraction):
            told.append((stage, fraction))
            seen.update(client.run_on_scheduler(prefixes))
            return bar(stage, fraction)

        distributed.merge(
            scans, tmp_path / "surface.ply", client=client, workspace=workspace, tasks=2, progress=progress, **OPTIONS
        )
    assert (tmp_path / "surface.ply").read_bytes() == by_one
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert stages[0] == "plan" and stages[-1] == "write" and len(stages) == 10
    assert set(stages) <= seen
    lines = shown.getvalue().split("\r")
    shares = {stage: [line for line in lines if line.startswith(stage)] for stage in stages}
    assert all(shares.values()), shown.getvalue()
    assert "100 %" in shares["write"][-1] and "100 %" not in "".join(shares["build"])


@pytest.mark.parametrize("keep", [False, True])
def test_files_of_others_stay_as_they_are(client, scans, by_one, tmp_path, keep):
    workspace = tmp_path / "workspace"
    before = put(workspace)
    given = {"client": client, "workspace": workspace, "tasks": 2, "keep": keep, **OPTIONS}
    with pytest.raises(surfrecon.Cancelled):
        distributed.merge(scans, tmp_path / "surface.ply", progress=lambda stage, _: stage != "label", **given)
    assert looked_at(workspace) == before
    distributed.merge(scans, tmp_path / "surface.ply", **given)
    assert looked_at(workspace) == before and len(ours(workspace)) == keep
    assert (tmp_path / "surface.ply").read_bytes() == by_one
