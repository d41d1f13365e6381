"""Turned phones and mirrored twins weighed beside a belief, with made filters."""

from dataclasses import replace
from math import log, nan
from types import SimpleNamespace

import numpy as np
import pytest
from made_filters import (
    SEARCHING,
    STATE,
    TERM,
    TRACKING,
    Beliefs,
    belief,
    gaining,
    rival,
    weighed,
)

from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate, FixedTerm


def turned_phone(log_evidence, *, prior=-2.0, null=-6.0, status=TRACKING, start_m=0.0):
    own = belief(status, log_evidence, east_m=800.0)
    return HeldOtherwise(own, Hold(1.0, 3.0), prior, start_m, NullHypothesis(null, 30.0), nan)


def test_beliefs_in_which_the_phone_was_turned_are_weighed_too():
    own = FixedTerm(np.full(4, -9.0))
    beliefs = Beliefs(held_otherwise=gaining(-1.0))
    given = replace(STATE, held=(turned_phone(-9.0), turned_phone(-30.0)))
    updates = [EvidenceUpdate(None, (own, TERM), under_null=-1.5)]
    found, _ = weighed(beliefs, given, updates)
    # What holds for the hypotheses of the main belief alone is no evidence for others.
    assert [one.terms for one in beliefs.held_otherwise.readings] == [(TERM,)] * 2
    assert all(one.tracked for one in beliefs.held_otherwise.readings)
    # The second is refuted, 19 nats behind.
    (left,) = found.held
    assert left.belief.log_evidence == -10.0
    assert left.null.log_odds == pytest.approx(-6.0 - 1.5 - 1.0 + 1.0)
    # 2 nats ahead and a prior of -2: even odds, elsewhere, from here on.
    assert left.ahead_m == 40.0
    assert (found.status, found.takeovers) == (TRACKING, 0)
    weighed(beliefs, given, updates, measured=False)
    assert not beliefs.held_otherwise.readings[-1].tracked


@pytest.mark.parametrize(
    ("reason", "kept"),
    [(Reason.NO_READING, 1), (Reason.UPDATE_FAILED, 0)],
)
def test_turned_phones_without_a_reading_stay_and_those_that_fail_do_not(reason, kept):
    given = replace(STATE, held=(turned_phone(-9.0),))
    found, _ = weighed(Beliefs(held_otherwise=gaining(-1.0, reason=reason)), given)
    assert len(found.held) == kept
    if kept:
        assert found.held[0].belief is given.held[0].belief


@pytest.mark.parametrize(
    ("log_evidence", "null", "wins"),
    # 10 nats ahead after both lost 2, less a prior of 2: the 8 that it takes.
    [(0.0, -6.0, True), (-0.1, -6.0, False), (0.0, -3.9, False), (0.0, -4.5, True)],
)
def test_a_turned_phone_that_is_far_ahead_takes_over(log_evidence, null, wins):
    other = rival(-9.0)
    given = replace(
        STATE, held=(turned_phone(log_evidence, null=null), turned_phone(-9.0)), alternative=other,
        status=Status.LOST, takeovers=1,
    )  # fmt: skip
    found, _ = weighed(state=given)
    assert (found.hold == Hold(1.0, 3.0)) is wins
    assert found.takeovers == 1 + wins
    if wins:
        assert found.belief.log_evidence == log_evidence - 2.0
        assert (found.status, found.recovery) == (TRACKING, Recovery())
        assert found.sources == {"one": "before anew", "two": 2}
        assert found.null.log_odds == pytest.approx(null - 0.5)
        # The alternative was started beside the main belief, against which it had odds of -2.
        assert found.alternative.main_log_evidence == -10.0 + 2.0
        (rest,) = found.held
        assert (rest.log_prior, rest.belief.log_evidence) == (0.0, -11.0)


def on_lanes(*, proven=True, turned_rad=7.0):
    """Carriageways on which a belief is proven by its twin, or not, and a path of some bends."""
    asked = []

    def is_proven(main, twin, turned, places):
        asked.append((main.status, twin, turned, places))
        return proven

    lanes = SimpleNamespace(mirror=SimpleNamespace(proven=is_proven), places=17)
    path = SimpleNamespace(
        turned_rad=turned_rad, is_distinctive=False, whole=True, mirrored="mirrored"
    )
    return lanes, path, asked


@pytest.mark.parametrize("proven", [True, False])
def test_on_carriageways_a_belief_converges_once_its_twin_proves_it(proven):
    lanes, path, asked = on_lanes(proven=proven)
    twin = MirroredTwin(belief(SEARCHING, -15.0), -3.0)
    beliefs = Beliefs(lanes=lanes)
    given = replace(STATE, belief=belief(SEARCHING), status=SEARCHING, path=path, twin=twin)
    found, _ = weighed(beliefs, replace(given, alternative=rival(-9.0)))
    assert asked == [(SEARCHING, twin, 7.0, 17)]
    main, other, mirrored = beliefs.filter.readings
    # An alternative there never converges by itself, and the twin is only compared.
    assert (main.doubted, other.doubted, mirrored.doubted) == (not proven, True, True)
    assert mirrored.terms == main.terms
    assert found.twin.belief.log_evidence == -17.0
    assert found.twin.main_log_evidence == -3.0


def test_a_twin_begins_beside_a_search_and_ends_with_it():
    lanes, path, _ = on_lanes()
    beliefs = Beliefs(lanes=lanes)
    searching = replace(STATE, belief=belief(SEARCHING), status=SEARCHING, path=path)
    found, _ = weighed(beliefs, searching)
    (prior,) = beliefs.filter.priors
    assert (prior.reading, prior.compass, prior.path) == (None, False, "mirrored")
    # What 17 places cost was paid before, as the belief is 40 m old.
    assert found.twin.main_log_evidence == -12.0
    assert found.twin.ahead_nats == pytest.approx(log(17.0))
    # Only where the whole path is known.
    part = replace(searching, path=SimpleNamespace(**{**vars(path), "whole": False}))
    assert weighed(Beliefs(lanes=lanes), part)[0].twin is None
    twin = MirroredTwin(belief(SEARCHING, -15.0), -3.0)
    assert weighed(Beliefs(lanes=lanes), replace(STATE, path=path, twin=twin))[0].twin is None
    assert weighed(Beliefs(), replace(searching, twin=twin))[0].twin is None


def test_a_twin_begins_anew_when_an_alternative_takes_over():
    lanes, path, _ = on_lanes()
    beliefs = Beliefs(lanes=lanes)
    twin = MirroredTwin(belief(SEARCHING, -15.0), -3.0)
    given = replace(STATE, belief=belief(SEARCHING), status=SEARCHING, path=path, twin=twin)
    found, _ = weighed(beliefs, replace(given, alternative=rival(6.0)))
    assert found.takeovers == 1
    assert found.twin.main_log_evidence == found.belief.log_evidence == 4.0
    assert found.twin.belief.log_evidence == 0.0
