"""Faults of a configuration in words, one for each field; and the field that a key names."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from mapfilter._annotations import expected, likely, without_none
from mapfilter._inputs import shown
from mapfilter.config.fields import field_annotation
from mapfilter.config.mistakes import mistake_in_value
from mapfilter.config.sections import Config
from mapfilter.errors import Fault


def faults_of(
    error: ValidationError, file: Path | None = None, settings: Sequence[str] = ()
) -> tuple[Fault, ...]:
    """Return the faults of a configuration, one for each field; faults of settings name these."""
    changed = [keys_of(setting) for setting in settings]
    faults: dict[tuple[str, ...], Fault] = {}
    for detail in error.errors():
        keys, annotation = _field_at(detail)
        in_file = file is not None and not any(
            keys[: len(key)] == key[: len(keys)] for key in changed
        )
        where = f"{file}, {'.'.join(keys)}" if in_file else f"setting {'.'.join(keys)}"
        faults.setdefault(keys, _fault(where, keys, annotation, detail))
    return tuple(faults.values())


def annotation_in(annotation: Any, part: str | int) -> Any:
    """Return the annotation of a key of a section, or of an element of a list; None without any."""
    inner = without_none(annotation)
    while get_origin(inner) is Annotated:
        inner = get_args(inner)[0]
    if isinstance(inner, type) and issubclass(inner, BaseModel):
        return field_annotation(inner, part) if part in inner.model_fields else None
    found = get_args(inner)
    if get_origin(inner) is tuple and isinstance(part, int):
        return found[0] if found[-1] is Ellipsis else found[min(part, len(found) - 1)]
    return found[1] if get_origin(inner) is dict and isinstance(part, str) else None


def _field_at(detail: Mapping[str, Any]) -> tuple[tuple[str, ...], Any]:
    """Return keys and annotation of the field that one of pydantic's findings is of.

    The location of a finding also names the members of a union; of a list that is too short it
    ends with an element.
    """
    place: tuple[str | int, ...] = detail["loc"]
    if detail["type"] == "missing" and isinstance(place[-1], int):
        place = place[:-1]
    annotation: Any = Config
    keys: list[str] = []
    for part in place:
        inner = annotation_in(annotation, part)
        if inner is None:
            break
        annotation = inner
        keys.append(str(part))
    if detail["type"] == "extra_forbidden":
        keys.append(str(place[-1]))
    return tuple(keys), annotation


def _names_in(model: type[BaseModel], within: str = "") -> Iterator[str]:
    """Yield the dotted names of all sections and keys of a configuration."""
    for name in model.model_fields:
        yield within + name
        inner = without_none(field_annotation(model, name))
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from _names_in(inner, f"{within}{name}.")


def _elsewhere(keys: Sequence[str]) -> list[str]:
    """Return the nearest known names that end like an unknown one, or none where these are many."""
    every = [name.split(".") for name in _names_in(Config)]
    # A section that the key stands in is no mistake for it.
    every = [name for name in every if list(keys[: len(name)]) != name]
    ends = sorted({name[-1] for name in every})
    near = difflib.get_close_matches(keys[-1], ends, n=1, cutoff=0.8)
    shared = {".".join(name): _shared(keys, name) for name in every if name[-1] in near}
    found = [name for name, sections in shared.items() if sections == max(shared.values())]
    return found if len(found) <= 2 else []


def _shared(keys: Sequence[str], others: Sequence[str]) -> int:
    """Return how many sections two names have in common, from the outermost on."""
    both = zip(keys[:-1], others[:-1], strict=False)
    return len(list(takewhile(lambda pair: pair[0] == pair[1], both)))


def _fault(where: str, keys: Sequence[str], annotation: Any, detail: Mapping[str, Any]) -> Fault:
    """Return the fault of a field; of an unknown key, with the most similar known key."""
    kind, given = detail["type"], detail["input"]
    wanted = without_none(annotation)
    if kind == "extra_forbidden":
        close = difflib.get_close_matches(keys[-1], list(wanted.model_fields), n=2)
        close = close or _elsewhere(keys)
        what = "section" if len(keys) == 1 else "key"
        return Fault(where, f"a known {what}", repr(keys[-1]), " or ".join(map(repr, close)))
    if kind == "value_error":
        got = ", ".join(given) if isinstance(given, Mapping) else shown(given)
        return Fault(where, str(detail["ctx"]["error"]), got)
    if kind == "missing" and isinstance(given, Mapping):
        return Fault(where, "a value", "none")
    if kind in ("too_short", "string_too_short") and not given:
        return Fault(where, "at least one value", "none")
    words = expected(wanted)
    if kind == "finite_number":
        words = words.replace("a number", "a finite number")
    hint = likely(wanted, given) or mistake_in_value(keys, words, given)
    return Fault(where, words, shown(given), hint)


def keys_of(setting: str) -> tuple[str, ...]:
    """Return section and key of a setting, ``section.key=value``."""
    return tuple(part.strip() for part in setting.partition("=")[0].split("."))
