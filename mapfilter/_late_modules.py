"""Parts of NumPy that commands do not use, read when something is asked of them.

SciPy copies all names that NumPy has, and with them imports its reader of Fortran and its tools for
tests. These are a twentieth of what a command imports.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import LazyLoader
from types import ModuleType

_LATE = ("numpy.f2py", "numpy.testing")


class _Late(MetaPathFinder):
    """Finds these modules as Python does, and has them read at the first look into them."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        found = PathFinder.find_spec(fullname, path, target) if fullname in _LATE else None
        if found is not None and found.loader is not None:
            found.loader = LazyLoader(found.loader)
        return found


def read_parts_late() -> None:
    """Have parts of NumPy read late in this process, which may have imported nothing yet."""
    if not any(isinstance(one, _Late) for one in sys.meta_path):
        sys.meta_path.insert(0, _Late())
