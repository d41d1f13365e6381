"""What a report says, made ready for the filter: which cells, which levels, and how much it counts.

Errors of a prediction last for tens of metres, so that a report says little new when one has hardly
moved since the last one. A report is used when ``spacing_m`` have been travelled since; serving
cells count by the metre, and levels by what is new in them
(see :mod:`mapfilter.models.fingerprint`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, exp, inf, isfinite, nan, sin, sqrt
from typing import Protocol

import numpy as np

from mapfilter._types import Floats, Floats32, Ints32
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.models.fingerprint import BoundReading, LevelErrors, LevelReading, ServingWeights
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.tracks.schema import SERVING


@dataclass(frozen=True, eq=False)
class RadioHistory:
    """What is kept from one report to the next.

    Parameters
    ----------
    travelled_m, east_m, north_m : float
        By dead reckoning since the start; east and north in the frame of its headings.
    used_at_m : float
        Distance at the last report that was used; minus infinity before the first.
    back_east_m, back_north_m : float
        Displacement since then.
    level_dbm, heard_at_m : ndarray, shape (C,)
        Level of each cell when it was last heard inside the scale, and the distance then.
    """

    level_dbm: Floats
    heard_at_m: Floats
    travelled_m: float = 0.0
    east_m: float = 0.0
    north_m: float = 0.0
    used_at_m: float = -inf
    back_east_m: float = 0.0
    back_north_m: float = 0.0

    @classmethod
    def empty(cls, cells: int) -> RadioHistory:
        """Return the memory of one who has heard nothing."""
        return cls(np.full(cells, nan), np.full(cells, -inf))

    def moved(self, step: MotionStep) -> RadioHistory:
        """Return the memory after a step."""
        if not isfinite(step.step_m):
            return self
        heading = step.heading_rad if isfinite(step.heading_rad) else 0.0
        east_m, north_m = step.step_m * cos(heading), step.step_m * sin(heading)
        return RadioHistory(
            self.level_dbm,
            self.heard_at_m,
            self.travelled_m + abs(step.step_m),
            self.east_m + east_m,
            self.north_m + north_m,
            self.used_at_m,
            self.back_east_m + east_m,
            self.back_north_m + north_m,
        )


class PlaceEvidence(Protocol):
    """A log-likelihood over hypotheses."""

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return it for each of the hypotheses, shape (N,), or one number for all of them."""


@dataclass(frozen=True, eq=False)
class Given:
    """A log-likelihood that is known already.

    Parameters
    ----------
    value : (N,) array or (1,) array
        For the hypotheses of the belief that it was made for, or one for all.
    """

    value: Floats

    def log_likelihood(self, state: Floats32) -> Floats:  # noqa: ARG002
        """Return it."""
        return self.value


_FIRST_GRAIN_M = 5.0
_SERVING_NATS = 0.5
_MAP_NATS_PER_M = 0.03
"""Less log probability than none, on average: of a serving cell at full weight, of the map."""


@dataclass(frozen=True, slots=True)
class EvidenceOptions:
    """How much reports count.

    Parameters
    ----------
    serving : ServingWeights
    levels : LevelErrors
    spacing_m : float
        Travelled between two reports that are used.
    first_m : float
        A first report counts as if so many metres had been travelled.
    use_levels : bool
        Whether levels are used at all, or serving cells only.
    """

    serving: ServingWeights = field(default_factory=ServingWeights)
    levels: LevelErrors = field(default_factory=LevelErrors)
    spacing_m: float = 5.0
    first_m: float = 25.0
    use_levels: bool = True


