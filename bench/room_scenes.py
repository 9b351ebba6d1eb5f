"""Rooms seen from inside, with what stands in them by a seed, and ways through them; metres."""

import math
from dataclasses import dataclass

import noise_room
import numpy as np
from noise_shapes import box, joined, look, sphere

# Length of the edges of walls and things: a virtual scanner asks for no finer ones.
STEP = 0.5
# How far things stand off the floor and the walls, so that no two surfaces are one.
APART = 0.005


@dataclass
class Room:
    """A room and a way through it: `way(share)` gives eye and target, for shares of the way from 0 to 1."""

    vertices: np.ndarray
    faces: np.ndarray
    way: object
    closed: bool = True  # whether the way ends where it began

    def poses(self, count, begin=0.0):
        """World from camera at even steps of the way; a closed way may begin anywhere."""
        last = count if self.closed else max(count - 1, 1)
        shares = [(begin * self.closed + k / last) % 1.0 if self.closed else k / last for k in range(count)]
        return np.array([look(*map(np.array, self.way(share))) for share in shares])


def statue():
    """The sculpture, 1 m high, standing at the origin."""
    import surfrecon

    mesh = surfrecon.sculpture(cell=6.0)
    low, high = mesh.bounds
    middle = np.append((low + high)[:2] / 2, low[2])
    return (mesh.positions - middle) / (high - low).max(), np.asarray(mesh.triangles)


def turned(part, angle, to):
    """A part turned about z and moved."""
    vertices, faces = part
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    return vertices @ turn.T + to, faces


def thing(generator, kind):
    """A box, a ball or a statue at the origin, and how high its middle, or foot, stands."""
    if kind == 0:
        size = generator.uniform([0.25, 0.25, 0.3], [1.0, 1.0, 1.4])
        return box(-size / 2, size / 2, STEP), size[2] / 2
    if kind == 1:
        radius = generator.uniform(0.15, 0.35)
        return sphere([0, 0, 0], radius, 0.05), radius
    vertices, faces = statue()
    return (generator.uniform(0.8, 1.6) * vertices, faces), 0.0


def along_walls(generator, count, length, width):
    """Things along the four walls of a room around the origin: of three two are boxes."""
    parts = []
    for k in range(count):
        part, up = thing(generator, int(generator.choice(3, p=[0.66, 0.2, 0.14])))
        side = 1 if k // 2 % 2 == 0 else -1
        far = (length / 2 - 0.4) * side, (width / 2 - 0.4) * side
        at = generator.uniform(-0.4, 0.4, 2) * [length, width]
        to = [far[0], at[1], up + APART] if k % 2 == 0 else [at[0], far[1], up + APART]
        parts.append(turned(part, generator.uniform(0, 3), to))
    return parts


def shell(low, high):
    """A room's walls, floor and ceiling."""
    return box(low, high, STEP, inside_out=True)


def whole_turn(side):
    """A turn about a room of 5 x 4 m, up and down: along an oval, looking at the near (1) or the far (-1) walls."""

    def way(share):
        turn = 2 * math.pi * share
        ahead = turn + 0.5
        eye = [side * math.cos(turn), side * 0.7 * math.sin(turn), 1.35 + 0.15 * math.sin(2 * turn)]
        return eye, [2.4 * math.cos(ahead), 2 * math.sin(ahead), 0.8 + 0.3 * math.sin(3 * turn)]

    return way


def flat_turn(share):
    """A turn along a narrow oval, through the door between two rooms."""
    turn = 2 * math.pi * share
    ahead = turn + 0.7
    eye = np.array([2.5 * math.cos(turn), 0.3 * math.sin(turn), 1.4 + 0.1 * math.sin(2 * turn)])
    return eye, eye + [2 * math.cos(ahead), 2 * math.sin(ahead), -0.5]


def through(points, swing=0.5, down=0.25):
    """A way along points, looking ahead, and to the sides in turn."""
    points = np.array(points, float)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    marks = np.append(0, np.cumsum(lengths)) / lengths.sum()

    def at(share):
        return np.array([np.interp(min(share, 1.0), marks, points[:, axis]) for axis in range(3)])

    def way(share):
        # Corners are cut, as a person does.
        eye = np.mean([at(max(share + off, 0)) for off in np.linspace(-0.04, 0.04, 9)], axis=0)
        ahead = np.mean([at(share + off) - at(max(share - 0.02, 0)) for off in (0.04, 0.07, 0.1)], axis=0)
        end = points[-1] - points[-2]
        ahead = ahead if np.linalg.norm(ahead[:2]) > 1e-6 else end
        angle = math.atan2(ahead[1], ahead[0]) + swing * math.sin(12 * math.pi * share)
        return eye, eye + [math.cos(angle), math.sin(angle), -down + 0.1 * math.sin(20 * math.pi * share)]

    return way


def box_room(seed, things=14):
    """A room of 5 x 4 x 2.7 m; of odd seeds the near walls are looked at, of even ones the far walls."""
    generator = np.random.default_rng([seed, 1])
    parts = [shell([-2.5, -2, 0], [2.5, 2, 2.7]), *along_walls(generator, things, 5, 4)]
    return Room(*joined(parts), whole_turn(1 if seed % 2 else -1))


def empty_room(seed):
    """The same room without anything in it."""
    return box_room(seed, things=0)


