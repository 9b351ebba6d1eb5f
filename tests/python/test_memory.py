"""Work that does not fit is refused before it begins, and says what would fit."""

import contextlib
import subprocess
import sys
import time

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


def test_what_is_held_is_counted_and_given_back():
    before = surfrecon.memory_in_use()
    assert surfrecon.memory_peak(restart=True) >= before
    mesh = surfrecon.sculpture(cell=8.0)
    bytes_held = mesh.positions.nbytes + mesh.triangles.nbytes
    held = surfrecon.memory_in_use() - before
    assert bytes_held <= held
    view = mesh.positions
    del mesh
    # The view keeps all of the mesh.
    assert surfrecon.memory_in_use() - before == pytest.approx(held, abs=10_000)
    del view
    assert surfrecon.memory_in_use() - before < 100_000
    assert surfrecon.memory_peak() - before >= held


def test_a_job_gives_all_back():
    mesh = surfrecon.sculpture(cell=8.0)
    surfrecon.Job.merge([mesh], voxel=2.0).result()
    before = surfrecon.memory_in_use()
    for stop in (False, True):
        job = surfrecon.Job.merge([mesh], voxel=2.0)
        if stop:
            job.cancel()
        with contextlib.suppress(surfrecon.Cancelled):
            job.result()
        del job
        # A cancelled job may still be giving its memory back.
        for _ in range(1000 if stop else 1):
            if abs(surfrecon.memory_in_use() - before) < 100_000:
                break
            time.sleep(0.01)
        else:
            raise AssertionError(f"{surfrecon.memory_in_use() - before:,} bytes are held")


LEAVE = """
import surfrecon
mesh = surfrecon.sculpture(cell=4.0)
job = surfrecon.Job.merge([mesh], voxel=0.2)
while job.progress()[1] == 0 and not job.done():
    pass
"""


def test_a_program_may_end_while_a_job_runs():
    done = subprocess.run([sys.executable, "-c", LEAVE], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")


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
