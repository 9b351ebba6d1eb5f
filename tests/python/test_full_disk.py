"""Disks that are full: the place and the bytes are named, and once there is room the merge goes on."""

import os
import re
import subprocess
import sys

import pytest
import shapes
import surfrecon
from surfrecon import distributed

OPTIONS = {"voxel": 0.02, "threads": 2}
# The least that two threads do with: blocks of two bricks.
LEAST = 24_000_000
BYTES = r"\d+ [kMG]B"
# The error of a write that found no room, and the one before any write.
NO_ROOM = re.compile(
    f"(the disk is full after {BYTES} of this file|the disk has no room for the {BYTES} of this file"
    f"|which take {BYTES} to {BYTES}, but {BYTES} are free): free some"
)

pytestmark = pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0, reason="only root mounts file systems")


@pytest.fixture(scope="module")
def listed(tmp_path_factory):
    """A list of scans in files."""
    return shapes.torus_files(tmp_path_factory)


@pytest.fixture(scope="module")
def expected(listed, tmp_path_factory):
    """The bytes of the surface, and how many triangles it has."""
    path = tmp_path_factory.mktemp("expected") / "surface.ply"
    report = surfrecon.merge_to_file(surfrecon.open(listed), path, **OPTIONS)
    return path.read_bytes(), sum(report.faces)


class Small:
    """A file system whose size is set; where it is, is ``folder``."""

    def __init__(self, folder):
        self.folder = folder
        folder.mkdir()
        self.has_right = self._mount("size=64k")

    def _mount(self, options):
        command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", self.folder]
        return subprocess.run(command, capture_output=True).returncode == 0

    def resize(self, kilobytes):
        """Of a size of 0 there is no limit."""
        assert self._mount(f"remount,size={max(kilobytes, 4)}k")

    def used(self):
        """Kilobytes that are taken."""
        found = os.statvfs(self.folder)
        return (found.f_blocks - found.f_bfree) * found.f_frsize // 1024

    def names(self):
        """All files and folders, below it."""
        return sorted(str(path.relative_to(self.folder)) for path in self.folder.rglob("*"))


@pytest.fixture
def small(tmp_path):
    small = Small(tmp_path / "small")
    if not small.has_right:
        pytest.skip("mount refuses: a container without that right")
    yield small
    subprocess.run(["umount", small.folder], check=True)


def check_told(problem, small):
    """The place and the bytes are named."""
    assert str(small.folder) in str(problem) and NO_ROOM.search(str(problem)), problem


def test_before_the_work_it_is_told_what_a_merge_takes(listed, small, tmp_path):
    small.resize(1000)
    beside = tmp_path / "beside"
    beside.mkdir()
    given = {"voxel": 0.01, "threads": 2}
    for workspace, text in (
        (
            None,
            rf"which take {BYTES} to {BYTES}, but 1 MB are free: free some, choose another workspace, or larger cells",
        ),
        (beside, rf"surface\.ply: the disk has no room for the {BYTES} of this file: free some, or choose another"),
    ):
        with pytest.raises(surfrecon.FileError, match=text) as raised:
            path = small.folder / "surface.ply"
            surfrecon.merge_to_file(surfrecon.open(listed), path, workspace=workspace, **given)
        check_told(raised.value, small)
        assert small.names() == [] and not list(beside.iterdir())


@pytest.mark.thorough
@pytest.mark.parametrize("keep", [False, True])
def test_a_merge_that_finds_no_room_at_any_write_loses_nothing(listed, expected, small, tmp_path, keep):
    path, size, full = tmp_path / "surface.ply", 64, 0
    given = {"max_memory": LEAST, "workspace": small.folder, "keep": keep, **OPTIONS}
    while True:
        small.resize(size)
        try:
            surfrecon.merge_to_file(surfrecon.open(listed), path, **given)
            break
        except surfrecon.FileError as problem:
            full += 1
            check_told(problem, small)
            assert not path.exists()
            assert "unfinished-" not in " ".join(small.names())
            assert keep or not small.names()
        size = size * 9 // 8 + 4
    assert full > 10
    assert path.read_bytes() == expected[0]


@pytest.mark.thorough
@pytest.mark.parametrize("keep", [False, True])
def test_a_task_that_finds_no_room_leaves_nothing_and_is_done_once_there_is(listed, expected, small, tmp_path, keep):
    path, full = tmp_path / "surface.ply", set()
    given = {"workspace": small.folder, "tasks": 3, "keep": keep, "max_memory": LEAST, **OPTIONS}
    plan = distributed.Plan.make(tmp_path / "plan.json", listed, path, **given)
    for stage in plan.stages:
        for number in stage.tasks:
            for spare in (0, 4, 64, 256):
                small.resize(small.used() + spare)
                before = {name for name in small.names() if "/done-" in name}
                try:
                    plan.run(number)
                    break
                except surfrecon.FileError as problem:
                    full.add(stage.name)
                    check_told(problem, small)
                after = small.names()
                assert "unfinished-" not in " ".join(after)
                assert {name for name in after if "/done-" in name} == before, (stage, number, spare)
            small.resize(1 << 20)
            plan.run(number)
    # A stage that removes what nobody wants any more has room, and the surface lies elsewhere.
    assert full >= {stage.name for stage in plan.stages} - {"colours", "write"}
    assert keep <= ("colours" in full)
    assert path.read_bytes() == expected[0]


@pytest.mark.thorough
@pytest.mark.parametrize("parts", [1, 3])
@pytest.mark.parametrize("keep", [False, True])
def test_a_surface_that_finds_no_room_is_written_once_there_is(listed, expected, small, tmp_path, keep, parts):
    content, triangles = expected
    given = {"tasks": 2, "keep": keep, "max_memory": LEAST, **OPTIONS}
    given |= {"workspace": tmp_path, "part_triangles": triangles // parts + 1 if parts > 1 else 0}
    plan = distributed.Plan.make(tmp_path / "plan.json", listed, small.folder / "surface.ply", **given)
    *before, last = (number for stage in plan.stages for number in stage.tasks)
    for number in before:
        plan.run(number)
    marks = {name for name in os.listdir(plan.folder) if name.startswith("done-")}
    # Of parts the room for the whole is taken first, and then theirs beside it.
    sizes = [share * len(content) // 1024 for share in (0.0, 0.5, 0.99, 1.1, 1.5, 1.9)]
    for size in sizes if parts > 1 else sizes[:3]:
        small.resize(int(size))
        with pytest.raises(surfrecon.FileError) as raised:
            plan.run(last)
        check_told(raised.value, small)
        assert small.names() == []
        assert {name for name in os.listdir(plan.folder) if name.startswith("done-")} == marks
    small.resize(1 << 20)
    plan.run(last)
    assert len(small.names()) == parts
    if parts == 1:
        assert (small.folder / "surface.ply").read_bytes() == content
