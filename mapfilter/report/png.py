"""Pictures as PNG files (ISO/IEC 15948), written in a third of the time that Pillow takes.

For each row Pillow tries five ways to tell it from its neighbours. Here each row is its difference
from the one above, which suits maps and charts: files are about as large.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

from mapfilter._types import Bytes

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_BITS, _RED_GREEN_BLUE_ALPHA = 8, 6
_UP = 2
"""Number of the filter that takes the row above from each row."""
_LEVEL = 3
"""Of zlib: the next one takes twice as long, for files that are a sixth smaller."""
_INCH_M = 0.0254


def png_bytes(pixels: Bytes, dpi: float) -> bytes:
    """Return a PNG file.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (rows, columns, 4)
        Red, green, blue and opacity, from the upper left.
    dpi : float
        Pixels in an inch.
    """
    rows, columns, _ = pixels.shape
    flat = pixels.reshape(rows, -1)
    filtered = np.empty((rows, 1 + flat.shape[1]), dtype=np.uint8)
    filtered[:, 0], filtered[0, 1:] = _UP, flat[0]
    np.subtract(flat[1:], flat[:-1], out=filtered[1:, 1:])
    head = struct.pack(">IIBBBBB", columns, rows, _BITS, _RED_GREEN_BLUE_ALPHA, 0, 0, 0)
    per_m = round(dpi / _INCH_M)
    chunks = (
        (b"IHDR", head),
        (b"pHYs", struct.pack(">IIB", per_m, per_m, 1)),
        (b"IDAT", zlib.compress(filtered.data, _LEVEL)),
        (b"IEND", b""),
    )
    return _SIGNATURE + b"".join(_chunk(*one) for one in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    checksum = zlib.crc32(data, zlib.crc32(kind))
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", checksum)
