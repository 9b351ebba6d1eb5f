# SPDX-License-Identifier: GPL-3.0-or-later
"""Formats of files as the importer's dialog needs them: which way is up, the unit, and the options that count."""

import os
import re

import surfrecon

from .recording import PARTS

# Endings of files that can be chosen. A zip archive is of a recording's folder. Anything else may be in one, so that
# the library names no ending.
ENDINGS = sorted({"." + ending for endings in surfrecon.formats().values() for ending in endings} | {".zip"})

# Endings of files that can be dropped. Blender takes an archive for an extension, and installs it.
DROPPED = [ending for ending in ENDINGS if ending != ".zip"]

# Files of recordings alone, and files of images.
RECORDINGS = {".r3d", ".sens", ".zip"}
IMAGES = {".png", ".pgm", ".pfm", ".exr", ".tif", ".tiff", ".npy", ".asc", ".hgt", ".jpg", ".jpeg"}

# Formats that say their unit.
IN_METRES = {".e57", ".las", ".laz", ".ptx", ".glb", ".gltf", ".3mf"}
# The note of a file of another format that says its unit too, with its name.
SAYS_UNIT = re.compile(r"(.+): its header says .+: it is read in metres")

# Formats with Y up. Recordings of phones have it too, and all others have Z up.
Y_UP = {".conf", ".glb", ".gltf"}
PHONES = re.compile(r" frames? of (Polycam|Record3D|3D Scanner App|Stray Scanner)\b")

# Findings about files, by their paths: dialogs ask at each redraw.
FOUND = {}


def ending_of(path):
    """The ending of a path in small letters."""
    return os.path.splitext(path)[1].lower()


def axes_of(paths, notes):
    """Forward and up of files that have these notes."""
    is_phone = any(PHONES.search(note) for note in notes)
    return ("-Z", "Y") if is_phone or any(ending_of(path) in Y_UP for path in paths) else ("Y", "Z")


def is_in_metres(paths, notes):
    """Whether all files are of formats in metres, or say their unit in these notes."""
    said = {match[1] for note in notes if (match := SAYS_UNIT.fullmatch(note))}
    return all(ending_of(path) in IN_METRES or os.path.basename(path) in said for path in paths)


def is_recording(path):
    """Whether a path is of a recording, as far as names tell: a folder, an archive, a file in such a folder."""
    if path not in FOUND:
        if len(FOUND) > 1000:
            FOUND.clear()
        FOUND[path] = looked_at(path)
    return FOUND[path]


def looked_at(path):
    """`is_recording`, from the disk."""
    if ending_of(path) in RECORDINGS:
        return True
    is_folder = os.path.isdir(path)
    if not is_folder and ending_of(path) not in PARTS:
        return False
    # The library looks at the folders above a file.
    path = os.path.join(path, "any") if is_folder else path
    try:
        return surfrecon.recording_of(os.path.abspath(path)) is not None
    except surfrecon.SurfreconError:
        return False


def is_image(path):
    """Whether a path is of an image of heights or depths."""
    return ending_of(path) in IMAGES
