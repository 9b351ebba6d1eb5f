# SPDX-License-Identifier: GPL-3.0-or-later
"""Close the openings of the active surface, and keep out of what its scans saw to be empty."""

import bpy
import numpy as np
import surfrecon
from mathutils import Matrix

from .. import convert, declared, recording, scan_objects, usable
from ..job import MeshOperator
from ..properties import draw_others, given, option
from ..running import Handle, Refused, gathered
from ..scene import dress, group_filled, link, put_forward
from ..sources import all_sources_of, note, what_is_gone
from ..surfaces import in_world, is_mirrored
from ..telling import tell
from ..words import sentence

REPORT = "surfrecon_close"

PARAMETERS = {p.name: p for p in surfrecon.parameters("close")}


@declared.operator("close")
class SURFRECON_OT_close_surface(MeshOperator, bpy.types.Operator):
    """Runs the operation `close`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()}

    def draw(self, context):
        """Sidebar of the last operation."""
        layout = self.layout
        layout.use_property_split = True
        above = ("openings", "max_hole_length", "flat_base", "base_up", "base_depth")
        for name in above:
            row = layout.row()
            row.active = name not in self.idle()
            row.prop(self, name)
        draw_others(layout, self, PARAMETERS, set(above))

    def idle(self):
        """The options that have no use with the others: they are greyed out."""
        return ({"base_up", "base_depth"} if not self.flat_base else set()) | (
            {"max_hole_length"} if self.openings != "holes" else set()
        )

    def launch(self, context):
        """Gathers the surface, and the scans that are selected beside it, or that it was made from."""
        surface = usable.active(context)
        if scan_objects.is_range_image(surface):
            raise Refused(f'"{surface.name}" is a scan: merge the scans first, and close their surface')
        scans = [obj for obj in context.selected_objects if obj is not surface and says_what_it_saw(obj)]
        if not scans:
            scans = [obj for obj in all_sources_of([surface]) if says_what_it_saw(obj)]
            gone = what_is_gone(surface)
            if gone:
                tell(self, {"WARNING"}, f"{gone}: what they saw to be empty is not known")
        self.surface, self.scans = Handle(surface), [Handle(obj) for obj in scans]
        ((mesh, self.matrix, _),) = yield from gathered(context, [surface], scan_objects.scan_of_object)
        self.positions = mesh.positions
        read = yield from gathered(context, scans, recording.scan_or_frames)
        options = given(self, PARAMETERS) | dict.fromkeys(self.idle())
        return surfrecon.Job.close(in_world(mesh, self.matrix), recording.of_all(read), **options)

    def finish(self, context, result):
        """Puts the closed surface beside the open one."""
        surface, matrix = self.surface.get(), self.matrix
        name = f"{self.surface.name} closed"
        mesh = convert.mesh_from_result(name, result.mesh)
        local = (result.mesh.positions - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
        # The measured vertices are those of the surface, to the bit.
        local[: len(self.positions)] = self.positions
        mesh.attributes["position"].data.foreach_set("vector", np.float32(local).reshape(-1))
        if is_mirrored(matrix):
            mesh.flip_normals()
        mesh.update()
        made = bpy.data.objects.new(name, mesh)
        made.matrix_world = Matrix(matrix.tolist())
        made[REPORT] = convert.report_of("close", result.report)
        link(context, made)
        group_filled(made)
        sources = self.scans or [self.surface]
        note(made, [source.get() for source in sources], [source.name for source in sources])
        dress(made, [surface], context.evaluated_depsgraph_get())
        put_forward(context, [made], [] if surface is None else [surface])
        report, self.positions = result.report, None
        tell(self, {"INFO"}, f"{report.closed:,} openings closed, {len(report.open):,} left open")
        if report.open:
            tell(self, {"WARNING"}, sentence(report.open[0][1]))


def says_what_it_saw(obj):
    """Whether an object is a scan whose rays may be known: a range image, or frames of a recording."""
    return scan_objects.is_range_image(obj) or recording.is_recording(obj)


# A sentence a line is easier to translate than one in pieces.
# ruff: noqa: E501
TRANSLATIONS = {
    "de_DE": {
        "names": {
            "Close Surface": "Fläche schließen",
            "Close the openings of the active surface with a smooth fill that stays out of what its scans saw to be empty": "Die Öffnungen der aktiven Fläche mit einer glatten Füllung schließen, die frei lässt, was ihre Scans leer sahen",
            "Flat base": "Flacher Fuß",
            "Force": "Erzwingen",
            "Inside the scans": "Umschlossene",
            "Openings": "Öffnungen",
            "Up of the base": "Oben am Fuß",
            "Depth of the base": "Tiefe des Fußes",
            "Area filled": "Gefüllte Fläche",
            "Cell of the fill": "Zelle der Füllung",
            "Filled": "Gefüllt",
            "Filled in seen space": "In gesehenem Raum gefüllt",
            "Keeps out of seen space": "Meidet gesehenen Raum",
            "Largest opening closed": "Größte geschlossene Öffnung",
            "Left open, by reason": "Offen, nach Grund",
            "Openings closed": "Geschlossene Öffnungen",
            "Vertices, triangles added": "Neue Ecken, Dreiecke",
        },
        "tips": {
            "Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a cell": "Öffnungen, die geschlossen werden. Nichts wird gefüllt, wo ein Scan um mehr als den Vereinungsabstand und eine halbe Zelle hindurchsah",
            "Everything that seen space allows: the result is closed": "Alles, was gesehener Raum zulässt: das Ergebnis ist geschlossen",
            "Openings that seen space or the surface surrounds: what lies before them is a pocket that nobody saw. A bowl's rim, a relief's border and the foot of a statue stay open": "Öffnungen, die gesehener Raum oder die Fläche umgibt: vor ihnen liegt eine Tasche, die niemand sah. Der Rand einer Schale, die Grenze eines Reliefs und der Fuß einer Statue bleiben offen",
            "Openings whose boundaries are at most as long as the longest hole": "Öffnungen, deren Ränder höchstens so lang sind wie der längste Lochrand",
            "None: the surface stays as it is, and the report says what is open": "Keine: die Fläche bleibt, wie sie ist, und der Bericht sagt, was offen ist",
            "Longest boundary of an opening that is closed, if holes alone are closed. 0: 100 cells": "Längster Rand einer Öffnung, die geschlossen wird, wenn nur Löcher geschlossen werden. 0: 100 Zellen",
            "Size of a cell of the merge that the surface is of. The fill has twice that size. 0: 1.3 times the median edge of the surface": "Größe einer Zelle der Vereinigung, aus der die Fläche ist. Die Füllung hat die doppelte. 0: das 1.3-Fache des Medians der Kanten der Fläche",
            "How far the surface and the poses of its scans may be off: the merge distance. 0: a cell": "Wie weit die Fläche und die Lagen ihrer Scans danebenliegen dürfen: der Vereinungsabstand. 0: eine Zelle",
            "Nothing is filled below a plane under the surface, so that what stood on the ground gets a flat foot instead of a round one. Off: parts that nobody saw from below continue as their sides bend": "Unter einer Ebene unter der Fläche wird nichts gefüllt, damit einen flachen Fuß statt eines runden bekommt, was auf dem Boden stand. Aus: Teile, die niemand von unten sah, gehen weiter, wie sich ihre Seiten biegen",
            "How far below the lowest measured point the flat base lies, if there is one": "Wie weit unter dem tiefsten gemessenen Punkt der flache Fuß liegt, wenn es einen gibt",
            "Closes too where scans saw through. These faces are marked in the attribute forced. Off: openings in seen space stay open, and the report says where": "Auch dort schließen, wo Scans hindurchsahen. Diese Flächen sind im Attribut forced markiert. Aus: Öffnungen in gesehenem Raum bleiben offen, und der Bericht sagt, wo",
            "Direction away from the ground, where there is a flat base": "Richtung vom Boden weg, wo es einen flachen Fuß gibt",
            "Along z": "Längs z",
            "Along y": "Längs y",
            "Along x": "Längs x",
            "Against z": "Gegen z",
            "Against y": "Gegen y",
            "Against x": "Gegen x",
        },
        "sentences": {
            '"{}" is a scan: merge the scans first, and close their surface': '"{}" ist ein Scan: erst die Scans vereinen, und ihre Fläche schließen',
            "{}: what they saw to be empty is not known": "{}: was sie leer sahen, ist nicht bekannt",
            "{} openings closed, {} left open": "{} Öffnungen geschlossen, {} bleiben offen",
            "The opening at vertex {}, at ({}, {}, {}), {} around, is {}: {}": "Die Öffnung am Punkt {}, bei ({}, {}, {}), mit Rand {}, ist {}: {}",
            "partly open": "teilweise offen",
            "open": "offen",
            'the flat base leaves its fill no room: close without it, or with a larger "Depth of the base", from {} on': 'der flache Fuß lässt ihrer Füllung keinen Platz: ohne ihn schließen, oder mit größerer "Tiefe des Fußes", ab {}',
            "the flat base leaves its fill no room: close without it": "der flache Fuß lässt ihrer Füllung keinen Platz: ohne ihn schließen",
            "flat_base and force have no use unless openings are closed: choose all, seen or holes, or leave them out": "Flacher Fuß und Erzwingen nützen nur, wenn Öffnungen geschlossen werden: Alle, Umschlossene oder Löcher wählen, oder beides weglassen",
            '"Flat base" and force have no use unless openings are closed: choose all, seen or holes, or leave them out': '"Flacher Fuß" und Erzwingen nützen nur, wenn Öffnungen geschlossen werden: Alle, Umschlossene oder Löcher wählen, oder beides weglassen',
            '"Flat base" is given, but has no use unless more than holes is closed: give close = all or seen, too': '"Flacher Fuß" ist angegeben, nützt aber nur, wenn mehr als Löcher geschlossen wird: auch Schließen = Alle oder Umschlossene angeben',
            "its fill would turn the surface inside out: close with a smaller cell": "ihre Füllung würde die Fläche umstülpen: mit kleinerer Zelle schließen",
            "no two of the {} triangles share an edge, and each would be closed by itself: merge vertices at one place first": "keine zwei der {} Dreiecke haben eine Kante gemeinsam, und jedes würde für sich geschlossen: erst Punkte am selben Ort verschmelzen",
            "cell is {}, but the median edge of the surface is {}: give at least a hundredth of that": "die Zelle ist {}, aber die mittlere Kante der Fläche ist {}: wenigstens ein Hundertstel davon angeben",
            "closing on a grid of {} nodes": "das Schließen auf einem Gitter von {} Knoten",
            "give a larger cell, or raise the limit": "eine größere Zelle wählen, oder die Grenze erhöhen",
            "openings are none: choose all, seen or holes": "keine Öffnung war zu schließen: Alle, Umschlossene oder Löcher wählen",
            "its boundary is longer than max_hole_length: raise that, or choose all": "ihr Rand ist länger als der längste Lochrand: diesen erhöhen, oder Alle wählen",
            "no scan saw round it, so that it may be a rim: choose all to close it": "kein Scan sah um sie herum, sie kann also ein Rand sein: Alle wählen, um sie zu schließen",
            "a scan saw through where it would be closed: closing with force fills it, and marks that": "ein Scan sah durch den Ort, wo sie zu schließen wäre: Erzwingen schließt sie und markiert das",
            "each fill crosses the surface: give the cell of the merge or a smaller one, or edit the surface there": "jede Füllung schneidet die Fläche: die Zelle der Vereinigung oder eine kleinere wählen, oder die Fläche dort bearbeiten",
            "base_depth is {}, but the longest side of the surface is {}: give at most that": "die Tiefe des Fußes ist {}, aber die längste Seite der Fläche ist {}: höchstens so viel angeben",
            '"Max hole length" is given, but has no use unless openings are holes: choose holes, or leave it out': "der längste Lochrand ist angegeben, nützt aber nur, wenn Löcher geschlossen werden: Löcher wählen, oder ihn weglassen",
            '"Up of the base" is given without "Flat base", but has no use then: give "Flat base", too': '"Oben am Fuß" ist ohne "Flacher Fuß" angegeben, und nützt dann nichts: auch "Flacher Fuß" angeben',
            '"Depth of the base" is given without "Flat base", but has no use then: give "Flat base", too': '"Tiefe des Fußes" ist ohne "Flacher Fuß" angegeben, und nützt dann nichts: auch "Flacher Fuß" angeben',
            "force is given, but has no use without scans that say where nothing is: give range images, too, or leave force out": "Erzwingen ist an, nützt aber nichts ohne Scans, die sagen, wo nichts ist: auch Tiefenbilder angeben, oder es ausschalten",
            "no scan meets the surface: {} lies around {}, the surface around {}: give the scans that it was merged of, with their poses": "kein Scan trifft die Fläche: {} liegt um {}, die Fläche um {}: die Scans angeben, aus denen sie vereint ist, mit ihren Lagen",
            "this scan does not meet the surface: leave it out if the surface was not merged of it": "dieser Scan trifft die Fläche nicht: ihn weglassen, wenn die Fläche nicht aus ihm vereint ist",
            "{}: this scan does not meet the surface: leave it out if the surface was not merged of it": "{}: dieser Scan trifft die Fläche nicht: ihn weglassen, wenn die Fläche nicht aus ihm vereint ist",
            "the surface looks toward its own middle: flip its faces and close it again, unless it is the inside of a thing": "die Fläche blickt zu ihrer eigenen Mitte: ihre Flächen umdrehen und sie noch einmal schließen, wenn sie nicht das Innere eines Dings ist",
            "the surface seems to be inside out: flip its faces, and close it again": "die Fläche ist wohl von innen nach außen gekehrt: ihre Flächen umdrehen, und sie noch einmal schließen",
            "the mesh has no triangles: there is nothing to close": "das Netz hat keine Dreiecke: es gibt nichts zu schließen",
        },
    }
}
