"""Fixes and pseudoranges as a source: when they are compared, with which belief, and at first."""

from dataclasses import replace
from math import inf, nan
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.filters.contract import Reason
from mapfilter.geodesy import project
from mapfilter.gnss.sky import GridFrame
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis
from mapfilter.positioning.epochs import Epoch, GnssFix, Pseudorange
from mapfilter.positioning.gnss.gate import GnssComparison
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.receiver import Receiver
from mapfilter.positioning.gnss.source import FirstFix, FirstRanges, FixSource, GnssSource
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.gnss.trail import FixTrail
from mapfilter.positioning.step_output import UnusedReading

CRS = "EPSG:32632"
EAST_M, NORTH_M = (float(one) for one in project(CRS, 9.3, 48.5))
WIDTH_M, HEIGHT_M = 800.0, 600.0
AREA = SimpleNamespace(
    size_m=(WIDTH_M, HEIGHT_M),
    origin_m=(EAST_M - 400.0, NORTH_M - 300.0),
    lattice=SimpleNamespace(crs=CRS),
)
"""The place at which satellites are received is its middle."""
OPTIONS = GnssOptions(
    height_m=300.0, height_sd_m=0.0, echo_m=0.0, reflection_m=0.0, reflection_times=0.0,
    spacing_m=10.0, pause_s=10.0, trust=3.0, trust_grows_s=50.0, dispute_s=10.0, mask_deg=15.0,
)  # fmt: skip
SOURCE = GnssSource(AREA, OPTIONS)
FIX = GnssFix(EAST_M, NORTH_M, 9.0, 9.0, 0.0)


def ranges(directions_deg, errors_m, sigma_m=nan):
    """Pseudoranges at the middle of the area, from azimuths and elevations."""
    frame = GridFrame(CRS, EAST_M, NORTH_M, 300.0).local
    azimuth, elevation = np.radians(directions_deg).T
    unit = np.stack(
        [np.cos(elevation) * np.sin(azimuth), np.cos(elevation) * np.cos(azimuth),
         np.sin(elevation)], axis=1,
    )  # fmt: skip
    places = (2.1e7 * unit) @ frame.axes + frame.origin_m
    return tuple(
        Pseudorange(f"G{k}", 2.1e7 + 5000.0 + error_m, sigma_m, tuple(map(float, place)))
        for k, (error_m, place) in enumerate(zip(errors_m, places, strict=True))
    )


def test_the_gate_compares_in_the_areas_frame():
    gate = SOURCE.gate
    assert (gate.crs, gate.origin_m, gate.area_m2) == (CRS, AREA.origin_m, 480_000.0)
    assert gate.options is OPTIONS
    assert SOURCE.kinds == {"gnss", "pseudorange"}
    assert SOURCE.begin().compared_at_m == -inf


def test_first_pseudoranges_weigh_places_by_their_differences():
    """East and west, 30 degrees up: 2 m at the zenith are 4 m, and 10 m of spacing 8.66 m."""
    epoch = Epoch(3.0, (), pseudoranges=ranges([(90.0, 30.0), (270.0, 30.0)], (6.0, 0.0)))
    found = SOURCE.first(epoch)
    assert found.state.receiver is None
    (term,) = found.terms
    np.testing.assert_allclose(term.sigma_m, np.hypot(4.0, 8.6602540), rtol=1e-6)
    assert term.sky.origin_m == (400.0, 300.0)
    # 20 m east one range is 17.3 m shorter, the other as much longer. North nothing changes.
    # Further rows of hypotheses are their errors of motion.
    state = np.full((8, 4), 7.0, dtype=np.float32)
    state[:2] = [400.0, 420.0, 400.0, 390.0], [300.0, 300.0, 330.0, 300.0]
    off_m = 6.0 + 2 * np.cos(np.radians(30.0)) * (state[0].astype(float) - 400.0)
    nats = -0.5 * off_m**2 / (2 * (16.0 + 75.0))
    gain = nats - np.log(np.mean(np.exp(nats)))
    # A tenth of the belief ignores satellites.
    np.testing.assert_allclose(
        term.log_likelihood(state), np.log(0.9 * np.exp(gain) + 0.1), atol=5e-3
    )
    far = np.array([[400.0, 1400.0], [300.0, 300.0]], dtype=np.float32)
    np.testing.assert_allclose(term.log_likelihood(far), np.log([1.9, 0.1]), atol=1e-3)


def test_first_satellites_take_the_receiver_at_the_stated_height():
    """So that places to either side are alike; a metre would be 0.6 m of the two's difference."""
    epoch = Epoch(3.0, (), pseudoranges=ranges([(90.0, 80.0), (270.0, 20.0)], (0.0, 0.0)))
    (term,) = SOURCE.first(epoch).terms
    state = np.array([[380.0, 400.0, 420.0], [300.0, 300.0, 300.0]], dtype=np.float32)
    west, middle, east = term.log_likelihood(state)
    assert west == pytest.approx(east, abs=1e-3)
    assert middle > west + 0.5


