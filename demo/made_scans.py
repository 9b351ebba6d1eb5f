"""Makes the files that the guides begin with, by the virtual scanner: for all who have no scans at hand.

Usage: python demo/made_scans.py [FOLDER]      without FOLDER into the folder it is started in

Needs the package. The folders and files:

    export of a phone/   24 frames of a statue on a table, in metres, with poses and colours, as nerfstudio writes them
    depths of a camera/  the depths of 10 frames of the same table as images of millimetres, without poses
    depths.npy           the same as one array, in metres
    turn/                8 scans of a statue on a turntable, without poses
    folder/of/scans/     10 scans of a statue from all sides and one of something else, without poses
    placed.conf          12 scans view00.ply and on, with poses
    points.xyz           30,000 points, without normals or sensors
    survey.e57           2 scans of hills with poses, far from the origin, in ETRS89 / UTM zone 32N
"""

import json
import sys
import zlib
from pathlib import Path

import numpy as np
import surfrecon

# The depth camera of the phone, in pixels, as the guide of recordings names it.
ROWS, COLS, FOCAL = 192, 256, 176.0
FRAMES = 24
# The top of the table in metres; the tracking of the phone takes all lengths for 4 % longer than they are.
TABLE, TOO_LONG = 0.75, 1.04
# Half a side of the table. The corners of the strip of paper on it, which is 1 m long.
HALF = 0.6
STRIP = (-0.5, 0.24), (0.5, 0.3)
# Stones on the table: where, their half lengths, their colours.
STONES = [
    ((0.27, -0.12), (0.07, 0.05, 0.06), (118, 122, 128)),
    ((-0.24, -0.17), (0.05, 0.07, 0.05), (150, 128, 112)),
    ((0.03, -0.29), (0.09, 0.05, 0.04), (164, 152, 140)),
    ((-0.28, 0.11), (0.06, 0.05, 0.08), (96, 104, 98)),
    ((0.28, 0.12), (0.05, 0.06, 0.07), (132, 112, 104)),
]
# The frames without poses, and degrees between them.
NEAR, STEP = 10, 5


def png(pixels):
    """An image file of (rows, cols) 16-bit or (rows, cols, 3) 8-bit numbers."""
    rows, cols = pixels.shape[:2]
    depth, kind = (8, 2) if pixels.ndim == 3 else (16, 0)
    samples = np.ascontiguousarray(pixels.astype(pixels.dtype.newbyteorder(">"))).view(np.uint8).reshape(rows, -1)
    lines = np.hstack([np.zeros((rows, 1), np.uint8), samples]).tobytes()
    header = np.array([cols, rows], ">u4").tobytes() + bytes([depth, kind, 0, 0, 0])
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(lines)), (b"IEND", b"")]
    number = lambda value: value.to_bytes(4, "big")  # noqa: E731
    body = b"".join(number(len(data)) + name + data + number(zlib.crc32(name + data)) for name, data in chunks)
    return b"\x89PNG\r\n\x1a\n" + body


def joined(*parts):
    """One mesh of several with colours."""
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    triangles = np.vstack([part.triangles.astype(int) + start for part, start in zip(parts, starts, strict=False)])
    colours = np.vstack([part.vertex_attributes["colour"] for part in parts])
    return surfrecon.Mesh(np.vstack([part.positions for part in parts]), triangles, colour=colours)


def sheet(low, high, height, colours, steps):
    """A flat rectangle seen from above, in colours of places."""
    x, y = np.meshgrid(np.linspace(low[0], high[0], steps), np.linspace(low[1], high[1], steps), indexing="ij")
    places = np.stack([x, y, np.full_like(x, height)], axis=-1).reshape(-1, 3)
    corner = np.arange(steps * steps).reshape(steps, steps)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]))
    return surfrecon.Mesh(places, np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), colour=colours(places))


def planks(places):
    """The colours of wood: boards of different brown."""
    board = np.floor((places[:, 1] + HALF) / 0.15).astype(int)
    brown = np.array([(150, 104, 66), (134, 90, 55), (163, 117, 78), (142, 97, 60)])[board % 4]
    grain = 10 * np.sin(40 * places[:, 1] + 3 * np.sin(7 * places[:, 0] + board))
    return np.clip(brown + grain[:, None], 0, 255).astype(np.uint8)


