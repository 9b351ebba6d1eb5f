"""One row of bench/limits.py: limits_call.py [CASE, [MOST, FEWEST CANCELS], THEIR SECONDS, FOLDER, SMALL]."""

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

case, (most_cancels, fewest_cancels), seconds, folder, small = json.loads(sys.argv[1])
operation, what = case.split(": ")
folder = Path(folder)


def size(large):
    """The size of an input, or of the smallest that shows that the benchmark works."""
    return max(large // 8, 40) if small else large


def on(make, call):
    """Prepares an input, then gives the call on it."""

    def prepare():
        made = make()
        return lambda: call(*made) if isinstance(made, tuple) else call(made)

    return prepare


def relief(side, noise=0.05):
    """Heights of waves with noise."""
    side = size(side)
    y, x = np.mgrid[:side, :side].astype(float)
    z = 20 * np.sin(x / 37) * np.cos(y / 29)
    return z + np.random.default_rng(1).normal(0, noise, z.shape) if noise else z


def orthographic(side, **options):
    """A height map."""
    return surfrecon.RangeImage.orthographic(relief(side, **options), step=(1.0, -1.0))


def pinhole(side):
    """A depth camera's image with colours."""
    z = 100 + relief(side) * 0.1
    image = surfrecon.RangeImage.pinhole(z, focal=(side, side), centre=(side / 2, side / 2))
    image.colour = np.full((*z.shape, 4), 200, np.uint8)
    return image


def shape(cell=2.0):
    """A closed surface."""
    return surfrecon.sculpture(cell=min(cell * (4 if small else 1), 20.0))


def half(cell):
    """The upper half of one."""
    whole = shape(cell)
    middle = (whole.positions.min(axis=0) + whole.positions.max(axis=0))[2] / 2
    return surfrecon.Mesh(whole.positions, whole.triangles[(whole.positions[whole.triangles, 2] > middle).all(axis=1)])


def dense(side):
    """A mesh of two triangles a pixel."""
    return orthographic(side, noise=0).triangulate()


def scans(count=6, pixels=500):
    """Scans of the shape."""
    mesh = shape()
    return surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=count, above=0, below=0, pixels=size(pixels)))


def merged():
    """The surface of scans of one side, with the scans."""
    some = scans()[:3]
    return surfrecon.merge(some, voxel=1.0).mesh, some


def sphere(count, noise=0.0):
    """Points on a sphere, or near it."""
    rng = np.random.default_rng(2)
    points = rng.normal(size=(size(count), 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points * (1 + rng.normal(0, noise, (len(points), 1))) if noise else points


def volume(count):
    """Points in a cube."""
    return np.random.default_rng(3).random((size(count), 3))


def ball(side):
    """A closed surface that is star-shaped, so no faces cross: what prints are made of."""
    side = size(side)
    turn, up = np.meshgrid(np.arange(2 * side) * np.pi / side, np.arange(1, side) * np.pi / side)
    out = np.stack([np.sin(up) * np.cos(turn), np.sin(up) * np.sin(turn), np.cos(up)], -1)
    out *= (50 + 3 * np.sin(5 * turn) * np.sin(up) ** 2)[..., None]
    last = (side - 1) * 2 * side
    row, col = np.arange(side - 2)[:, None], np.arange(2 * side)[None]
    following = (col + 1) % (2 * side)
    a, b = row * 2 * side + col, row * 2 * side + following
    c, d = a + 2 * side, b + 2 * side
    top = np.stack([np.full(2 * side, last), col[0], following[0]], -1)
    under = np.stack([np.full(2 * side, last + 1), last - 2 * side + following[0], last - 2 * side + col[0]], -1)
    triangles = [np.stack([a, c, d], -1).reshape(-1, 3), np.stack([a, d, b], -1).reshape(-1, 3), top, under]
    poles = [[0, 0, 50], [0, 0, -50]]
    return surfrecon.Mesh(np.vstack([out.reshape(-1, 3), poles]), np.vstack(triangles).astype(np.uint32))


def isolated(count):
    """Triangles far from each other."""
    corners = np.random.default_rng(4).random((size(count), 1, 3)) * 1000 + np.eye(3)[None]
    return surfrecon.Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3))


