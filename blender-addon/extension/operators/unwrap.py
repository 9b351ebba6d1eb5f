# SPDX-License-Identifier: GPL-3.0-or-later
"""Give the active mesh a UV map: charts that are packed into tiles, without flips and overlaps."""

import bpy
import numpy as np
import surfrecon

from .. import convert, declared, usable
from ..job import MeshOperator
from ..properties import draw_others, given, option
from ..running import Handle, Refused, still_there
from ..surfaces import in_world, is_mirrored, of_own_faces
from ..telling import tell

REPORT = "surfrecon_unwrap"

PARAMETERS = {p.name: p for p in surfrecon.parameters("unwrap")}


@declared.operator("unwrap")
class SURFRECON_OT_unwrap(MeshOperator, bpy.types.Operator):
    """Runs the operation `unwrap`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()}

    def draw(self, context):
        """Sidebar of the last operation: a density takes as many tiles as it needs."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "size")
        row = layout.row()
        row.active = self.texels_per_unit == 0
        row.prop(self, "tiles")
        draw_others(layout, self, PARAMETERS, {"size", "tiles"})

    def launch(self, context):
        """Gathers the mesh in the world, whose unit texels are counted by."""
        unwrapped = usable.active(context)
        usable.writable(unwrapped)
        mesh, matrix = unwrapped.data, np.array(unwrapped.matrix_world, np.float64)
        if len(mesh.polygons) == 0:
            raise Refused(f'"{unwrapped.name}" has no faces: choose a mesh with a surface')
        if len(mesh.loops) != 3 * len(mesh.polygons):
            # A seam may run along any edge of a triangle, and a UV map has none within a face.
            raise Refused(
                f'"{unwrapped.name}" has faces that are no triangles: cut them with Face > Triangulate Faces in edit mode'
            )
        usable.refuse_unusable(unwrapped, matrix)
        usable.refuse_flattened(unwrapped, matrix)
        own = of_own_faces(unwrapped)
        # Seen from outside, the image must not be mirrored.
        self.order = [2, 1, 0] if is_mirrored(matrix) else [0, 1, 2]
        self.unwrapped, self.triangles = Handle(unwrapped), own.triangles
        options = given(self, PARAMETERS)
        if self.texels_per_unit > 0:
            # Greyed out.
            options["tiles"] = None
        return surfrecon.Job.unwrap(in_world(own, matrix), **options)

    def finish(self, context, result):
        """Writes the active UV map, or the first one."""
        (unwrapped,) = still_there([self.unwrapped])
        mesh, report = unwrapped.data, result.report
        if not np.array_equal(convert.triangles(mesh), self.triangles):
            raise Refused(f'"{unwrapped.name}" was changed meanwhile: try again')
        convert.store_uv(mesh, result.uv[result.mesh.triangles[:, self.order]])
        unwrapped[REPORT] = convert.plain(report)
        mesh.update()
        tell(
            self,
            {"INFO"},
            f"Charts: {report.charts:,}, tiles: {report.tiles}, used: {report.used:.1%}, "
            f"texels per unit: {report.texels_per_unit:.4g}",
        )


