"""Contexts: threads, a limit on memory and a log for a part of a program."""

import gc
import logging
import threading
import weakref

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


GAPS = (logging.INFO, "the merged surface has 1 open boundary loop: close and max_hole_length say which close")


OPTIONS = {"voxel": 0.1, "max_hole_length": 0.0}


def square():
    """A surface with a border."""
    return surfrecon.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])


def with_a_gap():
    return surfrecon.merge([square()], **OPTIONS)


def test_calls_tell_the_logger_of_the_package(caplog, tmp_path):
    with caplog.at_level(logging.INFO, "surfrecon"):
        with_a_gap()
        with surfrecon.Context():
            surfrecon.Job.merge([square()], **OPTIONS).result()
        placed = square().with_crs("EPSG:25832")
        placed.write(tmp_path / "a 100 %s.stl")
        square().write(tmp_path / "square.ply")
        (tmp_path / "list.conf").write_text("bmesh square.ply 0 0 0 0 0 0 1")
        surfrecon.open(tmp_path / "list.conf")
    first, second, crs, opened = [(record.levelno, record.getMessage()) for record in caplog.records]
    assert first == second == GAPS
    assert crs[0] == logging.WARNING
    assert "a 100 %s.stl: .stl has no place for the coordinate reference system" in crs[1]
    assert opened[0] == logging.INFO
    assert "list.conf: quaternions read as" in opened[1]
    assert {record.name for record in caplog.records} == {"surfrecon"}


def test_without_a_handler_nothing_is_printed(capfd):
    logger = logging.getLogger("surfrecon")
    logger.propagate = False
    try:
        with_a_gap()
    finally:
        logger.propagate = True
    assert capfd.readouterr() == ("", "")


def test_a_context_has_a_log_of_its_own(caplog):
    said = []
    context = surfrecon.Context(log=lambda level, text: said.append((level, text)))
    with caplog.at_level(logging.INFO, "surfrecon"), context:
        with_a_gap()
        surfrecon.Job.merge([square()], **OPTIONS).result()
    assert said == [GAPS, GAPS]
    assert not caplog.records
    assert context.log is not None
    assert surfrecon.Context().log is None
    with pytest.raises(TypeError, match="log must be a function of level and text, got <class 'int'>"):
        surfrecon.Context(log=3)


def test_what_a_log_raises_fails_no_call(monkeypatch):
    raised = []
    monkeypatch.setattr("sys.unraisablehook", lambda info: raised.append(info.exc_value))

    def log(level, text):
        raise ValueError(text)

    with surfrecon.Context(log=log):
        assert len(with_a_gap().mesh.triangles) > 0
    assert [str(error) for error in raised] == [GAPS[1]]

    def stopped(level, text):
        raise KeyboardInterrupt

    with surfrecon.Context(log=stopped), pytest.raises(KeyboardInterrupt):
        with_a_gap()


def test_a_log_that_knows_its_context_keeps_neither():
    class Listener:
        def log(self, level, text):
            self.context.threads  # noqa: B018

    listener = Listener()
    listener.context = surfrecon.Context(log=listener.log)
    gone = weakref.ref(listener)
    del listener
    gc.collect()
    assert gone() is None
