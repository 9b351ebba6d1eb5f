"""One tool of the clustering benchmark in a process of its own: peer_cluster.py TOOL MESH.npz K OUT.npz.

MESH holds `positions` and `triangles`. OUT receives the same, or only `labels` where the tool does nothing but k-means;
printed is a line of JSON with the wall and CPU seconds of the work alone.
"""

import json
import math
import sys
import time

import numpy as np

# Lloyd steps that each k-means may take; ours stops by itself before.
STEPS = 40


def timed(work):
    """The result of `work`, its wall and its CPU seconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    made = work()
    return made, {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}


def surfrecon_mesh(positions, triangles, k, **options):
    """Ours."""
    import surfrecon

    mesh = surfrecon.Mesh(positions, triangles)
    made, figures = timed(lambda: surfrecon.cluster(mesh, vertices=k, **options))
    for when in ("before", "after"):
        figures[f"angles_{when}"] = list(made.report[when]["angles"])
    return {"positions": made.mesh.positions, "triangles": made.mesh.triangles}, figures


def acvd(positions, triangles, k, subdivisions):
    """Approximated centroidal Voronoi diagrams."""
    import pyacvd
    import pyvista

    mesh = pyvista.PolyData(positions, np.insert(triangles, 0, 3, axis=1).ravel())

    def work():
        clustering = pyacvd.Clustering(mesh)
        if subdivisions:
            clustering.subdivide(subdivisions)
        clustering.cluster(k)
        return clustering.create_mesh()

    made, figures = timed(work)
    return {"positions": np.asarray(made.points, float), "triangles": made.faces.reshape(-1, 4)[:, 1:]}, figures


def isotropic(positions, triangles, k):
    """MeshLab's isotropic remeshing; its edge length is sought, the time is that of the last try alone."""
    import pymeshlab

    corners = positions[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    length = math.sqrt(area / (2 * k) * 4 / math.sqrt(3))
    for _ in range(5):
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(positions, triangles))
        target = pymeshlab.PureValue(length)
        work = lambda meshes=meshes, target=target: meshes.meshing_isotropic_explicit_remeshing(  # noqa: E731
            iterations=10, targetlen=target, featuredeg=60
        )
        _, figures = timed(work)
        found = meshes.current_mesh().vertex_number()
        if abs(found - k) <= 0.01 * k:
            break
        length *= math.sqrt(found / k)
    made = meshes.current_mesh()
    return {"positions": made.vertex_matrix(), "triangles": made.face_matrix()}, figures


def quadric(positions, triangles, k):
    """MeshLab's quadric collapse with its default options."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(positions, triangles))
    _, figures = timed(lambda: meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=2 * k))
    made = meshes.current_mesh()
    return {"positions": made.vertex_matrix(), "triangles": made.face_matrix()}, figures


def surfrecon_patches(positions, triangles, k):
    """Our k-means, with what makes its patches a mesh: everything but the relaxation."""
    import surfrecon

    mesh = surfrecon.Mesh(positions, triangles)
    options = {"patches": k // 3, "adaptivity": 0.0, "iterations": STEPS, "relaxation": 0}
    made, figures = timed(lambda: surfrecon.cluster(mesh, **options))
    return {"labels": made.labels}, figures


def sklearn_patches(positions, triangles, k):
    """scikit-learn's k-means from its own start."""
    import sklearn.cluster

    kmeans = sklearn.cluster.KMeans(k // 3, n_init=1, max_iter=STEPS, random_state=0)
    made, figures = timed(lambda: kmeans.fit(positions, sample_weight=areas(positions, triangles)))
    return {"labels": made.labels_}, figures


def faiss_patches(positions, triangles, k):
    """faiss' k-means, in single precision."""
    import faiss

    points = positions.astype(np.float32)
    kmeans = faiss.Kmeans(3, k // 3, niter=STEPS, seed=1, min_points_per_centroid=1, max_points_per_centroid=1 << 30)

    def work():
        kmeans.train(points, weights=areas(positions, triangles).astype(np.float32))
        return kmeans.index.search(points, 1)[1].ravel()

    labels, figures = timed(work)
    return {"labels": labels}, figures


def areas(positions, triangles):
    """A third of the area of each vertex's triangles: what k-means weighs a vertex by."""
    corners = positions[triangles]
    size = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 6
    return np.bincount(triangles.ravel(), np.repeat(size, 3), len(positions))


TOOLS = {
    "surfrecon": surfrecon_mesh,
    "surfrecon-fitted": lambda p, t, k: surfrecon_mesh(p, t, k, fitting=1),
    "surfrecon-least-angle": lambda p, t, k: surfrecon_mesh(p, t, k, min_angle=math.radians(30)),
    "surfrecon-even": lambda p, t, k: surfrecon_mesh(p, t, k, adaptivity=0.0),
    "acvd": lambda p, t, k: acvd(p, t, k, 0),
    "acvd-1": lambda p, t, k: acvd(p, t, k, 1),
    "acvd-2": lambda p, t, k: acvd(p, t, k, 2),
    "meshlab-isotropic": isotropic,
    "meshlab-quadric": quadric,
    "surfrecon-patches": surfrecon_patches,
    "sklearn-kmeans": sklearn_patches,
    "faiss-kmeans": faiss_patches,
}

if __name__ == "__main__":
    tool, mesh, k, out = sys.argv[1:]
    with np.load(mesh) as data:
        made, figures = TOOLS[tool](data["positions"], data["triangles"].astype(np.int32), int(k))
    np.savez(out, **made)
    print(json.dumps(figures))
