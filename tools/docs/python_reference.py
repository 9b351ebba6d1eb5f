"""The reference of the Python package: signatures and types from the stubs and sources, texts from docstrings.

The compiled module has no types, and its stubs no texts, so both are read: the one is imported, the other parsed.
"""

import ast
import importlib
import inspect
import math
import re
from dataclasses import dataclass, field
from pathlib import Path

from sections import SiteError
from sphinx.ext.napoleon import Config, GoogleDocstring
from words import indented, title

# The pages and their names. Each public name stands in one of them, or in the page that an operation gets by itself.
PAGES = {
    "Opening and reading": ["open", "read", "recording_of", "formats", "ScanSet", "Scan", "Frame", "Camera"],
    "Range images, meshes, points": ["RangeImage", "GridCamera", "Mesh", "PointCloud", "linear_colours"],
    "Aligning": [
        "align",
        "Aligner",
        "Alignment",
        "Pick",
        "AlignReport",
        "AlignedScan",
        "AlignedPair",
        "Snap",
        "Freedom",
        "TurntableFound",
    ],
    "Merging": ["merge", "merge_to_file", "MergeResult", "MergeReport", "Merger"],
    "Merging on a cluster": ["distributed.merge", "distributed.Plan", "distributed.Stage"],
    "Sculpting one scan": ["sculpt", "Sculptor", "Sculpted", "SculptReport"],
    "Quad grids and splines": ["adaptive_quads", "QuadGrid", "Spline", "QuadReport"],
    "Surfaces through points": ["reconstruct", "Reconstructor", "Reconstructed", "ReconstructReport"],
    "Coarse meshes": ["cluster", "cluster_levels", "Clustered", "ClusterReport", "TriangleShapes"],
    "What to keep, true size and ground": [
        "keep",
        "remove",
        "Box",
        "Plane",
        "dominant_plane",
        "true_size",
        "ground",
        "Similarity",
        "transformed",
        "LeftOutReport",
    ],
    "Measuring": ["distances", "surface_distance", "nearest_triangles", "CheckReport", "DistanceReport"],
    "Writing": ["write", "write_scans", "crs_note", "provenance", "MemoryFolder", "MemoryPath"],
    "The virtual scanner": ["sculpture", "turntable", "virtual_scan"],
    "Running": [
        "Job",
        "Context",
        "parameters",
        "Parameter",
        "operations",
        "Operation",
        "figures",
        "Figure",
        "Report",
        "memory_foreseen",
        "memory_in_use",
        "memory_limit",
        "memory_peak",
        "set_memory_limit",
        "__version__",
    ],
    "Exceptions": [
        "SurfreconError",
        "ParameterError",
        "InputError",
        "FormatError",
        "FileError",
        "OutOfMemoryError",
        "Cancelled",
        "InternalError",
    ],
    "Pictures": ["plot.alignment", "plot.error_image", "plot.mesh", "plot.misfit", "plot.range_image"],
    "Progress bars": ["bar.Bar"],
}
# Methods of Python's own protocols that a class gives a meaning of its own.
_OPERATORS = {"__call__", "__matmul__", "__getitem__", "__setitem__", "__len__", "__iter__", "__truediv__"}
_NAPOLEON = Config(napoleon_use_rtype=False, napoleon_use_ivar=False, napoleon_use_param=True)


@dataclass
class Declared:
    """A name in a stub or a source: signatures of a function, type of a value, members of a class."""

    kind: str
    signatures: list = field(default_factory=list)
    type: str = ""
    members: dict = field(default_factory=dict)
    bases: list = field(default_factory=list)
    settable: bool = False


def public_names():
    """Every public name of the package, as users write it behind ``surfrecon.``."""
    names = list(importlib.import_module("surfrecon").__all__)
    for module in ("plot", "bar", "distributed"):
        names += [f"{module}.{name}" for name in importlib.import_module(f"surfrecon.{module}").__all__]
    return names


def pages():
    """All pages. An operation that none of `PAGES` has gets one behind those of other operations, with the function and
    the classes that this gives.
    """
    surfrecon = importlib.import_module("surfrecon")
    declared = _of_the_package()
    listed = {name for names in PAGES.values() for name in names}
    free = set(surfrecon.__all__) - listed
    operations = surfrecon.operations()
    named = {operation.name for operation in operations}
    behind = max(k for k, names in enumerate(PAGES.values()) if named & set(names)) + 1
    made = list(PAGES.items())
    for operation in operations:
        if operation.name not in free:
            continue
        names = [operation.name]
        for name in names:
            one = declared[name]
            types = [*one.signatures, *(member.type for member in one.members.values())]
            words = [word for text in types for word in re.findall(r"\w+", text)]
            names += [word for word in dict.fromkeys(words) if word in free and word not in names]
        heading = operation.operator[1] if operation.operator else operation.name
        made.insert(behind, (heading, names))
        behind += 1
    return dict(made)


