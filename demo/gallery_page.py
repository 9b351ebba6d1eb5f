"""Puts the pictures of the gallery on one page, with figures under each.

Usage: python gallery_page.py FOLDER FONT PAGE      reads what gallery.py wrote
"""

import json
import sys
from pathlib import Path

from picture import GREY, INK, LINE, PAPER, Type, gradient
from PIL import Image, ImageDraw

COLUMNS = ("input", "result", "wires", "error")
# Lines under the result and under its edges, as far as the sidebar has them.
RESULT = ("Triangles", "Quads", "Time")
EDGES = ("Vertices", "Voxel", "Of all", "On the surface", "Mean smallest angle", "Holes closed, left", "Taken as")
LEFT, BELOW, TOP = 26, 92, 44


def lines(row, column):
    """(name, value) texts under a picture."""
    if column == "input":
        return list(row["input"].items())
    if column == "error":
        return [(name, row["error"][name]) for name in ("RMS", "Largest") if name in row["error"]]
    wanted = RESULT if column == "result" else EDGES
    return [(name, row["result"][name]) for name in wanted if name in row["result"]][:3]


def main():
    """Writes the page."""
    folder, font, page_path = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    told = json.loads((folder / "gallery.json").read_text())
    width, height = told["size"]
    rows = told["rows"]
    type_ = Type(font, 600)
    page = Image.new("RGB", (len(COLUMNS) * width, len(rows) * (TOP + height + BELOW)), PAPER)
    pen = ImageDraw.Draw(page)
    for i, (name, row) in enumerate(rows.items()):
        y = i * (TOP + height + BELOW)
        if i:
            pen.line([(LEFT, y), (page.width - LEFT, y)], fill=LINE)
        pen.text((LEFT, y + 12), row["title"], font=type_(22, 650), fill=INK)
        for j, column in enumerate(COLUMNS):
            with Image.open(folder / f"{name}-{column}.png") as picture:
                page.paste(picture, (j * width, y + TOP), picture.convert("RGBA"))
            below = y + TOP + height + 8
            for k, (what, value) in enumerate(lines(row, column)):
                pen.text((j * width + LEFT, below + 22 * k), what, font=type_(15), fill=GREY)
                pen.text((j * width + LEFT + 150, below + 22 * k), value, font=type_(15, 550), fill=INK)
            if column == "error":
                bar = gradient(told["ramp"], width - 2 * LEFT, 8)
                page.paste(bar, (j * width + LEFT, below + 48))
                pen.text((j * width + LEFT, below + 58), "0", font=type_(13), fill=GREY)
                right = ((j + 1) * width - LEFT, below + 58)
                pen.text(right, f"{row['error']['limit']} and more", font=type_(13), fill=GREY, anchor="ra")
    page.save(page_path, quality=82, method=6)
    print(f"written: {page_path}")


if __name__ == "__main__":
    main()
