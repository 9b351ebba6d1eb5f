"""Measuring one object against another: the bound, both ways, what is refused."""

import bpy
import numpy as np
import pytest
import surfrecon
from mathutils import Matrix
from shapes import torus
from test_error_map import errors
from test_merge import add_mesh

PLANE = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]


def quad(name, height, matrix=None):
    positions = np.array(PLANE, float) + [0, 0, height]
    return add_mesh(name, surfrecon.Mesh(positions, [[0, 1, 2], [0, 2, 3]]), matrix)


def test_parallel_planes():
    quad("there", 0)
    measured = quad("here", 0.25)
    assert bpy.ops.surfrecon.measure() == {"FINISHED"}
    figures = measured["surfrecon_measure"].to_dict()
    for name in ("mean", "rms", "p95", "reached", "back_reached"):
        assert figures[name] == pytest.approx(0.25)
    assert 0.25 <= figures["bound"] <= 0.2526 and figures["hausdorff"] == max(figures["bound"], figures["back_bound"])
    assert np.allclose(errors(measured), 0.25)
    assert figures["against"] == "there"


def test_a_result_is_measured_against_its_hidden_sources(extension):
    source, result = quad("source", 0), quad("result", 0.25)
    result["surfrecon_scans"] = "source\nremoved meanwhile"
    extension.hiding.hide(bpy.context, [source, None])
    assert not source.visible_get()
    bpy.ops.surfrecon.measure()
    figures = result["surfrecon_measure"].to_dict()
    assert figures["reached"] == pytest.approx(0.25) and figures["against"] == "source"
    source.modifiers.new("Subdivision", "SUBSURF")
    with pytest.raises(RuntimeError, match='"source" is hidden, and so is what its modifiers make of it: show it'):
        bpy.ops.surfrecon.measure()


def test_what_the_active_one_lacks_counts_only_from_the_other():
    there, here = quad("there", 0), quad("here", 0)
    half = bpy.data.meshes.new("half")
    half.from_pydata(PLANE[:3], [], [[0, 1, 2]])
    here.data = half
    assert there.select_get()
    bpy.ops.surfrecon.measure()
    figures = here["surfrecon_measure"].to_dict()
    assert figures["bound"] < 1e-4
    # The corner that is missing is as far as half the diagonal.
    assert figures["back_reached"] == pytest.approx(2**0.5) and figures["hausdorff"] >= 2**0.5


def test_the_bound_holds_for_samples_of_a_turned_and_stretched_torus():
    pose = Matrix.Rotation(0.7, 4, "X") @ Matrix.Diagonal((2, 1, 0.5, 1))
    add_mesh("fine", torus(60), pose)
    coarse = add_mesh("coarse", torus(12), pose)
    bpy.ops.surfrecon.measure(both=False)
    figures = coarse["surfrecon_measure"].to_dict()
    assert "hausdorff" not in figures
    mesh, turned = torus(12), np.array(pose)[:3, :3]
    weights = np.random.default_rng(0).dirichlet((1, 1, 1), size=(len(mesh.triangles), 40))
    samples = np.einsum("mkc,mcx->mkx", weights, mesh.positions[mesh.triangles]).reshape(-1, 3) @ turned.T
    reference = surfrecon.Mesh(torus(60).positions @ turned.T, torus(60).triangles)
    distances = surfrecon.distances(samples, reference)
    assert distances.max() <= figures["bound"] <= 1.02 * figures["reached"]
    assert distances.max() > 0.8 * figures["reached"]
    assert figures["max"] <= figures["reached"]


