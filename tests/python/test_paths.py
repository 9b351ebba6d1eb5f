"""Files wherever users have them: names in any script, long paths, names that systems keep, files in use."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
import surfrecon
from shapes import torus, torus_scans

WINDOWS = sys.platform == "win32"
# Windows' functions take 260 characters, if they are not asked in another way.
LONG = 400
FOLDERS = ["Zoë Müller", "スキャン 測量", "сканы", "🗿 heads", "two  blanks", "100%", "a'b", "#1 [new] {x}", "-o"]


@pytest.mark.parametrize("name", FOLDERS)
def test_folders_of_any_script(tmp_path, name):
    folder = tmp_path / name
    folder.mkdir()
    round_trips(folder)


def test_paths_longer_than_windows_likes(tmp_path):
    folder = tmp_path
    while len(str(folder)) < LONG:
        folder /= "a folder in a folder in a folder"
    # Python itself asks in the other way where the name says so.
    os.makedirs(f"\\\\?\\{folder}" if WINDOWS else folder)
    round_trips(folder)


def round_trips(folder):
    """Writes a mesh and a set of scans, again over them, and reads them."""
    mesh, images = torus(10), torus_scans(20)
    for _ in range(2):
        mesh.write(folder / "mesh.ply")
        surfrecon.write_scans(folder / "set.conf", images)
    assert np.array_equal(surfrecon.read(folder / "mesh.ply").triangles, mesh.triangles)
    assert len([scan.read() for scan in surfrecon.open(folder / "set.conf")]) == len(images)
    assert not [name for name in os.listdir(folder) if name.endswith(".part")]


@pytest.mark.skipif(not WINDOWS, reason="drives and backslashes are Windows'")
def test_drives_and_backslashes(tmp_path, monkeypatch):
    mesh = torus(10)
    (tmp_path / "sub").mkdir()
    mesh.write(f"{tmp_path}\\sub\\a.ply")
    monkeypatch.chdir(tmp_path)
    drive = tmp_path.drive
    whole = f"{tmp_path.as_posix()}/sub/a.ply"
    for path in ["sub/a.ply", "sub\\a.ply", ".\\sub/..\\sub\\a.ply", f"{drive}sub\\a.ply", whole]:
        assert np.array_equal(surfrecon.read(path).triangles, mesh.triangles), path
    mesh.write(f"\\\\?\\{tmp_path}\\b.ply")
    assert (tmp_path / "b.ply").is_file()
    with pytest.raises(surfrecon.FileError, match="there is no folder"):
        mesh.write(f"{tmp_path}\\no\\a.ply")


@pytest.mark.parametrize("name", ["NUL.ply", "con.ply", "what?.ply", "a:b.ply", "com1.glb", "a|b.stl"])
def test_names_that_windows_keeps(tmp_path, name):
    mesh = torus(10)
    if WINDOWS:
        with pytest.raises(surfrecon.InputError, match="Windows.*choose another name"):
            mesh.write(f"{tmp_path}\\{name}")
    else:
        mesh.write(tmp_path / name)
    assert [file.name for file in tmp_path.iterdir()] == ([] if WINDOWS else [name])


def test_a_file_that_another_program_has_open(tmp_path):
    path = tmp_path / "a.ply"
    path.write_text("theirs")
    with path.open("rb") as file:
        if WINDOWS:
            with pytest.raises(surfrecon.FileError, match=r"a\.ply: .*another program has the file open"):
                torus(10).write(path)
        else:
            torus(10).write(path)
        assert file.read() == b"theirs"
    assert os.listdir(tmp_path) == ["a.ply"]
    assert (path.read_bytes() == b"theirs") == WINDOWS
    torus(10).write(path)
    with path.open("rb"):
        assert surfrecon.read(path).triangles.shape[0] == 400


def test_files_with_the_line_ends_of_each_system(tmp_path):
    images = torus_scans(20)
    surfrecon.write_scans(tmp_path / "set.conf", images)
    expected = [scan.read() for scan in surfrecon.open(tmp_path / "set.conf")]
    text = (tmp_path / "set.conf").read_bytes()
    for ends in [b"\n", b"\r\n"]:
        other = text.replace(b"\r\n", b"\n").replace(b"\n", ends)
        (tmp_path / "other.conf").write_bytes(other)
        found = [scan.read() for scan in surfrecon.open(tmp_path / "other.conf")]
        for image, same in zip(found, expected, strict=True):
            assert np.array_equal(image.world_from_sensor, same.world_from_sensor)
            assert np.array_equal(image.points, same.points, equal_nan=True)


def test_lists_name_files_with_the_separators_of_each_system(tmp_path):
    images = torus_scans(20)
    (tmp_path / "data").mkdir()
    surfrecon.write_scans(tmp_path / "data" / "set.conf", images)
    text = Path(tmp_path / "data" / "set.conf").read_text()
    for separator in ["/", "\\"] if WINDOWS else ["/"]:
        (tmp_path / "up.conf").write_text(text.replace("bmesh ", f"bmesh data{separator}"))
        assert len([scan.read() for scan in surfrecon.open(tmp_path / "up.conf")]) == len(images)
