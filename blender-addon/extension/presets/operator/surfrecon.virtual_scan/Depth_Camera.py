# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

op = bpy.context.active_operator

op.cameras = "ALL"
op.noise = 0.002
op.noise_grazing = 0.5
op.quantum = 0.001
op.dropout = 0.01
op.dropout_grazing = 0.5
op.backfaces = False
op.pose_shift = 0.001
op.pose_turn = 0.001
op.max_range = 0.0
