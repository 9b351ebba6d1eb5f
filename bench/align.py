"""Scans without poses to one frame: beside Open3D's two global registrations, with its ICP and pose graph.

Every run is a fresh process on the same files, whose poses are anything; times include reading and the import of the
package. Ours runs on one thread. A scan is `wrong` if it was placed and one of its samples is off by more than five
distances of samples; on real scans beside the archive's poses, which are another program's.
"""

import json
import sys
import tempfile
from pathlib import Path

import align_cases
import measured
import numpy as np
import table
from scipy.spatial import cKDTree

HERE = Path(__file__).resolve().parent
TOOLS = ["surfrecon", "open3d-ransac", "open3d-fgr"]
WRONG = 5.0
FOUND = ["placed", "wrong", "reason_given", "worst_shift_spacings", "residual_mm", "residual_conf_mm", "nees"]
COLUMNS = ["case", "tool", "scans", "overlap_pct", "noise", "threads", "expected_refusal", *FOUND]
COLUMNS += ["runs", "cpu_s", "wall_s", "peak_mb"]
SHOWN = {"tool": "tool", "scans": "scans", "placed": "placed", "wrong": "wrong", "worst shift": "worst_shift_spacings"}
SHOWN |= {
    "residual mm": "residual_mm",
    "of .conf": "residual_conf_mm",
    "NEES / 6": "nees",
    "CPU s": "cpu_s",
    "MB": "peak_mb",
}


class Scans:
    """Samples of a set, as the checker needs them."""

    def __init__(self, place):
        import surfrecon

        self.truth = np.load(place / "truth.npy")
        images = [scan.read() for scan in surfrecon.open(place / "scans.conf")]
        meshes = [image.triangulate() for image in images]
        self.points = [np.asarray(mesh.positions) for mesh in meshes]
        self.normals = [normals(mesh) for mesh in meshes]
        self.spacings = [np.median(cKDTree(p).query(p[::7], k=2)[0][:, 1]) for p in self.points]

    def errors(self, poses):
        """How far each placed scan is off, in spacings, where the scan fits that makes the worst least."""
        placed = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
        best = np.full(len(poses), np.nan)
        for anchor in placed:
            found = np.full(len(poses), np.nan)
            truth_from_found = self.truth[anchor] @ np.linalg.inv(poses[anchor])
            for k in placed:
                off = moved(truth_from_found @ poses[k], self.points[k][::17]) - moved(
                    self.truth[k], self.points[k][::17]
                )
                found[k] = np.linalg.norm(off, axis=1).max() / self.spacings[k]
            if np.isnan(best).all() or np.nanmax(found) < np.nanmax(best):
                best = found
        return best

    def squares(self, poses):
        """Squared distances of samples along the normals of others' nearest samples, within two spacings."""
        placed = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
        points = {k: moved(poses[k], self.points[k]) for k in placed}
        turned = {k: self.normals[k] @ poses[k][:3, :3].T for k in placed}
        trees = {k: cKDTree(points[k]) for k in placed}
        found = []
        for a in placed:
            for b in placed:
                if a != b:
                    some = points[b][::9]
                    distance, nearest = trees[a].query(some, distance_upper_bound=2 * self.spacings[a])
                    near = np.isfinite(distance)
                    same = (turned[b][::9][near] * turned[a][nearest[near]]).sum(1) > 0.7
                    off = ((some[near] - points[a][nearest[near]]) * turned[a][nearest[near]]).sum(1)
                    found.append(off[same] ** 2)
        return np.concatenate(found) if found else np.empty(0)


def moved(pose, points):
    """The points elsewhere."""
    return points @ pose[:3, :3].T + pose[:3, 3]


def normals(mesh):
    """Unit normals of the vertices."""
    corners = mesh.positions[mesh.triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros(mesh.positions.shape)
    for i in range(3):
        np.add.at(sums, mesh.triangles[:, i], faces)
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-300)


def squared_errors(scans, poses, told):
    """Squared errors of the poses by what their covariances say, over six."""
    kept = next((k for k, c in enumerate(told["covariance"]) if not np.any(c) and np.isfinite(poses[k]).all()), None)
    found = []
    for k, covariance in enumerate(np.array(told["covariance"])):
        if kept is None or k == kept or not np.isfinite(poses[k]).all() or not covariance.any():
            continue
        found_from_truth = poses[kept] @ np.linalg.inv(scans.truth[kept])
        error = found_from_truth @ scans.truth[k] @ np.linalg.inv(poses[k])
        middle = np.array(told["middle"][k])
        turn = 0.5 * np.array([error[2, 1] - error[1, 2], error[0, 2] - error[2, 0], error[1, 0] - error[0, 1]])
        motion = np.concatenate([turn, moved(error, middle[None])[0] - middle])
        size = np.ptp(scans.points[k], axis=0).max()
        unit = np.array([size] * 3 + [1.0] * 3)
        found.append((motion * unit) @ np.linalg.solve(covariance * np.outer(unit, unit), motion * unit) / 6)
    return found


def judge(case, sets, tool, made):
    """What a tool's poses are worth."""
    poses_of, told = made
    placed = wrong = 0
    worst, squares, given, nees = [], [], [], []
    for number, scans in enumerate(sets):
        poses = poses_of[f"set{number:03}"]
        errors = scans.errors(poses)
        placed += int(np.isfinite(errors).sum())
        wrong += int((errors > WRONG).sum()) if not case.refusal else 0
        worst.append(np.nanmax(errors, initial=0.0))
        squares.append(scans.squares(poses))
        given.append(scans.squares(scans.truth))
        if told[number] and case.known and not case.refusal:
            nees += squared_errors(scans, poses, told[number])
    rms = lambda found: case.mm * float(np.sqrt(np.concatenate(found).mean())) if sum(map(len, found)) else None  # noqa: E731
    reasons = sum(len(said.get("reasons", ())) for said in told)
    return {
        "placed": placed,
        "wrong": placed if case.refusal else wrong,
        "reason_given": reasons,
        "worst_shift_spacings": float(max(worst)) if placed and not case.refusal else None,
        "residual_mm": rms(squares),
        "residual_conf_mm": None if case.known else rms(given),
        "nees": float(np.mean(nees)) if nees else None,
    }


def main(wanted, record):
    """Runs all cases, prints a table a case."""
    for case in align_cases.cases(wanted, record):
        if not record.has_time_for(case.name):
            break
        tools = wanted.tools(case.name, TOOLS)
        count = sum(map(len, case.sets))
        with tempfile.TemporaryDirectory() as folder:
            align_cases.write(case, folder)
            sets = [Scans(place) for place in sorted(Path(folder).glob("set*"))]
            out = Path(folder) / "poses.npz"

            def once(tool, folder=folder, out=out):
                figures, printed = measured.run([sys.executable, HERE / "peer_align.py", tool, folder, out])
                with np.load(out) as poses:
                    return figures, (dict(poses), json.loads(printed.strip().splitlines()[-1]))

            def head(tool, case=case, count=count):
                told = {
                    "case": case.name,
                    "tool": tool,
                    "scans": count,
                    "overlap_pct": case.overlap,
                    "noise": case.noise,
                }
                return told | {"threads": 1 if tool == "surfrecon" else None, "expected_refusal": case.refusal}

            def worth(tool, made, case=case, sets=sets):
                return judge(case, sets, tool, made)

            rows = record.measure(tools, wanted.repeats, once, head, worth)
        print(f"\n{case.name}" + (": nothing should be placed" if case.refusal else ""))
        table.show(rows, SHOWN)
