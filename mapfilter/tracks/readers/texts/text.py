"""Text of a recording in one form: UTF-8, lines that end with a line feed, unpacked."""

from __future__ import annotations

import os
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from mapfilter._cut_ends import without_zero_end
from mapfilter._inputs import first_foreign_byte, open_input, wide_encoding
from mapfilter._separator_line import without_separator_line
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.plain.foreign_names import eastern_encoding
from mapfilter.tracks.readers.texts.zipped import read_zipped, zip_of

_HINTS = {
    "an OpenStreetMap extract": "a map; use it as area.map",
    "a TIFF raster": "roads.raster, or [rasters] path",
    "an SQLite database": "if a GeoPackage, layers of a map; use it as roads.layer",
}
_LARGEST_BYTES = 1 << 31
_LARGEST_UNPACKED_BYTES = 1 << 30
_HEAD_BYTES = 1 << 16
_PART_BYTES = 1 << 24
_MOST_ZERO_SHARE = 0.05
_MOST_STRANGE_SHARE = 0.1
_ARCHIVES = {
    b"PK\x03\x04": "a ZIP archive (or an Excel file)",
    b"\xfd7zXZ": "an XZ archive",
    b"BZh": "a bzip2 archive",
    b"7z\xbc\xaf": "a 7z archive",
    b"PAR1": "a Parquet file",
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"%PDF": "a PDF file",
    b"SQLite": "an SQLite database",
    b"II*\x00": "a TIFF raster",
    b"MM\x00*": "a TIFF raster",
    b"MATLAB 5.0 MAT-file": "a MATLAB file",
    b"\x00\x00\x00\r\n\tOSMHeader": "an OpenStreetMap extract",
    b"\x00\x00\x00\x0e\n\tOSMHeader": "an OpenStreetMap extract",
}


@dataclass(frozen=True, eq=False)
class Text:
    """A file's content.

    Parameters
    ----------
    path : Path
    data : bytes
        UTF-8 without a byte order mark; lines end with a line feed.
    notes : tuple of str
        What was changed to make it so.
    line : int
        Number of the first line; for a part of a file, one less than that of its first row.
    made_of : str
        What the file held in another form, such as "JSON"; "" for a text as it is.
    """

    path: Path
    data: bytes = field(repr=False)
    notes: tuple[str, ...] = ()
    line: int = 1
    made_of: str = ""

    @cached_property
    def head(self) -> tuple[str, ...]:
        """The first lines, up to 64 KiB of them."""
        return tuple(self.data[:_HEAD_BYTES].decode("utf-8", "replace").split("\n"))

    @cached_property
    def first_line(self) -> str:
        """The first line that is not blank."""
        return next((line.strip() for line in self.head if line.strip()), "")


def parts_of(text: Text) -> Iterator[Text]:
    """Cut a large text into parts, each below the first line that is not blank."""
    if len(text.data) <= _PART_BYTES:
        yield text
        return
    filled = len(text.data) - len(text.data.lstrip(b"\n \t"))
    # A first column without a name may begin the line with a separator.
    begin = text.data.rfind(b"\n", 0, filled) + 1
    end = text.data.find(b"\n", begin)
    header, at = text.data[begin : end + 1], end + 1
    line = text.line + text.data[:begin].count(b"\n")
    while end >= 0 and at < len(text.data):
        cut = text.data.find(b"\n", at + _PART_BYTES)
        stop = cut + 1 if cut >= 0 else len(text.data)
        part = text.data[at:stop]
        yield Text(text.path, header + part, text.notes, line)
        line += part.count(b"\n")
        at = stop
    if end < 0:
        yield text


def read_text(path: Path, most_bytes: int = -1) -> Text:
    r"""Read a file as text: plain, gzip, or in a ZIP that its path leads into; any line ends.

    It is UTF-8, UTF-16 or UTF-32, else Windows-1252, with a note.

    ``most_bytes`` are read at most, all of them where it is negative.

    Raises
    ------
    InputError
        The file is missing, empty, too large, or no text.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.NamedTemporaryFile() as file:
    ...     _ = Path(file.name).write_bytes("a,b\r\n1,2".encode("utf-16"))
    ...     read_text(Path(file.name)).data
    b'a,b\n1,2'
    """
    notes: list[str] = []
    if (within := zip_of(path)) is not None:
        data = read_zipped(path, within, most_bytes, _LARGEST_UNPACKED_BYTES)
    else:
        data = _bytes_of(path, most_bytes)
    if data.startswith(b"\x1f\x8b"):
        data = _unpacked(path, data, notes)
    for start, what in _ARCHIVES.items():
        if data.startswith(start):
            hint = "unpack it first" if "archive" in what else _HINTS.get(what, "")
            raise fail(InputError, str(path), "a recording as text", what, hint)
    data = _as_utf8(path, data, notes)
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if not data or data.isspace():
        raise fail(InputError, str(path), "a recording", "an empty file")
    return Text(path, without_separator_line(data), tuple(notes))


