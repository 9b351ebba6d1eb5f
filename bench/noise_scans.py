"""Depth images with known truth and known errors, and the files that the tools read.

A case's folder holds, in formats that each tool reads fastest:

| file | what | read by |
|---|---|---|
| `frame_0000.npy` or `.png` | planar depth, float32 or whole mm in 16 bits, 0 where nothing is seen | ours, Open3D |
| `camera.txt`, `poses.log` | fx fy cx cy; world from camera, Open3D's format | ours, Open3D |
| `frame_0000.ply`, `scans.txt` | each image triangulated in the world, with normals; the list of them | VCG |
| `points.ply` | the points that a triangle uses, with its normals | Poisson |
"""

import hashlib
from dataclasses import dataclass, replace

import numpy as np
import ply
import prepare

# Neighbours whose depths lie further apart than as many cells are the two sides of a jump.
JUMP_CELLS = 2.5


@dataclass
class Camera:
    """A pinhole, its axis through the middle of the image; x right, y down, z forward, pixel centres whole numbers."""

    rows: int
    cols: int
    focal: float

    @property
    def centre(self):
        """Column and row of the axis."""
        return (self.cols - 1) / 2, (self.rows - 1) / 2

    def rays(self):
        """Points of the pixels at depth 1, (rows, cols, 3)."""
        x, y = np.meshgrid(np.arange(self.cols) - self.centre[0], np.arange(self.rows) - self.centre[1])
        return np.stack([x / self.focal, y / self.focal, np.ones(x.shape)], -1)


@dataclass
class Shots:
    """Depth images of one camera."""

    camera: Camera
    poses: np.ndarray  # (n, 4, 4), world from camera
    depth: np.ndarray  # (n, rows, cols) float32, planar, 0: nothing seen
    cell: float  # of the grid to merge with: two pixel pitches on the object

    def take(self, views):
        """Only some of the images."""
        return replace(self, poses=self.poses[views], depth=self.depth[views])

    def points(self, every=1):
        """The samples of each image, in the world: one array an image."""
        rays = self.camera.rays()
        for pose, depth in zip(self.poses, self.depth, strict=True):
            seen = np.flatnonzero(depth.ravel())[::every]
            yield (rays.reshape(-1, 3)[seen] * depth.ravel()[seen, None]) @ pose[:3, :3].T + pose[:3, 3]


def scan(mesh, poses, camera, cell, folder):
    """Depth images of a mesh without any error, kept in a file of a folder."""
    import surfrecon

    made_from = [np.asarray(part, float).tobytes() for part in (mesh.positions, poses, [camera.focal, camera.cols])]
    file = folder / f"{len(poses)}_{hashlib.sha256(b''.join(made_from)).hexdigest()[:16]}.npz"
    if not file.is_file():
        file.parent.mkdir(parents=True, exist_ok=True)
        depth = np.zeros((len(poses), camera.rows, camera.cols), np.float32)
        for image, pose in zip(depth, poses, strict=True):
            seen = surfrecon.Camera.intrinsic(
                camera.rows, camera.cols, focal=(camera.focal,) * 2, centre=camera.centre, world_from_sensor=pose
            )
            image[:] = np.nan_to_num(surfrecon.virtual_scan(mesh, seen).values)
        np.savez_compressed(file, depth=depth)
    return Shots(camera, np.asarray(poses), np.load(file)["depth"], cell)


def jump_between(depth, other, cell):
    """Whether two neighbouring depths are both there and far apart."""
    return (depth > 0) & (other > 0) & (np.abs(depth - other) > JUMP_CELLS * cell)


def shifted(image, down, right):
    """The image's neighbours in one direction, 0 beyond the border."""
    rows, cols = image.shape
    padded = np.pad(image, 2)
    return padded[2 + down : 2 + down + rows, 2 + right : 2 + right + cols]


def correlated(depth, generator, cell):
    """Noise of standard deviation 1 that neighbours within 5 x 5 pixels share, but not across a jump."""
    white = generator.standard_normal(depth.shape) * (depth > 0)
    total, count = np.zeros(depth.shape), np.zeros(depth.shape)
    for down in range(-2, 3):
        for right in range(-2, 3):
            there = shifted(depth, down, right)
            same = (there > 0) & ~jump_between(depth, there, cell)
            total += np.where(same, shifted(white, down, right), 0)
            count += same
    return total / np.sqrt(np.maximum(count, 1))


