"""Satellites in the map filter: they help, are rejected where they lie, and come back."""

import pickle
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS, EAST, LATTICE, NORTH, SOUTH, make_database, walk_log
from sky_world import HEIGHTS, START_UTC_S, no_rows, sky_log, sky_table
from true_places import error_m

from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.gnss.receiver import carried
from mapfilter.positioning.loop import estimate_of, locate
from mapfilter.positioning.merging import epochs
from mapfilter.simulation.satellites import Spoofer
from mapfilter.tracks.log import make_log

FEW = {"max_particles": 2000, "min_search_particles": 1000, "min_particles": 300}
LONG = ((EAST, 90.0), (NORTH, 90.0), (SOUTH, 90.0), (EAST, 200.0))


@pytest.fixture(scope="module")
def area(tmp_path_factory):
    return open_area(make_database(tmp_path_factory.mktemp("sky")))


@pytest.fixture(scope="module")
def positioner(area):
    return BayesFilter(**FEW, **HEIGHTS).over_area(area)


def found(positioner, log, seed=0):
    return locate(log, positioner, np.random.default_rng(seed)).estimate


def switch_m(estimate):
    at = estimate.converged_at
    assert at is not None
    return float(estimate.time_s[at]) * 1.25


def test_satellites_shorten_the_search(positioner):
    log = sky_log(most=4)
    with_them, without = found(positioner, log), found(positioner, replace(
        log, pseudoranges=no_rows(log, "pseudoranges")))  # fmt: skip
    assert switch_m(with_them) < 0.7 * switch_m(without)
    assert error_m(log, with_them)[with_them.converged_at :].mean() < 6


def test_satellites_and_streets_find_a_walk_without_radio(positioner):
    log = sky_log(radio=False, most=4)
    estimate = found(positioner, log)
    assert estimate.converged_at is not None
    assert error_m(log, estimate)[estimate.converged_at :].mean() < 6


def test_a_phone_that_was_turned_may_receive_satellites(area):
    """Beliefs with another reading of headings have other hypotheses, and another number."""
    positioner = BayesFilter(**{**FEW, "min_particles": 600}, **HEIGHTS).over_area(area)
    rng, state, compared = np.random.default_rng(0), positioner.begin(), 0
    for epoch in epochs(sky_log(most=4)):
        if not compared and state.belief and state.belief.status is Status.TRACKING:
            state = replace(state, hold=Hold(sign=-1.0))
        state, _ = positioner.step(state, epoch, rng)
        compared += bool(state.held)
    assert compared > 1


def test_pseudoranges_alone_say_nothing_of_a_phone_that_was_turned(area):
    """A belief with another reading of headings outlasts epochs without anything else."""
    positioner = BayesFilter(**{**FEW, "min_particles": 600}, **HEIGHTS).over_area(area)
    rng, state, begun, lasted = np.random.default_rng(0), positioner.begin(), None, 0
    for epoch in epochs(sky_log(radio=False, most=4)):
        if begun is None and state.belief and state.belief.status is Status.TRACKING:
            state = replace(state, hold=Hold(offset_rad=1.0))
        before = state.sources["gnss"]
        state, _ = positioner.step(state, epoch, rng)
        if begun is None and state.hold != Hold():
            (begun,) = state.held
        elif begun is not None:
            assert [one.start_m for one in state.held] == [begun.start_m]
            assert state.held[0].belief.log_evidence == begun.belief.log_evidence
            lasted += state.sources["gnss"].compared_at_s > before.compared_at_s
        if lasted == 3:
            return
    pytest.fail("too few epochs with satellites")


