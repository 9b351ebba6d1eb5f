"""PrusaSlicer as a judge of closed surfaces: whether it makes G-code of one and has nothing to repair.

What it reads is written by this library, as users print it: STL and 3MF in millimetres.
"""

import re
import shutil
import tempfile
from pathlib import Path

import measured
import numpy as np
import surfrecon

PROGRAM = "prusa-slicer"
# The longest side of what is sliced, mm: what is repaired does not depend on it, and smaller things take less time.
PRINTED = 20.0
# Tips and parts that hang in the air stand on supports. Without them the pose decides whether there is G-code.
STANDING = ("--support-material", "--raft-layers", "1")
# How far the volume that it says may be off, as a share.
VOLUME = 0.005
# Figures of any mesh. Each kind of repair has a line of its own besides.
FIGURES = {f"{end}_{axis}" for end in ("size", "min", "max") for axis in "xyz"}
FIGURES |= {"number_of_facets", "manifold", "number_of_parts", "volume"}
# Lines about the work itself. One that its log calls an error is of its walls of different widths, not of the mesh.
WORKING = re.compile(
    r"\[.*\] \[trace\] .*|\[.*\] \[error\] +Reversing even wall line .*|"
    r"\[[^\]]*\]|\d+ => .*|Slicing result exported to .*|"
)
# A comment before the walls of an object, not of supports.
WALL = ";TYPE:External perimeter"
LIMIT_S = 600


def is_there():
    """Whether it is installed."""
    return shutil.which(PROGRAM) is not None


def faults(vertices, faces):
    """The reasons, in words, why a surface does not slice as it is: none if it does.

    The G-code is made of STL, in which faces find their neighbours by their corners. Of 3MF repairs and volume are
    asked.
    """
    place = vertices - vertices.min(0)
    place = place * (PRINTED / float(place.max()))
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for ending in ("stl", "3mf"):
            file = Path(folder) / f"surface.{ending}"
            surfrecon.Mesh(place, faces.astype(np.uint32)).write(file, metres_per_unit=0.001)
            said = faults_of_file(file, volume_of(place, faces), is_sliced=ending == "stl")
            found += [f"{ending}: {fault}" for fault in said]
    return found


def faults_of_file(file, volume, is_sliced=True):
    """The same of a file, whose surface bounds this volume in cubic millimetres."""
    code = file.with_suffix(".gcode")
    # Neither a display, nor a home, nor the language of the system: numbers have points.
    command = ["env", "-u", "DISPLAY", "LC_ALL=C", PROGRAM, "--datadir", file.parent / "settings", "--info"]
    command += ["--export-gcode", *STANDING, "--output", code] if is_sliced else []
    try:
        _, told = measured.run([*command, file], timeout=LIMIT_S)
    except measured.Failed as problem:
        return [str(problem)]
    found = faults_told(told, volume)
    if is_sliced and not (code.is_file() and WALL in code.read_text(errors="replace")):
        found.append("there is no G-code of walls")
    code.unlink(missing_ok=True)
    return found


def faults_told(told, volume):
    """The faults in what it prints: all but the figures of a mesh without any."""
    lines = [line.strip() for line in told.splitlines()]
    figures = dict(map(str.strip, line.split("=", 1)) for line in lines if re.match(r"\w+ = ", line))
    others = [line for line in lines if not re.match(r"\w+ = ", line) and not WORKING.fullmatch(line)]
    found = others + [f"{key} = {value}" for key, value in figures.items() if key not in FIGURES]
    if figures.get("manifold") != "yes":
        found.append(f"manifold = {figures.get('manifold')}")
    said = float(figures.get("volume", "nan"))
    if not abs(said - volume) <= VOLUME * abs(volume):
        found.append(f"its volume is {said}, ours {volume}")
    return found


def volume_of(vertices, faces):
    """The volume that a closed surface bounds, negative inside out."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)
