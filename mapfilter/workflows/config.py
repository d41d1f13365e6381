"""Reading a configuration: a TOML file, then ``--set section.key=value``, then one check of all."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, BeforeValidator, ValidationError

from mapfilter.errors import ConfigError, Fault, Faults, fail
from mapfilter.workflows.sections import EMBEDDED_MAP, Config, resolve_map, resolve_path

_RESOLVERS = (resolve_path, resolve_map)


def load_config(
    file: Path | None, settings: Sequence[str] = (), *, out: Path | None = None
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
    values = _read_toml(file) if file is not None else {}
    faults = Faults()
    for setting in settings:
        _apply(values, setting, faults)
    faults.raise_if_any(ConfigError)
    if out is not None:
        values.setdefault("output", {})["dir"] = str(out.absolute())
    folder = file.absolute().parent if file is not None else Path.cwd()
    values.setdefault("output", {}).setdefault("dir", str(Path.cwd() / "out"))
    try:
        return Config.model_validate(values, context={"folder": folder})
    except ValidationError as error:
        name = str(file) if file is not None else "the settings"
        raise ConfigError(tuple(_fault(name, detail) for detail in error.errors())) from None


def _read_toml(file: Path) -> dict[str, Any]:
    try:
        with file.open("rb") as stream:
            return tomllib.load(stream)
    except OSError as error:
        raise fail(ConfigError, str(file), "a TOML file", error.strerror or error) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise fail(ConfigError, str(file), "TOML", error) from error


def _apply(values: dict[str, Any], setting: str, faults: Faults) -> None:
    key, equals, text = setting.partition("=")
    *parents, last = [part.strip() for part in key.split(".")]
    where = f"--set {setting}"
    if not equals or not parents or not all((*parents, last)):
        faults.add(where, "section.key=value", setting)
        return
    place = values
    for parent in parents:
        place = place.setdefault(parent, {})
        if not isinstance(place, dict):
            faults.add(where, "a section", f"{parent}, which is a value")
            return
    value = _parse_value(text.strip())
    place[last] = str(Path(value).absolute()) if _is_path((*parents, last), value) else value


def _parse_value(text: str) -> Any:
    for candidate in (text, f"[{text}]" if "," in text else text):
        try:
            return tomllib.loads(f"value = {candidate}")["value"]
        except tomllib.TOMLDecodeError:
            continue
    return text


def _is_path(keys: tuple[str, ...], value: Any) -> bool:
    """Tell whether a setting fills a field of paths (and is not the name of the embedded map)."""
    model: Any = Config
    for key in keys[:-1]:
        field = model.model_fields.get(key)
        model = field.annotation if field is not None else None
        if not (isinstance(model, type) and issubclass(model, BaseModel)):
            return False
    field = model.model_fields.get(keys[-1])
    if field is None or not isinstance(value, str) or not value:
        return False
    marks = [*field.metadata]
    for variant in getattr(field.annotation, "__args__", ()):
        marks += getattr(variant, "__metadata__", ())
    resolved = any(isinstance(m, BeforeValidator) and m.func in _RESOLVERS for m in marks)
    return resolved and value != EMBEDDED_MAP


def _fault(name: str, detail: Mapping[str, Any]) -> Fault:
    """Turn one of pydantic's findings into a fault, with the key that was probably meant."""
    keys = [str(part) for part in detail["loc"]]
    where = f"{name}, {'.'.join(keys)}" if keys else name
    if detail["type"] == "extra_forbidden":
        close = difflib.get_close_matches(keys[-1], _known_keys(keys[:-1]), n=1)
        kind = "section" if len(keys) == 1 else "key"
        return Fault(where, f"a known {kind}", repr(keys[-1]), f"{close[0]!r}" if close else "")
    expected = str(detail["msg"]).removeprefix("Value error, ").removeprefix("Input should be ")
    return Fault(where, expected, repr(detail.get("input")))


def _known_keys(parents: Sequence[str]) -> list[str]:
    model: Any = Config
    for parent in parents:
        model = model.model_fields[parent].annotation
    return list(model.model_fields)
