# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings of depth cameras and phones: some frames become objects, one more object stands for all others.

That object is an empty with custom properties: the files, how they are read, which frames it stands for, and how many
units of the scene a unit of the files has. Its matrix places the recording in the world, so its frames go where it is
moved. They are read from the files when they are merged or aligned, one by one. Saving, undo and copies keep them.
"""

import os

import bpy
import numpy as np
import surfrecon

from . import scan_objects
from .running import Refused, Task, waited

# The files, a line each; keyword arguments of `surfrecon.open`; numbers of the frames, and how many there are in all;
# units of the scene a unit of the files; poses after aligning, 12 numbers a frame: the upper rows of the matrix that
# takes its samples, in the scene's unit, into the frame of the object.
PATHS, OPTIONS, FRAMES = "recording_paths", "recording_options", "recording_frames"
TOTAL, SCALE, POSES = "recording_total", "recording_scale", "recording_poses"

# Regions that keep or remove samples, 18 numbers each, in the frame of the object: 1 for a plane and 0 for a box, 1
# where what it holds is kept, and a matrix by rows: of a box, or with a plane's point, normal and margin as columns.
SELECTIONS = "recording_selections"

# Places of the frames when regions were drawn, before aligning moved them: for each such time how many regions there
# were by then, whether aligning had put the frames there, and their poses as above. Samples are kept, not places.
FORMER = "recording_former_poses"

# Of the object of one frame: its number, and the first of the files.
NUMBER, SOURCE = "recording_frame", "recording_source"

# One such file of a recording stands for all of it: images, lists and cameras, which alone are no scan with a place.
PARTS = {".png", ".jpg", ".jpeg", ".exr", ".json", ".txt", ".log", ".csv", ".freiburg", ".depth"}

# How much the axes of a matrix may differ in length and still be scaled alike: what single precision leaves.
ALIKE = 1e-5


def spread(preferred, most):
    """At most so many of the frames that these flags are of, spread evenly over them: of each of equal parts the one
    nearest to its middle, of those that are preferred if any is.
    """
    count = len(preferred)
    most = min(most, count)
    chosen = []
    for k in range(most):
        middle = (2 * k + 1) * count // (2 * most)
        part = range(k * count // most, (k + 1) * count // most)
        chosen.append(min(part, key=lambda i: (not preferred[i], abs(i - middle))))
    return chosen


def opened(paths, whole, options):
    """The paths that were opened and the scans in them. It is a generator for `launch`.

    One file of a recording that does not open as one stands for the whole of it, if `whole` says so: Blender lets files
    be dropped, but no folders.
    """
    folder = None
    if whole and len(paths) == 1 and os.path.splitext(paths[0])[1].lower() in PARTS and os.path.isfile(paths[0]):
        folder = surfrecon.recording_of(os.path.abspath(paths[0]))
    try:
        scans = yield from waited(surfrecon.Job.open(paths, **options))
    except (surfrecon.FormatError, surfrecon.InputError):
        if folder is None:
            raise
        scans = ()
    if folder is not None and not any(isinstance(scan, surfrecon.Frame) for scan in scans):
        paths = [str(folder)]
        scans = yield from waited(surfrecon.Job.open(paths, **options))
    return paths, scans


def reading(scans):
    """A job that reads scans: a list of what each holds and, of a frame, its `surfrecon.Camera`, else `None`.

    Of a frame among others whose images are damaged the error stands for what it holds.
    """

    def read(note):
        found = []
        for k, scan in enumerate(scans):

            def told(_, share, k=k):
                note((k + share) / len(scans))

            is_frame = isinstance(scan, surfrecon.Frame)
            try:
                content = scan.read(progress=told)
            except surfrecon.FormatError as problem:
                if not is_frame or len(scans) == 1:
                    raise
                content = problem
            found.append((content, scan.camera if is_frame else None))
            note((k + 1) / len(scans))
        return found

    return Task("Reading the frames", read)


def stand_for(name, paths, options, frames, total, scale):
    """An object that stands for frames of the files. It is linked nowhere yet. It lies at the origin of the files."""
    obj = bpy.data.objects.new(name, None)
    obj.empty_display_type = "SPHERE"
    obj[PATHS] = "\n".join(os.path.abspath(path) for path in paths)
    # Custom properties can't hold nothing.
    obj[OPTIONS] = {key: value for key, value in options.items() if value is not None}
    obj[FRAMES], obj[TOTAL], obj[SCALE] = list(frames), total, float(scale)
    return obj


def note_frame(obj, paths, number):
    """Notes with the object of a frame where it stands in its recording: names can be changed."""
    obj[NUMBER], obj[SOURCE] = number, os.path.abspath(paths[0])


def in_order(objects, found):
    """The (object, scan) of what `gathered` found of objects: in the order of their recordings where all are of
    some, else in that of the objects.
    """
    listed, places = [], []
    for obj, part in zip(objects, found, strict=True):
        if is_recording(obj):
            source = obj[PATHS].split("\n")[0]
            places += [(source, number) for number in obj[FRAMES]]
        else:
            places.append((obj[SOURCE], obj[NUMBER]) if NUMBER in obj and SOURCE in obj else None)
        listed += [(obj, scan) for scan in of_all([part])]
    if None in places:
        return listed
    return [listed[k] for k in sorted(range(len(listed)), key=lambda k: places[k])]


def is_recording(obj):
    """Whether an object stands for frames of a recording."""
    return obj is not None and obj.type == "EMPTY" and all(key in obj for key in (PATHS, FRAMES, TOTAL, SCALE))


def frames(obj, depsgraph):
    """The frames that an object stands for, placed as it is. Their samples are still in the files. It is a generator
    for `gathered`.

    Raises `Refused` with a sentence if the files are gone or have changed.
    """
    name, numbers, total, poses, scale = obj.name, list(obj[FRAMES]), obj[TOTAL], poses_of(obj), obj[SCALE]
    world_from_recording = placement(obj, depsgraph)
    regions, former = selections(obj, world_from_recording), former_poses(obj)
    paths = [bpy.path.abspath(path) for path in obj[PATHS].split("\n")]
    options = obj[OPTIONS].to_dict() if OPTIONS in obj else {}
    try:
        scans = yield from waited(surfrecon.Job.open(paths, **options))
    except surfrecon.Cancelled:
        raise
    except (surfrecon.SurfreconError, TypeError) as problem:
        raise Refused(
            f'"{name}" stands for frames of {paths[0]}, which cannot be opened: put them back there, or write'
            f" their new place into the custom property {PATHS} ({problem})"
        ) from problem
    if len(scans) != total or not numbers or not 0 <= min(numbers) <= max(numbers) < total:
        raise Refused(
            f'"{name}" was made when {paths[0]} had {total:,} frames, and now it has {len(scans):,}: import it again'
        )
    found = []
    for k, number in enumerate(numbers):
        pose = None if poses is None else poses[k]
        first = former[0][1] if former else poses
        scan = moved(scans[number], world_from_recording, scale, None if first is None else first[k])
        done = 0
        for count, then in former:
            scan = scan if then is first else at_pose(scan, world_from_recording, then[k])
            scan, done = selected(scan, regions[done:count]), count
        scan = at_pose(scan, world_from_recording, pose) if former else scan
        found.append(selected(scan, regions[done:]))
    return found


def selected(scan, regions):
    """The part of a scan that regions keep or leave."""
    for region, keep in regions:
        scan = scan.keep(region) if keep else scan.remove(region)
    return scan


def at_pose(scan, world_from_recording, pose):
    """A scan that is as large as it is to be, at a pose in the frame of the recording's object."""
    size = np.cbrt(np.linalg.det(world_from_recording[:3, :3]))
    world_from_sensor = world_from_recording @ pose
    world_from_sensor[:3, :3] /= size
    return scan.transformed(surfrecon.Similarity(world_from_sensor @ np.linalg.inv(np.array(scan.world_from_sensor))))


