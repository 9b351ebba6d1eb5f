"""Surveys far from the origin: places to the millimetre, and the coordinate reference system, from files to results."""

import json
import struct

import numpy as np
import pytest
import surfrecon
from command_line import run

UTM = 'PROJCS["ETRS89 / UTM zone 32N",GEOGCS["ETRS89"],UNIT["metre",1],AUTHORITY["EPSG","25832"]]'
CORNER = np.array([500_000.0, 5_000_000.0, 300.0])


def las(path, points, *, text=None, keys=None):
    """A LAS 1.4 of points in millimetres, which names a system by well-known text or keys of GeoTIFF."""
    records = b""
    for number, content in (2112, text and text.encode()), (34735, keys and struct.pack(f"<{len(keys)}H", *keys)):
        if content:
            records += struct.pack("<2x16sHH32x", b"LASF_Projection", number, len(content)) + content
    head = bytearray(375)
    head[0:4], head[24:26] = b"LASF", b"\1\4"
    struct.pack_into("<HII", head, 94, 375, 375 + len(records), int(bool(text)) + int(bool(keys)))
    struct.pack_into("<H", head, 105, 20)
    struct.pack_into("<6d", head, 131, 1e-3, 1e-3, 1e-3, *CORNER)
    struct.pack_into("<Q", head, 247, len(points))
    millimetres = np.round((points - CORNER) * 1000).astype(int)
    path.write_bytes(bytes(head) + records + b"".join(struct.pack("<iii8x", *point) for point in millimetres))
    return path


@pytest.fixture(scope="module")
def ground():
    """Points of a hilly ground of 20 m, with detail of millimetres."""
    x, y = np.mgrid[0:20:0.5, 0:20:0.5]
    z = np.sin(x / 3) * np.cos(y / 4)
    return CORNER + np.stack([x, y, z], axis=-1).reshape(-1, 3).round(3)


def image(name, shift, crs):
    """A scan of a bumpy wall from a point in UTM."""
    row, col = np.mgrid[-20:20, -20:20] / 20.0
    found = surfrecon.RangeImage.from_points(
        np.stack([col, row, 3 + 0.1 * np.cos(3 * col)], axis=-1), viewing=("from", (0, 0, 0)), name=name
    )
    pose = np.eye(4)
    pose[:3, 3] = CORNER + [shift, 0, 0]
    found.world_from_sensor, found.crs = pose, crs
    return found


def test_from_las_through_a_surface_to_a_file(tmp_path, ground):
    cloud = surfrecon.read(las(tmp_path / "ground.las", ground, text=UTM))
    assert cloud.crs == UTM and np.abs(cloud.positions - ground).max() < 1e-6
    mesh = surfrecon.reconstruct(cloud).mesh
    assert mesh.crs == UTM
    coarse = surfrecon.cluster(mesh, vertices=300).mesh
    assert coarse.crs == UTM
    for ending in "ply", "glb", "obj":
        coarse.write(tmp_path / f"coarse.{ending}")
        again = surfrecon.read(tmp_path / f"coarse.{ending}")
        assert again.crs == UTM and np.abs(again.positions - coarse.positions).max() < 1e-5
    # Transformed it is in none, unless who did it knows better.
    away = mesh.transformed(surfrecon.Similarity(np.diag([2.0, 2.0, 2.0, 1.0])))
    assert away.crs is None and away.with_crs("EPSG:2").crs == "EPSG:2" and mesh.with_crs(None).crs is None
    assert mesh.transformed(surfrecon.Similarity(np.eye(4))).crs == UTM
    with pytest.raises(surfrecon.InputError, match="not the text of a coordinate reference system: it is"):
        mesh.with_crs(" ")


