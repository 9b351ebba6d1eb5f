"""The public names: stubs, docstrings, exceptions and the parameter table agree with the module."""

import ast
import errno
import inspect
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import surfrecon
from shapes import torus_scans
from surfrecon import _native

STUB = ast.parse((Path(surfrecon.__file__).parent / "_native.pyi").read_text())


def public(names):
    return {name for name in names if not name.startswith("_")}


def stub_names(body):
    """Names a stub's body defines, without type aliases; setters and overloads count once."""
    names = set()
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.AnnAssign) and ast.unparse(node.annotation) != "TypeAlias":
            names.add(node.target.id)
    return public(names)


def stub_functions():
    """(qualified name, runtime object, arguments of the stub) of each function and method that takes keywords."""
    for node in STUB.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name, getattr(_native, node.name), node.args
        if isinstance(node, ast.ClassDef):
            runtime = getattr(_native, node.name)
            for method in node.body:
                if isinstance(method, ast.FunctionDef) and "staticmethod" in map(ast.unparse, method.decorator_list):
                    yield f"{node.name}.{method.name}", getattr(runtime, method.name), method.args


def test_stub_has_the_module_s_names():
    assert stub_names(STUB.body) == public(dir(_native))


@pytest.mark.parametrize("node", [n for n in STUB.body if isinstance(n, ast.ClassDef)], ids=lambda n: n.name)
def test_stub_has_the_names_of_each_class(node):
    assert stub_names(node.body) == public(vars(getattr(_native, node.name)))


# Ids are the same on each system and in each run.
@pytest.mark.parametrize(("runtime", "arguments"), [pytest.param(*rest, id=name) for name, *rest in stub_functions()])
def test_stub_has_the_arguments(runtime, arguments):
    parameters = inspect.signature(runtime).parameters.values()
    kinds = {inspect.Parameter.POSITIONAL_OR_KEYWORD: "args", inspect.Parameter.KEYWORD_ONLY: "kwonlyargs"}
    for kind, field in kinds.items():
        assert [p.name for p in parameters if p.kind == kind] == [a.arg for a in getattr(arguments, field)]


def test_the_package_offers_the_module_s_names():
    assert public(dir(_native)) <= set(surfrecon.__all__)
    assert all(hasattr(surfrecon, name) for name in surfrecon.__all__)
    assert (Path(surfrecon.__file__).parent / "py.typed").exists()


@pytest.mark.parametrize("name", sorted(public(dir(_native))))
def test_everything_has_a_docstring(name):
    thing = getattr(_native, name)
    assert thing.__doc__, name
    if inspect.isclass(thing):
        for member, value in vars(thing).items():
            assert member.startswith("_") or value.__doc__, f"{name}.{member}"


def keyword_options(function):
    signature = inspect.signature(function).parameters.values()
    return {p.name: p.default for p in signature if p.kind == inspect.Parameter.KEYWORD_ONLY}


