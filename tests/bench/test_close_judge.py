"""The judge of closed surfaces: what crosses, what lies in seen space, what moved, and the shapes themselves."""

import json
from pathlib import Path

import pytest
from peers import lines_of, needs_peers

BENCH = Path(__file__).resolve().parents[2] / "bench"

# Every script below begins with this, and prints JSON.
HEAD = """
import json, sys
import numpy as np
sys.path.insert(0, sys.argv[1])
import close_figures, close_shapes, noise_scans
from surface import topology
"""

CROSSINGS = """
flat = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
def pair(other):
    return close_figures.crossings(np.concatenate([flat, np.array(other, float)]), np.arange(6).reshape(2, 3))
through = [[1, 1, -1], [1, 1, 1], [9, 9, 1]]
tiny = 2.0**-60
shared = np.concatenate([flat, [[1, 1, 1], [1, 1, -1]]])
sheets = [np.array([[x, y, z] for x in range(13) for y in range(13)], float) for z in (0, 0.25)]
sheets[1][:, 2] += 0.5 * (np.abs(sheets[1][:, 0] - 6) < 0.5) * -1
grid = np.arange(13 * 13).reshape(13, 13)
a, b, c, d = (part.ravel() for part in (grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]))
faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
both = np.concatenate(sheets), np.concatenate([faces, faces + 13 * 13])
import pymeshlab
meshes = pymeshlab.MeshSet()
meshes.add_mesh(pymeshlab.Mesh(*both))
meshes.compute_selection_by_self_intersections_per_face()
print(json.dumps({
    "through": pair(through),
    "ends in it": pair([[1, 1, 0], [1, 1, 1], [9, 9, 1]]),
    "ends above it": pair([[1, 1, tiny], [1, 1, 1], [9, 9, 1]]),
    "ends below it": pair([[1, 1, -tiny], [1, 1, 1], [9, 9, 1]]),
    "beside it": pair([[5, 5, -1], [5, 5, 1], [9, 9, 1]]),
    "a common corner": close_figures.crossings(shared, np.array([[0, 1, 2], [0, 3, 4]])),
    "a common edge": close_figures.crossings(shared, np.array([[0, 1, 2], [0, 1, 3]])),
    "a furrow": close_figures.crossings(*both),
    "faces by MeshLab": meshes.current_mesh().selected_face_number(),
}))
"""

SEEN = """
camera = noise_scans.Camera(9, 9, 9.0)
depth = np.zeros((1, 9, 9), np.float32)
depth[0, :, :6] = 10
shots = noise_scans.Shots(camera, np.eye(4)[None], depth, 1.0)
points = np.array([[0, 0, 5], [0, 0, 9.5], [0, 0, 12], [2, 0, 5], [0.6, 0, 5], [0, 0, -5]], float)
print(json.dumps(close_figures.in_seen_space(shots, points, 1.0).tolist()))
"""

SHAPES = """
found = {}
for name in ("head", "figure", "vase", "goblet", "ball"):
    vertices, faces = close_shapes.SHAPES[name].mesh(6.0)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    figures = topology(vertices, faces)
    worst = sum(figures[f"{k}_edges"] for k in ("boundary", "nonmanifold", "misoriented"))
    found[name] = [int(worst), int(figures["components"]), float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)]
vertices, faces = close_shapes.SHAPES["ball"].mesh(6.0)
moved = vertices.copy()
moved[:7, 0] += 0.1
found["moved"] = close_figures.moved(vertices, moved), close_figures.moved(vertices, vertices.astype(np.float32))
surface = close_figures.noise_figures.Surface(*close_shapes.SHAPES["goblet"].mesh(2.0))
found["wall"] = close_figures.thinnest_wall(surface, *surface.sample(20_000), 220.0)
print(json.dumps(found))
"""

HALVED = """
import close_statue
corners = np.random.default_rng(1).normal(0, 4, (50, 3, 3))
halved = close_statue.halved(corners, 1.5)
edges = np.linalg.norm(halved - np.roll(halved, -1, axis=1), axis=2)
facing = [np.cross(part[:, 1] - part[:, 0], part[:, 2] - part[:, 0]).sum(0).tolist() for part in (corners, halved)]
short = close_statue.halved(halved, 1.5)
print(json.dumps([float(edges.max()), facing, len(halved), len(short)]))
"""


def run(script):
    """Runs a script with the peers' Python; gives what it printed."""
    return json.loads(lines_of(HEAD + script, BENCH)[-1])


@needs_peers
def test_only_what_goes_through_a_triangle_crosses_it():
    found = run(CROSSINGS)
    faces = found.pop("faces by MeshLab")
    furrow = found.pop("a furrow")
    crossing = {"through", "ends below it", "a common corner"}
    assert found == {name: int(name in crossing) for name in found}
    # Along the furrow each triangle of one sheet crosses some of the other.
    assert furrow >= faces / 2 > 20


@needs_peers
def test_seen_space_is_before_what_all_neighbouring_pixels_saw():
    # Far before the surface, just before it, behind it, where nothing came back, beside that, behind the eye.
    assert run(SEEN) == [True, False, False, False, False, False]


@needs_peers
def test_shapes_are_closed_and_known():
    found = run(SHAPES)
    moved, wall = found.pop("moved"), found.pop("wall")
    for name, (faults, parts, volume) in found.items():
        assert (faults, parts) == (0, 1) and volume > 1e5, name
    assert moved == [7, 0]
    assert 2.0 < wall < 2.6


@needs_peers
def test_halved_triangles_are_small_and_face_as_before():
    longest, (before, after), count, again = run(HALVED)
    assert longest <= 1.5 and after == pytest.approx(before)
    assert again == count > 50
