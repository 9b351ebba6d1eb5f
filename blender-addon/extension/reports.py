# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of results as (name, value) texts, in the scene's units."""

import itertools
import math

import surfrecon

from .declared import REPORTS
from .imported import of_scans
from .operators.align import REPORT as ALIGNED
from .operators.clean import REPORT as CLEANED
from .operators.cluster import REPORT as CLUSTERED
from .operators.measure import BACK
from .operators.measure import REPORT as MEASURED
from .operators.merge import IN_FILES, REPORT
from .operators.quads import REPORT as GRIDDED
from .operators.reconstruct import REPORT as RECONSTRUCTED
from .operators.sculpt import REPORT as SCULPTED
from .translations import word
from .words import length, sentence

# Kinds of figures, and shapes of them, that are told in a line.
KINDS = {"flag", "count", "integer", "bytes", "length", "angle", "ratio", "number", "choice", "stage"}
SHAPES = {"one", "optional", "array", "optional array"}
# So many sentences of a figure are shown at most. The custom property has all of them.
SENTENCES = 5
# The version whose figures the lines below choose from.
FIRST = "0.1"


class Told:
    """Figures of an operation as (name, value) texts: labels, kinds and names of choices are the library's."""

    def __init__(self, operation, context, figures):
        """Of `figures` as they are kept in a file."""
        self.rows = {row.name: row for row in surfrecon.figures(operation)}
        self.context = context
        self.figures = figures
        self.named = set()

    def label(self, name):
        """The name of a figure for people."""
        self.named.add(name)
        return self.rows[name].label

    def value(self, name):
        """A figure as people read it."""
        return self.text(self.rows[name], self.figures[name])

    def others(self, newer=False):
        """Those that no line names: all, or those that came after the lines were chosen."""
        yield from self(*(row.name for row in self.shown() if row.since != FIRST or not newer))

    def shown(self):
        """The rows of those that no line names."""
        rows = [row for name, row in self.rows.items() if name not in self.named]
        return [row for row in rows if row.kind in KINDS and row.shape in SHAPES]

    def __call__(self, *names):
        """Those of these names that the file has: an older one may lack some."""
        self.named.update(names)
        for name in names:
            if name in self.figures:
                row = self.rows[name]
                yield row.label, self.text(row, self.figures[name])

    def text(self, row, value):
        """A value as people read it."""
        if row.kind == "stage":
            return f"{sum(value.values()):.2f} s"
        if row.kind == "choice":
            # Files saved by earlier versions have the words here.
            return word(next((label for name, label, _ in row.choices if name == value), value))
        if row.shape in ("array", "optional array"):
            return ", ".join(self.one(row, part) for part in value)
        return self.one(row, value)

    def one(self, row, value):
        """One number."""
        if row.kind == "flag":
            return word("yes") if value else word("no")
        if row.kind == "bytes":
            return f"{value / 1e6:.0f} MB"
        if row.kind == "length":
            return length(self.context, value)
        if row.kind == "angle":
            return f"{math.degrees(value):.1f}°"
        if row.kind == "ratio":
            return f"{100 * value:.4g} %"
        return f"{value:.4g}" if row.kind == "number" else f"{int(value):,}"


def sculpt_lines(context, figures):
    """The figures of a sculpted scan as (name, value) texts."""
    figures = figures.to_dict()
    told = Told("sculpt", context, figures)
    yield from told("triangles")
    yield "Of all", f"{100 * figures['triangles'] / max(figures['full_triangles'], 1):.1f} %"
    yield from told("tolerance", "max_error", "rms_error", "isolated_pixels", "seconds")
    yield from told.others(newer=True)


def reconstruct_lines(context, figures):
    """The figures of a surface through points as (name, value) texts."""
    figures = figures.to_dict()
    told = Told("reconstruct", context, figures)
    yield from told("points", "used", "not_finite", "duplicates", "inside", "outside", "outliers")
    yield "Taken as", word("closed") if figures["closed"] else word("open")
    yield from told("tetrahedra")
    # The seconds of a surface include those of its stages.
    seconds = figures["seconds"]
    yield told.label("seconds"), f"{seconds['sort'] + seconds['tetrahedralize'] + seconds['surface']:.2f} s"
    yield from told.others(newer=True)


