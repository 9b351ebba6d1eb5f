"""Advice that can be followed in Blender, for all that the library advises; clouds are aligned, meshes coloured."""

import re

import bpy
import numpy as np
import pytest
import surfrecon
from conftest import ROOT
from files import write_set
from mathutils import Matrix
from shapes import torus, torus_scans
from test_align import errors, images, throw  # noqa: F401 (a fixture)
from test_merge import add_mesh
from test_sources import only

# As the library says it; what is quoted are names.
SAID = (
    "no place was found where it fits another scan: it shares too little: give it a rough pose, or pairs of points",
    "no place was found where it fits another scan: it shares less than a third: give it pairs of points",
    'it fits "a" in 2 places, and no other scan decides: give it a rough pose, or a pair of points that both show',
    'it fits "a" in 2 places, and no other scan decides: give it a pair of points that both show',
    "which fit elsewhere as well: align the recording as a sequence, give it a rough pose, or scan more of the room",
    "which fit elsewhere as well: give it a rough pose, or scan more of what stands in the room",
    'it fits "a" but can slide along (1, 0, 0): give pairs of points that both show, or scan more around it',
    "it is bent: check the scanner's calibration, place it by pairs of points, or leave it out if it is something else",
    "no plane stands out. Crop the scans to where the plane is, or give it by three points, or change the tolerance",
    "no plane stands out. Crop the scans to where the plane is, or give it by three points, or lower the least share",
    "no plane is told from others: give the plane by three points",
)
# Advice that no window and no panel of Ground can follow.
IMPOSSIBLE = re.compile(r"pairs? of points|give (it|the plane)|rough pose|change the|lower the least|as a sequence")


@pytest.mark.parametrize("text", SAID)
def test_advice_can_be_followed_here(text, extension):
    assert IMPOSSIBLE.search(text) and not IMPOSSIBLE.search(extension.words.sentence(text))


def test_the_library_says_what_the_table_has(extension):
    sources = [*(ROOT / "rust-core/align/src").glob("*.rs"), ROOT / "rust-core/plane/src/driver.rs"]
    said = re.sub(r"\\\n\s*", "", " ".join(path.read_text() for path in sources))
    # Names of choices are in quotes there.
    said = said.replace('\\"', '"')
    for theirs, _ in extension.advice.TABLE:
        # The library puts these together of pieces.
        for piece in re.split(r", or |, (?=give)|(?:or )?give it |give (?=a pair of points that two)", theirs):
            assert piece in said, piece


def test_reasons_and_warnings_give_that_advice(extension, capfd):
    ball = add_mesh("ball", surfrecon.Mesh(torus().positions * 50, torus().triangles))
    statue = add_mesh("statue", surfrecon.sculpture(cell=4.0))
    bpy.ops.surfrecon.align()
    said = capfd.readouterr().out + ball["surfrecon_align"]["reasons"] + statue["surfrecon_align"]["reasons"]
    assert "is not placed" in said and not IMPOSSIBLE.search(said)


def test_ground_advises_the_ruler(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60)[:6])))
    with pytest.raises(RuntimeError, match="ruler bent over three") as refused:
        bpy.ops.surfrecon.ground(by="FOUND")
    assert not IMPOSSIBLE.search(str(refused.value))


@pytest.fixture
def clouds(images, extension):  # noqa: F811
    """The views around the sculpture as points alone, thrown about."""
    made = []
    for k, image in enumerate(images):
        valid = image.valid
        turned = np.asarray(Matrix.Rotation(0.7 * k, 3, (1, k, 2)))
        mesh = extension.convert.new_mesh(
            f"cloud{k}",
            (np.asarray(image.points)[valid] @ turned.T).astype(np.float32).reshape(-1),
            np.empty(0, np.int32),
        )
        obj = bpy.data.objects.new(mesh.name, mesh)
        bpy.context.collection.objects.link(obj)
        obj.select_set(True)
        obj["truth"] = [x for row in np.array(image.world_from_sensor) @ four(turned.T) for x in row]
        made.append(obj)
    bpy.context.view_layer.objects.active = made[0]
    throw(made)
    return made


