"""Steps that need each other, run beside each other.

A step begins once all that it needs has ended well, what it holds is free, and the machine has room for it. Of
several that could, the first in the list begins. What a step prints goes into a file of its own, and to the terminal
as a whole when it has ended, so that steps that run at once stay apart.
"""

import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from testing.outcome import Tally
from testing.outputs import Output, PlainOutput

# No step may hang the whole run: the bpy module is known to hang at exit.
LIMIT = 45 * 60


def show(line):
    """Prints at once."""
    print(line, flush=True)


@dataclass
class Step:
    """A program to run. `command` may be a function that gives it when the step begins."""

    name: str
    command: list | Callable
    output: Output = field(default_factory=PlainOutput)
    env: dict = field(default_factory=dict)
    # Names of steps that must have ended well.
    needs: tuple = ()
    # Things that only one step at a time may use, such as cargo's folder.
    holds: tuple = ()
    # Cores that it keeps busy, about; 0 for what mostly waits.
    cores: float = 1.0
    # The status that says that what the step needs can't be had here: it is skipped, and so are those that need it.
    unavailable: int | None = None
    # The folder that it runs in, unless that is the tree's root.
    folder: Path | None = None


@dataclass
class Ended:
    """A step that has ended: how, and at what cost."""

    step: Step
    # "ok", "failed", "unavailable", or "not run".
    how: str
    tally: Tally
    began: float = 0.0
    seconds: float = 0.0
    cpu: float = 0.0


def chosen(steps, names):
    """The steps that are called so, with those that they need, in the order of the list; all where none is named."""
    if not names:
        return steps
    known = {step.name: step for step in steps}
    for name in names:
        if name not in known:
            raise SystemExit(f"no step is called {name!r}. The steps are: {', '.join(known)}.")
    wanted, left = set(), list(names)
    while left:
        name = left.pop()
        if name not in wanted:
            wanted.add(name)
            left.extend(known[name].needs)
    return [step for step in steps if step.name in wanted]


class Graph:
    """Runs steps with as many at once as the machine has cores for."""

    def __init__(self, steps, logs, root, cores=None):
        self.steps, self.logs, self.root = list(steps), logs, root
        # Steps wait for disks and programs now and then: one more fills that time.
        self.room = (cores or os.cpu_count() or 1) + 1
        self.ended, self.running = {}, {}
        self.changed = threading.Condition()
        self.start = time.monotonic()
        names = [step.name for step in self.steps]
        twice = {name for name in names if names.count(name) > 1}
        unknown = {need for step in self.steps for need in step.needs} - set(names)
        if twice or unknown:
            raise ValueError(
                f"steps that are there twice: {sorted(twice)}; that are needed and not there: {sorted(unknown)}"
            )

    def run(self):
        """Runs all; returns what became of each, in the order of the list."""
        self.logs.mkdir(parents=True, exist_ok=True)
        with self.changed:
            while len(self.ended) < len(self.steps):
                self.pass_over()
                for step in self.steps:
                    if self.may_begin(step):
                        thread = threading.Thread(target=self.work, args=(step,))
                        self.running[step.name] = step
                        thread.start()
                if len(self.ended) < len(self.steps):
                    if not self.running:
                        raise RuntimeError("steps need each other in a circle")
                    self.changed.wait()
        return [self.ended[step.name] for step in self.steps]

    def pass_over(self):
        """Ends the steps that need one that did not end well."""
        before = -1
        while before != len(self.ended):
            before = len(self.ended)
            for step in self.steps:
                lacking = [n for n in step.needs if n in self.ended and self.ended[n].how != "ok"]
                if step.name in self.ended or not lacking:
                    continue
                absent = all(self.ended[need].how == "unavailable" for need in lacking)
                show(f"\n{'SKIPPED' if absent else 'FAILED:'} {step.name}: it needs {', '.join(lacking)}")
                tally = Tally(skipped=1) if absent else Tally(failed=1)
                self.ended[step.name] = Ended(step, "unavailable" if absent else "not run", tally)

    def may_begin(self, step):
        """Whether a step can begin now."""
        if step.name in self.ended or step.name in self.running:
            return False
        if not all(need in self.ended for need in step.needs):
            return False
        busy = self.running.values()
        if {thing for other in busy for thing in other.holds} & set(step.holds):
            return False
        used = sum(other.cores for other in busy)
        return step.cores == 0 or used == 0 or used + step.cores <= self.room

    def work(self, step):
        """Runs one step in a thread of its own."""
        began = time.monotonic()
        try:
            ended = run(step, self.logs / f"{file_name(step.name)}.txt", self.root)
        except Exception as error:  # noqa: BLE001 (whatever it is, the others go on and it is told)
            ended = Ended(step, "failed", Tally(failed=1))
            show(f"\nFAILED: {step.name}: {error}")
        ended.began = began - self.start
        with self.changed:
            del self.running[step.name]
            self.ended[step.name] = ended
            self.changed.notify()


def file_name(name):
    """The name of a step as that of a file."""
    return "".join(letter if letter.isalnum() or letter in "-._" else "_" for letter in name)


def run(step, log, root):
    """Runs the program of a step to its end and shows what it printed."""
    command = step.command() if callable(step.command) else step.command
    began = time.monotonic()
    process = subprocess.Popen(
        list(map(str, command)),
        cwd=step.folder or root,
        env={**os.environ, **step.env},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    killer = threading.Timer(LIMIT, kill, [process.pid])
    killer.start()
    with log.open("w", buffering=1) as file:
        for line in process.stdout:
            file.write(line)
            step.output.line(line.rstrip("\n"))
    _, status, used = os.wait4(process.pid, 0)
    killer.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    cpu, seconds = used.ru_utime + used.ru_stime, time.monotonic() - began
    step.output.ended(cpu)
    tally, how = step.output.tally, "ok"
    lines = [f"\n== {step.name}", *step.output.shown]
    if process.returncode != 0 and process.returncode == step.unavailable:
        how = "unavailable"
        lines.append(f"SKIPPED {step.name}: see above")
        tally.add(Tally(skipped=1))
    elif process.returncode != 0 or tally.failed:
        how = "failed"
        if tally.failed == 0:
            lines.append(f"{step.name}: ended with status {process.returncode}")
            tally.add(Tally(failed=1))
    show("\n".join([*lines, f"== {step.name}: {tally} ({seconds:.0f} s, {cpu:.0f} s of CPU)"]))
    return Ended(step, how, tally, seconds=seconds, cpu=cpu)


def kill(process):
    """Ends a step that takes too long, with all that it started."""
    os.killpg(process, signal.SIGKILL)