def _of_the_package():
    """The declarations of the package, by name."""
    package, found = Path(importlib.import_module("surfrecon").__file__).parent, {}
    for file in ("_errors.py", "_report.py", "_reports.py", "_native.pyi"):
        found |= declarations(package / file)
    return found


def problems():
    """Public names that no page has, and names that are not there."""
    listed = [name for names in pages().values() for name in names]
    there = set(public_names())
    yield from (
        f"{name} is in no page of the reference: tools/docs/python_reference.py" for name in there - set(listed)
    )
    yield from (f"the reference has {name}, which is no public name" for name in set(listed) - there)
    yield from (f"the reference has {name} twice" for name in {name for name in listed if listed.count(name) > 1})


def _types(node):
    """A type as people read it: the stubs' own aliases without their mark."""
    text = re.sub(r"\b_([A-Z]\w*)", r"\1", ast.unparse(node)) if node is not None else ""
    return text.replace(repr(math.pi / 2), "pi / 2")


def _signature(node, bound):
    """Arguments and result of a function; `bound` ones lose their first argument."""
    arguments = node.args
    if bound and arguments.posonlyargs:
        arguments.posonlyargs.pop(0)
    elif bound and arguments.args:
        arguments.args.pop(0)
    if arguments.posonlyargs and all(argument.arg.startswith("_") or bound for argument in arguments.posonlyargs):
        # That they can't be named says nothing to those who call.
        arguments.args = arguments.posonlyargs + arguments.args
        arguments.posonlyargs = []
    result = _types(node.returns)
    return f"({_types(arguments)})" + (f" -> {result}" if result and node.name not in ("__new__", "__init__") else "")


def _decorators(node):
    return {ast.unparse(one).split(".")[-1] for one in node.decorator_list}


def _member(made, node):
    if isinstance(node, ast.AnnAssign):
        made[node.target.id] = Declared("attribute", type=_types(node.annotation))
    if not isinstance(node, ast.FunctionDef):
        return
    marks = _decorators(node)
    if "setter" in marks:
        made[node.name].settable = True
    elif marks & {"property", "cached_property"}:
        made[node.name] = Declared("property", type=_types(node.returns))
    else:
        kind = "staticmethod" if "staticmethod" in marks else "classmethod" if "classmethod" in marks else "method"
        signature = _signature(node, kind != "staticmethod")
        made.setdefault(node.name, Declared(kind)).signatures.append(signature)


def declarations(path):
    """The declarations of a stub or a source, by name."""
    made = {}
    for node in ast.parse(path.read_text("utf-8")).body:
        if isinstance(node, ast.FunctionDef):
            made.setdefault(node.name, Declared("function")).signatures.append(_signature(node, False))
        elif isinstance(node, ast.ClassDef):
            made[node.name] = Declared("class", bases=[ast.unparse(base) for base in node.bases])
            for inner in node.body:
                _member(made[node.name].members, inner)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            is_alias = ast.unparse(node.annotation) == "TypeAlias"
            made[node.target.id] = Declared(
                "alias" if is_alias else "data", type=_types(node.value if is_alias else node.annotation)
            )
    return made


def _text(of, types=None):
    """A docstring as reStructuredText; attributes get their types."""
    text = inspect.getdoc(of) if not isinstance(of, str) else inspect.cleandoc(of)
    text = text or ""
    attributes = text.partition("Attributes:\n")
    for name, kind in (types or {}).items():
        attributes = (*attributes[:2], re.sub(rf"^(    ){name}: ", rf"\1{name} ({kind}): ", attributes[2], flags=re.M))
    # Napoleon takes what stands before a colon for the type of the result, which the signature has.
    text = re.sub(
        r"(?<=^Returns:\n)(?:    .*\n?|\n)+", lambda found: found[0].replace(":", "\0"), "".join(attributes), flags=re.M
    )
    return str(GoogleDocstring(text, _NAPOLEON)).strip().replace("\0", ":")


def _directive(kind, signatures, text, *options):
    lines = [f".. py:{kind}:: {signatures[0]}", *(f"   {' ' * (len(kind) + 7)}{more}" for more in signatures[1:])]
    return "\n".join([*lines, *(f"   {option}" for option in options), "", indented(text), ""])


