"""One tool on the sets of a case, in a process of its own: peer_align.py TOOL FOLDER OUT.

FOLDER is from align_cases.py. Writes the poses found to OUT, NaN for scans that are left out. Only what the tool needs
is imported.
"""

import itertools
import json
import sys
from pathlib import Path

import numpy as np


def surfrecon(place):
    """Ours, on one thread."""
    import surfrecon

    found = surfrecon.align(surfrecon.open(place / "scans.conf"), threads=1)
    report = found.report
    told = {
        "deviation": [scan.deviation for scan in report.scans],
        "reasons": [scan.reason for scan in report.scans if scan.reason],
        "covariance": [scan.covariance.tolist() for scan in report.scans],
        "middle": [scan.middle for scan in report.scans],
    }
    return [None if pose is None or not report.placed else pose for pose in found.world_from_scan], told


def open3d(place, pairwise):
    """Open3D's global registration of all pairs, ICP and its pose graph, as its tutorials have it.

    The cell, which it has no rule for, is three spacings; pairs with a fitness below 0.3 after ICP are no edges.
    """
    import open3d
    from open3d.pipelines import registration

    clouds, features = [], []
    files = sorted(place.glob("scan*.ply"))
    raw = [open3d.io.read_point_cloud(str(file)) for file in files]
    cell = 3 * float(np.median(np.asarray(raw[0].compute_nearest_neighbor_distance())))
    for cloud in raw:
        down = cloud.voxel_down_sample(cell)
        down.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(radius=2 * cell, max_nn=30))
        # Range grids are seen from +z.
        down.orient_normals_to_align_with_direction((0.0, 0.0, 1.0))
        clouds.append(down)
        features.append(
            registration.compute_fpfh_feature(
                down, open3d.geometry.KDTreeSearchParamHybrid(radius=5 * cell, max_nn=100)
            )
        )
    graph = registration.PoseGraph()
    for _ in clouds:
        graph.nodes.append(registration.PoseGraphNode(np.eye(4)))
    edges = {}
    for a, b in itertools.combinations(range(len(clouds)), 2):
        first = pairwise(registration, clouds[b], clouds[a], features[b], features[a], cell)
        fine = registration.registration_icp(
            clouds[b], clouds[a], 0.4 * cell, first, registration.TransformationEstimationPointToPlane()
        )
        if fine.fitness < 0.3:
            continue
        information = registration.get_information_matrix_from_point_clouds(
            clouds[b], clouds[a], 0.4 * cell, fine.transformation
        )
        edges[a, b] = fine.transformation
        graph.edges.append(registration.PoseGraphEdge(b, a, fine.transformation, information, uncertain=True))
    # What it optimizes must start near: poses along edges from the first scan.
    poses = {0: np.eye(4)}
    while True:
        more = [
            (b, poses[a] @ t) if a in poses else (a, poses[b] @ np.linalg.inv(t))
            for (a, b), t in edges.items()
            if (a in poses) != (b in poses)
        ]
        if not more:
            break
        poses[more[0][0]] = more[0][1]
    for k, pose in poses.items():
        graph.nodes[k].pose = pose
    registration.global_optimization(
        graph,
        registration.GlobalOptimizationLevenbergMarquardt(),
        registration.GlobalOptimizationConvergenceCriteria(),
        registration.GlobalOptimizationOption(
            max_correspondence_distance=0.4 * cell, edge_prune_threshold=0.25, reference_node=0
        ),
    )
    alone = len(poses) == 1
    return [None if alone or k not in poses else graph.nodes[k].pose for k in range(len(clouds))], {}


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


TOOLS = {
    "surfrecon": surfrecon,
    "open3d-ransac": lambda place: open3d(place, ransac),
    "open3d-fgr": lambda place: open3d(place, fast),
}


def main():
    """Runs the tool on each set."""
    tool, folder, out = sys.argv[1], Path(sys.argv[2]), sys.argv[3]
    poses, told = {}, []
    for place in sorted(folder.glob("set*")):
        found, said = TOOLS[tool](place)
        poses[place.name] = np.stack([np.full((4, 4), np.nan) if pose is None else pose for pose in found])
        told.append(said)
    np.savez(out, **poses)
    print(json.dumps(told))


if __name__ == "__main__":
    main()
