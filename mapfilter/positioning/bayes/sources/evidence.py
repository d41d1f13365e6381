"""Sources of evidence: each turns an epoch's measurements of one kind into log-likelihood terms.

The map filter asks every source at every epoch and adds up what they return. A source keeps its
state under its name in :attr:`~mapfilter.positioning.bayes.state.BayesState.sources`; what depends
on a belief (a receiver's clock) is kept beside that belief, for the alternative in
:attr:`~mapfilter.positioning.bayes.rivals.alternative.AlternativeHypothesis.sources`.
A new kind of measurement is a class derived from :class:`EvidenceSource`; an instance in
:attr:`~mapfilter.positioning.bayes.filter.BayesPositioner.more_sources` suffices.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log, nan
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

from mapfilter._same import EqualByValue
from mapfilter._types import Floats, Floats32
from mapfilter.filters.contract import Reason
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.fingerprint import BoundReading
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.level_memory import OTHER_DBM, OTHER_SD_DB
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.beliefs.path import RecentPath
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis, MapBelief
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.gnss.trail import Contradiction
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.tracks.schema import Kind

SERVING_UNDER_NULL = -0.7
"""Log-likelihood, under the null hypothesis, of a serving cell at full weight."""
_UNKNOWN_NATS = 0.5
"""Gain from a serving cell that the map does not have."""


class Term(Protocol):
    """A log-likelihood over hypotheses."""

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return the value for each hypothesis, shape (N,), or one for all, shape (1,).

        Parameters
        ----------
        state : (STATES, N) array
            Rows as in :mod:`mapfilter.models.street_motion`: ``state[EAST]`` and ``state[NORTH]``
            in metres from the south-western corner of the area's lattice.
        """


@runtime_checkable
class PlacedTerm(Term, Protocol):
    """A log-likelihood that is largest, and 0, at a known place: that of a position fix."""

    @property
    def place_m(self) -> tuple[float, float]:
        """East and north of the place in the frame of the hypotheses."""


@dataclass(frozen=True, eq=False)
class FixedTerm:
    """A log-likelihood computed beforehand: for each hypothesis of one belief, or one for all."""

    value: Floats

    def log_likelihood(self, state: Floats32) -> Floats:  # noqa: ARG002
        """Return the value."""
        return self.value


@dataclass(frozen=True, slots=True, eq=False)
class RadioReading(EqualByValue):
    """One radio report and the terms of other sources, as the filter's model weighs them.

    Parameters
    ----------
    serving : int
        Band of the serving cell; -1 where none is used.
    serving_weight : float
        Power of the serving cell's likelihood; with a band of -1 that of a cell that the map does
        not have, 0 where none serves.
    levels : LevelReport or None
        Levels inside the scale, and cells that are absent.
    bounds : tuple of BoundReading
        Levels at an end of the scale, and levels of one of several candidate cells.
    terms : tuple of Term
        Of timing, fixes and satellites; added after the report, in this order.
    under_null : float
        Log-likelihood of the terms under the null hypothesis.
    doubted : bool
        Whether the null hypothesis, or an alternative, is too probable for a belief to converge.
    tracked : bool
        Whether the belief has been found and goes on by motion that is measured.
    length_m : float
        Distance since the last report that was used; 0 for the first.
    timing_advance : float
        Of the serving cell, in steps; NaN if not reported. Used by models with measured maps only.
    serving_under_null : float
        Log-likelihood of the serving cell at full weight, under the null hypothesis.
    belief : MapBelief or None
        The belief that is weighed, as it was before: at the edge of the area it does not converge.
    """

    serving: int = -1
    serving_weight: float = 0.0
    levels: LevelReport | None = None
    bounds: tuple[BoundReading, ...] = ()
    terms: tuple[Term, ...] = ()
    under_null: float = 0.0
    length_m: float = 0.0
    timing_advance: float = nan
    doubted: bool = False
    tracked: bool = False
    serving_under_null: float = SERVING_UNDER_NULL
    belief: MapBelief | None = None

    def weighing(self, belief: MapBelief, *, tracked: bool, doubted: bool) -> RadioReading:
        """Return the reading with what it depends on besides: the belief that it weighs."""
        return RadioReading(
            self.serving,
            self.serving_weight,
            self.levels,
            self.bounds,
            self.terms,
            self.under_null,
            self.length_m,
            self.timing_advance,
            doubted,
            tracked,
            self.serving_under_null,
            belief,
        )

    def for_other_hypotheses(self) -> RadioReading:
        """Return the reading without terms that hold for the hypotheses of one belief only."""
        own = [isinstance(one, FixedTerm) and one.value.size > 1 for one in self.terms]
        if not any(own):
            return self
        kept = tuple(one for one, drop in zip(self.terms, own, strict=True) if not drop)
        return replace(self, terms=kept)

    def at_edge(self, area: AreaFrame) -> bool:
        """Return whether the belief lies at the edge of an area."""
        belief = self.belief
        if belief is None:
            return False
        if isinstance(belief, ParticleBelief) and area.clear_of_edge(belief.state):
            # A summary takes longer.
            return False
        return area.at_edge(belief.summary.mean)

    def radio_under_null(self, other_log_likelihood: float) -> float:
        """Return the log-likelihood of the report under the null hypothesis.

        ``other_log_likelihood`` is that of its levels if the prediction is wrong about all cells.
        """
        each = self.serving_under_null if self.serving >= 0 else _UNKNOWN_NATS
        bounds = sum(bound_under_null(bound) for bound in self.bounds)
        return other_log_likelihood + each * self.serving_weight + bounds


