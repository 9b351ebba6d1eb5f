"""Programs of others, in the environment of the benchmarks: they judge what we write."""

import os
import subprocess

import pytest

# A Python that has them. The tests of everything install it.
PEERS = os.environ.get("SURFRECON_PEERS")

needs_peers = pytest.mark.skipif(not PEERS, reason="SURFRECON_PEERS does not name a Python with the peers")


def lines_of(program, *arguments, folder=None):
    """The lines that a program prints: a Python script, run in the folder."""
    run = subprocess.run([PEERS, "-c", program, *map(str, arguments)], capture_output=True, text=True, cwd=folder)
    assert run.returncode == 0, run.stderr
    return run.stdout.strip().splitlines()
