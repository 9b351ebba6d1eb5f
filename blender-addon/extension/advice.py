# SPDX-License-Identifier: GPL-3.0-or-later
"""Advice in Blender's terms: the library says what its callers can do, and not all of that is in a window.

A table of what the library says and what is said here. The longer ones come first: others are parts of them.
"""

ROUGH = "move it to about where it belongs and align again with Start: Rough"

START = "move one of each group to about where it belongs and align again with Start: Rough"

TABLE = (
    (
        "Align the recording as a sequence, give rough poses, or a pair of points that both show",
        "Align again with Start: Sequence, or move these scans to about where they belong and align again with"
        " Start: Rough",
    ),
    ("give rough poses, or a pair of points that two of them show", START),
    ("give a pair of points that two of them show", "move one of each group nearer to where it belongs"),
    (
        'start = "rough" looks near poses alone. Say "unknown" instead, or "sequence" for frames in their order, or'
        " give the poses",
        "Start: Rough looks near poses alone. Choose Start: Unknown or Start: Sequence, or move the scans to about"
        " where they belong",
    ),
    ('Say start = "rough"', "Choose Start: Rough"),
    ('say start = "sequence"', "choose Start: Sequence"),
    ('say start = "unknown"', "choose Start: Unknown"),
    ("align the recording as a sequence, give it a rough pose, or ", f"align again with Start: Sequence, {ROUGH}, or "),
    ("give it a rough pose, or pairs of points", ROUGH),
    ("give it a rough pose, or a pair of points that both show", ROUGH),
    ("give it a rough pose, or ", f"{ROUGH}, or "),
    ("give pairs of points that both show, or ", f"{ROUGH}, or "),
    ("give it a pair of points that both show", "move it nearer to where it belongs"),
    ("give it pairs of points", "move it nearer to where it belongs"),
    ("place it by pairs of points, or leave it out", "place it by hand, or leave it out"),
    (
        "or give it by three points, or change the tolerance",
        "or press Ground with a ruler bent over three of its points. Remove Background has a Tolerance",
    ),
    (
        "or give it by three points, or lower the least share",
        "or press Ground with a ruler bent over three of its points. Remove Background has a Min share",
    ),
    ("or give it by three points", "or press Ground with a ruler bent over three of its points"),
    ("give the plane by three points", "press Ground with a ruler bent over three points of the plane"),
)


def advised(text):
    """A text of the library with advice that can be followed here."""
    for theirs, ours in TABLE:
        text = text.replace(theirs, ours)
    return text
