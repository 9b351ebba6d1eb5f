"""Each benchmark on its smallest case, and what all of them stand on."""

import argparse
import json
import math
import os
import subprocess
import sys
import types
from pathlib import Path

import measured
import pytest
import record
import run
import scale
from peers import PEERS, needs_peers

ROOT = Path(__file__).resolve().parents[2]
# A folder with our own programs: tools/testing/plan.py names it.
PROGRAMS = os.environ.get("SURFRECON_PROGRAMS")
# The peers that every machine which tests has, by benchmark; that of `blender` is a column.
WITH = {
    "align": {"open3d-ransac", "open3d-fgr", "kiss-matcher", "small_gicp-rough", "meshlab-rough"}
    | {"open3d-fragments", "open3d-multiway", "kiss-icp"},
    "merge": {"pymeshlab-vcg", "pymeshlab-poisson", "open3d-vbg"},
    "scale": {"surfrecon-files-512", "surfrecon-tasks-128", "surfrecon-dask-2", "surfrecon-dask-2-killed"},
    "noise": {"pymeshlab-vcg", "pymeshlab-poisson", "open3d-vbg"},
    "colour": {"mean-of-bytes"},
    "delaunay": {"qhull"},
    "scattered": {"open3d-ball-pivoting", "open3d-alpha-shape", "meshlab-ball-pivoting"}
    | {"screened-poisson-5", "surfrecon-sensor"},
    "sculpt": {"pydelatin", "pymartini", "open3d-quadric", "meshlab-quadric"},
    "quads": set(),
    "cluster": {"meshlab-isotropic", "meshlab-quadric"},
    "close": {
        "poisson-8",
        "poisson-8-trimmed",
        "poisson-10",
        "vcg",
        "open3d-poisson-8",
        "meshlab-close-holes",
        "meshfix",
    },
    "capi": {"open3d-cpp", "cgal"},
    "io": {"decoders", "open3d", "pymeshlab", "trimesh", "meshio", "laspy", "bpy"},
    "blender": set(),
    "meshlab": {"vcg-filter"},
    "limits": set(),
    "install": set(),
}
# Columns that are null where a case has nothing of the kind.
NOT_OF_ALL = {
    # Of calls the one, of jobs the other; of peers' programs the smallest case only counts the lines.
    "capi": {"core_s", "c_s", "overhead_pct", "file_s", "memory_s"}
    | {"first_s", "again_s", "share_pct", "most_s", "same_bytes"}
    | {"lines", "compiled", "ran", "seconds", "triangles", "answers", "as_alone"},
    "align": {"overlap_pct", "threads", "residual_conf_mm", "nees", "worst_shift_spacings", "residual_mm", "snap_ms"}
    # Of scans of things the one, of frames of rooms the other; poses of one frame have no error.
    | {"way", "wrong_said", "undecided", "rms_mm", "noise", "pairs_total", "pairs_found"},
    "noise": {"sigma_vox", "veils_left_pct", "thinnest_wall_vox"},
    "colour": {"gain_error_pct", "cpu_s", "wall_s", "peak_mb"},
    "blender": {"ms", "blender_minimum_ms", "peak_mb"},
    "cluster": {"genus"},
    # Peers have no such option, and the slicer need not be there.
    "close": {"close", "slices"},
    # Extrapolated rows were compared with nothing. Blocks of a quick merge may be gone before they are seen.
    "scale": {"same_bytes", "blocks", "replaced_cpu_s"},
    "install": {"tests_passed", "tests_failed", "excused"},
    # Known of points with noise on shapes whose truth is known: see `check_noise`.
    "scattered": {"noise_spacings", "outlier_pct", "to_truth_rms"},
}


def bench(out, *arguments, **environment):
    """Runs bench/run.py as bench/run.sh does; returns the finished process."""
    command = [PEERS, ROOT / "bench" / "run.py", *arguments, "--out", out]
    command += ["--programs", PROGRAMS] if PROGRAMS else []
    environment = {**os.environ, **environment}
    return subprocess.run(
        list(map(str, command)), env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )


@needs_peers
@pytest.mark.skipif(not PROGRAMS, reason="SURFRECON_PROGRAMS does not name the folder of our own programs")
@pytest.mark.parametrize("name", run.BENCHMARKS)
def test_smallest_case(name, tmp_path):
    done = bench(tmp_path, name, "--smallest")
    if done.returncode == run.UNAVAILABLE:
        pytest.skip(next(line for line in done.stdout.splitlines() if line.startswith("SKIPPED")))
    assert done.returncode == 0, done.stdout
    found = json.loads((tmp_path / f"{name}.json").read_text())
    assert found["finished"] and found["columns"] and found["rows"]
    for row in found["rows"]:
        assert "failed" not in row, row
        lacking = [key for key in found["columns"] if row[key] is None and key not in NOT_OF_ALL.get(name, ())]
        assert not lacking, (lacking, row)
    tools = {row.get("tool", "surfrecon") for row in found["rows"]}
    assert any(tool.startswith("surfrecon") for tool in tools)
    if found["skipped"]:
        pytest.skip("; ".join(found["skipped"]))
    assert WITH[name] <= tools
    if name == "blender":
        assert any(row["blender_minimum_ms"] for row in found["rows"])
    if name == "scale":
        check_scale(found["rows"])
    if name == "scattered":
        check_noise(found["rows"])


