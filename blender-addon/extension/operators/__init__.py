# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators, a file each."""

import bpy

from . import cluster, error_map, export_scans, import_scans, merge, quads, reconstruct, sculpt

CLASSES = (
    import_scans.SURFRECON_OT_import_scans,
    import_scans.SURFRECON_FH_scans,
    export_scans.SURFRECON_OT_export_scans,
    merge.SURFRECON_OT_merge,
    sculpt.SURFRECON_OT_sculpt,
    quads.SURFRECON_OT_quads,
    reconstruct.SURFRECON_OT_reconstruct,
    cluster.SURFRECON_OT_cluster,
    error_map.SURFRECON_OT_error_map,
)


def register():
    """Registers them."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    cluster.register()


def unregister():
    """Unregisters them."""
    sculpt.Kept.forget()
    reconstruct.Kept.forget()
    cluster.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
