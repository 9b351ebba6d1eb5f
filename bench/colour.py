"""Colours of a merge: scans whose exposures differ and that show lamps' reflections, beside the mean of their bytes.

Depth images of a sculpture with a pattern on it whose colours are known; each is exposed otherwise, by up to 30 per
cent, and a lamp shines back where a pixel looks at its reflection. The mean of bytes is taken here, of what each image
shows of each vertex of the merged surface: what this library did before it added light and knew exposures. Nothing
tells how bright all scans together should be: what factor suits a result best is taken off, of both alike. Every run
is a fresh process.
"""

import json
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import measured
import noise_scans
import noise_shapes
import numpy as np
import table

HERE = Path(__file__).resolve().parent
OURS, UNMATCHED, BYTES = "surfrecon", "surfrecon-unmatched", "mean-of-bytes"
COLUMNS = ["case", "tool", "views", "exposure_pct", "glints", "rms_bytes", "worst_percent_bytes", "of_mean_of_bytes"]
COLUMNS += ["gain_error_pct", "cpu_s", "wall_s", "peak_mb"]
SEED = 1
# Of the lamp's reflection: its light, of full white, and how sharp it is.
LAMP, SHARPNESS = 0.6, 60
# Bytes that the camera's noise adds, standard deviation.
NOISE = 1.0


@dataclass
class Case:
    """Images of a shape, and what is wrong with their colours."""

    shape: str
    views: int
    exposure: float  # the largest share that one is off by
    glints: bool

    @property
    def name(self):
        """As the command line and the table name it."""
        return f"{self.shape} {self.views}, exposure {100 * self.exposure:.0f} %{', glints' if self.glints else ''}"


CASES = [Case("sculpture", 12, exposure, glints) for exposure in (0, 0.3) for glints in (False, True)]
CASES += [Case("sculpture", 40, 0.3, True)]
SMALLEST = [Case("sculpture small", 12, 0.3, True)]


def light_of(bytes_of):
    """Linear light of bytes of sRGB (IEC 61966-2-1)."""
    share = np.asarray(bytes_of) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def bytes_of(light):
    """Bytes of sRGB of linear light, not rounded."""
    light = np.clip(light, 0, 1)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def pattern(points, size):
    """The light that places reflect evenly: three colours in waves of a third to an eighth of the size."""
    turns = points @ np.array([[3, 5, 8], [6, -4, 3], [2, 7, -5]]).T * (2 * np.pi / size)
    return 0.28 + 0.16 * np.sin(turns) * np.cos(turns[:, [1, 2, 0]])


@dataclass
class Photos:
    """Depth images with colours."""

    shots: noise_scans.Shots
    colours: np.ndarray  # (n, rows, cols, 3) uint8
    exposures: np.ndarray
    size: float


@lru_cache(maxsize=1)
def shots_of(shape, views, folder):
    """Depth images of a shape, and how large it is."""
    mesh, poses, camera, cell, _ = noise_shapes.scene(shape, views)
    return noise_scans.scan(mesh, poses, camera, cell, folder), float(np.ptp(mesh.bounds, axis=0).max())


def normals(points):
    """Unit normals of a grid of points, towards the eye at the origin."""
    across = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-12)
    return np.where((across * points).sum(-1, keepdims=True) > 0, -across, across)


def photograph(case, folder):
    """The images of a case."""
    shots, size = shots_of(case.shape, case.views, folder)
    generator = np.random.default_rng(SEED)
    exposures = generator.permutation(np.linspace(1 - case.exposure, 1 + case.exposure, case.views))
    rays, colours = shots.camera.rays(), []
    for pose, depth, exposure in zip(shots.poses, shots.depth, exposures, strict=True):
        seen = rays * np.where(depth > 0, depth, np.nan)[..., None]
        world = seen @ pose[:3, :3].T + pose[:3, 3]
        light = pattern(world.reshape(-1, 3), size).reshape(world.shape)
        if case.glints:
            # The lamp hangs beside the camera, another way each time.
            lamp = generator.normal(size=3) * 0.3 + [0, 0, -1]
            towards = lamp / np.linalg.norm(lamp) - seen / np.linalg.norm(seen, axis=-1, keepdims=True)
            halfway = towards / np.linalg.norm(towards, axis=-1, keepdims=True)
            shine = np.clip((normals(seen) * halfway).sum(-1), 0, 1)
            light += LAMP * np.nan_to_num(shine[..., None]) ** SHARPNESS
        taken = bytes_of(np.nan_to_num(light) * exposure) + NOISE * generator.standard_normal(light.shape)
        colours.append(np.clip(np.round(taken), 0, 255).astype(np.uint8))
    return Photos(shots, np.stack(colours), exposures, size)


def merge(source, out, matched):
    """Merges what `main` wrote; the process of a run."""
    import surfrecon

    given, scans = np.load(source), []
    for k, (depth, colour, pose) in enumerate(zip(given["depth"], given["colours"], given["poses"], strict=True)):
        values = np.where(depth > 0, depth, np.nan).astype(float)
        image = surfrecon.RangeImage.pinhole(
            values, focal=tuple(given["focal"]), centre=tuple(given["centre"]), name=f"{k:04}"
        )
        image.world_from_sensor, image.colour = pose, colour
        scans.append(image)
    merged = surfrecon.merge(scans, voxel=float(given["cell"]), match_exposure=matched)
    found = {name: merged.mesh.vertex_attributes[name] for name in ("colour", "interpolated")}
    gains = np.array(merged.report.colour_gains).reshape(-1, 3)
    found["normals"] = vertex_normals(merged.mesh.positions, merged.mesh.triangles)
    np.savez(out, positions=merged.mesh.positions, gains=gains, **found)


