"""Scans thrown about, for the tests of aligning, and what tells how far they are off."""

import numpy as np
import surfrecon


def rigid(generator):
    """A turn about any axis and a shift."""
    q, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3] = q * np.sign(np.linalg.det(q))
    pose[:3, 3] = generator.normal(size=3) * 100
    return pose


def look(pixels=130):
    """Six views of the sculpture with the poses that they were taken from."""
    mesh = surfrecon.sculpture(cell=2.0)
    scans = surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=6, above=0, below=0, pixels=pixels))
    for k, scan in enumerate(scans):
        scan.name = f"view{k}"
    return scans


def off_by(pose, wanted, scan):
    """Largest distance of a scan's samples from where they belong."""
    points = scan.points[scan.valid]
    return np.linalg.norm(points @ (pose - wanted)[:3, :3].T + (pose - wanted)[:3, 3], axis=1).max()


def pushed(scan, degrees, share, seed=0):
    """The pose of a scan that was turned about its middle and shifted by a share of its size."""
    direction = np.random.default_rng(seed).normal(size=3)
    x, y, z = direction / np.linalg.norm(direction)
    cross, turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.radians(degrees)
    points = scan.world_points()[scan.valid]
    pose = np.eye(4)
    pose[:3, :3] += np.sin(turn) * cross + (1 - np.cos(turn)) * cross @ cross
    pose[:3, 3] = (
        points.mean(0) - pose[:3, :3] @ points.mean(0) + share * np.ptp(points, axis=0).max() * np.array((x, y, z))
    )
    return pose @ scan.world_from_sensor


def revolved(radius, height=1.0, detail=96):
    """A closed surface of revolution about z, whose radius is a function of z."""
    z = np.linspace(-height, height, detail)
    turn = 2 * np.pi * np.arange(detail) / detail
    r = np.broadcast_to(radius(z), z.shape)[:, None]
    side = np.stack([r * np.cos(turn), r * np.sin(turn), np.repeat(z[:, None], detail, axis=1)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(detail - 1), np.arange(detail), indexing="ij")
    a, b = (i * detail + j).ravel(), (i * detail + (j + 1) % detail).ravel()
    first, n = np.arange(detail), len(side)
    last = n - detail + first
    faces = [
        np.stack([a, b, b + detail], 1),
        np.stack([a, b + detail, a + detail], 1),
        np.stack([np.full(detail, n), np.roll(first, -1), first], 1),
        np.stack([np.full(detail, n + 1), last, np.roll(last, -1)], 1),
    ]
    return surfrecon.Mesh(np.vstack([side, (0, 0, -height), (0, 0, height)]), np.concatenate(faces).astype(np.uint32))


def turned_scans(mesh, count):
    """Scans of a mesh on a turntable by a sensor that stands still, the axis in the sensor's frame, and the angles."""
    cameras = surfrecon.turntable(mesh, around=count, above=0, below=0, pixels=130)
    scans = surfrecon.virtual_scan(mesh, cameras)
    sensor_from_world = np.linalg.inv(cameras[0].world_from_sensor)
    middle = mesh.bounds.mean(0)
    axis = sensor_from_world[:3, :3] @ middle + sensor_from_world[:3, 3], sensor_from_world[:3, :3] @ (0, 0, 1)
    angles = -2 * np.pi * np.arange(count) / count
    for k, scan in enumerate(scans):
        scan.name = f"step{k}"
    return scans, axis, angles


def without_poses(scans, seed=5):
    """Copies of scans thrown about."""
    generator = np.random.default_rng(seed)
    copies = []
    for scan in scans:
        copy = surfrecon.RangeImage.from_points(scan.points, name=scan.name)
        copy.world_from_sensor = rigid(generator)
        copies.append(copy)
    return copies


def errors(truth, alignment):
    """Largest distance of a sample of each placed scan from where it belongs, in the distances of samples."""
    report = alignment.report
    kept = next(k for k, scan in enumerate(report.scans) if scan.state == "kept")
    truth_from_found = truth[kept].world_from_sensor @ np.linalg.inv(alignment.world_from_scan[kept])
    found = []
    for scan, pose, told in zip(truth, alignment.world_from_scan, report.scans, strict=True):
        if pose is None:
            found.append(np.nan)
            continue
        points = scan.points[scan.valid]
        points = np.column_stack([points, np.ones(len(points))])
        off = points @ (truth_from_found @ pose - scan.world_from_sensor).T
        found.append(np.linalg.norm(off, axis=1).max() / told.spacing)
    return np.array(found)
