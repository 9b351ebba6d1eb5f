"""One tool on the recordings of a case, in a process of its own: peer_rooms.py TOOL FOLDER OUT.

FOLDER is from room_cases.py. Writes what peer_align.py does, poses of the camera: x right, y down, z forward. Only what
the tool needs is imported. All use depth alone, on one thread where they ask for a number.
"""

import itertools
import json

import numpy as np
import peer_align
from peer_align import THREADS, told_by

# How far rough poses may be off, in metres.
REACH = 0.3
# The defaults of Open3D's reconstruction system and its dense SLAM, in metres: cells of the volume, how far
# surfaces of neighbouring frames may lie apart, cells of thinned clouds. Depth is used up to what a Kinect measures.
VOLUME_CELL, APART, CELL, FARTHEST = 3 / 512, 0.07, 0.05, 4.5
# Frames of a fragment, and every how many frames of it loops are looked for.
FRAGMENT, LOOPS = 100, 10


def camera_of(place):
    """The camera of a recording, and its files."""
    return json.loads((place / "camera.json").read_text()), sorted(place.glob("frame_*.png"))


def surfrecon(place):
    """Ours, as the way says."""
    import surfrecon

    known, files = camera_of(place)
    scans = surfrecon.open(files, camera=(*known["focal"], *known["centre"]), scale=1 / known["per_metre"])
    if not (place / "rough.npy").is_file():
        start = {"sequence": "sequence", "heap": "unknown"}[known["way"]]
        return told(surfrecon.align(scans, start=start, threads=THREADS))
    images = [scan.read() for scan in scans]
    for image, pose in zip(images, np.load(place / "rough.npy"), strict=True):
        image.world_from_sensor = pose
    return told(surfrecon.align(images, start="rough", reach=REACH, threads=THREADS))


def told(found):
    """Poses, and what ours says of each frame: how far it may be off."""
    poses, said = told_by(found)
    report = found.report
    return poses, {
        "reasons": said["reasons"],
        "deviation": [min(scan.deviation, 1e9) for scan in report.scans],
        "states": [scan.state for scan in report.scans],
        "messages": report.messages,
    }


class Frames(peer_align.Clouds):
    """A recording as clouds."""

    FACING = (0.0, 0.0, -1.0)

    def raw_of(self, place):
        """A cloud of each image."""
        import open3d

        known, files = camera_of(place)
        found = []
        for file in files:
            image = open3d.io.read_image(str(file))
            rows, cols = np.asarray(image).shape
            camera = open3d.camera.PinholeCameraIntrinsic(cols, rows, *known["focal"], *known["centre"])
            found.append(
                open3d.geometry.PointCloud.create_from_depth_image(
                    image, camera, depth_scale=known["per_metre"], depth_trunc=FARTHEST
                )
            )
        return found

    def union(self, numbers, poses):
        """Frames with poses as one thinned cloud."""
        whole = sum(
            (type(self.down[k])(self.down[k]).transform(p) for k, p in zip(numbers, poses, strict=True)),
            start=type(self.down[0])(),
        )
        return whole.voxel_down_sample(self.cell)

    def global_pose(self, source, target):
        """The pose of a cloud in another's frame, near no place."""
        from open3d.pipelines import registration

        features = [self.feature(cloud) for cloud in (source, target)]
        return peer_align.ransac(registration, source, target, *features, self.cell)


def thinned(place):
    """A recording as clouds with the cells that Open3D takes for rooms: by the spacing they would be of millimetres."""
    return Frames(place, CELL)


