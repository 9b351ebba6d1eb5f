"""The C library as a caller sees who has nothing but its header: prototypes and structs are read from there.

    c = Library(path)
    mesh = c.mesh_create(positions, triangles)        # a handle
    coarse, report = c.mesh_cluster(mesh, c.struct("cluster_params", vertices=100))

A NumPy array stands for an `srf_array`, a 4 x 4 one (or some) for poses, a dict as Python's `projection` for a
projection, None for NULL. Progress is not asked. What a call gives comes back: handles, structs, copies of views,
numbers. Arrays that a call fills are given by their names.
"""

import ctypes
import re
from pathlib import Path

import numpy as np

HEADER = Path(__file__).parents[2] / "c-api" / "include" / "surfrecon.h"
SCALARS = {
    "uint8_t": ctypes.c_uint8,
    "int32_t": ctypes.c_int32,
    "uint32_t": ctypes.c_uint32,
    "int64_t": ctypes.c_int64,
    "uint64_t": ctypes.c_uint64,
    "size_t": ctypes.c_size_t,
    "double": ctypes.c_double,
}
# Room for a text that a call copies.
TEXT = 1 << 17
# srf_type.
TYPES = {1: np.float32, 2: np.float64, 3: np.int32, 4: np.uint32, 5: np.uint8, 6: np.uint16}


