# SPDX-License-Identifier: GPL-3.0-or-later
"""Range scans in Blender: import them with their grids and poses, merge them into one surface.

| file | what |
|---|---|
| properties | options of the operators and the sidebar, made from the library's parameter table |
| operators | import, export, merge, sculpt, quad grid, cluster, surface from points, error map |
| panels | the sidebar tab, the entry in File > Import |
| job | a long call of the library as a modal operator: thread, progress, cancel |
| convert | arrays <-> Blender's meshes, transforms and custom properties |
"""

from . import job, operators, panels, properties

MODULES = (properties, job, operators, panels)


def register():
    """Called by Blender when the extension is enabled."""
    for module in MODULES:
        module.register()


def unregister():
    """Called by Blender when the extension is disabled."""
    for module in reversed(MODULES):
        module.unregister()
