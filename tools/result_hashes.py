"""Hashes of the results of every operation, to see which of them a change changes.

Usage: result_hashes.py FILE             writes them as JSON, with the package that PYTHONPATH names
       result_hashes.py --compare A B    prints what differs; status 1 if anything does

Inputs are made by the virtual scanner and read from SURFRECON_DATA, where that is set, and from the seeds of the
fuzzers. A hash covers geometry and attributes, not reports, whose texts may change.
"""

import hashlib
import json
import os
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SEEDS = ROOT / "rust-core" / "fuzz" / "seeds"


def main():
    """Writes or compares."""
    if sys.argv[1:2] == ["--compare"]:
        before, after = (json.loads(Path(name).read_text()) for name in sys.argv[2:4])
        differing = [name for name in sorted({*before, *after}) if before.get(name) != after.get(name)]
        for name in differing:
            print(f"{name}: {before.get(name)} -> {after.get(name)}")
        print(f"{len(differing)} of {len({*before, *after})} differ")
        return int(bool(differing))
    found = {}
    for name, call in operations():
        started = time.monotonic()
        try:
            found[name] = hash_of(call())
        except (ValueError, OSError, MemoryError) as error:
            found[name] = f"{type(error).__name__}: {error}".replace(str(os.environ.get("SURFRECON_DATA")), "DATA")
        print(f"{time.monotonic() - started:6.1f} s  {name}", flush=True)
    Path(sys.argv[1]).write_text(json.dumps(found, indent=1) + "\n")
    return 0


def hash_of(result):
    """One hash of arrays, meshes, clouds, images and lists of them."""
    digest = hashlib.sha256()
    put(digest, result)
    return digest.hexdigest()[:16]


def put(digest, value):
    """Adds a value to a hash, by its kind."""
    import numpy as np
    import surfrecon as s

    if value is None or isinstance(value, (str, int, float, bool)):
        digest.update(repr(value).encode())
    elif isinstance(value, bytes):
        digest.update(value)
    elif isinstance(value, np.ndarray):
        digest.update(f"{value.dtype}{value.shape}".encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, s.Mesh):
        put(digest, [value.positions, value.triangles, dict(value.vertex_attributes), dict(value.face_attributes)])
    elif isinstance(value, s.PointCloud):
        put(digest, [value.positions, value.normals, value.colour, value.intensity, value.sensor, value.crs])
    elif isinstance(value, s.RangeImage):
        put(
            digest,
            [value.points, value.valid, value.world_from_sensor, value.colour, value.intensity, value.confidence],
        )
    elif isinstance(value, dict):
        for key in sorted(value):
            put(digest, key)
            put(digest, value[key])
    else:
        for one in value:
            put(digest, one)


def shape():
    """The built-in sculpture, and scans of it."""
    import surfrecon as s

    mesh = s.sculpture(cell=6)
    return mesh, s.turntable(mesh, pixels=140)


def clouds():
    """Points: clean, noisy, with normals' worth of noise, a lattice, a sheet."""
    import numpy as np

    rng = np.random.default_rng(3)
    sphere = rng.normal(size=(3000, 3))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    a, b = rng.uniform(0, 2 * np.pi, (2, 4000))
    ring = 1 + 0.4 * np.cos(b)
    torus = np.stack([ring * np.cos(a), ring * np.sin(a), 0.4 * np.sin(b)], 1)
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    sheet = np.stack([x, y, np.sin(x / 5) * 2], -1).reshape(-1, 3)
    cube = np.stack(np.meshgrid(*[np.arange(12.0)] * 3), -1).reshape(-1, 3)
    shell = cube[((cube == 0) | (cube == 11)).any(1)]
    return {
        "sphere": sphere,
        "torus": torus,
        "noisy torus": torus + rng.normal(0, 0.02, torus.shape),
        "sheet": sheet,
        "cube": shell,
        "hemisphere": sphere[sphere[:, 2] > 0],
    }


def operations():
    """Yields names with calls."""
    import surfrecon as s

    mesh, cameras = shape()
    for name, options in {"clean": {}, "noisy": {"noise": 0.5, "seed": 1}, "fine": {"pixels": 0}}.items():
        cameras_here = s.turntable(mesh, pixels=260) if options.pop("pixels", None) is not None else cameras
        scans = s.virtual_scan(mesh, cameras_here, **options)
        yield f"virtual_scan {name}", lambda scans=scans: scans
        yield from of_scans(name, scans)
    for name, points in clouds().items():
        yield from of_points(name, points)
    yield from of_meshes("sculpture", mesh)
    yield "align", lambda: aligned(s.virtual_scan(mesh, cameras))
    for file in sorted(SEEDS.glob("import_*/*")):
        yield f"read {file.parent.name}/{file.name}", lambda file=file: [one.read() for one in s.open(file)]
    data = os.environ.get("SURFRECON_DATA")
    if data:
        yield from of_data(Path(data))


