"""The work of each command: from scans in files to a result that is still to be written, and a report."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from .. import _native
from .._errors import InputError, OutOfMemoryError
from .._report import Report
from ..distributed import Plan
from . import contents, inputs, record
from .progress import Shown
from .requests import UsageError
from .work import Made, Work, Write

__all__ = [
    "align",
    "check_print",
    "close",
    "cluster",
    "convert",
    "info",
    "measure",
    "merge",
    "plan",
    "prepare_print",
    "quads",
    "reconstruct",
    "sculpt",
    "unwrap",
]


def info(work: Work) -> Made:
    """Lists what files hold."""
    given, found, lines = work.request.parameters, [], []
    scans = work.open()
    if given.get("list"):
        for scan in scans:
            found.append(Report({"name": scan.name, **inputs.named(os.fspath(scan.path)), "part": scan.part}))
            lines.append(scan.name)
        return Made(Report(scans=found), lines)
    for scan, content in contents.undamaged(scans, work):
        if content is None:
            continue
        known = contents.described(scan, content)
        lines.append(contents.line(known))
        if given.get("check") and isinstance(content, _native.Mesh):
            known["check"] = content.check()
            lines += [f"  {line}" for line in str(known["check"]).splitlines()]
        found.append(Report(known))
    return Made(Report(scans=found), lines)


def convert(work: Work) -> Made:
    """Reads and writes."""
    scans = work.open()
    name = work.request.parameters.get("scan")
    held: list[tuple[_native.Scan, contents.Content]]
    if name is None:
        read = contents.undamaged(scans, work)
        held = [(scan, content) for scan, content in read if content is not None]
    else:
        scan = contents.chosen(scans, name)
        held = [(scan, contents.read(scan, work))]
    known = [contents.described(scan, content) for scan, content in held]
    made = [_converted(work, scan, content) for scan, content in held]
    if len(made) > 1 and not all(isinstance(one, _native.RangeImage) for one in made):
        raise InputError(f"there are {len(made)} scans, and only range images share a file: choose one with --scan")
    content: Any = made[0] if len(made) == 1 else made
    pose = getattr(content, "world_from_sensor", getattr(content, "world_from_cloud", None))
    if pose is not None and not contents.is_placed(pose) and str(work.request.output).lower().endswith(".ply"):
        system = ", and with it the coordinate reference system" if content.crs else ""
        work.note(f"the pose is left out, which .ply has no place for{system}")
    if isinstance(content, _native.Mesh):
        return Made(
            _of_scans(known), [contents.line(one) for one in known], _writer(work, content), _parts(work, content)
        )
    if isinstance(content, _native.PointCloud):
        _tell_left_out(work, "points", content.crs)
    else:
        crs = next((image.crs for image in made if image.crs), None)
        _tell_left_out(work, "image" if len(made) == 1 else "images", crs)

    def write(path: str, shown: Shown, provenance: dict[str, Any] | None) -> None:
        _native.write(path, content, provenance=provenance, progress=shown)

    def beside(path: str) -> list[str]:
        if not path.lower().endswith(".conf"):
            return []
        return [os.path.join(os.path.dirname(path), f"{scan.name}.ply") for scan, _ in held]

    return Made(_of_scans(known), [contents.line(one) for one in known], write, beside)


def _of_scans(known: list[dict[str, Any]]) -> Report:
    return Report(scans=[Report(one) for one in known])


def _converted(work: Work, scan: _native.Scan, content: contents.Content) -> contents.Content:
    if isinstance(content, _native.Mesh):
        return contents.placed(content, scan.world_from_sensor, scan.crs)
    if not work.request.parameters.get("mesh"):
        return content
    if not isinstance(content, _native.RangeImage):
        raise InputError(f"{scan.name} is a point cloud: make a mesh of it with surfrecon reconstruct")
    return contents.placed(content.triangulate(**work.given("triangulate")), content.world_from_sensor, content.crs)


def align(work: Work) -> Made:
    """Finds where scans lie."""
    # Rough poses may be those of a list.
    scans = work.open(unplaced=work.request.parameters.get("start") != "rough")
    _refuse_unlisted(work, scans)
    with work.showing() as shown:
        found = _native.align(scans, progress=shown, **work.given("align"), **work.request.of("fixed", "angles"))

    def write(path: str, _: Shown, __: dict[str, Any] | None) -> None:
        found.write(path)
        _tell_outside(work, path, found.scans)

    # The log may have told some already.
    lines = [line for line in found.report.summary if line not in work.notes]
    return Made(found.report, lines, write)


def _refuse_unlisted(work: Work, scans: _native.ScanSet) -> None:
    """Refuses a list that can't name the scans, before they are aligned."""
    output = work.request.output
    if output is not None and not output.lower().endswith(".tum") and work.request.of("camera"):
        problem = "a list of this kind does not say the camera of the images"
        remedy = "end the output's name in .tum, and give the images, that file and --camera to what follows"
        raise UsageError(f"{output}: {problem}: {remedy}")
    unlisted = next((scan for scan in scans if scan.part), None)
    if unlisted is not None and output is not None and not output.lower().endswith(".tum"):
        problem = f"{unlisted.name} shares its file or its recording with other scans, so that no list can name it"
        raise UsageError(f"{output}: {problem}: end the output's name in .tum")


