"""What Python raises for a ZIP that is damaged."""

import lzma
import zipfile
import zlib

ZIP_DAMAGE = (
    *(OSError, EOFError, RuntimeError, ValueError),
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError),
)
"""Besides what is told as damage: places before the begin (ValueError), versions that are none
(NotImplementedError, a RuntimeError), and members that are locked."""