def test_what_is_no_text_names_no_system(ground):
    mesh = surfrecon.Mesh(ground[:3], [[0, 1, 2]])
    for call in (
        lambda text: mesh.with_crs(text),
        lambda text: setattr(image("a", 0.0, None), "crs", text),
        lambda text: surfrecon.open("no.las", crs=text),
        lambda text: surfrecon.crs_note("a.stl", "mesh", text),
        lambda text: surfrecon.distances(ground, mesh, crs=text),
    ):
        for text in ("\ud800", "EPSG:25832\udcff", "a\x00b", "EPSG:"):
            with pytest.raises(surfrecon.InputError, match=r"not the text of a coordinate reference system: .*: give"):
                call(text)
        with pytest.raises(TypeError):
            call(25832)


def test_who_names_a_system_names_one_that_can_be_looked_up(tmp_path, ground):
    path = las(tmp_path / "ground.las", ground)
    with pytest.raises(surfrecon.InputError, match='"junk" names no coordinate reference system: give well-known'):
        surfrecon.open(path, crs="junk")
    for text in ("junk", "EPSG:", "EPSG:junk", "", " "):
        done = run("info", path, "--crs", text)
        assert done.returncode == 1
        assert "coordinate reference system" in done.stderr
        assert "give well-known text, or a code as EPSG:25832" in done.stderr
    # The name that a file gives its system stays, and may be handed on.
    named = surfrecon.Mesh(ground[:3], [[0, 1, 2]]).with_crs("Our grid")
    assert named.with_crs(named.crs).crs == "Our grid"


def test_nothing_is_measured_between_two_systems_or_in_degrees(tmp_path, ground):
    mesh = surfrecon.reconstruct(ground).mesh
    utm, other, degrees = (mesh.with_crs(text) for text in (UTM, "EPSG:25833", "EPSG:4326"))
    two = r"is in ETRS89 / UTM zone 32N \(EPSG:25832\), .* in EPSG:25833: transform one of them first"
    angles = r"its coordinates are degrees \(EPSG:4326\), in which nothing can be measured"
    scan, seen = image("a", 0.0, UTM), image("b", 0.0, "EPSG:25833")
    lost = image("c", 0.0, "EPSG:4326")
    for call, match in (
        (lambda: surfrecon.surface_distance(utm, other), two),
        (lambda: surfrecon.surface_distance(degrees, mesh), angles),
        (lambda: surfrecon.distances(ground, other, crs=UTM), two),
        (lambda: surfrecon.distances(ground, [seen], crs=UTM), two),
        (lambda: surfrecon.distances(ground, [scan, seen]), two),
        (lambda: surfrecon.distances(ground, degrees), angles),
        (lambda: surfrecon.distances(ground, mesh, crs="EPSG:4326"), angles),
        (lambda: surfrecon.Job.distances(ground, other, crs=UTM).result(), two),
        (lambda: surfrecon.nearest_triangles(ground, degrees), angles),
        (lambda: surfrecon.sculpt(lost), angles),
        (lambda: surfrecon.adaptive_quads(lost), angles),
        (lambda: utm.write(tmp_path / "a.glb", coarser=[other]), two),
    ):
        with pytest.raises(surfrecon.InputError, match=match):
            call()
    assert not any(tmp_path.iterdir())
    assert surfrecon.distances(ground, utm, crs="EPSG:25832").max() < 1e-6
    utm.write(tmp_path / "utm.ply")
    other.write(tmp_path / "other.ply")
    degrees.write(tmp_path / "degrees.ply")
    las(tmp_path / "ground.las", ground, text=UTM)
    # Of a code alone nothing but its file says that it is of degrees.
    las(tmp_path / "angles.las", ground, keys=[1, 1, 0, 2, 1024, 0, 1, 2, 2048, 0, 1, 6318])
    for first, second, text in (
        ("utm.ply", "other.ply", "transform one of them first"),
        ("ground.las", "other.ply", "transform one of them first"),
        ("ground.las", "degrees.ply", "its coordinates are degrees"),
        ("degrees.ply", "utm.ply", "its coordinates are degrees"),
        ("angles.las", "utm.ply", "its coordinates are degrees"),
    ):
        done = run("measure", first, second, cwd=tmp_path)
        assert done.returncode == 1
        assert text in done.stderr
    assert run("measure", "ground.las", "utm.ply", cwd=tmp_path).returncode == 0


