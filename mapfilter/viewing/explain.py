"""What each reading of an epoch contributes to one hypothesis against another, in nats.

A hypothesis is a set of the filter's weighted particles: those near the estimate, those near the
runner-up, or all of the alternative. The likelihood of an epoch's readings under it is the mean
likelihood of its particles, by their weights; readings are taken one after another, each given
those before it, so that their log-likelihoods add up to that of the epoch, and the differences of
two hypotheses to the change of their log odds. All likelihoods are those of the filter's model
(:meth:`~mapfilter.positioning.bayes.sources.evidence_model.EvidenceModel.weigh`), asked for the
first one, two, three readings and so on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from mapfilter._types import Bools, Floats, Floats32
from mapfilter.filters.grid import GridBelief
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleBelief
from mapfilter.filters.resampling import log_sum
from mapfilter.models.fingerprint import pixels
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate, RadioReading
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.bayes.weighing import weighed_by

TERMS = (
    "streets", "serving", "level", "absent", "bound", "timing", "fix", "gnss", "map", "other",
)  # fmt: skip
"""Kinds of contributions."""

_OF_SOURCE = {"timing": "timing", "first fix": "fix", "gnss": "gnss", "map": "map"}


class Contribution(NamedTuple):
    """What one reading contributes to the hypotheses, in nats; NaN where there is no such one.

    ``cell`` is its band on the area's map, -1 for none; ``measured_dbm`` its level, and the two
    others those predicted at the estimate and at the runner-up.
    """

    what: str
    cell: int
    measured_dbm: float
    lead_dbm: float
    runner_dbm: float
    lead: float
    runner: float
    alternative: float


@dataclass(frozen=True, slots=True)
class Explanation:
    """The contributions of all readings of an epoch.

    Parameters
    ----------
    rows : tuple of Contribution
        Streets first, then readings in the order in which the filter takes them.
    prior : float
        Log odds of the leading hypothesis against the runner-up before the epoch.
    withheld, alternative_withheld : float
        Log evidence of levels that the belief, and the alternative, are not weighed by: it is a
        part of the evidence of a belief that is tracked, but of no hypothesis.
    """

    rows: tuple[Contribution, ...]
    prior: float
    withheld: float = 0.0
    alternative_withheld: float = 0.0


class _Prefix(NamedTuple):
    """A reading and all before it."""

    what: str
    cell: int
    measured_dbm: float
    reading: RadioReading


def explain(
    filter_: BayesPositioner,
    before: BayesState,
    epoch: Any,
    rng: np.random.Generator,
    lead_m: tuple[float, float],
    runner_m: tuple[float, float],
) -> Explanation | None:
    """Explain one step of the map filter.

    Parameters
    ----------
    before : BayesState
        State before the step.
    rng : numpy.random.Generator
        As before the step.
    lead_m, runner_m : tuple of float
        East and north of the estimate and the runner-up in the area's frame; NaN for none.

    Returns
    -------
    Explanation or None
        None where there was no belief yet, and for beliefs that are not particles.
    """
    start = before.belief
    if start is None or isinstance(start, GridBelief):
        return None
    state, updates, measured = filter_.evidence_at(before, epoch, rng)
    belief = state.belief
    if not isinstance(belief, ParticleBelief):
        return None
    names = [source.name for source in filter_.sources]
    model = filter_.model
    sets = [_near(belief.state, lead_m), _near(belief.state, runner_m)]
    moved = _streets(start, belief, sets)
    reading = weighed_by(belief, updates, measured=measured)
    main = list(_prefixes(reading, updates, names, alternative=False))
    chain, withheld = _chain(model, belief, main, sets)
    own, withheld_beside = [*moved, *chain], 0.0
    other = state.alternative
    beside: list[tuple[float, ...]]
    if other is None or not isinstance(other.belief, ParticleBelief):
        beside = [(nan,)] * len(own)
    else:
        everywhere = [np.ones(other.belief.log_weight.size, dtype=np.bool_)]
        previous = before.alternative.belief if before.alternative is not None else other.belief
        terms = []
        if reading is not None:
            # As the step weighs: the alternative with the belief, also where it has no evidence.
            against = weighed_by(other.belief, updates, measured=measured, alternative=True)
            against = against or RadioReading()
            terms = list(_prefixes(against, updates, names, alternative=True))
        chain, withheld_beside = _chain(model, other.belief, terms, everywhere)
        beside = [*_streets(previous, other.belief, everywhere), *chain]
    heads = [("streets", -1, nan), *((one.what, one.cell, one.measured_dbm) for one in main)]
    rows = tuple(
        Contribution(
            what,
            cell,
            measured_dbm,
            level_at(model, lead_m, cell),
            level_at(model, runner_m, cell),
            pair[0],
            pair[1],
            third[0],
        )
        for (what, cell, measured_dbm), pair, third in zip(heads, own, beside, strict=True)
    )
    totals = [_log_sum(start.log_weight, one) for one in sets]
    prior = totals[0] - totals[1] if start.log_weight.size == sets[0].size else nan
    return Explanation(rows, prior, withheld, withheld_beside)


def level_at(model: BayesModel, place_m: tuple[float, float], cell: int) -> float:
    """Return the predicted level of a band at a place in the area's frame; NaN for none."""
    if cell < 0 or not np.isfinite(place_m).all():
        return nan
    pixel = pixels(np.array(place_m, dtype=np.float32)[:, None], model.area.frame)[0]
    return float(model.area.levels_at(np.array([pixel]), np.array([cell]))[0])


