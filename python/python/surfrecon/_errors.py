"""The exceptions of surfrecon. Their texts name the offending thing and, where there is one, the remedy."""


class SurfreconError(Exception):
    """Base of all exceptions of this package."""

    def __reduce__(self) -> tuple[object, ...]:
        # With Python's own, what Dask sends exceptions by (tblib) can't make those anew that are a MemoryError.
        return type(self), self.args


class ParameterError(SurfreconError, ValueError):
    """An option lies outside its range; the text gives value, range and unit."""


class InputError(SurfreconError, ValueError):
    """The data handed in can't be used."""


class FormatError(SurfreconError, ValueError):
    """A file does not hold what its format promises; the text gives file and place."""


class FileError(SurfreconError, OSError):
    """Reading or writing a file failed; ``filename`` and ``errno`` are set where known."""

    def __reduce__(self) -> tuple[object, ...]:
        # That of OSError loses what was not given when it was made.
        return type(self), self.args, {"errno": self.errno, "filename": self.filename}

    def __str__(self) -> str:
        # That of OSError is made of its attributes, and lacks what only the text says.
        return str(self.args[0]) if self.args else ""


class OutOfMemoryError(SurfreconError, MemoryError):
    """The work would need more memory than is allowed or there is."""


class Cancelled(SurfreconError):
    """The caller cancelled; nothing was left behind."""


class InternalError(SurfreconError, RuntimeError):
    """A broken invariant of the library itself: please report it."""