def test_a_phone_that_was_turned_begins_with_a_receiver_of_its_own(area):
    """Errors of as many satellites, but of others, are carried since the phone was turned."""
    positioner = BayesFilter(**{**FEW, "min_particles": 600}, **HEIGHTS).over_area(area)
    log, rng, state = sky_log(most=4), np.random.default_rng(0), positioner.begin()
    for epoch in epochs(log):
        state, _ = positioner.step(state, epoch, rng)
        if state.belief and state.belief.status is Status.TRACKING and epoch.radio:
            break
    gnss = state.sources["gnss"]
    assert np.ptp(carried(state.belief.state, gnss.receiver.mean.size)) > 0
    others = replace(gnss.receiver.biases, names=tuple("WXYZ"[: len(gnss.receiver.biases.names)]))
    gnss = replace(gnss, receiver=replace(gnss.receiver, biases=others))
    own = replace(state.belief, log_evidence=state.belief.log_evidence + 100.0)
    held = HeldOtherwise(own, Hold(), 3.0, 0.0, NullHypothesis(-40.0))
    sources = {**state.sources, "gnss": gnss}
    after = replace(state, hold=Hold(offset_rad=1.0), held=(held,), sources=sources)
    rest = [one for one in epochs(log) if one.time_s > epoch.time_s]
    while after.takeovers == state.takeovers:
        after, _ = positioner.step(after, replace(rest.pop(0), pseudoranges=()), rng)
    assert after.hold == Hold()
    receiver = after.sources["gnss"].receiver
    assert after.sources["gnss"].compared_at_s == gnss.compared_at_s
    np.testing.assert_array_equal(carried(after.belief.state, receiver.mean.size), 0.0)
    assert receiver.biases.names == ()
    # The next satellites are compared with it.
    unused = []
    while after.sources["gnss"].receiver.used_at_m == gnss.receiver.used_at_m:
        after, output = positioner.step(after, rest.pop(0), rng)
        unused += output.unused
    assert not [one for one in unused if one.kind == "pseudorange"]
    assert "W" not in after.sources["gnss"].receiver.biases.names


def test_a_log_without_readings_of_satellites_gives_the_same_bytes(positioner):
    """Absent readings are no readings."""
    log = walk_log()
    ranges = sky_table(log.truth, most=4)
    blank = make_log(CRS, pseudoranges=ranges.assign(pseudorange_m=np.nan)).pseudoranges
    one, other = found(positioner, log), found(positioner, replace(log, pseudoranges=blank))
    assert one.east_m.tobytes() == other.east_m.tobytes()
    assert one.unused == other.unused


def test_live_satellites_give_the_bytes_of_the_replay(positioner):
    log, rng = sky_log(most=3), np.random.default_rng(5)
    track, told = positioner.begin(), []
    for epoch in epochs(log):
        track, rng = pickle.loads(pickle.dumps((track, rng)))
        track, news = positioner.step(track, epoch, rng)
        told.append(news)
    live, replayed = estimate_of(positioner, told), found(positioner, log, 5)
    for name in ("east_m", "north_m", "radii_m", "covariance_m2", "mass_50m"):
        assert getattr(live, name).tobytes() == getattr(replayed, name).tobytes(), name
    assert live.unused == replayed.unused


@pytest.mark.parametrize("most", [1, 2, 4])
def test_a_spoofer_is_rejected_and_honest_satellites_come_back(positioner, most):
    spoofer = Spoofer(200.0, 60.0, 300.0, 400.0, 50.0)
    honest, spoofed = sky_log(most=most), sky_log(spoofer=spoofer, most=most)
    estimates = [found(positioner, log) for log in (honest, spoofed)]
    errors = [error_m(log, one) for log, one in zip((honest, spoofed), estimates, strict=True)]
    about = (estimates[0].time_s >= 200.0) & (estimates[0].time_s < 320.0)
    assert np.median(errors[1][about]) < np.median(errors[0][about]) + 5.0
    assert errors[1][estimates[1].converged_at :].max() < 50.0
    told = [u for u in estimates[1].unused if u.kind == "pseudorange"]
    reasons = {u.reason for u in told if 200 <= u.time_s < 262}
    if most > 1:
        assert reasons >= {Reason.REJECTED_BY_EVIDENCE, Reason.ON_PROBATION}
        rejected = {u.time_s for u in told}
        # They are listened to every 5 m, which is every 4 s.
        assert sum(200 <= time_s < 260 for time_s in rejected) >= 13
    # They are used again soon after it.
    assert not [u for u in told if u.time_s > 275]
    assert Status.LOST not in estimates[1].status[estimates[1].converged_at :]


