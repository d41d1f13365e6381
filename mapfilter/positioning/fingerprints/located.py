"""What single reports gave: positions with radii, scores, and the errors of left-out ones."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from mapfilter._same import EqualByContent
from mapfilter._types import Floats, Ints
from mapfilter.geodesy import unproject
from mapfilter.positioning.fingerprints.options import Method, method_name
from mapfilter.positioning.place_tables import with_points

if TYPE_CHECKING:
    import geopandas as gpd

LOCATED, NOTHING, UNKNOWN = "", "nothing received", "no transmitter of the database"
"""Why a report has no position; empty where it has one."""


@dataclass(frozen=True)
class Validation:
    """Errors of a method where a part of the database was left out in turn.

    Parameters
    ----------
    blocks : str
        What was left out: "logs", or "squares of N m"; or how reports were drawn.
    folds, reports : int
        Times that something was left out, and reports located.
    error_mean_m, error_median_m, error_95_m : float
    within_50, within_67, within_95 : float
        Shares of the reports within the radii, each calibrated without its own block.
    """

    method: str
    blocks: str
    folds: int
    reports: int
    error_mean_m: float
    error_median_m: float
    error_95_m: float
    within_50: float
    within_67: float
    within_95: float


@dataclass(frozen=True, eq=False, repr=False)
class LocatedReports(EqualByContent):
    """Positions of R reports, each from that report alone.

    Parameters
    ----------
    east_m, north_m : ndarray, shape (R,)
        NaN where there is no position.
    radii_m : ndarray, shape (R, 3)
        Radii of the circles that hold 50, 67 and 95 % of the true positions; NaN where they are
        not calibrated.
    known, unknown : ndarray of int64, shape (R,)
        Transmitters received that the database has, and has not.
    reason : tuple of str
        Why there is no position, empty where there is one.
    error_m : ndarray, shape (R,)
        Distance to the true position; NaN where that is unknown.
    """

    crs: str
    method: Method
    time_s: Floats
    east_m: Floats
    north_m: Floats
    radii_m: Floats
    known: Ints
    unknown: Ints
    reason: tuple[str, ...]
    error_m: Floats
    validations: tuple[Validation, ...] = ()
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        located = int(np.isfinite(self.east_m).sum())
        scored = self.error_m[np.isfinite(self.error_m)]
        score = ""
        if scored.size:
            score = f", {scored.mean():.1f} m off on average, median {np.median(scored):.1f} m"
        return f"LocatedReports by {method_name(self.method)}: {located} of {len(self)}{score}"

    def _repr_html_(self) -> str:
        """Return the summary and the last reports, as notebooks show them."""
        return f"<p>{escape(repr(self))}</p>{self.to_dataframe().tail().to_html()}"

    def to_geodataframe(self) -> gpd.GeoDataFrame:
        """Return the same with points in the CRS; reports without a position are left out."""
        return with_points(self.to_dataframe(), self.crs)

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row for each report: position, radii (m), transmitters, reason, error (m)."""
        lon_deg, lat_deg = unproject(self.crs, self.east_m, self.north_m)
        return pd.DataFrame(
            {
                "time_s": self.time_s,
                "east_m": self.east_m,
                "north_m": self.north_m,
                "lon_deg": np.where(np.isfinite(self.east_m), lon_deg, nan),
                "lat_deg": np.where(np.isfinite(self.east_m), lat_deg, nan),
                "radius_50_m": self.radii_m[:, 0],
                "radius_67_m": self.radii_m[:, 1],
                "radius_95_m": self.radii_m[:, 2],
                "known": self.known,
                "unknown": self.unknown,
                "reason": self.reason,
                "error_m": self.error_m,
            }
        )


def figures_of(located: LocatedReports) -> dict[str, Any]:
    """Return counts, and the score where true positions are known."""
    error_m = located.error_m
    scored = np.isfinite(error_m)
    reasons = [reason for reason in located.reason if reason]
    found: dict[str, Any] = {
        "method": method_name(located.method),
        "reports": len(located),
        "located": int(np.isfinite(located.east_m).sum()),
        "not_located": {reason: reasons.count(reason) for reason in sorted(set(reasons))},
        "unknown_transmitters": int(located.unknown.sum()),
    }
    if scored.any():
        within = np.mean(error_m[scored, np.newaxis] <= located.radii_m[scored], axis=0)
        calibrated = np.isfinite(located.radii_m[scored]).all()
        found |= {
            "scored": int(scored.sum()),
            "error_mean_m": float(error_m[scored].mean()),
            "error_median_m": float(np.median(error_m[scored])),
            "error_67_m": float(np.quantile(error_m[scored], 0.67)),
            "error_95_m": float(np.quantile(error_m[scored], 0.95)),
        }
        for level, share in zip((50, 67, 95), within.tolist(), strict=True):
            found[f"within_{level}"] = share if calibrated else nan
    found["validations"] = located.validations
    return found
