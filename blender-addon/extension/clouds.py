# SPDX-License-Identifier: GPL-3.0-or-later
"""Points with normals, which say where outside is: clouds that are aligned without a surface through them."""

import re

import numpy as np
import surfrecon
from mathutils.kdtree import KDTree

from . import convert

# Attribute of points that were read with normals, in the object's frame.
NORMALS = "normals"

# Normals are compared with the planes through the neighbours of some points: Blender turns points and not what is kept
# with them. Of normals of any direction half are within 60 degrees of a plane's, that is 0.5.
MOST_POINTS, LOOKED_AT, NEIGHBOURS, ALIKE = 20_000, 300, 12, 0.7


def store_normals(mesh, normals):
    """Keeps normals (n, 3) with the vertices of a mesh."""
    layer = mesh.attributes.new(NORMALS, "FLOAT_VECTOR", "POINT")
    layer.data.foreach_set("vector", np.ascontiguousarray(normals, np.float32).reshape(-1))


def normals_of(obj, depsgraph):
    """(n, 3) float32: the normals that points were read with, or `None`."""
    if obj.type == "POINTCLOUD":
        return normals_in(obj.evaluated_get(depsgraph).data)
    if obj.type != "MESH":
        return None
    with convert.Placed(obj, depsgraph) as mesh:
        return None if mesh is None else normals_in(mesh)


def normals_in(geometry):
    """`normals_of`, of a mesh or a point cloud."""
    layer = geometry.attributes.get(NORMALS)
    if layer is None or layer.domain != "POINT" or layer.data_type != "FLOAT_VECTOR":
        return None
    flat = np.empty(3 * len(layer.data), np.float32)
    layer.data.foreach_get("vector", flat)
    return flat.reshape(-1, 3)


def are_normals(points, normals):
    """Whether the directions (n, 3) stand on the surface that the points (n, 3) are of."""
    chosen = np.random.default_rng(0).permutation(len(points))[:MOST_POINTS]
    points, normals = points[chosen], normals[chosen]
    if len(points) <= NEIGHBOURS:
        return False
    tree = KDTree(len(points))
    for k, point in enumerate(points):
        tree.insert(point, k)
    tree.balance()
    found = []
    for point, normal in zip(points[:LOOKED_AT], normals[:LOOKED_AT], strict=True):
        near = np.array([other for other, _, _ in tree.find_n(point, NEIGHBOURS)])
        upright = np.linalg.svd(near - near.mean(axis=0))[2][2]
        found.append(abs(upright @ normal) / max(np.linalg.norm(normal), 1e-12))
    return float(np.median(found)) > ALIKE


def scan_of(folder, number, name, points, normals, colour, matrix):
    """The scan of points with normals, placed by a rigid matrix, under that name: a file of a folder in memory, which
    has to be kept as long as the scan is used.
    """
    fields = [(axis, "<f4") for axis in ("x", "y", "z", "nx", "ny", "nz")]
    colours = ("red", "green", "blue", "alpha") if colour is not None else ()
    rows = np.empty(len(points), fields + [(channel, "u1") for channel in colours])
    for k, axis in enumerate("xyz"):
        rows[axis], rows[f"n{axis}"] = points[:, k], normals[:, k]
    for k, channel in enumerate(colours):
        rows[channel] = colour[:, k]
    kinds = [f"property float {field}" for field, _ in fields] + [f"property uchar {channel}" for channel in colours]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}", *kinds, "end_header", ""]
    # A slash would make a folder.
    stem = re.sub(r"[/\\]", "_", name)
    path = f"{number}/{stem}.ply"
    folder[path] = "\n".join(header).encode() + rows.tobytes()
    return surfrecon.open(folder / path)[0].transformed(surfrecon.Similarity(matrix))
