# SPDX-License-Identifier: GPL-3.0-or-later
"""The library's declarations of its operations, for the operators that run them."""

import surfrecon

OPERATIONS = {operation.name: operation for operation in surfrecon.operations()}


def operator(name):
    """Gives an operator the identifier, the name and the tip that its operation declares for Blender."""

    def named(cls):
        identifier, cls.bl_label, cls.bl_description = OPERATIONS[name].operator
        cls.bl_idname = f"surfrecon.{identifier}"
        return cls

    return named
