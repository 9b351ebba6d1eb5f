"""Plain text of comments as reStructuredText."""

import re
import textwrap

# In running text of comments names of C stand bare; elsewhere all that reStructuredText gives a meaning is escaped.
_C_NAME = re.compile(r"\b(srf_[a-z0-9_]+|SRF_[A-Z0-9_]+)(\(\))?")


def escaped(text):
    """The text, nothing of it taken for markup but code between backticks."""
    parts = re.split(r"`([^`]+)`", text)
    for k, part in enumerate(parts):
        parts[k] = f"``{part}``" if k % 2 else re.sub(r"([\\*`|_<>])", r"\\\1", part)
    return "".join(parts)


def indented(text, by=3):
    """A text inside a directive."""
    return textwrap.indent(text, " " * by)


def linked(text, roles):
    """The text with links to the names of C that `roles` knows: the role by name."""
    made, at = [], 0
    for found in _C_NAME.finditer(text):
        role = roles.get(found[1])
        if role is None:
            continue
        before = escaped(text[at : found.start()])
        # Roles end and begin at spaces; an escaped one is not shown.
        made += [before, "\\ " if before[-1:].strip() else "", f":c:{role}:`{found[1]}`", "\\ "]
        at = found.end()
    return "".join([*made, escaped(text[at:])]).rstrip()


def title(text, mark):
    """A heading."""
    return f"{text}\n{mark * len(text)}\n"
