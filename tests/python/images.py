"""Image files for tests."""

import struct
import zlib

import numpy as np


def png(pixels):
    """A PNG file of (rows, cols) uint8 or uint16, or of (rows, cols, 3) uint8."""
    rows, cols = pixels.shape[:2]
    kind = 2 if pixels.ndim == 3 else 0
    big = np.ascontiguousarray(pixels.astype(pixels.dtype.newbyteorder(">"))).view(np.uint8).reshape(rows, -1)
    data = np.concatenate([np.zeros((rows, 1), np.uint8), big], axis=1).tobytes()

    def chunk(name, content):
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", cols, rows, 8 * pixels.itemsize, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")
