"""Merges for which memory is short."""

import os
import tempfile

import bpy
import numpy as np
import surfrecon
from files import write_set
from shapes import torus_scans

OPTIONS = {"merge_distance": 0.06, "measure": False, "threads": 1}


def merged(names, **options):
    """The result of merging those objects: what its mesh holds, and its report."""
    for obj in bpy.data.objects:
        obj.hide_set(False)
        obj.select_set(obj.name in names)
    assert bpy.ops.surfrecon.merge(**OPTIONS | options) == {"FINISHED"}
    obj = bpy.context.object
    report = obj["surfrecon_report"].to_dict()
    return content(obj.data), report


def content(mesh):
    """All arrays of a mesh."""
    found = [("polygons", len(mesh.polygons))]
    kinds = {"FLOAT": ("value", np.float32, 1), "INT": ("value", np.int32, 1), "BOOLEAN": ("value", bool, 1)}
    kinds |= {"FLOAT_VECTOR": ("vector", np.float32, 3), "FLOAT_COLOR": ("color", np.float32, 4)}
    for name, layer in sorted(mesh.attributes.items()):
        if layer.data_type in kinds:
            field, dtype, width = kinds[layer.data_type]
            values = np.empty(len(layer.data) * width, dtype)
            layer.data.foreach_get(field, values)
            found.append((name, values.tobytes()))
    assert {"position", ".corner_vert", "source_scan"} <= {name for name, _ in found}
    return found


def test_where_memory_is_short_it_works_in_files_and_says_so(tmp_path, extension, capfd):
    images = torus_scans(pixels=100, noise=0.001)
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, images)))
    scans = [image.name for image in images]
    capfd.readouterr()
    for options in ({"voxel": 0.012, "measure": True}, {"voxel": 0.012}):
        expected, report = merged(scans, **options)
        assert not report["in_files"] and "renewed" in report
        assert "files" not in capfd.readouterr().out
        extension.kept_merge.KeptMerge.forget()
        files = set(os.listdir(bpy.app.tempdir or tempfile.gettempdir()))
        surfrecon.set_memory_limit(20_000_000)
        try:
            found, report = merged(scans, **options)
        finally:
            surfrecon.set_memory_limit(None)
        assert report["in_files"] and "renewed" not in report
        assert extension.kept_merge.KeptMerge.merger is None
        measured = [array for array in expected if array[0] in dict(found)]
        assert found == measured and len(found) >= len(expected) - 1
        assert "memory was short, so it worked in temporary files" in capfd.readouterr().out
        lines = [name for name, _ in extension.reports.merge_lines(bpy.context, bpy.context.object["surfrecon_report"])]
        assert "Memory was short, so it worked in temporary files" in lines
        assert set(os.listdir(bpy.app.tempdir or tempfile.gettempdir())) == files
