# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports whose format is chosen in the dialog, and whose name ends as that format's do."""

import os

from bpy_extras.io_utils import ExportHelper


class ExportByFormat(ExportHelper):
    """Has a property `file_format`, whose identifiers are endings in capitals."""

    @property
    def ending(self):
        """The ending of the file's name."""
        return "." + self.file_format.lower()

    def path(self):
        """The chosen path, with the format's ending."""
        return os.path.splitext(self.filepath)[0] + self.ending

    def check(self, context):
        """The ending of the name follows the format."""
        self.filename_ext = self.ending
        changed = self.filepath != self.path()
        self.filepath = self.path()
        return changed
