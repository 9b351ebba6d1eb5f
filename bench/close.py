"""Closing surfaces: this library beside Poisson reconstructions, hole filling and MeshFix on the same merged surfaces.

Virtual scans of closed shapes of which a known share is unseen, and real scans. This library merges them and fills
nothing; every tool is given that surface, and ours the scans as well. Each run is a process of its own; times are of
the work alone. `close_figures.py` judges the results.
"""

import json
import os
import shutil
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import close_figures
import close_picture
import close_shapes
import measured
import noise_scans
import numpy as np
import slicer
import table

HERE = Path(__file__).resolve().parent

OURS, FLAT, SEEN, POISSON, MESHFIX = "surfrecon", "surfrecon-flat", "surfrecon-seen", "poisson-8", "meshfix"
# The openings that ours closes.
OPENINGS = {OURS: "all", FLAT: "all", SEEN: "seen"}
PEERS = [POISSON, "poisson-8-trimmed", "poisson-10", "vcg", "open3d-poisson-8", "meshlab-close-holes", MESHFIX]
COLUMNS = ["case", "tool", "close", "unseen_pct", "noise", "watertight", "crossings", "components", "in_seen_space_pct"]
COLUMNS += ["measured_moved", "filled_to_truth_rms_mm", "to_truth_rms_mm", "filled_pct", "thinnest_wall_mm", "slices"]
COLUMNS += ["cpu_s", "merge_cpu_s", "peak_mb"]
# A run that takes more CPU time is given up.
LIMIT_S = 300
# Beyond the merge distance, as of what a scan measured: half a cell of error.
SLACK_CELLS = 0.5


@dataclass
class Case:
    """Virtual scans of a shape, of which a share is unseen; noise in cells."""

    shape: str
    unseen: float
    noise: float

    @property
    def name(self):
        """As the command line and the tables name it."""
        return f"{self.shape}, {100 * self.unseen:.0f} % unseen, noise {self.noise:g}"


CASES = [
    Case(shape, unseen, noise)
    for shape in ("head", "figure", "sculpture", "vase", "goblet")
    for unseen in (0.05, 0.15, 0.28)
    for noise in (0, 0.5)
]
SMALLEST = [Case("ball", 0.15, 0)]
# Name, what is opened, with what options, whether its files say from where they were seen, millimetres in its unit.
REAL = [
    ("bunny", "stanford_bunny/bun.conf", {}, False, 1e3),
    ("dragon", "stanford_dragon_stand/dragonStandRight.conf", {}, False, 1e3),
    ("happy", "stanford_happy_stand/happyStandRight.conf", {}, False, 1e3),
    ("chair", "frames/scannerapp_chair/chair_scan", {}, True, 1e3),
]


@lru_cache(maxsize=1)
def scanned(shape, unseen, pixels, step):
    """The truth and images without noise, which cases that differ in noise share."""
    return close_shapes.scanned(close_shapes.SHAPES[shape], unseen, pixels, step)


def virtual(case, wanted):
    """The files of a case and what is known of it: its folder, truth and images."""
    pixels, step = (close_shapes.SMALL_PIXELS, 8.0) if wanted.smallest else (close_shapes.PIXELS, close_shapes.STEP)
    truth, shots = scanned(case.shape, case.unseen, pixels, step)
    noisy, _ = noise_scans.with_noise(shots, "white", case.noise)
    folder = new_folder(wanted)
    noise_scans.write(noisy, folder, triangulated=False)
    files = [folder / "camera.txt", folder / "poses.log", *sorted(folder.glob("frame_*.npy"))]
    tell(folder, files, {"invalid": 0}, True)
    return folder, truth, noisy


def new_folder(wanted):
    """An empty folder for what the tools are given."""
    folder = wanted.out / "inputs" / "close"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def tell(folder, files, options, sight):
    """Takes note of the scans where peer_close.py looks for them."""
    told = {"files": [str(file) for file in files], "options": options, "sight": sight}
    (folder / "scans.json").write_text(json.dumps(told))


def tool_run(tool, folder, out):
    """Runs a tool; gives its figures and what it says."""
    figures, printed = measured.run([sys.executable, HERE / "peer_close.py", tool, folder, out], cpu_limit=LIMIT_S)
    told = json.loads(printed.strip().splitlines()[-1])
    said = told.pop("said")
    return figures | told, said


