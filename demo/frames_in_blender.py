"""The demo of recordings inside Blender: frames of a phone or a depth camera in, one coloured surface and pictures out.

Usage: python frames_in_blender.py ZIP OUT FRAMES      with the Python of a Blender module
FRAMES is what the extension imports as a recording: a folder, an archive, a list. UP=Y says which axis of it is up;
without, up is where the images' upper edge is. Writes OUT/demo.blend, OUT/demo.glb, OUT/demo.panel0.png and on, and
OUT/demo.json.
"""

import json
import os
import sys
from pathlib import Path

# Gives Blender a profile of its own, which must be there before the first `import bpy`.
from in_blender import MODULE, Clock, show_camera_view, world_points

# isort: split
import bpy
import numpy as np
from mathutils import Matrix, Vector

# Frames that become objects; all others are merged from the files.
OBJECTS = 9
AXES = "X", "Y", "Z", "-X", "-Y", "-Z"
# Pixels of a panel's longer side, and the view's angle along it.
PIXELS, ANGLE = 800, np.radians(55)
# This share of the surface is in view.
SEEN = 0.996
# This share of a panel around it is left free.
MARGIN = 0.04
CLAY, BACKDROP = (0.62, 0.56, 0.49, 1), (0.16, 0.17, 0.19)


