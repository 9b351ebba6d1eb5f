"""Puts the panels of the guides' pictures side by side, with a caption under each.

Usage: python guide_page.py FOLDER FONT PICTURES      reads what guide_pictures.py wrote, writes PICTURES/<picture>.jpg
"""

import json
import sys
from pathlib import Path

from picture import GREY, INK, PAPER, Type
from PIL import Image, ImageDraw

GAP, CAPTION, TITLE = 8, 50, 28
WIDTH = 800


def main():
    """Writes all pictures."""
    folder, font, pictures = Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
    type_ = Type(font, 600)
    for name, rows in json.loads((folder / "guides.json").read_text()).items():
        lines = [drawn(folder, row, type_, max(map(len, rows))) for row in rows]
        page = Image.new("RGB", (WIDTH, sum(line.height for line in lines)), PAPER)
        top = 0
        for line in lines:
            page.paste(line, (0, top))
            top += line.height
        path = pictures / f"{name}.jpg"
        page.save(path, quality=86, optimize=True, progressive=True)
        print(f"written: {path}, {path.stat().st_size // 1000} kB")


def drawn(folder, row, type_, columns):
    """One row of panels with their captions."""
    width = (WIDTH - GAP * (columns - 1)) // columns
    panels = []
    for panel in row:
        with Image.open(folder / panel["file"]) as picture:
            own = picture.convert("RGBA")
        if "behind" in panel:
            own = Image.alpha_composite(Image.new("RGBA", own.size, tuple(panel["behind"])), own)
        scale = min(1.0, width / own.width)
        panels.append(own.resize((round(own.width * scale), round(own.height * scale)), Image.Resampling.LANCZOS))
    height = max(panel.height for panel in panels)
    below = CAPTION if any(panel["text"] for panel in row) else TITLE if any(panel["title"] for panel in row) else GAP
    line = Image.new("RGB", (WIDTH, height + below), PAPER)
    pen = ImageDraw.Draw(line)
    for k, (panel, own) in enumerate(zip(row, panels, strict=True)):
        left = k * (width + GAP) + (width - own.width) // 2
        line.paste(own, (left, (height - own.height) // 2), own)
        middle = k * (width + GAP) + width / 2
        pen.text((middle, height + 4), panel["title"], font=type_(16, 600), fill=INK, anchor="ma")
        pen.text((middle, height + 25), panel["text"], font=type_(14), fill=GREY, anchor="ma")
    return line


if __name__ == "__main__":
    main()
