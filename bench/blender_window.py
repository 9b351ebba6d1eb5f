"""Time from the button to the first progress drawn, in the window of a real Blender: `tools/test_gui.sh` runs it."""

import importlib
import json
import os
import statistics
import sys
import time
import traceback

import bpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "tests", "gui"))
window = importlib.import_module("window")

# Samples of each scan: large enough that reading them takes a while.
PIXELS, RUNS = 600, 5


def steps():
    """Scans, then merges that are stopped as soon as they show progress."""
    yield from window.installing()
    import surfrecon

    extension = window.extension()
    shape = surfrecon.sculpture(cell=4.0)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=PIXELS))
    for k, image in enumerate(images):
        obj = extension.convert.object_from_range_image(f"scan{k:02}", image, 0.001, True)
        bpy.context.scene.collection.objects.link(obj)
        obj.select_set(True)
    window.run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="scans")
    window.view_selected()
    yield 2.0
    took, drawn = [], window.drawn()
    for _ in range(RUNS):
        drawn.clear()
        pressed = time.monotonic()
        window.run(bpy.ops.surfrecon.merge, voxel=0.0003)
        yield from window.until(lambda: drawn)
        # Blender's timers come after the window was drawn.
        took.append(1e3 * (time.monotonic() - pressed))
        bpy.ops.surfrecon.cancel()
        yield from window.until(lambda: extension.job.Running.job is None)
        yield 1.0
    print(json.dumps({"first_progress_ms": statistics.median(took), "all": took}), flush=True)


def tick():
    """Called by Blender's timer."""
    try:
        return next(script)
    except StopIteration:
        status = 0
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    os._exit(status)


script = steps()
bpy.app.timers.register(tick, first_interval=1.0)