@dataclass(frozen=True, slots=True)
class RadioReading:
    """One report, as the filter's model takes it.

    Parameters
    ----------
    serving : int
        Band of the serving cell; -1 where none counts.
    serving_weight : float
    levels : LevelReading or None
    bounds : tuple of BoundReading
        Levels at an end of the scale, and those of several candidates.
    fix : GnssFix or None
    expected : float
        Log probability on average where the belief is right.
    length_m : float
        Travelled since the last report that was used.
    timing_advance : float
        Of the serving cell, in steps; NaN where it was not told. Only models that know what is
        usual there take it.
    also : tuple of PlaceEvidence
        What else tells of places: satellites, times of arrival.
    """

    serving: int = -1
    serving_weight: float = 0.0
    levels: LevelReading | None = None
    bounds: tuple[BoundReading, ...] = ()
    fix: GnssFix | None = None
    expected: float = 0.0
    length_m: float = 0.0
    timing_advance: float = nan
    also: tuple[PlaceEvidence, ...] = ()


Unplaced = tuple[ReportRow, Reason]


def reading_of(
    area: AreaMap,
    options: EvidenceOptions,
    memory: RadioHistory,
    epoch: Epoch,
    particle_spacing_m: float = _FIRST_GRAIN_M,
) -> tuple[RadioHistory, RadioReading | None, Reason, list[Unplaced]]:
    """Make one report ready.

    Parameters
    ----------
    area : AreaMap
    options : EvidenceOptions
    memory : RadioHistory
    epoch : Epoch
    particle_spacing_m : float
        How far the hypotheses nearest to the truth may lie beside it.

    Returns
    -------
    memory : RadioHistory
    reading : RadioReading or None
        None where nothing in the report counts.
    reason : Reason
        Whether the serving cell was used, or why not.
    unplaced : list of (ReportRow, Reason)
        Rows that nobody can place; told, and kept out.
    """
    since_m = min(memory.travelled_m - memory.used_at_m, 1e9)
    first = not isfinite(memory.used_at_m)
    serving, reason, unplaced = _serving(area, epoch)
    due = first or since_m >= options.spacing_m
    if not due or (not epoch.heard):
        fix_only = RadioReading(fix=epoch.fix) if epoch.fix is not None else None
        if epoch.heard and reason is Reason.USED:
            reason = Reason.NOT_MOVED_ENOUGH
        return memory, fix_only, reason, unplaced
    counted_m = options.first_m if first else min(since_m, options.first_m)
    levels: LevelReading | None = None
    bounds: tuple[BoundReading, ...] = ()
    level_dbm, heard_at_m = memory.level_dbm, memory.heard_at_m
    if options.use_levels:
        inside, others, unknown = _placed(area, epoch, serving)
        unplaced += unknown
        bounds = tuple(_bound(options, band, row, counted_m) for band, row in others)
        if inside:
            levels = _levels(options, memory, inside, particle_spacing_m)
            level_dbm, heard_at_m = level_dbm.copy(), heard_at_m.copy()
            bands = list(inside)
            level_dbm[bands] = list(inside.values())
            heard_at_m[bands] = memory.travelled_m
    if serving < 0 and levels is None and not bounds:
        fix_only = RadioReading(fix=epoch.fix) if epoch.fix is not None else None
        return memory, fix_only, reason, unplaced
    weight = counted_m * options.serving.weight_per_m
    surprise = _SERVING_NATS * weight * (serving >= 0) + _MAP_NATS_PER_M * min(since_m, 100.0)
    by_levels = 0.0
    if levels is not None:
        by_levels = 0.5 * levels.weight * float(np.sum(_news(options, memory, levels.cell)))
    reading = RadioReading(
        serving,
        weight,
        levels,
        bounds,
        epoch.fix,
        -surprise - by_levels,
        0.0 if first else since_m,
        _timing_advance(epoch) if serving >= 0 else nan,
    )
    memory = replace(
        memory,
        level_dbm=level_dbm,
        heard_at_m=heard_at_m,
        used_at_m=memory.travelled_m,
        back_east_m=0.0,
        back_north_m=0.0,
    )
    return memory, reading, reason, unplaced


def _serving(area: AreaMap, epoch: Epoch) -> tuple[int, Reason, list[Unplaced]]:
    """Return the band of the serving cell, or why there is none."""
    named = [row for row in epoch.heard if row.role == SERVING and row.cell is not None]
    if not named:
        return -1, Reason.NO_SERVING_CELL if epoch.heard else Reason.NO_READING, []
    more = [(row, Reason.SECOND_SERVING_CELL) for row in named[1:]]
    cell = str(named[0].cell)
    if cell in area.band_of:
        return area.band_of[cell], Reason.USED, more
    known = cell in area.known_ids
    return -1, Reason.NO_POINTS_IN_CELL if known else Reason.UNKNOWN_CELL, more


