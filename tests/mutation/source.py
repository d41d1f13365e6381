"""Python source by places of its syntax tree, and which of its parts are not worth mutating."""

from __future__ import annotations

import ast
from collections.abc import Iterator

_SKIPPED_CALLS = frozenset(("fail", "add", "TypeVar", "NewType", "warn"))
"""Calls whose arguments are words of messages: ``fail(...)`` and ``faults.add(...)``."""
_SKIPPED_KEYWORDS = frozenset(("strict", "copy", "stacklevel", "indent"))
"""They change speed, looks, or what only a mistake of the programmer shows."""


class Source:
    """A file's text, its lines and its tree."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.data = text.encode()
        self.tree = ast.parse(text)
        self._starts = [0]
        for line in self.data.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))

    def start(self, node: ast.AST) -> int:
        """Return the first byte of a node."""
        return self._starts[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]

    def end(self, node: ast.AST) -> int:
        """Return the byte after a node."""
        return self._starts[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]

    def segment(self, node: ast.AST) -> str:
        """Return a node's text."""
        return self.data[self.start(node) : self.end(node)].decode()

    def position(self, byte: int) -> tuple[int, int]:
        """Return line (from 1) and column (from 0) of a byte."""
        line = max(n for n, start in enumerate(self._starts) if start <= byte)
        return line + 1, byte - self._starts[line]

    def line(self, number: int) -> str:
        """Return a line without the blanks around it."""
        return self.data[self._starts[number - 1] : self._starts[number]].decode().strip()


def mutable(tree: ast.Module) -> Iterator[tuple[ast.AST, bool, bool]]:
    """Yield the nodes that may be mutated, whether within a function, and whether as a condition.

    Left out are docstrings, annotations, decorators, f-strings, ``__all__``, blocks for type
    checkers, assertions, protocol stubs and the arguments of messages.
    """
    yield from _walk(tree, False, False)


def _walk(node: ast.AST, inside: bool, condition: bool) -> Iterator[tuple[ast.AST, bool, bool]]:
    if _is_skipped(node):
        return
    yield node, inside, condition
    if isinstance(node, ast.Call) and called(node) in _SKIPPED_CALLS:
        return
    inside = inside or isinstance(node, ast.FunctionDef | ast.Lambda)
    for name, value in ast.iter_fields(node):
        if name in ("decorator_list", "annotation", "returns", "bases", "type_params"):
            continue
        is_test = name in ("test", "ifs") and isinstance(
            node, ast.If | ast.IfExp | ast.comprehension
        )
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _walk(child, inside, is_test)


def _is_skipped(node: ast.AST) -> bool:
    match node:
        case ast.JoinedStr() | ast.Import() | ast.ImportFrom() | ast.Assert() | ast.Pass():
            return True
        case ast.Expr(value=ast.Constant()):
            return True
        case ast.If(test=ast.Name(id="TYPE_CHECKING")):
            return True
        case ast.If(test=ast.Compare(left=ast.Name(id="__name__"))):
            return True
        case ast.Assign(targets=[ast.Name(id=("__all__" | "__slots__" | "__version__"))]):
            return True
        case ast.keyword(arg=name):
            return name in _SKIPPED_KEYWORDS
    return False


def called(node: ast.Call) -> str:
    """Return the last part of the name of what is called."""
    if isinstance(node.func, ast.Attribute):
        return node.func.attr
    return node.func.id if isinstance(node.func, ast.Name) else ""
