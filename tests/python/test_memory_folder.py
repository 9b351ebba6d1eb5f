"""Files that never see a disk: folders in memory, file objects, functions; with the bytes that files have."""

import gc
import gzip
import io
import os
import subprocess
import sys
import threading
import zipfile
from pathlib import Path

import numpy as np
import pytest
import shapes
import surfrecon

IMAGES = ["a", "b"]


def image(name="a"):
    points = np.dstack([*np.meshgrid(np.arange(12.0), np.arange(9.0)), np.zeros((9, 12))])
    points[2, 3] = np.nan
    return surfrecon.RangeImage.from_points(points, viewing=("from", (5, 5, 9)), name=name)


def mesh():
    return shapes.torus(8)


def cloud():
    folder = surfrecon.MemoryFolder()
    folder["points.xyz"] = b"".join(b"%g %g %g\n" % tuple(point) for point in mesh().positions)
    return surfrecon.read(folder / "points.xyz")


WRITERS = {
    "mesh.ply": lambda place: mesh().write(place),
    "mesh.glb": lambda place: mesh().write(place),
    "mesh.obj": lambda place: mesh().write(place),
    "mesh.stl": lambda place: mesh().write(place),
    "points.ply": lambda place: surfrecon.write(place, cloud()),
    "grid.ply": lambda place: image().write(place),
    "scan.ptx": lambda place: image().write(place),
    "scan.e57": lambda place: surfrecon.write(place, image()),
    "list.conf": lambda place: surfrecon.write_scans(place, [image(name) for name in IMAGES]),
    "quads.ply": lambda place: surfrecon.adaptive_quads(image(), rows=4, columns=4).write(place),
    "quads.obj": lambda place: surfrecon.adaptive_quads(image(), rows=4, columns=4).write(place),
}


def on_disk(folder, name):
    """The files that the writer leaves on a disk."""
    WRITERS[name](folder / name)
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.mark.parametrize("name", WRITERS)
def test_what_is_written_to_memory_is_what_files_hold(tmp_path, name):
    files = on_disk(tmp_path, name)
    folder = surfrecon.MemoryFolder()
    WRITERS[name](folder / name)
    assert dict(folder) == files and len(folder) == len(files)

    pieces, complete = {}, []

    def sink(of, piece):
        assert of not in complete
        if piece is None:
            complete.append(of)
        else:
            pieces[of] = pieces.get(of, b"") + piece

    WRITERS[name](surfrecon.MemoryFolder(sink) / name)
    assert pieces == files and sorted(complete) == sorted(files)

    buffer = io.BytesIO()
    buffer.name = f"a folder/{name}"
    if name == "list.conf":
        with pytest.raises(ValueError, match=r"one file object can't hold: use a surfrecon.MemoryFolder"):
            WRITERS[name](buffer)
    else:
        WRITERS[name](buffer)
        assert buffer.getvalue() == files[name]


@pytest.mark.parametrize("name", [name for name in WRITERS if not name.startswith("quads")])
def test_what_lies_in_memory_is_read_as_files_are(tmp_path, name):
    files = on_disk(tmp_path, name)
    expected = [repr(scan.read()) for scan in surfrecon.open(tmp_path / name)]
    folder, lazy = surfrecon.MemoryFolder(), surfrecon.MemoryFolder()
    for key, content in files.items():
        folder[key] = content
        lazy.put_source(key, len(content), lambda at, count, content=content: content[at : at + min(count, 501)])
    for place in folder / name, folder, lazy / name, lazy:
        assert [repr(scan.read()) for scan in surfrecon.open(place)] == expected
    assert dict(lazy) == files
    if len(files) == 1:
        for content in bytes, bytearray, memoryview, io.BytesIO:
            folder[name] = content(files[name])
            assert folder[name] == files[name]
        with open(tmp_path / name, "rb") as file:
            assert [repr(scan.read()) for scan in surfrecon.open(file)] == expected


