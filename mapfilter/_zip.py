"""What Python raises for a ZIP that is damaged."""

import lzma
import zipfile
import zlib

ZIP_DAMAGE = (
    *(OSError, EOFError, RuntimeError, ValueError, OverflowError),
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError),
)
"""Besides what is told as damage: places before the begin (ValueError) or beyond what any file
has (OverflowError, in memory), versions that are none (NotImplementedError, a RuntimeError), and
members that are locked."""
