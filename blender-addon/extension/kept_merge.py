# SPDX-License-Identifier: GPL-3.0-or-later
"""The findings of the last merge, for the next: after a scan was moved, only what it has a part in is done anew.

Scans are known by what they hold, not by their objects. So undo, edits and other files can't deceive it. Results are
those of a merge that knows nothing, to the bit. One set of scans is kept, with copies of what they hold. Its memory is
given back when another file is read, when a merge or another operation finds memory short, and some time after the last
merge.
"""

import time

import surfrecon

from .kept import fingerprint, listeners, look_later

LOOK_SECONDS = 60.0

# A user who has not merged for so long is done with it.
IDLE_SECONDS = 900.0


class KeptMerge:
    """The one set of scans, its `surfrecon.Merger` and the key of each scan in it, in the order of the merger."""

    merger, keys, used = None, [], 0.0

    @classmethod
    def of(cls, scans):
        """Scans of `scan_objects` as `surfrecon.Job.merge` takes them: the merger, with these from now on.

        The scans themselves where some are in files still, of which nobody knows whether they have changed.
        """
        if any(isinstance(scan, surfrecon.Scan) for scan in scans):
            cls.forget()
            return scans
        if cls.merger is None:
            cls.merger, cls.keys = surfrecon.Merger(), []
        new = [(key_of(scan), scan) for scan in scans]
        wanted = [key for key, _ in new]
        for k in reversed(range(len(cls.keys))):
            if cls.keys[k] in wanted:
                wanted.remove(cls.keys[k])
            else:
                del cls.merger[k]
                del cls.keys[k]
        for key, scan in new:
            if key in wanted:
                wanted.remove(key)
                cls.merger.add(scan)
                cls.keys.append(key)
        cls.used = time.monotonic()
        look_later(look, LOOK_SECONDS)
        return cls.merger

    @classmethod
    def renewed(cls):
        """How many blocks of space the last merge had to do, and how many there are. The result is `None` where it
        kept nothing.
        """
        renewed = (0, 0) if cls.merger is None else cls.merger.renewed
        return renewed if renewed[1] > 0 else None

    @classmethod
    def forget(cls):
        """Gives its memory back. It returns whether there was anything."""
        was = cls.merger is not None
        cls.merger, cls.keys = None, []
        return was


def key_of(scan):
    """The key of a scan: equal for scans of one name that hold the same and lie at the same place."""
    if isinstance(scan, surfrecon.RangeImage):
        samples = scan.points if scan.values is None else scan.values
        values = (samples, scan.world_from_sensor, scan.colour, scan.intensity, scan.confidence)
        # Texts of arrays leave digits out.
        projection = [(name, repr(value)) for name, value in sorted(scan.projection.items())]
        return scan.name, scan.rows, scan.cols, *projection, fingerprint(*values)
    mesh, matrix, name = scan
    attributes = sorted(mesh.vertex_attributes.items())
    sizes = (len(mesh.positions), len(mesh.triangles), *(name for name, _ in attributes))
    return name, sizes, fingerprint(mesh.positions, mesh.triangles, matrix, *(values for _, values in attributes))


def look():
    """Forgets what nobody has used for long. As a timer, it returns when to look again."""
    if time.monotonic() - KeptMerge.used > IDLE_SECONDS:
        KeptMerge.forget()
    return None if KeptMerge.merger is None else LOOK_SECONDS


register, unregister = listeners(KeptMerge, look)
