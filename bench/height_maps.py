"""Height maps to sculpt: scans, depth images, terrain, made ones; scaled to a depth extent of 1, NaN where invalid."""

import numpy as np

# Steps in the depth extent of the virtual scans. The ranges of the paper's images are whole numbers, 7,000 to 9,000 of
# them from end to end, and its finest tolerance is one step.
STEPS = 7700


def unit_extent(heights):
    """Scaled to [0, 1] and rounded to 16 bits, as sensors do."""
    low, high = np.nanmin(heights), np.nanmax(heights)
    return np.round((heights - low) / (high - low) * 65535) / 65535


def terrain(file):
    """An SRTM tile; voids become NaN."""
    raw = np.fromfile(file, ">i2").astype(float)
    side = round(raw.size**0.5)
    raw[raw == -32768] = np.nan
    return unit_extent(raw.reshape(side, side))


def depth_image(file):
    """A camera's depths in millimetres as heights; 0 and 65535 are no depths."""
    import open3d

    raw = np.asarray(open3d.io.read_image(str(file))).astype(float)
    raw[(raw == 0) | (raw == 65535)] = np.nan
    return unit_extent(-raw)


def synthetic(side):
    """Fractal hills, eight round ones, and one step."""
    rng = np.random.default_rng(7)
    f = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None])
    f[0, 0] = 1
    z = np.fft.irfft2((rng.normal(size=f.shape) + 1j * rng.normal(size=f.shape)) * f**-2.4 * (f < 1), (side, side))
    z = (z - z.min()) / np.ptp(z)
    y, x = np.mgrid[:side, :side] / side
    for _ in range(8):
        cx, cy, width, height = *rng.random(2), 0.03 + 0.08 * rng.random(), 0.3 * rng.random()
        z += height * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * width * width))
    return unit_extent(z + 0.15 * ((x > 0.6) & (y > 0.55) & (x < 0.85) & (y < 0.8)))


def head(side=132):
    """A head-like shape with the background left out, curved everywhere."""
    y, x = np.mgrid[:side, :side] * (2 / (side - 1)) - 1
    inside = (x / 0.9) ** 2 + (y / 0.98) ** 2
    bump = lambda cx, cy, w, h: np.exp(-(((x - cx) / w) ** 2) - ((y - cy) / h) ** 2)  # noqa: E731
    z = np.sqrt(np.maximum(1.15 - inside, 0)) + 0.25 * bump(0, 0.05, 0.1, 0.22)
    z += 0.08 * bump(0, 0.5, 0.25, 0.06) - 0.1 * (bump(-0.3, -0.2, 0.14, 0.09) + bump(0.3, -0.2, 0.14, 0.09))
    return unit_extent(np.where(inside < 1, z, np.nan))


def scan(file):
    """A range scan seen along z on a regular grid of its own spacing, the largest part of its surface only."""
    import open3d
    import surfrecon
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    mesh = surfrecon.read(file).triangulate()
    points, triangles = np.asarray(mesh.positions), np.asarray(mesh.triangles)
    edges = np.concatenate([triangles[:, :2], triangles[:, 1:]])
    graph = coo_matrix((np.ones(len(edges)), edges.T), (len(points), len(points)))
    part = connected_components(graph, directed=False)[1][triangles[:, 0]]
    triangles = triangles[part == np.bincount(part).argmax()]
    used = points[np.unique(triangles)]
    low, high = used.min(0), used.max(0)
    e = points[triangles[:, 1]] - points[triangles[:, 0]]
    pitch = float(np.median(np.linalg.norm(e[:, :2], axis=1)))
    scene = open3d.t.geometry.RaycastingScene()
    moved = (points - [low[0], low[1], high[2]]).astype(np.float32)
    scene.add_triangles(open3d.core.Tensor(moved), open3d.core.Tensor(triangles.astype(np.uint32)))
    cols, rows = ((high - low)[:2] / pitch).astype(int) + 1
    x, y = np.meshgrid((np.arange(cols) + 0.25) * pitch, (np.arange(rows) + 0.25) * pitch)
    rays = np.stack([x, y, np.full_like(x, 0.01), 0 * x, 0 * x, 0 * x - 1], -1).astype(np.float32)
    depth = scene.cast_rays(open3d.core.Tensor(rays))["t_hit"].numpy().astype(float)
    return unit_extent(np.where(np.isfinite(depth), -depth, np.nan))


