"""Merges of the selected scans straight into a file."""

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from shapes import torus_scans

VOXEL = 0.06


@pytest.fixture(scope="module")
def images():
    return torus_scans(pixels=60, noise=0.001)


@pytest.fixture
def scans(tmp_path, images):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, images)))
    return [bpy.data.objects[image.name] for image in images]


def present():
    """Names of all objects, what is selected and what is active."""
    return bpy.data.objects.keys(), bpy.data.meshes.keys(), bpy.context.selected_objects, bpy.context.object


@pytest.mark.parametrize("encoding", ["binary", "binary_double"])
def test_the_file_is_the_one_of_the_library_and_the_scene_stays(scans, extension, tmp_path, encoding):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    images = [extension.scan_objects.scan_of_object(obj, depsgraph) for obj in scans]
    before, folder = present(), tmp_path / "results"
    folder.mkdir()
    options = {"voxel": VOXEL, "encoding": encoding.upper()}
    assert bpy.ops.surfrecon.merge_to_file(filepath=str(folder / "surface"), **options) == {"FINISHED"}
    assert present() == before
    assert [path.name for path in folder.iterdir()] == ["surface.ply"]
    # Options of operators are in single precision.
    expected = surfrecon.merge(images, voxel=float(np.float32(VOXEL))).mesh
    expected.write(folder / "expected.ply", encoding=encoding)
    assert (folder / "surface.ply").read_bytes() == (folder / "expected.ply").read_bytes()


def test_the_sidebar_s_options_are_used_unless_given(scans, tmp_path):
    bpy.context.scene.surfrecon.voxel = 2 * VOXEL
    bpy.ops.surfrecon.merge_to_file(filepath=str(tmp_path / "coarse.ply"))
    bpy.ops.surfrecon.merge_to_file(filepath=str(tmp_path / "fine.ply"), voxel=VOXEL)
    assert (tmp_path / "fine.ply").stat().st_size > 2 * (tmp_path / "coarse.ply").stat().st_size


def test_cancelled_or_refused_it_leaves_what_was_there(scans, extension, tmp_path, monkeypatch):
    folder = tmp_path / "results"
    folder.mkdir()
    path, before = folder / "surface.ply", present()
    path.write_text("old")
    running = extension.job.Running
    with monkeypatch.context() as patched:
        patched.setattr(running, "ended", lambda original=running.ended: (running.job.cancel(), original())[1])
        assert bpy.ops.surfrecon.merge_to_file(filepath=str(path), voxel=0.01) == {"CANCELLED"}
    with pytest.raises(RuntimeError, match="there is no folder"):
        bpy.ops.surfrecon.merge_to_file(filepath=str(folder / "none" / "surface.ply"), voxel=VOXEL)
    with pytest.raises(RuntimeError, match="No file is named for the surface: choose one, or give its path"):
        bpy.ops.surfrecon.merge_to_file(voxel=VOXEL)
    surfrecon.set_memory_limit(10_000_000)
    try:
        with pytest.raises(RuntimeError, match="12 MB for each of .* 10 MB are allowed"):
            bpy.ops.surfrecon.merge_to_file(filepath=str(path), voxel=VOXEL)
    finally:
        surfrecon.set_memory_limit(None)
    assert path.read_text() == "old" and len(list(folder.iterdir())) == 1
    assert present() == before


def test_the_menu_and_the_sidebar_have_it(extension):
    assert any("surfrecon.merge_to_file" in group for group in extension.menus.OBJECT)
    assert not bpy.ops.surfrecon.merge_to_file.poll()
