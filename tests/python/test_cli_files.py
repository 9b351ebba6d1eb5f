"""Files that may be written, and where: known before the work, without loss of what is there."""

import json
import os
import shutil
import stat
import sys

import pytest
import surfrecon
from command_line import buffer_outside, data, run

POSIX = os.name == "posix"


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    return data(tmp_path_factory.mktemp("data"))


@pytest.fixture
def folder(given, tmp_path):
    shutil.copy(given / "torus.ply", tmp_path)
    (tmp_path / "d.ply").mkdir()
    (tmp_path / "d.json").mkdir()
    for name in ("kept.ply", "kept.json"):
        (tmp_path / name).write_text("kept")
        os.chmod(tmp_path / name, 0o444)
    yield tmp_path
    for name in ("kept.ply", "kept.json"):
        os.chmod(tmp_path / name, 0o644)


# That of the next is read before anything else is done, and would be refused.
UNREADABLE = "cut.ply"


@pytest.mark.parametrize(
    "arguments, code, said",
    [
        (["-o", "d.ply"], 1, "d.ply: this is a folder: give the name of a file in it"),
        (["-o", "a.ply", "--report", "d.json"], 1, "d.json: this is a folder: give the name of a file in it"),
        (["-o", "a.ply", "--report", "d.json/"], 1, "d.json/: this is a folder: give the name of a file in it"),
        (["-o", "a.ply", "--report", ""], 2, "the report has an empty name"),
        (["-o", "kept.ply"], 1, "kept.ply: the file is read-only"),
        (["-o", "a.ply", "--report", "kept.json"], 1, "kept.json: the file is read-only"),
        (["-o", ".ply"], 2, ".ply: the name of the output must end in .ply, "),
        (["-o", ""], 2, ": the name of the output must end in .ply, "),
        (["-o", "a.ply", "--levels", "500,100"], 2, "a.ply: several levels of detail go into a .glb alone"),
        (["-o", "a.glb", "--levels", "100,500"], 2, "levels must fall, and be 1 at least, got 100,500"),
        (["-o", "a.glb", "--levels", "100,100"], 2, "levels must fall, and be 1 at least, got 100,100"),
        (["-o", "a.glb", "--levels", "100,0"], 2, "levels must fall, and be 1 at least, got 100,0"),
        (["-o", "a.ply", "--report", "a.ply"], 2, "a.ply: the report needs a name of its own"),
        (["-o", "a.ply", "--report", "d.ply/../a.ply"], 2, "d.ply/../a.ply: the report needs a name of its own"),
    ],
)
def test_refusals_come_before_the_work(folder, arguments, code, said):
    """Before the input is read: it is no mesh."""
    (folder / UNREADABLE).write_bytes((folder / "torus.ply").read_bytes()[:2000])
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    done = run("cluster", UNREADABLE, *arguments, cwd=folder)
    assert done.returncode == code and said in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


@pytest.mark.skipif(not POSIX, reason="links need rights elsewhere")
def test_links_to_the_result_are_its_names(folder):
    os.symlink("a.ply", folder / "soft.json")
    os.symlink(".", folder / "here")
    done = run("convert", "torus.ply", "-o", "a.ply", cwd=folder)
    assert done.returncode == 0
    os.link(folder / "a.ply", folder / "hard.json")
    before = (folder / "a.ply").read_bytes()
    for report in ("soft.json", "hard.json", "here/a.ply"):
        done = run("convert", "torus.ply", "-o", "a.ply", "--report", report, cwd=folder)
        assert done.returncode == 2 and "the report needs a name of its own" in done.stderr
        assert (folder / "a.ply").read_bytes() == before
    # Nor are links to nothing yet.
    (folder / "hard.json").unlink()
    (folder / "a.ply").unlink()
    done = run("convert", "torus.ply", "-o", "a.ply", "--report", "soft.json", cwd=folder)
    assert done.returncode == 2 and not (folder / "a.ply").exists()
    # A file of several names would lose one of them, be it a result or a report.
    (folder / "one.json").write_text("one")
    os.link(folder / "one.json", folder / "two.json")
    done = run("info", "torus.ply", "--report", "one.json", cwd=folder)
    assert done.returncode == 1 and "one.json: this file has 2 names (hard links)" in done.stderr
    assert (folder / "two.json").read_text() == "one"


