"""The examples of docs/site/guide/cluster.md run, as they stand there, and make what one process makes.

SLURM and Kubernetes are not there: `schedulers` stands in for their programs. Workers, tasks and dask-jobqueue are
real.
"""

import contextlib
import doctest
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import dask
import pytest
import schedulers
import surfrecon
from dask.distributed import Client, LocalCluster
from surfrecon import distributed

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "docs"))
from sections import blocks  # noqa: E402

GUIDE = "docs/site/guide/cluster.md"
WORKERS = {"n_workers": 2, "threads_per_worker": 1, "memory_limit": "600MB", "dashboard_address": None}


@pytest.fixture(scope="module")
def expected(scans, tmp_path_factory):
    """The bytes that one process makes, and what a command says in them of where they are from."""
    path = tmp_path_factory.mktemp("expected") / "surface.ply"
    surfrecon.merge_to_file(surfrecon.open(scans), path)
    return path.read_bytes()


@pytest.fixture
def here(scans, tmp_path, monkeypatch):
    """The folder that all examples find themselves in."""
    shutil.copytree(scans.parent, tmp_path / "here")
    here = tmp_path / "here"
    (here / "scans.conf").rename(here / "placed.conf")
    (here / "shared folder").mkdir()
    monkeypatch.chdir(here)
    yield here
    assert not list((here / "shared folder").iterdir())


@pytest.fixture
def cluster(here, tmp_path, monkeypatch):
    """Programs that start what they are given."""
    schedulers.programs(tmp_path / "bin")
    (tmp_path / "jobs").mkdir()
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{os.environ['PATH']}")
    monkeypatch.setenv("STAND_INS", str(tmp_path / "jobs"))
    monkeypatch.setenv("SHARED", str(here))
    monkeypatch.setenv("PYTHONPATH", str(Path(surfrecon.__file__).resolve().parents[1]))
    yield tmp_path / "jobs"
    schedulers.scancel([job.parent.name for job in (tmp_path / "jobs").glob("*/pid")])


def texts(name, language, heading):
    """The blocks of a language below a heading."""
    return [block.text for block in blocks(ROOT / name) if (block.language, block.heading) == (language, heading)]


def run(text, **names):
    """Runs a block of Python, as a script is."""
    names["__name__"] = "__main__"
    # The setting for Dask is for its cluster.
    with dask.config.set({"distributed.scheduler.allowed-failures": 3}):
        exec(compile(text, GUIDE, "exec"), names)
    assert isinstance(names["report"], surfrecon.MergeReport)


def shell(text):
    """Runs lines of a shell."""
    done = subprocess.run(["bash"], input=text, text=True, capture_output=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


@contextlib.contextmanager
def workers():
    """A cluster on this machine, and a client."""
    with LocalCluster(**WORKERS) as cluster, Client(cluster) as client:
        yield client


def without_comments(content):
    """A PLY file but for what it says of where it is from: that names the command."""
    head, end, rest = content.partition(b"end_header\n")
    return [line for line in head.splitlines() if not line.startswith(b"comment")], end, rest


def test_dask_on_one_machine(here, expected):
    (text,) = texts(GUIDE, "python", "On a cluster")
    run(text)
    assert (here / "surface.ply").read_bytes() == expected


def test_tasks_by_number(here, cluster, expected):
    (text,) = texts(GUIDE, "sh", "On a cluster")
    shell(f"set -e\n{text}")
    assert without_comments((here / "surface.ply").read_bytes()) == without_comments(expected)


def test_dask_on_slurm(here, cluster, expected):
    (text,) = texts(GUIDE, "python", "SLURM with Dask")
    run(text)
    assert (here / "surface.ply").read_bytes() == expected
    # All were asked for, and the two that the queue let in have worked.
    assert len(list(cluster.glob("*/pid"))) == 16


def test_dask_on_kubernetes(here, expected):
    (text,) = texts(GUIDE, "python", "Kubernetes with Dask")
    address = "tcp://merge-scheduler:8786"
    assert address in text
    with workers() as client:
        run(text.replace(address, client.scheduler.address))
    assert (here / "surface.ply").read_bytes() == expected


def planned():
    """Does what stands above all array jobs, with fewer tasks."""
    (text,) = texts(GUIDE, "bash", "Array jobs")
    assert "--tasks 64" in text
    shell("set -e\n" + text.replace("--tasks 64", "--tasks 2"))


@pytest.mark.parametrize("lost", ["merge-collect 1", "merge-label 0", "merge-write 0"])
def test_array_jobs_on_slurm(here, cluster, expected, monkeypatch, lost):
    monkeypatch.setenv("LOST", lost)
    planned()
    (text,) = texts(GUIDE, "bash", "SLURM")
    # The shell that runs it waits for the last, where a person would look later.
    shell(f"set -e\n{text}\nuntil [ -e {cluster}/$before/ended ]; do sleep 0.1; done")
    said = "".join(path.read_text() for path in sorted(cluster.glob("*/said")))
    assert {path.read_text() for path in cluster.glob("*/ended")} == {"well"}, said
    assert (cluster / "lost").exists()
    assert without_comments((here / "surface.ply").read_bytes()) == without_comments(expected)


def test_what_fails_stops_what_follows_on_slurm(here, cluster):
    planned()
    scan = next(here.glob("scan*.ply"))
    scan.write_bytes(scan.read_bytes()[:-10])
    (text,) = texts(GUIDE, "bash", "SLURM")
    shell(f"set -e\n{text}\nuntil [ -e {cluster}/$before/ended ]; do sleep 0.1; done")
    assert {path.read_text() for path in cluster.glob("*/ended")} == {"badly"}
    said = (cluster / "1" / "said").read_text()
    assert scan.name in said and "plan it anew" in said
    distributed.Plan.read(here / "merge.json").remove()


def test_indexed_jobs_on_kubernetes(here, cluster, expected, monkeypatch):
    monkeypatch.setenv("LOST", "merge-build 1")
    planned()
    (job,) = texts(GUIDE, "yaml", "Kubernetes")
    (here / "job.yaml").write_text(job)
    (text,) = texts(GUIDE, "bash", "Kubernetes")
    shell(text)
    assert (cluster / "lost").exists()
    assert without_comments((here / "surface.ply").read_bytes()) == without_comments(expected)


def test_object_stores(here, bucket, expected):
    (text,) = texts(GUIDE, "python", "Object stores")
    assert f'workspace="{bucket}"' in text
    with workers() as client:
        run(text, client=client, distributed=distributed)
    assert (here / "surface.ply").read_bytes() == expected


@pytest.mark.parametrize("title", ["distributed", "distributed.merge"])
def test_docstrings(here, expected, title):
    (here / "scans").mkdir()
    for file in [*here.glob("*.ply"), here / "placed.conf"]:
        shutil.copy(file, here / "scans")
    text = {"distributed": distributed, "distributed.merge": distributed.merge}[title].__doc__
    with workers() as client:
        names = {"dask": SimpleNamespace(distributed=SimpleNamespace(Client=lambda *address: client))}
        example = doctest.DocTestParser().get_doctest(text, names, title, None, 0)
        assert doctest.DocTestRunner(verbose=False).run(example).failed == 0
    assert (here / "surface.ply").exists()