def _timing_advance(epoch: Epoch) -> float:
    return next((row.timing_advance for row in epoch.heard if row.role == SERVING), nan)


def _placed(
    area: AreaMap, epoch: Epoch, serving: int
) -> tuple[dict[int, float], list[tuple[tuple[int, ...], ReportRow]], list[Unplaced]]:
    """Sort a report's levels: those of one cell inside the scale, others, and those of nobody."""
    inside: dict[int, float] = {}
    others: list[tuple[tuple[int, ...], ReportRow]] = []
    unplaced: list[Unplaced] = []
    served = False
    for row in epoch.heard:
        if row.role == SERVING:
            # A second serving cell is told of already; an unknown one, too.
            bands: tuple[int, ...] = () if served or serving < 0 else (serving,)
            served = True
            if not bands:
                continue
        elif row.cell is not None:
            band = area.band_of.get(row.cell)
            bands = (band,) if band is not None else ()
        elif row.arfcn is not None:
            found = area.carriers.get((row.arfcn, -1 if row.bsic is None else row.bsic), ())
            bands = tuple(b for b in found if b != serving)
        else:
            bands = ()
        if not bands:
            unplaced.append((row, Reason.UNKNOWN_CELL))
        elif not isfinite(row.level_dbm):
            continue
        elif len(bands) == 1 and row.censored == 0:
            inside.setdefault(bands[0], row.level_dbm)
        else:
            others.append((bands, row))
    return inside, others, unplaced


def _levels(
    options: EvidenceOptions,
    memory: RadioHistory,
    inside: dict[int, float],
    particle_spacing_m: float,
) -> LevelReading:
    errors = options.levels
    count = len(inside)
    cell = np.fromiter(inside, np.int32, count)
    level = np.fromiter(inside.values(), np.float64, count)
    away_m = memory.travelled_m - memory.heard_at_m[cell]
    together = (memory.heard_at_m[cell] == memory.used_at_m) & isfinite(memory.used_at_m)
    correlation = np.exp(-away_m / errors.correlation_m)
    rho = np.where(together, correlation, 0.0)
    before = np.where(together, memory.level_dbm[cell], 0.0)
    # A level that was missing from the last report alone is no news of a whole new error.
    news = np.where(together, 1.0, 1.0 - correlation**2)
    lasting = errors.sd_db**2
    white = errors.measurement_db**2 + errors.offset_variance_db2(particle_spacing_m)
    variance = lasting * (1 - rho**2) + white * (1 + rho**2)
    return LevelReading(
        cell,
        (level - rho * before).astype(np.float32),
        rho.astype(np.float32),
        np.sqrt(news / variance).astype(np.float32),
        errors.common,
        errors.weight,
        errors.clip_sd,
        memory.back_east_m,
        memory.back_north_m,
    )


def _news(options: EvidenceOptions, memory: RadioHistory, cell: Ints32) -> Floats:
    """Return how much of each level is new: 1 where it was in the last report, or never heard."""
    together = memory.heard_at_m[cell] == memory.used_at_m
    away_m = memory.travelled_m - memory.heard_at_m[cell]
    correlation = np.exp(-away_m / options.levels.correlation_m)
    return np.where(together, 1.0, 1.0 - correlation**2)


def _bound(
    options: EvidenceOptions, bands: tuple[int, ...], row: ReportRow, counted_m: float
) -> BoundReading:
    errors = options.levels
    weight = errors.weight * (1.0 - exp(-2.0 * counted_m / errors.correlation_m))
    return BoundReading(
        np.array(bands, dtype=np.int32),
        row.level_dbm,
        row.censored,
        sqrt(errors.sd_db**2 + errors.measurement_db**2),
        weight,
    )