def fan(count):
    """A vertex of as many triangles."""
    angle = np.linspace(0, 2 * np.pi, size(count), endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(9 * angle)], -1)
    n = len(ring)
    triangles = [(0, 1 + k, 1 + (k + 1) % n) for k in range(n)]
    return surfrecon.Mesh(np.vstack([[0, 0, 0.5], ring]), np.array(triangles, np.uint32))


def written(name, content, **options):
    """Writes a file; gives its path."""
    path = folder / name
    surfrecon.write(path, content, **options)
    return path


def opened(name):
    """The call that reads all of a file."""
    return lambda: [scan.read() for scan in surfrecon.open(folder / name)]


def loads(name, content, **options):
    """Writes a file, and gives the call that reads it."""
    written(name, content, **options)
    return opened(name)


def raw(name, payload):
    """Writes bytes, and gives the call that reads them."""
    (folder / name).write_bytes(payload)
    return opened(name)


def text(name, rows, delimiter=" "):
    """Writes numbers, and gives the call that reads them."""
    np.savetxt(folder / name, rows, "%.6f", delimiter)
    return opened(name)


def esri(name, heights):
    """Writes an ESRI grid, and gives the call that reads it."""
    head = f"ncols {heights.shape[1]}\nnrows {heights.shape[0]}\nxllcorner 0\nyllcorner 0\ncellsize 1"
    np.savetxt(folder / name, heights, "%.4f", header=head, comments="")
    return opened(name)


def png(side, value):
    """A grey image of one value, 16 bits."""
    rows = zlib.compressobj(9)
    line = b"\0" + struct.pack(">H", value) * side
    body = b"".join(rows.compress(line) for _ in range(side)) + rows.flush()

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", side, side, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def instances(count):
    """A glTF file of one small mesh, placed many times."""
    data = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) * 100
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": list(range(count))}],
            "nodes": [{"mesh": 0}] * count,
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "buffers": [
                {
                    "byteLength": len(data),
                    "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
                }
            ],
            "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 300, "type": "VEC3"}],
        }
    ).encode()


def points(image):
    """The valid points of an image."""
    return image.world_points()[image.valid]


def vertices(side):
    """The data that a host keeps of a depth camera's image: its camera and its vertices with their attributes."""
    image = pinhole(side)
    mesh = image.to_mesh(faces=False)
    return image.grid_camera(), mesh.vertex_attributes, mesh.positions


def back(camera, attributes, positions):
    """The image of a host's vertices."""
    row, col = attributes["range_row"], attributes["range_col"]
    return surfrecon.RangeImage.from_vertices(camera, row, col, positions, colour=attributes["colour"])