def test_modifiers_instances_and_mirrors_count():
    measured = quad("here", 0)
    moved = measured.modifiers.new("Displace", "DISPLACE")
    moved.strength, moved.mid_level = 0.1, 0
    source = quad("source", 0)
    collection = bpy.data.collections.new("sources")
    bpy.context.collection.objects.unlink(source)
    collection.objects.link(source)
    instance = bpy.data.objects.new("instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", collection
    bpy.context.collection.objects.link(instance)
    instance.location.z = 0.5
    instance.scale.z = -1
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    instance.select_set(True)
    measured.select_set(True)
    bpy.context.view_layer.objects.active = measured
    bpy.context.view_layer.update()
    assert bpy.ops.surfrecon.measure(signed=True) == {"FINISHED"}
    assert measured["surfrecon_measure"]["reached"] == pytest.approx(0.4)


def test_materials_come_back():
    quad("there", 0)
    measured = quad("here", 0.1)
    own = [bpy.data.materials.new(name) for name in ("one", "two")]
    for material in own:
        measured.data.materials.append(material)
    bpy.ops.surfrecon.measure()
    assert not any(slot.material in own for slot in measured.material_slots)
    assert list(measured.data.materials) == own
    # Workbench shows colours only.
    assert measured.data.color_attributes.active_color.name == "error_colour"
    assert bpy.ops.surfrecon.error_hide() == {"FINISHED"}
    assert [slot.material for slot in measured.material_slots] == own
    assert not bpy.ops.surfrecon.error_hide.poll()


def test_bad_selections():
    quad("alone", 0)
    with pytest.raises(RuntimeError, match='Select what "alone" is to be measured against'):
        bpy.ops.surfrecon.measure()
    empty = bpy.data.objects.new("empty", None)
    bpy.context.collection.objects.link(empty)
    empty.select_set(True)
    with pytest.raises(RuntimeError, match='Select what "alone" is to be measured against'):
        bpy.ops.surfrecon.measure()
    assert "surfrecon_measure" not in bpy.data.objects["alone"]
    lost = quad("lost", 0)
    lost.data.vertices[0].co.x = float("nan")
    with pytest.raises(RuntimeError, match='"lost" has a vertex whose coordinates are no numbers'):
        bpy.ops.surfrecon.measure()


def test_cancelling_changes_nothing(extension, monkeypatch):
    quad("there", 0)
    measured = quad("here", 0.25)
    running = extension.job.Running

    def ended(original=running.ended):
        running.job.cancel()
        return original()

    monkeypatch.setattr(running, "ended", ended)
    before = sorted(measured.keys()), len(bpy.data.materials), sorted(measured.data.attributes.keys())
    # Work this short may be over before it hears of it.
    if bpy.ops.surfrecon.measure() == {"CANCELLED"}:
        assert (sorted(measured.keys()), len(bpy.data.materials), sorted(measured.data.attributes.keys())) == before
    assert running.job is None


def test_undo_is_one_step():
    quad("there", 0)
    quad("here", 0.25)
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.surfrecon.measure()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert "surfrecon_measure" not in bpy.data.objects["here"] and not bpy.data.materials


@pytest.mark.parametrize("kind", ["instances_by_nodes", "instances_at_vertices"])
def test_instances_count_where_they_are_seen_and_are_refused_elsewhere(kind, tmp_path, extension):
    import test_selections

    getattr(test_selections, kind)(tmp_path)
    host = bpy.data.objects["host"]
    bpy.context.view_layer.update()
    surface = extension.surfaces.surface_of([host], bpy.context.evaluated_depsgraph_get())
    part = len(torus(10).triangles)
    assert len(surface.triangles) % part in {0, len(torus(8).triangles) % part}
    assert len(surface.triangles) >= part * len(torus(8).positions)
    truth = add_mesh("truth", torus(20))
    bpy.context.view_layer.objects.active = truth
    assert bpy.ops.surfrecon.measure() == {"FINISHED"}
    for name in ("merge", "reconstruct", "error_map"):
        with pytest.raises(RuntimeError, match="shows instances, which are not its own surface"):
            getattr(bpy.ops.surfrecon, name)()
    bpy.context.view_layer.objects.active = host
    with pytest.raises(RuntimeError, match="shows instances|has no vertices"):
        bpy.ops.surfrecon.remesh(vertices=50)
