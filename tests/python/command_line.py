"""The command line as a program of its own."""

import os
import subprocess
import sys
from pathlib import Path

import surfrecon

ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"} | {
    "PYTHONPATH": str(Path(surfrecon.__file__).parents[1].resolve())
}
PROGRAM = [sys.executable, "-m", "surfrecon"]


def run(*arguments, **options):
    """Runs it to its end; what it says is text."""
    given = {"capture_output": True} if not {"stdout", "stderr"} & set(options) else {}
    given |= {"env": ENVIRONMENT, "timeout": 300}
    done = subprocess.run([*PROGRAM, *arguments], **(given | options))
    done.stdout, done.stderr = (None if s is None else s.decode(errors="replace") for s in (done.stdout, done.stderr))
    assert "Traceback" not in (done.stderr or ""), done.stderr
    return done


def start(*arguments, **options):
    """Starts it."""
    return subprocess.Popen([*PROGRAM, *arguments], env=ENVIRONMENT, **options)
