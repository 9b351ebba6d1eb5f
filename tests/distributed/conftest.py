"""A cluster of processes, and scans in files."""

import contextlib
import sys
from pathlib import Path

import dask
import fsspec
import pytest
import surfrecon
from dask.distributed import Client, LocalCluster
from moto.server import ThreadedMotoServer

sys.path.insert(0, str(Path(__file__).parent.parent / "python"))
import shapes  # noqa: E402

OPTIONS = {"voxel": 0.02}


@pytest.fixture(scope="session")
def scans(tmp_path_factory):
    """A list of scans in files."""
    return shapes.torus_files(tmp_path_factory, pixels=90)


@pytest.fixture(scope="session")
def by_one(scans, tmp_path_factory):
    """The bytes that one process makes."""
    path = tmp_path_factory.mktemp("one") / "surface.ply"
    surfrecon.merge_to_file(surfrecon.open(scans), path, **OPTIONS)
    return path.read_bytes()


@contextlib.contextmanager
def two_workers():
    """A client of a cluster of two processes."""
    given = {"threads_per_worker": 1, "memory_limit": "600MB", "dashboard_address": None}
    # A worker that is killed takes nothing but its task along.
    with dask.config.set({"distributed.scheduler.allowed-failures": 20}):
        with LocalCluster(n_workers=2, processes=True, **given) as cluster, Client(cluster) as client:
            client.wait_for_workers(2, timeout=120)
            yield client


@pytest.fixture(scope="module")
def client():
    """One whose workers nobody kills."""
    with two_workers() as client:
        yield client


@pytest.fixture
def workspace(tmp_path):
    folder = tmp_path / "workspace"
    folder.mkdir()
    yield folder
    assert not list(folder.iterdir())


@pytest.fixture
def bucket(monkeypatch):
    """A URL in an object store of this machine."""
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    host, port = server.get_host_and_port()
    for name, value in {
        "AWS_ACCESS_KEY_ID": "nobody",
        "AWS_SECRET_ACCESS_KEY": "nothing",
        "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
    }.items():
        monkeypatch.setenv(name, value)
    # Each server has another address.
    fsspec.get_filesystem_class("s3").clear_instance_cache()
    fsspec.filesystem("s3").makedirs("bucket", exist_ok=True)
    yield "s3://bucket/merges"
    server.stop()
