"""Poses that are written as TUM's trajectories: each line says which scan it is of."""

import json
import os
import zipfile

import numpy as np
import pytest
import surfrecon
from command_line import run
from heaps import look

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
    assert f"placed {len(names) - 1} scans by name, and 1 of {len(names)} has no pose and is passed over" in str(
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


def entry(time, x, name=None, file=None):
    """A pose at x / 100, with the comment of its scan."""
    of = f' of "{file}"' if file else ""
    comment = f'# scan "{name}"{of}\n' if name else ""
    return f"{comment}{time} {x / 100} 0 0 0 0 0 1\n"


def frames(folder, numbers):
    """Entries of frames of a folder, x as the number."""
    return "".join(entry(f"{k:04}", k, f"frame_{k:04}", f"{folder}/frame_{k:04}.npy") for k in numbers)


@pytest.fixture
def recordings(tmp_path):
    """Frames 0 to 4 of two recordings, which have the same names."""
    return {name: images(tmp_path, [f"{name}/frame_{k:04}.npy" for k in range(5)]) for name in ("A", "B")}


def test_files_decide_where_a_list_is_of_several_recordings(tmp_path, recordings):
    """A frame without a pose takes none of the other recording, even where its own frame is gone."""
    joint = "".join(
        entry(time, x, f"frame_{k:04}", f"{name}/frame_{k:04}.npy")
        for time, (name, k, x) in enumerate([("A", 3, 3), ("B", 3, 13), ("A", 4, 4), ("B", 2, 12)])
    )
    path = tmp_path / "joint.tum"
    path.write_text(joint)
    found = surfrecon.open([*recordings["A"], path], camera=CAMERA)
    assert places(found, tmp_path) == {"A/frame_0003.npy": 3, "A/frame_0004.npy": 4}
    recordings["A"].pop().unlink()
    found = surfrecon.open([*recordings["A"], *recordings["B"], path], camera=CAMERA)
    assert places(found, tmp_path) == {"A/frame_0003.npy": 3, "B/frame_0003.npy": 13, "B/frame_0002.npy": 12}
    # From elsewhere none of its files is found, and names tell nothing.
    (tmp_path / "lists").mkdir()
    path = path.rename(tmp_path / "lists" / "joint.tum")
    with pytest.raises(surfrecon.FormatError, match="found from its own folder: if it was moved, put it back"):
        surfrecon.open([*recordings["A"], *recordings["B"], path], camera=CAMERA)


def test_names_alone_decide_where_no_file_of_the_list_is_opened(tmp_path, recordings):
    path = tmp_path / "gone.tum"
    path.write_text(frames("gone", range(5)))
    found = surfrecon.open([*recordings["B"], path], camera=CAMERA)
    assert places(found, tmp_path) == {f"B/frame_{k:04}.npy": k for k in range(5)}
    note = "gone.tum: the files that the list names are not there: poses are matched by name alone"
    assert note in found.notes
    # With one of its files it is the list of these.
    path.write_text(frames("A", range(4)))
    found = surfrecon.open([recordings["A"][0], *recordings["B"][1:], path], camera=CAMERA)
    assert places(found, tmp_path) == {"A/frame_0000.npy": 0}
    assert not any("by name alone" in note for note in found.notes)


def test_frames_of_archives_are_told_apart(tmp_path, recordings):
    """Files in archives are files: the archive says whether they are there."""
    for name in ("one", "two"):
        with zipfile.ZipFile(tmp_path / f"{name}.zip", "w") as archive:
            archive.writestr("camera.json", '{"fx": 60, "fy": 60, "cx": 25, "cy": 20}')
            for k in range(3):
                archive.write(recordings["A"][k], f"depth/frame_{k:04}.npy")
    path = tmp_path / "one.tum"
    path.write_text(frames("one.zip/depth", range(2)))
    found = surfrecon.open([tmp_path / "two.zip", path], camera=CAMERA)
    assert len(found) == 2 and any("check that these are the same" in note for note in found.notes), found.notes
    found = surfrecon.open([tmp_path / "one.zip", tmp_path / "two.zip", path], camera=CAMERA)
    assert places(found, tmp_path) == {f"one.zip/depth/frame_{k:04}.npy": k for k in range(2)}
    assert not any("check that" in note for note in found.notes)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda text: text.replace("0003 ", "# 0003 "), 'line 7: there is no pose behind # scan "frame_0003"'),
        (
            lambda text: "".join(
                line
                for line in text.splitlines(True)
                if not line.startswith("0002 ") and 'scan "frame_0003"' not in line
            ),
            'line 6: the time 3 is not the number in "frame_0002"',
        ),
        (
            lambda text: text.replace('"frame_0002"', "“frame_0002”"),
            "line 5: this comment must name a scan in straight quotes",
        ),
        (lambda text: text.replace('"frame_0002"', "frame_0002"), "line 6: the scan of this pose is missing"),
        (lambda text: text + '# scan "frame_0004"\n', 'line 9: there is no pose behind # scan "frame_0004"'),
        (lambda text: text + entry("0004", 4, "frame_0003", "./A/frame_0003.npy"), "line 10: .* has two poses"),
        (lambda text: text + entry("0004", 4, "frame_0003"), "line 10: .* has two poses"),
    ],
)
def test_a_list_that_was_edited_by_hand_is_not_misread(tmp_path, recordings, change, problem):
    path = tmp_path / "edited.tum"
    whole = frames("A", range(4))
    path.write_text(whole.replace("# scan", "#scan"))
    truth = {f"A/frame_{k:04}.npy": k for k in range(4)}
    assert places(surfrecon.open([*recordings["A"], path], camera=CAMERA), tmp_path) == truth
    path.write_text(change(whole))
    with pytest.raises(surfrecon.FormatError, match=problem):
        surfrecon.open([*recordings["A"], path], camera=CAMERA)


