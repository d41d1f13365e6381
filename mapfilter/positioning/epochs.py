"""Epochs: dead reckoning, radio report and GNSS of one moment."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite, isnan, nan
from typing import Any

from mapfilter._same import EqualByValue
from mapfilter.filters.contract import MotionStep
from mapfilter.tracks.schema import SERVING


@dataclass(frozen=True, slots=True, eq=False)
class ReportRow(EqualByValue):
    """One row of a radio report.

    Parameters
    ----------
    role : str
        ``serving`` or ``neighbour``.
    cell : str or None
        Its id in the database; None of a neighbour that is known by carrier and code alone.
    arfcn, bsic : int or None
        Its carrier (ARFCN, EARFCN, …) and code (BSIC, PCI, …); None where unknown.
    level_dbm : float
        NaN where it was not reported.
    censored : int
        -1: below the reported level, 1: above it, 0: the level itself.
    timing_advance : float
        Steps; NaN where it was not reported.

    Examples
    --------
    >>> ReportRow("serving", "A1", level_dbm=-71.0).name
    'A1'
    """

    role: str
    cell: str | None = None
    arfcn: int | None = None
    bsic: int | None = None
    level_dbm: float = nan
    censored: int = 0
    timing_advance: float = nan

    @property
    def name(self) -> str:
        """The cell as messages name it."""
        if self.cell is not None:
            return self.cell
        bsic = "unknown" if self.bsic is None else self.bsic
        return "" if self.arfcn is None else f"ARFCN {self.arfcn}, BSIC {bsic}"


FIX_SD_M = 10.0
"""Deviation, east and north, that is assumed of a fix that states none."""


@dataclass(frozen=True, slots=True, eq=False)
class GnssFix(EqualByValue):
    """A position by GNSS in the CRS of the database.

    Parameters
    ----------
    var_east_m2, var_north_m2, cov_east_north_m2 : float
        NaN where unknown.
    """

    east_m: float
    north_m: float
    var_east_m2: float = nan
    var_north_m2: float = nan
    cov_east_north_m2: float = nan

    def repeats(self, last: GnssFix | None) -> bool:
        """Return whether position and errors are those of the last fix, to the last digit.

        Noise makes two measured positions differ, also at a standstill.
        """
        return self == last


@dataclass(frozen=True, slots=True, eq=False)
class Pseudorange(EqualByValue):
    """One satellite received.

    Parameters
    ----------
    pseudorange_m : float
        With the receiver's clock in it; NaN where it was not measured.
    sigma_m : float
        NaN where unknown.
    place_m : tuple of float
        Of the satellite, earth-centred; NaN where unknown.
    """

    satellite: str
    pseudorange_m: float
    sigma_m: float
    place_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Difference(EqualByValue):
    """How much farther away a cell is than another, by times of arrival.

    Parameters
    ----------
    difference_m : float
        NaN where it was not measured.
    sigma_m, reference_sigma_m : float
        Of the two times, as distances; NaN where unknown.
    """

    cell: str
    reference: str
    difference_m: float
    sigma_m: float = nan
    reference_sigma_m: float = nan


@dataclass(frozen=True, slots=True, eq=False)
class Epoch(EqualByValue):
    """Motion and measurements of one moment; filters move first, then measure.

    Parameters
    ----------
    time_s : float
        Seconds since any start, the same for all epochs.
    motion : tuple of MotionStep
        Intervals that end now.
    radio : tuple of ReportRow
        The report, of all its rows.
    gnss : GnssFix or None
    pseudoranges : tuple of Pseudorange
    tdoa : tuple of Difference

    Examples
    --------
    >>> step, report = MotionStep(1.4, heading_rad=0.0), ReportRow("serving", "A1", level_dbm=-71.0)
    >>> Epoch(0.0, (step,), (report,)).measured
    True
    """

    time_s: float
    motion: tuple[MotionStep, ...] = ()
    radio: tuple[ReportRow, ...] = ()
    gnss: GnssFix | None = None
    pseudoranges: tuple[Pseudorange, ...] = ()
    tdoa: tuple[Difference, ...] = ()

    @property
    def measured(self) -> bool:
        """Whether something besides motion was measured; NaN, None and ``()`` are no reading."""
        return any(_is_reading(getattr(self, one.name)) for one in fields(self)[2:])


def _is_reading(value: Any) -> bool:
    missing = value is None or value == () or (isinstance(value, float) and isnan(value))
    return not missing


def headed(step: MotionStep, heading_rad: float) -> tuple[MotionStep, float]:
    """Give a step without a compass the heading that its turns add up to.

    Parameters
    ----------
    heading_rad : float
        After the last step; NaN before the first.

    Returns
    -------
    step : MotionStep
        With a heading; without one where it has neither heading nor turn and none was known.
    """
    if isfinite(step.heading_rad):
        return step, step.heading_rad
    if isfinite(step.spread_m):
        return step, heading_rad
    if isfinite(step.turn_rad):
        heading_rad = (heading_rad if isfinite(heading_rad) else 0.0) + step.turn_rad
    elif not isfinite(heading_rad):
        # A first step has no turn: the headings that follow are counted from it.
        heading_rad = 0.0
    else:
        return step, heading_rad
    # Each epoch has such a step: a copy by `dataclasses.replace` takes several times as long.
    with_heading = MotionStep(
        step.step_m,
        heading_rad,
        step.turn_rad,
        step.spread_m,
        step.sampling_sd_m,
        rows=step.rows,
    )
    return with_heading, heading_rad


def serving_cell(epoch: Epoch) -> str | None:
    """Return the first serving cell that a report names."""
    named = (row.cell for row in epoch.radio if row.role == SERVING and row.cell is not None)
    return next(named, None)
