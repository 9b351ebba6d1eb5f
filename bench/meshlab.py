"""Merging inside MeshLab: our filter beside MeshLab's own reconstruction, on the same layers in the same pymeshlab.

Every run is a fresh process. `cpu_s`, `wall_s` and `peak_mb` are of the whole process, with the import of pymeshlab and
the loading of the layers; `filter_cpu_s`, `filter_wall_s` and `filter_peak_mb` of the filter alone.
"""

import json
import sys

import measured
import merge
import table
from prepare import prepare

OURS, PEER = "surfrecon-filter", "vcg-filter"
TOOLS = [OURS, PEER]
PLUGIN = merge.HERE.parent / "out" / "meshlab-plugin" / "2025.07-double" / "libfilter_surfrecon.so"
COLUMNS = [*merge.COLUMNS, "filter_cpu_s", "filter_wall_s", "filter_peak_mb", "files_left"]


def run_case(case, wanted, record):
    """Both filters in turn; a row each."""
    folder = wanted.out / "inputs" / f"{case.conf.parent.name}_prepared"
    prepared = prepare(case.conf, folder)
    (wanted.out / "surfaces").mkdir(parents=True, exist_ok=True)

    def head(tool):
        voxel = case.voxel * case.mm
        return {"case": case.name, "tool": tool, "voxel_mm": voxel, "input_triangles": prepared["triangles"]}

    def once(tool):
        print(f"  {case.name}: {tool}", flush=True)
        out = merge.surface_file(wanted, case, tool)
        command = [sys.executable, merge.HERE / "meshlab_filter.py", tool, folder, case.voxel, out, PLUGIN]
        figures, printed = measured.run(command)
        return figures | json.loads(printed.strip().splitlines()[-1]), out

    tools = wanted.tools(case.name, TOOLS)
    return record.measure(
        tools, wanted.repeats, once, head, lambda _, out: merge.quality(case, folder, out), add_ratios
    )


def add_ratios(rows):
    """How many times what our filter takes each takes."""
    merge.add_ratios(rows, OURS)
    ours = next((row for row in rows if row["tool"] == OURS and "filter_cpu_s" in row), None)
    for row in rows:
        if ours and "filter_cpu_s" in row:
            row["filter_cpu_ratio"] = row["filter_cpu_s"] / max(ours["filter_cpu_s"], measured.LEAST_S)
            row["filter_wall_ratio"] = row["filter_wall_s"] / max(ours["filter_wall_s"], measured.LEAST_S)


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


def main(wanted, record):
    """Runs the benchmark."""
    if not PLUGIN.is_file():
        record.skip(
            "the plugin for MeshLab 2025.07 is not there: tools/build_meshlab_plugin.sh 2025.07-double says why"
        )
        return
    for case in merge.cases(wanted, record):
        print(f"\n{case.name}", flush=True)
        show(run_case(case, wanted, record))