def surface_file(wanted, name, tool):
    """The file of a result."""
    file = wanted.out / "surfaces" / "close" / f"{name} {tool}.npz".replace(",", "").replace("% ", "").replace(" ", "_")
    file.parent.mkdir(parents=True, exist_ok=True)
    return file


def mesh_of(file):
    """The vertices and faces of a result."""
    mesh = np.load(file)
    return mesh["positions"].astype(float), mesh["triangles"].astype(np.int64)


def run_case(name, tools, folder, wanted, record, truth=None, shots=None, noise=None, mm=1.0):
    """Merges, closes with each tool and judges; gives the rows."""
    merge, lengths = tool_run("merge", folder, folder / "surface.npz")
    merged = mesh_of(folder / "surface.npz")
    np.savez(folder / "merged.npz", positions=merged[0], triangles=merged[1], **lengths)
    cell = lengths["cell"]
    slack = lengths["merge_distance"] + SLACK_CELLS * cell
    known = {"noise": noise, "merge_cpu_s": merge["cpu_s"], "cell_mm": mm * cell}
    known |= {"merged_triangles": len(merged[1]), "merged_crossings": close_figures.crossings(*merged)}
    known["unseen_pct"] = close_figures.unseen_pct(merged, truth, cell) if truth else None

    def once(tool):
        print(f"  {name}: {tool}", flush=True)
        out = surface_file(wanted, name, tool)
        figures, said = tool_run(tool, folder, out)
        return figures, (out, said)

    def judge(_, made):
        out, said = made
        return close_figures.quality(mesh_of(out), merged, truth, shots, cell, slack, mm) | said

    def head(tool):
        return dict.fromkeys(COLUMNS) | {"case": name, "tool": tool, "close": OPENINGS.get(tool)} | known

    rows = record.measure(tools, 1, once, head, judge)
    if name == close_picture.CASE:
        results = [surface_file(wanted, name, tool) for tool in (FLAT, POISSON)]
        if all(result.is_file() for result in results):
            close_picture.draw(shots, truth, merged, [mesh_of(result) for result in results], cell, wanted.out)
    return rows


def real_cases(wanted, record):
    """The real scans that are wanted."""
    data = os.environ.get("SURFRECON_DATA")
    for name, file, options, sight, mm in () if wanted.smallest else REAL:
        if not wanted.takes(name):
            continue
        if data and (Path(data) / file).exists():
            yield name, Path(data) / file, options, sight, mm
        else:
            record.skip(f"{name}: {file} is not in SURFRECON_DATA")


def show(rows):
    """Prints the rows of one case."""
    columns = {
        "case": "case", "tool": "tool", "unseen %": "unseen_pct", "closed": "watertight",
        "open edges": "boundary_edges", "crossings": "crossings", "of the merge": "merged_crossings",
        "parts": "components", "seen %": "in_seen_space_pct", "moved": "measured_moved",
        "filled RMS mm": "filled_to_truth_rms_mm", "RMS mm": "to_truth_rms_mm",
        "left RMS mm": "unseen_to_result_rms_mm", "filled %": "filled_pct", "wall mm": "thinnest_wall_mm",
        "slices": "slices", "CPU s": "cpu_s", "merge CPU s": "merge_cpu_s", "MB": "peak_mb",
    }  # fmt: skip
    table.show(rows, columns)


def main(wanted, record):
    """Runs the benchmark."""
    if not slicer.is_there():
        record.skip(f"slices: {slicer.PROGRAM} is not installed")
    for case in SMALLEST if wanted.smallest else CASES:
        ours = [OURS, SEEN] + [FLAT] * close_shapes.SHAPES[case.shape].stands
        tools = wanted.tools(case.name, ours + PEERS)
        if tools and record.has_time_for(case.name):
            folder, truth, shots = virtual(case, wanted)
            show(run_case(case.name, tools, folder, wanted, record, truth, shots, case.noise))
    for name, file, options, sight, mm in real_cases(wanted, record):
        tools = wanted.tools(name, [OURS, SEEN, *PEERS])
        if tools and record.has_time_for(name):
            folder = new_folder(wanted)
            tell(folder, [file], options, sight)
            show(run_case(name, tools, folder, wanted, record, mm=mm))