@pytest.mark.skipif(not POSIX, reason="links and permissions of POSIX")
def test_a_folder_in_which_no_file_can_be_made(folder):
    (folder / UNREADABLE).write_bytes((folder / "torus.ply").read_bytes()[:2000])
    os.symlink("no/a.ply", folder / "soft.ply")
    (folder / "closed").mkdir()
    os.chmod(folder / "closed", 0o555)
    cases = [("soft.ply", "soft.ply: there is no folder ")]
    # The administrator may write everywhere.
    if not os.access(folder / "closed", os.W_OK):
        cases.append(("closed/a.ply", "closed/a.ply: no file can be made in the folder closed"))
    for output, said in cases:
        done = run("cluster", UNREADABLE, "-o", output, cwd=folder)
        assert done.returncode == 1 and said in done.stderr, done.stderr


@pytest.mark.skipif(not os.path.exists("/dev/stderr"), reason="this system has no such names of streams")
@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_report_may_go_into_a_stream(folder, stream):
    done = run("info", "torus.ply", "--quiet", "--report", f"/dev/{stream}", cwd=folder, timeout=60)
    assert done.returncode == 0 and json.loads(getattr(done, stream))["state"] == "done"


def test_a_report_is_no_grid_that_a_list_takes_with_it(given, tmp_path):
    done = run("convert", given / "ring.conf", "-o", "a.conf", "--report", "scan03.ply", cwd=tmp_path)
    assert done.returncode == 2 and "scan03.ply: the report needs a name of its own" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not POSIX, reason="permissions of POSIX")
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664])
def test_reports_keep_permissions_as_results_do(folder, mode):
    for name in ("a.ply", "a.json"):
        (folder / name).write_text("")
        os.chmod(folder / name, mode)
    done = run("convert", "torus.ply", "-o", "a.ply", "--report", "a.json", cwd=folder)
    assert done.returncode == 0, done.stderr
    for name in ("a.ply", "a.json"):
        assert stat.S_IMODE((folder / name).stat().st_mode) == mode
    assert json.loads((folder / "a.json").read_text())["state"] == "done"


def test_what_names_of_files_in_a_recording_or_gltf_lead_to_is_read(given, tmp_path):
    buffer_outside(tmp_path, "m")
    (tmp_path / "list.conf").write_text("bmesh m.gltf 0 0 0 0 0 0 1\n")
    before = (tmp_path / "m 1.bin").read_bytes()
    for name in ("m.gltf", "list.conf"):
        done = run("info", name, "--report", "m 1.bin", cwd=tmp_path)
        assert done.returncode == 2 and "m 1.bin is read" in done.stderr
        assert (tmp_path / "m 1.bin").read_bytes() == before
    found = json.loads(run("info", "list.conf", "--json", cwd=tmp_path).stdout)
    assert [file["path"] for file in found["inputs"]] == ["list.conf", "m 1.bin", "m.gltf"]


@pytest.mark.skipif(sys.platform != "linux", reason="names that are not UTF-8 are Linux's")
def test_a_report_has_one_name_for_a_file(given, tmp_path):
    source = os.path.join(os.fspath(tmp_path), os.fsdecode(b"\xff.ply"))
    shutil.copy(given / "torus.ply", source)
    found = json.loads(run("info", source, "--json").stdout)
    (file,), (scan,) = found["inputs"], found["report"]["scans"]
    assert file["path"] == scan["path"] and file["path"].endswith("\ufffd.ply")
    assert file["path_hex"] == scan["path_hex"] == os.fsencode(source).hex()
    listed = json.loads(run("info", source, "--json", "--list").stdout)["report"]["scans"]
    assert listed[0]["path_hex"] == file["path_hex"]


