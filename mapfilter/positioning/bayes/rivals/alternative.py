"""The hypotheses that compete with a belief: the null hypothesis and an alternative.

Two hypotheses compete with the belief. The *null hypothesis* is that it describes none of what is
measured: the position is outside the map, or database and network do not belong together. It has
likelihoods of its own, which fit every reading moderately well. Its log odds against the belief are
bounded from below, as it may become true at any time: so they are a CUSUM (Page, 1954).

When they are large, most of the belief has left the area, where nothing can refute it, or a turned
phone is more probable, an *alternative* starts from scratch beside the belief. Both then predict
the same readings; the difference of their log evidence is the logarithm of the Bayes factor between
"the position is anywhere" and "the position is where the belief has it". The alternative has a null
hypothesis, too: one that is improbable beside it is *suspect*.

What follows from comparing the two is in :mod:`~mapfilter.positioning.bayes.rivals.transitions`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import exp, log, nan
from typing import TYPE_CHECKING, Any

from mapfilter.filters.grid import GridBelief
from mapfilter.filters.particle import ParticleBelief
from mapfilter.options import NotNegative, Options, Share
from mapfilter.positioning.bayes.rivals.hold import Hold

if TYPE_CHECKING:
    from mapfilter.positioning.bayes.sources.evidence import RadioReading

MapBelief = ParticleBelief | GridBelief

LEAST_LOG_ODDS = -12.0
_MOST_LOG_ODDS, _MARGIN_NATS = 12.0, 3.0
"""Bounds of the log odds; how far below the threshold of convergence that of a search is."""
_PRIOR_LOG_ODDS = log(0.05 / 0.95)
MAP_NATS_PER_M = 0.04
"""Negative log-likelihood of the map for each metre, under the null hypothesis."""


@dataclass(frozen=True, slots=True)
class AlternativeRules(Options):
    """Thresholds for starting, preferring and abandoning an alternative.

    Log Bayes factors are in favour of the alternative.

    Parameters
    ----------
    start_log_odds : float
        Log odds of the null hypothesis at which an alternative starts.
    search_threshold : float
        Log Bayes factor from which a belief that still searches is replaced.
    lost_threshold : float
        Log Bayes factor from which a belief that had converged is LOST and may be replaced: being
        carried away unmeasured is rare.
    confirm_mass : float
        Share of the alternative within 50 m of its leading position, at most 50 m from that of the
        belief, at which the belief is confirmed.
    abandon_threshold : float
        Log Bayes factor at which an alternative is abandoned.
    abandon_after_m : float
        Distance after which an undecided alternative is abandoned.
    converge_log_odds : float
        Largest log odds of the null hypothesis with which a belief converges, or an alternative
        wins.
    converge_threshold : float
        Lead over its alternative, as a log Bayes factor, that a belief needs to converge.
    map_nats_per_m : float
        Negative log-likelihood of the map for each metre under the null hypothesis.
    claimed_from : float
        Least probability of being within 50 m with which a tracked position is claimed; with less
        it is UNCERTAIN.
    takes_over_searching : bool
        An alternative that is ahead of a belief that had converged replaces it at once, and has to
        converge anew.
    """

    start_log_odds: float = -1.0
    search_threshold: float = 4.0
    lost_threshold: float = 8.0
    confirm_mass: Share = 0.9
    abandon_threshold: float = -25.0
    abandon_after_m: NotNegative = 800.0
    converge_log_odds: float = -12.0
    converge_threshold: float = 2.0
    map_nats_per_m: NotNegative = MAP_NATS_PER_M
    claimed_from: Share = 0.95
    takes_over_searching: bool = False

    def least_log_odds(self, *, searching: bool) -> float:
        """Return the bound of the null hypothesis, lower while a belief has to refute it."""
        return min(LEAST_LOG_ODDS, self.converge_log_odds - _MARGIN_NATS if searching else 0.0)


@dataclass(frozen=True, slots=True)
class NullHypothesis:
    """Log odds that a belief describes none of what is measured.

    ``travelled_m`` is the distance that the belief had travelled at the last reading.
    """

    log_odds: float = _PRIOR_LOG_ODDS
    travelled_m: float = 0.0

    @property
    def probability(self) -> float:
        """Its probability beside the belief."""
        return 1 / (1 + exp(-self.log_odds))

    def after(
        self,
        reading: RadioReading,
        other_log_likelihood: float,
        gained: float,
        travelled_m: float,
        map_nats_per_m: float = MAP_NATS_PER_M,
        least_log_odds: float = LEAST_LOG_ODDS,
    ) -> NullHypothesis:
        """Add a reading.

        Parameters
        ----------
        other_log_likelihood : float
            Of its levels, if the prediction is wrong about all cells.
        gained : float
            Log-likelihood of the reading, and of the map since the last one, under the belief.
        travelled_m : float
            By the belief.
        map_nats_per_m : float
            Negative log-likelihood of the map for each metre, under the null hypothesis.
        least_log_odds : float
            Bound from below: the null hypothesis may become true at any time.
        """
        expected = reading.radio_under_null(other_log_likelihood) + reading.under_null
        expected -= map_nats_per_m * (travelled_m - self.travelled_m)
        log_odds = self.log_odds + expected - gained
        return NullHypothesis(min(max(log_odds, least_log_odds), _MOST_LOG_ODDS), travelled_m)

    def reset(self) -> NullHypothesis:
        """Return it as at the start, unless it is less probable."""
        return replace(self, log_odds=min(self.log_odds, _PRIOR_LOG_ODDS))


@dataclass(frozen=True, eq=False)
class AlternativeHypothesis:
    """A second belief, started from scratch.

    Parameters
    ----------
    start_m, start_s : float
        Distance travelled and time at its start.
    main_log_evidence : float
        Log evidence of the main belief at its start; less the log odds of a turned phone whose
        belief has taken over since.
    sources : mapping of str to object
        State of the sources of evidence that depends on the belief.
    gnss_log_bayes_factor : float
        Contribution of rejected satellites to the log Bayes factor; bounded, as all may be faulty.
    null : NullHypothesis
        Beside the alternative itself.
    hold : Hold
        How it reads headings, and the unit in which it reads lengths of steps.
    """

    belief: MapBelief
    start_m: float
    main_log_evidence: float
    start_s: float = nan
    sources: Mapping[str, Any] = field(default_factory=dict)
    gnss_log_bayes_factor: float = 0.0
    null: NullHypothesis = field(default_factory=NullHypothesis)
    hold: Hold = field(default_factory=Hold)

    def log_bayes_factor(self, main: MapBelief) -> float:
        """Return the logarithm of the Bayes factor in favour of the alternative."""
        by_readings = self.belief.log_evidence - (main.log_evidence - self.main_log_evidence)
        return by_readings + self.gnss_log_bayes_factor

    def beside(self, log_prior: float) -> AlternativeHypothesis:
        """Return it beside a belief that has taken over, which had such log odds beforehand."""
        return replace(self, main_log_evidence=self.main_log_evidence - log_prior)
