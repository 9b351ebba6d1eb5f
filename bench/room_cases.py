"""Recordings of rooms as all tools read them: depth images of 16 bits, what is known of the camera, and poses.

A case's sets are folders `set000` with, for each recording,

| file | what |
|---|---|
| `frame_0000.png` | planar depth, 0 where nothing was measured |
| `camera.json` | focal lengths and centre in pixels, depth in a metre, how frames are given (`way`) |
| `truth.npy` | world from camera (x right, y down, z forward); no tool reads it |
| `rough.npy` | poses that tools may begin with: the truth, or off by a drift or each by its own error |

Ways: `sequence` (in order, no poses), `heap` (in any order, no poses), `rough` (poses off by a drift of some cm),
`jitter` (each pose off by an error of its own) and `exact` (the true poses); the last three are said to be rough.
"""

import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import noise_room
import numpy as np
import room_scenes
from align_cases import EXACT, OTHER, turned
from noise_scans import Camera

# A wide time-of-flight camera, 69 degrees high, and the Kinect's image in a quarter of its size.
WIDE = Camera(120, 160, 87.0)
KINECT = Camera(120, 160, 145.0)
# The same in less: of many heaps, and of the smallest cases; and in the size that cameras have.
SMALL = {"white": Camera(60, 80, 43.5), "Kinect": noise_room.SMALL}
LARGE = {"white": Camera(480, 640, 348.0), "Kinect": noise_room.KINECT}
# Deviation of white noise along the axis, in metres.
WHITE = 4e-3
# Drift of rough poses from one frame to the next: metres and degrees.
DRIFT, DRIFT_TURN = 3e-3, 0.1
# Error of each rough pose by itself, along and about each axis: metres and degrees.
JITTER, JITTER_TURN = 3e-2, 0.7
# Ways with poses.
POSED = ("rough", "jitter", "exact")
# Heaps of the summary; their frames.
HEAPS, HEAPS_USUAL, FEWEST, MOST = 200, 8, 12, 20


@dataclass
class Recording:
    """Frames of one room, made when they are written."""

    kind: str
    seed: int
    count: int
    noise: str = "white"
    camera: Camera = None
    begin: float = 0.0

    def frames(self):
        """The poses, and the depth images one after the other in whole millimetres."""
        room = room_scenes.ROOMS[self.kind](self.seed)
        poses = room.poses(self.count, self.begin)
        return poses, self.measured(room, poses)

    def measured(self, room, poses):
        """The images that the camera measures from each pose."""
        for k, depth in enumerate(room_scenes.depths(room, poses, self.seen_by)):
            generator = np.random.default_rng([self.seed, k, 5])
            if self.noise == "Kinect":
                yield noise_room.measured_depth(depth, generator)
            else:
                noisy = depth + WHITE * generator.standard_normal(depth.shape)
                yield np.where(depth > 0, np.round(1e3 * noisy), 0).astype(np.uint16)

    @property
    def seen_by(self):
        """The camera: a Kinect's noise has its field of view."""
        return self.camera or (KINECT if self.noise == "Kinect" else WIDE)

    @property
    def intrinsics(self):
        """Focal lengths and centre, and depth in a metre."""
        camera = self.seen_by
        return {"focal": [camera.focal] * 2, "centre": list(camera.centre), "per_metre": 1000.0}

    @property
    def name(self):
        """Its name where one of many is meant."""
        return f"{self.kind} {self.seed}, {self.count} frames, {self.noise}"


@dataclass
class Real:
    """Frames of a real recording, whose poses are another program's."""

    poses: np.ndarray
    files: list
    intrinsics: dict
    name: str = ""

    def frames(self):
        """The poses, and the images as they are, without the value that says that nothing was measured."""
        import open3d

        images = (open3d.t.io.read_image(str(file)).as_tensor().numpy()[..., 0] for file in self.files)
        return self.poses, (np.where(image == 65535, 0, image) for image in images)


@dataclass
class Case:
    """Recordings that are aligned in one way, each on its own."""

    name: str
    way: str
    recordings: list = field(repr=False)
    refusal: bool = False  # whether nothing may be placed
    truth: str = EXACT

    @property
    def count(self):
        """How many frames there are."""
        return sum(len(r.files) if isinstance(r, Real) else r.count for r in self.recordings)


