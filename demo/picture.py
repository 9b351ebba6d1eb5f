"""Puts titles, figures and the legend to the rendered panels, and prints the table of the run.

Usage: python picture.py OUT FONT
Reads OUT/demo.json and OUT/demo.render.png, writes OUT/demo.png.
"""

import json
import sys
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

PAPER, INK, GREY, LINE = (252, 252, 251), (28, 31, 36), (104, 110, 118), (214, 217, 220)


class Type:
    """One variable font in the sizes and weights asked for; sizes are for a panel of 600 pixels."""

    def __init__(self, path, panel):
        self.path, self.unit = path, panel / 600
        self.made = {}

    def __call__(self, size, weight=400):
        """A font."""
        if (size, weight) not in self.made:
            font = ImageFont.truetype(self.path, round(size * self.unit))
            font.set_variation_by_axes([min(max(size, 14), 32), weight])
            self.made[size, weight] = font
        return self.made[size, weight]


def short(metres):
    """A length in mm."""
    return f"{metres * 1e3:.3f} mm" if metres < 0.01 else f"{metres * 1e3:.1f} mm"


def filled(report):
    """The row of what was filled, if more than holes was closed."""
    if report.get("filled_share"):
        yield "filled", f"{100 * report['filled_share']:.1f} % of the area"


def captions(f):
    """Title and rows (name, value) of each panel."""
    report, check, error, residual = f["report"], f["check"], f["error"], f["residual"]
    closed, left = report["holes"]
    manifold = "manifold" if check["is_manifold"] else "NOT manifold"
    if check["is_closed"]:
        manifold = f"closed, {manifold}"
    parts = "one component" if check["components"] == 1 else f"{check['components']} components"
    source = "virtual scans, noisy and slightly misplaced" if f["virtual"] else "registered range scans"
    against = "the true surface" if f["virtual"] else "the scans"
    yield (
        f"{f['scans']} scans",
        source,
        [
            ("samples", f"{f['samples']:,}"),
            ("triangles", f"{report['input_triangles']:,}"),
            ("they disagree by", short(report.get("overlap_residual", 0)) + " (median)"),
        ],
    )
    yield (
        "One surface",
        f"{manifold}, {parts}",
        [
            ("triangles", f"{f['triangles']:,}"),
            ("voxel", short(report["voxel"])),
            ("openings", f"{closed} closed, {left} left"),
            *filled(report),
            ("merged in", f"{f['seconds']['merge']:.1f} s"),
        ],
    )
    yield (
        "Error",
        f"distance of the surface to {against}",
        [
            ("RMS", short(error["rms"])),
            ("max", short(error["max"])),
            ("scans to surface", short(residual["rms"]) + " RMS"),
        ],
    )


def gradient(ramp, width, height):
    """The legend's bar."""
    bar = Image.new("RGB", (width, 1))
    for x in range(width):
        t = x / max(width - 1, 1)
        for (a, low), (b, high) in zip(ramp, ramp[1:], strict=False):
            if t <= b:
                share = (t - a) / (b - a)
                colour = (low[k] + share * (high[k] - low[k]) for k in range(3))
                bar.putpixel((x, 0), tuple(round(255 * c) for c in colour))
                break
    return bar.resize((width, height))


def draw(figures, render, type_):
    """The whole picture."""
    u = type_.unit
    panel = figures["picture"]["panel"]
    margin = round(40 * u)
    rows = round(26 * u)
    below = round(258 * u)
    page = Image.new("RGB", (render.width, render.height + below), PAPER)
    page.paste(render, (0, 0))
    pen = ImageDraw.Draw(page)
    top = render.height + round(26 * u)
    for k, (title, subtitle, lines) in enumerate(captions(figures)):
        left, right = k * panel + margin, (k + 1) * panel - margin
        if k:
            pen.line([(k * panel, top), (k * panel, page.height - margin)], fill=LINE, width=max(1, round(u)))
        pen.text((left, top), title, font=type_(30, 650), fill=INK)
        pen.text((left, top + 40 * u), subtitle, font=type_(17), fill=GREY)
        y = top + 76 * u
        for name, value in lines:
            pen.text((left, y), name, font=type_(18), fill=GREY)
            pen.text((left + 168 * u, y), value, font=type_(18, 550), fill=INK)
            y += rows
        if k == 2:
            bar = gradient(figures["ramp"], right - left, round(14 * u))
            y += 12 * u
            page.paste(bar, (left, round(y)))
            y += 20 * u
            limit = figures["error"]["limit"]
            pen.text((left, y), "0", font=type_(15), fill=GREY)
            pen.text(((left + right) / 2, y), f"{limit * 500:.3g} mm", font=type_(15), fill=GREY, anchor="ma")
            pen.text((right, y), f"{limit * 1000:.3g} mm and more", font=type_(15), fill=GREY, anchor="ra")
    return page


def table(f):
    """The lines of the printed table."""
    report, check = f["report"], f["check"]
    total = max(sum(report["faces"]), 1)
    yield "scans", f"{f['scans']}, {f['samples']:,} samples, {report['input_triangles']:,} triangles"
    yield "voxel, merge distance", f"{short(report['voxel'])}, {short(report['merge_distance'])}"
    yield "scans disagree by (median)", short(report.get("overlap_residual", 0))
    yield "intersections", f"{report['intersections']:,}, after fusing {report['fused_intersections']:,}"
    yield "triangles, vertices", f"{f['triangles']:,}, {f['vertices']:,}"
    yield "faces by case a / b / c", " / ".join(f"{100 * n / total:.2f} %" for n in report["faces"])
    yield "openings closed, left open", f"{report['holes'][0]}, {report['holes'][1]}"
    yield from filled(report)
    yield "small parts dropped", f"{report['dropped_components'][0]}"
    yield "components, boundary loops", f"{check['components']}, {check['boundary_loops']}"
    yield "non-manifold edges, vertices", f"{check['non_manifold_edges']}, {check['non_manifold_vertices']}"
    against = "truth" if f["virtual"] else "scans"
    for name, key in ((f"surface to {against}", "error"), ("scans to surface", "residual")):
        d = f[key]
        yield name + ": mean, RMS, max", f"{short(d['mean'])}, {short(d['rms'])}, {short(d['max'])}"
    for step, seconds in f["seconds"].items():
        yield step, f"{seconds:.1f} s"


def main():
    """Writes the picture, prints the table."""
    out, font = Path(sys.argv[1]), sys.argv[2]
    figures = json.loads((out / "demo.json").read_text())
    with Image.open(out / "demo.render.png") as render:
        picture = draw(figures, render.convert("RGB"), Type(font, figures["picture"]["panel"]))
    picture.save(out / "demo.png", optimize=True)
    (out / "demo.render.png").unlink()
    print(f"\n{figures['title']}: {figures['scans']} scans merged in Blender {figures['blender']}")
    for name, value in table(figures):
        print(f"  {name:32} {value}")


if __name__ == "__main__":
    main()