def test_lists_that_are_put_together_are_one(tmp_path, recordings):
    path = tmp_path / "both.tum"
    path.write_text(frames("A", range(5)) + frames("B", range(3)))
    found = surfrecon.open([*recordings["B"], *recordings["A"], path], camera=CAMERA)
    truth = {f"A/frame_{k:04}.npy": k for k in range(5)} | {f"B/frame_{k:04}.npy": k for k in range(3)}
    assert places(found, tmp_path) == truth


@pytest.mark.parametrize(
    ("names", "times", "truth"),
    [
        # Not in the order of their names.
        ([f"view{k}" for k in range(1, 13)], range(1, 13), {f"view{k}": k - 1 for k in range(1, 13)}),
        # As many poses as scans, but frame 2 has none and frame 5 is gone.
        (
            [f"frame_{k:04}" for k in range(5)],
            (0, 1, 3, 4, 5),
            {"frame_0000": 0, "frame_0001": 1, "frame_0003": 2, "frame_0004": 3},
        ),
        (["depth_1305.374112", "depth_1305.507445"], (1305.2, 1305.5074), {"depth_1305.507445": 1}),
        (["0000", "0001", "mask"], (0, 1, 2), {"0000": 0, "0001": 1}),
    ],
)
def test_times_are_found_in_names(tmp_path, names, times, truth):
    """Of lists whose comments are gone, and of others: the order of the files says nothing then."""
    files = images(tmp_path, [f"{name}.npy" for name in names])
    path = tmp_path / "other.tum"
    path.write_text("".join(entry(time, x) for x, time in enumerate(times)))
    for order in (files, files[::-1], sorted(files)):
        found = surfrecon.open([*order, path], camera=CAMERA)
        assert places(found, tmp_path) == {f"{name}.npy": x for name, x in truth.items()}


