"""Advice in terms of the command line: the library says it in those of Python.

A table of what the library says and what is said here. The longer ones come first: others are parts of them.
"""

from __future__ import annotations

__all__ = ["TABLE", "advised"]

TABLE = (
    ("camera = (fx, fy, cx, cy)", "--camera fx,fy,cx,cy"),
    ("(allow_outside)", "(--allow-outside)"),
    (
        'start = "rough" looks near poses alone. Say "unknown" instead, or "sequence" for frames in their order',
        "--start rough looks near poses alone. Say --start unknown instead, or --start sequence for frames in their"
        " order",
    ),
    ('Say start = "rough"', "Say --start rough"),
    ('say start = "sequence"', "say --start sequence"),
    ('say start = "unknown"', "say --start unknown"),
    ("give the distance of their pixels as step", "give the distance of their pixels as --step"),
    ('poses = "camera_to_world" or "world_to_camera"', "--poses camera_to_world or world_to_camera"),
    ('axes = "y_down" or "y_up"', "--axes y_down or y_up"),
    ("max_decoded_gib = ", "--max-decoded-gib "),
    ("pixels = terrain_rgb or terrarium", "--pixels terrain_rgb or terrarium"),
    ("with surfrecon.write()", "with surfrecon convert"),
)


def advised(text: str) -> str:
    """A text of the library with advice that can be followed here."""
    for theirs, ours in TABLE:
        text = text.replace(theirs, ours)
    return text
