"""Promises of the extension's page about the window, each seen in it: `tools/test_gui.sh tests/gui/promises.py`."""

import json
import os
import sys
import tempfile
import zipfile
from pathlib import Path

import blf
import bpy
import numpy as np
from mathutils import Matrix, Vector

TESTS = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(TESTS / "gui"), str(TESTS / "blender"), str(TESTS / "python")]

from bringing import written  # noqa: E402 (the path is made above)
from disturbing import switching  # noqa: E402
from driver import MODULE, PICTURES, check, drive, extension, key, picture, place, run, until  # noqa: E402
from person import Person, difference, found, move, scrolled, shot, sidebar  # noqa: E402

# Frames of the recordings that are dropped.
FRAMES = 6

# How often the view may be drawn until *Error Map* is seen, with the pictures by which its button is found.
REDRAWS = 20

# The place of the button *Cancel* beside a bar of progress, in pixels from the right border of the sidebar.
CANCEL = 48

# The icon and the margins of a button beside its label at scale 1, in pixels.
BESIDE_LABEL = 30

# Shares of a picture that a rendered surface covers, and noise.
COVERED, NOISE = 0.02, 0.0001


def scans():
    """The scans of the scene."""
    return [obj for obj in bpy.context.scene.objects if extension().scan_objects.is_range_image(obj)]


