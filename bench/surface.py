"""Independent figures of a triangle mesh: topology with numpy and scipy, distances with Open3D's ray casting scene."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def group(pairs_a, pairs_b, count):
    """Labels of the connected components of a graph of `count` nodes."""
    ones = np.ones(len(pairs_a), np.int8)
    return connected_components(coo_matrix((ones, (pairs_a, pairs_b)), (count, count)), directed=False)


def topology(vertices, faces):
    """Counts of components, boundaries and non-manifold places.

    Vertices count as one where their float32 coordinates are equal bit for bit, whoever wrote the file: some tools
    write a soup of triangles. Faces that repeat a vertex are left out and counted.
    """
    figures = {"triangles": len(faces)}
    if len(faces) == 0:
        return figures
    bits = np.ascontiguousarray(vertices.astype(np.float32) + 0.0)
    _, merged = np.unique(bits.view([("", np.float32)] * 3).ravel(), return_inverse=True)
    faces = merged.reshape(-1)[faces]
    collapsed = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 0] == faces[:, 2])
    figures["collapsed_triangles"] = int(collapsed.sum())
    used, faces = np.unique(faces[~collapsed], return_inverse=True)
    faces = faces.reshape(-1, 3)
    vertex_count, face_count = len(used), len(faces)

    # Each triangle has three half-edges, in the order of `corner`.
    half_edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = half_edges.min(1), half_edges.max(1)
    edges, edge_of, uses = np.unique(low * vertex_count + high, return_inverse=True, return_counts=True)
    edge_low, edge_high = edges // vertex_count, edges % vertex_count
    turns = np.zeros(len(edges), np.int64)
    np.add.at(turns, edge_of, np.where(half_edges[:, 0] < half_edges[:, 1], 1, -1))
    boundary = uses == 1
    figures["boundary_edges"] = int(boundary.sum())
    figures["nonmanifold_edges"] = int((uses > 2).sum())
    figures["misoriented_edges"] = int(((uses == 2) & (turns != 0)).sum())

    figures["components"], _ = group(edge_low, edge_high, vertex_count)
    figures["boundary_loops"] = 0
    if boundary.any():
        ends, renumbered = np.unique(np.concatenate([edge_low[boundary], edge_high[boundary]]), return_inverse=True)
        half = len(renumbered) // 2
        figures["boundary_loops"], _ = group(renumbered[:half], renumbered[half:], len(ends))

    euler = vertex_count - len(edges) + face_count
    figures["genus"] = (2 * int(figures["components"]) - int(figures["boundary_loops"]) - euler) / 2

    # A vertex is manifold where the corners around it hang together through shared edges: one fan.
    corner = np.arange(3 * face_count).reshape(face_count, 3)
    corner_from = np.concatenate([corner[:, 0], corner[:, 1], corner[:, 2]])
    corner_to = np.concatenate([corner[:, 1], corner[:, 2], corner[:, 0]])
    swapped = half_edges[:, 0] > half_edges[:, 1]
    corner_low = np.where(swapped, corner_to, corner_from)
    corner_high = np.where(swapped, corner_from, corner_to)
    order = np.argsort(edge_of, kind="stable")
    same = edge_of[order][1:] == edge_of[order][:-1]
    one, other = order[:-1][same], order[1:][same]
    _, fan = group(
        np.concatenate([corner_low[one], corner_high[one]]),
        np.concatenate([corner_low[other], corner_high[other]]),
        3 * face_count,
    )
    fans = np.unique(np.stack([faces.ravel(), fan], 1), axis=0)
    figures["nonmanifold_vertices"] = int((np.bincount(fans[:, 0], minlength=vertex_count) > 1).sum())
    return figures


def distances(points, vertices, faces):
    """Distance of each point to the surface; the scene computes in float32, so all is centred and scaled first."""
    import open3d

    centre = (vertices.max(0) + vertices.min(0)) / 2
    size = float((vertices.max(0) - vertices.min(0)).max())

    def tensor(array, dtype):
        return open3d.core.Tensor(np.ascontiguousarray(array.astype(dtype)))

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(tensor((vertices - centre) / size, np.float32), tensor(faces, np.uint32))
    found = scene.compute_distance(tensor((points - centre) / size, np.float32))
    return found.numpy().astype(np.float64) * size


def sample(vertices, faces, count, seed=0):
    """Points spread evenly over the surface."""
    generator = np.random.default_rng(seed)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    areas = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1))
    triangle = np.minimum(np.searchsorted(areas, generator.random(count) * areas[-1]), len(faces) - 1)
    u, v = generator.random(count), generator.random(count)
    outside = u + v > 1
    u[outside], v[outside] = 1 - u[outside], 1 - v[outside]
    a, b, c = a[triangle], b[triangle], c[triangle]
    return a + u[:, None] * (b - a) + v[:, None] * (c - a)
