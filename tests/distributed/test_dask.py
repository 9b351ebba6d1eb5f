"""Merges on a cluster of Dask's: as many workers as there are, some of which are killed."""

import os
import signal
import threading

import pytest
import surfrecon
from conftest import OPTIONS, two_workers
from dask.distributed import Client, LocalCluster
from surfrecon import distributed


def test_a_cluster_makes_what_one_process_makes(client, scans, by_one, workspace, tmp_path):
    path, told = tmp_path / "surface.ply", []
    report = distributed.merge(
        scans, path, client=client, workspace=workspace, progress=lambda *what: told.append(what), **OPTIONS
    )
    assert path.read_bytes() == by_one
    assert isinstance(report, surfrecon.MergeReport) and report.voxel == OPTIONS["voxel"]
    assert [fraction for _, fraction in told] == sorted(fraction for _, fraction in told)
    assert told[0][0] == "plan" and told[-1] == ("write", 1.0)
    # Again, from paths in a list, into the folder beside the file.
    distributed.merge([scans], path, client=client, tasks=1, **OPTIONS)
    assert path.read_bytes() == by_one
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["surface.ply", "workspace"]


def test_what_was_merged_before_is_merged_again(client, scans, by_one, workspace, tmp_path):
    # The same plan, at once, to another file: neither Dask nor workers take the one for the other.
    given = {"client": client, "tasks": 3, **OPTIONS}
    for name, place in (("a.ply", workspace), ("b.ply", f"file://{workspace}"), ("a.ply", workspace)):
        distributed.merge(scans, tmp_path / name, workspace=place, **given)
        assert (tmp_path / name).read_bytes() == by_one
        if name == "b.ply":
            (tmp_path / "a.ply").unlink()


def test_the_memory_of_one_process_is_no_workspace(client, scans, tmp_path):
    with pytest.raises(surfrecon.InputError, match="memory://work: that is one process's memory"):
        distributed.merge(scans, tmp_path / "a.ply", client=client, workspace="memory://work", **OPTIONS)


@pytest.mark.parametrize(
    "stage", ["plan", "collect", "overlap", "fuse", "look", "drop", "colours", "label", "build", "write"]
)
def test_a_worker_killed_in_any_stage_changes_nothing(scans, by_one, workspace, tmp_path, stage):
    killed = []
    # Of its own: Dask may not start a killed worker again where the machine has much to do.
    with two_workers() as client:
        before = client.run(os.getpid)

        def kill(name, _):
            # While the tasks of the next stage are about to run: the first that is told of a stage is done.
            stages = [found.name for found in distributed.plan.Plan.read(plan_of(workspace)).stages]
            following = stages[min(stages.index(name) + 1, len(stages) - 1)]
            if not killed and stage in (name, following):
                killed.append(min(before.values()))
                threading.Timer(0.02, os.kill, (killed[0], signal.SIGKILL)).start()

        distributed.merge(
            scans, tmp_path / "surface.ply", client=client, workspace=workspace, tasks=4, progress=kill, **OPTIONS
        )
    assert len(killed) == 1
    assert (tmp_path / "surface.ply").read_bytes() == by_one


def plan_of(workspace):
    (found,) = workspace.glob("*.json")
    return found


def test_a_merge_that_was_cancelled_goes_on(client, scans, by_one, tmp_path):
    workspace = tmp_path / "workspace"
    workspace.mkdir()
    given = {"client": client, "workspace": workspace, "tasks": 2, **OPTIONS}
    with pytest.raises(surfrecon.Cancelled):
        distributed.merge(scans, tmp_path / "surface.ply", progress=lambda stage, _: stage != "fuse", **given)
    assert not (tmp_path / "surface.ply").exists()
    (folder,) = (entry for entry in workspace.iterdir() if entry.is_dir())
    done = {entry.name for entry in folder.glob("done-*")}
    assert {"done-plan-000000", "done-collect-000000", "done-overlap-000000"} <= done
    changed = {entry.name: entry.stat().st_mtime_ns for entry in folder.glob("done-*")}
    stamps = {}

    def note(stage, _):
        stamps.update({entry.name: entry.stat().st_mtime_ns for entry in folder.glob("done-[pco]*")})

    distributed.merge(scans, tmp_path / "surface.ply", progress=note, **given)
    for name in ("done-plan-000000", "done-collect-000000", "done-overlap-000000"):
        assert stamps[name] == changed[name], name
    assert (tmp_path / "surface.ply").read_bytes() == by_one
    assert not list(workspace.iterdir())


def test_errors_come_back_as_they_are(client, scans, workspace, tmp_path):
    given = {"client": client, "workspace": workspace, "tasks": 1, "retries": 0}
    with pytest.raises(surfrecon.ParameterError, match="voxel must be"):
        distributed.merge(scans, tmp_path / "surface.ply", voxel=-1.0, **given)
    for wrong, kind in (
        ({"tasks": 0}, surfrecon.InputError),
        ({"max_memory": 0}, surfrecon.InputError),
        ({"max_memory": "1GB"}, TypeError),
    ):
        with pytest.raises(kind, match=f"{next(iter(wrong))} must"):
            distributed.merge(scans, tmp_path / "surface.ply", **given | wrong)
    with pytest.raises(surfrecon.OutOfMemoryError, match="needs 12 MB at least"):
        distributed.merge(scans, tmp_path / "surface.ply", max_memory=1000, **given)
    (plan,) = workspace.glob("*.json")
    distributed.Plan.read(plan).remove()
    with pytest.raises(surfrecon.InputError, match="must be names of files and folders"):
        distributed.merge(surfrecon.open(scans), tmp_path / "surface.ply", **given)
    with pytest.raises(surfrecon.InputError, match="s3://bucket/surface.ply: the surface must be a file"):
        distributed.merge(scans, "s3://bucket/surface.ply", **given)
    with pytest.raises(surfrecon.InputError, match="only .ply is written piece by piece"):
        distributed.merge(scans, tmp_path / "surface.obj", **given)
    with pytest.raises(surfrecon.FileError, match="nowhere"):
        distributed.merge(tmp_path / "nowhere.ply", tmp_path / "surface.ply", **given)


def test_workers_without_a_limit_need_one_given(scans, tmp_path):
    with LocalCluster(n_workers=1, processes=False, memory_limit=0, dashboard_address=None) as cluster:
        with Client(cluster) as client, pytest.raises(surfrecon.InputError, match="give max_memory"):
            distributed.merge(scans, tmp_path / "surface.ply", client=client)
    assert not list(tmp_path.iterdir())


def test_a_cluster_closes_what_one_process_closes(client, workspace, tmp_path):
    shape = surfrecon.sculpture(cell=8)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=80, height_angle=0.6))
    for number, image in enumerate(images):
        image.name = f"view{number}"
    surfrecon.write_scans(tmp_path / "scans.e57", images)
    given = {"voxel": 4.0, "close": "all", "flat_base": True}
    one = surfrecon.merge_to_file(surfrecon.open(tmp_path / "scans.e57"), tmp_path / "one.ply", **given)
    report = distributed.merge(
        tmp_path / "scans.e57", tmp_path / "many.ply", client=client, workspace=workspace, tasks=3, **given
    )
    assert (tmp_path / "many.ply").read_bytes() == (tmp_path / "one.ply").read_bytes()
    assert report.filled_share == one.filled_share > 0 and list(report.holes) == list(one.holes)