def quads_lines(context, figures):
    """The figures of a quad grid as (name, value) texts."""
    figures = figures.to_dict()
    told = Told("quads", context, figures)
    yield "Vertices", f"{figures['rows']} x {figures['columns']}"
    yield from told("quads", "tiles", "relative_error", "uniform_relative_error", "rms_error", "max_error")
    if "max_residual" in figures:
        yield "Surface off the grid by", length(context, figures["max_residual"])
    yield from told("gaps_filled", "seconds")
    yield from told.others(newer=True)


# Words for a scan that was not moved.
UNMOVED = {"kept": "stays", "apart": "apart", "unplaced": "not placed", "undecided": "undecided"}
MOVE = "Move what is not placed to about where it belongs, and align again with Start: Rough"


def align_lines(context, figures):
    """The figures of an alignment as (name, value) texts, and what it says in sentences."""
    figures = figures.to_dict()
    told = Told("align", context, figures)
    names, states, reasons = (figures[each].split("\n") for each in ("names", "states", "reasons"))
    # Reports of files saved before count the names.
    of = figures.get("of", len(names))
    yield "Scans placed", of_scans(figures["placed"], of)
    if figures["groups"] > 1:
        yield told.label("groups"), f"{figures['groups']}"
    if "residual" in figures:
        yield "Scans disagree by", told.value("residual")
    # Scans without a place come first, with each reason once. Placed scans come last.
    scans = sorted(
        zip(reasons, names, states, figures["deviations"], strict=True), key=lambda scan: (not scan[0], scan[0])
    )
    placed = []
    for reason, alike in itertools.groupby(scans, key=lambda scan: scan[0]):
        for _, name, state, deviation in alike:
            if reason:
                yield name, word(UNMOVED.get(state, state))
            else:
                text = word(UNMOVED[state]) if state in UNMOVED else f"± {length(context, float(f'{deviation:.2g}'))}"
                placed.append((name, text))
        if reason:
            yield sentence(reason), None
    for message in figures["messages"].splitlines():
        yield sentence(message), None
    if figures["placed"] < of:
        yield word(MOVE), None
    yield from told.others(newer=True)
    yield from placed


def lie_apart(report):
    """Whether merged scans plainly don't fit: the report says so, or another cell of the grid has the other surface."""
    return bool(report.get("warnings")) or report.get("overlap_residual", 0) > report["voxel"]


def merge_lines(context, report):
    """The figures of a merge's report as (name, value) texts."""
    report = report.to_dict()
    told = Told("merge", context, report)
    faces = report["faces"]
    total = max(sum(faces), 1)
    yield from told("scans", "input_triangles")
    yield "Triangles", f"{int(sum(faces)):,}"
    yield from told("voxel")
    if report.get("voxel_reason", "given") not in ("given", "as given"):
        yield from told("voxel_reason")
    yield from told("merge_distance", "overlap_residual")
    for warning in (report.get("warnings") or "").splitlines():
        yield sentence(warning), None
    if lie_apart(report) and not report.get("warnings"):
        apart = length(context, report["overlap_residual"])
        yield f"The scans lie {apart} apart where they overlap: align them first", None
    yield from told(*(name for name in ("noise", "noise_across", "noise_step") if report.get(name)))
    if report.get("noise_correlation", 1) > 1:
        yield told.label("noise_correlation"), f"{report['noise_correlation']:.0f} px"
    if "rms_error" in report:
        yield "RMS error", length(context, report["rms_error"])
        yield "Largest error", length(context, report["max_error"])
    filling = ("holes_seen_through", "filled_area", "filled_share")
    yield from told("holes", "max_hole_length", *(name for name in filling if report.get(name)))
    yield from told("dropped_components", "shortest_edge")
    if gains := list(report.get("colour_gains", ())):
        yield told.label("colour_gains"), f"{min(gains):.2f} {word('to')} {max(gains):.2f}"
    if report.get("in_files"):
        yield IN_FILES[0].upper() + IN_FILES[1:], None
    if "renewed" in report:
        yield "Done anew", word("{} of {} blocks").format(*report["renewed"])
    if report.get("seen_through"):
        yield told.label("seen_through"), f"{told.value('seen_through')} {word('edges')}"
    yield "Case a, b, c", ", ".join(f"{100 * n / total:.1f}" for n in faces) + " %"
    yield from told("seconds", "working_bytes")
    yield from told.others(newer=True)


