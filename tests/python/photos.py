"""Photos of meshes for tests: as a pinhole camera sees them, with colours by places."""

import numpy as np
import surfrecon


def waves(places):
    """Smooth colours of space: (..., 3) uint8."""
    x, y, z = np.moveaxis(np.asarray(places, float), -1, 0)
    turned = np.stack([x + z, y - 0.4 * z, z + 0.5 * x], axis=-1)
    return (128 + 80 * np.sin(1.7 * turned)).astype(np.uint8)


def photo_of(mesh, name, eye, colour=waves, shape=(100, 120), **options):
    """A photo from a place, which looks at the origin. The background is grey."""
    camera = surfrecon.Camera.pinhole(*shape, height_angle=0.8, eye=eye, target=(0, 0, 0))
    places = surfrecon.virtual_scan(mesh, camera).world_points()
    seen = np.isfinite(places).all(axis=-1)
    pixels = np.full((*shape, 3), 90, np.uint8)
    pixels[seen] = colour(places[seen])
    projection = camera.projection
    return surfrecon.Photo(name, pixels, projection["focal"], projection["centre"], camera.world_from_sensor, **options)


def around(mesh, count=6, distance=5.0, **options):
    """Photos from all around."""
    photos = []
    for k in range(count):
        angle = 2 * np.pi * k / count
        eye = np.array([np.cos(angle), np.sin(angle), [0.7, -0.7, 0.1][k % 3]])
        photos.append(photo_of(mesh, f"photo {k}", distance * eye / np.linalg.norm(eye), **options))
    return photos


def coloured(mesh, colour=waves):
    """The mesh with colours of its vertices."""
    return surfrecon.Mesh(mesh.positions, mesh.triangles, colour=colour(mesh.positions))
