"""The figures of a surface beside the known truth, where some scan saw the truth."""

import numpy as np
from surface import group

# A point of the result is a veil where it lies further from the truth than as many cells and standard deviations.
VEIL_CELLS, VEIL_SIGMAS = 2.0, 4.0
# A clean sample further from the result than as many cells is lost.
LOST_CELLS = 1.5
# Sides of a plate lie apart where they do by more than this share of its thickness; it is whole where they do at this
# share of its points; it is still that plate where it did not become thicker by more cells.
APART, NEARLY_ALL, THICKER_CELLS = 0.25, 0.98, 1.0
# Points of the result, and about as many samples, of which the figures are means.
POINTS = 100_000
# Rings of triangles at the border of what was seen that do not count: what a tool does there is no noise.
RINGS = 1


class Surface:
    """A mesh that answers for the nearest point; float32 inside, so all is centred and scaled first."""

    def __init__(self, vertices, faces):
        import open3d

        self.tensor = open3d.core.Tensor
        self.vertices, self.faces = np.asarray(vertices, float), np.asarray(faces)
        self.middle = (self.vertices.max(0) + self.vertices.min(0)) / 2
        self.size = float((self.vertices.max(0) - self.vertices.min(0)).max())
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        facing = np.cross(b - a, c - a)
        doubled = np.linalg.norm(facing, axis=1)
        self.areas, self.normals = doubled / 2, facing / np.maximum(doubled, 1e-30)[:, None]
        self.scene = open3d.t.geometry.RaycastingScene()
        self.scene.add_triangles(self.scaled(self.vertices), self.tensor(self.faces.astype(np.uint32)))

    def scaled(self, points):
        """Points as the scene takes them."""
        return self.tensor(np.ascontiguousarray(((points - self.middle) / self.size).astype(np.float32)))

    def nearest(self, points):
        """The vectors from the nearest points of the surface to the points, and the triangles those are in."""
        found = self.scene.compute_closest_points(self.scaled(points))
        return points - (found["points"].numpy() * self.size + self.middle), found["primitive_ids"].numpy()

    def distances(self, points):
        """How far the points lie from the surface."""
        return self.scene.compute_distance(self.scaled(points)).numpy() * self.size

    def cast(self, starts, direction):
        """How far the rays go, and the normals of what they meet."""
        rays = np.concatenate([(starts - self.middle) / self.size, np.broadcast_to(direction, starts.shape)], 1)
        found = self.scene.cast_rays(self.tensor(rays.astype(np.float32)))
        met = found["primitive_ids"].numpy()
        return found["t_hit"].numpy() * self.size, self.normals[np.where(met < len(self.faces), met, 0)]

    def sample(self, count, seed=0):
        """Points spread evenly, and the triangle of each."""
        generator = np.random.default_rng(seed)
        sums = np.cumsum(self.areas)
        triangle = np.minimum(np.searchsorted(sums, generator.random(count) * sums[-1]), len(sums) - 1)
        u, v = generator.random(count), generator.random(count)
        outside = u + v > 1
        u[outside], v[outside] = 1 - u[outside], 1 - v[outside]
        a, b, c = (self.vertices[self.faces[triangle, k]] for k in range(3))
        return a + u[:, None] * (b - a) + v[:, None] * (c - a), triangle


class Truth(Surface):
    """The shape that was scanned, and which of its triangles some image saw."""

    def __init__(self, vertices, faces):
        super().__init__(vertices, faces)
        self.seen = np.zeros(len(faces), bool)
        self.middles = self.vertices[self.faces].mean(1)

    def see(self, camera, pose, depth, cell):
        """Takes note of what an image without errors sees: triangles whose middle lies between four of its samples."""
        left = np.flatnonzero(~self.seen)
        to_eye = pose[:3, 3] - self.middles[left]
        left = left[np.einsum("ij,ij->i", to_eye, self.normals[left]) > 0]
        x, y, z = ((self.middles[left] - pose[:3, 3]) @ pose[:3, :3]).T
        ahead = z > 1e-9
        left, x, y, z = left[ahead], x[ahead], y[ahead], z[ahead]
        x, y = camera.focal * x / z + camera.centre[0], camera.focal * y / z + camera.centre[1]
        inside = (x >= 0) & (y >= 0) & (x < camera.cols - 1) & (y < camera.rows - 1)
        left, x, y, z = left[inside], x[inside], y[inside], z[inside]
        col, row = x.astype(int), y.astype(int)
        x, y = x - col, y - row
        corners = np.stack([depth[row + down, col + right] for down in (0, 1) for right in (0, 1)])
        between = (corners[0] * (1 - x) + corners[1] * x) * (1 - y) + (corners[2] * (1 - x) + corners[3] * x) * y
        self.seen[left[(corners > 0).all(0) & (np.abs(between - z) < cell / 2)]] = True

    def depth(self, pose, rays):
        """Planar depth along the rays of a camera, 0 where there is nothing."""
        start = np.broadcast_to((pose[:3, 3] - self.middle) / self.size, rays.shape)
        along = np.concatenate([start, rays @ pose[:3, :3].T], -1).astype(np.float32)
        hit = self.scene.cast_rays(self.tensor(along))["t_hit"].numpy() * self.size
        return np.where(np.isfinite(hit), hit, 0)

    def covered(self):
        """The triangles that count: seen, and not within RINGS of one that was not."""
        inner = self.seen.copy()
        for _ in range(RINGS):
            border = np.zeros(len(self.vertices), bool)
            border[self.faces[~inner].ravel()] = True
            inner &= ~border[self.faces].any(1)
        return inner


