"""A notebook as a page: it is run, and what it prints and draws stands below each cell."""

import contextlib
import io
import json
import re

# A table or a report has fewer lines.
MOST_LINES = 60


def page(path, target, pictures):
    """Writes the page; pictures go to a folder, named by the notebook and their number.

    Needs the package and matplotlib.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    made, names, count = [], {}, 0
    for number, cell in enumerate(json.loads(path.read_text("utf-8"))["cells"]):
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            made.append(source)
            continue
        made.append(f"```python\n{source}\n```")
        said = io.StringIO()
        # Bars of progress belong to a terminal.
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(io.StringIO()):
            exec(compile(source, f"{path.name}, cell {number}", "exec"), names)
        text = said.getvalue().rstrip("\n").splitlines()
        if text:
            more = ["..."] if len(text) > MOST_LINES else []
            made.append("\n".join(["```text", *text[:MOST_LINES], *more, "```"]))
        for figure in map(pyplot.figure, pyplot.get_fignums()):
            count += 1
            name = f"{path.stem}_{count}.png"
            pictures.mkdir(parents=True, exist_ok=True)
            figure.savefig(pictures / name, dpi=110, facecolor="white", bbox_inches="tight")
            made.append(f"![What the cell above draws](/pictures/{name})")
        pyplot.close("all")
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text("\n\n".join(made) + "\n", "utf-8")


def run_marked(page, pictures):
    """Runs the blocks of Python below lines `<!-- run -->` of a page in the folder of pictures, which get theirs."""
    import matplotlib

    matplotlib.use("Agg")
    pictures.mkdir(parents=True, exist_ok=True)
    names = {}
    text = page.read_text("utf-8")
    with contextlib.chdir(pictures), contextlib.redirect_stdout(io.StringIO()):
        for source in re.findall(r"^<!-- run -->\n\n```python\n(.*?)```", text, re.M | re.S):
            exec(compile(source, page.name, "exec"), names)
