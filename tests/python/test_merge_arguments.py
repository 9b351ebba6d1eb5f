"""Arguments of large merges: errors name the argument, what it must be and what was given, before anything is left."""

import os
import pickle

import numpy as np
import pytest
import shapes
import surfrecon
from surfrecon import distributed

# Of `merge_to_file`, `distributed.Plan.make` and `distributed.merge` alike.
OF_ALL = [
    ({"max_memory": 2e9}, TypeError, r"max_memory must be a whole number of bytes, got 2000000000\.0"),
    ({"max_memory": "2GB"}, TypeError, "max_memory must be a whole number of bytes, got '2GB'"),
    ({"max_memory": -1}, surfrecon.InputError, "max_memory must be .*, got -1"),
    ({"part_triangles": "x"}, TypeError, "part_triangles must be a whole number, got 'x'"),
    ({"part_triangles": -1}, surfrecon.ParameterError, "part_triangles must be >= 0 and <= 2147483647, got -1"),
    ({"part_triangles": 2**70}, surfrecon.ParameterError, "part_triangles must be >= 0 .*, got 1180591620717411303424"),
    ({"keep": "yes"}, TypeError, "keep must be True or False, got 'yes'"),
    ({"provenance": 3}, surfrecon.InputError, "provenance must be a JSON object, got 3"),
    ({"provenance": {"made by": object()}}, TypeError, "is not JSON serializable"),
    ({"voxel": -1.0}, surfrecon.ParameterError, "voxel must be"),
    ({"voxel": "x"}, TypeError, "voxel"),
    ({"grazing": 3}, TypeError, "unexpected keyword argument 'grazing'"),
]
THREADS = [
    ({"threads": -1}, surfrecon.ParameterError, "threads must be >= 0 and <= 1024, got -1"),
    ({"threads": "x"}, TypeError, "argument 'threads'"),
]
PROGRESS = [({"progress": 3}, TypeError, "progress must be a function or None, got 3")]
TASKS = [
    ({"tasks": "4"}, TypeError, "tasks must be a whole number, got '4'"),
    ({"tasks": 1.5}, TypeError, r"tasks must be a whole number, got 1\.5"),
    ({"tasks": 0}, surfrecon.InputError, "tasks must lie between 1 and 100000, got 0"),
]


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    """A list of scans in files."""
    folder = tmp_path_factory.mktemp("scans")
    surfrecon.write_scans(folder / "scans.conf", shapes.torus_scans(pixels=30))
    return folder / "scans.conf"


class Cluster:
    """A client that answers what a merge asks before it hands over a task."""

    def scheduler_info(self, n_workers):
        return {"workers": {"one": {"nthreads": 1, "memory_limit": 10**9}}}


@pytest.mark.parametrize(("given", "kind", "text"), [*OF_ALL, *THREADS, *PROGRESS])
def test_a_merge_into_a_file_names_its_arguments(scans, tmp_path, given, kind, text):
    with pytest.raises(kind, match=text):
        surfrecon.merge_to_file(surfrecon.open(scans), tmp_path / "surface.ply", **given)
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize(("given", "kind", "text"), [*OF_ALL, *THREADS, *TASKS])
def test_a_plan_names_its_arguments(scans, tmp_path, given, kind, text):
    with pytest.raises(kind, match=text):
        distributed.Plan.make(tmp_path / "plan.json", scans, tmp_path / "surface.ply", **given)
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize(
    ("given", "kind", "text"),
    [
        *(({"tasks": 2} | given, kind, text) for given, kind, text in [*OF_ALL, *TASKS]),
        *PROGRESS,
        ({"client": None}, TypeError, r"client must be a dask\.distributed\.Client, got None"),
        ({"retries": -1}, surfrecon.InputError, "retries must be >= 0, got -1"),
        ({"retries": "5"}, TypeError, "retries must be a whole number, got '5'"),
    ],
)
def test_a_merge_on_a_cluster_names_its_arguments(scans, tmp_path, given, kind, text):
    with pytest.raises(kind, match=text):
        distributed.merge(scans, tmp_path / "surface.ply", **({"client": Cluster()} | given))
    assert not os.listdir(tmp_path)


def test_a_task_names_its_progress(scans, tmp_path):
    plan = distributed.Plan.make(tmp_path / "plan.json", scans, tmp_path / "surface.ply", voxel=0.05)
    with pytest.raises(TypeError, match="progress must be a function or None, got 3"):
        plan.run(0, progress=3)


def test_a_merge_names_its_arguments(scans):
    opened = surfrecon.open(scans)
    measure = ({"measure": "yes"}, TypeError, "measure must be True or False, got 'yes'")
    for given, kind, text in [*PROGRESS, *OF_ALL[:3], measure]:
        with pytest.raises(kind, match=text):
            surfrecon.merge(opened, **given)


def test_names_of_files_are_to_be_opened_first(scans, tmp_path):
    for call in (surfrecon.merge, lambda given: surfrecon.merge_to_file(given, tmp_path / "surface.ply")):
        for given in (scans, str(scans)):
            with pytest.raises(TypeError) as problem:
                call(given)
            text = str(problem.value)
            assert "scans must be a ScanSet or a list of scans" in text
            assert f"open files with surfrecon.open({str(scans)!r})" in text


def test_names_that_a_merge_into_a_file_does_not_take(scans, tmp_path):
    opened = surfrecon.open(scans)
    for name in ("surface", "surface.obj", "surface.xyz"):
        for path in (tmp_path / name, str(tmp_path / name)):
            with pytest.raises(surfrecon.InputError) as problem:
                surfrecon.merge_to_file(opened, path)
            assert name in str(problem.value) and "only .ply is written piece by piece" in str(problem.value)
            assert ".glb" not in str(problem.value)
    with pytest.raises(surfrecon.InputError, match=r"s3://bucket/work: .*URLs are for surfrecon\.distributed\.merge"):
        surfrecon.merge_to_file(opened, tmp_path / "surface.ply", workspace="s3://bucket/work")


def test_numbers_and_flags_of_numpy_are_taken(scans, tmp_path):
    given = {"voxel": 0.05, "max_memory": np.int64(10**8), "part_triangles": np.int32(0), "keep": np.bool_(False)}
    surfrecon.merge_to_file(surfrecon.open(scans), tmp_path / "surface.ply", **given)
    plan = distributed.Plan.make(
        tmp_path / "plan.json", scans, tmp_path / "planned.ply", tasks=np.int64(2), threads=1, **given
    )
    plan = distributed.Plan.read(plan.path)
    for stage in plan.stages:
        for number in stage.tasks:
            plan.run(number)
    assert (tmp_path / "planned.ply").read_bytes() == (tmp_path / "surface.ply").read_bytes()


def test_merges_are_pickled_by_name():
    for call in (surfrecon.merge, surfrecon.merge_to_file):
        assert pickle.loads(pickle.dumps(call)) is call
