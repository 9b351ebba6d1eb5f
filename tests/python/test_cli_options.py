"""Options of the command line: out of the table of parameters, each parsed and checked as the core does."""

import math

import pytest
import surfrecon
from surfrecon.cli import options, requests
from surfrecon.cli.commands import COMMANDS
from surfrecon.cli.parser import parser, requested

ROWS = [(command.name, row) for command in COMMANDS.values() for row in command.options().values()]


def asked(*arguments):
    """The request of a command line, without running it."""
    return requested(parser().parse_args([*arguments]))


def test_options_are_those_of_the_table():
    taken = {
        "convert": ["triangulate", "write"],
        "align": ["align"],
        "merge": ["merge", "triangulate", "write"],
        "sculpt": ["sculpt", "triangulate", "write"],
        "quads": ["quads"],
        "reconstruct": ["reconstruct", "write"],
        "cluster": ["cluster", "write"],
    }
    for name, operations in taken.items():
        of_table = {row.name for one in [*operations, "open"] for row in surfrecon.parameters(one)}
        known = COMMANDS[name].options()
        assert of_table == {row.name for row in known.values() if isinstance(row, surfrecon.Parameter)}, name


def some_value(row):
    """A value that is allowed and not the default, as people write it, and what it is."""
    if row.kind == "flag":
        return None, not getattr(row, "default", False)
    if row.kind == "choice":
        name = row.choices[-1][0]
        return name, name
    if row.kind in ("text", "file", "folder"):
        return "a b", "a b"
    if row.kind in ("counts", "numbers"):
        number = int if row.kind == "counts" else float
        return "1,2,3,4", [number(k) for k in (1, 2, 3, 4)]
    low, high = max(getattr(row, "minimum", 0.0), -100.0), min(getattr(row, "maximum", 100.0), 100.0)
    if row.kind == "count":
        return str(int(low) + 1), int(low) + 1
    value = low + (high - low) / 3
    return repr(value), value


@pytest.mark.parametrize("command, row", ROWS, ids=lambda of: of if isinstance(of, str) else of.name)
def test_each_option_is_parsed(command, row):
    flag, output = f"--{row.name.replace('_', '-')}", f"a.{(COMMANDS[command].endings or ('ply',))[0]}"
    files = ["x", "-o", output] if COMMANDS[command].endings else ["x", "y"]
    text, value = some_value(row)
    if row.kind == "flag":
        given = asked(command, *files, flag if value else f"--no-{flag[2:]}")
    else:
        given = asked(command, *files, f"{flag}={text}")
    assert given.parameters == {row.name: value}
    assert type(given.parameters[row.name]) is type(value)
    # Nothing is said of what is not given: the core's defaults hold.
    assert asked(command, *files).parameters == {}


def some_wrong_value(row):
    """One that the core refuses, and what is said of what is allowed."""
    if row.kind == "choice":
        return "nonsense", row.allowed
    if row.kind in ("counts", "numbers"):
        return "1,x", row.allowed
    if isinstance(row, surfrecon.Parameter) and math.isfinite(row.minimum):
        return str(int(row.minimum) - 1), row.allowed
    return "x", row.allowed if row.kind == "count" else "a finite number"


@pytest.mark.parametrize(
    "command, row",
    [(command, row) for command, row in ROWS if row.kind not in ("flag", "text", "file", "folder")],
    ids=lambda of: of if isinstance(of, str) else of.name,
)
def test_a_wrong_value_names_option_and_range(command, row):
    files = ["x", "-o", f"a.{COMMANDS[command].endings[0]}"] if COMMANDS[command].endings else ["x", "y"]
    value, allowed = some_wrong_value(row)
    flag = f"--{row.name.replace('_', '-')}"
    with pytest.raises(requests.UsageError) as refused:
        asked(command, *files, f"{flag}={value}")
    assert flag in str(refused.value) and allowed in str(refused.value)


def test_angles_are_radians_or_degrees():
    (row,) = [row for row in surfrecon.parameters("triangulate") if row.kind == "angle"]
    assert options.read(row, "90deg") == math.pi / 2 and options.read(row, "1.5") == 1.5
    assert options.parsed(row, "45deg") == math.pi / 4 and options.parsed(row, 1) == 1
    for wrong in ("91deg", "xdeg", "0deg"):
        with pytest.raises(surfrecon.ParameterError, match="grazing_limit must be > 0 and <= 1.57"):
            options.read(row, wrong)


def test_numbers_may_begin_with_a_sign():
    """As a word of their own, too, where argparse takes few of them for numbers."""
    given = asked("info", "x", "--offset", "-1e5", "--invalid", "-3.4e38", "--camera", "-1,2,3,4")
    assert given.parameters == {"offset": -1e5, "invalid": -3.4e38, "camera": [-1, 2, 3, 4]}
    assert asked("info", "x", "--offset", "-.5").parameters == {"offset": -0.5}
    assert asked("info", "-1.ply").inputs == ["-1.ply"]
    for value in ("-5deg", "-inf", "-nan"):
        with pytest.raises(requests.UsageError, match="grazing_limit must be > 0 and <= 1.57"):
            asked("merge", "x", "-o", "a.ply", "--grazing-limit", value)
    with pytest.raises(requests.UsageError, match="expected one argument"):
        asked("info", "x", "--offset", "--json")


def test_angles_of_a_turntable_may_be_degrees():
    row = COMMANDS["align"].options()["angles"]
    given = asked("align", "x", "-o", "a.conf", "--angles", "0deg,90deg,-1.5")
    assert given.parameters == {"angles": [0, math.pi / 2, -1.5]}
    assert options.parsed(row, ["0deg", "90deg", 1]) == [0, math.pi / 2, 1]
    for wrong in (["90°"], ["1rad"], [None], "", [True], 10**400, [10**400]):
        with pytest.raises(surfrecon.ParameterError, match="angles must be numbers"):
            options.parsed(row, wrong)


@pytest.mark.parametrize("value", ["80°", "0.5rad", "80DEG", "80 degrees", ""])
def test_what_is_no_angle_is_told_the_unit(value):
    (row,) = [row for row in surfrecon.parameters("triangulate") if row.kind == "angle"]
    for read in (options.read, options.parsed):
        with pytest.raises(surfrecon.ParameterError, match="in radians or in degrees as 80deg, got"):
            read(row, value)


@pytest.mark.parametrize("size", ["9999999999GB", "9" * 400, "9223372036854775808", "8589934592GiB"])
def test_memory_that_no_computer_has(size):
    with pytest.raises(requests.UsageError, match="must be less than 9223372036854775808 bytes, 8 EiB"):
        asked("info", "x", "--max-memory", size)


SIZES = [
    ("1.5kB", 1500),
    ("0.1GB", 10**8),
    ("9223372036854775807", 2**63 - 1),
    ("2K", 2048),
    ("512M", 2**29),
    ("1.5G", 3 * 2**29),
]


@pytest.mark.parametrize("size, expected", SIZES)
def test_memory_is_counted_exactly(size, expected):
    assert parser().parse_args(["info", "x", "--max-memory", size]).max_memory == expected


def test_a_folder_has_a_name():
    row = COMMANDS["merge"].options()["workspace"]
    assert options.parsed(row, "some where") == "some where"
    for wrong in ("", "a\0b", 3, True, ["a"]):
        with pytest.raises(surfrecon.ParameterError, match="workspace must be the name of a folder, got"):
            options.parsed(row, wrong)
