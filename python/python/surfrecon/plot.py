"""Pictures of scans and surfaces, on matplotlib, which is needed for this module only: ``pip install matplotlib``.

Each function draws into ``ax``, or a new figure, and returns the axes. They are for looking: exact, but not fast beyond
a few 100,000 triangles.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._native import Alignment, Mesh, RangeImage, Sculpted

__all__ = ["alignment", "error_image", "mesh", "misfit", "range_image"]

# Calm where the value is small; the same colours as the error map in Blender.
RAMP = [
    (0.0, (0.16, 0.33, 0.60)),
    (0.3, (0.20, 0.65, 0.66)),
    (0.55, (0.95, 0.90, 0.45)),
    (0.8, (0.93, 0.45, 0.20)),
    (1.0, (0.65, 0.06, 0.12)),
]
CLAY = np.array((0.62, 0.56, 0.49))


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained")[1]


def _colours() -> Any:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("surfrecon", RAMP)


def range_image(image: RangeImage, ax: Any = None, unit: str = "") -> Any:
    """How far a range image's samples lie from the sensor, as a picture. They count from the nearest sample where
    rays are parallel.

    >>> from surfrecon import plot
    >>> plot.range_image(image, unit="mm").figure.savefig("depth.png")

    Args:
        image: the range image. Pixels without a sample stay empty.
        ax: matplotlib's axes, or ``None`` for new ones.
        unit: unit of lengths, for the legend.
    """
    ax = _axes(ax)
    points, kind = np.asarray(image.points, float), image.projection["kind"]
    how, vector = image.projection["viewing"] if kind == "points" else ("from", (0.0, 0.0, 0.0))
    if kind == "orthographic":
        how, vector = "parallel", (0.0, 0.0, -1.0)
    if how == "from":
        depth = np.linalg.norm(points - np.asarray(vector), axis=-1)
    else:
        depth = points @ (np.asarray(vector) / np.linalg.norm(vector))
        depth -= depth[image.valid].min(initial=np.inf)
    depth = np.where(image.valid, depth, np.nan)
    shown = ax.imshow(depth, cmap="viridis", interpolation="nearest")
    ax.figure.colorbar(shown, ax=ax, label=f"distance, {unit}" if unit else "distance")
    ax.set(xlabel="column", ylabel="row", title=f"{image.rows} x {image.cols}, {int(image.valid.sum()):,} samples")
    return ax


def error_image(result: Sculpted, ax: Any = None, unit: str = "") -> Any:
    """The distance of each sample from a sculpted mesh, at its pixel.

    >>> from surfrecon import plot
    >>> plot.error_image(surfrecon.sculpt(image), unit="mm").figure.savefig("error.png")

    Args:
        result: what ``sculpt`` or ``Sculptor.refine`` returned.
        ax: matplotlib's axes, or ``None`` for new ones.
        unit: unit of lengths, for the legend.
    """
    ax = _axes(ax)
    shown = ax.imshow(np.abs(result.error_image), cmap=_colours(), interpolation="nearest", vmin=0)
    ax.figure.colorbar(shown, ax=ax, label=f"error, {unit}" if unit else "error")
    ax.set(xlabel="column", ylabel="row", title=f"{len(result.mesh.triangles):,} triangles, RMS {result.rms_error:.3g}")
    return ax


def mesh(
    surface: Mesh,
    values: ArrayLike | None = None,
    ax: Any = None,
    *,
    azimuth: float = 0.35,
    elevation: float = 0.23,
    limit: float | None = None,
    label: str = "",
    edges: bool = False,
) -> Any:
    """A surface seen from a side, without perspective, z up.

    >>> from surfrecon import plot
    >>> coarse = surfrecon.cluster(mesh, vertices=500).mesh
    >>> off = surfrecon.distances(coarse.positions, mesh)
    >>> plot.mesh(coarse, off, label="off, mm").figure.savefig("coarse.png")

    Args:
        surface: the mesh.
        values: (n,) a number a vertex, shown in colours from 0 to ``limit``; ``None`` for plain clay.
        ax: matplotlib's axes, or ``None`` for new ones.
        azimuth: where the eye stands about the vertical, radians.
        elevation: how far above the horizon, radians.
        limit: value of the last colour; 95 % of the values lie below the default.
        label: what the legend of the values says, with their unit.
        edges: draw the triangles' edges too.

    Raises:
        ValueError: there are not as many values as vertices.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    ax = _axes(ax)
    right = np.array((np.cos(azimuth), np.sin(azimuth), 0.0))
    toward = np.array((-np.sin(azimuth) * np.cos(elevation), np.cos(azimuth) * np.cos(elevation), -np.sin(elevation)))
    up = np.cross(right, toward)
    corners = surface.positions[surface.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(lengths > 0, lengths, 1)
    light = -toward + 0.5 * up + 0.4 * right
    shade = 0.35 + 0.65 * np.abs(normals @ (light / np.linalg.norm(light)))
    if values is None:
        colours = np.broadcast_to(CLAY, (len(corners), 3))
    else:
        values = np.asarray(values, float).reshape(-1)
        if len(values) != len(surface.positions):
            raise ValueError(f"{len(values)} values for {len(surface.positions)} vertices: give one a vertex")
        of_faces = values[surface.triangles].mean(axis=1)
        limit = limit or float(np.nanquantile(values, 0.95)) or 1.0
        scale = ScalarMappable(Normalize(0, limit), _colours())
        colours = scale.to_rgba(of_faces)[:, :3]
        ax.figure.colorbar(scale, ax=ax, label=label, extend="max")
    # From back to front; what is behind is painted over.
    order = np.argsort(corners.mean(axis=1) @ -toward)
    seen: Any = np.stack([corners @ right, corners @ up], axis=-1)[order]
    faces = (colours * shade[:, None])[order]
    line: dict[str, Any] = (
        {"edgecolors": (0, 0, 0, 0.4), "linewidths": 0.2} if edges else {"edgecolors": faces, "linewidths": 0.15}
    )
    ax.add_collection(PolyCollection(seen, facecolors=faces, **line))
    ax.autoscale_view()
    ax.set_aspect("equal")
    ax.set_axis_off()
    return ax


# States of a pair, and their marks in the picture.
MARKS = {
    "misfit": "off",
    "slides": "slides",
    "ambiguous": "places",
    "background": "still",
    "seen_through": "through",
    "disagrees": "disagrees",
    "rejected": "no",
}


def alignment(result: Alignment, ax: Any = None) -> Any:
    """The overlap of scans: a square a pair, darker the more of the smaller they share, red if the pair was not used.

    Names of scans that have no place are red.

    >>> from surfrecon import plot
    >>> plot.alignment(surfrecon.align(scans)).figure.savefig("overlap.png")

    Args:
        result: what ``align`` returned.
        ax: matplotlib's axes, or ``None`` for new ones.
    """
    from matplotlib.patches import Rectangle

    ax = _axes(ax)
    report = result.report
    count = len(report.scans)
    shown = np.full((count, count), np.nan)
    for pair in report.pairs:
        a, b = pair.scans
        share = max(pair.overlap)
        if pair.state in ("fits", "misfit"):
            shown[a, b] = shown[b, a] = share
        if pair.state in MARKS:
            for row, col in ((a, b), (b, a)):
                if pair.state != "misfit":
                    ax.add_patch(Rectangle((col - 0.5, row - 0.5), 1, 1, color=(0.85, 0.35, 0.3)))
                if count <= 20:
                    ax.text(col, row, MARKS[pair.state], ha="center", va="center", fontsize=6)
    image = ax.imshow(shown, cmap="Blues", vmin=0, vmax=1, interpolation="nearest")
    ax.figure.colorbar(image, ax=ax, label="share of the smaller that overlaps")
    names = [scan.name for scan in report.scans]
    ax.set_xticks(range(count), names, rotation=90, fontsize=7)
    ax.set_yticks(range(count), names, fontsize=7)
    for labels in (ax.get_xticklabels(), ax.get_yticklabels()):
        for label, scan in zip(labels, report.scans, strict=True):
            if scan.state in ("unplaced", "apart", "undecided"):
                label.set_color((0.75, 0.1, 0.1))
    ax.set(title=f"{report.placed} of {count} scans placed", xlim=(-0.5, count - 0.5), ylim=(count - 0.5, -0.5))
    return ax


def misfit(result: Alignment, scan: int, ax: Any = None, unit: str = "") -> Any:
    """How far each sample of a range image lies outside of the surfaces of the others, at its pixel: red, inside blue.

    For a mesh, ``mesh(surface, abs(result.misfit(scan)))`` shows the same without the sides.

    >>> from surfrecon import plot
    >>> plot.misfit(surfrecon.align(scans), 0, unit="mm").figure.savefig("misfit.png")

    Args:
        result: what ``align`` returned.
        scan: number of the scan, counted from 0.
        ax: matplotlib's axes, or ``None`` for new ones.
        unit: unit of lengths, for the legend; 98 % of the samples lie within it.

    Raises:
        InputError: no such scan, or one that is not placed.
        ValueError: the scan is no range image.
    """
    told = result.report
    values = result.misfit(scan)
    if values.ndim != 2:
        raise ValueError(f"scan {scan} is no range image: show abs(result.misfit({scan})) on its mesh")
    ax = _axes(ax)
    limit = float(np.nanquantile(np.abs(values), 0.98)) if np.isfinite(values).any() else 1.0
    shown = ax.imshow(values, cmap="RdBu_r", interpolation="nearest", vmin=-limit, vmax=limit)
    ax.figure.colorbar(shown, ax=ax, label=f"outside of the others, {unit}" if unit else "outside of the others")
    found = told.scans[scan]
    ax.set(xlabel="column", ylabel="row", title=f"{found.name}, RMS {found.misfit:.3g}")
    return ax