def _near(state: Floats32, place_m: tuple[float, float]) -> Bools:
    """Return which particles are of the hypothesis at a place."""
    found: Bools = np.hypot(state[0] - place_m[0], state[1] - place_m[1]) <= NEAR_M
    return found


def _log_sum(log_weight: Floats, some: Bools) -> float:
    """Return the logarithm of the sum of some weights; NaN without any."""
    chosen = log_weight[some] if some.size == log_weight.size else log_weight[:0]
    total = log_sum(chosen)
    return total if isfinite(total) else nan


def _streets(before: MapBelief, moved: MapBelief, sets: Sequence[Bools]) -> list[tuple[float, ...]]:
    """Return what the map contributed while hypotheses moved, as one row."""
    if before.log_weight.size != moved.log_weight.size:
        # Copies with other headings: they are not what they were.
        return [tuple(0.0 if one.any() else nan for one in sets)]
    return [tuple(_log_sum(moved.log_weight, s) - _log_sum(before.log_weight, s) for s in sets)]


def _chain(
    model: BayesModel, belief: ParticleBelief, prefixes: Sequence[_Prefix], sets: Sequence[Bools]
) -> tuple[list[tuple[float, ...]], float]:
    """Return the contribution of each reading, given those before it, and what all withhold."""
    rows: list[tuple[float, ...]] = []
    withheld = 0.0
    last = [_log_sum(belief.log_weight, one) for one in sets]
    for prefix in prefixes:
        weighed = belief.log_weight.copy()
        cloud, _ = model.weigh(belief.cloud, weighed, prefix.reading)
        withheld = cloud.withheld
        now = [_log_sum(weighed, one) for one in sets]
        rows.append(tuple(after - earlier for after, earlier in zip(now, last, strict=True)))
        last = now
    return rows, withheld


def _prefixes(
    reading: RadioReading | None,
    updates: Sequence[EvidenceUpdate],
    names: Sequence[str],
    *,
    alternative: bool,
) -> Iterator[_Prefix]:
    """Yield the reading's first part, its first two parts and so on; the last is the whole."""
    if reading is None:
        return
    levels = reading.levels
    so_far = replace(reading, levels=None, bounds=(), terms=())
    if reading.serving >= 0 or reading.serving_weight > 0:
        yield _Prefix("serving", reading.serving, nan, so_far)
    if levels is not None:
        for k in range(levels.cell.size):
            some = slice(k + 1)
            part = levels.with_absent(())._replace(
                cell=levels.cell[some], level_dbm=levels.level_dbm[some]
            )
            so_far = replace(so_far, levels=part)
            yield _Prefix("level", int(levels.cell[k]), float(levels.level_dbm[k]), so_far)
        so_far = replace(so_far, levels=levels)
        if levels.absent.size:
            yield _Prefix("absent", -1, float(levels.limit_dbm.min()), so_far)
    for count, bound in enumerate(reading.bounds, start=1):
        so_far = replace(so_far, bounds=reading.bounds[:count])
        cell = int(bound.cells[0]) if bound.cells.size == 1 else -1
        yield _Prefix("bound", cell, bound.level_dbm, so_far)
    first = 0
    for name, one in reversed(list(zip(names, updates, strict=True))):
        other = alternative and one.alternative_terms is not None
        first += len((one.alternative_terms or ()) if other else one.terms)
        both = len(one.terms) + len(one.alternative_terms or ())
        if both:
            so_far = replace(so_far, terms=reading.terms[:first])
            yield _Prefix(_OF_SOURCE.get(name, "other"), -1, nan, so_far)
