"""Merging inside MeshLab: our filter beside MeshLab's own reconstruction, on the same layers in the same pymeshlab.

Every run is a fresh process. `cpu_s`, `wall_s` and `peak_mb` are of the whole process, with the import of pymeshlab and
the loading of the layers; `filter_cpu_s`, `filter_wall_s` and `filter_peak_mb` of the filter alone.
"""

import json
import statistics
import sys

import measured
import table
from merge import OUT, ROOT, add_ratios, data_cases, quality, virtual_case
from prepare import prepare

OURS, PEER = "surfrecon-filter", "vcg-filter"
TOOLS = [OURS, PEER]
PLUGIN = ROOT / "out" / "meshlab-plugin" / "2025.07-double" / "libfilter_surfrecon.so"
FIGURES = ["cpu_s", "wall_s", "peak_mb", "filter_cpu_s", "filter_wall_s", "filter_peak_mb", "files_left"]


def measure(case, folder, tool, out):
    """Runs a filter once."""
    command = [sys.executable, ROOT / "bench" / "meshlab_filter.py", tool, folder, case.voxel, out, PLUGIN]
    figures, printed = measured.run(command)
    return figures | json.loads(printed.strip().splitlines()[-1])


def run_case(case, repeats):
    """Both filters in turn; a row each."""
    folder = (OUT / "inputs" / f"{case.conf.parent.name}_prepared").resolve()
    prepared = prepare(case.conf, folder)
    (OUT / "surfaces").mkdir(parents=True, exist_ok=True)
    surfaces = {tool: OUT / "surfaces" / f"{case.name} {tool}.ply".replace(" ", "_") for tool in TOOLS}
    runs, failures = {tool: [] for tool in TOOLS}, {}
    for turn in range(repeats):
        for tool in TOOLS:
            if tool in failures:
                continue
            print(f"  {case.name}: {tool}, run {turn + 1} of {repeats}", flush=True)
            try:
                runs[tool].append(measure(case, folder, tool, surfaces[tool]))
            except measured.Failed as failed:
                failures[tool] = str(failed)
                print(f"    failed: {failed}", flush=True)
    rows = []
    for tool in TOOLS:
        row = {
            "case": case.name,
            "tool": tool,
            "voxel_mm": case.voxel * case.mm,
            "input_triangles": prepared["triangles"],
        }
        if tool in failures:
            rows.append(row | {"failed": failures[tool]})
            continue
        row |= {name: statistics.median(run[name] for run in runs[tool]) for name in FIGURES}
        row["filter_cpu_s_all"] = [run["filter_cpu_s"] for run in runs[tool]]
        rows.append(row | quality(case, folder, surfaces[tool]))
    add_ratios(rows, OURS)
    ours = next((row for row in rows if row["tool"] == OURS and "filter_cpu_s" in row), None)
    for row in rows:
        if ours and "filter_cpu_s" in row:
            row["filter_cpu_ratio"] = row["filter_cpu_s"] / ours["filter_cpu_s"]
            row["filter_wall_ratio"] = row["filter_wall_s"] / ours["filter_wall_s"]
    return rows


def show(rows):
    """Prints the rows of one case."""
    columns = {
        "tool": "tool", "filter CPU s": "filter_cpu_s", "x ours": "filter_cpu_ratio", "wall s": "filter_wall_s",
        "x": "filter_wall_ratio", "MB": "filter_peak_mb", "process CPU s": "cpu_s", "MB ": "peak_mb",
        "triangles": "triangles", "parts": "components", "loops": "boundary_loops", "border edges": "boundary_edges",
        "nm edges": "nonmanifold_edges", "RMS mm": "rms_mm", "mean mm": "mean_mm", "max mm": "max_mm",
        "astray max mm": "surface_to_scans_max_mm", "files left": "files_left",
    }  # fmt: skip
    if any("to_truth_mean_mm" in row for row in rows):
        columns |= {
            "to truth mean": "to_truth_mean_mm",
            "max": "to_truth_max_mm",
            "from truth mean": "from_truth_mean_mm",
        }
    table.show(rows, columns)


def main(only_cases, repeats):
    """Runs the benchmark and returns what goes into the JSON file."""
    skipped = []
    if not PLUGIN.is_file():
        skipped.append(
            "the plugin for MeshLab 2025.07 could not be built: tools/build_meshlab_plugin.sh 2025.07-double says why"
        )
        cases = []
    else:
        cases = [case for case in [*data_cases(skipped), virtual_case()] if only_cases in case.name]
    rows = []
    for case in cases:
        print(f"\n{case.name}", flush=True)
        rows += run_case(case, repeats)
        show([row for row in rows if row["case"] == case.name])
    for reason in skipped:
        print(f"SKIPPED {reason}")
    return {"rows": rows, "skipped": skipped}