def test_members_of_archives_are_files(tmp_path):
    mesh().write(tmp_path / "mesh.ply")
    with zipfile.ZipFile(tmp_path / "all.zip", "w") as archive:
        archive.write(tmp_path / "mesh.ply", "deep/mesh.ply")
        with archive.open("written.glb", "w") as member:
            member.name = "written.glb"
            mesh().write(member)
    with zipfile.ZipFile(tmp_path / "all.zip") as archive, archive.open("deep/mesh.ply") as member:
        assert np.array_equal(surfrecon.read(member).triangles, mesh().triangles)
        mesh().write(tmp_path / "written.glb")
        assert archive.read("written.glb") == (tmp_path / "written.glb").read_bytes()
    with gzip.open(tmp_path / "mesh.ply.gz", "wb") as packed:
        packed.write((tmp_path / "mesh.ply").read_bytes())
    with gzip.open(tmp_path / "mesh.ply.gz") as packed:
        assert np.array_equal(surfrecon.read(packed).positions, surfrecon.read(tmp_path / "mesh.ply").positions)
    # One of several files that open together.
    first, second = io.BytesIO((tmp_path / "mesh.ply").read_bytes()), tmp_path / "mesh.ply"
    first.name = "first.ply"
    assert [scan.name for scan in surfrecon.open([first, second])] == ["first", "mesh"]


def test_scans_keep_their_folder():
    folder = surfrecon.MemoryFolder()
    mesh().write(folder / "mesh.ply")
    path = os.fspath(folder / "mesh.ply")
    scan = surfrecon.open(path)[0]
    del folder
    assert len(scan.read().triangles) == len(mesh().triangles)
    del scan
    with pytest.raises(surfrecon.FileError, match=r"mesh\.ply: this folder in memory has gone"):
        surfrecon.open(path)


def test_scans_in_memory_are_merged_like_files(tmp_path):
    images = shapes.torus_scans(40)
    surfrecon.write_scans(tmp_path / "set.conf", images)
    folder = surfrecon.MemoryFolder()
    surfrecon.write_scans(folder / "set.conf", images)
    merged = [surfrecon.merge(surfrecon.open(place)).mesh for place in (tmp_path / "set.conf", folder)]
    assert len(merged[0].triangles) > 100
    assert merged[0].positions.tobytes() == merged[1].positions.tobytes()
    # Alignments say where files lie, in memory too.
    aligned = surfrecon.align(surfrecon.open(folder), fixed=[0])
    aligned.write(folder / "again.mlp")
    assert len(surfrecon.open(folder / "again.mlp")) == len(aligned.scans)


class Broken(io.RawIOBase):
    """A file whose k-th write fails, and which takes few bytes each time."""

    name = "broken.ply"

    def __init__(self, good):
        self.good, self.taken = good, b""

    def writable(self):
        return True

    def write(self, data):
        if self.good == 0:
            raise BrokenPipeError(32, "nobody listens")
        self.good -= 1
        some = bytes(data[:400])
        self.taken += some
        return len(some)


def test_what_functions_raise_comes_out(tmp_path):
    mesh().write(tmp_path / "mesh.ply")
    whole = (tmp_path / "mesh.ply").read_bytes()
    for good in range(100):
        file = Broken(good)
        try:
            mesh().write(file)
        except BrokenPipeError as error:
            assert error.errno == 32 and file.taken == whole[: len(file.taken)]  # noqa: PT017
        else:
            assert file.taken == whole and good > 3
            break
    else:
        pytest.fail("it never ends")

    folder = surfrecon.MemoryFolder()

    def fails(at, count):
        raise LookupError(f"{at} is not here")

    folder.put_source("a.ply", 1000, fails)
    with pytest.raises(LookupError, match="0 is not here"):
        surfrecon.open(folder / "a.ply")
    for wrong, error, words in [
        (lambda at, count: b"", ValueError, "must give 1 to"),
        (lambda at, count: b"x" * (count + 1), ValueError, "must give 1 to"),
        (lambda at, count: "text", TypeError, "must be bytes"),
    ]:
        folder.put_source("a.ply", 1000, wrong)
        with pytest.raises(error, match=words):
            surfrecon.open(folder / "a.ply")


