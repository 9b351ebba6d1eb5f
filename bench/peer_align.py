"""One tool on the sets of a case, in a process of its own: peer_align.py TOOL FOLDER OUT.

FOLDER is from align_cases.py. Writes the poses found to OUT, NaN for scans that are left out, and what the tool says
of them to OUT.json. The tool `snap` reads OUT instead, and says how long our `Aligner.snap` takes there. Only what the
tool needs is imported.
"""

import itertools
import json
import sys
import time
from pathlib import Path

import numpy as np

# Ours runs on one thread, as do the peers that ask for a number.
THREADS = 1


def read(place):
    """A set's scans as our package has them."""
    import surfrecon

    if (place / "scans.conf").is_file():
        return surfrecon.open(place / "scans.conf")
    return [surfrecon.read(file) for file in sorted(place.glob("scan*.ply"))]


def told_by(found):
    """Poses of an alignment of ours, and what it says of them."""
    report = found.report
    told = {
        "reasons": [scan.reason for scan in report.scans if scan.reason],
        "covariance": [scan.covariance.tolist() for scan in report.scans],
        "middle": [scan.middle for scan in report.scans],
    }
    return [None if pose is None or not report.placed else pose for pose in found.world_from_scan], told


def surfrecon(place):
    """Ours, which is told nothing."""
    import surfrecon

    return told_by(surfrecon.align(read(place), threads=THREADS))


def surfrecon_rough(place):
    """Ours from rough poses."""
    import surfrecon

    images = [scan.read() for scan in read(place)]
    for image, pose in zip(images, np.load(place / "rough.npy"), strict=True):
        image.world_from_sensor = pose
    return told_by(surfrecon.align(images, start="rough", threads=THREADS))


def snap(place, poses):
    """Milliseconds that it takes to draw each placed scan back to the others, from a rough pose."""
    import surfrecon
    from align_cases import displaced

    scans = read(place)
    placed = [k for k, pose in enumerate(poses) if np.isfinite(pose).all()]
    if len(placed) < 2:
        return []
    aligner = surfrecon.Aligner(scans, threads=THREADS)
    known = [pose if k in placed else None for k, pose in enumerate(poses)]
    generator, found = np.random.default_rng(5), []
    for k in placed:
        start = displaced(generator, poses[k], samples(scans[k]))
        began = time.perf_counter()
        aligner.snap(k, start, poses=known, threads=THREADS)
        found.append(1e3 * (time.perf_counter() - began))
    return found


def samples(scan):
    """Points of a scan in its own frame."""
    content = scan.read() if hasattr(scan, "read") else scan
    return content.points[content.valid] if hasattr(content, "valid") else content.positions


class Clouds:
    """A set's scans as Open3D has them, thinned as its tutorials do.

    The cell, which it has no rule for, is three spacings, and at least a 300th of the extent, for points crowd near
    scanners of wide surroundings: the tutorials have 5 cm in a living room, and KISS-Matcher's 0.3 m in a street.
    """

    # Towards where scans are seen from: range grids from +z.
    FACING = (0.0, 0.0, 1.0)

    def __init__(self, place, cell=None):
        import open3d

        self.raw = self.raw_of(place)
        self.spacing = float(np.median(np.asarray(self.raw[0].compute_nearest_neighbor_distance())))
        extent = np.linalg.norm(self.raw[0].get_max_bound() - self.raw[0].get_min_bound())
        self.cell = cell or float(max(3 * self.spacing, extent / 300))
        self.down = []
        for cloud in self.raw:
            down = cloud.voxel_down_sample(self.cell)
            if not cloud.has_normals():
                down.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(radius=2 * self.cell, max_nn=30))
                down.orient_normals_to_align_with_direction(self.FACING)
            self.down.append(down)

    def raw_of(self, place):
        """The scans as they are."""
        import open3d

        return [open3d.io.read_point_cloud(str(file)) for file in sorted(place.glob("scan*.ply"))]

    def pairs(self):
        """All of them."""
        return itertools.combinations(range(len(self.raw)), 2)

    def features(self):
        """FPFH of each."""
        return [self.feature(cloud) for cloud in self.down]

    def feature(self, cloud):
        """FPFH, as the tutorial on global registration has them."""
        from open3d import geometry
        from open3d.pipelines import registration

        near = geometry.KDTreeSearchParamHybrid(radius=5 * self.cell, max_nn=100)
        return registration.compute_fpfh_feature(cloud, near)

    def joined(self, edges):
        """Poses by Open3D's pose graph, from the poses of pairs that overlap.

        As in its reconstruction system, an edge puts three tenths of the smaller scan within 1.4 cells of the other.
        Placed are the most scans that edges join.
        """
        from open3d.pipelines import registration

        graph, kept, reach = registration.PoseGraph(), {}, 1.4 * self.cell
        for (a, b), pose in edges.items():
            information = registration.get_information_matrix_from_point_clouds(self.down[b], self.down[a], reach, pose)
            share = information[5, 5] / min(len(self.down[a].points), len(self.down[b].points))
            if share >= 0.3:
                kept[a, b] = pose, share
                graph.edges.append(registration.PoseGraphEdge(b, a, pose, information, uncertain=True))
        starts = largest(len(self.down), kept)
        if len(starts) < 2:
            return [None] * len(self.down)
        for k in range(len(self.down)):
            graph.nodes.append(registration.PoseGraphNode(starts.get(k, np.eye(4))))
        registration.global_optimization(
            graph,
            registration.GlobalOptimizationLevenbergMarquardt(),
            registration.GlobalOptimizationConvergenceCriteria(),
            registration.GlobalOptimizationOption(
                max_correspondence_distance=reach, edge_prune_threshold=0.25, reference_node=min(starts)
            ),
        )
        return [graph.nodes[k].pose if k in starts else None for k in range(len(self.down))]


