"""Poses that are written as TUM's trajectories: each line says which scan it is of."""

import numpy as np
import pytest
import surfrecon
from command_line import run

CAMERA = (60, 60, 25, 20)


def shifted(number):
    """A pose at x = number / 100."""
    return np.eye(4) + 0.01 * number * np.eye(4, k=3)


def images(folder, names):
    """Files of depth images."""
    row, col = np.mgrid[0:40, 0:50]
    for number, name in enumerate(names):
        (folder / name).parent.mkdir(exist_ok=True)
        np.save(folder / name, 2 + 0.1 * number + 0.01 * np.abs(col - 25.0) + 0.004 * row)
    return [folder / name for name in names]


def written(files, path, names=None):
    """A list of the files, the first at x = 0, the next at 0.01 and so on. `names` may choose some of them."""
    scans = surfrecon.open(files, camera=CAMERA)
    scans = [scan.transformed(shifted(number)) for number, scan in enumerate(scans)]
    chosen = [scan for scan in scans if names is None or scan.path.relative_to(path.parent).as_posix() in names]
    surfrecon.align(chosen, fixed=range(len(chosen))).write(path)
    return path


def places(scans, folder):
    """The place of each file."""
    return {scan.path.relative_to(folder).as_posix(): round(100 * scan.world_from_sensor[0, 3], 6) for scan in scans}


@pytest.mark.parametrize(
    "names",
    [
        ["one/000.npy", "one/001.npy", "two/000.npy", "two/001.npy", "two/002.npy"],
        ["000.npy", "0000.npy", "0005.npy", "001.npy"],
        ["frame_0001.npy", "frame_0002.npy", "frame_0004.npy", "frame_0003.npy"],
        ["0.001.npy", "0.004.npy", "0.002.npy", "0.003.npy"],
        ['a "b" of c.npy', "ä.npy", "# d.npy", "v1.2.3.npy"],
    ],
)
def test_each_scan_takes_its_own_pose(tmp_path, names):
    """Whatever names they have, in whatever order they are opened, and if some have no pose."""
    files = images(tmp_path, names)
    path = written(files, tmp_path / "placed.tum")
    truth = {name: number for number, name in enumerate(names)}
    for order in (files, files[::-1], files[1:], files[2:] + files[:1]):
        found = surfrecon.open([*order, path], camera=CAMERA)
        opened = {file.relative_to(tmp_path).as_posix() for file in order}
        assert places(found, tmp_path) == {name: x for name, x in truth.items() if name in opened}
    # One has no pose: no other scan's becomes its own.
    path = written(files, path, names[1:])
    found = surfrecon.open([*files, path], camera=CAMERA)
    assert places(found, tmp_path) == {name: x for name, x in truth.items() if name != names[0]}
    assert f"placed {len(names) - 1} scans by their names, and 1 of {len(names)} has no pose and is passed over" in str(
        found.notes
    )


def test_lists_are_read_by_the_tools_of_tum(tmp_path):
    """They split lines at blanks, and pass over those alone that begin with #."""
    names = ["frame 3.npy", "frame_0004.npy"]
    path = written(images(tmp_path, names), tmp_path / "placed.tum")
    lines = path.read_text().replace(",", " ").replace("\t", " ").split("\n")
    rows = [[float(word) for word in line.split(" ") if word] for line in lines if line and line[0] != "#"]
    assert [row[0] for row in rows] == [3, 4] and [len(row) for row in rows] == [8, 8]
    assert np.allclose(np.loadtxt(path), rows)


def test_a_list_of_one_recording_places_no_other(tmp_path):
    one, two = (images(tmp_path, [f"{name}/{number:03}.npy" for number in range(3)]) for name in ("one", "two"))
    path = written(two, tmp_path / "two.tum")
    found = surfrecon.open([*one, *two, path], camera=CAMERA)
    assert places(found, tmp_path) == {f"two/{number:03}.npy": number for number in range(3)}
    # The files alone may have been moved: their names place them. If they have not, this is said.
    found = surfrecon.open([*one, path], camera=CAMERA)
    assert len(found) == 3 and any("the scans of the same names are of" in note for note in found.notes)
    for file in two:
        file.rename(tmp_path / f"{file.stem}.npy")
    found = surfrecon.open([*sorted(tmp_path.glob("*.npy")), path], camera=CAMERA)
    assert places(found, tmp_path) == {f"{number:03}.npy": number for number in range(3)}
    assert not any("of the same names" in note for note in found.notes)
    # Now nothing tells which of two it is.
    with pytest.raises(surfrecon.FormatError, match=r'"000" is the name of 1 pose and of 2 scans, and no file tells'):
        surfrecon.open([*sorted(tmp_path.glob("*.npy")), *one, path], camera=CAMERA)
    (tmp_path / "other.npy").write_bytes(one[0].read_bytes())
    with pytest.raises(surfrecon.FormatError, match="no scan that is opened has a pose here"):
        surfrecon.open([tmp_path / "other.npy", path], camera=CAMERA)


def test_two_scans_do_not_take_one_line(tmp_path):
    """Of lists of others, which have times alone."""
    files = images(tmp_path, ["1.000.npy", "1.008.npy", "2.npy"])
    path = tmp_path / "other.tum"
    path.write_text("1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n")
    with pytest.raises(surfrecon.FormatError, match=r"1\.000 and 1\.008 both take the pose of time 1"):
        surfrecon.open([*files, path], camera=CAMERA)
    assert len(surfrecon.open([files[0], files[2], path], camera=CAMERA)) == 2


def test_scans_that_no_list_tells_apart_are_refused(tmp_path):
    scans = surfrecon.open(images(tmp_path, ["a.npy", "b.npy"]), camera=CAMERA)
    read = [scan.read() for scan in scans]
    for image in read:
        image.name = "x"
    with pytest.raises(surfrecon.InputError, match='"x" is the name of two scans'):
        surfrecon.align(read, fixed=[0, 1]).write(tmp_path / "x.tum")
    assert not (tmp_path / "x.tum").exists()
    for image in read:
        image.name = ""
    surfrecon.align(read, fixed=[0, 1]).write(tmp_path / "x.tum")
    assert '# scan "scan 1"\n1 ' in (tmp_path / "x.tum").read_text()


def test_the_command_line_aligns_and_merges_two_recordings(tmp_path):
    names = [f"{name}/{number:03}.npy" for name in ("one", "two") for number in range(2)]
    images(tmp_path, names)
    told = ("--camera", ",".join(map(str, CAMERA)))
    done = run("align", "one", "two", *told, "--fixed", "0,1,2,3", "-o", "placed.tum", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "placed.tum").read_text()
    assert [f'of "{name}"' in text for name in names] == [True] * 4
    done = run("info", "two", "one", "placed.tum", *told, cwd=tmp_path)
    assert done.returncode == 0 and "placed 4 scans by their names" in done.stderr, done.stderr
