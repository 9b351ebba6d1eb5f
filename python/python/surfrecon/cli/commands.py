"""The commands, each with what it takes and what it writes."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .. import _native
from .._arguments import is_url
from .._errors import InputError
from ..distributed.checks import MOST_TASKS
from . import advice, operations
from .options import Own, Row, rows
from .requests import Request, UsageError
from .work import Made, Work

__all__ = ["COMMANDS", "Command"]


@dataclass(frozen=True)
class Command:
    """A command."""

    name: str
    # In a line, and in full.
    summary: str
    text: str
    # The names of its files.
    inputs: str
    run: Callable[[Work], Made]
    # Operations of the core whose parameters it takes.
    takes: tuple[str, ...] = ()
    # Options that are none of the core's table.
    own: tuple[Row, ...] = ()
    # Endings of what it writes; without any it writes nothing.
    endings: tuple[str, ...] = ()
    # Whether the options of writing meshes are its own, too.
    meshes: bool = False
    # Whether it may leave its output out.
    output_is_optional: bool = False
    # Whether its output may be a URL that fsspec knows.
    urls: bool = False

    def is_file(self, output: str) -> bool:
        """Whether its output is a file, by its name."""
        return not (self.urls and is_url(output))

    def groups(self) -> list[tuple[str, list[Row]]]:
        """Its options: a title and rows, for each group."""
        groups: list[tuple[str, list[Row]]] = [(self.name, [*rows(*self.takes), *self.own])]
        groups.append(("reading files", [*rows("open"), _CAMERA, _CRS]))
        groups.append(("writing meshes", [*rows("write")] if self.meshes else []))
        return [(title, options) for title, options in groups if options]

    @property
    def written(self) -> str:
        """Its output, in words."""
        *most, last = (f".{ending}" for ending in self.endings)
        return f"{', '.join(most)} or {last}" if most else last

    def check(self, request: Request) -> None:
        """Refuses before hours of work what could not be made or written after them.

        Raises:
            UsageError: another ending, or parameters that do not go together.
        """
        output = request.output
        if output is not None:
            ending = os.path.splitext(output)[1].lower()
            if ending.removeprefix(".") not in self.endings or not ending:
                raise UsageError(f"{output}: the name of the output must end in {self.written}")
            encoding = request.parameters.get("encoding", "binary")
            if self.meshes and encoding != "binary" and ending != ".ply":
                raise UsageError(f'{output}: only .ply has the encoding "{encoding}"')
        if request.command == "plan":
            _check_plan(request)
        elif "workspace" in request.parameters:
            _check_workspace(request)
        elif request.parameters.get("keep"):
            raise UsageError("keep needs a workspace: give --workspace, a folder")
        if request.parameters.get("part_triangles"):
            _check_parts(request)
            _check_print_parts(request)
        levels = request.parameters.get("levels")
        if levels is None:
            return
        for name in ("vertices", "patches", "max_error", "triangles"):
            if name in request.parameters:
                raise UsageError(f"give levels or {name}, not both")
        if any(more <= less for more, less in itertools.pairwise(levels)) or levels[-1] < 1:
            raise UsageError(f"levels must fall, and be 1 at least, got {','.join(map(str, levels))}")
        if output is not None and len(levels) > 1 and not output.lower().endswith(".glb"):
            raise UsageError(f"{output}: several levels of detail go into a .glb alone")

    def options(self) -> dict[str, Row]:
        """All its options by name."""
        return {row.name: row for _, options in self.groups() for row in options}


def _check_workspace(request: Request) -> None:
    workspace, output = request.parameters["workspace"], request.output or ""
    if not os.path.isdir(workspace):
        raise UsageError(f"{workspace}: the workspace must be a folder that exists")
    _check_pieces(request, output)
    if request.parameters.get("measure"):
        raise UsageError("give measure or workspace, not both: surfrecon measure takes the file and the scans")


def _check_pieces(request: Request, path: str) -> None:
    """Parts of a surface, and one that memory does not hold, are written piece by piece."""
    try:
        _native._check_file_in_pieces(path, request.parameters.get("encoding"))
    except InputError as problem:
        raise UsageError(str(problem)) from None


def _check_parts(request: Request) -> None:
    path = request.parameters.get("surface") or request.output or ""
    _check_pieces(request, path)


def _check_print_parts(request: Request) -> None:
    printer = [name for name in request.parameters if name.startswith("printer_")]
    if request.command == "prepare" and printer:
        problem = "cuts the print into parts, each a file, and part_triangles cuts them again"
        raise UsageError(f"{printer[0]} {problem}: leave out part_triangles")


def _check_plan(request: Request) -> None:
    surface, workspace = request.parameters.get("surface"), request.parameters.get("workspace")
    tasks = request.parameters.get("tasks", 1)
    if not 1 <= tasks <= MOST_TASKS:
        raise UsageError(f"tasks must lie between 1 and {MOST_TASKS}, got {tasks}")
    if surface is None:
        raise UsageError("plan needs --surface, the file that the merge is to make")
    _check_pieces(request, surface)
    if workspace is not None and "://" not in workspace and not os.path.isdir(workspace):
        raise UsageError(f"{workspace}: the workspace must be a folder that exists")


def _written(*kinds: str) -> tuple[str, ...]:
    formats = [_native.formats(written=kind) for kind in kinds]  # type: ignore[arg-type]
    every = [ending for known in formats for endings in known.values() for ending in endings]
    return tuple(dict.fromkeys(every))


_MESHES = _written("mesh")
_SCAN = Own("scan", "text", "Which scan of the files: its name, or its number counted from 0.", "SCAN")
_CAMERA = Own("camera", "numbers", "Focal lengths and centre in pixels: makes images depth images.", "FX,FY,CX,CY", 4)
_CRS = Own(
    "crs",
    "text",
    "The coordinate reference system that all lie in, whatever files name: well-known text, a file "
    "(.prj, .wkt) that holds it, or a code as EPSG:25832.",
    "CRS",
)
_THREADS = [row for row in rows("merge") if row.name == "threads"]


# The endings of kinds of results.
_ENDINGS = {"a mesh": _MESHES, "a grid of quads": _written("quads")}


def _operation(name: str, *, parts: tuple[str, ...] = (), own: tuple[Row, ...] | None = None, **rest: Any) -> Command:
    """The command of an operation: its texts, and with its parameters those of `parts`.

    Where nothing else is said it writes what it gives, and takes one scan of its files unless it takes several.
    """
    operation = _DECLARED[name]
    assert operation.command is not None
    assert operation.command_name is not None
    files, summary, text = operation.command
    if own is None:
        own = () if operation.takes == ["scans"] else (_SCAN,)
    if "endings" not in rest:
        rest["endings"] = _ENDINGS[operation.gives[0]]
        rest["meshes"] = operation.gives == ["a mesh"]
    run = getattr(operations, name)
    return Command(operation.command_name, summary, text, files, run, (name, *parts), own, **rest)


_DECLARED = {operation.name: operation for operation in _native.operations() if operation.command}

# Options that commands have besides those that their operations declare.
_SPECIAL: dict[str, dict[str, Any]] = {
    "align": dict(
        own=(
            Own("fixed", "counts", "Numbers of the scans whose poses stay, counted from 0."),
            Own(
                "angles",
                "numbers",
                "Angles of the turntable at each scan, in radians, or in degrees as 80deg.",
                "ANGLE,ANGLE,...",
                angles=True,
            ),
        ),
        endings=("conf", "mlp", "aln", "tum"),
        output_is_optional=True,
    ),
    "merge": dict(
        parts=("triangulate",),
        own=(
            Own(
                "align",
                "flag",
                "Scans without poses, or with rough ones, are aligned first. Those without a place are left out "
                "and named.",
            ),
            Own("measure", "flag", "Measures how far the surface lies from the scans."),
            Own(
                "workspace",
                "folder",
                "Merges more scans than memory holds, straight into a .ply file of the same bytes: what memory "
                "does not hold, up to 200 bytes for each intersection of a scan with the grid, is kept in this "
                "folder meanwhile. --max-memory says how much memory holds.",
            ),
            Own(
                "keep",
                "flag",
                "What the merge finds out stays in the workspace: the next merge with the same parameters renews "
                "only what scans have a part in that are new, gone or moved, and goes on where one was stopped or "
                "killed.",
            ),
        ),
    ),
    "check_print": dict(output_is_optional=True),
    "sculpt": dict(parts=("triangulate",)),
    "cluster": dict(
        own=(_SCAN, Own("levels", "counts", "Vertices of each level of detail, most first: all go into one .glb.")),
    ),
}

COMMANDS = {
    command.name: command
    for command in (
        Command(
            "info",
            "what files hold",
            "Lists the scans of files: kind, size, extent, attributes.",
            "FILE",
            operations.info,
            own=(
                Own("list", "flag", "Names alone: no sample is read."),
                Own("check", "flag", "Checks meshes: manifold, closed, borders, parts."),
            ),
        ),
        Command(
            "convert",
            "write scans and meshes in another format",
            "Reads files and writes what they hold in the format that the name of the output asks for: a mesh, placed "
            "in the world, a point cloud, a range image, or several with their poses.",
            "FILE",
            operations.convert,
            ("triangulate",),
            (_SCAN, Own("mesh", "flag", "A range image becomes a mesh of triangles.")),
            _written("mesh", "points", "images"),
            meshes=True,
        ),
        *(_operation(name, **_SPECIAL.get(name, {})) for name in _DECLARED),
        Command(
            "plan",
            "a merge cut into tasks, for several processes and machines",
            "Plans a merge, of which surfrecon task does the tasks: on a cluster each in a job of its own, or all of "
            "them one after the other, where it goes on if it was stopped. Stages follow each other; the tasks of a "
            "stage need nothing of each other.",
            "SCANS",
            operations.plan,
            ("merge", "triangulate", "write"),
            (
                Own("surface", "file", "What the merge makes: a .ply file."),
                Own(
                    "workspace",
                    "folder",
                    "Tasks leave up to 200 bytes for each intersection of a scan with the grid in a folder there, "
                    "which all processes reach: a folder, or a URL that fsspec knows. Default: the plan's folder.",
                ),
                Own("tasks", "count", "How many tasks a stage has; some stages are one task. Default: 16."),
                Own(
                    "keep",
                    "flag",
                    "What the merge finds out stays in the workspace: the next one planned there with the same "
                    "parameters and as many tasks renews only what scans have a part in that are new, gone or moved.",
                ),
            ),
            ("json",),
            urls=True,
        ),
        Command(
            "measure",
            "how far a surface, or points, lie from another",
            "Measures how far the first file lies from all others: of two meshes with a bound that holds between "
            "the vertices too, else from points to a mesh or to scans.",
            "FILE",
            operations.measure,
            own=(_SCAN, Own("signed", "flag", "Distances behind the reference are negative."), *_THREADS),
        ),
    )
}

for _command in COMMANDS.values():
    advice.know(_command.name, {name: row.kind for name, row in _command.options().items()})
