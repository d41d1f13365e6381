"""How far pseudoranges, fixes, timing advances and time differences are trusted by a map filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter.errors import ConfigError, Faults
from mapfilter.models.ranging import GSM_STEP_M


@dataclass(frozen=True, slots=True)
class GnssOptions:
    """Noise, clock, height and doubt of what satellites tell.

    Parameters
    ----------
    zenith_m : float
        White noise of a pseudorange overhead, where a log does not tell its deviation; it grows as
        one over the sine of the elevation.
    echo_m : float
        Deviation of what lasts: echoes in streets.
    echo_memory_m : float
        Over how many metres they do; pseudoranges in a row count as one in so many.
    fix_memory_m : float
        The same of fixes.
    spacing_m, pause_s : float
        Satellites are listened to with each report that counts; without one after so many metres,
        or so many seconds where one stands.
    mask_deg : float
        Lower satellites are left out.
    height_m, height_sd_m : float
        Of the antenna over the ellipsoid, before anything is measured.
    slope : float
        Deviation of what the height changes by over a metre, metres per root metre.
    clock_sd_m, drift_sd_mps : float
        Of the clock's error and of its rate, before anything is measured.
    outliers : float
        Share of the readings that tell nothing.
    gate, search_gate : float
        Readings that are less probable than e to the power of minus this, on what is believed, are
        rejected: once converged, and while searching.
    probation_s : float
        For so long after a rejection of all satellites none is used.
    trust : float
        Largest logarithm of a Bayes factor that satellites alone make for another belief,
    trust_grows_s : float
        and over how many seconds it grows by one: spoofing ends some time.
    dispute_s : float
        After so long a rejection another belief is tried.
    """

    zenith_m: float = 2.0
    echo_m: float = 4.0
    echo_memory_m: float = 15.0
    fix_memory_m: float = 20.0
    spacing_m: float = 10.0
    pause_s: float = 10.0
    mask_deg: float = 5.0
    height_m: float = 100.0
    height_sd_m: float = 200.0
    slope: float = 0.3
    clock_sd_m: float = 3e5
    drift_sd_mps: float = 100.0
    outliers: float = 0.05
    gate: float = 8.0
    search_gate: float = 16.0
    probation_s: float = 5.0
    trust: float = 3.0
    trust_grows_s: float = 120.0
    dispute_s: float = 10.0

    def __post_init__(self) -> None:
        faults = Faults()
        for name in self.__slots__:
            value = getattr(self, name)
            if not np.isfinite(value) or (value < 0 if name != "height_m" else abs(value) > 1e4):
                faults.add(f"satellites, {name}", "a finite number, not negative", value)
        for name in ("zenith_m", "echo_memory_m", "fix_memory_m", "clock_sd_m", "trust_grows_s"):
            if getattr(self, name) == 0:
                faults.add(f"satellites, {name}", "a number above 0", 0)
        if not self.mask_deg < 90:
            faults.add("satellites, mask_deg", "degrees in 0..90", self.mask_deg)
        if not self.outliers < 1:
            faults.add("satellites, outliers", "a share below 1", self.outliers)
        faults.raise_if_any(ConfigError)


@dataclass(frozen=True, slots=True)
class TimingOptions:
    """How far timing advances and time differences are trusted.

    Parameters
    ----------
    step_m : float
        Distance of a step of timing advance: GSM; 78.1 m in LTE.
    advance_sd_m : float
        Deviation of a timing advance but for its rounding.
    advance_memory_m, difference_memory_m : float
        Over how many metres errors of timing advances and of differences last.
    difference_sd_m : float
        Deviation of a time of arrival, as a distance, where a log does not tell it.
    clip_sd : float
        A reading that is farther off counts no more than one at so many deviations.
    height_m : float
        Of the phone above ground; a site's height is its cell's.
    """

    step_m: float = GSM_STEP_M
    advance_sd_m: float = 200.0
    advance_memory_m: float = 500.0
    difference_memory_m: float = 20.0
    difference_sd_m: float = 30.0
    clip_sd: float = 3.0
    height_m: float = 1.5

    def __post_init__(self) -> None:
        faults = Faults()
        for name in self.__slots__:
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                faults.add(f"timing, {name}", "a number above 0", value)
        faults.raise_if_any(ConfigError)
