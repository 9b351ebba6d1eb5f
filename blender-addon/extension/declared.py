# SPDX-License-Identifier: GPL-3.0-or-later
"""The library's declarations of its operations, for the operators that run them."""

import surfrecon

OPERATIONS = {operation.name: operation for operation in surfrecon.operations()}

# Custom properties of results that hold what operations report, by their usual name, and the operations.
REPORTING = {figure.operation for figure in surfrecon.figures()}
REPORTS = {f"surfrecon_{name}": name for name in OPERATIONS if name in REPORTING}


def operator(name):
    """Gives an operator the identifier, the name and the tip that its operation declares for Blender."""

    def named(cls):
        identifier, cls.bl_label, cls.bl_description = OPERATIONS[name].operator
        cls.bl_idname = f"surfrecon.{identifier}"
        return cls

    return named
