"""Dense meshes to coarse ones of well-shaped triangles: beside ACVD, MeshLab's remeshing and other k-means.

Every run is a fresh process; times are of the work alone, without imports and files. One checker measures all results
at equal numbers of vertices: angles, quality (twice the inradius over the circumradius), distances of 200,000 points of
the input to the result as shares of the input's diagonal, topology. Rows of tools that only cluster have no such
figures. The angles before and after the relaxation are drawn as histograms to out/bench/cluster-CASE-K.svg.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import measured
import numpy as np
import surface
import table

HERE = Path(__file__).resolve().parent
REMESHERS = [
    "surfrecon",
    "surfrecon-fitted",
    "surfrecon-least-angle",
    "surfrecon-even",
    "acvd",
    "acvd-1",
    "acvd-2",
    "meshlab-isotropic",
    "meshlab-quadric",
]
CLUSTERERS = ["surfrecon-patches", "sklearn-kmeans", "faiss-kmeans"]
# Their own environment has them; MeshLab is in the one that runs this.
APART = {"acvd", "acvd-1", "acvd-2", "sklearn-kmeans", "faiss-kmeans"}
# On the large meshes: subdividing them further is not what anybody does, and k-means of others takes minutes.
LARGE = ["surfrecon", "surfrecon-fitted", "surfrecon-least-angle", "acvd", "meshlab-isotropic", "meshlab-quadric"]
SAMPLES = 200_000
# Figures of a mesh. They are null where a tool makes none.
QUALITY = ["vertices", "min_angle_mean", "below_30_pct", "quality_mean", "dist_mean", "dist_max", "components", "genus"]
COLUMNS = ["case", "tool", "k", "runs", "cpu_s", "wall_s", "peak_mb", *QUALITY]


def merged(path, voxel):
    """The largest part of registered scans merged by this library."""
    import surfrecon

    return surfrecon.merge(surfrecon.open(path), voxel=voxel, min_component_share=0.1).mesh


def cases(wanted, record):
    """Name, mesh, numbers of vertices and tools of each case that is wanted."""
    import surfrecon

    if wanted.smallest:
        # Without what has an environment of its own.
        yield "sculpture", surfrecon.sculpture(cell=12.0), [400], [tool for tool in REMESHERS if tool not in APART]
        return
    data = os.environ.get("SURFRECON_DATA")
    found = [
        ("bunny", "points/bunny70k.ply", surfrecon.read, [100, 800, 1500, 10_000], REMESHERS + CLUSTERERS),
        ("igea", "meshes/igea.ply", surfrecon.read, [10_000], REMESHERS),
        ("bunny merged", "stanford_bunny/bun.conf", lambda p: merged(p, 0.00047), [20_000], LARGE),
        (
            "dragon merged",
            "stanford_dragon_stand/dragonStandRight.conf",
            lambda p: merged(p, 0.00042),
            [20_000],
            LARGE,
        ),
    ]
    for name, file, make, counts, tools in found:
        counts = [k for k in counts if wanted.takes(case_name(name, k))]
        if not counts:
            continue
        if data and (Path(data) / file).is_file():
            yield name, make(Path(data) / file), counts, tools
        else:
            record.skip(f"{name}: {file} is not in SURFRECON_DATA")


def case_name(name, k):
    """A mesh and the number of vertices that it is brought to."""
    return f"{name}, {k:,} vertices"


def shape(positions, triangles):
    """Angles in degrees (m, 3) and qualities of the triangles."""
    corners = positions[triangles]
    sides = np.stack([np.linalg.norm(corners[:, i - 1] - corners[:, i - 2], axis=1) for i in range(3)], 1)
    angles = np.empty(sides.shape)
    for i in range(3):
        u, v = corners[:, i - 2] - corners[:, i], corners[:, i - 1] - corners[:, i]
        angles[:, i] = np.degrees(np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(1)))
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    product = np.maximum(sides.sum(1) * sides.prod(1), 1e-300)
    return angles, 16 * area**2 / product


def figures_of(positions, triangles, dense):
    """The figures of a result, beside the input and points of it in `dense`."""
    import surfrecon

    angles, quality = shape(positions, triangles)
    there = 100 * surface.distances(dense["samples"], positions, triangles) / dense["diagonal"]
    samples = surface.sample(positions, triangles, len(dense["samples"]), seed=4)
    back = 100 * surface.distances(samples, dense["positions"], dense["triangles"]) / dense["diagonal"]
    check = surfrecon.Mesh(positions, triangles).check()
    return {
        "vertices": len(np.unique(triangles)),
        "min_angle_mean": float(angles.min(1).mean()),
        "below_30_pct": float(100 * (angles < 30).mean()),
        "quality_mean": float(quality.mean()),
        "dist_mean": float(there.mean()),
        "dist_max": float(there.max()),
        "components": int(check["components"]),
        "genus": check["genus"],
    }, {
        "least_angle": float(angles.min()),
        "back_mean": float(back.mean()),
        "back_max": float(back.max()),
        "loops": int(check["boundary_loops"]),
        "manifold": "yes" if check["is_manifold"] else "no",
    }


def energy(labels, dense):
    """Sum of the weighted squared distances to the centroids of the patches, as a share of the diagonal's square."""
    import peer_cluster

    weights = peer_cluster.areas(dense["positions"], dense["triangles"])
    weights = weights / weights.sum()
    used = labels >= 0
    labels, points, weights = labels[used], dense["positions"][used], weights[used]
    total = np.maximum(np.bincount(labels, weights), 1e-300)
    means = np.stack([np.bincount(labels, weights * points[:, i]) / total for i in range(3)], 1)
    return float((weights * ((points - means[labels]) ** 2).sum(1)).sum() / dense["diagonal"] ** 2)