def test_a_first_receiver_that_has_lasting_errors_says_less():
    epoch = Epoch(3.0, (), pseudoranges=ranges([(90.0, 30.0), (270.0, 30.0)], (6.0, 0.0)))
    (term,) = SOURCE.first(epoch).terms
    lasting = FirstRanges(term.sky, term.sigma_m, replace(OPTIONS, echo_m=50.0))
    state = np.array([[400.0, 420.0], [300.0, 300.0]], dtype=np.float32)
    plain, wide = (np.ptp(one.log_likelihood(state)) for one in (term, lasting))
    # 2 x (91 + 2500) in place of 2 x 91.
    off_m = np.array([6.0, 6.0 + 34.641])
    gain = -0.5 * off_m**2 / (2 * 2591.0)
    gain -= np.log(np.mean(np.exp(gain)))
    assert wide == pytest.approx(np.ptp(np.log(0.9 * np.exp(gain) + 0.1)), rel=0.02)
    assert wide < plain / 5


@pytest.mark.parametrize(
    ("source", "given"),
    [(SOURCE, ()), (FixSource(AREA, OPTIONS), ranges([(90.0, 30.0)], (0.0,))),
     (SOURCE, ranges([(90.0, 10.0)], (0.0,)))],
)  # fmt: skip
def test_without_satellites_or_a_clock_a_belief_starts_without_them(source, given):
    found = source.first(Epoch(3.0, (), gnss=FIX, pseudoranges=given))
    assert found.terms == ()
    assert found.state.compared_at_m == -inf


def test_a_first_fix_is_taken_as_it_is():
    source = FirstFix(AREA.origin_m)
    (term,) = source.first(Epoch(1.0, (), gnss=FIX)).terms
    assert (term.fix, term.place_m) == (FIX, (400.0, 300.0))
    assert source.first(Epoch(1.0, ())).terms == ()
    # Later ones are compared with the belief.
    later = source.update(None, Epoch(1.0, (), gnss=FIX), None)
    assert (later.state, later.terms) == (None, ())
    assert (source.name, source.kinds) == ("first fix", {"gnss"})


class Gate:
    """A gate that finds what it is given for a belief, and notes what it is asked."""

    def __init__(self, **found):
        self.found, self.asked = found, []

    def compare(self, belief, state, epoch, travelled_m, spacing_m):
        self.asked.append((belief, state, epoch.time_s, travelled_m, spacing_m))
        return self.found[belief]


def gated(gate, options=OPTIONS):
    source = GnssSource(AREA, options)
    source.__dict__["gate"] = gate
    return source


def finding(name, *, rejected_s=nan, compared=True, **more):
    state = GnssState(rejected_since_s=rejected_s, fix_used_at_m=ord(name[0]))
    given = {"terms": (name,), "under_null": -float(len(name)), "compared": compared} | more
    return GnssComparison(f"{name} weighed", state, **given)


OWN, OTHERS = GnssState(compared_at_m=90.0, compared_at_s=95.0), GnssState(compared_at_m=80.0)


def alternative(**more):
    return AlternativeHypothesis(
        "other", 0.0, 0.0, start_s=100.0, sources={"gnss": OTHERS, "radio": 7}, **more
    )


def state_of(belief="main", beside=None, travelled_m=95.0, own=OWN):
    return SimpleNamespace(
        sources={"gnss": own}, reckoning=DeadReckoning(travelled_m),
        belief=belief, alternative=beside, proven=False,
        watch=SimpleNamespace(rest=None, is_unmeasured=False),
    )  # fmt: skip


def updated(gate, state, time_s=100.0, *, due=True, **readings):
    readings = readings or {"gnss": FIX}
    context = SimpleNamespace(report_due=due, particle_spacing_m=4.0)
    return gated(gate).update(state, Epoch(time_s, (), **readings), context)


@pytest.mark.parametrize(
    ("time_s", "travelled_m", "due", "compared"),
    [(100.0, 95.0, True, True), (100.0, 95.0, False, False), (105.0, 95.0, False, True),
     (104.9, 99.9, False, False), (100.0, 100.0, False, True)],
)  # fmt: skip
def test_readings_are_compared_when_a_report_is_used_or_after_a_while(
    time_s, travelled_m, due, compared
):
    gate = Gate(main=finding("main"))
    found = updated(gate, state_of(travelled_m=travelled_m), time_s, due=due)
    assert gate.asked == ([("main", OWN, time_s, travelled_m, 4.0)] if compared else [])
    assert (found.state is OWN) is not compared
    assert found.terms == (("main",) if compared else ())


def test_nothing_is_compared_without_readings_or_a_belief():
    gate = Gate(main=finding("main"))
    assert updated(gate, state_of(None)).state is OWN
    assert updated(gate, state_of(), pseudoranges=()).state is OWN
    assert gate.asked == []
    assert updated(gate, state_of(), pseudoranges=ranges([(90.0, 30.0)], (0.0,))).terms == ("main",)


