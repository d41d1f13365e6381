"""Hypotheses of one cell: as it should be, offset, dead, turned, moved; and their evidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Literal

import numpy as np

from mapfilter._same import EqualByValue
from mapfilter._types import Floats, Ints
from mapfilter.learning.likelihood import (
    OFFSETS_DB,
    LevelNoise,
    excess_db,
    log_likelihoods,
    log_sum,
    marginal,
    posterior_offset,
)
from mapfilter.learning.offset_sums import OffsetSums
from mapfilter.learning.patterns import Patterns, bearing_places
from mapfilter.learning.visits import Visits

FaultKind = Literal["offset", "dead", "moved", "turned", "rotated", "swapped"]
StateKind = Literal["fine", "offset", "dead", "moved", "turned", "rotated", "swapped"]

PRIOR: Mapping[str, float] = MappingProxyType(
    {
        "offset": 0.05,
        "dead": 0.02,
        "moved": 0.01,
        "turned": 0.01,
        "rotated": 0.02,
        "swapped": 0.02,
    }
)
"""Probability of each fault of a cell, or of a mast, before any journey."""
TURNS_DEG = tuple(float(turn) for turn in range(30, 360, 30))
_MOVED_REACH_M, _MOVED_STEP_M, _MOVED_LEAST_M = 600.0, 75.0, 120.0
_COARSE_DB: Floats = np.arange(-24.0, 24.5, 4.0)
_VISITS_AT_ONCE = 1 << 13
"""Of several places: more take more memory, and no less time each."""


@dataclass(frozen=True, eq=False)
class Explanation(EqualByValue):
    """What one hypothesis says of a cell.

    Parameters
    ----------
    kind : str
        ``fine`` or a fault.
    log_evidence : float
        Of the cell's visits.
    expected : (N,) array
        Levels of the cell's visits, without any offset.
    offset_db : float
        Of the cell, beside the prediction under this hypothesis.
    value : float
        Degrees turned, or metres moved; NaN where it has none.
    by_journey, unshifted : (journeys,) arrays
        Log-likelihood of each journey's visits at that offset, and without any.
    """

    kind: StateKind
    log_evidence: float
    expected: Floats
    offset_db: float
    offset_sd_db: float
    by_journey: Floats
    unshifted: Floats
    value: float = float("nan")
    place_m: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class Scene:
    """The visits, where they were, and what is predicted there.

    Parameters
    ----------
    place : (N,) array of int64
        Row of each visit in the patterns.
    weight : (N,) array
        How much a visit counts, that of its journey included.
    shift_db : (N,) array
        What is added to the prediction: the phone's offset, and the mean error of the class.
    look_far : bool
        Whether other places of cells are tried, which takes longest.
    """

    visits: Visits
    patterns: Patterns
    place: Ints
    weight: Floats
    shift_db: Floats
    noise: LevelNoise
    journeys: int
    look_far: bool = True

    @cached_property
    def sums(self) -> OffsetSums:
        """Sums of log-likelihoods for each offset of a cell."""
        return OffsetSums(self.noise.sd_db, OFFSETS_DB)

    @cached_property
    def coarse_sums(self) -> OffsetSums:
        """The same for few offsets, by which many places are compared."""
        return OffsetSums(self.noise.sd_db, _COARSE_DB)


class CellEvidence:
    """The hypotheses of one cell, each computed once."""

    def __init__(self, scene: Scene, cell: int) -> None:
        self.scene, self.cell = scene, cell
        self.own = np.flatnonzero(scene.visits.cell == cell)
        self.visits = scene.visits.where(self.own)
        self.place = scene.place[self.own]
        self.weight, self.shift = scene.weight[self.own], scene.shift_db[self.own]
        self._known: dict[tuple[float, int], tuple[Explanation, Explanation]] = {}

    @property
    def planned_deg(self) -> float | None:
        """Azimuth by the plan; None of a cell that is alike all around."""
        cell = self.scene.patterns.plan.cells[self.cell]
        return None if cell.antenna == "omni" else cell.azimuth_deg

    def fine(self, turn_deg: float = 0.0, other: int = -1) -> Explanation:
        """Return the usual state: turned by an angle, or with the levels of another cell."""
        return self._of(turn_deg, other)[0]

    def offset(self, turn_deg: float = 0.0, other: int = -1) -> Explanation:
        """Return the same with an offset that is a fault."""
        return self._of(turn_deg, other)[1]

    def mixed(self, turn_deg: float = 0.0, other: int = -1) -> float:
        """Return the evidence of a pattern, with or without an offset."""
        p = PRIOR["offset"]
        fine, offset = self._of(turn_deg, other)
        return float(
            np.logaddexp(np.log1p(-p) + fine.log_evidence, np.log(p) + offset.log_evidence)
        )

    def dead(self) -> Explanation | None:
        """Return that the cell is not on air; None where it was received."""
        if not len(self.visits) or self.visits.received.any():
            return None
        nothing = np.full(len(self.visits), np.nan)
        zero = np.zeros(self.scene.journeys)
        return Explanation("dead", 0.0, nothing, 0.0, np.nan, zero, zero)

    def moved(self) -> Explanation | None:
        """Return the best other place, with the evidence of all of them."""
        if not self.scene.look_far or self.visits.received.sum() < 5:
            return None
        scene, patterns = self.scene, self.scene.patterns
        one = patterns.plan.cells[self.cell]
        places = bearing_places(patterns, _MOVED_STEP_M, _MOVED_REACH_M, self.cell)
        away = np.hypot(places[:, 0] - one.east_m, places[:, 1] - one.north_m)
        by_place = np.array(list(self._coarse(places)))
        far = away >= _MOVED_LEAST_M
        here = float(by_place[np.argmin(away)])
        alone = self.fine().log_evidence, self.offset().log_evidence
        best = int(np.flatnonzero(far)[np.argmax(by_place[far])])
        place = float(places[best, 0]), float(places[best, 1])
        level = patterns.elsewhere(self.cell, *place)[self.place]
        (found,) = self._explained({"moved": scene.noise.fault_sd_db}, level)
        evidence = log_sum(by_place[far]) - np.log(far.sum())
        # Without its buildings a prediction fits worse, wherever the cell is taken to be.
        evidence = max(alone) + evidence - max(here, *alone)
        return replace(found, log_evidence=evidence, value=float(away[best]), place_m=place)

    def _coarse(self, places: Ints | Floats) -> Iterator[float]:
        """Yield the evidence of each place that the cell may stand in."""
        scene, at_once = self.scene, max(1, _VISITS_AT_ONCE // len(self.visits))
        for first in range(0, len(places), at_once):
            some = places[first : first + at_once].tolist()
            level = np.array(
                [scene.patterns.elsewhere(self.cell, *one)[self.place] for one in some]
            )
            above_db = self.visits.level_dbm - level - self.shift
            for total in scene.coarse_sums.of(above_db, self.visits.received, self.weight):
                yield marginal(total, scene.noise.fault_sd_db / 2, _COARSE_DB)

    def _of(self, turn_deg: float, other: int) -> tuple[Explanation, Explanation]:
        """Return a pattern in the usual state, and with an offset that is a fault."""
        key = turn_deg % 360.0, other
        if key not in self._known:
            patterns, noise = self.scene.patterns, self.scene.noise
            if other >= 0:
                level = patterns.level_dbm[:, other]
            elif turn_deg % 360.0 and self.planned_deg is not None:
                level = patterns.turned(self.cell, self.planned_deg + turn_deg)
            else:
                level = patterns.level_dbm[:, self.cell]
            kinds: dict[StateKind, float] = {
                "fine": noise.cells_sd_db,
                "offset": noise.fault_sd_db,
            }
            fine, offset = self._explained(kinds, level[self.place], turn_deg)
            self._known[key] = fine, offset
        return self._known[key]

    def _explained(
        self, kinds: Mapping[StateKind, float], level_dbm: Floats, value: float = float("nan")
    ) -> Iterator[Explanation]:
        """Yield what levels say under the deviation of the cell's offset in each kind of state."""
        scene = self.scene
        floor_dbm, noise_db = scene.patterns.floor_dbm, scene.noise.sd_db
        given = self.visits, level_dbm + self.shift, floor_dbm
        total = scene.sums.of(excess_db(*given), self.visits.received, self.weight)
        found = [posterior_offset(total, sd_db) for sd_db in kinds.values()]
        at = [int(np.argmin(np.abs(OFFSETS_DB - mean))) for mean, _ in found]
        each = log_likelihoods(*given, noise_db, OFFSETS_DB[[*at, OFFSETS_DB.size // 2]])
        *by_journey, unshifted = map(self._by_journey, each.T)
        for (kind, sd_db), offset, own in zip(kinds.items(), found, by_journey, strict=True):
            evidence = marginal(total, sd_db)
            yield Explanation(kind, evidence, level_dbm, *offset, own, unshifted, value)

    def _by_journey(self, each: Floats) -> Floats:
        counted = np.bincount(self.visits.journey, each * self.weight, self.scene.journeys)
        return np.asarray(counted, dtype=np.float64)
