"""Prepares what the peers of the merge read: triangulated, placed scans, points with normals, and depth maps.

This library reads the raw scans; the peers can't, so their time starts from these files. Written to a folder:

| file | what |
|---|---|
| `<scan>.ply` | each scan triangulated, in the world, with normals (VCG) |
| `scans.txt` | their paths, one a line |
| `points.ply` | all points that a triangle uses, with normals (screened Poisson); distances are measured from these |
| `all.ply` | all triangulated scans as one soup |
| `depth/<scan>.npz` | `depth`, intrinsic `K` (middles of pixels at whole numbers), extrinsic `E` (Open3D) |
"""

import hashlib
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import open3d
import ply
from scipy.spatial import cKDTree
from surface import distances

# Longest edge of a triangle, in median distances of neighbouring samples: 690,821 triangles on the bunny.
EDGE_LIMIT = 3.4


@dataclass
class Scan:
    """A scan as its file and the `.conf` hold it."""

    name: str
    points: np.ndarray
    grid: np.ndarray
    translation: np.ndarray
    quaternion: np.ndarray  # x y z w


def read_conf(conf):
    """The scans a Stanford `.conf` places."""
    scans = []
    for line in Path(conf).read_text().splitlines():
        words = line.split()
        if words and words[0] == "bmesh":
            file = ply.read_ply(Path(conf).parent / words[1])
            numbers = np.array(words[2:9], float)
            scans.append(Scan(words[1], file.vertices, file.grid, numbers[:3], numbers[3:]))
    return scans


