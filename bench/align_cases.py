"""Sets of scans without poses: real ones, virtual ones whose truth is known, and what no search can place."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import align_real
import align_refusals
import numpy as np
from align_shapes import Cloud, bent, look, shares
from ply import write_ply

EXACT, OTHER = "exact", "other"
# How far rough poses are off: a share of the scan's size, and degrees.
SHIFT, TURN = 0.02, 3.0
OVERLAPS, WARPED, NOISES = (50, 30, 20, 10, 5), (50, 30), (0.0, 0.5, 1.0)
STANFORD = [
    ("bunny", "stanford_bunny/bun.conf"),
    ("dragon", "stanford_dragon_stand/dragonStandRight.conf"),
    ("happy", "stanford_happy_stand/happyStandRight.conf"),
]


@dataclass
class Case:
    """Sets of scans, each to be brought to one frame."""

    name: str
    sets: list  # of lists of range images or clouds that lie where they belong
    mm: float = 1.0  # millimetres in the scans' unit
    overlap: float | None = None  # of the smaller scan, in per cent
    noise: float = 0.0  # standard deviation in distances of samples
    refusal: bool = False  # whether scans must be left out
    truth: str | None = EXACT  # the scans' poses: EXACT, another program's, or None if there are none
    slack: float = 0.0  # how far such poses are off themselves, in distances of samples
    objects: list | None = None  # which body each scan shows

    @property
    def count(self):
        """How many scans there are in all sets."""
        return sum(map(len, self.sets))

    @property
    def ranges(self):
        """Whether the scans are range images."""
        return not isinstance(self.sets[0][0], Cloud)


def turned(axis, angle):
    """The matrix of a turn."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def rigid(generator, size):
    """A turn about any axis and a shift by about `size`."""
    turn, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3] = turn * np.sign(np.linalg.det(turn))
    pose[:3, 3] = generator.normal(size=3) * size
    return pose


def displaced(generator, pose, points):
    """The pose, off by SHIFT and TURN about the middle of the scan's points."""
    low, high = points.min(0), points.max(0)
    middle = pose[:3, :3] @ ((low + high) / 2) + pose[:3, 3]
    shift = generator.normal(size=3)
    motion = np.eye(4)
    motion[:3, :3] = turned(generator.normal(size=3), np.radians(TURN))
    motion[:3, 3] = middle - motion[:3, :3] @ middle
    motion[:3, 3] += shift / np.linalg.norm(shift) * SHIFT * np.linalg.norm(high - low)
    return motion @ pose


def write(case, folder):
    """Each set as a folder `set000` with scans in frames of their own; where these belong: `truth.npy`, `rough.npy`.

    Range images are `scans.conf` and its grids, clouds are `scan000.ply`.
    """
    generator = np.random.default_rng(11)
    for number, scans in enumerate(case.sets):
        place = Path(folder) / f"set{number:03}"
        place.mkdir(parents=True)
        truth, points = write_ranges(place, scans) if case.ranges else write_clouds(place, scans, generator)
        if case.truth:
            np.save(place / "truth.npy", truth)
            np.save(place / "rough.npy", [displaced(generator, t, p) for t, p in zip(truth, points, strict=True)])


def write_ranges(place, scans):
    """Range images and a list without poses. Gives the poses of the files' frames, and points there."""
    import surfrecon

    truth = [scan.world_from_sensor for scan in scans]
    for k, scan in enumerate(scans):
        scan.name = f"scan{k:03}"
        # Readers tell by overlap in which sense poses are meant, which any other would leave to chance.
        scan.world_from_sensor = np.eye(4)
    surfrecon.write_scans(place / "scans.conf", scans)
    # Files have a frame of their own.
    written = [scan.read() for scan in surfrecon.open(place / "scans.conf")]
    poses = [pose @ file.world_from_sensor for pose, file in zip(truth, written, strict=True)]
    return np.stack(poses), [file.points[file.valid] for file in written]


def write_clouds(place, clouds, generator):
    """Clouds or meshes with normals, moved anyhow. Gives the poses of the files' frames, and points there."""
    poses, points = [], []
    for k, cloud in enumerate(clouds):
        # Single precision has no room for a large shift.
        file_from_cloud = rigid(generator, 0.1 * np.ptp(cloud.points, axis=0).max())
        there = cloud.points @ file_from_cloud[:3, :3].T + file_from_cloud[:3, 3]
        write_ply(place / f"scan{k:03}.ply", there, cloud.triangles, cloud.normals @ file_from_cloud[:3, :3].T)
        poses.append(cloud.pose @ np.linalg.inv(file_from_cloud))
        points.append(there)
    return np.stack(poses), points


def directions(generator, count):
    """Unit vectors, even over the sphere."""
    all_of = generator.normal(size=(count, 3))
    return all_of / np.linalg.norm(all_of, axis=1, keepdims=True)


