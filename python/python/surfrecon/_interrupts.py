"""Ctrl-C while the package is loaded for its own program: that then ends as the system ends it, without a traceback.

The package is loaded before any module of the command line, so it loads this first. In other programs nothing changes.
"""

# The module behind `signal`, which itself would be interrupted while it is loaded.
import _signal  # type: ignore[import-not-found]
import sys

__all__ = ["leave_to_system"]


def leave_to_system() -> None:
    """Lets an interrupt end the program, unless somebody else has decided what it does."""
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
        _signal.signal(_signal.SIGINT, _signal.SIG_DFL)


def _is_own_program() -> bool:
    """Whether Python was started as ``surfrecon`` or as ``python -m surfrecon``."""
    # Python within another program may have no arguments.
    arguments: list[str] = getattr(sys, "argv", [])
    name = arguments[0].replace("\\", "/").rpartition("/")[2] if arguments else ""
    if name == "-m":
        return "surfrecon" in sys.orig_argv[1:]
    return name.removesuffix(".exe").removesuffix("-script.py") == "surfrecon"


if _is_own_program():
    leave_to_system()
