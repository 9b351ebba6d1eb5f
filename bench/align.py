"""Scans without poses to one frame: beside Open3D's two searches and KISS-Matcher, with a pose graph.

Every run is a fresh process on the same files, whose poses are anything; times include reading and the import of the
package. Ours runs on one thread. A scan is `wrong` if it was placed and one of its samples is off by more than five
distances of samples; on real scans beside the archive's poses, which are another program's. Pairs are those that share
a tenth of the smaller scan, and are found if one lies rightly to the other.

Tools `*-rough` get poses that are off by a fiftieth of the scan's size and three degrees: small_gicp and MeshLab only
refine. They run where the truth is known and all scans belong together, for they would place what they are given.
"""

import importlib.util
import json
import sys
import tempfile
from pathlib import Path

import align_cases
import align_rooms
import measured
import numpy as np
import table
from align_checks import Scans

HERE = Path(__file__).resolve().parent
# By tool, the packages that it needs.
TOOLS = {
    "surfrecon": [],
    "surfrecon-rough": [],
    "open3d-ransac": ["open3d"],
    "open3d-fgr": ["open3d"],
    "kiss-matcher": ["kiss_matcher", "small_gicp", "open3d"],
    "small_gicp-rough": ["small_gicp", "open3d"],
    "meshlab-rough": ["pymeshlab", "open3d"],
}
# For things and for rooms.
BUDGET_CPU_S = 960
# A search of all pairs of more scans takes peers hours.
MOST_FOR_PEERS = 40
FOUND = ["placed", "wrong", "reason_given", "pairs_total", "pairs_found", "worst_shift_spacings"]
FOUND += ["residual_mm", "residual_conf_mm", "nees", "snap_ms"]
# Figures that only rows of rooms have: see align_rooms.
OF_ROOMS = ["way", "wrong_said", "undecided", "rms_mm"]
COLUMNS = ["case", "tool", "scans", "overlap_pct", "noise", "threads", "expected_refusal", *FOUND]
COLUMNS += [*OF_ROOMS, "runs", "cpu_s", "wall_s", "peak_mb"]
SHOWN = {
    "tool": "tool",
    "scans": "scans",
    "placed": "placed",
    "wrong": "wrong",
    "pairs": "pairs_total",
    "found": "pairs_found",
    "worst shift": "worst_shift_spacings",
    "residual mm": "residual_mm",
    "of .conf": "residual_conf_mm",
    "NEES / 6": "nees",
    "snap ms": "snap_ms",
    "CPU s": "cpu_s",
    "MB": "peak_mb",
}


def judge(case, sets, made):
    """The quality of a tool's poses."""
    poses_of, told = made
    poses = [poses_of[f"set{number:03}"] for number in range(len(sets))]
    placed = int(sum(np.isfinite(of).all(axis=(1, 2)).sum() for of in poses))
    found = {
        "placed": placed,
        "wrong": placed if case.refusal else None,
        "reason_given": sum(len(said.get("reasons", ())) for said in told),
        "pairs_total": None,
        "pairs_found": None,
        "worst_shift_spacings": None,
        "residual_mm": rms(case, [scans.squares(of) for scans, of in zip(sets, poses, strict=True)]),
        "residual_conf_mm": None,
        "nees": None,
    }
    return found | (beside_truth(case, sets, poses, told) if case.truth else {})


def beside_truth(case, sets, poses, told):
    """The figures that need known places of scans."""
    both = list(zip(sets, poses, strict=True))
    errors = np.concatenate([scans.errors(of) for scans, of in both])
    nees = []
    for (scans, of), said in zip(both, told, strict=True):
        if said and case.truth == align_cases.EXACT and not case.refusal:
            nees += scans.squared_errors(of, said)
    given = case.truth == align_cases.OTHER
    return {
        "wrong": int((errors > sets[0].limit).sum()),
        "pairs_total": sum(len(scans.pairs) for scans in sets),
        "pairs_found": int(sum(scans.pairs_found(of) for scans, of in both)),
        "worst_shift_spacings": float(np.nanmax(errors)) if np.isfinite(errors).any() else None,
        "residual_conf_mm": rms(case, [scans.squares(scans.truth) for scans in sets]) if given else None,
        "nees": float(np.mean(nees)) if nees else None,
    }