def view(places, cameras, upright):
    """The matrix of a camera that sees the surface as the middle one of the recording did, but more of it.

    `places` (n, 3) are vertices, `cameras` matrices of Blender's cameras; `upright`: z is up, whatever the cameras say.
    """
    middle = np.array(cameras[len(cameras) // 2])
    forward = Vector(-middle[:3, 2])
    up = Vector((0, 0, 1)) if upright and abs(forward.z) < 0.95 else Vector(middle[:3, 1])
    right = forward.cross(up).normalized()
    axes = np.array([right, right.cross(forward), -forward])
    seen = places @ axes.T
    low, high = np.quantile(seen, [(1 - SEEN) / 2, (1 + SEEN) / 2], axis=0)
    half = (1 - MARGIN) * np.tan(ANGLE / 2)
    eye = np.append((low + high)[:2] / 2, high[2] + (high - low).max())
    # The middle of the picture depends on how far off the eye is, and the other way round.
    for _ in range(10):
        away = np.maximum(eye[2] - seen[:, 2], 1e-3 * (high - low).max())
        left, right = np.quantile((seen[:, :2] - eye[:2]) / away[:, None], [(1 - SEEN) / 2, (1 + SEEN) / 2], axis=0)
        eye[:2] += (left + right) / 2 * np.median(away)
        eye[2] = np.quantile(seen[:, 2] + np.abs(seen[:, :2] - eye[:2]).max(axis=1) / half, SEEN)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes.T, axes.T @ eye
    return Matrix(matrix.tolist()), (right - left) * np.median(away)


def studio(matrix, size):
    """A camera there and settings to draw with; pictures have the shape of what is seen. Returns width and height."""
    scene = bpy.context.scene
    data = bpy.data.cameras.new("View")
    data.sensor_fit, data.angle, data.clip_start, data.clip_end = "AUTO", ANGLE, size.max() / 1000, size.max() * 100
    made = bpy.data.objects.new("View", data)
    made.matrix_world = matrix
    scene.collection.objects.link(made)
    scene.camera = made
    wide = np.clip(size[0] / size[1], 0.7, 1.25)
    width, height = (PIXELS, round(PIXELS / wide)) if wide > 1 else (round(PIXELS * wide), PIXELS)
    render, shading = scene.render, scene.display.shading
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    scene.view_settings.view_transform = "Standard"
    scene.display.render_aa = "8"
    scene.world = scene.world or bpy.data.worlds.new("Backdrop")
    scene.world.color = [((c + 0.055) / 1.055) ** 2.4 for c in BACKDROP]
    # Walls are seen from the side that was scanned, and not in the way from the other.
    shading.show_backface_culling = True
    return width, height


def draw(path, objects, light, colour):
    """Renders these objects only."""
    scene = bpy.context.scene
    for obj in scene.objects:
        obj.hide_render = obj not in objects
    # Only now: what is saved shows its materials, which this engine has no view of.
    scene.render.engine = "BLENDER_WORKBENCH"
    shading = scene.display.shading
    shading.light, shading.color_type, shading.single_color = light, colour, CLAY[:3]
    shading.show_cavity = light == "STUDIO"
    shading.cavity_type = "WORLD"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def seen_in_colour(surface):
    """The share of vertices whose colour a frame has; that of others is what the nearest have."""
    colour = surface.vertex_attributes.get("colour")
    return 0.0 if colour is None else float(np.mean(np.asarray(colour)[:, 3] > 0))


def main():
    """Runs the demo."""
    archive, out, given = sys.argv[1], Path(sys.argv[2]).resolve(), sys.argv[3]
    clock = Clock()
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    if MODULE not in bpy.context.preferences.addons:
        sys.exit("Blender refused the extension")
    import surfrecon

    names = ("convert", "recording", "scan_objects")
    convert, recording, scan_objects = (sys.modules[f"{MODULE}.{name}"] for name in names)
    clock.done("install the extension")

    up = os.environ.get("UP", "Z").upper()
    forward = {"Y": "-Z", "-Y": "Z"}.get(up, "Y")
    if up not in AXES:
        sys.exit(f"UP must be one of {', '.join(AXES)}, got {up}")
    bpy.ops.surfrecon.import_scans(filepath=given, frames=OBJECTS, axis_up=up, axis_forward=forward)
    chosen = list(bpy.context.selected_objects)
    scans = [obj for obj in chosen if scan_objects.is_range_image(obj)]
    cameras = [obj.matrix_world for obj in bpy.data.objects if obj.type == "CAMERA"]
    if not cameras:
        sys.exit(f"{given} is no recording: leave FRAMES out, and give scans as SCANS=path/to/file.conf")
    others = sum(len(obj[recording.FRAMES]) for obj in chosen if recording.is_recording(obj))
    clock.done("import the frames")

    bpy.ops.surfrecon.merge()
    merged = bpy.context.object
    report = merged["surfrecon_report"].to_dict()
    surface = surfrecon.Mesh(
        convert.positions(merged.data), convert.triangles(merged.data), colour=convert.vertex_colours(merged.data)
    )
    clock.done("merge")

    matrix, size = view(world_points(merged), cameras, "UP" in os.environ)
    width, height = studio(matrix, size)
    out.mkdir(exist_ok=True)
    surface.write(str(out / "demo.glb"), up="z")
    for obj in chosen:
        obj.hide_set(True)
    show_camera_view()
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(out / "demo.blend"), compress=True)
    clock.done("save")
    coloured = "VERTEX" if surface.vertex_attributes.get("colour") is not None else "SINGLE"
    flat = "FLAT" if coloured == "VERTEX" else "STUDIO"
    panels = [(scans, flat, coloured), ([merged], flat, coloured), ([merged], "STUDIO", "SINGLE")]
    # Without colours the surface is its shape.
    for k, (objects, light, colour) in enumerate(panels if coloured == "VERTEX" else panels[:2]):
        draw(out / f"demo.panel{k}.png", objects, light, colour)
    clock.done("draw")

    figures = {
        "title": Path(given).resolve().stem,
        "frames": len(scans) + others,
        "objects": len(scans),
        "samples": sum(len(obj.data.vertices) for obj in scans),
        "report": report,
        "triangles": len(merged.data.polygons),
        "vertices": len(merged.data.vertices),
        "coloured": coloured == "VERTEX",
        "seen_in_colour": seen_in_colour(surface),
        "check": surface.check(),
        "panel": [width, height],
        "seconds": clock.seconds,
        "blender": bpy.app.version_string,
    }
    (out / "demo.json").write_text(json.dumps(figures, indent=1))
    # The bpy module's own way out is known to hang or crash.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    try:
        main()
    except BaseException as problem:
        import traceback

        # Refusals of the extension and of this program are said in a sentence.
        if isinstance(problem, SystemExit | RuntimeError):
            print(f"  {str(problem).strip()}", file=sys.stderr)
        else:
            traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
