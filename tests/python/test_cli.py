"""Each command of the command line, what it says of what can't be, and exit codes."""

import hashlib
import json
import math
import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import entry_points

import numpy as np
import pytest
import surfrecon
from command_line import ENVIRONMENT, data, run
from heaps import look
from shapes import noisy_sphere, torus, torus_scans
from surfrecon.cli.commands import COMMANDS

VOXEL = 0.1


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return data(tmp_path_factory.mktemp("data"))


def test_depth_images_without_poses_are_told_of(tmp_path):
    row, col = np.mgrid[0:40, 0:50]
    for k in range(3):
        np.save(tmp_path / f"depth{k}.npy", 2 + 0.1 * k + 0.01 * np.abs(col - 25.0) + 0.004 * row)
    done = run("merge", tmp_path, "--camera", "60,60,25,20", "-o", tmp_path / "out.ply")
    assert done.returncode == 0 and (tmp_path / "out.ply").is_file()
    [said] = [line for line in done.stderr.splitlines() if "no scan has a pose" in line]
    assert "all 3 stand at one place" in said and "align them first, or give their poses" in said


def test_info(folder):
    done = run("info", folder / "ring.conf", folder / "torus.ply", folder / "points.xyz", "--check")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("scan00: range image, ") and "torus: mesh, 1,152 vertices" in done.stdout
    assert "  is_closed: True" in lines and "points: point cloud, 512 points" in done.stdout
    scans = json.loads(run("info", folder / "ring.conf", "--json", "--quiet").stdout)["report"]["scans"]
    expected = surfrecon.open(folder / "ring.conf")
    assert [scan["name"] for scan in scans] == [scan.name for scan in expected]
    assert scans[3]["samples"] == expected[3].read().valid.sum()
    assert np.allclose(scans[3]["world_from_sensor"], expected[3].read().world_from_sensor)
    points = np.concatenate([scan.read().world_points()[scan.read().valid] for scan in expected])
    assert np.allclose(np.min([scan["bounds"][0] for scan in scans], axis=0), points.min(0))
    assert run("info", "--list", folder / "ring.conf").stdout.split() == [scan["name"] for scan in scans]


def test_merge_is_that_of_the_library(folder, tmp_path):
    out, report = tmp_path / "out.ply", tmp_path / "report.json"
    done = run("merge", folder / "ring.conf", "-o", out, "--voxel", str(VOXEL), "--report", report)
    assert done.returncode == 0, done.stderr
    result = surfrecon.merge(surfrecon.open(folder / "ring.conf"), voxel=VOXEL)
    assert np.array_equal(surfrecon.read(out).triangles, result.mesh.triangles)
    found = json.loads(report.read_text())
    assert (found["state"], found["command"], found["version"]) == ("done", "merge", surfrecon.__version__)
    assert found["parameters"] == {"voxel": VOXEL} and found["notes"] == surfrecon.open(folder / "ring.conf").notes
    assert {k: v for k, v in found["report"].items() if k != "seconds"} == json.loads(
        surfrecon.Report({k: v for k, v in result.report.items() if k != "seconds"}).json()
    )
    # All files that were read, not only the list.
    scans = sorted(folder.glob("scan*.ply"))
    assert [file["path"] for file in found["inputs"]] == [str(folder / "ring.conf"), *map(str, scans)]
    for file in found["inputs"] + found["outputs"]:
        with open(file["path"], "rb") as content:
            assert hashlib.file_digest(content, "sha256").hexdigest() == file["sha256"]
        assert os.path.getsize(file["path"]) == file["bytes"]
    assert [file["path"] for file in found["outputs"]] == [str(out)]
    assert f"{out}: {len(result.mesh.positions):,} vertices" in done.stdout


def test_merge_aligns_first_if_asked_to(tmp_path):
    surfrecon.write_scans(tmp_path / "truth.conf", look())
    scans = sorted(tmp_path.glob("view*.ply"))
    done = run("merge", *scans, "--align", "-o", tmp_path / "surface.ply", "--json")
    assert done.returncode == 0, done.stderr
    aligned = surfrecon.align(surfrecon.open(scans))
    expected = surfrecon.merge(aligned.scans).mesh
    assert np.array_equal(surfrecon.read(tmp_path / "surface.ply").triangles, expected.triangles)
    report = json.loads(done.stdout)["report"]
    assert report["alignment"]["placed"] == aligned.report.placed == report["scans"] == len(scans)


