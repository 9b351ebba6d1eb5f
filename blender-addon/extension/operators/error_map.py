# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour a surface by its distance to the scans it was made from, or to any other surface."""

import bpy
import numpy as np
import surfrecon

from .. import convert, recording, usable
from ..chosen import Chosen
from ..false_colours import FIGURES, show, show_materials, store_distances
from ..job import MeshOperator
from ..measured import distances_of
from ..running import Handle, Known, Refused, gathered, still_there
from ..sources import sources_of, what_is_gone
from ..telling import tell
from ..words import length


class SURFRECON_OT_error_map(MeshOperator, bpy.types.Operator):
    """Colour the active surface by its distance to the other selected objects, or to its sources"""

    bl_idname = "surfrecon.error_map"
    bl_label = "Error Map"
    bl_options = {"REGISTER", "UNDO"}

    limit: bpy.props.FloatProperty(
        name="Full scale",
        description="Distance of the last colour. 0: a round number above 95 % of the distances",
        subtype="DISTANCE",
        unit="LENGTH",
        precision=5,
        min=0,
        # Another surface has other distances.
        options={"SKIP_SAVE"},
    )

    def launch(self, context):
        """Gathers the vertices and what they are measured against."""
        measured = usable.active(context)
        usable.writable(measured)
        chosen = Chosen(obj for obj in context.selected_objects if obj is not measured)
        references, self.said = chosen.objects, chosen.said()
        if not references:
            references, gone = sources_of(measured), what_is_gone(measured)
            if references and gone:
                tell(self, {"WARNING"}, f"{gone}: it is measured against the others")
            # Distances that the merge measured are at hand.
            if references and not gone and (known := distances_of(measured)) is not None:
                self.measured = Handle(measured)
                return Known(known)
        if not references:
            if gone := what_is_gone(measured):
                raise Refused(f"{gone}: select what it is to be compared with as well")
            raise Refused(f'Select the scans that "{measured.name}" is to be compared with as well')
        self.measured = Handle(measured)
        (points,) = yield from gathered(context, [measured], self.points_of)
        scans = yield from gathered(context, references, recording.scan_or_frames)
        return surfrecon.Job.distances(points, recording.of_all(scans))

    def points_of(self, measured, depsgraph):
        """The vertices of an object in the world."""
        points = convert.seen_positions(measured, depsgraph)
        if points is None:
            # The distances are stored in the object's own vertices.
            tell(self, {"WARNING"}, f'"{measured.name}" is measured without its modifiers, which make other vertices')
            points = convert.positions(measured.data)
        usable.refuse_not_finite(measured, points)
        matrix = np.array(measured.matrix_world)
        return points @ matrix[:3, :3].T + matrix[:3, 3]

    def finish(self, context, distances):
        """Stores the distances and shows them."""
        (measured,) = still_there([self.measured])
        if len(measured.data.vertices) != len(distances):
            raise Refused(f'"{measured.name}" was changed meanwhile: try again')
        limit = self.limit or scale_of(distances)
        map_onto(measured, distances, limit)
        show_materials(context)
        figures = measured[FIGURES]
        rms, most = (length(context, figures[name]) for name in ("rms", "max"))
        tell(self, {"INFO"}, f'"{measured.name}": RMS distance {rms}, largest {most}{self.said}')


def scale_of(distances):
    """The distance of the last colour."""
    return round_up(np.quantile(distances, 0.95)) if len(distances) else 1.0


def map_onto(obj, distances, limit):
    """Stores the distances of the vertices, with their figures, and gives the object a material that shows them."""
    store_distances(obj.data, distances)
    obj[FIGURES] = {
        "mean": float(np.mean(distances)),
        "rms": float(np.sqrt(np.mean(distances**2))),
        "p95": float(np.quantile(distances, 0.95)),
        "max": float(np.max(distances)),
        "limit": float(limit),
    }
    show(obj, limit)


def round_up(value):
    """The next of 1, 2, 5, 10, 20 ... in any power of ten. It is 1 for 0."""
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-9)))