def test_a_spoofed_fix_is_rejected_too(positioner):
    log = walk_log()
    truth = log.truth.iloc[100:]
    lie = np.where((truth["time_s"] >= 200) & (truth["time_s"] < 260), 500.0, 0.0)
    fixes = truth[["time_s", "east_m", "north_m"]].assign(var_east_m2=25.0, var_north_m2=25.0)
    fixes["east_m"] += lie
    told = replace(log, gnss=make_log(CRS, gnss=fixes).gnss)
    estimate = found(positioner, told)
    assert error_m(told, estimate)[120:].max() < 30
    times = {u.time_s for u in estimate.unused if u.kind == "gnss"}
    assert 200 <= min(times) <= 204
    assert 255 <= max(times) < 268


def test_honest_satellites_find_a_filter_that_is_lost(positioner):
    """A belief that is sure of a wrong place rejects them, and is replaced by the alternative."""
    log = sky_log(most=4, legs=LONG)
    merged, rng = epochs(log), np.random.default_rng(2)
    west, south, _, north = LATTICE.bounds_m
    track = positioner.begin_at(west + 128.0, north - 40.0, 3.0, rng)
    told = []
    for epoch in merged:
        track, news = positioner.step(track, epoch, rng)
        told.append(news)
    estimate = estimate_of(positioner, told)
    assert track.takeovers >= 1
    assert error_m(log, estimate)[-60:].mean() < 8
    assert south < estimate.north_m[-1] < north


@pytest.mark.parametrize("jump_m", [299_792.458, -3e7])
def test_the_receiver_may_set_its_clock_anew(positioner, jump_m):
    log = sky_log(most=4)
    ranges = log.pseudoranges.copy()
    ranges.loc[ranges["time_s"] > 150, "pseudorange_m"] += jump_m
    estimate = found(positioner, replace(log, pseudoranges=ranges))
    late = [u for u in estimate.unused if u.kind == "pseudorange" and u.time_s > 150]
    assert len(late) < 30
    assert error_m(log, estimate)[-100:].mean() < 6


def test_one_satellite_with_an_echo_is_left_out_alone(positioner):
    log = sky_log(most=4)
    ranges = log.pseudoranges.copy()
    far = (ranges["time_s"] > 150) & (ranges["time_s"] < 200)
    name = ranges.loc[far, "satellite"].iloc[0]
    ranges.loc[far & (ranges["satellite"] == name), "pseudorange_m"] += 150.0
    estimate = found(positioner, replace(log, pseudoranges=ranges))
    told = [u for u in estimate.unused if 150 < u.time_s < 200]
    assert {u.what for u in told} == {name}
    assert {u.reason for u in told} == {Reason.REJECTED_BY_EVIDENCE}
    assert error_m(log, estimate)[estimate.converged_at :].max() < 25


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"x_m": np.nan, "y_m": np.nan, "z_m": np.nan}, Reason.UNKNOWN_SATELLITE),
        ({"satellite": "G99", "x_m": -2.2e7, "y_m": 0.0, "z_m": -1e7}, Reason.BELOW_HORIZON),
        ({"pseudorange_m": 2.2e7}, Reason.SECOND_READING),
    ],
)
def test_satellites_that_are_of_no_use_have_a_reason(positioner, change, reason):
    log = sky_log(most=3)
    row = log.pseudoranges[log.pseudoranges["time_s"] == 40.0].iloc[[0]]
    more = pd.concat([log.pseudoranges, row.assign(**change)])
    if reason is Reason.UNKNOWN_SATELLITE:
        more = more[~((more["time_s"] == 40.0) & more["x_m"].notna())]
    told = make_log(CRS, motion=log.motion, radio=log.radio, truth=log.truth, pseudoranges=more,
                    start_utc_s=START_UTC_S)  # fmt: skip
    estimate = found(positioner, told)
    assert reason in {u.reason for u in estimate.unused if u.time_s == 40.0}


