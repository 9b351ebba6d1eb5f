"""The rows that a benchmark has measured so far, in a file that is whole at any moment: a stop loses nothing."""

import json
import math
import os
import resource
import statistics

import measured

# A tool whose run takes longer runs once: what disturbs so long a run is small beside it, and repeating the slowest
# peers would be most of a benchmark's time.
ONCE_CPU_S = 5
# No run is begun after as much CPU time: a benchmark takes ten minutes at most, for the longest run takes under two.
BUDGET_CPU_S = 480


def cpu_s():
    """CPU seconds of this process and of all that it has waited for."""
    both = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def in_turn(tools, repeats, once, used=cpu_s, may=lambda tool: True):
    """Runs the tools in turn, so that another load on the machine meets all of them alike.

    Gives for each run the tool and what `once(tool)` gave, or the text of the `measured.Failed` it raised. A tool that
    failed, whose run took more than ONCE_CPU_S by `used`, or that `may(tool)` not run any more, is not run again.
    """
    left = list(tools)
    for _ in range(repeats):
        for tool in list(left):
            if not may(tool):
                left.remove(tool)
                continue
            before = used()
            try:
                made, problem = once(tool), None
            except measured.Failed as failed:
                made, problem = None, str(failed)
            if problem or used() - before > ONCE_CPU_S:
                left.remove(tool)
            yield tool, made, problem


def finite(value):
    """The value as JSON can hold it: what is no finite number is null."""
    if isinstance(value, dict):
        return {key: finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


class Record:
    """The rows of a benchmark. Each that has no `failed` has all `columns`; `budget` is in CPU seconds by `used`."""

    def __init__(self, file, head, columns, budget=math.inf, used=cpu_s):
        self.file, self.columns, self.budget, self.used, self.began = file, list(columns), budget, used, used()
        self.kept = {**head, "finished": False, "cpu_s": 0.0, "columns": self.columns, "rows": [], "skipped": []}
        file.parent.mkdir(parents=True, exist_ok=True)
        self.save()

    @property
    def rows(self):
        """All rows so far."""
        return self.kept["rows"]

    @property
    def skipped(self):
        """The cases that could not run, and why."""
        return self.kept["skipped"]

    def save(self):
        """Writes the file anew, in one step."""
        self.kept["cpu_s"] = self.used() - self.began
        whole = self.file.with_suffix(".part")
        whole.write_text(json.dumps(finite(self.kept), indent=1, allow_nan=False) + "\n")
        os.replace(whole, self.file)

    def put(self, row, table="rows"):
        """Adds a row, or takes note of what was changed in one; other tables than `rows` have columns of their own."""
        lacking = [key for key in self.columns if key not in row and "failed" not in row and table == "rows"]
        if lacking:
            raise ValueError(f"{self.file.name}: the row of {row.get('case')}, {row.get('tool')} lacks {lacking}")
        rows = self.kept.setdefault(table, [])
        if not any(row is other for other in rows):
            rows.append(row)
        self.save()

    def skip(self, reason):
        """Notes what can't run, visibly."""
        print(f"SKIPPED {reason}", flush=True)
        self.skipped.append(reason)
        self.save()

    def has_time(self):
        """Whether CPU time is left."""
        return self.used() - self.began < self.budget

    def has_time_for(self, what):
        """Whether CPU time is left; without any, `what` is skipped."""
        if not self.has_time():
            self.skip(f"{what}: {self.budget} s of CPU time are used up; --all knows no limit")
        return self.has_time()

    def finish(self):
        """The benchmark has come to its end."""
        self.kept["finished"] = True
        self.save()

    def measure(self, tools, repeats, once, head, judge=None, derive=None):
        """Runs the tools in turn on one case and keeps a row for each: `head(tool)`, the medians of its runs' figures.

        `once(tool)` gives a run's figures and its result, of which, the first time, `judge(tool, result)` says what it
        is worth. `derive(rows)` adds what follows from the other rows of the case. Returns the rows.
        """
        runs, rows = {tool: [] for tool in tools}, {}

        def named(tool):
            return " ".join(str(part) for part in head(tool).values())

        def may(tool):
            # One that has a row is not skipped, only not repeated.
            return self.has_time() or (tool not in rows and self.has_time_for(named(tool)))

        for tool, made, problem in in_turn(tools, repeats, once, self.used, may):
            if problem:
                print(f"    {named(tool)}: {problem}", flush=True)
                rows.setdefault(tool, {}).clear()
                rows[tool] |= head(tool) | {"failed": problem}
            else:
                figures, result = made
                runs[tool].append(figures)
                if tool not in rows:
                    rows[tool] = head(tool) | (judge(tool, result) if judge else {})
                rows[tool] |= {key: statistics.median(run[key] for run in runs[tool]) for key in figures}
                rows[tool]["runs"] = len(runs[tool])
                # How far the runs lie apart says what the medians are worth.
                rows[tool] |= {f"{key}_all": [run[key] for run in runs[tool]] for key in figures if "cpu_s" in key}
            if derive:
                derive(list(rows.values()))
            self.put(rows[tool])
        return list(rows.values())
