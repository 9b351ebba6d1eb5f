"""Peers are given their input as they want it: one in the wrong place would make them look bad."""

from pathlib import Path

from peers import lines_of, needs_peers

BENCH = Path(__file__).resolve().parents[2] / "bench"

# A slanted plane seen by a far pinhole; prints how far the surface of its depth map lies off it on average, in pixels.
PLANE = """
import sys
from pathlib import Path
import numpy as np
folder = Path(sys.argv[1])
sys.path.insert(0, sys.argv[2])
import peer_merge
from ply import read_ply
side, distance = 240, 12.0
focal, middle = distance * side, (side - 1) / 2
normal = np.array([-0.5, -0.6, 1.0]) / np.linalg.norm([-0.5, -0.6, 1.0])
x, y = np.meshgrid(np.arange(side), np.arange(side))
rays = np.stack([(x - middle) / focal, (y - middle) / focal, np.ones(x.shape)], -1)
depth = (normal[2] * distance / (rays @ normal)).astype(np.float32)
(folder / "depth").mkdir()
K = np.array([[focal, 0, middle], [0, focal, middle], [0, 0, 1]])
np.savez(folder / "depth" / "scan.npz", depth=depth, K=K, E=np.eye(4))
(folder / "scans.txt").write_text(str(folder / "scan.ply") + "\\n")
peer_merge.voxel_block_grid(folder, 2 / side, folder / "out.ply")
found = read_ply(folder / "out.ply").vertices
assert len(found) > 5000
print(np.mean((found - [0, 0, distance]) @ normal) * side)
"""


@needs_peers
def test_open3d_merges_a_plane_where_its_depth_map_is(tmp_path):
    assert abs(float(lines_of(PLANE, tmp_path, BENCH)[-1])) < 0.05
