"""Sets of scans without poses: real ones, virtual ones whose truth is known, and what no search can place."""

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

PIXELS = 200


@dataclass
class Case:
    """Sets of scans, each to be brought to one frame."""

    name: str
    sets: list  # of lists of range images that lie where they belong
    mm: float = 1.0  # millimetres in the scans' unit
    overlap: float | None = None
    noise: float = 0.0  # standard deviation in distances of samples
    refusal: bool = False
    known: bool = True  # whether the poses are the truth, or another program's
    tools: list = field(default_factory=list)


def rigid(generator, size):
    """A turn about any axis and a shift by about `size`."""
    turn, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3] = turn * np.sign(np.linalg.det(turn))
    pose[:3, 3] = generator.normal(size=3) * size
    return pose


def write(case, folder):
    """Each set as a folder `set000` with `scans.conf`, whose poses are anything, and `truth.npy`."""
    import surfrecon

    generator = np.random.default_rng(11)
    for number, scans in enumerate(case.sets):
        place = Path(folder) / f"set{number:03}"
        place.mkdir(parents=True)
        truth = [scan.world_from_sensor for scan in scans]
        size = max(np.ptp(scan.points[scan.valid], axis=0).max() for scan in scans)
        for k, scan in enumerate(scans):
            scan.name = f"scan{k:03}"
            scan.world_from_sensor = rigid(generator, size)
        surfrecon.write_scans(place / "scans.conf", scans)
        # Files have a frame of their own.
        written = surfrecon.open(place / "scans.conf")
        sensor_from_file = [
            np.linalg.inv(scan.world_from_sensor) @ file.world_from_sensor
            for scan, file in zip(scans, written, strict=True)
        ]
        np.save(place / "truth.npy", np.stack([t @ f for t, f in zip(truth, sensor_from_file, strict=True)]))


def look(mesh, directions, noise=0.0, pixels=PIXELS, seed=0):
    """What pinhole cameras see of a mesh from these directions, each rolled by some angle."""
    import surfrecon

    low, high = mesh.bounds
    size, middle = np.linalg.norm(high - low), (low + high) / 2
    generator = np.random.default_rng(seed)
    cameras = []
    for direction in directions:
        up = np.cross(direction, generator.normal(size=3))
        eye = middle + 2.5 * size * direction
        cameras.append(
            surfrecon.Camera.pinhole(pixels, pixels, height_angle=2 * np.arctan(0.2), eye=eye, target=middle, up=up)
        )
    return surfrecon.virtual_scan(mesh, cameras, noise=noise * size / pixels, seed=seed)


def directions(generator, count):
    """Unit vectors, even over the sphere."""
    all_of = generator.normal(size=(count, 3))
    return all_of / np.linalg.norm(all_of, axis=1, keepdims=True)


def shared(scans):
    """Share of the smaller of two scans whose samples lie on the other, where both lie where they belong."""
    points = [scan.world_points()[scan.valid] for scan in scans]
    spacing = np.median(cKDTree(points[0]).query(points[0], k=2)[0][:, 1])
    near = [np.mean(cKDTree(points[1 - k]).query(points[k])[0] < 1.5 * spacing) for k in range(2)]
    return max(near)


def pairs(mesh, overlap, count, noise):
    """Pairs of views that share so much of the smaller, within a sixth of it."""
    generator = np.random.default_rng(int(1000 * overlap))
    found = []
    for attempt in range(40 * count):
        if len(found) == count:
            break
        two = directions(generator, 2)
        scans = look(mesh, two, noise, seed=attempt)
        if all(scan.valid.sum() > 1000 for scan in scans) and abs(shared(scans) - overlap) < overlap / 6:
            found.append(scans)
    return found


def ring(mesh, count, noise=0.0, heights=(0.2, 0.9)):
    """Views all around."""
    turns = 2 * np.pi * np.arange(count) / count
    raised = np.resize(heights, count)
    around = np.stack([np.cos(turns), np.sin(turns), raised], axis=1)
    return look(mesh, around / np.linalg.norm(around, axis=1, keepdims=True), noise)


