"""The ways of the README, from dropped files to a GLB, as a person goes them: each interaction is done and counted.

Real data are in SURFRECON_DATA. Without them the ways that need them are skipped, and the run ends with status 3.
"""

import json
import os
import shutil
import struct
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Matrix

sys.path.insert(0, str(Path(__file__).parent))

from driver import MODULE, PICTURES, adjust, check, drive, place, run, select, skip, until, view_selected  # noqa: E402 (the path is made above)
from person import Person, portrait  # noqa: E402

DATA = os.environ.get("SURFRECON_DATA")

# Files of the published bunny that are no scans.
MERGED = "bun_zipper"

# The field Smallest part, from where F9 opens its panel, in pixels.
SHARE = (208, -161)

# Interactions that each way may take.
BUNNY, HEAP, CHAIR = 8, 6, 10

# The photo of the chair beside which pictures from the same place are shown.
PHOTO = "frame_00030"

# The view of the bunny: turned from the scanner's, which looks along its z axis with y up, so many diagonals away, by a
# lens that distorts little.
TURNED, DISTANCE, LENS = (-0.3, 0.4, 0), 1.4, 100

# The extension of glTF that holds lights.
LIGHTS = "KHR_lights_punctual"

# Means of colours that are the same differ by no more, in a file that rounds them.
ROUNDED = 0.01


