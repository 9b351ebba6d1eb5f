"""A merge as tasks: a file that names the scans, the parameters and the folder where tasks leave what they find."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from .. import _native
from .._arguments import function, is_url, whole
from .._errors import FileError, FormatError, InputError
from .._report import jsonable
from .checks import check, check_made, check_names, name_of
from .storage import Storage, plain, read_text, remove_file, write_text

__all__ = ["Plan", "Stage"]

# The files that a stage reads of the stages before, and those that it leaves, by the beginnings of their names.
_READS = {
    "plan": (),
    "collect": (),
    "overlap": ("segment-", "done-collect-"),
    "fuse": ("segment-", "done-collect-", "done-overlap-"),
    "look": ("done-overlap-", "done-fuse-", "block-"),
    "drop": ("done-overlap-", "done-fuse-", "done-look-", "block-", "votes-"),
    "colours": ("done-overlap-", "done-drop-", "block-", "left-"),
    "label": ("done-overlap-", "done-drop-", "done-colours-", "block-", "left-"),
    "build": ("done-overlap-", "done-label-", "labels-"),
    "write": ("done-overlap-", "done-drop-", "done-colours-", "done-label-", "done-build-", "tile-"),
}
# Files that nobody wants any more once a stage has begun.
_SPENT = {"look": ("segment-",), "colours": ("votes-",), "build": ("block-", "left-"), "write": ("labels-",)}
WRITE = "write"

Progress = Callable[[str, float], object]


@dataclass(frozen=True)
class Stage:
    """A stage of a merge: its name, and the numbers of its tasks, which need nothing of each other.

    >>> stage = Plan.make("merge.json", "scans/", "surface.ply", workspace="work/", tasks=4).stages[1]
    >>> stage.name, stage.tasks
    ('collect', range(1, 5))
    """

    name: str
    tasks: range


class Plan:
    """A merge as tasks.

    >>> plan = Plan.make("merge.json", "scans/", "surface.ply", workspace="work/", tasks=16)
    >>> for stage in plan.stages:
    ...     for number in stage.tasks:
    ...         figures = plan.run(number)
    >>> plan.remove()
    """

    def __init__(self, path: str, content: Mapping[str, Any]) -> None:
        """``path`` is the file, ``content`` what it holds: see `Plan.read`."""
        self.path = path
        self._content = content
        self._scans: _native.ScanSet | None = None

    @classmethod
    def make(
        cls,
        path: str | os.PathLike[str] | None,
        scans: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
        output: str | os.PathLike[str],
        *,
        workspace: str | os.PathLike[str] | None = None,
        tasks: int = 16,
        keep: bool = False,
        max_memory: int | None = None,
        reading: Mapping[str, Any] | None = None,
        encoding: str | None = None,
        part_triangles: int = 0,
        provenance: Mapping[str, Any] | None = None,
        **options: Any,
    ) -> Plan:
        """Plans a merge. Of the scans headers alone are read.

        Where a merge of the same scans with the same parameters and as many tasks was planned in the same workspace
        before, and its folder is there still, the tasks that were done are done.

        >>> plan = Plan.make("merge.json", "scans/", "surface.ply", workspace="work/", tasks=4, voxel=3.0)
        >>> len(plan.stages[-1].tasks)  # the last one writes the surface
        1

        Args:
            path: where the plan is written. Names in it are relative to its folder where they lie in that. ``None``:
                into the workspace.
            scans: files and folders, as for ``surfrecon.open``.
            output: the surface. Its ending is ``.ply``.
            workspace: a folder that exists, or a URL that fsspec knows (``s3://bucket/folder``): tasks leave up to 200
                bytes for each intersection of a scan with the grid in a folder there. All processes have to reach it.
                Default: the plan's folder, else that of ``output``.
            tasks: how many tasks a stage has. Some stages are one task. A few for each process let fast ones do more.
            keep: what the merge finds out stays in the workspace, a folder, as with ``surfrecon.merge_to_file``: the
                next one planned in it with the same parameters and as many tasks, for these scans, some more, fewer or
                moved, renews only what they have a part in. One at a time.
            max_memory: most bytes that a process takes for a task. By default what is free.
            reading: the keyword arguments of ``surfrecon.open``.
            encoding: how the surface is written, as for ``surfrecon.merge_to_file``.
            part_triangles: most triangles of a file, as for ``surfrecon.merge_to_file``.
            provenance: what the file says of where it is from, as for ``surfrecon.merge_to_file``.
            options: those of ``surfrecon.merge``. ``threads`` are those of each task.

        Raises:
            InputError: scans that can't be used, a workspace that is no folder, or an output that is a scan, has no
                folder or another ending.
            ParameterError: an option out of its range.
            TypeError: an argument of another kind, or an option that there is not.
            FormatError, FileError: a file that can't be read or written.
        """
        path = None if path is None else os.fspath(path)
        given = [scans] if isinstance(scans, str | os.PathLike) else list(scans)
        try:
            paths = [os.fspath(one) for one in given]
        except TypeError:
            raise InputError("scans must be names of files and folders, which each process opens") from None
        output = os.fspath(output)
        check(
            tasks=tasks,
            keep=keep,
            max_memory=max_memory,
            encoding=encoding,
            part_triangles=part_triangles,
            provenance=provenance,
            options=options,
        )
        check_names(paths, output)
        workspace = plain(os.fspath(workspace)) if workspace is not None else os.path.dirname(path or output) or "."
        if keep and is_url(workspace):
            raise InputError(f"{workspace}: keep needs a workspace that is a folder, not an object store")
        reading = dict(reading or {})
        opened = _native.open(paths, **reading)
        if not len(opened):
            raise InputError(f"{paths[0] if paths else 'no file'}: there is no scan to merge")
        if os.path.realpath(output) in {os.path.realpath(scan.path) for scan in opened}:
            raise InputError(f"{output} is a scan: give the surface another name")
        content: dict[str, Any] = {
            "surfrecon": _native.__version__,
            "reading": reading,
            "tasks": int(tasks),
            "keep": bool(keep),
            "scans": _stamps(opened),
            "options": options,
        }
        content["name"] = name_of(content)
        storage = Storage.of(workspace, content["name"])
        storage.make()
        # Workers may have another working folder.
        path = path or (f"{storage.place}.json" if is_url(workspace) else f"{os.path.abspath(storage.place)}.json")
        folder = None if is_url(path) else os.path.dirname(os.path.abspath(path))
        content |= {
            "paths": [_named(one, folder) for one in paths],
            "workspace": _named(workspace, folder),
            "output": _named(output, folder),
            "written": {"encoding": encoding, "part_triangles": part_triangles, "provenance": provenance},
            "max_memory": max_memory,
        }
        plan = cls(path, jsonable(content))
        plan._scans = opened
        try:
            plan._write()
        except FileError:
            storage.discard()
            raise
        return plan

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Plan:
        """Reads a plan.

        >>> plan = Plan.make("merge.json", "scans/", "surface.ply", workspace="work/")  # once
        >>> figures = Plan.read("merge.json").run(0)  # in each process, with a number of its own

        Raises:
            FileError: it can't be read.
            FormatError: it is no plan, one that was changed after it was made, or that of another version, whose files
                this one does not understand.
        """
        path = os.fspath(path)
        try:
            content = json.loads(read_text(path))
        except ValueError as failed:
            raise FormatError(f"{path}: this is no plan of a merge: {failed}") from None
        if (problem := check_made(content)) is not None:
            raise FormatError(f"{path}: {problem}")
        return cls(path, content)

    @property
    def stages(self) -> list[Stage]:
        """The stages in their order. The last one, which is one task, writes the surface."""
        found, first = [], 0
        for name, count in [*_native._merge_stages(self._content["tasks"]), (WRITE, 1)]:
            found.append(Stage(name, range(first, first + count)))
            first += count
        return found

    @property
    def name(self) -> str:
        """The name of the merge: the same for the same scans, parameters and tasks. If it keeps, for any scans."""
        return str(self._content["name"])

    @property
    def folder(self) -> str:
        """The merge's own folder, in which tasks leave what they find."""
        return self._storage().place

    @property
    def output(self) -> str:
        """The surface."""
        return self._placed(self._content["output"])

    @property
    def keep(self) -> bool:
        """Whether what tasks leave stays for another merge."""
        return bool(self._content["keep"])

    @property
    def threads(self) -> int:
        """Threads of a task. 0 stands for all there are."""
        return int(self._content["options"].get("threads") or 0)

    def run(
        self,
        number: int,
        *,
        threads: int | None = None,
        max_memory: int | None = None,
        scratch: str | os.PathLike[str] | None = None,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Does a task, unless it is done. Once the surface is written all are, as long as it stays as it is.

        Args:
            number: which. All tasks of the stages before have to be done.
            threads: instead of the plan's.
            max_memory: instead of the plan's.
            scratch: where files of a workspace that is a URL are kept as long as they are needed. By default the
                system's folder for temporary files.
            progress: as of ``surfrecon.merge``.

        Returns:
            A few figures: ``stage``, ``task``, ``seconds``. Of the last task ``output`` and ``report`` as well, which
            names all scans.

        Raises:
            InputError: there is no such task, or one before it is not done, or scans have changed since they were
                planned.
            FormatError, FileError: files that can't be read or written, or are damaged.
            OutOfMemoryError: less memory than a task takes at least.
            Cancelled: ``progress`` said so. What other tasks left stays.
        """
        function("progress", progress)
        stage, first = self._stage_of(whole("number", number))
        if (figures := self._made(stage, number)) is not None:
            return figures
        try:
            return self._run(stage, first, number, threads, max_memory, scratch, progress)
        except (FileError, FormatError, InputError):
            # A process that did the last task at the same time has removed what tasks had left.
            with suppress(FileError, FormatError):
                self._content = Plan.read(self.path)._content
            if (figures := self._made(stage, number)) is not None:
                return figures
            raise

    def _run(
        self,
        stage: str,
        first: int,
        number: int,
        threads: int | None,
        max_memory: int | None,
        scratch: str | os.PathLike[str] | None,
        progress: Progress | None,
    ) -> dict[str, Any]:
        began = time.monotonic()
        storage = self._storage()
        options = dict(self._content["options"])
        options["threads"] = self.threads if threads is None else threads
        limit = self._content["max_memory"] if max_memory is None else max_memory
        cut = {name: self._content[name] for name in ("tasks", "keep")}
        cut["has_a_part"] = storage.is_remote
        call: dict[str, Any] = {**cut, "max_memory": limit, "progress": progress, **options}
        found: dict[str, Any] = {"stage": stage, "task": number}
        wanted = ("done-plan-", f"done-{stage}-", *_READS[stage])
        with storage.at_hand(wanted, _SPENT.get(stage, ()), scratch) as folder:
            self._refuse_early(stage, number - first, folder)
            if stage == WRITE:
                written = self._content["written"]
                report = _native._merge_tasks_to_file(self._opened(), folder, self.output, **written, **call)
                found |= {"output": self.output, "report": jsonable(report.as_dict())}
                made = {"file": _stamp(self.output), "report": found["report"]}
                self._content = {**self._content, "made": made}
                self._write()
                _native._end_merge_tasks(self._opened(), folder, **cut, max_memory=limit, **options)
            else:
                _native._merge_task(self._opened(), folder, stage, number - first, **call)
        return found | {"seconds": round(time.monotonic() - began, 3)}

    def clear(self) -> None:
        """Removes what tasks have left. The plan and the surface stay."""
        self._storage().remove()

    def remove(self) -> None:
        """Removes the plan and what tasks have left, but for what is to be kept. The surface stays."""
        if not self.keep:
            self.clear()
        remove_file(self.path)

    def _made(self, stage: str, number: int) -> dict[str, Any] | None:
        """The figures of a task, if the surface is written already."""
        made = self._content.get("made")
        if made is None:
            return None
        try:
            if _stamp(self.output) != made["file"]:
                return None
        except FileError:
            return None
        written = {"output": self.output, "report": made["report"]} if stage == WRITE else {}
        return {"stage": stage, "task": number, **written, "seconds": 0.0}

    def _write(self) -> None:
        write_text(self.path, json.dumps(self._content, indent=1) + "\n")

    def _refuse_early(self, stage: str, number: int, folder: str) -> None:
        """Names the first task of the stage before that is not done, unless this one is."""
        every = self.stages
        place = [one.name for one in every].index(stage)
        if not place or os.path.exists(os.path.join(folder, f"done-{stage}-{number:06}")):
            return
        before = every[place - 1]
        for k, task in enumerate(before.tasks):
            if not os.path.exists(os.path.join(folder, f"done-{before.name}-{k:06}")):
                text = f"{self.path}: task {task} ({before.name}) is not done: {stage} needs it first"
                if self.keep:
                    text += ". If it was done, another merge has begun in this workspace: plan this one anew after it."
                raise InputError(text)

    def _stage_of(self, number: int) -> tuple[str, int]:
        for stage in self.stages:
            if number in stage.tasks:
                return stage.name, stage.tasks.start
        last = self.stages[-1].tasks.start
        raise InputError(f"{self.path}: there is no task {number}: give one from 0 to {last}")

    def _storage(self) -> Storage:
        return Storage.of(self._placed(self._content["workspace"]), self.name)

    def _placed(self, name: str) -> str:
        if is_url(name) or is_url(self.path):
            return name
        return os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(self.path)), name))

    def _opened(self) -> _native.ScanSet:
        """The scans, if they are what was planned."""
        if self._scans is None:
            self._scans = _native.open(
                [self._placed(path) for path in self._content["paths"]], **self._content["reading"]
            )
        before, now = self._content["scans"], jsonable(_stamps(self._scans))
        if (what := _changed(before, now)) is not None:
            raise InputError(f"{what} since {self.path} was planned: plan it anew")
        return self._scans


def _named(path: str, folder: str | None) -> str:
    """A path as a plan in this folder names it: relative where it lies in it, so that both may lie elsewhere."""
    if is_url(path):
        return path
    whole = os.path.abspath(path)
    inside = folder is not None and os.path.commonpath([folder, whole]) == folder
    return os.path.relpath(whole, folder) if inside else whole


# Of a stamp the first entries, which tell which scan it is.
_IS_NAME = 3


def _stamps(scans: _native.ScanSet) -> list[list[Any]]:
    """The facts that tell of each scan whether it is the same: name, file, part, size, time, pose."""
    found: list[list[Any]] = []
    files: dict[str, list[int]] = {}
    for scan in scans:
        path = os.fspath(scan.path)
        if path not in files:
            files[path] = _stamp(path)
        pose = hashlib.sha256(scan.world_from_sensor.tobytes()).hexdigest()[:16]
        found.append([scan.name, os.path.basename(path), scan.part, *files[path], pose])
    return found


def _changed(before: list[list[Any]], now: list[list[Any]]) -> str | None:
    """The change of scans, by their stamps: the first that is gone, came, or is another."""
    for these, those, became in ((before, now, "is gone"), (now, before, "came")):
        others = {tuple(stamp[:_IS_NAME]) for stamp in those}
        different = [stamp for stamp in these if tuple(stamp[:_IS_NAME]) not in others]
        if different:
            more = f", and {len(different) - 1} more," if len(different) > 1 else ""
            return f"{different[0][1]}: scan {different[0][0]} {became}{more}"
    for planned, found in zip(before, now, strict=False):
        if planned != found:
            return f"{found[1]}: scan {found[0]} has changed"
    return None if len(before) == len(now) else f"{len(before)} scans became {len(now)}"


def _stamp(path: str) -> list[int]:
    """Size and time of a file."""
    try:
        status = os.stat(path)
    except OSError as problem:
        raise FileError(f"{path}: {problem.strerror}") from None
    return [status.st_size, status.st_mtime_ns]
