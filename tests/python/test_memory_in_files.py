"""The memory that merges in files take, whatever the number of scans: each in a process of its own."""

import json
import subprocess
import sys

import pytest
import shapes
import surfrecon

VOXEL = 0.012
# The least that a thread does with, and enough for blocks of more bricks.
ALLOWED = [12_000_000, 24_000_000]
# Beside what is allowed, in shares of it.
MORE = 1.1

MERGE = """
import json, os, sys, surfrecon
from surfrecon import distributed

folder, fine, memory, by = sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
scans, path = os.path.join(folder, "scans.conf"), os.path.join(folder, "surface.ply")


def resident():
    # The most so far; elsewhere what the library counts is all there is.
    if sys.platform != "linux":
        return 0
    return next(int(line.split()[1]) * 1024 for line in open("/proc/self/status") if line.startswith("VmHWM"))


def measured(call, *arguments, **options):
    surfrecon.memory_peak(restart=True)
    before = surfrecon.memory_in_use()
    call(*arguments, **options)
    return surfrecon.memory_peak() - before, resident()


def merged(voxel):
    given = {"voxel": voxel, "threads": 1}
    if by == "memory":
        return {by: measured(surfrecon.merge, surfrecon.open(scans), **given)}
    given |= {"max_memory": memory, "workspace": folder}
    if by == "file":
        return {by: measured(surfrecon.merge_to_file, surfrecon.open(scans), path, **given)}
    plan = distributed.Plan.make(None, scans, path, tasks=3, **given)
    found = {f"{stage.name} {n}": measured(plan.run, n) for stage in plan.stages for n in stage.tasks}
    plan.remove()
    return found


# The code itself is in memory once something was merged, however coarsely.
merged(0.2)
without = resident()
print(json.dumps({name: [peak, now - without] for name, (peak, now) in merged(fine).items()}))
"""


def peaks(folder, memory, by):
    """Of each call the most bytes that the library had, and by how much the process has grown."""
    command = [sys.executable, "-c", MERGE, folder, str(VOXEL), str(memory), by]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """Folders of frames around a torus, by how many there are."""
    mesh, folders = shapes.torus(), {}
    for count in (4, 16, 64):
        folders[count] = tmp_path_factory.mktemp("frames")
        images = surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=count, above=0, below=0, pixels=120))
        for k, image in enumerate(images):
            image.name = f"frame {k:02}"
        surfrecon.write_scans(folders[count] / "scans.conf", images)
    return folders


@pytest.mark.parametrize("by", ["file", "tasks"])
@pytest.mark.parametrize("memory", ALLOWED)
def test_no_merge_takes_more_than_it_may(frames, memory, by):
    for count, folder in frames.items():
        for what, found in peaks(folder, memory, by).items():
            assert max(found) <= memory * MORE, (count, what, found)


def test_in_memory_so_many_frames_take_more(frames):
    assert min(bytes for bytes in peaks(frames[64], 0, "memory")["memory"] if bytes) > max(ALLOWED) * MORE