def aligned(scans):
    """The poses that scans without poses get."""
    import numpy as np
    import surfrecon as s

    for k, scan in enumerate(scans):
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(k), -np.sin(k)], [np.sin(k), np.cos(k)]]
        turn[:3, 3] = [k, -k, 2 * k]
        scan.world_from_sensor = turn
    return s.align(scans).world_from_scan


def merged_in_files(scans, **options):
    """The bytes of a merge that works in files."""
    import surfrecon as s

    with tempfile.TemporaryDirectory() as folder:
        for k, scan in enumerate(scans):
            scan.name = f"scan{k}"
        s.write_scans(f"{folder}/scans.conf", scans)
        s.merge_to_file(s.open(f"{folder}/scans.conf"), f"{folder}/out.ply", **options)
        return Path(folder, "out.ply").read_bytes()


def of_scans(name, scans):
    """Operations on scans."""
    import surfrecon as s

    def incremental():
        merger = s.Merger()
        for scan in scans:
            merger.add(scan)
        return merger.merge(voxel=3).mesh

    yield f"triangulate {name}", lambda: [scan.triangulate() for scan in scans]
    yield f"merge {name}", lambda: s.merge(scans).mesh
    yield f"merge {name}, voxel", lambda: s.merge(scans, voxel=3).mesh
    yield f"merger {name}", incremental
    yield f"merge in files {name}", lambda: merged_in_files(scans, voxel=3, max_memory=200 << 20)
    yield f"sculpt {name}", lambda: [s.sculpt(scan, relative_tolerance=0.002).mesh for scan in scans[:4]]
    yield f"sculpt {name}, fine", lambda: s.sculpt(scans[0], relative_tolerance=0.0002).mesh
    yield f"quads {name}", lambda: [quads(scan) for scan in scans[:3]]


def quads(scan):
    """A grid of quads, and the surface through it."""
    import surfrecon as s

    grid = s.adaptive_quads(scan, rows=12, columns=12)
    return [grid.positions, grid.quads]


def of_points(name, points):
    """Operations on points."""
    import surfrecon as s

    for closure in ("auto", "closed", "open"):
        yield f"reconstruct {name}, {closure}", lambda closure=closure: s.reconstruct(points, closure=closure).mesh
    yield f"cluster points {name}", lambda: s.cluster(points, vertices=200).mesh


def of_meshes(name, mesh):
    """Operations on meshes."""
    import surfrecon as s

    yield f"cluster {name}", lambda: s.cluster(mesh, vertices=1500).mesh
    yield f"cluster {name}, min_angle", lambda: s.cluster(mesh, vertices=1500, min_angle=0.5).mesh
    yield f"cluster_levels {name}", lambda: [level.mesh for level in s.cluster_levels(mesh, [2000, 500])]
    yield f"dominant_plane {name}", lambda: repr(s.dominant_plane([mesh]))
    yield f"distances {name}", lambda: s.distances(mesh.positions[::7] * 1.01, mesh)


def of_data(data):
    """Operations on real scans."""
    import surfrecon as s

    bunny = data / "stanford_bunny" / "bun.conf"
    scans = s.open(bunny)
    yield "merge bunny", lambda: s.merge(scans).mesh
    yield "merge bunny, 1 mm", lambda: s.merge(scans, voxel=0.001).mesh
    yield "triangulate bunny", lambda: [scan.read().triangulate() for scan in scans]
    yield "sculpt bunny", lambda: s.sculpt(scans[0].read(), relative_tolerance=0.001).mesh
    yield "quads bunny", lambda: quads(scans[0].read())
    yield "align bunny", lambda: s.align(scans).world_from_scan
    for name in ("stanford_dragon_stand", "stanford_happy_stand"):
        for conf in sorted((data / name).glob("*.conf"))[:1]:
            yield f"merge {name}", lambda conf=conf: s.merge(s.open(conf), voxel=0.001).mesh
    for folder in sorted((data / "frames").iterdir()) + [data / "rgbd_7scenes", data / "rgbd_open3d"]:
        yield f"frames {folder.name}", lambda folder=folder: frames(folder)
    for folder in ("ptx", "e57", "organized_pcd", "points", "meshlab_rangemaps", "scans_unregistered", "meshes", "dem"):
        for file in sorted((data / folder).rglob("*")):
            if file.is_file() and file.stat().st_size < 30e6:
                yield f"read {file.relative_to(data)}", lambda file=file: [one.read() for one in s.open(file)]


def frames(folder):
    """Three frames of a recording, and a merge of them."""
    import surfrecon as s

    found = [scan for scan in s.open(folder)][:3]
    return [[scan.read() for scan in found], s.merge(found).mesh]


if __name__ == "__main__":
    sys.exit(main())
