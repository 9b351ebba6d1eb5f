"""Programs of others read what we write: Open3D, trimesh, MeshLab and lib3mf, in the environment of the benchmarks."""

import json

import numpy as np
import pytest
import surfrecon
from peers import lines_of, needs_peers
from shapes import torus

# Prints, for each file, the numbers of vertices and faces, bounds and the mean colour of vertices, if any.
PROGRAM = """
import json, sys
import numpy as np
tool, paths = sys.argv[1], sys.argv[2:]

def read(path):
    if tool == "open3d":
        import open3d
        mesh = open3d.io.read_triangle_mesh(path)
        return np.asarray(mesh.vertices), np.asarray(mesh.triangles), np.asarray(mesh.vertex_colors)
    if tool == "lib3mf":
        import lib3mf
        model = lib3mf.get_wrapper().CreateModel()
        reader = model.QueryReader("3mf")
        reader.SetStrictModeActive(True)
        reader.ReadFromFile(path)
        assert reader.GetWarningCount() == 0
        objects = model.GetMeshObjects()
        objects.MoveNext()
        mesh = objects.GetCurrentMeshObject()
        assert mesh.IsManifoldAndOriented() and mesh.IsValid()
        assert model.GetUnit() == lib3mf.ModelUnit.Meter
        groups = model.GetColorGroups()
        groups.MoveNext()
        group = groups.GetCurrentColorGroup()
        colours = [group.GetColor(number) for number in group.GetAllPropertyIDs()]
        colours = np.array([[colour.Red, colour.Green, colour.Blue] for colour in colours]) / 255
        vertices = [tuple(vertex.Coordinates) for vertex in mesh.GetVertices()]
        return vertices, [tuple(triangle.Indices) for triangle in mesh.GetTriangleIndices()], colours
    if tool == "trimesh":
        import trimesh
        mesh = trimesh.load(path, process=False, force="mesh")
        colours = np.asarray(getattr(mesh.visual, "vertex_colors", []), float)
        return mesh.vertices, mesh.faces, colours[:, :3] / 255 if colours.ndim == 2 else []
    import pymeshlab
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(path)
    mesh = meshes.current_mesh()
    colours = mesh.vertex_color_matrix()[:, :3] if mesh.has_vertex_color() else []
    return mesh.vertex_matrix(), mesh.face_matrix(), np.asarray(colours)

for path in paths:
    vertices, faces, colours = read(path)
    corners = np.asarray(vertices)[np.asarray(faces)]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    bounds = [np.min(vertices, 0).tolist(), np.max(vertices, 0).tolist()]
    mean = np.mean(colours, 0).tolist() if len(colours) else None
    print(json.dumps({"faces": len(faces), "area": area, "bounds": bounds, "colour": mean}))
"""

# Colours are compared where readers hand on sRGB: not those of glTF, which are linear.
FORMATS = {
    "open3d": ["ply", "text.ply", "obj", "stl", "glb"],
    "trimesh": ["ply", "text.ply", "obj", "stl", "glb"],
    "lib3mf": ["3mf"],
    "pymeshlab": ["ply", "text.ply", "obj", "stl"],
}

OPTIONS = {"text.ply": {"encoding": "ascii"}}


@needs_peers
@pytest.mark.parametrize("tool", FORMATS)
def test_others_read_our_meshes(tmp_path, tool):
    shape = torus()
    colour = np.zeros((len(shape.positions), 4), np.uint8)
    colour[:] = (200, 100, 50, 255)
    mesh = surfrecon.Mesh(shape.positions, shape.triangles, colour=colour)
    paths = []
    for ending in FORMATS[tool]:
        paths.append(str(tmp_path / f"torus.{ending}"))
        mesh.write(paths[-1], **OPTIONS.get(ending, {}))
    told = lines_of(PROGRAM, tool, *paths, folder=tmp_path)
    answers = [json.loads(line) for line in told if line.startswith("{")]
    corners = mesh.positions[mesh.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    for path, answer in zip(paths, answers, strict=True):
        assert answer["faces"] == len(mesh.triangles), path
        assert np.isclose(answer["area"], area, rtol=1e-5), path
        assert np.allclose(answer["bounds"], [mesh.positions.min(axis=0), mesh.positions.max(axis=0)], atol=1e-6), path
        if path.endswith(("ply", "obj", "3mf")):
            assert np.allclose(answer["colour"], np.array([200, 100, 50]) / 255, atol=0.005), path


@needs_peers
def test_others_read_our_scans(tmp_path):
    points = np.dstack([*np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 4)), np.full((4, 5), 3.0)])
    points[1, 2] = np.nan
    image = surfrecon.RangeImage.from_points(points, viewing=("from", (0, 0, 0)), name="scan")
    image.intensity = np.full((4, 5), 0.25)
    pose = np.eye(4)
    pose[:3, 3] = [4e6, 5e6, 7]
    image.world_from_sensor = pose
    surfrecon.write(tmp_path / "scan.e57", [image])
    program = """
import json, sys, numpy as np, pye57
scan = pye57.E57(sys.argv[1]).read_scan(0, intensity=True, row_column=True, ignore_missing_fields=True)
names = ("cartesianX", "cartesianY", "cartesianZ", "rowIndex", "columnIndex", "intensity")
print(json.dumps([np.asarray(scan[name], float).tolist() for name in names]))
"""
    told = lines_of(program, tmp_path / "scan.e57", folder=tmp_path)
    x, y, z, row, column, intensity = map(np.array, json.loads(told[-1]))
    assert len(x) == 19 and (intensity == 0.25).all()
    expected = image.world_points()[row.astype(int), column.astype(int)]
    assert np.allclose(np.column_stack([x, y, z]), expected, atol=1e-6, rtol=0)
