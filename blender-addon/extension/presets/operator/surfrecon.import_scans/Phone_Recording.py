# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

op = bpy.context.active_operator

op.unit = "M"
op.orientation = "AXES"
op.axis_forward = "-Z"
op.axis_up = "Y"
op.origin = "AUTO"
op.faces = True
op.cameras = True
op.whole = True
