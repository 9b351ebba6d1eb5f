# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences in the language of the interface: those with parts that change, which Blender's dictionaries can't have."""

import re
from functools import cache

import bpy

from .german import GERMAN as SENTENCES
from .german_reasons import REASONS

GERMAN = SENTENCES | REASONS
LANGUAGES = {"de_DE": GERMAN}

# Joints of a sentence whose parts are translated one by one if the whole is not known.
JOINTS = (". ", "; ", ": ", ", ")


def told(text):
    """A sentence in the language of the interface, as far as it is known there."""
    language = language_of(bpy.context.preferences.view)
    return text if language is None else translated(text, language)


def language_of(view):
    """The dictionary of the interface's language, or `None` where that is English, or has none."""
    return LANGUAGES.get(bpy.app.translations.locale) if view.use_translate_interface else None


def translated(text, language):
    """A sentence by a dictionary of patterns. A text without a pattern stays."""
    if text in language:
        return language[text]
    for pattern, other in patterns(id(language)):
        match = pattern.fullmatch(text)
        if match:
            return other.format(*(translated(part, language) for part in match.groups()))
    count = re.fullmatch(r"([\d.,]+) (.+)", text)
    if count and count[2] in language:
        return f"{count[1]} {language[count[2]]}"
    lower = text[:1].lower() + text[1:]
    if lower != text and (found := translated(lower, language)) != lower:
        # Sentences of the library begin with small letters, and in a report with a capital.
        return found[:1].upper() + found[1:]
    for joint in JOINTS:
        if joint in text:
            return joint.join(translated(part, language) for part in text.split(joint))
    return text


@cache
def patterns(number):
    """Patterns with parts that change, of the dictionary with that identity. Those that say most come first."""
    language = next(one for one in LANGUAGES.values() if id(one) == number)
    found = [key for key in language if "{}" in key]
    found.sort(key=lambda key: -len(key.replace("{}", "")))
    return [(re.compile("(.+?)".join(map(re.escape, key.split("{}"))), re.DOTALL), language[key]) for key in found]


def tell(operator, kinds, text):
    """An operator's report, in the language of the interface."""
    operator.report(kinds, told(text))


def in_object_mode(cls, context):
    """Whether the window is in object mode. An operator says that it has to be, otherwise."""
    if context.mode != "OBJECT":
        cls.poll_message_set(told("Switch to Object Mode first"))
        return False
    return True
