"""How a particle filter spends its particles, and when it says that it has found itself."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from mapfilter.errors import ConfigError, Faults


@dataclass(frozen=True, slots=True)
class ParticleOptions:
    """Numbers of particles, resampling and the switch rule.

    Parameters
    ----------
    most, least : int
        Limits of the number of particles.
    searching : int
        Least number until the filter has converged: a place that is improbable at first must keep
        enough of them to be followed.
    per_bin : float
        Particles for each bin of 25 m that the belief covers (two to the power of its entropy).
    resample_below : float
        Share of the particles that the effective sample size must not fall below.
    flatten : float
        Until the filter has converged, each bin of 25 m gets particles by its mass to this power,
        which keep the rest of it as weights: improbable places stay well covered. 1 for plain
        resampling.
    jitter : tuple of float
        Standard deviation of the noise that parts copies, for each row of the state.
    searching_jitter : tuple of float
        The same until the filter has converged: few copies stand for each place then, and must
        cover all headings and step lengths that are possible there.
    switch_mass : float
        The filter has converged when so much of the belief lies within 50 m of the leading
        hypothesis,
    switch_hold_m : float
        and has done so for so many metres travelled.
    """

    most: int = 20_000
    searching: int = 12_000
    least: int = 1000
    per_bin: float = 60.0
    resample_below: float = 0.5
    flatten: float = 0.5
    jitter: tuple[float, ...] = (0.2, 0.2, 0.005, 0.003, 0.0)
    searching_jitter: tuple[float, ...] = (1.5, 1.5, 0.015, 0.009, 0.0)
    switch_mass: float = 0.99
    switch_hold_m: float = 14.0

    def __post_init__(self) -> None:
        faults = Faults()
        if not 1 <= self.least <= self.most:
            got = f"{self.least} and {self.most}"
            faults.add("particles, least and most", "1 <= least <= most", got)
        if self.searching < 1:
            faults.add("particles, searching", ">= 1", self.searching)
        if not (isfinite(self.per_bin) and self.per_bin > 0):
            faults.add("particles, per_bin", "a finite number > 0", self.per_bin)
        if not 0 < self.flatten <= 1:
            faults.add("particles, flatten", "a power in (0, 1]", self.flatten)
        for name in ("resample_below", "switch_mass"):
            if not 0 < getattr(self, name) < 1:
                faults.add(f"particles, {name}", "a share between 0 and 1", getattr(self, name))
        if not (isfinite(self.switch_hold_m) and self.switch_hold_m >= 0):
            faults.add("particles, switch_hold_m", "metres >= 0", self.switch_hold_m)
        for name in ("jitter", "searching_jitter"):
            if not all(isfinite(sd) and sd >= 0 for sd in getattr(self, name)):
                faults.add(f"particles, {name}", "finite numbers >= 0", getattr(self, name))
        faults.raise_if_any(ConfigError)
