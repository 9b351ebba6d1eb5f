"""The places of tasks' files: a folder that all processes reach, or what fsspec reaches, a part at a time."""

from __future__ import annotations

import os
import shutil
import tempfile
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

from .._arguments import is_url
from .._errors import FileError, FormatError, InputError

__all__ = ["Storage", "plain", "read_text", "remove_file", "write_text"]

# Marks that a task is done: handed over last.
_MARK = "done-"
# The beginning of the names of files that nobody has finished.
_UNFINISHED = "unfinished-"


# A folder is one whatever it is called.
_FOLDERS = ("file://", "local://")


def plain(workspace: str) -> str:
    """A workspace as it is called here: ``/disk`` of ``file:///disk``."""
    return url2pathname(urlsplit(workspace).path) if workspace.startswith(_FOLDERS) else workspace


class Storage(ABC):
    """The files of a merge."""

    # Whether tasks have a part of the files alone at hand.
    is_remote = False

    def __init__(self, place: str) -> None:
        """``place`` is the merge's own folder."""
        self.place = place

    @staticmethod
    def of(workspace: str, name: str) -> Storage:
        """The folder of that name in a workspace."""
        return Remote(f"{workspace.rstrip('/')}/{name}") if is_url(workspace) else Local(os.path.join(workspace, name))

    @abstractmethod
    def make(self) -> None:
        """Makes the folder, unless it is there.

        Raises:
            InputError: the workspace is no folder.
            FileError: it can't be made.
        """

    @abstractmethod
    def at_hand(self, wanted: Sequence[str], spent: Sequence[str], scratch: str | os.PathLike[str] | None) -> Any:
        """A context in which those files whose names begin as ``wanted`` are in a folder of this machine.

        If all goes well files that were added are handed over, and those whose names begin as ``spent`` go: nobody
        wants them any more.
        """

    @abstractmethod
    def remove(self) -> None:
        """Removes the folder with all that is in it."""

    @abstractmethod
    def discard(self) -> None:
        """Removes the folder if nothing is in it."""


class Local(Storage):
    """A folder."""

    def make(self) -> None:
        """Makes it in a workspace that exists."""
        workspace = os.path.dirname(self.place)
        if not os.path.isdir(workspace):
            raise InputError(f"{workspace}: the workspace must be a folder that exists")
        try:
            os.makedirs(self.place, exist_ok=True)
        except OSError as problem:
            raise FileError(f"{self.place}: {problem.strerror}") from None

    @contextmanager
    def at_hand(
        self, wanted: Sequence[str], spent: Sequence[str], scratch: str | os.PathLike[str] | None
    ) -> Iterator[str]:
        """It is at hand. Tasks themselves remove what is spent."""
        if not os.path.isdir(self.place):
            raise FileError(f"{self.place}: the folder of the tasks is not there: plan the merge anew")
        yield self.place

    def discard(self) -> None:
        """Removes it, unless a merge has left something there."""
        with suppress(OSError):
            os.rmdir(self.place)

    def remove(self) -> None:
        """Removes it."""
        shutil.rmtree(self.place, ignore_errors=True)


