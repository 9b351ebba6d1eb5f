"""Scans as files, written independently of the library."""

import numpy as np


def write_range_grid(path, image):
    """Writes the pixels of a range image as a Stanford range-grid PLY, in the sensor's frame."""
    valid, points = image.valid, np.asarray(image.points, np.float64)
    index = np.full(valid.shape, -1)
    index[valid] = np.arange(valid.sum())
    lines = [
        "ply",
        "format ascii 1.0",
        f"obj_info num_cols {image.cols}",
        f"obj_info num_rows {image.rows}",
        f"element vertex {valid.sum()}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element range_grid {valid.size}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    lines += [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in points[valid]]
    lines += ["0" if i < 0 else f"1 {i}" for i in index.reshape(-1)]
    path.write_text("\n".join(lines) + "\n")


def quaternion(rotation):
    """(x, y, z, w) of a rotation matrix."""
    trace = np.trace(rotation)
    if trace > 0:
        s = 2 * np.sqrt(1 + trace)
        xyz = rotation[[2, 0, 1], [1, 2, 0]] - rotation[[1, 2, 0], [2, 0, 1]]
        return (*(xyz / s), s / 4)
    i = int(np.argmax(np.diag(rotation)))
    j, k = (i + 1) % 3, (i + 2) % 3
    s = 2 * np.sqrt(1 + rotation[i, i] - rotation[j, j] - rotation[k, k])
    q = np.zeros(4)
    q[i], q[3] = s / 4, (rotation[k, j] - rotation[j, k]) / s
    q[j], q[k] = (rotation[j, i] + rotation[i, j]) / s, (rotation[k, i] + rotation[i, k]) / s
    return tuple(q)


def write_set(folder, images, name="torus"):
    """Writes range images and the `.conf` that places them, with quaternions of scene from scan; returns its path."""
    lines = []
    for image in images:
        write_range_grid(folder / f"{image.name}.ply", image)
        pose = np.asarray(image.world_from_sensor)
        numbers = (*pose[:3, 3], *quaternion(pose[:3, :3]))
        lines.append(f"bmesh {image.name}.ply " + " ".join(f"{x:.9g}" for x in numbers))
    path = folder / f"{name}.conf"
    path.write_text("\n".join(lines) + "\n")
    return path
