# SPDX-License-Identifier: GPL-3.0-or-later
"""A long call of the library as a modal operator: thread, progress, cancel.

The call runs on a thread of the library's own (`surfrecon.Job`), which touches nothing of Blender. The operator looks
at it twenty times a second; ESC cancels. Only when it has ended is anything of the scene changed, on the main thread,
so that a cancelled or failed call leaves the scene as it was and a finished one is a single undo step.

An operation that is adjusted in the panel of the last operation runs while Blender waits, as any operator does there.
One that takes longer than a second is begun anew as a modal operator instead: see `Adjusting`.
"""

import inspect
import math
import re
import threading
import time

import bpy
import surfrecon

from . import preview
from .kept import Kept
from .properties import label

POLL_SECONDS = 0.05

# A job that is asked to stop does so within this time.
STOPPED_SECONDS = 0.1

# Estimates of the time left are worth nothing before.
SETTLED_SECONDS, SETTLED_SHARE = 1.0, 0.02


# So long an adjusted operation may keep the window waiting.
PATIENCE_SECONDS = 1.0

# Objects are read for no longer than this between two events of the window.
READING_SECONDS = 0.03


class Refused(Exception):
    """What the user selected can't be used; the text is one sentence that says why and what to do."""


class Gathering:
    """Stands for the job until its objects are read, which begins once the first progress has been drawn."""

    looked_at, share, steps = 0, 0.0, None

    def progress(self):
        """The share of the objects that is read."""
        return "Reading the objects", self.share

    def read(self):
        """Reads on for a moment; returns the job once all is read, else `None`."""
        end = time.monotonic() + READING_SECONDS
        while True:
            try:
                self.share = next(self.steps)
            except StopIteration as all_read:
                return all_read.value
            if time.monotonic() > end:
                return None

    def done(self):
        """Never: the real job takes its place."""
        return False

    def cancel(self):
        """There is nothing to stop."""

    def drawn(self):
        """Whether the window was drawn since: Blender draws between two events of the timer."""
        self.looked_at += 1
        return self.looked_at > 1


def gathered(context, objects, read):
    """`read(object, depsgraph)` of each object, as a list. A generator, for `start`, that yields the share done.

    The user may work on meanwhile, so objects are known by their names and looked up when their turn comes.
    """
    keys = [(obj.name, obj.library.filepath if obj.library is not None else None) for obj in objects]
    found = []
    for k, key in enumerate(keys):
        yield k / len(keys)
        obj = bpy.data.objects.get(key)
        if obj is None:
            raise Refused(f'"{key[0]}" was removed meanwhile: try again')
        found.append(read(obj, context.evaluated_depsgraph_get()))
    return found


class Task:
    """A Python function as a job, for what needs arrays and nothing of Blender: `function(fraction)` returns the result
    and calls `fraction(share done)` now and then, which raises `surfrecon.Cancelled` once it is to stop.
    """

    def __init__(self, title, function):
        self.title, self.share, self.stopped = title, 0.0, False
        self.value = self.problem = None
        self.thread = threading.Thread(target=self._run, args=(function,), daemon=True)
        self.thread.start()

    def _run(self, function):
        try:
            self.value = function(self._note)
        except Exception as problem:  # of another thread: raised again where the result is asked for
            self.problem = problem

    def _note(self, share):
        self.share = share
        if self.stopped:
            raise surfrecon.Cancelled("cancelled")

    def progress(self):
        """Title and share done."""
        return self.title, self.share

    def done(self):
        """Whether it has ended."""
        return not self.thread.is_alive()

    def cancel(self):
        """Asks it to stop."""
        self.stopped = True

    def result(self):
        """What the function returned; raises what it raised."""
        self.thread.join()
        if self.stopped:
            raise surfrecon.Cancelled("cancelled")
        if self.problem is not None:
            raise self.problem
        return self.value


class Known:
    """A result that is at hand already, as a job."""

    def __init__(self, value):
        self.value = value

    def progress(self):
        """All is done."""
        return "", 1.0

    def done(self):
        """It is."""
        return True

    def cancel(self):
        """Too late."""

    def result(self):
        """The result."""
        return self.value


