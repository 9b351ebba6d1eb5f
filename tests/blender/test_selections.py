"""Every operator on everything that may be selected: it does its work, or refuses in a sentence and changes nothing."""

import re

import bpy
import declared_operators
import pytest
from files import write_set
from shapes import torus, torus_scans
from test_merge import add_mesh

# Operators on a selection, with options. An import has none, and a plane is removed from scans that have one.
OPERATORS = {name: {} for name in declared_operators.LONG if name not in {"import_scans", "remove_background"}} | {
    "reproject": {"percent": 5},
    "virtual_scan": {"percent": 5},
    "tint_scans": {},
    "clean": {},
    "merge": {"voxel": 0.05},
    "sculpt": {"relative_tolerance": 0.01},
    "quads": {"rows": 8, "columns": 8},
    "remesh": {"vertices": 100},
    "error_hide": {},
    "error_map": {},
    "measure": {},
}


def link(obj):
    bpy.context.scene.collection.objects.link(obj)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    return obj


def scan(folder):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(folder, torus_scans(pixels=40)[:1])))
    return bpy.context.object


def a_scan(folder):
    scan(folder)


def a_mesh(folder):
    add_mesh("torus", torus())


def an_empty_mesh(folder):
    link(bpy.data.objects.new("empty", bpy.data.meshes.new("empty")))


def one_vertex(folder):
    mesh = bpy.data.meshes.new("one")
    mesh.from_pydata([(1, 2, 3)], [], [])
    link(bpy.data.objects.new("one", mesh))


def an_edge(folder):
    mesh = bpy.data.meshes.new("edge")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    link(bpy.data.objects.new("edge", mesh))


def a_lamp(folder):
    link(bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "SUN")))


def an_empty(folder):
    link(bpy.data.objects.new("empty", None))


def an_armature(folder):
    link(bpy.data.objects.new("armature", bpy.data.armatures.new("armature")))


def a_lattice(folder):
    link(bpy.data.objects.new("lattice", bpy.data.lattices.new("lattice")))


def a_text(folder):
    data = bpy.data.curves.new("text", "FONT")
    data.body = "scan"
    link(bpy.data.objects.new("text", data))


def a_curve_without_points(folder):
    link(bpy.data.objects.new("curve", bpy.data.curves.new("curve", "CURVE")))


def an_instance_of_a_collection(folder):
    obj = add_mesh("inside", torus())
    group = bpy.data.collections.new("group")
    group.objects.link(obj)
    obj.select_set(False)
    empty = bpy.data.objects.new("instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    link(empty)


def instances_by_nodes(folder):
    """Tori at the vertices of a mesh that is no longer seen itself."""
    source = add_mesh("torus", torus(10))
    source.select_set(False)
    group = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeObjectInfo", "GeometryNodeInstanceOnPoints", "NodeGroupOutput")
    given, taken, scatter, result = (group.nodes.new(kind) for kind in kinds)
    taken.inputs["Object"].default_value, taken.inputs["As Instance"].default_value = source, True
    group.links.new(given.outputs[0], scatter.inputs["Points"])
    group.links.new(taken.outputs["Geometry"], scatter.inputs["Instance"])
    group.links.new(scatter.outputs[0], result.inputs[0])
    host = add_mesh("host", torus(8))
    host.modifiers.new("Scatter", "NODES").node_group = group


def instances_at_vertices(folder):
    child = add_mesh("torus", torus(10))
    child.select_set(False)
    host = add_mesh("host", torus(8))
    host.instance_type, child.parent = "VERTS", host


def in_a_hidden_collection(folder):
    obj = scan(folder)
    group = bpy.data.collections.new("group")
    bpy.context.scene.collection.children.link(group)
    group.objects.link(obj)
    for other in list(obj.users_collection):
        if other != group:
            other.objects.unlink(obj)
    bpy.context.view_layer.layer_collection.children["group"].hide_viewport = True


def hidden_with_modifiers_of_a_scan(folder):
    obj = scan(folder)
    obj.modifiers.new("Smooth", "SMOOTH")
    obj.hide_viewport = True


def locked(folder):
    obj = scan(folder)
    obj.lock_location = obj.lock_rotation = obj.lock_scale = (True, True, True)
    obj.hide_select = True


def with_a_name_of_every_kind(folder):
    obj = scan(folder)
    obj.name = 'Büste "Ω" \\ / %s {0} 雕塑 \U0001f5ff'


def as_small_as_atoms(folder):
    scan(folder).scale = (1e-10, 1e-10, 1e-10)


def as_large_as_the_sun(folder):
    scan(folder).scale = (1e9, 1e9, 1e9)


def with_shape_keys(folder):
    obj = scan(folder)
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Key").value = 0.5


def of_flat_faces(folder):
    mesh = bpy.data.meshes.new("flat")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)], [], [(0, 1, 2), (1, 2, 3), (0, 0, 1)])
    link(bpy.data.objects.new("flat", mesh))


