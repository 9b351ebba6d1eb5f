"""Many jobs of a manifest: what is done stays, what failed or has changed runs again."""

import hashlib
import json
import os
import shutil
import time

import pytest
import surfrecon
from command_line import run, start, states
from shapes import torus, torus_scans

MANIFEST = """
[defaults]
threads = 1

[defaults.merge]
voxel = 0.1

[[job]]
name = "surface"
command = "merge"
inputs = ["ring.conf"]
output = "surface.ply"

[[job]]
command = "cluster"
inputs = ["surface.ply"]
output = "levels.glb"
parameters = { levels = [300, 80] }

[[job]]
name = "broken"
command = "sculpt"
inputs = ["missing.ply"]
output = "broken.ply"
parameters = { grazing_limit = "80deg" }

[[job]]
name = "distance"
command = "measure"
inputs = ["levels.glb", "surface.ply"]
report = "distance.json"
"""


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    surfrecon.write_scans(folder / "ring.conf", torus_scans(pixels=40))
    return folder


@pytest.fixture
def folder(data, tmp_path):
    for path in data.iterdir():
        shutil.copy(path, tmp_path)
    (tmp_path / "jobs.toml").write_text(MANIFEST)
    return tmp_path


ALL = ("surface", "levels.glb", "broken", "distance")
FIRST = {"surface": "done", "levels.glb": "done", "broken": "failed", "distance": "done"}
AGAIN = {"surface": "up to date", "levels.glb": "up to date", "broken": "failed", "distance": "up to date"}


def test_jobs_run_once(folder):
    assert states(folder) == FIRST
    report = json.loads((folder / "surface.ply.json").read_text())
    assert report["parameters"] == {"threads": 1, "voxel": 0.1} and report["state"] == "done"
    assert json.loads((folder / "distance.json").read_text())["report"]["bound"] > 0
    failed = json.loads((folder / "broken.ply.json").read_text())
    assert failed["state"] == "failed" and "missing.ply" in failed["error"]
    assert not (folder / "broken.ply").exists()
    before = {path.name: path.stat().st_mtime_ns for path in folder.iterdir() if "broken" not in path.name}
    assert states(folder) == AGAIN
    assert before == {path.name: path.stat().st_mtime_ns for path in folder.iterdir() if "broken" not in path.name}


def test_what_has_changed_runs_again(folder):
    states(folder)
    only = ("--only", "surface", "--only", "levels.glb", "--only", "distance")
    done = dict.fromkeys(("surface", "levels.glb", "distance"), "up to date")
    assert states(folder, *only, code=0) == done
    manifest = folder / "jobs.toml"

    def with_change(change):
        change()
        return states(folder, *only, code=0)

    # The number of threads has no say in a result.
    text = manifest.read_text()
    assert with_change(lambda: manifest.write_text(text.replace("threads = 1", "threads = 2"))) == done
    # A parameter: and what is made of the result, but not what comes out the same.
    changed = with_change(lambda: manifest.write_text(text.replace("[300, 80]", "[300, 90]")))
    assert changed == done | {"levels.glb": "done", "distance": "done"}
    # The output, by hand.
    assert with_change(lambda: (folder / "surface.ply").write_bytes(b"ply")) == done | {"surface": "done"}
    assert with_change(lambda: os.remove(folder / "surface.ply")) == done | {"surface": "done"}
    # The report.
    assert with_change(lambda: (folder / "surface.ply.json").write_text("{")) == done | {"surface": "done"}
    # A file that the list of scans names.
    image = surfrecon.open(folder / "scan03.ply")[0].read()
    image.write(folder / "scan03.ply")
    colourless = surfrecon.RangeImage.from_points(image.points + 0.01, viewing=("parallel", (0, 0, -1)), name="scan03")
    assert with_change(lambda: colourless.write(folder / "scan03.ply"))["surface"] == "done"
    # A pose that appears beside it, or another version.
    report = json.loads((folder / "surface.ply.json").read_text())
    report["version"] = "0.0.1"
    assert with_change(lambda: (folder / "surface.ply.json").write_text(json.dumps(report))) == done | {
        "surface": "done"
    }
    assert states(folder, *only, "--force", code=0) == dict.fromkeys(done, "done")


def test_a_folder_that_is_moved_is_still_done(folder, tmp_path_factory):
    states(folder)
    other = tmp_path_factory.mktemp("other") / "place"
    shutil.copytree(folder, other)
    assert states(other) == AGAIN
    # Whatever folder one works in.
    done = run("batch", "jobs.toml", "--json", cwd=other)
    assert {job["name"]: job["state"] for job in json.loads(done.stdout)["jobs"]} == AGAIN


