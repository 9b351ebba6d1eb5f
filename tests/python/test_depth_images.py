"""Depth images of a plain folder, opened with a camera: damaged ones, ones of another size, ones without a camera."""

import json

import numpy as np
import pytest
import surfrecon
from command_line import run
from images import png

CAMERA = (60, 60, 25, 20)
TOLD = ("--camera", ",".join(map(str, CAMERA)))


def depths(number):
    """A corner with a wave on it, seen from ever further away, in millimetres."""
    row, col = np.mgrid[0:40, 0:50]
    return 2000 + 20 * number + 10 * np.abs(col - 25) + 4 * row + 30 * np.sin(col * row / 50)


@pytest.fixture
def folder(tmp_path):
    for number in range(4):
        (tmp_path / f"depth_{number:04}.png").write_bytes(png(depths(number).astype(np.uint16)))
    return tmp_path


def test_a_damaged_image_is_skipped_and_named(folder, tmp_path_factory):
    """As in a recording: in the report, in the log once, and on the command line."""
    damaged = folder / "depth_0001.png"
    whole = damaged.read_bytes()
    for content in (b"", whole[:60], whole[:-30], b"garbage" * 20):
        damaged.write_bytes(content)
        scans = surfrecon.open(folder, camera=CAMERA)
        report = surfrecon.align(scans, fixed=[0, 2, 3]).report
        assert [scan.state for scan in report.scans] == ["kept", "unplaced", "kept", "kept"]
        assert report.scans[1].reason.startswith("it is skipped: ") and "depth_0001.png" in report.scans[1].reason
        [(kind, text)] = [one for one in surfrecon.merge(scans).report.warnings if one[0] == "damaged"]
        assert kind == "damaged" and "depth_0001 is skipped: " in text
        with pytest.raises(surfrecon.FormatError, match="depth_0001"):
            scans[1].read()
    done = run("align", folder, *TOLD, "--fixed", "0,2,3")
    assert done.returncode == 0 and done.stderr.count("depth_0001 is skipped: ") == 1, done.stderr
    assert "depth_0001: not placed: it is skipped: " in done.stdout
    done = run("merge", folder, *TOLD, "-o", tmp_path_factory.mktemp("out") / "out.ply")
    assert done.returncode == 0 and done.stderr.count("depth_0001 is skipped: ") == 1, done.stderr


