"""The same input gives the same bytes through the C library and through Python.

That C gives those of the core is tested in Rust. SURFRECON_LIBRARY names the built library.
"""

import ctypes
import os

import numpy as np
import pytest
import surfrecon

LIBRARY = os.environ.get("SURFRECON_LIBRARY")
pytestmark = pytest.mark.skipif(not LIBRARY, reason="SURFRECON_LIBRARY is not set")

F32, F64, U32 = 1, 2, 4
FLOAT_TYPES = {2: np.float64, 4: np.uint32, 1: np.float32, 3: np.int32, 5: np.uint8}


class Array(ctypes.Structure):
    """srf_array."""

    _fields_ = [
        ("data", ctypes.c_void_p),
        ("count", ctypes.c_size_t),
        ("stride", ctypes.c_size_t),
        ("type", ctypes.c_uint32),
        ("components", ctypes.c_uint32),
    ]

    @classmethod
    def of(cls, array, kind):
        """A borrowed array."""
        return cls(array.ctypes.data, len(array), 0, kind, array.shape[1])

    def copy(self):
        """A view as a NumPy array of its own."""
        size = self.count * self.components
        numbers = (np.ctypeslib.as_ctypes_type(FLOAT_TYPES[self.type]) * size).from_address(self.data)
        return np.array(numbers).reshape(self.count, self.components)


class MergeParams(ctypes.Structure):
    """srf_merge_params."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("threads", ctypes.c_uint32),
        ("voxel", ctypes.c_double),
        ("merge_distance", ctypes.c_double),
        ("max_hole_length", ctypes.c_double),
        ("min_component_share", ctypes.c_double),
        ("edge_limit", ctypes.c_double),
        ("grazing_limit", ctypes.c_double),
    ]


def test_a_merge():
    """Two overlapping height maps as meshes."""
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    meshes = []
    for shift in (0.0, 0.2):
        points = np.dstack([x, y, np.sin(0.3 * x) * np.cos(0.2 * y) + shift]).astype(np.float32)
        image = surfrecon.RangeImage.from_points(points, name=f"scan {shift}")
        meshes.append(image.triangulate())
    result = surfrecon.merge([(m, np.eye(4), f"scan {i}") for i, m in enumerate(meshes)], voxel=0.7)

    library = ctypes.CDLL(LIBRARY)
    library.srf_last_error_message.restype = ctypes.c_char_p

    def call(name, *arguments):
        status = getattr(library, name)(*arguments)
        assert status == 0, library.srf_last_error_message().decode()

    merger, merged = ctypes.c_void_p(), ctypes.c_void_p()
    call("srf_merger_create", ctypes.byref(merger))
    for i, mesh in enumerate(meshes):
        handle = ctypes.c_void_p()
        positions, triangles = np.ascontiguousarray(mesh.positions), np.ascontiguousarray(mesh.triangles, np.uint32)
        arrays = Array.of(positions, F64), Array.of(triangles, U32)
        call("srf_mesh_create", *map(ctypes.byref, arrays), ctypes.byref(handle))
        confidence = mesh.vertex_attributes["confidence"].reshape(-1, 1)
        call("srf_mesh_set_attribute", handle, 1, b"confidence", ctypes.byref(Array.of(confidence, F32)))
        call("srf_merger_add_mesh", merger, handle, None, f"scan {i}".encode())
        call("srf_mesh_free", handle)
    params = MergeParams()
    call("srf_merge_params_init_sized", ctypes.byref(params), ctypes.c_size_t(ctypes.sizeof(params)))
    params.voxel = 0.7
    call("srf_merger_run", merger, ctypes.byref(params), None, ctypes.byref(merged), None)
    views = Array(), Array()
    call("srf_mesh_positions", merged, ctypes.byref(views[0]))
    call("srf_mesh_triangles", merged, ctypes.byref(views[1]))
    assert len(result.mesh.triangles) > 1000
    assert views[0].copy().tobytes() == result.mesh.positions.tobytes()
    assert views[1].copy().tobytes() == result.mesh.triangles.astype(np.uint32).tobytes()
    call("srf_mesh_free", merged)
    call("srf_merger_free", merger)
