"""Merges of more scans than memory holds, and on more processes than one: in files, beside the same in memory.

Frames of a depth camera in rows over a landscape of sculptures, which is made while this runs; each sees a part of what
the one beside it sees. A thousand have 3e8 samples; what 1e9 take is extrapolated from the two largest cases.
"""

import hashlib
import json
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import measured
import numpy as np
import table

COLUMNS = ["scans", "samples", "blocks", "workers", "threads", "killed", "same_bytes", "replaced_cpu_s"]
COLUMNS += ["max_memory_mb", "vertices", "cpu_s", "wall_s", "peak_mb", "disk_mb"]
# The case that is extrapolated: how many samples, what grows with them, and most memory of a tool that is told a limit.
FAR, FAR_CASE, MOST_MB = 10**9, "1e9 samples, extrapolated", 16_000
GROWING = ["scans", "blocks", "vertices", "cpu_s", "replaced_cpu_s", "wall_s", "peak_mb", "disk_mb"]
HERE = Path(__file__).parent
THREADS = 2
# Of the camera, in metres: how high it is above the landscape, and how far frames are from each other.
HEIGHT, APART = 1.6, (0.45, 0.35)
# The place of the landscape: at no corner of space, which each block ends at, however large it is.
PLACE = (3, 3, 3)
# Of the sculptures, one to a square: the squares' side in metres, after how many they come again, and how steep their
# sides are. With the hills' slopes the steepest ray meets the ground once.
SEED, SQUARE, SQUARES, STEEP = 2026, 0.4, 64, 0.7


def sculptures():
    """For each square: centre, radius of the ridge, half its width, roundness, height of the top, if it is a block.

    A ridge without a radius is a dome, if it is round, or a cone; one with a radius is a torus lying down; a block
    has slanted sides and a flat top. Lengths are in sides of a square, the top in widths.
    """
    random = np.random.default_rng(SEED)
    count = SQUARES**2
    kind = random.integers(4, size=count)
    dome, torus, block = kind == 0, kind == 1, kind == 2
    reach = random.uniform(0.2, 0.45, count)
    centre = 0.5 + (0.5 - reach) * random.uniform(-1, 1, (2, count))
    width = np.where(torus, reach * random.uniform(0.25, 0.5, count), reach)
    top = np.where(block, random.uniform(0.2, 0.8, count), 1)
    return [*centre, np.where(torus, reach - width, 0), width, (dome | torus).astype(float), top, block]


SCULPTURES = sculptures()


def heights(x, y):
    """Hills, and sculptures on them."""
    hills = 0.24 * np.sin(1.3 * x) * np.cos(1.1 * y)
    x, y = x / SQUARE, y / SQUARE
    col, row = np.floor(x), np.floor(y)
    number = (row % SQUARES * SQUARES + col % SQUARES).astype(np.intp)
    east, north, ridge, width, round_, top, is_block = (column.take(number) for column in SCULPTURES)
    east, north = np.abs(x - col - east), np.abs(y - row - north)
    across = np.where(is_block, np.maximum(east, north), np.sqrt(east**2 + north**2))
    inward = np.maximum(1 - np.abs(across - ridge) / width, 0)
    return hills + STEEP * SQUARE * width * np.minimum(inward * (1 - 0.5 * round_ * inward), top)


# Rays are steep and slopes are not: each round is nearer by a third, at the corners of a frame at least.
ROUNDS = 8


def camera(rows, cols):
    """Focal lengths and centre, in pixels."""
    return 0.94 * cols, 0.94 * cols, (cols - 1) / 2, (rows - 1) / 2


def voxel(cols):
    """Cells of one and a half samples: given, since merges in memory would take larger ones where these do not fit."""
    return 1.5 * HEIGHT / camera(cols, cols)[0]


