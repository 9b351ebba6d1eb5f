"""Needs of adjusting an operation: kept work, chains that are not made twice, previews; materials face by face; the
messages that the README for artists explains.
"""

import re
import time
from importlib import import_module

import bpy
import numpy as np
import pytest
import surfrecon
from conftest import ROOT
from files import write_set
from shapes import torus, torus_scans
from test_merge import add_mesh


@pytest.fixture
def scan(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60)[:1])))
    return bpy.context.object


def test_a_shorter_chain_is_the_beginning_of_the_longer_one(extension):
    dense = add_mesh("torus", torus())
    bpy.ops.surfrecon.remesh(vertices=400, levels=3)
    long = [[v.co[:] for v in level.mesh.vertices] for level in bpy.context.object.surfrecon_levels]
    kept = extension.kept.Kept.value["chain"]
    bpy.context.view_layer.objects.active = dense
    bpy.ops.surfrecon.remesh(vertices=400, levels=2)
    assert extension.kept.Kept.value["chain"] is kept
    short = [[v.co[:] for v in level.mesh.vertices] for level in bpy.context.object.surfrecon_levels]
    assert short == long[:2]
    # And it is what the library makes of the shorter list.
    extension.kept.Kept.forget()
    bpy.context.view_layer.objects.active = dense
    bpy.ops.surfrecon.remesh(vertices=400, levels=2)
    assert [[v.co[:] for v in level.mesh.vertices] for level in bpy.context.object.surfrecon_levels] == short


def test_kept_work_goes_with_another_operator_or_file(scan, extension):
    kept = extension.kept.Kept
    bpy.ops.surfrecon.sculpt(tolerance=0.004)
    assert kept.value is not None
    bpy.context.view_layer.objects.active = scan
    bpy.ops.surfrecon.quads(rows=8, columns=8)
    assert kept.value is None
    bpy.context.view_layer.objects.active = scan
    bpy.ops.surfrecon.sculpt(tolerance=0.004)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert kept.value is None


def test_each_face_has_the_material_of_the_nearest_one():
    dense = add_mesh("torus", torus())
    left, right = (bpy.data.materials.new(name) for name in ("left", "right"))
    for material in (left, right):
        dense.data.materials.append(material)
    for face in dense.data.polygons:
        face.material_index = int(face.center.x > 0)
    bpy.ops.surfrecon.remesh(vertices=500)
    made = bpy.context.object.data
    assert list(made.materials) == [left, right]
    wrong = [f for f in made.polygons if f.material_index != int(f.center.x > 0) and abs(f.center.x) > 0.05]
    assert not wrong and {f.material_index for f in made.polygons} == {0, 1}


def test_a_merge_measures_itself(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60))))
    bpy.ops.surfrecon.merge(voxel=0.05)
    merged = bpy.context.object
    errors = np.empty(len(merged.data.vertices), np.float32)
    merged.data.attributes["error"].data.foreach_get("value", errors)
    assert merged["surfrecon_report"]["max_error"] == pytest.approx(errors.max(), rel=1e-6)
    assert merged["surfrecon_report"]["rms_error"] == pytest.approx(np.sqrt(np.mean(errors**2)), rel=1e-4)
    # Its own measurement is that of the error map.
    bpy.ops.surfrecon.error_map()
    again = np.empty(len(errors), np.float32)
    merged.data.attributes["error"].data.foreach_get("value", again)
    assert np.allclose(again, errors, atol=1e-6)


def test_a_task_is_a_job(extension):
    jobs = extension.running

    def slow(note):
        for k in range(1000):
            note(k / 1000)
            time.sleep(0.002)

    running = jobs.Task("slow", slow)
    running.cancel()
    with pytest.raises(surfrecon.Cancelled):
        running.result()
    assert running.done() and running.progress()[1] < 1
    assert jobs.Task("quick", lambda note: 7).result() == 7
    with pytest.raises(jobs.Refused, match="why"):
        jobs.Task("wrong", fail).result()


def fail(note):
    note(0)
    raise import_module("bl_ext.user_default.surfrecon.running").Refused("why")


def test_a_coarse_surface_keeps_the_shape(extension):
    mesh = torus()
    positions, triangles = extension.preview.coarse(mesh.positions, mesh.triangles)
    assert 0 < len(triangles) <= len(mesh.triangles) and triangles.max() < len(positions)
    assert np.allclose(np.ptp(positions, axis=0), np.ptp(mesh.positions, axis=0), atol=0.1)


LONG = {"sculpt": {}, "quads": {"rows": 8, "columns": 8}, "remesh": {"vertices": 100}, "reconstruct": {}}


@pytest.mark.parametrize("name", LONG)
def test_every_long_operator_has_a_preview(scan, previewed, name):
    mesh, matrix = previewed(name, **LONG[name])
    assert len(mesh.triangles) > 0 and np.asarray(matrix).shape == (4, 4)


def test_the_readme_explains_messages_that_exist():
    text = (ROOT / "blender-addon" / "README.md").read_text()
    # Some are the library's.
    files = [*(ROOT / "blender-addon" / "extension").rglob("*.py"), *(ROOT / "rust-core" / "io" / "src").rglob("*.rs")]
    sources = " ".join(path.read_text("utf-8") for path in files)
    # Long messages are written in several pieces.
    joined = re.sub(r'"\s*\n\s*f?"|\'\s*\n\s*f?[\'"]', "", sources)
    rows = re.findall(r"^\| `(.+?)` \|", text, re.M)
    assert len(rows) > 10
    for row in rows:
        for piece in row.split("..."):
            if len(piece.strip()) > 8 and "memory" not in piece and "allowed" not in piece:
                assert piece.strip() in joined, piece
