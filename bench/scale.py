"""Merges of more scans than memory holds: in files of a workspace, beside the same in memory, whose bytes are the same.

Frames of a depth camera in rows over a landscape, each sees a part of what the one beside it sees; a thousand have 3e8
samples.
"""

import hashlib
import json
import sys
import tempfile
from pathlib import Path

import measured
import numpy as np
import table

COLUMNS = ["scans", "samples", "max_memory_mb", "vertices", "same_bytes", "cpu_s", "wall_s", "peak_mb", "disk_mb"]
CALL = Path(__file__).parent / "scale_call.py"
THREADS = 2
# Of the camera, in metres: how high it is above the landscape, and how far frames are from each other.
HEIGHT, APART = 1.6, (0.45, 0.35)


def heights(x, y):
    """Hills with folds."""
    return (
        0.35 * np.sin(1.3 * x) * np.cos(1.1 * y)
        + 0.12 * np.sin(4.1 * x + 0.5) * np.sin(3.7 * y)
        + 0.02 * np.sin(17 * x) * np.cos(19 * y)
    )


def camera(rows, cols):
    """Focal lengths and centre, in pixels."""
    return 0.94 * cols, 0.94 * cols, (cols - 1) / 2, (rows - 1) / 2


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
        for _ in range(8):  # rays are steep and slopes are not: each round is nearer by a third
            depth = eye[2] - heights(eye[0] + along * depth, eye[1] + up * depth)
        np.save(names[-1], depth.astype(np.float32))
        pose = np.diag([1.0, -1, -1, 1])
        pose[:3, 3] = eye
        np.savetxt(names[-1].with_suffix(".pose.txt"), pose)
    return names


def one(names, size, folder, memory_mb):
    """The figures of a merge, in memory where no megabytes are given, and a number for the bytes of its result."""
    out = folder / "surface.ply"
    asked = [list(map(str, names)), camera(*size), str(out), memory_mb, THREADS]
    (folder / "asked.json").write_text(json.dumps(asked))
    figures, printed = measured.run([sys.executable, CALL, folder / "asked.json"])
    with out.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    out.unlink()
    return {"cpu_s": figures["cpu_s"], "wall_s": figures["wall_s"]} | json.loads(printed.splitlines()[-1]), digest


def main(wanted, record):
    """Runs the cases."""
    size = (60, 80) if wanted.smallest else (480, 640)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for count in (6,) if wanted.smallest else (10, 100, 1000):
            case = f"{count:,} frames"
            tools = {"surfrecon": None, "surfrecon-files-512": 512, "surfrecon-files-128": 128}
            run = wanted.tools(case, tools)
            if not run:
                continue
            names = make(folder, count, *size)
            expected = None
            for tool in run:
                found, digest = one(names, size, folder, tools[tool])
                expected = expected or digest
                row = {"case": case, "tool": tool, "scans": count, "samples": count * size[0] * size[1]}
                record.put(row | found | {"max_memory_mb": tools[tool] or 0, "same_bytes": digest == expected})
            for name in names:
                name.unlink()
    table.show(record.rows, {"case": "case", "tool": "tool"} | {key: key for key in COLUMNS})
