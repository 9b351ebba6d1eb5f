# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences of an import, kept with its collection for the report."""

import os

from .translations import word

# Custom property of a collection: figures, and notes, a line each.
IMPORTED = "surfrecon_import"


def of_scans(count, scans):
    """How many of the scans."""
    return f"{count:,} {word('of')} {scans:,}"


def import_of(obj):
    """The collection of an object that says of its import, or `None`."""
    return next((one for one in obj.users_collection if hasattr(one.get(IMPORTED), "to_dict")), None)


def folder_of(objects):
    """The folder that one of the objects was imported from, or `None`."""
    found = (collection[IMPORTED].get("folder") for collection in map(import_of, objects) if collection is not None)
    return next((folder for folder in found if isinstance(folder, str) and os.path.isdir(folder)), None)


def note_import(collection, path, scans, coloured, samples, in_files, notes):
    """Notes with a collection what was imported."""
    collection[IMPORTED] = {
        "folder": os.path.dirname(os.path.abspath(path)),
        "scans": scans,
        "coloured": coloured,
        "samples": samples,
        "in_files": in_files,
        "notes": "\n".join(notes),
    }


def import_lines(context, figures):
    """Imported scans as (name, value) texts. Notes are sentences."""
    figures = figures.to_dict()
    yield "Scans", f"{figures['scans']:,}"
    yield "Samples", f"{figures['samples']:,}"
    yield "With colours", of_scans(figures["coloured"], figures["scans"])
    if figures["in_files"]:
        yield "Frames in their files", f"{figures['in_files']:,}"
    for text in figures["notes"].splitlines():
        yield text, None
