"""Satellites and fixes beside a belief: weighed where they agree with it, else rejected.

What is heard is compared with what the belief expects. Honest readings weigh its hypotheses and
steer the clock. Readings that nothing of the belief explains are rejected, all of them or those of
a few satellites; the clock may have jumped, but position never follows at once. A belief that
rejects for long may itself be wrong: so it is disputed, and a challenger that believes the
satellites may try (:mod:`mapfilter.positioning.bayes.alternative`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite, nan

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.alternative import MapBelief
from mapfilter.positioning.bayes.evidence import Given, PlaceEvidence
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.readings import (
    LEAST_MOVED_M,
    FixEvidence,
    Told,
    range_sigma_m,
    sky_over,
    widened,
)
from mapfilter.positioning.gnss.receiver import (
    LINEAR,
    Receiver,
    Sky,
    Weighed,
    agreement,
    begun,
    carried,
    centred,
    clock_reset,
    moved,
    near_clock,
    weighed,
)
from mapfilter.positioning.gnss.state import GnssState

_RESET_GATE = 0.5


@dataclass(frozen=True, eq=False)
class Listened:
    """What satellites and fixes make of a belief.

    Parameters
    ----------
    belief : MapBelief
        Its hypotheses carry clock and height.
    memory : GnssState
    also : tuple of PlaceEvidence
        To weigh it by.
    heard : bool
        Whether there was anything to compare.
    told : tuple of (str, str, Reason)
        What was left alone, and why.
    """

    belief: MapBelief
    memory: GnssState
    also: tuple[PlaceEvidence, ...] = ()
    heard: bool = False
    told: tuple[Told, ...] = ()


@dataclass(frozen=True)
class GnssGate:
    """Compares satellites with beliefs.

    Parameters
    ----------
    options : GnssOptions
    crs : str
        Of the map.
    origin_m : (float, float)
        Of the frame of the hypotheses.
    """

    options: GnssOptions
    crs: str
    origin_m: tuple[float, float]

    def listen(
        self,
        belief: MapBelief,
        memory: GnssState,
        epoch: Epoch,
        travelled_m: float,
        particle_spacing_m: float,
    ) -> Listened:
        """Compare an epoch's satellites and fix with a belief.

        Parameters
        ----------
        belief : MapBelief
        memory : GnssState
        epoch : Epoch
        travelled_m : float
        particle_spacing_m : float
            How far the hypotheses nearest to the truth may lie beside it.
        """
        memory = replace(memory, heard_at_s=epoch.time_s, heard_at_m=travelled_m)
        found = Listened(belief, memory)
        if epoch.fix is not None:
            found = self._hear_fix(found, epoch, epoch.fix, travelled_m)
        if epoch.ranges:
            found = self._hear_ranges(found, epoch, travelled_m, particle_spacing_m)
        if found.memory.until_s > epoch.time_s:
            # Where one is rejected, the other does not count alone.
            found = replace(found, also=(Given(np.zeros(1)),))
        return found

    def _gate(self, belief: MapBelief) -> float:
        searching = belief.status is Status.SEARCHING
        return self.options.search_gate if searching else self.options.gate

    def _hear_ranges(
        self, found: Listened, epoch: Epoch, travelled_m: float, particle_spacing_m: float
    ) -> Listened:
        belief, memory, options = found.belief, found.memory, self.options
        if not isinstance(belief, ParticleBelief):
            told = tuple(
                ("pseudorange", row.satellite, Reason.NOT_USED_BY_FILTER) for row in epoch.ranges
            )
            return replace(found, told=(*found.told, *told))
        east, north = belief.state[:2].mean(axis=1, dtype=np.float64).tolist()
        sky, told = sky_over(options, self.crs, self.origin_m, epoch, (east, north))
        found = replace(found, told=(*found.told, *told))
        if sky is None:
            return found
        rows, fresh = carried(belief.state), memory.receiver is None
        receiver = memory.receiver or near_clock(sky, begun(options, epoch.time_s, travelled_m))
        if fresh:
            rows = np.zeros((LINEAR, belief.log_weight.size))
        receiver, rows = moved(options, receiver, rows, epoch.time_s, travelled_m)
        gone_m = travelled_m - receiver.used_at_m
        sigma = range_sigma_m(options, sky, gone_m, particle_spacing_m)
        waits = epoch.time_s < memory.until_s
        used: tuple[Sky, Weighed] | None = None
        if not waits:
            used = self._used(sky, sigma, receiver, belief, rows, fresh=fresh)
        if used is None:
            receiver, state = centred(receiver, rows, belief.state)
            why = Reason.ON_PROBATION if waits else Reason.REJECTED_BY_EVIDENCE
            memory = replace(memory, receiver=receiver)
            if not waits:
                memory = self._rejected(memory, epoch.time_s)
            told = tuple(("pseudorange", name, why) for name in sky.names)
            return replace(
                found, belief=replace(belief, state=state), memory=memory, heard=True,
                told=(*found.told, *told),
            )  # fmt: skip
        kept, news = used
        receiver = replace(receiver, covariance=news.covariance, used_at_m=travelled_m)
        receiver, state = centred(receiver, news.rows, belief.state)
        told = tuple(
            ("pseudorange", name, Reason.REJECTED_BY_EVIDENCE)
            for name in sky.names
            if name not in kept.names
        )
        return replace(
            found,
            belief=replace(belief, state=state),
            memory=replace(memory, receiver=receiver, since_s=nan),
            also=(*found.also, Given(self.mixed(news.gain))),
            heard=True,
            told=(*found.told, *told),
        )

    def _used(
        self, sky: Sky, sigma: Floats, receiver: Receiver, belief: ParticleBelief, rows: Floats,
        *, fresh: bool,
    ) -> tuple[Sky, Weighed] | None:  # fmt: skip
        """Return the satellites that agree with a belief, and what they make of it."""
        gate, place, log_weight = self._gate(belief), belief.state[:2], belief.log_weight
        searching = belief.status is Status.SEARCHING
        # Echoes that last make readings count less, but not be farther off.
        once = sigma if searching else range_sigma_m(self.options, sky, np.inf, 0.0)

        def weigh(chosen: Bools, clock: Receiver, free: int, gate: float) -> Weighed | None:
            some = sky.only(chosen)
            if not searching:
                fits = agreement(some, once[chosen], clock, place, belief.weight, rows, free)
                if fits < -gate:
                    return None
            found = weighed(some, sigma[chosen], clock, place, log_weight, rows, free)
            return found if found.score >= -gate else None

        every = np.ones(len(sky.names), dtype=np.bool_)
        whole = weigh(every, receiver, int(fresh), gate)
        if whole is None:
            jumped = near_clock(sky, clock_reset(self.options, receiver))
            whole = weigh(every, jumped, 1, _RESET_GATE * gate)
        if whole is not None:
            return sky, whole
        if len(sky.names) < 3:
            return None
        good = np.array([weigh(one, receiver, 0, gate) is not None for one in np.diag(every)])
        if 2 * good.sum() <= good.size:
            return None
        rest = weigh(good, receiver, 0, gate)
        return (sky.only(good), rest) if rest is not None else None

    def mixed(self, gain: Floats) -> Floats:
        """Return log-likelihoods of readings of which a share tells nothing."""
        share = self.options.outliers
        if share == 0:
            return gain
        return np.asarray(np.logaddexp(np.log1p(-share) + gain, np.log(share)))

    def _rejected(self, memory: GnssState, time_s: float) -> GnssState:
        since_s = memory.since_s if isfinite(memory.since_s) else time_s
        return replace(memory, until_s=time_s + self.options.probation_s, since_s=since_s)

    def _hear_fix(
        self, found: Listened, epoch: Epoch, fix: GnssFix, travelled_m: float
    ) -> Listened:
        belief, memory, options = found.belief, found.memory, self.options
        if not (isfinite(fix.east_m) and isfinite(fix.north_m)) or not belief.log_weight.size:
            return found
        if epoch.time_s < memory.until_s:
            told = ("gnss", "", Reason.ON_PROBATION)
            return replace(found, heard=True, told=(*found.told, told))
        gone_m = travelled_m - memory.fix_at_m
        wide = widened(fix, max(options.fix_memory_m / max(gone_m, LEAST_MOVED_M), 1.0))
        evidence, log_weight = FixEvidence(wide, self.origin_m), belief.log_weight
        gain = evidence.log_likelihood(belief.state)
        total = float(np.logaddexp.reduce(log_weight + gain) - np.logaddexp.reduce(log_weight))
        if total + 1.0 < -self._gate(belief):
            told = ("gnss", "", Reason.REJECTED_BY_EVIDENCE)
            return replace(
                found, memory=self._rejected(memory, epoch.time_s), heard=True,
                told=(*found.told, told),
            )  # fmt: skip
        memory = replace(memory, fix_at_m=travelled_m, since_s=nan)
        # What it says of the belief as a whole is judged here, and not once more as doubt.
        also = (*found.also, evidence, Given(np.array([-total])))
        return replace(found, memory=memory, also=also, heard=True)
