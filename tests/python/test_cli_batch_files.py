"""Files that jobs of a manifest read and write: no file has two purposes, and all that was read is known."""

import json
import os
import shutil
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
import surfrecon
from command_line import ENVIRONMENT, buffer_outside, run, states
from shapes import torus, torus_scans


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    surfrecon.write_scans(folder / "ring.conf", torus_scans(pixels=40))
    return folder


@pytest.fixture
def folder(data, tmp_path):
    for path in data.iterdir():
        shutil.copy(path, tmp_path)
    return tmp_path


def job(command, inputs, **keys):
    """A job as a manifest has it."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in {"command": command, "inputs": inputs, **keys}.items()]
    return "\n".join(["[[job]]", *lines, ""])


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
    # A file that one job reads and another writes.
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
    """Their names are known once the scans are read."""
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


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_report_that_is_a_pipe_is_not_waited_for(sources):
    os.mkfifo(sources / "r.json")
    (sources / "jobs.toml").write_text(job("cluster", ["x.ply"], name="a", output="o.ply", report="r.json"))
    done = run("batch", sources / "jobs.toml", "--dry-run", "--json", timeout=30)
    (entry,) = json.loads(done.stdout)["jobs"]
    assert done.returncode == 0 and entry["reason"] == "there is no report of it"
