"""The reference of the command line, out of its parsers."""

import argparse

from words import escaped, indented, title

# The names that argparse gives groups that have no name of ours.
_TITLES = {"positional arguments": "arguments"}


def _option(action):
    names = ", ".join(_with_value(action, name) for name in action.option_strings) or action.metavar or action.dest
    text = escaped((action.help or "") % {"default": action.default, "prog": ""})
    if action.choices and not action.option_strings:
        text += f"one of {', '.join(f'``{choice}``' for choice in action.choices)}"
    return f".. option:: {names}\n\n{indented(text)}\n"


def _with_value(action, name):
    if action.nargs == 0:
        return name
    value = action.metavar or (
        action.dest.upper() if not action.choices else "{" + ",".join(map(str, action.choices)) + "}"
    )
    return f"{name} {' '.join(value) if isinstance(value, tuple) else value}"


def _command(parser):
    usage = " ".join(parser.format_usage().removeprefix("usage:").split())
    made = [title(parser.prog, "-"), f".. program:: {parser.prog}\n", escaped(parser.description or "") + "\n"]
    made += [f".. code-block:: text\n\n   {usage}\n"]
    for group in parser._action_groups:
        actions = [action for action in group._group_actions if not isinstance(action, argparse._HelpAction)]
        if actions:
            made += [f".. rubric:: {escaped(_TITLES.get(group.title, group.title))}\n", *map(_option, actions)]
    return "\n".join(made)


def write(target):
    """Writes the page; the package must be importable. Returns the commands."""
    from surfrecon.cli.parser import parser

    whole = parser()
    (commands,) = (action for action in whole._actions if isinstance(action, argparse._SubParsersAction))
    made = [title("Command line reference", "="), escaped(whole.description) + "\n"]
    made += [".. code-block:: text\n", indented(whole.epilog.rstrip()), ""]
    made += [_command(commands.choices[name]) for name in commands.choices]
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text("\n".join(made), "utf-8")
    return list(commands.choices)
