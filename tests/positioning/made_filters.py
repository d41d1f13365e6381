"""Made filters, areas and sources, which beliefs are weighed with: each answers as it is told."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np

from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.bayes.rivals.alternative import (
    AlternativeHypothesis,
    AlternativeRules,
    NullHypothesis,
)
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules, PullRules
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate, FixedTerm
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.bayes.weighing import Weighing
from mapfilter.positioning.epochs import Epoch

SEARCHING, CONVERGED, TRACKING = Status.SEARCHING, Status.CONVERGED, Status.TRACKING
RULES = AlternativeRules(
    start_log_odds=-1.0, search_threshold=4.0, lost_threshold=8.0, converge_log_odds=-5.0,
    map_nats_per_m=0.1,
)  # fmt: skip


def belief(status=TRACKING, log_evidence=-10.0, *, east_m=500.0, travelled_m=40.0):
    """All hypotheses at one place, 400 m north."""
    place = np.array([[east_m] * 4, [400.0] * 4], dtype=np.float32)
    return ParticleBelief(
        place, np.full(4, -np.log(4.0)), Bins.over((0.0, 0.0, 1000.0, 1000.0)),
        np.empty((0, 4), dtype=np.float32), travelled_m=travelled_m, log_evidence=log_evidence,
        status=status,
    )  # fmt: skip


def gaining(gained, *, status=None, reason=Reason.USED):
    """A filter whose update adds to the log evidence, and which starts beliefs anew."""
    made = SimpleNamespace(readings=[], priors=[])

    def update(given, reading, rng):
        rng.random()
        made.readings.append(reading)
        after = replace(given, log_evidence=given.log_evidence + gained)
        return replace(after, status=status or given.status), SimpleNamespace(reason=reason)

    def init(prior, rng):
        rng.random()
        made.priors.append(prior)
        return belief(SEARCHING, 0.0, travelled_m=0.0)

    made.update, made.init = update, init
    return made


@dataclass
class Area:
    edge: bool = False
    inside: bool = True
    cell_ids: tuple = ("A",)
    origin_m: tuple = (1000.0, 2000.0)

    def at_edge(self, place_m):
        return self.edge and place_m[0] == 500.0

    def holds_all(self, east_m, north_m):
        return self.inside and (east_m > 400.0).all() and (north_m == 400.0).all()

    def holds(self, east_m, north_m, weight):
        return self.inside and (east_m > 400.0).all() and north_m.size == weight.size


@dataclass
class Beliefs:
    """What is asked for of the filters, as it is told."""

    filter: object = field(default_factory=lambda: gaining(-2.0))
    area: Area = field(default_factory=Area)
    by_map: bool = False
    contested: bool = False
    unit_m: float = 1.0
    lanes: object = None
    held_otherwise: object = field(default_factory=lambda: gaining(-2.0))
    around: object = field(default_factory=lambda: gaining(-2.0))
    holds: HoldRules = field(default_factory=HoldRules)
    pulls: PullRules = field(default_factory=PullRules)
    positions: bool = False
    positioned: bool = False
    asks: bool = False
    looks: bool = False

    @property
    def model(self):
        return SimpleNamespace(area=self.area, weights=MapWeights())

    @property
    def alone(self):
        return self.held_otherwise

    def filter_of(self, state):
        assert state.belief is not None
        return self.filter

    def moving_filter(self, state, *, compass):
        assert compass == state.compass
        return self.filter

    def rules_of(self, _):
        return RULES

    def by_map_alone(self, _):
        return self.by_map

    def is_positioned(self, _):
        return self.positioned

    def by_carriageways(self, _):
        return self.lanes

    def other_unit_m(self, _):
        return self.unit_m

    def goes_by_ways(self, _):
        return False

    def is_contested(self, _):
        return self.contested

    def used_positions(self, _):
        return self.positions

    def asks_for_proof(self, _):
        return self.asks

    def asks_for_look(self, *_, taken_over):  # noqa: ARG002
        return self.looks


@dataclass
class Source:
    """A source that knows what to say at first, and of a belief that is just started."""

    name: str = "one"
    is_position: bool = False
    at_first: EvidenceUpdate = field(default_factory=lambda: EvidenceUpdate(None, (TERM,)))
    own: object = "started"

    def first_after(self, _, epoch):
        assert epoch.time_s == 9.0
        return self.at_first

    def start(self, given, epoch, travelled_m):
        assert (epoch.time_s, travelled_m) == (9.0, 40.0)
        return given, self.own

    def beside_other(self, state):
        return f"{state} anew"

    def distrusted(self, state, time_s):
        return f"{state} distrusted at {time_s:.0f} s"


TERM = FixedTerm(np.full(1, -1.0))
UPDATES = [EvidenceUpdate(None, (TERM,), under_null=-1.5)]
STATE = BayesState(
    belief=belief(), status=TRACKING, sources={"one": "before", "two": 2},
    reckoning=DeadReckoning(travelled_m=40.0), null=NullHypothesis(-6.0, 30.0),
)  # fmt: skip


def weighed(beliefs=None, state=STATE, updates=UPDATES, *, measured=True, source=None):
    weighing = Weighing(beliefs or Beliefs(), None, (source or Source(),))
    rng = np.random.default_rng(1)
    return weighing.weighed(state, state.belief, updates, Epoch(9.0), rng, measured=measured)


def rival(log_evidence=0.0, *, status=SEARCHING, null=-6.0, east_m=800.0, **more):
    other = belief(status, log_evidence, east_m=east_m)
    given = {"sources": {"one": "other's"}} | more
    return AlternativeHypothesis(other, 20.0, -10.0, null=NullHypothesis(null, 30.0), **given)
