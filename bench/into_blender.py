"""A mesh of the library into Blender, beside the fewest calls of Blender that make the same mesh from arrays at hand.

Runs under the Python of a Blender module: into_blender.py ADDON_FOLDER REPEATS SIDE, with SIDE x SIDE vertices. A line
of JSON a case: the megabytes of coordinates and corners that Blender is handed; seconds of the CPU and of the clock for
us and for the minimum, their medians; and megabytes that the library, by its own count, and NumPy, by Python's, hold
more than before while the mesh is made (`peak_mb`) and after it (`left_mb`). A last line, of the case `operator`, has
what is left when a whole operator has ended.
"""

import gc
import importlib
import json
import os
import resource
import statistics
import sys
import time
import tracemalloc

sys.path.insert(0, sys.argv[1])
import bpy
import numpy as np
import surfrecon

convert = importlib.import_module("extension.convert")
SIDE = int(sys.argv[3])


def shape():
    """Vertices and a million triangles of a wavy sheet."""
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    vertices = np.dstack([x, y, np.sin(x / 9) + np.cos(y / 7)]).reshape(-1, 3)
    a = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    return vertices, np.concatenate([np.stack([a, a + 1, a + SIDE], 1), np.stack([a + 1, a + SIDE + 1, a + SIDE], 1)])


VERTICES, TRIANGLES = shape()
COORDINATES, CORNERS = VERTICES.astype(np.float32).reshape(-1), TRIANGLES.astype(np.int32).reshape(-1)
STARTS = np.arange(0, len(CORNERS), 3, dtype=np.uint32)
ERROR = np.linspace(0, 1, len(VERTICES), dtype=np.float32)
COLOUR = np.random.default_rng(1).integers(0, 256, (len(VERTICES), 4), dtype=np.uint8)
LINEAR = np.linspace(0, 1, 4 * len(VERTICES), dtype=np.float32)


def minimum(attributes):
    """The fewest calls, all arrays as Blender wants them."""
    mesh = bpy.data.meshes.new("a")
    mesh.vertices.add(len(VERTICES))
    mesh.loops.add(len(CORNERS))
    mesh.polygons.add(len(STARTS))
    mesh.attributes["position"].data.foreach_set("vector", COORDINATES)
    mesh.attributes[".corner_vert"].data.foreach_set("value", CORNERS)
    mesh.polygons.foreach_set("loop_start", STARTS)
    mesh.update(calc_edges=True)
    if attributes:
        mesh.attributes.new("error", "FLOAT", "POINT").data.foreach_set("value", ERROR)
        mesh.attributes.new("colour", "FLOAT_COLOR", "POINT").data.foreach_set("color", LINEAR)
    return mesh


def ours(content):
    """Makes Blender's mesh of a result by the calls of the operators."""
    return convert.object_from_mesh("a", content, 1.0)[0].data


def used():
    """CPU seconds."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def median(call, repeats):
    """CPU and wall seconds of a call that returns a mesh; the first one, which fills caches, doesn't count."""
    runs = []
    for turn in range(1 + repeats):
        start, wall = used(), time.perf_counter()
        mesh = call()
        runs.append((used() - start, time.perf_counter() - wall))
        assert len(mesh.polygons) == len(TRIANGLES) and len(mesh.edges) > len(TRIANGLES)
        bpy.data.meshes.remove(mesh)
        if turn == 0:
            runs.clear()
    return [statistics.median(run[k] for run in runs) for k in range(2)]


def memory(call):
    """Megabytes beyond what was held before: the most while a call runs, and what stays."""
    gc.collect()
    tracemalloc.start()
    before = surfrecon.memory_in_use()
    surfrecon.memory_peak(restart=True)
    call()
    peak = surfrecon.memory_peak() - before + tracemalloc.get_traced_memory()[1]
    gc.collect()
    left = surfrecon.memory_in_use() - before + array_bytes()
    tracemalloc.stop()
    return peak / 1e6, left / 1e6


def array_bytes():
    """The bytes of NumPy's arrays that were made since the tracing began."""
    return sum(trace.size for trace in tracemalloc.take_snapshot().traces if trace.domain == NUMPY)


# Python's number for NumPy's memory.
NUMPY = 389047


def operator():
    """Merges the sheet: handing over, measuring, materials."""
    assert bpy.ops.surfrecon.merge(voxel=1.5) == {"FINISHED"}


def operator_memory(content):
    """Megabytes left by the operator, once all that is made only once has been made."""
    extension = importlib.import_module("extension")
    extension.register()
    obj = convert.object_from_mesh("sheet", content, 1.0)[0]
    bpy.context.scene.collection.objects.link(obj)

    def once():
        for other in list(bpy.data.objects):
            if other is not obj:
                bpy.data.batch_remove([other.data, other])
        obj.select_set(True)
        operator()

    once()
    left = memory(once)[1]
    extension.unregister()
    return left


def main():
    """Measures both cases, and an operator."""
    repeats = int(sys.argv[2])
    for case, attributes in (("plain", False), ("colour and error", True)):
        content = surfrecon.Mesh(VERTICES, TRIANGLES, colour=COLOUR, confidence=ERROR) if attributes else None
        content = content or surfrecon.Mesh(VERTICES, TRIANGLES)
        calls = (lambda content=content: ours(content), lambda attributes=attributes: minimum(attributes))
        # In turns, so that another load on the machine meets both.
        rounds = [[median(call, 3) for call in calls] for _ in range(repeats)]
        best = [[statistics.median(each[k][i] for each in rounds) for i in range(2)] for k in range(2)]
        peak, left = memory(lambda call=calls[0]: bpy.data.meshes.remove(call()))
        row = {
            "case": case,
            "megabytes": (COORDINATES.nbytes + CORNERS.nbytes) / 1e6,
            "ours": best[0],
            "minimum": best[1],
            "peak_mb": peak,
            "left_mb": left,
        }
        print(json.dumps(row))
    print(json.dumps({"case": "operator", "left_mb": operator_memory(surfrecon.Mesh(VERTICES, TRIANGLES))}))
    sys.stdout.flush()
    # The module's own way out hangs.
    os._exit(0)


if __name__ == "__main__":
    main()