def furnished(_):
    """The room with cupboard, shelf and table of the benchmark of noise."""
    return Room(*noise_room.furnished(STEP), whole_turn(-1))


def l_room(seed):
    """A room of 6 x 5 m, of which a corner of 3 x 2.5 m is missing; the way goes from one arm's end to the other's."""
    generator = np.random.default_rng([seed, 2])
    parts = [shell([-3, -2.5, 0], [3, 2.5, 2.7]), box([0, 0, -0.1], [3.1, 2.6, 2.8], STEP)]
    for k in range(10):
        part, up = thing(generator, int(generator.choice(3, p=[0.66, 0.2, 0.14])))
        along = generator.uniform(-0.45, 0.45)
        to = [[-2.6, 5 * along], [6 * along, -2.1], [-0.35, 1.25 + 2 * along], [1.5 + 2.5 * along, -0.35]][k % 4]
        parts.append(turned(part, generator.uniform(0, 3), [*to, up + APART]))
    return Room(*joined(parts), through([[-1.4, 1.6, 1.4], [-1.4, -1.2, 1.4], [2.0, -1.2, 1.5]]), closed=False)


def corridor(seed):
    """A corridor of 14 x 1.8 x 2.5 m with equal doors on both sides; the seed says where some of them are open."""
    generator = np.random.default_rng([seed, 3])
    parts = [shell([-7, -0.9, 0], [7, 0.9, 2.5])]
    for k in range(6):
        for side in (-0.9, 0.9):
            at = np.array([2.2 * k - 5.5, side, 1.0])
            half = np.array([0.45, 0.06 + 0.1 * (generator.random() < 0.2), 1.0])
            parts.append(box(at - half, at + half, STEP))
    return Room(*joined(parts), through([[-6, 0, 1.4], [5.5, 0.1, 1.5]]), closed=False)


def stairs(seed):
    """A flight of 14 equal steps up one side of a stairwell, a landing at its end; the way goes up."""
    generator = np.random.default_rng([seed, 4])
    parts = [shell([-1.2, -1, 0], [6, 2, 5.5])]
    for k in range(14):
        parts.append(box([0.28 * k, -1.1, -0.1], [6.1, 0.2, 0.17 * (k + 1)], STEP))
    parts += [turned(thing(generator, 0)[0], generator.uniform(0, 3), [x, 1.4, 0.7]) for x in (0.5, 3.5)]
    up = [[-0.8, -0.4, 1.5], [0.0, -0.4, 1.5], [3.9, -0.4, 3.9], [4.8, -0.4, 3.9]]
    return Room(*joined(parts), through(up, swing=0.6, down=0.1), closed=False)


def office(seed):
    """An office of 8 x 6 x 2.7 m with six equal desks, each with a screen, and a cupboard at one end, by the seed."""
    at = np.random.default_rng([seed, 5]).uniform(-2, 2)
    # Without it the room turned by half a turn is the same, and no tool could say which frames see which end.
    parts = [shell([-4, -3, 0], [4, 3, 2.7]), box([3.3, at - 0.6, APART], [3.9, at + 0.6, 1.9], STEP)]
    for k in range(6):
        at = np.array([2.4 * (k % 3) - 2.4, -1.7 if k < 3 else 1.7, 0.0])
        for half, up in (([0.7, 0.4, 0.37], 0.37 + APART), ([0.25, 0.03, 0.18], 0.95)):
            parts.append(box(at + [0, 0, up] - half, at + [0, 0, up] + half, STEP))
    return Room(*joined(parts), flat_turn)


def twins(_):
    """Two equal rooms of 4 x 4 x 2.6 m with the same things in them, joined by a door.

    Most frames of one look as frames of the other do: that only the order tells.
    """
    parts = [shell([-4, -2, 0], [4, 2, 2.6])]
    for x in (-2.0, 2.0):
        for at, half in (
            ([x - 1.2, 1.4, 0.6], [0.35, 0.5, 0.6]),
            ([x + 0.4, -1.6, 0.35], [0.5, 0.3, 0.35]),
            ([x + 0.3, 1.7, 0.9], [0.2, 0.2, 0.9]),
        ):
            parts.append(box(np.subtract(at, half) + [0, 0, APART], np.add(at, half) + [0, 0, APART], STEP))
    parts += [box([-0.05, y - 0.75, -0.1], [0.05, y + 0.75, 2.7], STEP) for y in (-1.25, 1.25)]
    return Room(*joined(parts), flat_turn)


ROOMS = {
    "box": box_room,
    "furnished": furnished,
    "L": l_room,
    "corridor": corridor,
    "stairs": stairs,
    "office": office,
    "twins": twins,
    "empty": empty_room,
}


def depths(room, poses, camera):
    """Planar depth without any error that a camera sees from each pose, one after the other; 0: nothing."""
    import surfrecon

    mesh = surfrecon.Mesh(room.vertices, room.faces.astype(np.uint32))
    for first in range(0, len(poses), 20):
        cameras = [
            surfrecon.Camera.intrinsic(
                camera.rows, camera.cols, focal=(camera.focal,) * 2, centre=camera.centre, world_from_sensor=pose
            )
            for pose in poses[first : first + 20]
        ]
        for seen in surfrecon.virtual_scan(mesh, cameras):
            yield np.nan_to_num(seen.values)
