"""Estimates: one :class:`Fix` for each epoch, together a :class:`TrackEstimate`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.errors import Faults, InputError
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.integrity import DEFAULT_RISK, RadialTail

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd


@dataclass(frozen=True, slots=True)
class Fix:
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


@dataclass(frozen=True, slots=True)
class StepOutput:
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


@dataclass(frozen=True, slots=True, eq=False)
class TrackEvidence:
    """Uncertainty of filters that hold probabilities, over N epochs; NaN before the start.

    Parameters
    ----------
    runner_up_east_m, runner_up_north_m : (N,) arrays
        The second hypothesis, in the CRS of the positions; NaN where there is none.
    runner_up_mass : (N,) array
        Its share of the belief.
    entropy_bits : (N,) array
        Of the belief over bins of 25 m.
    log_evidence : (N,) array
        Logarithm of the probability of all readings so far.
    """

    runner_up_east_m: Floats
    runner_up_north_m: Floats
    runner_up_mass: Floats
    entropy_bits: Floats
    log_evidence: Floats


@dataclass(frozen=True)
class TrackEstimate:
    """The fixes of one track as arrays over N epochs.

    Parameters
    ----------
    crs : str
        CRS of the positions.
    filter : str
        Name of the filter.
    start_utc_s : float
        UTC seconds of ``time_s`` = 0; NaN when unknown.
    time_s : (N,) array
        Seconds since the start of the log, in ascending order.
    east_m, north_m : (N,) arrays
        Position in ``crs``; NaN where the filter gives none.
    covariance_m2 : (N, 2, 2) array
        Covariance of east and north; NaN where the filter has none.
    radii_m : (N, 3) array
        Radii about the position that contain 50, 67 and 95 % of the belief.
    status : tuple of Status
        As in :class:`~mapfilter.filters.contract.Status`, for each epoch.
    hypotheses : (N,) array of int64
        Number of hypotheses (candidates, particles or Gaussians).
    mass_50m : (N,) array
        Share of the belief within 50 m of the leading hypothesis, 0 to 1; NaN where
        the filter gives none.
    way_id : (N,) array of int64
        OpenStreetMap id of the matched way; 0 where none is matched.
    way_probability : (N,) array
        Probability of the matched way, 0 to 1; NaN where the filter gives none.
    reason : tuple of Reason
        Whether the reading of each epoch was used, or why not.
    radius_99_m : (N,) array
        Radii that hold 99 % of the belief; NaN where the filter has none.
    protection_m : (N,) array
        Protection levels; infinite where there is none for the risk, NaN of filters without any.
    unused : tuple of UnusedReading
        Every reading not used, and why.
    evidence : TrackEvidence or None
        Only of filters that hold probabilities.
    """

    crs: str
    filter: str
    start_utc_s: float
    time_s: Floats
    east_m: Floats
    north_m: Floats
    covariance_m2: Floats
    radii_m: Floats
    status: tuple[Status, ...]
    hypotheses: Ints
    mass_50m: Floats
    way_id: Ints
    way_probability: Floats
    reason: tuple[Reason, ...]
    radius_99_m: Floats
    protection_m: Floats
    unused: tuple[UnusedReading, ...] = ()
    evidence: TrackEvidence | None = None

    def __post_init__(self) -> None:
        faults = Faults()
        count = self.time_s.size
        for column in fields(self)[3:-2]:
            found = len(getattr(self, column.name))
            if found != count:
                faults.add(f"estimate, {column.name}", f"{count} epochs", found)
        if count and not np.all(np.isfinite(self.time_s)):
            faults.add("estimate, time_s", "finite seconds", "NaN or infinity")
        if count > 1 and np.any(np.diff(self.time_s) < 0):
            faults.add("estimate, time_s", "seconds in ascending order", "a step back")
        faults.raise_if_any(InputError)

    def __len__(self) -> int:
        return int(self.time_s.size)

    def fix(self, index: int) -> Fix:
        """Return one epoch."""
        return Fix(
            float(self.time_s[index]),
            float(self.east_m[index]),
            float(self.north_m[index]),
            self.covariance_m2[index],
            self.radii_m[index],
            self.status[index],
            int(self.hypotheses[index]),
            float(self.mass_50m[index]),
            int(self.way_id[index]),
            float(self.way_probability[index]),
            self.reason[index],
            float(self.radius_99_m[index]),
            float(self.protection_m[index]),
        )

    @property
    def converged_at(self) -> int | None:
        """Index of the first CONVERGED epoch, or None."""
        return next((i for i, s in enumerate(self.status) if s is Status.CONVERGED), None)

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row for each epoch, as in the Parquet file of a replay."""
        # A process that draws does without.
        import pandas as pd

        columns: dict[str, Any] = {
            "time_s": self.time_s,
            "east_m": self.east_m,
            "north_m": self.north_m,
            "var_east_m2": self.covariance_m2[:, 0, 0],
            "var_north_m2": self.covariance_m2[:, 1, 1],
            "cov_east_north_m2": self.covariance_m2[:, 0, 1],
            "radius_50_m": self.radii_m[:, 0],
            "radius_67_m": self.radii_m[:, 1],
            "radius_95_m": self.radii_m[:, 2],
            "radius_99_m": self.radius_99_m,
            "protection_m": self.protection_m,
            "status": list(map(str, self.status)),
            "hypotheses": self.hypotheses,
            "mass_50m": self.mass_50m,
            "way_id": self.way_id,
            "way_probability": self.way_probability,
            "reason": list(map(str, self.reason)),
        }
        if self.evidence is not None:
            columns |= {one.name: getattr(self.evidence, one.name) for one in fields(self.evidence)}
        return pd.DataFrame(columns)

    def to_geodataframe(self) -> gpd.GeoDataFrame:
        """Return the same with points in the CRS; epochs without a position are left out."""
        import geopandas as gpd

        table = self.to_dataframe()
        table = table[np.isfinite(table["east_m"])].reset_index(drop=True)
        points = gpd.points_from_xy(table["east_m"], table["north_m"])
        return gpd.GeoDataFrame(table, geometry=points, crs=self.crs)

    @classmethod
    def of_fixes(
        cls,
        crs: str,
        filter_name: str,
        fixes: Sequence[Fix],
        *,
        start_utc_s: float = float("nan"),
        unused: Sequence[UnusedReading] = (),
        evidence: TrackEvidence | None = None,
    ) -> TrackEstimate:
        """Put the fixes of a track together."""
        columns: dict[str, Any] = {
            one.name: [getattr(fix, one.name) for fix in fixes] for one in fields(Fix)
        }
        for name, values in columns.items():
            if name in ("status", "reason"):
                columns[name] = tuple(values)
            else:
                whole = name in ("hypotheses", "way_id")
                columns[name] = np.array(values, dtype=np.int64 if whole else np.float64)
        columns["covariance_m2"] = columns["covariance_m2"].reshape(-1, 2, 2)
        columns["radii_m"] = columns["radii_m"].reshape(-1, 3)
        return cls(
            crs=crs,
            filter=filter_name,
            start_utc_s=start_utc_s,
            **columns,
            unused=tuple(unused),
            evidence=evidence,
        )
