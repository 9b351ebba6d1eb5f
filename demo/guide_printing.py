"""The picture of the guide to printing: a merged surface with openings, closed by this library and by Screened Poisson.

`bench/close_statue.py` makes the surfaces where its peers are installed, and leaves them where the pictures go.
"""

import json
import sys

import numpy as np
from guide_drawing import made

# Darker than the clay of other pictures: marks and shadows must both be seen.
MEASURED, INSIDE = (0.36, 0.305, 0.25), (0.12, 0.10, 0.08)
UNSEEN, FILLED, EMPTY = (0.60, 0.18, 0.01), (0.045, 0.16, 0.46), (0.50, 0.012, 0.02)
# Rendered twice as large as they are shown.
WHOLE, CLOSE = (792, 880), (792, 720)
# Corners of the box that a detail shows, in mm, and what is behind it there: a window, as the statue ends at its rim.
NEAR, BEHIND = ((-57, -57, -14), (57, 57, 106)), (234, 236, 238)
# From the side that no scan saw.
LOOK = {"azimuth": 20, "elevation": 12}


def body(name, corners, *marks):
    """An object of triangles (n, 3, 3); each mark is a flag per triangle and its colour."""
    colours = np.tile(MEASURED, (len(corners), 1))
    for marked, colour in marks:
        colours[marked] = colour
    triangles = np.arange(3 * len(corners)).reshape(-1, 3)
    return made(name, corners.reshape(-1, 3), triangles, np.repeat(colours, 3, axis=0))


def lined(obj):
    """Makes the inner side of a surface dark, so that one looks into its openings."""
    tree = obj.data.materials[0].node_tree
    shader = tree.nodes["Principled BSDF"]
    mix, side = tree.nodes.new("ShaderNodeMixRGB"), tree.nodes.new("ShaderNodeNewGeometry")
    tree.links.new(side.outputs["Backfacing"], mix.inputs["Fac"])
    tree.links.new(shader.inputs["Base Color"].links[0].from_socket, mix.inputs["Color1"])
    mix.inputs["Color2"].default_value = (*INSIDE, 1)
    tree.links.new(mix.outputs["Color"], shader.inputs["Base Color"])
    return obj


def printing(p):
    """A surface that scans of one side leave open, and the fills of two programs."""
    made_before = p.out / "printing.npz"
    if not made_before.is_file():
        sys.exit(f"{made_before} is not there: run bench/close_statue.py first, as tools/gallery.sh does")
    surfaces = np.load(made_before)
    told = json.loads((p.out / "printing.json").read_text())
    box = made("Box", np.array(NEAR), [(0, 1, 0)])

    def whole(name, obj, title, text):
        return p.view(f"printing-{name}", [obj], WHOLE, title, text, frame=[statue], **LOOK)

    def detail(name, title):
        far, empty = surfaces[f"{name}_far"], surfaces[f"{name}_empty"]
        obj = body(title, surfaces[name], (far, FILLED), (empty, EMPTY))
        text = f"red: {told[f'{name}_empty_pct']:.1f} % of the fill, where scans saw empty space"
        shown = p.view(f"printing-{name}", [obj], CLOSE, title, text, frame=[box], room=1, floor=False, **LOOK)
        return shown | {"behind": BEHIND}

    statue = body("Statue", surfaces["statue"], (surfaces["statue_far"], UNSEEN))
    measured = lined(body("Merged", surfaces["open"]))
    p.picture(
        "printing-closed",
        [
            whole("open", measured, f"{told['scans']} scans merged", "all from one side: the other side is open"),
            whole("unseen", statue, "The statue", f"orange: the {told['statue_pct']:.0f} % that no scan saw"),
        ],
        [detail("ours", "Closed by surfrecon"), detail("poisson", "Screened Poisson")],
    )
