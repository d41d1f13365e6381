"""Faults of a network: the hypotheses of each mast, and of cells of two masts, compared."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapfilter.learning.cell_evidence import (
    PRIOR,
    TURNS_DEG,
    CellEvidence,
    Explanation,
    FaultKind,
    Scene,
)
from mapfilter.learning.likelihood import log_sum

_SURE = 0.95
"""A finding is as probable as this."""
_NEAREST_CELLS = 20
_LEAST_RECEIVED = 5


@dataclass(frozen=True)
class Finding:
    """One fault of the database.

    Parameters
    ----------
    kind : str
        ``offset``, ``dead``, ``moved``, ``turned``, ``rotated`` or ``swapped``.
    cells : tuple of str
        The cells that it concerns.
    value : float
        Offset in dB, degrees clockwise, or metres; NaN where there is none.
    log_bayes_factor : float
        Natural logarithm of the evidence for it against its absence.
    probability : float
        With the prior of :data:`PRIOR`.
    journeys : int
        With visits of the cells.
    agreeing : int
        Of them, whose own visits favour it.
    place_m : tuple of float or None
        Where a moved cell stands.
    """

    kind: FaultKind
    cells: tuple[str, ...]
    value: float
    log_bayes_factor: float
    probability: float
    journeys: int
    agreeing: int
    place_m: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class NetworkFit:
    """The most probable state of a network.

    Parameters
    ----------
    findings : tuple of Finding
        The most certain first.
    cells : tuple of Explanation
        Of each cell of the plan.
    """

    findings: tuple[Finding, ...]
    cells: tuple[Explanation, ...]


@dataclass(frozen=True, eq=False)
class _Case:
    """One hypothesis of a mast: its log prior times evidence, its cells, and its own faults."""

    score: float
    cells: tuple[Explanation, ...]
    faults: tuple[tuple[FaultKind, tuple[int, ...], float], ...] = ()


def explain(scene: Scene) -> NetworkFit:
    """Return the most probable state of a network, mast by mast, then across masts."""
    patterns = scene.patterns
    evidence = [CellEvidence(scene, cell) for cell in range(len(patterns.plan))]
    chosen: dict[int, Explanation] = {}
    findings: list[Finding] = []
    for mast in patterns.masts:
        cases = list(_cases(mast, evidence))
        best = max(cases, key=lambda case: case.score)
        chosen |= dict(zip(mast, best.cells, strict=True))
        findings += _named(scene, evidence, mast, best, cases)
    findings, chosen = _across(scene, evidence, findings, chosen)
    ordered = sorted(findings, key=lambda found: -found.log_bayes_factor)
    return NetworkFit(tuple(ordered), tuple(chosen[cell] for cell in range(len(evidence))))


def _alone(one: CellEvidence) -> list[tuple[float, Explanation]]:
    """Return the hypotheses of a cell by itself, each with log prior plus log evidence."""
    faults = sum(PRIOR[name] for name in ("offset", "dead", "moved", "turned"))
    found = [
        (np.log1p(-faults), one.fine()),
        (np.log(PRIOR["offset"]), one.offset()),
    ]
    if (dead := one.dead()) is not None:
        found.append((np.log(PRIOR["dead"]), dead))
    if (moved := one.moved()) is not None:
        found.append((np.log(PRIOR["moved"]), moved))
    if one.planned_deg is not None and one.visits.received.sum() >= _LEAST_RECEIVED:
        each = np.log(PRIOR["turned"] / len(TURNS_DEG))
        for turn in TURNS_DEG:
            found.append((each, replace(one.fine(turn), kind="turned")))
    return [(prior + case.log_evidence, case) for prior, case in found]


def _cases(mast: Sequence[int], evidence: Sequence[CellEvidence]) -> Iterator[_Case]:
    """Yield the hypotheses of a mast."""
    alone = [_alone(evidence[cell]) for cell in mast]
    best = tuple(max(cases, key=lambda case: case[0])[1] for cases in alone)
    total = sum(log_sum([score for score, _ in cases]) for cases in alone)
    pointed = [cell for cell in mast if evidence[cell].planned_deg is not None]
    usual = np.log1p(-PRIOR["rotated"] - PRIOR["swapped"]) if len(pointed) > 1 else 0.0
    yield _Case(usual + total, best)
    if len(pointed) < 2:
        return
    each = np.log(PRIOR["rotated"] / len(TURNS_DEG))
    for turn in TURNS_DEG:
        yield _turned_case(mast, evidence, dict.fromkeys(pointed, turn), each, "rotated")
    each = np.log(PRIOR["swapped"] / _pairs(len(pointed)))
    for first, second in itertools.combinations(pointed, 2):
        apart = (evidence[second].planned_deg or 0.0) - (evidence[first].planned_deg or 0.0)
        if apart % 360.0:
            turns = {first: apart, second: -apart}
            yield _turned_case(mast, evidence, turns, each, "swapped")


def _turned_case(
    mast: Sequence[int],
    evidence: Sequence[CellEvidence],
    turns_deg: dict[int, float],
    log_prior: float,
    kind: FaultKind,
) -> _Case:
    score, cells = log_prior, []
    for cell in mast:
        one, turn = evidence[cell], turns_deg.get(cell, 0.0)
        if (dead := one.dead()) is not None:
            states = [(np.log(PRIOR["dead"]) + dead.log_evidence, dead)]
        else:
            states = []
        fine, offset = one.fine(turn), one.offset(turn)
        states.append((np.log1p(-PRIOR["offset"]) + fine.log_evidence, fine))
        states.append((np.log(PRIOR["offset"]) + offset.log_evidence, offset))
        score += log_sum([s for s, _ in states])
        cells.append(max(states, key=lambda state: state[0])[1])
    value = next(iter(turns_deg.values())) % 360.0 if kind == "rotated" else float("nan")
    return _Case(float(score), tuple(cells), ((kind, tuple(turns_deg), value),))


def _named(
    scene: Scene,
    evidence: Sequence[CellEvidence],
    mast: Sequence[int],
    best: _Case,
    cases: Sequence[_Case],
) -> list[Finding]:
    """Return the findings that the best hypothesis of a mast stands for."""
    found = []
    every = log_sum([case.score for case in cases])
    cells_of = [cell for cell in mast if evidence[cell].planned_deg is not None]
    share = float(np.exp(best.score - every))
    for kind, cells, value in best.faults:
        usual_score = sum(evidence[cell].mixed() for cell in mast)
        prior = PRIOR[kind] / (len(TURNS_DEG) if kind == "rotated" else _pairs(len(cells_of)))
        bayes = best.score - np.log(prior) - usual_score
        ours = dict(zip(mast, best.cells, strict=True))
        usual = {cell: evidence[cell].fine() for cell in cells}
        found.append(_finding(scene, evidence, kind, cells, value, (bayes, share), ours, usual))
    for cell, state in zip(mast, best.cells, strict=True):
        one = evidence[cell]
        if state.kind == "fine":
            continue
        turn = state.value if np.isfinite(state.value) and state.kind == "offset" else 0.0
        usual_state = one.fine(turn)
        bayes = state.log_evidence - usual_state.log_evidence
        prior = PRIOR[state.kind]
        odds = bayes + np.log(prior) - np.log1p(-prior)
        sure = share / (1.0 + np.exp(-np.clip(odds, -700, 700)))
        value = state.offset_db if state.kind == "offset" else state.value
        found.append(
            _finding(
                scene,
                evidence,
                state.kind,
                (cell,),
                value,
                (bayes, float(sure)),
                {cell: state},
                {cell: usual_state},
            )
        )
    return [one for one in found if one.probability >= _SURE]


def _pairs(count: int) -> int:
    return count * (count - 1) // 2


def _finding(
    scene: Scene,
    evidence: Sequence[CellEvidence],
    kind: FaultKind,
    cells: Sequence[int],
    value: float,
    known: tuple[float, float],
    ours: dict[int, Explanation],
    usual: dict[int, Explanation],
) -> Finding:
    gain = np.zeros(scene.journeys)
    for c in cells:
        # With enough visits even a narrow prior lets a cell have its offset.
        gain += ours[c].by_journey
        gain -= usual[c].unshifted if kind == "offset" else usual[c].by_journey
    with_visits = {int(j) for c in cells for j in np.unique(evidence[c].visits.journey)}
    return Finding(
        kind,
        tuple(scene.patterns.plan.ids[c] for c in cells),
        float(value),
        float(known[0]),
        float(known[1]),
        len(with_visits),
        int(np.sum(gain > 0)),
        next((ours[c].place_m for c in cells if ours[c].place_m is not None), None),
    )


def _across(
    scene: Scene,
    evidence: Sequence[CellEvidence],
    findings: list[Finding],
    chosen: dict[int, Explanation],
) -> tuple[list[Finding], dict[int, Explanation]]:
    """Find cells that have the levels of each other, on different masts."""
    patterns = scene.patterns
    mast_of = {cell: n for n, mast in enumerate(patterns.masts) for cell in mast}
    received = [int(one.visits.received.sum()) for one in evidence]
    able = [cell for cell, count in enumerate(received) if count >= _LEAST_RECEIVED]
    places = np.array([[c.east_m, c.north_m] for c in patterns.plan.cells])
    pairs = []
    for first in able:
        away = np.hypot(*(places - places[first]).T)
        near = [c for c in np.argsort(away).tolist() if c in able and c > first]
        pairs += [(first, c) for c in near[:_NEAREST_CELLS] if mast_of[c] != mast_of[first]]
    if not pairs:
        return findings, chosen
    each = np.log(PRIOR["swapped"] / len(pairs))
    scored = []
    for first, second in pairs:
        other = evidence[first].mixed(other=second) + evidence[second].mixed(other=first)
        own = chosen[first].log_evidence + chosen[second].log_evidence
        scored.append((other - own, first, second))
    taken: set[int] = set()
    for bayes, first, second in sorted(scored, reverse=True):
        odds = bayes + each
        if odds < np.log(_SURE / (1 - _SURE)) or taken & {first, second}:
            continue
        taken |= {first, second}
        pair = first, second
        ours = {a: replace(evidence[a].fine(other=b), kind="fine") for a, b in (pair, pair[::-1])}
        usual = {a: evidence[a].fine() for a in pair}
        names = {patterns.plan.ids[a] for a in pair}
        findings = [one for one in findings if not names & set(one.cells)]
        sure = 1 / (1 + np.exp(-min(odds, 700.0)))
        known = float(bayes), float(sure)
        nothing = float("nan")
        findings.append(_finding(scene, evidence, "swapped", pair, nothing, known, ours, usual))
        chosen = chosen | ours
    return findings, chosen
