"""Blender's own importers read what the library writes."""

import bpy
import numpy as np
import pytest
import surfrecon
from shapes import torus

IMPORT = {
    "ply": lambda path: bpy.ops.wm.ply_import(filepath=path, forward_axis="Y", up_axis="Z", import_colors="SRGB"),
    "obj": lambda path: bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z"),
    "stl": lambda path: bpy.ops.wm.stl_import(filepath=path, forward_axis="Y", up_axis="Z"),
    "glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
}


WRITTEN = [
    ("ply", {"encoding": "binary"}),
    ("ply", {"encoding": "ascii"}),
    ("obj", {}),
    ("stl", {}),
    ("glb", {"up": "z"}),
]


@pytest.mark.parametrize(("ending", "options"), WRITTEN)
def test_blender_reads_our_meshes(tmp_path, ending, options):
    shape = torus()
    colour = np.zeros((len(shape.positions), 4), np.uint8)
    colour[:] = (200, 100, 50, 255)
    mesh = surfrecon.Mesh(shape.positions, shape.triangles, colour=colour)
    path = str(tmp_path / f"torus.{ending}")
    mesh.write(path, **options)
    assert IMPORT[ending](path) == {"FINISHED"}
    (obj,) = [obj for obj in bpy.data.objects if obj.type == "MESH"]
    found = obj.data
    assert len(found.polygons) == len(mesh.triangles) and not found.validate()
    assert np.isclose(sum(polygon.area for polygon in found.polygons), area(mesh), rtol=1e-5)
    corners = np.array([obj.matrix_world @ vertex.co for vertex in found.vertices])
    expected = [mesh.positions.min(axis=0), mesh.positions.max(axis=0)]
    assert np.allclose([corners.min(axis=0), corners.max(axis=0)], expected, atol=1e-5)
    if ending != "stl":
        (layer,) = found.color_attributes
        first = layer.data[0].color_srgb
        assert np.allclose(first[:3], np.array([200, 100, 50]) / 255, atol=0.01)


def area(mesh):
    """Of all triangles."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
