"""Points that carry noise, of shapes whose surface is known, and how far from it a reconstruction lies."""

import math

import noise_shapes
import numpy as np
import surface

COUNT = 30_000
# Of the points, in spacings: the side of a square of the surface that has one of them.
NOISES = [0, 0.3, 0.5, 1, 2]
# Of the points, put besides them into their bounding box.
OUTLIERS_PCT = [0, 5]
# Samples of a reconstruction whose distances to the truth are taken.
SAMPLES = 50_000
# Octrees of Screened Poisson: the best counts.
DEPTHS = [5, 6, 7, 8]


def torus(step):
    """Radii 3 and 1, of quads of about `step`, cut in two."""
    around, across = round(8 * math.pi / step), round(2 * math.pi / step)
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, around + 1), np.linspace(0, 2 * np.pi, across + 1), indexing="ij")
    radius = 3 + np.cos(v)
    vertices = np.stack([radius * np.cos(u), radius * np.sin(u), np.sin(v)], -1)
    return vertices.reshape(-1, 3), noise_shapes.sheet(around + 1, across + 1, False)


def sculpture():
    """The virtual sculpture of this library."""
    import surfrecon

    mesh = surfrecon.sculpture()
    return mesh.positions.astype(float), mesh.triangles.astype(int)


def truths(goblet):
    """Name, genus, and maker of vertices and triangles of each shape; `goblet` is a maker, or `None`."""
    yield "sphere", 0, lambda: noise_shapes.sphere(np.zeros(3), 1.0, 0.01)
    yield "torus", 1, lambda: torus(0.02)
    yield "sculpture", None, sculpture
    if goblet:
        yield "goblet", 0, goblet


def points(vertices, triangles, noise, outliers_pct, count=COUNT):
    """Random points of the surface with noise in all directions, then outliers."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    rng = np.random.default_rng(5)
    made = surface.sample(vertices, triangles, count, 1)
    made = made + rng.normal(size=made.shape) * noise * math.sqrt(area / count)
    low, high = made.min(0), made.max(0)
    return np.concatenate([made, low + rng.random((count * outliers_pct // 100, 3)) * (high - low)])


def to_truth_rms(made, truth):
    """Root mean square of the distances of a reconstruction's surface to the true one."""
    return math.sqrt((surface.distances(surface.sample(*made, SAMPLES), *truth) ** 2).mean())