def test_options_are_those_of_the_table():
    merge = [p.name for p in surfrecon.parameters("merge") + surfrecon.parameters("triangulate")]
    triangulate = [p.name for p in surfrecon.parameters("triangulate")]
    scan = [p.name for p in surfrecon.parameters("scan")]
    assert set(keyword_options(surfrecon.virtual_scan)) == {*scan, "progress"}
    in_files = {*merge, "measure", "files", "max_memory", "workspace"}
    assert set(keyword_options(surfrecon.merge)) == in_files | {"progress"}
    assert set(keyword_options(surfrecon.Merger.merge)) == in_files | {"progress"}
    assert set(keyword_options(surfrecon.Job.merge)) == in_files
    into_file = {*merge, "max_memory", "workspace", "keep", "encoding", "part_triangles", "provenance"}
    assert set(keyword_options(surfrecon.merge_to_file)) == {*into_file, "progress"}
    assert set(keyword_options(surfrecon.Job.merge_to_file)) == into_file
    align = {p.name for p in surfrecon.parameters("align")}
    known = {"fixed", "picks", "trusted", "rejected", "axis", "angles"}
    assert set(keyword_options(surfrecon.align)) == align | known | {"progress"}
    assert set(keyword_options(surfrecon.Aligner.align)) == align | known | {"progress"}
    assert set(keyword_options(surfrecon.Job.align)) == align | known
    assert set(keyword_options(surfrecon.Aligner)) == {"threads", "progress"}
    assert set(keyword_options(surfrecon.Job.aligner)) == {"threads"}
    sculpt = [p.name for p in surfrecon.parameters("sculpt") + surfrecon.parameters("triangulate")]
    assert set(keyword_options(surfrecon.sculpt)) == {*sculpt, "progress"}
    assert set(keyword_options(surfrecon.Sculptor)) == {*sculpt, "progress"} - {"tolerance", "relative_tolerance"}
    cluster = {p.name for p in surfrecon.parameters("cluster")}
    assert set(keyword_options(surfrecon.cluster)) == {*cluster, "progress"}
    one_level = {"vertices", "patches", "max_error", "triangles"}
    assert set(keyword_options(surfrecon.Job.cluster)) == {*cluster, "levels", "levels_of"}
    assert set(keyword_options(surfrecon.cluster_levels)) == {*cluster, "levels_of", "progress"} - one_level
    quads = [p.name for p in surfrecon.parameters("quads")]
    assert set(keyword_options(surfrecon.adaptive_quads)) == {*quads, "progress"}
    reconstruct = {p.name for p in surfrecon.parameters("reconstruct")}
    cloud = {"normals", "colour", "sensors", "toward"}
    assert set(keyword_options(surfrecon.reconstruct)) == reconstruct | cloud | {"progress"}
    assert set(keyword_options(surfrecon.Reconstructor)) == cloud
    assert set(keyword_options(surfrecon.Reconstructor.surface)) == reconstruct | {"progress"}
    assert set(keyword_options(surfrecon.Job.surface)) == reconstruct
    assert set(keyword_options(surfrecon.RangeImage.triangulate)) == set(triangulate)
    assert set(keyword_options(surfrecon.open)) == {p.name for p in surfrecon.parameters("open")} | {"camera", "crs"}


@pytest.mark.parametrize(
    "operation, function",
    [
        ("align", surfrecon.align),
        ("align", surfrecon.Aligner),
        ("align", surfrecon.Aligner.align),
        ("align", surfrecon.Aligner.snap),
        ("align", surfrecon.Job.align),
        ("merge", surfrecon.merge),
        ("merge", surfrecon.Job.merge),
        ("triangulate", surfrecon.RangeImage.triangulate),
        ("sculpt", surfrecon.sculpt),
        ("sculpt", surfrecon.Sculptor.refine),
        ("quads", surfrecon.adaptive_quads),
        ("reconstruct", surfrecon.reconstruct),
        ("cluster", surfrecon.cluster),
        ("scan", surfrecon.virtual_scan),
        ("open", surfrecon.open),
        ("write", surfrecon.Mesh.write),
        ("spline", surfrecon.QuadGrid.spline),
    ],
)
def test_signatures_show_the_defaults_of_the_table(operation, function):
    shown = keyword_options(function)
    known = {p.name: p for p in surfrecon.parameters(operation)}
    told = [name for name in shown if name in known]
    assert told, operation
    for name in told:
        assert shown[name] == known[name].default and type(shown[name]) is type(known[name].default), name
    if function is getattr(surfrecon, operation, None):
        for name in known:
            assert f"    {name}: {known[name].text[:20]}" in inspect.getdoc(function), name


def test_a_default_beside_what_excludes_it_is_no_choice():
    """A default that the signature shows can be handed over as it is."""
    image = surfrecon.RangeImage.orthographic(np.add.outer(np.arange(9.0), np.arange(9.0) ** 2), step=(1.0, 1.0))
    defaults = {p.name: p.default for p in surfrecon.parameters("sculpt")}
    shown = surfrecon.sculpt(image, **defaults | {"tolerance": 0.5})
    assert shown.tolerance == 0.5
    assert np.array_equal(shown.mesh.triangles, surfrecon.sculpt(image, tolerance=0.5).mesh.triangles)
    with pytest.raises(surfrecon.InputError, match="give tolerance or relative_tolerance, not both"):
        surfrecon.sculpt(image, tolerance=0.5, relative_tolerance=0.01)


