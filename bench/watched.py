"""Watches a merge in files: the workspace while it runs, and the memory of processes."""

import contextlib
import os
import threading
from pathlib import Path


def most_taken_mb(pid="self"):
    """The most memory that a process had since it began to run its program."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:")) / 1024


class Watched:
    """A workspace, looked at every now and then: most megabytes of its files, and how many blocks have a surface."""

    def __init__(self, folder):
        self.folder, self.most_mb, self.blocks, self._stage = Path(folder), 0.0, 0, None
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._watch)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._done.set()
        self._thread.join()

    def told(self, stage, _fraction):
        """Takes what a merge says of its progress: blocks are all there when the stage that makes them has ended."""
        if stage != self._stage:
            self._stage = stage
            self._look()

    def _look(self):
        total, blocks = 0, 0
        # Files and folders that are done with since they were listed: `os.walk` passes over those folders, `Path.rglob`
        # raises.
        for folder, _, names in os.walk(self.folder):
            for name in names:
                with contextlib.suppress(FileNotFoundError):
                    total += os.stat(os.path.join(folder, name)).st_size
                    blocks += name.startswith("tile-")
        self.most_mb, self.blocks = max(self.most_mb, total / 1e6), max(self.blocks, blocks)

    def _watch(self):
        while not self._done.wait(0.05):
            self._look()