def moved(scan, world_from_recording, scale, pose):
    """A scan where the recording's object and, if it was aligned, its own pose put it. It stays in its file."""
    scaled = np.diag([scale, scale, scale, 1.0])
    similarity = world_from_recording @ scaled
    if pose is not None:
        similarity = world_from_recording @ pose @ scaled @ np.linalg.inv(np.array(scan.world_from_sensor))
    if np.array_equal(similarity, np.eye(4)):
        return scan
    return scan.transformed(surfrecon.Similarity(similarity))


def placement(obj, depsgraph):
    """4 x 4 float64: from the recording to the world. It refuses what no frame can be: stretched, flattened,
    mirrored.
    """
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)
    if not np.isfinite(matrix).all():
        raise Refused(f'"{obj.name}" has a location, rotation or scale that is no number: check it in N, Item')
    left, stretch, right = np.linalg.svd(matrix[:3, :3])
    mirrored = np.linalg.det(left @ right) < 0
    if mirrored or stretch[0] == 0 or stretch[0] - stretch[2] > ALIKE * stretch[0]:
        raise Refused(
            f'"{obj.name}" is scaled differently along its axes or mirrored, which frames cannot be:'
            " give it and its parents one scale above 0 along all axes"
        )
    size = 1.0 if abs(stretch[1] - 1) < ALIKE else stretch[1]
    matrix[:3, :3] = size * left @ right
    return matrix


def refuse_scaled(obj, depsgraph):
    """Refuses an object whose frames are not as large as they were imported: aligning moves and turns only."""
    matrix = placement(obj, depsgraph)
    if abs(np.linalg.det(matrix[:3, :3]) - 1) > ALIKE:
        raise Refused(
            f'"{obj.name}" is scaled, and aligning moves and turns only: set its scale and its parents\' to 1'
        )
    return matrix


