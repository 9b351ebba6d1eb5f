"""One row of bench/scale.py on a Dask cluster: scale_dask.py FILE, with what is asked in the file.

{names, camera, out, megabytes, tasks, workers, kill}. CPU time and peaks are those of the workers, one thread each,
since they were there; one that takes the place of one that is killed counts from its start.
"""

import json
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

import dask
import psutil
from dask.distributed import Client, LocalCluster
from surfrecon import distributed
from watched import Watched, most_taken_mb

# How much of the merge is done when a worker is killed.
MIDWAY = 0.5


def figures():
    """Of a worker: its process, CPU seconds so far, and the most megabytes that it had."""
    return os.getpid(), sum(os.times()[:2]), most_taken_mb()


def main(asked):
    """Merges; prints the figures."""
    given = {"n_workers": asked["workers"], "threads_per_worker": 1, "memory_limit": 0, "dashboard_address": None}
    killed = []
    with (
        tempfile.TemporaryDirectory() as workspace,
        dask.config.set({"distributed.scheduler.allowed-failures": 20}),
        LocalCluster(**given) as cluster,
        Client(cluster) as client,
        Watched(workspace) as watched,
    ):
        client.wait_for_workers(asked["workers"])
        before = {pid: (cpu, peak) for pid, cpu, peak in client.run(figures).values()}
        baseline = max(peak for _, peak in before.values())

        def told(stage, fraction):
            watched.told(stage, fraction)
            if asked["kill"] and not killed and fraction >= MIDWAY:
                pid = min(before)
                killed.append((pid, sum(psutil.Process(pid).cpu_times()[:2]), most_taken_mb(pid)))
                os.kill(pid, signal.SIGKILL)

        began = time.monotonic()
        distributed.merge(
            asked["names"],
            asked["out"],
            client=client,
            workspace=workspace,
            tasks=asked["tasks"],
            voxel=asked["voxel"],
            max_memory=asked["megabytes"] * 10**6,
            reading={"camera": asked["camera"]},
            progress=told,
        )
        wall = time.monotonic() - began
        client.wait_for_workers(asked["workers"])
        after = [*client.run(figures).values(), *killed]
    cpu = sum(cpu - before.get(pid, (0, 0))[0] for pid, cpu, _ in after)
    peak = max(peak - before.get(pid, (0, baseline))[1] for pid, _, peak in after)
    found = {"cpu_s": cpu, "wall_s": wall, "peak_mb": peak, "disk_mb": watched.most_mb, "blocks": watched.blocks}
    print(json.dumps(found | {"killed": len(killed)}))


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text()))
