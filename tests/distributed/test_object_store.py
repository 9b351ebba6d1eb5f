"""A workspace in an object store: a local server that speaks S3's protocol."""

import json
import os
import tempfile

import fsspec
import pytest
import surfrecon
from command_line import run
from conftest import OPTIONS
from surfrecon import distributed


def test_tasks_hand_over_their_files(bucket, scans, by_one, tmp_path):
    plan = distributed.Plan.make(
        tmp_path / "plan.json", scans, tmp_path / "surface.ply", workspace=bucket, tasks=3, threads=1, **OPTIONS
    )
    files = fsspec.filesystem("s3")
    assert plan.folder.startswith("s3://bucket/merges/surfrecon-merge-")
    with tempfile.TemporaryDirectory() as scratch:
        for stage in plan.stages:
            for number in stage.tasks:
                plan.run(number, scratch=scratch)
                # By another process, too, which has nothing but what is there.
                if stage.name in ("collect", "label"):
                    distributed.Plan.read(plan.path).run(number)
            files.invalidate_cache()
            names = {name.rsplit("/", 1)[-1].split("-")[0] for name in files.ls(plan.folder, detail=False)}
            if stage.name == "build":
                assert names == {"cut", "done", "known", "labels", "tile"}
        assert not [name for name in os.listdir(scratch) if name.startswith("surfrecon-task-")]
        plan.remove()
    assert (tmp_path / "surface.ply").read_bytes() == by_one
    files.invalidate_cache()
    assert not files.exists(plan.folder)
    assert os.listdir(tmp_path) == ["surface.ply"]


def test_what_a_server_refuses_is_told(bucket, scans, tmp_path, monkeypatch):
    given = {"tasks": 1, **OPTIONS}
    plan = distributed.Plan.make(tmp_path / "plan.json", scans, tmp_path / "surface.ply", workspace=bucket, **given)
    with pytest.raises(surfrecon.InputError, match="nowhere: scratch must be a folder that exists"):
        plan.run(0, scratch=tmp_path / "nowhere")
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    fsspec.get_filesystem_class("s3").clear_instance_cache()
    with pytest.raises(surfrecon.FileError, match=plan.folder):
        plan.run(0)


def test_what_is_damaged_there_is_named_as_it_is_called_there(bucket, scans, tmp_path):
    given = {"tasks": 1, **OPTIONS}
    plan = distributed.Plan.make(tmp_path / "plan.json", scans, tmp_path / "surface.ply", workspace=bucket, **given)
    plan.run(0)
    plan.run(1)
    files = fsspec.filesystem("s3")
    files.invalidate_cache()
    segment = next(name for name in files.ls(plan.folder, detail=False) if "/segment-" in name)
    whole = files.cat_file(segment)
    files.pipe_file(segment, bytes(len(whole) - 64) + whole[-64:])
    with pytest.raises(
        surfrecon.FormatError, match=f"{plan.folder}/segment-.*damaged: remove the folder {plan.folder} "
    ):
        plan.run(2)
    plan.remove()


def test_the_command_line_writes_plans_to_urls(scans, by_one, tmp_path):
    url, surface = f"file://{tmp_path}/merge.json", tmp_path / "surface.ply"
    given = ["--voxel", str(OPTIONS["voxel"]), "--tasks", "1", "--workspace", tmp_path, "--surface", surface]
    made = run("plan", scans, "-o", url, "--json", *given)
    assert made.returncode == 0, made.stderr
    assert [output["path"] for output in json.loads(made.stdout)["outputs"]] == [url]
    done = run("task", url)
    assert done.returncode == 0, done.stderr
    # But for the provenance that the header has.
    assert surface.read_bytes().split(b"end_header")[1] == by_one.split(b"end_header")[1]
    # Outputs of other commands are files.
    refused = run("merge", scans, "-o", f"file://{tmp_path}/merged.ply")
    assert refused.returncode == 1 and f"there is no folder file://{tmp_path}" in refused.stderr