def test_a_belief_alone_takes_what_its_comparison_finds():
    unused = (("gnss", "", Reason.ON_PROBATION),)
    found = updated(Gate(main=finding("main", unused=unused)), state_of())
    assert (found.belief, found.under_null, found.state.fix_used_at_m) == ("main weighed", -4, 109)
    assert (found.alternative, found.alternative_terms) == (None, None)
    assert found.alternative_under_null is None
    (one,) = found.unused
    assert one == UnusedReading(100.0, "gnss", "", Reason.ON_PROBATION)


@pytest.mark.parametrize(("since_s", "disputed"), [(nan, False), (90.0, True), (90.1, False)])
def test_a_belief_that_rejects_readings_for_long_is_disputed(since_s, disputed):
    found = updated(Gate(main=finding("main", rejected_s=since_s)), state_of())
    assert found.disputed is disputed


@pytest.mark.parametrize(
    ("main_s", "other_s", "compared", "before", "after"),
    [
        # Whoever rejects readings loses against the other, by one nat.
        (95.0, nan, (True, True), 0.5, 1.5),
        (nan, 95.0, (True, True), 0.5, -0.5),
        (95.0, 95.0, (True, True), 0.5, 0.5),
        (95.0, nan, (True, False), 0.5, 1.5),
        (95.0, nan, (False, True), 0.5, 1.5),
        (95.0, nan, (False, False), 0.5, 0.5),
        # 3 nats at its start, and one more after 50 s.
        (95.0, nan, (True, True), 3.5, 4.0),
        (nan, 95.0, (True, True), -3.5, -4.0),
    ],
)
def test_an_alternative_is_compared_for_itself(main_s, other_s, compared, before, after):
    main = finding("main", rejected_s=main_s, compared=compared[0])
    other = finding("other", rejected_s=other_s, compared=compared[1])
    gate, beside = Gate(main=main, other=other), alternative(gnss_log_bayes_factor=before)
    found = updated(gate, state_of(beside=beside), 150.0)
    assert [one[:2] for one in gate.asked] == [("main", OWN), ("other", OTHERS)]
    assert gate.asked[1][2:] == (150.0, 95.0, 4.0)
    assert (found.terms, found.alternative_terms) == (("main",), ("other",))
    assert (found.under_null, found.alternative_under_null) == (-4.0, -5.0)
    assert found.alternative.belief == "other weighed"
    assert found.alternative.sources == {"gnss": other.state, "radio": 7}
    assert found.alternative.gnss_log_bayes_factor == after


def test_a_belief_that_starts_is_compared_at_once():
    gate = Gate(new=finding("new"))
    source = gated(gate)
    assert source.start("new", Epoch(5.0, ()), 30.0)[0] == "new"
    assert source.start("new", Epoch(5.0, ()), 30.0)[1].compared_at_m == -inf
    assert gate.asked == []
    for given in ({"gnss": FIX}, {"pseudoranges": ranges([(90.0, 30.0)], (0.0,))}):
        belief, state = source.start("new", Epoch(5.0, (), **given), 30.0)
        assert (belief, state.fix_used_at_m) == ("new weighed", ord("n"))
        assert gate.asked[-1][2:] == (5.0, 30.0, 10.0)


def test_beside_another_belief_the_receiver_begins_anew():
    assert SOURCE.beside_other(OWN) is OWN
    receiver = Receiver(10.0, 50.0, np.array([990.0, 2.0, 15.0, 4.0]), np.eye(4), 45.0)
    found = SOURCE.beside_other(replace(OWN, receiver=receiver))
    # The same clock, whose errors are unknown; the height and lasting errors are new.
    np.testing.assert_array_equal(found.receiver.mean, [990.0, 2.0, 0.0])
    np.testing.assert_array_equal(found.receiver.covariance, np.diag([9e10, 1e4, 0.0]))
    assert (found.receiver.time_s, found.receiver.travelled_m) == (10.0, 50.0)
    assert (found.receiver.used_at_m, found.compared_at_m) == (45.0, 90.0)


def test_a_trail_has_fixes_that_were_compared_by_a_belief_that_trusts_them():
    found = finding("main")
    (row,) = updated(Gate(main=found), state_of()).state.trail.rows
    assert (row.east_m, row.time_s, row.rejected) == (EAST_M, 100.0, False)
    rejected = finding("main", unexplained=True)
    assert updated(Gate(main=rejected), state_of()).state.trail.rows[0].rejected
    for other in (
        finding("main", compared=False),
        found._replace(state=replace(found.state, distrusted=True)),
    ):
        assert updated(Gate(main=other), state_of()).state.trail.rows == ()


def test_beside_another_belief_a_trail_begins_anew():
    trail = updated(Gate(main=finding("main")), state_of()).state.trail
    assert SOURCE.beside_other(replace(OWN, trail=trail)).trail == FixTrail()