def white(places):
    """Paper."""
    return np.full((len(places), 3), 236, np.uint8)


def scaled(mesh, factor):
    """A mesh in another size."""
    return mesh.transformed(surfrecon.Similarity(np.diag([factor, factor, factor, 1.0])))


def still_life():
    """A statue 45 cm high on a table, behind it a strip of paper, in metres."""
    table = sheet((-HALF, -HALF), (HALF, HALF), 0.0, planks, 81)
    paper = sheet(*STRIP, 0.001, white, 3)
    stones = []
    for (x, y), radii, colour in STONES:
        places, triangles = ellipsoid(radii)
        colours = np.broadcast_to(np.array(colour, np.uint8), places.shape)
        stones.append(surfrecon.Mesh(places + (x, y, radii[2] / 2), triangles, colour=colours))
    raised = np.eye(4)
    raised[2, 3] = TABLE
    whole = joined(scaled(surfrecon.sculpture(cell=3.0), 0.002), table, paper, *stones)
    return whole.transformed(surfrecon.Similarity(raised))


def seen(subject, angle, seed):
    """A frame from a place beside the table: its camera, its image, its depths in metres, 0 where there is none."""
    eye = (0.72 * np.cos(angle), 0.72 * np.sin(angle), TABLE + 0.5 + 0.12 * np.sin(2 * angle))
    height = 2 * np.arctan(ROWS / 2 / FOCAL)
    camera = surfrecon.Camera.pinhole(ROWS, COLS, height_angle=height, eye=eye, target=(0, 0, TABLE + 0.15))
    image = surfrecon.virtual_scan(subject, camera, noise=0.0015, noise_grazing=0.3, dropout_grazing=0.5, seed=seed)
    return camera, image, np.nan_to_num(np.asarray(image.points)[..., 2])


def phone(folder):
    """A recording as nerfstudio writes it; the cameras go once around the table."""
    export = folder / "export of a phone"
    for name in ("images", "depths"):
        (export / name).mkdir(parents=True)
    subject, frames = scaled(still_life(), TOO_LONG), []
    for k, angle in enumerate(2 * np.pi * np.arange(FRAMES) / FRAMES - 1.35):
        camera, image, depth = seen(subject, angle, k)
        names = f"depths/{k:05}.png", f"images/{k:05}.png"
        (export / names[0]).write_bytes(png(np.round(1000 * depth).astype(np.uint16)))
        clean = surfrecon.virtual_scan(subject, camera)
        (export / names[1]).write_bytes(
            png(np.where(clean.valid[..., None], clean.colour[..., :3], 225).astype(np.uint8))
        )
        # Of transforms.json the camera looks along -z, with y up.
        pose = np.array(image.world_from_sensor) @ np.diag([1.0, -1, -1, 1])
        frames.append({"depth_file_path": names[0], "file_path": names[1], "transform_matrix": pose.tolist()})
    lens = {"fl_x": FOCAL, "fl_y": FOCAL, "cx": COLS / 2, "cy": ROWS / 2, "w": COLS, "h": ROWS}
    (export / "transforms.json").write_text(json.dumps(lens | {"frames": frames}, indent=1), "utf-8")
    near = [seen(subject, np.radians(STEP * k) - 1.35, k)[2] for k in range(NEAR)]
    np.save(folder / "depths.npy", np.stack(near).astype(np.float32))
    write_depths(folder / "depths of a camera", near)


def write_depths(folder, depths):
    """Depths in metres as images of millimetres, as Kinects write them. Nothing says their camera."""
    folder.mkdir()
    for k, depth in enumerate(depths):
        (folder / f"frame_{k:04}.png").write_bytes(png(np.round(1000 * depth).astype(np.uint16)))


