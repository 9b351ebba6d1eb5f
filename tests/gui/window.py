"""Drives the extension in the window of a real Blender: `tools/test_gui.sh` runs it.

Blender's own event loop runs between the `yield`s, each of which says for how many seconds. Every check prints a line
`ok: ...` or `FAILED: ...`; pictures of the window are kept.
"""

import os
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from pathlib import Path

import addon_utils
import bpy
from mathutils import Matrix, Vector

PICTURES = Path(os.environ["SURFRECON_PICTURES"])
MODULE = "bl_ext.user_default.surfrecon"
LONGEST = 240
failed = 0

# Must be set before the window is drawn.
bpy.context.preferences.view.show_splash = False
# Without a window manager a second window would cover everything.
bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
bpy.context.preferences.system.use_online_access = False
# Views change at once.
bpy.context.preferences.view.smooth_view = 0


def check(text, holds):
    """One line a check."""
    global failed
    failed += not holds
    print(f"{'ok' if holds else 'FAILED'}: {text}", flush=True)


def place():
    """Window, area and region of the 3D view, for `temp_override`."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    return {"window": window, "area": area, "region": next(r for r in area.regions if r.type == "WINDOW")}


def run(operator, *mode, **options):
    """Calls an operator as a button does: with its invoke and with an undo step."""
    with bpy.context.temp_override(**place()):
        return operator(*(mode or ("INVOKE_DEFAULT", True)), **options)


def key(name, at=None, unicode=None):
    """Presses and releases a key with the mouse there, else over the middle of the window."""
    window = bpy.context.window_manager.windows[0]
    x, y = at or (window.width // 2, window.height // 2)
    for value in ("PRESS", "RELEASE"):
        text = {"unicode": unicode} if unicode and value == "PRESS" else {}
        window.event_simulate(type=name, value=value, x=x, y=y, **text)


KEYS = ["ZERO", "ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE", "PERIOD"]
DIGITS = dict(zip("0123456789.", KEYS, strict=True))

# Where F9 opens its panel, in pixels from the lower left corner, and from there the second field below the presets.
PANEL, SECOND_FIELD, FOURTH_FIELD = (120, 760), (208, -97), (208, -143)


def adjust(name, text, field=SECOND_FIELD):
    """As a person does: F9, the mouse over a field, Enter, a number, Enter."""
    window = bpy.context.window_manager.windows[0]
    key("F9", PANEL)
    yield 1.0
    picture(name)
    at = (PANEL[0] + field[0], PANEL[1] + field[1])
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=at[0], y=at[1])
    yield 0.3
    key("RET", at)
    yield 0.3
    for letter in text:
        key(DIGITS[letter], at, letter)
    yield 0.3
    key("RET", at)
    yield 0.5


def leave_panel():
    """Closes what F9 opened."""
    key("ESC", (PANEL[0] + SECOND_FIELD[0], PANEL[1] + SECOND_FIELD[1]))
    yield 0.5


def picture(name):
    """Keeps a picture of the whole window; Blender's own screenshots are black under software rendering."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    command = ["import", "-window", "root", "-display", os.environ["DISPLAY"], PICTURES / f"{name}.png"]
    subprocess.run(command, check=True)


