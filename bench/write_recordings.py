"""Writes recordings of a room, taken by the virtual scanner, as cameras and phones lay them out.

python write_recordings.py FOLDER FRAMES LAYOUT...: a folder or a file for each layout, named like it. Runs in the
environment bench-recordings, with this library's wheel in PYTHONPATH.
"""

import io
import json
import struct
import sys
import zipfile
import zlib
from pathlib import Path

import numpy as np
import surfrecon

KINECT = (480, 640), 525.0
PHONE = (192, 256), 212.0
PHOTO = (1440, 1920)
TURNED = np.diag([1.0, -1.0, -1.0, 1.0])
VIEWS = 12  # that are scanned; further frames see the same from elsewhere


def room():
    """A statue in a room, coloured by place."""
    statue = surfrecon.sculpture(cell=6.0)
    low, high = statue.bounds
    points = (statue.positions - (low + high) / 2) / (high - low).max()
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * (2.0, 2.0, 1.2)
    walls = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    inward = np.array([(a, b, c) for a, b, c, _ in walls] + [(a, c, d) for a, _, c, d in walls])
    for triangle in inward:
        p, q, r = corners[triangle]
        if np.dot(np.cross(q - p, r - p), p + q + r) > 0:
            triangle[1:] = triangle[:0:-1]
    positions = np.concatenate([points, corners])
    waves = 128 + 90 * np.sin(positions * (9, 7, 8)) + 20 * np.sin(positions * 60)
    colour = np.concatenate([np.clip(waves, 0, 255), np.full((len(positions), 1), 255)], axis=1).astype(np.uint8)
    return surfrecon.Mesh(positions, np.concatenate([statue.triangles, inward + len(points)]), colour=colour)


def pose(angle):
    """A camera on a circle that looks at the statue: x right, y down, z forward."""
    eye = np.array([1.7 * np.cos(angle), 1.7 * np.sin(angle), 0.3 * np.sin(3 * angle)])
    z = -eye / np.linalg.norm(eye)
    x = np.cross(z, (0, 0, 1.0))
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([x, np.cross(z, x), z, eye])
    return matrix


class Recording:
    """Frames of one camera: depths in metres, 0 for none, colours of the same size, poses."""

    def __init__(self, mesh, frames, size, focal):
        (self.rows, self.cols), self.focal = size, focal
        self.centre = ((self.cols - 1) / 2, (self.rows - 1) / 2)
        self.poses = [pose(2 * np.pi * k / frames) for k in range(frames)]
        self.seen = []
        for k in range(min(frames, VIEWS)):
            camera = surfrecon.Camera.intrinsic(
                *size,
                focal=(focal, focal),
                centre=self.centre,
                world_from_sensor=self.poses[k * frames // min(frames, VIEWS)],
            )
            image = surfrecon.virtual_scan(mesh, camera, noise=0.002)
            colours = np.array(image.colour).reshape(self.rows, self.cols, -1)[:, :, :3]
            self.seen.append((np.nan_to_num(np.array(image.values)).reshape(size), np.ascontiguousarray(colours)))
        self.photos = {}

    def __len__(self):
        return len(self.poses)

    def depth(self, k):
        """Metres."""
        return self.seen[k % len(self.seen)][0]

    def whole(self, k, per_metre=1000):
        """Whole numbers."""
        return np.round(self.depth(k) * per_metre).astype(np.uint16)

    def depth_png(self, k, per_metre=1000):
        """The depths as PNG."""
        return png(self.whole(k, per_metre))

    def colour_png(self, k):
        """The colours, of the depths' size, as PNG."""
        return png(self.seen[k % len(self.seen)][1])

    def photo(self, k, size=PHOTO):
        """The colours as a larger JPEG image, with a camera's grain."""
        from PIL import Image

        at = k % len(self.seen), size
        if at not in self.photos:
            larger = Image.fromarray(self.seen[at[0]][1]).resize(size[::-1], Image.Resampling.BICUBIC)
            grain = np.random.default_rng(at[0]).normal(0, 3, (*size, 3))
            out = io.BytesIO()
            grainy = Image.fromarray(np.clip(np.asarray(larger) + grain, 0, 255).astype(np.uint8))
            grainy.save(out, "JPEG", quality=90)
            self.photos[at] = out.getvalue()
        return self.photos[at]

    def camera(self, size=PHOTO):
        """fx, fy, cx, cy of images of another size; pixel centres at whole numbers."""
        scale = size[0] / self.rows
        return self.focal * scale, self.focal * scale, *((c + 0.5) * scale - 0.5 for c in self.centre)

    def levels(self, high):
        """Confidence, low at the rims of the image."""
        levels = np.full((self.rows, self.cols), high[2], np.uint8)
        levels[:, :3], levels[:, -3:] = high[0], high[1]
        return levels


def png(pixels):
    """A PNG file."""
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "PNG")
    return out.getvalue()


