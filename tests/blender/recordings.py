"""Recordings as files, written independently of the library."""

import json

import numpy as np
import surfrecon
from images import png
from shapes import torus

SIZE = (48, 64)
FOCAL, CENTRE = (44.0, 44.0), (31.2, 23.9)
TURNED = np.diag([1.0, -1.0, -1.0, 1.0])


def ring(count, finer=1):
    """Cameras around a torus that lies before them; `finer` ones have that many pixels where the others have one."""
    size = finer * SIZE[0], finer * SIZE[1]
    focal, centre = (tuple(finer * value for value in pair) for pair in (FOCAL, CENTRE))
    for k in range(count):
        angle = 2 * np.pi * k / count
        eye = (2.2 * np.cos(angle), 2.2 * np.sin(angle), 1.1)
        pose = surfrecon.Camera.pinhole(*size, height_angle=1, eye=eye, target=(0, 0, 0)).world_from_sensor
        yield surfrecon.Camera.intrinsic(*size, focal=focal, centre=centre, world_from_sensor=pose)


def images(count, subject=None, finer=1):
    """The images that the cameras measure of a surface, in whole millimetres. 0 where nothing is."""
    subject = subject or torus()
    for camera in ring(count, finer):
        values = surfrecon.virtual_scan(subject, camera).values
        yield camera, np.nan_to_num(np.round(values * 1000), nan=0).astype(np.uint16)


def write_transforms(folder, count, colour=(200, 100, 50), subject=None, finer=1):
    """As nerfstudio writes them: `transforms.json`, depths in mm, colour images of twice the size; returns its path."""
    (folder / "images").mkdir(parents=True)
    (folder / "depths").mkdir()
    frames = []
    for k, (camera, depths) in enumerate(images(count, subject, finer)):
        (folder / "depths" / f"{k:05}.png").write_bytes(png(depths))
        frame = {
            "depth_file_path": f"depths/{k:05}.png",
            "file_path": f"images/{k:05}.png",
            "transform_matrix": (camera.world_from_sensor @ TURNED).tolist(),
        }
        if colour is not None:
            pixels = np.full((2 * finer * SIZE[0], 2 * finer * SIZE[1], 3), colour, np.uint8)
            (folder / "images" / f"{k:05}.png").write_bytes(png(pixels))
        frames.append(frame)
    lens = {
        "fl_x": finer * FOCAL[0],
        "fl_y": finer * FOCAL[1],
        "cx": finer * CENTRE[0] + 0.5,
        "cy": finer * CENTRE[1] + 0.5,
        "w": finer * SIZE[1],
        "h": finer * SIZE[0],
    }
    path = folder / "transforms.json"
    path.write_text(json.dumps(lens | {"frames": frames}))
    return path


def write_redwood(folder, count):
    """As Open3D and Redwood write them: `depth/`, `color/`, `camera.json`, `trajectory.log`; returns the folder."""
    (folder / "depth").mkdir(parents=True)
    (folder / "color").mkdir()
    lines = []
    for k, (camera, depths) in enumerate(images(count)):
        (folder / "depth" / f"{k:06}.png").write_bytes(png(depths))
        (folder / "color" / f"{k:06}.png").write_bytes(png(np.full((*SIZE, 3), (10, 200, 30), np.uint8)))
        lines += [f"{k} {k} {k + 1}", *(" ".join(f"{x:.12g}" for x in row) for row in camera.world_from_sensor)]
    (folder / "trajectory.log").write_text("\n".join(lines) + "\n")
    matrix = [FOCAL[0], 0, 0, 0, FOCAL[1], 0, *CENTRE, 1]
    camera = {"width": SIZE[1], "height": SIZE[0], "intrinsic_matrix": matrix}
    (folder / "camera.json").write_text(json.dumps(camera))
    return folder
