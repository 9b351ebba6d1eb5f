"""The demo inside Blender: install the extension, import scans, merge them, map the error, render, save.

Usage: python in_blender.py ZIP OUT [CONF]      with the Python of a Blender module
Without CONF it scans a sculpture virtually, so that the true surface is known. Writes OUT/demo.blend, OUT/demo.glb,
OUT/demo.render.png and OUT/demo.json with the figures of the run.
"""

import json
import os
import sys
import tempfile
import time
from pathlib import Path

# Must be set before the first `import bpy`.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="surfrecon-demo-")

import bpy
import mathutils
import numpy as np

MODULE = "bl_ext.user_default.surfrecon"

# The virtual scanner, in mm: as a good structured-light scanner on a turntable, registered pairwise.
SCANNER = {
    "noise": 0.10,
    "noise_grazing": 0.3,
    "quantum": 0.01,
    "dropout": 0.002,
    "dropout_grazing": 0.3,
    "pose_shift": 0.05,
    "pose_turn": 0.0005,
    "seed": 2004,
}
PIXELS = 480
# Vertical field of view, radians.
HEIGHT_ANGLE = 0.4
RINGS = (
    {"around": 8, "above": 0, "below": 2},
    {"around": 0, "above": 5, "below": 0, "elevation": 0.6},
    {"around": 0, "above": 3, "below": 0, "elevation": 1.1},
)
# The place of the picture's camera, degrees around the vertical.
AZIMUTH = {"sculpture": 20, "other": 0}


class Clock:
    """Wall-clock seconds by step."""

    def __init__(self):
        self.seconds = {}
        self.last = time.monotonic()

    def done(self, step):
        """The step that began where the last one ended is done."""
        now = time.monotonic()
        self.seconds[step], self.last = now - self.last, now
        print(f"  {step}: {self.seconds[step]:.1f} s", flush=True)


def scan_sculpture(folder):
    """Scans the sculpture virtually into a file; returns it and the true surface, in mm."""
    import surfrecon

    truth = surfrecon.sculpture()
    lens = {"pixels": PIXELS, "height_angle": HEIGHT_ANGLE}
    cameras = [camera for ring in RINGS for camera in surfrecon.turntable(truth, **ring, **lens)]
    scans = surfrecon.virtual_scan(truth, cameras, **SCANNER)
    for k, scan in enumerate(scans):
        scan.name = f"scan{k:02}"
    folder.mkdir(parents=True, exist_ok=True)
    # It keeps from where each scan was seen, so that closing knows where nothing is.
    file = folder / "sculpture.e57"
    surfrecon.write_scans(file, scans)
    return file, truth


def sample_distance(objects):
    """Median distance of neighbouring samples: the median edge of the scans."""
    medians = []
    for obj in objects:
        mesh = obj.data
        ends = np.empty(2 * len(mesh.edges), np.int32)
        mesh.edges.foreach_get("vertices", ends)
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        a, b = points.reshape(-1, 3)[ends.reshape(-1, 2)].transpose(1, 0, 2)
        medians.append(np.median(np.linalg.norm(a - b, axis=1)))
    return float(np.median(medians))


