"""Tables for a terminal."""


def cell(value):
    """A value as people read it: three or four digits that matter."""
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.4g}"
    return f"{value:,}" if isinstance(value, int) else str(value)


def show(rows, columns):
    """Prints `columns` (heading -> key) of the rows; text to the left, numbers to the right."""
    lines = [list(columns)] + [[cell(row.get(key)) for key in columns.values()] for row in rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(columns))]
    for line in lines:
        first = line[0].ljust(widths[0])
        rest = [text.rjust(width) for text, width in zip(line[1:], widths[1:], strict=True)]
        print("  ".join([first, *rest]))