def cases():
    """By operation and input: what prepares the input and gives the call, and whether the input is one of the worst."""
    s = surfrecon
    return {
        "triangulate: relief": (on(lambda: orthographic(2000), lambda i: i.triangulate()), 0),
        "world_points: relief": (on(lambda: orthographic(2000), lambda i: i.world_points()), 0),
        "to_mesh: relief": (on(lambda: pinhole(2000), lambda i: i.to_mesh()), 0),
        "to_mesh: without faces": (on(lambda: pinhole(2000), lambda i: i.to_mesh(faces=False)), 0),
        "grid_camera: relief": (on(lambda: pinhole(2000), lambda i: i.grid_camera()), 0),
        "from_vertices: relief": (on(lambda: vertices(2000), back), 0),
        "sculpt: relief": (on(lambda: orthographic(700), lambda i: s.sculpt(i, relative_tolerance=0.02)), 0),
        "sculpt: smooth": (on(lambda: orthographic(1000, noise=0), lambda i: s.sculpt(i, relative_tolerance=0.002)), 0),
        "sculpt: tolerance 0": (on(lambda: orthographic(400), lambda i: s.sculpt(i, tolerance=0)), 1),
        "sculpt: off samples": (
            on(lambda: orthographic(200), lambda i: s.sculpt(i, relative_tolerance=0.02, interpolate=False)),
            0,
        ),
        "Sculptor: relief": (on(lambda: orthographic(1500), lambda i: s.Sculptor(i)), 0),
        "adaptive_quads: relief": (
            on(lambda: orthographic(2000), lambda i: s.adaptive_quads(i, rows=60, columns=60)),
            0,
        ),
        "spline: relief": (
            on(lambda: s.adaptive_quads(orthographic(1000), rows=60, columns=60), lambda q: q.spline()),
            0,
        ),
        "merge: scans": (on(lambda: scans(), lambda i: s.merge(i, voxel=1.0)), 0),
        "merge: scans, fine": (on(lambda: scans(), lambda i: s.merge(i, voxel=0.4)), 0),
        "merge: one relief": (on(lambda: orthographic(500), lambda i: s.merge([i], voxel=1.0)), 0),
        "merge: isolated triangles": (on(lambda: isolated(4000), lambda m: s.merge([m], voxel=0.5)), 1),
        "merge: measured": (on(lambda: scans(), lambda i: s.merge(i, voxel=1.0, measure=True)), 0),
        "close: half a shape": (on(lambda: half(2.0), lambda m: s.close(m)), 0),
        "close: scans": (on(lambda: merged(), lambda m, i: s.close(m, i)), 0),
        "check_print: shape": (on(lambda: shape(2.0), lambda m: s.check_print(m)), 0),
        "check_print: fan": (on(lambda: fan(30_000), lambda m: s.check_print(m)), 1),
        "prepare_print: hollow": (
            on(lambda: ball(280), lambda m: s.prepare_print(m, flat_base=True, hollow=4.0, drain=6.0)),
            0,
        ),
        "prepare_print: thick": (on(lambda: ball(180), lambda m: s.prepare_print(m, min_wall=4.0)), 0),
        "unwrap: shape": (on(lambda: shape(3.0), lambda m: s.unwrap(m)), 0),
        "unwrap: isolated triangles": (on(lambda: isolated(1500), lambda m: s.unwrap(m)), 1),
        "reconstruct: sphere": (on(lambda: sphere(50_000), lambda p: s.reconstruct(p)), 1),
        "reconstruct: noisy sphere": (on(lambda: sphere(40_000, 0.004), lambda p: s.reconstruct(p)), 1),
        "reconstruct: scan": (on(lambda: points(scans(1, 600)[0]), lambda p: s.reconstruct(p)), 0),
        "reconstruct: volume": (on(lambda: volume(30_000), lambda p: s.reconstruct(p)), 1),
        "cluster: shape": (on(lambda: shape(2.0), lambda m: s.cluster(m, vertices=2000)), 0),
        "cluster: fitted": (on(lambda: shape(2.0), lambda m: s.cluster(m, vertices=2000, fitting=2)), 0),
        "cluster: least angle": (on(lambda: shape(2.0), lambda m: s.cluster(m, vertices=2000, min_angle=0.5)), 0),
        "cluster: largest error": (on(lambda: dense(150), lambda m: s.cluster(m, max_error=1.0)), 1),
        "cluster: points": (on(lambda: points(scans(1, 400)[0]), lambda p: s.cluster(p, vertices=2000)), 0),
        "cluster: fan": (on(lambda: fan(100_000), lambda m: s.cluster(m, vertices=500)), 1),
        "cluster: isolated triangles": (on(lambda: isolated(30_000), lambda m: s.cluster(m, vertices=500)), 1),
        "cluster_levels: shape": (on(lambda: shape(2.0), lambda m: s.cluster_levels(m, [2000, 500])), 0),
        "distances: shape": (on(lambda: (dense(700), volume(50_000) * 700), lambda m, p: s.distances(p, m)), 0),
        "surface_distance: shapes": (
            on(lambda: (dense(300), dense(400)), lambda a, b: s.surface_distance(a, b)),
            0,
        ),
        "nearest_triangles: shape": (
            on(lambda: (dense(700), volume(50_000) * 700), lambda m, p: s.nearest_triangles(p, m)),
            0,
        ),
        "check: shape": (on(lambda: dense(1000), lambda m: m.check()), 0),
        "check: fan": (on(lambda: fan(300_000), lambda m: m.check()), 1),
        "Mesh: shape": (on(lambda: dense(1000), lambda m: s.Mesh(m.positions.copy(), m.triangles.copy())), 0),
        "positions_f32: shape": (on(lambda: dense(1000), lambda m: m.positions_f32()), 0),
        "RangeImage.orthographic: relief": (
            on(lambda: relief(3000), lambda z: s.RangeImage.orthographic(z, step=(1, -1))),
            0,
        ),
        "virtual_scan: shape": (
            on(lambda: (shape(), s.turntable(shape(), pixels=size(1000))), lambda m, c: s.virtual_scan(m, c)),
            0,
        ),
        "turntable: a million": (on(lambda: shape(8.0), lambda m: s.turntable(m, around=size(10**6))), 1),
        "sculpture: fine": (lambda: lambda: shape(4.0), 0),
        "read: grid.ply": (lambda: loads("grid.ply", orthographic(1500)), 0),
        "read: grid.asc": (lambda: esri("grid.asc", relief(1000)), 0),
        "read: mesh.ply": (lambda: loads("mesh.ply", dense(1000)), 0),
        "read: mesh text.ply": (lambda: loads("mesh.ply", dense(700), encoding="ascii"), 0),
        "read: mesh.obj": (lambda: loads("mesh.obj", dense(700)), 0),
        "read: mesh.stl": (lambda: loads("mesh.stl", dense(1000)), 0),
        "read: mesh.glb": (lambda: loads("mesh.glb", dense(1000)), 0),
        "read: scans.e57": (lambda: loads("scans.e57", [pinhole(1000)]), 0),
        "read: scans.ptx": (lambda: loads("scans.ptx", [pinhole(600)]), 0),
        "read: points.xyz": (lambda: text("points.xyz", volume(500_000)), 0),
        "read: points.csv": (lambda: text("points.csv", volume(500_000), ","), 0),
        "read: map.npy": (lambda: (np.save(folder / "map.npy", relief(2000)), opened("map.npy"))[1], 0),
        "read: map.png": (lambda: raw("map.png", png(size(3000), 700)), 1),
        "read: instances.gltf": (lambda: raw("instances.gltf", instances(size(20_000))), 1),
        "write: grid.ply": (on(lambda: orthographic(1500), lambda i: written("w.ply", i)), 0),
        "write: mesh.ply": (on(lambda: dense(1000), lambda m: written("w.ply", m)), 0),
        "write: mesh.obj": (on(lambda: dense(700), lambda m: written("w.obj", m)), 0),
        "write: mesh.stl": (on(lambda: dense(1000), lambda m: written("w.stl", m)), 0),
        "write: mesh.glb": (on(lambda: dense(1000), lambda m: written("w.glb", m)), 0),
        "write: scans.e57": (on(lambda: pinhole(1000), lambda i: written("w.e57", [i])), 0),
        "write: scans.ptx": (on(lambda: pinhole(600), lambda i: written("w.ptx", [i])), 0),
    }