def rms(case, squares):
    """The root of their mean, in millimetres."""
    return case.mm * float(np.sqrt(np.concatenate(squares).mean())) if sum(map(len, squares)) else None


def installed(tools, record):
    """Tools whose packages are there."""
    found = []
    for tool, packages in tools.items():
        lacking = [name for name in packages if importlib.util.find_spec(name) is None]
        if lacking:
            record.skip(f"{tool}: not installed: {', '.join(lacking)}")
        else:
            found.append(tool)
    return found


def unsuited(case, tool):
    """Why a tool can't do the case; None if it can."""
    ours, rough = tool.startswith("surfrecon"), tool.endswith("-rough")
    if rough and case.refusal:
        return "scans must be left out, and it places what it is given"
    if rough and not case.truth:
        return "there is no truth to start near"
    if rough and ours and not case.ranges:
        return "clouds take no poses"
    if not ours and max(map(len, case.sets)) > MOST_FOR_PEERS:
        return "so many scans take hours"
    return None


def suited(case, tools, record, unsuited=unsuited):
    """Tools that can do the case; others are left out visibly, once for each reason."""
    reasons = {tool: unsuited(case, tool) for tool in tools}
    for tool, reason in reasons.items():
        start = f"{tool}: {reason}: "
        if reason and not any(text.startswith(start) for text in record.skipped):
            record.skip(f"{start}{case.name}, and others of the kind")
    return [tool for tool in tools if not reasons[tool]]


def head(case, tool):
    """The columns of a row that say its case and its tool."""
    threads = 1 if tool.startswith("surfrecon") else None
    row = {"case": case.name, "tool": tool, "scans": case.count, "overlap_pct": case.overlap, "noise": case.noise}
    return row | {"threads": threads, "expected_refusal": case.refusal} | dict.fromkeys(OF_ROOMS)


def once(tool, folder):
    """Figures of a run, with poses and what the tool says of them."""
    out = Path(folder) / "poses.npz"
    figures, _ = measured.run([sys.executable, HERE / "peer_align.py", tool, folder, out])
    with np.load(out) as poses:
        return figures, (dict(poses), json.loads(Path(f"{out}.json").read_text()))


def snap_ms(tool, folder, record):
    """The median time of drawing a scan to the others, once they have poses; None for peers."""
    if tool != "surfrecon":
        return None
    out = Path(folder) / "poses.npz"
    try:
        measured.run([sys.executable, HERE / "peer_align.py", "snap", folder, out])
    except measured.Failed as failed:
        record.skip(f"snap: {failed}")
        return None
    times = json.loads(Path(f"{out}.json").read_text())
    return float(np.median(times)) if times else None


def main(wanted, record):
    """Runs all cases, prints a table a case."""
    tools = installed(TOOLS, record)
    for case in align_cases.cases(wanted, record):
        if not record.has_time_for(case.name):
            break
        with tempfile.TemporaryDirectory() as folder:
            align_cases.write(case, folder)
            sets = [Scans(place, case) for place in sorted(Path(folder).glob("set*"))]

            def worth(tool, made, case=case, sets=sets, folder=folder):
                return judge(case, sets, made) | {"snap_ms": snap_ms(tool, folder, record)}

            # Of pairs there are many in a run, and of scans that must be left out it is not asked how long that takes.
            repeats = 1 if case.overlap or case.refusal else wanted.repeats
            rows = record.measure(
                suited(case, wanted.tools(case.name, tools), record),
                repeats,
                lambda tool, folder=folder: once(tool, folder),
                lambda tool, case=case: head(case, tool),
                worth,
            )
        print(f"\n{case.name}" + (": scans must be left out" if case.refusal else ""))
        table.show(rows, SHOWN)
    align_rooms.main(wanted, record, installed, suited, COLUMNS)
