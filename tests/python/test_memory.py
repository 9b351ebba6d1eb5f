"""Work that does not fit is refused before it begins, and says what would fit."""

import subprocess
import sys

import numpy as np
import pytest
import surfrecon


@pytest.fixture
def limit():
    """Sets the limit; lifted afterwards."""
    yield surfrecon.set_memory_limit
    surfrecon.set_memory_limit(None)


def test_the_limit_holds_until_it_is_lifted(limit):
    points = np.random.default_rng(1).random((1000, 3))
    limit(100_000)
    assert surfrecon.memory_limit() == 100_000
    with pytest.raises(MemoryError) as refused:
        surfrecon.reconstruct(points)
    assert str(refused.value) == (
        "not enough memory: a surface through 1000 points needs about 400 kB, 100 kB are allowed; use fewer"
    )
    limit(None)
    mesh = surfrecon.sculpture()
    limit(100_000)
    with pytest.raises(surfrecon.OutOfMemoryError, match="are allowed; a voxel of .* fits"):
        surfrecon.merge([mesh], voxel=1e-4)
    limit(None)
    assert surfrecon.memory_limit() is None
    surfrecon.reconstruct(points)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems don't limit the address space")
def test_the_limit_of_the_process_is_seen():
    program = """
import resource, surfrecon, numpy as np
points = np.random.default_rng(1).random((1_000_000, 3))
surfrecon.reconstruct(points[:100], threads=2)
pages = int(open("/proc/self/statm").read().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 200_000_000, resource.RLIM_INFINITY))
try:
    surfrecon.reconstruct(points, threads=2)
except MemoryError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = "not enough memory: a surface through 1000000 points needs about 400 MB, "
    assert done.stdout.startswith(said), done.stdout
