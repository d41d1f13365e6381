"""Reading a configuration: a TOML file, then ``--set section.key=value``, then one check of all."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BeforeValidator, ValidationError

from mapfilter._annotations import without_none
from mapfilter._inputs import path_fault, read_input, shown, toml_values
from mapfilter.config.field_faults import annotation_in, faults_of, keys_of
from mapfilter.config.fields import MAP_NAMES, resolve_map, resolve_path
from mapfilter.config.mistakes import mistake_in_toml
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Faults, fail

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


def _apply(values: dict[str, Any], setting: str, faults: Faults) -> None:
    _, equals, text = setting.partition("=")
    *parents, last = keys_of(setting)
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
    resolver = _resolver_of((*parents, last))
    if resolver is not None:
        names = MAP_NAMES if resolver is resolve_map else ()
        if isinstance(value, list) and text.strip().startswith("["):
            value = [_absolute(item, names) if isinstance(item, str) else item for item in value]
        else:
            # A folder may be called 2024, which TOML takes for a number.
            value = _absolute(value if isinstance(value, str) else text.strip(), names)
    place[last] = value


def _absolute(value: str, names: Collection[str]) -> str:
    as_it_is = value in ("", *names) or value.startswith("~")
    return value if as_it_is else str(Path(value).absolute())


def _parse_value(text: str) -> Any:
    for candidate in (text, f"[{text}]" if "," in text else text):
        try:
            return tomllib.loads(f"value = {candidate}")["value"]
        except (ValueError, RecursionError):
            continue
    return text


def _resolver_of(keys: tuple[str, ...]) -> Callable[..., Any] | None:
    """Return what makes a setting absolute that fills a field of paths; None for other fields."""
    annotation: Any = Config
    for key in keys:
        annotation = annotation_in(annotation, key)
    inner = without_none(annotation)
    marks = [*getattr(inner, "__metadata__", ())]
    for variant in get_args(get_args(inner)[0] if marks else inner):
        marks += getattr(variant, "__metadata__", ())
    found = (mark.func for mark in marks if isinstance(mark, BeforeValidator))
    return next((one for one in found if one in _RESOLVERS), None)
