# SPDX-License-Identifier: GPL-3.0-or-later
"""The size that files will have in the scene, for the importer's dialog before anything is imported.

Files are looked at on a thread, and dialogs draw meanwhile. What was found is kept by the files' paths, their times and
how they are read: unit and axes change nothing of it.
"""

import itertools
import os
from typing import NamedTuple

import bpy
import numpy as np
import surfrecon

from . import recording
from .running import Task

# Bytes of files that are read for their size. Larger sets are told by scans that are spread evenly over them.
MOST_BYTES = 64e6

# So many frames of a recording tell about how large it is.
MOST_FRAMES = 12

# Seconds between looks at what is read.
LOOK_SECONDS = 0.1

# So many findings are kept.
MOST_KEPT = 100


class Seen(NamedTuple):
    """Scans in their files' unit and axes: the lowest and the highest corner, `None` where there is no sample."""

    low: np.ndarray | None
    high: np.ndarray | None
    # Whether some of the scans stand for all.
    is_part: bool
    # Whether all scans are frames of a recording, and what the library says of the files.
    of_frames: bool
    paths: list
    notes: list


class Look:
    """The look that is being taken, and those before."""

    key = task = popup = None
    found = {}  # noqa: RUF012 (one for all, as is the look)

    @classmethod
    def at(cls, paths, whole, options):
        """The findings in the files, or `None` as long as they are being read. A problem stands for them where files
        can't be read, or are too large to be.
        """
        key = tuple(map(stamp, paths)), whole, tuple(options.items())
        if key in cls.found:
            return cls.found[key]
        if key != cls.key:
            cls.forget()
            cls.key, cls.task = key, Task("Looking at the files", lambda note: seen(paths, whole, options, note))
            if not bpy.app.timers.is_registered(ask_again):
                bpy.app.timers.register(ask_again, first_interval=LOOK_SECONDS)
        return cls.found.get(key) if cls.ended() else None

    @classmethod
    def ended(cls):
        """Keeps what the look has found, if it has ended, and says whether it has."""
        if cls.task is None or not cls.task.done():
            return cls.task is None
        if len(cls.found) >= MOST_KEPT:
            cls.found.clear()
        try:
            cls.found[cls.key] = cls.task.result()
        except (surfrecon.SurfreconError, MemoryError, OSError) as problem:
            cls.found[cls.key] = problem
        cls.key = cls.task = None
        return True

    @classmethod
    def wait(cls, seconds):
        """Until the look has ended, but no longer than that."""
        if cls.task is not None:
            cls.task.thread.join(seconds)

    @classmethod
    def forget(cls):
        """Ends the look: the dialog is closed, or shows other files."""
        if cls.task is not None:
            cls.task.cancel()
        cls.key = cls.task = cls.popup = None


class TooLarge(surfrecon.SurfreconError):
    """The files are too large to be read twice."""


def stamp(path):
    """The path of a file with its time and size: another one if the file was written anew."""
    try:
        status = os.stat(path)
    except OSError:
        return path, 0, 0
    return path, status.st_mtime_ns, status.st_size


def seen(paths, whole, options, note):
    """Looks at files. `note` takes the share done, and raises once it is to stop."""
    steps = recording.opened(paths, whole, options)
    while True:
        try:
            note(0.1 * next(steps))
        except StopIteration as ended:
            paths, scans = ended.value
            break
    chosen = sample(scans)
    boxes = []
    for k, scan in enumerate(chosen):

        def told(_, share, k=k):
            note(0.1 + 0.9 * (k + share) / len(chosen))

        try:
            points = points_of(scan, scan.read(progress=told))
        except surfrecon.FormatError:
            # The import skips damaged frames, and refuses other files.
            if not isinstance(scan, surfrecon.Frame):
                raise
            continue
        if len(points):
            boxes += [points.min(axis=0), points.max(axis=0)]
        note(0.1 + 0.9 * (k + 1) / len(chosen))
    return Seen(
        np.min(boxes, axis=0) if boxes else None,
        np.max(boxes, axis=0) if boxes else None,
        len(chosen) < len(scans),
        bool(scans) and all(isinstance(scan, surfrecon.Frame) for scan in scans),
        paths,
        list(scans.notes) if scans else [],
    )


def sample(scans):
    """The scans that are read for the size: all of them, or some that are spread evenly."""
    scans = list(scans)
    if any(isinstance(scan, surfrecon.Frame) for scan in scans):
        return [scans[k] for k in recording.spread([True] * len(scans), MOST_FRAMES)]
    # A file of many scans is shared by them.
    each = {}
    for scan in scans:
        each.setdefault(scan.path, []).append(scan)
    sizes = [stamp(scan.path)[2] / len(each[scan.path]) for scan in scans]
    for count in itertools.chain([len(scans)], (8, 4, 2, 1)):
        places = recording.spread([True] * len(scans), count)
        if sum(sizes[k] for k in places) <= MOST_BYTES:
            return [scans[k] for k in places]
    raise TooLarge("the files are large")


def points_of(scan, content):
    """(n, 3) float64: the samples of a scan in the axes of its files."""
    if isinstance(content, surfrecon.RangeImage):
        return np.asarray(content.world_points()[content.valid], np.float64)
    pose = np.array(scan.world_from_sensor)
    points = np.asarray(content.positions, np.float64)
    points = points[np.isfinite(points).all(axis=1)]
    return points @ pose[:3, :3].T + pose[:3, 3]


def ask_again():
    """Called by a timer: draws dialogs anew once a look has ended."""
    if not Look.ended():
        return LOOK_SECONDS
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "FILE_BROWSER":
                area.tag_redraw()
    if Look.popup is not None:
        Look.popup.tag_refresh_ui()
    return None