def _tell_outside(work: Work, path: str, scans: Sequence[_native.Scan]) -> None:
    """Notes that a list leads out of its folder, which who reads it must allow."""
    if path.lower().endswith(".tum"):
        return
    folder = os.path.join(os.path.realpath(os.path.dirname(path)), "")
    outside = sum(not os.path.realpath(scan.path).startswith(folder) for scan in scans)
    if outside:
        lie = "1 scan lies" if outside == 1 else f"{outside} scans lie"
        work.note(
            f"{path}: {lie} outside of its folder, so merge refuses this list without --allow-outside. "
            "Or write it into a folder that all scans are in or below."
        )


_IN_FILES = "--workspace DIR (workspace) merges in files, into a .ply file, with the cells as they are"


def merge(work: Work) -> Made:
    """Merges scans to one surface. Those without poses are aligned first, where that is asked for."""
    scans: Iterable[_native.Scan] = work.open(unplaced=bool(work.request.parameters.get("align")))
    aligned = None
    if work.request.parameters.get("align"):
        with work.showing() as shown:
            aligned = _native.align(scans, progress=shown, **work.request.of("threads"))
        if aligned.report.placed == 0:
            reasons = "; ".join(dict.fromkeys(scan.reason for scan in aligned.report.scans if scan.reason))
            raise InputError(f"no two scans fit each other in one place, so there is nothing to merge: {reasons}")
        scans = aligned.scans
    made = _merged_to_file(work, scans) if "workspace" in work.request.parameters else _merged(work, scans)
    if aligned is None:
        return made
    work.note(*aligned.report.messages)
    report = Report(made.report | {"alignment": aligned.report})
    return replace(made, report=report, lines=[aligned.report.summary[0], *made.lines])


def _merged(work: Work, scans: Iterable[_native.Scan]) -> Made:
    options = work.given("merge", "triangulate") | work.request.of("measure")
    try:
        with work.showing() as shown:
            result = _native.merge(scans, progress=shown, **options)
    except OutOfMemoryError as problem:
        raise OutOfMemoryError(f"{problem}. {_IN_FILES}.") from None
    report: Report = result.report
    if result.report.voxel_reason == "memory":
        work.note(f"the cells were made coarser, to fit into memory: {_IN_FILES}")
    _warn(work, report)
    lines = [_counts(result.mesh), _cells(work, report)]
    if result.distances is not None:
        distances = _summary(result.distances)
        report = Report(report | {"distances": distances})
        lines.append(f"distances of the vertices from the scans: {_figures(distances)}")
    return Made(report, lines, _writer(work, result.mesh), _parts(work, result.mesh))


def _warn(work: Work, report: Report) -> None:
    """Notes whether scans plainly do not lie where they belong. The log has told of each that is damaged."""
    work.note(*(text for kind, text in report["warnings"] if kind != "damaged"))


