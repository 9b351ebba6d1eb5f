"""Disturbances by a user: cancelling, another editor, another scene, another file."""

import os
import threading
import time

import addon_utils
import bpy
from driver import BESIDE_SIDEBAR, MODULE, check, extension, key, names, picture, run, select, shown, until, view_beside


def watch(job, ended):
    """Notes when a job ends."""
    while not job.done():
        time.sleep(0.005)
    ended.append(time.monotonic())


def cancelling(scans):
    """ESC, the button, another file: the scene stays as it was. A fine merge shows its preview first."""
    running, preview = extension().job.Running, extension().preview.Preview
    for route in ("ESC", "button"):
        select([bpy.data.objects[name] for name in scans])
        view_beside(BESIDE_SIDEBAR)
        before = names()
        run(bpy.ops.surfrecon.merge, voxel=0.00008)
        yield from until(lambda: running.seconds() > 0.5 and hasattr(running.job, "result"))
        if route == "ESC":
            yield from until(lambda: preview.handle is not None or running.job is None, 60)
            check("a preview is drawn while a long merge runs", preview.handle is not None)
            yield 2.0
            picture("5_preview")
            check("and nothing of it is in the scene", names() == before)
        job, ended = running.job, []
        # On a thread: drawing keeps this one waiting.
        watcher = threading.Thread(target=watch, args=(job, ended))
        watcher.start()
        if route == "ESC":
            key("ESC")
        else:
            bpy.ops.surfrecon.cancel()
        yield from until(lambda: running.job is None, 60)
        watcher.join()
        seconds = ended[0] - running.stopped
        unchanged = running.job is None and names() == before
        check(f"{route} leaves the scene as it was", unchanged)
        # The watcher looks 200 times a second, the window 20 times.
        limit = extension().job.STOPPED_SECONDS + extension().job.POLL_SECONDS
        check(f"and ends the job in {1000 * seconds:.0f} ms", seconds < limit)
        check("and takes the preview away", preview.handle is None)
        yield 0.3


def asking():
    """The file browser with the options at its side."""
    run(bpy.ops.surfrecon.import_scans)
    yield from until(lambda: shown("FILE_BROWSER"), 10)
    check("the menu's entry opens a file browser", shown("FILE_BROWSER"))
    yield 2.0
    picture("10_file_browser")
    key("ESC")
    yield from until(lambda: not shown("FILE_BROWSER"), 10)
    check("that ESC closes", shown("VIEW_3D") and not shown("FILE_BROWSER"))
    yield 0.5


def meddling(scans, folder):
    """Other work of a user while a merge runs: it ends well, whatever happens to the scene."""
    running = extension().job.Running

    def begin(voxel=0.0003):
        for name in scans:
            if name in bpy.data.objects:
                bpy.data.objects[name].hide_set(False)
        select([bpy.data.objects[name] for name in scans if name in bpy.data.objects])
        run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="select")
        run(bpy.ops.surfrecon.merge, voxel=voxel)
        # Objects that vanish while they are read are another matter.
        yield from until(lambda: running.job is None or (hasattr(running.job, "result") and running.fraction > 0.02))

    def ended(text):
        yield from until(lambda: running.job is None)
        yield 0.3
        made = bpy.context.view_layer.objects.active
        check(f"a merge ends well while {text}", made is not None and "surfrecon_report" in made)

    yield from begin()
    bpy.data.objects.remove(bpy.data.objects[scans[-1]])
    yield 0.2
    yield from ended("one of its scans is deleted")
    yield from begin()
    run(bpy.ops.ed.undo, "EXEC_DEFAULT")
    yield 0.2
    run(bpy.ops.ed.undo, "EXEC_DEFAULT")
    yield from ended("steps are undone")
    yield from begin()
    polls = [getattr(bpy.ops.surfrecon, name).poll() for name in ("merge", "sculpt", "clean", "import_scans")]
    check("nothing else of the extension may begin", not any(polls))
    path = str(folder / "meanwhile.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    check("the file can be saved", os.path.getsize(path) > 100_000)
    yield from ended("the file is saved")
    yield from begin()
    run(bpy.ops.object.mode_set, "EXEC_DEFAULT", mode="EDIT")
    yield from until(lambda: running.waiting or running.job is None)
    edited = bpy.context.view_layer.objects.active
    waits = running.job is not None and edited.mode == "EDIT" and edited.name in scans
    check("a merge that ends while a mesh is edited waits", waits)
    run(bpy.ops.object.mode_set, "EXEC_DEFAULT", mode="OBJECT")
    yield from ended("a mesh is edited")
    # Drawing may take longer than a coarser merge.
    yield from begin(0.0001)
    yield from until(lambda: hasattr(running.job, "result"), 10)
    job = running.job
    addon_utils.disable(MODULE)
    yield from until(lambda: job is None or job.done(), 10)
    check("disabling the extension ends what runs", job is not None and job.done())
    addon_utils.enable(MODULE)
    yield 0.5
    check("and it can be enabled again", hasattr(bpy.types, "SURFRECON_OT_merge"))


def switching(scans):
    """Another scene is shown while a merge runs: the surface comes into the scene where it was begun."""
    running, window = extension().job.Running, bpy.context.window_manager.windows[0]
    there = window.scene
    for name in scans:
        there.objects[name].hide_set(False)
    select([there.objects[name] for name in scans])
    before = set(there.objects.keys())
    run(bpy.ops.surfrecon.merge, voxel=0.0006)
    yield from until(lambda: running.job is None or (hasattr(running.job, "result") and running.fraction > 0.02))
    check("a merge runs", running.job is not None)
    other = bpy.data.scenes.new("Other")
    window.scene = other
    yield from until(lambda: running.job is None)
    yield 0.3
    came = [obj for obj in there.objects if obj.name not in before and "surfrecon_report" in obj]
    check("a surface comes into the scene that it was begun in", len(came) == 1)
    check("and nothing into the one that is shown", window.scene == other and not other.objects)
    window.scene = there
    bpy.data.scenes.remove(other)
    yield 0.3
    hidden = not any(there.objects[name].visible_get() for name in scans)
    check("where its scans are hidden", hidden and bool(came) and came[0].visible_get())


def leaving(scans):
    """Another file while something runs."""
    running = extension().job.Running
    there = [bpy.data.objects[name] for name in scans if name in bpy.data.objects]
    for obj in there:
        obj.hide_set(False)
    select(there)
    run(bpy.ops.surfrecon.merge, voxel=0.00008)
    yield from until(lambda: running.fraction > 0 and hasattr(running.job, "result"))
    job = running.job
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 0.5
    check("another file ends what runs", job is not None and running.job is None)
    yield from until(job.done, 10)
    check("and its thread", job.done())
