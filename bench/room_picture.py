"""A recording without poses, aligned and merged: docs/pictures/recording.jpg.

Usage: python bench/room_picture.py OUT      with surfrecon and open3d
Three panels, seen from above without the upper half of the room: the frames as they come, each where its camera is
the origin; the frames as `align` places them, with the way of the camera; and what `merge` makes of them.
"""

import sys
import tempfile
from pathlib import Path

import noise_picture
import noise_scans
import noise_shapes
import numpy as np
import room_cases

SIDE, GAP = 560, 8
# Rows that show something.
CROP = slice(85, 435)
# Nothing above is drawn, in metres.
CEILING = 1.6
COUNT, SEED = 60, 1
EYE, TARGET = [0.3, -3.4, 7.6], [0, -0.15, 0.6]
CAMERA = noise_scans.Camera(SIDE, SIDE, 560.0)


def tint(share):
    """A colour of the rainbow from the first frame to the last."""
    turn = 5 * share
    return (255 * np.clip(np.abs((turn + np.array([5, 3, 1])) % 6 - 3) - 1, 0.15, 0.9)).astype(np.uint8)


def splat(parts, pose):
    """Points with their colours as the camera sees them."""
    depth, picture = np.full((SIDE, SIDE), np.inf), np.full((SIDE, SIDE, 3), 255, np.uint8)
    for points, colour in parts:
        x, y, z = ((points - pose[:3, 3]) @ pose[:3, :3]).T
        col, row = (np.stack([x, y]) / z * CAMERA.focal + SIDE / 2).astype(int)
        for across, down in np.ndindex(2, 2):
            c, r = col + across, row + down
            inside = (z > 0) & (c >= 0) & (c < SIDE) & (r >= 0) & (r < SIDE)
            order = np.flatnonzero(inside)[np.argsort(-z[inside])]
            nearer = order[z[order] < depth[r[order], c[order]]]
            depth[r[nearer], c[nearer]] = z[nearer]
            picture[r[nearer], c[nearer]] = colour
    return picture


def way(picture, poses, pose):
    """The way of the camera, drawn into a picture: a line, and a dot for each frame."""
    x, y, z = ((poses[:, :3, 3] - pose[:3, 3]) @ pose[:3, :3]).T
    places = np.stack([x, y], 1) / z[:, None] * CAMERA.focal + SIDE / 2
    steps = np.linspace(places[:-1], places[1:], 40).reshape(-1, 2)
    rows, cols = np.indices(picture.shape[:2])
    for radius, dots in ((1.2, steps), (3.5, places)):
        for col, row in dots:
            picture[(cols - col) ** 2 + (rows - row) ** 2 <= radius**2] = 0
    return picture


def main():
    """Makes the frames, aligns and merges them, writes the picture."""
    import open3d
    import surfrecon

    recording = room_cases.Recording("box", SEED, COUNT)
    with tempfile.TemporaryDirectory() as folder:
        room_cases.write(room_cases.Case("picture", "sequence", [recording]), folder)
        camera = (*recording.intrinsics["focal"], *recording.intrinsics["centre"])
        files = sorted(Path(folder).glob("set000/*.png"))
        frames = [scan for file in files for scan in surfrecon.open(file, camera=camera)]
        aligned = surfrecon.align(frames)
        print("\n".join(aligned.report.messages))
        placed = [k for k, pose in enumerate(aligned.world_from_scan) if pose is not None]
        print(f"{len(placed)} of {COUNT} placed")
        merged = surfrecon.merge(aligned.scans)
        own = [frame.read().world_points().reshape(-1, 3) for frame in frames]
    truth, _ = recording.frames()
    # Seen upright: where the truth has the first placed frame.
    upright = truth[placed[0]] @ np.linalg.inv(aligned.world_from_scan[placed[0]])
    moved = lambda points, pose: points @ pose[:3, :3].T + pose[:3, 3]  # noqa: E731
    pose = noise_shapes.look(np.array(EYE), np.array(TARGET))
    own = [points[np.isfinite(points).all(1)] for points in own]
    heap, found = [], []
    for k in placed:
        heap.append((moved(own[k], truth[0])[::3], tint(k / COUNT)))
        points = moved(own[k], upright @ aligned.world_from_scan[k])
        found.append((points[points[:, 2] < CEILING], tint(k / COUNT)))
    middle = np.mean([points.mean(axis=0) for points, _ in heap], axis=0)
    heap = [(points - middle + TARGET, colour) for points, colour in heap]
    poses = np.array([upright @ aligned.world_from_scan[k] for k in placed])
    vertices = moved(merged.mesh.positions, upright)
    faces = np.asarray(merged.mesh.triangles)
    faces = faces[(vertices[faces][..., 2] < CEILING).all(1)]
    gap = np.full((SIDE, GAP, 3), 255, np.uint8)
    panels = [splat(heap, pose), gap, way(splat(found, pose), poses, pose), gap]
    picture = np.hstack([*panels, noise_picture.surface(vertices, faces, pose, CAMERA)])
    open3d.io.write_image(sys.argv[1], open3d.geometry.Image(np.ascontiguousarray(picture[CROP])), quality=82)


if __name__ == "__main__":
    main()