class Library:
    """The library at a path."""

    def __init__(self, path):
        text = re.sub(r"/\*.*?\*/|//[^\n]*", "", HEADER.read_text(), flags=re.DOTALL)
        self.constants = {name: int(value) for name, value in re.findall(r"\b(SRF_\w+) = (\d+),", text)}
        self.structs = {}
        for body, name in re.findall(r"typedef struct \{([^}]*)\} (\w+);", text):
            self.structs[name] = type(name, (ctypes.Structure,), {"_fields_": list(self._fields(body))})
        self.prototypes = {}
        for name, arguments in re.findall(r"\bsrf_status srf_(\w+)\(([^)]*)\);", text):
            self.prototypes[name] = [" ".join(argument.split()) for argument in arguments.split(",")]
        self.dll = ctypes.CDLL(path)
        self.dll.srf_last_error_message.restype = ctypes.c_char_p
        self.handles = []

    def close(self):
        """Frees all handles."""
        for kind, handle in self.handles:
            assert getattr(self.dll, f"srf_{kind}_free")(handle) == 0
        self.handles = []

    def struct(self, name, **fields):
        """A struct with its defaults, where it has some, and fields."""
        struct = self.structs[f"srf_{name}"]()
        if f"{name}_init_sized" in self.prototypes:
            self._checked(f"{name}_init_sized", [ctypes.byref(struct), ctypes.c_size_t(ctypes.sizeof(struct))])
        for field, value in fields.items():
            assert hasattr(struct, field), field
            setattr(struct, field, self.constants.get(value, value))
        return struct

    def __getattr__(self, name):
        if name not in self.__dict__.get("prototypes", {}):
            raise AttributeError(name)
        return lambda *given, **filled: self._call(name, given, filled)

    def image(self, image):
        """A handle of an image of Python's."""
        samples = image.points if image.values is None else image.values.reshape(-1, 1)
        samples = samples.reshape(-1, samples.shape[-1])
        handle = self.image_create(
            image.rows, image.cols, image.projection, samples, image.world_from_sensor, image.name
        )
        pixels = image.rows * image.cols
        attributes = (image.colour, image.intensity, image.confidence)
        self.image_set_attributes(handle, *(None if a is None else a.reshape(pixels, -1) for a in attributes))
        return handle

    def mesh(self, mesh):
        """A handle of a mesh of Python's."""
        handle = self.mesh_create(mesh.positions, mesh.triangles)
        for domain, attributes in (1, mesh.vertex_attributes), (2, mesh.face_attributes):
            for name, values in attributes.items():
                self.mesh_set_attribute(handle, domain, name, values.reshape(len(values), -1))
        return handle

    def attributes(self, mesh, domain):
        """All attributes of a mesh's vertices (1) or triangles (2)."""
        names = (self.mesh_attribute_name(mesh, domain, i) for i in range(self.mesh_attribute_count(mesh, domain)))
        return {name: self.mesh_attribute(mesh, domain, name) for name in names}

    def _fields(self, body):
        """The fields of a struct, as ctypes wants them."""
        for line in filter(None, (line.strip() for line in body.split(";"))):
            kind, name, sizes = re.fullmatch(r"(.*?[ *])(\w+)((?:\[\d+\])*)", line).groups()
            kind = kind.strip()
            pointer = kind.endswith(("*", "_fn"))
            field = ctypes.c_void_p if pointer else SCALARS.get(kind) or self.structs[kind]
            for size in reversed(re.findall(r"\d+", sizes)):
                field *= int(size)
            yield name, field

    def _call(self, name, given, filled):
        given, taken, kept, outs = list(given), [], [], []
        for prototype in self.prototypes[name]:
            kind, argument = re.fullmatch(r"(.*?[ *])(\w+)", prototype).groups()
            kind = kind.strip()
            if kind == "const srf_progress *":
                taken.append(None)
            elif argument in filled:
                value = filled.pop(argument)
                taken.append(None if value is None else value.ctypes)
            elif argument.startswith("out_"):
                out = self._out(kind, name, argument)
                outs.append((kind, out))
                taken.append(ctypes.byref(out))
            else:
                value = self._given(kind, given.pop(0))
                kept.append(value)
                by_value = value is None or isinstance(value, (bytes, ctypes.Array, *SCALARS.values(), ctypes.c_void_p))
                taken.append(value if by_value else ctypes.byref(value))
        assert not given and not filled, f"srf_{name}: {given} {filled} left"
        self._checked(name, taken)
        results = [self._result(kind, out) for kind, out in outs]
        return results[0] if len(results) == 1 else results or None

    def _given(self, kind, value):
        """An argument as the prototype's type."""
        if value is None:
            return None
        if kind in SCALARS:
            return SCALARS[kind](self.constants.get(value, value))
        if kind == "const char *":
            return str(value).encode()
        if kind == "const srf_array *":
            value = np.ascontiguousarray(value if value.ndim == 2 else value.reshape(len(value), -1))
            number = next(number for number, dtype in TYPES.items() if dtype == value.dtype)
            array = self.structs["srf_array"](value.ctypes.data, len(value), 0, number, value.shape[1])
            array.borrowed = value
            return array
        if kind == "const srf_pose *":
            columns = np.asarray(value, float).reshape(-1, 4, 4).transpose(0, 2, 1)
            return (self.structs["srf_pose"] * len(columns)).from_buffer_copy(np.ascontiguousarray(columns))
        if kind == "const srf_projection *":
            return self.projection(value)
        if kind.endswith("*const *") and isinstance(value, list):
            return (ctypes.c_void_p * len(value))(*(handle.value for handle in value))
        if kind.startswith("const ") and kind.endswith(" *") and kind[6:-2] in SCALARS:
            return (SCALARS[kind[6:-2]] * np.size(value))(*np.ravel(value))
        return value

    def projection(self, described):
        """Python's description as a struct."""
        kind = described["kind"]
        if kind == "points":
            way, numbers = described["viewing"]
            kind = "SRF_PROJECTION_GRID_PARALLEL" if way == "parallel" else "SRF_PROJECTION_GRID_FROM"
        elif kind == "pinhole":
            numbers = (*described["focal"], *described["centre"])
            kind = "SRF_PROJECTION_PINHOLE_DEPTH" if described["depth"] == "planar" else "SRF_PROJECTION_PINHOLE_RANGE"
        else:
            numbers, kind = (*described["first"], *described["step"]), f"SRF_PROJECTION_{kind.upper()}"
        four = (ctypes.c_double * 4)(*numbers)
        return self.structs["srf_projection"](self.constants[kind], 0, four)

    def _out(self, kind, name, argument):
        """The place in which a call puts a result."""
        kind = kind.removesuffix("*").strip()
        if kind.endswith("*"):
            return ctypes.c_char_p() if kind == "const char *" else ctypes.c_void_p()
        if kind in self.structs:
            return self.struct(kind.removeprefix("srf_"))
        if kind == "char":
            return ctypes.create_string_buffer(TEXT)
        # Of numbers, those of which there may be more than one are given by their names.
        assert kind not in ("double", "uint8_t"), f"srf_{name} wants {argument}=an array"
        return SCALARS[kind]()

    def _result(self, kind, out):
        if kind.endswith("**"):
            if kind.startswith("const char"):
                return out.value.decode()
            self.handles.append((kind.removesuffix("**").strip().removeprefix("srf_"), out))
            return out
        if isinstance(out, self.structs["srf_pose"]):
            return np.array(out.matrix).reshape(4, 4).T
        if kind == "char *":
            return out.value.decode()
        if not isinstance(out, self.structs["srf_array"]):
            return out.value if hasattr(out, "value") else out
        if not out.count:
            return None
        numbers = np.ctypeslib.as_ctypes_type(TYPES[out.type]) * (out.count * out.components)
        return np.array(numbers.from_address(out.data)).reshape(out.count, out.components)

    def _checked(self, name, arguments):
        status = getattr(self.dll, f"srf_{name}")(*arguments)
        if status != 0:
            raise AssertionError(f"srf_{name}: {status}, {self.dll.srf_last_error_message().decode()}")