def test_large_numbers_of_the_command_line(folder):
    for arguments in (["--fixed", "9" * 30], ["--angles", "9" * 401], ["--scale", "9" * 401], ["--fixed", "9" * 5000]):
        done = run("align", "torus.ply", *arguments, cwd=folder)
        assert done.returncode == 2 and "must be" in done.stderr and len(done.stderr) < 1000, done.stderr
    assert surfrecon.read(folder / "torus.ply").check().is_manifold


@pytest.fixture
def views(tmp_path):
    """Files of scans of one thing, which alone are in their folder."""
    mesh = surfrecon.sculpture(cell=3.0)
    made = surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=5, above=0, below=0, pixels=50))
    files = [tmp_path / f"scan{k}.ply" for k in range(len(made))]
    for path, scan in zip(files, made, strict=True):
        surfrecon.write(path, scan)
    return files


@pytest.mark.parametrize("keep", [150, -40], ids=["header", "end"])
def test_a_damaged_scan_of_many_is_skipped_and_named(views, keep, tmp_path_factory):
    """Of a folder and of several files: in notes and reports. By itself, or where all are so, it is an error."""
    folder, out = views[0].parent, tmp_path_factory.mktemp("out")
    views[1].write_bytes(views[1].read_bytes()[:keep])
    for given in ([folder], views):
        done = run("info", *given)
        assert done.returncode == 0 and done.stderr.count("scan1 is skipped: ") == 1, done.stderr
        assert "scan1.ply: " in done.stderr
        assert [line.split(":")[0] for line in done.stdout.splitlines()] == ["scan0", "scan2", "scan3", "scan4"]
        done = run("convert", *given, "-o", out / "all.conf")
        assert done.returncode == 0 and len(surfrecon.open(out / "all.conf")) == 4, done.stderr
        done = run("align", *given, "-o", out / "placed.tum")
        assert done.returncode == 0 and "scan1: not placed: it is skipped: " in done.stdout, done.stdout + done.stderr
        done = run("merge", *given, "-o", out / "out.ply")
        assert done.returncode == 0 and done.stderr.count("scan1 is skipped: ") == 1, done.stderr
        assert "4 of 5 scans, cells of" in done.stdout
    for command in (["info"], ["convert", "-o", out / "one.conf"], ["merge", "-o", out / "one.ply"]):
        done = run(command[0], views[1], *command[1:])
        assert done.returncode == 1 and "scan1.ply: " in done.stderr and "is skipped" not in done.stderr, done.stderr
    for path in views:
        path.write_bytes(path.read_bytes()[:100])
    for command in (["info"], ["align", "-o", out / "none.tum"], ["merge", "-o", out / "none.ply"]):
        done = run(command[0], folder, *command[1:])
        assert done.returncode == 1 and "scan0" in done.stderr, done.stdout + done.stderr
    assert not (out / "none.tum").exists() and not (out / "none.ply").exists()


def test_a_merge_into_the_folder_of_its_scans_may_be_repeated(views):
    """The surface of the first time is no scan of the second. A scan is not written over."""
    folder = views[0].parent
    out = folder / "surface.ply"
    said = f"{folder}: 1 file of this folder is a surface that was merged from scans, and is passed over: surface.ply"
    made = []
    for time in range(2):
        done = run("merge", folder, "-o", out)
        assert done.returncode == 0 and f"{len(views)} scans, cells of" in done.stdout, done.stdout + done.stderr
        assert done.stderr.count(said) == time, done.stderr
        made.append(out.read_bytes())
    assert made[0] == made[1]
    done = run("merge", folder, "-o", views[1])
    assert done.returncode == 2 and "scan1.ply is read: give the output another name" in done.stderr
