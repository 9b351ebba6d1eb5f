# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators, a file each."""

import bpy

from ..translations import in_our_words
from . import (
    align,
    background,
    clean,
    cluster,
    error_hide,
    error_map,
    export_scans,
    import_scans,
    measure,
    merge,
    merge_to_file,
    place,
    quads,
    reconstruct,
    sculpt,
    select_region,
    tint_scans,
    virtual_scan,
)

CLASSES = (
    import_scans.SURFRECON_OT_import_scans,
    import_scans.SURFRECON_FH_scans,
    export_scans.SURFRECON_OT_export_scans,
    virtual_scan.SURFRECON_OT_reproject,
    virtual_scan.SURFRECON_OT_virtual_scan,
    tint_scans.SURFRECON_OT_tint_scans,
    place.SURFRECON_OT_true_size,
    place.SURFRECON_OT_ground,
    clean.SURFRECON_OT_clean,
    select_region.SURFRECON_OT_select_region,
    background.SURFRECON_OT_remove_background,
    align.SURFRECON_OT_align,
    merge.SURFRECON_OT_merge,
    merge_to_file.SURFRECON_OT_merge_to_file,
    sculpt.SURFRECON_OT_sculpt,
    quads.SURFRECON_OT_quads,
    reconstruct.SURFRECON_OT_reconstruct,
    cluster.SURFRECON_OT_cluster,
    error_map.SURFRECON_OT_error_map,
    error_hide.SURFRECON_OT_error_hide,
    measure.SURFRECON_OT_measure,
)


def register():
    """Registers them."""
    for cls in CLASSES:
        bpy.utils.register_class(in_our_words(cls))
    cluster.register()


def unregister():
    """Unregisters them."""
    cluster.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