def test_a_start_eighteen_seconds_off_is_rejected_epoch_by_epoch(positioner):
    """Leap seconds left out: satellites lie where they were 18 s ago."""
    log = sky_log(most=4)
    wrong = log.pseudoranges.copy()
    late = sky_log(most=4).pseudoranges
    # Satellites go about 3 km/s: 18 s are up to 16 km in their ranges, each another.
    rate = {name: 250.0 * index for index, name in enumerate(sorted(set(late["satellite"])))}
    wrong["pseudorange_m"] += 18.0 * wrong["satellite"].map(rate)
    estimate = found(positioner, replace(log, pseudoranges=wrong))
    assert estimate.converged_at is not None
    assert error_m(log, estimate)[estimate.converged_at :].mean() < 15
    after = estimate.time_s[estimate.converged_at]
    told = {u.time_s for u in estimate.unused if u.kind == "pseudorange" and u.time_s > after}
    assert len(told) > 0.2 * np.sum(estimate.time_s > after)


def test_the_exact_filter_tells_that_it_takes_no_pseudoranges(area):
    grid = GridFilter().over_area(area)
    log = sky_log(legs=((EAST, 30.0),), most=2)
    estimate = found(grid, log)
    reasons = {u.reason for u in estimate.unused if u.kind == "pseudorange"}
    assert reasons == {Reason.NOT_USED_BY_FILTER}


def test_rows_of_one_time_count_alike_in_any_order(positioner):
    log = sky_log(most=4)
    turned = log.pseudoranges.iloc[::-1].sort_values("time_s", kind="stable")
    told = replace(log, pseudoranges=turned.reset_index(drop=True))
    one, other = found(positioner, log), found(positioner, told)
    assert one.converged_at == other.converged_at
    np.testing.assert_allclose(one.east_m[-50:], other.east_m[-50:], atol=2.0)


def test_hindsight_and_turns_alone_take_satellites_too(positioner):
    log = sky_log(most=4, legs=((EAST, 90.0), (NORTH, 60.0)))
    heading = log.motion["heading_rad"].to_numpy()
    turn = np.diff(heading, prepend=np.nan)
    motion = log.motion.assign(heading_rad=np.nan, turn_rad=(turn + np.pi) % (2 * np.pi) - np.pi)
    for one, smooth in ((log, True), (replace(log, motion=motion), False)):
        rng = np.random.default_rng(1)
        estimate = locate(one, replace(positioner, smooth=smooth), rng).estimate
        assert error_m(log, estimate)[-30:].mean() < 12


def test_the_exact_filter_takes_fixes_and_rejects_lies(area):
    grid = GridFilter(**FEW).over_area(area)
    log = walk_log(((EAST, 90.0),))
    fixes = log.truth[["time_s", "east_m", "north_m"]].assign(var_east_m2=9.0, var_north_m2=9.0)
    fixes.loc[fixes["time_s"] > 40, "north_m"] += 400.0
    estimate = found(grid, replace(log, gnss=make_log(CRS, gnss=fixes).gnss))
    assert error_m(log, estimate)[10:].max() < 15
    assert {u.reason for u in estimate.unused if u.kind == "gnss"} >= {Reason.REJECTED_BY_EVIDENCE}


@pytest.mark.parametrize("kind", [BayesFilter, GridFilter])
def test_a_fix_of_no_place_is_no_fix_before_a_start_neither(area, kind):
    positioner = kind(**FEW, **HEIGHTS).over_area(area)
    row = ReportRow("serving", "W", None, None, np.nan, 0)
    blank, report = Epoch(0.0, gnss=GnssFix(np.nan, 1.0)), Epoch(1.0, radio=(row,))
    rng, other = np.random.default_rng(0), np.random.default_rng(0)
    nothing, news = positioner.step(positioner.begin(), blank, rng)
    assert (nothing.belief, news.fix.hypotheses) == (None, 0)
    _, told = positioner.step(nothing, replace(report, gnss=blank.gnss), rng)
    _, plain = positioner.step(positioner.begin(), report, other)
    assert told.fix.east_m == plain.fix.east_m
    np.testing.assert_array_equal(told.fix.radii_m, plain.fix.radii_m)
