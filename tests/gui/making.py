"""Making surfaces of scans, adjusting them, looking at them."""

import time

import bpy
from driver import (
    BESIDE_PANEL,
    BESIDE_SIDEBAR,
    LONGEST,
    adjust,
    check,
    extension,
    key,
    leave_panel,
    names,
    only,
    picture,
    place,
    run,
    select,
    until,
    view_beside,
)
from mathutils import Vector
from person import found, is_stale, scrolled

# A button below those that show progress.
BELOW = "surfrecon.error_map"


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


def merged_object():
    """The surface that the scans were merged to, or `None`."""
    return next((obj for obj in bpy.data.objects if obj.name.endswith(" merged")), None)


def merging():
    """To the end, with progress; then back and forth."""
    running, shown = extension().job.Running, drawn()
    before = names()
    lay = yield from found(BELOW)
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
            lies = yield from found(BELOW)
            check(f"no button jumps: {BELOW} lies at {lies}, and lay at {lay}", lies == lay is not None)
        yield 0.05
    # Reading the objects, then merging and measuring: each from 0 to 1.
    falls = sum(after < before for before, after in zip(seen, seen[1:], strict=False))
    check(f"progress rose through {len(stages)} stages", falls <= 1 < len(stages))
    yield 0.3
    stale = yield from is_stale()
    check("the sidebar is as it should be by itself", not stale)
    merged = merged_object()
    check("the surface is there", merged is not None and len(merged.data.polygons) > 10000)
    run(bpy.ops.ed.undo, "EXEC_DEFAULT")
    check("undo takes it away in one step", names() == before)
    run(bpy.ops.ed.redo, "EXEC_DEFAULT")
    check("redo brings it back", merged_object() is not None)
    scans = [obj for obj in bpy.data.objects if extension().scan_objects.is_range_image(obj)]
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


def adjusting(scans):
    """The panel of the last operation digs again without a new start."""
    only(bpy.data.objects[scans[0]])
    view_beside(BESIDE_PANEL)
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
    """Adjusting that takes longer than a second leaves the window alive, and ESC brings the first result back."""
    running = extension().job.Running
    select([merged_object()])
    run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="select")
    count = len(bpy.data.objects)
    run(bpy.ops.surfrecon.remesh, vertices=3000)
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
    merged = merged_object()
    select([merged])
    run(bpy.ops.surfrecon.error_map)
    yield from until(lambda: running.job is None)
    check("the error map is there", "error" in merged.data.attributes)
    only(merged)
    view_beside(BESIDE_SIDEBAR)
    yield 1.0
    # Down to the legend, and back.
    yield from scrolled("WHEELDOWNMOUSE")
    picture("8_error_map")
    yield from scrolled("WHEELUPMOUSE")
    space = place()["area"].spaces.active
    check("it is seen in the solid view, whose colours need no shader", space.shading.type == "SOLID")
    check("which shows them", space.shading.color_type == "VERTEX")
    check("the colours for the solid view are there", merged.data.color_attributes.active_color.name == "error_colour")


def scanning():
    """No scanner at hand: a camera scans what is there, and the scan becomes quads."""
    running, merged = extension().job.Running, merged_object()
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
        seen = extension().scan_objects.is_range_image(made) and len(made.data.vertices) > 1000
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
