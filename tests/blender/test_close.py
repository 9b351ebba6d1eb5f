"""The operator that closes surfaces: it keeps what was measured, marks the fill, and heeds the scans behind it."""

import bpy
import numpy as np
import pytest
import surfrecon
from mathutils import Matrix
from shapes import torus
from test_merge import add_mesh, surface


@pytest.fixture(scope="module")
def images():
    shape = surfrecon.sculpture(cell=6)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=100, height_angle=0.6))
    for number, image in enumerate(images):
        image.name = f"scan{number}"
    return images


@pytest.fixture
def merged(tmp_path, images):
    """A merge of imported scans, with its openings, as the active object."""
    # Range-grid PLY does not say from where a scan was seen.
    surfrecon.write_scans(tmp_path / "set.e57", images)
    bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / "set.e57"))
    assert bpy.ops.surfrecon.merge(close="none") == {"FINISHED"}
    assert surface(bpy.context.object).check()["boundary_loops"] > 0
    return bpy.context.object


def coordinates(obj):
    return np.array([vertex.co[:] for vertex in obj.data.vertices])


def marks(obj, name):
    return np.array([one.value for one in obj.data.attributes[name].data], bool)


def test_the_fill_is_marked_and_what_was_measured_stays(merged):
    assert bpy.ops.surfrecon.close_surface(flat_base=True) == {"FINISHED"}
    made = bpy.context.object
    assert made is not merged and made.name.endswith(" closed") and bpy.context.selected_objects == [made]
    before, after = coordinates(merged), coordinates(made)
    assert np.array_equal(after[: len(before)], before) and len(after) > len(before)
    assert marks(made, "interpolated")[len(before) :].all()
    faces = len(merged.data.polygons)
    assert not marks(made, "hole_fill")[:faces].any() and marks(made, "hole_fill")[faces:].all()
    group = made.vertex_groups["Filled"].index
    grouped = {vertex.index for vertex in made.data.vertices if any(one.group == group for one in vertex.groups)}
    assert grouped == {v for face in made.data.polygons[faces:] for v in face.vertices}
    report = made["surfrecon_close"].to_dict()
    assert report["has_sight"] and report["closed"] > 0
    assert report["is_closed"] == surface(made).check()["is_closed"]
    assert len(report["open"].splitlines()) == sum(report["left"])


def test_scans_that_are_selected_count_instead_of_its_sources(merged):
    sources = [source.object for source in merged.surfrecon_sources]
    sources[0].hide_set(False)
    sources[0].select_set(True)
    assert bpy.ops.surfrecon.close_surface() == {"FINISHED"}
    assert [source.object for source in bpy.context.object.surfrecon_sources] == sources[:1]


def test_a_moved_and_mirrored_surface_stays_in_its_place(merged):
    scans = [source.object for source in merged.surfrecon_sources]
    for obj in [merged, *scans]:
        obj.matrix_world = Matrix.Translation((1, 2, 3)) @ Matrix.Scale(-1, 4, (1, 0, 0)) @ obj.matrix_world
    bpy.context.view_layer.update()
    assert bpy.ops.surfrecon.close_surface() == {"FINISHED"}
    made = bpy.context.object
    bpy.context.view_layer.update()
    assert np.allclose(made.matrix_world, merged.matrix_world, atol=1e-6)
    check = surface(made).check()
    assert check["is_manifold"] and check["boundary_loops"] < surface(merged).check()["boundary_loops"]


def test_doubts_are_in_the_sidebar_too(extension):
    whole = torus(24)
    add_mesh("torus", surfrecon.Mesh(whole.positions, whole.triangles[1:, ::-1]))
    assert bpy.ops.surfrecon.close_surface() == {"FINISHED"}
    figures = bpy.context.object["surfrecon_close"]
    assert figures["warnings"].startswith("the surface looks toward its own middle: flip its faces")
    lines = extension.reports.LINES["surfrecon_close"](bpy.context, figures)
    assert "looks toward its own middle" in " ".join(name for name, value in lines if value is None)


def test_without_scans_the_shape_alone_decides():
    whole = torus(24)
    open_one = add_mesh("torus", surfrecon.Mesh(whole.positions, whole.triangles[1:]))
    assert bpy.ops.surfrecon.close_surface() == {"FINISHED"}
    made = bpy.context.object
    assert surface(made).check()["is_closed"] and not made["surfrecon_close"]["has_sight"]
    assert [source.object for source in made.surfrecon_sources] == [open_one]


def test_the_sidebar_says_what_stays_open(merged, extension):
    assert bpy.ops.surfrecon.close_surface(openings="none") == {"FINISHED"}
    made = bpy.context.object
    assert len(made.data.polygons) == len(merged.data.polygons)
    lines = list(extension.reports.LINES["surfrecon_close"](bpy.context, made["surfrecon_close"]))
    assert ("Openings closed", "0") in lines
    said = [name for name, value in lines if value is None]
    assert said and all("openings are none: choose all, seen or holes" in text for text in said)


def test_a_scan_is_no_surface(merged):
    scan = merged.surfrecon_sources[0].object
    scan.hide_set(False)
    bpy.ops.object.select_all(action="DESELECT")
    scan.select_set(True)
    bpy.context.view_layer.objects.active = scan
    with pytest.raises(RuntimeError, match="is a scan: merge the scans first, and close their surface"):
        bpy.ops.surfrecon.close_surface()
