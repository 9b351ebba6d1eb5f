"""The work with the extension in the window of a real Blender: `tools/test_gui.sh` runs it."""

import shutil
import sys
import tempfile
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))

from bringing import aligning, dropping, installing, undoing
from disturbing import asking, cancelling, leaving, meddling
from driver import drive
from making import adjusting, adjusting_long, looking, merging, merging_anew, scanning
from ruling import ruling


def steps():
    """All of it, in the order of the work."""
    yield from installing()
    # The dialog shows the folder, in a picture for others.
    scans = Path.home() / "scans"
    shutil.rmtree(scans, ignore_errors=True)
    scans.mkdir()
    yield from undoing(scans)
    yield from dropping(scans)
    shutil.rmtree(scans)
    yield from aligning()
    scans = [obj.name for obj in bpy.data.objects]
    yield from merging()
    anew = yield from merging_anew(scans)
    yield from adjusting(scans)
    bpy.data.batch_remove([bpy.data.objects[anew]])
    yield from adjusting_long()
    yield from cancelling(scans)
    yield from looking()
    yield from ruling()
    yield from scanning()
    yield from asking()
    with tempfile.TemporaryDirectory() as folder:
        yield from meddling(scans, Path(folder))
    yield from leaving(scans)


if __name__ == "__main__":
    drive(steps())
