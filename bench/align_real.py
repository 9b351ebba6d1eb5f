"""Scans of the archive's `scans_unregistered`: laser scans of a room and of streets, and a figurine."""

import numpy as np
from align_shapes import Cloud, of_corners
from scipy.spatial import cKDTree


def normals(points, neighbours=12):
    """Normals of the planes through each point's neighbours, towards the sensor at the origin."""
    _, near = cKDTree(points).query(points, k=neighbours)
    local = points[near] - points[near].mean(axis=1, keepdims=True)
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local))
    found = vectors[:, :, 0]
    return found * np.where((found * points).sum(1, keepdims=True) > 0, -1.0, 1.0)


def cloud(points, pose=None):
    """A cloud; all tools get the same normals."""
    return Cloud(points, normals(points), pose=np.eye(4) if pose is None else pose)


def room(folder):
    """3DTK's: centimetres, left-handed, placed by odometry. Very near and very far points are no surface."""
    mirror = np.diag([1.0, 1.0, -1.0])
    found = []
    for k in range(3):
        points = np.loadtxt(folder / "3dtk" / f"scan{k:03}.3d")
        far = np.linalg.norm(points, axis=1)
        shift, angles = np.loadtxt(folder / "3dtk" / f"scan{k:03}.pose")
        pose = np.eye(4)
        pose[:3, :3] = mirror @ about(0, angles[0]) @ about(1, angles[1]) @ about(2, angles[2]) @ mirror
        pose[:3, 3] = mirror @ shift
        found.append(cloud(points[(far > 48) & (far < 3270)] @ mirror, pose))
    return found


def about(axis, degrees):
    """The turn about x, y or z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
    return turn


def cars(folder):
    """libpointmatcher's two scans with poses, in metres."""
    place = folder / "libpointmatcher" / "examples" / "data"
    first = np.loadtxt(place / "car_cloud400.csv", delimiter=",", skiprows=1)[:, :3]
    second = np.loadtxt(place / "car_cloud401.csv")
    line = (place / "carCloudList.csv").read_text().splitlines()[2]
    pose = np.array(line.split(",")[1:], float).reshape(4, 4)
    # Its rotation has six digits.
    u, _, v = np.linalg.svd(pose[:3, :3])
    pose[:3, :3] = u @ v
    return [cloud(first), cloud(second, pose)]


def streets(folder):
    """libpointmatcher's three scans without poses, in metres."""
    found = []
    for k in range(3):
        text = (folder / "libpointmatcher" / "examples" / "data" / f"cloud.{k:05}.vtk").read_text()
        count, numbers = text.split("POINTS ", 1)[1].split(" float", 1)
        found.append(cloud(np.array(numbers.split(None, 3 * int(count))[: 3 * int(count)], float).reshape(-1, 3)))
    return found


def hippo(folder):
    """OpenGR's two views of a figurine: meshes, no unit."""
    found = []
    for k in (1, 2):
        lines = (folder / "hippo" / f"hippo{k}.obj").read_text().splitlines()
        points = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)
        faces = [[int(c.split("/")[0]) - 1 for c in line.split()[1:]] for line in lines if line.startswith("f ")]
        found.append(Cloud(points, of_corners(points, np.array(faces)), np.array(faces), np.eye(4)))
    return found


# Name, how they are read, millimetres in their unit, whether they have poses, how far these are off in spacings:
# odometry by 0.7 m where points lie 1 cm apart, the cars' poses by a metre at their far ends and 0.1 m.
SETS = [
    ("3dtk room", room, 10.0, True, 60.0),
    ("cars", cars, 1e3, True, 10.0),
    ("streets", streets, 1e3, False, 0.0),
    ("hippo", hippo, 1.0, False, 0.0),
]
