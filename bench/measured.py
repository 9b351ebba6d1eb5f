"""Runs a program and measures it.

As a script it is the small process in between: `python measured.py RESULT CPU_LIMIT PROGRAM ARGUMENT...`. A child's
peak memory as the system reports it includes what its parent held when it was forked, so the parent must be small, and
the benchmark, with numpy and meshes in memory, is not.
"""

import json
import os
import resource
import signal
import sys
import time


def main():
    """Forks, waits, writes wall seconds, CPU seconds and peak megabytes to RESULT. A CPU_LIMIT of 0 s is none."""
    result, limit, program = sys.argv[1], int(sys.argv[2]), sys.argv[3:]
    started = time.monotonic()
    child = os.fork()
    if child == 0:
        if limit:
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        try:
            os.execvp(program[0], program)
        except OSError as error:
            os.write(2, f"{program[0]}: {error.strerror}\n".encode())
        os._exit(127)
    _, status, usage = os.wait4(child, 0)
    figures = {
        "wall_s": time.monotonic() - started,
        "cpu_s": usage.ru_utime + usage.ru_stime,
        "peak_mb": usage.ru_maxrss / 1024,
    }
    with open(result, "w") as out:
        json.dump(figures, out)
    return os.waitstatus_to_exitcode(status) & 0xFF


# CPU seconds that the system's clocks can tell apart, about: what is divided by is at least this.
LEAST_S = 1e-4


class Failed(Exception):
    """The program ended with an error or took too long; the text is what it said last."""


def run(command, timeout=1800, cpu_limit=0):
    """Runs a command in a fresh process; returns its figures and what it printed.

    `timeout` is in seconds of the clock, `cpu_limit` in CPU seconds, which do not depend on what else is running.
    """
    import subprocess
    import tempfile

    # Spinning OpenMP threads would count as work of the peers; Qt must not look for a display.
    environment = {"OMP_WAIT_POLICY": "passive", "QT_QPA_PLATFORM": "offscreen", **os.environ}
    with tempfile.TemporaryDirectory() as folder:
        result = os.path.join(folder, "figures.json")
        command = [sys.executable, "-E", "-S", __file__, result, str(cpu_limit), *map(str, command)]
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=environment,
            text=True,
            errors="replace",
            start_new_session=True,
            cwd=folder,
        )
        try:
            printed, _ = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            raise Failed(f"took more than {timeout} s") from None
        if cpu_limit and process.returncode == 256 - signal.SIGXCPU:
            raise Failed(f"stopped after {cpu_limit} s of CPU time")
        if process.returncode != 0:
            said = " | ".join(printed.strip().splitlines()[-3:])
            raise Failed(f"ended with status {process.returncode}: {said}")
        with open(result) as source:
            return json.load(source), printed


if __name__ == "__main__":
    sys.exit(main())
