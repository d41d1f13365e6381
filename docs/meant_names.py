"""Which of several objects of one short name a docstring means: that of its module's imports."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path


def imported_names(module: str) -> dict[str, str]:
    """Return the full names of what a module imports from others, by the names that it uses.

    Its source is read and not run: imports for types alone count, too.
    """
    # Finding a module runs the packages around it, which here are empty.
    found = find_spec(module) if module else None
    if found is None or found.origin is None or not found.origin.endswith(".py"):
        return {}
    tree = ast.parse(Path(found.origin).read_text(encoding="utf-8"))
    return {
        one.asname or one.name: f"{node.module}.{one.name}"
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and not node.level and node.module
        for one in node.names
    }


def meant(names: Sequence[str], module: str, imported: Mapping[str, str]) -> list[str]:
    """Return the one of some full names that ends in the same short name, or none.

    Parameters
    ----------
    names : sequence of str
        In any order, all with the same last part.
    module : str
        Of the docstring; empty on other pages.
    imported : mapping of str to str
        Full names of its imports, by short names.

    Returns
    -------
    names : list of str
        One, or none where the module has the name of another package. Without an import it is that
        of the nearest package; of several, the shortest, and of these the first of the alphabet.
    """
    if not names:
        return []
    known = imported.get(names[0].rpartition(".")[2], "")
    if known in names:
        return [known]
    root = names[0].partition(".")[0]
    if known and known.partition(".")[0] != root:
        return []
    own = module.split(".")

    def order(name: str) -> tuple[int, int, str]:
        parts = name.split(".")
        shared = next(
            (at for at, pair in enumerate(zip(own, parts, strict=False)) if pair[0] != pair[1]),
            min(len(own), len(parts)),
        )
        return -shared, len(parts), name

    return [min(names, key=order)]