def check_scale(rows):
    """Bytes are the same whoever merges, also where a worker is killed, and the memory is what is allowed."""
    found = [row for row in rows if row["case"] != scale.FAR_CASE]
    assert all(row["same_bytes"] is True for row in found)
    for row in found:
        assert row["killed"] == row["tool"].endswith("-killed"), row
        assert 0 < row["peak_mb"] <= (row["max_memory_mb"] * 1.1 or math.inf), row
        assert "-files-" in row["tool"] or row["blocks"] >= 1, row
    assert any(row["killed"] for row in found)
    far = {row["tool"] for row in rows if row["case"] == scale.FAR_CASE}
    assert far == {f"{row['tool']}, extrapolated" for row in found}


def check_noise(rows):
    """Of points that carry noise all is known, and our surface lies nearer to the truth than they do."""
    found = {row["tool"]: row for row in rows if row["noise_spacings"] is not None}
    assert set(found) == {"surfrecon", "screened-poisson-5"}
    # 2,000 points of the unit sphere.
    spacing = math.sqrt(4 * math.pi / 2000)
    for row in found.values():
        assert (row["noise_spacings"], row["outlier_pct"]) == (1, 5) and row["to_truth_rms"] > 0
    assert found["surfrecon"]["to_truth_rms"] < spacing / 2


def test_a_billion_samples_are_extrapolated_from_the_two_largest_cases(tmp_path):
    rows = new(tmp_path, scale.COLUMNS)

    def put(tool, samples, peak, limit=512):
        row = dict.fromkeys(scale.COLUMNS) | {"case": f"{samples} samples", "tool": tool, "samples": samples}
        grown = {key: samples / 1e6 for key in ("scans", "vertices", "cpu_s", "wall_s", "disk_mb")}
        rows.put(row | grown | {"peak_mb": peak, "max_memory_mb": limit, "same_bytes": True})

    for samples in (10**8, 3 * 10**8, 10**7):
        put("falls", samples, 100 - samples / 1e7)
        put("much", samples, samples / 1e4)
        put("unlimited", samples, samples / 1e4, 0)
    put("once", 10**8, 5)
    scale.extrapolate(rows)
    far = {row["tool"]: row for row in rows.rows if row["case"] == scale.FAR_CASE}
    assert set(far) == {f"{tool}, extrapolated" for tool in ("falls", "much", "unlimited")}
    falls, much, unlimited = (far[f"{tool}, extrapolated"] for tool in ("falls", "much", "unlimited"))
    assert falls["peak_mb"] == 70 and falls["disk_mb"] == falls["cpu_s"] == pytest.approx(1000)
    assert (falls["samples"], falls["same_bytes"], falls["blocks"]) == (10**9, None, None)
    assert much["failed"] == "takes 100000 MB, more than 16000"
    assert "failed" not in falls and "failed" not in unlimited


@needs_peers
def test_what_cannot_run_is_no_success(tmp_path):
    done = bench(tmp_path, "quads", "--cases", "terrain", SURFRECON_DATA="")
    assert done.returncode == run.UNAVAILABLE and "SKIPPED terrain Fuji" in done.stdout, done.stdout
    found = json.loads((tmp_path / "quads.json").read_text())
    assert not found["rows"] and len(found["skipped"]) == 3
    done = bench(tmp_path, "quads", "--cases", "no such case")
    assert done.returncode == run.UNAVAILABLE and "no case is named 'no such case'" in done.stdout, done.stdout


def test_help_says_what_is_left_out(tmp_path):
    done = subprocess.run([ROOT / "bench" / "run.sh", "--help"], capture_output=True, text=True, check=True)
    said = " ".join(done.stdout.split())
    assert run.HEAVY and set(run.HEAVY) <= set(run.BENCHMARKS)
    for patterns in run.HEAVY.values():
        for pattern in patterns:
            assert pattern in said
    assert f"takes more than {record.ONCE_CPU_S} s of CPU time is run once" in said
    assert f"nothing is begun after {record.BUDGET_CPU_S} s" in said


def test_heavy_cases_are_left_out_unless_all_is_asked_for(tmp_path):
    usual, heavy = (run.Wanted("merge", tmp_path, tmp_path, 3, extent) for extent in (run.USUAL, run.ALL))
    for pattern in run.HEAVY["merge"]:
        case, tool = (part.replace("*", "x") for part in pattern.split(": "))
        assert heavy.takes(case, tool) and not usual.takes(case, tool)
    assert usual.takes("bunny 0.470 mm", "surfrecon") and usual.takes("bunny 0.470 mm", "open3d-vbg")