def test_merge_refuses_scans_that_nothing_aligns(tmp_path):
    flat = np.zeros((40, 40))
    images = [surfrecon.RangeImage.orthographic(flat + k, step=(0.025, -0.025)) for k in range(2)]
    for k, image in enumerate(images):
        image.name = f"flat{k}"
    surfrecon.write_scans(tmp_path / "flats.conf", images)
    done = run("merge", *sorted(tmp_path.glob("flat*.ply")), "--align", "-o", tmp_path / "surface.ply")
    assert done.returncode != 0 and "no two scans fit each other in one place" in done.stderr
    assert not (tmp_path / "surface.ply").exists()


def test_merge_measures(folder, tmp_path):
    done = run("merge", folder / "ring.conf", "-o", tmp_path / "a.ply", "--voxel", "0.1", "--measure", "--json")
    distances = json.loads(done.stdout)["report"]["distances"]
    assert 0 < distances["mean"] <= distances["rms"] <= distances["max"] < VOXEL


def test_align_writes_a_list_that_places_the_scans(tmp_path):
    surfrecon.write_scans(tmp_path / "truth.conf", look())
    scans = sorted(tmp_path.glob("view*.ply"))
    done = run("align", *scans, "-o", tmp_path / "placed.conf", "--fixed", "0", "--threads", "2", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)["report"]
    states = [scan["state"] for scan in report["scans"]]
    assert states == ["kept"] + ["placed"] * 5, report["summary"]
    assert [scan.name for scan in surfrecon.open(tmp_path / "placed.conf")] == [path.stem for path in scans]
    done = run("align", *scans[:2], "--fixed", "0")
    assert done.returncode == 0 and "of 2 scans placed" in done.stdout


