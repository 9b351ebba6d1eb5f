"""Plans and scans that are no longer what they were when the merge was planned."""

import json
import re
from pathlib import Path

import pytest
import shapes
import surfrecon
from command_line import run
from surfrecon import distributed

OPTIONS = {"voxel": 0.05, "threads": 1, "tasks": 2}
CHANGED = "this plan was changed after it was made: make it anew with surfrecon plan"


@pytest.fixture
def folder(tmp_path):
    """A folder of scans, which tell their poses themselves."""
    folder = tmp_path / "scans"
    folder.mkdir()
    surfrecon.write_scans(folder / "scans.conf", shapes.torus_scans(pixels=30))
    for k, scan in enumerate(surfrecon.open(folder / "scans.conf")):
        mesh = scan.read()
        mesh = mesh if isinstance(mesh, surfrecon.Mesh) else mesh.to_mesh()
        mesh.write(tmp_path / f"scan {k}.ply")
    for path in folder.iterdir():
        path.unlink()
    for path in tmp_path.glob("scan *.ply"):
        path.rename(folder / path.name)
    return folder


def planned(folder, **given):
    beside = folder.parent
    return distributed.Plan.make(beside / "plan.json", folder, beside / "surface.ply", **(OPTIONS | given))


@pytest.mark.parametrize("keep", [False, True])
@pytest.mark.parametrize(
    "change",
    [
        lambda content: content["options"].update(voxel=0.1),
        lambda content: content["options"].update(max_hole_length=1.0),
        lambda content: content.update(tasks=3),
        lambda content: content.update(tasks="a"),
        lambda content: content.update(tasks=None),
        lambda content: content.update(keep="a"),
        lambda content: content.update(keep=not content["keep"]),
        lambda content: content.update(options=3),
        lambda content: content.update(reading={"confidence": 0.5}),
        lambda content: content.update(name="surfrecon-merge-0000000000000000"),
        lambda content: content.update(max_memory="2GB"),
        lambda content: content.update(paths=[3]),
        lambda content: content.update(scans=[3]),
        lambda content: content["written"].update(part_triangles=-1),
        lambda content: content["written"].pop("encoding"),
    ],
)
def test_a_plan_that_was_edited_is_refused(folder, change, keep):
    path = Path(planned(folder, keep=keep).path)
    content = json.loads(path.read_text())
    assert distributed.Plan.read(path).name == content["name"]
    change(content)
    path.write_text(json.dumps(content))
    with pytest.raises(surfrecon.FormatError, match=re.escape(f"{path}: {CHANGED}")):
        distributed.Plan.read(path)


def test_a_task_of_an_edited_plan_is_refused_in_a_line(folder):
    path = Path(planned(folder).path)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"tasks": "a"}))
    refused = run("task", path, "0", check=False)
    assert (refused.returncode, refused.stdout) == (1, "")
    assert refused.stderr.splitlines() == [f"surfrecon: task: {path}: {CHANGED}"]


def test_threads_may_be_edited(folder):
    path = Path(planned(folder).path)
    content = json.loads(path.read_text())
    content["options"]["threads"] = 2
    path.write_text(json.dumps(content))
    assert distributed.Plan.read(path).threads == 2


@pytest.mark.parametrize("keep", [False, True])
def test_scans_of_a_folder_that_vanish_or_come_are_named(folder, keep):
    plan = planned(folder, keep=keep)
    first, second, *_ = sorted(folder.iterdir())
    contents = {path: path.read_bytes() for path in (first, second)}

    def problem():
        with pytest.raises(surfrecon.InputError) as raised:
            distributed.Plan.read(plan.path).run(0)
        return str(raised.value)

    first.unlink()
    since = f"since {plan.path} was planned: plan it anew"
    assert problem() == f"{first.name}: scan {first.stem} is gone {since}"
    second.unlink()
    assert problem() == f"{first.name}: scan {first.stem} is gone, and 1 more, {since}"
    plan = planned(folder, keep=keep)
    first.write_bytes(contents[first])
    assert problem() == f"{first.name}: scan {first.stem} came {since}"
    plan = planned(folder, keep=keep)
    first.write_bytes(contents[first] + b" ")
    assert problem() == f"{first.name}: scan {first.stem} has changed {since}"