def vertex_normals(positions, triangles):
    """Unit normals of a mesh."""
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    across, sums = np.cross(b - a, c - a), np.zeros_like(positions)
    for k in range(3):
        np.add.at(sums, triangles[:, k], across)
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-12)


def mean_of_bytes(photos, vertices, normals):
    """The mean of what the images show of each vertex, in bytes, and the sum of its weights.

    A weight is a quarter and, of the rest, the cosine between the ray and the normal: as the merge trusts samples.
    """
    total, count = np.zeros((len(vertices), 3)), np.zeros(len(vertices))
    camera = photos.shots.camera
    for pose, depth, colours in zip(photos.shots.poses, photos.shots.depth, photos.colours, strict=True):
        at = (vertices - pose[:3, 3]) @ pose[:3, :3]
        place = at[:, :2] / at[:, 2:] * camera.focal + camera.centre
        col, row = np.floor(place).astype(int).T
        inside = (at[:, 2] > 0) & (col >= 0) & (row >= 0) & (col < camera.cols - 1) & (row < camera.rows - 1)
        col, row = np.where(inside, col, 0), np.where(inside, row, 0)
        share, shown = place - np.floor(place), np.zeros((len(vertices), 3))
        for right, down in ((0, 0), (1, 0), (0, 1), (1, 1)):
            inside &= np.abs(depth[row + down, col + right] - at[:, 2]) < 2 * photos.shots.cell
            weight = (share[:, 0] if right else 1 - share[:, 0]) * (share[:, 1] if down else 1 - share[:, 1])
            shown += weight[:, None] * colours[row + down, col + right]
        towards = pose[:3, 3] - vertices
        cosine = (towards * normals).sum(1) / np.linalg.norm(towards, axis=1)
        trust = np.where(inside, 0.25 + 0.75 * np.clip(cosine, 0, 1), 0)
        total += trust[:, None] * shown
        count += trust
    return total / np.where(count > 0, count, 1)[:, None], count


def off_pattern(found, light):
    """How far bytes are off those of the pattern, by vertex, after the factor for each channel that suits them best."""
    factor = light.sum(0) / light_of(found).sum(0)
    return np.sqrt(((bytes_of(light_of(found) * factor) - bytes_of(light)) ** 2).mean(1))


def run_case(case, wanted, record):
    """Runs both of ours on a case and takes the mean of bytes; gives their rows."""
    print(f"  {case.name}: making images", flush=True)
    photos = photograph(case, wanted.out / "inputs" / "noise_clean")
    folder = wanted.out / "inputs" / "colour"
    folder.mkdir(parents=True, exist_ok=True)
    shots, camera = photos.shots, photos.shots.camera
    given = {"depth": shots.depth, "colours": photos.colours, "poses": shots.poses, "cell": shots.cell}
    np.savez(folder / "given.npz", focal=(camera.focal,) * 2, centre=camera.centre, **given)
    known = {"views": case.views, "exposure_pct": 100 * case.exposure, "glints": case.glints}
    seen = {}

    def head(tool):
        return dict.fromkeys(COLUMNS) | {"case": case.name, "tool": tool} | known

    def once(tool):
        print(f"  {case.name}: {tool}", flush=True)
        out = folder / f"{tool}.npz"
        command = [sys.executable, HERE / "colour.py", folder / "given.npz", out, json.dumps(tool == OURS)]
        return measured.run(command)[0], out

    def figures(found, former, light):
        off, before = off_pattern(found, light), off_pattern(former, light)
        rms, rms_before = (float(np.sqrt((x**2).mean())) for x in (off, before))
        worst = float(np.percentile(off, 99))
        return {"rms_bytes": rms, "worst_percent_bytes": worst, "of_mean_of_bytes": rms / rms_before}

    def judge(tool, out):
        made = np.load(out)
        former, count = mean_of_bytes(photos, made["positions"], made["normals"])
        told = (count > 0) & ~made["interpolated"] & (made["colour"][:, 3] > 0)
        light = pattern(made["positions"][told], photos.size)
        if tool == OURS:
            seen["former"] = figures(former[told], former[told], light)
        row = figures(made["colour"][told, :3].astype(float), former[told], light)
        if len(made["gains"]):
            products = made["gains"] * photos.exposures[:, None]
            row["gain_error_pct"] = 100 * float(np.abs(products / products.mean(0) - 1).max())
        return row

    rows = record.measure(wanted.tools(case.name, [OURS, UNMATCHED]), wanted.repeats, once, head, judge)
    if "former" in seen:
        rows.append(head(BYTES) | seen["former"])
        record.put(rows[-1])
    return rows


def main(wanted, record):
    """Runs the benchmark."""
    rows = []
    for case in SMALLEST if wanted.smallest else CASES:
        if wanted.takes(case.name) and record.has_time_for(case.name):
            rows += run_case(case, wanted, record)
    columns = {
        "case": "case", "tool": "tool", "RMS bytes": "rms_bytes", "worst 1 %": "worst_percent_bytes",
        "of mean of bytes": "of_mean_of_bytes", "gains off %": "gain_error_pct", "CPU s": "cpu_s", "MB": "peak_mb",
    }  # fmt: skip
    table.show(rows, columns)


if __name__ == "__main__":
    merge(sys.argv[1], sys.argv[2], json.loads(sys.argv[3]))