def cluster_lines(context, figures):
    """The figures of a remeshed surface as (name, value) texts."""
    figures = figures.to_dict()
    told = Told("cluster", context, figures)
    yield from told("vertices", "triangles")
    # Files saved by earlier versions have the angles of the result beside its other figures.
    shapes = figures.get("after", figures)
    yield "Mean smallest angle", f"{math.degrees(shapes['mean_smallest_angle']):.1f}°"
    yield "Smallest angle", f"{math.degrees(shapes['smallest_angle']):.1f}°"
    yield from told("max_error")
    if figures["kept_input"]:
        yield "Result", word("the input: nothing coarser found that near")
    if figures["cut_edges"]:
        yield from told("cut_edges")
    yield from told.others(newer=True)


def measure_lines(context, figures):
    """The figures of a measured distance as (name, value) texts."""
    figures = figures.to_dict()
    told = Told("distance", context, figures)
    yield "Against", figures["against"]
    # As in the legend of the error map.
    for name, text in (("mean", "Mean"), ("rms", "RMS"), ("p95", "95 % below")):
        yield text, told.value(name)
    yield "Nowhere more than", told.value("bound")
    yield "Largest found", told.value("reached")
    if "hausdorff" in figures:
        yield "From there: RMS", length(context, figures["back_rms"])
        yield "Nowhere more than", length(context, figures["back_bound"])
        yield "Either way at most", length(context, figures["hausdorff"])
    yield from told.others(newer=True)


def clean_lines(context, figures):
    """The figures of what was removed from a scan, as (name, value) texts."""
    figures = figures.to_dict()
    yield "Samples", f"{figures['samples']:,}"
    yield "Removed: in small parts", f"{figures['small']:,}"
    yield "Removed: of low confidence", f"{figures['doubtful']:,}"


# Custom property of a result -> its lines.
LINES = {
    ALIGNED: align_lines,
    REPORT: merge_lines,
    SCULPTED: sculpt_lines,
    GRIDDED: quads_lines,
    RECONSTRUCTED: reconstruct_lines,
    CLUSTERED: cluster_lines,
    MEASURED: measure_lines,
    CLEANED: clean_lines,
}


def lines_of_all(operation):
    """The lines of an operation that has none above: a line for each figure that it declares, and its warnings."""

    def lines(context, figures):
        told = Told(operation, context, figures.to_dict())
        yield from told.others()
        for row in told.rows.values():
            if row.kind == "warning":
                for text in told.figures.get(row.name, "").splitlines()[:SENTENCES]:
                    yield sentence(text), None

    return lines


# Reports of the library that a custom property holds, by the operation that declares them.
DECLARED = {
    ALIGNED: "align",
    MEASURED: "distance",
    REPORT: "merge",
    SCULPTED: "sculpt",
    GRIDDED: "quads",
    RECONSTRUCTED: "reconstruct",
    CLUSTERED: "cluster",
}
OTHERS = {name: of for name, of in REPORTS.items() if name not in LINES and of not in DECLARED.values()}
DECLARED |= OTHERS
LINES |= {name: lines_of_all(operation) for name, operation in OTHERS.items()}
# Lengths that operators add to these figures.
ADDED_LENGTHS = {
    ALIGNED: {"deviations"},
    REPORT: {"rms_error", "max_error"},
    GRIDDED: {"max_residual", "rms_residual"},
    MEASURED: {"hausdorff"},
}


def lengths_of(name):
    """The figures of a custom property that are lengths. Those of the way back have a name of their own."""
    declared = (
        {row.name for row in surfrecon.figures(DECLARED[name]) if row.kind == "length"} if name in DECLARED else set()
    )
    back = {f"{BACK}{one}" for one in declared} if name == MEASURED else set()
    return declared | back | ADDED_LENGTHS.get(name, set())


def grow(obj, scale):
    """Scales the lengths among an object's figures, as it is scaled."""
    for name in LINES:
        figures = obj.get(name)
        if not hasattr(figures, "to_dict"):
            # Custom properties can be changed by anyone.
            continue
        for key in lengths_of(name) & set(figures.keys()):
            value = figures[key]
            figures[key] = value * scale if isinstance(value, int | float) else [one * scale for one in value]