def rotation(quaternion):
    """Matrix of a quaternion x y z w."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotations(scans):
    """World-from-scan rotations, in the sense of the quaternions that makes the scans overlap better."""
    best = None
    for transposed in (True, False):
        candidates = [rotation(s.quaternion).T if transposed else rotation(s.quaternion) for s in scans]
        placed = [s.points @ r.T + s.translation for s, r in zip(scans, candidates, strict=True)]
        apart = []
        for i, points in enumerate(placed):
            others = cKDTree(np.concatenate([p[::4] for j, p in enumerate(placed) if j != i]))
            apart.append(np.median(others.query(points[::17])[0]))
        if best is None or np.median(apart) < best[0]:
            best = (np.median(apart), candidates)
    return best[1]


def spacing(scan):
    """Median distance of neighbouring samples."""
    grid, points = scan.grid, scan.points
    across = (grid[:, :-1] >= 0) & (grid[:, 1:] >= 0)
    down = (grid[:-1] >= 0) & (grid[1:] >= 0)
    steps = [
        np.linalg.norm(points[grid[:, :-1][across]] - points[grid[:, 1:][across]], axis=1),
        np.linalg.norm(points[grid[:-1][down]] - points[grid[1:][down]], axis=1),
    ]
    return float(np.median(np.concatenate(steps)))


def triangulate(points, grid, limit):
    """Two triangles a cell of the grid along its shorter diagonal, one where a corner is missing, none over a jump."""

    def length(i, j):
        return np.linalg.norm(points[i] - points[j], axis=1)

    a, b, c, d = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel(), grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
    full = (a >= 0) & (b >= 0) & (c >= 0) & (d >= 0)
    p, q, r, s = a[full], b[full], c[full], d[full]
    along = length(p, r) <= length(q, s)
    found = [
        np.stack([p, q, r], 1)[along],
        np.stack([p, r, s], 1)[along],
        np.stack([p, q, s], 1)[~along],
        np.stack([q, r, s], 1)[~along],
    ]
    for missing, i, j, k in ((a, b, c, d), (b, a, c, d), (c, a, b, d), (d, a, b, c)):
        three = (missing < 0) & (i >= 0) & (j >= 0) & (k >= 0)
        found.append(np.stack([i[three], j[three], k[three]], 1))
    triangles = np.concatenate(found)
    i, j, k = triangles.T
    triangles = triangles[(length(i, j) <= limit) & (length(j, k) <= limit) & (length(k, i) <= limit)]
    # The sensor looks along -z: counter-clockwise seen from +z.
    i, j, k = (points[corner] for corner in triangles.T)
    away = np.cross(j - i, k - i)[:, 2] < 0
    triangles[away] = triangles[away][:, [0, 2, 1]]
    return triangles


def vertex_normals(points, triangles):
    """Normals weighted by area."""
    i, j, k = (points[corner] for corner in triangles.T)
    facing = np.cross(j - i, k - i)
    normals = np.zeros_like(points)
    for corner in triangles.T:
        np.add.at(normals, corner, facing)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def depth_map(points, triangles, world_from_scan, translation, step):
    """Ray casts a scan from a pinhole far in front of it (the scanners are near orthographic): depth, K, E."""
    low, high = points.min(0), points.max(0)
    extent = high - low
    distance = 12 * float(extent.max())
    eye = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, high[2] + distance])
    focal = (distance + extent[2] / 2) / (0.66 * step)
    width, height = (int(np.ceil(1.08 * extent[axis] / (0.66 * step))) + 16 for axis in (0, 1))
    # Camera: x right, y down, z forward, where the scan's frame has y up and looks along -z.
    camera_from_scan = np.diag([1.0, -1.0, -1.0])
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = camera_from_scan @ world_from_scan.T
    extrinsic[:3, 3] = -extrinsic[:3, :3] @ translation - camera_from_scan @ eye
    intrinsic = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])

    # float32 in the scene: rays start just before the scan, coordinates stay small.
    start = distance - 0.1 * float(extent.max())
    in_camera = (points - eye) @ camera_from_scan - [0, 0, distance]
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        open3d.core.Tensor(in_camera.astype(np.float32)), open3d.core.Tensor(triangles.astype(np.uint32))
    )
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    directions = np.stack([(x - intrinsic[0, 2]) / focal, (y - intrinsic[1, 2]) / focal, np.ones(x.shape)], -1)
    rays = np.concatenate([directions * start - [0, 0, distance], directions], -1).astype(np.float32)
    hit = scene.cast_rays(open3d.core.Tensor(rays))["t_hit"].numpy().astype(np.float64)
    depth = np.where(np.isfinite(hit), hit + start, 0).astype(np.float32)
    return depth, intrinsic, extrinsic


def check_depth(depth, intrinsic, extrinsic, vertices, triangles, step):
    """A depth map in the wrong place would make a peer look bad: its points must lie on the scan."""
    row, col = np.nonzero(depth)
    z = depth[row, col].astype(np.float64)
    in_camera = np.stack(
        [(col - intrinsic[0, 2]) / intrinsic[0, 0] * z, (row - intrinsic[1, 2]) / intrinsic[1, 1] * z, z], 1
    )
    in_world = (in_camera - extrinsic[:3, 3]) @ extrinsic[:3, :3]
    off = distances(in_world[::50], vertices, triangles).max()
    if off > 0.1 * step:
        raise RuntimeError(
            f"a prepared depth map lies {off} off its scan, a tenth of the sample spacing is {0.1 * step}"
        )


def fingerprint(conf):
    """Changes when the scans or this program change."""
    hashed = hashlib.sha256(Path(__file__).read_bytes())
    for path in sorted(Path(conf).parent.iterdir()):
        stat = path.stat()
        hashed.update(f"{path.name} {stat.st_size} {stat.st_mtime_ns}\n".encode())
    return hashed.hexdigest()


def prepare(conf, folder):
    """Writes the folder described above, unless it is up to date. Returns the numbers of points and triangles."""
    folder = Path(folder)
    stamp, mark = folder / "prepared.json", fingerprint(conf)
    if stamp.is_file() and json.loads(stamp.read_text())["fingerprint"] == mark:
        return json.loads(stamp.read_text())
    (folder / "depth").mkdir(parents=True, exist_ok=True)
    scans = read_conf(conf)
    vertices, normals, triangles, files, count = [], [], [], [], 0
    for scan, world_from_scan in zip(scans, rotations(scans), strict=True):
        step = spacing(scan)
        faces = triangulate(scan.points, scan.grid, EDGE_LIMIT * step)
        used, faces = np.unique(faces, return_inverse=True)
        points, faces = scan.points[used], faces.reshape(-1, 3)
        placed = points @ world_from_scan.T + scan.translation
        directions = vertex_normals(points, faces) @ world_from_scan.T
        file = folder / f"{Path(scan.name).stem}.ply"
        ply.write_ply(file, placed, faces, directions)
        maps = depth_map(points, faces, world_from_scan, scan.translation, step)
        check_depth(*maps, placed, faces, step)
        np.savez(folder / "depth" / file.stem, **dict(zip(("depth", "K", "E"), maps, strict=True)))
        files.append(file)
        vertices.append(placed)
        normals.append(directions)
        triangles.append(faces + count)
        count += len(placed)
    vertices, normals, triangles = np.concatenate(vertices), np.concatenate(normals), np.concatenate(triangles)
    ply.write_ply(folder / "all.ply", vertices, triangles, normals)
    ply.write_ply(folder / "points.ply", vertices, None, normals)
    (folder / "scans.txt").write_text("".join(f"{file.resolve()}\n" for file in files))
    figures = {"fingerprint": mark, "scans": len(scans), "points": len(vertices), "triangles": len(triangles)}
    stamp.write_text(json.dumps(figures))
    return figures


if __name__ == "__main__":
    print(prepare(sys.argv[1], sys.argv[2]))
