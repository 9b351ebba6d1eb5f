"""Files that files name: what is read besides what was given, as far as names alone tell it.

The core says which files hold scans, but not a glTF's buffers, nor a recording's images, nor what a list will name.
"""

from __future__ import annotations

import html
import json
import os
import re
from collections.abc import Iterable, Iterator
from typing import Any
from urllib.parse import unquote

__all__ = ["with_members"]

# Longest of what is looked into, in bytes: lists are short.
_LONGEST = 256 << 20
_IMAGES = ("", ".png", ".jpg", ".jpeg")
_GLB_HEADER = 20


def with_members(paths: Iterable[str]) -> list[str]:
    """Files, all that they name, and what these name. Each comes once. A file that can't be read names nothing."""
    found: dict[str, str] = {}
    left = list(paths)
    while left:
        path = left.pop()
        whole = os.path.abspath(path)
        if whole not in found:
            found[whole] = path
            folder = os.path.dirname(path)
            named = (os.path.join(folder, name.replace("\\", "/")) for name in _names(path) if name)
            left += [file for file in named if os.path.isfile(file)]
    return list(found.values())


def _names(path: str) -> list[str]:
    try:
        # A device or a pipe would be waited for.
        if not os.path.isfile(path) or os.path.getsize(path) > _LONGEST and not path.lower().endswith(".glb"):
            return []
        with open(path, "rb") as file:
            start = file.read(_GLB_HEADER)
            if start.startswith(b"glTF"):
                return list(_of_json(file.read(min(int.from_bytes(start[12:16], "little"), _LONGEST))))
            ending = os.path.splitext(path)[1].lower()
            if start.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
                return list(_of_json(start + file.read()))
            if ending in _LISTS:
                text = (start + file.read()).decode("utf-8", "replace")
                return [html.unescape(name) for name in re.findall(_LISTS[ending], text)]
    except (OSError, ValueError, RecursionError):
        pass
    return []


_LISTS = {
    # A keyword, a name that may hold blanks, seven numbers.
    ".conf": r"(?im)^[ \t]*b?mesh[ \t]+(.+?)(?:[ \t]+[^ \t\r\n]+){7}[ \t]*$",
    ".mlp": r"""(?i)\bfilename\s*=\s*["']([^"']*)["']""",
    ".aln": r"(?m)^[ \t]*([^\r\n]+?)[ \t]*\r?\n[ \t]*#",
}


def _of_json(text: bytes) -> Iterator[str]:
    """Buffers and images of a glTF, depth and colour of frames. Some files of frames are named without an ending."""
    whole = json.loads(text.decode("utf-8-sig"))
    for entry in _entries(whole, "buffers") + _entries(whole, "images"):
        name = entry.get("uri")
        if isinstance(name, str) and not name.startswith("data:"):
            yield from (unquote(name), name)
    for frame in _entries(whole, "frames"):
        for name in (frame.get("depth_file_path"), frame.get("file_path")):
            if isinstance(name, str):
                yield from (name + ending for ending in _IMAGES)


def _entries(whole: Any, name: str) -> list[dict[str, Any]]:
    entries = whole.get(name) if isinstance(whole, dict) else None
    return [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []
