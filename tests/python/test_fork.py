"""Forked processes, as multiprocessing makes them by default on Linux before Python 3.14: what the parent did before
the fork, or does while it forks, keeps no child from its work. A child that hangs is ended and fails its test."""

import functools
import hashlib
import multiprocessing
import threading

import numpy as np
import pytest
import surfrecon
from shapes import torus, torus_scans

if "fork" not in multiprocessing.get_all_start_methods():
    pytest.skip("this system has no fork", allow_module_level=True)
FORK = multiprocessing.get_context("fork")
# Seconds for a child's work of a fraction of one.
LIMIT = 60


def digest(*arrays):
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()


def shape(mesh):
    return digest(mesh.positions, mesh.triangles)


@functools.cache
def scans():
    return torus_scans(pixels=40)


def merged(_=None):
    return shape(surfrecon.merge(scans()).mesh)


def sculpted():
    return shape(surfrecon.sculpt(scans()[0], tolerance=0.01).mesh)


def reconstructed():
    return shape(surfrecon.reconstruct(torus(24).positions).mesh)


def clustered():
    return shape(surfrecon.cluster(torus(24), vertices=100).mesh)


def measured():
    return digest(surfrecon.distances(np.eye(3), torus(24)))


def in_child(work):
    """The value that ``work()`` returns in a forked child."""
    answers = FORK.SimpleQueue()
    child = FORK.Process(target=lambda: answers.put(work()), daemon=True)
    child.start()
    child.join(LIMIT)
    hangs = child.exitcode is None
    if hangs:
        child.kill()
        child.join()
    assert not hangs, "the child hangs"
    assert child.exitcode == 0
    return answers.get()


def in_grandchild(work):
    # Children of daemons are nothing that multiprocessing offers.
    multiprocessing.current_process()._config["daemon"] = False
    return in_child(work)


@pytest.mark.parametrize("work", [merged, sculpted, reconstructed, clustered, measured], ids=lambda work: work.__name__)
def test_a_child_and_its_child_do_what_the_parent_did(work):
    expected = work()
    assert in_child(lambda: (work(), in_grandchild(work))) == (expected, expected)


def test_a_pool_of_processes_works_after_a_call_in_the_parent():
    expected = merged()
    with FORK.Pool(2) as pool:
        assert pool.map_async(merged, range(4)).get(LIMIT) == [expected] * 4


def test_children_forked_in_the_middle_of_a_call_of_another_thread():
    expected = merged()
    end, rounds = threading.Event(), []

    def work_on():
        while not end.is_set():
            rounds.append(merged() == expected)

    thread = threading.Thread(target=work_on)
    thread.start()
    try:
        for _ in range(20):
            assert in_child(merged) == expected
    finally:
        end.set()
        thread.join()
    assert rounds and all(rounds)


def test_children_forked_while_other_threads_are_at_folders_in_memory():
    end = threading.Event()
    shared = surfrecon.MemoryFolder()

    def work_on():
        while not end.is_set():
            for _ in range(100):
                surfrecon.MemoryFolder()
                shared["a"] = b"abc"

    def put():
        folder = surfrecon.MemoryFolder()
        folder["b"] = shared["b"] = b"x"
        return folder["b"] + shared["b"]

    threads = [threading.Thread(target=work_on) for _ in range(3)]
    for thread in threads:
        thread.start()
    try:
        for _ in range(60):
            assert in_child(put) == b"xx"
    finally:
        end.set()
        for thread in threads:
            thread.join()


def test_a_child_is_told_that_a_sink_was_in_use():
    began, end = threading.Event(), threading.Event()

    def sink(_, piece):
        began.set()
        end.wait(LIMIT)

    folder = surfrecon.MemoryFolder(sink)
    thread = threading.Thread(target=lambda: torus(8).write(folder / "a.ply"))
    thread.start()
    assert began.wait(LIMIT)

    def write():
        try:
            torus(8).write(folder / "b.ply")
        except OSError as error:
            return str(error)
        return ""

    try:
        assert "forked while another thread wrote into this folder" in in_child(write)
    finally:
        end.set()
        thread.join()


def test_a_job_of_the_parent_says_that_it_is_not_the_child_s():
    job = surfrecon.Job.merge(scans(), voxel=0.002)

    def ask():
        with pytest.raises(RuntimeError, match="runs in process .*, from which this one was forked"):
            job.result()
        job.cancel()
        return job.done(), repr(job)

    try:
        done, shown = in_child(ask)
    finally:
        job.cancel()
    assert done and "another process" in shown
    with pytest.raises(surfrecon.Cancelled):
        job.result()


def test_a_reconstructor_that_was_at_work_is_refused_in_the_child():
    points = torus(24).positions
    reconstructor = surfrecon.Reconstructor(points)
    expected = shape(reconstructor.surface().mesh)
    answers = []

    def ask():
        with pytest.raises(surfrecon.InputError, match="when this process was forked"):
            reconstructor.surface()
        with pytest.raises(surfrecon.InputError, match="when this process was forked"):
            surfrecon.Job.surface(reconstructor).result()
        return shape(surfrecon.Reconstructor(points).surface().mesh)

    def fork(*_):
        if not answers:
            answers.append(in_child(ask))

    # Within its progress function it is at work for certain.
    assert shape(reconstructor.surface(progress=fork).mesh) == expected
    assert answers == [expected]
    # One that was idle goes on in the child.
    assert in_child(lambda: shape(reconstructor.surface().mesh)) == expected