@pytest.mark.parametrize("name", ["", ".", "..", "../a", "/a", "a/", "a\\b", "a//b", "a\0b"])
def test_names_are_those_of_files_within(name):
    folder = surfrecon.MemoryFolder()
    with pytest.raises(surfrecon.InputError, match="a file in memory is called like one on a disk"):
        folder / name
    with pytest.raises(surfrecon.InputError):
        folder[name] = b""
    assert name not in folder and len(folder) == 0


def test_a_folder_is_like_a_dictionary():
    folder = surfrecon.MemoryFolder()
    folder["b/1.xyz"] = b"0 0 0\n"
    folder["a.xyz"] = b"1 1 1\n"
    assert list(folder) == folder.keys() == ["a.xyz", "b/1.xyz"] and "b/1.xyz" in folder and 3 not in folder
    assert os.fspath(folder) in repr(folder) and Path(folder / "b/1.xyz").parent == Path(folder) / "b"
    assert surfrecon.read(Path(folder) / "b" / "1.xyz").positions.tolist() == [[0, 0, 0]]
    del folder["a.xyz"]
    for key in "a.xyz", "b":
        with pytest.raises(KeyError):
            folder[key]
        with pytest.raises(KeyError):
            del folder[key]
    # A file object is no list of files, and what it reads is known by its content.
    nameless = io.BytesIO(b"0 0 0\n")
    with pytest.raises(ValueError, match=r"has no name that says the format: give it one, file.name ="):
        surfrecon.open(nameless)
    with pytest.raises(ValueError, match=r"has no name that says the format"):
        mesh().write(io.BytesIO())
    for wrong in 3, None, object():
        with pytest.raises(
            TypeError, match="paths must be a path, a binary file object, or a list or another iterable of these, got"
        ):
            surfrecon.open(wrong)
        with pytest.raises(TypeError, match="path must be a path or a binary file object, got"):
            mesh().write(wrong)
        with pytest.raises(TypeError, match="a file must be bytes or a binary file object"):
            folder["x.ply"] = wrong
        with pytest.raises(TypeError):
            folder.put_source("x.ply", 3, wrong)
    for wrong in 3, "text":
        with pytest.raises(TypeError, match="must be callable"):
            surfrecon.MemoryFolder(wrong)
    text = io.StringIO()
    text.name = "mesh.ply"
    with pytest.raises(TypeError, match="a bytes-like object|string argument expected|str"):
        mesh().write(text)
    with pytest.raises(surfrecon.InputError, match="the name must end in"):
        mesh().write(folder / "mesh.txt")
    assert list(folder) == ["b/1.xyz"]


