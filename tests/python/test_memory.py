"""Work that does not fit is refused before it begins, and says what would fit."""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import surfrecon


def holds_limits():
    """Whether programs get no more memory than they are allowed: Windows can't say how much, emulators don't count."""
    if sys.platform != "linux":
        return False
    program = "import resource as r; r.setrlimit(r.RLIMIT_AS, (1 << 31, r.RLIM_INFINITY)); bytearray(1 << 32)"
    return subprocess.run([sys.executable, "-c", program], capture_output=True).returncode != 0


limited = pytest.mark.skipif(not holds_limits(), reason="this system holds programs to no limit of their memory")


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
    said = "not enough memory: a surface through 1000 points needs about 400 kB, {} kB are allowed: about {} would fit"
    # The memory that the call holds already, some hundred bytes, may take the place of a few points.
    assert str(refused.value) in [said.format(kb, fit) for kb in (98, 99, 100) for fit in range(245, 251)]
    limit(None)
    mesh = surfrecon.sculpture()
    limit(40_000_000)
    with pytest.raises(surfrecon.OutOfMemoryError, match="are allowed: choose a voxel of .*, which fits"):
        surfrecon.merge([mesh], voxel=1e-4)
    half = surfrecon.Mesh(mesh.positions, mesh.triangles[mesh.positions[mesh.triangles, 0].max(axis=1) < 0])
    limit(surfrecon.memory_in_use() + 60_000_000)
    with pytest.raises(surfrecon.OutOfMemoryError, match="closing on a grid of .* nodes .*: give a larger cell"):
        surfrecon.close(half, cell=1.0)
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


@limited
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


@limited
@pytest.mark.parametrize("threads", [1, 3])
def test_threads_that_can_not_start_are_an_error(threads):
    program = """
import resource, surfrecon, sys
surfrecon.formats()
pages = int(open("/proc/self/statm").read().split()[0])
room = pages * resource.getpagesize() + int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_AS, (room, resource.RLIM_INFINITY))
try:
    surfrecon.sculpture(cell=16, threads=int(sys.argv[2]))
except MemoryError as error:
    print("MemoryError")
"""
    # Its stack fits, and then little else.
    for kilobytes in (2040, 2050, 2058, 2060, 2064, 2068, 2072, 2080, 2100, 2200, 3000, 3100, 3200):
        room = (threads - 1) * 2048 + kilobytes
        run = [sys.executable, "-c", program, str(room << 10), str(threads)]
        done = subprocess.run(run, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, ""), (kilobytes, done.returncode, done.stderr)


def test_a_limit_is_kept_by_jobs_that_run_already(limit):
    mesh = surfrecon.RangeImage.orthographic(np.random.default_rng(1).random((700, 700)), step=(1, -1)).triangulate()
    job = surfrecon.Job.cluster(mesh, vertices=1000)
    while job.progress()[1] == 0 and not job.done():
        pass
    limit(1_000_000)
    with pytest.raises(MemoryError):
        job.result()


def calls():
    """Calls of every kind that take a few megabytes: the operations, what makes arrays, a reader, a writer."""
    y, x = np.mgrid[:300, :300].astype(float)
    heights = 20 * np.sin(x / 37) * np.cos(y / 29) + np.random.default_rng(1).normal(0, 0.05, x.shape)
    image = surfrecon.RangeImage.orthographic(heights, step=(1, -1))
    mesh = image.triangulate()
    points = mesh.positions[::7].copy()
    quads = surfrecon.adaptive_quads(image, rows=20, columns=20)
    return {
        "RangeImage": lambda: surfrecon.RangeImage.orthographic(heights, step=(1, -1)),
        "Mesh": lambda: surfrecon.Mesh(mesh.positions, mesh.triangles),
        "triangulate": image.triangulate,
        "world_points": image.world_points,
        "positions_f32": mesh.positions_f32,
        "check": mesh.check,
        "sculpt": lambda: surfrecon.sculpt(image, tolerance=0),
        "Sculptor": lambda: surfrecon.Sculptor(image),
        "adaptive_quads": lambda: surfrecon.adaptive_quads(image, rows=20, columns=20),
        "spline": quads.spline,
        "merge": lambda: surfrecon.merge([image], voxel=1.0),
        "reconstruct": lambda: surfrecon.reconstruct(points),
        "cluster": lambda: surfrecon.cluster(mesh, vertices=500),
        "distances": lambda: surfrecon.distances(points, mesh),
        "surface_distance": lambda: surfrecon.surface_distance(mesh, mesh),
        "sculpture": lambda: surfrecon.sculpture(cell=8.0),
        "virtual_scan": lambda: surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=1, above=0, below=0)),
        "turntable": lambda: surfrecon.turntable(mesh, around=20_000),
    }


