# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how far one surface lies from another, with a bound that holds between the vertices too."""

import bpy
import surfrecon
from bpy.props import BoolProperty

from .. import convert, recording, surfaces, usable
from ..chosen import Chosen
from ..false_colours import show, store_distances
from ..job import MeshOperator
from ..running import Handle, Refused, still_there
from ..sources import sources_of, what_is_gone
from ..telling import tell
from ..words import length
from .error_map import round_up

REPORT = "surfrecon_measure"
# Begins the names of figures that were measured the other way.
BACK = "back_"


class SURFRECON_OT_measure(MeshOperator, bpy.types.Operator):
    """Measure how far the active surface is from the others selected, or its sources, with a limit no point exceeds"""

    bl_idname = "surfrecon.measure"
    bl_label = "Measure Distance"
    bl_options = {"REGISTER", "UNDO"}

    both: BoolProperty(
        name="Both ways",
        description="Measure from the others to the active surface as well: what the active one lacks counts too",
        default=True,
    )
    signed: BoolProperty(name="Signed", description="Distances behind the other surface are negative", default=False)
    show_error: BoolProperty(
        name="Show error", description="Colour the active surface by the distances of its vertices", default=True
    )

    def launch(self, context):
        """Gathers both surfaces in the world."""
        active = usable.active(context)
        chosen = Chosen(obj for obj in context.selected_objects if obj is not active)
        others, gone, self.said = chosen.objects or sources_of(active), what_is_gone(active), chosen.said()
        if others and not chosen.objects and gone:
            tell(self, {"WARNING"}, f"{gone}: it is measured against the others")
        for obj in others:
            if recording.is_recording(obj):
                tell(self, {"WARNING"}, f'Nothing is measured to the frames of "{obj.name}": the error map does that')
        others = [obj for obj in others if not recording.is_recording(obj)]
        if not others:
            raise Refused(f'Select what "{active.name}" is to be measured against as well')
        if active.data.library is not None and self.show_error:
            raise Refused(f'"{active.name}" is linked from another file, which is left as it is: turn off Show error')
        depsgraph = context.evaluated_depsgraph_get()
        self.measured, self.against = Handle(active), ", ".join(obj.name for obj in others)
        self.surface = surfaces.surface_of([active], depsgraph)
        self.reference = surfaces.surface_of(others, depsgraph)
        self.found = None
        return surfrecon.Job.surface_distance(self.surface, self.reference, signed=self.signed)

    def finish(self, context, result):
        """Measures the way back, then shows both."""
        if self.both and self.found is None:
            self.found = result
            return surfrecon.Job.surface_distance(self.reference, self.surface)
        there, back = (result, None) if self.found is None else (self.found, result)
        self.surface = self.reference = self.found = None
        (active,) = still_there([self.measured])
        names = [row.name for row in surfrecon.figures("distance")]
        figures = {name: there[name] for name in names} | {"against": self.against}
        if back is not None:
            figures |= {f"{BACK}{name}": back[name] for name in names}
            figures["hausdorff"] = max(there["bound"], back["bound"])
        distances = there["distances"]
        if self.show_error and len(distances) == len(active.data.vertices):
            store_distances(active.data, distances)
            show(active, round_up(there["p95"]))
        elif self.show_error:
            text = "is measured with its modifiers, which make other vertices: apply them to see the error in colours"
            tell(self, {"WARNING"}, f'"{active.name}" {text}')
        active[REPORT] = convert.plain(figures)
        bound = length(context, there["bound"])
        tell(self, {"INFO"}, f'No point of "{active.name}" is farther than {bound} from {self.against}{self.said}')
        return None
