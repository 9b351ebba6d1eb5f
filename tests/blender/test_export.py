"""File > Export > Range Scans."""

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from shapes import torus_scans

FAR = np.array([4.5e6, 5.1e6, 300.0])


@pytest.fixture
def imported(tmp_path):
    """Three scans far from the origin, imported and selected."""
    images = []
    for image in torus_scans(pixels=40)[:3]:
        grid = surfrecon.RangeImage.from_points(image.points, viewing=("from", (0, 0, 5)), name=image.name)
        pose = np.array(image.world_from_sensor)
        pose[:3, 3] += FAR
        grid.world_from_sensor = pose
        grid.intensity = np.where(grid.valid, 0.25, 0)
        images.append(grid)
    surfrecon.write(tmp_path / "in.ptx", images)
    bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / "in.ptx"))
    return images


def export(path, **options):
    return bpy.ops.surfrecon.export_scans(filepath=str(path), **options)


@pytest.mark.parametrize("ending", ["conf", "ptx", "e57"])
def test_what_was_imported_goes_out_where_it_was(tmp_path, imported, ending):
    assert export(tmp_path / "out", file_format=ending.upper()) == {"FINISHED"}
    again = [scan.read() for scan in surfrecon.open(tmp_path / f"out.{ending}")]
    assert len(again) == len(imported)
    expected = np.sort([image.world_points()[image.valid].mean(axis=0) for image in imported], axis=0)
    found = np.sort([image.world_points()[image.valid].mean(axis=0) for image in again], axis=0)
    assert np.abs(found - expected).max() < 1e-5
    assert sorted(image.valid.sum() for image in again) == sorted(image.valid.sum() for image in imported)
    assert all(np.isclose(image.intensity[image.valid], 0.25).all() for image in again)


def test_a_scale_applies_to_samples_and_poses(tmp_path, imported):
    assert export(tmp_path / "out.ptx", file_format="PTX", scale=1000) == {"FINISHED"}
    again = surfrecon.open(tmp_path / "out.ptx")[0].read()
    assert np.abs(again.world_points()[again.valid].mean(axis=0) / 1000 - FAR).max() < 3


def test_what_can_not_be_exported_says_why(tmp_path, imported):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    with pytest.raises(RuntimeError, match="No range scan is selected"):
        export(tmp_path / "out.conf")
    images = write_set(tmp_path, torus_scans(pixels=40)[:1])
    bpy.ops.surfrecon.import_scans(filepath=str(images))
    with pytest.raises(RuntimeError, match="its rays are parallel"):
        export(tmp_path / "out.e57", file_format="E57")
    assert not (tmp_path / "out.e57").exists()


def test_a_scale_that_is_no_number(tmp_path, imported):
    with pytest.raises(RuntimeError, match="Scale is nan, which is no number"):
        bpy.ops.surfrecon.export_scans(filepath=str(tmp_path / "out.conf"), scale=float("nan"))
    assert not list(tmp_path.glob("out*"))


@pytest.mark.parametrize("origin", ["x", [1.0, 2.0], [float("nan"), 0.0, 0.0], {"x": 1.0}])
def test_an_origin_that_is_no_place_names_its_collection(tmp_path, imported, origin):
    collection = bpy.context.selected_objects[0].users_collection[0]
    collection["world_origin"] = origin
    with pytest.raises(RuntimeError, match=f'"{collection.name}" has a world_origin that is no place'):
        export(tmp_path / "out.ptx", file_format="PTX")
    assert not list(tmp_path.glob("out*"))


def test_the_coordinate_reference_system_stays(tmp_path, imported):
    images = surfrecon.open(tmp_path / "in.ptx", crs="EPSG:25832")
    surfrecon.write_scans(tmp_path / "in.e57", [scan.read() for scan in images])
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / "in.e57"), unit="SCENE", axis_forward="Y", axis_up="Z")
    collection = bpy.context.selected_objects[0].users_collection[0]
    assert collection["crs"] == "EPSG:25832"
    assert export(tmp_path / "out.e57", file_format="E57") == {"FINISHED"}
    assert surfrecon.open(tmp_path / "out.e57").crs == "EPSG:25832"
    # Of another size they lie in none.
    assert export(tmp_path / "scaled.e57", file_format="E57", scale=2) == {"FINISHED"}
    assert surfrecon.open(tmp_path / "scaled.e57").crs is None
    collection["crs"] = 3
    with pytest.raises(RuntimeError, match=f'"{collection.name}" has a crs that is no text'):
        export(tmp_path / "no.e57", file_format="E57")


def test_a_glb_has_the_selected_surface_alone_under_its_name_beside_the_scans(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=40))))
    scan = bpy.context.object
    bpy.ops.surfrecon.merge(measure=False)
    merged = bpy.context.object
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.select_set(False)
    merged.select_set(True)
    bpy.context.view_layer.objects.active = merged
    scan.hide_set(False)
    merged.name = "a/b merged"
    assert bpy.ops.surfrecon.export_glb() == {"FINISHED"}
    written = list(tmp_path.glob("*.glb"))
    assert [path.name for path in written] == ["a_b merged.glb"]
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(written[0]))
    (found,) = bpy.data.objects
    assert found.name == "a/b merged" and len(found.data.polygons) > 1000


def test_without_a_surface_there_is_no_glb():
    bpy.ops.object.camera_add()
    assert not bpy.ops.surfrecon.export_glb.poll()
    assert not bpy.ops.surfrecon.export_for_printing.poll()


@pytest.mark.parametrize("ending", ["3mf", "stl"])
def test_a_print_is_in_millimetres(tmp_path, ending, capfd):
    bpy.context.scene.unit_settings.scale_length = 0.5
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.02)
    ball = bpy.context.object
    ball.scale = (1, 1, -2)
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.select_set(False)
    ball.select_set(True)
    path = tmp_path / "ball.blend"
    assert bpy.ops.surfrecon.export_for_printing(filepath=str(path), file_format=ending.upper()) == {"FINISHED"}
    assert f"ball.{ending}: 20.0 × 20.0 × 40.0 mm" in capfd.readouterr().out
    found = surfrecon.read(path.with_suffix(f".{ending}"))
    # Both say their unit, so they are read in metres.
    assert np.allclose(1000 * np.ptp(found.positions, axis=0), [20, 20, 40], rtol=1e-3)
    assert found.check().is_closed
    corners = found.positions[found.triangles]
    assert np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() > 0


def test_a_print_has_colours_and_its_holes_are_told(tmp_path, capfd):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=40)[:2])))
    bpy.ops.surfrecon.merge(measure=False)
    merged = bpy.context.object
    layer = merged.data.attributes.new("colour", "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color_srgb", np.tile([1.0, 0.0, 0.0, 1.0], len(layer.data)))
    path = tmp_path / "torus.3mf"
    assert bpy.ops.surfrecon.export_for_printing(filepath=str(path)) == {"FINISHED"}
    assert "which slicers close in their own way" in capfd.readouterr().out
    assert (surfrecon.read(path).vertex_attributes["colour"] == [255, 0, 0, 255]).all()


def test_a_print_that_cannot_be_written_is_said(tmp_path):
    bpy.ops.mesh.primitive_cube_add()
    with pytest.raises(RuntimeError, match="no folder"):
        bpy.ops.surfrecon.export_for_printing(filepath=str(tmp_path / "no folder" / "a.3mf"))
