"""Scenes for the examples of the guides: files in their folder, and names that they do not make."""

import functools
import shutil

import made_scans
import numpy as np
import photos
import recordings
import surfrecon
from heaps import look, pushed
from shapes import torus


class Scenes:
    """Files that are made once, and copied for each example."""

    def __init__(self, folder):
        self.folder = folder

    @functools.cached_property
    def scans(self):
        """A folder of six scans from one turn of a table, without poses; and the scans with them."""
        folder, truth = self.folder / "scans", look(pixels=260)
        folder.mkdir()
        for scan in truth:
            scan.write(folder / f"{scan.name}.ply")
        return folder, truth

    @functools.cached_property
    def placed(self):
        """A list of scans with poses."""
        folder = self.folder / "placed"
        folder.mkdir()
        surfrecon.write_scans(folder / "bun.conf", look())
        return folder

    @functools.cached_property
    def phone(self):
        """A recording of a ring on a floor, in metres, 192 x 256 pixels a frame."""
        ring = torus()
        floor = np.array([(x, y, -0.2) for x in (-2, 2) for y in (-2, 2)])
        corners = np.array([(0, 2, 1), (1, 2, 3)]) + len(ring.positions)
        subject = surfrecon.Mesh(np.vstack([0.4 * ring.positions, floor]), np.vstack([ring.triangles, corners]))
        folder = self.folder / "phone"
        recordings.write_transforms(folder, 6, subject=subject, finer=4)
        return folder

    @functools.cached_property
    def virtual(self):
        """The scans that `demo/made_scans.py` makes, as the guides say."""
        folder = self.folder / "made"
        made_scans.make_all(folder)
        return folder

    def made(self, folder):
        """The same elsewhere."""
        shutil.copytree(self.virtual, folder, dirs_exist_ok=True)
        return {}

    def heap(self, folder):
        """A folder of scans without poses."""
        shutil.copytree(self.scans[0], folder / "folder of scans")
        return {}

    def jobs(self, folder):
        """A folder of scans without poses, named by their views."""
        (folder / "scans").mkdir()
        for image in look():
            image.write(folder / "scans" / f"{image.name}.ply")
        return {}

    def heights(self, folder):
        """A height map."""
        row, col = np.mgrid[:60, :80]
        np.save(folder / "heights.npy", np.sin(row / 9) * np.cos(col / 7))
        return {}

    def surface(self, folder):
        """A dense surface."""
        surfrecon.merge(look()).mesh.write(folder / "surface.ply")
        return {}

    def recording(self, folder):
        """A phone's recording, and its depths as one array and as images."""
        shutil.copytree(self.phone, folder / "export of a phone")
        depths = [frame.image.points[..., 2] for frame in surfrecon.open(self.phone)]
        np.save(folder / "depths.npy", np.nan_to_num(np.stack(depths)))
        made_scans.write_depths(folder / "depths of a camera", np.nan_to_num(depths))
        return {}

    def large(self, folder):
        """A list of scans, and a folder to work in."""
        surfrecon.write_scans(folder / "placed.conf", look())
        (folder / "fast disk").mkdir()
        return {}

    def planned(self, folder):
        """A folder of scans with poses, and one to work in."""
        shutil.copytree(self.placed, folder / "scans")
        (folder / "work").mkdir()
        return {}

    def listed(self, folder):
        """A list of scans, and a folder of them; the first one, a closed surface, and points on it."""
        shutil.copytree(self.placed, folder, dirs_exist_ok=True)
        shutil.copytree(self.scans[0], folder / "folder of scans")
        scans, mesh = surfrecon.open(folder / "bun.conf"), torus()
        return {"scans": scans, "image": scans[0].read(), "mesh": mesh, "points": mesh.positions}

    def points_picked(self, folder):
        """Scans without poses, and a place that two of them show."""
        folder, truth = self.scans
        made = picked(truth)
        made["point"] = truth[0].points[120, 45]
        return made | {"scans": surfrecon.open(folder)}

    def table(self, folder):
        """Scans of something that stands on a floor."""
        return {"scans": surfrecon.open(self.phone)}

    def photographed(self, folder):
        """A light mesh, the detailed surface that it stands for, and photos of that."""
        detail = torus(24)
        return {"light": torus(8), "detail": detail, "photos": photos.around(detail, count=3)}

    def nothing(self, folder):
        """Examples that make all they need."""
        return {}


def picked(truth):
    """A place that scans 0 and 1 both show, with its normals, in their frames; where scan 4 lies, roughly."""
    row, col = 120, 45
    other_point, other_normal = facing(truth[1], nearest(truth[1], truth[0].world_points()[row, col]))
    return {
        "other_point": other_point,
        "normal": facing(truth[0], (row, col))[1],
        "other_normal": other_normal,
        # The largest scan stays, and no file has a pose: the world is its frame.
        "rough_pose": pushed(truth[4], 3, 0.02) @ np.linalg.inv(truth[4].world_from_sensor),
    }


def nearest(scan, place):
    """The pixel of a scan whose sample lies nearest to a place in the world."""
    distances = np.linalg.norm(scan.world_points() - place, axis=-1)
    return np.unravel_index(np.nanargmin(distances), distances.shape)


def facing(scan, pixel):
    """A sample and its normal, which faces the sensor, in the scan's frame."""
    row, col = pixel
    points = np.asarray(scan.points, float)
    normal = np.cross(points[row, col + 1] - points[row, col - 1], points[row - 1, col] - points[row + 1, col])
    return points[row, col], normal / np.linalg.norm(normal)
