"""Gmsh's and Qhull's tetrahedralization of a file of doubles: peer_delaunay.py gmsh|qhull POINTS THREADS.

Prints the number of tetrahedra and the time without imports as JSON.
"""

import json
import sys
import time

import numpy as np

tool, path, threads = sys.argv[1], sys.argv[2], int(sys.argv[3])
points = np.fromfile(path, "<f8")
if tool == "gmsh":
    import gmsh

    gmsh.initialize(["gmsh", "-v", "0"])
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", threads)
    tetrahedralize = lambda: len(gmsh.algorithm.tetrahedralize(points)[0]) // 4  # noqa: E731
else:
    from scipy.spatial import Delaunay

    tetrahedralize = lambda: len(Delaunay(points.reshape(-1, 3)).simplices)  # noqa: E731
cpu, wall = time.process_time(), time.perf_counter()
count = tetrahedralize()
print(json.dumps({"tets": count, "cpu_s": time.process_time() - cpu, "wall_s": time.perf_counter() - wall}))