def largest(count, kept):
    """The most scans that edges join, with poses along those that overlap most: what is optimized must start near."""
    best = {}
    for first in range(count):
        if first in best:
            continue
        poses = {first: np.eye(4)}
        while True:
            ways = [pair for pair in kept if (pair[0] in poses) != (pair[1] in poses)]
            if not ways:
                break
            a, b = max(ways, key=lambda pair: kept[pair][1])
            pose = kept[a, b][0]
            if a in poses:
                poses[b] = poses[a] @ pose
            else:
                poses[a] = poses[b] @ np.linalg.inv(pose)
        best = poses if len(poses) > len(best) else best
    return best


def open3d(place, pairwise):
    """Open3D's global registration of all pairs, and ICP as far as its reconstruction system, then its tutorial."""
    from open3d.pipelines import registration

    clouds, edges = Clouds(place), {}
    features = clouds.features()
    for a, b in clouds.pairs():
        source, target = clouds.down[b], clouds.down[a]
        first = pairwise(registration, source, target, features[b], features[a], clouds.cell)
        for reach in (1.4 * clouds.cell, 0.4 * clouds.cell):
            first = registration.registration_icp(
                source, target, reach, first, registration.TransformationEstimationPointToPlane()
            ).transformation
        edges[a, b] = first
    return clouds.joined(edges), {}


def ransac(registration, source, target, of_source, of_target, cell):
    """RANSAC on features."""
    return registration.registration_ransac_based_on_feature_matching(
        source,
        target,
        of_source,
        of_target,
        True,
        1.5 * cell,
        registration.TransformationEstimationPointToPoint(False),
        3,
        [
            registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
            registration.CorrespondenceCheckerBasedOnDistance(1.5 * cell),
        ],
        registration.RANSACConvergenceCriteria(100_000, 0.999),
    ).transformation


def fast(registration, source, target, of_source, of_target, cell):
    """Fast global registration."""
    return registration.registration_fgr_based_on_feature_matching(
        source,
        target,
        of_source,
        of_target,
        registration.FastGlobalRegistrationOption(maximum_correspondence_distance=0.5 * cell),
    ).transformation


class Refining:
    """GICP of small_gicp, with its defaults: a cell is their 0.25 m, so that distances in metres mean the same."""

    METRES = 0.25

    def __init__(self, clouds):
        import small_gicp

        self.scale = self.METRES / clouds.cell
        points = [self.scale * np.asarray(cloud.points) for cloud in clouds.raw]
        self.ready = [small_gicp.preprocess_points(p, num_threads=THREADS) for p in points]

    def refine(self, a, b, first):
        """The pose of scan b in the frame of scan a, from a rough one."""
        import small_gicp

        target, tree = self.ready[a]
        found = small_gicp.align(
            target, self.ready[b][0], tree, scaled(first, self.scale), num_threads=THREADS
        ).T_target_source
        return scaled(found, 1 / self.scale)


