"""The type stubs, held against the module by mypy's own checker; and the package's Python, strictly typed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import surfrecon

pytest.importorskip("mypy")

# matplotlib, shtab and tqdm are optional, and not all of them is typed.
SETTINGS = """
[mypy]
strict = True
[mypy-distributed.*,fsspec.*,matplotlib.*,shtab.*,tqdm.*]
ignore_missing_imports = True
follow_imports = skip
disallow_any_unimported = False
"""

# Code that a type checker must take, and code that it must refuse.
RIGHT = """
import numpy as np
import surfrecon

scans = surfrecon.open("bun.conf")
first: surfrecon.Scan = scans[0]
few: surfrecon.ScanSet = scans[1:]
colours = [scan.colour for scan in scans if isinstance(scan, surfrecon.Frame)]
merged = surfrecon.merge([scan for scan in scans], voxel=0.001, progress=lambda stage, share: share < 0.5)
merged.mesh.write("bunny.glb", up="z")
image = surfrecon.RangeImage.from_points(np.zeros((2, 2, 3)), viewing=("parallel", (0, 0, -1)))
camera: surfrecon.GridCamera = image.grid_camera().scaled(1000)
kept = surfrecon.GridCamera(camera.rows, camera.cols, camera.projection, camera.anchors)
points = image.to_mesh(faces=False).positions
back = surfrecon.RangeImage.from_vertices(kept, [0], [0], points, world_from_host=np.eye(4))
sculpted: surfrecon.Sculpted = surfrecon.Sculptor(image).refine(tolerance=0.1)
job = surfrecon.Job.sculptor(image, effort=1)
one: surfrecon.RangeImage = surfrecon.virtual_scan(merged.mesh, surfrecon.turntable(merged.mesh)[0])
many: list[surfrecon.RangeImage] = surfrecon.virtual_scan(merged.mesh, surfrecon.turntable(merged.mesh))
held: int = surfrecon.memory_in_use()
pick = surfrecon.Pick(0, 1, (0, 0, 0), np.zeros(3), normals=((0, 0, 1), (0, 0, 1)))
aligner = surfrecon.Aligner(scans, threads=1)
aligned = aligner.align(picks=[pick, (0, 1, (0, 0, 0), (0, 0, 0))], axis=((0, 0, 0), (0, 0, 1)), angles=np.zeros(9))
snap: surfrecon.Snap = aligner.snap(1, np.eye(4), poses=aligned.world_from_scan)
shown = aligned.misfit(1) if aligned.report.turntable is None else np.array(aligned.report.turntable.axis)
"""
WRONG = (
    'surfrecon.merge([], voxel="small")',
    'surfrecon.open("a")[0].write("b")',
    "surfrecon.linear_colours()",
    "surfrecon.Aligner([]).snap(0)",
    'surfrecon.sculpture().write("a.glb", up="x")',
    "class Own(surfrecon.Mesh): ...",
)


@pytest.fixture(scope="module")
def mypy(tmp_path_factory):
    """Runs mypy, or its checker of stubs; returns what it says."""
    folder = tmp_path_factory.mktemp("mypy")
    (folder / "mypy.ini").write_text(SETTINGS)

    def run(module, option, *arguments):
        command = [sys.executable, "-m", module, option, str(folder / "mypy.ini"), *arguments]
        found = {"PYTHONPATH": str(Path(surfrecon.__file__).parents[1].resolve())}
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder, env=os.environ | found)
        return done.returncode, done.stdout + done.stderr

    return run


def test_the_stubs_are_those_of_the_module(mypy):
    code, said = mypy("mypy.stubtest", "--mypy-config-file", "surfrecon")
    assert code == 0, said


def test_the_package_is_strictly_typed(mypy):
    code, said = mypy("mypy", "--config-file", "-p", "surfrecon")
    assert code == 0, said
    assert (Path(surfrecon.__file__).parent / "py.typed").exists()


def test_checkers_take_right_programs_and_refuse_wrong_ones(mypy, tmp_path):
    program = tmp_path / "program.py"
    program.write_text(RIGHT)
    code, said = mypy("mypy", "--config-file", str(program))
    assert code == 0, said
    program.write_text("import surfrecon\n" + "\n".join(WRONG) + "\n")
    code, said = mypy("mypy", "--config-file", str(program))
    assert code == 1 and all(f"program.py:{k + 2}: error" in said for k in range(len(WRONG))), said