def test_order_alone_decides_only_where_nothing_contradicts_it(tmp_path):
    files = images(tmp_path, [f"view{k}.npy" for k in (1, 2, 3, 10)])
    path = tmp_path / "other.tum"
    truth = {"view1.npy": 0, "view2.npy": 1, "view3.npy": 2, "view10.npy": 3}
    for list_of in (
        "".join(entry(x / 2, x) for x in range(4)),
        "".join(f"1 0 0 {x / 100} 0 1 0 0 0 0 1 0\n" for x in range(4)),
    ):
        path.write_text(list_of)
        found = surfrecon.open([*sorted(files), path], camera=CAMERA)
        assert places(found, tmp_path) == truth
        assert "other.tum: placed 4 scans in the order of the numbers in their names" in found.notes
        with pytest.raises(surfrecon.FormatError, match="4 poses for 3 scans, whose names have no times of the list"):
            surfrecon.open([*files[1:], path], camera=CAMERA)
    path.write_text("".join(entry(time, x) for x, time in enumerate((0, 1, 2, 3))))
    with pytest.raises(surfrecon.FormatError, match="its times are 0 to 3, but the numbers in the names .* 1 to 10"):
        surfrecon.open([*files, path], camera=CAMERA)


def test_the_number_that_differs_decides(tmp_path):
    """Of a folder, whose files come in the order of their letters. A file that is given twice is in doubt."""
    folder = tmp_path / "seen"
    folder.mkdir()
    files = images(folder, [f"{k}_640x480.npy" for k in range(12)])
    lists = {
        "kitti.txt": "".join(f"1 0 0 {x / 100} 0 1 0 0 0 0 1 0\n" for x in range(12)),
        "seconds.tum": "".join(entry(f"0.{x:02}", x) for x in range(12)),
        "numbers.tum": "".join(entry(x, x) for x in range(12)),
    }
    for name, text in lists.items():
        path = tmp_path / name
        path.write_text(text)
        found = surfrecon.open([folder, path], camera=CAMERA)
        assert places(found, folder) == {f"{x}_640x480.npy": x for x in range(12)}, found.notes
        twice = [*files[:2], files[1], *files[3:]]
        with pytest.raises(surfrecon.FormatError, match=r"1_640x480 and 1_640x480 \(2\) have the same number"):
            surfrecon.open([*twice, path], camera=CAMERA)
        np.save(folder / "mean.npy", np.load(files[0]))
        if name != "numbers.tum":
            with pytest.raises(surfrecon.FormatError, match=r"mean has no number in its name|12 poses for 13 scans"):
                surfrecon.open([folder, path], camera=CAMERA)
        (folder / "mean.npy").unlink()


def logged(numbers):
    """A log of Open3D's, x as the place."""
    return "".join(f"{k} {k} {k + 1}\n1 0 0 {x / 100}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n" for x, k in enumerate(numbers))


def test_a_log_of_other_frames_is_refused(tmp_path):
    """In a folder of depth and colour, too."""
    folder = tmp_path / "recording"
    folder.mkdir()
    names = [f"{k:06}.npy" for k in (0, 1, 2, 4, 5)]
    images(folder, [f"depth/{name}" for name in names])
    (folder / "color").mkdir()
    path = folder / "trajectory.log"
    path.write_text(logged((0, 1, 2, 4, 5)))
    opened = surfrecon.open(folder, camera=CAMERA)
    assert [round(100 * scan.world_from_sensor[0, 3]) for scan in opened] == list(range(5))
    path.write_text(logged((0, 1, 2, 3, 5)))
    for opened in (folder, [folder / "depth", path]):
        with pytest.raises(surfrecon.FormatError, match="the first and the third number before each matrix"):
            surfrecon.open(opened, camera=CAMERA)


