"""Meshes and scans for tests, without files."""

import numpy as np
import surfrecon

MAJOR, MINOR, SWELL, TOWARD = 1.0, 0.4, 0.08, 0.7


def tube(azimuth):
    """Radius of the tube: it swells toward one side, so that no turn or mirroring takes the shape onto itself."""
    return MINOR + SWELL * np.cos(azimuth - TOWARD)


def torus(detail=48):
    """A closed torus about z whose tube swells toward one side; see `torus_distance`."""
    n, m = 2 * detail, detail
    a, b = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    ring = MAJOR + tube(a) * np.cos(b)
    positions = np.stack([ring * np.cos(a), ring * np.sin(a), tube(a) * np.sin(b)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    corner = lambda di, dj: ((i + di) % n * m + (j + dj) % m).reshape(-1)  # noqa: E731
    p, q, r, s = corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)
    triangles = np.concatenate([np.stack([p, q, r], 1), np.stack([p, r, s], 1)])
    return surfrecon.Mesh(positions, triangles)


def torus_distance(points):
    """Distance of points near the smooth torus, negative inside; up to 1 % too large where the tube swells."""
    x, y, z = np.moveaxis(np.asarray(points, float), -1, 0)
    return np.hypot(np.hypot(x, y) - MAJOR, z) - tube(np.arctan2(y, x))


def torus_scans(pixels=90, **options):
    """Scans of the torus from all sides, named in their order."""
    mesh = torus()
    scans = surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, pixels=pixels), **options)
    for k, scan in enumerate(scans):
        scan.name = f"scan{k:02}"
    return scans


def torus_files(tmp_path_factory, pixels=60):
    """A list of such scans, with noise, in files of a folder of its own."""
    folder = tmp_path_factory.mktemp("scans")
    surfrecon.write_scans(folder / "scans.conf", torus_scans(pixels=pixels, noise=0.002))
    return folder / "scans.conf"


# Side of a square of the sphere below that has one of its 5,000 points.
NOISY_SPACING = np.sqrt(4 * np.pi / 5000)


def noisy_sphere():
    """5,000 random points of the unit sphere with noise of one spacing in all directions, then 250 outliers."""
    rng = np.random.default_rng(6)
    points = rng.normal(size=(5000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    points += rng.normal(0, NOISY_SPACING, points.shape)
    return np.concatenate([points, rng.uniform(-1.2, 1.2, (250, 3))])