def _own_text(of, name):
    """The docstring that a class gives one of its members, or an empty one where that is Python's own."""
    member = inspect.getattr_static(of, name, None)
    if isinstance(member, staticmethod | classmethod):
        member = member.__func__
    if isinstance(member, property | type(inspect)) or member is not None:
        own = getattr(member, "__doc__", None) or ""
        for base in (object, dict, list, Exception):
            if own == (getattr(getattr(base, name, None), "__doc__", None) or ""):
                return ""
        return own
    return ""


def _class(name, of, declared):
    made = declared.members.get("__init__") or declared.members.get("__new__")
    signatures = [f"{name}{one}" for one in made.signatures] if made else [name]
    fields = {key: one.type for key, one in declared.members.items() if one.kind == "attribute"}
    text = _text(of, fields)
    known = text.count(".. attribute::")
    inside = [text.replace(".. attribute::", ".. py:attribute::")]
    if made and (own := _own_text(of, "__init__")) and "See help(type(self))" not in own:
        inside.append(_text(own))
    for member, one in declared.members.items():
        if member.startswith("_") and member not in _OPERATORS:
            continue
        said = _own_text(of, member)
        if one.kind == "attribute":
            if not known:
                inside.append(_directive("attribute", [member], _text(said), f":type: {one.type}"))
        elif one.kind == "property" and said:
            can = " It can be set." if one.settable else ""
            inside.append(_directive("property", [member], _text(said) + can, f":type: {one.type}"))
        elif said:
            options = [] if one.kind == "method" else [f":{one.kind}:"]
            inside.append(_directive("method", [f"{member}{each}" for each in one.signatures], _text(said), *options))
    bases = [base for base in declared.bases if base in ("Scan", "Report", "SurfreconError")]
    if bases:
        inside.insert(0, "Also: " + ", ".join(f":py:class:`{base}`" for base in bases) + ".\n")
    kind = "exception" if inspect.isclass(of) and issubclass(of, BaseException) else "class"
    return _directive(kind, signatures, "\n\n".join(inside))


def named(full):
    """The thing that a public name stands for."""
    module, _, name = full.rpartition(".")
    return getattr(importlib.import_module(f"surfrecon.{module}".rstrip(".")), name)


def _entry(full, declared):
    of, name = named(full), full.rpartition(".")[2]
    one = declared[name]
    if one.kind == "class":
        return _class(name, of, one)
    if one.kind == "function":
        return _directive("function", [f"{name}{each}" for each in one.signatures], _text(of))
    return _directive(
        "data", [name], "The version of the package." if name == "__version__" else "", f":type: {one.type}"
    )


def write(folder):
    """Writes the pages; the package must be importable. Returns names and members that they document."""
    package = Path(importlib.import_module("surfrecon").__file__).parent
    found = {"": _of_the_package()}
    for module in ("plot", "bar"):
        found[module] = declarations(package / f"{module}.py")
    found["distributed"] = {}
    for file in ("client.py", "plan.py"):
        found["distributed"] |= declarations(package / "distributed" / file)
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    for heading, listed in pages().items():
        name = re.sub(r"\W+", "_", heading.lower())
        module = listed[0].rpartition(".")[0]
        text = [title(heading, "="), f".. py:currentmodule:: surfrecon{'.' + module if module else ''}", ""]
        if module:
            text.append(_text(importlib.import_module(f"surfrecon.{module}")) + "\n")
        text += [_entry(full, found[full.rpartition(".")[0]]) for full in listed]
        (folder / f"{name}.rst").write_text("\n".join(text), "utf-8")
        names.append(name)
    aliases = {name.lstrip("_"): one for name, one in found[""].items() if one.kind == "alias"}
    if both := {name for name in aliases if name in found[""]}:
        raise SiteError(f"the stubs' names {', '.join(both)} are public without their mark: choose others")
    text = [
        title("Types of arguments", "="),
        "What signatures call by a short name.\n",
        ".. py:currentmodule:: surfrecon\n",
    ]
    text += [_directive("type", [name], "", f":canonical: {one.type}") for name, one in sorted(aliases.items())]
    (folder / "types.rst").write_text("\n".join(text), "utf-8")
    toc = [".. toctree::", "   :maxdepth: 1", "", *(f"   {name}" for name in [*names, "types"])]
    about = _text(importlib.import_module("surfrecon"))
    text = [title("Python reference", "="), ".. py:module:: surfrecon\n", about, "", *toc, ""]
    (folder / "index.rst").write_text("\n".join(text), "utf-8")
