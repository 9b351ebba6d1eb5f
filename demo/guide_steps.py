"""The steps of each guide, done with the scans of `made_scans.py`, as its pictures show them."""

import colorsys
from pathlib import Path

import numpy as np
import surfrecon
from guide_drawing import (
    cameras,
    dots,
    enlarged,
    false_colours,
    linear,
    made,
    samples,
    shaded,
    surface,
    wires,
)
from guide_printing import printing
from stage import scan_colour

GREY = (0.33, 0.34, 0.36)
# Degrees to the side of the heap from which the head is seen.
BACK = 290


def rainbow(k, count):
    """A colour for the k-th frame, close to those of the frames beside it."""
    return tuple(share**2.2 for share in colorsys.hls_to_rgb(k / count, 0.52, 0.62))


def read(scans):
    """The images of scans."""
    return [scan.read() if hasattr(scan, "read") else scan for scan in scans]


def many(number, thing):
    """A number with its noun."""
    return f"{number:,} {thing}"


def recordings(p):
    """Frames, where they are, and the coloured surface."""
    frames = surfrecon.open("export of a phone")
    chosen = [0, 6, 12, 18]
    above, below = [], []
    for k in chosen:
        frame = frames[k]
        depth = np.where(frame.image.valid, np.asarray(frame.image.points)[..., 2], np.nan)
        colour = np.asarray(frame.colour)[..., :3]
        above.append(p.pixels(f"recording-colour{k}", enlarged(colour, 256)))
        title = f"Frame {k}"
        below.append(p.pixels(f"recording-depth{k}", enlarged(false_colours(depth, 0.4, 1.4), 256), title))
    p.picture("recording-frames", above, below)

    images = [frame.image for frame in frames]
    poses = [np.array(frame.pose) for frame in frames]
    result = surfrecon.merge(frames)
    around = cameras(poses, 0.06, rainbow)
    heap = dots(samples(images, rainbow), 0.004, 40_000)
    everything = surface(result.mesh, coloured=True)
    size = (400, 290)
    looks = {"frame": [everything, around], "azimuth": -12, "elevation": 28, "floor": False}
    p.picture(
        "recording-placed",
        [
            p.view(
                "recording-heap", [heap, around], size, many(len(frames), "frames"), "where the phone saw them", **looks
            ),
            p.view(
                "recording-model",
                [everything],
                size,
                "One surface",
                f"{many(len(result.mesh.triangles), 'triangles')}, colours of the frames",
                **looks,
            ),
        ],
    )
    table = surfrecon.dominant_plane(frames)
    box = surfrecon.Box.between((-0.17, -0.17, 0.7), (0.17, 0.17, 1.4))
    alone = surfrecon.keep(surfrecon.remove(frames, table), box)
    statue = surfrecon.merge(alone, voxel=0.004).mesh
    coloured, plain = surface(statue, coloured=True), surface(statue)
    near = {"frame": [coloured], "azimuth": -12, "elevation": 12}
    (first, *_) = read(alone)
    grain = dots([(first.world_points()[first.valid], scan_colour(0))], 0.0016)
    p.picture(
        "recording-noise",
        [
            p.view("recording-one", [grain], (266, 380), "One frame", "noise of 2 mm", **near),
            p.view("recording-shape", [plain], (266, 380), "All frames merged", "the noise is averaged out", **near),
            p.view(
                "recording-coloured", [coloured], (266, 380), "In its colours", "GLB, OBJ and PLY hold them", **near
            ),
        ],
    )


def raw(p, name, scans, columns, width):
    """The scans as grids of pixels, in rows of some."""
    panels = [p.pixels(f"{name}-{k}", shaded(scan, width), scan.name) for k, scan in enumerate(read(scans))]
    p.picture(name, *(panels[at : at + columns] for at in range(0, len(panels), columns)))