def emptied():
    """A new file, as Blender begins with."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield 1.0


def importing(person, folder):
    """Scans of millimetres are dropped into a new file: the view fits them, shows their colours and no outlines."""
    yield from emptied()
    view = place()["area"].spaces.active
    check("a new file's solid views show no colours of attributes", view.shading.color_type == "MATERIAL")
    check("and outlines", view.overlay.show_outline_selected)
    written(folder)
    bpy.context.preferences.addons[MODULE].preferences.unit = "MM"
    yield from person.drop([folder / "serpent.conf"])
    yield from person.press("RET", "click Import Range Scans")
    yield from person.wait()
    person.look("imported")
    size = max(obj.dimensions.length for obj in scans())
    near, far, away = view.clip_start, view.clip_end, view.region_3d.view_distance
    check(
        f"scans of {size:.2g} m are seen from {away:.2g} m, between planes at {near:.2g} and {far:.2g} m",
        near < 0.02 * size and far > 10 * size and near < away < far and far / near <= 1.001e6,
    )
    check(
        "in solid views, which show colours of attributes",
        (view.shading.type, view.shading.color_type) == ("SOLID", "VERTEX"),
    )
    check("without outlines", not view.overlay.show_outline_selected)


def keeping(person):
    """*Keep Inside* and *Remove Inside* are two buttons, and each click does what it says."""
    count = lambda: sum(len(obj.data.vertices) for obj in scans())  # noqa: E731
    everything, left = count(), []
    for action in ("keep_inside", "remove_inside"):
        yield from person.click("surfrecon.select_scans")
        yield from person.click("surfrecon.box_around")
        yield 0.5
        box = bpy.context.view_layer.objects.active
        check(
            "the box is active, and selected alone",
            [box] == bpy.context.selected_objects and box.name.startswith("Box"),
        )
        # To the upper half.
        box.scale.z *= 0.5
        box.location.z += box.scale.z
        run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="move")
        below = box.location.z - box.scale.z
        yield from person.click(f"surfrecon.{action}")
        yield from until(lambda: count() < everything, 30)
        left.append(count())
        if action == "keep_inside":
            heights = [(obj.matrix_world @ vertex.co).z for obj in scans() for vertex in obj.data.vertices]
            check(f"{action} leaves what is in the box", min(heights) > below - 1e-5)
            person.look("kept_inside")
        # The box and its move as well.
        for _ in range(4):
            if count() == everything and not any(obj.name.startswith("Box") for obj in bpy.data.objects):
                break
            run(bpy.ops.ed.undo, "EXEC_DEFAULT")
            yield 0.3
        check("and undo brings the rest back", count() == everything)
    check(
        f"of {everything:,} samples {left[0]:,} are inside and {left[1]:,} are not",
        sum(left) == everything and min(left) > 0.1 * everything,
    )


def rendered():
    """The share of a rendered picture that shows something."""
    path = PICTURES / ".rendered.png"
    bpy.context.scene.render.filepath = str(path)
    run(bpy.ops.render.render, "EXEC_DEFAULT", write_still=True)
    image = bpy.data.images.load(str(path), check_existing=False)
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return float((pixels[3::4] > 0.5).mean())


def rendering(person):
    """Scans that were merged are not rendered, as long as *Show Sources* does not show it."""
    yield from person.click("surfrecon.select_scans")
    yield from person.click("surfrecon.merge")
    yield from person.wait()
    merged, scene = bpy.context.view_layer.objects.active, bpy.context.scene
    middle = sum((merged.matrix_world @ Vector(corner) for corner in merged.bound_box), Vector()) / 8
    away = Matrix.Translation(middle + Vector((0, -2 * merged.dimensions.length, 0)))
    scene.camera.matrix_world = away @ Matrix.Rotation(np.pi / 2, 4, "X")
    scene.camera.data.clip_start = 0.001
    # The plainest of the engines, which compiles no shaders.
    scene.render.engine, scene.render.film_transparent = "BLENDER_WORKBENCH", True
    scene.render.resolution_x, scene.render.resolution_y = 320, 240
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    yield 0.5
    share = rendered()
    check(f"the surface is rendered: {share:.1%} of the picture", share > COVERED)
    # They lie where the surface lies, which hides them.
    merged.hide_render = True
    share = rendered()
    check(f"and nothing else, as is seen without it: {share:.1%}", share < NOISE)
    yield from person.click("surfrecon.show_sources")
    yield 0.5
    share = rendered()
    check(f"Show Sources lets its scans be rendered: {share:.1%}", share > COVERED)
    yield from person.click("surfrecon.show_sources")
    yield 0.5
    share = rendered()
    check(f"and no more, once it is clicked again: {share:.1%}", share < NOISE)
    merged.hide_render = False


def colouring(person):
    """*Error Map* is there at once: what the merge measured is at hand, and no shader is compiled."""
    merged = bpy.context.view_layer.objects.active
    view, drawn = place()["area"].spaces.active, []

    def note():
        """Called after each drawing of the view: whether it shows the colours."""
        name = merged.data.color_attributes.active_color_name
        drawn.append((name == "error_colour", view.shading.type, view.shading.color_type, view.shading.light))

    shot("plain")
    handle = bpy.types.SpaceView3D.draw_handler_add(note, (), "WINDOW", "POST_PIXEL")
    yield from person.click("surfrecon.error_map")
    yield from until(lambda: drawn and drawn[-1][0], 60)
    bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
    first = next((k for k, (shown, *_) in enumerate(drawn) if shown), len(drawn))
    check(f"the error map is seen after {first} drawings", first < len(drawn) and first <= REDRAWS)
    check("solid, unlit, in the colours of the legend", drawn[-1][1:] == ("SOLID", "VERTEX", "FLAT"))
    yield 0.5
    shot("red")
    region = place()["region"]
    check("and the picture has changed", difference(region) is not None)
    person.look("error_map")
    run(bpy.ops.surfrecon.error_hide)
    yield 0.5
    check("Hide Error Map takes it away", merged.data.color_attributes.active_color_name != "error_colour")


def scrolling(person):
    """Progress stands where one has scrolled to: in the button that was pressed, with the tab's top out of sight."""
    running = extension().job.Running
    yield from person.click("surfrecon.select_scans")
    yield from scrolled("WHEELDOWNMOUSE")
    top = yield from found("surfrecon.export_glb")
    check("the top of the tab is out of sight", top is None)
    lay = yield from found("surfrecon.merge")
    check(f"the button is in sight, at {lay}", lay is not None)
    run(bpy.ops.surfrecon.merge, voxel=0.0001)
    yield from until(lambda: running.fraction > 0.02 and hasattr(running.job, "result"), 120)
    check("a merge runs", running.job is not None)
    person.look("scrolled")
    check("and runs still", running.job is not None)
    # A click there hits the bar's button *Cancel*, or a grey button.
    region = sidebar()
    cancel = region.x + region.width - CANCEL, lay[1]
    window = move(cancel)
    yield 0.5
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(type="LEFTMOUSE", value=value, x=cancel[0], y=cancel[1])
        yield 0.2
    yield from until(lambda: running.job is None or running.stopped is not None, 5)
    stopped = running.job is None or running.stopped is not None
    check("its progress stands where the button was, and what is beside it cancels", stopped)
    if not stopped:
        key("ESC")
    yield from until(lambda: running.job is None, 60)
    yield from scrolled("WHEELUPMOUSE")


