"""Many jobs of a manifest: what is done stays, what failed or has changed runs again."""

import hashlib
import json
import os
import shutil
import struct
import subprocess
import sys
import time
import zlib

import numpy as np
import pytest
import surfrecon
from command_line import ENVIRONMENT, run, start
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


def states(folder, *options, code=1):
    """What became of each job."""
    done = run("batch", folder / "jobs.toml", "--json", *options)
    assert done.returncode == code, done.stderr
    return {job["name"]: job["state"] for job in json.loads(done.stdout)["jobs"]}


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
        ("voxel = 0.1", "voxels = 0.1", "merge has no parameter 'voxels'"),
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
        ('inputs = ["ring.conf"]', 'input = ["ring.conf"]', "there is no key 'input': a job has name, command, inputs"),
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
        ("[[job]]", "[[jobs]]", "there is no key 'jobs': a manifest has [defaults] and [[job]]"),
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


def job(command, inputs, **keys):
    """A job as a manifest has it."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in {"command": command, "inputs": inputs, **keys}.items()]
    return "\n".join(["[[job]]", *lines, ""])


def buffer_outside(folder, name):
    """A triangle as glTF whose buffer is a file of its own."""
    buffer = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    (folder / f"{name} 1.bin").write_bytes(buffer)
    whole = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": f"{name}%201.bin"}],
    }
    (folder / f"{name}.gltf").write_text(json.dumps(whole))


def recording(folder):
    """Two frames of nerfstudio's layout, with depth."""
    (folder / "images").mkdir(parents=True)
    frames = []
    for k in range(2):
        depths = np.add.outer(np.arange(12), np.arange(16)).astype(">u2") + 1000 + k
        (folder / "images" / f"d{k}.pgm").write_bytes(b"P5 16 12 65535\n" + depths.tobytes())
        pixels = bytes([0]) + bytes([10 * k + 5, 20, 30]) * 16
        chunks = (
            (b"IHDR", struct.pack(">2I5B", 16, 12, 8, 2, 0, 0, 0)),
            (b"IDAT", zlib.compress(pixels * 12)),
            (b"IEND", b""),
        )
        parts = [
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
            for kind, data in chunks
        ]
        (folder / "images" / f"c{k}.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
        # Colour is found without its ending, too.
        name = "images/c0" if k == 0 else "images/c1.png"
        frame = {"file_path": name, "depth_file_path": f"images/d{k}.pgm", "transform_matrix": np.eye(4).tolist()}
        frames.append(frame)
    camera = {"w": 16, "h": 12, "fl_x": 20, "fl_y": 20, "cx": 8, "cy": 6}
    (folder / "transforms.json").write_text(json.dumps({**camera, "frames": frames}))


CONFLICTS = [
    # What a job reads, and what another writes.
    (
        [("a", "x.ply", "y.ply"), ("b", "y.ply", "x.ply")],
        None,
        "job 'b': {}/x.ply is read by job 'a', which runs before",
    ),
    ([("a", "x.ply", "y.ply"), ("b", "x.ply", "./y.ply")], None, "job 'b': another has the same output: job 'a'"),
    ([("a", "x.ply", "x.ply")], None, "job 'a': {}/x.ply is read: give the output another name"),
    ([("a", "ring.conf", "y.ply"), ("b", "x.ply", "scan03.ply")], None, "scan03.ply is read by job 'a'"),
    # Reports.
    ([("a", "x.ply", "y.ply", "y.ply")], None, "job 'a': {}/y.ply is the output of job 'a' already: the report needs"),
    ([("a", "x.ply", "y.ply", "z.ply"), ("b", "x.ply", "z.ply")], None, "{}/z.ply is the output of job 'b' already"),
    ([("a", "x.ply", "y.ply", "b"), ("b", "x.ply", "z.ply", "b")], None, "{}/b is the report of job 'a' already"),
    ([("a", "x.ply", "y.ply", "jobs.toml")], None, "job 'a': {}/jobs.toml is the manifest already: the report needs"),
    ([("a", "x.ply", "y.ply"), ("b", "y.ply", "z.ply", "x.ply")], None, "job 'b': {}/x.ply is read by job 'a'"),
    ([("a", "m.gltf", "y.ply", "m 1.bin")], None, "job 'a': {}/m 1.bin is read by job 'a'"),
    ([("a", "ns/transforms.json", "y.e57", "ns/images/c0.png")], None, "c0.png is read by job 'a'"),
    ([("a", "ns", "y.e57", "ns/transforms.json")], None, "transforms.json is read by job 'a'"),
    # The summary's.
    ([("a", "x.ply", "y.ply")], "x.ply", "{}/x.ply is read by job 'a'"),
    ([("a", "x.ply", "y.ply")], "y.ply", "{}/y.ply is the output of job 'a' already"),
    ([("a", "x.ply", "y.ply")], "y.ply.json", "{}/y.ply.json is the report of job 'a' already"),
    ([("a", "x.ply", "y.ply")], "jobs.toml", "{}/jobs.toml: the report needs a name of its own"),
    ([("a", "ring.conf", "y.ply")], "scan03.ply", "{}/scan03.ply is read by job 'a'"),
    ([("a", "m.gltf", "y.ply")], "m 1.bin", "{}/m 1.bin is read by job 'a'"),
    ([("a", "ns/transforms.json", "y.e57")], "ns/images/c1.png", "{}/ns/images/c1.png is read by job 'a'"),
    ([("a", "ns", "y.e57")], "ns/images/d0.pgm", "{}/ns/images/d0.pgm is read by job 'a'"),
]


@pytest.fixture
def sources(folder):
    """Files of all kinds that name others."""
    torus(8).write(folder / "x.ply")
    buffer_outside(folder, "m")
    recording(folder / "ns")
    return folder


def content(folder):
    """All files of a folder with what is in them."""
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.mark.parametrize("jobs, summary, said", CONFLICTS)
def test_files_with_two_purposes_are_refused_before_any_job(sources, jobs, summary, said):
    text = ""
    for name, read, output, *report in jobs:
        text += job("convert", [read], name=name, output=output, **({"report": report[0]} if report else {}))
    (sources / "jobs.toml").write_text(text)
    before = content(sources)
    done = run("batch", sources / "jobs.toml", *(["--report", sources / summary] if summary else []))
    assert done.returncode == 2 and said.format(sources) in done.stderr.replace("/./", "/"), done.stderr
    assert done.stderr.count("\n") == 1 and content(sources) == before


@pytest.mark.skipif(os.name != "posix", reason="links need rights elsewhere")
def test_links_are_other_names_of_a_file(sources):
    os.symlink(".", sources / "link")
    os.link(sources / "x.ply", sources / "hard.ply")
    before = content(sources)
    for jobs, summary, said in (
        (
            [("a", "x.ply", "y.ply"), ("b", "x.ply", "link/y.ply")],
            None,
            "job 'b': another has the same output: job 'a'",
        ),
        ([("a", "x.ply", "hard.ply")], None, "hard.ply is read: give the output another name"),
        ([("a", "x.ply", "y.ply")], "link/y.ply", "link/y.ply is the output of job 'a' already"),
    ):
        text = "".join(job("convert", [read], name=name, output=output) for name, read, output in jobs)
        (sources / "jobs.toml").write_text(text)
        before[sources / "jobs.toml"] = text.encode()
        done = run("batch", sources / "jobs.toml", *(["--report", sources / summary] if summary else []))
        assert done.returncode == 2 and said in done.stderr, done.stderr
        assert {path: data for path, data in content(sources).items() if path in before} == before


def test_what_files_name_is_hashed(sources):
    """A job runs again when a file changes that another names."""
    jobs = job("info", ["m.gltf"], report="m.json") + job("merge", ["ns/transforms.json"], output="ns.ply")
    jobs += job("info", ["list.conf"], report="list.json")
    (sources / "jobs.toml").write_text(jobs)
    (sources / "list.conf").write_text("bmesh m.gltf 0 0 0 0 0 0 1\nbmesh x.ply 0 0 0 0 0 0 1\n")
    assert states(sources, code=0) == {"m.json": "done", "ns.ply": "done", "list.json": "done"}
    done = {"m.json": "up to date", "ns.ply": "up to date", "list.json": "up to date"}
    assert states(sources, code=0) == done
    read = json.loads((sources / "ns.ply.json").read_text())["inputs"]
    assert sorted(os.path.basename(file["path"]) for file in read) == [
        "c0.png",
        "c1.png",
        "d0.pgm",
        "d1.pgm",
        "transforms.json",
    ]
    (sources / "m 1.bin").write_bytes((sources / "m 1.bin").read_bytes()[::-1])
    assert states(sources, code=0) == done | {"m.json": "done", "list.json": "done"}
    shutil.copy(sources / "ns/images/c1.png", sources / "ns/images/c0.png")
    assert states(sources, code=0) == done | {"ns.ply": "done"}


def test_another_name_of_the_output_or_order_of_inputs_runs_again(sources):
    torus(10).write(sources / "a.ply")
    torus(12).write(sources / "b.ply")

    def becomes(**keys):
        (sources / "jobs.toml").write_text(job("convert", ["x.ply"], name="one", report="r.json", **keys))
        return states(sources, code=0)["one"]

    assert [becomes(output=name) for name in ("o.ply", "o.ply", "p.ply", "p.ply")] == ["done", "up to date"] * 2
    assert (sources / "p.ply").exists()

    def of(*given, command="measure"):
        (sources / "jobs.toml").write_text(job(command, given, name="one", report="r.json"))
        return states(sources, code=0)["one"]

    assert [of("a.ply", "b.ply"), of("a.ply", "b.ply")] == ["done", "up to date"]
    assert [of("b.ply", "a.ply"), of("b.ply", "a.ply"), of("a.ply", "b.ply")] == ["done", "up to date", "done"]
    assert [of("a.ply", command="info"), of("a.ply", "a.ply", command="info")] == ["done", "done"]
    for name in ("one", "two"):
        (sources / name).mkdir()
        torus(10 if name == "one" else 12).write(sources / name / "s.ply")
    assert [of("one", "two", command="info"), of("two", "one", command="info")] == ["done", "done"]
    assert of("two", "one", command="info") == "up to date"


def test_an_output_that_is_missing_is_called_so(sources):
    (sources / "jobs.toml").write_text(job("convert", ["x.ply"], output="y.ply"))
    states(sources, code=0)
    (sources / "y.ply").unlink()
    done = run("batch", sources / "jobs.toml", "--dry-run")
    assert "y.ply: to do: its output is missing" in done.stderr


DONE = {"state": "done", "version": surfrecon.__version__, "command": "convert", "parameters": {}}


@pytest.mark.parametrize(
    "report",
    [
        *('{"state": "done", "parameters": ' + value + "}" for value in ("null", "[]", '"x"', '{"a": null}')),
        *("[" * 100000, '{"a":' * 100000, "[]", "null", '{"state": "done", "version": 1, "command": []}'),
        *(json.dumps(DONE | {"inputs": inputs}) for inputs in (5, [5], None, [])),
    ],
    ids=range(13),
)
def test_a_report_of_anything_is_none(sources, report):
    (sources / "jobs.toml").write_text(
        job("convert", ["x.ply"], output="y.ply") + job("info", ["x.ply"], report="x.json")
    )
    (sources / "y.ply.json").write_text(report)
    assert states(sources, code=0) == {"y.ply": "done", "x.json": "done"}


@pytest.mark.parametrize(
    "text",
    [
        'command = "info"\ninputs = ["x.ply"]\nreport = "r\\u0000.json"',
        'command = "info"\ninputs = ["x\\u0000.ply"]\nreport = "r.json"',
        'command = "info"\ninputs = [""]\nreport = "r.json"',
        'command = "info"\ninputs = ["x.ply"]\nreport = ""',
        'command = "align"\ninputs = ["x.ply"]\nreport = "r.json"\nparameters.angles = [' + "9" * 400 + ", 1]",
        'command = "align"\ninputs = ["x.ply"]\nreport = "r.json"\nparameters.fixed = [' + "9" * 22 + "]",
        'command = "info"\ninputs = ["x.ply"]\nreport = "r.json"\nparameters.scale = ' + "9" * 401,
        'command = "info"\ninputs = ["x.ply"]\nreport = "r.json"\nparameters.scale = ' + "9" * 5000,
        'command = "info"\ninputs = ["x.ply"]\nreport = "r.json"\nparameters.camera = [1, 2, 3, ' + "9" * 401 + "]",
        'command = "info"\ninputs = ["x.ply"]\nreport = "r.json"\na = ' + "[" * 5000,
        'command = "info"\ninputs = ["x.ply"]\nreport = "r.json"\na = ' + "[" * 5000 + "]" * 5000,
    ],
    ids=range(11),
)
def test_a_manifest_of_monsters_is_refused(sources, text):
    (sources / "jobs.toml").write_text(f"[[job]]\n{text}\n")
    before = content(sources)
    done = run("batch", sources / "jobs.toml")
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert len(done.stderr) < 1500 and content(sources) == before


def test_large_whole_numbers_are_numbers(sources):
    (sources / "jobs.toml").write_text(
        job("align", ["x.ply"], name="far", report="far.json", parameters="?").replace(
            '"?"', "{ angles = [9999999999999999999999, 1] }"
        )
        + job("info", ["x.ply"], report="r.json")
    )
    assert states(sources) == {"far": "failed", "r.json": "done"}


def test_grids_beside_lists_are_not_those_of_other_jobs(sources):
    """Which these are is known once the scans are read."""
    (sources / "a").mkdir()
    shutil.copy(sources / "scan05.ply", sources / "a/scan05.ply")
    first = job("convert", ["ring.conf"], output="a/first.conf")
    cases = [
        (job("convert", ["ring.conf"], output="a/second.conf"), "scan00.ply"),
        (job("info", ["x.ply"], name="two", report="a/scan04.ply"), "scan04.ply"),
        (job("info", ["a/scan05.ply"], name="two", report="two.json"), "scan05.ply"),
    ]
    for k, (other, name) in enumerate(cases):
        # In the first case the second job is refused what the first has made.
        (sources / "jobs.toml").write_text(first + other if k == 0 else other + first)
        before = (sources / "a/scan05.ply").read_bytes()
        done = run("batch", sources / "jobs.toml", "--json")
        assert [one["state"] for one in json.loads(done.stdout)["jobs"]] == ["done", "failed"], done.stdout
        assert f"{name}, which is written beside the output, is another job's" in done.stderr
        if k:
            assert (sources / "a/scan05.ply").read_bytes() == before
        for path in (sources / "a").iterdir():
            path.unlink()
        shutil.copy(sources / "scan05.ply", sources / "a/scan05.ply")


def test_a_mistake_of_ours_stops_no_other_job(sources):
    program = """
import sys
from surfrecon.cli import commands, main
def info(work):
    if "x.ply" in work.request.inputs[0]:
        raise TypeError("a mistake")
    return before(work)
before = commands.operations.info
object.__setattr__(commands.COMMANDS["info"], "run", info)
main()
"""
    (sources / "jobs.toml").write_text(
        job("info", ["x.ply"], report="x.json") + job("info", ["m.gltf"], report="m.json")
    )
    command = [sys.executable, "-c", program, "batch", sources / "jobs.toml", "--json"]
    done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, timeout=100)
    jobs = json.loads(done.stdout)["jobs"]
    assert done.returncode == 1 and [one["state"] for one in jobs] == ["failed", "done"]
    assert jobs[0]["error"] == "TypeError: a mistake"
    assert json.loads((sources / "x.json").read_text())["state"] == "failed"