def found(p, name, scans, aligned, upright, size, left_out=(), **look):
    """Scans as they come, and where they were placed."""
    images, placed = read(scans), read(aligned.scans)
    for image in images:
        image.world_from_sensor = np.eye(4)
    heap = tinted(images, range(len(images)), upright)
    kept = [k for k in range(len(images)) if k not in left_out]
    there = tinted(placed, kept, upright)
    text = f"{aligned.report.placed} of {len(images)} scans"
    p.picture(
        name,
        [
            p.view(f"{name}-heap", heap, size, "As they come", "each where its own axes put it", floor=False, **look),
            p.view(f"{name}-there", there, size, "Placed", text, floor=False, **look),
        ],
    )


def tinted(images, numbers, upright):
    """The triangulated scans, each in the colour of its number."""
    bodies = []
    for k, image in zip(numbers, images, strict=True):
        mesh, pose = image.triangulate(), upright @ np.array(image.world_from_sensor)
        places = mesh.positions @ pose[:3, :3].T + pose[:3, 3]
        bodies.append(made("Scan", places, mesh.triangles, colour=scan_colour(k)))
    return bodies


def turntable(p):
    """A turn: its scans, placed, merged, without the table."""
    scans = surfrecon.open("turn")
    raw(p, "turntable-scans", scans, 4, 200)
    aligned = surfrecon.align(scans, turntable="equal")
    merged = surfrecon.merge(aligned.scans).mesh
    table = surfrecon.dominant_plane(aligned.scans)
    upright = np.array(surfrecon.ground(table).matrix)
    found(p, "turntable-placed", scans, aligned, upright, (400, 380))
    level = surfrecon.ground(table)
    whole = surface(merged.transformed(level))
    alone = surfrecon.merge(surfrecon.remove(aligned.scans, table)).mesh.transformed(level)
    size, look = (400, 380), {"elevation": 18}
    p.picture(
        "turntable-merged",
        [
            p.view("turntable-whole", [whole], size, "Merged", many(len(merged.triangles), "triangles"), **look),
            p.view(
                "turntable-alone",
                [surface(alone)],
                size,
                "Without the table",
                f"{table.share:.0%} of the samples lay on it",
                frame=[whole],
                **look,
            ),
        ],
    )


def heaps(p):
    """Scans without poses: as they come, placed, merged."""
    scans = surfrecon.open("folder/of/scans")
    raw(p, "heap-scans", scans, 6, 130)
    aligned = surfrecon.align(scans)
    out = [k for k, scan in enumerate(aligned.report.scans) if aligned.world_from_scan[k] is None]
    result = surfrecon.merge(aligned.scans)
    upright = upright_of(result.mesh)
    found(p, "heap-placed", scans, aligned, upright, (400, 400), out, azimuth=BACK)
    mesh = result.mesh.transformed(surfrecon.Similarity(upright))
    sources = np.asarray(mesh.vertex_attributes["source_scan"])
    tints = np.array([scan_colour(k) for k in range(len(scans))])[np.clip(sources, 0, None)]
    size, look = (266, 400), {"azimuth": BACK}
    p.picture(
        "heap-merged",
        [
            p.view("heap-surface", [surface(mesh)], size, "Merged", many(len(mesh.triangles), "triangles"), **look),
            p.view(
                "heap-sources",
                [made("Sources", mesh.positions, mesh.triangles, tints)],
                size,
                "By scan",
                "source_scan of each vertex",
                **look,
            ),
            p.view(
                "heap-colours", [surface(mesh, coloured=True)], size, "In colour", "where the scans have any", **look
            ),
        ],
    )


def upright_of(mesh):
    """A turn that makes the longest way through a mesh vertical, its heavy end below."""
    centred = mesh.positions - mesh.positions.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    up = axes[0] * (-1 if np.mean((centred @ axes[0]) ** 3) < 0 else 1)
    right = np.cross(up, axes[1])
    turn = np.eye(4)
    turn[:3, :3] = np.stack([right, np.cross(up, right), up])
    return turn