class Views:
    """Views of a mesh from all sides, and how much each two share."""

    def __init__(self, mesh, count=80):
        generator = np.random.default_rng(3)
        self.mesh, self.directions, self.rolls = mesh, directions(generator, count), directions(generator, count)
        self.shares = shares(self.views(range(count)))

    def views(self, numbers, noise=0.0):
        """Images from some of the directions."""
        some = list(numbers)
        return look(self.mesh, self.directions[some], noise, seed=7, rolls=self.rolls[some])

    def pairs(self, overlap, noise=0.0, count=12):
        """Pairs that share so much of the smaller, within a sixth of it; the same ones with any noise."""
        near = np.argwhere(np.triu(np.abs(self.shares - overlap) < overlap / 6, 1))
        np.random.default_rng(int(1000 * overlap)).shuffle(near)
        chosen = []
        for pair in near.tolist():
            if len(chosen) < count and not any(set(pair) & set(other) for other in chosen):
                chosen.append(pair)
        found = self.views(np.ravel(chosen), noise)
        return [found[k : k + 2] for k in range(0, len(found), 2)]


def ring(mesh, count, noise=0.0, heights=(0.2, 0.9)):
    """Views all around."""
    turns = 2 * np.pi * np.arange(count) / count
    raised = np.resize(heights, count)
    around = np.stack([np.cos(turns), np.sin(turns), raised], axis=1)
    return look(mesh, around / np.linalg.norm(around, axis=1, keepdims=True), noise)


def stanford(wanted, record):
    """The archive's scans, beside its poses."""
    import surfrecon

    data = os.environ.get("SURFRECON_DATA")
    for name, file in STANFORD:
        if not wanted.takes(name):
            continue
        if data and (Path(data) / file).is_file():
            yield Case(name, [[scan.read() for scan in surfrecon.open(Path(data) / file)]], mm=1e3, truth=OTHER)
        else:
            record.skip(f"{name}: {file} is not in SURFRECON_DATA")


def paired(wanted, mesh):
    """Pairs by their overlap, with noise or warp."""
    kinds = [f"pairs, {overlap} %, noise {noise:g}" for overlap in OVERLAPS for noise in NOISES]
    if not any(map(wanted.takes, kinds + [f"pairs, {overlap} %, warp 1" for overlap in WARPED])):
        return
    views = Views(mesh)
    for noise in NOISES:
        for overlap in OVERLAPS:
            name = f"pairs, {overlap} %, noise {noise:g}"
            if wanted.takes(name):
                yield Case(name, views.pairs(overlap / 100, noise), overlap=overlap, noise=noise)
    for overlap in WARPED:
        name = f"pairs, {overlap} %, warp 1"
        if wanted.takes(name):
            sets = [[first, bent(second)] for first, second in views.pairs(overlap / 100)]
            yield Case(name, sets, overlap=overlap)


def rings(wanted, mesh):
    """Views all around, with noise or warp."""
    if wanted.takes("ring of 15, warp 1"):
        scans = ring(mesh, 15)
        yield Case("ring of 15, warp 1", [[bent(s) if k % 2 else s for k, s in enumerate(scans)]])
    for count, noise in ((15, 0.0), (15, 0.5), (30, 0.0), (200, 0.0)):
        name = f"ring of {count}, noise {noise:g}"
        if wanted.takes(name):
            yield Case(name, [ring(mesh, count, noise)], noise=noise)


def refusals(wanted, mesh):
    """Scans that may turn, slide or lie in several places, or that belong to something else."""
    for name, scans in align_refusals.shapes():
        if wanted.takes(name):
            yield Case(name, [scans], refusal=True, truth=None)
    whole = Case("background that stays", [], refusal=True)
    if wanted.takes(whole.name):
        yield replace(whole, sets=[align_refusals.before_a_corner()])
    other = align_refusals.lump(100.0)
    for name, ours, others in (("two objects", 3, 3), ("one of another object", 5, 1)):
        if wanted.takes(name):
            sets = [ring(mesh, 6)[:ours] + ring(other, 6)[:others]]
            yield replace(whole, name=name, sets=sets, objects=[0] * ours + [1] * others)


def real(wanted, record):
    """Scans that nobody has placed, or only roughly."""
    for name, read, mm, truth, slack in align_real.SETS:
        if not wanted.takes(name):
            continue
        folder = Path(os.environ.get("SURFRECON_DATA", "")) / "scans_unregistered"
        if os.environ.get("SURFRECON_DATA") and folder.is_dir():
            yield Case(name, [read(folder)], mm=mm, truth=OTHER if truth else None, slack=slack)
        else:
            record.skip(f"{name}: scans_unregistered is not in SURFRECON_DATA")


def cases(wanted, record):
    """The cases that are wanted."""
    import surfrecon

    if wanted.smallest:
        mesh = surfrecon.sculpture(cell=3.0)
        yield Case("sculpture, 4 around", [ring(mesh, 6)[:4]])
        return
    yield from stanford(wanted, record)
    mesh = surfrecon.sculpture(cell=1.5)
    yield from refusals(wanted, mesh)
    yield from rings(wanted, mesh)
    yield from real(wanted, record)
    yield from paired(wanted, mesh)
