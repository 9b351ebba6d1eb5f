"""Merging registered range scans: this library beside VCG, screened Poisson and Open3D on the same scans.

Ours reads the raw scans and their `.conf`; the peers read what prepare.py made for them beforehand. Every run is a
fresh process; its time includes loading, and for the peers the import of their Python package. Tools take turns,
figures are medians.
"""

import json
import os
import statistics
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import measured
import numpy as np
import table
from ply import read_ply
from prepare import prepare
from surface import distances, sample, topology

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "bench"
EXAMPLES = ROOT / "target" / "release" / "examples"
SAMPLES = 200_000

OURS, WHEEL = "surfrecon", "surfrecon-wheel"
TOOLS = [OURS, WHEEL, "pymeshlab-vcg", "pymeshlab-poisson", "open3d-vbg"]


@dataclass
class Case:
    """Scans and the size of a cell to merge them with."""

    name: str
    conf: Path
    voxel: float
    mm: float = 1e3  # millimetres in the scans' unit
    truth: Path | None = None  # the shape that was scanned, where it is known
    paper: tuple | None = None  # shares of case a, b, c in per cent in the paper's Table 2


DATA_CASES = [
    ("bunny 1.436 mm", "stanford_bunny/bun.conf", 0.001436, (98.62, 0.72, 0.66)),
    ("bunny 0.470 mm", "stanford_bunny/bun.conf", 0.00047, (98.28, 1.12, 0.60)),
    ("dragon 0.75 mm", "stanford_dragon_stand/dragonStandRight.conf", 0.00075, None),
    ("happy 0.60 mm", "stanford_happy_stand/happyStandRight.conf", 0.0006, None),
]
VIRTUAL_SCANS, VIRTUAL_VOXEL = 12, 1.0


def data_cases(skipped):
    """The cases on real scans; those that can't run are named in `skipped`."""
    data = os.environ.get("SURFRECON_DATA")
    cases = []
    for name, conf, voxel, paper in DATA_CASES:
        if not data:
            skipped.append(f"{name}: SURFRECON_DATA is not set")
        elif not (Path(data) / conf).is_file():
            skipped.append(f"{name}: {conf} is not in SURFRECON_DATA")
        else:
            cases.append(Case(name, Path(data) / conf, voxel, paper=paper))
    return cases


def virtual_scans(scans):
    """Scans a known shape, in millimetres, with noise, dropouts and slightly wrong poses; returns the folder."""
    folder = OUT / "inputs" / f"virtual_{scans}"
    program = [EXAMPLES / "virtual_scans", folder, "--scans", scans, "--ascii"]
    subprocess.run(list(map(str, program)), check=True, stdout=subprocess.DEVNULL)
    return folder


def virtual_case():
    """Where the truth is known."""
    folder = virtual_scans(VIRTUAL_SCANS)
    voxel = VIRTUAL_VOXEL
    return Case(f"virtual {voxel:g} mm", folder / "scans.conf", voxel, mm=1.0, truth=folder / "truth.ply")


def command(tool, case, folder, out, report):
    """The program and arguments that merge the scans of a case."""
    if tool == OURS:
        return [EXAMPLES / "merge_scans", case.conf, out, "--voxel", case.voxel, "--report", report]
    if tool == WHEEL:
        return [sys.executable, ROOT / "bench" / "wheel_merge.py", case.conf, out, case.voxel]
    return [sys.executable, ROOT / "bench" / "peer_merge.py", tool, folder, case.voxel, out]


def quality(case, folder, out):
    """Figures of a merged surface; distances in mm."""
    mesh = read_ply(out)
    if mesh.faces is None or len(mesh.faces) == 0:
        return {"triangles": 0}
    figures = topology(mesh.vertices, mesh.faces)
    off = distances(read_ply(folder / "points.ply").vertices, mesh.vertices, mesh.faces) * case.mm
    figures |= {
        "rms_mm": float(np.sqrt(np.mean(off**2))),
        "max_mm": float(off.max()),
        "mean_mm": float(off.mean()),
        "p95_mm": float(np.percentile(off, 95)),
    }
    # Surface where no scan has any: how far the result strays from the scans.
    scans = read_ply(folder / "all.ply")
    on_surface = sample(mesh.vertices, mesh.faces, SAMPLES)
    astray = distances(on_surface, scans.vertices, scans.faces) * case.mm
    figures |= {"surface_to_scans_mean_mm": float(astray.mean()), "surface_to_scans_max_mm": float(astray.max())}
    if case.truth:
        truth = read_ply(case.truth)
        to_truth = distances(on_surface, truth.vertices, truth.faces) * case.mm
        from_truth = distances(sample(truth.vertices, truth.faces, SAMPLES), mesh.vertices, mesh.faces) * case.mm
        figures |= {
            "to_truth_mean_mm": float(to_truth.mean()),
            "to_truth_max_mm": float(to_truth.max()),
            "from_truth_mean_mm": float(from_truth.mean()),
            "from_truth_max_mm": float(from_truth.max()),
        }
    return figures


