"""The names of Python that pages refer to, found quickly and in one order."""

from __future__ import annotations

from copy import copy
from pathlib import Path
from runpy import run_path
from typing import Any

from sphinx.domains.python import PythonDomain

_MEANT = run_path(str(Path(__file__).with_name("meant_names.py")))


class Names(PythonDomain):
    """The names of Python, where what was looked up is kept.

    Short names of types in docstrings are compared with the names that end in the same word, not
    with all that there are. Of several objects the order would be that in which processes have read
    pages.
    """

    _found: dict[tuple[object, ...], list[Any]] | None = None
    _by_ending: dict[str, dict[str, Any]] | None = None
    _imported: dict[str, dict[str, str]] | None = None

    def find_obj(self, env: Any, *sought: Any) -> list[Any]:
        """Return the object of a name; pages are resolved when all of them have been read."""
        if self._found is None:
            self._found = {}
        if sought not in self._found:
            module, _, name, _, by_ending = sought
            found = PythonDomain.find_obj(self._ending_like(name), env, *sought)
            self._found[sought] = (
                self._meant(found, module or "") if by_ending and "." not in name else found
            )
        return list(self._found[sought])

    def _ending_like(self, name: str) -> Names:
        """Return these names without those that end in another word, in the same order."""
        if self._by_ending is None:
            self._by_ending = {}
            for full, entry in self.objects.items():
                self._by_ending.setdefault(full.rpartition(".")[2], {})[full] = entry
        less = copy(self)
        ending = name.removesuffix("()").rpartition(".")[2]
        less.data = {**self.data, "objects": self._by_ending.get(ending, {})}
        return less

    def _meant(self, found: list[Any], module: str) -> list[Any]:
        if self._imported is None:
            self._imported = {}
        if module not in self._imported:
            self._imported[module] = _MEANT["imported_names"](module)
        names = _MEANT["meant"]([name for name, _ in found], module, self._imported[module])
        return [one for one in found if one[0] in names]
