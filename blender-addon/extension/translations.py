# SPDX-License-Identifier: GPL-3.0-or-later
"""Translations: a dictionary a language, by Blender's own way. English texts are the keys.

Another language is another entry of `LANGUAGES`; texts that it lacks stay English.
"""

import bpy

PANELS = "*"
OPERATORS = "Operator"

LANGUAGES = {
    "de_DE": {
        (OPERATORS, "Import Range Scans"): "Entfernungsbilder importieren",
        (OPERATORS, "Export Range Scans"): "Entfernungsbilder exportieren",
        (OPERATORS, "Scan from Camera"): "Von der Kamera scannen",
        (OPERATORS, "Virtual Scan"): "Virtuell scannen",
        (OPERATORS, "Colour by Scan"): "Nach Scan färben",
        (OPERATORS, "Clean Scans"): "Scans säubern",
        (OPERATORS, "Merge Scans"): "Scans vereinen",
        (OPERATORS, "Surface from Points"): "Fläche aus Punkten",
        (OPERATORS, "Sculpt Scan"): "Scan schnitzen",
        (OPERATORS, "Quad Grid"): "Vierecksgitter",
        (OPERATORS, "Cluster Surface"): "Fläche vergröbern",
        (OPERATORS, "Error Map"): "Fehlerkarte",
        (OPERATORS, "Hide Error Map"): "Fehlerkarte ausblenden",
        (OPERATORS, "Measure Distance"): "Abstand messen",
        (OPERATORS, "Cancel"): "Abbrechen",
        (PANELS, "Bring In"): "Hereinholen",
        (PANELS, "Look"): "Ansehen",
        (PANELS, "Clean"): "Säubern",
        (PANELS, "Merge"): "Vereinen",
        (PANELS, "Merge Options"): "Optionen der Vereinigung",
        (PANELS, "Reduce"): "Vereinfachen",
        (PANELS, "Measure"): "Messen",
        (PANELS, "Error Map"): "Fehlerkarte",
        (PANELS, "Report"): "Bericht",
    },
}


def register():
    """Gives Blender the dictionaries."""
    bpy.app.translations.register(__package__, LANGUAGES)


def unregister():
    """Takes them away again."""
    bpy.app.translations.unregister(__package__)
