"""The output of a step of the map filter: its belief as a position with radii."""

from __future__ import annotations

from math import isfinite, nan

from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.hypotheses import empty_summary
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.beliefs.legs import Lead
from mapfilter.positioning.bayes.state import BayesState, Reported
from mapfilter.positioning.integrity import sample_tail
from mapfilter.positioning.step_output import Fix, StepOutput, UnusedReading, protected_m


def step_output(
    area: AreaFrame,
    state: BayesState,
    time_s: float,
    reason: Reason,
    unused: tuple[UnusedReading, ...],
    *,
    positions_only: bool = False,
) -> tuple[BayesState, StepOutput]:
    """Summarise the belief; ``reason`` is whether the epoch's report was used.

    A phone that stands still has the same belief for hours, which is not summarised again, nor is
    one whose steps wait: its position goes on by dead reckoning.
    ``positions_only`` leaves out ways, the radius of 99 % and protection levels.
    """
    made_of = state.belief, state.status, state.null.probability
    known, leg = state.reported, state.leg
    if known is None or known.belief is not made_of[0] or known[1:3] != made_of[1:]:
        output = _output(area, state, time_s, reason, unused, positions_only=positions_only)
        known = Reported(*made_of, output)
        state = state.with_output(known)
        if not leg.rows:
            return state, output
    state, east_m, north_m = _gone_on(state, known)
    fix = known.output.fix.gone_on(time_s, east_m, north_m, reason)
    return state, StepOutput(fix, known.output.evidence, unused, known.output.tail)


def _gone_on(state: BayesState, known: Reported) -> tuple[BayesState, float, float]:
    """Return where a reported position has gone since; the state keeps what leads it on."""
    fix, belief = known.output.fix, state.belief
    if not state.leg.rows or not isinstance(belief, ParticleBelief):
        return state, fix.east_m, fix.north_m
    lead = known.lead
    if lead is None:
        lead = Lead.of(belief.state, belief.weight, belief.summary.mean)
        state = state.with_output(known._replace(lead=lead))
    east_m, north_m = lead.led_m(state.leg.gone_m(state.reckoning))
    return state, fix.east_m + east_m, fix.north_m + north_m


def _output(
    area: AreaFrame,
    state: BayesState,
    time_s: float,
    reason: Reason,
    unused: tuple[UnusedReading, ...],
    *,
    positions_only: bool,
) -> StepOutput:
    belief, (west, south) = state.belief, area.origin_m
    count, way, tail = 0, (0, nan), None
    wide_m = protection_m = nan
    if belief is None or state.status is Status.OUTSIDE:
        summary = empty_summary(STATES)
    else:
        summary, count = belief.summary, belief.count
        if not positions_only:
            places = belief.state[0], belief.state[1], belief.weight
            way = area.matched_way(*places)
            if count:
                tail = sample_tail(*places, summary.mean, p_none=state.null.probability)
                wide_m, protection_m = protected_m(tail, summary.radii_m)
    fix = Fix(
        time_s,
        float(summary.mean[0]) + west,
        float(summary.mean[1]) + south,
        summary.covariance_m2,
        summary.radii_m,
        state.status,
        count,
        summary.mass_50m if count else nan,
        *way,
        reason,
        wide_m,
        protection_m,
    )
    east_m = north_m = nan
    mass = 0.0 if isfinite(summary.entropy_bits) else nan
    if len(summary.runners_up):
        east_m, north_m, mass = summary.runners_up[0].tolist()
    log_evidence = belief.log_evidence if belief else nan
    evidence = (east_m + west, north_m + south, mass, summary.entropy_bits, log_evidence)
    return StepOutput(fix, evidence, unused, tail)
