"""State of the map filter after an epoch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import nan, sqrt
from typing import Any, NamedTuple

from mapfilter._changes import changed
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.filters.contract import Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.beliefs.legs import NO_LEG, Lead, Leg, moved_on
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning as DeadReckoning
from mapfilter.positioning.bayes.beliefs.path import RecentPath
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.rivals.alternative import (
    AlternativeHypothesis,
    MapBelief,
    NullHypothesis,
)
from mapfilter.positioning.bayes.rivals.bends import NO_DIRECTION, Straight
from mapfilter.positioning.bayes.rivals.half_turns import HalfTurns
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.step_output import StepOutput

FIRST_SPACING_M = 5.0
"""Assumed distance between hypotheses before there are any."""

_STREET_SHARE = 0.3
_MIN_SPACING_M = 1.5


@dataclass(frozen=True, eq=False, repr=False)
class BayesState:
    """State of the map filter after an epoch.

    Parameters
    ----------
    belief : MapBelief or None
        None before the first report with a known cell, fix or satellite, and where all mass of a
        grid has left the area.
    status : Status
        As reported; that of the belief may differ while it is LOST or UNCERTAIN.
    contested : bool
        LOST only because a belief in which the phone was turned, or one without positions, is
        ahead, or because the phone may have been carried on though no step is counted.
    sources : mapping of str to object
        State of each source of evidence by its name.
    reckoning : DeadReckoning
        Since the belief was started.
    heading_rad : float
        Of the last step; without a compass relative to the first one.
    compass : bool
        Headings are those of a compass.
    null : NullHypothesis
        That the belief describes none of what is measured.
    alternative : AlternativeHypothesis or None
        Tested against the belief; None while nothing contradicts it.
    takeovers : int
        Number of alternatives that have replaced the belief.
    path : RecentPath
        The last metres, where the map alone may start a belief.
    reported : Reported or None
        The last output, which stays as it is as long as the belief does.
    watch : SensorWatch
        Whether sensors still measure.
    last_fix : GnssFix or None
        The last one that was used.
    recovery : Recovery or None
        Of a position that was lost though its belief did not search again, or was uncertain, until
        it is claimed.
    twin : MirroredTwin or None
        The mirrored motion, while a belief by the map alone has to prove itself.
    hold : Hold
        How headings are read, and the unit of steps.
    walking_rad : float
        Heading of the last row of a walk, as measured.
    straight : Straight
        Direction of the last metres of a walk, as measured.
    held : tuple of HeldOtherwise
        Beliefs in which the phone was turned, tested against the belief.
    half_turns : HalfTurns
        Half turns of the journey that were the walker's.
    alternatives : int
        Number of alternatives that were started.
    unaided : tuple of HeldOtherwise
        Beliefs without positions, beside one that is weighed by them: at most one that began as
        that, and one that began from scratch.
    proven : bool
        Whether the belief's place was found without positions, too, or that was tried.
    alone_from_m : float
        Distance travelled at the start of the last belief without positions that took over; NaN if
        none did.
    area : str
        Checksum of the area that it is of; empty where nobody states it.
    leg : Leg
        Steps by which its beliefs have not been moved yet.
    """

    belief: MapBelief | None = None
    status: Status = Status.SEARCHING
    contested: bool = False
    sources: Mapping[str, Any] = field(default_factory=dict)
    reckoning: DeadReckoning = field(default_factory=DeadReckoning)
    heading_rad: float = nan
    compass: bool = True
    null: NullHypothesis = field(default_factory=NullHypothesis)
    alternative: AlternativeHypothesis | None = None
    takeovers: int = 0
    path: RecentPath = field(default_factory=RecentPath)
    reported: Reported | None = None
    watch: SensorWatch = field(default_factory=SensorWatch)
    last_fix: GnssFix | None = None
    recovery: Recovery | None = None
    twin: MirroredTwin | None = None
    hold: Hold = field(default_factory=Hold)
    walking_rad: float = nan
    straight: Straight = NO_DIRECTION
    held: tuple[HeldOtherwise, ...] = ()
    half_turns: HalfTurns = field(default_factory=HalfTurns)
    alternatives: int = 0
    unaided: tuple[HeldOtherwise, ...] = ()
    proven: bool = False
    alone_from_m: float = nan
    area: str = ""
    leg: Leg = NO_LEG

    def __repr__(self) -> str:
        """Return status, hypotheses and way in one line."""
        count = 0 if self.belief is None else self.belief.count
        held = number_of(count, "hypothesis", "hypotheses")
        return f"<BayesState {self.status}: {held}, {self.reckoning.travelled_m:.0f} m travelled>"

    def with_output(self, reported: Reported) -> BayesState:
        """Return the state with its output."""
        return changed(self, reported=reported)

    def begun_anew(self) -> BayesState:
        """Return the state without its belief, of which nothing is left, or nothing is to be used.

        What was found out beside it, too, begins with the next one.
        """
        found = self.status in (Status.CONVERGED, Status.TRACKING, Status.UNCERTAIN)
        return changed(
            self,
            belief=None,
            status=Status.LOST if found else self.status,
            null=NullHypothesis(),
            alternative=None,
            recovery=None,
            twin=None,
            held=(),
            half_turns=self.half_turns.anew(),
            unaided=(),
            proven=False,
            leg=NO_LEG,
        )

    @property
    def rivals(self) -> tuple[HeldOtherwise, ...]:
        """Beliefs that compete with the main one, by what they assume of phone and positions."""
        return (*self.held, *self.found_alone)

    @property
    def found_alone(self) -> tuple[HeldOtherwise, ...]:
        """Beliefs without positions that have a place: a search gains and loses by chance."""
        return tuple(one for one in self.unaided if one.belief.status is Status.TRACKING)

    @property
    def particle_spacing_m(self) -> float:
        """Distance between hypotheses along the streets that the belief covers."""
        belief = self.belief
        if belief is None or not belief.count:
            return FIRST_SPACING_M
        area_m2 = _STREET_SHARE * belief.bins.size_m**2 * belief.summary.effective_bins
        return max(sqrt(area_m2 / belief.count), _MIN_SPACING_M)


def belief_here(state: BayesState) -> MapBelief | None:
    """Return the belief with its hypotheses where dead reckoning has led them by now."""
    belief, leg = state.belief, state.leg
    if not leg.rows or not isinstance(belief, ParticleBelief):
        return belief
    return replace(belief, state=moved_on(belief.state, leg.gone_m(state.reckoning)))


def check_state(state: BayesState, area: AreaFrame) -> None:
    """Check that a state, which may have been saved, is one of this area.

    Raises
    ------
    InputError
        It is of another area, or no state of this filter.
    """
    given: Any = state
    if not isinstance(given, BayesState):
        got = f"a {type(given).__name__}"
    elif given.area and given.area != area.checksum:
        got = "one of another"
    else:
        return
    expected = "a state of this database, of begin, begin_at or step"
    hint = "the database was built again; begin anew"
    raise fail(InputError, "state", expected, got, hint)


class Reported(NamedTuple):
    """An output, and the belief, the status and the probability of no hypothesis it was made of.

    ``lead`` is how that belief goes on by dead reckoning; None where nobody has asked yet.
    """

    belief: MapBelief | None
    status: Status
    p_none: float
    output: StepOutput
    lead: Lead | None = None
