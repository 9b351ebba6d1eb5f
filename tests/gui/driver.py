"""How a script works Blender's window: clicks, keys, pictures, checks.

Blender's own event loop runs between the `yield`s of a script, each of which says for how many seconds. Every check
prints a line `ok: ...` or `FAILED: ...`; pictures of the window are kept.
"""

import os
import subprocess
import sys
import time
import traceback
from pathlib import Path

import bpy
from mathutils import Vector

PICTURES = Path(os.environ["SURFRECON_PICTURES"])
MODULE = "bl_ext.user_default.surfrecon"
LONGEST = 240
# The status of a run that could not do all that was asked of it.
UNAVAILABLE = 3
failed = skipped = 0

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


def skip(text):
    """One line for what can't be done here. The run does not pass without it."""
    global skipped
    skipped += 1
    print(f"SKIPPED {text}", flush=True)


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

# The place of the panel that F9 opens, in pixels from the lower left corner, and from there fields below the presets.
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
    """Keeps a picture of all windows; Blender's own screenshots are black under software rendering."""
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    screen(name)


def screen(name):
    """Keeps a picture of the screen as it is."""
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
    """The names that a cancelled operation must leave as they were."""
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


# How much farther away than Blender's own views, and how far to the right of their middle, as a share of the distance:
# between the tools and the sidebar, and beside the panel of F9.
BESIDE_SIDEBAR, BESIDE_PANEL = (1.35, 0.046), (1.5, 0.086)


def view_beside(place_of_it):
    """Fills with what is selected the part of the view that pictures for people show."""
    view_selected()
    farther, right = place_of_it
    view = place()["area"].spaces.active.region_3d
    view.view_distance *= farther
    view.view_location -= view.view_rotation @ Vector((right * view.view_distance, 0, 0))


def shown(kind):
    """Whether a window has an area of that kind."""
    return any(area.type == kind for window in bpy.context.window_manager.windows for area in window.screen.areas)


def drive(script):
    """Runs a script from the event loop, and ends Blender with it."""

    def tick():
        """Called by Blender's timer; an exception there would not end Blender."""
        try:
            return next(script)
        except StopIteration:
            rest = f", and {skipped} SKIPPED" if skipped else ""
            print((f"{failed} checks failed" if failed else "all checks hold") + rest, flush=True)
        except BaseException:
            traceback.print_exc()
            check("the script runs to its end", False)
            picture("exception")
        sys.stdout.flush()
        os._exit(1 if failed else UNAVAILABLE if skipped else 0)

    # Reading another file takes away all others.
    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
