"""Draws scans as they come, placed, and merged: docs/pictures/heap.jpg, with real ones.

Usage: python demo/heap_picture.py OUT.jpg [SCANS.conf]

Without SCANS the scans are virtual ones of one turn; scans of files, which have y up, get a row above. All poses are
thrown away first. Needs the package with matplotlib and Pillow.
"""

import sys

import matplotlib

matplotlib.use("Agg")

import numpy as np
import surfrecon
from matplotlib import pyplot
from surfrecon import plot

AZIMUTH, ELEVATION = 0.35, 0.23
Z_FROM_Y = np.array([(1.0, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)])


def virtual():
    """Scans of one turn of a table, and what brings the world of the first one upright."""
    shape = surfrecon.sculpture(cell=2.0)
    cameras = surfrecon.turntable(shape, around=8, above=0, below=0, pixels=200)
    scans = surfrecon.virtual_scan(shape, cameras, noise=0.1, seed=1)
    return scans, np.array(scans[0].world_from_sensor), {"turntable": "equal"}


def real(path):
    """Scans of a file."""
    scans = [scan.read() for scan in surfrecon.open(path)]
    return scans, Z_FROM_Y @ np.array(scans[0].world_from_sensor), {}


def panel(axes, scans, upright):
    """The samples of all scans, each scan in its own colour, far ones first."""
    places = [scan.world_points()[scan.valid] @ upright[:3, :3].T + upright[:3, 3] for scan in scans]
    colours = pyplot.get_cmap("tab10")(np.repeat(np.arange(len(scans)) % 10, list(map(len, places))))
    points = np.vstack(places)
    # As plot.mesh sees.
    right = np.array((np.cos(AZIMUTH), np.sin(AZIMUTH), 0))
    ahead = np.array((-np.sin(AZIMUTH) * np.cos(ELEVATION), np.cos(AZIMUTH) * np.cos(ELEVATION), -np.sin(ELEVATION)))
    order = np.argsort(-points @ ahead)
    x, y = points @ right, points @ np.cross(right, ahead)
    axes.scatter(x[order], y[order], c=colours[order], s=0.5, linewidths=0)
    axes.set_aspect("equal")
    axes.axis("off")


def row(axes, scans, upright, known):
    """Throws the poses away, aligns, merges and draws."""
    for scan in scans:
        scan.world_from_sensor = np.eye(4)
    aligned = surfrecon.align(scans, fixed=[0], **known)
    placed = [scan.read() if hasattr(scan, "read") else scan for scan in aligned.scans]
    panel(axes[0], scans, upright)
    panel(axes[1], placed, upright)
    surface = surfrecon.merge(aligned.scans).mesh.transformed(upright)
    plot.mesh(surface, ax=axes[2], azimuth=AZIMUTH, elevation=ELEVATION)


def main():
    """Draws all rows."""
    out, *files = sys.argv[1:]
    sets = [*map(real, files), virtual()]
    figure, axes = pyplot.subplots(len(sets), 3, figsize=(11, 4.6 * len(sets)), squeeze=False)
    for of_row, one in zip(axes, sets, strict=True):
        row(of_row, *one)
    for ax, title in zip(axes[0], ("as they come", "placed", "merged"), strict=True):
        ax.set_title(title)
    figure.subplots_adjust(wspace=0.02, hspace=0.02)
    figure.savefig(out, dpi=80, bbox_inches="tight", pil_kwargs={"quality": 85})


if __name__ == "__main__":
    main()