def write(case, folder):
    """Each recording as a folder."""
    for number, recording in enumerate(case.recordings):
        place = Path(folder) / f"set{number:03}"
        place.mkdir(parents=True)
        write_one(case.way, recording, place, np.random.default_rng([17, number]))


def write_one(way, recording, place, generator):
    """Frames in the order in which they are handed over, and what is known of them."""
    import open3d

    poses, images = recording.frames()
    order = generator.permutation(len(poses)) if way == "heap" else np.arange(len(poses))
    at = np.argsort(order)
    for k, image in enumerate(images):
        file = str(place / f"frame_{at[k]:04}.png")
        open3d.t.io.write_image(file, open3d.t.geometry.Image(np.ascontiguousarray(image[..., None])))
    (place / "camera.json").write_text(json.dumps({**recording.intrinsics, "way": way}))
    np.save(place / "truth.npy", poses[order])
    if way in POSED:
        make = {"rough": drifted, "jitter": jittered, "exact": lambda poses, _: poses}[way]
        np.save(place / "rough.npy", make(poses, generator))


def shaken(generator, pose, shift, degrees):
    """A small motion, turned about where a camera is."""
    step = np.eye(4)
    step[:3, :3] = turned(generator.normal(size=3), np.radians(degrees) * generator.normal())
    eye = pose[:3, 3]
    step[:3, 3] = shift * generator.normal(size=3) + eye - step[:3, :3] @ eye
    return step


def drifted(poses, generator):
    """Poses that are off by a motion that grows from one to the next."""
    motion, found = np.eye(4), []
    for k, pose in enumerate(poses):
        if k:
            motion = shaken(generator, motion @ pose, DRIFT, DRIFT_TURN) @ motion
        found.append(motion @ pose)
    return np.array(found)


def jittered(poses, generator):
    """Poses that are off each by an error of its own, but for the first."""
    others = [shaken(generator, pose, JITTER, JITTER_TURN) @ pose for pose in poses[1:]]
    return np.array([poses[0], *others])


def single(kind, seed, count, way, noise="white", camera=None):
    """A case of one virtual recording."""
    large = "" if camera is None else f" at {camera.cols} x {camera.rows}"
    name = f"room {kind} {seed}, {count} frames{large}, {way}, {noise}"
    return Case(name, way, [Recording(kind, seed, count, noise, camera)], kind == "empty" and way == "heap")


