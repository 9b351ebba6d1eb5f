"""Work that a merge leaves for the next one."""

import bpy
import pytest
import surfrecon
from files import write_set
from shapes import torus_scans
from test_in_files import merged as merged_with

# Blocks of space are a fraction of the torus.
OPTIONS = {"voxel": 0.02, "merge_distance": 0.06, "measure": False, "threads": 1}


@pytest.fixture(scope="module")
def images():
    return torus_scans(pixels=60, noise=0.001)[:6]


@pytest.fixture
def scans(tmp_path, images):
    """Names of scans, each of a torus of its own."""
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, images)))
    for k, image in enumerate(images):
        bpy.data.objects[image.name].location.x += 4 * k
    bpy.context.view_layer.update()
    return [image.name for image in images]


@pytest.fixture
def kept(extension):
    """The store of kept work, empty at first."""
    found = extension.kept_merge.KeptMerge
    found.forget()
    yield found
    found.forget()


def merged(names, **options):
    """The result of merging those objects: what its mesh holds, and its report."""
    return merged_with(names, **OPTIONS | options)


def move(name, by):
    bpy.data.objects[name].location.z += by
    bpy.context.view_layer.update()


def test_only_what_a_moved_scan_has_a_part_in_is_done_anew(scans, kept):
    first, report = merged(scans)
    renewed, of = report["renewed"]
    assert renewed == of > 50
    again, report = merged(scans)
    assert again == first and report["renewed"] == [0, of]
    # Parts are chosen anew, the rest stays.
    largest, report = merged(scans, min_component_share=0.99)
    assert largest != first and report["renewed"] == [0, of]
    move(scans[2], 0.3)
    second, report = merged(scans)
    renewed, of = report["renewed"]
    assert 0 < renewed < of / 3
    # Another object, one less, a changed one, and another name.
    fewer, report = merged(scans[:-1])
    assert report["scans"] == len(scans) - 1
    bpy.data.objects[scans[0]].data.vertices[10].co.z += 1e-3
    edited, _ = merged(scans)
    bpy.data.objects[scans[1]].name = renamed = "zzz"
    names = [renamed if name == scans[1] else name for name in scans]
    other_order, _ = merged(names)
    for expected, of in ((edited, None), (other_order, names)):
        if of is not None:
            kept.forget()
            assert merged(of)[0] == expected
    assert edited != second != fewer
    bpy.data.objects[renamed].name = scans[1]
    kept.forget()
    assert merged(scans)[0] == edited


def test_moved_scans_merge_as_from_scratch(scans, kept):
    merged(scans)
    for k, name in enumerate(scans[:3]):
        move(name, 0.05 * k - 0.3)
        here, report = merged(scans)
        assert report["renewed"][0] < report["renewed"][1]
        held = kept.merger, kept.keys
        kept.forget()
        assert merged(scans)[0] == here
        kept.merger, kept.keys = held


def test_undo_does_not_deceive_it(scans, kept):
    bpy.ops.ed.undo_push(message="before")
    first, _ = merged(scans)
    bpy.ops.ed.undo_push(message="merged")
    move(scans[2], 0.3)
    bpy.ops.ed.undo_push(message="moved")
    second, _ = merged(scans)
    bpy.ops.ed.undo_push(message="merged again")
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    assert merged(scans)[0] == first
    move(scans[2], 0.3)
    assert merged(scans)[0] == second != first


def test_a_merge_that_is_cancelled_leaves_what_was_kept_right(scans, kept, extension, monkeypatch):
    first, _ = merged(scans)
    move(scans[2], 0.3)
    running = extension.job.Running
    with monkeypatch.context() as patched:
        patched.setattr(running, "ended", lambda original=running.ended: (running.job.cancel(), original())[1])
        for obj in bpy.data.objects:
            obj.select_set(obj.name in scans)
        assert bpy.ops.surfrecon.merge(**OPTIONS) == {"CANCELLED"}
    second, _ = merged(scans)
    kept.forget()
    assert merged(scans)[0] == second != first


def test_its_memory_is_given_back(scans, kept, extension):
    before = surfrecon.memory_in_use()
    merged(scans)
    assert surfrecon.memory_in_use() - before > 1e6
    kept.used -= extension.kept_merge.IDLE_SECONDS + 1
    assert extension.kept_merge.look() is None and kept.merger is None
    assert surfrecon.memory_in_use() - before < 1e6
    merged(scans)
    assert extension.kept_merge.look() == extension.kept_merge.LOOK_SECONDS
    # Another operation finds memory short.
    bpy.context.view_layer.objects.active = bpy.data.objects[scans[0]]
    bpy.data.objects[scans[0]].select_set(True)
    surfrecon.set_memory_limit(40_000)
    try:
        with pytest.raises(RuntimeError, match="What the last merge had kept is given back now: try again"):
            bpy.ops.surfrecon.sculpt()
    finally:
        surfrecon.set_memory_limit(None)
    assert kept.merger is None
    merged(scans)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert kept.merger is None
