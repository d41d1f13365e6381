"""Time differences of arrival as evidence, whose errors are other than stated.

What is stated of them seldom includes paths that are longer than the line of sight, and never a
clock that is off, or a mast that stands elsewhere. So all deviations are taken times an unknown
factor, and one station may be at fault: its time then says nothing. Each reading is a mixture over
these cases. How probable they are is learnt from the readings, by Bayes' rule, each with the mean
of its likelihood over the belief.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import log
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.models.gaussian import GaussianTerms
from mapfilter.models.ranging import difference_covariance
from mapfilter.positioning.bayes.rivals.alternative import MapBelief

FACTORS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Factors of stated deviations."""
PRIOR = (0.3, 0.25, 0.2, 0.12, 0.08, 0.05)
FAULT = 0.2
"""Probability of each factor, and of a station's fault, before any reading."""
_FAULT_M, _FAULT_NATS = 10_000.0, 0.6
"""Deviation of the time of a station at fault, as a distance, with which it says nothing; what each
reading costs, more than the half nat by which its best place fits better without a station."""
NULL_FACTOR = 1.5
"""Log-likelihood under the null hypothesis, as a multiple of what is expected of the belief."""
_CHANGES, _LEAST, _RARE, _SUREST = 0.02, 1e-300, 1e-4, 0.999
"""How often errors become any others between independent readings; least likelihood; probability
below which a case is left out; largest one of a fault."""
_KEPT = 0.3
"""Share of the most probable case from which on none is left out: of dozens of stations none is at
fault but rarely, nor one alone."""


class DifferenceErrors(NamedTuple):
    """What is known of the errors of time differences.

    Parameters
    ----------
    shares : tuple of float
        Probability of each of :data:`FACTORS`.
    faults : tuple of (str, float)
        Stations that were compared, by the names of their cells, with the probability of a fault.
    """

    shares: tuple[float, ...] = PRIOR
    faults: tuple[tuple[str, float], ...] = ()

    def fault_of(self, station: str) -> float:
        """Return the probability that a station is at fault."""
        return dict(self.faults).get(station, FAULT)

    def after(self, terms: Sequence[DifferenceTerm], belief: MapBelief) -> DifferenceErrors:
        """Return it after readings, whose place is as probable as a belief has it."""
        known, state = self, belief.state
        weight = belief.weight.astype(np.float64)
        for one in terms:
            # What the readings before have shown of the errors is known to the next.
            term = replace(one, errors=known)
            likely = np.exp(term.log_densities(state)) @ weight + _LEAST
            odds = np.log([case.probability for case in term.cases]) + term.weight * np.log(likely)
            found = np.exp(odds - odds.max())
            known = known._found(term, found / found.sum())
        return known

    def _found(self, term: DifferenceTerm, probability: Floats) -> DifferenceErrors:
        """Return it by the probabilities of a term's cases; a little of it is forgotten."""
        shares, faults = dict.fromkeys(FACTORS, 0.0), dict.fromkeys(term.stations, 0.0)
        for case, odds in zip(term.cases, probability.tolist(), strict=True):
            shares[case.factor] += odds
            if case.at_fault is not None:
                faults[term.stations[case.at_fault]] += odds
        new = _CHANGES * term.weight
        known = [(1 - new) * shares[f] + new * p for f, p in zip(FACTORS, PRIOR, strict=True)]
        learnt = {name: (1 - new) * odds + new * FAULT for name, odds in faults.items()}
        return DifferenceErrors(tuple(known), tuple({**dict(self.faults), **learnt}.items()))


class Case(NamedTuple):
    """Errors that a reading may have.

    ``whitens`` is the inverse of the Cholesky factor of their covariance, ``log_scale`` the
    logarithm of the density's factor, beside that of stated errors.
    """

    probability: float
    factor: float
    at_fault: int | None
    whitens: Floats
    log_scale: float


@dataclass(frozen=True, eq=False)
class DifferenceTerm:
    """Log-likelihood of time differences that share a reference, whatever their errors are.

    Parameters
    ----------
    model : GaussianTerms
        Of east and north in the frame of the hypotheses.
    reading_m : (m,) array
        Measured differences of distances.
    stations : tuple of str
        The reference and the m others.
    sigma_m : (m + 1,) array
        Stated deviations of their times of arrival.
    weight : float
        Share of the reading that is new, 0 to 1.
    clip_sd : float
        Largest innovation in standard deviations; outliers count as this.
    errors : DifferenceErrors
    """

    model: GaussianTerms
    reading_m: Floats
    stations: tuple[str, ...]
    sigma_m: Floats
    weight: float
    clip_sd: float
    errors: DifferenceErrors

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """Errors that the reading may have; the rarest are left out."""
        errors = self.errors
        faults = [min(errors.fault_of(station), _SUREST) for station in self.stations]
        none = float(np.prod([1 - odds for odds in faults]))
        at_fault: list[tuple[int | None, float]] = [(None, none)]
        at_fault += [(k, none * odds / (1 - odds)) for k, odds in enumerate(faults)]
        found, count = [], self.reading_m.size
        most = max(odds for _, odds in at_fault) * max(errors.shares)
        least = min(_RARE, _KEPT * most)
        for (station, odds), (factor, share) in product(
            at_fault, zip(FACTORS, errors.shares, strict=True)
        ):
            if odds * share < least:
                continue
            sigma_m = factor * self.sigma_m
            log_scale = -count * log(factor)
            if station is not None:
                sigma_m[station] = _FAULT_M
                # A fault lasts: what it adds is unknown once, and not anew in each reading.
                log_scale -= _FAULT_NATS
            whitens = np.linalg.inv(np.linalg.cholesky(difference_covariance(sigma_m, 0)))
            found.append(Case(odds * share, factor, station, whitens, log_scale))
        return tuple(found)

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return the log-likelihood of each hypothesis."""
        log_odds = np.log([case.probability for case in self.cases])[:, None]
        each = log_odds + self.log_densities(state)
        highest = each.max(axis=0)
        total = np.exp(each - highest).sum(axis=0)
        return np.asarray(self.weight * (highest + np.log(total)))

    def log_densities(self, state: Floats32) -> Floats:
        """Return the log density of each hypothesis (N,) in each case, (C, N)."""
        off = (self.reading_m - self.model.mean(state[:2].T.astype(np.float64))).T
        most = self.clip_sd**2 * self.reading_m.size
        found = np.empty((len(self.cases), off.shape[1]))
        for one, case in zip(found, self.cases, strict=True):
            white = case.whitens @ off
            one[:] = case.log_scale - 0.5 * np.minimum(np.sum(white**2, axis=0), most)
        return found

    @property
    def under_null(self) -> float:
        """Log-likelihood under the null hypothesis, from what is expected at the true position."""
        scaled = [log(case.probability) + case.log_scale for case in self.cases]
        expected = -0.5 * NULL_FACTOR * self.reading_m.size
        return float(self.weight * (expected + np.logaddexp.reduce(scaled)))
