"""One row of bench/limits.py, in a process of its own: limits_call.py [CASE, CANCELS, FOLDER, SMALL]."""

import base64
import json
import signal
import struct
import sys
import time
import zlib
from pathlib import Path

import numpy as np
import surfrecon

case, cancels, folder, small = json.loads(sys.argv[1])
operation, what = case.split(": ")
folder = Path(folder)
size = (lambda large: max(large // 8, 40)) if small else (lambda large: large)


def relief(side, noise=0.05):
    side = size(side)
    y, x = np.mgrid[:side, :side].astype(float)
    z = 20 * np.sin(x / 37) * np.cos(y / 29)
    return z + np.random.default_rng(1).normal(0, noise, z.shape) if noise else z


def orthographic(side, **options):
    return surfrecon.RangeImage.orthographic(relief(side, **options), step=(1.0, -1.0))


def pinhole(side):
    z = 100 + relief(side) * 0.1
    image = surfrecon.RangeImage.pinhole(z, focal=(side, side), centre=(side / 2, side / 2))
    image.colour = np.full((*z.shape, 4), 200, np.uint8)
    return image


def shape(cell=2.0):
    return surfrecon.sculpture(cell=cell * (4 if small else 1))


def scans(count=6, pixels=500):
    mesh = shape()
    return surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=count, above=0, below=0, pixels=size(pixels)))


def sphere(count, noise=0.0):
    rng = np.random.default_rng(2)
    points = rng.normal(size=(size(count), 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points * (1 + rng.normal(0, noise, (len(points), 1))) if noise else points


def volume(count):
    return np.random.default_rng(3).random((size(count), 3))


def isolated(count):
    corners = np.random.default_rng(4).random((size(count), 1, 3)) * 1000 + np.eye(3)[None]
    return surfrecon.Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3))


def fan(count):
    angle = np.linspace(0, 2 * np.pi, size(count), endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(9 * angle)], -1)
    n = len(ring)
    triangles = [(0, 1 + k, 1 + (k + 1) % n) for k in range(n)]
    return surfrecon.Mesh(np.vstack([[0, 0, 0.5], ring]), np.array(triangles, np.uint32))


def written(name, content, **options):
    path = folder / name
    surfrecon.write(path, content, **options)
    return path


def opened(name):
    return lambda: [scan.read() for scan in surfrecon.open(folder / name)]


def loads(name, content, **options):
    written(name, content, **options)
    return opened(name)


def raw(name, payload):
    (folder / name).write_bytes(payload)
    return opened(name)


def text(name, rows, delimiter=" "):
    np.savetxt(folder / name, rows, "%.6f", delimiter)
    return opened(name)


def png(side, value):
    rows = zlib.compressobj(9)
    line = b"\0" + struct.pack(">H", value) * side
    body = b"".join(rows.compress(line) for _ in range(side)) + rows.flush()
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", side, side, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def instances(count):
    # One small mesh, placed many times.
    data = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) * 100
    return json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(count))}],
        "nodes": [{"mesh": 0}] * count, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 300, "type": "VEC3"}],
    }).encode()


def points(image):
    return image.world_points()[image.valid]


