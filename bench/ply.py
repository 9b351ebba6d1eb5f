"""Reading and writing PLY files, range grids included, with numpy alone: independent of the library under test."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

NUMPY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip


@dataclass
class Ply:
    """The content of a file."""

    vertices: np.ndarray = None  # (n, 3) float64
    vertex_properties: dict = field(default_factory=dict)
    faces: np.ndarray = None  # (m, 3) int64
    grid: np.ndarray = None  # (rows, cols) int64, -1 where nothing was measured
    info: dict = field(default_factory=dict)


@dataclass
class Element:
    """An element of the header: its properties are (type, name) or (count type, item type, name)."""

    name: str
    count: int
    properties: list = field(default_factory=list)

    @property
    def has_list(self):
        """Whether rows differ in length."""
        return any(len(p) == 3 for p in self.properties)


def read_ply(path):
    """Reads a PLY file of triangles or a range grid; polygons are cut into fans."""
    content = Path(path).read_bytes()
    end = content.index(b"end_header")
    body = content.index(b"\n", end) + 1
    ply, elements, layout = Ply(), [], None
    for line in content[:end].decode("latin1").splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "format":
            layout = words[1]
        elif words[0] == "obj_info" and len(words) >= 3:
            ply.info[words[1]] = words[2]
        elif words[0] == "element":
            elements.append(Element(words[1], int(words[2])))
        elif words[0] == "property":
            elements[-1].properties.append(tuple(words[2:] if words[1] == "list" else words[1:]))

    if layout == "ascii":
        source = AsciiBody(content[body:])
    else:
        source = BinaryBody(content, body, "<" if layout == "binary_little_endian" else ">")
    for element in elements:
        if not element.has_list:
            columns = source.rows(element)
            if element.name == "vertex":
                ply.vertices = np.stack([columns.pop(axis) for axis in "xyz"], 1).astype(np.float64)
                ply.vertex_properties = columns
        else:
            counts, items = source.lists(element)
            if element.name == "range_grid":
                grid = np.full(element.count, -1, np.int64)
                grid[counts > 0] = items[(np.cumsum(counts) - counts)[counts > 0]]
                ply.grid = grid.reshape(int(ply.info["num_rows"]), int(ply.info["num_cols"]))
            elif element.name in ("face", "faces"):
                ply.faces = fans(counts, items)
    return ply


class AsciiBody:
    """The numbers of an ascii file."""

    def __init__(self, text):
        self.numbers = np.array(text.split(), np.float64)
        self.at = 0

    def rows(self, element):
        """A column for each property."""
        width = len(element.properties)
        table = self.numbers[self.at : self.at + element.count * width].reshape(element.count, width)
        self.at += table.size
        return {p[-1]: table[:, i] for i, p in enumerate(element.properties)}

    def lists(self, element):
        """Length of each list, and all items in a row. The element has one property, a list."""
        whole = self.numbers[self.at :].astype(np.int64).tolist()
        starts, at = [], 0
        for _ in range(element.count):
            starts.append(at)
            at += 1 + whole[at]
        self.at += at
        values = np.array(whole[:at], np.int64)
        is_item = np.ones(at, bool)
        is_item[starts] = False
        return values[starts], values[is_item]


class BinaryBody:
    """The bytes of a binary file."""

    def __init__(self, content, at, order):
        self.content, self.at, self.order = content, at, order

    def dtype(self, name):
        """The numpy type of a PLY type in this file's byte order."""
        return np.dtype(self.order + NUMPY_TYPES[name])

    def rows(self, element):
        """A column for each property."""
        record = np.dtype([(p[-1], self.dtype(p[0])) for p in element.properties])
        table = np.frombuffer(self.content, record, element.count, self.at)
        self.at += record.itemsize * element.count
        return {name: table[name] for name in record.names}

    def lists(self, element):
        """Length of each list, and all items in a row. Other properties than the first list are passed over."""
        position = next(i for i, p in enumerate(element.properties) if len(p) == 3)
        count_type, item_type = (self.dtype(t) for t in element.properties[position][:2])
        before = sum(self.dtype(p[0]).itemsize for p in element.properties[:position])
        after = sum(self.dtype(p[0]).itemsize for p in element.properties[position + 1 :])
        triangles = np.dtype(
            [("before", f"V{before}"), ("n", count_type), ("items", item_type, 3), ("after", f"V{after}")]
        )
        if len(self.content) - self.at >= triangles.itemsize * element.count:
            table = np.frombuffer(self.content, triangles, element.count, self.at)
            if np.all(table["n"] == 3):
                self.at += triangles.itemsize * element.count
                return table["n"].astype(np.int64), table["items"].astype(np.int64).ravel()
        order = "little" if self.order == "<" else "big"
        counts, items = [], []
        for _ in range(element.count):
            self.at += before
            count = int.from_bytes(self.content[self.at : self.at + count_type.itemsize], order)
            self.at += count_type.itemsize
            items.append(self.content[self.at : self.at + count * item_type.itemsize])
            self.at += count * item_type.itemsize + after
            counts.append(count)
        return np.array(counts, np.int64), np.frombuffer(b"".join(items), item_type).astype(np.int64)


def fans(counts, items):
    """Cuts polygons into triangles around their first corner."""
    if len(counts) == 0 or np.all(counts == 3):
        return items.reshape(-1, 3)
    triangles, at = [], 0
    for count in counts:
        triangles += [(items[at], items[at + k], items[at + k + 1]) for k in range(1, count - 1)]
        at += count
    return np.array(triangles, np.int64).reshape(-1, 3)


def write_ply(path, vertices, faces=None, normals=None):
    """Writes a binary file with float coordinates."""
    names = ["x", "y", "z"] + (["nx", "ny", "nz"] if normals is not None else [])
    table = np.concatenate([vertices] + ([normals] if normals is not None else []), 1).astype("<f4")
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in names]
    if faces is not None:
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    with open(path, "wb") as out:
        out.write(("\n".join(header) + "\nend_header\n").encode())
        out.write(table.tobytes())
        if faces is not None:
            records = np.zeros(len(faces), [("n", "u1"), ("items", "<i4", 3)])
            records["n"] = 3
            records["items"] = faces
            out.write(records.tobytes())