class Images:
    """A recording as Open3D's tensors have it, in a grey that says nothing."""

    def __init__(self, place):
        import open3d

        self.o3d = open3d
        self.known, files = camera_of(place)
        self.depths = [open3d.t.io.read_image(str(file)) for file in files]
        self.rows, self.cols = self.depths[0].rows, self.depths[0].columns
        self.grey = open3d.t.geometry.Image(np.full((self.rows, self.cols, 3), 128, np.uint8))
        (fx, fy), (cx, cy) = self.known["focal"], self.known["centre"]
        self.intrinsic = open3d.core.Tensor([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        self.scale = self.known["per_metre"]

    def odometry(self, a, b):
        """The pose of frame a in the frame of b, by depth alone, and its information; None where it finds none."""
        odometry, tensor = self.o3d.t.pipelines.odometry, self.o3d.core.Tensor
        pair = [self.o3d.t.geometry.RGBDImage(self.grey, self.depths[k]) for k in (a, b)]
        try:
            found = odometry.rgbd_odometry_multi_scale(
                *pair,
                self.intrinsic,
                tensor(np.eye(4)),
                self.scale,
                FARTHEST,
                [odometry.OdometryConvergenceCriteria(n) for n in (10, 5, 3)],
                odometry.Method.PointToPlane,
            ).transformation
            information = odometry.compute_odometry_information_matrix(
                self.depths[a], self.depths[b], self.intrinsic, found, APART, self.scale, FARTHEST
            )
        except RuntimeError:
            return None
        return found.numpy(), information.numpy()


def slam(place):
    """Open3D's dense SLAM, frame to model, as its example; a frame that fits a tenth or less has lost track."""
    images = Images(place)
    o3d, scale = images.o3d, images.scale
    device = o3d.core.Device("CPU:0")
    model = o3d.t.pipelines.slam.Model(VOLUME_CELL, 16, 20_000, o3d.core.Tensor(np.eye(4)), device)
    seen, known = (o3d.t.pipelines.slam.Frame(images.rows, images.cols, images.intrinsic, device) for _ in range(2))
    pose, poses = np.eye(4), []
    for k, depth in enumerate(images.depths):
        seen.set_data_from_image("depth", depth)
        seen.set_data_from_image("color", images.grey)
        if k:
            try:
                found = model.track_frame_to_model(seen, known, scale, FARTHEST, APART)
            except RuntimeError:
                poses.append(None)
                continue
            if found.fitness <= 0.1:
                poses.append(None)
                continue
            pose = pose @ found.transformation.numpy()
        model.update_frame_pose(k, o3d.core.Tensor(pose))
        model.integrate(seen, scale, FARTHEST, 8.0)
        model.synthesize_model_frame(known, scale, 0.1, FARTHEST, 8.0, False)
        poses.append(pose)
    return poses, {}


def optimized(edges, starts, reach, preference=0.1):
    """Poses by Open3D's pose graph: edges (a, b, pose of a in b, information, whether uncertain)."""
    from open3d.pipelines import registration

    graph = registration.PoseGraph()
    for start in starts:
        graph.nodes.append(registration.PoseGraphNode(start))
    for a, b, pose, information, uncertain in edges:
        graph.edges.append(registration.PoseGraphEdge(a, b, pose, information, uncertain=uncertain))
    registration.global_optimization(
        graph,
        registration.GlobalOptimizationLevenbergMarquardt(),
        registration.GlobalOptimizationConvergenceCriteria(),
        registration.GlobalOptimizationOption(
            max_correspondence_distance=reach,
            edge_prune_threshold=0.25,
            preference_loop_closure=preference,
            reference_node=0,
        ),
    )
    return [node.pose for node in graph.nodes]


def chained(steps):
    """Poses along a chain, from the pose of each frame in the next."""
    return list(itertools.accumulate(steps, lambda pose, step: pose @ np.linalg.inv(step), initial=np.eye(4)))


def fragment(images, first, last):
    """Poses of the frames of a fragment: odometry of neighbours, and loops between every LOOPS-th.

    Where odometry finds nothing, the system goes on as if the sensor had stood still.
    """
    edges, steps = [], []
    for k in range(first, last - 1):
        found = images.odometry(k, k + 1) or (np.eye(4), np.eye(6))
        steps.append(found[0])
        edges.append((k - first, k + 1 - first, *found, False))
    for a, b in itertools.combinations(range(first, last, LOOPS), 2):
        found = images.odometry(a, b)
        if found is not None and found[1][5, 5] / (images.rows * images.cols) > 0.3:
            edges.append((a - first, b - first, *found, True))
    return optimized(edges, chained(steps), APART) if edges else [np.eye(4)]


def closest(source, target, start, cells):
    """The pose of a cloud in another's frame by ICP, point to plane, from coarse to fine, and its information."""
    from open3d.pipelines import registration

    for cell in cells:
        start = registration.registration_icp(
            source, target, 1.4 * cell, start, registration.TransformationEstimationPointToPlane()
        ).transformation
    return start, registration.get_information_matrix_from_point_clouds(source, target, 1.4 * CELL, start)


def fragments(place):
    """Open3D's reconstruction system: fragments, their registration, the pose graph of all; its defaults.

    Of fewer than five hundred frames a fragment is a fifth of them, for theirs are taken thirty a second. A fragment's
    surface is the union of its frames' points, thinned, where theirs is taken out of a volume.
    """
    images, clouds = Images(place), Frames(place, CELL)
    length = min(FRAGMENT, max(5, len(images.depths) // 5))
    bounds = [(k, min(k + length, len(images.depths))) for k in range(0, len(images.depths), length)]
    within = [fragment(images, *bound) for bound in bounds]
    whole = [clouds.union(range(*bound), poses) for bound, poses in zip(bounds, within, strict=True)]
    steps, edges = [], []
    for k in range(len(whole) - 1):
        # The next fragment begins where this one ends.
        start = np.linalg.inv(within[k][-1])
        found = closest(whole[k], whole[k + 1], start, (CELL, CELL / 2, CELL / 4))
        steps.append(found[0])
        edges.append((k, k + 1, *found, False))
    for a, b in itertools.combinations(range(len(whole)), 2):
        if b > a + 1:
            start = clouds.global_pose(whole[a], whole[b])
            found = closest(whole[a], whole[b], start, (CELL, CELL / 2, CELL / 4))
            if found[1][5, 5] / min(len(whole[a].points), len(whole[b].points)) > 0.3:
                edges.append((a, b, *found, True))
    tops = optimized(edges, chained(steps), 1.4 * CELL, 5.0) if edges else [np.eye(4)]
    return [top @ pose for top, poses in zip(tops, within, strict=True) for pose in poses], {}


def multiway(place):
    """Open3D's multiway registration: ICP of neighbours, of pairs that overlap by these, and the pose graph."""
    from open3d.pipelines import registration

    down = Frames(place, CELL).down
    edges, steps = [], []
    for k in range(len(down) - 1):
        found = closest(down[k], down[k + 1], np.eye(4), (10 * CELL, CELL))
        steps.append(found[0])
        edges.append((k, k + 1, *found, False))
    starts = chained(steps)
    for a, b in itertools.combinations(range(len(down)), 2):
        start = np.linalg.inv(starts[b]) @ starts[a]
        near = registration.evaluate_registration(down[a], down[b], 3 * CELL, start).fitness
        if b > a + 1 and near > 0.3:
            found = closest(down[a], down[b], start, (3 * CELL, CELL))
            if found[1][5, 5] / min(len(down[a].points), len(down[b].points)) > 0.3:
                edges.append((a, b, *found, True))
    return optimized(edges, starts, 1.4 * CELL), {}


def kiss_icp(place):
    """KISS-ICP, odometry of laser scans: for depth cameras, cells of a hundredth of the farthest range, its rule."""
    from kiss_icp.config import KISSConfig
    from kiss_icp.kiss_icp import KissICP

    config = KISSConfig()
    config.data.max_range, config.data.min_range, config.data.deskew = FARTHEST, 0.1, False
    config.mapping.voxel_size = FARTHEST / 100
    config.registration.max_num_threads = THREADS
    odometry, poses = KissICP(config), []
    for cloud in Frames(place).raw:
        points = np.asarray(cloud.points)
        odometry.register_frame(points, np.zeros(len(points)))
        poses.append(odometry.last_pose.copy())
    return poses, {}


TOOLS = {
    "surfrecon": surfrecon,
    "open3d-slam": slam,
    "open3d-fragments": fragments,
    "open3d-multiway": multiway,
    "kiss-icp": kiss_icp,
    "kiss-matcher": lambda place: peer_align.kiss(place, thinned),
    "small_gicp-rough": lambda place: peer_align.gicp_rough(place, thinned),
}


if __name__ == "__main__":
    peer_align.main(TOOLS)
