"""A phone that reports no motion, or hardly any: by its levels, whether it is carried on.

At rest levels change by fading alone, and by more along a short way. Each block of a rest is
compared with its first one, by the likelihoods of "still there", or as far away as measured, and
"carried elsewhere", and their ratio is added up from zero (a CUSUM; Page, 1954).

A walker whose steps are no longer counted is 50 m away before that ratio can be large. So the
rest itself has to be shown, too: where levels could have shown it, and did not, the position is in
doubt from 45 m on, at the pace before, beyond what is measured. How levels change then depends on
the distance.

A vehicle does not turn where it stands: an odometer whose zeros began at once, beyond usual
braking, and have the turn of a corner, is dead. Wheel sensors also read zero while one creeps into
a parking lot. So after a usual stop, as of a car that is towed or stands on a ferry, turns are
added to what levels say, and do not suffice alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import exp, inf, isfinite, nan, radians

from mapfilter._same import EqualByValue
from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.epochs import ReportRow
from mapfilter.positioning.sensors.pace import WALKERS_MPS
from mapfilter.positioning.sensors.reported_levels import levels_of
from mapfilter.positioning.sensors.rest_levels import added_nats, carried_nats_of, left_nats_of
from mapfilter.tracks.schema import SERVING

_BLOCK_S = 10.0
_CELLS_AT_REST, _M_PER_CELL, _NATS_PER_CELL, _CELLS_S = 3, 30.0, 2.5, 600.0
_NATS_PER_S = 1 / 300
"""Serving cells that are usual at rest, the measured way for each that is usual besides, gain from
each further one that has not served for so long, and what is forgotten with time: now and then
others serve, also at rest."""
_CARRIED_NATS = 6.0
_LEFT_M = 45.0
"""Way from which on a position is in doubt."""
_NEAR_M = 25.0
"""Way up to which one that no step is counted of leaves a position within 50 m."""
_DEAD_SHARE, _NATS_PER_FACTOR = 0.05, 5.0
"""Assumed share of such rests that are none, as the counter has died; how much the sum has to fall
for e times fewer simulated ways to reach it."""
_SHOWABLE_NATS = -2.5
"""Sum of levels that do not change at all above which levels could not show a rest."""
_RIDE_S = 60.0
"""After so long a bus is half a kilometre away."""
_DRIFT_MPS = 1.5
"""Slower positions of a vehicle whose wheels stand drift by their errors."""
_BRAKES_MPS2 = 5.0
"""Beyond usual braking."""
_CORNER_RAD, _CORNER_S = radians(45.0), 10.0
"""Turn within some seconds that no bias of a gyroscope adds up to."""
_NATS_PER_CORNER, _MOST_BY_CORNERS = 2.0, 5.0
"""What such a turn adds where one may have rolled out, and the largest sum that turns alone make:
wheels that read zero may creep into a parking lot, or a phone is taken in the hand."""
_SHOWN_NATS, _SHOWN_AGAIN_NATS = -1.0, -5.0
"""Sum at or below which levels show a rest, and do so again after a doubt."""
_CLEAR_NATS = -10.5
"""Sum that a minute of way does not reach (none of 48 simulated ones), and 70 s of rest do (47 of
52)."""
_CERTAIN_NATS = -19.5
"""Sum that less than 0.01 of the time of simulated ways is below, 50 to 200 m from their start, and
half of the rests after two minutes."""


@dataclass(frozen=True, slots=True, eq=False)
class Rest(EqualByValue):
    """Reports since motion stands still, or is slow.

    Parameters
    ----------
    since_s : float
        Time of the last step at the usual pace, or of the last position that was measured.
    block_s : float
        When the present block began.
    first, present : mapping of str to tuple of float
        Sum and number of each cell's levels, in the first and the present block.
    served : mapping of str to float
        When each cell has served last.
    heard_s : float
        Time of the last report.
    carried_nats : float
        How much the levels, and turns of a vehicle, speak for being carried on.
    pace_mps : float
        Speed before the rest.
    began_s : float
        When the first block began.
    left_nats : float
        How much the levels speak for walking on at that pace against a rest; below 0 for the rest.
    still_nats : float
        The same, had no level changed.
    is_doubtful : bool
        Whether levels could have shown the rest by now, and did not.
    measured_m : float
        Way in m that was measured since then: 0 at rest.
    braked_mps2 : float
        How a vehicle has braked to it.
    turned_rad, turned_s : float
        Sum of recent turns that were measured without a way or a heading, and the time of the last.
    carried_mps : float
        Speed of a phone that is carried on, as positions show it; 0 where none do.
    """

    since_s: float
    block_s: float = nan
    first: Mapping[str, tuple[float, int]] = field(default_factory=dict)
    present: Mapping[str, tuple[float, int]] = field(default_factory=dict)
    served: Mapping[str, float] = field(default_factory=dict)
    heard_s: float = nan
    carried_nats: float = 0.0
    pace_mps: float = 0.0
    began_s: float = nan
    left_nats: float = 0.0
    still_nats: float = 0.0
    is_doubtful: bool = False
    measured_m: float = 0.0
    braked_mps2: float = 0.0
    turned_rad: float = 0.0
    turned_s: float = -inf
    carried_mps: float = 0.0

    def turned(self, time_s: float, steps: tuple[MotionStep, ...]) -> Rest:
        """Add turns without a way: a vehicle that takes a corner is carried on.

        Headings beside turns may be courses of a receiver, which turn at rest.
        """
        if self.pace_mps <= WALKERS_MPS or self.is_carried:
            return self
        turns = [s.turn_rad for s in steps if isfinite(s.turn_rad) and not isfinite(s.heading_rad)]
        if not turns:
            return self
        kept = exp((self.turned_s - time_s) / _CORNER_S)
        turned_rad = kept * self.turned_rad + sum(turns)
        nats = self.carried_nats
        if abs(turned_rad) >= _CORNER_RAD:
            most_nats = max(nats, _MOST_BY_CORNERS)
            rolls_out = self.braked_mps2 <= _BRAKES_MPS2
            nats = min(nats + _NATS_PER_CORNER, most_nats) if rolls_out else _CARRIED_NATS
            turned_rad = 0.0
        return replace(self, turned_rad=turned_rad, turned_s=time_s, carried_nats=nats)

    def heard(self, time_s: float, rows: tuple[ReportRow, ...], gone_m: float = 0.0) -> Rest:
        """Add a report, and what was measured since the last one.

        A phone that was carried on stays so until it moves.
        """
        if self.is_carried:
            return self
        measured_m = self.measured_m + gone_m
        cells = {row.cell for row in rows if row.role == SERVING and row.cell is not None}
        recent = {cell: at_s for cell, at_s in self.served.items() if time_s - at_s <= _CELLS_S}
        usual = _CELLS_AT_REST + int(measured_m / _M_PER_CELL)
        known, all_cells = max(len(recent), usual), len(cells | recent.keys())
        gone_s = time_s - self.heard_s if isfinite(self.heard_s) else 0.0
        kept = max(self.carried_nats - _NATS_PER_S * gone_s, 0.0)
        nats = min(kept + _NATS_PER_CELL * max(all_cells - known, 0), _CARRIED_NATS)
        served = recent | dict.fromkeys(cells, time_s)
        block_s, first, present = self.block_s, self.first, dict(self.present)
        began_s, left_nats, still_nats = self.began_s, self.left_nats, self.still_nats
        if not isfinite(block_s):
            block_s = began_s = time_s
        elif time_s - block_s >= _BLOCK_S:
            nats = max(nats + carried_nats_of(first, present, measured_m), 0.0)
            nats = min(nats, _CARRIED_NATS)
            way_m = self.pace_mps * (block_s - began_s)
            gained, unchanged = left_nats_of(first, present, way_m, measured_m)
            left_nats, still_nats = added_nats(left_nats, gained), added_nats(still_nats, unchanged)
            block_s, first, present = time_s, {**present, **first}, {}
        for name, level_dbm in levels_of(rows):
            total, count = present.get(name, (0.0, 0))
            present[name] = (total + level_dbm, count + 1)
        return Rest(
            self.since_s,
            block_s,
            first,
            present,
            served,
            time_s,
            nats,
            self.pace_mps,
            began_s,
            left_nats,
            still_nats,
            self._in_doubt(time_s, left_nats, still_nats, measured_m) and nats < _CARRIED_NATS,
            measured_m,
            self.braked_mps2,
            self.turned_rad,
            self.turned_s,
        )

    def _in_doubt(
        self, time_s: float, left_nats: float, still_nats: float, measured_m: float
    ) -> bool:
        """Return whether the rest is in doubt at a time, with these sums."""
        far = self.pace_mps * (time_s - self.since_s) - measured_m >= _LEFT_M
        shown_nats = _SHOWN_AGAIN_NATS if self.is_doubtful else _SHOWN_NATS
        return far and still_nats <= _SHOWABLE_NATS and left_nats > shown_nats

    def left_share(self, time_s: float) -> float:
        """Return the probability that a walker has left the place unnoticed by a time.

        0 while one cannot be far, where levels could not show a rest and do not speak against it,
        and once it is certain.
        """
        way_m = self.pace_mps * (time_s - self.since_s) - self.measured_m
        told = self.is_certain or self.is_carried or self.pace_mps > WALKERS_MPS
        mute = self.still_nats > _SHOWABLE_NATS and self.left_nats <= 0
        if way_m < _NEAR_M or told or mute:
            return 0.0
        odds = _DEAD_SHARE * exp(min(self.left_nats, 0.0) / _NATS_PER_FACTOR)
        return odds / (1 - _DEAD_SHARE + odds)

    def carried(self, speed_mps: float = 0.0) -> Rest:
        """Return the rest as one that is none; positions may show its speed."""
        return replace(self, carried_nats=_CARRIED_NATS, is_doubtful=False, carried_mps=speed_mps)

    def may_be_carried_at(self, speed_mps: float) -> bool:
        """Return whether it may be carried on at a speed that positions show.

        Not where levels of now show that it stands. Nor are wheels dead because positions drift.
        """
        is_shown = self.left_nats <= _SHOWN_AGAIN_NATS and bool(self.present)
        drifts = self.pace_mps > WALKERS_MPS and speed_mps < _DRIFT_MPS
        return not (is_shown or drifts)

    def missed_mps(self, gone_s: float) -> float:
        """Return the pace before less what was measured, over a time since it began."""
        return max(self.pace_mps - self.measured_m / gone_s, 0.0) if gone_s > 0 else 0.0

    @property
    def is_clear(self) -> bool:
        """Whether levels show it as clearly as those of a minute at rest do."""
        return not self.is_carried and self.left_nats <= _CLEAR_NATS

    @property
    def is_certain(self) -> bool:
        """Whether levels show it as hardly any way does: those of two minutes at rest do."""
        return not self.is_carried and self.left_nats <= _CERTAIN_NATS

    @property
    def is_carried(self) -> bool:
        """Whether the phone is carried on though no motion is reported."""
        return self.carried_nats >= _CARRIED_NATS

    def was_ride(self, time_s: float) -> bool:
        """Return whether a walker was carried on for so long that it may be anywhere.

        Not where positions show how far that was.
        """
        is_long = self.is_carried and time_s - self.since_s >= _RIDE_S
        return is_long and self.pace_mps <= WALKERS_MPS and self.carried_mps == 0

    @property
    def left_probability(self) -> float:
        """Probability that the phone was carried on at the pace before, by its levels alone."""
        return 1 / (1 + exp(-self.left_nats))