class Remote(Storage):
    """A folder that fsspec reaches. Files with their names never change, so a process fetches each once."""

    is_remote = True

    def make(self) -> None:
        """Folders are made of names there."""
        files, root = _files(self.place)
        with _failures(self.place):
            files.makedirs(root, exist_ok=True)

    @contextmanager
    def at_hand(
        self, wanted: Sequence[str], spent: Sequence[str], scratch: str | os.PathLike[str] | None
    ) -> Iterator[str]:
        """Fetches what is not here yet. Hands over what is new, marks last."""
        if scratch is not None and not os.path.isdir(scratch):
            raise InputError(f"{os.fspath(scratch)}: scratch must be a folder that exists")
        files, root = _files(self.place)
        there = self._there(files, root)
        names = [name for name in there if name.startswith(tuple(wanted))]
        with _fetching, _failures(self.place):
            fetched = _fetched(files, root, names, scratch)
        with tempfile.TemporaryDirectory(prefix="surfrecon-task-", dir=scratch) as folder:
            for name in names:
                _linked(os.path.join(fetched, name), os.path.join(folder, name))
            try:
                yield folder
            except (FormatError, InputError) as problem:
                # Of a copy nobody knows anything.
                raise type(problem)(str(problem).replace(folder, self.place)) from None
            new = [name for name in os.listdir(folder) if name not in names and not name.startswith(_UNFINISHED)]
            with _failures(self.place):
                for name in sorted(new, key=lambda name: (name.startswith(_MARK), name)):
                    # The first mark stays.
                    if not (name.startswith(_MARK) and files.exists(f"{root}/{name}")):
                        files.put_file(os.path.join(folder, name), f"{root}/{name}")
                for name in there:
                    if name.startswith(tuple(spent)):
                        with suppress(FileNotFoundError):
                            files.rm_file(f"{root}/{name}")

    def _there(self, files: Any, root: str) -> list[str]:
        with _failures(self.place):
            files.invalidate_cache()
            if not files.exists(root):
                return []
            return sorted(name.rsplit("/", 1)[-1] for name in files.ls(root, detail=False))

    def discard(self) -> None:
        """Without files there is no folder there."""

    def remove(self) -> None:
        """Removes it there, and what was fetched of it here."""
        files, root = _files(self.place)
        with _failures(self.place):
            if files.exists(root):
                files.rm(root, recursive=True)
        with _fetching:
            _caches.pop(root, None)


# The files that this process has fetched, by their folder. They go with the process.
_caches: dict[str, tempfile.TemporaryDirectory[str]] = {}
_fetching = threading.Lock()


def _fetched(files: Any, root: str, names: Sequence[str], scratch: str | os.PathLike[str] | None) -> str:
    """A folder that has these files and no others."""
    if root not in _caches:
        _caches[root] = tempfile.TemporaryDirectory(prefix="surfrecon-fetched-", dir=scratch)
    folder = _caches[root].name
    here = set(os.listdir(folder))
    for name in here - set(names):
        os.unlink(os.path.join(folder, name))
    for name in names:
        if name not in here:
            whole = os.path.join(folder, name)
            files.get_file(f"{root}/{name}", f"{whole}.part")
            os.replace(f"{whole}.part", whole)
    return folder


def _linked(path: str, to: str) -> None:
    try:
        os.link(path, to)
    except OSError:
        shutil.copyfile(path, to)


@contextmanager
def _failures(place: str) -> Iterator[None]:
    """A server's error as an error of a file: each of fsspec's implementations has errors of its own."""
    try:
        yield
    except Exception as problem:
        raise FileError(f"{place}: {getattr(problem, 'strerror', None) or problem}") from None


def _files(url: str) -> tuple[Any, str]:
    try:
        import fsspec
    except ImportError:
        raise InputError(f"{url}: URLs need the package fsspec: pip install fsspec") from None
    try:
        return fsspec.url_to_fs(url)  # type: ignore[no-any-return]
    except (ImportError, ValueError) as problem:
        raise InputError(f"{url}: {problem}") from None


def remove_file(path: str) -> None:
    """Removes a file, if it is there."""
    with suppress(FileNotFoundError):
        if is_url(path):
            files, name = _files(path)
            files.rm_file(name)
        else:
            os.unlink(path)


def read_text(path: str) -> str:
    """A file's text.

    Raises:
        FileError: it can't be read.
    """
    try:
        if is_url(path):
            files, name = _files(path)
            return str(files.cat_file(name).decode())
        with open(path, encoding="utf-8") as file:
            return file.read()
    except OSError as problem:
        raise FileError(f"{path}: {problem.strerror or problem}") from None


def write_text(path: str, text: str) -> None:
    """Writes a file as a whole.

    Raises:
        FileError: it can't be written.
    """
    try:
        if is_url(path):
            files, name = _files(path)
            files.pipe_file(name, text.encode())
            return
        part = f"{path}.part-{os.getpid()}"
        try:
            with open(part, "w", encoding="utf-8") as file:
                file.write(text)
            os.replace(part, path)
        finally:
            if os.path.exists(part):
                os.unlink(part)
    except OSError as problem:
        raise FileError(f"{path}: {problem.strerror or problem}") from None
