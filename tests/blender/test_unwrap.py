"""Unwrapping: a UV map at the corners of the active mesh, the same as the library's."""

import bpy
import numpy as np
import pytest
import surfrecon
from mathutils import Matrix
from shapes import torus
from test_check_print import box
from test_merge import add_mesh

OPTIONS = dict(size=512, padding=2)


def corners(obj, name="UVMap"):
    """(faces, 3, 2) float32: the UV map."""
    layer = obj.data.uv_layers[name]
    flat = np.empty(2 * len(obj.data.loops), np.float32)
    layer.data.foreach_get("uv", flat)
    return flat.reshape(-1, 3, 2)


def in_world(obj):
    """Vertices in the world, and faces."""
    mesh, matrix = obj.data, np.array(obj.matrix_world)
    positions = np.array([vertex.co[:] for vertex in mesh.vertices]) @ matrix[:3, :3].T + matrix[:3, 3]
    return positions, np.array([polygon.vertices[:] for polygon in mesh.polygons])


def doubled(uv):
    """Twice the areas of triangles."""
    a, b, c = np.moveaxis(uv.astype(np.float64), 1, 0)
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def test_the_map_is_that_of_the_library():
    ring = add_mesh("ring", torus(16))
    before = in_world(ring)
    assert bpy.ops.surfrecon.unwrap(tiles=2, **OPTIONS) == {"FINISHED"}
    assert bpy.context.object is ring and len(bpy.data.objects) == 1
    assert all(np.array_equal(*pair) for pair in zip(in_world(ring), before, strict=True))
    expected = surfrecon.unwrap(surfrecon.Mesh(*before), tiles=2, **OPTIONS)
    assert np.array_equal(corners(ring), expected.uv[expected.mesh.triangles])
    assert (doubled(corners(ring)) > 0).all()
    report = ring["surfrecon_unwrap"].to_dict()
    assert report["charts"] == expected.report.charts and report["tiles"] == expected.report.tiles == 2
    assert list(ring.data.attributes.keys()).count("UVMap") == 1 and "chart" not in ring.data.attributes


def test_the_active_map_is_replaced():
    ring = add_mesh("ring", torus(16))
    for name in "first", "second":
        ring.data.uv_layers.new(name=name)
    ring.data.uv_layers.active = ring.data.uv_layers["second"]
    first = corners(ring, "first")
    bpy.ops.surfrecon.unwrap(**OPTIONS)
    assert [layer.name for layer in ring.data.uv_layers] == ["first", "second"]
    assert np.array_equal(corners(ring, "first"), first) and (doubled(corners(ring, "second")) > 0).all()


def test_texels_are_counted_in_the_world_and_images_are_not_mirrored():
    ring = add_mesh("ring", torus(16))
    bpy.ops.surfrecon.unwrap(**OPTIONS)
    before = ring["surfrecon_unwrap"].to_dict()["texels_per_unit"]
    ring.matrix_world = Matrix.Diagonal((-2, 2, 2, 1))
    bpy.context.view_layer.update()
    bpy.ops.surfrecon.unwrap(**OPTIONS)
    assert ring["surfrecon_unwrap"].to_dict()["texels_per_unit"] == pytest.approx(before / 2, rel=0.05)
    assert (doubled(corners(ring)) < 0).all()
    bpy.ops.surfrecon.unwrap(tiles=3, texels_per_unit=0.7 * before, **OPTIONS)
    assert ring["surfrecon_unwrap"].to_dict()["texels_per_unit"] == pytest.approx(0.7 * before, rel=0.01)


def test_faces_that_are_no_triangles_are_refused_with_the_remedy():
    obj = box()
    with pytest.raises(RuntimeError, match="Triangulate Faces"):
        bpy.ops.surfrecon.unwrap()
    assert not obj.data.uv_layers


def test_files_keep_the_map(tmp_path):
    unwrapped = surfrecon.unwrap(torus(16), **OPTIONS)
    expected = unwrapped.uv[unwrapped.mesh.triangles]
    for ending in "ply", "obj", "glb":
        path = tmp_path / f"ring.{ending}"
        unwrapped.mesh.write(path)
        bpy.ops.surfrecon.import_scans(filepath=str(path))
        assert np.array_equal(corners(bpy.context.object), expected), ending
        assert "s" not in bpy.context.object.data.attributes
        readers = {"ply": bpy.ops.wm.ply_import, "obj": bpy.ops.wm.obj_import, "glb": bpy.ops.import_scene.gltf}
        readers[ending](filepath=str(path))
        read = bpy.context.selected_objects[0]
        assert np.allclose(corners(read, read.data.uv_layers[0].name), expected, atol=1e-7), ending


def test_the_operator_says_why_it_is_off():
    bpy.context.view_layer.objects.active = None
    assert not bpy.ops.surfrecon.unwrap.poll()
