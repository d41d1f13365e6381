"""What a Kalman-type filter over sites knows after an epoch."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, nan

from mapfilter.filters.contract import Status
from mapfilter.models.state import StateLayout
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.fix_errors import FixErrors
from mapfilter.positioning.kalman.lasting import Motion
from mapfilter.positioning.kalman.level_errors import CellSlots
from mapfilter.positioning.kalman.reckoning import Reckoning


@dataclass(frozen=True, eq=False)
class KalmanState:
    """State of a journey.

    Parameters
    ----------
    layout : StateLayout
        Position and errors of dead reckoning where there is some, else position and velocity; with
        the place that fixes are of, where their errors last, and behind them the errors of levels.
    belief : SumBelief or None
        None before the first measurement that it can start from.
    time_s : float
        Time of the last epoch.
    moved_m : float
        Distance travelled since levels or timing advances were last used.
    recent_nis : tuple of float
        Normalised innovations squared of the last measurements, per component.
    motion : tuple of arrays or None
        Transition, noise and shift that led to the last epoch.
    last_fix : GnssFix or None
        The last one with a position.
    fixes : FixErrors
        Errors of fixes.
    slots : CellSlots
        Cells whose errors of levels are in the state.
    reckoning : Reckoning
        What is known of the sensors.
    """

    layout: StateLayout
    belief: SumBelief | None = None
    time_s: float = nan
    moved_m: float = inf
    status: Status = Status.SEARCHING
    recent_nis: tuple[float, ...] = ()
    motion: Motion | None = None
    last_fix: GnssFix | None = None
    fixes: FixErrors = field(default_factory=FixErrors)
    slots: CellSlots = field(default_factory=lambda: CellSlots.empty(0))
    reckoning: Reckoning = field(default_factory=Reckoning)
