"""True Size with a ruler that is drawn in the window without snapping: its ends lie in the air."""

import bpy
import numpy as np
from bpy_extras import view3d_utils
from driver import check, extension, key, only, picture, place, run
from making import merged_object
from person import Person

# Pixels between the places that are tried, and around one that are looked at.
STEP, AROUND = 25, 6


def seen(at):
    """The place that the view sees at a pixel of its region, or `None`."""
    region, view = place()["region"], place()["area"].spaces.active.region_3d
    begin = view3d_utils.region_2d_to_origin_3d(region, view, at)
    direction = view3d_utils.region_2d_to_vector_3d(region, view, at)
    hit, where, *_ = bpy.context.scene.ray_cast(bpy.context.evaluated_depsgraph_get(), begin, direction)
    return where if hit else None


def is_smooth(at, size):
    """Whether the surface goes on around a pixel."""
    there = [seen((at[0] + x, at[1] + y)) for x, y in ((0, 0), (AROUND, 0), (-AROUND, 0), (0, AROUND), (0, -AROUND))]
    return None not in there and all((one - there[0]).length < size / 30 for one in there)


def dragged(begin, end):
    """The mouse from one pixel of the region to another, with its left button held."""
    region, window = place()["region"], bpy.context.window_manager.windows[0]
    path = [np.array((region.x, region.y)) + begin + (np.array(end) - begin) * share for share in np.linspace(0, 1, 9)]
    for k, (x, y) in enumerate(path):
        window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=int(x), y=int(y))
        yield 0.2
        if k == 0:
            window.event_simulate(type="LEFTMOUSE", value="PRESS", x=int(x), y=int(y))
            yield 0.2
    window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(x), y=int(y))
    yield 0.5


def ruling():
    """The length that True Size begins with is that between the places of the surface that were pointed at."""
    merged = merged_object()
    only(merged)
    run(bpy.ops.wm.tool_set_by_id, "INVOKE_DEFAULT", name="builtin.measure")
    yield 1.0
    size, region = max(merged.dimensions), place()["region"]
    found = [
        (x, y)
        for x in range(100, region.width - 350, STEP)
        for y in range(100, region.height - 100, STEP)
        if is_smooth((x, y), size)
    ]
    check(f"the surface is seen at {len(found)} places", len(found) > 2)
    begin, end = max(((a, b) for a in found for b in found), key=lambda pair: np.hypot(*np.subtract(*pair)))
    there = (seen(begin) - seen(end)).length
    yield from dragged(begin, end)
    points = extension().regions.ruler_points(bpy.context.scene, 2)
    check("the window draws a ruler", points is not None)
    drawn = float(np.linalg.norm(points[1] - points[0]))
    picture("12_ruler")
    run(bpy.ops.wm.tool_set_by_id, "INVOKE_DEFAULT", name="builtin.select_box")
    yield 0.5
    yield from Person("ruler").click("surfrecon.true_size")
    yield 1.0
    picture("12_true_size")
    key("RET")
    yield 1.0
    asked = bpy.context.window_manager.operators[-1].distance
    check(
        f"between the places it is {there:.5f}, in the air {drawn:.5f}, and True Size begins with {asked:.5f}",
        abs(asked - there) < 0.01 * there < abs(drawn - there),
    )
