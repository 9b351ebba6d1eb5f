"""One row of bench/scale.py in one process: scale_call.py FILE, with what is asked in the file.

{names, camera, out, megabytes, threads, tasks}: without megabytes in memory, with tasks one after the other.
"""

import json
import sys
import tempfile
from pathlib import Path

import surfrecon
from surfrecon import distributed
from watched import Watched, most_taken_mb

asked = json.loads(Path(sys.argv[1]).read_text())
names, camera, out, threads = asked["names"], asked["camera"], asked["out"], asked["threads"]
memory = asked["megabytes"] and asked["megabytes"] * 10**6

scans = surfrecon.open(names, camera=camera)
before = most_taken_mb()
with tempfile.TemporaryDirectory() as workspace, Watched(workspace) as watched:
    given = {"max_memory": memory, "workspace": workspace, "threads": threads}
    if asked["tasks"]:
        plan = distributed.Plan.make(None, names, out, tasks=asked["tasks"], reading={"camera": camera}, **given)
        for stage in plan.stages:
            watched.told(stage.name, 0)
            for number in stage.tasks:
                plan.run(number)
    elif memory:
        surfrecon.merge_to_file(scans, out, **given)
    else:
        surfrecon.merge(scans, threads=threads).mesh.write(out)
found = {"peak_mb": most_taken_mb() - before, "disk_mb": watched.most_mb, "blocks": watched.blocks or None}
print(json.dumps(found))
