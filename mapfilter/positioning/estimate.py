"""Estimates of a track: the fixes of its epochs, together a :class:`TrackEstimate`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from mapfilter._same import EqualByContent
from mapfilter._types import Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.place_tables import with_points
from mapfilter.positioning.step_output import Fix, UnusedReading

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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

    def __repr__(self) -> str:
        return f"TrackEvidence({number_of(self.entropy_bits.size, 'epoch')})"


@dataclass(frozen=True, eq=False, repr=False)
class TrackEstimate(EqualByContent):
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

    def __repr__(self) -> str:
        # Arrays of a thousand epochs would fill pages.
        return f"TrackEstimate({self.filter}, {self.summary}, {self.crs})"

    @property
    def summary(self) -> str:
        """Number of epochs, when it converged, and the last status."""
        epochs = number_of(len(self), "epoch")
        if not len(self):
            return epochs
        first = self.converged_at
        when = "never converged" if first is None else f"converged at {self.time_s[first]:g} s"
        return f"{epochs}, {when}, {self.status[-1]} at the end"

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
        return with_points(self.to_dataframe(), self.crs)

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
