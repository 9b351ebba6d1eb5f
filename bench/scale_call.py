"""One row of bench/scale.py: scale_call.py FILE, with [NAMES, CAMERA, OUT, MEGABYTES OR null, THREADS] in the file."""

import contextlib
import json
import resource
import sys
import tempfile
import threading
from pathlib import Path

import surfrecon

names, camera, out, megabytes, threads = json.loads(Path(sys.argv[1]).read_text())


def taken_mb():
    """The most memory that this process had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def on_disk(folder):
    """Bytes of all files in a folder."""
    total = 0
    for file in Path(folder).rglob("*"):
        with contextlib.suppress(FileNotFoundError):  # done with since it was listed
            total += file.stat().st_size
    return total


scans = surfrecon.open(names, camera=camera)
before, most, done = taken_mb(), 0, threading.Event()
with tempfile.TemporaryDirectory() as workspace:

    def watch():
        """Looks at the workspace every now and then."""
        global most
        while not done.wait(0.05):
            most = max(most, on_disk(workspace))

    watching = threading.Thread(target=watch)
    watching.start()
    if megabytes:
        surfrecon.merge_to_file(scans, out, max_memory=megabytes * 10**6, workspace=workspace, threads=threads)
    else:
        surfrecon.merge(scans, threads=threads).mesh.write(out)
    done.set()
    watching.join()
peak = taken_mb() - before
with open(out, "rb") as file:
    header = file.read(4096).split(b"end_header")[0].decode()
vertices = int(header.split("element vertex ")[1].split()[0])
print(json.dumps({"vertices": vertices, "peak_mb": peak, "disk_mb": most / 1e6}))
