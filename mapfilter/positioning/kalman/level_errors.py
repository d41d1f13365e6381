"""Errors of levels that last, as further components of a Kalman-type filter's state.

The path loss of a cell by formula is off by as much for hundreds of metres: its antenna, its
surroundings and the streets in between stay the same, and what the formula and the receiver have
wrong is common to all cells. Taken as noise of each report, a hundred of them would count as one of
a tenth of the error. Here a level is

    y = h(x) + e + e_c + w,

with e common to all cells, e_c the cell's own, both first-order Gauss-Markov processes along the
way (Gudmundson 1991; Bar-Shalom, Li & Kirubarajan 2001, sect. 8.2), and w noise. The state is
extended by e and by the errors of a few cells. One that was reported within the memory of its error
keeps its place there; the error of a cell without a place is noise. Nothing that was forgotten
counts again as if it were new: the variance of an error that is not kept grows so that the cell
counts once over twice that distance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import exp, inf
from typing import NamedTuple

import numpy as np

from mapfilter.filters.gaussian import Method
from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.lasting import Motion

MOST_CELLS = 12
"""Cells whose errors are kept at a time."""
_ONCE = 2.0
"""Reports count as one over so many times the distance at which a correlation is 1/e: its integral
over both sides."""
LEAST_MOVED_M = 0.1
"""Shortest distance between two reports of one cell, for the growth of variances."""


class SlotUpdate(NamedTuple):
    """What a report changes.

    Parameters
    ----------
    slots : CellSlots
        After the report.
    growth : mapping of str to float
        Of each cell reported, how many times as large the variance of its own error is where the
        error was not kept; 1 for a cell that was not reported for long.
    renewed : mapping of int to float
        Slots that are another cell's now, and its growth.
    """

    slots: CellSlots
    growth: Mapping[str, float]
    renewed: Mapping[int, float]


@dataclass(frozen=True, slots=True)
class CellSlots:
    """Which cell each kept error is of.

    Parameters
    ----------
    cells : tuple of str
        Empty where there is none yet.
    ago_m : mapping of str to float
        Distance travelled since each cell was reported, of those whose errors are still alike.
    """

    cells: tuple[str, ...]
    ago_m: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def empty(cls, count: int) -> CellSlots:
        """Return slots of no cells yet."""
        return cls(("",) * count)

    @property
    def size(self) -> int:
        """Components of the state: the common error and one for each slot, or none."""
        return len(self.cells) + 1 if self.cells else 0

    def after_report(self, names: Sequence[str], moved_m: float, memory_m: float) -> SlotUpdate:
        """Return what a report changes, a distance after the one before.

        Cells take the slots of those that were not reported within the memory, in their order.

        Examples
        --------
        >>> update = CellSlots.empty(2).after_report(["A", "B"], 0.0, 300.0)
        >>> update = update.slots.after_report(["C", "B"], 100.0, 300.0)
        >>> update.slots.cells, update.growth
        (('A', 'B'), {'C': 1.0, 'B': 6.0})
        >>> update.slots.after_report(["C", "B"], 200.0, 300.0).slots.cells
        ('C', 'B')
        """
        if not self.cells:
            return SlotUpdate(self, {}, {})
        once_m = _ONCE * memory_m
        before = ((name, far_m + moved_m) for name, far_m in self.ago_m.items())
        ago_m = {name: far_m for name, far_m in before if far_m < once_m}
        growth = {
            name: max(once_m / max(ago_m.get(name, inf), LEAST_MOVED_M), 1.0) for name in names
        }
        cells, renewed = list(self.cells), dict[int, float]()
        far = [slot for slot, name in enumerate(cells) if ago_m.get(name, inf) >= memory_m]
        free = sorted(
            (slot for slot in far if cells[slot] not in growth),
            key=lambda slot: ago_m.get(cells[slot], inf),
            reverse=True,
        )
        coming = [name for name in growth if name not in cells]
        for name, slot in zip(coming, free, strict=False):
            cells[slot], renewed[slot] = name, growth[name]
        return SlotUpdate(
            CellSlots(tuple(cells), ago_m | dict.fromkeys(growth, 0.0)), growth, renewed
        )

    def components(self, names: Sequence[str], layout: StateLayout) -> list[tuple[int, int]]:
        """Return the components of the common and the own error of each cell; -1 for none."""
        common = layout.size - self.size
        own = {name: common + 1 + slot for slot, name in enumerate(self.cells) if name}
        return [(common, own.get(name, -1)) for name in names]


@dataclass(frozen=True, slots=True)
class LastingLevels:
    """Deviations of the two errors, and the distances after which a correlation is 1/e."""

    common_db: float
    common_m: float
    own_db: float
    own_m: float

    def variances(self, slots: CellSlots) -> list[float]:
        """Return the variance of each component."""
        return [self.common_db**2, *(self.own_db**2 for _ in slots.cells)]

    def extended_belief(self, belief: SumBelief, slots: CellSlots) -> SumBelief:
        """Return a belief with the errors, before any level."""
        count, n, more = *belief.means.shape, slots.size
        means = np.zeros((count, n + more))
        means[:, :n] = belief.means
        covariances = np.zeros((count, n + more, n + more))
        covariances[:, :n, :n] = belief.covariances
        covariances[:, range(n, n + more), range(n, n + more)] = self.variances(slots)
        return replace(belief, means=means, covariances=covariances)

    def extended_motion(
        self, motion: Motion, slots: CellSlots, renewed: Mapping[int, float], moved_m: float
    ) -> Motion:
        """Return motion with that of the errors over a distance.

        Those of ``renewed`` slots begin anew, with so many times their variance.
        """
        transition, noise, shift = motion
        n, more = shift.size, slots.size
        kept = np.array([exp(-moved_m / self.common_m), *[exp(-moved_m / self.own_m)] * (more - 1)])
        begun = np.ones(more)
        for slot, growth in renewed.items():
            kept[1 + slot], begun[1 + slot] = 0.0, growth
        wide, spread = np.zeros((n + more, n + more)), np.zeros((n + more, n + more))
        wide[:n, :n], spread[:n, :n] = transition, noise
        wide[n:, n:] = np.diag(kept)
        spread[n:, n:] = np.diag(begun * (1 - kept**2) * self.variances(slots))
        return wide, spread, np.concatenate([shift, np.zeros(more)])


@lru_cache(32)
def with_own_spread(method: Method, errors: int) -> Method:
    """Return a method whose sigma points lie as far out as without so many errors that last.

    Levels are linear in these, or do not depend on them, and the columns of the Cholesky factor
    that move the position are the first ones: more components need no points that are farther out.
    """
    if method.sigma is None or not errors:
        return method
    return replace(method, sigma=replace(method.sigma, kappa=method.sigma.kappa - errors))


def with_levels(layout: StateLayout, slots: CellSlots) -> StateLayout:
    """Return a layout with the errors of levels behind the other components."""
    return replace(layout, size=layout.size + slots.size)
