"""Parameters and figures of all operations, out of PARAMETERS.md: an entry for each row of a wide table there."""

import re

from words import escaped, indented, title


def _cells(row):
    return [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", row)[1:-1]]


def _entry(operation, row):
    # Parameters have a default and a range, figures of reports have not.
    name, label, kind, *rule, meaning, since = _cells(row)
    default, allowed = rule or ("", "")
    facts = [kind, f"default {default}" if default else "", allowed, f"since {since}"]
    said = f"**{escaped(label)}**, {escaped(', '.join(filter(None, facts)))}"
    of = f"{operation}.{name.strip('`')}" if rule else f"{operation}.report.{name.strip('`')}"
    return f".. parameter:: {of}\n\n{indented(said)}\n\n{indented(escaped(meaning))}\n"


def write(source, target):
    """Writes the page."""
    made = []
    for block in re.split(r"\n{2,}", source.read_text("utf-8")):
        if block.startswith("# "):
            made.append(title(block[2:], "="))
        elif block.startswith("## "):
            operation = block[3:]
            made.append(title(operation, "-"))
        elif block.startswith("### "):
            made.append(title(block[4:], "~"))
        elif block.startswith("|"):
            made += [_entry(operation, row) for row in block.splitlines()[2:]]
        else:
            made.append(escaped(" ".join(block.split())) + "\n")
    target.write_text("\n".join(made), "utf-8")
