"""One tool of the benchmark of closing, in a process of its own: peer_close.py TOOL FOLDER OUT.

FOLDER holds `merged.npz`, the measured surface (positions, triangles, cell), and what scans there are. With the tool
`merge` it is made there. OUT (.npz) gets the result; printed is a line of JSON with the CPU and wall seconds of the
work alone, without imports and files, and what a tool says of its result.
"""

import json
import resource
import sys
import time
from pathlib import Path

import numpy as np

# Of vertices of Screened Poisson the level of the octree that their samples reached, less than the depth by more than
# this: there were none. The reconstruction's own trimmer takes 7 for a depth of 10.
TRIMMED_LEVELS = 3


def scans_of(folder):
    """The scans of a folder, None where none are known; see close.py for how they are kept."""
    import surfrecon

    told = json.loads((folder / "scans.json").read_text())
    if told["files"] is None:
        return None
    return surfrecon.open(told["files"] if len(told["files"]) > 1 else told["files"][0], **told["options"])


def merge(folder, _):
    """The measured surface: nothing is filled."""
    import surfrecon

    scans = scans_of(folder)

    def work():
        merged = surfrecon.merge(scans, max_hole_length=0.0)
        lengths = {"cell": merged.report.voxel, "merge_distance": merged.report.merge_distance}
        return merged.mesh.positions, merged.mesh.triangles, lengths

    return work


def ours(folder, merged, **options):
    """This library, told what saw the surface."""
    import surfrecon

    told = json.loads((folder / "scans.json").read_text())
    scans = scans_of(folder) if told["sight"] else None
    mesh = surfrecon.Mesh(merged["positions"], merged["triangles"])

    def work():
        closed = surfrecon.close(mesh, scans, **options)
        left = [kind for kind, _ in closed.report.open]
        said = {"left_open": {kind: left.count(kind) for kind in set(left)}, "openings_closed": closed.report.closed}
        return closed.mesh.positions, closed.mesh.triangles, said

    return work


def meshlab(merged):
    """A set of meshes with the measured surface in it, and its normals."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(merged["positions"], merged["triangles"]))
    return meshes


def made(meshes):
    """The current mesh of a set."""
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix(), {}


def poisson(_, merged, depth, trimmed=False):
    """MeshLab's Screened Poisson of the vertices and normals of the measured surface."""
    meshes = meshlab(merged)

    def work():
        meshes.compute_normal_per_vertex()
        meshes.generate_surface_reconstruction_screened_poisson(depth=depth, preclean=True)
        if trimmed:
            meshes.compute_selection_by_condition_per_vertex(condselect=f"q < {depth - TRIMMED_LEVELS}")
            meshes.meshing_remove_selected_vertices()
        return made(meshes)

    return work


def open3d_poisson(_, merged):
    """Open3D's of the same; with more threads it now and then ends with a fault."""
    import open3d

    vectors = (open3d.utility.Vector3dVector(merged["positions"]), open3d.utility.Vector3iVector(merged["triangles"]))
    mesh = open3d.geometry.TriangleMesh(*vectors)

    def work():
        mesh.compute_vertex_normals()
        cloud = open3d.geometry.PointCloud(mesh.vertices)
        cloud.normals = mesh.vertex_normals
        found, _ = open3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=8, n_threads=1)
        return np.asarray(found.vertices), np.asarray(found.triangles), {}

    return work


def vcg(_, merged):
    """MeshLab's VCG reconstruction of the measured surface: it closes holes by widening its distance field."""
    import pymeshlab

    meshes = meshlab(merged)

    def work():
        meshes.generate_surface_reconstruction_vcg(
            voxsize=pymeshlab.PureValue(float(merged["cell"])), subdiv=1, mergecolor=False, simplification=False
        )
        return made(meshes)

    return work


def close_holes(_, merged):
    """MeshLab's filter, of holes of any length."""
    meshes = meshlab(merged)

    def work():
        meshes.meshing_close_holes(maxholesize=10**7, newfaceselected=False)
        return made(meshes)

    return work


def meshfix(_, merged):
    """MeshFix, which keeps the largest part and repairs crossings as well."""
    import pymeshfix

    def work():
        fix = pymeshfix.MeshFix(merged["positions"], merged["triangles"].astype(np.int32))
        fix.repair()
        return np.asarray(fix.points), np.asarray(fix.faces), {}

    return work


TOOLS = {
    "merge": merge,
    "surfrecon": ours,
    "surfrecon-flat": lambda folder, merged: ours(folder, merged, flat_base=True),
    "surfrecon-seen": lambda folder, merged: ours(folder, merged, openings="seen"),
    "poisson-8": lambda folder, merged: poisson(folder, merged, 8),
    "poisson-8-trimmed": lambda folder, merged: poisson(folder, merged, 8, trimmed=True),
    "poisson-10": lambda folder, merged: poisson(folder, merged, 10),
    "vcg": vcg,
    "open3d-poisson-8": open3d_poisson,
    "meshlab-close-holes": close_holes,
    "meshfix": meshfix,
}


def main():
    """Runs one tool."""
    tool, folder, out = sys.argv[1], Path(sys.argv[2]), sys.argv[3]
    merged = None if tool == "merge" else dict(np.load(folder / "merged.npz"))
    work = TOOLS[tool](folder, merged)
    # The VCG filter leaves a file where it runs: measured.run starts this in a folder of its own.
    started, used = time.monotonic(), resource.getrusage(resource.RUSAGE_SELF)
    positions, triangles, said = work()
    now, ended = resource.getrusage(resource.RUSAGE_SELF), time.monotonic()
    np.savez(out, positions=positions, triangles=triangles)
    seconds = {"cpu_s": now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime, "wall_s": ended - started}
    print("\n" + json.dumps(seconds | {"said": said}))


if __name__ == "__main__":
    main()