def test_commands_that_read_images_one_by_one_skip_a_damaged_one(folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    (folder / "depth_0001.png").write_bytes(b"garbage" * 20)
    done = run("info", folder, *TOLD)
    assert done.returncode == 0 and done.stderr.count("depth_0001 is skipped: ") == 1, done.stderr
    assert [line.split(":")[0] for line in done.stdout.splitlines()] == ["depth_0000", "depth_0002", "depth_0003"]
    done = run("convert", folder, *TOLD, "-o", out / "all.e57")
    assert done.returncode == 0 and done.stderr.count("depth_0001 is skipped: ") == 1, done.stderr
    assert len(surfrecon.open(out / "all.e57")) == 3
    done = run("merge", folder, *TOLD, "-o", out / "out.ply")
    assert done.returncode == 0 and "3 of 4 scans, cells of" in done.stdout, done.stdout
    for path in folder.glob("*.png"):
        path.write_bytes(b"garbage" * 20)
    for arguments in (["info"], ["convert", "-o", out / "none.e57"], ["align", "-o", out / "none.tum"]):
        done = run(arguments[0], folder, *TOLD, *arguments[1:])
        assert done.returncode == 1 and "depth_0000" in done.stderr, done.stderr
    assert not (out / "none.tum").exists() and not (out / "none.e57").exists()
    assert 'none of the 4 scans has a surface: "depth_0000" is skipped: ' in done.stderr


@pytest.mark.parametrize("odd", [0, 2])
def test_an_image_of_another_size_is_skipped_and_named(folder, odd):
    """Most images say the size of the camera's, if the camera does not. A camera's file of another size is refused."""
    name = f"depth_{odd:04}"
    (folder / f"{name}.png").write_bytes(png(depths(odd)[:20].astype(np.uint16)))
    files = sorted(folder.glob("*.png"))
    for given in (files, files[::-1]):
        scans = surfrecon.open(given, camera=CAMERA)
        fixed = [k for k, scan in enumerate(scans) if scan.name != name]
        report = surfrecon.align(scans, fixed=fixed).report
        [reason] = [scan.reason for scan in report.scans if scan.state == "unplaced"]
        assert "50 x 20 pixels, but the camera's images have 50 x 40: open it apart" in reason
    # By itself it says the size.
    assert surfrecon.open(folder / f"{name}.png", camera=CAMERA)[0].read().valid.shape == (20, 50)
    camera = dict(zip(("fx", "fy", "cx", "cy"), CAMERA, strict=True))
    (folder / "camera.json").write_text(json.dumps(camera | {"width": 640, "height": 480}))
    said = r"camera\.json: .* images of 640 x 480 pixels, but 3 of 4 depth images have 50 x 40\. Write the camera of"
    with pytest.raises(surfrecon.FormatError, match=said):
        surfrecon.open(folder)


def test_what_lies_beside_the_images_is_passed_over_and_named(folder):
    """Pictures, masks and texts. A list of poses is none of them."""
    for name, pixels in (("rgb_0000", np.zeros((40, 50, 3))), ("mask", np.ones((40, 50)))):
        (folder / f"{name}.png").write_bytes(png(pixels.astype(np.uint8)))
    (folder / "README.txt").write_text("Depth images, scanned in May.\n")
    (folder / "Thumbs.db").write_bytes(b"\xd0\xcf\x11\xe0")
    scans = surfrecon.open(folder, camera=CAMERA)
    assert [scan.name for scan in scans] == [f"depth_{k:04}" for k in range(4)]
    notes = "\n".join(scans.notes)
    assert "1 file of this folder holds neither a scan nor poses, and is passed over: README.txt" in notes
    assert "2 images beside depth images hold colours or numbers of 8 bits, and are passed over: mask.png, " in notes
    (folder / "poses.tum").write_text("".join(f"{k},{k},0,0,0,0,0,1\n" for k in range(4)))
    placed = surfrecon.open(folder, camera=CAMERA)
    assert [scan.world_from_sensor[0, 3] for scan in placed] == [0, 1, 2, 3]


def test_images_without_a_camera_are_not_aligned(folder, tmp_path):
    """Of 16 bits they may be depths or heights. The distance of pixels says that they are heights."""
    scans = surfrecon.open(folder)
    with pytest.raises(surfrecon.InputError, match="4 images of 16 bits may be depth images or height maps"):
        surfrecon.align(scans)
    done = run("align", folder, "-o", "placed.tum", cwd=tmp_path)
    assert done.returncode == 1 and not (tmp_path / "placed.tum").exists()
    assert "give it as --camera fx,fy,cx,cy. Or put a camera.json" in done.stderr
    assert "give the distance of their pixels as --step" in done.stderr and "camera = (" not in done.stderr
    heights = surfrecon.open(folder, step=10)
    assert surfrecon.align(heights, fixed=range(4)).report.placed == 4
    surfrecon.merge(scans[:1])


def test_scans_of_a_few_samples_say_so(folder):
    """Whatever their size: they are not in another unit."""
    whole = [scan.read() for scan in surfrecon.open(folder, camera=CAMERA)][:2]
    for shape, said in (((0, 0), "no surface"), ((1, 1), "no surface"), ((2, 2), "too little surface: ")):
        few = surfrecon.RangeImage.pinhole(np.full(shape, 2.0), focal=(60, 60), centre=(25, 20), name="few")
        assert said in surfrecon.align([*whole, few], fixed=[0, 1]).report.scans[2].reason


def test_what_is_no_scan_is_named_by_its_type(folder):
    with pytest.raises(TypeError, match=r"got str: open files with surfrecon\.open\(\)"):
        surfrecon.align(str(folder))
    with pytest.raises(TypeError, match=r"scan 0 must be a Scan, RangeImage, PointCloud, Mesh, .*, got int$"):
        surfrecon.align([3, 4])


def balls(turn):
    """A room of 4 x 3 x 2.4 m with balls in it, seen from its middle, in millimetres."""
    row, col = np.mgrid[0:80, 0:100]
    x, y, z = (col - 49.5) / 80, (row - 39.5) / 80, np.ones((80, 100))
    rays = np.stack([x * np.cos(turn) + np.sin(turn), y, np.cos(turn) - x * np.sin(turn)], -1)
    depth = np.min(np.array([2.0, 1.2, 1.5]) / np.maximum(np.abs(rays), 1e-9), -1)
    chance = np.random.default_rng(3)
    for _ in range(40):
        around, height, radius = chance.uniform([0, -0.9, 0.1], [2 * np.pi, 0.9, 0.3])
        middle = np.array([1.3 * np.cos(around), height, np.sin(around)])
        squared, along = (rays * rays).sum(-1), rays @ middle
        under = along**2 - squared * (middle @ middle - radius**2)
        hit = np.where(under > 0, (along - np.sqrt(np.maximum(under, 0))) / squared, np.inf)
        depth = np.minimum(depth, np.where(hit > 0, hit, np.inf))
    return np.round(1000 * depth * z).astype(np.uint16)


def test_what_gives_the_order_is_said(folder):
    followed = "followed as a sequence, in the order of their recording or of the numbers in their names"
    unused = "the order of the frames is not used: "
    scans = surfrecon.open(folder, camera=CAMERA)
    # Those that are fixed are not compared with each other.
    assert "the order" not in str(surfrecon.align(scans, fixed=range(4)).report.summary)
    camera = (80, 80, 49.5, 39.5)
    for step, said, other in ((0.15, followed, unused), (2.0, unused, followed)):
        for number in range(4):
            (folder / f"depth_{number:04}.png").write_bytes(png(balls(step * number)))
        scans = surfrecon.open(folder, camera=camera)
        report = surfrecon.align(scans).report
        assert said in report.summary[1] and said in report.messages[0]
        assert other not in str(report.summary)
        for start in ("unknown", "sequence"):
            summary = str(surfrecon.align(scans, start=start).report.summary)
            assert followed not in summary and unused not in summary
    (folder / "depth_0003.png").rename(folder / "other_0002.png")
    scans = surfrecon.open(folder, camera=camera)
    report = surfrecon.align(scans).report
    assert "the order of the frames" not in str(report.summary) and followed not in str(report.summary)
    assert any('"depth_0002" and "other_0002" have the same number' in text for text in report.messages)
    assert not any("the same number" in text for text in surfrecon.align(scans, start="sequence").report.messages)
