"""Reading a configuration: a TOML file, then ``--set section.key=value``, then one check of all."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, BeforeValidator, ValidationError

from mapfilter._io import path_fault, shown
from mapfilter.config.fields import MAP_NAMES, resolve_map, resolve_path
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Fault, Faults, fail

_RESOLVERS = (resolve_path, resolve_map)
_EXPECTED = {
    "model_type": "a section",
    "missing": "one value more",
    "path_type": "a path",
    "is_instance_of": "a path",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "string_type": "a text",
    "tuple_type": "a list",
    "bool_type": "true or false",
}
_LISTS = {
    "bbox": "four numbers: west, south, east, north",
    "southwest": "two numbers: longitude, latitude",
    "size_m": "two numbers: metres east, metres north",
}


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
        The file cannot be read or is no TOML, or keys or values are wrong; all told together.

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
    """Return what pydantic found as faults; where ``settings`` are at fault, the file is not."""
    changed = [_keys(setting) for setting in settings]
    return tuple(_fault(file, changed, detail) for detail in error.errors())


def given_keys(file: Path | None, settings: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the keys that a file and settings give, such as ``area.map``, sorted.

    Raises
    ------
    ConfigError
        As for :func:`load_config`, of the file and of the settings' form.
    """
    return tuple(sorted(_leaves(_values(file, settings))))


def load_keys(
    file: Path | None, settings: Sequence[str], out: Path | None, keys: Sequence[str]
) -> Config | None:
    """Return what some keys of a configuration say, however wrong others are.

    Parameters
    ----------
    file, settings, out
        As for :func:`load_config`.
    keys : sequence of str
        Such as ``database.path``; all others have their defaults.

    Returns
    -------
    config : Config or None
        None where the keys themselves are wrong.
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
    """Return what file and settings give, and nothing else."""
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
    try:
        text = file.read_bytes().decode("utf-8-sig")
        values = tomllib.loads(text.replace("\r\n", "\n"))
    except OSError as error:
        raise fail(ConfigError, str(file), "a TOML file", error.strerror or error) from error
    except ValueError as error:
        raise fail(ConfigError, str(file), "TOML", error) from error
    except RecursionError as error:
        raise fail(ConfigError, str(file), "TOML", "hundreds of nested values") from error
    if not text.strip():
        raise fail(ConfigError, str(file), "a TOML file", "an empty file", "cut off when saved")
    return values


def _keys(setting: str) -> list[str]:
    return [part.strip() for part in setting.partition("=")[0].split(".")]


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
    """Tell whether a setting fills a field of paths."""
    model: Any = Config
    for key in keys[:-1]:
        field = model.model_fields.get(key)
        model = field.annotation if field is not None else None
        if not (isinstance(model, type) and issubclass(model, BaseModel)):
            return False
    field = model.model_fields.get(keys[-1])
    if field is None:
        return False
    marks = [*field.metadata]
    for variant in getattr(field.annotation, "__args__", ()):
        marks += getattr(variant, "__metadata__", ())
    return any(isinstance(m, BeforeValidator) and m.func in _RESOLVERS for m in marks)


def _fault(file: Path | None, changed: Sequence[list[str]], detail: Mapping[str, Any]) -> Fault:
    """Turn one of pydantic's findings into a fault, with the key that was probably meant."""
    keys = [str(part) for part in detail["loc"]]
    in_file = file is not None and not any(_one_path(keys, key) for key in changed)
    where = f"{file}, {'.'.join(keys)}" if in_file else f"setting {'.'.join(keys)}"
    if detail["type"] == "extra_forbidden":
        close = difflib.get_close_matches(keys[-1], _known_keys(keys[:-1]), n=1)
        kind = "section" if len(keys) == 1 else "key"
        return Fault(where, f"a known {kind}", repr(keys[-1]), f"{close[0]!r}" if close else "")
    if detail["type"] == "value_error":
        given = detail["input"]
        got = ", ".join(given) if isinstance(given, Mapping) else shown(given)
        return Fault(where, str(detail["ctx"]["error"]), got)
    whole = keys[-2:-1] if detail["type"] == "missing" else keys[-1:]
    if detail["type"] in ("missing", "too_short", "too_long") and whole and whole[0] in _LISTS:
        place = where.removesuffix(f".{keys[-1]}") if detail["type"] == "missing" else where
        return Fault(place, _LISTS[whole[0]], shown(detail["input"]))
    if detail["type"] == "missing" and isinstance(detail["input"], Mapping):
        return Fault(where, "a value", "none")
    if detail["type"] == "too_short" and not detail["input"]:
        return Fault(where, "at least one value", "none")
    if detail["type"] in ("too_short", "too_long"):
        wanted = detail["ctx"].get("max_length", detail["ctx"].get("min_length"))
        return Fault(where, f"{wanted} values", f"{len(detail['input'])}")
    return Fault(where, _EXPECTED.get(detail["type"], _said(detail)), shown(detail["input"]))


def _one_path(a: Sequence[str], b: Sequence[str]) -> bool:
    shorter = min(len(a), len(b))
    return a[:shorter] == b[:shorter]


def _said(detail: Mapping[str, Any]) -> str:
    return str(detail["msg"]).removeprefix("Input should be ")


def _known_keys(parents: Sequence[str]) -> list[str]:
    model: Any = Config
    for parent in parents:
        # A number is a place in a list of sections.
        inner = parent.isdecimal()
        model = model.__args__[0] if inner else model.model_fields[parent].annotation
    return list(model.model_fields)
