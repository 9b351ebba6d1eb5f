# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

op = bpy.context.active_operator

op.cameras = "ALL"
op.noise = 0.0
op.noise_grazing = 0.0
op.quantum = 0.0
op.dropout = 0.0
op.dropout_grazing = 0.0
op.pose_shift = 0.0
op.pose_turn = 0.0
op.max_range = 0.0
op.backfaces = False
