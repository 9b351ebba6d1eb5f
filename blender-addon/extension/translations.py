# SPDX-License-Identifier: GPL-3.0-or-later
"""Translations: a dictionary a language, by Blender's own way. English texts are the keys.

Another language is another entry of `LANGUAGES`. Each has all names, titles and figures, and the tooltips of operators;
what explains an option, and what is said in sentences, stays English.
"""
# A text a line is easier to translate than one in pieces.
# ruff: noqa: E501

import bpy

# Blender's own contexts: names of operators, and all else. Blender's words win in its contexts ("Triangles" is its verb), so
# names and figures have one of ours; tooltips can't.
OPERATORS, TEXTS, NAMES = "Operator", "*", "surfrecon"

# Properties that Blender's helpers make, whose names it has in all its languages.
BLENDERS = {"axis_forward", "axis_up"}

GERMAN_OPERATORS = {
    "Import Range Scans": "Entfernungsbilder importieren",
    "Export Range Scans": "Entfernungsbilder exportieren",
    "Scan from Camera": "Von der Kamera scannen",
    "Virtual Scan": "Virtuell scannen",
    "Colour by Scan": "Nach Scan färben",
    "Clean Scans": "Scans säubern",
    "Align Scans": "Scans ausrichten",
    "Merge Scans": "Scans vereinen",
    "Surface from Points": "Fläche aus Punkten",
    "Sculpt Scan": "Scan schnitzen",
    "Quad Grid": "Vierecksgitter",
    "Cluster Surface": "Fläche vergröbern",
    "Error Map": "Fehlerkarte",
    "Hide Error Map": "Fehlerkarte ausblenden",
    "Measure Distance": "Abstand messen",
    "Cancel": "Abbrechen",
}

