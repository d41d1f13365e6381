"""Timing advances and time differences of arrival as evidence of places.

Their errors last: readings in a row, some metres apart, count as one over the distance at which
errors part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, hypot, inf, isfinite, nan

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.filters.contract import Reason
from mapfilter.models.gaussian import GaussianTerms
from mapfilter.models.ranging import range_differences, timing_advances
from mapfilter.models.state import StateLayout
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.evidence import RadioReading
from mapfilter.positioning.epochs import Difference, Epoch
from mapfilter.positioning.estimate import UnusedReading
from mapfilter.positioning.gnss.options import TimingOptions

Timed = tuple[float, float]
"""Distance travelled when timing advances and differences were last used."""

NEVER: Timed = (-inf, -inf)


@dataclass(frozen=True, eq=False)
class TimingEvidence:
    """What distances, or differences of them, say of places.

    Parameters
    ----------
    model : GaussianTerms
        Of east and north in the frame of the hypotheses.
    reading_m : (m,) array
    weight : float
        How much of it is new, 0 to 1.
    clip_sd : float
    """

    model: GaussianTerms
    reading_m: Floats
    weight: float
    clip_sd: float

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return it for each hypothesis; outliers count no more than readings at the clip."""
        off = self.reading_m - self.model.mean(state[:2].T.astype(np.float64))
        white = np.linalg.solve(np.linalg.cholesky(self.model.noise), off.T)
        square = np.minimum(np.sum(white**2, axis=0), self.clip_sd**2 * self.reading_m.size)
        return np.asarray(-0.5 * self.weight * square)

    @property
    def expected(self) -> float:
        """Log-likelihood on average where the place is right."""
        return -0.5 * self.weight * self.reading_m.size


def with_timing(
    area: AreaMap,
    options: TimingOptions,
    epoch: Epoch,
    reading: RadioReading | None,
    timed: Timed,
    travelled_m: float,
    *,
    advances: bool = True,
) -> tuple[RadioReading | None, Timed, list[UnusedReading]]:
    """Add timing advances and time differences of an epoch to its report.

    Parameters
    ----------
    area : AreaMap
        Knows the sites.
    options : TimingOptions
    epoch : Epoch
    reading : RadioReading or None
        What else the epoch's report says, if anything.
    timed : Timed
    travelled_m : float
    advances : bool
        Whether timing advances are compared with the sites' distances.

    Returns
    -------
    reading : RadioReading or None
    timed : Timed
    unused : list of UnusedReading
    """
    unused: list[UnusedReading] = []
    found: list[TimingEvidence] = []
    share = _new(travelled_m - timed[0], options.advance_memory_m)
    if advances and share > 0:
        told, missing = _advances(area, options, epoch, share)
        found, unused = found + told, unused + missing
        timed = (travelled_m if told else timed[0], timed[1])
    share = _new(travelled_m - timed[1], options.difference_memory_m)
    if epoch.differences and share > 0:
        told, missing = _differences(area, options, epoch, share)
        found, unused = found + told, unused + missing
        timed = (timed[0], travelled_m if told else timed[1])
    if not found:
        return reading, timed, unused
    reading = reading or RadioReading()
    expected = reading.expected + sum(one.expected for one in found)
    return replace(reading, also=(*reading.also, *found), expected=expected), timed, unused


def _new(gone_m: float, memory_m: float) -> float:
    return 1.0 - exp(-2.0 * gone_m / memory_m) if isfinite(gone_m) else 1.0


def _layout(options: TimingOptions) -> StateLayout:
    return StateLayout(2, 0, 1, height_m=options.height_m)


def _site(area: AreaMap, cell: str) -> list[float]:
    (east, north, up), (west, south) = area.sites[cell], area.origin_m
    return [east - west, north - south, up]


def _advances(
    area: AreaMap, options: TimingOptions, epoch: Epoch, share: float
) -> tuple[list[TimingEvidence], list[UnusedReading]]:
    rows = [row for row in epoch.heard if row.cell is not None and isfinite(row.timing_advance)]
    known = [row for row in rows if row.cell in area.sites]
    unused = [
        UnusedReading(epoch.time_s, "ta", str(row.cell), Reason.UNKNOWN_CELL)
        for row in rows
        if row.cell not in area.sites
    ]
    if not known:
        return [], unused
    sigma_m = hypot(options.advance_sd_m, options.step_m / 12**0.5)
    sites = [_site(area, str(row.cell)) for row in known]
    reading = np.array([(row.timing_advance + 0.5) * options.step_m for row in known])
    model = timing_advances(_layout(options), sites, sigma_m)
    return [TimingEvidence(model, reading, share, options.clip_sd)], unused


def _differences(
    area: AreaMap, options: TimingOptions, epoch: Epoch, share: float
) -> tuple[list[TimingEvidence], list[UnusedReading]]:
    """Take differences to one reference together, as they share its error."""
    unused: list[UnusedReading] = []
    by_reference: dict[str, dict[str, Difference]] = {}
    for row in epoch.differences:
        if not isfinite(row.difference_m):
            continue
        of = by_reference.setdefault(row.reference, {})
        strange = [cell for cell in (row.cell, row.reference) if cell not in area.sites]
        if strange:
            unused.append(UnusedReading(epoch.time_s, "tdoa", strange[0], Reason.UNKNOWN_CELL))
        elif row.cell in of:
            unused.append(UnusedReading(epoch.time_s, "tdoa", row.cell, Reason.SECOND_READING))
        elif _site(area, row.cell) != _site(area, row.reference):
            of[row.cell] = row
    found = []
    for reference, rows in by_reference.items():
        if not rows:
            continue
        own_m = next((one.reference_sigma_m for one in rows.values()), nan)
        sigma_m = [own_m, *(one.sigma_m for one in rows.values())]
        usual = options.difference_sd_m
        model = range_differences(
            _layout(options),
            [_site(area, reference), *(_site(area, cell) for cell in rows)],
            [value if isfinite(value) else usual for value in sigma_m],
        )
        reading = np.array([one.difference_m for one in rows.values()])
        found.append(TimingEvidence(model, reading, share, options.clip_sd))
    return found, unused


def is_timed(epoch: Epoch) -> bool:
    """Tell whether an epoch has anything to do with times of arrival."""
    return bool(epoch.differences) or any(isfinite(row.timing_advance) for row in epoch.heard)
