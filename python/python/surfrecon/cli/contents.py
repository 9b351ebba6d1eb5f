"""The content of scans, once they are read."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from typing import Any, TypeAlias

import numpy as np

from .. import _native
from .._arguments import meant
from .._errors import FormatError, InputError
from .inputs import named
from .work import Work

__all__ = [
    "Content",
    "chosen",
    "described",
    "image",
    "kind",
    "line",
    "one",
    "placed",
    "points",
    "points_in_world",
    "read",
    "undamaged",
]

Content: TypeAlias = _native.RangeImage | _native.Mesh | _native.PointCloud
_POSE = np.eye(4)


def read(scan: _native.Scan, work: Work) -> Content:
    """Reads a scan."""
    with work.showing() as shown:
        return scan.read(progress=shown)


def undamaged(scans: Iterable[_native.Scan], work: Work) -> Iterator[tuple[_native.Scan, Content | None]]:
    """Reads scans, one after the other. Damaged ones have no content, and are noted.

    Raises:
        FormatError: the only scan is damaged, or all are.
    """
    problem, found = None, 0
    for scan in scans:
        try:
            content = read(scan, work)
        except FormatError as error:
            if not scan._is_one_of_many:
                raise
            problem = error
            work.note(f"{scan.name} is skipped: {error}")
            yield scan, None
        else:
            found += 1
            yield scan, content
    if problem is not None and not found:
        raise problem


def chosen(scans: _native.ScanSet, name: str | None) -> _native.Scan:
    """The scan of a name or number, or the only one.

    Raises:
        InputError: there is none, or more than one and no name.
    """
    if name is None:
        if len(scans) != 1:
            raise InputError(f"there are {len(scans)} scans: choose one with --scan, by its name or its number from 0")
        return scans[0]
    for scan in scans:
        if scan.name == name:
            return scan
    if name.isdecimal() and int(name) < len(scans):
        return scans[int(name)]
    near = meant(name, [scan.name for scan in scans])
    raise InputError(
        f"there is no scan {name!r}: give a name, or a number from 0 to {len(scans) - 1}{near and '.'}{near}"
    )


def one(work: Work) -> tuple[_native.Scan, Content]:
    """The scan that was chosen, or the only one there is."""
    scan = chosen(work.open(), work.request.parameters.get("scan"))
    return scan, read(scan, work)


def image(work: Work) -> _native.RangeImage:
    """The range image that was chosen, or the only one there is.

    Raises:
        InputError: it is something else.
    """
    scan, content = one(work)
    if not isinstance(content, _native.RangeImage):
        raise InputError(f"{scan.name} is a {kind(content)}: {work.request.command} takes a range image")
    return content


def kind(content: Content) -> str:
    """The kind of content, in words."""
    kinds = {_native.RangeImage: "range image", _native.Mesh: "mesh", _native.PointCloud: "point cloud"}
    return kinds[type(content)]


def placed(mesh: _native.Mesh, pose: Any, crs: str | None) -> _native.Mesh:
    """A mesh in the world, and its coordinate reference system. One that is there already stays, to the last bit."""
    return (mesh if is_placed(pose) else mesh.transformed(_native.Similarity(pose))).with_crs(crs)


def is_placed(pose: Any) -> bool:
    """Whether a pose moves nothing."""
    return bool(np.array_equal(pose, _POSE))


def points(scan: _native.Scan, content: Content) -> tuple[Any, Any]:
    """Points as `reconstruct` takes them, and the pose that places what is made of them."""
    if isinstance(content, _native.PointCloud):
        return content, content.world_from_cloud
    if isinstance(content, _native.RangeImage):
        return content.world_points()[content.valid], _POSE
    return content.positions, scan.world_from_sensor


def points_in_world(scan: _native.Scan, content: Content) -> Any:
    """(n, 3): samples, points or vertices."""
    found, pose = points(scan, content)
    found = found.positions if isinstance(found, _native.PointCloud) else found
    return found if is_placed(pose) else found @ pose[:3, :3].T + pose[:3, 3]


def described(scan: _native.Scan, content: Content) -> dict[str, Any]:
    """The facts of a scan for people, by name."""
    known: dict[str, Any] = {"name": scan.name, **named(os.fspath(scan.path)), "part": scan.part, "kind": kind(content)}
    if isinstance(content, _native.RangeImage):
        known |= {"rows": content.rows, "cols": content.cols, "samples": int(content.valid.sum())}
        known["projection"] = content.projection["kind"]
        attributes = [name for name in ("colour", "intensity", "confidence") if getattr(content, name) is not None]
    elif isinstance(content, _native.PointCloud):
        known["points"] = len(content.positions)
        attributes = [name for name in ("normals", "colour", "intensity") if getattr(content, name) is not None]
    else:
        known |= {"vertices": len(content.positions), "triangles": len(content.triangles)}
        attributes = [*content.vertex_attributes, *content.face_attributes]
    found = points_in_world(scan, content)
    found = found[np.isfinite(found).all(axis=1)]
    known["attributes"] = attributes
    if scan.crs is not None:
        known["crs"] = scan.crs
    known["bounds"] = np.array([found.min(0), found.max(0)]) if len(found) else None
    known["world_from_sensor"] = getattr(content, "world_from_sensor", scan.world_from_sensor)
    return known


def line(known: dict[str, Any]) -> str:
    """The facts of a scan in a line."""
    if known["kind"] == "range image":
        counts = f"{known['rows']} x {known['cols']} pixels, {known['samples']:,} samples"
    elif known["kind"] == "point cloud":
        counts = f"{known['points']:,} points"
    else:
        counts = f"{known['vertices']:,} vertices, {known['triangles']:,} triangles"
    text = f"{known['name']}: {known['kind']}, {counts}"
    if known["bounds"] is not None:
        text += ", extent " + " x ".join(f"{side:.4g}" for side in known["bounds"][1] - known["bounds"][0])
    if "crs" in known:
        # Of well-known text its name alone.
        text += f", in {known['crs'].split(chr(34))[1] if chr(34) in known['crs'] else known['crs']}"
    return text + "".join(f", {name}" for name in known["attributes"])