def test_depth_images_keep_their_times_and_their_camera(tmp_path):
    """A list that can't say the camera is refused before the work; a trajectory has the times that the names are."""
    row, col = np.mgrid[0:40, 0:50]
    names = ["1305031453.404816.npy", "1305031453.374112.npy"]
    for k, name in enumerate(names):
        np.save(tmp_path / name, 2 + 0.1 * k + 0.01 * np.abs(col - 25.0) + 0.004 * row)
    camera = "60,60,25,20"
    told = ("--camera", camera, "--fixed", "0,1")
    done = run("align", *names, *told, "-o", "placed.conf", cwd=tmp_path)
    assert done.returncode == 2 and "does not say the camera of the images" in done.stderr and ".tum" in done.stderr
    scans = surfrecon.open([tmp_path / name for name in names], camera=(60, 60, 25, 20))
    with pytest.raises(surfrecon.InputError, match=r"does not say its camera\. Write the poses as \.tum"):
        surfrecon.align(scans, fixed=[0, 1]).write(tmp_path / "placed.mlp")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    done = run("align", *names, *told, "-o", "placed.tum", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = (tmp_path / "placed.tum").read_text().splitlines()
    assert [line.split()[0] for line in lines] == ["#", "#", "1305031453.374112", "#", "1305031453.404816"]
    # Without the second line an image has no pose, and is passed over.
    (tmp_path / "placed.tum").write_text("\n".join(lines[:3]) + "\n")
    done = run("info", *names, "placed.tum", "--camera", camera, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "placed 1 scan by name, and 1 of 2 has no pose and is passed over" in done.stderr
    # Lists of others have times alone.
    (tmp_path / "placed.tum").write_text(lines[2] + "\n")
    done = run("info", *names, "placed.tum", "--camera", camera, cwd=tmp_path)
    assert "placed 1 scan by the times in their names, and 1 of 2 has no pose of its own within 0.02 s" in done.stderr


def test_align_tells_that_a_list_leads_out_of_its_folder(tmp_path):
    surfrecon.write_scans(tmp_path / "truth.conf", torus_scans(pixels=40)[:2])
    (tmp_path / "lists").mkdir()
    shutil.move(tmp_path / "scan01.ply", tmp_path / "lists")
    scans = ("scan00.ply", os.path.join("lists", "scan01.ply"))
    told = "1 scan lies outside of its folder, so merge refuses this list without --allow-outside. "
    for ending, is_told in [("conf", True), ("mlp", True), ("aln", True), ("tum", False)]:
        placed = os.path.join("lists", f"placed.{ending}")
        done = run("align", *scans, "--fixed", "0,1", "-o", placed, "--json", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert (told in done.stderr) == any(told in note for note in json.loads(done.stdout)["notes"]) == is_told
    # Named so that it is found from anywhere.
    found = surfrecon.open(tmp_path / "lists" / "placed.conf", allow_outside=True)
    assert [os.path.samefile(scan.path, tmp_path / path) for scan, path in zip(found, scans, strict=True)] == [True] * 2
    with pytest.raises(surfrecon.FormatError, match="leads out of the folder"):
        surfrecon.open(tmp_path / "lists" / "placed.conf")
    # All below: nothing to tell.
    done = run("align", *scans, "--fixed", "0,1", "-o", "placed.conf", cwd=tmp_path)
    assert done.returncode == 0 and "outside" not in done.stderr
    assert len(surfrecon.open(tmp_path / "placed.conf")) == 2


@pytest.mark.parametrize("ending", ["ply", "glb", "obj", "stl", "3mf"])
def test_convert_meshes(folder, tmp_path, ending):
    out = tmp_path / f"out.{ending}"
    done = run("convert", folder / "torus.ply", "-o", out)
    assert done.returncode == 0, done.stderr
    assert len(surfrecon.read(out).triangles) == len(torus(24).triangles)


def test_convert_scans(folder, tmp_path):
    depths = np.add.outer(np.arange(30.0), np.arange(40.0)) / 100 + 2
    images = [surfrecon.RangeImage.pinhole(depths, focal=(40, 40), centre=(20, 15), name=f"s{k}") for k in range(2)]
    images[1].world_from_sensor = np.array([[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1.0]])
    surfrecon.write_scans(tmp_path / "two.e57", images)
    for name in ("all.e57", "all.ptx", "all.conf"):
        out = tmp_path / name
        done = run("convert", tmp_path / "two.e57", "-o", out, "--json")
        assert done.returncode == 0, done.stderr
        for scan, image in zip(surfrecon.open(out), images, strict=True):
            assert np.allclose(scan.read().world_points(), image.world_points(), atol=1e-5, equal_nan=True)
        written = {os.path.basename(file["path"]) for file in json.loads(done.stdout)["outputs"]}
        assert written == {name} | ({"s0.ply", "s1.ply"} if name.endswith("conf") else set())
    done = run("convert", folder / "ring.conf", "--scan", "scan03", "--mesh", "-o", tmp_path / "one.stl")
    assert done.returncode == 0, done.stderr
    image = surfrecon.open(folder / "ring.conf")[3].read()
    mesh = surfrecon.read(tmp_path / "one.stl")
    assert len(mesh.triangles) == len(image.triangulate().triangles)
    points = image.world_points()[image.valid]
    assert np.abs(mesh.bounds - [points.min(0), points.max(0)]).max() < 0.2
    done = run("convert", folder / "ring.conf", "--scan", "3", "-o", tmp_path / "one.ply")
    assert "the pose is left out" in done.stderr and isinstance(
        surfrecon.read(tmp_path / "one.ply"), surfrecon.RangeImage
    )
    done = run("convert", folder / "points.xyz", "-o", tmp_path / "points.ply")
    assert len(surfrecon.read(tmp_path / "points.ply").positions) == 512


def test_sculpt(folder, tmp_path):
    done = run("sculpt", folder / "ring.conf", "--scan", "8", "-o", tmp_path / "a.ply", "--tolerance", "0.01", "--json")
    report = json.loads(done.stdout)["report"]
    image = surfrecon.open(folder / "ring.conf")[8].read()
    mesh = surfrecon.read(tmp_path / "a.ply")
    assert report["triangles"] == len(mesh.triangles) < report["full_triangles"] and report["max_error"] <= 0.01
    # In the world, where the scans are.
    points = image.world_points()[image.valid]
    assert np.abs(mesh.bounds - [points.min(0), points.max(0)]).max() < 0.1


def test_quads(folder, tmp_path):
    done = run("quads", folder / "ring.conf", "--scan", "8", "-o", tmp_path / "a.obj", "--rows", "5", "--columns", "5")
    assert done.returncode == 0 and (tmp_path / "a.obj").read_text().count("\nf ") > 0, done.stderr
    assert "5 x 5 vertices" in done.stdout and "sensor's frame" in done.stderr


@pytest.mark.parametrize("name", ["points.xyz", "ball.ply"])
def test_reconstruct(folder, tmp_path, name):
    done = run("reconstruct", folder / name, "-o", tmp_path / "a.glb", "--closure", "closed", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["report"]["closed"] and surfrecon.read(tmp_path / "a.glb").check().is_closed


def test_reconstruct_says_what_became_of_the_points(tmp_path):
    np.savetxt(tmp_path / "noisy.xyz", noisy_sphere())

    def made(*options):
        command = ["reconstruct", tmp_path / "noisy.xyz", "-o", tmp_path / "a.ply", *options]
        return run(*command).stdout, json.loads(run(*command, "--json").stdout)["report"]

    said, report = made()
    outliers = report["dropped"]["outlier"]
    assert outliers > 100 and report["moved"] > 0
    assert f"closed, of {report['used']:,} of 5,250 points" in said and f"left out: {outliers:,} outliers" in said
    assert f"moved by {report['moved']:.4g} (root mean square) within {report['smoothing']:.4g}" in said
    said, put_back = made("--noisy-points", "put_back")
    assert put_back["dropped"] == report["dropped"]
    assert f"closed, through {report['used']:,} of 5,250 points" in said and "moved" not in said


@pytest.mark.parametrize("command", [["reconstruct", "--closure", "open"], ["cluster", "--vertices", "80"]])
def test_surfaces_of_points_know_the_place_of_a_sensor(tmp_path, command):
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0)) + 0.3 * np.random.default_rng(1).random((2, 20, 20))
    # Above the sensor, which is moved and turned by a quarter.
    image = surfrecon.RangeImage.from_points(np.stack([x, y, 30 + 0.02 * x**2], 2), viewing=("from", (0, 0, 0)))
    image.world_from_sensor = [[0, -1, 0, 30], [1, 0, 0, 0], [0, 0, 1, -50], [0, 0, 0, 1]]
    surfrecon.write_scans(tmp_path / "a.e57", [image])
    done = run(command[0], tmp_path / "a.e57", "-o", tmp_path / "a.ply", *command[1:])
    assert done.returncode == 0, done.stderr
    mesh = surfrecon.read(tmp_path / "a.ply")
    a, b, c = mesh.positions[mesh.triangles.T]
    # Of an open surface the other side is up.
    assert (np.cross(b - a, c - a)[:, 2] < 0).mean() > 0.9
    points = image.world_points()[image.valid]
    assert np.abs(mesh.bounds - [points.min(0), points.max(0)]).max() < 0.5


def test_cluster(folder, tmp_path):
    done = run("cluster", folder / "torus.ply", "-o", tmp_path / "a.ply", "--vertices", "150", "--json")
    report = json.loads(done.stdout)["report"]
    assert report["vertices"] == len(surfrecon.read(tmp_path / "a.ply").positions) <= 200
    done = run("cluster", folder / "points.xyz", "-o", tmp_path / "a.glb", "--levels", "200,60", "--json")
    first, second = json.loads(done.stdout)["report"]["levels"]
    assert first["vertices"] > second["vertices"] and b"MSFT_lod" in (tmp_path / "a.glb").read_bytes()
    done = run("cluster", folder / "torus.ply", "-o", tmp_path / "b.glb", "--levels", "200,60", "--patches", "9")
    assert done.returncode == 2 and "give levels or patches, not both" in done.stderr
    done = run("cluster", folder / "torus.ply", "-o", tmp_path / "c.ply", "--triangles", "200")
    said = r"100 vertices, 200 triangles, 0\.\d+ off at most, 0\.\d+ root mean square"
    assert re.search(said, done.stdout), done.stdout


def test_measure(folder, tmp_path):
    mesh = torus(24)
    moved = surfrecon.Mesh(mesh.positions + (0, 0, 0.01), mesh.triangles)
    moved.write(tmp_path / "moved.ply", encoding="binary_double")
    found = json.loads(run("measure", tmp_path / "moved.ply", folder / "torus.ply", "--json").stdout)
    expected = surfrecon.surface_distance(moved, surfrecon.read(folder / "torus.ply"))
    assert found["report"] == {k: v for k, v in expected.items() if k not in ("distances", "bias")}
    assert len(found["inputs"]) == 2
    # Without signs there is no bias.
    assert "bias" not in found["report"]
    with_signs = json.loads(run("measure", tmp_path / "moved.ply", folder / "torus.ply", "--json", "--signed").stdout)
    assert abs(with_signs["report"]["bias"]) <= with_signs["report"]["mean"]
    found = json.loads(run("measure", folder / "points.xyz", folder / "ring.conf", "--json").stdout)["report"]
    cloud = surfrecon.read(folder / "points.xyz").positions
    assert math.isclose(found["max"], surfrecon.distances(cloud, surfrecon.open(folder / "ring.conf")).max())
    said = run("measure", folder / "torus.ply", folder / "torus.ply").stdout
    assert said.startswith("mean 0, ")
    assert run("measure", folder / "torus.ply").returncode == 2


def test_completion():
    pytest.importorskip("shtab")
    for shell in ("bash", "zsh", "fish"):
        done = run("completion", shell)
        assert done.returncode == 0 and "merge" in done.stdout and "max-hole-length" in done.stdout, done.stderr
    assert run("completion", "csh").returncode == 2


def test_completion_without_shtab_says_what_to_install(tmp_path):
    (tmp_path / "shtab.py").write_text("raise ImportError")
    program = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from surfrecon.cli.program import run; run(sys.argv[1:])"
    )
    done = subprocess.run([sys.executable, "-c", program, "completion", "bash"], env=ENVIRONMENT, capture_output=True)
    assert done.stderr.decode().strip() == "surfrecon: completion: completion needs shtab: pip install 'surfrecon[cli]'"


def test_the_program_is_installed_with_the_package():
    (script,) = (one for one in entry_points(group="console_scripts") if one.name == "surfrecon")
    assert script.load() is surfrecon.cli.main


def test_help_and_version():
    assert run("--version").stdout == f"surfrecon {surfrecon.__version__}\n"
    whole = run("--help").stdout
    assert all(f"\n    {name}" in whole for name in COMMANDS) and "130" in whole
    for name, command in COMMANDS.items():
        said = " ".join(run(name, "--help").stdout.split())
        for row in command.options().values():
            assert f"--{row.name.replace('_', '-')}" in said
            assert " ".join(row.text.split())[:25] in said, row.name
    said = " ".join(run("merge", "--help").stdout.split())
    assert f"<= {math.pi / 2}, in radians, or in degrees as 80deg. Default: {math.pi / 2}." in said


@pytest.mark.parametrize(
    "arguments, said",
    [
        ([], "surfrecon: the following arguments are required: COMMAND"),
        (["melt"], "surfrecon: argument COMMAND: must be one of info, convert, "),
        (["mrege"], "got 'mrege'. Did you mean 'merge'? surfrecon --help says more."),
        (["completion", "zhs"], "must be one of bash, zsh, fish, got 'zhs'. Did you mean 'zsh'?"),
        (["align", "a.ply", "-o", "a.tum", "--start", "sequnce"], 'got "sequnce". Did you mean "sequence"?'),
        (["merge", "a.ply", "-o", "b.ply", "--max_memroy=1"], "--max_memroy=1. Did you mean --max-memory?"),
        (["merge", "a.ply", "--outptu", "b.ply"], "unrecognized arguments: --outptu. Did you mean --output?"),
        (["merge", "a.ply", "-o", "b.ply", "--no-colors"], "unrecognized arguments: --no-colors"),
        (["merge", "a.ply"], "surfrecon: merge: the following arguments are required: -o/--output"),
        (["merge", "a.ply", "-o", "b.ply", "--voxel", "0"], "surfrecon: merge: argument --voxel: voxel must be "),
        (["merge", "a.ply", "-o", "b.ply", "--voxels", "1"], "surfrecon: merge: unrecognized arguments: --voxels"),
        (["merge", "a.ply", "-o", "b.docx"], "b.docx: the name of the output must end in .ply, "),
        (
            ["merge", "a.ply", "-o", "b.ply", "--max-memory", "4 apples"],
            "--max-memory: must be bytes, or a number with",
        ),
        (["merge", "a.ply", "-o", "b.glb", "--encoding", "ascii"], 'b.glb: only .ply has the encoding "ascii"'),
        (["align", "a.ply", "-o", "b.ply"], "must end in .conf, .mlp, .aln or .tum"),
        (["batch", "a.toml", "--onl", "b"], "surfrecon: batch: unrecognized arguments: --onl"),
        (["merge", "a.ply", "-o", "b.ply", "--report", "./b.ply"], "./b.ply: the report needs a name of its own"),
        (["batch", "a.toml", "--report", "a.toml"], "a.toml: the report needs a name of its own"),
    ],
)
def test_wrong_use_is_exit_code_2_and_one_line(arguments, said, tmp_path):
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode == 2 and said in done.stderr and done.stdout == ""
    assert done.stderr.startswith("surfrecon: ") and done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_files_that_cannot_be_used_are_exit_code_1_and_one_line(folder, tmp_path):
    (tmp_path / "cut.ply").write_bytes((folder / "torus.ply").read_bytes()[:2000])
    (tmp_path / "no.txt").write_bytes(b"MZ\0\0")
    cases = [
        (["info", "missing.ply"], "missing.ply"),
        (["info", "cut.ply"], "cut.ply"),
        (["info", "no.txt"], "no.txt"),
        (["merge", folder / "points.xyz", "-o", "a.ply"], "points"),
        (["merge", folder / "ring.conf", "-o", "no/a.ply"], "no/a.ply: there is no folder no"),
        (["info", folder / "ring.conf", "--report", "no/a.json"], "no/a.json: there is no folder no"),
        (["sculpt", folder / "ring.conf", "-o", "a.ply"], "there are 12 scans: choose one with --scan"),
        (["sculpt", folder / "ring.conf", "--scan", "x", "-o", "a.ply"], "there is no scan 'x'"),
        (["sculpt", folder / "ring.conf", "--scan", "scn03", "-o", "a.ply"], "from 0 to 11. Did you mean 'scan03'?"),
        (["sculpt", folder / "torus.ply", "-o", "a.ply"], "torus is a mesh: sculpt takes a range image"),
        (["convert", folder / "torus.ply", folder / "ring.conf", "-o", "a.e57"], "only range images share a file"),
        (["convert", folder / "points.xyz", "--mesh", "-o", "a.stl"], "make a mesh of it with surfrecon reconstruct"),
        (["merge", folder / "ring.conf", "-o", "a.ply", "--voxel", "1e-5", "--max-memory", "40MB"], "a voxel of"),
        (["batch", "missing.toml"], "missing.toml: No such file or directory"),
    ]
    before = sorted(tmp_path.iterdir())
    for arguments, said in cases:
        done = run(*arguments, cwd=tmp_path)
        assert done.returncode == 1 and said in done.stderr, (arguments, done.stderr)
        problems = [line for line in done.stderr.splitlines() if "quaternions" not in line]
        assert len(problems) == 1 and problems[0].startswith(f"surfrecon: {arguments[0]}: "), done.stderr
        assert sorted(tmp_path.iterdir()) == before


def test_what_is_read_is_not_written_over(folder, tmp_path):
    for name in ["ring.conf", *(f"scan{k:02}.ply" for k in range(12))]:
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for arguments in (
        ["merge", "ring.conf", "-o", "scan03.ply"],
        ["merge", "ring.conf", "-o", "./scan03.ply"],
        # The grids of the list have the names of the scans.
        ["convert", "ring.conf", "-o", "other.conf"],
        ["info", "ring.conf", "--report", "ring.conf"],
    ):
        done = run(*arguments, cwd=tmp_path)
        assert done.returncode == 2 and "is read: give the output another name" in done.stderr, done.stderr
        assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_what_is_there_is_replaced(folder, tmp_path):
    (tmp_path / "a.ply").write_text("old")
    (tmp_path / "a.json").write_text("old")
    done = run("convert", folder / "torus.ply", "-o", tmp_path / "a.ply", "--report", tmp_path / "a.json")
    assert done.returncode == 0
    assert len(surfrecon.read(tmp_path / "a.ply").triangles) == len(torus(24).triangles)
    assert json.loads((tmp_path / "a.json").read_text())["state"] == "done"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "a.ply"]


def test_quiet_says_nothing_and_provenance_may_be_left_out(folder, tmp_path):
    done = run(
        "merge", folder / "ring.conf", "-o", tmp_path / "a.ply", "-q", "--no-provenance", "--report", tmp_path / "a"
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    report = json.loads((tmp_path / "a").read_text())
    assert report["inputs"] == [] and report["outputs"] == [{"path": str(tmp_path / "a.ply")}]