def quaternion(matrix):
    """x, y, z, w of a rotation."""
    m = matrix[:3, :3]
    k = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0],
            [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
            [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], 0],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]],
        ]
    )
    return np.linalg.eigh(k)[1][:, -1]


def words(numbers):
    """Numbers as text."""
    return " ".join(f"{x:.9g}" for x in np.ravel(numbers))


def exr(depth):
    """One channel R of halves, ZIP: 16 rows a block, bytes parted by their place and kept as differences."""
    rows, cols = depth.shape
    window = struct.pack("<4i", 0, 0, cols - 1, rows - 1)
    attributes = [
        ("channels", "chlist", b"R\0" + struct.pack("<iB3xii", 1, 0, 1, 1) + b"\0"),
        ("compression", "compression", b"\x03"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ]
    head = struct.pack("<2i", 20000630, 2)
    for name, kind, value in attributes:
        head += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    head += b"\0"
    blocks = []
    for row in range(0, rows, 16):
        raw = np.frombuffer(depth[row : row + 16].astype("<f2").tobytes(), np.uint8)
        parted = np.concatenate([raw[::2], raw[1::2]])
        kept = parted.copy()
        kept[1:] = parted[1:] - parted[:-1] + 128
        packed = zlib.compress(kept.tobytes())
        blocks.append(struct.pack("<2i", row, len(packed)) + packed)
    places = np.cumsum([len(head) + 8 * len(blocks), *(len(block) for block in blocks[:-1])])
    return head + places.astype("<u8").tobytes() + b"".join(blocks)


def seven_scenes(r):
    """Three files a frame."""
    for k in range(len(r)):
        yield f"frame-{k:06}.depth.png", r.depth_png(k)
        yield f"frame-{k:06}.color.png", r.colour_png(k)
        yield f"frame-{k:06}.pose.txt", words(r.poses[k])
    yield from kinect_camera(r, "camera.json")


def kinect_camera(r, name):
    """The file of a camera that is the same for depths and colours."""
    matrix = [r.focal, 0, 0, 0, r.focal, 0, *r.centre, 1]
    yield name, json.dumps({"width": r.cols, "height": r.rows, "intrinsic_matrix": matrix})


def tum(r):
    """Lists of times and images, and poses at times of their own."""
    for kind, image in (("depth", lambda k: r.depth_png(k, 5000)), ("rgb", r.colour_png)):
        for k in range(len(r)):
            yield f"{kind}/{k + 1:.6f}.png", image(k)
        yield f"{kind}.txt", "".join(f"{k + 1:.6f} {kind}/{k + 1:.6f}.png\n" for k in range(len(r)))
    places = (f"{k + 1:.4f} {words(p[:3, 3])} {words(quaternion(p))}\n" for k, p in enumerate(r.poses))
    yield "groundtruth.txt", "".join(places)
    yield from kinect_camera(r, "camera.json")


def redwood(r):
    """Numbered images and a trajectory."""
    log = ""
    for k in range(len(r)):
        log += f"{k} {k} {k + 1}\n" + "".join(words(row) + "\n" for row in r.poses[k])
        yield f"depth/{k + 1:07}-{k * 33000:012}.png", r.depth_png(k)
        yield f"rgb/{k + 1:07}-{k * 33000:012}.jpg", r.photo(k, (r.rows, r.cols))
    yield "trajectory.log", log
    yield from kinect_camera(r, "camera_primesense.json")


def icl_nuim(r):
    """In the form of TUM, without its lists."""
    for k in range(len(r)):
        yield f"depth/{k}.png", r.depth_png(k, 5000)
        yield f"rgb/{k}.png", r.colour_png(k)
    yield "room.gt.freiburg", "".join(f"{k} {words(p[:3, 3])} {words(quaternion(p))}\n" for k, p in enumerate(r.poses))
    yield from kinect_camera(r, "camera.json")


def nerfstudio(r):
    """One list of frames."""
    fx, fy, cx, cy = r.camera()
    head = {
        "fl_x": fx,
        "fl_y": fy,
        "cx": cx + 0.5,
        "cy": cy + 0.5,
        "w": PHOTO[1],
        "h": PHOTO[0],
        "camera_model": "OPENCV",
    }
    frames = []
    for k in range(len(r)):
        paths = {"file_path": f"images/{k:05}.jpg", "depth_file_path": f"depths/{k:05}.png"}
        frames.append(paths | {"transform_matrix": (r.poses[k] @ TURNED).tolist()})
        yield paths["file_path"], r.photo(k)
        yield paths["depth_file_path"], r.depth_png(k)
    yield "transforms.json", json.dumps(head | {"frames": frames})


def polycam(r):
    """A folder a kind, a file a frame, as of sessions without corrected poses."""
    fx, fy, cx, cy = r.camera()
    for k in range(len(r)):
        entries = {f"t_{i}{j}": (r.poses[k] @ TURNED)[i, j] for i in range(3) for j in range(4)}
        camera = {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": PHOTO[1], "height": PHOTO[0]} | entries
        yield f"keyframes/cameras/{k + 1}.json", json.dumps(camera)
        yield f"keyframes/images/{k + 1}.jpg", r.photo(k)
        yield f"keyframes/depth/{k + 1}.png", r.depth_png(k)
        yield f"keyframes/confidence/{k + 1}.png", png(r.levels((0, 127, 255)))
    yield "mesh_info.json", "{}"


def record3d_metadata(r):
    """Camera and poses."""
    fx, fy, cx, cy = r.camera()
    poses = [[*quaternion(p), *p[:3, 3]] for p in (p @ TURNED for p in r.poses)]
    sizes = {"w": PHOTO[1], "h": PHOTO[0], "dw": r.cols, "dh": r.rows}
    return json.dumps({"K": [fx, 0, 0, 0, fy, 0, cx, cy, 1], "fps": 60, "poses": poses} | sizes)


def record3d(r):
    """The files that are zipped as .r3d."""
    import lzfse

    yield "metadata", record3d_metadata(r)
    for k in range(len(r)):
        yield f"rgbd/{k}.depth", lzfse.compress(r.depth(k).astype("<f4").tobytes())
        yield f"rgbd/{k}.conf", lzfse.compress(r.levels((0, 1, 2)).tobytes())
        yield f"rgbd/{k}.jpg", r.photo(k)


def record3d_exr(r):
    """The export for other programs."""
    yield "EXR_RGBD/metadata.json", record3d_metadata(r)
    for k in range(len(r)):
        yield f"EXR_RGBD/depth/{k}.exr", exr(r.depth(k))
        yield f"EXR_RGBD/rgb/{k}.jpg", r.photo(k)


def scanner_app(r):
    """Each third frame has colours."""
    fx, fy, cx, cy = r.camera()
    for k in range(len(r)):
        place = np.ravel(r.poses[k] @ TURNED).tolist()
        camera = {"cameraPoseARFrame": place, "intrinsics": [fx, 0, cx, 0, fy, cy, 0, 0, 1]}
        yield f"frame_{k:05}.json", json.dumps(camera)
        yield f"depth_{k:05}.png", r.depth_png(k)
        yield f"conf_{k:05}.png", png(r.levels((0, 1, 2)))
        if k % 3 == 0:
            yield f"frame_{k:05}.jpg", r.photo(k)


def stray(r):
    """Colours are a video, which nobody reads."""
    rows = "timestamp, frame, x, y, z, qx, qy, qz, qw, fx, fy, cx, cy\n"
    for k, place in enumerate(r.poses):
        numbers = [*place[:3, 3], *quaternion(place), *r.camera()]
        rows += f"{k / 60:.6f}, {k:06}, " + ", ".join(f"{x:.9g}" for x in numbers) + "\n"
        yield f"depth/{k:06}.png", r.depth_png(k)
        yield f"confidence/{k:06}.png", png(r.levels((0, 1, 2)))
    yield "odometry.csv", rows
    yield "rgb.mp4", "video"


def colmap(r):
    """A dense workspace with its model in text."""
    fx, fy, cx, cy = r.camera()
    images = ""
    for k, place in enumerate(r.poses):
        inverse = np.linalg.inv(place)
        x, y, z, w = quaternion(inverse)
        images += f"{k + 1} {words([w, x, y, z, *inverse[:3, 3]])} 1 {k}.jpg\n\n"
        head = f"{r.cols}&{r.rows}&1&".encode()
        yield f"stereo/depth_maps/{k}.jpg.geometric.bin", head + r.depth(k).astype("<f4").tobytes()
        yield f"images/{k}.jpg", r.photo(k)
    yield "sparse/images.txt", images
    yield "sparse/cameras.txt", f"1 PINHOLE {PHOTO[1]} {PHOTO[0]} {words([fx, fy, cx + 0.5, cy + 0.5])}\n"


def scannet(r):
    """One file that holds all."""

    def camera(fx, fy, cx, cy):
        return np.array([[fx, 0, cx, 0], [0, fy, cy, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "<f4").tobytes()

    size = (968, 1296)
    still = np.eye(4, dtype="<f4").tobytes()
    file = struct.pack("<IQ", 4, 4) + b"room"
    file += camera(*r.camera(size)) + still + camera(r.focal, r.focal, *r.centre) + still
    file += struct.pack("<2i4IfQ", 2, 1, size[1], size[0], r.cols, r.rows, 1000, len(r))
    parts = [file]
    for k, place in enumerate(r.poses):
        depth, colour = zlib.compress(r.whole(k).tobytes()), r.photo(k, size)
        parts += [place.astype("<f4").tobytes(), struct.pack("<4Q", k, k, len(colour), len(depth)), colour, depth]
    yield "", b"".join([*parts, struct.pack("<Q", 0)])


# Name of what is written, by whom, and how. Those with an ending are one file.
LAYOUTS = {
    "7-Scenes": (KINECT, seven_scenes),
    "TUM RGB-D": (KINECT, tum),
    "Redwood": (KINECT, redwood),
    "ICL-NUIM": (KINECT, icl_nuim),
    "nerfstudio": (PHONE, nerfstudio),
    "Polycam": (PHONE, polycam),
    "Record3D.r3d": (PHONE, record3d),
    "Record3D EXR": (PHONE, record3d_exr),
    "3D Scanner App": (PHONE, scanner_app),
    "Stray Scanner": (PHONE, stray),
    "COLMAP": (KINECT, colmap),
    "ScanNet.sens": (KINECT, scannet),
}


def main(folder, frames, *names):
    """Writes the layouts."""
    mesh, taken = room(), {}
    for name in names:
        camera, files = LAYOUTS[name]
        if camera not in taken:
            taken[camera] = Recording(mesh, int(frames), *camera)
        path = Path(folder, name)
        if name.endswith(".r3d"):
            with zipfile.ZipFile(path, "w") as archive:
                for inner, content in files(taken[camera]):
                    archive.writestr(inner, content)
            continue
        for inner, content in files(taken[camera]):
            file = path / inner if inner else path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content if isinstance(content, bytes) else content.encode())


if __name__ == "__main__":
    main(*sys.argv[1:])
