"""The small bugs: which changes of a source are tried, in an order that never varies."""

from __future__ import annotations

import ast
import hashlib
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from .source import Source, called, mutable

_FLIPS = {
    ast.Lt: ("<", ">="), ast.LtE: ("<=", ">"), ast.Gt: (">", "<="), ast.GtE: (">=", "<"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
}  # fmt: skip
_BOUNDARIES = {
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
}  # fmt: skip
_ARITHMETIC = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"), ast.Mod: ("%", "*"), ast.Pow: ("**", "*"),
    ast.LShift: ("<<", ">>"), ast.RShift: (">>", "<<"),
    ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"), ast.BitXor: ("^", "&"),
}  # fmt: skip
_PAIRS = (
    ("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("nanmin", "nanmax"),
    ("fmin", "fmax"), ("floor", "ceil"), ("any", "all"), ("sin", "cos"), ("zeros", "ones"),
    ("left", "right"), ("isnan", "isfinite"),
)  # fmt: skip
_SWAPS = {a: b for pair in _PAIRS for a, b in (pair, pair[::-1])}
_SIDES = {"left": "right", "right": "left"}
_UNITS = frozenset(("m", "s", "rad", "deg", "dbm", "db", "m2", "row", "col", "rows", "cols"))
_SHOWN = 60
_SMALL = 10
"""Whole numbers up to here are off by one, larger ones doubled."""


@dataclass(frozen=True)
class Mutant:
    """One small bug.

    Parameters
    ----------
    file : str
        Relative to the repository.
    line, col : int
        Where the change begins, from 1 and from 0.
    operator : str
    start, end : int
        The bytes that are replaced.
    before, after : str
        Their text, and what replaces it.
    source : str
        The line, stripped.
    nth : int
        Counts equal changes of equal lines in the file, from 0.
    """

    file: str
    line: int
    col: int
    operator: str
    start: int
    end: int
    before: str
    after: str
    source: str
    nth: int = 0

    @property
    def stable(self) -> str:
        """A name that does not depend on what stands above the line."""
        parts = (self.file, self.source, self.operator, self.before, self.after, str(self.nth))
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:12]

    @property
    def id(self) -> str:
        """File, line, column, operator, and a hash of the line and the change."""
        return f"{self.file}:{self.line}:{self.col}:{self.operator}:{self.stable}"

    @property
    def change(self) -> str:
        """What is changed, in short."""
        before, after = (re.sub(r"\s+", " ", text) for text in (self.before, self.after))
        return f"{before[:_SHOWN]} → {after[:_SHOWN]}"


def mutants(text: str, file: str) -> list[Mutant]:
    """Return all mutants of a source, in the order of their places; equal ones once."""
    source = Source(text)
    found: dict[tuple[int, int, str], tuple[str, str]] = {}
    for node, inside, condition in mutable(source.tree):
        for operator, start, end, after in _of_node(source, node, inside, condition):
            found.setdefault((start, end, after), (operator, after))
    made: list[Mutant] = []
    seen: Counter[tuple[str, ...]] = Counter()
    for (start, end, after), (operator, _) in sorted(found.items()):
        line, col = source.position(start)
        before, shown = source.data[start:end].decode(), source.line(line)
        alike = (shown, operator, before, after)
        nth = seen[alike]
        seen[alike] += 1
        made.append(Mutant(file, line, col, operator, start, end, before, after, shown, nth))
    return made


def applied(text: str, mutant: Mutant) -> str:
    """Return the source with the bug in it."""
    data = text.encode()
    return (data[: mutant.start] + mutant.after.encode() + data[mutant.end :]).decode()


_Change = tuple[str, int, int, str]


def _of_node(source: Source, node: ast.AST, inside: bool, condition: bool) -> Iterator[_Change]:
    match node:
        case ast.Compare():
            yield from _comparisons(source, node, condition)
        case ast.BinOp() if inside or not isinstance(node.op, ast.BitOr):
            yield from _arithmetic(source, node)
        case ast.AugAssign():
            yield from _augmented(source, node)
        case ast.BoolOp():
            yield from _boolean(source, node)
        case ast.UnaryOp(op=(ast.USub() | ast.Not() | ast.Invert())):
            start = source.start(node)
            yield "unary", start, source.end(node), f"({source.segment(node.operand)})"
        case ast.Constant():
            yield from _constant(source, node)
        case ast.Call():
            yield from _call(source, node)
        case ast.If() | ast.IfExp():
            yield from _negated(source, node.test)
        case ast.comprehension():
            for test in node.ifs:
                yield from _negated(source, test)
        case ast.FunctionDef(returns=ast.Name(id="bool")):
            for inner in ast.walk(node):
                if isinstance(inner, ast.Return) and inner.value is not None:
                    yield from _negated(source, inner.value)
    if isinstance(node, ast.stmt):
        yield from _deleted(source, node)


