# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

op = bpy.context.active_operator

op.unit = "M"
op.orientation = "AXES"
op.axis_forward = "Y"
op.axis_up = "Z"
op.origin = "CENTRE"
op.faces = True
