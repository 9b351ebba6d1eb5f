"""The exceptions of surfrecon. Their texts name the offending thing and, where there is one, the remedy."""


class SurfreconError(Exception):
    """Base of all exceptions of this package.

    >>> try:
    ...     mesh = surfrecon.read("nowhere.ply")
    ... except surfrecon.SurfreconError as error:  # any of them
    ...     print(type(error).__name__)
    FileError
    """

    def __reduce__(self) -> tuple[object, ...]:
        # With Python's own, what Dask sends exceptions by (tblib) can't make those anew that are a MemoryError.
        return type(self), self.args


class ParameterError(SurfreconError, ValueError):
    """An option lies outside its range. The text gives value, range and unit.

    >>> try:
    ...     result = surfrecon.merge(scans, voxel=-1.0)
    ... except surfrecon.ParameterError as error:
    ...     print(error)
    voxel must be a finite number > 0, got -1 (in the unit of the scans)
    """


class InputError(SurfreconError, ValueError):
    """The data handed in can't be used.

    >>> try:
    ...     aligned = surfrecon.align(scans[:1])
    ... except surfrecon.InputError as error:
    ...     print(error)
    aligning takes at least two scans, got 1
    """


class FormatError(SurfreconError, ValueError):
    """A file does not hold what its format promises. The text gives file and place.

    >>> with open("notes.ply", "w") as file:
    ...     count = file.write("no scan")
    >>> try:
    ...     scan = surfrecon.read("notes.ply")
    ... except surfrecon.FormatError as error:
    ...     print(str(error).partition(":")[0])
    notes.ply
    """


class FileError(SurfreconError, OSError):
    """Reading or writing a file failed. ``filename`` and ``errno`` are set where known.

    >>> try:
    ...     scans = surfrecon.open("nowhere.ply")
    ... except surfrecon.FileError as error:
    ...     print(error.filename)
    nowhere.ply
    """

    def __reduce__(self) -> tuple[object, ...]:
        # That of OSError loses what was not given when it was made.
        return type(self), self.args, {"errno": self.errno, "filename": self.filename}

    def __str__(self) -> str:
        # That of OSError is made of its attributes, and lacks what only the text says.
        return str(self.args[0]) if self.args else ""


class OutOfMemoryError(SurfreconError, MemoryError):
    """The work would need more memory than is allowed or there is.

    >>> try:
    ...     result = surfrecon.merge(scans, voxel=0.001)
    ... except surfrecon.OutOfMemoryError:
    ...     result = surfrecon.merge(scans)  # of the cells that scans ask for
    """


class Cancelled(SurfreconError):
    """The caller cancelled. Nothing was left behind.

    >>> try:
    ...     result = surfrecon.merge(scans, progress=lambda stage, share: False)
    ... except surfrecon.Cancelled:
    ...     print("stopped")
    stopped
    """


class InternalError(SurfreconError, RuntimeError):
    """A broken invariant of the library itself: please report it.

    >>> try:
    ...     result = surfrecon.merge(scans)
    ... except surfrecon.InternalError as error:
    ...     print("this goes into an issue:", error)
    """
