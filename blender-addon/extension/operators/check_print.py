# SPDX-License-Identifier: GPL-3.0-or-later
"""Check whether the active mesh can be printed, and show its faults."""

import bpy
import numpy as np
import surfrecon

from .. import convert, declared, usable
from ..false_colours import CROSSING, FAULT, OVERHANG, PRINTED, THIN, WALL, show, show_materials, store_faults
from ..job import MeshOperator
from ..properties import draw_others, given, option
from ..running import Handle, Refused, still_there
from ..surfaces import in_world, of_own_faces
from ..telling import tell
from ..words import sentence

PARAMETERS = {p.name: p for p in surfrecon.parameters("check_print")}


@declared.operator("check_print")
class SURFRECON_OT_check_print(MeshOperator, bpy.types.Operator):
    """Runs the operation `check_print`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()} | {
        "show_faults": bpy.props.BoolProperty(
            name="Show faults", description="Colour the faces by their faults", default=True
        )
    }

    def draw(self, context):
        """Sidebar of the last operation."""
        layout = self.layout
        layout.use_property_split = True
        draw_others(layout, self, PARAMETERS, set())
        layout.prop(self, "show_faults")

    def launch(self, context):
        """Gathers the mesh in the world."""
        checked = usable.active(context)
        usable.writable(checked)
        matrix = np.array(checked.matrix_world, np.float64)
        if len(checked.data.polygons) == 0:
            raise Refused(f'"{checked.name}" has no faces: choose the mesh that is to be printed')
        if len(checked.modifiers) > 0:
            # The faults are stored in the object's own faces.
            tell(self, {"WARNING"}, f'"{checked.name}" is checked without its modifiers: apply them first')
        usable.refuse_unusable(checked, matrix)
        self.checked, self.count = Handle(checked), len(checked.data.polygons)
        self.faces = convert.faces_of_triangles(checked.data)
        return surfrecon.Job.check_print(in_world(of_own_faces(checked), matrix), **given(self, PARAMETERS))

    def finish(self, context, result):
        """Stores the faults of the faces and shows them."""
        (checked,) = still_there([self.checked])
        if len(checked.data.polygons) != self.count:
            raise Refused(f'"{checked.name}" was changed meanwhile: try again')
        marks, report = result.mesh.face_attributes, result.report
        wall = np.full(self.count, np.inf, np.float32)
        np.minimum.at(wall, self.faces, marks["wall"])
        # A polygon without triangles has no wall.
        wall[np.isinf(wall)] = report.wall_limit
        crossing, overhang = (self.any_of(marks[name]) for name in ("crossing", "overhang"))
        convert.store(checked.data, WALL, wall, "FACE")
        convert.store(checked.data, "crossing", crossing, "FACE")
        convert.store(checked.data, "overhang", overhang, "FACE")
        figures = convert.report_of("check_print", report)
        if report.thinnest_face is not None:
            figures["thinnest_face"] = int(self.faces[report.thinnest_face])
        checked[PRINTED] = figures
        if self.show_faults:
            faults = np.zeros(self.count, np.float32)
            for place, mask in (OVERHANG, overhang), (THIN, wall < np.float32(self.min_wall)), (CROSSING, crossing):
                faults[mask] = place
            store_faults(checked.data, faults)
            show(checked, 1, attribute=FAULT)
            show_materials(context)
        for _, text in report.findings:
            tell(self, {"WARNING"}, sentence(text))
        if not report.findings:
            tell(self, {"INFO"}, f'"{checked.name}": nothing is in the way of printing')

    def any_of(self, marks):
        """Of each polygon whether one of its triangles is marked."""
        found = np.zeros(self.count, bool)
        found[self.faces[np.asarray(marks).astype(bool)]] = True
        return found


# A sentence a line is easier to translate than one in pieces.
# ruff: noqa: E501
TRANSLATIONS = {
    "de_DE": {
        "names": {
            "Check for Printing": "Für den Druck prüfen",
            "Check whether the active mesh can be printed: openings, crossing faces, thin walls, overhangs and size": "Prüfen, ob das aktive Netz gedruckt werden kann: Öffnungen, sich schneidende Flächen, dünne Wände, Überhänge und Größe",
            "Min wall": "Dünnste Wand",
            "Max wall": "Dickste Wand",
            "Overhang": "Überhang",
            "Up of the print": "Oben beim Druck",
            "Printer width": "Breite des Druckers",
            "Printer depth": "Tiefe des Druckers",
            "Printer height": "Höhe des Druckers",
            "Density": "Dichte",
            "Show faults": "Fehler zeigen",
            "Thin wall": "Dünne Wand",
            "Crosses another": "Schneidet eine andere",
            "Faults for Printing": "Fehler für den Druck",
            "Non-manifold edges": "Nicht mannigfaltige Kanten",
            "Non-manifold vertices": "Nicht mannigfaltige Ecken",
            "Misoriented edges": "Verdrehte Kanten",
            "Crossing pairs of faces": "Sich schneidende Paare",
            "Crossing faces": "Sich schneidende Flächen",
            "Parts": "Teile",
            "Bodies": "Körper",
            "Fits into the printer": "Passt in den Drucker",
            "Volume": "Volumen",
            "Weight": "Gewicht",
            "Thinnest wall": "Dünnste Wand",
            "Face of the thinnest wall": "Fläche der dünnsten Wand",
            "Faces with thin walls": "Flächen mit dünner Wand",
            "Walls measured up to": "Wände gemessen bis",
            "Walls measured every": "Wände gemessen alle",
            "Overhanging faces": "Überhängende Flächen",
            "Area of overhangs": "Inhalt der Überhänge",
        },
        "tips": {
            "Thinnest wall that the printer makes: 0.8 mm for most. 0: none, walls are measured only": "Dünnste Wand, die der Drucker macht: 0.8 mm bei den meisten. 0: keine, Wände werden nur gemessen",
            "Walls are measured up to this thickness, and at least up to the thinnest wall that the printer makes. Thicker ones count as so thick. 0: a tenth of the diagonal of the mesh's box": "Wände werden bis zu dieser Dicke gemessen, mindestens aber bis zur dünnsten Wand, die der Drucker macht. Dickere gelten als so dick. 0: ein Zehntel der Diagonale des Quaders um das Netz",
            "Faces that look down and lean from the vertical by more than this need supports": "Flächen, die nach unten sehen und sich um mehr als dies aus der Senkrechten neigen, brauchen Stützen",
            "Direction away from the plate that is printed on": "Richtung von der Platte weg, auf der gedruckt wird",
            "Width of the space that the printer fills. 0: any": "Breite des Raums, den der Drucker füllt. 0: jede",
            "Depth of the space that the printer fills. The print may also be turned by a quarter. 0: any": "Tiefe des Raums, den der Drucker füllt. Der Druck darf auch um ein Viertel gedreht sein. 0: jede",
            "Height of the space that the printer fills. 0: any": "Höhe des Raums, den der Drucker füllt. 0: jede",
            "Weight of a unit of volume: 0.00124 for PLA, in grams and millimetres. 0: none, no weight is computed": "Gewicht einer Einheit des Volumens: 0.00124 bei PLA, in Gramm und Millimetern. 0: keines, es wird kein Gewicht berechnet",
            "Colour the faces by their faults": "Die Flächen nach ihren Fehlern färben",
        },
        "sentences": {
            '"{}" has no faces: choose the mesh that is to be printed': '"{}" hat keine Flächen: das Netz wählen, das gedruckt werden soll',
            '"{}" is checked without its modifiers: apply them first': '"{}" wird ohne seine Modifikatoren geprüft: sie erst anwenden',
            '"{}": nothing is in the way of printing': '"{}": dem Druck steht nichts im Weg',
            "checking the print of {} triangles": "den Druck von {} Dreiecken prüfen",
            "checking": "prüfen",
            "looking for crossings": "Schnitte suchen",
            "measuring walls": "Wände messen",
            "Places where the mesh is no oriented manifold: {}": "Stellen, an denen das Netz keine orientierte Mannigfaltigkeit ist: {}",
            "Openings of the mesh: {}": "Öffnungen des Netzes: {}",
            "Pairs of faces that cross: {}": "Flächenpaare, die sich schneiden: {}",
            "Bodies that are inside out: {}": "Körper, die von innen nach außen gekehrt sind: {}",
            "Bodies in the solid of another: {}": "Körper im Inneren eines anderen: {}",
            "Bodies that hang together nowhere: {}": "Körper, die nirgends zusammenhängen: {}",
            "The smallest has a volume of {}, at {}": "Der kleinste hat ein Volumen von {}, bei {}",
            "The first is at {}": "Der erste ist bei {}",
            "The first are {} and {}, at {}": "Die ersten sind {} und {}, bei {}",
            "The mesh encloses no volume": "Das Netz umschließt kein Volumen",
            "Give it a thickness": "Ihm eine Dicke geben",
            "the mesh has no triangles, but must have some: give a surface": "das Netz hat keine Dreiecke, muss aber welche haben: eine Fläche angeben",
            "The mesh is {} x {} x {}: too large for the printer's width and depth of {} x {}": "Das Netz ist {} x {} x {}: zu groß für die Breite und Tiefe des Druckers von {} x {}",
            "The mesh is {} x {} x {}: too large for the printer's width of {}": "Das Netz ist {} x {} x {}: zu groß für die Breite des Druckers von {}",
            "The mesh is {} x {} x {}: too large for the printer's depth of {}": "Das Netz ist {} x {} x {}: zu groß für die Tiefe des Druckers von {}",
            "The mesh is {} x {} x {}: too large for the printer's height of {}": "Das Netz ist {} x {} x {}: zu groß für die Höhe des Druckers von {}",
            "Faces with walls thinner than {}: {}": "Flächen mit Wänden dünner als {}: {}",
            "The thinnest is {}, at {}": "Die dünnste ist {}, bei {}",
            "Faces that hang over by more than {} degrees: {}": "Flächen, die um mehr als {} Grad überhängen: {}",
            "Merge its scans again, or repair these places": "Seine Scans noch einmal vereinen, oder diese Stellen reparieren",
            "Close them": "Sie schließen",
            "Move or remove these faces": "Diese Flächen verschieben oder entfernen",
            "Flip their faces": "Ihre Flächen umdrehen",
            "Remove them, or flip the faces of those that are cavities": "Sie entfernen, oder die Flächen derer umdrehen, die Hohlräume sind",
            "Remove those that are not to be printed": "Die entfernen, die nicht gedruckt werden sollen",
            "Scale it, or cut it into parts": "Es skalieren oder in Teile schneiden",
            "Thicken it there, or print it larger": "Es dort verdicken oder größer drucken",
            "Turn the object, or print it with supports": "Das Objekt drehen oder mit Stützen drucken",
        },
    }
}
