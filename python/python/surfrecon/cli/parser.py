"""The command line's options and help."""

from __future__ import annotations

import argparse
import itertools
import re
from decimal import Decimal
from typing import Any, NoReturn

from .. import _native
from .._arguments import meant
from .commands import COMMANDS, Command
from .options import add
from .requests import Request, UsageError
from .streams import say

__all__ = ["SHELLS", "BadCommandLine", "parser", "requested"]

SHELLS = ("bash", "zsh", "fish")
_EXIT_CODES = """exit codes:
  0    done
  1    a file can't be read or written, or what it holds can't be used
  2    a wrong command line or manifest
  130  stopped by Ctrl-C (128 + the number of any signal). Nothing is left behind, but the jobs of a batch that are
       done stay. A signal changes nothing once all is written.
  141  nobody reads the output any more

An output that exists is replaced, at once and only if all went well.
"""
_UNITS = {"": 1, "kB": 10**3, "MB": 10**6, "GB": 10**9} | {"KiB": 2**10, "MiB": 2**20, "GiB": 2**30}
# As other programs have them.
_UNITS |= {"K": 2**10, "M": 2**20, "G": 2**30}


# Of a memory limit.
_LARGEST = 2**63 - 1


class BadCommandLine(UsageError):
    """A command line that can't be understood. ``command`` is the one that says more with --help."""

    def __init__(self, command: str, text: str) -> None:
        super().__init__(f"{text}{'' if text.endswith('?') else '.'} {command} --help says more.")
        self.command = command


class _Parser(argparse.ArgumentParser):
    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        # A text that begins like a number is a value, not only what argparse takes for one: -1e5, -5deg, -1,2,3,4.
        self._negative_number_matcher = re.compile(r"-\.?\d|-inf|-nan")

    def _print_message(self, message: str, file: object = None) -> None:
        # Of --help and --version; argparse itself would not tell of a full disk.
        say(message.rstrip("\n"))

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # noqa: D102
        # argparse would first tell of what is required: of the option that was meant, not of the one that was given.
        if self._subparsers is None and args is not None:
            options = itertools.takewhile(lambda one: one != "--", args)
            self._refuse([one for one in options if one.startswith("--") and " " not in one and not self._knows(one)])
        given, unknown = super().parse_known_args(args, namespace)
        self._refuse(unknown)
        return given, unknown

    def _knows(self, option: str) -> bool:
        return option.partition("=")[0] in self._option_string_actions

    def _refuse(self, unknown: list[str]) -> None:
        if unknown:
            known = [option.lstrip("-") for option in self._option_string_actions if option.startswith("--")]
            near = (_native._nearest(one.partition("=")[0].lstrip("-"), known) for one in unknown if one[:1] == "-")
            means = ", ".join(f"--{one}" for one in near if one)
            self.error(f"unrecognized arguments: {' '.join(unknown)}" + (f". Did you mean {means}?" if means else ""))

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        known = [*(action.choices or (value,))]
        if value not in known:
            means = meant(str(value), known)
            text = f"must be one of {', '.join(known)}, got {value!r}{means and '.'}{means}"
            raise argparse.ArgumentError(action, text)

    def error(self, message: str) -> NoReturn:
        raise BadCommandLine(self.prog, message)


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    whole = _Parser(
        prog="surfrecon",
        description="Surfaces from range scans.",
        epilog=_EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    whole.add_argument("--version", action="version", version=f"surfrecon {_native.__version__}")
    commands = whole.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=_Parser)
    for command in COMMANDS.values():
        _add_command(
            commands.add_parser(command.name, help=command.summary, description=command.text, allow_abbrev=False),
            command,
        )
    text = "Runs those jobs of a manifest that are not done yet, one after the other. One that fails stops no other."
    _add_batch(
        commands.add_parser(
            "batch", help="many jobs, resumed where they were stopped", description=text, allow_abbrev=False
        )
    )
    text = "Does tasks of a merge that surfrecon plan has planned. One that is done is not done again."
    _add_task(
        commands.add_parser("task", help="tasks of a merge that was planned", description=text, allow_abbrev=False)
    )
    text = 'Prints a script that completes what is typed. For bash: eval "$(surfrecon completion bash)" in ~/.bashrc.'
    completion = commands.add_parser("completion", help="completion for shells", description=text, allow_abbrev=False)
    completion.add_argument("shell", choices=SHELLS)
    return whole


