"""Recordings of depth cameras in MeshLab: a layer a frame, of many frames some, spread evenly."""

import json
import shutil

import numpy as np
import pytest
from conftest import IMPORT
from files import write_set
from images import png
from shapes import torus_scans

SIZE = (24, 32)
COUNT = 60


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """In nerfstudio's form: a wavy wall, seen from a place that moves."""
    folder = tmp_path_factory.mktemp("recordings") / "wall"
    (folder / "depths").mkdir(parents=True)
    rows, cols = np.indices(SIZE)
    frames = []
    for k in range(COUNT):
        depths = 1000 + 50 * np.sin(cols * 0.3 + k) + 30 * np.cos(rows * 0.4)
        (folder / "depths" / f"{k:03}.png").write_bytes(png(depths.astype(np.uint16)))
        pose = np.eye(4)
        pose[0, 3] = k / 100
        paths = {"file_path": f"images/{k:03}.png", "depth_file_path": f"depths/{k:03}.png"}
        frames.append(paths | {"transform_matrix": pose.tolist()})
    head = {"fl_x": 30, "fl_y": 30, "cx": 16, "cy": 12, "w": SIZE[1], "h": SIZE[0]}
    (folder / "transforms.json").write_text(json.dumps(head | {"frames": frames}))
    return folder


def labels(document):
    return [layer.label() for layer in document.layers()]


@pytest.mark.parametrize(("options", "expected"), [({}, 50), ({"max_frames": 7}, 7), ({"max_frames": 0}, COUNT)])
def test_frames_are_layers_spread_evenly(document, recording, options, expected):
    out = document.run(IMPORT, file=str(recording / "transforms.json"), **options)
    assert out["layers"] == out["range_images"] == len(document) == expected
    assert labels(document) == [f"{k * COUNT // expected:03}" for k in range(expected)]


def test_a_damaged_frame_is_skipped(document, recording, tmp_path):
    folder = shutil.copytree(recording, tmp_path / "damaged")
    image = bytearray((folder / "depths" / "030.png").read_bytes())
    middle = len(image) // 2
    image[middle : middle + 8] = 8 * b"\xff"
    (folder / "depths" / "030.png").write_bytes(image)
    document.run(IMPORT, file=str(folder / "transforms.json"), max_frames=0)
    assert labels(document) == [f"{k:03}" for k in range(COUNT) if k != 30]


def test_few_frames_are_all_there(document, recording):
    listed = json.loads((recording / "transforms.json").read_text())
    listed["frames"] = listed["frames"][:3]
    (recording / "few.json").write_text(json.dumps(listed))
    document.run(IMPORT, file=str(recording / "few.json"), max_frames=3)
    assert labels(document) == ["000", "001", "002"]


def test_scans_that_are_no_frames_all_become_layers(document, tmp_path):
    out = document.run(IMPORT, file=str(write_set(tmp_path, torus_scans(pixels=20)[:5])), max_frames=2)
    assert out["layers"] == 5


def test_fewer_than_none_are_refused(document, refused, recording):
    said = refused(document.run, IMPORT, file=str(recording / "transforms.json"), max_frames=-1)
    assert "max_frames must be at least 0, got -1" in said
    assert len(document) == 0
