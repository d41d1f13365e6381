"""GNSS as a source of evidence: fixes and pseudoranges beside a belief and its alternative.

Each belief has a receiver (clock and height) of its own. Readings are compared with both beliefs
(:mod:`mapfilter.positioning.gnss.gate`); whichever of the two rejects them loses against the other.
As all satellites may be faulty at once, their part of the Bayes factor is bounded.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis, MapBelief
from mapfilter.positioning.bayes.sources.evidence import Context, EvidenceSource, EvidenceUpdate
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.gnss.fixes import FixTerm, agrees_with, widened
from mapfilter.positioning.gnss.gate import GnssComparison, GnssGate
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.receiver import (
    LINEAR,
    begun,
    begun_anew,
    near_clock,
    weighed,
    with_satellites,
)
from mapfilter.positioning.gnss.sky import Sky, range_sigma_m, sky_over
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.gnss.trail import Contradiction, FixTrail
from mapfilter.positioning.gnss.wander import Way
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.tracks.schema import Kind

_FIRST_SPACING_M = 10.0
_BLIND_START = 0.1
"""Share of a first belief that ignores satellites."""


@dataclass(frozen=True, eq=False)
class FirstRanges:
    """Log-likelihood of the first pseudoranges, with an unknown clock."""

    sky: Sky
    sigma_m: Floats
    options: GnssOptions

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return the log-likelihood of each place, such that the mean likelihood is 1."""
        count = state.shape[1]
        receiver = near_clock(self.sky, begun(self.options, 0.0, 0.0))
        rows = np.zeros((LINEAR, count))
        receiver, rows = with_satellites(self.options, receiver, rows, self.sky)
        found = weighed(self.sky, self.sigma_m, receiver, state[:2], np.zeros(count), rows)
        blind = np.log(_BLIND_START)
        return np.asarray(np.logaddexp(np.log1p(-_BLIND_START) + found.gain, blind))


@dataclass(frozen=True)
class FirstFix(EvidenceSource):
    """A fix before there is a belief to compare it with; :class:`GnssSource` takes later ones.

    A source of its own, as it is added before the terms of timing.
    """

    origin_m: tuple[float, float]
    name: ClassVar[str] = "first fix"
    kinds: ClassVar[frozenset[Kind]] = frozenset({"gnss"})
    is_position: ClassVar[bool] = True

    def first(self, epoch: Epoch) -> EvidenceUpdate:
        """Return the fix as it is."""
        return EvidenceUpdate(None, (FixTerm(epoch.gnss, self.origin_m),) if epoch.gnss else ())

    def update(self, state: BayesState, epoch: Epoch, context: Context) -> EvidenceUpdate:  # noqa: ARG002
        """Return nothing."""
        return EvidenceUpdate(None)


