"""A person at Blender's window, who drops files, clicks, types, and counts each of these.

Buttons are found as they are seen: a picture in which one is drawn in red is compared with one in which none is.
"""

import subprocess

import bpy
from driver import PICTURES, check, extension, key, picture, place, screen, until

# Place of the mouse when a file is dropped, and when nothing else is meant: the middle of the 3D view, from below.
MIDDLE = (450, 520)

# The lens with which a view of 4 to 3 shows as much as a phone's photo.
PHOTO_LENS = 53


class Person:
    """One way from files to a result; its name is that of its pictures."""

    def __init__(self, name):
        self.name, self.done, self.seen, self.kept = name, [], 0, {}

    def did(self, text):
        """Counts one interaction."""
        self.done.append(text)
        print(f"   {len(self.done)}. {text}", flush=True)

    def look(self, text):
        """Keeps a picture."""
        self.seen += 1
        picture(f"{self.name}_{self.seen}_{text}")

    def keep(self, folder, text):
        """Keeps a copy of the file as it is, for `portrait`."""
        self.kept[text] = str(folder / f"{self.name}_{text}.blend")
        bpy.ops.wm.save_as_mainfile(filepath=self.kept[text], copy=True)

    def counted(self, most):
        """Checks how many interactions it took."""
        check(f"{self.name}: {len(self.done)} interactions, at most {most}", len(self.done) <= most)

    def drop(self, paths):
        """Files are dropped into the view: the operator that Blender calls with them."""
        self.did(f"drop {paths[0].name}" + (f" and {len(paths) - 1} more" if len(paths) > 1 else ""))
        move(MIDDLE)
        yield 0.3
        with bpy.context.temp_override(**place()):
            bpy.ops.wm.drop_import_file(
                "INVOKE_DEFAULT", directory=f"{paths[0].parent}/", files=[{"name": path.name} for path in paths]
            )
        yield 1.0

    def press(self, name, text=None):
        """The default button of the dialog that is open."""
        self.did(text or name)
        key(name, MIDDLE)
        yield 0.5

    def type(self, name, unicode=None):
        """A key over the view."""
        self.did(f"key {name}")
        key(name, MIDDLE, unicode)
        yield 0.5

    def click(self, operator):
        """A button of the sidebar."""
        button = yield from found(operator)
        check(f"{self.name}: the button {operator} is in sight", button is not None)
        if button is None:
            self.look("no_button")
            return
        self.did(f"click {operator}")
        # The first move lets the button know of the mouse, which slow drawing may keep from it.
        for off in (3, 0):
            window = move((button[0] + off, button[1]))
            yield 0.5
        for value in ("PRESS", "RELEASE"):
            window.event_simulate(type="LEFTMOUSE", value=value, x=button[0], y=button[1])
            yield 0.2

    def wait(self):
        """For what runs."""
        running = extension().job.Running
        yield 0.5
        yield from until(lambda: running.job is None, 900)
        check(f"{self.name}: it ends", running.job is None)
        move(MIDDLE)
        yield 1.0


def portrait(name, view_matrix, lens=PHOTO_LENS):
    """Keeps a picture of the view alone, without its sidebar, its tools and what else lies over it."""
    area = place()["area"]
    space = area.spaces.active
    space.show_region_ui = space.show_region_toolbar = space.show_region_header = space.show_region_tool_header = False
    space.overlay.show_overlays = space.show_gizmo = False
    space.lens, space.region_3d.view_perspective = lens, "PERSP"
    space.region_3d.view_matrix = view_matrix
    yield 1.0
    picture(name)


def move(at):
    """Moves the mouse."""
    window = bpy.context.window_manager.windows[0]
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=at[0], y=at[1])
    return window


def sidebar():
    """The region of the sidebar."""
    return next(region for region in place()["area"].regions if region.type == "UI")


def found(operator):
    """Place of an operator's button in the sidebar, in pixels from the lower left corner. `None` if it isn't there."""
    panels = extension().panels
    draw = panels.button
    names = []

    def button(column, name, icon, **look):
        """Draws one in red, but for the first picture."""
        row = column.row(align=True)
        row.alert = name in names
        draw(row, name, icon, **look)

    panels.button = button
    region = sidebar()
    try:
        for kind in ("plain", "red"):
            region.tag_redraw()
            yield 0.3
            shot(kind)
            names.append(operator)
    finally:
        panels.button = draw
        region.tag_redraw()
    box = difference(region, reddened=True)
    yield 0.1
    return box


def shot(name):
    """A picture of the window to look for something in; it is not kept."""
    picture(f".{name}")


def is_stale():
    """Whether the sidebar shows something else once it is drawn anew, which nobody asks for."""
    yield 1.0
    screen(".plain")
    sidebar().tag_redraw()
    yield 0.3
    shot("red")
    return difference(sidebar()) is not None


def difference(region, reddened=False):
    """The middle of what differs between two pictures in a region, or of what is redder in the second, or `None`."""
    height = bpy.context.window_manager.windows[0].height
    crop = f"{region.width}x{region.height}+{region.x}+{height - region.y - region.height}"
    command = ["convert", PICTURES / ".plain.png", PICTURES / ".red.png", "-crop", crop, "+repage"]
    if reddened:
        # Red without green, of which bars of progress have none.
        command += ["-color-matrix", "1 -1 0 1 -1 0 1 -1 0"]
    # Of what is seen through the sidebar edges differ too, but no whole area.
    command += ["-compose", "difference", "-composite", "-colorspace", "gray", "-threshold", "4%"]
    command += ["-morphology", "Open", "Rectangle:20x10"]
    mean = subprocess.run([*command, "-format", "%[fx:mean]", "info:"], check=True, capture_output=True, text=True)
    if float(mean.stdout) == 0:
        return None
    box = subprocess.run([*command, "-format", "%@", "info:"], check=True, capture_output=True, text=True).stdout
    size, x, y = box.split("+")
    width, tall = map(int, size.split("x"))
    top = height - region.y - region.height + int(y)
    return region.x + int(x) + width // 2, height - (top + tall // 2)


def scrolled(wheel):
    """Turns the wheel over the sidebar, as far as that goes."""
    region = sidebar()
    at = (region.x + region.width // 2, region.y + region.height // 2)
    window = move(at)
    for _ in range(12):
        yield 0.1
        window.event_simulate(type=wheel, value="PRESS", x=at[0], y=at[1])
    move(MIDDLE)
    yield 1.0
