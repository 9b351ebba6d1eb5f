"""Every number of every operator at its ends and beyond: it works, or is refused in a sentence and changes nothing."""

import re

import bpy
import numpy as np
import pytest
from files import write_set
from shapes import torus, torus_scans
from test_cancelling import LONG, ON_SHAPE
from test_merge import add_mesh
from test_selections import state

# Values that are set besides, large enough that nothing takes long.
OTHERS = {
    "reproject": {"percent": 100},
    "virtual_scan": {"percent": 100},
    "merge": {"voxel": 0.05},
    "sculpt": {"relative_tolerance": 0.05},
    "quads": {"rows": 6, "columns": 6},
    "remesh": {"vertices": 100},
}
FLOATS = (float("nan"), float("inf"), -1e30, 1e30, 1e-30)
INTEGERS = (-(2**31), 0, 1, 2**31 - 1)


def numbers(name):
    """The operator's own numbers and switches."""
    for prop in getattr(bpy.ops.surfrecon, name).get_rna_type().properties:
        if prop.is_hidden or prop.type not in {"FLOAT", "INT", "BOOLEAN", "ENUM"} or getattr(prop, "is_array", False):
            continue
        if prop.type == "ENUM":
            yield from ((prop.identifier, item.identifier) for item in prop.enum_items)
        elif prop.type == "BOOLEAN":
            yield from ((prop.identifier, value) for value in (False, True))
        else:
            yield from ((prop.identifier, value) for value in (FLOATS if prop.type == "FLOAT" else INTEGERS))


def prepare(folder):
    bpy.ops.wm.read_homefile(use_empty=True)
    path = str(write_set(folder, torus_scans(pixels=30)[:2]))
    bpy.ops.surfrecon.import_scans(filepath=path)
    scan = bpy.context.object
    shape = add_mesh("torus", torus(16))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0, 0, 5)
    bpy.context.scene.collection.objects.link(camera)
    scene = bpy.context.scene
    scene.camera, scene.render.resolution_x, scene.render.resolution_y = camera, 40, 30
    bpy.context.view_layer.update()
    return path, scan, shape


def select(name, scan, shape):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    chosen = [shape] if name in ON_SHAPE else [scan]
    if name in {"align", "error_map", "measure"}:
        chosen = [shape, scan]
    for obj in chosen:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = chosen[0]


@pytest.mark.one_version
@pytest.mark.parametrize("name", LONG)
def test_any_number_works_or_is_refused(name, tmp_path, extension):
    path, scan, shape = prepare(tmp_path)
    for prop, value in numbers(name):
        options = OTHERS.get(name, {}) | {prop: value}
        if name == "import_scans":
            options["filepath"] = path
        if name == "merge_to_file":
            options["filepath"] = str(tmp_path / "merged.ply")
        select(name, scan, shape)
        before = state()
        try:
            assert getattr(bpy.ops.surfrecon, name)(**options) == {"FINISHED"}
        except RuntimeError as refused:
            # The core's own errors begin with what they are about.
            said = str(refused).removeprefix("Error: ").strip()
            assert re.fullmatch(rf'(["A-Z0-9]|{scan.name}: )[^\n]{{15,300}}', said), f"{prop}={value}: {said}"
            assert not re.search(r"[a-z]_[a-z]", said), f"a name of the code: {said}"
            assert state() == before, (prop, value)
            continue
        finally:
            assert extension.job.Running.job is None
        for mesh in bpy.data.meshes:
            assert np.isfinite([v.co[:] for v in mesh.vertices]).all(), (prop, value)
            assert not mesh.validate(), (prop, value)
        path, scan, shape = prepare(tmp_path)


def test_undo_and_redo_back_and_forth(tmp_path):
    """A storm of undo and redo over several operations ends where it should."""
    _, scan, shape = prepare(tmp_path)
    bpy.ops.ed.undo_push(message="start")
    counts = [len(bpy.data.objects)]
    for name in ("sculpt", "quads", "remesh", "error_map", "merge"):
        select(name, bpy.data.objects[scan.name], bpy.data.objects["torus"])
        assert getattr(bpy.ops.surfrecon, name)(**OTHERS.get(name, {})) == {"FINISHED"}
        bpy.ops.ed.undo_push(message=name)
        scan = next(obj for obj in bpy.data.objects if "range_rows" in obj)
        counts.append(len(bpy.data.objects))
    for _ in range(3):
        for count in reversed(counts[:-1]):
            bpy.ops.ed.undo()
            assert len(bpy.data.objects) == count
        for count in counts[1:]:
            bpy.ops.ed.redo()
            assert len(bpy.data.objects) == count
    assert all(not mesh.validate() for mesh in bpy.data.meshes)