def _bytes_of(path: Path, most_bytes: int) -> bytes:
    try:
        with open_input(path) as stream:
            size = os.fstat(stream.fileno()).st_size
            if size > _LARGEST_BYTES and most_bytes < 0:
                raise fail(InputError, str(path), "a recording of at most 2 GiB", f"{size} bytes")
            return stream.read(most_bytes)
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error


def _unpacked(path: Path, data: bytes, notes: list[str]) -> bytes:
    """Unpack gzip as far as it is whole."""
    parts: list[bytes] = []
    left = _LARGEST_UNPACKED_BYTES
    try:
        while data.startswith(b"\x1f\x8b"):
            stream = zlib.decompressobj(wbits=31)
            parts.append(stream.decompress(data, left))
            left -= len(parts[-1])
            if left <= 0:
                got = "more than 1 GiB, unpacked"
                raise fail(InputError, str(path), "a recording of at most 1 GiB", got)
            if not stream.eof:
                notes.append("the gzip file is cut off; what could be unpacked was read")
                break
            data = stream.unused_data
    except zlib.error as error:
        if not any(parts):
            raise fail(InputError, str(path), "a gzip file", str(error), "damaged") from error
        notes.append("the gzip file is damaged; what could be unpacked was read")
    return b"".join(parts)


def _as_utf8(path: Path, data: bytes, notes: list[str]) -> bytes:
    if data.startswith(b"\xef\xbb\xbf"):
        data = data[3:]
    elif wide_encoding(data) == "UTF-32":
        notes.append("UTF-32 text")
        # A file cut off may end within a character.
        data = data[: len(data) // 4 * 4].decode("utf-32", "replace").encode()
    elif (wide := _utf16(data)) is not None:
        notes.append("UTF-16 text")
        # A file cut off may end within a character.
        data = data[: len(data) // 2 * 2].decode(wide, "replace").lstrip("\ufeff").encode()
    data, note = without_zero_end(data)
    if note and not data:
        raise fail(InputError, str(path), "a recording as text", "zero bytes only", "cut off")
    notes += [note] if note else []
    zeros = data.count(b"\0")
    if zeros > _MOST_ZERO_SHARE * len(data):
        raise fail(InputError, str(path), "a recording as text", "a binary file")
    if zeros:
        notes.append(f"{zeros} zero bytes left out")
        data = data.replace(b"\0", b"")
    if not data.isascii():
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            if eastern := eastern_encoding(data[:_HEAD_BYTES].split(b"\n", 1)[0]):
                notes.append(f"no UTF-8; read as {eastern.upper()}")
                return data.decode(eastern, "replace").encode()
            strange = data[:_HEAD_BYTES].decode("utf-8", "replace").count("\ufffd")
            if strange > _MOST_STRANGE_SHARE * min(len(data), _HEAD_BYTES):
                got = "a binary file"
                raise fail(InputError, str(path), "a recording as text", got) from None
            if (at := first_foreign_byte(data)) >= 0:
                notes.append(f"no UTF-8 (byte {at}); read as Windows-1252")
                return data.decode("cp1252").encode()
            notes.append("some bytes are not UTF-8")
            data = data.decode("utf-8", "replace").encode()
    return data


def _utf16(data: bytes) -> str | None:
    """Return the codec of UTF-16 text, with or without a mark, else None."""
    if data.startswith(b"\xff\xfe"):
        return "utf-16-le"
    if data.startswith(b"\xfe\xff"):
        return "utf-16-be"
    head = data[:512]
    if len(head) >= 8 and re.fullmatch(rb"(?:[\t\n\r -~\xa0-\xff]\0)+.?", head, re.DOTALL):
        return "utf-16-le"
    if len(head) >= 8 and re.fullmatch(rb"(?:\0[\t\n\r -~\xa0-\xff])+.?", head, re.DOTALL):
        return "utf-16-be"
    return None
