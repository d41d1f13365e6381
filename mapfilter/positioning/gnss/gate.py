"""Comparison of fixes and pseudoranges with a belief: they are weighed where they agree with it.

Readings that agree with the belief weigh its hypotheses and correct the receiver's clock. Readings
that no hypothesis explains are rejected: all of them, or those of a few satellites. The clock may
have jumped, the position never follows at once. After a rejection nothing is used for a while; a
belief that rejects readings for long may be wrong itself and is disputed
(:mod:`mapfilter.positioning.gnss.source`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import nan
from typing import Any, NamedTuple

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.bayes.sources.evidence import FixedTerm, Term
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.gnss.fixes import (
    FixTerm,
    RejectedFixTerm,
    agrees_with,
    refutation,
    repeated,
    squared_distance,
    widened,
)
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.receiver import (
    LINEAR,
    Receiver,
    Weighed,
    agreement,
    begun,
    carried,
    centred,
    clock_reset,
    moved,
    near_clock,
    weighed,
    with_satellites,
)
from mapfilter.positioning.gnss.sky import Sky, Unused, range_sigma_m, sky_over
from mapfilter.positioning.gnss.state import GnssState

_RESET_GATE = 0.5


class GnssComparison(NamedTuple):
    """Outcome of comparing an epoch's fix and pseudoranges with a belief.

    ``belief`` carries clock and height in its hypotheses; ``under_null`` is the log-likelihood
    under the null hypothesis, relative to that under the belief. ``compared`` is whether there was
    anything to compare; ``unused`` holds kind, name and reason of readings left out. Rivals are
    weighed by ``rival_terms``, too. ``unexplained`` is whether a belief that had converged would
    reject the fix: one that searches keeps it, as its place may be among those not looked at.
    """

    belief: MapBelief
    state: GnssState
    terms: tuple[Term, ...] = ()
    under_null: float = 0.0
    compared: bool = False
    unused: tuple[Unused, ...] = ()
    rival_terms: tuple[Term, ...] = ()
    unexplained: bool = False

    def without(
        self, kind: str, names: Iterable[str], why: Reason, **changes: Any
    ) -> GnssComparison:
        """Add readings left out, and change further fields."""
        left_out = tuple((kind, name, why) for name in names)
        return self._replace(unused=(*self.unused, *left_out), **changes)


def _neutral(found: GnssComparison) -> GnssComparison:
    """Return a comparison whose terms leave the total likelihood of the belief as it is.

    A fix does so by itself, and so do pseudoranges, the last term; where they agree, not together.
    """
    belief, (*terms, last) = found.belief, found.terms
    gain = sum((one.log_likelihood(belief.state) for one in terms), np.zeros(1))
    gain = gain + (own := last.log_likelihood(belief.state))
    log_weight = belief.log_weight
    total = np.logaddexp.reduce(log_weight + gain) - np.logaddexp.reduce(log_weight)
    return found._replace(terms=(*terms, FixedTerm(own - total)))


def _total(belief: MapBelief, term: FixTerm) -> float:
    """Return the log-likelihood of a fix under a whole belief."""
    log_weight = belief.log_weight
    found = np.logaddexp.reduce(log_weight + term.log_likelihood(belief.state))
    return float(found - np.logaddexp.reduce(log_weight))


def _is_found(belief: MapBelief) -> bool:
    return belief.status is not Status.SEARCHING


@dataclass(frozen=True)
class GnssGate:
    """Compares fixes and pseudoranges with beliefs, in the map's CRS and the hypotheses' frame.

    ``area_m2`` is the size of the map.
    """

    options: GnssOptions
    crs: str
    origin_m: tuple[float, float]
    area_m2: float

    def compare(
        self,
        belief: MapBelief,
        state: GnssState,
        epoch: Epoch,
        travelled_m: float,
        particle_spacing_m: float,
    ) -> GnssComparison:
        """Compare an epoch's fix and pseudoranges with a belief.

        The hypotheses nearest to the true position lie up to ``particle_spacing_m`` from it.
        """
        state = replace(state, compared_at_s=epoch.time_s, compared_at_m=travelled_m)
        found = GnssComparison(belief, state)
        if epoch.gnss is not None and belief.count:
            found = self._compare_fix(found, epoch.gnss, epoch.time_s, travelled_m)
        by_fix = found.terms
        if epoch.pseudoranges:
            found = self._compare_ranges(found, epoch, travelled_m, particle_spacing_m)
        if by_fix and found.terms is not by_fix:
            found = _neutral(found)
        if found.state.probation_until_s > epoch.time_s:
            # Where fixes are rejected, pseudoranges are not used alone, and the other way around.
            found = found._replace(terms=(FixedTerm(np.zeros(1)),), under_null=0.0)
            if by_fix:
                unused = replace(
                    found.state,
                    fix_used_at_m=state.fix_used_at_m,
                    fix_used_at_s=state.fix_used_at_s,
                    excess=state.excess,
                )
                found = found.without("gnss", [""], Reason.ON_PROBATION, state=unused)
        return found

    def _gate(self, belief: MapBelief) -> float:
        return self.options.gate if _is_found(belief) else self.options.search_gate

    def rejected(self, state: GnssState, time_s: float) -> GnssState:
        """Return a state in which all readings of a time are rejected."""
        since_s = state.rejected_since_s if state.rejecting else time_s
        until_s = time_s + self.options.probation_s
        return replace(
            state, probation_until_s=until_s, rejected_since_s=since_s, agrees_from_m=nan
        )

    def _compare_fix(
        self, found: GnssComparison, fix: GnssFix, time_s: float, travelled_m: float
    ) -> GnssComparison:
        belief, state, options = found.belief, found.state, self.options
        if time_s < state.probation_until_s:
            return found.without("gnss", [""], Reason.ON_PROBATION, compared=True)
        if state.distrusted:
            if not agrees_with(belief, widened(fix, 1.0), self.origin_m):
                state, why = self.rejected(state, time_s), Reason.REJECTED_BY_EVIDENCE
                return found.without("gnss", [""], why, state=state, compared=True)
            state = state.on_trial(options, travelled_m)
            if state.distrusted:
                why = Reason.ON_PROBATION
                return found.without("gnss", [""], why, state=state, compared=True)
        times = state.repeats(options, time_s, travelled_m)
        # A belief that has grown wider than a fix is no more precise by its error than the fix.
        times = min(times, repeated(belief, widened(fix, 1.0)))
        # What it adds is little where its error is that of the one before, and less where fixes are
        # less precise than they state. Neither makes one that is far away agree.
        wide = widened(fix, times * state.understated)
        term, as_stated = FixTerm(wide, self.origin_m), FixTerm(fix, self.origin_m)
        total, fits = (_total(belief, one) for one in (term, as_stated))
        if fits + 1.0 < -self._gate(belief):
            # Whether it is trusted again stays as it was.
            state = self.rejected(found.state, time_s)
            why = Reason.REJECTED_BY_EVIDENCE
            rival = RejectedFixTerm(as_stated, 1.0 + self._gate(belief), 1.0 / times)
            found = found._replace(rival_terms=(rival,), unexplained=True)
            return found.without("gnss", [""], why, state=state, compared=True)
        squared = squared_distance(belief, widened(fix, 1.0), self.origin_m) / 2
        state = state.after_fix(squared if _is_found(belief) else 1.0, time_s, travelled_m)
        # The likelihood of the whole belief is judged here, so it does not count in the CUSUM.
        terms = (*found.terms, term, FixedTerm(np.array([-total])))
        # Fixes in a row repeat the same error, and refute by the share that is new.
        under_null = refutation(wide, total, self.area_m2) / times
        unexplained = fits + 1.0 < -options.gate
        return found._replace(
            state=state,
            terms=terms,
            under_null=under_null,
            compared=True,
            unexplained=unexplained,
        )

    def _compare_ranges(
        self, found: GnssComparison, epoch: Epoch, travelled_m: float, particle_spacing_m: float
    ) -> GnssComparison:
        belief, state, options, kind = found.belief, found.state, self.options, "pseudorange"
        if not isinstance(belief, ParticleBelief):
            missed = [row.satellite for row in epoch.pseudoranges]
            return found.without(kind, missed, Reason.NOT_USED_BY_FILTER)
        east, north = belief.state[:2].mean(axis=1, dtype=np.float64).tolist()
        sky, unused = sky_over(options, self.crs, self.origin_m, epoch, (east, north))
        found = found._replace(unused=(*found.unused, *unused))
        if sky is None:
            return found
        receiver, fresh = state.receiver, state.receiver is None
        if receiver is None:
            receiver = near_clock(sky, begun(options, epoch.time_s, travelled_m))
            rows = np.zeros((LINEAR, belief.log_weight.size))
        else:
            rows = carried(belief.state, receiver.mean.size)
        receiver, rows = moved(options, receiver, rows, epoch.time_s, travelled_m)
        receiver, rows = with_satellites(options, receiver, rows, sky)
        sigma = range_sigma_m(options, sky, particle_spacing_m)
        used, why = None, Reason.ON_PROBATION
        if epoch.time_s >= state.probation_until_s:
            used = self._agreeing(sky, sigma, receiver, belief, rows, fresh=fresh)
            why = Reason.REJECTED_BY_EVIDENCE
            if used is None:
                state = self.rejected(state, epoch.time_s)
            elif state.distrusted:
                state = state.on_trial(options, travelled_m)
                if state.distrusted:
                    used, why = None, Reason.ON_PROBATION
        if used is None:
            names = sky.names
        else:
            kept, receiver, result = used
            names = tuple(name for name in sky.names if name not in kept.names)
            receiver = replace(receiver, covariance=result.covariance, used_at_m=travelled_m)
            rows, state = result.rows, replace(state, rejected_since_s=nan)
            found = found._replace(terms=(*found.terms, FixedTerm(self._mixed(result.gain))))
        receiver, carrying = centred(receiver, rows, belief.state)
        belief, state = replace(belief, state=carrying), replace(state, receiver=receiver)
        return found.without(kind, names, why, belief=belief, state=state, compared=True)

    def _agreeing(
        self,
        sky: Sky,
        sigma: Floats,
        receiver: Receiver,
        belief: ParticleBelief,
        rows: Floats,
        *,
        fresh: bool,
    ) -> tuple[Sky, Receiver, Weighed] | None:
        """Return the satellites that agree with a belief, and the belief weighed by them.

        The receiver is the one given, or, where its clock jumped, one with another clock.
        """
        gate, place, log_weight = self._gate(belief), belief.state[:2], belief.log_weight
        searching = not _is_found(belief)
        once = sigma if searching else range_sigma_m(self.options, sky, 0.0)

        def weigh(chosen: Bools, clock: Receiver, free: int, gate: float) -> Weighed | None:
            some = sky.only(chosen)
            if not searching:
                fits = agreement(some, once[chosen], clock, place, belief.weight, rows, free)
                if fits < -gate:
                    return None
            found = weighed(some, sigma[chosen], clock, place, log_weight, rows, free)
            return found if found.score >= -gate else None

        every = np.ones(len(sky.names), dtype=np.bool_)
        whole, clock = weigh(every, receiver, int(fresh), gate), receiver
        if whole is None:
            clock = near_clock(sky, clock_reset(self.options, receiver))
            whole = weigh(every, clock, 1, _RESET_GATE * gate)
        if whole is not None:
            return sky, clock, whole
        if len(sky.names) < 3:
            return None
        good = np.array([weigh(one, receiver, 0, gate) is not None for one in np.diag(every)])
        if 2 * good.sum() <= good.size:
            return None
        rest = weigh(good, receiver, 0, gate)
        return (sky.only(good), receiver, rest) if rest is not None else None

    def _mixed(self, gain: Floats) -> Floats:
        """Mix log-likelihoods with a share of readings that carry no information."""
        share = self.options.outliers
        if share == 0:
            return gain
        return np.asarray(np.logaddexp(np.log1p(-share) + gain, np.log(share)))