def poses_of(obj):
    """(n, 4, 4) float64: where aligning has put the frames, or `None` where the files say."""
    rows = np.array(obj.get(POSES, ()), np.float64)
    return matrices(rows) if rows.size == 12 * len(obj[FRAMES]) else None


def matrices(rows):
    """(n, 4, 4) float64 of their upper rows, 12 numbers each."""
    poses = np.tile(np.eye(4), (rows.size // 12, 1, 1))
    poses[:, :3] = rows.reshape(-1, 3, 4)
    return poses


def former_poses(obj):
    """The places of the frames when regions were drawn, in order: how many regions by then, the poses or `None`."""
    rows = np.array(obj.get(FORMER, ()), np.float64).reshape(-1, 2 + 12 * len(obj[FRAMES]))
    return [(int(row[0]), matrices(row[2:]) if row[1] else None) for row in rows]


def put(obj, world_from_recording, world_from_frames):
    """Notes where frames lie now, in the world. The object stays where it is."""
    count = len(obj.get(SELECTIONS, ())) // 18
    former = list(obj.get(FORMER, ()))
    width = 2 + 12 * len(obj[FRAMES])
    if count > (former[-width] if former else 0):
        poses = obj.get(POSES)
        rows = np.zeros(width - 2) if poses is None else poses
        obj[FORMER] = [*former, float(count), float(poses is not None), *rows]
    recording_from_world = np.linalg.inv(world_from_recording)
    obj[POSES] = np.concatenate([(recording_from_world @ pose)[:3].reshape(-1) for pose in world_from_frames]).tolist()


def note_selection(obj, region, keep, world_from_recording):
    """Notes that frames keep what a region of the world holds, a `surfrecon.Plane` or a box's matrix, or are without
    it, whenever they are read.
    """
    rows = np.zeros((4, 4))
    recording_from_world = np.linalg.inv(world_from_recording)
    is_plane = isinstance(region, surfrecon.Plane)
    if is_plane:
        size = np.cbrt(np.linalg.det(recording_from_world[:3, :3]))
        rows[:, 0] = recording_from_world @ [*region.point, 1]
        rows[:3, 1] = recording_from_world[:3, :3] @ region.normal / size
        rows[0, 2] = region.margin * size
    else:
        rows = recording_from_world @ region
    obj[SELECTIONS] = [*obj.get(SELECTIONS, ()), float(is_plane), float(keep), *rows.reshape(-1).tolist()]


def selections(obj, world_from_recording):
    """The regions, in the world, and whether each is kept."""
    size = np.cbrt(np.linalg.det(world_from_recording[:3, :3]))
    found = []
    for is_plane, keep, *numbers in np.array(obj.get(SELECTIONS, ()), np.float64).reshape(-1, 18):
        rows = np.array(numbers).reshape(4, 4)
        if is_plane:
            point, normal = world_from_recording @ [*rows[:3, 0], 1], world_from_recording[:3, :3] @ rows[:3, 1]
            found.append((surfrecon.Plane(point[:3], normal, margin=rows[0, 2] * size), bool(keep)))
        else:
            found.append((surfrecon.Box(world_from_recording @ rows), bool(keep)))
    return found


def grow(obj, scale):
    """Scales the frames about the origin of the object's frame."""
    obj[SCALE] = obj[SCALE] * scale
    poses = poses_of(obj)
    if poses is not None:
        poses[:, :3, 3] *= scale
        obj[POSES] = poses[:, :3].reshape(-1).tolist()
    if FORMER in obj:
        former = np.array(obj[FORMER], np.float64).reshape(-1, 2 + 12 * len(obj[FRAMES]))
        for row in former:
            row[2:].reshape(-1, 3, 4)[:, :, 3] *= scale
        obj[FORMER] = former.reshape(-1).tolist()
    if SELECTIONS in obj:
        stored = np.array(obj[SELECTIONS], np.float64).reshape(-1, 18)
        for one in stored:
            rows = one[2:].reshape(4, 4)
            if one[0]:
                rows[:3, 0] *= scale
                rows[0, 2] *= scale
            else:
                rows[:3] *= scale
        obj[SELECTIONS] = stored.reshape(-1).tolist()
    obj.empty_display_size *= scale


def scan_or_frames(obj, depsgraph):
    """The scan of an object for merging and measuring: a scan, or a generator of the frames that it stands for."""
    return frames(obj, depsgraph) if is_recording(obj) else scan_objects.scan_of_object(obj, depsgraph)


def of_all(found):
    """The scans of `gathered` as one list: a scan of an object, or the frames that it stands for."""
    return [scan for part in found for scan in (part if isinstance(part, list) else [part])]
