"""Numeric options of a configuration as axes of an experiment, by their dotted keys."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from types import NoneType
from typing import Any

from pydantic import BaseModel, ValidationError

from mapfilter._annotations import expected, fits, plain_types
from mapfilter.config.field_faults import faults_of
from mapfilter.config.fields import field_annotation
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Faults, MapfilterError, fail

SECTIONS = ("filter", "imu", "journeys", "database")
"""Sections whose numeric options can be varied, but for those that a sweep does not use."""

_NOT_USED = {
    "journeys.count": "sweep.routes",
    "journeys.draws": "sweep.draws",
    "journeys.seed": "sweep.seed",
    "database.floor_dbm": "sweep.databases, each built with its own floor",
    "database.tile_px": "",
    "filter.bayes.threads": "--workers, as runs are divided among processes",
    **dict.fromkeys(
        (
            *(f"filter.bayes.{name}" for name in ("timing_step_m", "timing_sd_m")),
            *(f"filter.bayes.{name}" for name in ("satellite_sd_m", "antenna_height_m")),
            "filter.bayes.antenna_height_sd_m",
            *(f"filter.kalman.timing_{name}" for name in ("step_m", "sd_m", "memory_m")),
            *(f"filter.kalman.fix_{name}" for name in ("sd_m", "lasting_share")),
            *(f"filter.kalman.fix_{name}" for name in ("lasting_m", "lasting_s")),
        ),
        "an option of replay, as sweeps simulate no such measurement",
    ),
    **dict.fromkeys(
        (f"filter.kalman.turn_{name}" for name in ("drift_deg_per_sqrt_m", "rate_sd_deg_per_s")),
        "an option of replay, as simulated motion has headings",
    ),
}
"""Numeric options of these sections that change nothing in a sweep, and what does instead."""


def numeric_keys() -> dict[str, Any]:
    """Return the keys that can be varied, such as ``imu.scale``, with their annotations."""
    options = _options().items()
    return {key: found for key, found in options if _is_numeric(found) and key not in _NOT_USED}


def _options() -> dict[str, Any]:
    return {
        key: annotation
        for section in SECTIONS
        for key, annotation in _leaves(Config.model_fields[section].annotation, section)
    }


def parse_axis(text: str) -> tuple[str, tuple[float, ...]]:
    """Return key and values of an axis that is given as ``section.key=1,2,3``, checked.

    Raises
    ------
    ConfigError
        The text has another form; as for :func:`check_axis`.

    Examples
    --------
    >>> parse_axis("filter.bayes.heading_sd_deg=3,6,10")
    ('filter.bayes.heading_sd_deg', (3.0, 6.0, 10.0))
    """
    key, equals, listed = text.partition("=")
    try:
        values = [float(part) for part in listed.split(",")]
    except ValueError:
        values = []
    if not equals or not values:
        raise fail(ConfigError, "--vary", "section.key=number,number,...", repr(text))
    return key.strip(), check_axis(key.strip(), values)


def check_axis(key: str, values: Sequence[float]) -> tuple[float, ...]:
    """Return the values of an axis in the type of its option, after a check of all of them.

    Raises
    ------
    ConfigError
        The key is unknown or not numeric, there is no value, or values are out of range or given
        twice.

    Examples
    --------
    >>> check_axis("imu.scale", [0.0, 1.5])
    Traceback (most recent call last):
        ...
    mapfilter.errors.ConfigError: imu.scale: expected a number >= 0 and < 1, found 1.5
    """
    known = numeric_keys()
    if key not in known:
        raise _not_numeric(key, known)
    faults = Faults()
    for value in values:
        if not fits(known[key], value):
            faults.add(key, expected(known[key]), value)
    if not values:
        faults.add(key, "at least one value", "none")
    if len(set(values)) < len(values):
        faults.add(key, "every value once", ", ".join(f"{value:g}" for value in values))
    faults.raise_if_any(ConfigError)
    whole = float not in plain_types(known[key])
    return tuple(int(value) if whole else float(value) for value in values)


def vary(config: Config, changes: Mapping[str, float]) -> Config:
    """Return a configuration with other values of some options, by their dotted keys, checked.

    Raises
    ------
    ConfigError
        A key is unknown or not numeric, or the values do not go together.

    Examples
    --------
    >>> vary(Config(), {"imu.sigma_trans_m": 0.4}).imu.sigma_trans_m
    0.4
    """
    values = config.model_dump()
    for key, value in changes.items():
        (checked,) = check_axis(key, (value,))
        *parents, last = key.split(".")
        place = values
        for parent in parents:
            place = place[parent]
        place[last] = checked
    try:
        return Config.model_validate(values)
    except ValidationError as error:
        raise ConfigError(faults_of(error)) from None


def _leaves(section: Any, name: str) -> Iterator[tuple[str, Any]]:
    for key in section.model_fields:
        annotation = field_annotation(section, key)
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            yield from _leaves(annotation, f"{name}.{key}")
        else:
            yield f"{name}.{key}", annotation


def _is_numeric(annotation: Any) -> bool:
    types = set(plain_types(annotation))
    return bool(types & {int, float}) and types <= {int, float, NoneType}


def _not_numeric(key: str, known: Mapping[str, Any]) -> MapfilterError:
    """Return the error for a key that cannot be varied, with those that were probably meant."""
    if key in _NOT_USED:
        return fail(ConfigError, key, "an option that a sweep uses", repr(key), _NOT_USED[key])
    if annotation := _options().get(key):
        return fail(
            ConfigError, key, "a numeric option", f"an option that is {expected(annotation)}"
        )
    name = key.rpartition(".")[2]
    alike = [one for one in known if one.rpartition(".")[2] == name]
    alike += difflib.get_close_matches(key, known, n=3, cutoff=0.5)
    close = " or ".join(map(repr, list(dict.fromkeys(alike))[:3]))
    return fail(ConfigError, key, "a numeric option", repr(key), close)
