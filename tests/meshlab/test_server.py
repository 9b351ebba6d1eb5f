"""Scripts of filters in meshlabserver, the oldest MeshLab that is supported."""

import subprocess

import numpy as np
import pytest
import surfrecon
from desktop import environment, installed
from files import write_set
from shapes import torus_distance, torus_scans

SCRIPT = """<!DOCTYPE FilterScript>
<FilterScript>
{filters}</FilterScript>
"""


def script(tmp_path, *filters):
    """A file with filters: names, and parameters as name, type, value."""
    text = ""
    for name, parameters in filters:
        text += f' <filter name="{name}">\n'
        for parameter, kind, value, more in parameters:
            text += f'  <Param name="{parameter}" type="{kind}" value="{value}" {more}/>\n'
        text += " </filter>\n"
    path = tmp_path / "script.mlx"
    path.write_text(SCRIPT.format(filters=text))
    return path


def run(tmp_path, arguments):
    """Runs meshlabserver; returns its status and all it said."""
    program = installed(tmp_path, "meshlabserver")
    command = ["xvfb-run", "-a", "-s", "-screen 0 640x480x24", program, *arguments]
    captured = {"capture_output": True, "text": True, "errors": "replace", "timeout": 300, "check": False}
    done = subprocess.run(list(map(str, command)), env=environment(tmp_path), cwd=tmp_path, **captured)
    return done.returncode, done.stdout + done.stderr


def scans_file(tmp_path):
    return write_set(tmp_path, torus_scans(pixels=60))


# meshlabserver wants every parameter of a filter in a script.


def number(name, value, kind="RichFloat"):
    return (name, kind, value, "")


def flag(name, value="false"):
    return (name, "RichBool", value, "")


def length(name, value=0):
    return (name, "RichAbsPerc", value, 'min="0" max="10"')


def choice(name, values):
    options = "".join(f'enum_val{i}="{value}" ' for i, value in enumerate(values))
    return (name, "RichEnum", 0, f'{options}enum_cardinality="{len(values)}"')


def entry(parameter, given):
    """A parameter of the library as MeshLab has it."""
    name, default = parameter.name, parameter.default or 0
    if parameter.name == "invalid":
        return (name, "RichString", given or "", "")
    if parameter.kind == "length" and parameter.operation != "open":
        return length(name, given or default)
    if parameter.kind == "count":
        return number(name, given or default, "RichInt")
    if parameter.kind == "flag":
        return flag(name, str(bool(default)).lower())
    if parameter.kind == "choice":
        return choice(name, [label for _, label, _ in parameter.choices])
    return number(name, given or (np.degrees(default) if parameter.kind == "angle" else default))


def asked(*operations, **given):
    """Every parameter of these operations that MeshLab asks for."""
    known = [p for operation in operations for p in surfrecon.parameters(operation) if p.name != "threads"]
    return [entry(p, given.get(p.name)) for p in known]


def importing(path):
    file = ("file", "RichOpenFile", path, 'exts_val0="*" exts_cardinality="1"')
    camera = ("camera", "RichString", "", "")
    frames = number("max_frames", 50, "RichInt")
    return ("Import Range Images", [file, flag("faces", "true"), camera, frames, *asked("open")])


def merging(voxel):
    parameters = [*asked("merge", "triangulate", voxel=voxel), flag("quality_as_confidence")]
    return ("Surface Reconstruction: Marching Intersections", parameters)


def sculpting(tolerance, triangles=0):
    own = number("max_triangles", triangles, "RichInt")
    parameters = [*asked("sculpt", "triangulate", tolerance=tolerance), own]
    return ("Surface Reconstruction: Range Image Sculpting", parameters)


def measuring(measured, reference):
    layers = [("measured", "RichMesh", measured, ""), ("reference", "RichMesh", reference, "")]
    return ("Exact Distance between Layers", [*layers, flag("signed"), flag("both_ways")])


def reconstructing():
    return ("Surface Reconstruction: Delaunay Carving", [*asked("reconstruct", factor=1.4), flag("use_normals")])


