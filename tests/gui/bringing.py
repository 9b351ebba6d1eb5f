"""Bringing in: the extension, a file of scans, and scans to one frame."""

import os
import time

import bpy
from driver import (
    BESIDE_SIDEBAR,
    FOURTH_FIELD,
    MODULE,
    adjust,
    check,
    extension,
    key,
    leave_panel,
    picture,
    place,
    run,
    select,
    until,
    view_beside,
    view_selected,
)
from mathutils import Matrix, Vector
from person import MIDDLE, move

# About the distance of the samples of the scans that are dropped, in millimetres.
SPACING = 1.5


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
    # The outline would cover the colours.
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


def written(folder):
    """How many scans of a made-up shape were written, and the options of the operator that a drop of them calls."""
    import surfrecon

    shape = surfrecon.sculpture(cell=4.0)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=200), noise=0.05)
    for k, image in enumerate(images):
        image.name = f"serpent{k:02}"
    surfrecon.write_scans(folder / "serpent.conf", images)
    options = {"filepath": str(folder / "serpent.conf"), "directory": f"{folder}/", "files": [{"name": "serpent.conf"}]}
    return len(images), options


def dropping(folder):
    """A file dropped into the view: the call that Blender makes for the file handler."""
    count, options = written(folder)
    handler = bpy.types.SURFRECON_FH_scans
    check("the file handler takes .conf files", ".conf" in handler.bl_file_extensions.split(";"))
    with bpy.context.temp_override(**place()):
        check("and files dropped into the 3D view", bool(handler.poll_drop(bpy.context)))
    # The dialog opens there.
    move(MIDDLE)
    yield 0.3
    run(bpy.ops.surfrecon.import_scans, **options, unit="MM")
    yield 0.7
    picture("2_import_dialog")
    check("nothing is imported before the dialog is answered", not bpy.data.objects)
    *_, seen = extension().foreseen.Look.found.values()
    longest = float((seen.high - seen.low).max())
    check(f"the dialog knows that the scans are {longest:.0f} mm long", 100 < longest < 300)
    key("RET")
    yield from until(lambda: bpy.data.objects and extension().job.Running.job is None)
    scans = [obj for obj in bpy.data.objects if extension().scan_objects.is_range_image(obj)]
    check(f"all {count} scans are there", len(scans) == count)
    check("in a collection named after the set", "serpent" in bpy.data.collections)
    run(bpy.ops.ed.undo, "EXEC_DEFAULT")
    check("importing is one undo step", not bpy.data.objects)
    run(bpy.ops.ed.redo, "EXEC_DEFAULT")
    check("that can be done again", len(bpy.data.objects) == count)
    yield 0.5
    far = place()["area"].spaces.active.region_3d.view_distance
    size = max(obj.dimensions.length for obj in bpy.data.objects)
    check(f"the scans fill the view: {size:.2g} seen from {far:.2g}", size < far < 5 * size)
    run(bpy.ops.surfrecon.tint_scans)
    view_beside(BESIDE_SIDEBAR)
    yield 3.0
    picture("3_scans")


def undoing(folder):
    """Scans in a cube are shown alone, and once they are undone the cube is seen again."""
    _, options = written(folder)
    run(bpy.ops.mesh.primitive_cube_add, "EXEC_DEFAULT", True, size=2)
    run(bpy.ops.surfrecon.import_scans, **options, unit="MM")
    yield 0.7
    key("RET")
    yield from until(lambda: len(bpy.data.objects) > 1 and extension().job.Running.job is None)
    yield 0.5
    view = place()["area"].spaces.active
    check("scans in a cube are shown alone", view.local_view is not None)
    run(bpy.ops.ed.undo, "EXEC_DEFAULT")
    yield 1.0
    (cube,) = bpy.data.objects
    check("and the cube is seen again without them", view.local_view is None and cube.visible_get(viewport=view))
    bpy.data.objects.remove(cube)
    run(bpy.ops.ed.undo_push, "EXEC_DEFAULT", message="empty")


def aligning():
    """Scans that are thrown about come together again, F9 throws them back, and they end where the file put them."""
    running, scans = extension().job.Running, sorted(bpy.data.objects.keys())
    there = [bpy.data.objects[name].matrix_world.copy() for name in scans]
    thrown = [Matrix.Rotation(k, 4, "XYZ"[k % 3]) @ Matrix.Translation((0.03 * k, 0, 0)) for k in range(len(scans))]

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
    view_selected()
    yield 1.0
    picture("3_heap")
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
