"""Loads the built plugin into the real MeshLab of the environment, and evens out what differs between its versions."""

import os
import sys
from pathlib import Path

import pymeshlab
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "python"), str(ROOT / "tests" / "blender")]

IMPORT = "create_range_images_from_file"
ALIGN = "compute_matrix_by_scan_alignment"
MERGE = "generate_surface_reconstruction_marching_intersections"
DISTANCE = "get_exact_distance_between_layers"
SCULPT = "generate_surface_reconstruction_range_image_sculpting"
QUADS = "generate_surface_reconstruction_adaptive_quad_grid"
RECONSTRUCT = "generate_surface_reconstruction_delaunay_carving"
CLUSTER = "meshing_multiresolution_clustering"
CLOSE = "meshing_close_surface"
CHECK_PRINT = "compute_scalar_by_print_check_per_face"
PREPARE_PRINT = "meshing_prepare_for_printing"
UNWRAP = "compute_texcoord_by_unwrapping_per_wedge"
REGION = "meshing_keep_or_remove_by_region"
BACKGROUND = "meshing_remove_background"
SIZE_AND_GROUND = "compute_matrix_by_true_size_and_ground"


def plugins():
    """The folder of what is tested: SURFRECON_PLUGINS, which tools/testing/plan.py sets."""
    return Path(os.environ["SURFRECON_PLUGINS"])


def pytest_configure(config):
    pymeshlab.load_plugin(str(plugins() / "libfilter_surfrecon.so"))
    pymeshlab.load_plugin(str(plugins() / "libio_surfrecon.so"))


def length(value):
    """A length as MeshLab's filters take it: absolute."""
    return getattr(pymeshlab, "PureValue", None or getattr(pymeshlab, "AbsoluteValue", None))(value)


class Document:
    """A MeshSet with the same few calls in all versions."""

    def __init__(self):
        self.set = pymeshlab.MeshSet(verbose=False)

    def __len__(self):
        return len(self.set)

    def add(self, positions, triangles=None, name="", **more):
        """Adds a layer and returns it."""
        arrays = {"vertex_matrix": positions} | ({} if triangles is None else {"face_matrix": triangles}) | more
        self.set.add_mesh(pymeshlab.Mesh(**arrays), name)
        return self.set.current_mesh()

    def layers(self):
        """All layers, in their order."""
        return list(self.set)

    def named(self, name):
        """Makes the layer of that label the current one and returns it."""
        layer = next(layer for layer in self.set if layer.label() == name)
        self.set.set_current_mesh(layer.id())
        return self.set.current_mesh()

    def run(self, name, **parameters):
        """Applies a filter; returns what it returns."""
        return self.set.apply_filter(name, **parameters)

    @property
    def current(self):
        """The current layer."""
        return self.set.current_mesh()


def scalars(layer, name):
    """A scalar custom attribute of the vertices."""
    return layer.vertex_custom_scalar_attribute_array(name)


def has_scalars(layer, name):
    """Whether the vertices have that attribute."""
    try:
        scalars(layer, name)
    except pymeshlab.PyMeshLabException:
        return False
    return True


def matrix(layer):
    """The matrix of a layer."""
    return layer.trasform_matrix() if hasattr(layer, "trasform_matrix") else layer.transform_matrix()


@pytest.fixture
def document():
    return Document()


@pytest.fixture
def refused():
    """Calls what must fail and returns the sentence of the filter."""

    def call(function, *arguments, **named):
        with pytest.raises(pymeshlab.PyMeshLabException) as error:
            function(*arguments, **named)
        return str(error.value).split("Details: ")[-1]

    return call
