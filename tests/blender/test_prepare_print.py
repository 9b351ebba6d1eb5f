"""Preparing a print: objects that a printer makes, where the mesh was, and the same as the library's."""

import bpy
import numpy as np
import pytest
import surfrecon
from mathutils import Matrix
from shapes import torus
from test_merge import add_mesh


def in_world(obj):
    """A mesh object as the library's mesh, in the world."""
    mesh, matrix = obj.data, np.array(obj.matrix_world)
    positions = np.array([vertex.co[:] for vertex in mesh.vertices]) @ matrix[:3, :3].T + matrix[:3, 3]
    return surfrecon.Mesh(positions, np.array([polygon.vertices[:] for polygon in mesh.polygons]))


def printable(obj):
    report = surfrecon.check_print(in_world(obj)).report
    return report.is_closed and report.crossing_pairs == 0


def test_it_is_scaled_and_stands_flat():
    ring = add_mesh("ring", torus(16))
    assert bpy.ops.surfrecon.prepare_print(scale_to=0.1, flat_base=True) == {"FINISHED"}
    made = bpy.context.object
    assert made is not ring and made.name == "ring for printing"
    assert max(made.dimensions) == pytest.approx(0.1, rel=1e-5) and printable(made)
    report = made["surfrecon_prepare_print"].to_dict()
    assert report["base_faces"] > 0 and report["parts"] == 1 and report["notes"] == ""
    assert "added" in made.data.attributes


def test_parts_are_objects_of_their_own():
    ring = add_mesh("ring", torus(16))
    ring.matrix_world = Matrix.Translation((3, 0, 0)) @ Matrix.Scale(2, 4)
    bpy.context.view_layer.update()
    width, whole = ring.dimensions[0], in_world(ring).positions
    assert bpy.ops.surfrecon.prepare_print(printer_width=0.6 * width) == {"FINISHED"}
    parts = bpy.context.selected_objects
    assert sorted(part.name for part in parts) == ["ring for printing 1", "ring for printing 2"]
    assert all(printable(part) and part.dimensions[0] <= 0.6 * width for part in parts)
    corners = np.vstack([in_world(part).positions for part in parts])
    assert np.allclose([corners.min(axis=0), corners.max(axis=0)], [whole.min(axis=0), whole.max(axis=0)], atol=1e-4)


def test_an_open_mesh_is_refused_with_the_remedy():
    ring = torus(16)
    add_mesh("ring", surfrecon.Mesh(ring.positions, ring.triangles[1:]))
    with pytest.raises(RuntimeError, match="close it first"):
        bpy.ops.surfrecon.prepare_print(flat_base=True)
    assert len(bpy.data.objects) == 1


def test_the_operator_says_why_it_is_off():
    bpy.context.view_layer.objects.active = None
    assert not bpy.ops.surfrecon.prepare_print.poll()