def plan(work: Work) -> Made:
    """Cuts a merge into tasks."""
    work.open()
    parameters = work.request.parameters
    surface = parameters["surface"]
    work.refuse([surface])
    reading = work.given("open") | work.request.of("camera", "crs")
    if "crs" in reading:
        reading["crs"] = inputs.system(reading["crs"])
    # The surface says what made it, as that of one process does.
    said = record.provenance(work)
    if said is not None:
        of_merge = {name: value for name, value in said["parameters"].items() if name not in _PLANNING}
        said = {**said, "command": "merge", "parameters": of_merge}
    given = work.given("merge", "triangulate") | work.request.of(
        "workspace", "tasks", "keep", "encoding", "part_triangles"
    )
    made = Plan.make(str(work.request.output), work.request.inputs, surface, reading=reading, provenance=said, **given)
    stages: list[dict[str, Any]] = [
        {"name": stage.name, "first": stage.tasks[0], "last": stage.tasks[-1]} for stage in made.stages
    ]
    lines = [f"{stages[-1]['last'] + 1} tasks, which leave what they find in {made.folder}"]
    lines += [f"  {_tasks(stage)}" for stage in stages]
    return Made(Report({"folder": made.folder, "stages": stages}), lines, lambda *_: None)


# Options of a plan that a merge by one process does not have.
_PLANNING = ("surface", "tasks", "keep")


def _tasks(stage: dict[str, Any]) -> str:
    first, last = stage["first"], stage["last"]
    return f"{stage['name']}: {first}" if first == last else f"{stage['name']}: {first} to {last}"


def _merged_to_file(work: Work, scans: Iterable[_native.Scan]) -> Made:
    options = work.given("merge", "triangulate") | work.request.of("workspace", "keep", "encoding", "part_triangles")
    _refuse_scans_like_parts(work, scans)
    provenance = record.provenance(work)
    # The output appears at the end of this call: from here on it is progress that stops it.
    work.stops.check()
    work.stops.defer()
    with work.showing() as shown:
        report = _native.merge_to_file(
            scans, str(work.request.output), provenance=provenance, progress=shown, **options
        )
    _warn(work, report)
    lines = [f"{sum(report.faces):,} triangles", _cells(work, report)]
    return Made(report, lines, lambda *_: None, _parts(work, sum(report.faces)))