def heaps(count, fewest=FEWEST, most=MOST):
    """Many heaps of few small frames, of all rooms but the empty one; half of them with a Kinect's noise."""
    kinds = [kind for kind in room_scenes.ROOMS if kind != "empty"]
    made = []
    for k in range(count):
        generator = np.random.default_rng([23, k])
        frames, begin = int(generator.integers(fewest, most + 1)), float(generator.random())
        # Boxes and L have things by their seed; every other heap is one of them.
        kind = ("box", "L")[k // 4 % 2] if k % 2 == 0 else kinds[k // 2 % len(kinds)]
        noise = ("white", "Kinect")[k // 2 % 2]
        made.append(Recording(kind, k, frames, noise, SMALL[noise], begin))
    return Case(f"room heaps, {count} of {fewest} to {most} frames", "heap", made)


# Kind, seed, frames, way, noise, camera.
VIRTUAL = [("box", 1, count, "sequence", "white") for count in (12, 20, 40, 100, 300)]
VIRTUAL += [("box", 2, count, "sequence", "Kinect") for count in (20, 40, 100, 300)]
VIRTUAL += [("box", 1, count, "heap", "white") for count in (12, 20, 40, 100)]
VIRTUAL += [("box", 2, count, "heap", "Kinect") for count in (12, 20, 40)]
VIRTUAL += [("box", 1, count, way, "white") for way in ("rough", "exact") for count in (40, 100)]
VIRTUAL += [("box", 2, 40, way, "Kinect") for way in ("rough", "exact")]
VIRTUAL += [("box", seed, 40, "jitter", noise) for seed, noise in ((1, "white"), (2, "Kinect"))]
VIRTUAL += [("box", 1, *of, "white", LARGE["white"]) for of in ((300, "sequence"), (20, "heap"), (40, "rough"))]
VIRTUAL += [("box", 2, 300, "sequence", "Kinect", LARGE["Kinect"])]
VIRTUAL += [
    (kind, 1, count, way, "white")
    for kind in room_scenes.ROOMS
    if kind != "box"
    for count, way in ((20, "heap"), (40, "sequence"), (100, "sequence"), (40, "rough"), (40, "exact"))
]
VIRTUAL += [(kind, 2, 100, "sequence", "Kinect") for kind in room_scenes.ROOMS if kind != "box"]


def seven_scenes(data):
    """Fifty frames of 7-Scenes; its poses' rotations have seven digits."""
    folder = data / "rgbd_7scenes"
    files = sorted(folder.glob("*.depth.png"))
    poses = np.array([np.loadtxt(str(file).replace(".depth.png", ".pose.txt")) for file in files])
    for pose in poses:
        u, _, v = np.linalg.svd(pose[:3, :3])
        pose[:3, :3] = u @ v
    return Real(poses, files, {"focal": [585.0, 585.0], "centre": [320.0, 240.0], "per_metre": 1000.0})


def tum_desk(data):
    """Nine frames of TUM's desk, beside a motion capture: the pose whose time is nearest."""
    folder = data / "frames" / "tum_fr1_desk"
    files, poses = sorted((folder / "depth").glob("*.png")), []
    given = np.loadtxt(folder / "groundtruth.txt")
    for file in files:
        row = given[np.argmin(abs(given[:, 0] - float(file.stem)))]
        x, y, z, w = row[4:] / np.linalg.norm(row[4:])
        pose = np.eye(4)
        pose[:3, :3] = turned(np.array([x, y, z]), 2 * np.arctan2(np.linalg.norm([x, y, z]), w))
        pose[:3, 3] = row[1:4]
        poses.append(pose)
    return Real(np.array(poses), files, {"focal": [517.3, 516.5], "centre": [318.6, 255.3], "per_metre": 5000.0})


def living_room(data):
    """Five frames of Open3D's living room, beside its trajectory."""
    folder = data / "rgbd_open3d"
    files = sorted((folder / "depth").glob("*.png"))
    lines = (folder / "trajectory.log").read_text().splitlines()
    poses = [np.array([line.split() for line in lines[5 * k + 1 : 5 * k + 5]], float) for k in range(len(files))]
    for pose in poses:
        u, _, v = np.linalg.svd(pose[:3, :3])
        pose[:3, :3] = u @ v
    return Real(np.array(poses), files, {"focal": [525.0] * 2, "centre": [319.5, 239.5], "per_metre": 1000.0})


# Name, folder, how it is read, every how many frames a heap takes.
REAL = [
    ("7-Scenes", "rgbd_7scenes", seven_scenes, 4),
    ("TUM desk", "frames/tum_fr1_desk", tum_desk, 1),
    ("living room", "rgbd_open3d", living_room, 1),
]


def real(wanted, record):
    """Real recordings, whose poses are thrown away."""
    data = os.environ.get("SURFRECON_DATA")
    for title, folder, read, every in REAL:
        if not data or not (Path(data) / folder).is_dir():
            if wanted.takes(title):
                record.skip(f"{title}: {folder} is not in SURFRECON_DATA")
            continue
        whole = read(Path(data))
        for way in ("sequence", "heap", "exact"):
            some = slice(None, None, every if way == "heap" else 1)
            part = Real(whole.poses[some], whole.files[some], whole.intrinsics)
            name = f"{title}, {len(part.files)} frames, {way}"
            if wanted.takes(name):
                yield Case(name, way, [part], truth=OTHER)


def cases(wanted, record):
    """The cases that are wanted."""
    if wanted.smallest:
        for count, way in ((8, "sequence"), (5, "rough")):
            yield single("box", 2, count, way, camera=SMALL["white"])
        yield heaps(2, 4, 5)
        yield single("empty", 1, 5, "heap", camera=SMALL["white"])
        return
    yield from real(wanted, record)
    made = [single(*row) for row in VIRTUAL]
    made += [heaps(HEAPS_USUAL), heaps(HEAPS)]
    yield from (case for case in made if wanted.takes(case.name))
