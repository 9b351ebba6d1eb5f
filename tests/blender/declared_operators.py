"""Operators of the operations that the library declares, so that tests find new ones."""

import surfrecon

# Operations by the names of their operators. Exports run at once.
OPERATIONS = {one.operator[0]: one for one in surfrecon.operations() if one.operator is not None}
LONG = [name for name in OPERATIONS if name != "export_scans"]
# Operators that work on a surface.
ON_MESH = {name for name in LONG if OPERATIONS[name].takes[0] == "a mesh"}