class Running:
    """The one job that may run at a time, for the panel to show."""

    job = None
    title = ""
    stage = ""
    fraction = 0.0
    started = 0.0
    # When the job was asked to stop, if it was.
    stopped = None
    # Whether it has ended and its result can't come into the scene yet.
    waiting = False

    @classmethod
    def begin(cls, job, title):
        """Takes a started job."""
        cls.job, cls.title, cls.stage, cls.fraction = job, title, "", 0.0
        cls.started, cls.stopped, cls.waiting = time.monotonic(), None, False

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
        if cls.waiting:
            return "Switch to Object Mode to get the result"
        left = cls.seconds_left()
        return f"{cls.stage} {cls.fraction:.0%}" + (f", {duration(left)} left" if left is not None else "")

    @classmethod
    def stop(cls):
        """Asks the job to stop, which it does within a tenth of a second; who watches it does the rest."""
        cls.job.cancel()
        cls.stopped = time.monotonic()

    @classmethod
    def wait(cls, seconds):
        """Until the job has ended, but no longer than that."""
        end = time.monotonic() + seconds
        while not cls.job.done() and time.monotonic() < end:
            time.sleep(0.002)

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


# What parameters are called here whose names in code are no words. Names of files and objects stay as they are.
TABLES = ("merge", "triangulate", "sculpt", "quads", "reconstruct", "cluster")
LABELS = {p.name: label(p) for table in TABLES for p in surfrecon.parameters(table) if "_" in p.name}
CODE_NAMES = re.compile(rf'(?<![\w"/.-])({"|".join(LABELS)})(?![\w"/.-])')


def sentence(problem):
    """The text of an error as people read it: the library's begin in small letters and name parameters as code does."""
    text = CODE_NAMES.sub(lambda name: f'"{LABELS[name[0]]}"', str(problem))
    # What begins with a file's or a scan's name is followed by a colon.
    return text[:1].upper() + text[1:] if re.match(r"[a-z]+[ ,]", text) else text


def duration(seconds):
    """A time for people: no more digits than an estimate has."""
    seconds = max(int(seconds + 0.5), 1)
    if seconds < 100:
        return f"{seconds} s"
    minutes = (seconds + 30) // 60
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"


class JobOperator:
    """An operator around a `surfrecon.Job`.

    A subclass defines `start(context)`, which gathers the input and returns a running job, or is a generator that does
    so object by object (see `gathered`), and `finish(context, result)`, which puts the result into the scene, or
    returns a further job whose result comes next. Both may raise `Refused` or the library's errors. `preview(context)`
    may return a job for a rough picture of the result, which is drawn while the other one takes its time.
    """

    bl_options = {"UNDO"}
    # Whether `finish` may meet the first result when an adjusted operation goes on in the background.
    may_be_handed_over = True
    replaces = None
    _timer = None
    _shown = None

    @classmethod
    def poll(cls, context):
        """One job at a time, and meshes can be read in object mode only."""
        if Running.job is not None and Adjusting.handed is None:
            cls.poll_message_set(f"{Running.title} is running")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Switch to Object Mode first")
            return False
        return True

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

    def invoke(self, context, event):
        """For people: returns at once; `modal` watches."""
        return self.watch(context)

    def watch(self, context):
        """Shows that something begins and leaves the rest to `modal`."""
        if Adjusting.handed is not None:
            Adjusting.adopt(self)
        else:
            # What an earlier operation made is not what this one will replace when it is adjusted.
            Adjusting.replaced = None
            Running.begin(Gathering(), self.bl_label)
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
            self.report({"WARNING"}, f"{self.bl_label}: cancelled")
            return self._leave(context, {"CANCELLED"})
        gathering = Running.job
        if not gathering.drawn():
            return {"RUNNING_MODAL"}
        try:
            if gathering.steps is None:
                gathering.steps = self._starting(context)
            job = gathering.read()
        except (Refused, surfrecon.SurfreconError) as problem:
            Running.take()
            self.report({"ERROR"}, sentence(problem))
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
            context.workspace.status_text_set(f"{self.bl_label}: {text}   ESC cancels")
        context.window_manager.progress_update(int(100 * Running.fraction))
        redraw(context)

    def _starting(self, context):
        """The steps of `start`, if it has any; a generator that returns the job."""
        Kept.only_of(self.bl_idname)
        refuse_no_numbers(self)
        started = self.start(context)
        return (yield from started) if inspect.isgenerator(started) else started

    def _begin(self, context):
        gathering = Gathering()
        gathering.steps = self._starting(context)
        try:
            job = None
            while job is None:
                job = gathering.read()
            Running.begin(job, self.bl_label)
        except (Refused, surfrecon.SurfreconError) as problem:
            self.report({"ERROR"}, sentence(problem))
            return False
        return True

    def _end(self, context):
        """What the operator returns, or `None` if there is more to do."""
        try:
            if Running.stopped is not None:  # also when it was done before it heard
                Running.take()
                raise surfrecon.Cancelled("cancelled")
            further = self.finish(context, Running.take().result())
            if further is not None:
                Running.begin(further, self.bl_label)
                return None
        except surfrecon.Cancelled:
            self.report({"WARNING"}, f"{self.bl_label}: cancelled")
            return {"CANCELLED"}
        except (Refused, surfrecon.SurfreconError) as problem:
            self.report({"ERROR"}, sentence(problem))
            return {"CANCELLED"}
        return {"FINISHED"}

    def _leave(self, context, done=None):
        """Takes away what was shown; returns `done`."""
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


