"""Settings of benchmarks over those of a simulated world, and which have no meaning there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import as_file, files
from pathlib import Path

from mapfilter.config.load import given_keys, load_config
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Faults, fail
from mapfilter.positioning.locators import filter_options
from mapfilter.workflows.inputs.filter_choice import option_sections

WORLDS = ("easy", "plain")

_DRAWN = "is drawn for each run; use --seed"
_CASES = "is what the cases vary; use --case"
_PREDICTS = "levels are predicted here, and the ground truth is drawn"
_NO_JOURNEYS = "journeys are simulated here"
_RUNS = "use --runs"
_NO_TIMING = "no timing advances are simulated"
_WAYS = "journeys follow the ways of a map"
REFUSED: Mapping[str, str] = {
    "prediction.ground_truth.write": _PREDICTS,
    "prediction.ground_truth.seed": _DRAWN,
    "prediction.survey": _PREDICTS,
    "rasters": _PREDICTS,
    "roads.raster": _WAYS,
    "roads.raster_classes": _WAYS,
    "database.path": "the database is built here",
    "database.cells": "the cases are of cells",
    "journeys.count": _RUNS,
    "journeys.draws": _RUNS,
    "journeys.seed": _DRAWN,
    "journeys.radio": "the ground truth is what is received",
    "track": _NO_JOURNEYS,
    "filter.smooth": _CASES,
    "filter.bayes.timing_step_m": _NO_TIMING,
    "filter.bayes.timing_sd_m": _NO_TIMING,
    "filter.kalman.timing_step_m": _NO_TIMING,
    "filter.kalman.timing_sd_m": _NO_TIMING,
    "filter.kalman.timing_memory_m": _NO_TIMING,
    "sweep": "there is no grid here; use mapfilter sweep",
}
"""Settings, or sections of them, that have no meaning here, and why."""

_OF_WALKERS = frozenset(
    f"journeys.{name}"
    for name in ("speed_mps", "beside", "change_side_m", "stop_every_m", "stop_s")
)
_OF_PARTICLES = frozenset(f"filter.bayes.{name}_particles" for name in ("max", "min_search", "min"))
_STATED = (
    "step_sd_m",
    "heading_sd_deg",
    "bias_sd_deg",
    "drift_deg_per_sqrt_m",
    "scale",
    "antenna_height_m",
    "antenna_height_sd_m",
)
_OF_THE_CASES: Mapping[str, str] = {
    "prediction.ground_truth.level_error_db": "level_error_db",
    "journeys.length_m": "length_m",
    "imu.sigma_orient_deg": "imu.sigma_orient_deg",
    "imu.bias_sd_deg": "imu.bias_sd_deg",
    "imu.drift_deg_per_sqrt_s": "imu.drift_deg_per_sqrt_s",
    "imu.scale": "imu.scale",
    **{f"filter.bayes.{name}": name for name in _STATED},
}
"""Settings that hold in all cases once they are given, and the cases' own names for them."""


def load_benchmark(
    world: str, file: Path | None, settings: Sequence[str], *, out: Path | None = None
) -> tuple[Config, frozenset[str]]:
    """Load a benchmark's configuration over that of a simulated world, one of :data:`WORLDS`.

    Returns
    -------
    config : Config
        From file and settings, as by :func:`mapfilter.config.load.load_config`.
    fixed : frozenset of str
        Names of what was set, and the cases must not change.

    Raises
    ------
    ConfigError
        There is no such world, or a setting is wrong or has no meaning here.
    """
    if world not in WORLDS:
        expected = ", ".join((*WORLDS, "foreign, harsh or sensors"))
        raise fail(ConfigError, "--world", expected, repr(world))
    with as_file(files("mapfilter.data")) as data:
        config = load_config(file, settings, out=out, base=data / f"world-{world}.toml")
    given = given_keys(file, settings)
    _check(given, config)
    return config, frozenset(name for key, name in _OF_THE_CASES.items() if key in given)


def _check(given: Sequence[str], config: Config) -> None:
    faults = Faults()
    for key in given:
        why = _refused(key, config)
        if why:
            faults.add(f"setting {key}", "none, as the benchmark does not take it", "one", why)
    if config.prediction.model == "survey":
        faults.add("setting prediction.model", "a propagation model", "survey", _PREDICTS)
    faults.raise_if_any(ConfigError)


def _refused(key: str, config: Config) -> str:
    """Return why a setting has no meaning, or an empty text."""
    for name, why in REFUSED.items():
        if key == name or key.startswith(f"{name}."):
            return why
    if key in _OF_WALKERS and config.roads.profile == "driving":
        return "is of walkers; roads.profile is driving"
    if not key.startswith("filter.") or key == "filter.name":
        return ""
    chosen = config.filter.name
    section, _, _ = key.rpartition(".")
    particles = chosen == "bayes" or key not in _OF_PARTICLES
    options = None if ":" in chosen else filter_options(chosen)
    if section in dict(option_sections(config.filter, options)) and particles:
        return ""
    return f"the filter {chosen} has no such option"