def raw_veils(shots, truth, sigma):
    """Area of the veils in the images themselves: of samples that lie off the truth, each a pixel's on the object."""
    points = np.concatenate(list(shots.points()))
    off = truth.distances(points) > veil_distance(shots.cell, sigma)
    return float(off.sum()) * (shots.cell / 2) ** 2


def veil_distance(cell, sigma):
    """How far from the truth no surface can be explained by noise."""
    return (VEIL_CELLS + VEIL_SIGMAS * sigma) * cell


def quality(mesh, truth, clean, cell, sigma, raw, mm=1.0):
    """Figures of a result.

    `clean` are samples without errors, `raw` the area of veils in the images, where there are any, `mm` the
    millimetres in the unit of lengths. Points of the result count whose nearest triangle of the truth was seen.
    """
    if mesh.faces is None or len(mesh.faces) == 0:
        return {"samples_lost_pct": 100.0, "triangles": 0, "components": 0}
    result, covered = Surface(mesh.vertices, mesh.faces), truth.covered()
    points, triangle = result.sample(POINTS)
    off, nearest = truth.nearest(points)
    counts = covered[nearest]
    distance, side = np.linalg.norm(off, axis=1), np.einsum("ij,ij->i", off, truth.normals[nearest])
    turned = np.einsum("ij,ij->i", result.normals[triangle], truth.normals[nearest])[counts]
    area = result.areas.sum()
    figures = {
        "rms_mm": mm * float(np.sqrt(np.mean(distance[counts] ** 2))),
        "signed_mean_mm": mm * float(np.mean(np.copysign(distance, side)[counts])),
        "normal_median_deg": float(np.degrees(np.median(np.arccos(np.clip(turned, -1, 1))))),
        "area_ratio": float(area * counts.mean() / truth.areas[covered].sum()),
        "triangles": len(mesh.faces),
        "components": components(mesh),
        "samples_lost_pct": float(100 * np.mean(result.distances(clean) > LOST_CELLS * cell)),
    }
    if raw:
        left = area * np.mean(distance > veil_distance(cell, sigma))
        figures["veils_left_pct"] = float(100 * left / raw)
    return figures


def components(mesh):
    """Connected parts; vertices count as one where their coordinates are equal, as in surface.topology."""
    bits = np.ascontiguousarray(mesh.vertices.astype(np.float32) + 0.0).view([("", np.float32)] * 3)
    _, merged = np.unique(bits.ravel(), return_inverse=True)
    faces = merged.reshape(-1)[mesh.faces]
    used, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    count, _ = group(faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel(), len(used))
    return int(count)


def walls(mesh, plates, cell):
    """The plates in the surface: thickness in cells, how far the sides lie apart (median), whether it is a wall.

    It is one where rays from both sides meet sides that face them and lie apart, at nearly all points of its middle,
    and not much further than the plate is thick: distance fields make thin plates as thick as they are truncated.
    """
    if mesh.faces is None or len(mesh.faces) == 0:
        return []
    result, found = Surface(mesh.vertices, mesh.faces), []
    for plate in plates:
        across = np.linspace(-8, 8, 33) * cell
        x, z = (part.ravel() for part in np.meshgrid(across, across))
        at, right = [], np.ones(x.shape, bool)
        for side in (-1, 1):
            start = plate.middle + np.stack([x, np.full(x.shape, 20 * side * cell), z], 1)
            hit, facing = result.cast(start, [0, -side, 0])
            at.append(start[:, 1] - side * hit)
            right &= np.isfinite(hit) & (side * facing[:, 1] > 0)
        apart = np.where(right, at[1] - at[0], 0)
        whole = np.mean(apart > APART * plate.thickness) >= NEARLY_ALL
        whole &= np.median(apart) < plate.thickness + THICKER_CELLS * cell
        found.append((round(plate.thickness / cell, 3), float(np.median(apart)) / cell, bool(whole)))
    return found


def thinnest(found):
    """The thinnest plate that is a wall, as all thicker ones are, of what `walls` found; none: null."""
    last = None
    for thickness, _, whole in sorted(found, reverse=True):
        if not whole:
            break
        last = thickness
    return last
