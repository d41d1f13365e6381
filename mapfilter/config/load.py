"""Reading a configuration: a TOML file, then ``--set section.key=value``, then one check of all."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, BeforeValidator, ValidationError

from mapfilter._annotations import expected, likely, without_none
from mapfilter._inputs import path_fault, read_input, shown, toml_values
from mapfilter.config.fields import MAP_NAMES, field_annotation, resolve_map, resolve_path
from mapfilter.config.mistakes import mistake_in_toml, mistake_in_value
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Fault, Faults, fail

_LARGEST_BYTES = 16 << 20
_RESOLVERS = (resolve_path, resolve_map)


def load_config(
    file: Path | None,
    settings: Sequence[str] = (),
    *,
    out: Path | None = None,
    base: Path | None = None,
) -> Config:
    """Read and check a configuration.

    Parameters
    ----------
    file : Path or None
        TOML; without one, all defaults. Relative paths in it are relative to its folder.
    settings : sequence of str
        ``section.key=value``, the value in TOML; a bare text needs no quotes and a list of numbers
        no brackets. Relative paths in them are relative to the working folder.
    out : Path or None
        Replaces ``output.dir``.
    base : Path or None
        TOML whose values stand in for the defaults.

    Raises
    ------
    ConfigError
        The file cannot be read or is no TOML, or keys or values are wrong; all faults together.

    Examples
    --------
    >>> config = load_config(None, ["cells.sites=3", "area.bbox=24.94,60.16,24.95,60.17"])
    >>> config.cells.sites, config.area.bbox
    (3, (24.94, 60.16, 24.95, 60.17))
    """
    values, folder = _given(file, settings, out)
    if base is not None:
        values = _merged(_read_toml(base), values)
    try:
        return Config.model_validate(values, context={"folder": folder})
    except ValidationError as error:
        raise ConfigError(faults_of(error, file, settings)) from None


def faults_of(
    error: ValidationError, file: Path | None = None, settings: Sequence[str] = ()
) -> tuple[Fault, ...]:
    """Return the faults of a configuration, one for each field; faults of settings name these."""
    changed = [_keys(setting) for setting in settings]
    faults: dict[tuple[str, ...], Fault] = {}
    for detail in error.errors():
        keys, annotation = _field_at(detail)
        in_file = file is not None and not any(
            keys[: len(key)] == key[: len(keys)] for key in changed
        )
        where = f"{file}, {'.'.join(keys)}" if in_file else f"setting {'.'.join(keys)}"
        faults.setdefault(keys, _fault(where, keys, annotation, detail))
    return tuple(faults.values())


def given_keys(file: Path | None, settings: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the keys that a file and settings give, such as ``area.map``, sorted."""
    return tuple(sorted(_leaves(_values(file, settings))))


def load_keys(
    file: Path | None, settings: Sequence[str], out: Path | None, keys: Sequence[str]
) -> Config | None:
    """Return a configuration of some keys alone, whatever faults others have.

    Parameters
    ----------
    file, settings, out
        As for :func:`load_config`.
    keys : sequence of str
        Such as ``database.path``; all others have their defaults. Where these keys themselves are
        wrong, the result is None.
    """
    try:
        values, folder = _given(file, settings, out)
        chosen: dict[str, dict[str, Any]] = {}
        for section, _, key in (name.partition(".") for name in keys):
            if isinstance(values.get(section), dict) and key in values[section]:
                chosen.setdefault(section, {})[key] = values[section][key]
        return Config.model_validate(chosen, context={"folder": folder})
    except (ConfigError, ValidationError):
        return None


def _given(
    file: Path | None, settings: Sequence[str], out: Path | None
) -> tuple[dict[str, Any], Path]:
    """Return the values of file and settings, unchecked, and the folder that paths start from."""
    values = _values(file, settings)
    folder = file.absolute().parent if file is not None else Path.cwd()
    output = values.setdefault("output", {})
    if isinstance(output, dict):
        if out is not None:
            output["dir"] = str(out.absolute())
        output.setdefault("dir", str(Path.cwd() / "out"))
    return values, folder


def _values(file: Path | None, settings: Sequence[str]) -> dict[str, Any]:
    """Return the keys that file and settings give, without defaults."""
    values = _read_toml(file) if file is not None else {}
    faults = Faults()
    for setting in settings:
        _apply(values, setting, faults)
    faults.raise_if_any(ConfigError)
    return values


def _leaves(values: Mapping[str, Any]) -> list[str]:
    """Return the keys of nested sections, with the names of their sections before them."""
    found = []
    for key, value in values.items():
        inner = _leaves(value) if isinstance(value, Mapping) else []
        found += [f"{key}.{name}" for name in inner] if inner else [key]
    return found


def _merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested sections, with the values above in place of those below."""
    merged = dict(below)
    for key, value in above.items():
        under = merged.get(key)
        if isinstance(under, Mapping) and isinstance(value, Mapping):
            merged[key] = _merged(under, value)
        else:
            merged[key] = value
    return merged


def _read_toml(file: Path) -> dict[str, Any]:
    if wrong := path_fault(file):
        raise fail(ConfigError, "--config", wrong, shown(str(file)))
    data = read_input(file, _LARGEST_BYTES, "a TOML file", ConfigError)
    try:
        text = data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise fail(ConfigError, str(file), "TOML", error) from error
    try:
        values = toml_values(text)
    except ValueError as error:
        hint = mistake_in_toml(text, error)
        raise fail(ConfigError, str(file), "TOML", error, hint) from error
    except RecursionError as error:
        raise fail(ConfigError, str(file), "TOML", "hundreds of nested values") from error
    if not text.strip():
        raise fail(ConfigError, str(file), "a TOML file", "an empty file", "cut off when saved")
    return values


def _keys(setting: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in setting.partition("=")[0].split("."))


def _apply(values: dict[str, Any], setting: str, faults: Faults) -> None:
    _, equals, text = setting.partition("=")
    *parents, last = _keys(setting)
    where = f"--set {setting}"
    if not equals or not parents or not all((*parents, last)):
        faults.add(where, "section.key=value", repr(setting))
        return
    place = values
    for parent in parents:
        place = place.setdefault(parent, {})
        if not isinstance(place, dict):
            faults.add(where, "a section", f"{parent}, which is a value")
            return
    value = _parse_value(text.strip())
    if _is_path((*parents, last)):
        if isinstance(value, list) and text.strip().startswith("["):
            value = [_absolute(item) if isinstance(item, str) else item for item in value]
        else:
            # A folder may be called 2024, which TOML takes for a number.
            value = _absolute(value if isinstance(value, str) else text.strip())
    place[last] = value


def _absolute(value: str) -> str:
    as_it_is = value in ("", *MAP_NAMES) or value.startswith("~")
    return value if as_it_is else str(Path(value).absolute())


def _parse_value(text: str) -> Any:
    for candidate in (text, f"[{text}]" if "," in text else text):
        try:
            return tomllib.loads(f"value = {candidate}")["value"]
        except (ValueError, RecursionError):
            continue
    return text


def _is_path(keys: tuple[str, ...]) -> bool:
    """Return whether a setting fills a field of paths."""
    annotation: Any = Config
    for key in keys:
        annotation = _inside(annotation, key)
    inner = without_none(annotation)
    marks = [*getattr(inner, "__metadata__", ())]
    for variant in get_args(get_args(inner)[0] if marks else inner):
        marks += getattr(variant, "__metadata__", ())
    return any(isinstance(m, BeforeValidator) and m.func in _RESOLVERS for m in marks)


def _inside(annotation: Any, part: str | int) -> Any:
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
        inner = _inside(annotation, part)
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
