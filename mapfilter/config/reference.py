"""The reference of all keys of a configuration, made from the sections and their docstrings.

``python -m mapfilter.config.reference > docs/configuration.toml`` writes it anew.
"""

from __future__ import annotations

import json
import re
import sys
import textwrap
from collections.abc import Iterator
from inspect import cleandoc
from pathlib import Path
from typing import Any

from mapfilter._annotations import expected, without_none
from mapfilter.config.fields import Section, field_annotation
from mapfilter.config.sections import Config
from mapfilter.options import descriptions

_COLUMN = 38
_WIDTH = 100
_HEAD = """\
Every key with its default; keys without one are comments. Lengths are metres, angles degrees,
times seconds and levels dBm, by the suffix of the name. Paths are relative to this file.
"""
_TEXT, _NO_BREAK = '"..."', "\N{NO-BREAK SPACE}"
_LARGEST = f" and < {2**63}"
_MARKUP = re.compile(r":\w+:`~?([^`<]*?)`|``([^`]*)``")


def reference_toml() -> str:
    """Return a configuration file with every key, its default, meaning and limits."""
    lines = [f"# {line}" for line in _HEAD.splitlines()]
    for name in Config.model_fields:
        lines += _table(getattr(Config(), name), name)
    return "\n".join(lines) + "\n"


def _table(values: Section, path: str) -> Iterator[str]:
    """Yield the lines of a section; those of the sections inside it come last."""
    section = type(values)
    yield ""
    yield from _entry(f"[{path}]", _summary(section))
    meanings: dict[str, str] = {}
    for kind in (*section.kinds, section):
        meanings |= descriptions(kind)
    inner: list[str] = []
    for name in section.model_fields:
        value, meaning = getattr(values, name), _plain(meanings.get(name, ""))
        if isinstance(value, Section):
            inner += _table(value, f"{path}.{name}")
        elif isinstance(value, dict):
            inner += ["", *_entry(f"[{path}.{name}]", meaning)]
        else:
            annotation = without_none(field_annotation(section, name))
            text = f"{meaning} {_limits(annotation)}".strip()
            yield from _entry(_assignment(name, value, annotation), text)
    yield from inner


def _limits(annotation: Any) -> str:
    """Return the limits of a key, in words that are not broken; none where there is a type only."""
    words = expected(annotation).replace("'", '"').removesuffix(_LARGEST)
    bare = words in ("a number", "a whole number", "a text", "a path", "a list", "true or false")
    return "" if bare else f"({words})".replace(" ", _NO_BREAK)


def _assignment(name: str, value: Any, annotation: Any) -> str:
    """Return the line of a key; a comment where it has no default."""
    if value is not None:
        return f"{name} = {_toml(value)}"
    return f"# {name} = {'...' if expected(annotation) not in ('a text', 'a path') else _TEXT}"


def _toml(value: Any) -> str:
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_toml, value))}]"
    return json.dumps(str(value) if isinstance(value, Path) else value, ensure_ascii=False)


def _entry(key: str, text: str) -> Iterator[str]:
    """Yield the line of a key with its comment, continued on further lines."""
    lines = textwrap.wrap(text, _WIDTH - _COLUMN - 2, break_on_hyphens=False)
    if len(key) >= _COLUMN or not lines:
        yield key
    else:
        yield f"{key.ljust(_COLUMN)}# {lines.pop(0)}".replace(_NO_BREAK, " ")
    for line in lines:
        yield f"{' ' * _COLUMN}# {line}".replace(_NO_BREAK, " ")


def _summary(section: type[Section]) -> str:
    """Return a section's docstring before its parameters, without the section's name."""
    text, _, _ = cleandoc(section.__doc__ or "").partition("\n\nParameters\n")
    return _plain(" ".join(text.partition(": ")[2].split()))


def _plain(text: str) -> str:
    """Return a description without markup, as a sentence."""
    bare = _MARKUP.sub(lambda found: found[2] or found[1].rpartition(".")[2], text)
    first = bare.partition(" ")[0]
    word = first == "a" or (len(first) > 1 and first.isascii() and first.islower())
    return bare[0].upper() + bare[1:] if word else bare


if __name__ == "__main__":
    sys.stdout.write(reference_toml())
