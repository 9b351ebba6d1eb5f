# SPDX-License-Identifier: GPL-3.0-or-later
"""A long call of the library as a modal operator: thread, progress, cancel.

The call runs on a thread of the library's own (`surfrecon.Job`), which touches nothing of Blender. The operator looks
at it ten times a second; ESC cancels. Only when it has ended is anything of the scene changed, on the main thread, so
that a cancelled or failed call leaves the scene as it was and a finished one is a single undo step.
"""

import time

import bpy
import surfrecon

POLL_SECONDS = 0.1


class Refused(Exception):
    """What the user selected can't be used; the text is one sentence that says why and what to do."""


class Running:
    """The one job that may run at a time, for the panel to show."""

    job = None
    title = ""
    stage = ""
    fraction = 0.0

    @classmethod
    def begin(cls, job, title):
        """Takes a started job."""
        cls.job, cls.title, cls.stage, cls.fraction = job, title, "", 0.0

    @classmethod
    def ended(cls):
        """Notes the progress and tells whether the work has ended."""
        cls.stage, cls.fraction = cls.job.progress()
        return cls.job.done()

    @classmethod
    def take(cls):
        """The job, which no longer counts as running."""
        job, cls.job = cls.job, None
        return job

    @classmethod
    def cancel(cls):
        """Cancels the job, if there is one, and forgets it."""
        if cls.job is not None:
            cls.take().cancel()


class JobOperator:
    """An operator around a `surfrecon.Job`.

    A subclass defines `start(context)`, which gathers the input and returns a running job, and
    `finish(context, result)`, which puts the result into the scene. Both may raise `Refused` or the library's errors.
    """

    bl_options = {"UNDO"}
    _timer = None

    @classmethod
    def poll(cls, context):
        """One job at a time, and meshes can be read in object mode only."""
        if Running.job is not None:
            cls.poll_message_set(f"{Running.title} is running")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the edit mode first")
            return False
        return True

    def execute(self, context):
        """For scripts: waits for the end."""
        if not self._begin(context):
            return {"CANCELLED"}
        while not Running.ended():
            time.sleep(0.005)
        return self._end(context)

    def invoke(self, context, event):
        """For people: returns at once; `modal` watches."""
        if not self._begin(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(POLL_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        manager.progress_begin(0, 100)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Watches the job."""
        if Running.job is None:  # cancelled elsewhere, for example by disabling the extension
            self._leave(context)
            return {"CANCELLED"}
        if event.type == "ESC":
            Running.job.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        ended = Running.ended()
        text = f"{self.bl_label}: {Running.stage} {Running.fraction:.0%}   ESC cancels"
        context.workspace.status_text_set(text)
        context.window_manager.progress_update(int(100 * Running.fraction))
        redraw(context)
        if not ended:
            return {"RUNNING_MODAL"}
        self._leave(context)
        return self._end(context)

    def cancel(self, context):
        """Blender ends the operator: a window was closed, another file loaded."""
        Running.cancel()
        self._leave(context)

    def _begin(self, context):
        try:
            Running.begin(self.start(context), self.bl_label)
        except (Refused, surfrecon.SurfreconError) as problem:
            self.report({"ERROR"}, str(problem))
            return False
        return True

    def _end(self, context):
        try:
            self.finish(context, Running.take().result())
        except surfrecon.Cancelled:
            self.report({"WARNING"}, f"{self.bl_label}: cancelled")
            return {"CANCELLED"}
        except (Refused, surfrecon.SurfreconError) as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        return {"FINISHED"}

    def _leave(self, context):
        manager = context.window_manager
        if self._timer is not None:
            manager.event_timer_remove(self._timer)
            self._timer = None
        manager.progress_end()
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        redraw(context)


class SURFRECON_OT_cancel(bpy.types.Operator):
    """Stop the running operation; the scene stays as it was"""

    bl_idname = "surfrecon.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context):
        """Something must be running."""
        return Running.job is not None

    def execute(self, context):
        """Asks the job to stop; its operator does the rest."""
        Running.job.cancel()
        return {"FINISHED"}


def redraw(context):
    """Lets the sidebars show the progress."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def register():
    """Registers the cancel button."""
    bpy.utils.register_class(SURFRECON_OT_cancel)


def unregister():
    """Stops a running job: nobody will fetch its result."""
    Running.cancel()
    bpy.utils.unregister_class(SURFRECON_OT_cancel)
