"""Rooms seen from inside and recordings without poses: beside Open3D's dense SLAM, its reconstruction system, its
multiway registration, and KISS-ICP for frames in order; KISS-Matcher for heaps; small_gicp from rough poses.

Every run is a fresh process on the same depth images; times include reading and the import of the package.

A frame is off if one of its samples lies further from where it belongs than 5 cm and than five distances of its
samples. Where frames belong in what was found is said by the largest group that agrees: of the rigid motions that put
one placed frame where it belongs, that which leaves fewest off, then fitted to the samples of all that are not off, as
long as more of them come. `wrong` counts frames that are placed and off, of which the tool does not say so: ours gives
the standard deviation of each frame's place, and six of them say what is possible. What is off and said is
`wrong_said`. Of a case in which nothing may be placed, all that is placed is wrong. Frames that stay where they were
given because nothing decides where they belong are not placed: they are `undecided`.

`rms_mm` is of points 2 m before the cameras of all frames that are placed, after the rigid motion that fits these best.
A row of many heaps has the sums of its counts, and `wrong_in` says which heaps have frames that are wrong.
"""

import json
import sys
import tempfile
from pathlib import Path

import measured
import numpy as np
import room_cases
import table
from align_checks import fitted, moved
from align_shapes import spacing

HERE = Path(__file__).resolve().parent
# By way in which frames are given, the tools, and the packages these need.
TOOLS = {
    "sequence": {"surfrecon": [], "open3d-slam": ["open3d"], "open3d-fragments": ["open3d"]}
    | {"open3d-multiway": ["open3d"], "kiss-icp": ["kiss_icp", "open3d"]},
    "heap": {"surfrecon": [], "kiss-matcher": ["kiss_matcher", "small_gicp", "open3d"]},
} | dict.fromkeys(room_cases.POSED, {"surfrecon": [], "small_gicp-rough": ["small_gicp", "open3d"]})
# Metres, and distances of samples.
LIMIT, LIMIT_SPACINGS = 0.05, 5.0
# Deviations that say how far a frame may be off.
SAID = 6.0
AHEAD = 2.0
# Of the clock: all heaps are one run. Of peers' CPU time: Open3D's tracking may run forever where it has lost track.
TIMEOUT_S, CPU_LIMIT_S = 7200, 300
# It does not always end, see above.
NOT_OF_SMALLEST = {"open3d-slam"}
# Samples of a frame that are looked at.
SAMPLES = 300
# Peers look at all pairs of more frames for hours, and of more heaps; those that need not may take more.
MOST_FOR_PEERS, MOST_IN_A_HEAP = 100, 20
MOST_FOR = {"open3d-slam": 300, "open3d-fragments": 300}
SHOWN = {
    "tool": "tool",
    "frames": "scans",
    "placed": "placed",
    "wrong": "wrong",
    "said": "wrong_said",
    "undecided": "undecided",
    "rms mm": "rms_mm",
    "CPU s": "cpu_s",
    "wall s": "wall_s",
    "MB": "peak_mb",
}


