"""The cases of the global-positioning benchmark: what is measured, how badly, and what is stated.

How wrong the dead reckoning of a case is (``imu``) and what its data sheet states (``data_sheet``)
are two things. A filter is given the second; where the sheet is silent, the filter's own defaults
hold.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from mapfilter.tracks.imu_noise import ImuNoise

_WALKING_MPS = 1.4
_NOTHING: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class Case:
    """One row of the table.

    Parameters
    ----------
    imu : mapping of str to float
        Errors of dead reckoning in which the case differs from the simulated world, by their names
        in :class:`mapfilter.tracks.imu_noise.ImuNoise`.
    data_sheet : mapping of str to float
        What is stated of the dead reckoning, as options of
        :class:`mapfilter.positioning.bayes.options.BayesFilter`.
    levels : bool
        Whether the phone reports levels and neighbours, or only its serving cell.
    compass : bool
        Whether headings are measured, or only turns.
    missing_ways : float
        Share of the ways that the filter's map lacks.
    level_error_db : float or None
        Deviation of the ground truth's shadowing; None for that of the world.
    smooth : bool
        Whether the whole track is smoothed and scored from its start.
    recovery_within_m : float
        For journeys with an unmeasured displacement: within how many metres the position must be
        found again; 0 for those without.
    satellites : int or None
        How many satellites the phone receives at most; None without a receiver.
    spoofed : bool
        Whether a spoofer shifts their position for a while.

    Notes
    -----
    ``fixed`` are names of errors and options that were set for all cases.
    """

    name: str
    imu: Mapping[str, float] = field(default_factory=lambda: _NOTHING)
    data_sheet: Mapping[str, float] = field(default_factory=lambda: _NOTHING)
    levels: bool = True
    compass: bool = True
    missing_ways: float = 0.0
    level_error_db: float | None = None
    smooth: bool = False
    recovery_within_m: float = 0.0
    satellites: int | None = None
    spoofed: bool = False

    def errors_in(self, world: ImuNoise, fixed: frozenset[str] = frozenset()) -> ImuNoise:
        """Return the world's errors of dead reckoning with those of the case that are not fixed."""
        changes: dict[str, Any] = {k: v for k, v in self.imu.items() if f"imu.{k}" not in fixed}
        return replace(world, **changes)


def _compass(sd_deg: float) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return errors and data sheet of a compass of some accuracy."""
    return {"sigma_orient_deg": sd_deg}, {"heading_sd_deg": sd_deg}


def _biased(
    bias_sd_deg: float, drift_deg_per_sqrt_s: float, scale: float
) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return errors and data sheet of a unit with a lasting heading error and step scale."""
    errors, sheet = _compass(6.0)
    return (
        {
            **errors,
            "bias_sd_deg": bias_sd_deg,
            "drift_deg_per_sqrt_s": drift_deg_per_sqrt_s,
            "scale": scale,
        },
        {
            **sheet,
            "bias_sd_deg": bias_sd_deg,
            "drift_deg_per_sqrt_m": drift_deg_per_sqrt_s / _WALKING_MPS**0.5,
            "scale": scale,
        },
    )


_USUAL, _BIAS_10, _BIAS_20 = _compass(6.0), _biased(10.0, 0.2, 0.05), _biased(20.0, 0.4, 0.1)

CASES = {
    case.name: case
    for case in (
        *(Case(f"levels-{deg}", *_compass(deg)) for deg in (3, 6, 10, 20)),
        *(Case(f"cell-{deg}", *_compass(deg), levels=False) for deg in (3, 6, 10, 20)),
        Case("levels-bias10", *_BIAS_10),
        Case("levels-bias20", *_BIAS_20),
        Case("levels-nocompass", *_USUAL, compass=False),
        Case("cell-bias10", *_BIAS_10, levels=False),
        Case("levels-missing10", *_USUAL, missing_ways=0.1),
        Case("levels-error10", *_USUAL, level_error_db=10.0),
        Case("smooth-6", *_USUAL, smooth=True),
        Case("smooth-bias10", *_BIAS_10, smooth=True),
        Case("recovery-levels", *_USUAL, recovery_within_m=300.0),
        Case("recovery-cell", *_USUAL, levels=False, recovery_within_m=700.0),
        *(Case(f"satellites-{count}", *_BIAS_10, satellites=count) for count in range(5)),
        Case("spoofed", *_BIAS_10, satellites=4, spoofed=True),
    )
}
"""All cases by name, in the order of the table."""

USUAL = tuple(name for name, case in CASES.items() if case.satellites is None)
"""Those that are run unless others are asked for."""