def test_a_dry_run_runs_nothing(folder):
    before = sorted(folder.iterdir())
    assert states(folder, "--dry-run", code=0) == dict.fromkeys(ALL, "to do")
    assert sorted(folder.iterdir()) == before
    states(folder)
    assert states(folder, "--dry-run", code=0) == AGAIN | {"broken": "to do"}
    (folder / "surface.ply").unlink()
    expected = {"surface": "to do", "levels.glb": "to do", "broken": "to do", "distance": "to do"}
    assert states(folder, "--dry-run", code=0) == expected


def test_failures_stop_others_only_if_asked(folder):
    assert states(folder, "--stop") == {name: FIRST[name] for name in ALL[:3]}
    done = run("batch", folder / "jobs.toml")
    assert done.stdout == "4 jobs: 2 up to date, 1 failed, 1 done\n"
    assert "surfrecon: batch: broken: failed: " in done.stderr
    quiet = run("batch", folder / "jobs.toml", "--quiet")
    assert (
        quiet.stdout == "" and quiet.stderr.startswith("surfrecon: batch: broken: ") and quiet.stderr.count("\n") == 1
    )


@pytest.mark.parametrize(
    "old, new, said",
    [
        ('command = "merge"', 'command = "melt"', "job 'surface': command must be one of info, convert, "),
        ('command = "merge"', 'command = "mrege"', "got 'mrege'. Did you mean 'merge'?"),
        ("voxel = 0.1", "voxels = 0.1", "merge has no parameter 'voxels'. Did you mean 'voxel'?"),
        ("voxel = 0.1", "grille = 0.1", "merge has no parameter 'grille'. surfrecon merge --help lists them."),
        ("voxel = 0.1", "voxel = 0", "defaults.merge: voxel must be a finite number > 0, got 0"),
        (
            'command = "measure"',
            'command = "measure"\nparameters.threads = true',
            "must be a whole number >= 0 and <= 1024, got True",
        ),
        ("[300, 80]", "[80, 300]", "job 'levels.glb': levels must fall"),
        ('output = "levels.glb"', 'output = "levels.ply"', "levels.ply: several levels of detail go into a .glb alone"),
        (
            "parameters = { levels = [300, 80] }",
            "parameters.vertices = true",
            "vertices must be a whole number >= 1 and ",
        ),
        (
            "parameters = { levels = [300, 80] }",
            "parameters.vertices = 5.0",
            "vertices must be a whole number >= 1 and ",
        ),
        (
            "parameters = { levels = [300, 80] }",
            "parameters.vertices = '5'",
            "vertices must be a whole number >= 1 and ",
        ),
        ("threads = 1", "threads = 'x'", "defaults: threads must be a whole number >= 0 and "),
        ("threads = 1", "quads.nope = 1", "defaults.quads: quads has no parameter 'nope'"),
        ("threads = 1", "reconstruct.threads = 'x'", "defaults.reconstruct: threads must be a whole number >= 0 and "),
        ("voxel = 0.1", "voxel = '0.1'", "voxel must be a finite number > 0, got '0.1'"),
        ("voxel = 0.1", "match_exposure = 1", "match_exposure must be on or off, got 1"),
        ("[300, 80]", "[300, -80]", "job 'levels.glb': levels must be whole numbers >= 0"),
        ("[300, 80]", "[]", "levels must be whole numbers >= 0"),
        ('"80deg"', '"95deg"', "job 'broken': grazing_limit must be > 0 and <= 1.57"),
        ("threads = 1", "colour = 1", "defaults: there is no command and no parameter 'colour'"),
        ("[defaults.merge]\nvoxel = 0.1", "merge = 1", "defaults: 'merge' must be a table"),
        ("threads = 1", "threads = {}", "defaults: 'threads' must be a value"),
        ('inputs = ["ring.conf"]', 'inputs = "ring.conf"', "inputs must be a list of files and folders"),
        ('inputs = ["ring.conf"]', "inputs = []", "inputs must be a list of files and folders"),
        ('inputs = ["ring.conf"]', 'input = ["ring.conf"]', "there is no key 'input': a job may have name, command, "),
        ('inputs = ["ring.conf"]', 'input = ["ring.conf"]', "report, parameters. Did you mean 'inputs'?"),
        ('output = "surface.ply"', 'output = "surface.txt"', "the name of the output must end in .ply"),
        ('output = "surface.ply"', 'report = "surface.json"', "merge needs an output"),
        (
            'report = "distance.json"',
            'output = "distance.ply"',
            "measure writes nothing: give report instead of output",
        ),
        ('report = "distance.json"', "", "measure needs a report"),
        ('output = "broken.ply"', 'output = "./surface.ply"', "another has the same output: job 'surface'"),
        ('report = "distance.json"', 'report = "jobs.toml"', "job 'distance': "),
        ('output = "levels.glb"', 'output = "levels.glb"\nreport = "levels.glb"', "the report needs a name of its own"),
        ('name = "broken"', 'name = "surface"', "job 'surface': another has the same name"),
        ("[[job]]", "[[jobs]]", "there is no key 'jobs': a manifest may have [defaults] and [[job]]"),
        ("[[job]]", "[[job", "jobs.toml: "),
    ],
)
def test_a_wrong_manifest_runs_nothing(folder, old, new, said):
    assert old in MANIFEST
    (folder / "jobs.toml").write_text(MANIFEST.replace(old, new))
    before = sorted(folder.iterdir())
    done = run("batch", folder / "jobs.toml")
    assert done.returncode == 2 and sorted(folder.iterdir()) == before, done.stderr
    assert said in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("surfrecon: batch: ")


