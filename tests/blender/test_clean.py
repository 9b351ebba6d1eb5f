"""Cleaning scans: what goes, what stays, what is refused."""

import bpy
import numpy as np
import pytest
from files import write_set
from shapes import torus, torus_scans
from test_merge import add_mesh


@pytest.fixture
def scan(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60)[:1])))
    return bpy.context.object


def parts(obj):
    """Sizes of the connected parts, found by walking."""
    around = {vertex.index: set() for vertex in obj.data.vertices}
    for edge in obj.data.edges:
        a, b = edge.vertices
        around[a].add(b)
        around[b].add(a)
    sizes, left = [], set(around)
    while left:
        heap, seen = [left.pop()], 1
        while heap:
            for other in around[heap.pop()] & left:
                left.discard(other)
                heap.append(other)
                seen += 1
        sizes.append(seen)
    return sorted(sizes)


def cut(obj, distance):
    """Separates a small cap from the rest."""
    import bmesh

    high = max(vertex.co.x for vertex in obj.data.vertices)
    edited = bmesh.new()
    edited.from_mesh(obj.data)
    ring = [v for v in edited.verts if distance < high - v.co.x < 1.6 * distance]
    bmesh.ops.delete(edited, geom=ring, context="VERTS")
    edited.to_mesh(obj.data)
    edited.free()


def test_small_parts_go_and_it_stays_a_range_image(scan, extension):
    cut(scan, 0.15)
    before = parts(scan)
    assert len(before) > 1
    limit = before[-1]
    assert bpy.ops.surfrecon.clean(smallest=limit) == {"FINISHED"}
    assert parts(scan) == [limit]
    assert scan["surfrecon_clean"].to_dict() == {"samples": limit, "small": sum(before[:-1]), "doubtful": 0}
    image = extension.scan_objects.scan_of_object(scan, bpy.context.evaluated_depsgraph_get())
    assert image.valid.sum() == limit


def test_samples_of_low_confidence_go(scan):
    count = len(scan.data.vertices)
    values = np.linspace(0, 1, count, dtype=np.float32)
    scan.data.attributes.new("confidence", "FLOAT", "POINT").data.foreach_set("value", values)
    bpy.ops.surfrecon.clean(smallest=1, confidence=0.25)
    assert len(scan.data.vertices) == (values >= 0.25).sum()
    assert scan["surfrecon_clean"]["doubtful"] == (values < 0.25).sum()


def test_undo_is_one_step(scan):
    count, name = len(scan.data.vertices), scan.name
    cut(scan, 0.15)
    bpy.ops.ed.undo_push(message="before")
    left = len(scan.data.vertices)
    bpy.ops.surfrecon.clean(smallest=parts(scan)[-1])
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert len(bpy.data.objects[name].data.vertices) == left < count


def test_refusals(scan):
    count = len(scan.data.vertices)
    with pytest.raises(RuntimeError, match="Nothing would be left of"):
        bpy.ops.surfrecon.clean(smallest=10**6)
    assert len(scan.data.vertices) == count
    scan.select_set(False)
    add_mesh("torus", torus())
    assert not bpy.ops.surfrecon.clean.poll()
