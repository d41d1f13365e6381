"""Output of one step of a filter: a :class:`Fix`, and why readings were not used."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan

import numpy as np

from mapfilter._same import EqualByContent
from mapfilter._types import Floats
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.integrity import DEFAULT_RISK, RadialTail


@dataclass(frozen=True, slots=True, eq=False)
class Fix(EqualByContent):
    """Position at one epoch; NaN where the filter does not give a value.

    Parameters
    ----------
    time_s : float
        Seconds since the start of the log.
    east_m, north_m : float
        Position in the database's CRS; NaN while the filter gives none.
    covariance_m2 : (2, 2) array
        Covariance of east and north; NaN where the filter has none.
    radii_m : (3,) array
        Radii that hold 50, 67 and 95 % of the belief.
    status : Status
        As in :class:`~mapfilter.filters.contract.Status`.
    hypotheses : int
        Number of hypotheses (candidates, particles or Gaussians).
    mass_50m : float
        Share of the belief within 50 m of the leading hypothesis.
    way_id : int
        OpenStreetMap id of the matched way; 0 where none is matched.
    way_probability : float
        Probability of that way.
    reason : Reason
        Whether the epoch's serving-cell reading was used, or why not.
    radius_99_m : float
        Radius that holds 99 % of the belief; NaN where the filter has none.
    protection_m : float
        Protection level: the error exceeds it with at most a stated risk, by default 1e-3. Infinite
        where there is none for this risk (unavailable), NaN of filters without one.
    """

    time_s: float
    east_m: float
    north_m: float
    covariance_m2: Floats
    radii_m: Floats
    status: Status
    hypotheses: int
    mass_50m: float
    way_id: int
    way_probability: float
    reason: Reason
    radius_99_m: float = nan
    protection_m: float = nan

    @classmethod
    def nowhere(cls, time_s: float, status: Status, reason: Reason) -> Fix:
        """Return the fix of an epoch at which the filter gives no position."""
        empty = np.full((2, 2), np.nan)
        return cls(
            time_s, np.nan, np.nan, empty, np.full(3, np.nan), status, 0, np.nan, 0, np.nan, reason
        )

    def gone_on(self, time_s: float, east_m: float, north_m: float, reason: Reason) -> Fix:
        """Return the fix at a later epoch, with all else as it was."""
        # Most epochs have such a fix: a copy by `dataclasses.replace` takes twice as long.
        return Fix(
            time_s,
            east_m,
            north_m,
            self.covariance_m2,
            self.radii_m,
            self.status,
            self.hypotheses,
            self.mass_50m,
            self.way_id,
            self.way_probability,
            reason,
            self.radius_99_m,
            self.protection_m,
        )


@dataclass(frozen=True, slots=True)
class UnusedReading:
    """A reading that was not used, or all readings of a kind.

    Parameters
    ----------
    time_s : float
        When it was taken.
    kind : str
        ``motion``, ``serving``, ``neighbour``, ``gnss``, ``pseudorange``, ``ta`` or ``tdoa``.
    what : str
        The cell or satellite, or an empty string.
    reason : Reason
        Why.
    readings : int
        How many there are; the time is that of the first.
    """

    time_s: float
    kind: str
    what: str
    reason: Reason
    readings: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class StepOutput(EqualByContent):
    """Output of one step of a filter.

    Parameters
    ----------
    evidence : tuple of float, optional
        Runner-up's east, north and mass, entropy in bits, log evidence; of filters that hold
        probabilities.
    unused : tuple of UnusedReading
        Measurements of the epoch that were not used, and why.
    tail : RadialTail, optional
        How likely the position is farther off, for protection levels of any risk; of filters that
        hold probabilities.
    """

    fix: Fix
    evidence: tuple[float, float, float, float, float] | None = None
    unused: tuple[UnusedReading, ...] = ()
    tail: RadialTail | None = None

    def protected(self, tail: RadialTail | None, risk: float = DEFAULT_RISK) -> StepOutput:
        """Return the output with a tail, and what follows from it for the fix.

        Parameters
        ----------
        risk : float
            Of the protection level, between 0 and 1.
        """
        if tail is None:
            return self
        wide_m, protection_m = protected_m(tail, self.fix.radii_m, risk)
        fix = replace(self.fix, radius_99_m=wide_m, protection_m=protection_m)
        return StepOutput(fix, self.evidence, self.unused, tail)


def protected_m(
    tail: RadialTail, radii_m: Floats, risk: float = DEFAULT_RISK
) -> tuple[float, float]:
    """Return the radius that holds 99 % of a belief, and its protection level for a risk.

    The former is at least the largest of the other radii, ``radii_m``.
    """
    return max(tail.radius_m(0.99), float(radii_m[-1])), tail.protection_m(risk)
