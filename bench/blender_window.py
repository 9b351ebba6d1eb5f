"""Time from the button to the first progress drawn, in the window of a real Blender: `tools/test_gui.sh` runs it."""

import json
import os
import statistics
import sys
import time

import bpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "tests", "gui"))

from bringing import installing  # noqa: E402 (the path is made above)
from driver import drive, extension, run, until, view_selected  # noqa: E402
from making import drawn  # noqa: E402

# Samples of each scan: large enough that reading them takes a while.
PIXELS, RUNS = 600, 5


def steps():
    """Scans, then merges that are stopped as soon as they show progress."""
    yield from installing()
    import surfrecon

    parts = extension()
    shape = surfrecon.sculpture(cell=4.0)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=PIXELS))
    for k, image in enumerate(images):
        obj = parts.scan_objects.object_from_range_image(f"scan{k:02}", image, 0.001, True)
        bpy.context.scene.collection.objects.link(obj)
        obj.select_set(True)
    run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="scans")
    view_selected()
    yield 2.0
    took, times = [], drawn()
    for _ in range(RUNS):
        times.clear()
        pressed = time.monotonic()
        run(bpy.ops.surfrecon.merge, voxel=0.0003)
        yield from until(lambda: times)
        # Blender's timers come after the window was drawn.
        took.append(1e3 * (time.monotonic() - pressed))
        bpy.ops.surfrecon.cancel()
        yield from until(lambda: parts.job.Running.job is None)
        yield 1.0
    print(json.dumps({"first_progress_ms": statistics.median(took), "all": took}), flush=True)


drive(steps())