def _between(
    source: Source, left: ast.AST, right: ast.AST, old: str, new: str
) -> tuple[int, int, str] | None:
    """Return the place of an operator between its operands."""
    start, end = source.end(left), source.start(right)
    gap = re.sub(rb"#[^\n]*", lambda m: b" " * len(m[0]), source.data[start:end])
    pattern = rb"\b" + re.sub(rb" ", rb"\\s+", old.encode()) + rb"\b"
    if not old[0].isalpha():
        pattern = re.escape(old.encode())
    at = re.search(pattern, gap)
    return None if at is None else (start + at.start(), start + at.end(), new)


def _comparisons(source: Source, node: ast.Compare, condition: bool) -> Iterator[_Change]:
    operands = [node.left, *node.comparators]
    for kind, left, right in zip(node.ops, operands, operands[1:], strict=False):
        # A condition that is one comparison is negated as a condition already.
        tables = [("boundary", _BOUNDARIES)]
        if not condition or len(node.ops) > 1:
            tables.append(("comparison", _FLIPS))
        for name, table in tables:
            if type(kind) in table:
                place = _between(source, left, right, *table[type(kind)])
                if place is not None:
                    yield name, *place


def _is_text(node: ast.AST) -> bool:
    if isinstance(node, ast.BinOp):
        return _is_text(node.left) or _is_text(node.right)
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)
    )


def _arithmetic(source: Source, node: ast.BinOp) -> Iterator[_Change]:
    if type(node.op) in _ARITHMETIC and not _is_text(node):
        place = _between(source, node.left, node.right, *_ARITHMETIC[type(node.op)])
        if place is not None:
            yield "arithmetic", *place


def _augmented(source: Source, node: ast.AugAssign) -> Iterator[_Change]:
    if type(node.op) in _ARITHMETIC and not _is_text(node.value):
        old, new = _ARITHMETIC[type(node.op)]
        place = _between(source, node.target, node.value, f"{old}=", f"{new}=")
        if place is not None:
            yield "arithmetic", *place


def _boolean(source: Source, node: ast.BoolOp) -> Iterator[_Change]:
    old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
    for left, right in zip(node.values, node.values[1:], strict=False):
        place = _between(source, left, right, old, new)
        if place is not None:
            yield "boolean", *place


def _constant(source: Source, node: ast.Constant) -> Iterator[_Change]:
    value, start, end = node.value, source.start(node), source.end(node)
    if isinstance(value, bool):
        yield "constant", start, end, str(not value)
    elif isinstance(value, int):
        yield "constant", start, end, str(value + 1 if value <= _SMALL else 2 * value)
    elif isinstance(value, float):
        yield "constant", start, end, repr(value * 2 or 1.0)
    elif isinstance(value, str) and value in _SIDES:
        yield "swap", start, end, f'"{_SIDES[value]}"'


def _call(source: Source, node: ast.Call) -> Iterator[_Change]:
    name = called(node)
    if name in _SWAPS:
        end = source.end(node.func)
        yield "swap", end - len(name.encode()), end, _SWAPS[name]
    for word in node.keywords:
        if word.arg == "axis" and isinstance(word.value, ast.Constant) and word.value.value == 1:
            yield "axis", source.start(word.value), source.end(word.value), "0"
    sided = len(node.args) > 2 or any(word.arg == "side" for word in node.keywords)
    if name == "searchsorted" and not sided:
        end = source.end(node) - 1
        yield "swap", end, end, ', side="right"'
    for a, b in zip(node.args, node.args[1:], strict=False):
        first, second = source.segment(a), source.segment(b)
        if first != second and _unit(a) and _unit(a) == _unit(b):
            gap = source.data[source.end(a) : source.start(b)].decode()
            yield "arguments", source.start(a), source.end(b), f"{second}{gap}{first}"


def _unit(node: ast.AST) -> str:
    name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")
    unit = name.rpartition("_")[2]
    return unit if unit in _UNITS else ""


def _negated(source: Source, test: ast.AST) -> Iterator[_Change]:
    if not isinstance(test, ast.Constant):
        start, end = source.start(test), source.end(test)
        yield "negation", start, end, f"(not ({source.segment(test)}))"


def _deleted(source: Source, node: ast.stmt) -> Iterator[_Change]:
    place = isinstance(node, ast.Assign) and all(
        isinstance(target, ast.Subscript | ast.Attribute) for target in node.targets
    )
    effect = isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    if place or effect or isinstance(node, ast.AugAssign | ast.Raise | ast.Break | ast.Continue):
        yield "deletion", source.start(node), source.end(node), "pass"