def four(rotation):
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    return matrix


def test_clouds_are_aligned_by_the_surface_through_their_points(clouds, capfd):
    assert bpy.ops.surfrecon.align(show_misfit=True) == {"FINISHED"}
    said = capfd.readouterr().out
    assert f"{len(clouds)} clouds by the surface through the points" in said
    states = clouds[0]["surfrecon_align"]["states"].split("\n")
    placed = [obj for obj, state in zip(clouds, states, strict=True) if state in ("placed", "kept")]
    # Points don't say which side is outside, so that some may stay where they are.
    assert len(placed) >= 4 and errors(placed).max() < 5
    assert all(len(obj.data.polygons) == 0 for obj in clouds) and len(bpy.data.objects) == len(clouds)


@pytest.fixture
def with_normals(tmp_path):
    """Clouds from files of points with normals, thrown about."""
    mesh = surfrecon.sculpture(cell=2.0)
    seen = surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=6, above=0, below=0, pixels=140))
    made = []
    for k, image in enumerate(seen):
        surfrecon.write(tmp_path / f"cloud{k}.ply", image.to_cloud())
        bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / f"cloud{k}.ply"))
        made.append(bpy.context.object)
        made[-1]["truth"] = [x for row in np.array(image.world_from_sensor) for x in row]
    for obj in made:
        obj.select_set(True)
    throw(made)
    return made


def test_normals_of_points_are_kept(with_normals, tmp_path):
    read = surfrecon.read(tmp_path / "cloud0.ply")
    values = np.empty(3 * len(read.positions), np.float32)
    with_normals[0].data.attributes["normals"].data.foreach_get("vector", values)
    assert np.allclose(values.reshape(-1, 3), read.normals, atol=1e-6)


def test_clouds_with_normals_are_aligned_as_they_are(with_normals, capfd):
    # A name with a slash, as Blender allows it, and another one's pose.
    with_normals[1].name = "left/right"
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    said = capfd.readouterr().out
    assert "by the surface through the points" not in said
    assert "6 of 6 scans placed" in said
    assert errors(with_normals).max() < 3
    assert "left/right" in with_normals[0]["surfrecon_align"]["names"].split("\n")


def test_normals_that_points_were_turned_away_from_are_not_used(with_normals, capfd):
    turned = with_normals[2]
    turned.data.transform(Matrix.Rotation(1.2, 4, (1, 1, 0)))
    bpy.ops.surfrecon.align()
    assert "1 cloud by the surface through the points" in capfd.readouterr().out


def test_meshes_are_coloured_too():
    meshes = [add_mesh(name, torus()) for name in ("left", "right")]
    for obj in meshes:
        obj.select_set(True)
    assert bpy.ops.surfrecon.tint_scans() == {"FINISHED"}
    assert tuple(meshes[0].color) != tuple(meshes[1].color)
    # Nothing is selected, and nothing is known to be a scan.
    bpy.ops.object.select_all(action="DESELECT")
    assert not bpy.ops.surfrecon.tint_scans.poll()


def test_imported_meshes_are_coloured_without_being_selected(tmp_path):
    surfrecon.Mesh(torus().positions, torus().triangles).write(tmp_path / "torus.stl")
    for _ in range(2):
        bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / "torus.stl"))
    scans = list(bpy.data.objects)
    bpy.ops.object.select_all(action="DESELECT")
    for obj in scans:
        obj.color = (1, 1, 1, 1)
    only(add_mesh("other", torus()))
    bpy.data.objects["other"].select_set(False)
    assert bpy.ops.surfrecon.tint_scans() == {"FINISHED"}
    assert len({tuple(obj.color) for obj in scans}) == 2
