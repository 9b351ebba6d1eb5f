# SPDX-License-Identifier: GPL-3.0-or-later
"""A long call of the library as a modal operator: thread, progress, cancel.

The call runs on a thread of the library's own (`surfrecon.Job`), which touches nothing of Blender. The operator looks
at it twenty times a second; ESC cancels. Only when it has ended is anything of the scene changed, on the main thread,
so that a cancelled or failed call leaves the scene as it was and a finished one is a single undo step.
"""

import time

import bpy
import surfrecon

from . import preview

POLL_SECONDS = 0.05

# Estimates of the time left are worth nothing before.
SETTLED_SECONDS, SETTLED_SHARE = 1.0, 0.02


class Refused(Exception):
    """What the user selected can't be used; the text is one sentence that says why and what to do."""


class Running:
    """The one job that may run at a time, for the panel to show."""

    job = None
    title = ""
    stage = ""
    fraction = 0.0
    started = 0.0
    # When the job was asked to stop, if it was.
    stopped = None

    @classmethod
    def begin(cls, job, title):
        """Takes a started job."""
        cls.job, cls.title, cls.stage, cls.fraction = job, title, "", 0.0
        cls.started, cls.stopped = time.monotonic(), None

    @classmethod
    def ended(cls):
        """Notes the progress and tells whether the work has ended."""
        cls.stage, cls.fraction = cls.job.progress()
        return cls.job.done()

    @classmethod
    def seconds(cls):
        """Since the job began."""
        return time.monotonic() - cls.started

    @classmethod
    def seconds_left(cls):
        """An estimate, or `None` as long as there is none."""
        if cls.seconds() < SETTLED_SECONDS or cls.fraction < SETTLED_SHARE:
            return None
        return cls.seconds() * (1 - cls.fraction) / cls.fraction

    @classmethod
    def text(cls):
        """Stage, share done and time left, for people."""
        if cls.stopped is not None:
            return "stopping"
        left = cls.seconds_left()
        return f"{cls.stage} {cls.fraction:.0%}" + (f", {duration(left)} left" if left is not None else "")

    @classmethod
    def stop(cls):
        """Asks the job to stop, which it does within a tenth of a second; who watches it does the rest."""
        cls.job.cancel()
        cls.stopped = time.monotonic()

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


def duration(seconds):
    """A time for people: no more digits than an estimate has."""
    seconds = max(int(seconds + 0.5), 1)
    if seconds < 100:
        return f"{seconds} s"
    minutes = (seconds + 30) // 60
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"


class JobOperator:
    """An operator around a `surfrecon.Job`.

    A subclass defines `start(context)`, which gathers the input and returns a running job, and
    `finish(context, result)`, which puts the result into the scene, or returns a further job whose result comes next.
    Both may raise `Refused` or the library's errors. `preview(context)` may return a job for a rough picture of the
    result, which is drawn while the other one takes its time.
    """

    bl_options = {"UNDO"}
    _timer = None
    _shown = None

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

    def preview(self, context):
        """Nothing, unless a subclass knows better."""

    def execute(self, context):
        """For scripts and the panel of the last operation: waits for the end."""
        if not self._begin(context):
            return {"CANCELLED"}
        while True:
            while not Running.ended():
                time.sleep(0.002)
            done = self._end(context)
            if done is not None:
                return done

    def invoke(self, context, event):
        """For people: returns at once; `modal` watches."""
        return self.watch(context)

    def watch(self, context):
        """Starts the job and leaves it to `modal`."""
        if not self._begin(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(POLL_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        manager.progress_begin(0, 100)
        self._show(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Watches the job."""
        if Running.job is None:  # cancelled elsewhere, for example by disabling the extension
            self._leave(context)
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            Running.stop()
            preview.end()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        ended = Running.ended()
        self._show(context)
        preview.step(self, context, Running)
        if not ended:
            return {"RUNNING_MODAL"}
        preview.end()
        done = self._end(context)
        if done is None:  # a further job has begun
            return {"RUNNING_MODAL"}
        self._leave(context)
        return done

    def cancel(self, context):
        """Blender ends the operator: a window was closed, another file loaded."""
        Running.cancel()
        self._leave(context)

    def _show(self, context):
        text = Running.text()
        if text == self._shown:
            return
        self._shown = text
        if context.workspace is not None:
            context.workspace.status_text_set(f"{self.bl_label}: {text}   ESC cancels")
        context.window_manager.progress_update(int(100 * Running.fraction))
        redraw(context)

    def _begin(self, context):
        try:
            Running.begin(self.start(context), self.bl_label)
        except (Refused, surfrecon.SurfreconError) as problem:
            self.report({"ERROR"}, str(problem))
            return False
        return True

    def _end(self, context):
        """What the operator returns, or `None` if there is more to do."""
        try:
            further = self.finish(context, Running.take().result())
            if further is not None:
                Running.begin(further, self.bl_label)
                return None
        except surfrecon.Cancelled:
            self.report({"WARNING"}, f"{self.bl_label}: cancelled")
            return {"CANCELLED"}
        except (Refused, surfrecon.SurfreconError) as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        return {"FINISHED"}

    def _leave(self, context):
        preview.end()
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
        Running.stop()
        return {"FINISHED"}


def redraw(context):
    """Lets the sidebars show the progress; the views themselves may be slow to draw and stay as they are."""
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