def cases():
    # Operation and input: what prepares the input and gives the call, and whether the input is one of the worst.
    s = surfrecon
    image = lambda side=1000, **o: orthographic(side, **o)
    return {
        "triangulate: relief": (lambda: (lambda i: lambda: i.triangulate())(image(2000)), 0),
        "world_points: relief": (lambda: (lambda i: lambda: i.world_points())(image(2000)), 0),
        "sculpt: relief": (lambda: (lambda i: lambda: s.sculpt(i, relative_tolerance=0.02))(image(700)), 0),
        "sculpt: smooth": (lambda: (lambda i: lambda: s.sculpt(i, relative_tolerance=0.002))(image(1000, noise=0)), 0),
        "sculpt: tolerance 0": (lambda: (lambda i: lambda: s.sculpt(i, tolerance=0))(image(400)), 1),
        "sculpt: off samples": (
            lambda: (lambda i: lambda: s.sculpt(i, relative_tolerance=0.02, interpolate=False))(image(300)), 0),
        "Sculptor: relief": (lambda: (lambda i: lambda: s.Sculptor(i))(image(1500)), 0),
        "adaptive_quads: relief": (lambda: (lambda i: lambda: s.adaptive_quads(i, rows=60, columns=60))(image(2000)), 0),
        "spline: relief": (lambda: (lambda q: lambda: q.spline())(s.adaptive_quads(image(1000), rows=60, columns=60)), 0),
        "merge: scans": (lambda: (lambda i: lambda: s.merge(i, voxel=1.0))(scans()), 0),
        "merge: scans, fine": (lambda: (lambda i: lambda: s.merge(i, voxel=0.4))(scans()), 0),
        "merge: one relief": (lambda: (lambda i: lambda: s.merge([i], voxel=1.0))(image(500)), 0),
        "merge: isolated triangles": (lambda: (lambda m: lambda: s.merge([m], voxel=0.5))(isolated(4000)), 1),
        "merge: measured": (lambda: (lambda i: lambda: s.merge(i, voxel=1.0, measure=True))(scans()), 0),
        "reconstruct: sphere": (lambda: (lambda p: lambda: s.reconstruct(p))(sphere(100_000)), 1),
        "reconstruct: noisy sphere": (lambda: (lambda p: lambda: s.reconstruct(p))(sphere(60_000, 0.004)), 1),
        "reconstruct: scan": (lambda: (lambda p: lambda: s.reconstruct(p))(points(scans(1, 600)[0])), 0),
        "reconstruct: volume": (lambda: (lambda p: lambda: s.reconstruct(p))(volume(30_000)), 1),
        "cluster: shape": (lambda: (lambda m: lambda: s.cluster(m, vertices=2000))(shape(2.0)), 0),
        "cluster: fitted": (lambda: (lambda m: lambda: s.cluster(m, vertices=2000, fitting=2))(shape(2.0)), 0),
        "cluster: largest error": (lambda: (lambda m: lambda: s.cluster(m, max_error=1.0))(shape(5.0)), 1),
        "cluster: points": (lambda: (lambda p: lambda: s.cluster(p, vertices=2000))(points(scans(1, 400)[0])), 0),
        "cluster: fan": (lambda: (lambda m: lambda: s.cluster(m, vertices=500))(fan(100_000)), 1),
        "cluster: isolated triangles": (lambda: (lambda m: lambda: s.cluster(m, vertices=500))(isolated(30_000)), 1),
        "cluster_levels: shape": (lambda: (lambda m: lambda: s.cluster_levels(m, [2000, 500]))(shape(2.0)), 0),
        "distances: shape": (lambda: (lambda m, p: lambda: s.distances(p, m))(shape(1.0), volume(300_000) * 100), 0),
        "surface_distance: shapes": (lambda: (lambda a, b: lambda: s.surface_distance(a, b))(shape(2.0), shape(1.5)), 0),
        "nearest_triangles: shape": (
            lambda: (lambda m, p: lambda: s.nearest_triangles(p, m))(shape(1.0), volume(300_000) * 100), 0),
        "check: shape": (lambda: (lambda m: lambda: m.check())(shape(0.7)), 0),
        "check: fan": (lambda: (lambda m: lambda: m.check())(fan(300_000)), 1),
        "Mesh: shape": (lambda: (lambda m: lambda: s.Mesh(m.positions.copy(), m.triangles.copy()))(shape(0.7)), 0),
        "positions_f32: shape": (lambda: (lambda m: lambda: m.positions_f32())(shape(0.7)), 0),
        "RangeImage.orthographic: relief": (
            lambda: (lambda z: lambda: s.RangeImage.orthographic(z, step=(1, -1)))(relief(3000)), 0),
        "virtual_scan: shape": (
            lambda: (lambda m, c: lambda: s.virtual_scan(m, c))(m := shape(), s.turntable(m, pixels=size(1000))), 0),
        "turntable: a million": (lambda: (lambda m: lambda: s.turntable(m, around=size(10**6)))(shape(8.0)), 1),
        "sculpture: fine": (lambda: lambda: shape(1.0), 0),
        "read: grid.ply": (lambda: loads("grid.ply", image(1500)), 0),
        "read: grid text.ply": (lambda: loads("grid.ply", image(700), encoding="ascii"), 0),
        "read: mesh.ply": (lambda: loads("mesh.ply", shape(0.7)), 0),
        "read: mesh text.ply": (lambda: loads("mesh.ply", shape(1.0), encoding="ascii"), 0),
        "read: mesh.obj": (lambda: loads("mesh.obj", shape(1.0)), 0),
        "read: mesh.stl": (lambda: loads("mesh.stl", shape(0.7)), 0),
        "read: mesh.glb": (lambda: loads("mesh.glb", shape(0.7)), 0),
        "read: scans.e57": (lambda: loads("scans.e57", [pinhole(1000)]), 0),
        "read: scans.ptx": (lambda: loads("scans.ptx", [pinhole(600)]), 0),
        "read: points.xyz": (lambda: text("points.xyz", volume(500_000)), 0),
        "read: points.csv": (lambda: text("points.csv", volume(500_000), ","), 0),
        "read: map.npy": (lambda: (np.save(folder / "map.npy", relief(2000)), opened("map.npy"))[1], 0),
        "read: map.png": (lambda: raw("map.png", png(size(3000), 700)), 1),
        "read: instances.gltf": (lambda: raw("instances.gltf", instances(size(20_000))), 1),
        "write: grid.ply": (lambda: (lambda i: lambda: written("w.ply", i))(image(1500)), 0),
        "write: mesh.ply": (lambda: (lambda m: lambda: written("w.ply", m))(shape(0.7)), 0),
        "write: mesh.obj": (lambda: (lambda m: lambda: written("w.obj", m))(shape(1.0)), 0),
        "write: mesh.stl": (lambda: (lambda m: lambda: written("w.stl", m))(shape(0.7)), 0),
        "write: mesh.glb": (lambda: (lambda m: lambda: written("w.glb", m))(shape(0.7)), 0),
        "write: scans.e57": (lambda: (lambda i: lambda: written("w.e57", [i]))(pinhole(1000)), 0),
        "write: scans.ptx": (lambda: (lambda i: lambda: written("w.ptx", [i]))(pinhole(600)), 0),
    }