def run_case(case, tools, repeats):
    """Runs the tools in turn on one case; returns a row a tool and our own report."""
    folder = OUT / "inputs" / f"{case.conf.parent.name}_prepared"
    prepared = prepare(case.conf, folder)
    runs, failures = {tool: [] for tool in tools}, {}
    report = OUT / "inputs" / "report.json"
    surfaces = {tool: OUT / "surfaces" / f"{case.name} {tool}.ply".replace(" ", "_") for tool in tools}
    (OUT / "surfaces").mkdir(parents=True, exist_ok=True)
    for turn in range(repeats):
        for tool in tools:
            if tool in failures:
                continue
            print(f"  {case.name}: {tool}, run {turn + 1} of {repeats}", flush=True)
            try:
                figures, _ = measured.run(command(tool, case, folder.resolve(), surfaces[tool], report))
                runs[tool].append(figures)
            except measured.Failed as failed:
                failures[tool] = str(failed)
                print(f"    failed: {failed}", flush=True)
    rows = []
    for tool in tools:
        row = {
            "case": case.name,
            "tool": tool,
            "voxel_mm": case.voxel * case.mm,
            "input_triangles": prepared["triangles"],
        }
        if tool in failures:
            rows.append(row | {"failed": failures[tool]})
            continue
        for name in ("cpu_s", "wall_s", "peak_mb"):
            row[name] = statistics.median(run[name] for run in runs[tool])
        row["cpu_s_all"] = [run["cpu_s"] for run in runs[tool]]
        rows.append(row | quality(case, folder, surfaces[tool]))
    add_ratios(rows)
    return rows, json.loads(report.read_text()) if OURS in tools and OURS not in failures else None


def add_ratios(rows, tool=OURS):
    """How many times the CPU time, wall time and memory of `tool` each takes."""
    ours = next((row for row in rows if row["tool"] == tool and "cpu_s" in row), None)
    for row in rows:
        if ours and "cpu_s" in row:
            for name in ("cpu", "wall", "peak"):
                unit = "mb" if name == "peak" else "s"
                row[f"{name}_ratio"] = row[f"{name}_{unit}"] / ours[f"{name}_{unit}"]


def show_rows(rows):
    """Prints the rows of one case."""
    columns = {
        "tool": "tool", "CPU s": "cpu_s", "x ours": "cpu_ratio", "wall s": "wall_s", "MB": "peak_mb",
        "triangles": "triangles", "parts": "components", "loops": "boundary_loops", "border edges": "boundary_edges",
        "nm edges": "nonmanifold_edges", "nm verts": "nonmanifold_vertices", "RMS mm": "rms_mm", "mean mm": "mean_mm",
        "max mm": "max_mm",
    }  # fmt: skip
    if any("to_truth_mean_mm" in row for row in rows):
        columns |= {
            "to truth mean": "to_truth_mean_mm", "max": "to_truth_max_mm",
            "from truth mean": "from_truth_mean_mm", "max ": "from_truth_max_mm",
        }  # fmt: skip
    table.show(rows, columns)
    for row in rows:
        if "failed" in row:
            print(f"  {row['tool']} failed: {row['failed']}")


def show_shares(shares):
    """Prints the shares of faces by how they were made beside those of the paper."""
    print("\nFaces made directly (a), from neighbouring cells (b), by closing holes (c), per cent")
    table.show(
        shares,
        {
            "case": "case",
            "a": "a",
            "b": "b",
            "c": "c",
            "paper a": "paper_a",
            "paper b": "paper_b",
            "paper c": "paper_c",
        },
    )


def growth(repeats):
    """How our time and memory grow with twice the scans and half the voxel; a row for each combination."""
    rows = []
    for scans in (VIRTUAL_SCANS, 2 * VIRTUAL_SCANS):
        conf = virtual_scans(scans) / "scans.conf"
        for voxel in (VIRTUAL_VOXEL, VIRTUAL_VOXEL / 2):
            case = Case(f"{scans} scans {voxel:g} mm", conf, voxel, mm=1.0)
            out, report = OUT / "inputs" / "growth.ply", OUT / "inputs" / "growth.json"
            print(f"  {case.name}: {repeats} runs", flush=True)
            runs = [measured.run(command(OURS, case, None, out, report))[0] for _ in range(repeats)]
            figures = {name: statistics.median(run[name] for run in runs) for name in ("cpu_s", "wall_s", "peak_mb")}
            told = json.loads(report.read_text())
            row = {"scans": scans, "voxel_mm": voxel, "input_triangles": told["input_triangles"]} | figures
            rows.append(row | {"triangles": sum(told["faces"]), "intersections": told["intersections"]})
    for row in rows:
        row["cpu_growth"] = row["cpu_s"] / rows[0]["cpu_s"]
        row["peak_growth"] = row["peak_mb"] / rows[0]["peak_mb"]
    return rows


def show_growth(rows):
    """Prints the table of growth."""
    print("\nGrowth, surfrecon on virtual scans")
    columns = {
        "scans": "scans", "voxel mm": "voxel_mm", "input triangles": "input_triangles", "triangles": "triangles",
        "intersections": "intersections", "CPU s": "cpu_s", "x": "cpu_growth", "wall s": "wall_s", "MB": "peak_mb",
        "x ": "peak_growth",
    }  # fmt: skip
    table.show(rows, columns)


def main(only_cases, repeats):
    """Runs the benchmark and returns what goes into the JSON file."""
    skipped = []
    cases = [case for case in [*data_cases(skipped), virtual_case()] if only_cases in case.name]
    rows, shares = [], []
    for case in cases:
        print(f"\n{case.name}", flush=True)
        of_case, report = run_case(case, TOOLS, repeats)
        show_rows(of_case)
        rows += of_case
        if report and case.paper:
            total = sum(report["faces"]) or 1
            made = {k: 100 * n / total for k, n in zip("abc", report["faces"], strict=True)}
            paper = {f"paper_{k}": share for k, share in zip("abc", case.paper, strict=True)}
            shares.append({"case": case.name} | made | paper)
    if shares:
        show_shares(shares)
    grown = growth(repeats) if only_cases in "growth" else []
    if grown:
        show_growth(grown)
    for reason in skipped:
        print(f"SKIPPED {reason}")
    return {"rows": rows, "face_shares": shares, "growth": grown, "skipped": skipped}