def points(p):
    """Points, the surface through them, and its triangles."""
    cloud = surfrecon.read("points.xyz")
    through = surfrecon.reconstruct(cloud)
    grains = dots([(np.asarray(cloud.positions), GREY)], 0.5)
    body = surface(through.mesh)
    size = (266, 400)
    p.picture(
        "points-surface",
        [
            p.view(
                "points-points", [grains], size, "Points", many(len(cloud.positions), "without normals"), frame=[body]
            ),
            p.view("points-body", [body], size, "Surface", many(len(through.mesh.triangles), "triangles")),
            p.view(
                "points-wires",
                [body, wires(through.mesh, 0.25)],
                size,
                "Its triangles",
                "corners are the points",
                frame=[body],
            ),
        ],
    )


def terrain(p):
    """Heights, triangles of two tolerances, and the error."""
    row, col = np.mgrid[:300, :400]
    heights = 30 * np.sin(row / 40) * np.cos(col / 55) + 12 * np.sin(row / 13 + col / 21)
    np.save("heights.npy", heights)
    (opened,) = surfrecon.open("heights.npy")
    image = opened.read()
    sculptor = surfrecon.Sculptor(image)
    extent = np.ptp(heights)
    light, finer = sculptor.refine(tolerance=0.01 * extent), sculptor.refine(tolerance=0.001 * extent)
    low, high = heights.min(), heights.max()
    grey = np.repeat(np.round(255 * (heights - low) / (high - low)).astype(np.uint8)[..., None], 3, axis=-1)
    errors = false_colours(np.abs(np.asarray(light.error_image)), 0, light.max_error)
    p.picture(
        "terrain-heights",
        [
            p.pixels("terrain-grey", grey, "Heights", f"{heights.size:,} pixels, {low:.0f} to {high:.0f}"),
            p.pixels("terrain-error", errors, "Error of each pixel", f"none above {light.max_error:.2g}"),
        ],
    )
    look = {"azimuth": 25, "elevation": 38, "floor": False, "room": 1.02}
    shown = []
    for name, one, title in (("light", light, "Tolerance 1 %"), ("finer", finer, "Tolerance 0.1 %")):
        body = surface(one.mesh)
        text = many(len(one.mesh.triangles), "triangles")
        shown.append(
            p.view(f"terrain-{name}", [body, wires(one.mesh, 0.5)], (400, 250), title, text, frame=[body], **look)
        )
    p.picture("terrain-triangles", shown)


def merging(p):
    """Placed scans, one surface, and how sure it is."""
    scans = surfrecon.open("placed.conf")
    raw(p, "merging-scans", list(scans)[:6], 6, 130)
    result = surfrecon.merge(scans)
    mesh = result.mesh
    body = surface(mesh)
    patches = dots(samples(read(scans)), 0.5)
    confidence = np.asarray(mesh.vertex_attributes["confidence"], float)
    sure = np.quantile(confidence, 0.9)
    tints = linear(false_colours(sure - confidence, 0, sure))
    size = (266, 400)
    p.picture(
        "merging-surface",
        [
            p.view("merging-placed", [patches], size, many(len(scans), "scans"), "a colour for each", frame=[body]),
            p.view("merging-body", [body], size, "One surface", many(len(mesh.triangles), "triangles")),
            p.view(
                "merging-confidence",
                [made("Confidence", mesh.positions, mesh.triangles, tints)],
                size,
                "Confidence",
                "blue where it is sure",
            ),
        ],
    )


def remeshing(p):
    """A dense surface and two of its levels."""
    dense = surfrecon.merge(surfrecon.open("placed.conf")).mesh
    levels = [level.mesh for level in surfrecon.cluster_levels(dense, [4_000, 500])]
    panels = []
    for k, (mesh, thick) in enumerate(zip([dense, *levels], (0.12, 0.22, 0.5), strict=True)):
        body = surface(mesh)
        title = "Merged" if not k else many(len(mesh.positions), "vertices")
        text = many(len(mesh.triangles), "triangles")
        panels.append(p.view(f"remeshing-{k}", [body, wires(mesh, thick)], (266, 400), title, text, frame=[body]))
    p.picture("remeshing-levels", panels)


