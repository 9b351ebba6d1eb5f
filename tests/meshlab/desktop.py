"""MeshLab as Debian packages it, with the plugin inside, without a display of one's own."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

SYSTEM = Path("/usr/lib/x86_64-linux-gnu/meshlab")
VERSION = "2020.09"


def installed(tmp_path, program):
    """A copy of the program that finds our plugins beside its own; skips where there is none of the right version.

    Plugins are looked for relative to the program, so a copy needs no writing into the system.
    """
    binary = Path("/usr/bin") / program
    plugins = os.environ.get("SURFRECON_PLUGINS_DESKTOP")
    if not plugins:
        pytest.skip(f"the plugin for MeshLab {VERSION} was not built")
    package = subprocess.run(
        ["dpkg-query", "-W", "-f", "${Version}", "meshlab"], capture_output=True, text=True, check=False
    )
    if not binary.is_file() or not package.stdout.startswith(VERSION):
        pytest.skip(f"this system has no {program} {VERSION}")
    for needed in ("xvfb-run", "Xvfb"):
        if shutil.which(needed) is None:
            pytest.skip(f"{needed} is missing: apt-get install xvfb xauth")
    prefix = tmp_path / "meshlab"
    (prefix / "bin").mkdir(parents=True)
    shutil.copy(binary, prefix / "bin")
    inside = prefix / SYSTEM.relative_to("/usr")
    shutil.copytree(SYSTEM, inside)
    for plugin in Path(plugins).glob("*.so"):
        shutil.copy(plugin, inside / "plugins")
    return prefix / "bin" / program


def environment(tmp_path):
    """Settings of its own, and software rendering."""
    home = tmp_path / "home"
    home.mkdir(mode=0o700, exist_ok=True)
    return os.environ | {
        "HOME": str(home),
        "XDG_RUNTIME_DIR": str(home),
        "QT_X11_NO_MITSHM": "1",
        "LIBGL_ALWAYS_SOFTWARE": "1",
    }