def test_threads_write_into_one_folder():
    folder = surfrecon.MemoryFolder()
    shape = mesh()

    def work(number):
        for turn in range(10):
            shape.write(folder / f"{number}/{turn}.ply")
            surfrecon.read(folder / f"{number}/{turn}.ply")

    threads = [threading.Thread(target=work, args=(number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(folder) == 60 and len(set(dict(folder).values())) == 1


def test_a_cancelled_writer_leaves_nothing_in_memory():
    folder = surfrecon.MemoryFolder()
    with pytest.raises(surfrecon.Cancelled):
        mesh().write(folder / "mesh.ply", progress=lambda stage, share: False)
    assert not list(folder)


ENDS = {
    "a job that reads": """
job = surfrecon.Job.read(surfrecon.open(folder))
""",
    "a thread that writes to a function": """
threading.Thread(target=lambda: mesh.write(surfrecon.MemoryFolder(slow_sink) / "a.stl"), daemon=True).start()
""",
    "a thread that writes to a file object": """
class Slow(io.BytesIO):
    name = "a.stl"
    def write(self, data):
        time.sleep(0.02)
        return super().write(data)
threading.Thread(target=lambda: mesh.write(Slow()), daemon=True).start()
""",
}


@pytest.mark.parametrize("what", ENDS)
def test_python_may_end_while_its_functions_are_called(tmp_path, what):
    shapes.torus(40).write(tmp_path / "mesh.stl")
    program = f"""
import io, threading, time, surfrecon
mesh = surfrecon.read({str(tmp_path / "mesh.stl")!r})
content = open({str(tmp_path / "mesh.stl")!r}, "rb").read()
folder = surfrecon.MemoryFolder()
def slow(at, count):
    time.sleep(0.01)
    return content[at : at + min(count, 8192)]
def slow_sink(name, piece):
    time.sleep(0.02)
folder.put_source("mesh.stl", len(content), slow)
{ENDS[what]}
time.sleep(0.05)
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 0 and "Fatal" not in ended.stderr, ended.stderr


class Raw(io.RawIOBase):
    name = "mesh.ply"

    def __init__(self, answer):
        self.answer = answer

    def writable(self):
        return True

    def write(self, data):
        return self.answer(len(data))


def test_file_objects_that_take_less_than_they_should_are_told():
    with pytest.raises(BlockingIOError, match=r"takes no bytes now"):
        mesh().write(Raw(lambda count: None))
    for wrong in (
        (lambda count: 0),
        (lambda count: -1),
        (lambda count: count + 1),
        (lambda count: 0.5),
        (lambda count: "x"),
    ):
        with pytest.raises(ValueError, match=r"write\(\) took .* of \d+ bytes"):
            mesh().write(Raw(wrong))

    class Silent:
        name = b"mesh.ply"
        taken = b""

        def write(self, data):
            self.taken += data

    silent, folder = Silent(), surfrecon.MemoryFolder()
    mesh().write(silent)
    mesh().write(folder / "mesh.ply")
    assert silent.taken == folder["mesh.ply"]


def test_whatever_opens_a_folder_keeps_it():
    for opened in (lambda folder: folder / "mesh.ply"), (lambda folder: folder):
        folder = surfrecon.MemoryFolder()
        mesh().write(folder / "mesh.ply")
        job = surfrecon.Job.open(opened(folder))
        del folder
        gc.collect()
        assert len(job.result()) == 1


def test_lists_of_poses_name_no_files_that_they_can_not_find(tmp_path):
    folder = surfrecon.MemoryFolder()
    surfrecon.write_scans(folder / "set.conf", shapes.torus_scans(40))
    aligned = surfrecon.align(surfrecon.open(folder), fixed=[0])
    for place in tmp_path / "o.conf", surfrecon.MemoryFolder() / "o.mlp", folder / "deep/o.aln":
        with pytest.raises(surfrecon.InputError, match="lies in memory, where only a list in its own folder finds it"):
            aligned.write(place)
    assert not list(tmp_path.iterdir())
    aligned.write(tmp_path / "poses.tum")


def test_folders_and_files_do_not_share_names():
    folder = surfrecon.MemoryFolder()
    folder["a/b.xyz"] = b"0 0 0\n"
    with pytest.raises(surfrecon.InputError, match="this is a folder"):
        folder["a"] = b""
    with pytest.raises(surfrecon.InputError, match=r"a/b\.xyz is a file, but must be a folder"):
        mesh().write(folder / "a/b.xyz/mesh.ply")
    assert folder.get("a") is None and folder.get("a", 3) == 3 and folder.get("a/b.xyz") == b"0 0 0\n"
    assert folder.items() == [("a/b.xyz", b"0 0 0\n")] and folder.values() == [b"0 0 0\n"]
    with pytest.raises(UnicodeEncodeError):
        folder / "\ud800"


@pytest.mark.parametrize("name", ["a.ply", "a.glb", "a.obj", "a.stl"])
def test_what_has_failed_is_not_written_to_again(name):
    for good in (0, 1):
        calls = []

        def sink(of, piece, calls=calls, good=good):
            calls.append(of)
            if len(calls) > good:
                raise ValueError("full")

        with pytest.raises(ValueError, match="full"):
            mesh().write(surfrecon.MemoryFolder(sink) / name)
        assert len(calls) == good + 1
