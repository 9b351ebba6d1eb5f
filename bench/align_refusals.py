"""Scans that must not be placed, or not with each other."""

import numpy as np
from align_shapes import cube, look, relief, revolved, together


def shapes():
    """Shapes that may turn, slide, or lie in several places."""
    side = [(1, 0.2, 0.4), (0.6, 0.8, 0.5), (0.9, 0.5, 0.2)]
    above = [(0.2, 0.1, 1), (-0.2, 0.3, 1), (0.1, -0.3, 1)]

    def seen(mesh, towards):
        towards = np.array(towards, float)
        return look(mesh, towards / np.linalg.norm(towards, axis=1, keepdims=True))

    yield "ball", seen(revolved(lambda z, t: np.sqrt(np.maximum(1 - z**2, 0)) + 0 * t, 1.0), side)
    yield "cylinder", seen(revolved(lambda z, t: 0.6 + 0 * z + 0 * t, 1.0), side)
    yield "vase", seen(revolved(lambda z, t: 0.5 + 0.2 * np.sin(3 * z) + 0 * t, 1.0), side)
    yield "cube", seen(cube(), side)
    yield "fluted column", seen(revolved(lambda z, t: 0.6 + 0.04 * np.cos(16 * t) + 0 * z, 1.0, 320), side)
    yield "coin", seen(revolved(lambda z, t: 1.0 + 0 * z + 0 * t, 0.06), [(0.2, 0.1, 1), (0.1, 0.3, -1)])
    yield "plane", seen(relief(lambda x, y: 0 * x), above)
    yield "repeated relief", seen(relief(lambda x, y: 0.04 * np.sin(14 * x) * np.sin(14 * y)), above)


def lump(size):
    """A body that lies on itself in one way only, about as high as twice `size`."""

    def radius(z, turn):
        waves = 0.12 * np.sin(turn + 2 * z) + 0.08 * np.sin(3 * turn - 4 * z) + 0.06 * np.sin(5 * turn + 7 * z + 1)
        return size * (0.6 + waves) * np.sqrt(1.02 - z**2)

    return revolved(radius, size)


def corner(size):
    """Floor and two walls of a room that meet behind the origin, seen from (1, 1, 1)."""
    import surfrecon

    floor = relief(lambda x, y: 0 * x, size, 60)
    walls = [np.roll(floor.positions, shift, axis=1) for shift in (1, 2)]
    planes = [floor, *(surfrecon.Mesh(positions, floor.triangles) for positions in walls)]
    moved = [surfrecon.Mesh(p.positions + off, p.triangles) for p, off in zip(planes, size * behind(), strict=True)]
    return together(moved)


def behind():
    """The middles of floor and walls, for a size of 1."""
    return np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def before_a_corner(count=4, degrees=25.0):
    """A body on a turntable in a room: sensor and room stay, and the truth is the body's."""
    import surfrecon

    room, body, scans = corner(1.2), lump(0.5), []
    for k in range(count):
        angle = np.radians(k * degrees)
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        placed = surfrecon.Mesh(body.positions @ turn[:3, :3].T, body.triangles)
        (scan,) = look(together([placed, room]), [np.full(3, 3**-0.5)], seed=1)
        scan.world_from_sensor = np.linalg.inv(turn) @ scan.world_from_sensor
        scans.append(scan)
    return scans