def test_unknown_options_are_refused_by_name():
    image = surfrecon.RangeImage.orthographic([[0.0, 0.0], [0.0, 0.0]], step=(1.0, 1.0))
    with pytest.raises(TypeError, match=r"sculpt\(\) got an unexpected keyword argument 'toleranse'"):
        surfrecon.sculpt(image, toleranse=1)
    with pytest.raises(TypeError, match="argument 'tolerance': must be real number, not str"):
        surfrecon.sculpt(image, tolerance="1")
    with pytest.raises(surfrecon.ParameterError, match="effort must be >= 0 and <= 2, got 73786976294838206464"):
        surfrecon.sculpt(image, effort=2**66)
    with pytest.raises(surfrecon.ParameterError, match="seed must be .*, got 9007199254740993"):
        surfrecon.virtual_scan(surfrecon.Mesh(np.eye(3), [[0, 1, 2]]), [], seed=2**53 + 1)
    with pytest.raises(surfrecon.ParameterError, match="threads must be >= 0 and <= 1024, got 2147483648"):
        surfrecon.sculpt(image, threads=2**31)
    with pytest.raises(surfrecon.ParameterError, match='depth must be "planar" or "ray", got "z"'):
        surfrecon.RangeImage.pinhole([[1.0]], focal=(1, 1), centre=(0, 0), depth="z")
    with pytest.raises(surfrecon.InputError, match='operation must be one of "open", .*, got "nope"'):
        surfrecon.parameters("nope")
    with pytest.raises(surfrecon.ParameterError, match='closure must be "auto", "closed" or "open", got "shut"'):
        surfrecon.reconstruct([[0, 0, 0]], closure="shut")


@pytest.mark.parametrize("parameter", surfrecon.parameters(), ids=lambda p: f"{p.operation}.{p.name}")
def test_each_parameter_is_complete(parameter):
    assert parameter.kind in {"length", "angle", "ratio", "count", "flag", "choice"}
    assert parameter.label and parameter.since
    assert (parameter.kind == "choice") == bool(parameter.choices)
    assert parameter.minimum <= parameter.maximum and parameter.text.endswith(".")
    assert (parameter.default is None) != (parameter.default_from is None)


@pytest.mark.parametrize(
    "parameter",
    [
        p
        for p in surfrecon.parameters("merge") + surfrecon.parameters("triangulate")
        if p.kind not in {"flag", "choice"}
    ],
    ids=lambda p: p.name,
)
def test_values_out_of_range_are_refused_with_range_and_unit(parameter):
    bad = [parameter.minimum - 1] + ([parameter.maximum * 2] if parameter.maximum < float("inf") else [])
    for value in bad:
        value = int(value) if value == int(value) else value
        with pytest.raises(surfrecon.ParameterError, match=rf"{parameter.name} must be .*, got {value}"):
            surfrecon.merge([], **{parameter.name: value})


def test_the_exceptions_are_a_tree():
    for name in surfrecon.__all__:
        thing = getattr(surfrecon, name)
        if inspect.isclass(thing) and issubclass(thing, BaseException):
            assert issubclass(thing, surfrecon.SurfreconError)
    assert issubclass(surfrecon.ParameterError, ValueError)
    assert issubclass(surfrecon.FileError, OSError)
    assert issubclass(surfrecon.OutOfMemoryError, MemoryError)


def test_a_missing_file_is_a_file_error(tmp_path):
    missing = tmp_path / "missing.ply"
    with pytest.raises(surfrecon.FileError, match="missing.ply") as raised:
        surfrecon.open(missing)
    assert raised.value.filename == str(missing) and raised.value.errno == errno.ENOENT
    assert re.search("No such file|not found|cannot find", str(raised.value))
    with pytest.raises(TypeError, match="paths must be a path"):
        surfrecon.open(3)


def test_what_cannot_be_merged_is_named():
    mesh = surfrecon.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(TypeError, match="scan 1 must be a Scan"):
        surfrecon.merge([mesh, 3])
    with pytest.raises(TypeError, match="scans must be a ScanSet or a list"):
        surfrecon.merge(3)
    with pytest.raises(surfrecon.InputError, match="world_from_mesh"):
        surfrecon.merge([(mesh, [[1, 2], [3, 4]])])


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
@pytest.mark.parametrize(
    "call",
    [
        surfrecon.open,
        surfrecon.merge,
        lambda bad: surfrecon.write("a.ply", bad),
        lambda bad: surfrecon.Aligner(torus_scans(10)).snap(0, np.eye(4), poses=bad),
        lambda bad: surfrecon.align(torus_scans(10), fixed=[bad]),
        lambda bad: surfrecon.Sculptor(torus_scans(10)[0]).at_most(bad),
    ],
)
def test_ctrl_c_while_a_value_is_looked_at_stays_ctrl_c(call, error):
    class Bad(Sequence):
        """A sequence that answers each question with Ctrl-C, or with an end of memory."""

        def stop(self, *_):
            raise error

        __fspath__ = __index__ = __iter__ = __len__ = __getitem__ = stop

    with pytest.raises(error):
        call(Bad())
