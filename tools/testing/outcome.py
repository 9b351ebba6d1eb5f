"""Counts of tests, and what one test came to and cost."""

from dataclasses import asdict, dataclass


@dataclass
class Tally:
    """Numbers of tests passed, failed and skipped."""

    passed: int = 0
    failed: int = 0
    skipped: int = 0

    def add(self, other):
        """Adds another tally to this one."""
        self.passed += other.passed
        self.failed += other.failed
        self.skipped += other.skipped

    def count(self, outcome):
        """Adds one test of an outcome: "passed", "failed" or "skipped"."""
        setattr(self, outcome, getattr(self, outcome) + 1)

    def __str__(self):
        return f"{self.passed} passed, {self.failed} failed, {self.skipped} skipped"


@dataclass
class Test:
    """One test that ran. `cpu` is None where its runner does not measure it."""

    # Not a test of pytest's, though its name begins so.
    __test__ = False

    name: str
    outcome: str
    # Of the wall.
    seconds: float
    # Of all its threads and of the programs that it called.
    cpu: float | None = None

    def row(self):
        """As a row of times.json."""
        return asdict(self)
