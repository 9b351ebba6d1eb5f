"""The demo's stage: what its picture shows is what its captions say."""

import importlib.util
from pathlib import Path

import bpy
import pytest
from files import write_set
from shapes import torus_scans
from test_merge import VOXEL


@pytest.fixture
def stage():
    spec = importlib.util.spec_from_file_location("stage", Path(__file__).parents[2] / "demo" / "stage.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_scans_are_tinted_the_surface_has_its_colours_and_the_error_its_map(stage, extension, tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60))))
    scans = list(bpy.context.selected_objects)
    for obj in scans:
        obj.data.materials.append(bpy.data.materials.new("as it was read"))
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    bpy.ops.surfrecon.error_map()
    stage.compose(merged, scans, 20)
    shows_error = extension.false_colours.shows_error
    assert all(shows_error(slot.material) for slot in bpy.data.objects["Error map"].material_slots)
    assert merged.material_slots and not any(shows_error(slot.material) for slot in merged.material_slots)
    # Scans: one material each, of a colour of their own.
    assert all([m.name for m in obj.data.materials] == [obj.name] for obj in scans)
    tints = {tuple(obj.data.materials[0].node_tree.nodes["Principled BSDF"].inputs[0].default_value) for obj in scans}
    assert len(tints) == len(scans)
