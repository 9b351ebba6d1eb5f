"""The gallery inside Blender: each operator on virtual scans, its input, its result, its triangles and its error.

Usage: python gallery.py ZIP OUT      with the Python of a Blender module
Writes OUT/<row>-<column>.png, all seen by the same camera in the same light, and OUT/gallery.json with the figures that
the sidebar shows.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

# Must be set before the first `import bpy`.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="surfrecon-gallery-")

import bpy
import numpy as np
from mathutils import Matrix, Vector

MODULE = "bl_ext.user_default.surfrecon"
SCANNER = {"noise": 0.05, "noise_grazing": 0.3, "dropout_grazing": 0.3, "seed": 2004}
PIXELS = 400
WIDTH, HEIGHT = 300, 400
CLAY, INK = (0.62, 0.56, 0.49, 1), (0.06, 0.07, 0.09, 1)
# Degrees around the vertical and above the horizon; metres that are seen.
AZIMUTH, ELEVATION = 20, 13


def turn():
    """The rotation of the camera."""
    return Matrix.Rotation(np.radians(AZIMUTH), 3, "Z") @ Matrix.Rotation(np.radians(90 - ELEVATION), 3, "X")


class Studio:
    """One camera, one light; shows some objects at a time."""

    def __init__(self, subject, out):
        self.scene, self.out = bpy.context.scene, out
        corners = np.array([subject.matrix_world @ Vector(c) for c in subject.bound_box])
        seen = corners @ np.array(turn())
        centre = turn() @ Vector((seen.min(axis=0) + seen.max(axis=0)) / 2)
        data = bpy.data.cameras.new("Gallery")
        # The scale is that of the longer side.
        data.type, data.ortho_scale = "ORTHO", 1.03 * max(np.ptp(seen[:, 1]), np.ptp(seen[:, 0]) * HEIGHT / WIDTH)
        camera = bpy.data.objects.new("Gallery", data)
        camera.matrix_world = Matrix.Translation(centre + turn() @ Vector((0, 0, 1))) @ turn().to_4x4()
        self.scene.collection.objects.link(camera)
        self.scene.camera = camera
        render, shading = self.scene.render, self.scene.display.shading
        render.engine = "BLENDER_WORKBENCH"
        render.resolution_x, render.resolution_y, render.film_transparent = WIDTH, HEIGHT, True
        self.scene.view_settings.view_transform = "Standard"
        self.scene.display.render_aa = "8"
        shading.light, shading.show_cavity, shading.cavity_type = "STUDIO", True, "WORLD"
        shading.show_shadows = False

    def picture(self, name, objects, colour="MATERIAL"):
        """Renders these objects only."""
        for obj in self.scene.objects:
            obj.hide_render = obj not in objects
        self.scene.display.shading.color_type = colour
        self.scene.render.filepath = str(self.out / f"{name}.png")
        bpy.ops.render.render(write_still=True)


def in_clay(obj):
    """A copy of an object in one colour."""
    copy = obj.copy()
    copy.data = obj.data.copy()
    copy.data.materials.clear()
    copy.modifiers.clear()
    copy.color = CLAY
    bpy.context.scene.collection.objects.link(copy)
    return copy


def wires(obj, thickness):
    """The edges of an object as thin beams."""
    copy = in_clay(obj)
    modifier = copy.modifiers.new("Wires", "WIREFRAME")
    modifier.thickness, modifier.use_replace, modifier.use_boundary = thickness, True, True
    modifier.offset = 0.5
    # An even offset would make spikes of needles.
    modifier.use_even_offset = False
    copy.color = INK
    return copy


def dots(points, radius, colours=None):
    """Points as small octahedra, which Workbench can draw."""
    shape = radius * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    corners = (np.array(faces)[None] + 6 * np.arange(len(points))[:, None, None]).reshape(-1)
    mesh = sys.modules[f"{MODULE}.convert"].new_mesh(
        "Dots", (points[:, None] + shape).astype(np.float32).reshape(-1), corners.astype(np.int32)
    )
    made = bpy.data.objects.new("Dots", mesh)
    made.color = INK
    bpy.context.scene.collection.objects.link(made)
    return made


def select_only(objects):
    """As the extension selects: these and no others, the first one active."""
    sys.modules[f"{MODULE}.scene"].select_only(bpy.context, objects)


def figures(obj):
    """The figures of a result in the sidebar: names to texts."""
    reports = sys.modules[f"{MODULE}.reports"]
    found = {}
    for name, lines in reports.LINES.items():
        if name in obj:
            found |= dict(lines(bpy.context, obj[name]))
    return found


def error_figures(obj, limit):
    """The legend and the figures of the error map."""
    length = sys.modules[f"{MODULE}.reports"].length
    found = {"limit": length(bpy.context, limit)}
    if "surfrecon_error" in obj:
        values = obj["surfrecon_error"].to_dict()
        found |= {"RMS": length(bpy.context, values["rms"]), "Largest": length(bpy.context, values["max"])}
    return found


def limit_of(obj):
    """Full scale of the error map that an object shows."""
    shows = sys.modules[f"{MODULE}.false_colours"].shows_error
    material = next(slot.material for slot in obj.material_slots if shows(slot.material))
    return material.node_tree.nodes["Error range"].inputs["From Max"].default_value


def main():
    """Runs every operator and takes its pictures."""
    archive, out = sys.argv[1], Path(sys.argv[2]).resolve()
    out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    if MODULE not in bpy.context.preferences.addons:
        sys.exit("Blender refused the extension")
    import surfrecon

    convert = sys.modules[f"{MODULE}.convert"]
    bpy.context.scene.unit_settings.length_unit = "ADAPTIVE"
    shape = surfrecon.sculpture()
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=PIXELS), **SCANNER)
    for k, image in enumerate(images):
        image.name = f"scan{k:02}"
    with tempfile.TemporaryDirectory() as folder:
        surfrecon.write_scans(f"{folder}/sculpture.conf", images)
        bpy.ops.surfrecon.import_scans(filepath=f"{folder}/sculpture.conf", unit="MM")
    scans = list(bpy.context.selected_objects)
    bpy.ops.surfrecon.tint_scans()
    samples = sum(len(obj.data.vertices) for obj in scans)
    told = {}

    select_only(scans)
    bpy.ops.surfrecon.merge(voxel=0.0012)
    merged = bpy.context.object
    studio = Studio(merged, out)
    studio.picture("merge-input", scans, "OBJECT")
    bpy.ops.surfrecon.error_map()
    show(studio, "merge", merged, 0.00008)
    told["merge"] = {
        "title": "Merge Scans",
        "input": {"Scans": str(len(scans)), "Samples": f"{samples:,}"},
        "result": figures(merged),
        "error": error_figures(merged, limit_of(merged)),
    }

    # The surface that the camera of the pictures sees, as a scanner with a little noise would.
    truth = bpy.data.objects.new("Sculpture", convert.mesh_from_result("Sculpture", shape, scale=0.001))
    bpy.context.scene.collection.objects.link(truth)
    select_only([truth])
    bpy.ops.surfrecon.virtual_scan(cameras="ACTIVE", percent=150, noise=0.00003)
    front = bpy.context.object
    source = in_clay(front)
    for name, title, run in (
        ("sculpt", "Sculpt Scan", lambda: bpy.ops.surfrecon.sculpt(relative_tolerance=0.002, show_error=True)),
        ("quads", "Quad Grid", lambda: bpy.ops.surfrecon.quads(rows=20, columns=20, show_error=True)),
    ):
        select_only([front])
        run()
        made = bpy.context.object
        studio.picture(f"{name}-input", [source], "OBJECT")
        show(studio, name, made, 0.00025)
        values = figures(made)
        told[name] = {
            "title": title,
            "input": {"Scans": "1", "Samples": f"{len(front.data.vertices):,}"},
            "result": values,
            "error": error_figures(made, limit_of(made))
            | {"RMS": values["RMS error"], "Largest": values["Largest error"]},
        }

    select_only([merged])
    bpy.ops.surfrecon.remesh(vertices=20_000)
    points = convert.positions(bpy.context.object.data)
    cloud = bpy.data.objects.new("Points", convert.new_mesh("Points", points.reshape(-1), np.empty(0, np.int32)))
    bpy.context.scene.collection.objects.link(cloud)
    select_only([cloud])
    bpy.ops.surfrecon.reconstruct(closure="open")
    through = bpy.context.object
    studio.picture("reconstruct-input", [dots(points, 0.00035)], "OBJECT")
    points_told = {"Points": f"{len(points):,}"}
    told["reconstruct"] = told_of(studio, "reconstruct", "Surface from Points", points_told, through, merged, 0.0002)

    select_only([merged])
    bpy.ops.surfrecon.remesh(vertices=5000)
    even = bpy.context.object
    studio.picture("cluster-input", [in_clay(merged)], "OBJECT")
    dense_told = {"Triangles": f"{len(merged.data.polygons):,}"}
    told["cluster"] = told_of(studio, "cluster", "Remesh", dense_told, even, merged, 0.0003)
    ramp = sys.modules[f"{MODULE}.false_colours"].RAMP
    (out / "gallery.json").write_text(json.dumps({"rows": told, "ramp": ramp, "size": (WIDTH, HEIGHT)}, indent=1))
    sys.stdout.flush()
    # The module's own way out hangs.
    os._exit(0)


def told_of(studio, name, title, source, made, dense, thickness):
    """Pictures and figures of a result whose error is that of the dense surface to it."""
    far = distances_from(made, dense)
    show(studio, name, made, thickness, far)
    return {"title": title, "input": source, "result": figures(made), "error": error_figures(far, limit_of(far))}


def distances_from(made, dense):
    """A copy of a dense surface that shows how far it is from what was made of it, whose own vertices lie on it."""
    copy = in_clay(dense)
    copy.name = "Distances"
    select_only([copy, made])
    bpy.ops.surfrecon.error_map()
    return copy


def show(studio, name, made, thickness, mapped=None):
    """The pictures of a result: itself, its edges, and its error or that of the surface it was made from."""
    plain = in_clay(made)
    studio.picture(f"{name}-result", [plain], "OBJECT")
    studio.picture(f"{name}-wires", [plain, wires(made, thickness)], "OBJECT")
    # The colours that the solid view shows.
    studio.picture(f"{name}-error", [mapped or made], "VERTEX")


if __name__ == "__main__":
    main()