def gridding(rows, columns):
    parameters = asked("quads", rows=rows, columns=columns, tiles_down=1, tiles_across=1, exponent=0.5, floor=0.5)
    own = [number("surface_steps", 0, "RichInt"), number("order", 4, "RichInt")]
    return ("Surface Reconstruction: Adaptive Quad Grid", [*parameters, *own])


def test_import_and_merge(tmp_path):
    out = tmp_path / "merged.ply"
    path = script(tmp_path, importing(scans_file(tmp_path)), merging(0.0625))
    status, said = run(tmp_path, ["-s", path, "-o", out])
    assert status == 0, said
    mesh = surfrecon.read(str(out))
    assert mesh.check()["is_manifold"] and np.abs(torus_distance(mesh.positions)).max() < 0.0625


@pytest.mark.parametrize("away", [0, 0.2])
def test_layers_that_do_not_fit_are_told_of(tmp_path, away):
    row, col = np.mgrid[0:40, 0:50]
    corners = [
        surfrecon.RangeImage.orthographic(0.02 * np.abs(col - 25.0) + 0.01 * row, step=(0.02, 0.02)) for _ in range(2)
    ]
    corners[1].world_from_sensor = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, away], [0, 0, 0, 1]]
    path = script(tmp_path, importing(write_set(tmp_path, corners)), merging(0.02))
    status, said = run(tmp_path, ["-l", tmp_path / "log.txt", "-s", path, "-o", tmp_path / "merged.ply"])
    assert status == 0, said
    log = (tmp_path / "log.txt").read_text()
    assert ("align them first" in log) == (away > 0) and "Voxel: 0.02; " in log and "Merge distance: " in log, log


def test_sculpt_and_measure(tmp_path):
    out = tmp_path / "measured.ply"
    path = script(tmp_path, importing(scans_file(tmp_path)), sculpting(0.0078125), measuring(0, 1))
    status, said = run(tmp_path, ["-s", path, "-o", out, "-m", "vq"])
    assert status == 0, said
    assert len(surfrecon.read(str(out)).positions) > 100


def test_import_and_reconstruct(tmp_path):
    out = tmp_path / "through.ply"
    path = script(tmp_path, importing(scans_file(tmp_path)), reconstructing())
    status, said = run(tmp_path, ["-s", path, "-o", out])
    assert status == 0, said
    mesh = surfrecon.read(str(out))
    assert len(mesh.triangles) > 100 and mesh.check()["is_manifold"]


def test_import_and_grid(tmp_path):
    out = tmp_path / "grid.ply"
    path = script(tmp_path, importing(scans_file(tmp_path)), gridding(9, 9))
    status, said = run(tmp_path, ["-s", path, "-o", out])
    assert status == 0, said
    assert 9 < len(surfrecon.read(str(out)).positions) <= 81


def clustering(vertices):
    parameters = [*asked("cluster", vertices=vertices, fitting=3), number("levels", 1, "RichInt")]
    return ("Remeshing: Multiresolution Clustering", parameters)


def test_import_and_cluster(tmp_path):
    out = tmp_path / "clustered.ply"
    path = script(tmp_path, importing(scans_file(tmp_path)), merging(0.0625), clustering(200))
    status, said = run(tmp_path, ["-s", path, "-o", out])
    assert status == 0, said
    mesh = surfrecon.read(str(out))
    assert len(mesh.positions) == 200 and mesh.check()["is_manifold"]


def test_a_set_opens_like_any_file(tmp_path):
    np.save(tmp_path / "map.npy", np.arange(12.0).reshape(3, 4))
    out = tmp_path / "map.ply"
    status, said = run(tmp_path, ["-i", tmp_path / "map.npy", "-o", out])
    assert status == 0, said
    assert len(surfrecon.read(str(out)).positions) == 12


def test_a_refused_filter_ends_the_script(tmp_path):
    path = script(tmp_path, importing(scans_file(tmp_path)), sculpting(0, triangles=-1))
    status, said = run(tmp_path, ["-s", path, "-o", tmp_path / "none.ply"])
    # It does not print why; xvfb-run may put a status of its own in the place of its 255.
    assert status != 0 and not (tmp_path / "none.ply").exists(), said
