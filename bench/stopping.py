"""How long each long call of the extension runs on after it was asked to stop.

A call is stopped at moments spread evenly over its run, a fresh call each time. The clock counts here: that is what
somebody who pressed ESC waits. The longest of the moments tells, for no stage may be deaf.
"""

import os
import tempfile
import time

import numpy as np
import surfrecon

# Moments, and rows and columns of the scans.
USUAL, SMALLEST = (16, 900), (1, 60)


def sheet(pixels):
    """A noisy range image of that many rows and columns, on no lattice, as the extension hands them over."""
    y, x = np.mgrid[:pixels, :pixels].astype(float)
    z = 20 * np.sin(x / 37) * np.cos(y / 29) + np.random.default_rng(1).normal(0, 0.05, x.shape)
    points = np.dstack([x, -y, z]).astype(np.float32)
    return surfrecon.RangeImage.from_points(points, viewing=("parallel", (0, 0, -1)), name="sheet")


def calls(folder, pixels):
    """Each call by the name of its button."""
    job = surfrecon.Job
    shape = surfrecon.sculpture(cell=4.0)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=5 * pixels // 9))
    large, small = sheet(pixels), sheet(pixels // 2)
    mesh, coarse = large.triangulate(), small.triangulate()
    points = np.concatenate([image.world_points()[image.valid] for image in images])
    sculptor = surfrecon.Sculptor(large)
    path = os.path.join(folder, "sheet.ply")
    mesh.write(path, encoding="ascii")
    scans = list(surfrecon.open(path))
    return {
        "Import Range Scans": lambda: job.read(scans),
        "Virtual Scan": lambda: job.virtual_scan(mesh, surfrecon.turntable(mesh, pixels=2 * pixels // 3)),
        "Merge Scans": lambda: job.merge(images, voxel=225 / pixels, measure=True),
        "Surface from Points": lambda: job.surface(surfrecon.Reconstructor(points)),
        "Sculpt Scan, preparing": lambda: job.sculptor(large),
        "Sculpt Scan": lambda: job.refine(sculptor, relative_tolerance=0.0005),
        "Quad Grid": lambda: job.adaptive_quads(large, rows=60, columns=60),
        "Remesh": lambda: job.cluster(coarse, vertices=pixels * pixels // 40),
        "Error Map": lambda: job.distances(points, mesh),
        "Measure Distance": lambda: job.surface_distance(mesh, shape, signed=True),
    }


def stopped(start, seconds):
    """Seconds that a call ran on after it was asked to stop, so long after its start."""
    job = start()
    time.sleep(seconds)
    asked = time.perf_counter()
    job.cancel()
    while not job.done():
        time.sleep(0.0005)
    return time.perf_counter() - asked


def longest(wanted, record):
    """Gives each call that is wanted and the longest that it ran on, milliseconds."""
    if "stopping" not in wanted.cases and wanted.cases not in "stopping":
        return
    moments, pixels = SMALLEST if wanted.smallest else USUAL
    with tempfile.TemporaryDirectory() as folder:
        for name, start in calls(folder, pixels).items():
            if not wanted.takes(f"stopping {name}") or not record.has_time_for(f"stopping {name}"):
                continue
            begun = time.perf_counter()
            start().result()
            whole = time.perf_counter() - begun
            yield f"stopping {name}", 1e3 * max(stopped(start, (k + 0.5) / moments * whole) for k in range(moments))
