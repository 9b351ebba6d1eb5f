"""The check for printing: it marks faces, shows faults in colours that go again, and says what to do."""

import bpy
import numpy as np
import pytest
import surfrecon
from mathutils import Matrix
from shapes import torus
from test_merge import add_mesh


def two_rings():
    """Two rings that cross each other."""
    ring = torus(16)
    both = np.vstack([ring.positions, ring.positions + [0.7, 0.1, 0.05]])
    return surfrecon.Mesh(both, np.vstack([ring.triangles, ring.triangles + len(ring.positions)]))


def marks(obj, name, dtype=bool):
    layer = obj.data.attributes[name]
    assert layer.domain == "FACE"
    values = np.empty(len(layer.data), dtype)
    layer.data.foreach_get("value", values)
    return values


def box(size=(2, 2, 2)):
    """A box of six quads."""
    mesh = bpy.data.meshes.new("box")
    corners = [(x * size[0], y * size[1], z * size[2]) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners, [], faces)
    obj = bpy.data.objects.new("box", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    return obj


def test_faces_are_marked_as_the_library_says():
    obj = add_mesh("rings", two_rings())
    assert bpy.ops.surfrecon.check_print(min_wall=0.1) == {"FINISHED"}
    assert bpy.context.object is obj and len(bpy.data.objects) == 1
    positions = np.array([vertex.co[:] for vertex in obj.data.vertices])
    expected = surfrecon.check_print(surfrecon.Mesh(positions, two_rings().triangles), min_wall=np.float32(0.1))
    known = expected.mesh.face_attributes
    assert np.array_equal(marks(obj, "crossing"), np.asarray(known["crossing"]).astype(bool))
    assert np.array_equal(marks(obj, "overhang"), np.asarray(known["overhang"]).astype(bool))
    assert np.allclose(marks(obj, "wall", np.float32), known["wall"])
    report = obj["surfrecon_check_print"].to_dict()
    assert report["crossing_pairs"] == expected.report.crossing_pairs > 0
    assert len(report["findings"].splitlines()) == len(expected.report.findings)


def test_faults_are_shown_and_hidden_without_a_trace(extension):
    obj = add_mesh("rings", two_rings())
    bpy.ops.surfrecon.check_print()
    faults = marks(obj, "print_fault", np.float32)
    assert np.array_equal(faults == 1, marks(obj, "crossing"))
    assert extension.false_colours.shows_faults(obj) and "error_colour" in obj.data.attributes
    # The colour of the faces that cross another is the last one of the scale.
    colours = np.empty(4 * len(obj.data.loops), np.float32)
    obj.data.attributes["error_colour"].data.foreach_get("color", colours)
    crossing = colours.reshape(-1, 3, 4)[marks(obj, "crossing")]
    linear = extension.false_colours.linear
    assert np.allclose(crossing[..., :3], [linear(x) for x in extension.false_colours.RAMP[-1][1]], atol=1e-5)
    assert bpy.ops.surfrecon.error_hide() == {"FINISHED"}
    assert {"wall", "crossing", "overhang"} <= set(obj.data.attributes.keys())
    assert not {"print_fault", "error_colour"} & set(obj.data.attributes.keys())
    assert not obj.material_slots


def test_an_error_map_takes_the_place_of_the_faults(extension):
    add_mesh("truth", torus(16))
    obj = add_mesh("rings", two_rings())
    bpy.ops.surfrecon.check_print()
    bpy.ops.surfrecon.error_map()
    assert not extension.false_colours.shows_faults(obj) and extension.false_colours.is_shown(obj)
    bpy.ops.surfrecon.check_print()
    assert extension.false_colours.shows_faults(obj)
    assert bpy.ops.surfrecon.error_hide() == {"FINISHED"}
    assert not {"print_fault", "error", "error_colour"} & set(obj.data.attributes.keys())


def test_faces_of_many_corners_have_one_value_each():
    obj = box(size=(2, 2, 0.5))
    assert bpy.ops.surfrecon.check_print(min_wall=0.6) == {"FINISHED"}
    walls = marks(obj, "wall", np.float32)
    assert len(walls) == 6 and walls.min() == pytest.approx(0.5)
    report = obj["surfrecon_check_print"].to_dict()
    assert report["volume"] == pytest.approx(2) and report["is_closed"]
    assert report["thinnest_face"] in np.flatnonzero(walls == walls.min())
    assert "Faces with walls thinner than 0.6" in report["findings"]


def test_it_is_checked_where_it_lies_in_the_world():
    obj = box()
    # Mirrored, and half as large.
    obj.matrix_world = Matrix.Translation((1, 2, 3)) @ Matrix.Diagonal((-0.5, 0.5, 0.5, 1))
    bpy.context.view_layer.update()
    assert bpy.ops.surfrecon.check_print(printer_width=0.9) == {"FINISHED"}
    report = obj["surfrecon_check_print"].to_dict()
    assert report["volume"] == pytest.approx(1) and list(report["size"]) == pytest.approx([1, 1, 1])
    assert not report["is_fitting"] and "too large for the printer's width of 0.9" in report["findings"]


def test_the_sidebar_says_what_to_do(extension):
    obj = add_mesh("open", surfrecon.Mesh(torus(16).positions, torus(16).triangles[1:]))
    assert bpy.ops.surfrecon.check_print(show_faults=False) == {"FINISHED"}
    assert not extension.false_colours.is_shown(obj)
    lines = list(extension.reports.LINES["surfrecon_check_print"](bpy.context, obj["surfrecon_check_print"]))
    assert ("Openings", "1") in lines
    assert "Openings of the mesh: 1. Close them." in [name for name, value in lines if value is None]


def test_a_mesh_without_faces_is_refused():
    add_mesh("points", surfrecon.Mesh(np.eye(3), np.zeros((0, 3), np.uint32)))
    with pytest.raises(RuntimeError, match="has no faces: choose the mesh that is to be printed"):
        bpy.ops.surfrecon.check_print()