def refuse_no_numbers(operator):
    """Refuses options that are no numbers: scripts and expressions can give them, past the limits of sliders."""
    for prop in operator.properties.bl_rna.properties:
        if prop.type != "FLOAT":
            continue
        value = getattr(operator, prop.identifier)
        for number in value if prop.is_array else (value,):
            if not math.isfinite(number):
                raise Refused(f"{prop.name} is {number}, which is no number to work with: enter another one")


class Adjusting:
    """An adjusted operation that takes too long to keep the window waiting.

    Blender runs an adjusted operator after it has undone the first result, and brings that back if the operator is
    cancelled. So it is cancelled, but its job is handed to a modal operator of the same kind, and when that ends what
    it made takes the place of the first result. If the user stops it, the first result stays as it is.
    """

    # Attributes of the operator whose job goes on, and what was there before it.
    handed = before = None
    # What the last such operation took the place of: undoing it brings that back, and adjusting it again replaces that.
    replaced = None

    @classmethod
    def hand_over(cls, operator, before):
        """Lets another operator go on with the running job, once Blender is done with its own steps."""
        name, options = operator.bl_idname, operator.as_keywords()
        category, _, short = name.partition("_OT_")
        call = getattr(getattr(bpy.ops, category.lower()), short)
        cls.handed, cls.before = dict(vars(operator)), before

        def go_on():
            try:
                with in_view():
                    call("INVOKE_DEFAULT", True, **options)
            except RuntimeError:  # it can't go on in what is there now
                Running.cancel()
            finally:
                cls.handed = cls.before = None

        bpy.app.timers.register(go_on, first_interval=0.0)

    @classmethod
    def adopt(cls, operator):
        """Makes an operator the one that goes on."""
        for name, value in cls.handed.items():
            setattr(operator, name, value)
        operator.replaces = cls.before.replaced_by()


class Before:
    """What was selected and what there was before an operation."""

    def __init__(self, context):
        self.selected = [obj.name for obj in context.selected_objects]
        self.active = context.object.name if context.object is not None else None
        self.objects, self.collections = set(bpy.data.objects.keys()), set(bpy.data.collections.keys())
        self.made = self.made_in = ()

    def replaced_by(self):
        """This, with the names of what has come since."""
        self.made = sorted(set(bpy.data.objects.keys()) - self.objects)
        self.made_in = sorted(set(bpy.data.collections.keys()) - self.collections)
        return self

    def there(self):
        """Whether what was made is in the file: the operation that replaced it was undone."""
        return all(name in bpy.data.objects for name in self.made)

    def select(self, context):
        """Selects what was selected then."""
        for obj in context.selected_objects:
            obj.select_set(False)
        for name in self.selected:
            if name in context.view_layer.objects:
                # The result that is there has hidden what it was made from.
                context.view_layer.objects[name].hide_set(False)
                context.view_layer.objects[name].select_set(True)
        context.view_layer.objects.active = context.view_layer.objects.get(self.active or "")

    def replace(self):
        """Removes what was made then; what was made now takes its names."""
        for kind, names in ((bpy.data.objects, self.made), (bpy.data.collections, self.made_in)):
            for name in names:
                old = kind.get(name)
                if old is None:
                    continue
                data = getattr(old, "data", None)
                kind.remove(old)
                label = data.name if data is not None else ""
                if data is not None and data.users == 0:
                    bpy.data.batch_remove([data])
                successor = kind.get(f"{name}.001")
                if successor is not None:
                    successor.name = name
                    if data is not None:
                        successor.data.name = label


def in_view():
    """The context of a 3D view, which timers lack."""
    manager = bpy.context.window_manager
    for window in manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                region = next(region for region in area.regions if region.type == "WINDOW")
                return bpy.context.temp_override(window=window, area=area, region=region)
    return bpy.context.temp_override(window=manager.windows[0])


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
