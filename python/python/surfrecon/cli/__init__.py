"""The command line: ``surfrecon --help``.

======================== =======================================================================
``program``              runs a command line, and what becomes of errors
``performing``           one command from reading to writing, and exit codes
``parser``, ``options``  the command line, and options out of the table of parameters
``commands``             what each command takes and writes
``operations``           what each command does
``contents``             what scans hold
``work``, ``requests``   one run: what is asked, the files that it reads, how it is stopped
``batch``, ``manifest``  many jobs
``task``                 tasks of a merge that was planned
``conflicts``            jobs that would write over what others read or write
``inputs``, ``members``  files that are read, their hashes, and files that files name
``record``               what is kept of a run: its report and the provenance of its result
``files``                text files that appear whole
``advice``               what to do about errors, in options of the command line
``streams``              closed pipes, full disks, names that are not UTF-8
``stops``                Ctrl-C
``progress``             bars
``completion``           shells
======================== =======================================================================
"""

import sys

from .._interrupts import leave_to_system

__all__ = ["main"]


def main() -> None:
    """Runs the command of ``sys.argv`` and ends the program with its exit code."""
    # Until all is loaded nothing has begun.
    leave_to_system()
    from .program import run

    sys.exit(run(sys.argv[1:]))