def sculpt_mode(folder):
    add_mesh("torus", torus())
    bpy.ops.object.mode_set(mode="SCULPT")


def hidden_and_active(folder):
    scan(folder).hide_set(True)


def hidden_with_modifiers(folder):
    obj = add_mesh("torus", torus())
    obj.modifiers.new("Subdivision", "SUBSURF")
    obj.hide_set(True)


def with_modifiers(folder):
    scan(folder).modifiers.new("Smooth", "SMOOTH")


def with_more_vertices(folder):
    scan(folder).modifiers.new("Subdivision", "SUBSURF")


def flattened(folder):
    scan(folder).scale.z = 0


def mirrored_and_stretched(folder):
    scan(folder).scale = (-1, 2, 0.5)


def nowhere(folder):
    scan(folder).location.x = float("nan")


def too_far(folder):
    scan(folder).location.x = 1e30


def with_vertices_that_are_no_numbers(folder):
    mesh = add_mesh("torus", torus()).data
    mesh.vertices[3].co.x = float("nan")


def linked(folder):
    name = scan(folder).name
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "library.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(folder / "library.blend"), link=True) as (_, wanted):
        wanted.objects = [name]
    link(wanted.objects[0])


def of_two_users(folder):
    obj = scan(folder)
    link(obj.copy())


def a_scan_that_lost_its_grid(folder):
    obj = scan(folder)
    obj.data.attributes.remove(obj.data.attributes["range_row"])


def a_scan_with_a_grid_that_lies(folder):
    obj = scan(folder)
    obj["range_rows"], obj["range_cols"] = 2**31 - 1, 2**31 - 1


def a_scan_with_words_for_a_grid(folder):
    scan(folder)["range_rows"] = "many"


def in_edit_mode(folder):
    add_mesh("torus", torus())
    bpy.ops.object.mode_set(mode="EDIT")


def nothing(folder):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    bpy.context.view_layer.objects.active = None


SELECTIONS = [
    a_scan,
    a_mesh,
    an_empty_mesh,
    one_vertex,
    an_edge,
    a_lamp,
    an_empty,
    an_armature,
    a_lattice,
    a_text,
    a_curve_without_points,
    an_instance_of_a_collection,
    instances_by_nodes,
    instances_at_vertices,
    in_a_hidden_collection,
    hidden_with_modifiers_of_a_scan,
    locked,
    with_a_name_of_every_kind,
    as_small_as_atoms,
    as_large_as_the_sun,
    with_shape_keys,
    of_flat_faces,
    sculpt_mode,
    hidden_and_active,
    hidden_with_modifiers,
    with_modifiers,
    with_more_vertices,
    flattened,
    mirrored_and_stretched,
    nowhere,
    too_far,
    with_vertices_that_are_no_numbers,
    linked,
    of_two_users,
    a_scan_that_lost_its_grid,
    a_scan_with_a_grid_that_lies,
    a_scan_with_words_for_a_grid,
    in_edit_mode,
    nothing,
]


def state():
    """The state that a refusal must leave as it was."""
    kinds = (bpy.data.objects, bpy.data.meshes, bpy.data.collections, bpy.data.materials, bpy.data.curves)
    counts = {mesh.name: (len(mesh.vertices), sorted(mesh.attributes.keys())) for mesh in bpy.data.meshes}
    properties = {obj.name: sorted(obj.keys()) for obj in bpy.data.objects}
    return [sorted(kind.keys()) for kind in kinds], counts, properties, [o.name for o in bpy.context.selected_objects]


def prepare(selection, folder):
    bpy.ops.wm.read_homefile(use_empty=True)
    selection(folder)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0, 0, 5)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.view_layer.update()


def mended():
    """The names of the meshes that Blender would mend as they are."""
    names = set()
    for mesh in list(bpy.data.meshes):
        copy = mesh.copy()
        if copy.validate():
            names.add(mesh.name)
        bpy.data.meshes.remove(copy)
    return names


@pytest.mark.parametrize("selection", SELECTIONS, ids=lambda f: f.__name__)
def test_each_operator_works_or_refuses_in_a_sentence(selection, tmp_path, extension):
    prepare(selection, tmp_path)
    broken = mended()
    for name, options in OPERATORS.items():
        before, operator = state(), getattr(bpy.ops.surfrecon, name)
        if not operator.poll():
            continue
        try:
            assert operator(**options) == {"FINISHED"}
        except RuntimeError as refused:
            said = str(refused).removeprefix("Error: ").strip()
            assert re.fullmatch(r'["A-Z0-9][^\n]{15,300}', said), f"{name}: {said}"
            assert state() == before, name
            continue
        finally:
            assert extension.job.Running.job is None
        assert mended() <= broken, name
        prepare(selection, tmp_path)
