"""Contexts: threads and a limit on memory for a part of a program."""

import threading

import numpy as np
import pytest
import surfrecon

POINTS = np.random.default_rng(1).random((1000, 3))


def test_a_limit_holds_within_its_context_alone():
    narrow, wide = surfrecon.Context(memory_limit=100_000), surfrecon.Context()
    reconstructor = surfrecon.Reconstructor(POINTS)
    with narrow:
        with pytest.raises(surfrecon.OutOfMemoryError, match=r"needs about 400 kB, \d+ kB are allowed"):
            surfrecon.reconstruct(POINTS)
        with wide:
            surfrecon.reconstruct(POINTS)
        with pytest.raises(surfrecon.OutOfMemoryError):
            surfrecon.Job.surface(reconstructor).result()
    surfrecon.reconstruct(POINTS)
    surfrecon.set_memory_limit(100_000)
    try:
        with pytest.raises(surfrecon.OutOfMemoryError), wide:
            surfrecon.reconstruct(POINTS)
        with surfrecon.Context(memory_limit=10**9):
            surfrecon.reconstruct(POINTS)
    finally:
        surfrecon.set_memory_limit(None)


def test_threads_enter_and_leave_a_context_by_themselves():
    context = surfrecon.Context(threads=2, memory_limit=10_000)
    assert (context.threads, context.memory_limit) == (2, 10_000)
    assert repr(context) == "Context(threads=2, memory_limit=10000)"
    entered, left, seen = threading.Event(), threading.Event(), []

    def work():
        with context, context:
            entered.set()
            assert left.wait(10)
            with pytest.raises(surfrecon.OutOfMemoryError):
                surfrecon.reconstruct(POINTS)
        seen.append(surfrecon.reconstruct(POINTS))

    thread = threading.Thread(target=work)
    with context:
        thread.start()
        assert entered.wait(10)
    surfrecon.reconstruct(POINTS)
    left.set()
    thread.join()
    assert len(seen) == 1
    with pytest.raises(RuntimeError, match="has not entered"):
        context.__exit__(None, None, None)


def test_blocks_may_end_in_another_order_than_they_began():
    def part(context):
        with context:
            yield
            yield

    narrow, wide = surfrecon.Context(memory_limit=10_000), surfrecon.Context()
    for first, second, is_narrow in [(narrow, wide, False), (wide, narrow, True), (narrow, narrow, True)]:
        blocks = part(first), part(second)
        for block in blocks:
            next(block)
        blocks[0].close()
        if is_narrow:
            with pytest.raises(surfrecon.OutOfMemoryError):
                surfrecon.reconstruct(POINTS)
        else:
            surfrecon.reconstruct(POINTS)
        blocks[1].close()
        surfrecon.reconstruct(POINTS)
    # As in a block that is entered while another context holds.
    with narrow:
        blocks = part(wide), part(surfrecon.Context())
        for block in blocks:
            next(block)
        for block in blocks:
            block.close()
        with pytest.raises(surfrecon.OutOfMemoryError):
            surfrecon.reconstruct(POINTS)


def test_results_are_the_same_under_any_context():
    mesh = surfrecon.sculpture(cell=8.0)
    expected = surfrecon.merge([mesh], voxel=6.0).mesh
    for threads in [1, 3]:
        with surfrecon.Context(threads=threads):
            found = surfrecon.merge([mesh], voxel=6.0).mesh
        assert np.array_equal(found.positions, expected.positions)
        assert np.array_equal(found.triangles, expected.triangles)


@pytest.mark.parametrize("threads", [-1, 1025])
def test_threads_that_can_not_be_are_refused(threads):
    with pytest.raises(surfrecon.ParameterError, match=f"threads must be >= 0 and <= 1024, got {threads}"):
        surfrecon.Context(threads=threads)