def world_points(obj):
    """(n, 3) vertices in the world."""
    points = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.attributes["position"].data.foreach_get("vector", points)
    matrix = np.array(obj.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def summary(distances):
    """Figures of distances."""
    return {
        "mean": float(np.mean(distances)),
        "rms": float(np.sqrt(np.mean(distances**2))),
        "max": float(np.max(distances)),
    }


def show_camera_view():
    """Lets the saved file open with the picture's view and its materials."""
    for screen in bpy.data.screens:
        for area in screen.areas:
            if area.type == "VIEW_3D":
                area.spaces.active.shading.type = "MATERIAL"
                area.spaces.active.region_3d.view_perspective = "CAMERA"


def shuffle(scans):
    """Throws the scans about, aligns them, and brings all of them to where the first that stayed belongs."""
    context, generator = bpy.context, np.random.default_rng(1)
    truth = {obj.name: obj.matrix_world.copy() for obj in scans}
    size = max(max(obj.dimensions) for obj in scans)
    for obj in scans:
        turn = mathutils.Quaternion(generator.normal(size=4)).normalized().to_matrix().to_4x4()
        obj.matrix_world = mathutils.Matrix.Translation(generator.uniform(-2, 2, 3) * size) @ turn
    context.view_layer.update()
    thrown = {obj.name: obj.matrix_world.copy() for obj in scans}
    bpy.ops.surfrecon.align()
    context.view_layer.update()
    kept = next(obj for obj in scans if obj.matrix_world == thrown[obj.name])
    back = truth[kept.name] @ kept.matrix_world.inverted()
    for obj in scans:
        obj.matrix_world = back @ obj.matrix_world
    context.view_layer.update()
    off = max((obj.matrix_world.translation - truth[obj.name].translation).length for obj in scans)
    print(f"  {len(scans)} scans found their places again, at most {off / size:.1e} of their size off")


def main():
    """Runs the demo."""
    archive, out = sys.argv[1], Path(sys.argv[2]).resolve()
    given = Path(sys.argv[3]).resolve() if len(sys.argv) > 3 else None
    clock = Clock()
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    if MODULE not in bpy.context.preferences.addons:
        sys.exit("Blender refused the extension")
    clock.done("install the extension")

    import stage
    import surfrecon

    truth = None
    conf = given
    if given is None:
        conf, truth = scan_sculpture(out / "demo-scans")
        clock.done("scan the sculpture virtually")

    # The sculpture is in mm with z up; the scans of the Stanford archive are in m with y up.
    unit, up = ("MM", "Z") if given is None else (os.environ.get("UNIT", "M"), os.environ.get("UP", "Y"))
    options = {"unit": unit, "axis_up": up, "axis_forward": {"Y": "-Z"}.get(up, "Y")}
    bpy.ops.surfrecon.import_scans(filepath=str(conf), **options)
    scans = list(bpy.context.selected_objects)
    samples = sum(len(obj.data.vertices) for obj in scans)
    clock.done("import the scans")
    if os.environ.get("SHUFFLE"):
        shuffle(scans)
        clock.done("throw the poses away, align")

    # Its error is measured below, against the true surface. Nobody saw the foot, which stood on the turntable.
    closing = {} if truth is None else {"close": "all", "flat_base": True}
    bpy.ops.surfrecon.merge(voxel=sample_distance(scans), measure=False, **closing)
    merged = bpy.context.object
    report = merged["surfrecon_report"].to_dict()
    clock.done("merge")

    convert, select_only = sys.modules[f"{MODULE}.convert"], sys.modules[f"{MODULE}.scene"].select_only
    surface = surfrecon.Mesh(convert.positions(merged.data), convert.triangles(merged.data))
    check = surface.check()
    residual = surfrecon.distances(np.concatenate([world_points(obj) for obj in scans]), surface)
    references = scans
    if truth is not None:
        reference = bpy.data.objects.new("Truth", convert.mesh_from_result("Truth", truth))
        reference.scale = (0.001, 0.001, 0.001)
        bpy.context.scene.collection.objects.link(reference)
        references = [reference]
    select_only(bpy.context, [merged, *references])
    bpy.ops.surfrecon.error_map()
    error = merged["surfrecon_error"].to_dict()
    if truth is not None:
        bpy.data.batch_remove([reference.data, reference])
    clock.done("measure")

    azimuth = AZIMUTH["sculpture" if given is None else "other"]
    picture = stage.compose(merged, scans, azimuth)
    out.mkdir(exist_ok=True)
    select_only(bpy.context, [merged])
    bpy.ops.export_scene.gltf(
        filepath=str(out / "demo.glb"), export_format="GLB", use_selection=True, export_materials="NONE"
    )
    show_camera_view()
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(out / "demo.blend"), compress=True)
    clock.done("save")
    bpy.context.scene.render.filepath = str(out / "demo.render.png")
    print("  rendering the picture, without a graphics card: half a minute or more", flush=True)
    bpy.ops.render.render(write_still=True)
    clock.done("render")

    figures = {
        "title": conf.stem,
        "virtual": truth is not None,
        "scans": len(scans),
        "samples": samples,
        "report": report,
        "triangles": len(merged.data.polygons),
        "vertices": len(merged.data.vertices),
        "check": check,
        "residual": summary(residual),
        "error": error,
        "ramp": sys.modules[f"{MODULE}.false_colours"].RAMP,
        "seconds": clock.seconds,
        "picture": picture,
        "blender": bpy.app.version_string,
    }
    (out / "demo.json").write_text(json.dumps(figures, indent=1))
    # The bpy module's own way out is known to hang or crash.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    try:
        main()
    except BaseException:
        import traceback

        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