def scaled(pose, scale):
    """The pose in another unit."""
    pose = np.array(pose)
    pose[:3, 3] *= scale
    return pose


def kiss(place, clouds_of=Clouds):
    """KISS-Matcher of all pairs, small_gicp from there, and Open3D's pose graph.

    KISS-Matcher registers pairs only, and coarsely. Its configuration follows from the cell, by default 0.3 m; scans
    are scaled to that, for it takes no cell below 5 mm. By its example a result counts with five inliers or more.
    """
    import kiss_matcher

    clouds, edges = clouds_of(place), {}
    refining, scale = Refining(clouds), 0.3 / clouds.cell
    points = [(scale * np.asarray(cloud.points)).astype(np.float32) for cloud in clouds.raw]
    for a, b in clouds.pairs():
        matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(0.3))
        found = matcher.estimate(points[b], points[a])
        if matcher.get_num_final_inliers() >= 5:
            first = np.eye(4)
            first[:3, :3], first[:3, 3] = found.rotation, np.ravel(found.translation) / scale
            edges[a, b] = refining.refine(a, b, first)
    return clouds.joined(edges), {}


def gicp_rough(place, clouds_of=Clouds):
    """small_gicp on pairs that overlap by rough poses, and Open3D's pose graph."""
    clouds, edges = clouds_of(place), {}
    refining, rough = Refining(clouds), np.load(place / "rough.npy")
    for a, b in clouds.pairs():
        first = np.linalg.inv(rough[a]) @ rough[b]
        distances = type(clouds.down[b])(clouds.down[b]).transform(first).compute_point_cloud_distance(clouds.down[a])
        # A pair is looked at as far as GICP reaches, by default four cells.
        if np.mean(np.asarray(distances) < 4 * clouds.cell) > 0.1:
            edges[a, b] = refining.refine(a, b, first)
    return clouds.joined(edges), {}


def meshlab_rough(place):
    """MeshLab's Global Align Meshes from rough poses.

    It measures in absolute units, for a device whose error is far below 1: scans are scaled to a spacing of 1. The
    distance up to which samples count must reach what poses are off; pairs share a tenth, as for the others; the rest
    are its defaults. Meshes that it could not align stay where they are, and nothing says so.
    """
    import pymeshlab

    rough, meshes = np.load(place / "rough.npy"), pymeshlab.MeshSet(verbose=False)
    scale = 1 / Clouds(place).spacing
    starts = [scaled(pose, scale) for pose in rough]
    for file, start in zip(sorted(place.glob("scan*.ply")), starts, strict=True):
        meshes.load_new_mesh(str(file))
        meshes.set_matrix(transformmatrix=start @ np.diag([scale, scale, scale, 1.0]), freeze=True)
    size = meshes.mesh(0).bounding_box().diagonal()
    meshes.compute_matrix_by_mesh_global_alignment(arcthreshold=0.1, mindistabs=0.06 * size)
    found = [meshes.mesh(k).transform_matrix() @ start for k, start in enumerate(starts)]
    return [scaled(pose, 1 / scale) for pose in found], {}


TOOLS = {
    "surfrecon": surfrecon,
    "surfrecon-rough": surfrecon_rough,
    "open3d-ransac": lambda place: open3d(place, ransac),
    "open3d-fgr": lambda place: open3d(place, fast),
    "kiss-matcher": kiss,
    "small_gicp-rough": gicp_rough,
    "meshlab-rough": meshlab_rough,
}


def main(tools):
    """Runs the tool on each set."""
    tool, folder, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    poses, told = {}, []
    for place in sorted(folder.glob("set*")):
        if tool == "snap":
            told += snap(place, np.load(out)[place.name])
            continue
        found, said = tools[tool](place)
        poses[place.name] = np.stack([np.full((4, 4), np.nan) if pose is None else pose for pose in found])
        told.append(said)
    if poses:
        np.savez(out, **poses)
    Path(f"{out}.json").write_text(json.dumps(told))


if __name__ == "__main__":
    main(TOOLS)
