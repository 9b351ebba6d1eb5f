# SPDX-License-Identifier: GPL-3.0-or-later
"""Range scans in Blender: import them with their grids and poses, bring them to one frame, merge them into one surface.

| file | what |
|---|---|
| preferences | what holds for all scenes |
| properties | options of the operators and the sidebar, made from the library's parameter table |
| operators | a file each: bring in, look, clean, align, merge, reduce, measure, export |
| panels | the sidebar tab |
| reports | the figures of results |
| menus | the entries in Blender's menus |
| job | a long call as a modal operator |
| running | what runs, and its cancel |
| preview | a rough picture while a job runs |
| home | the scene and the collection that a job was begun in |
| kept_merge | what the last merge found out, for the next one |
| adjusting | adjusted operations that take long |
| kept | what an operator needs again when it is adjusted |
| convert | arrays <-> Blender's meshes |
| splines | NURBS surfaces |
| clouds | points with normals |
| surfaces | several objects as one surface |
| scan_objects | range images as objects, and back |
| cameras | cameras both ways |
| usable | what refuses objects that can't be used, changed or moved |
| regions | boxes, planes, selections, the ruler's points |
| pruning | meshes with fewer vertices |
| scaling | other sizes |
| recording | frames of a recording: those that stay in their files, and the object that stands for them |
| chosen | the part of a selection that is meant, and what is left out |
| sources | what results were made from |
| hiding | hiding the sources of results in views, renders and exports |
| scene | results in the scene: collections, selection, colours, materials |
| imported | what an import said |
| foreseen | the size that files will have, before they are imported |
| formats | formats in the dialog of an import |
| views | views and the sidebar after an import |
| false_colours | distances in colours, put on a surface for looking and taken off again |
| by_format | exports whose format is chosen in the dialog |
| gltf | what Blender's export of glTF leaves out |
| words | lengths, numbers, times and errors as people read them |
| advice | what to do about errors in Blender |
| declared | what the library declares of its operations: identifiers, names, tips |
| presets | options saved under names |
| translations | other languages |
"""

from . import (
    job,
    kept,
    kept_merge,
    menus,
    operators,
    panels,
    preferences,
    presets,
    properties,
    sources,
    translations,
    views,
)
from .gltf import (  # noqa: F401 (Blender's exporter calls them)
    glTF2_post_export_callback,
    glTF2_pre_export_callback,
    glTF2ExportUserExtension,
)

MODULES = (
    preferences,
    properties,
    sources,
    job,
    kept,
    kept_merge,
    operators,
    panels,
    menus,
    presets,
    views,
    translations,
)


def register():
    """Called by Blender when the extension is enabled."""
    for module in MODULES:
        module.register()


def unregister():
    """Called by Blender when the extension is disabled."""
    for module in reversed(MODULES):
        module.unregister()