def _parts(work: Work, surface: _native.Mesh | int) -> Callable[[str], list[str]]:
    """The files beside the output that a mesh, or one of so many triangles, is in."""
    triangles = surface if isinstance(surface, int) else len(surface.triangles)
    most = work.request.parameters.get("part_triangles") or triangles or 1
    count = -(-triangles // most)
    if count > 1:
        output = str(work.request.output)
        work.note(f"the mesh is in {count} files: {output} to {_native._part_path(output, count, count)}")
    return lambda path: [_native._part_path(path, number, count) for number in range(2, count + 1)]


def _refuse_scans_like_parts(work: Work, scans: Iterable[_native.Scan]) -> None:
    """Of the parts of a surface the names follow once it is made: a scan with such a name would be gone then."""
    if not work.request.parameters.get("part_triangles"):
        return
    output = os.path.abspath(str(work.request.output))
    stem, ending = os.path.splitext(output)
    for scan in scans:
        path = os.path.abspath(scan.path)
        if re.fullmatch(re.escape(stem) + r"-\d+-of-\d+" + re.escape(ending), path):
            raise InputError(f"{scan.path} is a scan, and called as a part of {output} may be: write to another name")


def _cells(work: Work, report: Report) -> str:
    skipped = sum(any(note.startswith(f"{name} is skipped: ") for note in work.notes) for name in report.scan_names)
    used = report.scans - skipped
    scans = f"{used} of {report.scans} scans" if skipped else "1 scan" if used == 1 else f"{used} scans"
    return f"{scans}, cells of {report.voxel:.4g}: {_label('merge', 'voxel_reason', report.voxel_reason)}"


def _label(operation: str, figure: str, choice: str) -> str:
    """A choice as people read it."""
    choices = next(row.choices for row in _native.figures(operation) if row.name == figure)
    return next(label for name, label, _ in choices if name == choice)


def sculpt(work: Work) -> Made:
    """Makes a mesh of few triangles of a range image."""
    image = contents.image(work)
    with work.showing() as shown:
        found = _native.sculpt(image, progress=shown, **work.given("sculpt", "triangulate"))
    report = found.report
    off = f"of {report.full_triangles:,}, {report.max_error:.4g} off at most, tolerance {report.tolerance:.4g}"
    mesh = contents.placed(found.mesh, image.world_from_sensor, image.crs)
    return Made(report, [_counts(mesh), off], _writer(work, mesh), _parts(work, mesh))


def quads(work: Work) -> Made:
    """Makes a grid of quads of a range image."""
    image = contents.image(work)
    with work.showing() as shown:
        grid = _native.adaptive_quads(image, progress=shown, **work.given("quads"))
    report = grid.report
    if not contents.is_placed(image.world_from_sensor):
        left_out = "" if image.crs is None else ", and they are not in its coordinate reference system"
        work.note(f"the quads are in the sensor's frame: its pose is not applied{left_out}")

    def write(path: str, _: Shown, provenance: dict[str, Any] | None) -> None:
        grid.write(path, provenance=provenance)

    # If a quad spans a jump, the farthest point says nothing of the rest.
    off = f"{report.rms_error:.4g} off (root mean square), {report.max_error:.4g} at most (jumps included)"
    counts = f"{grid.rows} x {grid.columns} vertices, {report.quads:,} quads, {off}"
    return Made(report, [counts], write)


# Why points are not on a surface.
_DROPPED = {
    "not_finite": "not finite",
    "duplicate": "at the same place as others",
    "inside": "inside",
    "outside": "outside",
    "outlier": "outliers",
}


def reconstruct(work: Work) -> Made:
    """Makes a surface through points."""
    scan, content = contents.one(work)
    points, pose = contents.points(scan, content)
    with work.showing() as shown:
        # Those of range images lie in the world; clouds know their own.
        sensors = content.sensor if isinstance(content, _native.RangeImage) else None
        found = _native.reconstruct(points, sensors=sensors, progress=shown, **work.given("reconstruct"))
    left_out = {reason: len(indices) for reason, indices in found.dropped.items()}
    report = Report(found.report | {"dropped": left_out})
    passes = "of" if report.moved else "through"
    said = [f"{'closed' if report.closed else 'open'}, {passes} {report.used:,} of {report.points:,} points"]
    if any(left_out.values()):
        counts = (f"{count:,} {_DROPPED[reason]}" for reason, count in left_out.items() if count)
        said.append("left out: " + ", ".join(counts))
    if report.moved:
        within = f"within {report.smoothing:.4g}, as their noise is {report.noise:.4g}"
        said.append(f"points were moved by {report.moved:.4g} (root mean square) {within}")
    mesh = contents.placed(found.mesh, pose, scan.crs)
    return Made(report, [_counts(mesh), *said], _writer(work, mesh), _parts(work, mesh))


def cluster(work: Work) -> Made:
    """Makes a coarse mesh of well-shaped triangles, or a chain of levels."""
    scan, content = contents.one(work)
    options, levels = work.given("cluster"), work.request.parameters.get("levels")
    is_mesh = isinstance(content, _native.Mesh)
    dense: Any
    # The cloud knows where the rays start. Surfaces of points tell jumps by that.
    points = content.to_cloud() if isinstance(content, _native.RangeImage) else content
    dense, pose = (content, scan.world_from_sensor) if is_mesh else contents.points(scan, points)
    with work.showing() as shown:
        if levels is None:
            found = [_native.cluster(dense, progress=shown, **options)]
        else:
            found = _native.cluster_levels(dense, levels, progress=shown, **options)
    finest, *coarser = [contents.placed(level.mesh, pose, scan.crs) for level in found]
    report = found[0].report if levels is None else Report(levels=[level.report for level in found])
    lines = [
        f"{_counts(mesh)}, {level.report.max_error:.4g} off at most, {level.report.rms_error:.4g} root mean square"
        for mesh, level in zip((finest, *coarser), found, strict=True)
    ]
    return Made(report, lines, _writer(work, finest, coarser), _parts(work, finest))


# Openings left open that are told one by one. The report has all of them.
_OPENINGS = 5


_BLIND = (
    "no scan says where nothing is, so the shape of the surface alone decided: "
    "give recordings, depth images, .ptx or .e57 for that"
)


def close(work: Work) -> Made:
    """Closes the openings of a surface, by its scans where they are given."""
    first, *others = work.request.inputs
    scan = contents.chosen(work.open([first]), work.request.parameters.get("scan"))
    content = contents.read(scan, work)
    if not isinstance(content, _native.Mesh):
        what = contents.kind(content)
        raise InputError(f"{scan.name} is a {what}: give the surface first, then the scans that it was merged of")
    surface = contents.placed(content, scan.world_from_sensor, scan.crs)
    scans = work.open(others) if others else None
    with work.showing() as shown:
        found = _native.close(surface, scans, progress=shown, **work.given("close"))
    report = found.report
    work.note(*(text for _, text in report.open[:_OPENINGS]))
    openings = "1 opening" if report.closed == 1 else f"{report.closed:,} openings"
    said = f"{openings} closed, {len(report.open):,} left open, {report.filled_share:.1%} filled"
    sight = "nothing is filled where a scan saw through" if report.has_sight else _BLIND
    return Made(report, [_counts(found.mesh), said, sight], _writer(work, found.mesh), _parts(work, found.mesh))


def check_print(work: Work) -> Made:
    """Checks whether a mesh can be printed. Findings are lines of the result."""
    scan, content = contents.one(work)
    if not isinstance(content, _native.Mesh):
        raise InputError(f"{scan.name} is a {contents.kind(content)}: give a mesh, such as surfrecon merge makes")
    mesh = contents.placed(content, scan.world_from_sensor, scan.crs)
    with work.showing() as shown:
        found = _native.check_print(mesh, progress=shown, **work.given("check_print"))
    report = found.report
    said = [f"{' x '.join(f'{side:.4g}' for side in report.size)}, bodies: {report.bodies:,}"]
    if report.volume is not None:
        weight = "" if report.weight is None else f", weight {report.weight:.4g}"
        said.append(f"closed, volume {report.volume:.4g}{weight}")
    thinnest = report.thinnest_wall
    walls = f"no wall thinner than {report.wall_limit:.4g}" if thinnest is None else f"thinnest wall {thinnest:.4g}"
    said.append(f"{walls}, measured at places up to {report.wall_spacing:.4g} apart")
    said += [text for _, text in report.findings] or ["nothing is in the way of printing"]
    return Made(report, [_counts(found.mesh), *said], _writer(work, found.mesh), _parts(work, found.mesh))


def prepare_print(work: Work) -> Made:
    """Makes a closed mesh ready for printing. Each part becomes a file."""
    scan, content = contents.one(work)
    if not isinstance(content, _native.Mesh):
        raise InputError(
            f"{scan.name} is a {contents.kind(content)}: give a closed mesh, such as surfrecon close makes"
        )
    mesh = contents.placed(content, scan.world_from_sensor, scan.crs)
    with work.showing() as shown:
        found = _native.prepare_print(mesh, progress=shown, **work.given("prepare_print"))
    report, parts = found.report, found.parts
    work.note(*(text for _, text in report.notes))
    lines = [
        _counts(found.mesh),
        f"{' x '.join(f'{side:.4g}' for side in report.size)}, parts: {report.parts:,}, volume {report.volume:.4g}",
    ]
    output = work.request.output
    if len(parts) == 1:
        beside_one = _parts(work, found.mesh)
        if output is not None:
            _tell_older_parts(work, output, beside_one(output))
        return Made(report, lines, _writer(work, found.mesh), beside_one)

    def beside(path: str) -> list[str]:
        return [_native._part_path(path, number, len(parts)) for number in range(2, len(parts) + 1)]

    writers = [_writer(work, part) for part in parts]

    def write(path: str, shown: Shown, provenance: dict[str, Any] | None) -> None:
        for file, one in zip([path, *beside(path)], writers, strict=True):
            one(file, shown, provenance)

    if output is not None:
        work.note(f"the parts are in {len(parts)} files: {output} to {beside(output)[-1]}")
        _tell_older_parts(work, output, beside(output))
    return Made(report, lines, write, beside)


def _tell_older_parts(work: Work, output: str, written: Sequence[str]) -> None:
    """Notes files beside the output that are called as its parts, but are of another run: slicers would take both."""
    folder, name = os.path.split(output)
    stem, ending = os.path.splitext(name)
    called = re.compile(re.escape(stem) + r"-\d+-of-\d+" + re.escape(ending))
    own = {os.path.basename(path) for path in written}
    older = sorted(file for file in os.listdir(folder or ".") if called.fullmatch(file) and file not in own)
    if older:
        names = older[0] if len(older) == 1 else f"{older[0]} to {older[-1]}"
        work.note(f"{names}: of an earlier run with another count of parts: remove what is not to be printed")


def unwrap(work: Work) -> Made:
    """Gives a mesh texture coordinates."""
    output = work.request.output
    if output is not None and not output.lower().endswith(_TEXTURED):
        raise UsageError(
            f"{output}: files of this format hold no texture coordinates: end its name in .obj, .glb or .ply"
        )
    scan, content = contents.one(work)
    if not isinstance(content, _native.Mesh):
        raise InputError(f"{scan.name} is a {contents.kind(content)}: give a mesh, such as surfrecon merge makes")
    mesh = contents.placed(content, scan.world_from_sensor, scan.crs)
    with work.showing() as shown:
        found = _native.unwrap(mesh, progress=shown, **work.given("unwrap"))
    report = found.report
    said = (
        f"charts: {report.charts:,}, tiles: {report.tiles}, {report.used:.1%} used, "
        f"{report.texels_per_unit:.4g} texels per unit"
    )
    stretch = f"stretch {report.stretch:.4g}, at most {report.stretch_p95:.4g} on 95 % of the surface"
    lines = [_counts(found.mesh), said, stretch]
    if report.collapsed:
        share = f"{report.collapsed_area:.2%} of the surface"
        lines.append(f"triangles too thin or too small for an area in the texture: {report.collapsed:,}, {share}")
    return Made(report, lines, _writer(work, found.mesh), _parts(work, found.mesh))


# Endings of files that hold texture coordinates.
_TEXTURED = (".obj", ".glb", ".ply")


def measure(work: Work) -> Made:
    """Measures how far something lies from a surface."""
    first, *others = work.request.inputs
    if not others:
        raise UsageError("measure takes what is measured, and what it is measured against: two files at least")
    opened, against = work.open([first]), work.open(others)
    # Of names alone it may not be told that they are of degrees: their files say so.
    crs = opened.crs
    scan = contents.chosen(opened, work.request.parameters.get("scan"))
    content, options = contents.read(scan, work), work.request.of("signed", "threads")
    reference = contents.read(against[0], work) if len(against) == 1 else None
    if isinstance(content, _native.Mesh) and isinstance(reference, _native.Mesh):
        meshes = [contents.placed(content, scan.world_from_sensor, scan.crs)]
        meshes.append(contents.placed(reference, against[0].world_from_sensor, against[0].crs))
        with work.showing() as shown:
            found = _native.surface_distance(*meshes, progress=shown, **options)
        report = _told(found, options)
        return Made(report, [_figures(report), f"no point of the surface is farther than {report.bound:.6g}"])
    with work.showing() as shown:
        points = contents.points_in_world(scan, content)
        report = _told(_summary(_native.distances(points, against, crs=crs, progress=shown, **options)), options)
    return Made(report, [_figures(report)])


def _told(report: Report, options: Mapping[str, Any]) -> Report:
    """The report of distances. Distances without a sign have no bias."""
    left_out = {"distances"} | (set() if options.get("signed") else {"bias"})
    return Report({name: value for name, value in report.items() if name not in left_out})


def _tell_left_out(work: Work, content: Literal["mesh", "points", "image", "images"], crs: str | None) -> None:
    note = _native.crs_note(work.request.output, content, crs) if work.request.output else None
    work.note(*filter(None, [note]))


def _writer(work: Work, mesh: _native.Mesh, coarser: Sequence[_native.Mesh] = ()) -> Write:
    options = work.given("write")
    _tell_left_out(work, "mesh", mesh.crs)

    def write(path: str, shown: Shown, provenance: dict[str, Any] | None) -> None:
        mesh.write(path, provenance=provenance, coarser=coarser, progress=shown, **options)

    return write


def _counts(mesh: _native.Mesh) -> str:
    return f"{len(mesh.positions):,} vertices, {len(mesh.triangles):,} triangles"


def _summary(distances: Any) -> Report:
    """Figures of distances, by the names that `DistanceReport` has for them."""
    sizes = np.abs(distances)
    if len(sizes) == 0:
        raise InputError("there is no point to measure")
    return Report(
        count=len(sizes),
        mean=float(sizes.mean()),
        rms=float(np.sqrt((sizes**2).mean())),
        p95=float(np.sort(sizes)[math.ceil(0.95 * len(sizes)) - 1]),
        max=float(sizes.max()),
        bias=float(distances.mean()),
    )


def _figures(report: Report) -> str:
    return ", ".join(f"{name} {report[name]:.6g}" for name in ("mean", "rms", "p95", "max", "bias") if name in report)
