"""More scans than memory holds, merged straight into a file."""

import json
import os

import numpy as np
import pytest
import shapes
import surfrecon
from command_line import run

OPTIONS = {"voxel": 0.02, "threads": 2}
# The least that two threads do with: blocks of two bricks.
LEAST = 24_000_000


@pytest.fixture(scope="module")
def scans():
    return shapes.torus_scans(pixels=60, noise=0.002)


@pytest.fixture
def workspace(tmp_path):
    folder = tmp_path / "workspace"
    folder.mkdir()
    yield folder
    assert not list(folder.iterdir())


@pytest.fixture(scope="module")
def at_once(scans, tmp_path_factory):
    """The file that merging and writing make, and the report."""
    result = surfrecon.merge(scans, **OPTIONS)
    path = tmp_path_factory.mktemp("at_once") / "surface.ply"
    result.mesh.write(path)
    return path.read_bytes(), result.report


def known(report):
    return {name: value for name, value in report.items() if name not in ("seconds", "working_bytes", "in_files")}


def test_the_file_is_the_one_that_merging_and_writing_make(scans, at_once, workspace, tmp_path):
    path = tmp_path / "surface.ply"
    for given in ({"max_memory": LEAST, "workspace": workspace}, {}):
        report = surfrecon.merge_to_file(scans, path, **given, **OPTIONS)
        assert isinstance(report, surfrecon.MergeReport)
        assert path.read_bytes() == at_once[0]
        assert known(report) == known(at_once[1])
    job = surfrecon.Job.merge_to_file(scans, path, max_memory=LEAST, workspace=os.fspath(workspace), **OPTIONS)
    assert known(job.result()) == known(at_once[1])
    assert path.read_bytes() == at_once[0]
    assert {entry.name for entry in tmp_path.iterdir()} == {"surface.ply", "workspace"}


def test_a_workspace_that_is_kept_takes_further_scans(tmp_path):
    (tmp_path / "scans").mkdir()
    (tmp_path / "workspace").mkdir()
    images = shapes.torus_scans(pixels=50, noise=0.002)
    for k, image in enumerate(images):
        image.name = f"scan {k:02}"
        image.write(tmp_path / "scans" / f"{k:02}.ply")

    def both(scans):
        path, again = tmp_path / "a.ply", tmp_path / "b.ply"
        given = {"max_memory": LEAST, "workspace": tmp_path / "workspace", "keep": True, **OPTIONS}
        surfrecon.merge_to_file(scans, path, **given)
        surfrecon.merge_to_file(scans, again, max_memory=LEAST, **OPTIONS)
        assert path.read_bytes() == again.read_bytes()
        (folder,) = (tmp_path / "workspace").iterdir()
        return {entry.name: entry.stat().st_mtime_ns for entry in folder.iterdir()}

    first = both(images[:-1])
    more = both(images)
    segments = [name for name in first if name.startswith("segment-")]
    # The findings of others stay, and are not made again.
    assert segments and all(more.get(name) == first[name] for name in segments)
    files = list(surfrecon.open(tmp_path / "scans"))
    known = both(files)
    changed = (tmp_path / "scans" / "01.ply").read_bytes()
    os.utime(tmp_path / "scans" / "01.ply")
    (tmp_path / "scans" / "01.ply").write_bytes(changed)
    told = both(files)
    new = [name for name in told if name.startswith("segment-") and name not in known]
    assert 1 <= len(new) < len([name for name in told if name.startswith("segment-")])
    with pytest.raises(surfrecon.InputError, match="what is kept needs a workspace"):
        surfrecon.merge_to_file(images, tmp_path / "a.ply", keep=True)
    given = [tmp_path / "scans", "-o", tmp_path / "c.ply", "--voxel", "0.02"]
    assert run("merge", *given, "--keep").returncode == 2
    kept = run("merge", *given, "--workspace", tmp_path / "workspace", "--keep")
    assert kept.returncode == 0, kept.stderr
    plain = run("merge", *given[:2], tmp_path / "d.ply", *given[3:])
    assert plain.returncode == 0, plain.stderr
    assert (tmp_path / "c.ply").read_bytes() == (tmp_path / "d.ply").read_bytes()


