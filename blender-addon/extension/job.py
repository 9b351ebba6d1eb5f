# SPDX-License-Identifier: GPL-3.0-or-later
"""A long call of the library as a modal operator: thread, progress, cancel.

The call runs on a thread of the library's own (`surfrecon.Job`), which touches nothing of Blender. The operator looks
at it twenty times a second. ESC cancels. Only when it has ended is anything of the scene changed, on the main thread,
so that a cancelled or failed call leaves the scene as it was and a finished one is a single undo step.

An operation that is adjusted in the panel of the last operation runs while Blender waits, as any operator does there.
One that takes longer than a second is begun anew as a modal operator instead: see `Adjusting`.
"""

import inspect
import math
import time

import bpy
import surfrecon

from . import preview
from .adjusting import Adjusting, Before
from .home import Home
from .kept import Kept
from .kept_merge import KeptMerge
from .running import Gathering, Refused, Running
from .telling import in_object_mode, tell, told
from .translations import title
from .words import sentence

POLL_SECONDS = 0.05

# A job that is asked to stop does so within this time.
STOPPED_SECONDS = 0.1

# So long an adjusted operation may keep the window waiting.
PATIENCE_SECONDS = 1.0


class JobOperator:
    """An operator around a `surfrecon.Job`.

    A subclass defines `launch(context)`, which gathers the input and returns a running job, or is a generator that does
    so object by object (see `gathered`), and `finish(context, result)`, which puts the result into the scene, or
    returns a further job whose result comes next. Both may raise `Refused` or the library's errors. `preview(context)`
    may return a job for a rough picture of the result, which is drawn while the other one takes its time.
    """

    bl_options = {"UNDO"}
    # The work before the job begins, in words for people.
    gathering = "Reading the objects"
    # Whether `finish` may meet the first result when an adjusted operation goes on in the background.
    may_be_handed_over = True
    replaces = None
    # The place where the job was begun, which its result goes to.
    home = None
    _timer = None
    _shown = None

    @classmethod
    def poll(cls, context):
        """One job at a time, and meshes can be read in object mode only."""
        if Running.job is not None and Adjusting.handed is None:
            cls.poll_message_set(told(f"{title(Running.title)} is running: wait for it, or cancel it with ESC"))
            return False
        return in_object_mode(cls, context)

    def preview(self, context):
        """Nothing, unless a subclass knows better."""

    def execute(self, context):
        """For scripts and the panel of the last operation: waits for the end."""
        adjusting = self.options.is_repeat and not bpy.app.background and self.may_be_handed_over
        replaces = Adjusting.replaced if adjusting else None
        Adjusting.replaced = None
        if replaces is not None and replaces.there():
            replaces.select(context)
        else:
            replaces = None
        before = replaces or Before(context)
        self.home = Home(context)
        if not self._begin(context):
            return {"CANCELLED"}
        while True:
            while not Running.ended():
                if adjusting and Running.seconds() > PATIENCE_SECONDS:
                    Adjusting.hand_over(self, before)
                    return {"CANCELLED"}
                time.sleep(0.002)
            done = self._end(context)
            if done is None:
                continue
            if done == {"FINISHED"} and replaces is not None:
                replaces.replace()
                Adjusting.replaced = replaces
            return done

    def is_watched(self):
        """Whether somebody works in the window meanwhile: no script and no adjustment waits."""
        return self._timer is not None

    def invoke(self, context, event):
        """For people: it returns at once. `modal` watches."""
        return self.watch(context)

    def watch(self, context):
        """Shows that something begins and leaves the rest to `modal`."""
        if Adjusting.handed is not None:
            Adjusting.adopt(self)
        else:
            # The result of an earlier operation is not what this one will replace when it is adjusted.
            Adjusting.replaced = None
            self.home = Home(context)
            Running.begin(Gathering(self.gathering), self.bl_label)
        manager = context.window_manager
        self._timer = manager.event_timer_add(POLL_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        manager.progress_begin(0, 100)
        self._show(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Watches the job."""
        if Running.job is None:  # cancelled elsewhere, for example by disabling the extension
            return self._leave(context, {"CANCELLED"})
        if event.type == "ESC" and event.value == "PRESS":
            Running.stop()
            preview.end()
            if not isinstance(Running.job, Gathering):
                # The next event of the timer comes after the window was drawn, which may take longer than the job.
                Running.wait(STOPPED_SECONDS)
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        if isinstance(Running.job, Gathering):
            return self._gather(context)
        ended = Running.ended()
        # Whoever edits or sculpts meanwhile keeps the active object and the selection.
        Running.waiting = ended and Running.stopped is None and context.mode != "OBJECT"
        self._show(context)
        if Running.waiting:
            return {"RUNNING_MODAL"}
        if Running.stopped is None:
            preview.step(self, context, Running)
        if not ended:
            return {"RUNNING_MODAL"}
        preview.end()
        done = self._end(context)
        if done is None:  # a further job has begun
            return {"RUNNING_MODAL"}
        return self._leave(context, done)

    def cancel(self, context):
        """Blender ends the operator: a window was closed, another file loaded."""
        Running.cancel()
        self._leave(context)

    def _gather(self, context):
        """Reads objects once the window shows that it will, and starts the job when all are read."""
        if Running.stopped is not None:
            Running.take()
            tell(self, {"WARNING"}, f"{title(self.bl_label)}: cancelled")
            return self._leave(context, {"CANCELLED"})
        gathering = Running.job
        if not gathering.drawn():
            return {"RUNNING_MODAL"}
        try:
            if gathering.steps is None:
                gathering.steps = self._launching(context)
            with self.home.there(context):
                job = gathering.read()
        except (Refused, surfrecon.SurfreconError) as problem:
            Running.take()
            self._refuse(problem)
            return self._leave(context, {"CANCELLED"})
        Running.ended()
        if job is not None:
            Running.begin(job, self.bl_label)
        self._show(context)
        return {"RUNNING_MODAL"}

    def _show(self, context):
        text = Running.text()
        if text == self._shown:
            return
        self._shown = text
        if context.workspace is not None:
            context.workspace.status_text_set(f"{title(self.bl_label)}: {text}   {told('ESC cancels')}")
        context.window_manager.progress_update(int(100 * Running.fraction))
        redraw(context)

    def _launching(self, context):
        """The steps of `launch`, if it has any. It is a generator that returns the job."""
        Kept.only_of(self.bl_idname)
        refuse_no_numbers(self)
        launched = self.launch(context)
        return (yield from launched) if inspect.isgenerator(launched) else launched

    def _begin(self, context):
        gathering = Gathering(self.gathering)
        gathering.steps = self._launching(context)
        try:
            job = None
            while job is None:
                job = gathering.read()
            Running.begin(job, self.bl_label)
        except (Refused, surfrecon.SurfreconError) as problem:
            self._refuse(problem)
            return False
        return True

    def _end(self, context):
        """The value that the operator returns, or `None` if there is more to do."""
        try:
            if Running.stopped is not None:  # also when it was done before it heard
                Running.take()
                raise surfrecon.Cancelled("cancelled")
            result = Running.take().result()
            with self.home.there(context):
                further = self.finish(context, result)
            if further is not None:
                Running.begin(further, self.bl_label)
                return None
        except surfrecon.Cancelled:
            tell(self, {"WARNING"}, f"{title(self.bl_label)}: cancelled")
            return {"CANCELLED"}
        except (Refused, surfrecon.SurfreconError) as problem:
            self._refuse(problem)
            return {"CANCELLED"}
        if (scene := self.home.find()) != context.scene:
            tell(self, {"INFO"}, f'The result is in the scene "{scene.name}", where it was begun')
        return {"FINISHED"}

    def _refuse(self, problem):
        """Says why there is no result."""
        text = sentence(problem)
        if isinstance(problem, surfrecon.OutOfMemoryError) and KeptMerge.forget():
            text += ". What the last merge had kept is given back now: try again"
        tell(self, {"ERROR"}, text)

    def _leave(self, context, done=None):
        """Takes away what was shown. It returns `done`."""
        preview.end()
        manager = context.window_manager
        if self._timer is not None:
            manager.event_timer_remove(self._timer)
            self._timer = None
        manager.progress_end()
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        redraw(context)
        if done == {"FINISHED"} and self.replaces is not None:
            self.replaces.replace()
            Adjusting.replaced = self.replaces
        return done


class MeshOperator(JobOperator):
    """One that works on the active object, a mesh."""

    @classmethod
    def poll(cls, context):
        """There must be a mesh."""
        if not super().poll(context):
            return False
        if context.object is None or context.object.type != "MESH":
            cls.poll_message_set(told("Make a mesh the active object"))
            return False
        return True


def refuse_no_numbers(operator):
    """Refuses options that are no numbers: scripts and expressions can give them, past the limits of sliders."""
    for prop in operator.properties.bl_rna.properties:
        if prop.type != "FLOAT":
            continue
        value = getattr(operator, prop.identifier)
        for number in value if prop.is_array else (value,):
            if not math.isfinite(number):
                raise Refused(f"{prop.name} is {number}, which is no number to work with: enter another one")


class SURFRECON_OT_cancel(bpy.types.Operator):
    """Stop the running operation. The scene stays as it was"""

    bl_idname = "surfrecon.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context):
        """Something must be running."""
        return Running.job is not None

    def execute(self, context):
        """Asks the job to stop. Its operator does the rest."""
        Running.stop()
        return {"FINISHED"}


def redraw(context):
    """Lets the sidebars show the progress. The views themselves may be slow to draw and stay as they are."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


def register():
    """Registers the cancel button."""
    bpy.utils.register_class(SURFRECON_OT_cancel)


def unregister():
    """Stops a running job: nobody will fetch its result."""
    preview.end()
    Running.cancel()
    bpy.utils.unregister_class(SURFRECON_OT_cancel)