class Frames:
    """Samples of a recording, in the frames of its camera, and where they belong."""

    def __init__(self, place):
        import open3d

        known = json.loads((place / "camera.json").read_text())
        self.truth, self.points, self.limits = np.load(place / "truth.npy"), [], []
        for file in sorted(place.glob("frame_*.png")):
            depth = open3d.t.io.read_image(str(file)).as_tensor().numpy()[..., 0] / known["per_metre"]
            row, col = np.nonzero(depth)
            z = depth[row, col]
            rays = (np.stack([col, row], 1) - known["centre"]) / known["focal"]
            points = np.column_stack([rays * z[:, None], z])
            self.limits.append(max(LIMIT, LIMIT_SPACINGS * spacing(points)))
            self.points.append(points[:: max(1, len(points) // SAMPLES)])

    def off(self, found_from_truth, poses, placed):
        """How far each placed frame is off, in its limits."""
        far = []
        for k in placed:
            away = moved(found_from_truth @ self.truth[k], self.points[k]) - moved(poses[k], self.points[k])
            far.append(np.linalg.norm(away, axis=1).max() / self.limits[k])
        return np.array(far)

    def fit(self, poses, frames, points=None):
        """The motion that lays the truth on what was found, by these frames."""
        some = {k: self.points[k] if points is None else points for k in frames}
        both = [[moved(of[k], some[k]) for k in frames] for of in (self.truth, poses)]
        return fitted(*map(np.concatenate, both))

    def errors(self, poses, placed):
        """How far each placed frame is off, in its limits, by the largest group that agrees."""
        ways = [self.off(poses[k] @ np.linalg.inv(self.truth[k]), poses, placed) for k in placed]
        best = min(ways, key=lambda far: ((far > 1).sum(), far.sum()))
        while True:
            far = self.off(self.fit(poses, placed[best <= 1]), poses, placed)
            if (far <= 1).sum() <= (best <= 1).sum():
                return far if (far <= 1).sum() == (best <= 1).sum() else best
            best = far

    def squares(self, poses, placed):
        """Squared distances of points before the cameras from where they belong."""
        ahead = np.array([[0, 0, AHEAD], [0.1, 0, AHEAD], [0, 0.1, AHEAD]])
        motion = self.fit(poses, placed, ahead)
        off = [moved(motion @ self.truth[k], ahead[:1]) - moved(poses[k], ahead[:1]) for k in placed]
        return np.sum(np.concatenate(off) ** 2, axis=1)


def judge(case, sets, made):
    """The quality of a tool's poses."""
    poses_of, told = made
    counts, squares, wrong_in = np.zeros(5, int), [], []
    for number, (frames, said, recording) in enumerate(zip(sets, told, case.recordings, strict=True)):
        poses = poses_of[f"set{number:03}"]
        is_open = np.array(said.get("states", [""] * len(poses))) == "undecided"
        placed = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)) & ~is_open)
        wrong, and_said = np.array([], int), np.array([], int)
        if case.refusal:
            wrong = placed
        elif len(placed):
            far = frames.errors(poses, placed)
            may_be = SAID * np.array(said.get("deviation", np.zeros(len(poses))))[placed]
            is_said = far * np.array(frames.limits)[placed] <= may_be
            wrong, and_said = placed[(far > 1) & ~is_said], placed[(far > 1) & is_said]
            squares += [frames.squares(poses, placed)] if len(placed) > 1 else []
        counts += len(placed), len(wrong), len(and_said), is_open.sum(), len(said.get("reasons", ()))
        if len(wrong):
            wrong_in.append({"recording": recording.name, "frames": wrong.tolist()})
    names = ("placed", "wrong", "wrong_said", "undecided", "reason_given")
    found = dict(zip(names, map(int, counts), strict=True))
    rms = 1e3 * float(np.sqrt(np.concatenate(squares).mean())) if squares else None
    return found | {"rms_mm": rms, "wrong_in": wrong_in}


def unsuited(case, tool):
    """Why a peer can't do the case; None if it can."""
    if tool.startswith("surfrecon"):
        return None
    if case.refusal:
        return "nothing may be placed, and it places what it is given"
    if case.count > MOST_FOR.get(tool, MOST_FOR_PEERS) or (case.way == "heap" and case.count > MOST_IN_A_HEAP):
        return "so many frames take long"
    return None


def once(tool, folder):
    """Figures of a run, with poses and what the tool says of them."""
    out = Path(folder) / "poses.npz"
    limit = 0 if tool.startswith("surfrecon") else CPU_LIMIT_S
    command = [sys.executable, HERE / "peer_rooms.py", tool, folder, out]
    figures, _ = measured.run(command, timeout=TIMEOUT_S, cpu_limit=limit)
    with np.load(out) as poses:
        return figures, (dict(poses), json.loads(Path(f"{out}.json").read_text()))


def main(wanted, record, installed, suited, columns):
    """Runs all cases, prints a table a case; the others' rows have the same columns."""
    tools = {}
    for case in room_cases.cases(wanted, record):
        if not record.has_time_for(case.name):
            break
        if case.way not in tools:
            of_way = TOOLS[case.way].items()
            some = {tool: needs for tool, needs in of_way if not (wanted.smallest and tool in NOT_OF_SMALLEST)}
            tools[case.way] = installed(some, record)
        some = wanted.tools(case.name, tools[case.way])
        if wanted.smallest and case.refusal:
            some = [tool for tool in some if tool.startswith("surfrecon")]
        with tempfile.TemporaryDirectory() as folder:
            room_cases.write(case, folder)
            sets = [Frames(place) for place in sorted(Path(folder).glob("set*"))]
            rows = record.measure(
                suited(case, some, record, unsuited),
                1,
                lambda tool, folder=folder: once(tool, folder),
                lambda tool, case=case: head(case, tool, columns),
                lambda tool, made, case=case, sets=sets: judge(case, sets, made),
            )
        print(f"\n{case.name}" + (": nothing may be placed" if case.refusal else ""))
        table.show(rows, SHOWN)


def head(case, tool, columns):
    """The columns of a row that say its case and its tool. Columns that only rows of scans have are null."""
    threads = 1 if tool.startswith("surfrecon") else None
    known = {"case": case.name, "tool": tool, "scans": case.count, "threads": threads, "expected_refusal": case.refusal}
    return dict.fromkeys(columns) | known | {"way": case.way}