def until(condition, seconds=LONGEST):
    """Lets Blender run until something holds."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        yield 0.02


def extension():
    """The enabled extension."""
    return sys.modules[MODULE]


def names():
    """What a cancelled operation must leave as it was."""
    kinds = (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.collections)
    return [sorted(kind.keys()) for kind in kinds]


def select(objects):
    """Selects these objects only."""
    for obj in bpy.data.objects:
        if obj in objects:
            obj.hide_set(False)
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def only(shown):
    """Hides all else, selects the object and fills the view with it."""
    for obj in bpy.data.objects:
        obj.hide_set(obj is not shown)
    select([shown])
    view_selected()


def view_selected():
    """Fills the view with what is selected."""
    run(bpy.ops.view3d.view_selected, "INVOKE_DEFAULT", use_all_regions=False)


def installing():
    """From the zip, as a user does."""
    bpy.ops.extensions.package_install_files(
        filepath=os.environ["SURFRECON_ZIP"], repo="user_default", enable_on_install=True
    )
    check("the extension is installed and enabled", MODULE in bpy.context.preferences.addons)
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="empty")
    yield 0.5
    area = place()["area"]
    area.spaces[0].show_region_ui = True
    area.spaces[0].overlay.show_floor = False
    # Which would cover the colours.
    area.spaces[0].overlay.show_outline_selected = False
    yield 0.5
    next(region for region in area.regions if region.type == "UI").active_panel_category = "Scans"
    yield 0.5
    picture("1_sidebar")
    view = bpy.context.preferences.view
    view.language, view.use_translate_interface = "de_DE", True
    yield 0.5
    # Blender's own word for it is that of a command.
    check("in German our words win over Blender's", extension().translations.word("Triangles") == "Dreiecke")
    picture("1_sidebar_german")
    view.language = "en_US"
    yield 0.5


def dropping(folder):
    """A file dropped into the view: the call that Blender makes for the file handler."""
    import surfrecon

    shape = surfrecon.sculpture(cell=4.0)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=200), noise=0.05)
    for k, image in enumerate(images):
        image.name = f"serpent{k:02}"
    surfrecon.write_scans(folder / "serpent.conf", images)
    handler = bpy.types.SURFRECON_FH_scans
    check("the file handler takes .conf files", ".conf" in handler.bl_file_extensions.split(";"))
    with bpy.context.temp_override(**place()):
        check("and files dropped into the 3D view", bool(handler.poll_drop(bpy.context)))
    options = {"filepath": str(folder / "serpent.conf"), "directory": f"{folder}/", "files": [{"name": "serpent.conf"}]}
    run(bpy.ops.surfrecon.import_scans, **options, unit="MM")
    yield 0.7
    picture("2_import_dialog")
    check("nothing is imported before the dialog is answered", not bpy.data.objects)
    key("RET")
    yield from until(lambda: bpy.data.objects and extension().job.Running.job is None)
    scans = [obj for obj in bpy.data.objects if extension().convert.is_range_image(obj)]
    check(f"all {len(images)} scans are there", len(scans) == len(images))
    check("in a collection named after the set", "serpent" in bpy.data.collections)
    run(bpy.ops.ed.undo, "EXEC_DEFAULT")
    check("importing is one undo step", not bpy.data.objects)
    run(bpy.ops.ed.redo, "EXEC_DEFAULT")
    check("that can be done again", len(bpy.data.objects) == len(images))
    yield 0.5
    far = place()["area"].spaces.active.region_3d.view_distance
    size = max(obj.dimensions.length for obj in bpy.data.objects)
    check(f"the scans fill the view: {size:.2g} seen from {far:.2g}", size < far < 5 * size)
    run(bpy.ops.surfrecon.tint_scans)
    yield 3.0
    picture("3_scans")


# About the distance of the samples of the scans that are dropped, in millimetres.
SPACING = 1.5


def aligning():
    """Scans that are thrown about come together again, F9 throws them back, and they end where the file put them."""
    running, scans = extension().job.Running, sorted(bpy.data.objects.keys())
    there = [bpy.data.objects[name].matrix_world.copy() for name in scans]
    thrown = [Matrix.Rotation(k, 4, "XYZ"[k % 3]) @ Matrix.Translation((0.1 * k, 0, 0)) for k in range(len(scans))]

    def put(matrices, text):
        objects = [bpy.data.objects[name] for name in scans]
        for obj, matrix in zip(objects, matrices, strict=True):
            obj.matrix_world = matrix
        select(objects)
        run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message=text)

    def off(matrices):
        """How far the scans lie, beside the first, from where these matrices put them: millimetres."""
        objects = [bpy.data.objects[name] for name in scans]
        back = matrices[0] @ objects[0].matrix_world.inverted()
        pairs = zip(objects, matrices, strict=True)
        return 1000 * max(
            ((back @ obj.matrix_world - matrix) @ Vector((*corner, 1))).length
            for obj, matrix in pairs
            for corner in obj.bound_box
        )

    put(thrown, "thrown")
    yield 0.3
    for time_of_it in ("at first", "once more"):
        started = time.monotonic()
        check(f"aligning {time_of_it} runs in the background", run(bpy.ops.surfrecon.align) == {"RUNNING_MODAL"})
        yield from until(lambda: running.job is None)
        took = time.monotonic() - started
        check(f"scans come together in {took:.1f} s, {off(there):.2f} mm off", off(there) < SPACING)
        yield 0.3
        if time_of_it == "at first":
            run(bpy.ops.ed.undo, "EXEC_DEFAULT")
            check("undo throws them about in one step", off(thrown) < 0.001)
    view_selected()
    yield 1.0
    picture("3_aligned")
    for share, matrices, limit, text in (
        ("1", thrown, 0.001, "F9: where no overlap is enough, all lie where they were"),
        ("0.03", there, SPACING, "and come together with another"),
    ):
        yield from adjust("3_adjust_aligned", share, FOURTH_FIELD)
        yield from until(lambda: running.job is None)
        yield from leave_panel()
        yield 0.5
        check(f"{text}: {off(matrices):.3f} mm off", off(matrices) < limit)
    put(there, "as in the file")
    view_selected()
    yield 0.3


def drawn():
    """A list that gets the time of each drawing of the panel while something runs."""
    panel, times = extension().panels.SURFRECON_PT_running, []
    draw = getattr(panel, "drawn_by", panel.draw)
    panel.drawn_by = draw

    def note(self, context):
        draw(self, context)
        if extension().job.Running.job is not None:
            times.append(time.monotonic())

    panel.draw = note
    return times


def merging():
    """To the end, with progress; then back and forth."""
    running, shown = extension().job.Running, drawn()
    before = names()
    started = time.monotonic()
    check("the merge runs in the background", run(bpy.ops.surfrecon.merge, voxel=0.0006) == {"RUNNING_MODAL"})
    yield from until(lambda: shown, 10)
    # Blender's timers come after the window was drawn.
    took = 1000 * (time.monotonic() - started)
    check(f"the first progress was drawn {took:.0f} ms after the button", bool(shown))
    seen, stages, pictured = [], set(), False
    while running.job is not None and time.monotonic() < started + LONGEST:
        seen.append(running.fraction)
        stages.add(running.stage)
        if running.fraction > 0.3 and not pictured:
            pictured = True
            check("no second operation may begin meanwhile", not bpy.ops.surfrecon.merge.poll())
            picture("4_merging")
        yield 0.05
    # Reading the objects, then merging and measuring: each from 0 to 1.
    falls = sum(after < before for before, after in zip(seen, seen[1:], strict=False))
    check(f"progress rose through {len(stages)} stages", falls <= 1 < len(stages))
    yield 0.3
    merged = bpy.data.objects.get("Merged")
    check("the surface is there", merged is not None and len(merged.data.polygons) > 10000)
    run(bpy.ops.ed.undo, "EXEC_DEFAULT")
    check("undo takes it away in one step", names() == before)
    run(bpy.ops.ed.redo, "EXEC_DEFAULT")
    check("redo brings it back", "Merged" in bpy.data.objects)
    scans = [obj for obj in bpy.data.objects if extension().convert.is_range_image(obj)]
    check("and the scans, which lie in the same place, are hidden", not any(obj.visible_get() for obj in scans))
    yield 0.3


def merging_anew(scans):
    """F9 after a merge is about the merge."""
    running = extension().job.Running
    select([bpy.data.objects[name] for name in scans])
    run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="select")
    count = len(bpy.data.objects)
    run(bpy.ops.surfrecon.merge, voxel=0.0006)
    yield from until(lambda: running.job is None)
    yield 0.3
    yield from adjust("4_adjust_merge", "0.003")
    yield from until(lambda: running.job is None)
    yield from leave_panel()
    yield 0.3
    made = bpy.context.view_layer.objects.active
    distance = made["surfrecon_report"]["merge_distance"]
    check(f"F9 merges anew within {distance:.4f}", len(bpy.data.objects) == count + 1 and abs(distance - 0.003) < 1e-5)
    check("and what was merged is hidden again", not any(bpy.data.objects[name].visible_get() for name in scans))
    made.name = "Merged anew"
    return made.name


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


def adjusting(scans):
    """The panel of the last operation digs again without a new start."""
    only(bpy.data.objects[scans[0]])
    place()["area"].spaces.active.overlay.show_wireframes = True
    run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="select")
    running, kept = extension().job.Running, extension().kept.Kept
    others = set(bpy.data.objects.keys())
    run(bpy.ops.surfrecon.sculpt, relative_tolerance=0.002)
    yield from until(lambda: running.job is None)
    fine, sculptor, count = len(bpy.context.object.data.polygons), kept.value, len(bpy.data.objects)
    yield 0.3
    yield from adjust("6_adjust", "0.01")
    yield from until(lambda: running.job is None)
    coarse = len(bpy.context.object.data.polygons)
    check(f"F9 digs again: {fine:,} to {coarse:,} triangles", coarse < fine and len(bpy.data.objects) == count)
    check("and leaves all else", others < set(bpy.data.objects.keys()))
    check("with the same sculptor", kept.value is sculptor and sculptor is not None)
    yield from leave_panel()
    run(bpy.ops.ed.undo, "EXEC_DEFAULT")
    check("undo takes it away in one step", len(bpy.data.objects) == count - 1)
    check("and shows the scan again", bpy.data.objects[scans[0]].visible_get())
    place()["area"].spaces.active.overlay.show_wireframes = False
    yield 0.3


def adjusting_long():
    """What takes longer than a second when adjusted leaves the window alive, and ESC brings the first result back."""
    running = extension().job.Running
    select([bpy.data.objects["Merged"]])
    run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="select")
    count = len(bpy.data.objects)
    run(bpy.ops.surfrecon.cluster, vertices=3000)
    yield from until(lambda: running.job is None)
    first = len(bpy.context.object.data.vertices)
    check("the surface is clustered", len(bpy.data.objects) == count + 1)
    yield 0.3
    yield from adjust("7_adjust_long", "60000")
    check("an adjusted operation that takes long goes on in the background", running.job is not None)
    yield 0.5
    yield from leave_panel()
    if running.job is not None and running.stopped is None:
        key("ESC")
    yield from until(lambda: running.job is None)
    yield 1.0
    same = len(bpy.data.objects) == count + 1 and len(bpy.context.object.data.vertices) == first
    check("ESC brings the first result back", same)
    yield from adjust("7_adjust_long", "30000")
    yield from until(lambda: running.job is None)
    yield from leave_panel()
    yield 0.5
    made = bpy.context.object
    replaced = len(bpy.data.objects) == count + 1 and len(made.data.vertices) > first
    check(f"waiting replaces it: {first:,} to {len(made.data.vertices):,} vertices", replaced)
    yield from adjust("7_adjust_long", "20000")
    yield from until(lambda: running.job is None)
    yield from leave_panel()
    yield 0.5
    again = len(bpy.context.object.data.vertices)
    replaced = len(bpy.data.objects) == count + 1 and first < again < 30000
    check(f"and so does adjusting once more: {again:,} vertices", replaced)
    yield 0.3


def looking():
    """The error map with its legend, and the measured distance."""
    running = extension().job.Running
    merged = bpy.data.objects["Merged"]
    select([merged])
    run(bpy.ops.surfrecon.error_map)
    yield from until(lambda: running.job is None)
    check("the error map is there", "error" in merged.data.attributes)
    only(merged)
    # Shaders are compiled first.
    yield 15.0
    picture("8_error_map")
    space = place()["area"].spaces.active
    space.shading.type, space.shading.color_type = "SOLID", "VERTEX"
    yield 3.0
    picture("9_error_map_solid")
    check("the colours for the solid view are there", merged.data.color_attributes.active_color.name == "error_colour")


def scanning():
    """No scanner at hand: a camera scans what is there, and the scan becomes quads."""
    running, merged = extension().job.Running, bpy.data.objects["Merged"]
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    middle = sum((merged.matrix_world @ Vector(corner) for corner in merged.bound_box), Vector()) / 8
    camera.location = middle + Vector((0, -3 * merged.dimensions.length, 0))
    camera.rotation_euler = (1.5708, 0, 0)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    for scan in (bpy.ops.surfrecon.reproject, bpy.ops.surfrecon.virtual_scan):
        select([merged])
        run(scan, percent=30)
        yield from until(lambda: running.job is None)
        yield 0.3
        made = bpy.context.view_layer.objects.active
        seen = extension().convert.is_range_image(made) and len(made.data.vertices) > 1000
        check(f"{made.name} sees {len(made.data.vertices):,} samples", seen)
    run(bpy.ops.view3d.localview, "INVOKE_DEFAULT")
    yield 0.5
    run(bpy.ops.surfrecon.quads, rows=40, columns=40)
    yield from until(lambda: running.job is None)
    yield 0.3
    made = bpy.context.view_layer.objects.active
    space = place()["area"].spaces.active
    # Only the evaluated object knows.
    drawn = made.evaluated_get(bpy.context.evaluated_depsgraph_get())
    check("a result is seen in the local view of its source", space.local_view and drawn.visible_in_viewport_get(space))
    run(bpy.ops.view3d.localview, "INVOKE_DEFAULT")
    quads = len(made.data.polygons)
    check(f"a quad grid has {quads:,} quads", quads > 100 and all(len(f.vertices) == 4 for f in made.data.polygons))


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


def shown(kind):
    """Whether a window has an area of that kind."""
    return any(area.type == kind for window in bpy.context.window_manager.windows for area in window.screen.areas)


def meddling(scans, folder):
    """What else a user does while a merge runs: it ends well, whatever happens to the scene."""
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


def steps():
    """All of it, in the order of the work."""
    yield from installing()
    with tempfile.TemporaryDirectory() as folder:
        yield from dropping(Path(folder))
    yield from aligning()
    scans = [obj.name for obj in bpy.data.objects]
    yield from merging()
    anew = yield from merging_anew(scans)
    yield from adjusting(scans)
    bpy.data.batch_remove([bpy.data.objects[anew]])
    yield from adjusting_long()
    yield from cancelling(scans)
    yield from looking()
    yield from scanning()
    yield from asking()
    with tempfile.TemporaryDirectory() as folder:
        yield from meddling(scans, Path(folder))
    yield from leaving(scans)


def tick():
    """Called by Blender's timer; an exception there would not end Blender."""
    try:
        return next(script)
    except StopIteration:
        print(f"{failed} checks failed" if failed else "all checks hold", flush=True)
    except BaseException:
        traceback.print_exc()
        check("the script runs to its end", False)
        picture("exception")
    sys.stdout.flush()
    os._exit(1 if failed else 0)


if __name__ == "__main__":
    script = steps()
    # Reading another file takes away all others.
    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