def pipe(pixels=13_500):
    """A virtual scan of a pipe that forks: cylinders and planes, as on the machine parts of the paper's database."""
    tubes = [((-70, 0, 0), (70, 0, 0), 22), ((0, 0, 0), (45, 55, 10), 18), ((38, 46.5, 8.5), (45, 55, 10), 24)]
    tubes += [((60, 0, 0), (70, 0, 0), 28), ((-70, 0, 0), (-60, 0, 0), 28)]
    length = lambda a, b: float(np.linalg.norm(np.subtract(b, a)))  # noqa: E731
    return virtual_scan(
        [turned([(0, 0), (0, r), (length(a, b), r), (length(a, b), 0)], a, b) for a, b, r in tubes], pixels
    )


def bottle(pixels=13_500):
    """A virtual scan of a turned shape: curved lengthwise at its shoulder, straight elsewhere."""
    along = np.linspace(0, 1, 300)
    radius = 8 + 30 * np.minimum(1, ((1 - along) / 0.35) ** 0.65)
    profile = np.column_stack([150 * along, np.where(along > 0.93, 10, radius)])
    return virtual_scan([turned([(0, 0), *profile, (150, 0)], (-75, 0, 0), (75, 0, 0))], pixels)


def turned(profile, start, end, around=720):
    """The surface that a profile of (place along the axis, radius) leaves as it turns around the axis."""
    axis = np.subtract(end, start) / np.linalg.norm(np.subtract(end, start))
    right = np.cross(axis, [0.3, 1, 0.2])
    right /= np.linalg.norm(right)
    angle = np.arange(around) * 2 * np.pi / around
    ring = np.cos(angle)[:, None] * right + np.sin(angle)[:, None] * np.cross(axis, right)
    # A radius of 0 would leave triangles without an area.
    place, radius = np.maximum(np.array(profile, float), [0, 1e-9]).T
    positions = np.array(start, float) + place[:, None, None] * axis + radius[:, None, None] * ring
    a = np.arange(len(place) - 1)[:, None] * around + np.arange(around)
    b = np.arange(len(place) - 1)[:, None] * around + (np.arange(around) + 1) % around
    corners = [np.stack([a, b, a + around], -1), np.stack([b, b + around, a + around], -1)]
    return positions.reshape(-1, 3), np.concatenate(corners).reshape(-1, 3)


def virtual_scan(surfaces, pixels):
    """Seen from aslant by the virtual scanner, without noise, in whole steps, at about so many valid pixels."""
    import surfrecon

    first = np.cumsum([0] + [len(positions) for positions, _ in surfaces])
    triangles = np.concatenate([corners + i for (_, corners), i in zip(surfaces, first, strict=False)])
    mesh = surfrecon.Mesh(np.concatenate([positions for positions, _ in surfaces]), triangles.astype(np.uint32))
    low, high = mesh.bounds
    size, middle = float(np.linalg.norm(high - low)), tuple((low + high) / 2)
    spacing = size / 200
    for _ in range(5):
        side = int(size / spacing) + 2
        camera = surfrecon.Camera.orthographic(
            side, side, spacing=spacing, target=middle, toward=(0.25, -0.35, 0.9), up=(0, 1, 0)
        )
        image = surfrecon.virtual_scan(mesh, camera)
        spacing *= (image.valid.sum() / pixels) ** 0.5
    heights = np.where(image.valid, image.points[..., 2], np.nan)
    step = float(np.nanmax(heights) - np.nanmin(heights)) / STEPS
    image = surfrecon.virtual_scan(mesh, camera, quantum=step)
    heights = np.where(image.valid, image.points[..., 2], np.nan)
    steps = np.round((heights - np.nanmin(heights)) / step)
    rows, cols = (np.flatnonzero(image.valid.any(axis)) for axis in (1, 0))
    return steps[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1] / np.nanmax(steps)