GERMAN_TEXTS = {
    # What operators do
    "Import range scans with their grids and poses, one object a scan": "Entfernungsbilder mit ihren Gittern und Lagen importieren, jeder Scan ein Objekt",
    "Export the selected range scans with their grids and poses": "Die ausgewählten Entfernungsbilder mit ihren Gittern und Lagen exportieren",
    "Make a range scan of what the scene's camera sees of the selected objects, so that it can be sculpted": "Aus dem, was die Kamera der Szene von den ausgewählten Objekten sieht, ein Entfernungsbild machen, das geschnitzt werden kann",
    "Scan the selected objects with the scene's cameras as a real scanner would, with the noise and gaps asked for": "Die ausgewählten Objekte mit den Kameras der Szene scannen wie ein echter Scanner, mit so viel Rauschen und Lücken wie verlangt",
    "Show each scan in a colour of its own in the solid view: overlaps are seen, and how well the scans fit": "Jeden Scan in der soliden Ansicht in eigener Farbe zeigen: man sieht, wo Scans sich überlappen und wie gut sie passen",
    "Remove doubtful samples from the selected scans: small parts that hang on nothing, and low confidence": "Zweifelhafte Messpunkte aus den ausgewählten Scans entfernen: kleine lose Teile und solche geringer Verlässlichkeit",
    "Move and turn the selected scans to where they fit each other; those with locked location and rotation stay": "Die ausgewählten Scans dorthin schieben und drehen, wo sie aneinander passen; wessen Position und Drehung gesperrt sind, der bleibt",
    "Merge the selected scans, or any selected oriented meshes, into one new surface": "Die ausgewählten Scans, oder beliebige Netze mit einer Außenseite, zu einer neuen Fläche vereinen",
    "Make a surface through the vertices or points of the selected objects, whatever faces they have": "Eine Fläche durch die Ecken oder Punkte der ausgewählten Objekte legen, gleich welche Flächen sie haben",
    "Make a mesh of few triangles from the active scan that stays within a tolerance of every sample": "Aus dem aktiven Scan ein Netz weniger Dreiecke machen, das von keinem Messpunkt weiter abweicht als die Toleranz",
    "Make a regular grid of quads of the active scan, dense where the surface bends": "Aus dem aktiven Scan ein regelmäßiges Gitter von Vierecken machen, dicht, wo sich die Fläche krümmt",
    "Make a coarser mesh of well-shaped triangles from the active surface or points, or a chain of levels of detail": "Aus der aktiven Fläche oder ihren Punkten ein gröberes Netz wohlgeformter Dreiecke machen, oder eine Reihe von Detailstufen",
    "Colour the active surface by its distance to the other selected objects, or to its sources": "Die aktive Fläche nach ihrem Abstand von den anderen ausgewählten Objekten färben, oder von dem, woraus sie entstand",
    "Show the selected objects in their own materials again; the measured errors stay as an attribute": "Die ausgewählten Objekte wieder in ihren eigenen Materialien zeigen; die gemessenen Fehler bleiben als Attribut",
    "Measure how far the active surface is from the others selected, or its sources, with a limit no point exceeds": "Messen, wie weit die aktive Fläche von den anderen ausgewählten oder von ihren Quellen entfernt ist, mit einer Schranke, die kein Punkt überschreitet",
    "Stop the running operation; the scene stays as it was": "Die laufende Operation anhalten; die Szene bleibt, wie sie war",
    # Titles
    "Range Scans": "Entfernungsbilder",
    "Bring In": "Hereinholen",
    "Look": "Ansehen",
    "Clean": "Säubern",
    "Merge": "Vereinen",
    "Merge Options": "Optionen der Vereinigung",
    "Reduce": "Vereinfachen",
    "Measure": "Messen",
    "Error Map": "Fehlerkarte",
    "Report": "Bericht",
    # Options
    "0: measured from the scans": "0: aus den Scans gemessen",
    "Active": "Aktive",
    "Adaptivity": "Anpassung",
    "All": "Alle",
    "Along the ray": "Längs des Strahls",
    "An object a level": "Ein Objekt je Stufe",
    "As preferred": "Wie eingestellt",
    "Auto": "Automatisch",
    "Backfaces": "Rückseiten",
    "Background curvature": "Krümmung des Hintergrunds",
    "Both ways": "In beide Richtungen",
    "Cameras": "Kameras",
    "Centimetres": "Zentimeter",
    "Centre": "Mitte",
    "Close holes": "Löcher schließen",
    "Closed": "Geschlossen",
    "Closure": "Abschluss",
    "Columns a tile": "Spalten je Kachel",
    "Control columns": "Kontrollspalten",
    "Control rows": "Kontrollzeilen",
    "Coverage": "Abdeckung",
    "Curvature limit": "Grenze der Krümmung",
    "Curvature unit": "Einheit der Krümmung",
    "Depth": "Tiefe",
    "Depth images": "Tiefenbilder",
    "Dropout": "Ausfälle",
    "Dropout grazing": "Ausfälle bei Streifen",
    "E57 (.e57)": "E57 (.e57)",
    "Edge limit": "Längste Kante",
    "Effort": "Aufwand",
    "Exponent": "Exponent",
    "Factor": "Faktor",
    "Feet": "Fuß",
    "Fitting": "Einpassung",
    "Floor": "Sockel",
    "Focal length": "Brennweite",
    "Format": "Format",
    "Free": "Frei",
    "Full scale": "Voller Ausschlag",
    "Gap neighbours": "Nachbarn einer Lücke",
    "Gap passes": "Durchgänge für Lücken",
    "Global": "Global",
    "Grazing limit": "Grenzwinkel",
    "Height maps": "Höhenkarten",
    "Images": "Bilder",
    "Inches": "Zoll",
    "Interpolate": "Interpolieren",
    "Iterations": "Durchgänge",
    "Keep": "Behalten",
    "Largest error": "Größter Fehler",
    "Least confidence": "Geringste Verlässlichkeit",
    "Level": "Stufe",
    "Levels": "Stufen",
    "Local": "Lokal",
    "Manifold": "Mannigfaltigkeit",
    "Match exposure": "Belichtung angleichen",
    "Max error": "Größter Fehler",
    "Max hole length": "Längster Lochrand",
    "Max range": "Größte Reichweite",
    "Memory limit": "Grenze des Speichers",
    "Merge distance": "Abstand der Vereinigung",
    "Metres": "Meter",
    "Micrometres": "Mikrometer",
    "Millimetres": "Millimeter",
    "Min angle": "Kleinster Winkel",
    "Move if far": "Verschieben, wenn weit",
    "Numbers": "Zahlen",
    "NURBS Surface": "NURBS-Fläche",
    "Noise": "Rauschen",
    "Noise grazing": "Rauschen bei Streifen",
    "Open": "Offen",
    "Order": "Ordnung",
    "Origin": "Ursprung",
    "Other": "Andere",
    "Pixels": "Pixel",
    "PTX (.ptx)": "PTX (.ptx)",
    "Patches": "Flecken",
    "Pixel size": "Größe eines Pixels",
    "Planar": "Zur Ebene",
    "Pose shift": "Fehler der Lage",
    "Pose turn": "Fehler der Richtung",
    "Quads": "Vierecke",
    "Quantum": "Schrittweite",
    "RMS error": "RMS-Fehler",
    "Reach": "Reichweite",
    "Relative tolerance": "Relative Toleranz",
    "Relaxation": "Entspannung",
    "Resolution": "Auflösung",
    "Result": "Ergebnis",
    "Rough": "Ungefähr",
    "Rows a tile": "Zeilen je Kachel",
    "Scale": "Skalierung",
    "Scene units": "Einheiten der Szene",
    "Seed": "Startwert",
    "Selected": "Ausgewählte",
    "Selection": "Auswahl",
    "mesh": "Netz",
    "meshes": "Netze",
    "scan": "Scan",
    "scans": "Scans",
    "Show error": "Fehler zeigen",
    "Signed": "Mit Vorzeichen",
    "Simplify borders": "Ränder vereinfachen",
    "Min overlap (share)": "Kleinste Überlappung (Anteil)",
    "No": "Nein",
    "Smallest part": "Kleinster Teil",
    "Show misfit": "Abweichung zeigen",
    "Smallest part (share)": "Kleinster Teil (Anteil)",
    "Smoothing": "Glättung",
    "Stanford (.conf)": "Stanford (.conf)",
    "Start": "Anfang",
    "Subdivision": "Unterteilung",
    "Terrain RGB": "Terrain RGB",
    "Terrarium": "Terrarium",
    "Turned": "Gedreht",
    "Turned by equal steps": "Gedreht in gleichen Schritten",
    "Turntable": "Drehteller",
    "Use colour": "Farbe verwenden",
    "Threads": "Threads",
    "Threshold": "Schwelle",
    "Tiles across": "Kacheln quer",
    "Tiles down": "Kacheln abwärts",
    "Tolerance": "Toleranz",
    "Topology": "Topologie",
    "Toward the camera": "Zur Kamera",
    "Triangles": "Dreiecke",
    "Triangulate": "Triangulieren",
    "Unit": "Einheit",
    "Unknown": "Unbekannt",
    "Frame": "Ins Bild rücken",
    "Hide sources": "Quellen ausblenden",
    "Unit of files": "Einheit der Dateien",
    "Value scale": "Skalierung der Werte",
    "Vertices": "Ecken",
    "Voxel": "Voxel",
    # Figures
    "95 % below": "95 % unter",
    "Against": "Gegen",
    "Case a, b, c": "Fall a, b, c",
    "Closed up to": "Geschlossen bis",
    "Edges cut": "Geschnittene Kanten",
    "Either way at most": "In beide Richtungen höchstens",
    "From there: RMS": "Von dort: RMS",
    "Gaps filled": "Gefüllte Lücken",
    "Groups": "Gruppen",
    "Holes closed, left": "Löcher geschlossen, offen",
    "Inside, outside": "Innen, außen",
    "Largest found": "Größter gefundener",
    "Max": "Größter",
    "Mean": "Mittel",
    "Mean smallest angle": "Mittlerer kleinster Winkel",
    "Memory": "Speicher",
    "Not finite, copies": "Nicht endlich, doppelt",
    "Nowhere more than": "Nirgends mehr als",
    "Of all": "Von allen",
    "Of the uniform grid": "Des gleichmäßigen Gitters",
    "On the surface": "Auf der Fläche",
    "Points": "Punkte",
    "RMS": "RMS",
    "Relative error": "Relativer Fehler",
    "Removed: in small parts": "Entfernt: in kleinen Teilen",
    "Removed: of low confidence": "Entfernt: geringer Verlässlichkeit",
    "Samples": "Messpunkte",
    "Samples not covered": "Nicht bedeckte Messpunkte",
    "Scans": "Scans",
    "Scans disagree by": "Scans weichen ab um",
    "Scans placed": "Scans am Platz",
    "Stray parts dropped": "Lose Teile entfernt",
    "Noise of the samples": "Rauschen der Messpunkte",
    "Chosen as": "Gewählt als",
    "Across the rays": "Quer zum Strahl",
    "In steps of": "In Stufen von",
    "Shared over": "Gemeinsam über",
    "Exposures matched by": "Belichtungen angeglichen um",
    "Dropped as seen through": "Durchschaut, daher entfernt",
    "Smallest angle": "Kleinster Winkel",
    "Surface off the grid by": "Fläche neben dem Gitter um",
    "Taken as": "Betrachtet als",
    "Tetrahedra": "Tetraeder",
    "Their triangles": "Ihre Dreiecke",
    "Tiles": "Kacheln",
    "Time": "Zeit",
}

LANGUAGES = {
    "de_DE": {(OPERATORS, text): german for text, german in GERMAN_OPERATORS.items()}
    | {(context, text): german for context in (TEXTS, NAMES) for text, german in GERMAN_TEXTS.items()},
}


def in_our_words(cls):
    """A class whose properties' names are looked up among ours; to be registered."""
    declared = (item for base in cls.__mro__ for item in vars(base).get("__annotations__", {}).items())
    for name, prop in declared:
        if name not in BLENDERS and hasattr(prop, "keywords"):
            prop.keywords.setdefault("translation_context", NAMES)
    return cls


def word(text):
    """A name in the language of the interface."""
    return bpy.app.translations.pgettext_iface(text, NAMES)


def register():
    """Gives Blender the dictionaries."""
    bpy.app.translations.register(__package__, LANGUAGES)


def unregister():
    """Takes them away again."""
    bpy.app.translations.unregister(__package__)