def mixed(depth, generator, cell):
    """Pixels at a jump take a random value between its two sides."""
    result = depth.copy()
    for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        there = shifted(depth, down, right)
        at = jump_between(depth, there, cell)
        share = generator.random(depth.shape)
        result[at] = (depth + share * (there - depth))[at]
    return result


def with_noise(shots, kind, sigma, pose_error=0.0, seed=1):
    """The images with noise along the rays, and poses off by a shift each; lengths in cells.

    Gives the images and the standard deviation, in cells, of what was added along the rays; for mixed pixels, of
    those that are not mixed.
    """
    cell, length = shots.cell, np.linalg.norm(shots.camera.rays(), axis=-1)
    noisy, poses, added = np.zeros_like(shots.depth), shots.poses.copy(), []
    for k, depth in enumerate(shots.depth.astype(float)):
        generator = np.random.default_rng([seed, k])
        seen = depth > 0
        start = mixed(depth, generator, cell) if kind == "mixed" else depth
        along = start * length
        if kind == "quantized":
            step = sigma * cell * np.sqrt(12)
            along = np.round(along / step) * step if step else along
        elif kind == "correlated":
            along += sigma * cell * correlated(depth, generator, cell)
        else:
            along += sigma * cell * generator.standard_normal(depth.shape)
        noisy[k] = np.where(seen, along / length, 0)
        added.append((along - depth * length)[seen & (start == depth)] / cell)
        shift = generator.standard_normal(3)
        poses[k, :3, 3] += pose_error * cell * shift / np.linalg.norm(shift)
    return replace(shots, depth=noisy, poses=poses), float(np.concatenate(added).std())


def write_camera(camera, poses, folder):
    """The files beside the depth images."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "camera.txt").write_text(
        " ".join(repr(float(x)) for x in (camera.focal, camera.focal, *camera.centre)) + "\n"
    )
    lines = []
    for k, pose in enumerate(poses):
        lines += [f"{k} {k} {k + 1}"] + [" ".join(repr(float(x)) for x in row) for row in pose]
    (folder / "poses.log").write_text("\n".join(lines) + "\n")


def write(shots, folder, triangulated):
    """Writes the depth images and, if asked for, what the peers read that take no depth images."""
    write_camera(shots.camera, shots.poses, folder)
    for k, depth in enumerate(shots.depth):
        np.save(folder / f"frame_{k:04}.npy", depth)
    if triangulated:
        write_triangulated(shots, folder)


def write_triangulated(shots, folder):
    """The images as scans with triangles and as points with normals, as prepare.py makes both."""
    files, everything = [], []
    for k, (pose, depth) in enumerate(zip(shots.poses, shots.depth, strict=True)):
        vertices, faces, normals = triangulated_image(shots.camera, pose, depth)
        files.append(folder / f"frame_{k:04}.ply")
        ply.write_ply(files[-1], vertices, faces, normals)
        everything.append((vertices, normals))
    (folder / "scans.txt").write_text("".join(f"{file}\n" for file in files))
    vertices, normals = (np.concatenate(parts) for parts in zip(*everything, strict=True))
    ply.write_ply(folder / "points.ply", vertices, None, normals)


def triangulated_image(camera, pose, depth):
    """An image's vertices, faces and normals in the world; jumps left out."""
    seen = depth > 0
    grid = np.full(depth.shape, -1)
    grid[seen] = np.arange(seen.sum())
    # As prepare.py wants it: y up, looking along -z.
    points = camera.rays()[seen] * depth[seen, None] * [1, -1, -1]
    step = prepare.spacing(prepare.Scan("", points, grid, None, None))
    faces = prepare.triangulate(points, grid, prepare.EDGE_LIMIT * step)
    used, faces = np.unique(faces, return_inverse=True)
    points, faces = points[used], faces.reshape(-1, 3)
    turned = pose[:3, :3] * [1, -1, -1]
    return points @ turned.T + pose[:3, 3], faces, prepare.vertex_normals(points, faces) @ turned.T
