"""Files that the extension of a released version saved: they open, and what is in them can be worked with.

`released/VERSION.blend` is written by this file with SURFRECON_GENERATE=1, in the oldest Blender; once its version is
out it stays as it is.
"""

import gzip
import os
import re
from pathlib import Path

import bpy
import numpy as np
import pytest
import surfrecon
from conftest import ROOT
from files import write_set
from shapes import torus_distance, torus_scans

FOLDER = Path(__file__).parent / "released"
VOXEL = 0.1


def images():
    """Images of the scanned object, the same for all versions."""
    return torus_scans(pixels=45)


@pytest.mark.skipif("SURFRECON_GENERATE" not in os.environ, reason="only at a release")
def test_writing_the_file_of_this_version(tmp_path):
    assert bpy.app.version[:2] == (4, 2), "newer versions of Blender read files of older ones"
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, images())))
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    bpy.ops.surfrecon.error_map()
    bpy.ops.surfrecon.remesh(vertices=100, levels=2)
    bpy.context.object.name = "Levels"
    saved = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(saved), copy=True, relative_remap=False)
    content = saved.read_bytes()
    # The folder in which it was made is nobody's business.
    for folder in (tmp_path, Path.home()):
        content = re.sub(re.escape(bytes(folder)) + rb"[^\0]*", lambda found: bytes(len(found[0])), content)
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{surfrecon.__version__}.blend").write_bytes(gzip.compress(content, 9, mtime=0))


def test_each_released_version_has_a_file():
    versions = re.findall(r"^## \[?(\d+\.\d+\.\d+)(?!.*unreleased)", (ROOT / "CHANGELOG.md").read_text(), re.M)
    assert not {f"{version}.blend" for version in versions} - {path.name for path in FOLDER.iterdir()}


@pytest.fixture(params=sorted(FOLDER.glob("*.blend")), ids=lambda path: path.stem)
def opened(request):
    """One of the files."""
    bpy.ops.wm.open_mainfile(filepath=str(request.param))
    return bpy.data.objects


def test_its_scans_are_range_images(opened, extension):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for expected in images():
        found = extension.scan_objects.scan_of_object(opened[expected.name], depsgraph)
        assert isinstance(found, surfrecon.RangeImage)
        assert np.array_equal(found.valid, expected.valid)
        valid = expected.valid
        # In single precision, of numbers around 3.
        assert np.abs(np.asarray(found.points)[valid] - np.asarray(expected.points)[valid]).max() < 1e-6
        assert np.abs(np.asarray(found.world_from_sensor) - np.asarray(expected.world_from_sensor)).max() < 1e-6


def test_its_scans_can_be_merged(opened):
    for expected in images():
        opened[expected.name].hide_set(False)
        opened[expected.name].select_set(True)
    opened["Merged"].select_set(False)
    opened["Levels"].select_set(False)
    assert bpy.ops.surfrecon.merge(voxel=VOXEL) == {"FINISHED"}
    made = bpy.context.object
    assert made is not opened["Merged"]
    # How many it has is that version's affair.
    assert len(made.data.polygons) > 1000
    assert np.abs(torus_distance(np.array([vertex.co[:] for vertex in made.data.vertices]))).max() < VOXEL


def test_its_results_know_their_sources_and_levels(opened):
    merged = opened["Merged"]
    assert merged["surfrecon_report"].to_dict()["scans"] == len(images())
    assert "error" in merged.data.attributes
    # Names became pointers.
    assert [source.object for source in merged.surfrecon_sources] == [opened[image.name] for image in images()]
    opened[images()[0].name].name = "renamed"
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    merged.hide_set(False)
    merged.select_set(True)
    bpy.context.view_layer.objects.active = merged
    assert bpy.ops.surfrecon.measure() == {"FINISHED"}
    assert bpy.ops.surfrecon.error_hide() == {"FINISHED"}
    assert "error_colour" not in merged.data.attributes and "error" in merged.data.attributes
    levels = opened["Levels"]
    levels.surfrecon_level = 1
    assert len(levels.data.vertices) == 25


def test_its_reports_are_shown(opened, extension):
    for name, labels in {
        "Merged": {"Scans", "Voxel", "Triangles", "RMS error", "Time"},
        "Levels": {"Vertices", "Triangles", "Mean smallest angle", "Smallest angle"},
    }.items():
        obj = opened[name]
        for key in extension.reports.LINES.keys() & set(obj.keys()):
            lines = dict(extension.reports.LINES[key](bpy.context, obj[key]))
            assert labels <= set(lines), (name, lines)