def selecting(p):
    """The whole recording, without the table, upright and in its true size."""
    scans = surfrecon.open("export of a phone")
    colour = enlarged(np.asarray(scans[0].colour)[..., :3], 512)
    for row, col in ((91, 60), (106, 231)):
        y, x = 2 * row + 1, 2 * col + 1
        rows, cols = np.indices(colour.shape[:2])
        far = np.hypot(rows - y, cols - x)
        colour[(far > 7) & (far < 10)] = (220, 30, 30)
    places = scans[0].read().world_points()
    size = surfrecon.true_size(places[91, 60], places[106, 231], 1.0)
    table = surfrecon.dominant_plane(scans)
    level = size @ surfrecon.ground(table)
    before = surface(surfrecon.merge(scans).mesh, coloured=True)
    p.picture(
        "selecting-before",
        [
            p.pixels("selecting-picks", colour, "Frame 0", "two places that are 1 m apart"),
            p.view(
                "selecting-all",
                [before],
                (512, 384),
                "Merged whole",
                f"{table.share:.0%} of the samples lie on the table",
                azimuth=-12,
                elevation=24,
                floor=False,
            ),
        ],
    )
    moved = surfrecon.transformed(scans, level)
    alone = surfrecon.remove(moved, surfrecon.Plane((0, 0, 0), (0, 0, 1), margin=0.005))
    box = surfrecon.Box.between((-0.17, -0.17, 0), (0.17, 0.17, 0.5))
    statue = surfrecon.merge(surfrecon.keep(alone, box), voxel=0.004).mesh
    low, high = statue.bounds
    body = surface(statue, coloured=True)
    corners = np.array([(x, y, z) for x in (-0.17, 0.17) for y in (-0.17, 0.17) for z in (0, 0.5)])
    edges = beams(corners, [(a, b) for a in range(8) for b in range(8) if a < b and bin(a ^ b).count("1") == 1], 0.002)
    look = {"azimuth": -12, "elevation": 14}
    p.picture(
        "selecting-after",
        [
            p.view(
                "selecting-box", [body, edges], (400, 400), "In the box", "0.34 x 0.34 x 0.5 m on the ground", **look
            ),
            p.view(
                "selecting-statue", [body], (400, 400), "Upright, true size", f"{high[2] - low[2]:.3f} m high", **look
            ),
        ],
    )


def beams(corners, edges, radius):
    """Thin square beams along edges."""
    unit = np.array([(x, y, z) for x in (0, 1) for y in (-1, 1) for z in (-1, 1)])
    faces = np.array(
        [
            (0, 1, 3),
            (0, 3, 2),
            (4, 6, 7),
            (4, 7, 5),
            (0, 4, 5),
            (0, 5, 1),
            (2, 3, 7),
            (2, 7, 6),
            (0, 2, 6),
            (0, 6, 4),
            (1, 5, 7),
            (1, 7, 3),
        ]
    )
    places, triangles = [], []
    for k, (a, b) in enumerate(edges):
        along = corners[b] - corners[a]
        other = np.eye(3)[np.argmin(np.abs(along))]
        side = np.cross(along, other)
        side = radius * side / np.linalg.norm(side)
        third = np.cross(along, side)
        third = radius * third / np.linalg.norm(third)
        places.append(corners[a] + unit @ np.stack([along, side, third]))
        triangles.append(faces + 8 * k)
    return made("Beams", np.vstack(places), np.vstack(triangles), colour=(0.02, 0.12, 0.5))