def test_every_noise_of_scattered_points_is_shown_of_this_library(tmp_path):
    usual = run.Wanted("scattered", tmp_path, tmp_path, 3)
    for noise in (0, 0.3, 0.5, 1, 2):
        assert usual.takes(f"sphere, noise {noise}, outliers 5 %", "surfrecon")
    assert not usual.takes("sphere, noise 0, outliers 5 %", "screened-poisson-5")


def new(tmp_path, columns=("case", "tool", "cpu_s")):
    return record.Record(tmp_path / "some.json", {"benchmark": "some"}, columns)


def kept(tmp_path):
    return json.loads((tmp_path / "some.json").read_text())


def test_rows_are_kept_as_they_are_measured(tmp_path):
    rows, seen = new(tmp_path), []

    def once(tool):
        seen.append([(row["tool"], row["cpu_s"]) for row in kept(tmp_path)["rows"]])
        if len(seen) == 4:
            raise KeyboardInterrupt
        return {"cpu_s": float(len(seen))}, None

    with pytest.raises(KeyboardInterrupt):
        rows.measure(["a", "b"], 3, once, lambda tool: {"case": "c", "tool": tool})
    assert seen == [[], [("a", 1.0)], [("a", 1.0), ("b", 2.0)], [("a", 2.0), ("b", 2.0)]]
    found = kept(tmp_path)
    assert [row["cpu_s"] for row in found["rows"]] == [2.0, 2.0] and not found["finished"]


def test_an_end_while_writing_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    rows = new(tmp_path)
    rows.put({"case": "c", "tool": "a", "cpu_s": math.inf})
    before = kept(tmp_path)
    assert before["rows"][0]["cpu_s"] is None

    def broken(path, text):
        with open(path, "w") as file:
            file.write(text[: len(text) // 2])
        raise OSError("no space")

    monkeypatch.setattr(Path, "write_text", broken)
    with pytest.raises(OSError):
        rows.put({"case": "c", "tool": "b", "cpu_s": 1.0})
    assert kept(tmp_path) == before


def test_a_row_without_its_columns_is_refused(tmp_path):
    rows = new(tmp_path)
    with pytest.raises(ValueError, match="cpu_s"):
        rows.put({"case": "c", "tool": "a"})
    rows.put({"case": "c", "tool": "a", "failed": "killed"})
    assert len(kept(tmp_path)["rows"]) == 1


def test_why_a_row_failed_is_said(tmp_path, monkeypatch, capsys):
    def main(_, rows):
        rows.put({"case": "3 frames", "tool": "surfrecon-files", "failed": "no room on the disk"})
        rows.put({"case": "3 frames", "tool": "a peer", "failed": "killed"})

    monkeypatch.setitem(sys.modules, "some", types.SimpleNamespace(COLUMNS=[], main=main))
    asked = argparse.Namespace(out=tmp_path, programs=tmp_path, repeats=1, extent=run.SMALLEST, cases="")
    assert run.run("some", asked, "here") == (2, 1, 0)
    said = capsys.readouterr().out
    assert "FAILED 3 frames, surfrecon-files: no room on the disk\nFAILED 3 frames, a peer: killed\n" in said


def test_slow_and_failing_tools_run_once():
    clock, ran = [0.0], []

    def once(tool):
        ran.append(tool)
        clock[0] += {"slow": record.ONCE_CPU_S + 1, "quick": 1}.get(tool, 0)
        if tool == "broken":
            raise measured.Failed("broken")
        return tool

    for tool, made, problem in record.in_turn(["slow", "broken", "quick"], 3, once, used=lambda: clock[0]):
        assert (made, problem) == ((None, "broken") if tool == "broken" else (tool, None))
    assert ran == ["slow", "broken", "quick", "quick", "quick"]


def test_nothing_is_begun_when_the_time_is_used_up(tmp_path):
    clock, ran = [0.0], []
    rows = record.Record(tmp_path / "some.json", {"benchmark": "some"}, [], 3, used=lambda: clock[0])

    def once(tool):
        ran.append(tool)
        clock[0] += 1
        return {"cpu_s": 1.0}, None

    rows.measure(["a", "b"], 1, once, lambda tool: {"case": "first", "tool": tool})
    rows.measure(["a", "b"], 3, once, lambda tool: {"case": "second", "tool": tool})
    assert ran == ["a", "b", "a"]
    found = kept(tmp_path)
    assert [(row["case"], row["tool"], row["runs"]) for row in found["rows"]] == [
        ("first", "a", 1),
        ("first", "b", 1),
        ("second", "a", 1),
    ]
    assert found["skipped"] == ["second b: 3 s of CPU time are used up; --all knows no limit"]
    assert not rows.has_time_for("growth") and len(kept(tmp_path)["skipped"]) == 2
