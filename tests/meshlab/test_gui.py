"""MeshLab's window: the filter is found by its name, its dialog opens, Apply applies it. The pictures are kept."""

import shutil
import subprocess

import pytest
from conftest import ROOT
from desktop import environment, installed
from shapes import torus

PICTURES = ROOT / "out" / "meshlab-plugin" / "pictures"


def test_the_merge_filter_by_hand(tmp_path):
    program = installed(tmp_path, "meshlab")
    for needed in ("xdotool", "openbox", "import"):
        if shutil.which(needed) is None:
            pytest.skip(f"{needed} is missing: apt-get install xdotool openbox imagemagick")
    torus(24).write(str(tmp_path / "torus.ply"))
    filter_name = "Surface Reconstruction: Marching Intersections"
    script = ROOT / "tests" / "meshlab" / "gui.sh"
    command = [
        "xvfb-run",
        "-a",
        "-s",
        "-screen 0 1280x900x24",
        script,
        program,
        tmp_path / "torus.ply",
        filter_name,
        PICTURES,
    ]
    captured = {"capture_output": True, "text": True, "errors": "replace", "timeout": 400, "check": False}
    done = subprocess.run(list(map(str, command)), env=environment(tmp_path), cwd=tmp_path, **captured)
    assert done.returncode == 0, f"{done.stdout}{done.stderr}; see {PICTURES}"
    assert (PICTURES / "dialog.png").is_file() and (PICTURES / "applied.png").is_file()
