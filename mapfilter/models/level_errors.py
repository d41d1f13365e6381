"""Errors of predicted levels that last along the path, summed out for each hypothesis.

A level received is the predicted one plus four errors: *slow* and *fast* ones of the cell's
prediction, Gauss-Markov processes along the path (Gudmundson 1991), one of the *device* that all
cells share, and white noise. Slow and fast errors of cells of one site, and of all cells, are
correlated. Given a hypothesis's path these errors are Gaussian, so a Kalman filter estimates them
and the likelihood of a level is that of its innovation: a Rao-Blackwellised particle filter (Doucet
et al. 2000). Its covariance does not depend on the levels and is shared by all hypotheses, see
:mod:`mapfilter.models.level_memory`; the means and the probability of each cell's fault are those
of a hypothesis.

A *fault* of a cell (switched off, moved, rotated, or something else that the prediction does not
know) is a state that lasts for hundreds of metres: its levels then say nothing of the position. The
likelihood of a level is the mixture over both, and the log odds of the fault are kept for each
hypothesis and cell.

A cell that the prediction expects, and that is absent from a report although weaker ones are in it,
is evidence, too: its level is below that of the weakest one reported.

Where the prediction changes much from pixel to pixel, a hypothesis a few metres beside the true
position expects another level; the local standard deviation of the prediction is added to that of
the innovation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats32, Ints32
from mapfilter.errors import Faults
from mapfilter.options import NotNegative, Options, Positive, Probability, Share

_ROUGHNESS_M = 35.0


@dataclass(frozen=True, slots=True)
class LevelErrors(Options):
    """How levels differ from their prediction.

    Parameters
    ----------
    slow_db, slow_m : float
        Standard deviation of the slow error, and the distance after which its correlation is 1/e.
    fast_db, fast_m : float
        The same of the fast error.
    white_db : float
        Standard deviation of the independent error of each level.
    device_db : float
        Standard deviation of the device's error, equal for all cells.
    site_share, common_share : float
        Correlation of the errors of cells of one site beyond that of all cells, and of all cells.
    roughness : float
        Share of the local variance of the prediction that is added.
    fault_probability : float
        Share of cells that the prediction is wrong about.
    fault_m : float
        Distance after which a fault may have ended or begun.
    absent_db : float
        Further standard deviation of the level of a cell that is absent from a report.
    weight : float
        Exponent of the likelihood; below 1, as real errors come in bursts.
    tracking_share : float
        Share of this exponent where a position is tracked: dead reckoning and the map know more
        than levels there, whose errors along two ways differ for hundreds of metres.
    """

    slow_db: NotNegative = 7.0
    slow_m: Positive = 200.0
    fast_db: NotNegative = 4.0
    fast_m: Positive = 20.0
    white_db: Positive = 3.3
    device_db: NotNegative = 5.0
    site_share: Share = 0.6
    common_share: Share = 0.2
    roughness: NotNegative = 1.0
    fault_probability: Probability = 0.06
    fault_m: Positive = 300.0
    absent_db: NotNegative = 3.0
    weight: Share = 0.35
    tracking_share: Share = 0.3

    def check(self, faults: Faults) -> None:
        """Add shares that leave no error of a cell's own."""
        if self.site_share + self.common_share >= 1:
            where = "LevelErrors, site_share and common_share"
            found = f"{self.site_share} and {self.common_share}"
            faults.add(where, "site_share + common_share < 1", found)

    @property
    def total_db(self) -> float:
        """Standard deviation of a first level without the device's error."""
        return float(np.hypot(np.hypot(self.slow_db, self.fast_db), self.white_db))

    @property
    def fault_log_odds(self) -> float:
        """Log odds of a fault before anything is known."""
        return log(self.fault_probability / (1 - self.fault_probability))


class LevelReport(NamedTuple):
    """The levels of one report.

    Parameters
    ----------
    cell : ndarray of int32, shape (K,)
        Bands of the cells, each once.
    level_dbm : ndarray of float32, shape (K,)
        Their levels.
    absent : ndarray of int32, shape (J,)
        Bands of cells that would be in the report if they were stronger than ``limit_dbm``.
    limit_dbm : ndarray of float32, shape (J,)
        Weakest level that would be reported of each.
    offset_db : float
        Standard deviation that is added as hypotheses lie beside the true position.
    """

    cell: Ints32
    level_dbm: Floats32
    absent: Ints32
    limit_dbm: Floats32
    offset_db: float

    def with_absent(self, some: Sequence[int]) -> LevelReport:
        """Return the report with some of the absent cells only, by their places."""
        chosen = np.asarray(some, dtype=np.intp)
        return self._replace(absent=self.absent[chosen], limit_dbm=self.limit_dbm[chosen])


def roughness_px(resolution_m: float) -> int:
    """Return the side of the square of :func:`roughness`, pixels."""
    return max(2 * round(_ROUGHNESS_M / resolution_m / 2) + 1, 3)


def roughness(level_dbm: Floats32, resolution_m: float) -> Floats32:
    """Return the local standard deviation of predicted levels, (rows, cols, C), in dB.

    It is that of a square of 45 to 50 m at pixels of 5 to 10 m, and of 3 x 3 pixels at least.
    """
    from scipy.ndimage import uniform_filter

    size = roughness_px(resolution_m)
    found = np.empty(level_dbm.shape, dtype=np.float32)
    for band in range(level_dbm.shape[2]):
        level = level_dbm[..., band].astype(np.float64)
        mean = uniform_filter(level, size)
        found[..., band] = np.sqrt(np.maximum(uniform_filter(level**2, size) - mean**2, 0.0))
    return found