def test_scans_of_files_far_from_the_origin_keep_their_system(workspace, tmp_path):
    images = shapes.torus_scans(pixels=40)
    for image in images:
        pose = np.array(image.world_from_sensor)
        pose[:3, 3] += (400_000, 5_600_000, 100)
        image.world_from_sensor = pose
    surfrecon.write_scans(tmp_path / "scans.conf", images)
    scans, said = surfrecon.open(tmp_path / "scans.conf", crs="EPSG:25832"), {"made by": "hand"}
    surfrecon.merge(scans, voxel=0.05).mesh.write(tmp_path / "one.ply", provenance=said)
    into = tmp_path / "other.ply"
    surfrecon.merge_to_file(scans, into, voxel=0.05, workspace=workspace, provenance=said)
    assert into.read_bytes() == (tmp_path / "one.ply").read_bytes()
    assert surfrecon.provenance(into) == said
    assert b"property double x" in into.read_bytes()[:2000]
    surfrecon.merge_to_file(scans, into, voxel=0.05, workspace=workspace, encoding="binary_double")
    surfrecon.merge(scans, voxel=0.05).mesh.write(tmp_path / "one.ply", encoding="binary_double")
    assert into.read_bytes() == (tmp_path / "one.ply").read_bytes()


def test_what_can_not_be_is_told_before_the_work(scans, tmp_path):
    def refused(error, text, path="surface.ply", **given):
        with pytest.raises(error, match=text):
            surfrecon.merge_to_file(scans, tmp_path / path, **{**OPTIONS, **given})
        assert not list(tmp_path.iterdir())

    refused(surfrecon.InputError, "surface.obj: only .ply is written piece by piece", "surface.obj")
    refused(surfrecon.InputError, 'must be binary, got the encoding "ascii"', encoding="ascii")
    refused(surfrecon.ParameterError, "encoding must be", encoding="morse")
    refused(surfrecon.ParameterError, "voxel must be", voxel=-1)
    refused(surfrecon.InputError, "none: the workspace must be a folder that exists", workspace=tmp_path / "none")
    refused(surfrecon.FileError, "there is no folder", "none/surface.ply")
    refused(MemoryError, "24 MB at least, 12 MB for each of 2 threads, 1 MB are given", max_memory=10**6)
    refused(surfrecon.InputError, "max_memory must be >= 0", max_memory=-1)
    with surfrecon.Context(memory_limit=10**7):
        refused(MemoryError, "10 MB are allowed")
    with pytest.raises(TypeError, match="unexpected keyword argument 'measure'"):
        surfrecon.merge_to_file(scans, tmp_path / "surface.ply", measure=True)
    with pytest.raises(surfrecon.InputError, match="give a workspace"):
        surfrecon.merge_to_file(scans, surfrecon.MemoryFolder() / "surface.ply", **OPTIONS)


def test_cancelled_at_any_tick_it_leaves_nothing(scans, workspace, tmp_path):
    path = tmp_path / "surface.ply"
    path.write_text("old")
    ticks = 0
    while True:
        left = ticks

        def tick(*_):
            nonlocal left
            left -= 1
            return left >= 0

        try:
            surfrecon.merge_to_file(scans, path, workspace=workspace, max_memory=LEAST, progress=tick, **OPTIONS)
        except surfrecon.Cancelled:
            assert path.read_text() == "old"
            assert len(list(tmp_path.iterdir())) == 2
            assert not list(workspace.iterdir())
        else:
            break
        ticks += 1
    assert ticks > 2


