"""MeshLab's parameters and formats, against the library's own tables: each parameter with its default, each ending."""

import os

import numpy as np
import pymeshlab
import pytest
import surfrecon
from conftest import ALIGN, BACKGROUND, CLUSTER, IMPORT, MERGE, QUADS, RECONSTRUCT, SCULPT

# Operations whose parameters a filter has all of, but those named; what it has besides, with its default.
FILTERS = {
    IMPORT: (["open"], [], {"file": "", "faces": True, "camera": "", "max_frames": 50}),
    ALIGN: (["align"], [], {}),
    MERGE: (["merge", "triangulate"], [], {"quality_as_confidence": False}),
    SCULPT: (["sculpt", "triangulate"], [], {"max_triangles": 0}),
    # Rows and columns of the surface are the grid's.
    QUADS: (["quads", "spline"], [], {"surface_steps": 0}),
    RECONSTRUCT: (["reconstruct"], [], {"use_normals": False}),
    CLUSTER: (["cluster"], [], {"levels": 1}),
    BACKGROUND: (["plane"], [], {}),
}
# A filter that has no more than its operation.
FILTERS |= {
    operation.filter[1]: ([operation.name], [], {})
    for operation in surfrecon.operations()
    if operation.filter is not None and operation.filter[1] not in FILTERS
}

# Endings of files that MeshLab is left out of: projects, rasters, and what says nothing without the files beside it.
NOBODYS = {"mlp", "aln", "png", "tif", "tiff", "json", "log", "freiburg", "traj"}


def default_in_meshlab(parameter):
    """The default as MeshLab has it: 0, or nothing, for what the data give; degrees; the number of a choice."""
    if parameter.name == "invalid":
        return ""
    if parameter.kind == "choice":
        return [name for name, _, _ in parameter.choices].index(parameter.default)
    if parameter.kind == "flag":
        return bool(parameter.default)
    value = parameter.default or 0
    return np.float32(np.degrees(value) if parameter.kind == "angle" else value)


@pytest.mark.parametrize("name", FILTERS)
def test_a_filter_has_the_parameters_of_its_operations_with_their_defaults(document, name):
    operations, left_out, own = FILTERS[name]
    document.add(np.eye(3), np.array([[0, 1, 2]]))
    expected = dict(own)
    for operation in reversed(operations):
        for parameter in surfrecon.parameters(operation):
            if parameter.name != "threads" and parameter.name not in left_out:
                expected[parameter.name] = default_in_meshlab(parameter)
    shown = document.set.filter_parameter_values(name)
    assert set(shown) == set(expected)
    for parameter, value in shown.items():
        value = value.value() if hasattr(value, "value") else value
        value = np.float32(value) if isinstance(value, float) else value
        assert value == expected[parameter], parameter


def is_nobodys(path):
    """Whether MeshLab knows no reader of a file, asked in a process of its own: some of MeshLab's own readers take
    counts of what is no file of theirs from memory that was never set, and now and then crash.
    """
    child = os.fork()
    if child == 0:
        known = True
        try:
            pymeshlab.MeshSet(verbose=False).load_new_mesh(str(path))
        except BaseException as error:  # noqa: BLE001 (what it says of nonsense is its own business)
            known = "Unknown format" not in str(error)
        finally:
            os._exit(0 if known else 1)
    _, status = os.waitpid(child, 0)
    return os.WIFEXITED(status) and os.WEXITSTATUS(status) == 1


def test_each_ending_of_the_table_is_opened_by_somebody(tmp_path):
    nobodys = set()
    for ending in {ending for endings in surfrecon.formats().values() for ending in endings}:
        path = tmp_path / f"nonsense.{ending}"
        path.write_text("nonsense")
        if is_nobodys(path):
            nobodys.add(ending)
    assert nobodys == NOBODYS
