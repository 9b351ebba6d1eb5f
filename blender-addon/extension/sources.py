# SPDX-License-Identifier: GPL-3.0-or-later
"""Sources of results: noted with them as pointers, which hold whatever an object is called later.

A pointer keeps a deleted object in the file, where no scene has it. Such an object counts as gone, and saving lets it
go. Each pointer has the name beside it that the object had, so that what is gone can be named.
"""

import re

import bpy
import surfrecon
from bpy.props import CollectionProperty, PointerProperty

from . import scan_objects

# Custom property of results in files of 0.1: the names of what they were made from, a line each.
SCANS = "surfrecon_scans"

# Names that Blender gives to collections.
BLENDERS = re.compile(r"Collection([ .]\d+)?")


class Source(bpy.types.PropertyGroup):
    """An object that a result was made from, and as `name` what it was called then."""

    object: PointerProperty(type=bpy.types.Object)


def note(made, objects, names):
    """Notes with a result the objects that it was made from, or `None` where one is gone meanwhile, and their names."""
    made.surfrecon_sources.clear()
    for obj, name in zip(objects, names, strict=True):
        source = made.surfrecon_sources.add()
        source.object, source.name = obj, name


def pairs_of(obj):
    """The name and the object of each source of a result, or `None` where that is gone."""
    if len(obj.surfrecon_sources) > 0:
        return [(source.name, source.object if is_there(source.object) else None) for source in obj.surfrecon_sources]
    names = obj.get(SCANS)
    return [(name, bpy.data.objects.get(name)) for name in names.split("\n")] if isinstance(names, str) else []


def is_there(obj):
    """Whether an object is in any scene: one that was deleted is in none."""
    return obj is not None and len(obj.users_scene) > 0


def sources_of(obj):
    """The objects that a result was made from, as far as they are still there."""
    return [source for _, source in pairs_of(obj) if source is not None]


def all_sources_of(objects):
    """Sources of objects, and theirs. None comes twice, and none is one of the objects themselves."""
    found, new = list(objects), list(objects)
    while new:
        new = [source for obj in new for source in sources_of(obj) if source not in found]
        found += dict.fromkeys(new)
    return found[len(objects) :]


def what_is_gone(obj):
    """A sentence's part about what a result was made from and is no longer there, or `None`."""
    gone = [name for name, source in pairs_of(obj) if source is None]
    if not gone:
        return None
    named = ", ".join(f'"{name}"' for name in gone[:3])
    more = f" and {len(gone) - 3:,} more" if len(gone) > 3 else ""
    return f'{named}{more}, of which "{obj.name}" was made, {"is" if len(gone) == 1 else "are"} gone'


def common_name(objects):
    """A name for what several objects are together: that of the collection that holds them, as importing names it by
    the file, else that of the first.
    """
    for collection in objects[0].users_collection if len(objects) > 1 else ():
        # The scene's own collection, and those of new files, are named after nothing.
        own = bpy.data.collections.get(collection.name) == collection
        if own and not BLENDERS.fullmatch(collection.name) and all(obj.name in collection.objects for obj in objects):
            return collection.name
    return objects[0].name


def has_colours(scan):
    """Whether a scan has colours: a range image, a mesh with its place, or a frame in its file."""
    if isinstance(scan, surfrecon.RangeImage):
        return scan.colour is not None
    if isinstance(scan, surfrecon.Scan):
        return bool(getattr(scan, "has_colour", False))
    return "colour" in scan[0].vertex_attributes


def scan_behind(obj):
    """The range scan that an object is, or was made from. It is `None` if there is no such scan.

    So an operator can be adjusted, and called again, while its own result is the active object.
    """
    if obj is None or scan_objects.is_range_image(obj):
        return obj
    sources = pairs_of(obj)
    source = sources[0][1] if len(sources) == 1 else None
    return source if source is not None and scan_objects.is_range_image(source) else None


@bpy.app.handlers.persistent
def convert_names(*_):
    """Makes pointers of the names in files of 0.1."""
    for obj in bpy.data.objects:
        if obj.library is None and isinstance(obj.get(SCANS), str):
            if len(obj.surfrecon_sources) == 0:
                names = obj[SCANS].split("\n")
                note(obj, [bpy.data.objects.get(name) for name in names], names)
            del obj[SCANS]


@bpy.app.handlers.persistent
def let_go(*_):
    """Lets objects go that were deleted, so that they are not in the file that is saved."""
    for obj in bpy.data.objects:
        for source in obj.surfrecon_sources if obj.library is None else ():
            found = source.object
            if found is not None and not is_there(found) and not found.users_collection and not found.use_fake_user:
                source.object = None


def register():
    """Gives objects their sources."""
    bpy.utils.register_class(Source)
    bpy.types.Object.surfrecon_sources = CollectionProperty(type=Source)
    bpy.app.handlers.load_post.append(convert_names)
    bpy.app.handlers.save_pre.append(let_go)


def unregister():
    """Takes them away again."""
    bpy.app.handlers.save_pre.remove(let_go)
    bpy.app.handlers.load_post.remove(convert_names)
    del bpy.types.Object.surfrecon_sources
    bpy.utils.unregister_class(Source)
