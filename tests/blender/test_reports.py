"""Reports of the library in the sidebar: what operators keep of them, and how their figures are told."""

import ast
from pathlib import Path

import bpy
import pytest
import surfrecon
from shapes import torus
from test_merge import add_mesh

# The function that tells a report, where it is not called by the operation, and the operation.
TOLD_BY = {"measure": "distance"}


def label_of(node):
    """The label in what a function yields, if it is written out there."""
    first = node.value.elts[0] if isinstance(node.value, ast.Tuple) else None
    return first.value if isinstance(first, ast.Constant) else None


def test_labels_that_the_library_declares_are_not_written_again(extension):
    tree = ast.parse(Path(extension.reports.__file__).read_text("utf-8"))
    functions = [one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name.endswith("_lines")]
    assert len(functions) == 8
    for function in functions:
        name = function.name.removesuffix("_lines")
        declared = {row.label for row in surfrecon.figures() if row.operation == TOLD_BY.get(name, name)}
        written = {label_of(node) for node in ast.walk(function) if isinstance(node, ast.Yield)}
        assert not written & declared, function.name


def kept_of(figures, operation):
    """The declared figures that a custom property lacks, but for those that may be absent."""
    return {row.name for row in surfrecon.figures(operation) if row.shape == "one"} - set(figures.keys())


def test_the_whole_report_of_remeshing_is_kept(extension):
    add_mesh("torus", torus(30))
    assert bpy.ops.surfrecon.remesh(vertices=200, levels=2) == {"FINISHED"}
    made = bpy.context.object
    for owner in (made, *(level.mesh for level in made.surfrecon_levels)):
        assert not kept_of(owner["surfrecon_cluster"], "cluster")
        assert len(owner["surfrecon_cluster"]["after"]["angles"]) > 10


def test_a_report_of_remeshing_from_before_is_told_alike(extension):
    add_mesh("torus", torus(30))
    bpy.ops.surfrecon.remesh(vertices=200)
    made, lines = bpy.context.object, extension.reports.LINES["surfrecon_cluster"]
    today = list(lines(bpy.context, made["surfrecon_cluster"]))
    figures = made["surfrecon_cluster"].to_dict()
    after = figures.pop("after")
    figures |= {name: after[name] for name in ("mean_smallest_angle", "smallest_angle")}
    made["surfrecon_cluster"] = figures
    assert list(lines(bpy.context, made["surfrecon_cluster"])) == today
    assert "Mean smallest angle" in dict(today)


def test_the_whole_report_of_a_measurement_is_kept_and_grows_with_the_object(extension):
    add_mesh("fine", torus(30))
    add_mesh("coarse", torus(12))
    bpy.data.objects["fine"].select_set(True)
    assert bpy.ops.surfrecon.measure() == {"FINISHED"}
    measured = bpy.context.object
    before = measured["surfrecon_measure"].to_dict()
    assert not kept_of(before, "distance")
    extension.reports.grow(measured, 2.0)
    after = measured["surfrecon_measure"].to_dict()
    lengths = {row.name for row in surfrecon.figures("distance") if row.kind == "length"}
    lengths |= {f"back_{name}" for name in lengths} | {"hausdorff"}
    assert len(lengths) == 15
    for name, value in before.items():
        if not isinstance(value, str):
            assert after[name] == pytest.approx(2 * value if name in lengths else value), name