def test_what_is_beside_a_file_and_names_none_is_told(tmp_path, ground):
    las(tmp_path / "ground.las", ground)
    (tmp_path / "ground.prj").write_text("EPSG:25832")
    done = run("info", "ground.las", cwd=tmp_path)
    assert done.returncode == 0
    assert "ground.prj: coordinate reference system: expected well-known text" in done.stderr


def test_scans_without_valid_points_spoil_no_set(tmp_path):
    none = surfrecon.RangeImage.from_points(np.full((4, 5, 3), np.nan), viewing=("from", (0, 0, 0)), name="none")
    surfrecon.write_scans(tmp_path / "set.e57", [image("a", 0.0, UTM), none, image("b", 0.1, UTM)])
    scans = surfrecon.open(tmp_path / "set.e57")
    assert [scan.name for scan in scans] == ["a", "b"]
    assert scans.notes[0].endswith("set.e57: scan 1, none, has no valid points: it is left out")
    assert len(surfrecon.merge(scans, voxel=0.1).mesh.triangles)
    surfrecon.write_scans(tmp_path / "none.e57", [none])
    with pytest.raises(surfrecon.FormatError, match=r"none\.e57: whole file: the scan has no valid points"):
        surfrecon.read(tmp_path / "none.e57")


def test_scans_of_one_system_make_results_in_it_and_others_are_refused(tmp_path):
    images = [image("a", 0.0, UTM), image("b", 0.1, "EPSG:25832")]
    surfrecon.write_scans(tmp_path / "both.e57", images, provenance={"by": "a test ]]>"})
    assert surfrecon.provenance(tmp_path / "both.e57") == {"by": "a test ]]>"}
    scans = surfrecon.open(tmp_path / "both.e57")
    assert scans.crs == UTM and [scan.crs for scan in scans] == [UTM, UTM]
    assert scans.notes == ["coordinates are in ETRS89 / UTM zone 32N (EPSG:25832)"]
    result = surfrecon.merge(scans, voxel=0.1)
    assert result.mesh.crs == UTM
    # Whatever their order.
    assert surfrecon.merge(images[::-1], voxel=0.1).mesh.crs == UTM
    images[1].crs = "EPSG:25833"
    for call in (
        lambda: surfrecon.merge(images, voxel=0.1),
        lambda: surfrecon.align(images),
        lambda: surfrecon.dominant_plane(images),
        lambda: surfrecon.write_scans(tmp_path / "no.e57", images),
    ):
        with pytest.raises(surfrecon.InputError, match=r"a is in ETRS89 .* \(EPSG:25832\), b in EPSG:25833: transform"):
            call()
    assert surfrecon.open(tmp_path / "both.e57", crs="EPSG:7").crs == "EPSG:7"


def test_degrees_are_no_lengths(tmp_path, ground):
    keys = [1, 1, 0, 2, 1024, 0, 1, 2, 2048, 0, 1, 4326]
    path = las(tmp_path / "degrees.las", ground, keys=keys)
    cloud = surfrecon.read(path)
    assert cloud.crs == "EPSG:4326"
    with pytest.raises(surfrecon.InputError, match=r"degrees \(EPSG:4326\), in which nothing can be measured: project"):
        surfrecon.reconstruct(cloud)
    with pytest.raises(surfrecon.InputError, match="degrees: its coordinates are degrees"):
        _ = surfrecon.open(path).crs
    # Files of their own still say so.
    surfrecon.write(tmp_path / "degrees.ply", cloud)
    with pytest.raises(surfrecon.InputError, match="are degrees"):
        surfrecon.reconstruct(surfrecon.read(tmp_path / "degrees.ply"))


