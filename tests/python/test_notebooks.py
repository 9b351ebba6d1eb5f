"""The notebooks run from the first cell to the last; pictures and progress bars say what they show."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
import surfrecon

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402
from surfrecon import plot  # noqa: E402
from surfrecon.bar import Bar  # noqa: E402

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path):
    cells = json.loads(path.read_text())["cells"]
    names = {}
    for number, cell in enumerate(cells):
        assert not cell.get("outputs"), "outputs are not committed"
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{path.name}, cell {number}", "exec"), names)
    assert len(pyplot.get_fignums()) >= 3
    pyplot.close("all")


def test_there_is_a_notebook():
    assert NOTEBOOKS


def tetrahedron():
    return surfrecon.Mesh(
        np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float),
        np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]),
    )


def test_a_picture_shows_every_triangle_and_the_legend_the_limit():
    axes = plot.mesh(tetrahedron(), [0, 1, 2, 3], limit=3, label="height, mm")
    (faces,) = axes.collections
    assert len(faces.get_paths()) == 4
    legend = next(other for other in axes.figure.axes if other is not axes)
    assert legend.get_ylabel() == "height, mm" and legend.get_ylim() == (0, 3)
    pyplot.close("all")


def test_values_are_one_a_vertex():
    with pytest.raises(ValueError, match="3 values for 4 vertices: give one a vertex"):
        plot.mesh(tetrahedron(), [1, 2, 3])
    pyplot.close("all")


def test_a_bar_follows_an_operation_to_its_end():
    said = io.StringIO()
    with Bar(file=said, mininterval=0) as progress:
        surfrecon.sculpt(surfrecon.RangeImage.from_points(sheet(), viewing=("parallel", (0, 0, -1))), progress=progress)
    assert "100 %" in said.getvalue()


def test_a_bar_stays_where_it_was_when_the_operation_fails():
    said = io.StringIO()
    with pytest.raises(ZeroDivisionError), Bar(file=said, mininterval=0) as progress:
        progress("first", 0.5)
        raise ZeroDivisionError
    assert "first" in said.getvalue() and "100 %" not in said.getvalue()


def sheet():
    x, y = np.meshgrid(np.arange(80.0), np.arange(60.0))
    return np.dstack([x, y, np.sin(x / 5) * np.cos(y / 7)])
