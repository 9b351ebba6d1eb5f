"""What only a program can do to a filter: answer its progress with no."""

import subprocess
from pathlib import Path

import pymeshlab
import pytest
from conftest import ROOT, plugins
from files import write_set
from shapes import torus_scans


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """A program linked to the library of MeshLab that pymeshlab brings."""
    version = plugins().name.split("-")[0]
    script = ROOT / "tools" / "meshlab_source.sh"
    # 2023.12 and 2025.07 have the same interface, see tools/build_meshlab_plugin.sh.
    source = subprocess.check_output([script, version.replace("2023.12", "2025.07")], text=True).strip()
    library = Path(pymeshlab.__file__).parent / "lib"
    modules = ["Qt5Core", "Qt5Gui", "Qt5Widgets", "Qt5OpenGL", "Qt5Xml"]
    qt = subprocess.check_output(["pkg-config", "--cflags", *modules], text=True).split()
    headers = [f"{source}/src", f"{source}/src/vcglib", "/usr/include/eigen3"]
    made = tmp_path_factory.mktemp("host") / "host"
    command = ["c++", "-std=c++17", "-O1", "-fPIC", f"-DMESHLAB_VERSION={version}d", "-DMESHLAB_SCALAR=double"]
    command += [f"-isystem{folder}" for folder in headers] + qt
    command += [ROOT / "tests" / "meshlab" / "host.cpp", "-o", made, f"-L{library}", "-lmeshlab-common"]
    command += [library / "libQt5Core.so.5", f"-Wl,--disable-new-dtags,-rpath,{library}", "-Wl,--allow-shlib-undefined"]
    subprocess.run(list(map(str, command)), check=True)
    return made


def test_filters_stop_when_they_are_told_to(host, tmp_path):
    path = write_set(tmp_path, torus_scans(pixels=120))
    plugin = plugins() / "libfilter_surfrecon.so"
    said = subprocess.run([host, plugin, path], capture_output=True, text=True, check=False)
    assert (said.returncode, said.stdout) == (0, "ok\n"), said.stdout + said.stderr
