"""Paths that people give: what cannot be a file or a folder is refused before it is opened."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

_NO_PATH = (errno.ENAMETOOLONG, errno.ELOOP)
_SHOWN = 60


def path_fault(path: Path) -> str:
    """Return what is expected in place of a path, or an empty text when nothing is wrong.

    A path may name a file, a folder or nothing yet; whether it can be read or written is found
    later. A pipe is refused because it would be waited for, and cannot be read twice.

    Examples
    --------
    >>> path_fault(Path("not-yet"))
    ''
    >>> path_fault(Path("a" * 5000))
    'a path that the system takes (File name too long)'
    """
    try:
        str(path).encode()
        mode = path.stat().st_mode
    except UnicodeEncodeError:
        return "a path in UTF-8"
    except ValueError:
        return "a path without a zero byte"
    except OSError as error:
        refused = error.errno in _NO_PATH
        return f"a path that the system takes ({error.strerror})" if refused else ""
    usable = stat.S_ISREG(mode) or stat.S_ISDIR(mode)
    return "" if usable else "a file or a folder, not a pipe, socket or device"


def shown(value: object) -> str:
    """Return a value as messages show it: printable, and not too long.

    Examples
    --------
    >>> shown("a" * 5000)[-4:]
    'aaa…'
    """
    text = repr(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"
