"""Merges of more scans than memory holds, and on more processes than one: in files, beside the same in memory.

Frames of a depth camera in rows over a landscape, each sees a part of what the one beside it sees; a thousand have 3e8
samples.
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
HERE = Path(__file__).parent
THREADS = 2
# Of the camera, in metres: how high it is above the landscape, and how far frames are from each other.
HEIGHT, APART = 1.6, (0.45, 0.35)
# Where the landscape lies: at no corner of space, which each block ends at, however large it is.
PLACE = (3, 3, 3)


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
        for _ in range(8):  # rays are steep and slopes are not: each round is nearer by a third
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


# Of the same case the bytes are the same. Less memory, more blocks: blocks of 6, 18 and 63 bricks a side.
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


def main(wanted, record):
    """Runs the cases."""
    size = (60, 80) if wanted.smallest else (480, 640)
    python = cluster_python(record)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for count in (6,) if wanted.smallest else (10, 100, 1000):
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
    table.show(record.rows, {"case": "case", "tool": "tool"} | {key: key for key in COLUMNS})