if what == "list":
    print(json.dumps({name: "worst" if worst else "ordinary" for name, (_, worst) in cases().items()}))
    sys.exit()


class Stop(Exception):
    pass


def stop(number, frame):
    raise Stop


signal.signal(signal.SIGALRM, stop)
call = cases()[case][0]()
call()


def run(limit=None):
    surfrecon.memory_peak(restart=True)
    before = surfrecon.memory_in_use()
    surfrecon.set_memory_limit(limit)
    try:
        result, refused = call(), None
        del result
    except MemoryError as error:
        refused = str(error)
    finally:
        surfrecon.set_memory_limit(None)
    return surfrecon.memory_peak() - before, refused


peak, _ = run()
foreseen = surfrecon.memory_foreseen()
halved, refused = run(max(peak // 2, 1))
_, without_need = run(max(foreseen, peak) + (1 << 20))
# A few pages of the small allocations that a refusal takes are no harm.
kept = refused is not None and halved <= peak // 2 + (1 << 16) and without_need is None
began = time.perf_counter()
call()
whole = time.perf_counter() - began
longest, heard = 0.0, 0
for k in range(cancels):
    delay = max((k + 0.5) / cancels * whole, 1e-5)
    began = time.perf_counter()
    signal.setitimer(signal.ITIMER_REAL, delay)
    try:
        call()
        signal.setitimer(signal.ITIMER_REAL, 0)
    except Stop:
        longest, heard = max(longest, time.perf_counter() - began - delay), heard + 1
print(json.dumps({
    "estimate_mb": foreseen / 1e6, "peak_mb": peak / 1e6, "limit_kept": kept, "stop_ms": 1e3 * longest, "cancels": heard,
    "seconds": whole, "refusal": refused, "without_need": without_need,
}))
