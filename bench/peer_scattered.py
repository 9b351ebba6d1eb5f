"""One peer that is a Python package, in a process of its own: peer_scattered.py TOOL POINTS SPACING OUT.

This library too, told from where the points were seen, which its program for points does not take.

Writes the vertices and triangles to OUT (.npz) and prints the CPU and wall seconds of the reconstruction alone, without
imports and files.
"""

import json
import resource
import sys
import time

import numpy as np


def open3d_cloud(points, with_normals):
    """A cloud; ball pivoting needs normals, whose estimation counts."""
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    if with_normals:
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(12))
        cloud.orient_normals_consistent_tangent_plane(12)
    return cloud


def open3d_ball_pivoting(points, spacing):
    """Radii as its documentation advises."""
    import open3d

    radii = open3d.utility.DoubleVector([1.25 * spacing, 2.5 * spacing, 5 * spacing])
    cloud = open3d_cloud(points, with_normals=True)
    return open3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii)


def open3d_alpha_shape(points, spacing):
    """The boundary of the union of all tetrahedra in balls of 2.5 spacings."""
    import open3d

    cloud = open3d_cloud(points, with_normals=False)
    return open3d.geometry.TriangleMesh.create_from_point_cloud_alpha_shape(cloud, 2.5 * spacing)


def meshlab_ball_pivoting(meshes):
    """With its own guess of the radius."""
    meshes.generate_surface_reconstruction_ball_pivoting()


def screened_poisson(meshes, depth):
    """Normals from 30 neighbours: with the default of ten they turn over where noise is as large as the spacing."""
    meshes.compute_normal_for_point_clouds(k=30)
    meshes.generate_surface_reconstruction_screened_poisson(depth=depth, preclean=False)


def seen_from_afar(points):
    """This library's surface through the points of a scan along -z, whose sensor is a hundred extents away."""
    import surfrecon

    away = 100 * np.ptp(points, axis=0).max()
    return surfrecon.reconstruct(points, sensors=points.mean(axis=0) + (0, 0, away)).mesh


def main():
    """Runs one tool."""
    tool, points, spacing, out = sys.argv[1], np.fromfile(sys.argv[2]).reshape(-1, 3), float(sys.argv[3]), sys.argv[4]
    if tool.startswith("open3d"):
        import open3d  # noqa: F401 the time of the import is no part of the reconstruction
    elif tool == "surfrecon-sensor":
        import surfrecon  # noqa: F401 nor is this one's
    else:
        import pymeshlab

        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(points))
    started, used = time.monotonic(), resource.getrusage(resource.RUSAGE_SELF)
    if tool == "open3d-ball-pivoting":
        mesh = open3d_ball_pivoting(points, spacing)
    elif tool == "open3d-alpha-shape":
        mesh = open3d_alpha_shape(points, spacing)
    elif tool == "surfrecon-sensor":
        mesh = seen_from_afar(points)
    elif tool.startswith("screened-poisson-"):
        screened_poisson(meshes, int(tool.rpartition("-")[2]))
    else:
        meshlab_ball_pivoting(meshes)
    now = resource.getrusage(resource.RUSAGE_SELF)
    seconds = {
        "cpu_s": now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime,
        "wall_s": time.monotonic() - started,
    }
    if tool.startswith("open3d"):
        vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    elif tool == "surfrecon-sensor":
        vertices, triangles = mesh.positions, mesh.triangles
    else:
        vertices, triangles = meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()
    np.savez(out, vertices=vertices, triangles=triangles)
    print(json.dumps(seconds))


main()