def revolved(radius, height, detail=160):
    """A closed surface of revolution about z: `radius` of the height and the azimuth."""
    import surfrecon

    rows = detail
    z, turn = np.meshgrid(np.linspace(-height, height, rows), 2 * np.pi * np.arange(detail) / detail, indexing="ij")
    r = radius(z / height, turn)
    side = np.stack([r * np.cos(turn), r * np.sin(turn), z], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(detail), indexing="ij")
    a, b = (i * detail + j).ravel(), (i * detail + (j + 1) % detail).ravel()
    c, d = a + detail, b + detail
    ends = np.array([[0, 0, -height], [0, 0, height]])
    first, last, n = np.arange(detail), (rows - 1) * detail + np.arange(detail), len(side)
    caps = [
        np.stack([np.full(detail, n), np.roll(first, -1), first], 1),
        np.stack([np.full(detail, n + 1), last, np.roll(last, -1)], 1),
    ]
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1), *caps])
    return surfrecon.Mesh(np.concatenate([side, ends]), faces.astype(np.uint32))


def relief(height, size=1.0, detail=240):
    """A sheet z = height(x, y) that faces +z."""
    import surfrecon

    x, y = np.meshgrid(np.linspace(-size, size, detail), np.linspace(-size, size, detail))
    positions = np.stack([x, y, height(x, y)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(detail - 1), np.arange(detail - 1), indexing="ij")
    a = (i * detail + j).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + detail + 1], 1), np.stack([a, a + detail + 1, a + detail], 1)])
    return surfrecon.Mesh(positions, faces.astype(np.uint32))


def refusals():
    """What may turn, slide, or lie in several places."""
    side = [(1, 0.2, 0.4), (0.6, 0.8, 0.5), (0.9, 0.5, 0.2)]
    above = [(0.2, 0.1, 1), (-0.2, 0.3, 1), (0.1, -0.3, 1)]

    def seen(mesh, towards):
        towards = np.array(towards, float)
        return [look(mesh, towards / np.linalg.norm(towards, axis=1, keepdims=True))]

    yield "ball", seen(revolved(lambda z, t: np.sqrt(np.maximum(1 - z**2, 0)) + 0 * t, 1.0), side)
    yield "cylinder", seen(revolved(lambda z, t: 0.6 + 0 * z + 0 * t, 1.0), side)
    yield "vase", seen(revolved(lambda z, t: 0.5 + 0.2 * np.sin(3 * z) + 0 * t, 1.0), side)
    yield "fluted column", seen(revolved(lambda z, t: 0.6 + 0.04 * np.cos(16 * t) + 0 * z, 1.0, 320), side)
    yield "coin", seen(revolved(lambda z, t: 1.0 + 0 * z + 0 * t, 0.06), [(0.2, 0.1, 1), (0.1, 0.3, -1)])
    yield "plane", seen(relief(lambda x, y: 0 * x), above)
    yield "repeated relief", seen(relief(lambda x, y: 0.04 * np.sin(14 * x) * np.sin(14 * y)), above)


def cases(wanted, record):
    """The cases that are wanted."""
    import surfrecon

    if wanted.smallest:
        mesh = surfrecon.sculpture(cell=3.0)
        yield Case("sculpture, 4 around", [ring(mesh, 6)[:4]])
        return
    data = os.environ.get("SURFRECON_DATA")
    for name, file in (
        ("bunny", "stanford_bunny/bun.conf"),
        ("dragon", "stanford_dragon_stand/dragonStandRight.conf"),
        ("happy", "stanford_happy_stand/happyStandRight.conf"),
    ):
        if not wanted.takes(name):
            continue
        if data and (Path(data) / file).is_file():
            yield Case(name, [[scan.read() for scan in surfrecon.open(Path(data) / file)]], mm=1e3, known=False)
        else:
            record.skip(f"{name}: {file} is not in SURFRECON_DATA")
    mesh = surfrecon.sculpture(cell=1.5)
    for noise in (0.0, 0.5, 1.0):
        for overlap in (0.5, 0.3, 0.2, 0.1):
            name = f"pairs, {100 * overlap:.0f} %, noise {noise:g}"
            if wanted.takes(name):
                yield Case(name, pairs(mesh, overlap, 12, noise), overlap=100 * overlap, noise=noise)
    for count, noise in ((15, 0.0), (15, 0.5), (30, 0.0), (200, 0.0)):
        name = f"ring of {count}, noise {noise:g}"
        if wanted.takes(name):
            yield Case(name, [ring(mesh, count, noise)], noise=noise)
    for name, sets in refusals():
        if wanted.takes(name):
            yield Case(name, sets, refusal=True)
