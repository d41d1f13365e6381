"""Which settings ``mapfilter evaluate global-positioning`` takes; all others are refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import as_file, files
from pathlib import Path
from typing import Literal, get_args

from mapfilter.config.load import given_keys, load_config
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Faults, fail

WorldName = Literal["easy", "plain"]
WORLDS: tuple[str, ...] = get_args(WorldName)

_DRAWN = "is drawn for each run; use --seed"
_CASES = "is what the cases vary; use --case"
_PREDICTS = "levels are predicted here, and the ground truth is drawn"
_NO_JOURNEYS = "journeys are simulated here"
_RUNS = "use --runs"
_NO_TIMING = "no timing advances are simulated"
_PICTURES = "no pictures are drawn here"
REFUSED: Mapping[str, str] = {
    "prediction.reality.write": _PREDICTS,
    "prediction.reality.seed": _DRAWN,
    "prediction.survey": _PREDICTS,
    "rasters": _PREDICTS,
    "database.path": "the database is built here",
    "journeys.count": _RUNS,
    "journeys.draws": _RUNS,
    "journeys.seed": _DRAWN,
    "journeys.radio": "the ground truth is what is received",
    "track": _NO_JOURNEYS,
    "filter.smooth": _CASES,
    "filter.bayes.smooth": _CASES,
    "filter.bayes.timing_step_m": _NO_TIMING,
    "filter.bayes.timing_sd_m": _NO_TIMING,
    "sweep": "there is no grid here; use mapfilter sweep",
    "output.pictures": _PICTURES,
}
"""Settings, or sections of them, that have no meaning here, and why."""

_OF_WALKERS = frozenset(
    f"journeys.{name}"
    for name in ("speed_mps", "beside", "change_side_m", "stop_every_m", "stop_s")
)

_OF_PARTICLES = frozenset(f"filter.bayes.{name}_particles" for name in ("max", "min_search", "min"))

_OF_THE_CASES: Mapping[str, str] = {
    "prediction.reality.level_error_db": "level_error_db",
    "journeys.length_m": "length_m",
    "imu.sigma_orient_deg": "sigma_orient_rad",
    "imu.bias_sd_deg": "heading_bias_sd_rad",
    "imu.drift_deg_per_sqrt_s": "heading_drift_rad_per_sqrt_s",
    "imu.scale": "step_scale_sd",
    "filter.bayes.step_sd_m": "step_sd_m",
    "filter.bayes.heading_sd_deg": "heading_sd_rad",
    "filter.bayes.bias_sd_deg": "bias_sd_rad",
    "filter.bayes.drift_deg_per_sqrt_m": "bias_drift_rad_per_sqrt_m",
    "filter.bayes.scale": "scale_sd",
    "filter.bayes.antenna_height_m": "height_m",
    "filter.bayes.antenna_height_sd_m": "height_sd_m",
}
"""Settings that hold in all cases once they are given, and the cases' own names for them."""


def load_benchmark(
    world: str, file: Path | None, settings: Sequence[str], *, out: Path | None = None
) -> tuple[Config, frozenset[str]]:
    """Load a benchmark's configuration over that of a simulated world.

    Parameters
    ----------
    world : str
        One of :data:`WORLDS`.
    file, settings, out
        As for :func:`mapfilter.config.load.load_config`.

    Returns
    -------
    config : Config
    fixed : frozenset of str
        What the cases must not change, as it was set.

    Raises
    ------
    ConfigError
        There is no such world, or a setting is wrong or has no meaning here.
    """
    if world not in WORLDS:
        raise fail(ConfigError, "--world", " or ".join(WORLDS), repr(world))
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
    of_bayes = key.startswith("filter.bayes.")
    particles = chosen == "bayes" or key not in _OF_PARTICLES
    if chosen in ("bayes", "grid") and of_bayes and particles:
        return ""
    if chosen == "candidate" and not of_bayes:
        return ""
    return f"the filter {chosen} has no such option"