# A sentence a line is easier to translate than one in pieces.
# ruff: noqa: E501
TRANSLATIONS = {
    "de_DE": {
        "names": {
            "Unwrap": "Abwickeln",
            "Give the active mesh a UV map of charts that are packed into tiles, without flips and overlaps": "Dem aktiven Netz eine UV-Map aus Stücken geben, die in Kacheln gepackt sind, ohne Umklappen und Überlappen",
            "Tiles": "Kacheln",
            "Texels per unit": "Texel je Einheit",
            "Padding": "Abstand",
            "Cone": "Kegel",
            "Max stretch": "Größte Streckung",
            "Charts": "Stücke",
            "Charts before joining": "Stücke vor dem Vereinen",
            "Used": "Genutzt",
            "Stretch": "Streckung",
            "Stretch, 95 %": "Streckung, 95 %",
            "Triangles without area": "Dreiecke ohne Fläche",
            "Share without area": "Anteil ohne Fläche",
            "Vertices moved": "Bewegte Ecken",
        },
        "tips": {
            "Tiles to fill, as densely as they hold the charts. 0: one": "Zu füllende Kacheln, so dicht, wie sie die Stücke fassen. 0: eine",
            "Texels per unit of length on the surface, in as many tiles as that takes. 0: as many as fit the tiles": "Texel je Längeneinheit auf der Fläche, in so vielen Kacheln, wie das braucht. 0: so viele, wie in die Kacheln passen",
            "Columns and rows of a tile, in texels": "Spalten und Zeilen einer Kachel, in Texeln",
            "Texels that stay free around each chart, twice as many between two. Mipmaps of level n need 2^n": "Texel, die um jedes Stück frei bleiben, doppelt so viele zwischen zweien. Mipmaps der Stufe n brauchen 2^n",
            "Largest angle between the normal of a triangle and the mean normal of its chart. Smaller angles make flatter charts and more of them": "Größter Winkel zwischen der Normalen eines Dreiecks und der mittleren Normalen seines Stücks. Kleinere Winkel machen flachere Stücke und mehr davon",
            "Largest factor by which the area of a triangle in the texture may differ from its share of the chart, either way. Charts that exceed it are split": "Größter Faktor, um den der Inhalt eines Dreiecks in der Textur von seinem Anteil am Stück abweichen darf, in beide Richtungen. Stücke, die ihn überschreiten, werden geteilt",
        },
        "sentences": {
            "Charts: {}, tiles: {}, used: {}, texels per unit: {}": "Stücke: {}, Kacheln: {}, genutzt: {}, Texel je Einheit: {}",
            '"{}" has no faces: choose a mesh with a surface': '"{}" hat keine Flächen: ein Netz mit einer Fläche wählen',
            '"{}" has faces that are no triangles: cut them with Face > Triangulate Faces in edit mode': '"{}" hat Flächen, die keine Dreiecke sind: sie im Editiermodus mit Fläche > Flächen triangulieren schneiden',
            "flattening charts": "Stücke abwickeln",
            "joining charts": "Stücke vereinen",
            "packing charts": "Stücke packen",
            "the mesh has no triangles, but unwrapping needs some": "das Netz hat keine Dreiecke, Abwickeln braucht aber welche",
            "all triangles of the mesh lie at one point, but unwrapping needs a surface": "alle Dreiecke des Netzes liegen in einem Punkt, Abwickeln braucht aber eine Fläche",
            "{} triangles are more than can be unwrapped: {} at most": "{} Dreiecke sind mehr, als abgewickelt werden können: höchstens {}",
            "{} texels per unit need {} tiles of {} texels, but 100 are the most: use fewer texels per unit or larger tiles": "{} Texel je Einheit brauchen {} Kacheln von {} Texeln, aber 100 sind das Höchste: weniger Texel je Einheit oder größere Kacheln nehmen",
            "{} texels per unit make the mesh {} texels long, but 1 to 10^9 are allowed: use more or fewer texels per unit": "{} Texel je Einheit machen das Netz {} Texel lang, erlaubt sind aber 1 bis 10^9: mehr oder weniger Texel je Einheit nehmen",
            "{} charts with a padding of {} texels do not fit the tiles: {} of {} x {} texels": "{} Stücke mit einem Abstand von {} Texeln passen nicht in die Kacheln: {} von {} x {} Texeln",
            "Use more or larger tiles or less padding, or drop small parts of the mesh": "Mehr oder größere Kacheln oder weniger Abstand nehmen, oder kleine Teile des Netzes weglassen",
            "padding is {} texels for tiles of {}, but must be less than a quarter of the size: use less padding or larger tiles": "der Abstand ist {} Texel bei Kacheln von {}, muss aber kleiner als ein Viertel der Größe sein: weniger Abstand oder größere Kacheln nehmen",
            "a chart takes {} x {} texels with its padding, but a tile has {} x {}": "ein Stück braucht {} x {} Texel mit seinem Abstand, aber eine Kachel hat {} x {}",
            "Use larger tiles, fewer texels per unit, less padding or a smaller cone": "Größere Kacheln, weniger Texel je Einheit, weniger Abstand oder einen kleineren Kegel nehmen",
            "the charts would take {} texels, more than 2^30: use fewer texels per unit or smaller tiles": "die Stücke bräuchten {} Texel, mehr als 2^30: weniger Texel je Einheit oder kleinere Kacheln nehmen",
            "the mesh can't be unwrapped: {}": "das Netz kann nicht abgewickelt werden: {}",
            "texture coordinate {} is ({}, {}), but must be finite": "Texturkoordinate {} ist ({}, {}), muss aber endlich sein",
            "triangle {} names a texture coordinate beyond the {} there are": "Dreieck {} nennt eine Texturkoordinate jenseits der {}, die es gibt",
        },
    }
}