def make(folder, count, rows, cols):
    """Writes frames as depths and poses, those that are not there yet; their names."""
    fx, fy, cx, cy = camera(rows, cols)
    row, col = np.mgrid[:rows, :cols]
    along, up = (col - cx) / fx, -(row - cy) / fy
    wide = int(np.ceil(np.sqrt(count)))
    names = []
    for k in range(count):
        eye = np.array([APART[0] * (k % wide), APART[1] * (k // wide), HEIGHT])
        names.append(folder / f"{count}-{k:04}.npy")
        depth = np.full(along.shape, HEIGHT)
        for _ in range(ROUNDS):
            depth = eye[2] - heights(eye[0] + along * depth, eye[1] + up * depth)
        np.save(names[-1], depth.astype(np.float32))
        pose = np.diag([1.0, -1, -1, 1])
        pose[:3, 3] = eye + PLACE
        np.savetxt(names[-1].with_suffix(".pose.txt"), pose)
    return names


@dataclass
class Tool:
    """How a case is merged: in memory where no megabytes are given, by tasks one after the other, or on a cluster.

    What is kept of a merge of which one scan lay elsewhere is merged again; the time of both is that of the row.
    """

    megabytes: int | None = None
    tasks: int | None = None
    workers: int | None = None
    kill: bool = False
    kept: bool = False

    @property
    def threads(self):
        """Of each process."""
        return THREADS if self.workers is None else 1


# Of the same case the bytes are the same. Less memory, more blocks: of 6, 18 and 63 bricks a side, as many as come out.
TOOLS = {
    "surfrecon": Tool(),
    "surfrecon-files-512": Tool(512),
    "surfrecon-files-128": Tool(128),
    "surfrecon-tasks-12000": Tool(12_000, tasks=4),
    "surfrecon-tasks-1000": Tool(1_000, tasks=4),
    "surfrecon-tasks-128": Tool(128, tasks=16),
    "surfrecon-kept-128": Tool(128, kept=True),
    "surfrecon-dask-1": Tool(256, tasks=16, workers=1),
    "surfrecon-dask-2": Tool(256, tasks=16, workers=2),
    "surfrecon-dask-4": Tool(256, tasks=16, workers=4),
    "surfrecon-dask-2-killed": Tool(256, tasks=16, workers=2, kill=True),
}


def one(tool, names, size, folder, python):
    """The figures of a merge, and a number for the bytes of its result."""
    out = folder / "surface.ply"
    asked = {"names": list(map(str, names)), "camera": camera(*size), "voxel": voxel(size[1]), "out": str(out)}
    asked |= asdict(tool)
    (folder / "asked.json").write_text(json.dumps(asked | {"threads": tool.threads}))
    if tool.workers is None:
        figures, printed = measured.run([sys.executable, HERE / "scale_call.py", folder / "asked.json"])
    else:
        figures, printed = measured.run([python, HERE / "scale_dask.py", folder / "asked.json"])
    found = {"cpu_s": figures["cpu_s"], "wall_s": figures["wall_s"], "killed": 0}
    found |= json.loads(printed.splitlines()[-1])
    with out.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        file.seek(0)
        header = file.read(4096).split(b"end_header")[0].decode()
    out.unlink()
    return found | {"vertices": int(header.split("element vertex ")[1].split()[0])}, digest


def cluster_python(record):
    """A Python that has Dask."""
    made = subprocess.run([HERE.parent / "tools" / "venv.sh", "distributed"], capture_output=True, text=True)
    if made.returncode == 0:
        return Path(made.stdout.strip()) / "bin" / "python"
    record.skip("clusters of Dask: their environment could not be made")
    return None


def extrapolate(record, is_claimed=True):
    """Puts rows of 1e9 samples: of each tool the line through its two largest cases, no less than the larger.

    That who is told a limit takes at most MOST_MB of memory is claimed of cases that are large enough to tell.
    """
    for tool in dict.fromkeys(row["tool"] for row in record.rows):
        rows = [row for row in record.rows if row["tool"] == tool and "failed" not in row]
        if len(rows) < 2:
            continue
        less, more = sorted(rows, key=lambda row: row["samples"])[-2:]
        steps = (FAR - more["samples"]) / (more["samples"] - less["samples"])
        row = more | {"case": FAR_CASE, "tool": f"{tool}, extrapolated", "samples": FAR, "same_bytes": None}
        for key in GROWING:
            if more[key] is not None and less[key] is not None:
                row[key] = more[key] + max(more[key] - less[key], 0) * steps
        if is_claimed and row["max_memory_mb"] and row["peak_mb"] > MOST_MB:
            row["failed"] = f"takes {row['peak_mb']:.0f} MB, more than {MOST_MB}"
        record.put(row)


def main(wanted, record):
    """Runs the cases."""
    size = (60, 80) if wanted.smallest else (480, 640)
    python = cluster_python(record)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for count in (3, 6) if wanted.smallest else (10, 100, 1000):
            case = f"{count:,} frames"
            run = [name for name in wanted.tools(case, TOOLS) if python or TOOLS[name].workers is None]
            if not run:
                continue
            names = make(folder, count, *size)
            expected = None
            for name in run:
                tool = TOOLS[name]
                row = {"case": case, "tool": name, "scans": count, "samples": count * size[0] * size[1]}
                row |= {"workers": tool.workers or 1, "threads": tool.threads, "replaced_cpu_s": None}
                try:
                    found, digest = one(tool, names, size, folder, python)
                except measured.Failed as problem:
                    record.put(row | {"failed": str(problem)})
                    continue
                expected = expected or digest
                record.put(row | found | {"max_memory_mb": tool.megabytes or 0, "same_bytes": digest == expected})
            for name in names:
                name.unlink()
    extrapolate(record, not wanted.smallest)
    table.show(record.rows, {"case": "case", "tool": "tool"} | {key: key for key in COLUMNS})
