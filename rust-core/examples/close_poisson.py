"""Makes Screened Poisson surfaces of what the example close_figures writes: close_poisson.py FOLDER [DEPTH]."""

import json
import sys
import time
from pathlib import Path

import pymeshlab

folder, depth = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 8
for merged in sorted(folder.glob("*.merged.ply")):
    name = merged.name.removesuffix(".merged.ply")
    result = folder / f"{name}.poisson.ply"
    if result.exists() and result.stat().st_mtime > merged.stat().st_mtime:
        continue
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(merged))
    meshes.compute_normal_per_vertex()
    start = time.process_time()
    meshes.generate_surface_reconstruction_screened_poisson(depth=depth, preclean=True, threads=1)
    seconds = time.process_time() - start
    meshes.save_current_mesh(str(result))
    (folder / f"{name}.poisson.json").write_text(json.dumps({"cpu_s": seconds}))
    print(f"{name}: {meshes.current_mesh().face_number()} triangles, {seconds:.1f} s", flush=True)
