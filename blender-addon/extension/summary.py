# SPDX-License-Identifier: GPL-3.0-or-later
"""The first lines of a report: the few that people look for. All other figures are folded below them."""

from .declared import OPERATIONS, REPORTS
from .imported import of_scans
from .operators.merge import REPORT as MERGED
from .operators.quads import REPORT as GRIDDED
from .operators.reconstruct import REPORT as RECONSTRUCTED
from .translations import word
from .words import length, size

# Custom properties of what is a surface.
KINDS = (["a mesh"], ["a grid of quads"])
SURFACES = (MERGED, *(name for name, operation in REPORTS.items() if OPERATIONS[operation].gives in KINDS))

# Without a summary so many figures are not folded.
FEW = 5


def in_short(context, obj):
    """At most five (name, value) texts of a result that is a surface: triangles, size, holes, error and colours."""
    made = next((name for name in SURFACES if name in obj), None)
    if made is None:
        return
    figures = obj[made].to_dict()
    if obj.type == "MESH":
        is_quads = made == GRIDDED and "quads" in figures and len(obj.data.polygons) == figures["quads"]
        yield "Quads" if is_quads else "Triangles", f"{len(obj.data.polygons):,}"
    yield "Size", size(context, obj.dimensions)
    if made == MERGED:
        _, left = figures["holes"]
        yield "Holes", f"{left:,}" if left else word("none, it is closed")
    elif made == RECONSTRUCTED:
        yield "Holes", word("none, it is closed") if figures["closed"] else word("open")
    if "rms_error" in figures and "max_error" in figures:
        rms, most = (length(context, figures[name]) for name in ("rms_error", "max_error"))
        yield "Error", f"{rms} RMS, {word('at most')} {most}"
    elif "max_error" in figures:
        yield "Error", f"{word('at most')} {length(context, figures['max_error'])}"
    elif "overlap_residual" in figures:
        yield "Scans disagree by", length(context, figures["overlap_residual"])
    if "coloured" in figures:
        seen = f"{100 * figures['seen_in_colour']:.3g} %, " if "seen_in_colour" in figures else ""
        yield "With colours", f"{seen}{of_scans(figures['coloured'], figures['scans'])}"


def folded(figures, summed_up):
    """The (name, value) texts to be shown at once, and those to be folded. Sentences are never folded, nor what leads
    to them.
    """
    if summed_up:
        return [row for row in figures if row[1] is None], [row for row in figures if row[1] is not None]
    last = max((k for k, (_, value) in enumerate(figures) if value is None), default=-1)
    cut = max(FEW, last + 1)
    return figures[:cut], figures[cut:]
