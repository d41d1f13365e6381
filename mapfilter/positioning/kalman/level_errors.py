"""Errors of levels that last, as further components of a Kalman-type filter's state.

The path loss of a cell by formula is off by as much for hundreds of metres: its antenna, its
surroundings and the streets in between stay the same, and what the formula and the receiver have
wrong is common to all cells. Taken as noise of each report, a hundred of them would count as one of
a tenth of the error. Here a level is

    y = h(x) + e + e_c + w,

with e common to all cells, e_c the cell's own, both first-order Gauss-Markov processes along the
way (Gudmundson 1991; Bar-Shalom, Li & Kirubarajan 2001, sect. 8.2), and w noise. The state is
extended by e and by the errors of a few cells: of the cells heard, those last heard keep theirs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, inf

import numpy as np

from mapfilter.filters.gaussian import Method
from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.lasting import Motion

MOST_CELLS = 12
"""Cells whose errors are kept at a time."""


@dataclass(frozen=True, slots=True)
class CellSlots:
    """Which cell each kept error is of.

    Parameters
    ----------
    cells : tuple of str
        Empty where there is none yet.
    heard_s : tuple of float
        When each was last heard.
    """

    cells: tuple[str, ...]
    heard_s: tuple[float, ...]

    @classmethod
    def empty(cls, count: int) -> CellSlots:
        """Return slots of no cells yet."""
        return cls(("",) * count, (-inf,) * count)

    @property
    def size(self) -> int:
        """Components of the state: the common error and one for each slot, or none."""
        return len(self.cells) + 1 if self.cells else 0

    def hearing(self, names: Sequence[str], time_s: float) -> tuple[CellSlots, tuple[int, ...]]:
        """Return the slots after a report, and those that are another cell's now.

        The cells that were not heard for longest give way; what exceeds the slots has none.

        Examples
        --------
        >>> slots, renewed = CellSlots.empty(2).hearing(["A", "B"], 1.0)
        >>> slots, renewed = slots.hearing(["C", "B"], 2.0)
        >>> slots.cells, renewed
        (('C', 'B'), (0,))
        """
        cells, heard_s, renewed = list(self.cells), list(self.heard_s), []
        wanted = list(dict.fromkeys(names))[: len(cells)]
        for name in wanted:
            if name in cells:
                heard_s[cells.index(name)] = time_s
        for name in wanted:
            if name not in cells:
                slot = min(range(len(cells)), key=heard_s.__getitem__)
                cells[slot], heard_s[slot] = name, time_s
                renewed.append(slot)
        return CellSlots(tuple(cells), tuple(heard_s)), tuple(renewed)

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
        self, motion: Motion, slots: CellSlots, renewed: Sequence[int], moved_m: float
    ) -> Motion:
        """Return motion with that of the errors over a distance; renewed ones begin anew."""
        transition, noise, shift = motion
        n, more = shift.size, slots.size
        kept = np.array([exp(-moved_m / self.common_m), *[exp(-moved_m / self.own_m)] * (more - 1)])
        kept[[1 + slot for slot in renewed]] = 0.0
        wide, spread = np.zeros((n + more, n + more)), np.zeros((n + more, n + more))
        wide[:n, :n], spread[:n, :n] = transition, noise
        wide[n:, n:] = np.diag(kept)
        spread[n:, n:] = np.diag((1 - kept**2) * self.variances(slots))
        return wide, spread, np.concatenate([shift, np.zeros(more)])


def with_own_spread(method: Method, slots: CellSlots) -> Method:
    """Return a method whose sigma points lie as far out as without the errors of levels.

    Levels are linear in these, and the columns of the Cholesky factor that move the position are
    the first ones: more components need no points that are farther out.
    """
    if method.sigma is None or not slots.size:
        return method
    return replace(method, sigma=replace(method.sigma, kappa=method.sigma.kappa - slots.size))


def with_levels(layout: StateLayout, slots: CellSlots) -> StateLayout:
    """Return a layout with the errors of levels behind the other components."""
    return replace(layout, size=layout.size + slots.size)
