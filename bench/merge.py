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
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import measured
import numpy as np
import table
from ply import read_ply
from prepare import prepare
from surface import distances, sample, topology

HERE = Path(__file__).resolve().parent

OURS, WHEEL = "surfrecon", "surfrecon-wheel"
TOOLS = [OURS, WHEEL, "pymeshlab-vcg", "pymeshlab-poisson", "open3d-vbg"]
# Figures of a surface. They are null where there is none.
QUALITY = ["components", "boundary_loops", "boundary_edges", "nonmanifold_edges", "nonmanifold_vertices"]
QUALITY += ["rms_mm", "mean_mm", "p95_mm", "max_mm", "surface_to_scans_mean_mm", "surface_to_scans_max_mm"]
HEAD = ["case", "tool", "voxel_mm", "input_triangles", "runs", "cpu_s", "wall_s", "peak_mb", "triangles"]
COLUMNS = HEAD + QUALITY


@dataclass
class Case:
    """Scans and the size of a cell to merge them with."""

    name: str
    conf: Path
    voxel: float
    mm: float = 1e3  # millimetres in the scans' unit
    truth: Path | None = None  # the shape that was scanned, where it is known
    samples: int = 200_000  # points of each surface whose distances to others are averaged
    paper: tuple | None = None  # shares of case a, b, c in per cent in the paper's Table 2


DATA_CASES = [
    ("bunny 1.436 mm", "stanford_bunny/bun.conf", 0.001436, (98.62, 0.72, 0.66)),
    ("bunny 0.470 mm", "stanford_bunny/bun.conf", 0.00047, (98.28, 1.12, 0.60)),
    ("dragon 0.75 mm", "stanford_dragon_stand/dragonStandRight.conf", 0.00075, None),
    ("happy 0.60 mm", "stanford_happy_stand/happyStandRight.conf", 0.0006, None),
]


@dataclass
class Virtual:
    """Virtual scans of a shape: what bench/merge.py hands to the example `virtual_scans`."""

    scans: int
    pixels: int  # across the shape
    detail: float  # of the shape, mm
    voxel: float  # cell to merge with, mm


VIRTUAL, SMALLEST = Virtual(12, 520, 1.8, 1.0), Virtual(4, 60, 12.0, 8.0)


def cases(wanted, record):
    """The cases that are wanted: on real scans, and on virtual ones of a known shape."""
    data = os.environ.get("SURFRECON_DATA")
    for name, conf, voxel, paper in () if wanted.smallest else DATA_CASES:
        if not wanted.takes(name):
            continue
        if data and (Path(data) / conf).is_file():
            yield Case(name, Path(data) / conf, voxel, paper=paper)
        else:
            record.skip(f"{name}: {conf} is not in SURFRECON_DATA")
    virtual = SMALLEST if wanted.smallest else VIRTUAL
    name = f"virtual {virtual.voxel:g} mm"
    if wanted.takes(name):
        folder = virtual_scans(wanted, virtual)
        case = Case(name, folder / "scans.conf", virtual.voxel, mm=1.0, truth=folder / "truth.ply")
        yield replace(case, samples=2_000) if wanted.smallest else case


def virtual_scans(wanted, virtual):
    """Scans a known shape, in millimetres, with noise, dropouts and slightly wrong poses; returns the folder."""
    folder = wanted.out / "inputs" / f"virtual_{virtual.scans}_{virtual.pixels}"
    program = [wanted.programs / "examples" / "virtual_scans", folder, "--ascii", "--scans", virtual.scans]
    program += ["--pixels", virtual.pixels, "--cell", virtual.detail]
    subprocess.run(list(map(str, program)), check=True, stdout=subprocess.DEVNULL)
    return folder


def command(tool, case, wanted, folder, out, report):
    """The program and arguments that merge the scans of a case."""
    if tool == OURS:
        program = wanted.programs / "examples" / "merge_scans"
        return [program, case.conf, out, "--voxel", case.voxel, "--report", report]
    if tool == WHEEL:
        return [sys.executable, HERE / "wheel_merge.py", case.conf, out, case.voxel]
    return [sys.executable, HERE / "peer_merge.py", tool, folder, case.voxel, out]


# Every tool of a case is held against the same three.
read_once = lru_cache(maxsize=3)(read_ply)


