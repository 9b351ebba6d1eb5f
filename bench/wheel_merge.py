"""Our row of the wheel, in a process of its own: wheel_merge.py CONF OUT VOXEL."""

import sys

import surfrecon
from ply import write_ply

if __name__ == "__main__":
    conf, out, voxel = sys.argv[1], sys.argv[2], float(sys.argv[3])
    mesh = surfrecon.merge(surfrecon.open(conf), voxel=voxel).mesh
    write_ply(out, mesh.positions, mesh.triangles)
