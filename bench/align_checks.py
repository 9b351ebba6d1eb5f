"""The quality of poses of scans, by the truth and by how the scans lie on each other."""

import itertools

import numpy as np
from align_shapes import lying, of_corners, spacing
from peer_align import read
from scipy.spatial import cKDTree

WRONG = 5.0
# Scans of one body that share as much of the smaller are a pair that can be found.
LEAST = 0.1
# Samples that a check looks at, at most: of a scan, and of all scans of a set.
OF_ONE, OF_ALL = 2000, 60_000
# And pairs of scans whose distance is taken.
COMPARED = 1000


class Scans:
    """Samples of a set, as the checker needs them."""

    def __init__(self, place, case):
        truth = place / "truth.npy"
        self.truth = np.load(truth) if truth.is_file() else None
        contents = [scan.read() if hasattr(scan, "read") else scan for scan in read(place)]
        meshes = [scan.triangulate() if hasattr(scan, "triangulate") else scan for scan in contents]
        self.points = [np.asarray(mesh.positions) for mesh in meshes]
        self.normals = [np.asarray(normals(mesh)) for mesh in meshes]
        looked_at = min(OF_ONE, OF_ALL // len(self.points))
        self.some = [slice(None, None, max(1, len(p) // looked_at)) for p in self.points]
        self.spacings = [spacing(points) for points in self.points]
        self.bodies = case.objects or [0] * len(self.points)
        self.limit = WRONG + case.slack
        least = LEAST if case.overlap is None else min(LEAST, 0.8e-2 * case.overlap)
        self.pairs = self.overlapping(least, 1.5 + case.slack / 5) if self.truth is not None else []

    def overlapping(self, least, near):
        """Pairs of scans of one body that share as much of the smaller, within so many spacings."""
        world = [moved(pose, p) for pose, p in zip(self.truth, self.points, strict=True)]
        turned = [n @ pose[:3, :3].T for pose, n in zip(self.truth, self.normals, strict=True)]
        trees = [cKDTree(p) for p in world]
        found = []
        for a in range(len(world)):
            for b in range(a):
                small, large = sorted((a, b), key=lambda k: len(world[k]))
                if self.bodies[a] != self.bodies[b]:
                    continue
                some = self.some[small]
                limit = near * max(self.spacings[a], self.spacings[b])
                if lying(world[small][some], turned[small][some], trees[large], turned[large], limit) >= least:
                    found.append((b, a))
        return found

    def off(self, found_from_truth, pose, k):
        """The furthest that a sample of a scan is from where it belongs, in spacings."""
        points = self.points[k][self.some[k]]
        away = moved(found_from_truth @ self.truth[k], points) - moved(pose, points)
        return np.linalg.norm(away, axis=1).max() / self.spacings[k]

    def errors(self, poses):
        """How far each placed scan is off, in spacings, where its body fits that makes least wrong."""
        placed = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
        best, least = np.full(len(poses), np.nan), None
        for body, found_from_truth in self.fits(poses, placed):
            found = np.full(len(poses), np.nan)
            for k in placed:
                found[k] = self.off(found_from_truth, poses[k], k) if self.bodies[k] == body else np.inf
            cost = (found[placed] > self.limit).sum(), found[placed].max()
            if least is None or cost < least:
                best, least = found, cost
        return best

    def fits(self, poses, placed):
        """The motions that lay the truth on what was found: by each scan of some, and by all scans of a body."""
        for k in placed[:: max(1, len(placed) // 30)]:
            yield self.bodies[k], poses[k] @ np.linalg.inv(self.truth[k])
        for body in sorted({self.bodies[k] for k in placed}):
            of = [k for k in placed if self.bodies[k] == body]
            points = [self.points[k][self.some[k]] for k in of]
            truth = np.concatenate([moved(self.truth[k], p) for k, p in zip(of, points, strict=True)])
            found = np.concatenate([moved(poses[k], p) for k, p in zip(of, points, strict=True)])
            yield body, fitted(truth, found)

    def pairs_found(self, poses):
        """How many pairs lie rightly to each other."""
        placed = np.isfinite(poses).all(axis=(1, 2))
        return sum(
            placed[a] and placed[b] and self.off(poses[a] @ np.linalg.inv(self.truth[a]), poses[b], b) <= self.limit
            for a, b in self.pairs
        )

    def squares(self, poses):
        """Squared distances of samples along the normals of others' nearest samples, within two spacings."""
        placed = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
        points = {k: moved(poses[k], self.points[k]) for k in placed}
        turned = {k: self.normals[k] @ poses[k][:3, :3].T for k in placed}
        trees = {k: cKDTree(points[k]) for k in placed}
        found, pairs = [], list(itertools.permutations(placed, 2))
        for a, b in pairs[:: max(1, len(pairs) // COMPARED)]:
            some = points[b][self.some[b]]
            distance, nearest = trees[a].query(some, distance_upper_bound=2 * self.spacings[a])
            near = np.isfinite(distance)
            same = (turned[b][self.some[b]][near] * turned[a][nearest[near]]).sum(1) > 0.7
            off = ((some[near] - points[a][nearest[near]]) * turned[a][nearest[near]]).sum(1)
            found.append(off[same] ** 2)
        return np.concatenate(found) if found else np.empty(0)

    def squared_errors(self, poses, told):
        """Squared errors of the poses by what their covariances say, over six."""
        covariances = np.array(told["covariance"])
        placed = np.isfinite(poses).all(axis=(1, 2))
        kept = next((k for k, c in enumerate(covariances) if placed[k] and not np.any(c)), None)
        found = []
        for k, covariance in enumerate(covariances):
            if kept is None or k == kept or not placed[k] or not covariance.any():
                continue
            found_from_truth = poses[kept] @ np.linalg.inv(self.truth[kept])
            error = found_from_truth @ self.truth[k] @ np.linalg.inv(poses[k])
            middle = np.array(told["middle"][k])
            turn = 0.5 * np.array([error[2, 1] - error[1, 2], error[0, 2] - error[2, 0], error[1, 0] - error[0, 1]])
            motion = np.concatenate([turn, moved(error, middle[None])[0] - middle])
            size = np.ptp(self.points[k], axis=0).max()
            unit = np.array([size] * 3 + [1.0] * 3)
            found.append((motion * unit) @ np.linalg.solve(covariance * np.outer(unit, unit), motion * unit) / 6)
        return found


def fitted(points, others):
    """The rigid motion that brings points nearest to others, by least squares."""
    u, _, v = np.linalg.svd((points - points.mean(0)).T @ (others - others.mean(0)))
    motion = np.eye(4)
    motion[:3, :3] = v.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(v.T @ u.T))]) @ u.T
    motion[:3, 3] = others.mean(0) - motion[:3, :3] @ points.mean(0)
    return motion


def moved(pose, points):
    """The points elsewhere."""
    return points @ pose[:3, :3].T + pose[:3, 3]


def normals(scan):
    """Unit normals of a mesh's vertices, or those that a cloud has."""
    return of_corners(scan.positions, scan.triangles) if hasattr(scan, "triangles") else scan.normals