def reading_german():
    """No label of a button on the first screen is cut off in German."""
    view, panels = bpy.context.preferences.view, extension().panels
    draw, drawn, region = panels.button, [], sidebar()

    def button(column, name, icon, **look):
        """Notes which buttons are drawn."""
        drawn.append(name)
        draw(column, name, icon, **look)

    view.language, view.use_translate_interface = "de_DE", True
    panels.button = button
    region.tag_redraw()
    yield 1.0
    panels.button = draw
    picture("13_sidebar_german")
    scale = bpy.context.preferences.system.ui_scale
    blf.size(0, bpy.context.preferences.ui_styles[0].widget.points * scale)
    room, translations = region.width - BESIDE_LABEL * scale, extension().translations
    names = sorted(set(drawn))
    labels = {
        name: bpy.app.translations.pgettext_iface(panels.label_of(name), translations.OPERATORS) for name in names
    }
    widths = {label: blf.dimensions(0, label)[0] for label in labels.values()}
    widest = max(widths, key=widths.get)
    check(
        f"{len(labels)} buttons are drawn in German, such as {widest}", len(labels) > 15 and "Merge Scans" not in widths
    )
    check(f"the widest label takes {widths[widest]:.0f} of {room:.0f} pixels", widths[widest] < room)
    view.language = "en_US"
    yield 0.5


def r3d(path):
    """A recording as Record3D writes it, of the cameras of `recordings.ring`; blocks of LZFSE are not compressed."""
    from recordings import CENTRE, FOCAL, SIZE, TURNED, images

    def block(data):
        """Bytes as LZFSE keeps them if they can't be made smaller."""
        return b"bvx-" + len(data).to_bytes(4, "little") + data + b"bvx$"

    poses = []
    with zipfile.ZipFile(path, "w") as archive:
        for k, (camera, depths) in enumerate(images(FRAMES)):
            matrix = Matrix((camera.world_from_sensor @ TURNED).tolist())
            w, x, y, z = matrix.to_quaternion()
            poses.append([x, y, z, w, *matrix.translation])
            metres = np.where(depths == 0, np.nan, depths * 0.001).astype("<f4")
            archive.writestr(f"rgbd/{k}.depth", block(metres.tobytes()))
            archive.writestr(f"rgbd/{k}.conf", block(np.full(SIZE, 2, np.uint8).tobytes()))
        lens = [FOCAL[0], 0, 0, 0, FOCAL[1], 0, *CENTRE, 1]
        height, width = SIZE
        head = {"K": lens, "w": width, "h": height, "dw": width, "dh": height, "fps": 60, "poses": poses}
        archive.writestr("metadata", json.dumps(head))
    return path


def recordings(person, folder):
    """A file of Record3D and one depth image of a folder are dropped: each time the whole recording opens."""
    from recordings import write_transforms

    ring = write_transforms(folder / "ring", FRAMES)
    sizes = []
    # Blender takes such files for videos and images too, and asks by a menu.
    for path, asks in ((r3d(folder / "walk.r3d"), True), (ring.parent / "depths" / "00002.png", True), (ring, False)):
        yield from emptied()
        yield from person.drop([path])
        person.look(f"dropped_{path.suffix[1:]}")
        if asks:
            yield from person.press("I", "click Import Range Scans, in the menu of importers")
            yield 1.0
        yield from person.press("RET", "click Import Range Scans")
        yield from person.wait()
        person.look(path.suffix[1:])
        made = scans()
        check(f"{path.name}: {len(made)} scans of {FRAMES} frames", len(made) == FRAMES)
        cameras = [obj for obj in bpy.context.scene.objects if obj.type == "CAMERA" and obj.name != "Camera"]
        check(f"{path.name}: and their cameras", len(cameras) == FRAMES)
        if made:
            corners = np.array([obj.matrix_world @ Vector(corner) for obj in made for corner in obj.bound_box])
            sizes.append(sorted(np.ptp(corners, axis=0)))
    check("all are of the same size", len(sizes) == 3 and np.allclose(sizes, sizes[0], rtol=0.02))


def steps():
    """All of it."""
    bpy.ops.extensions.package_install_files(
        filepath=os.environ["SURFRECON_ZIP"], repo="user_default", enable_on_install=True
    )
    check("the extension is installed and enabled", MODULE in bpy.context.preferences.addons)
    yield 0.5
    person = Person("promises")
    with tempfile.TemporaryDirectory() as folder:
        yield from importing(person, Path(folder))
        yield from reading_german()
        yield from keeping(person)
        yield from rendering(person)
        yield from colouring(person)
        yield from switching([obj.name for obj in scans()])
        yield from scrolling(person)
        bpy.context.preferences.addons[MODULE].preferences.unit = "M"
        yield from recordings(person, Path(folder))


if __name__ == "__main__":
    drive(steps())