def measure(case, tools, k, mesh, dense, pythons, wanted, record):
    """Runs the tools on a mesh; returns their rows with what is only printed, and our angles before and after."""
    shown, angles = {}, []
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "mesh.npz"

        def once(tool):
            command = [pythons[tool in APART], HERE / "peer_cluster.py", tool, mesh, k, out]
            figures, printed = measured.run(command)
            told = json.loads(printed.strip().splitlines()[-1])
            if tool == "surfrecon":
                angles[:] = [told[f"angles_{when}"] for when in ("before", "after")]
            with np.load(out) as made:
                return figures | {key: told[key] for key in ("cpu_s", "wall_s")}, dict(made)

        def judge(tool, made):
            if "labels" in made:
                shown[tool] = {"energy": energy(made["labels"], dense)}
                return dict.fromkeys(QUALITY)
            kept, shown[tool] = figures_of(made["positions"], made["triangles"].astype(np.int64), dense)
            return kept

        rows = record.measure(tools, wanted.repeats, once, lambda tool: {"case": case, "tool": tool, "k": k}, judge)
    return [row | shown.get(row["tool"], {}) for row in rows], angles


def histogram(path, title, before, after):
    """Draws how many of all angles lie in each 5 degrees, before and after the relaxation."""
    width, height, left, base = 640, 280, 50, 230
    highest = max(max(before) / sum(before), max(after) / sum(after))
    step = (width - left - 20) / len(after)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}"',
        ' font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/><text x="{left}" y="20">{title}</text>',
    ]
    for counts, colour, shift in ((before, "#b8bfc8", 0.0), (after, "#2b6cb0", 0.5)):
        for i, count in enumerate(counts):
            bar = 190 * count / sum(counts) / highest
            x = left + (i + shift) * step
            parts.append(
                f'<rect x="{x:.1f}" y="{base - bar:.1f}" width="{step / 2:.1f}" height="{bar:.1f}" fill="{colour}"/>'
            )
    for degrees in range(0, 181, 30):
        x = left + degrees / 5 * step
        parts.append(f'<text x="{x:.1f}" y="{base + 16}" text-anchor="middle">{degrees}°</text>')
    parts.append(f'<text x="{left}" y="{base + 38}" fill="#7d8794">fans</text>')
    parts.append(f'<text x="{left + 50}" y="{base + 38}" fill="#2b6cb0">relaxed</text>')
    parts.append(f'<text x="{left - 6}" y="{base - 186}" text-anchor="end">{100 * highest:.0f} %</text></svg>')
    path.write_text("\n".join(parts) + "\n")


def main(wanted, record):
    """Runs all cases, prints a table a case and number of vertices."""
    apart = None
    if not wanted.smallest:
        made = subprocess.run([HERE.parent / "tools" / "venv.sh", "bench-cluster"], capture_output=True, text=True)
        if made.returncode == 0:
            apart = Path(made.stdout.strip()) / "bin" / "python"
        else:
            record.skip("ACVD, scikit-learn, faiss: their environment could not be made")
    for name, mesh, counts, tools in cases(wanted, record):
        positions, triangles = np.asarray(mesh.positions, float), np.asarray(mesh.triangles).astype(np.int64)
        dense = {"positions": positions, "triangles": triangles}
        dense["samples"] = surface.sample(positions, triangles, 2_000 if wanted.smallest else SAMPLES, seed=3)
        dense["diagonal"] = float(np.linalg.norm(np.ptp(positions[np.unique(triangles)], axis=0)))
        check = mesh.check()
        print(
            f"\n{name}: {len(positions):,} vertices, {len(triangles):,} triangles, components {check['components']}, "
            f"boundary loops {check['boundary_loops']}, genus {check['genus']}"
        )
        tools = [tool for tool in tools if apart or tool not in APART]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "mesh.npz"
            np.savez(file, positions=positions, triangles=triangles.astype(np.int32))
            for k in counts:
                case = case_name(name, k)
                there = wanted.tools(case, tools)
                shown, angles = measure(name, there, k, file, dense, (sys.executable, apart), wanted, record)
                if angles:
                    drawing = wanted.out / f"cluster-{name.replace(' ', '-')}-{k}.svg"
                    histogram(drawing, f"{case}: angles of the triangles", *angles)
                columns = ["tool", "cpu_s", "wall_s", "peak_mb", "vertices", "min_angle_mean", "least_angle"]
                columns += ["below_30_pct", "quality_mean", "dist_mean", "dist_max", "back_mean", "back_max"]
                columns += ["components", "genus", "loops", "manifold", "energy"]
                print(f"\n{name}, k = {k:,}", flush=True)
                table.show(shown, {column: column for column in columns if any(column in row for row in shown)})