def quality(case, folder, out):
    """Figures of a merged surface; distances in mm."""
    mesh = read_ply(out)
    if mesh.faces is None or len(mesh.faces) == 0:
        return dict.fromkeys(QUALITY) | {"triangles": 0}
    figures = topology(mesh.vertices, mesh.faces)
    off = distances(read_once(folder / "points.ply").vertices, mesh.vertices, mesh.faces) * case.mm
    figures |= {
        "rms_mm": float(np.sqrt(np.mean(off**2))),
        "max_mm": float(off.max()),
        "mean_mm": float(off.mean()),
        "p95_mm": float(np.percentile(off, 95)),
    }
    # Surface where no scan has any: how far the result strays from the scans.
    scans = read_once(folder / "all.ply")
    on_surface = sample(mesh.vertices, mesh.faces, case.samples)
    astray = distances(on_surface, scans.vertices, scans.faces) * case.mm
    figures |= {"surface_to_scans_mean_mm": float(astray.mean()), "surface_to_scans_max_mm": float(astray.max())}
    if case.truth:
        truth = read_once(case.truth)
        to_truth = distances(on_surface, truth.vertices, truth.faces) * case.mm
        from_truth = distances(sample(truth.vertices, truth.faces, case.samples), mesh.vertices, mesh.faces) * case.mm
        figures |= {
            "to_truth_mean_mm": float(to_truth.mean()),
            "to_truth_max_mm": float(to_truth.max()),
            "from_truth_mean_mm": float(from_truth.mean()),
            "from_truth_max_mm": float(from_truth.max()),
        }
    return figures


def run_case(case, wanted, record):
    """Runs the tools in turn on one case; returns a row a tool and our own report."""
    folder = wanted.out / "inputs" / f"{case.conf.parent.name}_prepared"
    prepared = prepare(case.conf, folder)
    report = wanted.out / "inputs" / "report.json"
    (wanted.out / "surfaces").mkdir(parents=True, exist_ok=True)

    def head(tool):
        voxel = case.voxel * case.mm
        return {"case": case.name, "tool": tool, "voxel_mm": voxel, "input_triangles": prepared["triangles"]}

    def once(tool):
        print(f"  {case.name}: {tool}", flush=True)
        out = surface_file(wanted, case, tool)
        return measured.run(command(tool, case, wanted, folder, out, report))[0], out

    tools = wanted.tools(case.name, TOOLS)
    rows = record.measure(tools, wanted.repeats, once, head, lambda _, out: quality(case, folder, out), add_ratios)
    ours = next((row for row in rows if row["tool"] == OURS), {"failed": "not run"})
    return rows, None if "failed" in ours else json.loads(report.read_text())


def surface_file(wanted, case, tool):
    """The file that keeps the surface of a tool, to be looked at."""
    return wanted.out / "surfaces" / f"{case.name} {tool}.ply".replace(" ", "_")


def add_ratios(rows, tool=OURS):
    """How many times the CPU time, wall time and memory of `tool` each takes."""
    ours = next((row for row in rows if row["tool"] == tool and "cpu_s" in row), None)
    for row in rows:
        if ours and "cpu_s" in row:
            for name in ("cpu", "wall", "peak"):
                unit = "mb" if name == "peak" else "s"
                row[f"{name}_ratio"] = row[f"{name}_{unit}"] / max(ours[f"{name}_{unit}"], measured.LEAST_S)


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


def growth(wanted, record):
    """How our time and memory grow with twice the scans and half the cell; a row for each combination."""
    virtual = SMALLEST if wanted.smallest else VIRTUAL
    rows = []
    for scans in (virtual.scans, 2 * virtual.scans):
        conf = virtual_scans(wanted, replace(virtual, scans=scans)) / "scans.conf"
        for voxel in (virtual.voxel, virtual.voxel / 2):
            case = Case(f"{scans} scans {voxel:g} mm", conf, voxel, mm=1.0)
            if not record.has_time_for(f"growth, {case.name}"):
                return rows
            out, report = wanted.out / "inputs" / "growth.ply", wanted.out / "inputs" / "growth.json"
            print(f"  {case.name}: {wanted.repeats} runs", flush=True)
            program = command(OURS, case, wanted, None, out, report)
            runs = [measured.run(program)[0] for _ in range(wanted.repeats)]
            figures = {name: statistics.median(run[name] for run in runs) for name in ("cpu_s", "wall_s", "peak_mb")}
            told = json.loads(report.read_text())
            row = {"scans": scans, "voxel_mm": voxel, "input_triangles": told["input_triangles"]} | figures
            row |= {"triangles": sum(told["faces"]), "intersections": told["intersections"]}
            rows.append(row)
            row["cpu_growth"] = row["cpu_s"] / rows[0]["cpu_s"]
            row["peak_growth"] = row["peak_mb"] / rows[0]["peak_mb"]
            record.put(row, "growth")
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


def main(wanted, record):
    """Runs the benchmark."""
    shares = []
    for case in cases(wanted, record):
        print(f"\n{case.name}", flush=True)
        rows, report = run_case(case, wanted, record)
        show_rows(rows)
        if report and case.paper:
            total = sum(report["faces"]) or 1
            made = {k: 100 * n / total for k, n in zip("abc", report["faces"], strict=True)}
            paper = {f"paper_{k}": share for k, share in zip("abc", case.paper, strict=True)}
            shares.append({"case": case.name} | made | paper)
            record.put(shares[-1], "face_shares")
    if shares:
        show_shares(shares)
    if wanted.takes("growth"):
        show_growth(growth(wanted, record))