def test_the_command_line_and_batches(scans, at_once, tmp_path):
    surfrecon.write_scans(tmp_path / "scans.conf", scans)
    (tmp_path / "scratch").mkdir()
    merge = ["merge", "scans.conf", "--voxel", "0.02", "-o"]
    assert run(*merge, "one.ply", cwd=tmp_path).returncode == 0
    done = run(*merge, "other.ply", "--workspace", "scratch", "--max-memory", "512M", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "one.ply").read_bytes() == (tmp_path / "other.ply").read_bytes()
    assert not list((tmp_path / "scratch").iterdir())
    report = json.loads(done.stdout)
    assert report["parameters"] == {"voxel": 0.02, "workspace": "scratch"}
    assert report["report"]["scans"] == len(scans)
    assert report["outputs"][0]["path"] == "other.ply"
    said = run(*merge, "other.ply", "--workspace", "scratch", cwd=tmp_path).stdout
    assert f"other.ply: {sum(at_once[1].faces):,} triangles" in said
    for wrong, text in (
        (["b.glb", "--workspace", "scratch"], "b.glb: only .ply is written piece by piece"),
        (["b.ply", "--workspace", "none"], "none: the workspace must be a folder that exists"),
        (["b.ply", "--workspace", "scratch", "--encoding", "ascii"], 'must be binary, got the encoding "ascii"'),
        (["b.ply", "--workspace", "scratch", "--measure"], "give measure or workspace, not both"),
    ):
        refused = run(*merge, *wrong, cwd=tmp_path)
        assert (refused.returncode, text in refused.stderr) == (2, True), refused.stderr
    few = run(*merge, "b.ply", "--workspace", "scratch", "--max-memory", "1M", cwd=tmp_path)
    assert few.returncode == 1
    assert "1 MB are allowed: allow more, or fewer threads" in few.stderr
    manifest = tmp_path / "jobs.toml"
    manifest.write_text(
        '[[job]]\ncommand = "merge"\ninputs = ["scans.conf"]\noutput = "batch.ply"\n'
        'parameters = {voxel = 0.02, workspace = "scratch"}\n'
    )
    assert run("batch", manifest).returncode == 0
    assert (tmp_path / "batch.ply").read_bytes() == (tmp_path / "one.ply").read_bytes()
    manifest.write_text(manifest.read_text().replace(', workspace = "scratch"', ""))
    assert "up to date" in run("batch", manifest).stderr
    assert not (tmp_path / "b.ply").exists()


def test_the_command_line_tells_of_merging_in_files_where_memory_is_short(tmp_path):
    surfrecon.write_scans(tmp_path / "scans.conf", shapes.torus_scans(pixels=500))
    (tmp_path / "scratch").mkdir()
    hint = "--workspace DIR (workspace) merges in files, into a .ply file, with the cells as they are"
    merge = ["merge", "scans.conf", "--threads", "1", "-o"]
    coarser = run(*merge, "coarser.ply", "--max-memory", "22M", "--json", cwd=tmp_path)
    assert coarser.returncode == 0, coarser.stderr
    told = f"the cells were made coarser, to fit into memory: {hint}"
    assert f"surfrecon: merge: {told}" in coarser.stderr.splitlines()
    assert told in json.loads(coarser.stdout)["notes"]
    refused = run(*merge, "refused.ply", "--max-memory", "22M", "--voxel", "0.0137", cwd=tmp_path)
    assert refused.returncode == 1
    assert "not enough memory: a voxel of 0.0137" in refused.stderr and refused.stderr.rstrip().endswith(f". {hint}.")
    # It does what it promises; and who has memory, or has done so, is told nothing.
    for given in (["--max-memory", "22M", "--workspace", "scratch"], []):
        enough = run(*merge, "whole.ply", *given, "--json", cwd=tmp_path)
        assert enough.returncode == 0 and "--workspace" not in enough.stderr, enough.stderr
        assert json.loads(enough.stdout)["report"]["voxel"] < json.loads(coarser.stdout)["report"]["voxel"]
