"""Every way to stop every long operator: the scene stays as it was, the thread ends, the memory comes back."""

import addon_utils
import bpy
import declared_operators
import numpy as np
import pytest
import surfrecon
from conftest import MODULE
from declared_operators import ON_MESH
from files import write_set
from shapes import torus, torus_scans
from test_merge import add_mesh
from test_selections import state

# Long operators, with options.
LONG = dict.fromkeys(declared_operators.LONG, {}) | {
    "reproject": {"percent": 40},
    "virtual_scan": {"percent": 40},
    "ground": {"by": "FOUND"},
    "clean": {},
    "align_merge": {},
    "merge": {"voxel": 0.008},
    "merge_to_file": {"voxel": 0.008},
    "sculpt": {"relative_tolerance": 0.0001},
    "quads": {"rows": 20, "columns": 20},
    "remesh": {"vertices": 10000},
    "error_map": {},
    "measure": {},
}

# Those whose active object is a surface.
ON_SHAPE = ON_MESH | {"error_map", "measure", "reproject"}


def operator_classes():
    return {
        name.removeprefix("SURFRECON_OT_"): getattr(bpy.types, name) for name in dir(bpy.types) if "RECON_OT" in name
    }


def test_every_long_operator_is_listed(extension):
    long = {name for name, cls in operator_classes().items() if issubclass(cls, extension.job.JobOperator)}
    assert long == set(LONG)


@pytest.fixture(scope="module")
def scans_file(tmp_path_factory):
    """Four scans, written once."""
    return str(write_set(tmp_path_factory.mktemp("scans"), torus_scans(pixels=120)[:4]))


def floor(extension):
    """A scan of a floor below the others."""
    x, y = np.meshgrid(np.linspace(-3, 3, 200), np.linspace(-3, 3, 200))
    points = np.stack([x, y, np.full_like(x, -0.6)], axis=-1)
    image = surfrecon.RangeImage.from_points(points, viewing=("parallel", (0, 0, -1)))
    made = extension.scan_objects.object_from_range_image("floor", image, 1.0, True)
    bpy.context.scene.collection.objects.link(made)
    bpy.context.view_layer.update()
    return made


@pytest.fixture
def call(scans_file, extension, tmp_path):
    """Calls an operator with something to work on."""
    path = scans_file
    bpy.ops.surfrecon.import_scans(filepath=path)
    scans = bpy.context.selected_objects
    shape = add_mesh("torus", torus(150))
    below = floor(extension)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0, 0, 5)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.view_layer.update()

    def run(name, *mode):
        for obj in bpy.context.selected_objects:
            obj.select_set(False)
        active = shape if name in ON_SHAPE else scans[0]
        chosen = {
            "sculpt": scans[:1],
            "quads": scans[:1],
            "reconstruct": scans[:1],
            "reproject": [shape],
        }.get(name, [shape] if name in ON_MESH else [*scans, shape])
        if name in {"align", "align_merge", "merge", "merge_to_file", "clean"}:
            chosen = scans
        if name in {"ground", "remove_background"}:
            # A plane is hidden once nothing of it is left.
            below.hide_set(False)
            chosen = [*scans, below]
        for obj in chosen:
            obj.select_set(True)
        bpy.context.view_layer.objects.active = active
        files = {"import_scans": path, "merge_to_file": str(tmp_path / "surface.ply")}
        options = LONG[name] | ({"filepath": files[name]} if name in files else {})
        return getattr(bpy.ops.surfrecon, name)(*mode, **options)

    return run


@pytest.mark.parametrize("name", LONG)
@pytest.mark.parametrize("route", ["ESC", "button"])
def test_a_stopped_operator_changes_nothing(call, extension, monkeypatch, name, route):
    """ESC and the button come to `Running.stop`; here each look at the progress is one."""
    running, jobs = extension.job.Running, []
    begin = running.begin.__func__

    def begun(cls, job, title):
        begin(cls, job, title)
        jobs.append(job)
        if route == "button":
            assert bpy.ops.surfrecon.cancel() == {"FINISHED"}
        else:
            cls.stop()

    # Another kind of state than the operator's own.
    call(name) if name == "import_scans" else None
    before = state()
    monkeypatch.setattr(running, "begin", classmethod(begun))
    assert call(name) == {"CANCELLED"}
    monkeypatch.undo()
    after = state()
    # The selection for the call is the test's own doing.
    assert after[:3] == before[:3]
    assert running.job is None and jobs and all(job.done() for job in jobs)
    assert call(name) == {"FINISHED"}


@pytest.mark.parametrize("name", ["merge", "error_map"])
def test_objects_are_read_one_by_one_and_may_vanish_meanwhile(call, extension, monkeypatch, name):
    """Between two objects the window lives: here one that is still to be read is removed."""
    read = extension.running.Gathering.read
    # After each object, also where the clock stands still for longer than one takes.
    monkeypatch.setattr(extension.running, "READING_SECONDS", -1)
    removed = []

    def looked(self):
        if self.share > 0 and not removed:
            removed.append(bpy.context.selected_objects[-1].name)
            bpy.data.objects.remove(bpy.context.selected_objects[-1])
        return read(self)

    monkeypatch.setattr(extension.running.Gathering, "read", looked)
    with pytest.raises(RuntimeError, match="meanwhile: try again"):
        call(name)
    assert removed and extension.job.Running.job is None


def test_disabling_the_extension_ends_what_runs(extension):
    image = surfrecon.RangeImage.from_points(torus_scans(pixels=400)[0].points, viewing=("parallel", (0, 0, -1)))
    job = surfrecon.Job.merge([image], voxel=0.002)
    extension.job.Running.begin(job, "Merge Scans")
    addon_utils.disable(MODULE)
    assert extension.job.Running.job is None
    with pytest.raises(surfrecon.Cancelled):
        job.result()
    addon_utils.enable(MODULE)
    assert bpy.ops.surfrecon.merge.poll() in {True, False}


def test_an_operator_that_blender_ends_stops_its_job(call, extension):
    """Closing the window or reading another file: Blender calls `cancel` of the operator, and its `modal` no more."""
    running = extension.job.Running
    job = surfrecon.Job.merge(torus_scans(pixels=400)[:3], voxel=0.002)
    running.begin(job, "Merge Scans")
    left = []
    operator = type("Ended", (), {"_leave": lambda self, context, done=None: left.append(done)})()
    extension.job.JobOperator.cancel(operator, bpy.context)
    assert running.job is None and left == [None]
    with pytest.raises(surfrecon.Cancelled):
        job.result()


def test_nothing_is_held_when_an_operator_has_ended(call, extension):
    """By the library's own count; what adjusting, and the next merge, may need again is given back by itself."""
    results = [call(name) for name in LONG]
    assert all(result == {"FINISHED"} for result in results)
    extension.kept.Kept.forget()
    extension.kept_merge.KeptMerge.forget()
    for name in LONG:
        before = surfrecon.memory_in_use()
        assert call(name) == {"FINISHED"}
        extension.kept.Kept.forget()
        extension.kept_merge.KeptMerge.forget()
        held = surfrecon.memory_in_use() - before
        # An import keeps where its files are until the next one.
        assert held < 64_000, f"{name} holds {held:,} bytes"