def test_the_command_line_keeps_it_and_tells_what_is_lost(tmp_path, ground):
    path = las(tmp_path / "ground.las", ground, text=UTM)
    done = run("info", path, "--json")
    assert json.loads(done.stdout)["report"]["scans"][0]["crs"] == UTM
    assert "in ETRS89 / UTM zone 32N" in run("info", path).stdout
    done = run("reconstruct", path, "-o", tmp_path / "ground.obj")
    assert done.returncode == 0, done.stderr
    mesh = surfrecon.read(tmp_path / "ground.obj")
    assert mesh.crs == UTM and surfrecon.provenance(tmp_path / "ground.obj")["command"] == "reconstruct"
    surfrecon.write_scans(tmp_path / "scan.e57", [image("a", 0.0, UTM)])
    done = run("convert", tmp_path / "scan.e57", "-o", tmp_path / "scan.ptx")
    assert ".ptx has no place for the coordinate reference system, ETRS89 / UTM zone 32N (EPSG:25832)" in done.stderr
    assert run("convert", tmp_path / "scan.e57", "-o", tmp_path / "again.e57").returncode == 0
    assert surfrecon.read(tmp_path / "again.e57").crs == UTM
    assert surfrecon.provenance(tmp_path / "again.e57")["command"] == "convert"
    # Placed in the world, a mesh of a scan is in its system.
    for command in (["convert", "--mesh"], ["sculpt"]):
        done = run(*command, tmp_path / "scan.e57", "-o", tmp_path / "scan.ply")
        assert done.returncode == 0, done.stderr
        placed = surfrecon.read(tmp_path / "scan.ply")
        assert placed.crs == UTM and np.abs(placed.positions - CORNER).max() < 10
    done = run("quads", tmp_path / "scan.e57", "-o", tmp_path / "quads.ply")
    assert "they are not in its coordinate reference system" in done.stderr
    assert surfrecon.read(tmp_path / "quads.ply").crs is None
    done = run("info", path, "--crs", "EPSG:5", "--json")
    assert json.loads(done.stdout)["report"]["scans"][0]["crs"] == "EPSG:5"


def test_a_system_beside_a_map_is_read_and_hashed(tmp_path):
    grid = tmp_path / "map.asc"
    rows = "\n".join(" ".join(str((r * c) % 7) for c in range(12)) for r in range(12))
    grid.write_text(f"ncols 12\nnrows 12\nxllcorner 500000\nyllcorner 5000000\ncellsize 1\n{rows}\n")
    (tmp_path / "map.prj").write_text(UTM)
    assert run("convert", grid, "--mesh", "-o", tmp_path / "map.ply").returncode == 0
    mesh = surfrecon.read(tmp_path / "map.ply")
    assert mesh.crs == UTM and mesh.positions[:, 0].min() == 500_000.5
    assert [file["name"] for file in surfrecon.provenance(tmp_path / "map.ply")["inputs"]] == ["map.asc", "map.prj"]


def test_the_command_line_takes_a_system_from_a_file(tmp_path, ground):
    las(tmp_path / "ground.las", ground)
    (tmp_path / "zone.prj").write_text(UTM)
    (tmp_path / "latin.prj").write_bytes(b"Gau\xdf")

    def converted(system):
        return run("convert", "ground.las", "-o", "out.ply", "--crs", system, cwd=tmp_path)

    assert converted("zone.prj").returncode == 0
    assert surfrecon.open(tmp_path / "out.ply")[0].crs == UTM
    for system, text in (
        ("none.prj", "none.prj: no coordinate"),
        ("latin.prj", "latin.prj: no"),
        ("\udcff", "not the text of"),
    ):
        done = converted(system)
        assert done.returncode == 1
        assert text in done.stderr


@pytest.mark.parametrize("name", ["EPSG:4326", "OGC:CRS84", "+proj=longlat +datum=WGS84"])
def test_degrees_are_known_by_their_usual_names(tmp_path, ground, name):
    points = surfrecon.open(las(tmp_path / "ground.las", ground), crs=name)[0].read()
    with pytest.raises(surfrecon.InputError, match="degrees"):
        surfrecon.reconstruct(points)
