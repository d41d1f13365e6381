"""What is recorded of a filter while it locates a log, for a view of the run afterwards."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from mapfilter._types import Bytes, Ints32
from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.filter import Filter, Hypotheses
from mapfilter.positioning.step_output import StepOutput
from mapfilter.viewing.explain import Explanation, explain

MOST_FRAMES, MOST_EXPLAINED = 1500, 4000
"""Most beliefs and most explanations that are kept of a run."""

_STEPS_M = (2.5, 5.0, 10.0, 25.0, 50.0, 100.0)
_MOST_SQUARES = 1000
_SHADES = 255


class Moment(NamedTuple):
    """Quantities of every epoch that an estimate does not hold; NaN where there are none.

    ``doubt`` is the log odds that the map explains nothing; the last four are of the alternative:
    its place in the filter's CRS, its log Bayes factor, and its share within 50 m.
    """

    travelled_m: float
    doubt: float
    east_m: float
    north_m: float
    lead: float
    mass: float


class Frame(NamedTuple):
    """A belief as a density: squares of ``step_m`` by their column and row from the CRS's origin.

    ``shade`` is 255 times the square root of a square's mass over that of the heaviest, ``peak``.
    """

    epoch: int
    step_m: float
    col: Ints32
    row: Ints32
    shade: Bytes
    peak: float


@dataclass(eq=False)
class Thinned:
    """Things of some epochs, evenly spread: when there are too many, every second one goes.

    Parameters
    ----------
    most : int
        How many are kept at most.
    every : int
        Distance of two epochs, doubled each time.
    """

    most: int
    every: int = 1
    kept: dict[int, Any] = field(default_factory=dict)
    always: set[int] = field(default_factory=set)

    def due(self, epoch: int) -> bool:
        """Return whether an epoch is one of those that are kept."""
        return epoch % self.every == 0

    def add(self, epoch: int, thing: Any, *, always: bool = False) -> None:
        """Keep a thing; ``always`` also where others have to go, as long as there are few such."""
        self.kept[epoch] = thing
        if always and len(self.always) < self.most // 4:
            self.always.add(epoch)
        while len(self.kept) > self.most:
            self.every *= 2
            self.kept = {
                at: one
                for at, one in self.kept.items()
                if at % self.every == 0 or at in self.always
            }


@dataclass(eq=False)
class TraceRecorder:
    """Records a run: a :class:`~mapfilter.positioning.filter.Recorder`.

    Of the Bayes map filter also the alternative, and why the belief is where it is.

    Parameters
    ----------
    filter : Filter
        The one that is recorded.
    """

    filter: Filter[Any]
    moments: list[Moment] = field(default_factory=list)
    frames: Thinned = field(default_factory=lambda: Thinned(MOST_FRAMES))
    explained: Thinned = field(default_factory=lambda: Thinned(MOST_EXPLAINED))
    _status: Status | None = None
    _travelled_m: float = 0.0
    _belief: object = None

    def record(
        self,
        before: Any,
        epoch: Epoch,
        rng: np.random.Generator,
        after: Any,
        output: StepOutput,
    ) -> None:
        """Record one step."""
        number, fix = len(self.moments), output.fix
        steps_m = (step.step_m for step in epoch.motion if isfinite(step.step_m))
        moved_m = sum(map(abs, steps_m))
        self._travelled_m += moved_m
        self.moments.append(moment_of(self.filter, self._travelled_m, after))
        changed = fix.status is not self._status
        self._status = fix.status
        rests = not moved_m and isinstance(after, BayesState) and after.belief is self._belief
        self._belief = after.belief if isinstance(after, BayesState) else None
        if changed or (self.frames.due(number) and not rests):
            found = self.filter.hypotheses(after)
            if found is not None and found.weight.size:
                self.frames.add(number, density(number, found), always=changed)
        measured = bool(epoch.radio) or epoch.gnss is not None or bool(epoch.pseudoranges)
        if measured and not rests and (changed or self.explained.due(number)):
            explanation = explanation_of(self.filter, before, epoch, rng, output)
            if explanation is not None:
                self.explained.add(number, explanation, always=changed)


def explanation_of(
    filter_: Filter[Any], before: Any, epoch: Epoch, rng: np.random.Generator, output: StepOutput
) -> Explanation | None:
    """Explain one step; None for other filters than the Bayes map filter, and before its start.

    Parameters
    ----------
    before : state of the filter
        Before the step.
    rng : numpy.random.Generator
        As it was before the step.
    """
    if not isinstance(filter_, BayesPositioner) or not isinstance(before, BayesState):
        return None
    (west, south), fix = filter_.area.origin_m, output.fix
    east_m, north_m = output.evidence[:2] if output.evidence is not None else (nan, nan)
    lead = fix.east_m - west, fix.north_m - south
    return explain(filter_, before, epoch, rng, lead, (east_m - west, north_m - south))


def moment_of(filter_: Filter[Any], travelled_m: float, state: Any) -> Moment:
    """Return what a state holds beside the estimate; NaN where the filter has no such thing."""
    if not isinstance(state, BayesState) or not isinstance(filter_, BayesPositioner):
        return Moment(travelled_m, nan, nan, nan, nan, nan)
    doubt = state.null.log_odds if state.belief is not None else nan
    other = state.alternative
    if other is None or state.belief is None:
        return Moment(travelled_m, doubt, nan, nan, nan, nan)
    (west, south), summary = filter_.area.origin_m, other.belief.summary
    lead = other.log_bayes_factor(state.belief)
    place = float(summary.mean[0]) + west, float(summary.mean[1]) + south
    return Moment(travelled_m, doubt, *place, lead, summary.mass_50m)


def density(epoch: int, found: Hypotheses) -> Frame:
    """Put hypotheses into squares: as small as keeps them few, and none that would not be seen."""
    for step_m in _STEPS_M:
        col = np.floor(found.east_m / step_m).astype(np.int64)
        row = np.floor(found.north_m / step_m).astype(np.int64)
        low_col, low_row = int(col.min()), int(row.min())
        width = int(col.max()) - low_col + 1
        square, of = np.unique((row - low_row) * width + (col - low_col), return_inverse=True)
        mass = np.bincount(of.ravel(), found.weight)
        peak = float(mass.max())
        shade = np.rint(_SHADES * np.sqrt(mass / peak)) if peak > 0 else np.zeros(mass.size)
        seen = np.flatnonzero(shade >= 1)
        if seen.size <= _MOST_SQUARES:
            break
    return Frame(
        epoch,
        step_m,
        (square[seen] % width + low_col).astype(np.int32),
        (square[seen] // width + low_row).astype(np.int32),
        shade[seen].astype(np.uint8),
        peak,
    )
