"""What reports say of the cells that are not in them: these were weaker there than those that are.

A phone reports its serving cell, or the strongest ones. Of a cell that is not among them the level
is not known, but it has a bound: the weakest level of the report. The bound is no strict one, as
phones stay with a cell, and bands have priorities, so it is for places far from a cell's readings.
Levels of another technology are another quantity, and no bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from mapfilter._types import Floats
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.residual_field import SOFTENING_M

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_REPORTS = 8


@dataclass(frozen=True, eq=False)
class WeakestReported:
    """Weakest level of each report.

    Parameters
    ----------
    places : scipy.spatial.cKDTree
        Of the reports.
    level_dbm : numpy.ndarray, shape (N,)
        Weakest level of each.
    """

    places: cKDTree
    level_dbm: Floats

    @classmethod
    def of(cls, measurements: Measurements) -> WeakestReported:
        """Return those of the reports of a survey."""
        from scipy.spatial import cKDTree

        report = measurements.report
        order = np.lexsort((measurements.level_dbm, report))
        first = order[np.unique(report[order], return_index=True)[1]]
        places = np.column_stack([measurements.east_m, measurements.north_m])[first]
        return cls(cKDTree(places), measurements.level_dbm[first])

    def bound_dbm(self, east_m: Floats, north_m: Floats, within_m: float) -> Floats:
        """Return the weighted mean of the nearest reports at places; infinite beyond all reports.

        Of the eight nearest within ``within_m``, with the weight 1/(distance + 20 m).
        """
        count = min(_REPORTS, len(self.level_dbm))
        distance_m, index = self.places.query(
            np.column_stack([east_m, north_m]),
            k=np.arange(1, count + 1),
            # The bound itself must still count.
            distance_upper_bound=np.nextafter(within_m, np.inf),
        )
        found = np.isfinite(distance_m)
        weight = 1 / (distance_m + SOFTENING_M)
        total = (weight * self.level_dbm[np.where(found, index, 0)]).sum(axis=1)
        some = found[:, 0]
        bound_dbm = np.full(len(total), np.inf)
        bound_dbm[some] = total[some] / weight[some].sum(axis=1)
        return bound_dbm


def scale_of(technology: str | None) -> str:
    """Return by which scale levels of a technology can be compared, "" where it is not known.

    RSRP is that of LTE and NR: logs of 5G over an anchor name the LTE cell NR.
    """
    return "LTE" if technology == "NR" else technology or ""


def weakest_reported(measurements: Measurements) -> dict[str, WeakestReported]:
    """Return the weakest levels of the reports by :func:`scale_of` the technology."""
    known = measurements.technologies
    kinds = [scale_of(known.get(cell_id)) for cell_id in measurements.cell_ids]
    of_row = np.array(kinds, dtype=np.str_)[measurements.cell]
    return {
        kind: WeakestReported.of(measurements.where(of_row == kind))
        for kind in np.unique(of_row).tolist()
    }


def mean_below(level_dbm: Floats, bound_dbm: Floats, deviation_db: float) -> Floats:
    """Return the means of normal levels of which it is known that they are less than a bound.

    ``level_dbm`` is their mean without that; where it exceeds the bound it is taken as the bound.
    An infinite bound changes nothing.
    """
    from scipy.special import ndtr

    mean_dbm = np.minimum(level_dbm, bound_dbm)
    above = (bound_dbm - mean_dbm) / deviation_db
    density = np.exp(-(above**2) / 2) / np.sqrt(2 * pi)
    return np.asarray(mean_dbm - deviation_db * density / ndtr(above))