CALLS = calls()


@pytest.mark.parametrize("name", CALLS)
def test_the_limit_holds_whatever_was_foreseen(name, limit):
    call = CALLS[name]

    def peak():
        surfrecon.memory_peak(restart=True)
        before = surfrecon.memory_in_use()
        result = call()
        del result
        return surfrecon.memory_peak() - before

    call()
    whole = peak()
    foreseen = surfrecon.memory_foreseen()
    limit(whole // 2)
    before = surfrecon.memory_in_use()
    with pytest.raises(MemoryError, match="not enough memory"):
        peak()
    assert surfrecon.memory_peak() - before <= whole // 2 + 100_000
    limit(max(whole, foreseen) + 2_000_000)
    assert peak() <= whole * 1.1 + 100_000


STARVED = """
import resource, sys
import numpy as np
sys.path.insert(0, {folder!r})
import surfrecon, test_memory
call = test_memory.CALLS[{name!r}]
call()
pages = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
refused = 0
for more in [0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512]:
    resource.setrlimit(resource.RLIMIT_AS, (pages + more * (1 << 20), resource.RLIM_INFINITY))
    try:
        call()
    except MemoryError:
        refused += 1
resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
call()
print("alive", refused)
"""


@limited
@pytest.mark.parametrize(
    "name", ["adaptive_quads", "sculpture", "virtual_scan", "cluster", "spline", "merge", "world_points"]
)
def test_a_system_without_memory_is_no_end(name):
    code = STARVED.format(folder=os.path.dirname(__file__), name=name)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("alive"), done.stderr


def test_numbers_that_ask_for_too_much_are_refused():
    mesh = surfrecon.sculpture(cell=20.0)
    with pytest.raises(MemoryError, match="placing 1000000004 cameras needs"):
        surfrecon.turntable(mesh, around=10**9)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_waiting_for_a_job_can_be_interrupted_and_its_result_fetched_later():
    mesh = surfrecon.sculpture(cell=3.0)
    job = surfrecon.Job.cluster(mesh, vertices=5000)

    class Interrupted(Exception):
        pass

    def interrupt(*_):
        raise Interrupted

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        began = time.perf_counter()
        with pytest.raises(Interrupted):
            job.result()
        assert time.perf_counter() - began < 5
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert len(job.result().mesh.positions) >= 5000


def test_file_errors_survive_pickling(tmp_path):
    with pytest.raises(surfrecon.FileError) as caught:
        surfrecon.sculpture(cell=20.0).write(tmp_path / "none" / "x.ply")
    assert caught.value.errno == 2 and "there is no folder" in str(caught.value)
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.errno, again.filename, str(again)) == (2, caught.value.filename, str(caught.value))


@pytest.mark.parametrize("given", [-1, -(10**6000), 1 << 64, 1 << 100], ids=["-1", "long", "2^64", "2^100"])
def test_a_limit_that_is_no_number_of_bytes_is_refused_in_words(limit, given):
    for name, call in [("bytes", limit), ("memory_limit", lambda given: surfrecon.Context(memory_limit=given))]:
        told = rf"^{name} must be >= 0 and < 2\^64, 0 or None for no limit, got"
        with pytest.raises(surfrecon.InputError, match=told):
            call(given)
        with pytest.raises(TypeError):
            call("much")
    assert surfrecon.memory_limit() is None


def test_a_limit_of_no_bytes_is_none(limit):
    limit(10**9)
    limit(0)
    assert surfrecon.memory_limit() is None
    assert surfrecon.Context(memory_limit=0).memory_limit is None
    surfrecon.reconstruct(np.random.default_rng(1).random((100, 3)))
    mesh = surfrecon.sculpture(cell=8.0)
    assert not surfrecon.merge([mesh], voxel=8.0, max_memory=0).report.in_files


def test_a_limit_may_be_larger_than_any_memory(limit):
    for given in [1 << 63, (1 << 64) - 2]:
        limit(given)
        assert surfrecon.memory_limit() == given
        surfrecon.reconstruct(np.random.default_rng(1).random((100, 3)))


def test_what_is_written_into_memory_beyond_the_limit_names_it(limit):
    mesh, folder = surfrecon.sculpture(cell=4.0), surfrecon.MemoryFolder()
    limit(mesh.positions.nbytes // 2)
    with pytest.raises(surfrecon.OutOfMemoryError, match=r"could not be had, \d+ kB are allowed: raise the limit"):
        mesh.write(folder / "sculpture.ply")
    limit(None)
    assert len(folder) == 0
    mesh.write(folder / "sculpture.ply")
