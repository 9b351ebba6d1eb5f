"""Files that die half way: each is refused in a sentence that names it, and nothing of it is in the scene."""

import struct
import sys
import zlib

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from shapes import torus, torus_scans

pytestmark = pytest.mark.one_version

# Shares of a file's bytes that are left.
SHARES = (0.0, 0.1, 0.5, 0.9, 0.99)

# Cut at the end of a line or a word these may be whole files of fewer points.
TEXTS = {"xyz", "csv", "pts", "obj", "aln", "conf"}


def heights():
    y, x = np.mgrid[:30, :40]
    return np.sin(x / 5) * np.cos(y / 7) + 2


def stations():
    return [
        surfrecon.RangeImage.from_points(image.points, viewing=("from", (0, 0, 5)), name=f"station{k}")
        for k, image in enumerate(torus_scans(pixels=30)[:2])
    ]


def png(path):
    values = (heights() * 1000).astype(">u2")
    rows = b"".join(b"\0" + row.tobytes() for row in values)

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", values.shape[1], values.shape[0], 16, 0, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    )


def tiff(path):
    values = heights().astype("<f4")
    rows, cols = values.shape
    entries = [
        (256, 4, cols), (257, 4, rows), (258, 3, 32), (259, 3, 1), (262, 3, 1), (273, 4, 8), (277, 3, 1),
        (278, 4, rows), (279, 4, values.nbytes), (339, 3, 3),
    ]  # fmt: skip
    table = struct.pack("<H", len(entries)) + b"".join(
        struct.pack("<HHII", tag, kind, 1, v) for tag, kind, v in entries
    )
    path.write_bytes(struct.pack("<2sHI", b"II", 42, 8 + values.nbytes) + values.tobytes() + table + b"\0\0\0\0")


def pcd(path):
    points = torus(20).positions.astype("<f4")
    words = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
    size = f"WIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA binary\n"
    path.write_bytes((words + size).encode() + points.tobytes())


def las(path):
    points = torus(20).positions
    low, high = points.min(axis=0), points.max(axis=0)
    header = bytearray(227)
    struct.pack_into("<4s", header, 0, b"LASF")
    struct.pack_into("<BB", header, 24, 1, 2)
    struct.pack_into("<HII", header, 94, 227, 227, 0)
    struct.pack_into("<BHI", header, 104, 0, 20, len(points))
    struct.pack_into("<6d", header, 131, 1e-4, 1e-4, 1e-4, 0, 0, 0)
    struct.pack_into("<6d", header, 179, high[0], low[0], high[1], low[1], high[2], low[2])
    records = b"".join(
        struct.pack("<iiiHBBbBH", *np.round(p * 1e4).astype(int).tolist(), 0, 0, 0, 0, 0, 0) for p in points
    )
    path.write_bytes(bytes(header) + records)


def text(path, lines):
    path.write_text("\n".join(" ".join(f"{x:.9g}" for x in line) for line in lines) + "\n")


def project(path):
    torus(20).write(path.parent / "part.ply")
    name = '<MLMesh label="part" filename="part.ply">'
    matrix = "<MLMatrix44>\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n</MLMatrix44>"
    text = (
        f"<!DOCTYPE MeshLabDocument>\n<MeshLabProject><MeshGroup>{name}{matrix}</MLMesh></MeshGroup></MeshLabProject>\n"
    )
    # Without the end of its last line, which is two bytes on Windows, it is still whole.
    path.write_text(text, newline="\n")


def alignment(path):
    torus(20).write(path.parent / "part.ply")
    path.write_text("1\npart.ply\n#\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0\n")


def netpbm(path, kind):
    values = heights()
    if kind == "pgm":
        content = b"P5\n40 30\n65535\n" + (values * 1000).astype(">u2").tobytes()
    else:
        content = b"Pf\n40 30\n-1.0\n" + values.astype("<f4").tobytes()
    path.write_bytes(content)


def grid(path):
    head = "ncols 40\nnrows 30\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -9999\n"
    path.write_text(head + "\n".join(" ".join(f"{x:.3f}" for x in row) for row in heights()) + "\n")


