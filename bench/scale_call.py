"""One row of bench/scale.py in one process: scale_call.py FILE, with what is asked in the file.

{names, camera, voxel, out, megabytes, threads, tasks, kept}: without megabytes in memory, with tasks one after the
other, kept in a workspace that has a merge already of which one scan lay elsewhere.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import surfrecon
from surfrecon import distributed
from watched import Watched, most_taken_mb

asked = json.loads(Path(sys.argv[1]).read_text())
names, camera, out, threads = asked["names"], asked["camera"], asked["out"], asked["threads"]
memory = asked["megabytes"] and asked["megabytes"] * 10**6

scans = surfrecon.open(names, camera=camera)
before, replaced = most_taken_mb(), None
# Of the scan that lies elsewhere first, in metres: a twentieth of a cell.
MOVED = asked["voxel"] / 20


def move(name, by):
    """Moves a frame up."""
    path = Path(name).with_suffix(".pose.txt")
    pose = np.loadtxt(path)
    pose[2, 3] += by
    np.savetxt(path, pose)


with tempfile.TemporaryDirectory() as workspace, Watched(workspace) as watched:
    cell = {"voxel": asked["voxel"]}
    given = {"max_memory": memory, "workspace": workspace, "threads": threads, **cell}
    told = {"progress": watched.told}
    if asked["tasks"]:
        plan = distributed.Plan.make(None, names, out, tasks=asked["tasks"], reading={"camera": camera}, **given)
        for stage in plan.stages:
            watched.told(stage.name, 0)
            for number in stage.tasks:
                plan.run(number)
    elif asked["kept"]:
        middle, given["keep"] = names[len(names) // 2], True
        move(middle, MOVED)
        surfrecon.merge_to_file(surfrecon.open(names, camera=camera), out, **given)
        move(middle, -MOVED)
        began = time.process_time()
        surfrecon.merge_to_file(surfrecon.open(names, camera=camera), out, **given, **told)
        replaced = time.process_time() - began
    elif memory:
        surfrecon.merge_to_file(scans, out, **given, **told)
    else:
        surfrecon.merge(scans, threads=threads, **cell).mesh.write(out)
found = {
    "peak_mb": most_taken_mb() - before,
    "disk_mb": watched.most_mb,
    "blocks": (watched.blocks or None) if memory else 1,
}
found["replaced_cpu_s"] = replaced
print(json.dumps(found))