def _add_command(to: argparse.ArgumentParser, command: Command) -> None:
    output = "" if not command.endings else " [-o FILE]" if command.output_is_optional else " -o FILE"
    to.usage = f"surfrecon {command.name} [options] {command.inputs} [{command.inputs} ...]{output}"
    to.add_argument("inputs", nargs="+", metavar=command.inputs, help="files or folders")
    if command.endings:
        required = not command.output_is_optional
        to.add_argument("-o", "--output", required=required, metavar="FILE", help=f"what is written: {command.written}")
    for title, rows in command.groups():
        group = to.add_argument_group(title)
        for row in rows:
            add(group, row)
    _add_common(to, "the report")


def _add_batch(to: argparse.ArgumentParser) -> None:
    to.add_argument("manifest", metavar="MANIFEST", help="a file in TOML; the guide On the command line has an example")
    to.add_argument("--dry-run", action="store_true", help="say what would run, and run nothing")
    to.add_argument("--force", action="store_true", help="run all jobs, those that are done too")
    to.add_argument("--stop", action="store_true", help="stop at the first job that fails")
    to.add_argument("--only", action="append", metavar="NAME", help="run this job alone; may be given again")
    _add_common(to, "the summary")


def _add_task(to: argparse.ArgumentParser) -> None:
    to.add_argument("plan", metavar="PLAN", help="what surfrecon plan has written: a file, or a URL that fsspec knows")
    to.add_argument(
        "numbers", nargs="*", type=_number, metavar="NUMBER", help="which tasks; default: all, one after the other"
    )
    to.add_argument("--threads", type=_number, metavar="N", help="threads of a task, instead of the plan's; 0: all")
    to.add_argument("--scratch", metavar="DIR", help="where files are kept that are fetched from a URL")
    to.add_argument("--keep", action="store_true", help="what tasks have left stays once the surface is written")
    _add_common(to, "the figures of each task")


def _number(text: str) -> int:
    if not re.fullmatch(r"\d{1,9}", text):
        raise argparse.ArgumentTypeError(f"must be a whole number, got {text!r}")
    return int(text)


def _add_common(to: argparse.ArgumentParser, what: str) -> None:
    group = to.add_argument_group("running")
    group.add_argument("--json", action="store_true", help=f"{what} as JSON on standard output")
    group.add_argument("--report", metavar="FILE", help=f"{what} as JSON in a file")
    group.add_argument("-q", "--quiet", action="store_true", help="say nothing but errors")
    group.add_argument(
        "--max-memory",
        type=_size,
        metavar="SIZE",
        help="most memory to take, for example 4GB or 512M, which is 512MiB",
    )
    group.add_argument(
        "--no-provenance",
        action="store_true",
        help="hash no files: the result and the report do not say what they were made of",
    )


def _size(text: str) -> int:
    found = re.fullmatch(r"(\d+(?:\.\d+)?) ?([A-Za-z]*)", text)
    if found is None or found[2] not in _UNITS:
        known = ", ".join(filter(None, _UNITS))
        raise argparse.ArgumentTypeError(f"must be bytes, or a number with one of {known}, got {text!r}")
    size = int(Decimal(found[1]) * _UNITS[found[2]])
    if size > _LARGEST:
        raise argparse.ArgumentTypeError(f"must be less than {_LARGEST + 1} bytes, 8 EiB")
    return size


def requested(given: argparse.Namespace) -> Request:
    """The request of the command line to a command."""
    known = vars(given)
    parameters = {name: known[name] for name in COMMANDS[given.command].options() if name in known}
    # A flag of a command alone is on or was not given.
    parameters = {name: value for name, value in parameters.items() if value is not None}
    return Request(given.command, given.inputs, known.get("output"), parameters)