def turn(folder):
    """Scans of one turn, in its order, with the table."""
    shape, angle = surfrecon.sculpture(cell=3.0), np.arange(32) * np.pi / 16
    first = len(shape.positions)
    rim = np.stack([150 * np.cos(angle), 150 * np.sin(angle), 0 * angle], axis=1)
    top = [(first, first + k, first + k + 1) for k in range(1, 31)]
    both = surfrecon.Mesh(np.vstack([shape.positions, rim]), np.vstack([shape.triangles, top]))
    cameras = surfrecon.turntable(both, around=0, above=8, below=0, elevation=0.5, pixels=220)
    (folder / "turn").mkdir()
    for k, image in enumerate(surfrecon.virtual_scan(both, cameras, noise=0.1, seed=1)):
        image.write(folder / "turn" / f"view{k:02}.ply")


def heap(folder):
    """Scans from all sides, in no order; one of something else. Range grids of Stanford's have no pose."""
    shape = surfrecon.sculpture(cell=3.0)
    cameras = surfrecon.turntable(shape, around=8, above=2, below=0, pixels=220)
    images = surfrecon.virtual_scan(shape, cameras, noise=0.1, seed=1)
    egg = surfrecon.Mesh(*ellipsoid((60.0, 60.0, 85.0)))
    images.append(surfrecon.virtual_scan(egg, surfrecon.turntable(egg, around=1, above=0, below=0, pixels=160)[0]))
    within = folder / "folder" / "of" / "scans"
    within.mkdir(parents=True)
    for place, k in enumerate(np.random.default_rng(3).permutation(len(images))):
        images[k].write(within / f"scan{place:02}.ply")


def ellipsoid(radii, detail=60):
    """Corners and triangles of an ellipsoid."""
    across, along = np.meshgrid(np.linspace(0, np.pi, detail), np.arange(2 * detail) * np.pi / detail, indexing="ij")
    unit = np.stack([np.sin(across) * np.cos(along), np.sin(across) * np.sin(along), np.cos(across)], axis=-1)
    corner = np.arange(unit.shape[0] * unit.shape[1]).reshape(unit.shape[:2])
    beside = np.roll(corner, -1, axis=1)
    a, b, c, d = (part.ravel() for part in (corner[:-1], corner[1:], beside[1:], beside[:-1]))
    return unit.reshape(-1, 3) * radii, np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def placed(folder):
    """Scans with poses, and the list that has these."""
    shape = surfrecon.sculpture(cell=3.0)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=220), noise=0.1, seed=1)
    for k, image in enumerate(images):
        image.name = f"view{k:02}"
    surfrecon.write_scans(folder / "placed.conf", images)


def points(folder):
    """Points that lie anywhere on a surface."""
    shape, generator = surfrecon.sculpture(cell=3.0), np.random.default_rng(1)
    corners = shape.positions[shape.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = generator.choice(len(corners), 30_000, p=areas / areas.sum())
    shares = generator.dirichlet((1, 1, 1), len(chosen))
    np.savetxt(folder / "points.xyz", np.einsum("nk,nkc->nc", shares, corners[chosen]), fmt="%.4f")


def survey(folder):
    """Two scans of hills, each from its place, in coordinates of a survey."""
    x, y = np.meshgrid(np.linspace(-40, 40, 161), np.linspace(-40, 40, 161), indexing="ij")
    z = 5.0 * np.sin(x / 9) * np.cos(y / 7) + 1.2 * np.sin(x / 3 + y / 5)
    corner = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]))
    hills = surfrecon.Mesh(
        np.stack([x, y, z], axis=-1).reshape(-1, 3), np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    )
    images = []
    for k, eye in enumerate([(-14.0, -8.0, 14.0), (14.0, 9.0, 14.0)]):
        camera = surfrecon.Camera.spherical(200, 480, lowest=-1.4, highest=0.2, eye=eye)
        image = surfrecon.virtual_scan(hills, camera, noise=0.01, seed=k)
        pose = np.array(image.world_from_sensor)
        pose[:3, 3] += 500_000, 5_400_000, 300
        image.world_from_sensor, image.crs, image.name = pose, "EPSG:25832", f"station {k + 1}"
        images.append(image)
    surfrecon.write_scans(folder / "survey.e57", images)


def make_all(folder):
    """Makes all files in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for make in (phone, turn, heap, placed, points, survey):
        make(folder)


def main():
    """Makes all, and lists them."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    make_all(folder)
    print("\n".join(sorted(str(path) for path in folder.iterdir())))


if __name__ == "__main__":
    main()
