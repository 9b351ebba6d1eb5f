"""The provenance in results of the command line and of the library."""

import hashlib
import json

import numpy as np
import pytest
import surfrecon
from command_line import data, run
from shapes import torus


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return data(tmp_path_factory.mktemp("data"))


def said_in(path):
    """The provenance of a file."""
    content = path.read_bytes()
    if path.suffix == ".glb":
        length = int.from_bytes(content[12:16], "little")
        return json.loads(content[20 : 20 + length])["asset"]["extras"]["surfrecon"]
    header = content[: content.index(b"end_header")].decode("ascii")
    whole = {}
    text = header.replace("\ncomment surfrecon + ", "")
    for line in text.splitlines():
        if line.startswith("comment surfrecon "):
            for key, value in json.loads(line.removeprefix("comment surfrecon ")).items():
                if isinstance(value, list):
                    whole[key] = whole.get(key, []) + value
                elif isinstance(value, dict):
                    whole[key] = whole.get(key, {}) | value
                else:
                    whole[key] = value
    return whole


def hash_of(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("ending", ["ply", "glb"])
def test_results_say_what_made_them(folder, tmp_path, ending):
    out = tmp_path / f"a.{ending}"
    assert run("merge", folder / "ring.conf", "-o", out, "--voxel", "0.1", "--threads", "1").returncode == 0
    said = said_in(out)
    assert {name: said[name] for name in ("program", "version", "command", "parameters")} == {
        "program": "surfrecon",
        "version": surfrecon.__version__,
        "command": "merge",
        "parameters": {"voxel": 0.1},
    }
    assert said["inputs"] == [
        {"name": path.name, "sha256": hash_of(path)}
        for path in sorted(folder.glob("*.*"))
        if path.stem[:4] in ("ring", "scan")
    ]
    # The same bytes from another folder, for another number of threads; and the same surface.
    moved = tmp_path / "moved"
    moved.mkdir()
    for path in folder.iterdir():
        (moved / path.name).write_bytes(path.read_bytes())
    again = tmp_path / f"b.{ending}"
    run("merge", "ring.conf", "-o", again, "--voxel", "0.1", "--threads", "2", cwd=moved)
    if ending == "ply":
        assert out.read_bytes() == again.read_bytes()
    plain = tmp_path / f"c.{ending}"
    run("merge", folder / "ring.conf", "-o", plain, "--voxel", "0.1", "--no-provenance")
    assert b"sha256" not in plain.read_bytes()
    assert np.array_equal(surfrecon.read(out).positions, surfrecon.read(plain).positions)


def test_quads_and_points_say_it_too(folder, tmp_path):
    run("quads", folder / "ring.conf", "--scan", "8", "-o", tmp_path / "q.ply")
    assert said_in(tmp_path / "q.ply")["parameters"] == {"scan": "8"}
    run("convert", folder / "points.xyz", "-o", tmp_path / "p.ply")
    assert said_in(tmp_path / "p.ply")["inputs"] == [{"name": "points.xyz", "sha256": hash_of(folder / "points.xyz")}]


def test_of_many_files_a_result_has_one_hash(tmp_path):
    names = [f"{k:03}.xyz" for k in range(101)]
    for k, name in enumerate(names):
        (tmp_path / name).write_text(f"0 0 {k}\n1 0 {k}\n0 1 {k}\n")
    done = run("convert", *names, "--scan", "7", "-o", "out.ply", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = "".join(f"{hash_of(tmp_path / name)}  {name}\n" for name in names)
    said = said_in(tmp_path / "out.ply")
    assert (said["inputs"], said["sha256_of_inputs"]) == (101, hashlib.sha256(lines.encode()).hexdigest())


def test_the_library_writes_what_it_is_told(tmp_path):
    mesh = torus(10)
    told = {"by": "a test", "of": ["\n", "ä" * 2000], "numbers": {"one": 1, "third": 1 / 3}}
    for name in ("a.ply", "a.glb"):
        mesh.write(tmp_path / name, provenance=told)
        assert said_in(tmp_path / name) == told
        assert len(surfrecon.read(tmp_path / name).triangles) == len(mesh.triangles)
    for told in ({}, {"crs": "EPSG:4326", "crs_unit": "degree"}, {"a": [], "b": {}, "third": 1 / 3, "most": 2**64 - 1}):
        for name in ("a.ply", "a.glb", "a.obj"):
            mesh.write(tmp_path / name, provenance=told)
            assert surfrecon.provenance(tmp_path / name) == told
            assert surfrecon.open(tmp_path / name).crs is None
    with pytest.raises(surfrecon.InputError, match="would take .* bytes of the file, more than 4194304: leave"):
        mesh.write(tmp_path / "b.ply", provenance={"notes": "ä" * 1_000_000})
    mesh.write(tmp_path / "a.stl", provenance=told)
    with pytest.raises(TypeError):
        mesh.write(tmp_path / "b.ply", provenance={"array": np.eye(2)})
    with pytest.raises(surfrecon.InputError, match="provenance must be a JSON object"):
        mesh.write(tmp_path / "b.ply", provenance=["a"])
    assert not (tmp_path / "b.ply").exists()
