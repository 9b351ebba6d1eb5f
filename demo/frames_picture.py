"""Puts the panels of a recording side by side, with titles and figures, and prints the table of the run.

Usage: python frames_picture.py OUT FONT
Reads OUT/demo.json and OUT/demo.panel0.png and on, writes OUT/demo.png.
"""

import json
import sys
from pathlib import Path

from picture import GREY, INK, LINE, PAPER, Type, short
from PIL import Image, ImageDraw


def in_colours(f):
    """A text on the colours of the surface. Shares of a hundredth are not seen."""
    if not f["coloured"]:
        return "no frame has colours"
    share = f["seen_in_colour"]
    return "in the colours of the recording" + (f", {share:.0%} of it seen in colour" if share < 0.99 else "")


def captions(f):
    """Title, subtitle and rows (name, value) of each panel."""
    report, check = f["report"], f["check"]
    noise, apart = report.get("noise", 0), report.get("overlap_residual", 0)
    yield (
        f"{f['objects']} of {f['frames']} frames" if f["objects"] < f["frames"] else f"{f['frames']} frames",
        "as they were recorded, where the recording puts them",
        [("their samples", f"{f['samples']:,}"), ("they disagree by", f"{short(apart)} (median)")],
    )
    yield (
        "One surface",
        in_colours(f),
        [("triangles", f"{f['triangles']:,}"), ("all frames merged in", f"{f['seconds']['merge']:.1f} s")],
    )
    manifold = "manifold" if check["is_manifold"] else "NOT manifold"
    yield (
        "Its shape",
        f"{manifold}, noise averaged out",
        [("noise of a sample", short(noise) if noise else "none measured"), ("voxel", short(report["voxel"]))],
    )


def draw(figures, panels, font):
    """The whole picture."""
    width, height = figures["panel"]
    type_ = Type(font, width)
    u = type_.unit
    margin, gap = round(24 * u), max(round(4 * u), 2)
    page = Image.new("RGB", (len(panels) * (width + gap) - gap, height + round(180 * u)), PAPER)
    pen = ImageDraw.Draw(page)
    for k, (panel, (title, subtitle, lines)) in enumerate(zip(panels, captions(figures), strict=False)):
        left, top = k * (width + gap), height + round(20 * u)
        page.paste(panel, (left, 0))
        if k:
            pen.line([(left - gap, top), (left - gap, page.height - margin)], fill=LINE, width=max(1, round(u)))
        pen.text((left + margin, top), title, font=type_(30, 650), fill=INK)
        pen.text((left + margin, top + 40 * u), subtitle, font=type_(17), fill=GREY)
        for row, (name, value) in enumerate(lines):
            y = top + (76 + 26 * row) * u
            pen.text((left + margin, y), name, font=type_(18), fill=GREY)
            pen.text((left + margin + 210 * u, y), value, font=type_(18, 550), fill=INK)
    return page


def table(f):
    """The lines of the printed table."""
    report, check = f["report"], f["check"]
    yield "frames", f"{f['frames']:,}, {f['objects']} of them as objects, {f['samples']:,} samples"
    yield "voxel", f"{short(report['voxel'])} ({report.get('voxel_reason', 'given')})"
    yield "noise, frames disagree by", f"{short(report.get('noise', 0))}, {short(report.get('overlap_residual', 0))}"
    yield "triangles, vertices", f"{f['triangles']:,}, {f['vertices']:,}"
    yield "components, boundary loops", f"{check['components']}, {check['boundary_loops']}"
    yield "non-manifold edges, vertices", f"{check['non_manifold_edges']}, {check['non_manifold_vertices']}"
    for step, seconds in f["seconds"].items():
        yield step, f"{seconds:.1f} s"


def main():
    """Writes the picture, prints the table."""
    out, font = Path(sys.argv[1]), sys.argv[2]
    figures = json.loads((out / "demo.json").read_text())
    files = sorted(out.glob("demo.panel?.png"))
    panels = [Image.open(file).convert("RGB") for file in files]
    draw(figures, panels, font).save(out / "demo.png", optimize=True)
    for file in files:
        file.unlink()
    print(f"\n{figures['title']}: {figures['frames']} frames merged in Blender {figures['blender']}")
    for name, value in table(figures):
        print(f"  {name:32} {value}")


if __name__ == "__main__":
    main()
