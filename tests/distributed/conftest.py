"""A cluster of processes, and scans in files."""

import sys
from pathlib import Path

import pytest
import surfrecon

sys.path.insert(0, str(Path(__file__).parent.parent / "python"))
import shapes  # noqa: E402

OPTIONS = {"voxel": 0.02}


@pytest.fixture(scope="session")
def scans(tmp_path_factory):
    """A list of scans in files."""
    folder = tmp_path_factory.mktemp("scans")
    surfrecon.write_scans(folder / "scans.conf", shapes.torus_scans(pixels=90, noise=0.002))
    return folder / "scans.conf"


@pytest.fixture(scope="session")
def by_one(scans, tmp_path_factory):
    """The bytes that one process makes."""
    path = tmp_path_factory.mktemp("one") / "surface.ply"
    surfrecon.merge_to_file(surfrecon.open(scans), path, **OPTIONS)
    return path.read_bytes()
