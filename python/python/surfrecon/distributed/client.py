"""Tasks on Dask: one after the other on each thread of each worker, stage by stage."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterable, Mapping
from typing import Any

from .._arguments import function, is_url, whole
from .._errors import Cancelled, InputError
from .._reports import MergeReport
from .plan import Plan, Progress

__all__ = ["merge"]

# Of a worker's memory, which its interpreter and scans that are being read take as well.
_SHARE = 0.7
# Tasks of a stage for each thread: fast ones do more.
_TASKS_A_THREAD = 4
# How often workers are asked for: the answer has none where the client's own refresh, every two seconds, comes between.
_ASKED = 3


def merge(
    scans: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    output: str | os.PathLike[str],
    *,
    client: Any,
    workspace: str | os.PathLike[str] | None = None,
    tasks: int | None = None,
    keep: bool = False,
    max_memory: int | None = None,
    reading: Mapping[str, Any] | None = None,
    encoding: str | None = None,
    part_triangles: int = 0,
    provenance: Mapping[str, Any] | None = None,
    retries: int = 5,
    progress: Progress | None = None,
    **options: Any,
) -> MergeReport:
    """Merges scans on a Dask cluster, straight into a PLY file.

    The file's bytes are those of ``surfrecon.merge_to_file`` with the same options, however many workers there are, and
    whether any of them is lost: what it had done stays, what it was at is done again. Called again after it was stopped
    it goes on, if ``tasks`` and what else decides the result are the same.

    >>> from surfrecon import distributed
    >>> client = dask.distributed.Client("tcp://scheduler:8786")
    >>> report = distributed.merge("scans/", "surface.ply", client=client, tasks=8, voxel=0.05)

    Args:
        scans: files and folders, as for ``surfrecon.open``, under names that all workers know.
        output: the surface. Its ending is ``.ply``. A file that is there is replaced once all is written.
        client: a ``dask.distributed.Client``. Each task takes one thread of a worker. Processes of one thread are best.
        workspace: a folder that all workers reach under this name, or a URL that fsspec knows. Default: the folder of
            ``output``.
        tasks: how many tasks a stage has. By default it has four for each thread of the workers that are there.
        keep: what the merge finds out stays in the workspace for the next one with the same parameters and ``tasks``,
            which has to be given: see ``Plan.make``.
        max_memory: most bytes that a task takes. The default is 0.7 of what a worker may take, by its threads.
        reading: the keyword arguments of ``surfrecon.open``.
        encoding: as for ``surfrecon.merge_to_file``.
        part_triangles: as for ``surfrecon.merge_to_file``.
        provenance: as for ``surfrecon.merge_to_file``.
        retries: how often a task that fails, or whose worker is lost, is tried again. Dask gives a task up whose
            workers died more often than ``distributed.scheduler.allowed-failures``.
        progress: called as ``progress(stage, fraction)`` whenever a task is done; ``False`` cancels.
        options: those of ``surfrecon.merge``.

    Returns:
        The ``MergeReport``. Its ``seconds`` are of the last task.

    Raises:
        InputError: there is no worker, or one has no limit of memory and ``max_memory`` is not given, or
            scans that can't be used.
        ParameterError, FormatError, FileError, OutOfMemoryError: as of ``surfrecon.merge_to_file``, on any worker.
        TypeError: an argument of another kind, or an option that there is not.
        Cancelled: ``progress`` returned ``False``. The workspace keeps what is done: the same call goes on.
    """
    if keep and tasks is None:
        raise InputError("keep needs tasks: what is kept is of a merge of as many tasks")
    if not hasattr(client, "scheduler_info"):
        raise TypeError(f"client must be a dask.distributed.Client, got {client!r}")
    if whole("retries", retries) < 0:
        raise InputError(f"retries must be >= 0, got {retries}")
    function("progress", progress)
    if isinstance(workspace, str) and workspace.startswith("memory://"):
        raise InputError(
            f"{workspace}: that is one process's memory, which workers do not share: give a folder or an object store"
        )
    threads, memory = _workers(client)
    if max_memory is None and memory is None:
        raise InputError("a worker has no limit of memory: give max_memory, the bytes that a task may take")
    given = [scans] if isinstance(scans, str | os.PathLike) else scans
    plan = Plan.make(
        None,
        [_whole(path) for path in given],
        _whole(output),
        workspace=workspace,
        tasks=_TASKS_A_THREAD * threads if tasks is None else tasks,
        keep=keep,
        max_memory=memory if max_memory is None else max_memory,
        reading=reading,
        encoding=encoding,
        part_triangles=part_triangles,
        provenance=provenance,
        **(options | {"threads": 1}),
    )
    report = MergeReport(_done(plan, client, retries, progress)["report"])
    plan.remove()
    return report


def _whole(path: Any) -> Any:
    """A path as workers find it. The plan refuses anything that is no path."""
    is_path = isinstance(path, str | os.PathLike) and not is_url(os.fspath(path))
    return os.path.abspath(path) if is_path else path


def _workers(client: Any) -> tuple[int, int | None]:
    """Threads of all workers, and bytes that each may take."""
    workers: list[Any] = []
    for _ in range(_ASKED):
        workers = workers or list(client.scheduler_info(n_workers=-1)["workers"].values())
    if not workers:
        raise InputError("the cluster has no worker yet: wait for one with client.wait_for_workers(1)")
    limits = [worker["memory_limit"] / worker["nthreads"] for worker in workers if worker["memory_limit"]]
    memory = int(_SHARE * min(limits)) if len(limits) == len(workers) else None
    return sum(worker["nthreads"] for worker in workers), memory


def _done(plan: Plan, client: Any, retries: int, progress: Progress | None) -> dict[str, Any]:
    """Does all tasks. Returns the figures of the last."""
    from distributed import as_completed

    # Dask takes a key that it knows for one that is done, and workers a plan for the one that they have read.
    call = uuid.uuid4().hex
    every = plan.stages[-1].tasks.stop
    done = 0
    found: dict[str, Any] = {}
    for stage in plan.stages:
        futures = [
            client.submit(
                _run,
                call,
                plan.path,
                number,
                key=f"{stage.name}-{call}-{number}",
                retries=retries,
                pure=False,
            )
            for number in stage.tasks
        ]
        try:
            for _, figures in as_completed(futures, with_results=True):
                done, found = done + 1, figures
                if progress is not None and progress(stage.name, done / every) is False:
                    raise Cancelled(
                        "the merge was cancelled, and the workspace keeps what is done: call it again to go on"
                    )
        finally:
            client.cancel(futures, force=True)
    return found


def _run(call: str, path: str, number: int) -> dict[str, Any]:
    """A task on a worker."""
    plan = _plans.get(call)
    if plan is None:
        plan = Plan.read(path)
        _plans.clear()
        _plans[call] = plan
    return plan.run(number, threads=1)


# The plan that this worker has read last, by the call: the headers of its scans are read once.
_plans: dict[str, Plan] = {}
