# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs: what runs while the window lives. Those of the library (`surfrecon.Job`), and what stands for one here."""

import inspect
import math
import threading
import time

import bpy
import surfrecon

from .telling import told
from .words import duration

# Estimates of the time left are worth nothing before.
SETTLED_SECONDS, SETTLED_SHARE = 1.0, 0.02

# Seconds between looks at a job that is waited for.
LOOK_SECONDS = 0.002

# Objects are read for no longer than this between two events of the window.
READING_SECONDS = 0.03


class Refused(Exception):
    """The selection can't be used. The text is one sentence that says why and what to do."""


class Gathering:
    """Stands for the job until its input is read, which begins once the first progress has been drawn."""

    looked_at, share, steps = 0, 0.0, None

    def __init__(self, title):
        self.title = title

    def progress(self):
        """The share of the input that is read."""
        return self.title, self.share

    def read(self):
        """Reads on for a moment. It returns the job once all is read, else `None`."""
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


class Handle:
    """An object as it is known while something runs and the user may rename, undo or remove: by a number that stays,
    and the name that it had.
    """

    def __init__(self, obj):
        self.name, self.number = obj.name, obj.session_uid

    def __eq__(self, other):
        return isinstance(other, Handle) and self.number == other.number

    def __hash__(self):
        return hash(self.number)

    def get(self):
        """The object, or `None` where it is gone."""
        found = bpy.data.objects.get(self.name)
        if found is not None and found.session_uid == self.number:
            return found
        return next((obj for obj in bpy.data.objects if obj.session_uid == self.number), None)


def still_there(handles):
    """The objects of handles, as a list. It refuses one that is gone. One that a result points to stays in the file
    when it is deleted, and no scene has it.
    """
    objects = [handle.get() for handle in handles]
    seen = {obj for scene in bpy.data.scenes for obj in scene.objects}
    for handle, obj in zip(handles, objects, strict=True):
        if obj not in seen:
            raise removed(handle)
    return objects


def removed(handle):
    """The refusal to go on with an object that is gone."""
    return Refused(f'"{handle.name}" was removed meanwhile: try again')


def gathered(context, objects, read):
    """`read(object, depsgraph)` of each object, as a list. It is a generator, for `launch`, that yields the share done.
    A `read` that takes long may be a generator of the same kind.

    The user may work on meanwhile, so objects are looked up when their turn comes.
    """
    handles = [Handle(obj) for obj in objects]
    found = []
    for k, handle in enumerate(handles):
        yield k / len(handles)
        obj = handle.get()
        if obj is None:
            raise removed(handle)
        content = read(obj, context.evaluated_depsgraph_get())
        if inspect.isgenerator(content):
            content = yield from part_of(content, k / len(handles), 1 / len(handles))
        found.append(content)
    return found


def part_of(steps, begin, length):
    """A generator that yields shares, as a part of a longer one. It returns what `steps` returns."""
    while True:
        try:
            share = next(steps)
        except StopIteration as ended:
            return ended.value
        yield begin + length * share


def waited(job):
    """The result of a job of the library. It is a generator, for `launch`, that yields the share done. A generator that
    is dropped cancels the job.
    """
    while not job.done():
        yield job.progress()[1]
        time.sleep(LOOK_SECONDS)
    return job.result()


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
        """The value that the function returned. Raises what it raised."""
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
    def text(cls, letters=math.inf):
        """Stage, share done and time left, for people, in so many letters: a stage that is too long is said in part, or
        not at all.
        """
        if cls.stopped is not None:
            return told("stopping")
        if cls.waiting:
            return told("Switch to Object Mode to get the result")
        left = cls.seconds_left()
        rest = f"{cls.fraction:.0%}" + (f", {told(f'{duration(left)} left')}" if left is not None else "")
        stages = (cls.stage, cls.stage.split(", ")[0])
        texts = (f"{told(stage)} {rest}" for stage in stages if stage)
        return next((text for text in texts if len(text) <= letters), rest)

    @classmethod
    def stop(cls):
        """Asks the job to stop, which it does within a tenth of a second. The watcher of the job does the rest."""
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