if what == "list":
    print(json.dumps({name: "worst" if worst else "ordinary" for name, (_, worst) in cases().items()}))
    sys.exit()


class Stop(Exception):
    """The exception of an interrupted call."""


def stop(number, frame):
    """Ctrl-C, but for its name."""
    raise Stop


signal.signal(signal.SIGALRM, stop)
call = cases()[case][0]()
call()


def run(limit=None):
    """Bytes that the call took at its peak, and why it was refused, if it was."""
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
# Half of the run on average each.
cancels = int(min(max(2 * seconds / whole, fewest_cancels), most_cancels))
longest, heard = 0.0, 0
for k in range(cancels):
    delay = max((k + 0.5) / cancels * whole, 1e-5)
    began = time.perf_counter()
    try:
        signal.setitimer(signal.ITIMER_REAL, delay)
        call()
        signal.setitimer(signal.ITIMER_REAL, 0)
    except Stop:
        longest, heard = max(longest, time.perf_counter() - began - delay), heard + 1
print(
    json.dumps(
        {
            "estimate_mb": foreseen / 1e6,
            "peak_mb": peak / 1e6,
            "limit_kept": kept,
            "stop_ms": 1e3 * longest,
            "cancels": heard,
            "seconds": whole,
            "refusal": refused,
            "without_need": without_need,
        }
    )
)