@pytest.mark.skipif(os.sep == "\\", reason="a backslash separates folders there")
@pytest.mark.parametrize("ending", ["tum", "conf", "aln"])
def test_names_with_a_backslash_survive(tmp_path, ending):
    surfrecon.write_scans(tmp_path / "two.conf", look()[:2])
    (tmp_path / "two.conf").unlink()
    files = [file.rename(tmp_path / f"a\\b{k}{file.suffix}") for k, file in enumerate(sorted(tmp_path.iterdir()))]
    path = tmp_path / f"placed.{ending}"
    surfrecon.align(surfrecon.open(files), fixed=[0, 1]).write(path)
    assert "a/b0" not in path.read_text()
    opened = surfrecon.open([*files, path] if ending == "tum" else path)
    assert [scan.path for scan in opened] == files


def test_two_scans_do_not_take_one_line(tmp_path):
    """Of lists of others, which have times alone: the nearer takes it."""
    files = images(tmp_path, ["1.008.npy", "1.000.npy", "2.npy"])
    path = tmp_path / "other.tum"
    path.write_text("1 0 0 0 0 0 0 1\n2 0.01 0 0 0 0 0 1\n")
    found = surfrecon.open([*files, path], camera=CAMERA)
    assert places(found, tmp_path) == {"1.000.npy": 0, "2.npy": 1}
    assert any("1 of 3 has no pose of its own within 0.02 s" in note for note in found.notes)
    again = images(tmp_path, ["again/1.000.npy"])
    with pytest.raises(surfrecon.FormatError, match=r"1\.000 and 1\.000 have the same number"):
        surfrecon.open([*files, *again, path], camera=CAMERA)


def test_an_empty_list_says_so(tmp_path, recordings):
    path = tmp_path / "empty.tum"
    for text in ("", "# timestamp tx ty tz qx qy qz qw\n"):
        path.write_text(text)
        with pytest.raises(surfrecon.FormatError, match="there is no pose"):
            surfrecon.open([*recordings["A"], path], camera=CAMERA)


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
    assert done.returncode == 0 and "placed 4 scans by name" in done.stderr, done.stderr


def test_a_list_in_the_folder_of_its_scans_hides_none(tmp_path):
    """It says which it lacks, and aligning takes them all."""
    folder = tmp_path / "scans"
    folder.mkdir()
    surfrecon.write_scans(folder / "all.conf", look())
    (folder / "all.conf").unlink()
    files = sorted(path.name for path in folder.iterdir())
    placed = folder / "aligned.conf"
    placed.write_text("".join(f"bmesh {name} 0 0 0 0 0 0 1\n" for name in files[1:]))
    note = f"1 file of this folder is not in its list aligned.conf: {files[0]}"
    assert any(note in said for said in surfrecon.open(folder).notes)
    done = run("info", "scans", cwd=tmp_path)
    assert done.returncode == 0 and note in done.stderr, done.stderr
    report = tmp_path / "report.json"
    done = run("align", "scans", "-o", "scans/aligned.conf", "--report", "report.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert note not in done.stderr and len(json.loads(report.read_text())["report"]["scans"]) == len(files)
    placed.write_text("".join(f"bmesh {name} 0 0 0 0 0 0 1\n" for name in files[1:]))
    done = run("merge", "scans", "--align", "-o", "surface.ply", "--report", "report.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(json.loads(report.read_text())["report"]["alignment"]["scans"]) == len(files)


def test_a_trajectory_in_the_folder_of_its_images_hides_none(tmp_path, recordings):
    (tmp_path / "A" / "poses.tum").write_text(frames(".", range(3)))
    told = ("--camera", ",".join(map(str, CAMERA)))
    done = run("info", "A", *told, cwd=tmp_path)
    note = "2 files of this folder are not in its list poses.tum: frame_0003.npy, frame_0004.npy"
    assert done.returncode == 0 and note in done.stderr, done.stderr
    done = run("align", "A", *told, "--fixed", "0,1,2,3,4", "-o", "placed.tum", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert [f"A/frame_{k:04}.npy" in (tmp_path / "placed.tum").read_text() for k in range(5)] == [True] * 5