MAKERS = {
    "conf": lambda path: write_set(path.parent, torus_scans(pixels=20)[:2], path.stem),
    "ptx": lambda path: surfrecon.write(path, stations()),
    "e57": lambda path: surfrecon.write(path, stations()),
    "ply": lambda path: torus(20).write(path),
    "text.ply": lambda path: torus(20).write(path, encoding="ascii"),
    "obj": lambda path: torus(20).write(path),
    "stl": lambda path: torus(20).write(path),
    "glb": lambda path: torus(20).write(path),
    "pcd": pcd,
    "las": las,
    "mlp": project,
    "aln": alignment,
    "png": png,
    "tif": tiff,
    "pgm": lambda path: netpbm(path, "pgm"),
    "pfm": lambda path: netpbm(path, "pfm"),
    "npy": lambda path: np.save(path, heights()),
    "asc": grid,
    "hgt": lambda path: path.write_bytes(
        (heights().repeat(41, 0)[:1201].repeat(31, 1)[:, :1201] * 100).astype(">i2").tobytes()
    ),
    "xyz": lambda path: text(path, torus(20).positions),
    "csv": lambda path: text(path, torus(20).positions),
    "pts": lambda path: path.write_text(
        f"{len(torus(20).positions)}\n" + "".join(f"{x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in torus(20).positions)
    ),
}


def name_of(kind):
    return f"N36E138.{kind}" if kind == "hgt" else f"half.{kind}"


def nothing():
    kinds = (bpy.data.objects, bpy.data.meshes, bpy.data.collections, bpy.data.materials, bpy.data.images)
    return not any(len(kind) for kind in kinds)


@pytest.mark.parametrize("kind", MAKERS)
def test_half_a_file_changes_nothing(tmp_path, kind):
    path = tmp_path / name_of(kind)
    MAKERS[kind](path)
    whole = path.read_bytes()
    assert bpy.ops.surfrecon.import_scans(filepath=str(path)) == {"FINISHED"}, "the whole file"
    assert len(bpy.data.objects) > 0
    for share in SHARES:
        path.write_bytes(whole[: int(share * len(whole))])
        bpy.ops.wm.read_homefile(use_empty=True)
        try:
            done = bpy.ops.surfrecon.import_scans(filepath=str(path))
        except RuntimeError as refused:
            said = str(refused).removeprefix("Error: ").strip()
            assert path.name in said and "\n" not in said and 15 < len(said) < 400, said
            assert nothing(), (share, said)
        else:
            assert done == {"FINISHED"} and kind in TEXTS, f"{share:.0%} of the file were taken for all of it"


@pytest.mark.parametrize("kind", ["e57", "glb", "npy", "png", "ply", "las", "pcd", "tif"])
def test_bytes_of_no_meaning_change_nothing(tmp_path, kind):
    """A changed file may still be a file. If it isn't, nothing is in the scene."""
    path = tmp_path / name_of(kind)
    MAKERS[kind](path)
    whole = bytearray(path.read_bytes())
    random = np.random.default_rng(7)
    for _ in range(20):
        damaged = bytearray(whole)
        for place in random.integers(0, min(len(whole), 400), 6):
            damaged[place] = random.integers(0, 256)
        path.write_bytes(damaged)
        bpy.ops.wm.read_homefile(use_empty=True)
        try:
            bpy.ops.surfrecon.import_scans(filepath=str(path))
        except RuntimeError:
            assert nothing()


def test_a_file_of_several_that_is_bad_takes_all_back(tmp_path):
    torus(20).write(tmp_path / "good.ply")
    MAKERS["las"](tmp_path / "bad.las")
    (tmp_path / "bad.las").write_bytes((tmp_path / "bad.las").read_bytes()[:-7])
    with pytest.raises(RuntimeError, match="bad.las"):
        bpy.ops.surfrecon.import_scans(directory=str(tmp_path), files=[{"name": "good.ply"}, {"name": "bad.las"}])
    assert nothing()


def test_a_file_that_may_not_be_read(tmp_path):
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(RuntimeError, match="folder.ply"):
        bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / "folder.ply"))
    with pytest.raises(RuntimeError, match="nowhere"):
        bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / "nowhere" / "scan.ply"))
    assert nothing()


def test_names_of_every_kind(tmp_path):
    # Windows has no names with quotation marks.
    quoted = "" if sys.platform == "win32" else ' "b"'
    path = tmp_path / f"Büste 雕塑 % {{0}} 'a'{quoted}.ply"
    torus(20).write(path)
    assert bpy.ops.surfrecon.import_scans(filepath=str(path)) == {"FINISHED"}
    assert bpy.context.object.name == path.stem
    # Blender's names have 63 bytes at most, up to 4.5.
    path = tmp_path / ("ü" * 100 + ".ply")
    torus(20).write(path)
    assert bpy.ops.surfrecon.import_scans(filepath=str(path)) == {"FINISHED"}
    assert path.stem.startswith(bpy.context.object.name)
