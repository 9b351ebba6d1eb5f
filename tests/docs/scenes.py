"""What the examples of the guides find when they run: files in their folder, and names that they do not make."""

import functools
import shutil

import numpy as np
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

    def python(self, folder):
        """`In Python`: scans without poses, points, and what a person picks."""
        scans, truth = self.scans
        (folder / "folder").mkdir()
        shutil.copytree(scans, folder / "folder" / "of" / "scans")
        return {"points": torus().positions} | picked(truth)

    def recording(self, folder):
        """`Recordings`, `What to keep`."""
        shutil.copytree(self.phone, folder / "export of a phone")
        return {}

    def survey(self, folder):
        """`Surveys`: scans seen from points far from the origin, in a system."""
        row, col = np.mgrid[-20:20, -20:20] / 20.0
        points = np.stack([col, row, 3 + 0.1 * np.cos(3 * col)], axis=-1)
        images = [surfrecon.RangeImage.from_points(points, viewing=("from", (0, 0, 0)), name=name) for name in "ab"]
        for image in images:
            pose = np.eye(4)
            pose[:3, 3] = 500_000, 5_000_000, 300
            image.world_from_sensor, image.crs = pose, "EPSG:25832"
        surfrecon.write_scans(folder / "survey.e57", images)
        return {}

    def again(self, folder):
        """`Merged again`: scans, and one that was moved."""
        moved = look()[3]
        moved.world_from_sensor = np.array(moved.world_from_sensor) + 0.01 * np.eye(4, k=3)
        return {"scans": look(), "moved": moved}

    def large(self, folder):
        """`More scans than memory holds`: a list of scans, and a folder to work in."""
        surfrecon.write_scans(folder / "placed.conf", look())
        (folder / "fast disk").mkdir()
        return {}

    def planned(self, folder):
        """A folder of scans with poses, and one to work in."""
        shutil.copytree(self.placed, folder / "scans")
        (folder / "work").mkdir()
        return {}

    def host(self, folder):
        """`Range images inside a host`."""
        return {"image": look()[0]}

    def memory(self, folder):
        """`Files in memory`: bytes that came from somewhere, and somebody who takes them."""
        sent = []
        received = (self.placed / "view0.ply").read_bytes()
        return {"received": received, "images": look(), "mesh": torus(), "send": sent.append}

    def listed(self, folder):
        """A list of scans, and a folder of them."""
        shutil.copytree(self.placed, folder, dirs_exist_ok=True)
        shutil.copytree(self.scans[0], folder / "folder of scans")
        return {"scans": surfrecon.open(folder / "bun.conf")}

    def table(self, folder):
        """Scans of something that stands on a floor."""
        return {"scans": surfrecon.open(self.phone)}

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