def surveys(p):
    """Two stations of a survey, merged."""
    scans = surfrecon.open("survey.e57")
    images = read(scans)
    origin = np.array(images[0].world_from_sensor)[:3, 3]
    parts = [(points - origin, colour) for points, colour in samples(images)]
    mesh = surfrecon.merge(scans).mesh
    body = made("Hills", mesh.positions - origin, mesh.triangles)
    stations = cameras(
        [np.array(image.world_from_sensor) - np.pad(origin[:, None], ((0, 1), (3, 0))) for image in images], 1.2
    )
    look = {"azimuth": 20, "elevation": 24, "floor": False, "frame": [body]}
    p.picture(
        "surveys-hills",
        [
            p.view(
                "surveys-scans",
                [dots(parts, 0.16, 90_000), stations],
                (400, 220),
                "Two scans",
                "each from its station",
                **look,
            ),
            p.view("surveys-merged", [body], (400, 220), "Merged", f"{len(mesh.triangles):,} triangles", **look),
        ],
    )


def large(p):
    """A surface in parts."""
    surfrecon.merge_to_file(surfrecon.open("placed.conf"), "parts.ply", part_triangles=9_000)
    files = [Path("parts.ply"), *sorted(Path(".").glob("parts-*-of-*.ply"))]
    bodies = [surface(surfrecon.read(path), scan_colour(k)) for k, path in enumerate(files)]
    names = p.view("large-parts", bodies, (400, 400), many(len(files), "files"), "each in its own colour")
    p.picture("large-parts", [names])


def library(p):
    """A preview, the surface, and how far the one is off the other."""
    scans = surfrecon.open("placed.conf")
    preview = surfrecon.merge(scans, voxel=8.0).mesh
    mesh = surfrecon.merge(scans).mesh
    off = np.asarray(surfrecon.distances(mesh.positions, preview))
    most = 2.0
    tints = linear(false_colours(off, 0, most))
    size, body = (266, 400), surface(mesh)
    p.picture(
        "library-surface",
        [
            p.view(
                "library-preview",
                [surface(preview)],
                size,
                "A preview",
                many(len(preview.triangles), "triangles"),
                frame=[body],
            ),
            p.view("library-body", [body], size, "The surface", many(len(mesh.triangles), "triangles")),
            p.view(
                "library-off",
                [made("Off", mesh.positions, mesh.triangles, tints)],
                size,
                "How far the preview is off",
                f"red: {most:.0f} mm and more",
            ),
        ],
    )


def cluster(p):
    """The scans by the tasks that collect them, the blocks of the surface, and the surface."""
    tasks, cells = 4, 64
    scans = surfrecon.open("placed.conf")
    images = read(scans)
    result = surfrecon.merge(scans)
    mesh, size = result.mesh, (266, 400)
    body = surface(mesh)
    # A task collects a run of the scans in the order of their names.
    runs = dots(samples(images, lambda k, count: scan_colour(k * tasks // count)), 0.5)
    # Blocks are cubes of the world's grid.
    block = np.floor(mesh.positions / (cells * result.report.voxel)).astype(int)
    _, number = np.unique(block, axis=0, return_inverse=True)
    tints = np.array([scan_colour(k) for k in range(number.max() + 1)])[number.ravel()]
    p.picture(
        "cluster-tasks",
        [
            p.view(
                "cluster-runs",
                [runs],
                size,
                "Scans",
                f"{many(tasks, 'tasks')} collect {len(images)} scans",
                frame=[body],
            ),
            p.view(
                "cluster-blocks",
                [made("Blocks", mesh.positions, mesh.triangles, tints)],
                size,
                "Blocks",
                f"{number.max() + 1}, each {cells} cells wide",
            ),
            p.view("cluster-body", [body], size, "One file", many(len(mesh.triangles), "triangles")),
        ],
    )


GUIDES = {
    "recordings": recordings,
    "turntable": turntable,
    "heaps": heaps,
    "points": points,
    "terrain": terrain,
    "merging": merging,
    "remeshing": remeshing,
    "selecting": selecting,
    "surveys": surveys,
    "large": large,
    "library": library,
    "cluster": cluster,
    "printing": printing,
}
