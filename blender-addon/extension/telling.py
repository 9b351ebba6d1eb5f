# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences in the language of the interface: those with parts that change, which Blender's dictionaries can't have."""

import re
from functools import cache, lru_cache

import bpy

from .german import GERMAN as SENTENCES
from .german_files import FILES
from .german_library import LIBRARY
from .german_reasons import REASONS
from .translations import GERMAN_TEXTS
from .words import LABELS


def quoted(names):
    """Names of parameters, as errors of the library quote them."""
    return {f'"{label}"': f'"{names[label]}"' for label in LABELS.values() if label in names}


GERMAN = SENTENCES | REASONS | LIBRARY | FILES | quoted(GERMAN_TEXTS)
LANGUAGES = {"de_DE": GERMAN}

# Joints of a sentence whose parts are translated one by one if the whole is not known.
JOINTS = (". ", "; ", ": ", ", ")


def learn(code, names, sentences):
    """Adds sentences of an operation to a language, and the names of its parameters. Nothing has been looked up yet."""
    LANGUAGES[code].update(sentences | quoted(names))


def told(text):
    """A sentence in the language of the interface, as far as it is known there."""
    language = language_of(bpy.context.preferences.view)
    return text if language is None else translated(text, language)


def language_of(view):
    """The dictionary of the interface's language, or `None` where that is English, or has none."""
    return LANGUAGES.get(bpy.app.translations.locale) if view.use_translate_interface else None


def translated(text, language):
    """A sentence by a dictionary of patterns. A text without a pattern stays."""
    return translated_by(text, id(language))


@lru_cache(maxsize=4096)
def translated_by(text, number):
    """`translated`, by the dictionary with that identity. Panels ask at each redraw."""
    whole = as_whole(text, number)
    if whole is not None:
        return whole
    if text.endswith("."):
        return f"{translated_by(text[:-1], number)}."
    for joint in JOINTS:
        if joint in text:
            return joint.join(translated_by(part, number) for part in text.split(joint))
    return text


def as_whole(text, number):
    """A text in the other language, if the dictionary with that identity has it without taking it apart, else `None`.
    Parts that change hold no end of a sentence, but for the last.

    Sentences of the library begin with small letters, and in a report with a capital.
    """
    language = language_by(number)
    lower = text[:1].lower() + text[1:]
    for way in (text, lower):
        if way in language:
            found = language[way]
            return found if way == text else found[:1].upper() + found[1:]
    count = re.fullmatch(r"([\d.,]+) (.+)", text)
    if count and count[2] in language:
        return f"{count[1]} {language[count[2]]}"
    for piece, pattern, other in patterns(number):
        for way in (text, lower):
            match = pattern.fullmatch(way) if piece in way else None
            if match and not ends_within(match, language):
                found = other.format(*(translated_by(part, number) for part in match.groups()))
                return found if way == text else found[:1].upper() + found[1:]
    return None


def ends_within(match, language):
    """Whether a sentence ends within a part that changes, unless that ends the text."""
    parts = [part for place, part in enumerate(match.groups(), 1) if match.end(place) < len(match.string)]
    return any(". " in part and part not in language for part in parts)


def language_by(number):
    """The dictionary with that identity."""
    return next(one for one in LANGUAGES.values() if id(one) == number)


@cache
def patterns(number):
    """Patterns with parts that change, of the dictionary with that identity: the longest part that stays, the pattern,
    the other language. Those that say most come first.
    """
    language = language_by(number)
    found = [key for key in language if "{}" in key]
    found.sort(key=lambda key: -len(key.replace("{}", "")))
    pieces = [key.split("{}") for key in found]
    regular = [re.compile("(.+?)".join(map(re.escape, parts)), re.DOTALL) for parts in pieces]
    return [(max(parts, key=len), one, language[key]) for parts, one, key in zip(pieces, regular, found, strict=True)]


def tell(operator, kinds, text):
    """An operator's report, in the language of the interface."""
    operator.report(kinds, told(text))


def in_object_mode(cls, context):
    """Whether the window is in object mode. An operator says that it has to be, otherwise."""
    if context.mode != "OBJECT":
        cls.poll_message_set(told("Switch to Object Mode first"))
        return False
    return True
