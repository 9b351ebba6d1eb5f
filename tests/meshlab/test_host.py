"""Programs around MeshLab's library do what no script can: say no to a filter's progress, look at what layers hold."""

import os
import subprocess
from pathlib import Path

import pymeshlab
import pytest
from conftest import ROOT, plugins
from files import write_set
from shapes import torus_scans

SOURCES = ROOT / "meshlab-plugin" / "src"


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Compiles sources to a program linked to the library of MeshLab that pymeshlab brings."""
    version = plugins().name.split("-")[0]
    script = ROOT / "tools" / "meshlab_source.sh"
    # 2023.12 and 2025.07 have the same interface, see tools/build_meshlab_plugin.sh.
    source = subprocess.check_output([script, version.replace("2023.12", "2025.07")], text=True).strip()
    library = Path(pymeshlab.__file__).parent / "lib"
    modules = ["Qt5Core", "Qt5Gui", "Qt5Widgets", "Qt5OpenGL", "Qt5Xml"]
    qt = subprocess.check_output(["pkg-config", "--cflags", *modules], text=True).split()
    headers = [f"{source}/src", f"{source}/src/vcglib", "/usr/include/eigen3"]
    defined = [f"-DMESHLAB_VERSION={version}d", "-DMESHLAB_SCALAR=double", f"-DSRF_MESHLAB={version.replace('.', '')}"]
    folder = tmp_path_factory.mktemp("host")

    def build(name, *more):
        command = ["c++", "-std=c++17", "-O1", "-fPIC", *defined, *(f"-isystem{folder}" for folder in headers), *qt]
        command += [ROOT / "tests" / "meshlab" / f"{name}.cpp", *more, "-o", folder / name]
        command += [f"-L{library}", "-lmeshlab-common", library / "libQt5Core.so.5"]
        command += [f"-Wl,--disable-new-dtags,-rpath,{library}", "-Wl,--allow-shlib-undefined"]
        subprocess.run(list(map(str, command)), check=True)
        return folder / name

    return build


def says_ok(*command):
    said = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    assert (said.returncode, said.stdout) == (0, "ok\n"), said.stdout + said.stderr


def test_filters_stop_when_they_are_told_to(program, tmp_path):
    says_ok(program("host"), plugins() / "libfilter_surfrecon.so", write_set(tmp_path, torus_scans(pixels=120)))


def test_range_layers_keep_how_their_pixels_see(program):
    """Each kind of projection: moved, turned, scaled, mirrored, stretched, less some vertices."""
    library = Path(os.environ["SURFRECON_LIBRARY"])
    ours = [SOURCES / "range_layer.cpp", SOURCES / "layer.cpp", f"-I{SOURCES}", f"-I{ROOT / 'c-api' / 'include'}"]
    says_ok(program("range_layer", *ours, library, f"-Wl,-rpath,{library.parent}"))
