"""Recordings in a ZIP, as apps share them: its files have paths below that of the ZIP.

``walk.zip/Accelerometer.csv`` is the file of that name in ``walk.zip``. Nothing is unpacked on the
disk, and names in a ZIP reach no other file.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from mapfilter._inputs import open_input
from mapfilter._words import number_of
from mapfilter._zip import ZIP_DAMAGE
from mapfilter.errors import InputError, MapfilterError, fail

_BEGIN = b"PK\x03\x04"
_WORKBOOKS = frozenset(("[Content_Types].xml",)), frozenset(("mimetype", "content.xml"))
"""Files of workbooks of Excel and of OpenDocument."""
_MOST_FILES = 1000
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_CHECKED_BYTES = 1 << 18


def is_zip(path: Path) -> bool:
    """Return whether a path is a ZIP, and no workbook, which is a ZIP, too."""
    try:
        with open_input(path) as stream:
            if stream.read(len(_BEGIN)) != _BEGIN:
                return False
        with _archive(path) as archive:
            names = frozenset(archive.namelist())
            return not any(files <= names for files in _WORKBOOKS)
    except OSError:
        return False
    except MapfilterError:
        # A cut-off ZIP is named as that where its files are asked for.
        return path.is_file()


def files_in_zip(path: Path) -> list[Path]:
    """Return the files of a ZIP that are in no folder, or else those of its one folder, by name.

    Hidden ones, and those of further folders within that one, are left out.

    Raises
    ------
    InputError
        It is damaged, a name leads out of it, it has no file or more than a thousand, or several
        folders and no file beside them.
    """
    with _archive(path) as archive:
        names = [PurePosixPath(name) for name in _members(archive)]
    for name in names:
        if name.is_absolute() or ".." in name.parts or "\\" in str(name):
            got = repr(str(name)[:80])
            raise fail(InputError, str(path), "names within the ZIP", got, "a damaged ZIP")
    names = [name for name in names if not any(part[:1] in (".", "_") for part in name.parts)]
    if not 0 < len(names) <= _MOST_FILES:
        expected = f"a ZIP with at most {_MOST_FILES} files"
        raise fail(InputError, str(path), expected, number_of(len(names), "file"))
    least = min(len(name.parts) for name in names)
    shallow = sorted(name for name in names if len(name.parts) == least)
    folders = sorted({str(name.parent) for name in shallow})
    if len(folders) > 1:
        got = ", ".join(folders[:5]) + (", …" if len(folders) > 5 else "")
        hint = "several journeys; unpack it, and name one folder"
        raise fail(InputError, str(path), "a ZIP with the recordings of one journey", got, hint)
    return [path / name for name in shallow]


def zip_of(path: Path) -> Path | None:
    """Return the ZIP that a path leads into; None for a path that leads into no file."""
    return next((parent for parent in path.parents if parent.is_file()), None)


def has_recording(path: Path) -> bool:
    """Return whether there is a file of this path, which may lead into a ZIP."""
    if (found := zip_of(path)) is None:
        return path.is_file()
    with _archive(found) as archive:
        return path.relative_to(found).as_posix() in _members(archive)


def read_zipped(path: Path, within: Path, most_bytes: int, largest_bytes: int) -> bytes:
    """Return the bytes of a file in a ZIP, at most ``most_bytes`` of them if that is not negative.

    Raises
    ------
    InputError
        There is no such file, it is damaged or needs a password, or it is larger than
        ``largest_bytes``, unpacked.
    """
    with _archive(within) as archive:
        entry = _members(archive).get(path.relative_to(within).as_posix())
        if entry is None:
            hint = "a mistyped path"
            raise fail(InputError, str(path), "a file in the ZIP", "no such file", hint)
        if entry.compress_type not in _METHODS:
            # Others are unpacked block by block, however little is asked for, or not at all.
            got = f"method {entry.compress_type}"
            raise fail(InputError, str(path), "a file compressed by deflate", got, "unpack the ZIP")
        try:
            with archive.open(entry) as stream:
                data = stream.read(largest_bytes + 1 if most_bytes < 0 else most_bytes)
        except NotImplementedError as error:
            expected = "a file compressed by deflate"
            raise fail(InputError, str(path), expected, str(error), "unpack the ZIP") from error
        except RuntimeError as error:
            raise fail(InputError, str(path), "a file without a password", str(error)) from error
    if len(data) > largest_bytes:
        expected, got = f"at most {largest_bytes >> 20} MiB", "more, unpacked"
        raise fail(InputError, str(path), expected, got, "possible decompression bomb")
    return data


def check_zipped(path: Path, within: Path) -> None:
    """Check that a file in a ZIP can be read, as far as its beginning; InputError as above."""
    read_zipped(path, within, _CHECKED_BYTES, _CHECKED_BYTES)


def _members(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """Return the files of a ZIP by their names as paths have them: ``./a//b`` is ``a/b``."""
    files = (one for one in archive.infolist() if not one.is_dir())
    return {str(PurePosixPath(one.filename)): one for one in files}


@contextmanager
def _archive(path: Path) -> Iterator[zipfile.ZipFile]:
    try:
        with open_input(path) as stream, zipfile.ZipFile(stream) as archive:
            yield archive
    except ZIP_DAMAGE as error:
        hint = "cut off, or damaged"
        raise fail(InputError, str(path), "a ZIP that can be read", str(error), hint) from error