def bound_under_null(bound: BoundReading) -> float:
    """Return the log-likelihood, under the null hypothesis, of a bound or of an ambiguous level.

    A level is then a draw from those that phones report. On the map the likelihood is the mean over
    the n cells that it may be of, most of which do not fit it: ``-log n`` makes up for that mean.
    Ends of the scale are as probable as on the map where they agree.
    """
    if bound.censored != 0:
        return 0.0
    variance_db2 = OTHER_SD_DB**2 + bound.sd_db**2
    density = log(bound.sd_db**2 / variance_db2) - (bound.level_dbm - OTHER_DBM) ** 2 / variance_db2
    return bound.weight * (0.5 * density - log(bound.cells.size))


class Context(NamedTuple):
    """Quantities of an epoch that sources need besides the filter's state.

    ``particle_spacing_m`` is how far the hypotheses nearest to the true position may lie from it;
    ``report_due`` whether the epoch's radio report is used.
    """

    particle_spacing_m: float
    report_due: bool


class EvidenceUpdate(NamedTuple):
    """What one source contributes at one epoch.

    ``state`` is the source's state afterwards. ``terms`` hold for both beliefs unless
    ``alternative_terms`` are given. ``under_null`` is the log-likelihood of the terms under the
    null hypothesis, that of the alternative in ``alternative_under_null`` if it differs. ``belief``
    and ``alternative`` replace those of the filter unless None. ``disputed`` asks for an
    alternative. ``radio`` and ``reason`` (whether the serving cell is used) come from the radio
    reports only. Beliefs in which the phone was turned are weighed by ``rival_terms``, too.
    ``path`` is the way that a belief starts with, where the map alone is the
    evidence. ``contradiction`` is a way by fixes that the belief rejects. ``refuted`` is whether a
    position is where none of the hypotheses of a search is that spread without any motion, or none
    is left: it begins anew.
    """

    state: Any
    terms: tuple[Term, ...] = ()
    alternative_terms: tuple[Term, ...] | None = None
    under_null: float = 0.0
    unused: Sequence[UnusedReading] = ()
    belief: MapBelief | None = None
    alternative: AlternativeHypothesis | None = None
    disputed: bool = False
    radio: RadioReading | None = None
    reason: Reason | None = None
    path: RecentPath | None = None
    alternative_under_null: float | None = None
    rival_terms: tuple[Term, ...] = ()
    contradiction: Contradiction | None = None
    refuted: bool = False


class EvidenceSource(ABC):
    """One source of evidence.

    ``kinds`` are the kinds of measurements of a log that it uses. Those that no source of a filter
    uses are reported as not used. ``is_position`` is whether its readings are positions, or make
    them.
    """

    name: ClassVar[str]
    kinds: ClassVar[frozenset[Kind]] = frozenset()
    is_position: ClassVar[bool] = False

    def begin(self) -> Any:
        """Return the state before the first epoch."""
        return None

    @abstractmethod
    def first(self, epoch: Epoch) -> EvidenceUpdate:
        """Return evidence for a belief that is not started yet, without regard to past epochs.

        Also called for an alternative, which starts from one epoch while the belief goes on.
        """

    def first_after(self, state: BayesState, epoch: Epoch) -> EvidenceUpdate:  # noqa: ARG002
        """Return evidence for a first belief or an alternative, with regard to the motion so far.

        Only sources that need that motion differ from :meth:`first`.
        """
        return self.first(epoch)

    def start(self, belief: MapBelief, epoch: Epoch, travelled_m: float) -> tuple[MapBelief, Any]:  # noqa: ARG002
        """Adapt a belief just started; also return the state that depends on it, None if none."""
        return belief, None

    def beside_other(self, state: Any) -> Any:
        """Return the state when the belief is replaced by one that the source has not adapted.

        Such is a belief in which the phone was turned. Only sources differ whose state depends on
        a belief.
        """
        return state

    def distrusted(self, state: Any, time_s: float) -> Any:  # noqa: ARG002
        """Return the state when a belief takes over that was weighed without positions.

        Sources of positions have been rejecting them since.
        """
        return self.beside_other(state)

    @abstractmethod
    def update(self, state: BayesState, epoch: Epoch, context: Context) -> EvidenceUpdate:
        """Return evidence for the belief and its alternative, both moved already."""


def joined(updates: Sequence[EvidenceUpdate], *, alternative: bool = False) -> RadioReading | None:
    """Combine the evidence of all sources, for the belief or its alternative; None without any.

    Terms are added in the reverse order of the sources: radio first, satellites last.
    """
    radio: RadioReading | None = None
    terms: tuple[Term, ...] = ()
    for one in updates:
        radio = one.radio if radio is None else radio
        other = alternative and one.alternative_terms is not None
        terms = ((one.alternative_terms or ()) if other else one.terms) + terms
    if radio is None and not terms:
        return None
    radio = radio or RadioReading()
    under_null = radio.under_null
    for one in updates:
        other = alternative and one.alternative_under_null is not None
        under_null += (one.alternative_under_null or 0.0) if other else one.under_null
    if not terms and under_null == radio.under_null:
        # A radio report has no terms of its own.
        return radio
    return replace(radio, terms=terms, under_null=under_null)