def fresh():
    """A new file, as Blender begins with, and the window as it is then."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield 1.0
    area = place()["area"]
    check(
        "the sidebar is closed, and the cube is there",
        not area.spaces.active.show_region_ui and "Cube" in bpy.data.objects,
    )


def installed():
    """The extension, from the zip."""
    bpy.ops.extensions.package_install_files(
        filepath=os.environ["SURFRECON_ZIP"], repo="user_default", enable_on_install=True
    )
    check("the extension is installed and enabled", MODULE in bpy.context.preferences.addons)
    yield 0.5


def contents(path):
    """The JSON of a GLB file."""
    data = path.read_bytes()
    magic, _, _, length, kind = struct.unpack("<4sIIII", data[:20])
    assert (magic, kind) == (b"glTF", 0x4E4F534A)
    return json.loads(data[20 : 20 + length])


def mean_colour(layer):
    """The mean of colours, linear."""
    colours = np.empty(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color", colours)
    return colours.reshape(-1, 4)[:, :3].mean(axis=0)


def merged(person):
    """Notes the colours of a new surface, before anything is done to them: `None` where the scans have none."""
    scans = [obj for obj in bpy.data.objects if "surfrecon_report" not in obj and obj.type == "MESH"]
    coloured = any("colour" in obj.data.attributes for obj in scans)
    layer = surface().data.color_attributes.get("colour")
    check(f"{person.name}: the surface has colours if scans have some: {coloured}", (layer is not None) == coloured)
    person.colour = None if layer is None else mean_colour(layer)


def exported(person, path, triangles):
    """Opens the GLB again: it has the surface that was exported and nothing else."""
    yield from until(path.exists, 60)
    check(f"{person.name}: {path.name} is written", path.exists())
    if not path.exists():
        return
    document = contents(path)
    nodes, meshes = document["nodes"], document["meshes"]
    primitives = [primitive for mesh in meshes for primitive in mesh["primitives"]]
    check(f"{person.name}: one node, of the name {path.stem}", [node["name"] for node in nodes] == [path.stem])
    check(f"{person.name}: one mesh of one part", len(meshes) == len(primitives) == 1)
    check(
        f"{person.name}: no camera, no light, no image",
        not any(document.get(name) for name in ("cameras", "images", "animations"))
        and LIGHTS not in (*document.get("extensionsUsed", ()), *document.get("extensions", ())),
    )
    wanted = {"POSITION", "NORMAL"} | ({"COLOR_0"} if person.colour is not None else set())
    found = set(primitives[0]["attributes"])
    check(f"{person.name}: the mesh has {', '.join(sorted(found))}", found == wanted)
    shutil.copy(path, PICTURES / f"{person.name}.glb")
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 0.5
    run(bpy.ops.import_scene.gltf, "EXEC_DEFAULT", filepath=str(path))
    yield 0.5
    # glTF has no quads, and its importer none either.
    (made,) = bpy.data.objects
    check(
        f"{person.name}: Blender finds {len(made.data.polygons):,} triangles in it, and nothing else",
        made.type == "MESH" and len(made.data.polygons) == triangles,
    )
    layers = list(made.data.color_attributes)
    check(f"{person.name}: and {len(layers)} layers of colours", len(layers) == (person.colour is not None))
    if layers and person.colour is not None:
        off = float(abs(mean_colour(layers[0]) - person.colour).max())
        check(f"{person.name}: which are those of the scans: their mean is {off:.4f} off", off < ROUNDED)
    view_selected()
    view = place()["area"].spaces.active
    view.shading.color_type, view.overlay.show_outline_selected = "VERTEX", False
    yield 1.0
    person.look("opened_again")
    return made


def surface():
    """The active object, of which a surface is expected."""
    return bpy.context.view_layer.objects.active


def to_glb(person, folder):
    """The last steps of each way."""
    triangles, name = len(surface().data.polygons), surface().name
    yield from person.click("surfrecon.export_glb")
    yield 2.0
    person.look("export")
    yield from person.press("RET", "click Export glTF 2.0")
    return (yield from exported(person, folder / f"{name}.glb", triangles))


def bunny(folder):
    """The scans of a turntable with their list: they lie where they belong."""
    scans(folder)
    shutil.copy(Path(DATA, "stanford_bunny", "bun.conf"), folder)
    yield from fresh()
    made = yield from turntable(Person("bunny"), folder / "bun.conf")
    check(f"bunny: it is {made.dimensions.z:.3f} m high and stands", 0.14 < made.dimensions.z < 0.17)


def made(folder):
    """The same with scans of a made-up shape, which need no data."""
    import surfrecon

    shape = surfrecon.sculpture(cell=4.0)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=200), noise=0.05)
    for k, image in enumerate(images):
        image.name = f"serpent{k:02}"
    surfrecon.write_scans(folder / "serpent.conf", images)
    yield from fresh()
    bpy.context.preferences.addons[MODULE].preferences.unit = "MM"
    result = yield from turntable(Person("made"), folder / "serpent.conf")
    bpy.context.preferences.addons[MODULE].preferences.unit = "M"
    longest, there = max(result.dimensions), 0.001 * (shape.positions.max(axis=0) - shape.positions.min(axis=0)).max()
    check(f"made: it is {longest:.4f} m long, as the shape", abs(longest - there) < 0.02 * there)


def turntable(person, path):
    """From the dropped list of a set of scans to the GLB; returns what is in that."""
    yield from person.drop([path])
    person.look("dropped")
    yield from person.press("RET", "click Import Range Scans")
    yield from person.wait()
    person.look("imported")
    yield from person.click("surfrecon.merge")
    yield from person.wait()
    merged(person)
    person.look("merged")
    yield from person.click("surfrecon.error_map")
    yield from person.wait()
    person.look("error")
    result = yield from to_glb(person, path.parent)
    person.counted(BUNNY)
    return result


def scans(folder):
    """Copies the ten scans of the bunny; returns their paths."""
    found = sorted(Path(DATA, "stanford_bunny").glob("*.ply"))
    return [Path(shutil.copy(path, folder)) for path in found if not path.name.startswith(MERGED)]


def heap(folder):
    """Ten scans that lie anywhere: they are brought together first."""
    folder = folder / "heap"
    folder.mkdir()
    person = Person("heap")
    yield from fresh()
    yield from person.drop(scans(folder))
    person.look("dropped")
    yield from person.press("R", "click Range Scans, in the menu of importers")
    person.look("dialog")
    yield from person.press("RET", "click Import Range Scans")
    yield from person.wait()
    person.look("imported")
    person.keep(folder, "heap")
    yield from person.click("surfrecon.align_merge")
    yield from person.wait()
    yield from person.wait()
    merged(person)
    person.look("merged")
    person.keep(folder, "aligned")
    result = yield from to_glb(person, folder)
    diagonal = result.dimensions.length
    check(f"heap: a bunny with a diagonal of {diagonal:.3f} m", 0.2 < diagonal < 0.3)
    person.counted(HEAP)
    for text, path in person.kept.items():
        bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
        yield 1.0
        there = shown_alone(lambda obj: "surfrecon_report" not in obj)
        check(f"heap: ten scans are in the picture of {text}", len(there) == 10)
        run(bpy.ops.surfrecon.tint_scans)
        yield 0.5
        yield from portrait(f"portrait_{text}", from_the_front(there, bpy.data.objects["bun000"]), LENS)


def shown_alone(is_meant):
    """Shows and selects the meshes of the file that are meant, and hides all else."""
    there = [obj for obj in bpy.data.objects if obj.type == "MESH" and obj.name != "Cube" and is_meant(obj)]
    for obj in bpy.data.objects:
        obj.hide_set(obj not in there)
    select(there)
    return there


def from_the_front(objects, standing):
    """A view of these objects in which the one that stood upright before its scanner does so."""
    found = []
    for obj in objects:
        places = np.empty(3 * len(obj.data.vertices))
        obj.data.vertices.foreach_get("co", places)
        matrix = np.array(obj.matrix_world)
        found.append(places.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3])
    low, high = np.concatenate(found).min(axis=0), np.concatenate(found).max(axis=0)
    away = Matrix.Translation((0, 0, DISTANCE * np.linalg.norm(high - low)))
    turned = standing.matrix_world.to_3x3().to_4x4() @ Euler(TURNED).to_matrix().to_4x4()
    return (Matrix.Translation(0.5 * (low + high)) @ turned @ away).inverted()


def chair(folder):
    """A phone's recording of a chair in a garden, of which the chair alone is meant."""
    there = folder / "chair"
    shutil.copytree(Path(DATA, "frames", "scannerapp_chair", "chair_scan"), there)
    shutil.copy(there / f"{PHOTO}.jpg", PICTURES / "chair_photo.jpg")
    person = Person("chair")
    yield from fresh()
    yield from person.drop([there / "info.json"])
    person.look("dropped")
    yield from person.press("RET", "click Import Range Scans")
    yield from person.wait()
    person.look("imported")
    check("chair: the cube that it stands in is out of sight", place()["area"].spaces.active.local_view is not None)
    camera = next(obj for obj in bpy.data.objects if obj.type == "CAMERA" and PHOTO in obj.name)
    from_photo = camera.matrix_world.inverted()
    person.keep(folder, "frames")
    yield from person.click("surfrecon.remove_background")
    yield from person.wait()
    person.look("without_background")
    yield from person.click("surfrecon.merge")
    yield from person.wait()
    person.look("merged")
    check("chair: some of the garden is left", surface().dimensions.length > 2.5)
    person.keep(folder, "merged")
    # The largest part alone: the fourth field of the panel of the last operation.
    yield from adjust("chair_5_adjust", "1", SHARE)
    for text in ("F9", "Enter over Smallest part", "type 1", "Enter"):
        person.did(text)
    # The panel goes away as soon as the mouse leaves it.
    yield from person.wait()
    merged(person)
    person.look("largest_part")
    result = yield from to_glb(person, there.parent)
    size = result.dimensions
    check(
        f"chair: it alone, {size.x:.2f} x {size.y:.2f} x {size.z:.2f} m, stands", 0.8 < size.z < 1.1 and max(size) < 2
    )
    check("chair: it has colours", person.colour is not None)
    person.counted(CHAIR)
    yield from portrait("portrait_finished", from_photo)
    for text, path in person.kept.items():
        bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
        yield 1.0
        # Frames without a photo would cover those that have one.
        meant = "surfrecon_report" if text == "merged" else "range_rows"
        shown_alone(lambda obj, meant=meant: meant in obj and "colour" in obj.data.attributes)
        yield from portrait(f"portrait_{text}", from_photo)


# Each way, and whether it is of real data.
WAYS = ((made, False), (bunny, True), (heap, True), (chair, True))


def steps():
    """All ways, or those that JOURNEYS names."""
    asked = os.environ.get("JOURNEYS", "").split()
    yield from installed()
    for way, is_real in WAYS:
        if asked and way.__name__ not in asked:
            continue
        if is_real and DATA is None:
            skip(f"the way {way.__name__}: SURFRECON_DATA is not set")
            continue
        with tempfile.TemporaryDirectory() as folder:
            yield from way(Path(folder))


if __name__ == "__main__":
    drive(steps())
