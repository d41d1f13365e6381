"""The Stanford diagram: errors against protection levels, with an alert limit.

A position may be used while its protection level is at most the alert limit. Each epoch falls into
one of five regions (Tossaint et al. 2007, *The Stanford - ESA integrity diagram*, Navigation 54(2),
after the diagram of the WAAS laboratory at Stanford):

==========================  =======================  ===========================================
Region                      Protection level         Error
==========================  =======================  ===========================================
``available``               at most the alert limit  at most the protection level
``misleading``              at most the alert limit  above the level, at most the alert limit
``hazardous``               at most the alert limit  above the alert limit
``unavailable``             above, or none           at most the protection level
``unavailable_misleading``  above                    above the protection level
==========================  =======================  ===========================================
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats, Ints
from mapfilter.options import Options, Positive, Probability
from mapfilter.positioning.integrity import DEFAULT_RISK

REGIONS = ("available", "misleading", "hazardous", "unavailable", "unavailable_misleading")
BINS = 100
"""Of errors and of levels, up to twice the alert limit; the last bin holds all beyond."""


@dataclass(frozen=True, slots=True)
class IntegrityOptions(Options):
    """Protection levels: their risk, and the error from which on a position is of no use.

    Parameters
    ----------
    risk : float
        Probability, at each epoch, that the error exceeds the protection level.
    alert_limit_m : float
        Positions are available while their protection level is at most this.
    """

    risk: Probability = DEFAULT_RISK
    alert_limit_m: Positive = 50.0


def stanford_regions(errors_m: ArrayLike, levels_m: ArrayLike, alert_limit_m: float) -> Ints:
    """Return the region of each epoch, as index into :data:`REGIONS`.

    Parameters
    ----------
    errors_m, levels_m : array_like, shape (N,)
        Errors, and protection levels; a level of NaN is none.

    Examples
    --------
    >>> errors_m, levels_m = [5.0, 30.0, 60.0, 5.0, 90.0], [20.0, 20.0, 20.0, 80.0, 80.0]
    >>> [REGIONS[region] for region in stanford_regions(errors_m, levels_m, 50.0)]
    ['available', 'misleading', 'hazardous', 'unavailable', 'unavailable_misleading']
    """
    errors, levels = np.asarray(errors_m, np.float64), np.asarray(levels_m, np.float64)
    levels = np.where(np.isnan(levels), np.inf, levels)
    usable, exceeded = levels <= alert_limit_m, errors > levels
    used = np.where(exceeded, np.where(errors > alert_limit_m, 2, 1), 0)
    return np.asarray(np.where(usable, used, np.where(exceeded, 4, 3)), dtype=np.int64)


@dataclass(frozen=True, slots=True)
class StanfordCounts:
    """Epochs in each region; all regions together are all epochs.

    Parameters
    ----------
    available, misleading, hazardous, unavailable, unavailable_misleading : int
        See :mod:`mapfilter.evaluation.stanford`.
    """

    available: int = 0
    misleading: int = 0
    hazardous: int = 0
    unavailable: int = 0
    unavailable_misleading: int = 0

    @property
    def epochs(self) -> int:
        """All epochs."""
        return sum(asdict(self).values())

    @property
    def exceeded(self) -> int:
        """Epochs whose error exceeded the protection level: the risk, times all, if it holds."""
        return self.misleading + self.hazardous + self.unavailable_misleading


def stanford_counts(
    errors_m: ArrayLike, levels_m: ArrayLike, alert_limit_m: float
) -> StanfordCounts:
    """Count the epochs in each region; those without an error are left out."""
    errors, levels = _known(errors_m, levels_m)
    regions = stanford_regions(errors, levels, alert_limit_m)
    return StanfordCounts(*np.bincount(regions, minlength=len(REGIONS)).tolist())


def stanford_bins(errors_m: ArrayLike, levels_m: ArrayLike, alert_limit_m: float) -> Ints:
    """Return the diagram's bins that hold any epoch, shape (K, 3): error, level, epochs.

    Bins have sides of a fiftieth of the alert limit; the regions' borders are between bins, but for
    the diagonal.
    """
    errors, levels = _known(errors_m, levels_m)
    side_m = 2 * alert_limit_m / BINS
    levels = np.where(np.isnan(levels), np.inf, levels)
    # A level that is the alert limit itself is still available.
    places = [
        np.clip(np.ceil(np.minimum(values / side_m, 2.0 * BINS)) - 1, 0, BINS - 1).astype(np.int64)
        for values in (errors, levels)
    ]
    found, counts = np.unique(places[0] * BINS + places[1], return_counts=True)
    return np.stack([found // BINS, found % BINS, counts], axis=1)


def _known(errors_m: ArrayLike, levels_m: ArrayLike) -> tuple[Floats, Floats]:
    errors, levels = np.asarray(errors_m, np.float64), np.asarray(levels_m, np.float64)
    known = np.isfinite(errors)
    return errors[known], levels[known]
