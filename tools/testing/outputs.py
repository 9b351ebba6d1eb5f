"""Reads what each kind of runner prints: which tests ran, what they came to, and what they cost.

A reader has `tally`, `tests` (one `Test` each, where the runner tells them apart), `line` for the next line, and
`ended` for the end, which takes the CPU seconds of the whole process.
"""

import json
import re

from testing.outcome import Tally, Test


class Output:
    """A reader that keeps the lines to show."""

    def __init__(self):
        self.tally, self.tests, self.shown = Tally(), [], []

    def line(self, line):
        """Takes the next line."""
        self.shown.append(line)

    def ended(self, cpu):
        """Takes the CPU seconds of the process once it has ended."""


class PlainOutput(Output):
    """For steps that prepare something: there is nothing to count unless they fail."""


class CheckOutput(Output):
    """Counts the `ok: ...` and `FAILED: ...` lines of our scripts."""

    def line(self, line):
        """Takes the next line."""
        super().line(line)
        self.tally.add(Tally(passed=int(line.startswith("ok: ")), failed=int(line.startswith("FAILED: "))))


class RustOutput(Output):
    """Reads the JSON lines of one test program.

    Of tests that pass, only what says that something was skipped is shown. Such a test counts as skipped: it
    lacked its data.
    """

    # A "timeout" is only said of a test that still runs after a minute.
    OUTCOMES = {"ok": "passed", "failed": "failed"}

    def __init__(self, program):
        super().__init__()
        self.program = program

    def line(self, line):
        """Takes the next line."""
        try:
            event = json.loads(line) if line.startswith("{") else None
        except json.JSONDecodeError:
            event = None
        if not isinstance(event, dict) or "type" not in event:
            # Programs that tests call print beside the runner.
            super().line(line)
        elif event["type"] == "test" and event["event"] in self.OUTCOMES:
            self.take(event)

    def take(self, event):
        """Takes the end of one test."""
        outcome, printed = self.OUTCOMES[event["event"]], event.get("stdout", "")
        skips = [said for said in printed.splitlines() if said.startswith("SKIPPED")]
        if outcome == "failed":
            self.shown += [f"---- {event['name']}", *printed.splitlines(), event.get("message", "")]
        elif skips:
            outcome = "skipped"
            self.shown += [f"{said} ({event['name']})" for said in skips]
        self.tally.count(outcome)
        self.tests.append(Test(f"{self.program} {event['name']}", outcome, event.get("exec_time", 0.0)))

    def ended(self, cpu):
        """Shares the CPU seconds of the program among its tests by their time: the runner knows no more."""
        total = sum(test.seconds for test in self.tests)
        for test in self.tests:
            test.cpu = cpu * test.seconds / total if total else 0.0


class DoctestOutput(Output):
    """Counts what `cargo test --doc` says."""

    def line(self, line):
        """Takes the next line."""
        super().line(line)
        result = re.match(r"test result: \w+\. (\d+) passed; (\d+) failed; (\d+) ignored", line)
        if result:
            self.tally.add(Tally(*map(int, result.groups())))


class PytestOutput(Output):
    """Reads the records that tests/conftest.py writes into a file; what pytest prints is shown as it is."""

    def __init__(self, step, record):
        super().__init__()
        self.step, self.record = step, record

    def ended(self, cpu):
        """Reads the records."""
        lines = self.record.read_text().splitlines() if self.record.exists() else []
        for row in map(json.loads, lines):
            if "error" in row:
                self.tally.count("failed")
                continue
            self.tally.count(row["outcome"])
            self.tests.append(Test(f"{self.step}: {row['name']}", row["outcome"], row["seconds"], row["cpu"]))
