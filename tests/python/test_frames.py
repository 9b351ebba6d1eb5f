"""Recordings of depth cameras and phones: frames read one by one, with colours, that go where other scans go."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import surfrecon
from command_line import run
from images import png
from shapes import torus

SIZE = (48, 64)
FOCAL, CENTRE = (44.0, 44.0), (31.2, 23.9)
TURNED = np.diag([1.0, -1.0, -1.0, 1.0])


def cameras(count=6):
    """Around a ring that lies before them."""
    for k in range(count):
        angle = 2 * np.pi * k / count
        eye = (2.2 * np.cos(angle), 2.2 * np.sin(angle), 1.1)
        pose = surfrecon.Camera.pinhole(*SIZE, height_angle=1, eye=eye, target=(0, 0, 0)).world_from_sensor
        yield surfrecon.Camera.intrinsic(*SIZE, focal=FOCAL, centre=CENTRE, world_from_sensor=pose)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """As 3D Scanner App exports it, each second frame with a colour image of twice the size, all of one colour."""
    folder = tmp_path_factory.mktemp("recordings") / "ring"
    folder.mkdir()
    ring = torus()
    for k, camera in enumerate(cameras()):
        values = surfrecon.virtual_scan(ring, camera).values
        depths = np.nan_to_num(np.round(values * 1000), nan=0).astype(np.uint16)
        levels = np.full(SIZE, 2, np.uint8)
        levels[:, :33] = 0
        (folder / f"depth_{k:05}.png").write_bytes(png(depths))
        (folder / f"conf_{k:05}.png").write_bytes(png(levels))
        if k % 2 == 0:
            (folder / f"frame_{k:05}.jpg").write_bytes(png(np.full((96, 128, 3), (200, 100, 50), np.uint8)))
        matrix = [2 * FOCAL[0], 0, 2 * CENTRE[0] + 0.5, 0, 2 * FOCAL[1], 2 * CENTRE[1] + 0.5, 0, 0, 1]
        pose = (camera.world_from_sensor @ TURNED).ravel().tolist()
        text = json.dumps({"cameraPoseARFrame": pose, "intrinsics": matrix})
        (folder / f"frame_{k:05}.json").write_text(text)
    return folder


def test_frames_have_what_was_recorded(recording):
    frames = surfrecon.open(recording)
    assert len(frames) == 6 and all(isinstance(frame, surfrecon.Frame) for frame in frames)
    assert "6 frames of 3D Scanner App, 3 with colour" in frames.notes[0]
    assert any("poses read as y up, looking along -z" in note for note in frames.notes), frames.notes
    assert any("of low confidence" in note for note in frames.notes), frames.notes
    first, second = frames[0], frames[1]
    assert isinstance(first, surfrecon.Scan) and repr(first).startswith('<Frame "frame_00000" of ')
    assert first.colour.shape == (96, 128, 3) and (first.colour == (200, 100, 50)).all()
    assert second.colour is None and [frame.has_colour for frame in frames] == [True, False] * 3
    assert first.confidence.shape == SIZE and set(np.unique(first.confidence)) == {0, 2}
    assert np.array_equal(first.pose, first.world_from_sensor)
    for frame, camera in zip(frames, cameras(), strict=True):
        assert np.allclose(frame.pose, camera.world_from_sensor, atol=1e-6)


def test_cameras_are_those_of_the_colours(recording):
    first, second = surfrecon.open(recording)[:2]
    large, small = first.camera, second.camera
    assert (large.rows, large.cols, small.rows, small.cols) == (96, 128, *SIZE)
    assert large.projection["focal"] == (88, 88) and small.projection["focal"] == FOCAL
    assert np.allclose(small.projection["centre"], CENTRE) and np.allclose(large.projection["centre"], (62.9, 48.3))
    assert np.allclose(large.world_from_sensor, first.pose)


def test_images_have_what_can_be_trusted(recording):
    frame = surfrecon.open(recording)[0]
    depth, image, out = frame.depth, frame.image, frame.left_out
    assert isinstance(out, surfrecon.LeftOutReport) and out.of == out["of"]
    assert depth.colour is None and depth.valid[:, :33].any()
    assert not image.valid[:, :33].any() and image.valid[:, 33:].sum() == depth.valid[:, 33:].sum()
    assert out["of"] == depth.valid.sum() and out["low_confidence"] == depth.valid[:, :33].sum()
    assert out["out_of_reach"] == out["black_rim"] == 0
    assert (image.colour[image.valid] == (200, 100, 50, 255)).all()
    read = frame.read()
    assert np.array_equal(read.values, image.values, equal_nan=True) and read.name == "frame_00000"


def test_frames_go_where_scans_go(recording):
    frames = surfrecon.open(recording)
    merged = surfrecon.merge(frames, voxel=0.06)
    assert merged.mesh.triangles.shape[0] > 100
    aligned = surfrecon.align(frames, start="rough")
    assert all(isinstance(scan, surfrecon.Frame) for scan in aligned.scans)


def test_frames_of_a_recording_need_no_poses_and_no_order(recording):
    frames = surfrecon.open(recording)
    aligned = surfrecon.align(frames, start="sequence")
    told = [text for text in aligned.report.messages if text.startswith("track was lost between")]
    assert len(aligned.world_from_scan) == len(frames)
    assert told or all(pose is not None for pose in aligned.world_from_scan)
    back = surfrecon.align(frames[::-1], start="sequence")
    for one, other in zip(aligned.world_from_scan, back.world_from_scan[::-1], strict=True):
        assert (one is None and other is None) or np.array_equal(one, other)
    # Images have no number.
    images = [frame.read() for frame in frames]
    assert surfrecon.align(images).report.messages == surfrecon.align(images, start="unknown").report.messages


def test_a_job_opens_what_open_opens(recording):
    job = surfrecon.Job.open(recording)
    frames = job.result()
    assert job.done() and isinstance(frames, surfrecon.ScanSet)
    opened = surfrecon.open(recording)
    assert [frame.name for frame in frames] == [frame.name for frame in opened] and frames.notes == opened.notes
    with pytest.raises(surfrecon.FileError):
        surfrecon.Job.open(recording / "nothing").result()
    with pytest.raises(surfrecon.ParameterError):
        surfrecon.Job.open(recording, scale=-1)
    with pytest.raises(TypeError, match="paths must be"):
        surfrecon.Job.open(3)


def test_one_file_tells_which_recording_it_is_of(recording, tmp_path):
    assert surfrecon.recording_of(recording / "depth_00001.png") == recording
    assert surfrecon.recording_of(recording / "not there.png") == recording
    (tmp_path / "alone.png").write_bytes(b"")
    assert surfrecon.recording_of(tmp_path / "alone.png") is None
    assert surfrecon.recording_of(tmp_path / "no folder" / "alone.png") is None


def test_a_recording_that_lacks_something_says_so(recording, tmp_path):
    (tmp_path / "keyframes" / "images").mkdir(parents=True)
    (tmp_path / "keyframes" / "cameras").mkdir()
    with pytest.raises(surfrecon.FormatError, match="exported as raw data with developer mode on"):
        surfrecon.open(tmp_path)
    for path in recording.iterdir():
        (tmp_path / "cut").mkdir(exist_ok=True)
        content = path.read_bytes()
        (tmp_path / "cut" / path.name).write_bytes(content[:50] if path.suffix == ".jpg" else content)
    frame = surfrecon.open(tmp_path / "cut")[0]
    with pytest.raises(surfrecon.FormatError, match="frame_00000.jpg"):
        frame.colour  # noqa: B018
    assert frame.confidence is not None


def test_cancelling_while_a_frame_is_read(recording):
    frame = surfrecon.open(recording)[0]
    assert frame.read(progress=lambda stage, share: True).rows == SIZE[0]


@pytest.mark.skipif("SURFRECON_DATA" not in os.environ, reason="SURFRECON_DATA is not set")
def test_a_real_phone():
    folder = Path(os.environ["SURFRECON_DATA"]) / "frames" / "scannerapp_chair" / "chair_scan"
    if not folder.is_dir():
        pytest.skip("SURFRECON_DATA has no frames/scannerapp_chair")
    frames = surfrecon.open(folder)
    frame = frames[0]
    assert len(frames) == 24 and frame.colour.shape == (1440, 1920, 3) and frame.confidence.shape == (192, 256)
    assert frame.left_out["low_confidence"] > 0
    image = frame.image
    assert (image.colour[image.valid][:, 3] == 255).mean() > 0.95


@pytest.mark.parametrize("camera", [(44, 44), "narrow", 525, (1, 2, 3, "4")])
def test_a_camera_is_four_numbers(recording, camera):
    with pytest.raises(TypeError, match="camera must be fx, fy, cx, cy in pixels, got "):
        surfrecon.open(recording, camera=camera)


def cut(path):
    path.write_bytes(path.read_bytes()[:-40])


def test_damage_is_said_on_the_command_line(recording, tmp_path):
    """Of files that opening reads, and of others: what reads many frames goes on and says each, in reports as well."""
    folder, listed, report = tmp_path / "ring", tmp_path / "aligned.tum", tmp_path / "report.json"
    shutil.copytree(recording, folder)
    frames = surfrecon.open(folder)
    cut(folder / "conf_00003.png")
    cut(folder / "frame_00004.jpg")
    gone, colourless = "frame_00003 is skipped: ", "frame_00004 is read without colours: "
    for _ in range(2):
        [(kind, text)] = surfrecon.merge(frames, voxel=0.2).report.warnings
        assert kind == "damaged" and text.startswith("2 of 6 scans are damaged: ")
        assert gone in text and colourless in text and "conf_00003.png" in text and "frame_00004.jpg" in text
    reason = surfrecon.align(frames, start="rough").report.scans[3].reason
    assert reason.startswith("it is skipped: ") and "conf_00003.png" in reason

    skipped = "1 of 6 frames are skipped: conf_00003.png is damaged"
    cut(folder / "frame_00002.jpg")
    done = run("merge", folder, "-o", tmp_path / "out.ply", "--voxel", "0.2", "--report", report)
    assert "scans are damaged" not in done.stderr and done.stderr.count("is read without colours") == 2, done.stderr
    assert done.returncode == 0 and done.stderr.count(skipped) == 1 and done.stderr.count(colourless) == 1, done.stderr
    found = json.loads(report.read_text())
    assert [kind for kind, _ in found["report"]["warnings"]] == ["damaged"]
    done = run("align", folder, "-o", listed, "--start", "unknown", "--reach", "0.1")
    assert done.returncode == 0 and done.stderr.count("surfrecon: align: --reach, 0.1, is not used") == 1, done.stderr
    done = run("align", folder, "-o", tmp_path / "aligned.conf")
    assert done.returncode == 2 and "shares its file or its recording" in done.stderr and ".tum" in done.stderr
    done = run("info", folder)
    assert done.returncode == 0 and len(done.stdout.splitlines()) == 3
    assert skipped in done.stderr and "frame_00004 is skipped: " in done.stderr
