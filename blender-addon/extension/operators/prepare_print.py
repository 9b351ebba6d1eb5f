# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the closed active mesh ready for printing: size, base, walls, cavity, parts."""

import bpy
import numpy as np
import surfrecon
from mathutils import Matrix

from .. import convert, declared, scan_objects, usable
from ..job import MeshOperator
from ..properties import draw_others, given, option
from ..running import Handle, Refused, gathered
from ..scene import dress, link, put_forward
from ..sources import note
from ..surfaces import in_world
from ..telling import tell
from ..words import sentence

REPORT = "surfrecon_prepare_print"

PARAMETERS = {p.name: p for p in surfrecon.parameters("prepare_print")}
# Each step with the options that are of use only with it.
STEPS = (
    ("scale_to", ("scale_side",)),
    ("flat_base", ("base_height",)),
    ("min_wall", ()),
    ("hollow", ("hollow_cell", "drain")),
    ("drain", ("drain_sides",)),
    ("printer_width", ()),
    ("printer_depth", ()),
    ("printer_height", ()),
)


@declared.operator("prepare_print")
class SURFRECON_OT_prepare_print(MeshOperator, bpy.types.Operator):
    """Runs the operation `prepare_print`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()}

    def draw(self, context):
        """Sidebar of the last operation: a step, then what belongs to it."""
        layout = self.layout
        layout.use_property_split = True
        drawn = set()
        idle = self.idle()
        for step, parts in STEPS:
            column = layout.column(align=True)
            if step not in drawn:
                column.prop(self, step)
            below = column.column(align=True)
            below.active = not idle.intersection(parts)
            for name in parts:
                below.prop(self, name)
            drawn |= {step, *parts}
        draw_others(layout, self, PARAMETERS, drawn)

    def idle(self):
        """The options that have no use, as the step that they belong to is left out."""
        found = set()
        for step, parts in STEPS:
            if step in found or not getattr(self, step):
                found |= set(parts)
        return found

    def launch(self, context):
        """Gathers the mesh in the world."""
        source = usable.active(context)
        if scan_objects.is_range_image(source):
            raise Refused(f'"{source.name}" is a scan: merge the scans first, and close their surface')
        self.source = Handle(source)
        ((mesh, matrix, _),) = yield from gathered(context, [source], scan_objects.scan_of_object)
        # Greyed out.
        options = given(self, PARAMETERS) | dict.fromkeys(self.idle())
        return surfrecon.Job.prepare_print(in_world(mesh, matrix), **options)

    def finish(self, context, result):
        """Puts what is to be printed beside the mesh: an object for each part."""
        source, parts, report = self.source.get(), result.parts, result.report
        figures = convert.report_of("prepare_print", report)
        made = []
        for number, part in enumerate(parts, 1):
            name = f"{self.source.name} for printing" + (f" {number}" if len(parts) > 1 else "")
            obj = bpy.data.objects.new(name, convert.mesh_from_result(name, part))
            obj.matrix_world = Matrix.Identity(4)
            obj[REPORT] = figures
            note(obj, [source], [self.source.name])
            link(context, obj)
            made.append(obj)
        if source is not None:
            depsgraph = context.evaluated_depsgraph_get()
            for obj in made:
                dress(obj, [source], depsgraph)
        put_forward(context, made, [] if source is None else [source])
        size = " x ".join(f"{side:.4g}" for side in np.array(report.size))
        tell(self, {"INFO"}, f"{size}, parts: {report.parts:,}")
        for _, text in report.notes:
            tell(self, {"WARNING"}, sentence(text))


# A sentence a line is easier to translate than one in pieces.
# ruff: noqa: E501
TRANSLATIONS = {
    "de_DE": {
        "names": {
            "Prepare for Printing": "Für den Druck vorbereiten",
            "Make the closed active mesh ready for printing: size, flat base, thicker walls, cavity with a drain, parts": "Das geschlossene aktive Netz für den Druck vorbereiten: Größe, flacher Fuß, dickere Wände, Hohlraum mit Abfluss, Teile",
            "Scale to": "Skalieren auf",
            "Scaled side": "Skalierte Seite",
            "Longest side": "Längste Seite",
            "Height": "Höhe",
            "Height of the base": "Höhe des Fußes",
            "Hollow": "Aushöhlen",
            "Cell of the cavity": "Zelle des Hohlraums",
            "Drain": "Abfluss",
            "Sides of the drain": "Seiten des Abflusses",
            "Scale": "Maßstab",
            "Size": "Größe",
            "Volume before": "Volumen vorher",
            "Deviation": "Abweichung",
            "Added faces": "Neue Flächen",
            "Faces of the base": "Flächen des Fußes",
            "Area of the base": "Inhalt des Fußes",
            "Thinnest wall before": "Dünnste Wand vorher",
            "Thinnest wall after": "Dünnste Wand nachher",
            "Moved faces": "Bewegte Flächen",
            "Thinnest wall of the cavity": "Dünnste Wand am Hohlraum",
            "Thickest wall of the cavity": "Dickste Wand am Hohlraum",
            "Shut cavities": "Verschlossene Hohlräume",
            "Room for a drain": "Platz für einen Abfluss",
            "Drained": "Mit Abfluss",
        },
        "tips": {
            "Length of the side of the result: 0.1 for a print of 10 cm, if the unit is a metre. All sides are scaled alike. 0: the size stays": "Länge der Seite des Ergebnisses: 0.1 für einen Druck von 10 cm, wenn die Einheit ein Meter ist. Alle Seiten werden gleich skaliert. 0: die Größe bleibt",
            "The side that gets this length": "Die Seite, die diese Länge bekommt",
            "The longest of the sides along x, y and z": "Die längste der Seiten entlang x, y und z",
            "The side along up": "Die Seite entlang oben",
            "Stands the mesh on a flat face: the part below the height of the base is cut off. Off: nothing is cut off": "Stellt das Netz auf eine flache Fläche: der Teil unter der Höhe des Fußes wird abgeschnitten. Aus: nichts wird abgeschnitten",
            "Height of the base above the lowest point. 0: 0 if the mesh stands on a face, else at most a 50th of its height": "Höhe des Fußes über dem tiefsten Punkt. 0: 0, wenn das Netz auf einer Fläche steht, sonst höchstens ein Fünfzigstel seiner Höhe",
            "Thinnest wall that the printer makes. Thinner ones are made as thick, where there is room. 0: no wall is moved": "Dünnste Wand, die der Drucker macht. Dünnere werden so dick gemacht, wo Platz ist. 0: keine Wand wird bewegt",
            "Thickness of the walls around a cavity. Larger ones make smaller cavities. 0: nothing is hollowed out": "Dicke der Wände um einen Hohlraum. Größere machen kleinere Hohlräume. 0: nichts wird ausgehöhlt",
            "Size of the cells in which the cavity is made, at most a third of the walls. Smaller ones take more memory and time. 0: a 256th of the longest side, but from a quarter to a third of the walls": "Größe der Zellen, in denen der Hohlraum entsteht, höchstens ein Drittel der Wände. Kleinere brauchen mehr Speicher und Zeit. 0: ein 256stel der längsten Seite, aber von einem Viertel bis zu einem Drittel der Wände",
            "Diameter of a hole that leads from the base into the cavity, so that resin or powder runs out. It needs a base and a cavity. 0: the cavity stays shut": "Durchmesser eines Lochs, das vom Fuß in den Hohlraum führt, damit Harz oder Pulver herausläuft. Es braucht einen Fuß und einen Hohlraum. 0: der Hohlraum bleibt verschlossen",
            "Sides of the hole, which is a prism": "Seiten des Lochs, das ein Prisma ist",
            "Size across up of the space that the printer fills: along x, or along y if up is along x. Larger meshes are cut into parts. 0: any": "Größe quer zu oben des Raums, den der Drucker füllt: entlang x, oder entlang y, wenn oben entlang x ist. Größere Netze werden in Teile geschnitten. 0: jede",
            "Size across up of the space that the printer fills: along y, or along z if up is not along z. 0: any": "Größe quer zu oben des Raums, den der Drucker füllt: entlang y, oder entlang z, wenn oben nicht entlang z ist. 0: jede",
            "Size along up of the space that the printer fills. 0: any": "Größe entlang oben des Raums, den der Drucker füllt. 0: jede",
        },
        "sentences": {
            "{}, parts: {}": "{}, Teile: {}",
            "cutting the base": "den Fuß schneiden",
            "thickening walls": "Wände verdicken",
            "hollowing out": "aushöhlen",
            "draining": "Abfluss schneiden",
            "cutting into parts": "in Teile schneiden",
            "preparing the print of {} triangles": "den Druck von {} Dreiecken vorbereiten",
            "a cavity on a grid of {} nodes": "ein Hohlraum auf einem Gitter von {} Knoten",
            "a cavity on a grid of {} nodes is more than 2^32: {}": "ein Hohlraum auf einem Gitter von {} Knoten ist mehr als 2^32: {}",
            'give a larger "Cell of the cavity" or thicker walls': 'eine größere "Zelle des Hohlraums" oder dickere Wände angeben',
            "the mesh has no triangles, but must have some: give a closed mesh": "das Netz hat keine Dreiecke, muss aber welche haben: ein geschlossenes Netz angeben",
            "the mesh must be a closed, oriented manifold, but it has {}: merge its scans again, or repair these places first": "das Netz muss eine geschlossene, orientierte Mannigfaltigkeit sein, hat aber {}: seine Scans noch einmal vereinen, oder diese Stellen erst reparieren",
            "the mesh has {}: close it first, by the operation close": "das Netz hat {}: es erst schließen, mit der Operation close",
            "{} of faces cross, the first are {} and {}: check the print to see all, and repair these places first": "{} von Flächen schneiden sich, die ersten sind {} und {}: den Druck prüfen, um alle zu sehen, und diese Stellen erst reparieren",
            "the factor that scales the mesh": "der Faktor, der das Netz skaliert",
            "openings": "Öffnungen",
            "pair": "Paar",
            "pairs": "Paare",
            "cavity": "Hohlraum",
            "cavities": "Hohlräume",
            "{} inside out, the first at {}: flip its faces first": "{} von innen nach außen gekehrt, der erste bei {}: seine Flächen erst umdrehen",
            "{} in the solid of another, the first at {}: remove it first, or flip its faces if it is a cavity": "{} im Inneren eines anderen, der erste bei {}: ihn erst entfernen, oder seine Flächen umdrehen, wenn er ein Hohlraum ist",
            "body is": "Körper ist",
            "bodies are": "Körper sind",
            "body lies": "Körper liegt",
            "bodies lie": "Körper liegen",
            '"Scaled side" is given without "Scale to", but has no use then: give "Scale to", too': '"Skalierte Seite" ist ohne "Skalieren auf" angegeben, und nützt dann nichts: auch "Skalieren auf" angeben',
            '"Sides of the drain" is given without drain, but has no use then: give drain, too': '"Seiten des Abflusses" ist ohne "Abfluss" angegeben, und nützt dann nichts: auch "Abfluss" angeben',
            "The side is {} long, not {}: walls as thick as asked for take more room": "Die Seite ist {} lang, nicht {}: so dicke Wände brauchen mehr Platz",
            "the mesh encloses no volume: give it a thickness first": "das Netz umschließt kein Volumen: ihm erst eine Dicke geben",
            "min_wall is {}, but the longest side of the mesh is {}: give less than that, in the unit of the mesh": "die dünnste Wand ist {}, aber die längste Seite des Netzes ist {}: weniger angeben, in der Einheit des Netzes",
            "the printer's size cuts the mesh into {} parts: at most {} are made, give a larger printer": "die Größe des Druckers zerschneidet das Netz in {} Teile: höchstens {} werden gemacht, einen größeren Drucker angeben",
            '"Height of the base" is {}, but the mesh is {} high along {}: give less than that': '"Höhe des Fußes" ist {}, aber das Netz ist {} hoch entlang {}: weniger angeben',
            '"Height of the base" is given without "Flat base", but has no use then: give "Flat base", too': '"Höhe des Fußes" ist ohne "Flacher Fuß" angegeben, und nützt dann nichts: auch "Flacher Fuß" angeben',
            "drain is given without {}, but leads from a flat base into a cavity: give {}, too": "ein Abfluss ist ohne {} angegeben, führt aber von einem flachen Fuß in einen Hohlraum: auch {} angeben",
            '"Cell of the cavity" is given without hollow, but has no use then: give hollow, too': '"Zelle des Hohlraums" ist ohne "Aushöhlen" angegeben, und nützt dann nichts: auch "Aushöhlen" angeben',
            '"Cell of the cavity" is {}, but must be at most a third of hollow, which is {}': '"Zelle des Hohlraums" ist {}, darf aber höchstens ein Drittel von "Aushöhlen" sein, und das ist {}',
            "the mesh can't be cut at {} along {}, where rounding makes its faces cross: cut it elsewhere": "das Netz kann bei {} entlang {} nicht geschnitten werden, weil Runden dort seine Flächen sich schneiden lässt: es woanders schneiden",
            "{} is {}, but the mesh is {} long there: at most {} parts are made, give at least {}": "{} ist {}, aber das Netz ist dort {} lang: höchstens {} Teile werden gemacht, wenigstens {} angeben",
            "The base lies {} above the lowest point, {} beside the height asked for: rounding would make faces cross there": "Der Fuß liegt {} über dem tiefsten Punkt, {} neben der verlangten Höhe: Runden würde dort Flächen sich schneiden lassen",
            "The mesh does not stand on a face, and nothing lies below the base: give a larger height": "Das Netz steht auf keiner Fläche, und nichts liegt unter dem Fuß: eine größere Höhe angeben",
            'The mesh stands on no face that a hole could lead from: give a larger "Height of the base"': 'Das Netz steht auf keiner Fläche, von der ein Loch ausgehen könnte: eine größere "Höhe des Fußes" angeben',
            "A hole of {} finds no room in the floor of the cavity, where {} fits: give a smaller drain or a higher base": "Ein Loch von {} hat keinen Platz im Boden des Hohlraums, wo {} passt: einen kleineren Abfluss oder höheren Fuß angeben",
            "A hole of that diameter would cross the surface beside the base: give a smaller drain or a higher base": "Ein Loch dieses Durchmessers würde die Fläche neben dem Fuß schneiden: einen kleineren Abfluss oder höheren Fuß angeben",
            "There is no cavity that a hole could lead into: give thinner walls": "Es gibt keinen Hohlraum, in den ein Loch führen könnte: dünnere Wände angeben",
            "The drain leads into one cavity, and {} stay shut: give thicker walls": "Der Abfluss führt in einen Hohlraum, und {} bleiben verschlossen: dickere Wände angeben",
            "The mesh is nowhere thicker than two walls of {}: give thinner ones": "Das Netz ist nirgends dicker als zwei Wände von {}: dünnere angeben",
            "Parts meet at {} along {}, {} beside the place of equal parts: rounding would make faces cross there": "Teile treffen sich bei {} entlang {}, {} neben der Stelle gleicher Teile: Runden würde dort Flächen sich schneiden lassen",
            "{} walls thinner than {}, at sharp edges or where there is no room: print it larger": "{} Wände dünner als {}, an scharfen Kanten oder wo kein Platz ist: es größer drucken",
            "{} where others do, the first at {}. STL joins bodies that touch: move them apart, or give another height": "{} wo andere liegen, der erste bei {}. STL verbindet Körper, die sich berühren: sie auseinanderrücken, oder eine andere Höhe angeben",
            "{} where others do in single precision, the first at {}. STL and 3MF join them: give another size or cell, or move the mesh to the origin": "{} wo in einfacher Genauigkeit andere liegen, der erste bei {}. STL und 3MF verbinden sie: eine andere Größe oder Zelle angeben, oder das Netz zum Ursprung rücken",
            "Faces cross in single precision, which STL and 3MF hold: move the mesh to the origin, or make it with a larger cell": "Flächen schneiden sich in einfacher Genauigkeit, die STL und 3MF haben: das Netz zum Ursprung rücken, oder es mit größerer Zelle machen",
            "{} vertex lies": "{} Punkt liegt,",
            "{} vertices lie": "{} Punkte liegen,",
            "The attribute thin marks them": "Das Attribut thin markiert sie",
            "{} face still has": "{} Fläche hat noch",
            "{} faces still have": "{} Flächen haben noch",
        },
    }
}