@dataclass(frozen=True)
class GnssSource(EvidenceSource):
    """Fixes and pseudoranges, with each radio report that is used, or on their own without one."""

    area: AreaFrame
    options: GnssOptions
    name: ClassVar[str] = "gnss"
    kinds: ClassVar[frozenset[Kind]] = frozenset({"gnss", "pseudorange"})
    is_position: ClassVar[bool] = True

    @cached_property
    def gate(self) -> GnssGate:
        """Comparison with beliefs in the area's frame."""
        width_m, height_m = self.area.size_m
        crs, origin_m = self.area.lattice.crs, self.area.origin_m
        return GnssGate(self.options, crs, origin_m, width_m * height_m)

    def begin(self) -> GnssState:
        """Return the state before the first comparison."""
        return GnssState()

    def first(self, epoch: Epoch) -> EvidenceUpdate:
        """Return the pseudoranges, with the satellites as they stand over the area's middle."""
        state = GnssState()
        if not epoch.pseudoranges or "pseudorange" not in self.kinds:
            return EvidenceUpdate(state)
        options, (width_m, height_m) = self.options, self.area.size_m
        middle_m = (width_m / 2, height_m / 2)
        sky, _ = sky_over(options, self.gate.crs, self.gate.origin_m, epoch, middle_m)
        if sky is None:
            return EvidenceUpdate(state)
        sigma_m = range_sigma_m(options, sky, _FIRST_SPACING_M)
        return EvidenceUpdate(state, (FirstRanges(sky, sigma_m, options),))

    def start(
        self, belief: MapBelief, epoch: Epoch, travelled_m: float
    ) -> tuple[MapBelief, GnssState]:
        """Give each hypothesis of a belief the clock that the pseudoranges require there."""
        if not epoch.pseudoranges and epoch.gnss is None:
            return belief, GnssState()
        found = self.gate.compare(belief, GnssState(), epoch, travelled_m, _FIRST_SPACING_M)
        return found.belief, found.state

    def beside_other(self, state: GnssState) -> GnssState:
        """Return the state with a receiver and a trail that begin anew."""
        receiver = state.receiver
        if state.trail.rows or state.wander.known:
            state = replace(state, trail=FixTrail(), wander=state.wander.before_a_jump())
        if receiver is None:
            return state
        return replace(state, receiver=begun_anew(self.options, receiver))

    def distrusted(self, state: GnssState, time_s: float) -> GnssState:
        """Return the state with readings rejected from now on."""
        return replace(self.gate.rejected(self.beside_other(state), time_s), distrusted=True)

    def update(self, state: BayesState, epoch: Epoch, context: Context) -> EvidenceUpdate:
        """Compare the epoch's fix and pseudoranges with the belief and the alternative."""
        own = gnss_of(state)
        if epoch.gnss is None and not epoch.pseudoranges:
            return EvidenceUpdate(own)
        travelled_m, belief = state.reckoning.travelled_m, state.belief
        due = context.report_due or own.due(self.options, epoch.time_s, travelled_m)
        # Nothing else tells where an unmeasured way leads.
        unmeasured = state.watch.is_unmeasured
        due = due or unmeasured
        if belief is None or not due:
            return EvidenceUpdate(own)
        spacing_m = context.particle_spacing_m
        main = self.gate.compare(belief, own, epoch, travelled_m, spacing_m)
        if epoch.gnss is not None and main.compared and not main.state.distrusted:
            main = main._replace(state=self._followed(main, epoch.gnss, epoch.time_s, state))
        contradiction = None
        if main.state.trail.contradicts:
            contradiction = self._weighted(main.state.trail.contradiction, proven=state.proven)
        alternative, terms, under_null = state.alternative, None, None
        if alternative is not None:
            before: GnssState = alternative.sources[self.name]
            other = self.gate.compare(alternative.belief, before, epoch, travelled_m, spacing_m)
            sources = {**alternative.sources, self.name: other.state}
            alternative = replace(alternative, belief=other.belief, sources=sources)
            terms, under_null = other.terms, other.under_null
            if main.compared or other.compared:
                step = float(main.state.contradicting) - float(other.state.contradicting)
                alternative = self._supported(alternative, step, epoch.time_s, contradiction)
        rejected_s = epoch.time_s - main.state.rejected_since_s
        disputed = main.state.contradicting and rejected_s >= self.options.dispute_s
        astray = unmeasured and main.unexplained
        return EvidenceUpdate(
            main.state,
            main.terms,
            terms,
            under_null=main.under_null,
            alternative_under_null=under_null,
            unused=[UnusedReading(epoch.time_s, *one) for one in main.unused],
            belief=main.belief,
            alternative=alternative,
            rival_terms=main.rival_terms,
            disputed=disputed or astray or contradiction is not None,
            contradiction=contradiction,
            refuted=(astray and belief.status is Status.SEARCHING)
            # Nothing is left of a grid's belief beyond the area.
            or (epoch.gnss is not None and not belief.count),
        )

    def _weighted(self, found: Contradiction | None, *, proven: bool) -> Contradiction | None:
        """Return a contradiction with what it gives an alternative.

        A belief that was found without positions knows where it is: they may lead away slowly.
        """
        if found is None or not found.goes_on or proven:
            return found
        nats = min(self.options.agreed_nats * found.fixes, self.options.agreed_trust)
        return found._replace(nats=nats)

    def _followed(
        self, found: GnssComparison, fix: GnssFix, time_s: float, state: BayesState
    ) -> GnssState:
        """Return the state with a fix in its trail, and beside the steps of one that moves."""
        own, rejected = found.state, found.unexplained
        if time_s < gnss_of(state).probation_until_s:
            # It was not compared: it may agree with the belief.
            rejected = not agrees_with(found.belief, widened(fix, 1.0), self.gate.origin_m)
        least_s = self.options.dispute_s
        trail = own.trail.after(time_s, fix, state.reckoning, least_s, rejected=rejected)
        wander, rest = own.wander, state.watch.rest
        if rest is not None:
            wander = wander.rested(time_s, rest.since_s)
        elif not rejected:
            wide, gone = widened(fix, 1.0), state.reckoning
            way = Way(gone.east_m, gone.north_m, gone.gaps)
            variance_m2 = (wide.var_east_m2 + wide.var_north_m2) / 2
            wander = wander.at_fix(time_s, way, (fix.east_m, fix.north_m), variance_m2)
        return replace(own, trail=trail, wander=wander)

    def _supported(
        self,
        alternative: AlternativeHypothesis,
        step: float,
        time_s: float,
        contradiction: Contradiction | None,
    ) -> AlternativeHypothesis:
        """Add to the alternative's Bayes factor, within the trust in satellites as a whole.

        Fixes that contradict a belief by what they give count for more.
        """
        most = self.options.trust
        most += max(time_s - alternative.start_s, 0.0) / self.options.trust_grows_s
        if contradiction is not None and contradiction.nats > 0:
            most, step = self.options.agreed_trust, self.options.agreed_nats * step
        # What was given by then stays.
        most = max(most, abs(alternative.gnss_log_bayes_factor))
        total = min(max(alternative.gnss_log_bayes_factor + step, -most), most)
        return replace(alternative, gnss_log_bayes_factor=total)


def gnss_of(state: BayesState) -> GnssState:
    """Return what a state holds of GNSS beside its main belief."""
    found: GnssState = state.sources[GnssSource.name]
    return found


@dataclass(frozen=True)
class FixSource(GnssSource):
    """Fixes alone: hypotheses on a grid carry no clock, which pseudoranges need."""

    kinds: ClassVar[frozenset[Kind]] = frozenset({"gnss"})
