"""One merge filter inside pymeshlab, in a process of its own: meshlab_filter.py TOOL FOLDER VOXEL OUT PLUGIN.

FOLDER is from prepare.py: both filters get the same layers. Prints what the filter itself took, without loading and
saving.
"""

import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

import pymeshlab


def ours(meshes, voxel):
    """Our plugin; holes and parts as it does by default."""
    meshes.apply_filter("generate_surface_reconstruction_marching_intersections", voxel=pymeshlab.PureValue(voxel))


def vcg(meshes, voxel):
    """MeshLab's own: a distance field, its cell the same; leaves a file of its own where it runs."""
    meshes.generate_surface_reconstruction_vcg(
        voxsize=pymeshlab.PureValue(voxel), subdiv=1, mergecolor=False, simplification=False
    )


def main(tool, folder, voxel, out, plugin):
    """Loads the layers, applies the filter, saves its result."""
    if tool == "surfrecon-filter":
        pymeshlab.load_plugin(plugin)
    meshes = pymeshlab.MeshSet(verbose=False)
    for file in (Path(folder) / "scans.txt").read_text().split("\n")[:-1]:
        meshes.load_new_mesh(file)
    with tempfile.TemporaryDirectory() as scratch:
        os.chdir(scratch)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        wall, cpu = time.perf_counter(), time.process_time()
        (ours if tool == "surfrecon-filter" else vcg)(meshes, voxel)
        figures = {"filter_cpu_s": time.process_time() - cpu, "filter_wall_s": time.perf_counter() - wall}
        figures["filter_peak_mb"] = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
        figures["files_left"] = len(os.listdir(scratch))
        meshes.save_current_mesh(out, save_vertex_normal=False, save_vertex_quality=False, save_vertex_color=False)
        os.chdir("/")
    print(json.dumps(figures))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]), sys.argv[4], sys.argv[5])