def test_a_job_that_is_not_there(folder):
    done = run("batch", folder / "jobs.toml", "--only", "nothing")
    assert done.returncode == 2 and "there is no job 'nothing'" in done.stderr
    (folder / "jobs.toml").write_bytes(b"\xff")
    assert run("batch", folder / "jobs.toml").returncode == 2


MERGE = '[[job]]\ncommand = "merge"\ninputs = ["ring.conf"]\noutput = "m{}.ply"\nparameters.voxel = {}\n'
MANY = "".join(MERGE.format(k, 0.04 + k / 1000) for k in range(6))


def test_a_batch_that_is_killed_leaves_whole_files_and_goes_on(folder):
    """Killed again and again it still gets to its end, and what it has done by then it does not do again."""
    (folder / "jobs.toml").write_text(MANY)
    names = {path.name for path in folder.iterdir()}
    began = time.monotonic()
    run("batch", folder / "jobs.toml", "--only", "m0.ply")
    one = time.monotonic() - began
    for path in folder.glob("m0*"):
        path.unlink()
    finished = {}
    for k in range(60):
        program = start("batch", folder / "jobs.toml", "--quiet")
        time.sleep(one * (0.6 + 0.1 * (k % 9)))
        program.kill()
        ended = program.wait()
        for path in folder.iterdir():
            if path.name in names:
                continue
            # Nothing is half written: reports are JSON, meshes are what their reports say.
            assert path.name.startswith("m"), path.name
            if path.suffix == ".json":
                report = json.loads(path.read_text())
                (output,) = report["outputs"]
                assert report["state"] == "done"
                assert hashlib.sha256((folder / path.stem).read_bytes()).hexdigest() == output["sha256"]
                # Done once.
                assert finished.setdefault(path.name, path.stat().st_mtime_ns) == path.stat().st_mtime_ns
            else:
                assert len(surfrecon.read(path).triangles) > 0
        if len(finished) == 6 and ended == 0:
            break
    assert states(folder, code=0) == {f"m{k}.ply": "up to date" for k in range(6)}


def test_jobs_without_hashes_are_never_up_to_date(folder):
    only = ("--only", "surface")
    assert states(folder, *only, "--no-provenance", code=0) == {"surface": "done"}
    assert states(folder, *only, code=0) == {"surface": "done"}
    assert states(folder, *only, code=0) == {"surface": "up to date"}


def test_a_report_that_cannot_be_written_is_a_failure(folder):
    os.mkdir(folder / "surface.ply.json")
    done = run("batch", folder / "jobs.toml", "--only", "surface")
    assert done.returncode == 1 and "surface.ply.json: " in done.stderr
    torus(10).write(folder / "input.ply")
    (folder / "jobs.toml").write_text(
        '[[job]]\ncommand = "convert"\ninputs = ["input.ply"]\noutput = "a.stl"\nreport = "input.ply"\n'
    )
    done = run("batch", folder / "jobs.toml")
    assert done.returncode == 2 and "is read by job 'a.stl': give the report another name" in done.stderr
    # A missing folder is known before the work.
    (folder / "jobs.toml").write_text(
        '[[job]]\ncommand = "convert"\ninputs = ["input.ply"]\noutput = "a.stl"\nreport = "no/a.json"\n'
    )
    done = run("batch", folder / "jobs.toml")
    assert done.returncode == 1 and "no/a.json: there is no folder" in done.stderr
    assert not (folder / "a.stl").exists()
    assert len(surfrecon.read(folder / "input.ply").triangles) > 0


def test_results_may_go_into_the_folder_that_is_read(folder):
    (folder / "jobs.toml").unlink()
    for name in ("align", "convert"):
        place = folder / name
        place.mkdir()
        for path in folder.glob("scan0*.ply"):
            shutil.copy(path, place)
    manifest = """
[[job]]
command = "align"
inputs = ["align"]
output = "align/placed.conf"
parameters = { fixed = [0] }
"""
    (folder / "jobs.toml").write_text(manifest)
    assert states(folder, code=0) == {"align/placed.conf": "done"}
    # But a scan of it is not written over.
    text = manifest.replace("align/placed.conf", "convert/scan03.ply").replace('"align"', '"convert"')
    (folder / "jobs.toml").write_text(text.replace("fixed = [0]", "scan = '3'"))
    before = (folder / "convert" / "scan03.ply").read_bytes()
    assert states(folder) == {"convert/scan03.ply": "failed"}
    assert (folder / "convert" / "scan03.ply").read_bytes() == before
