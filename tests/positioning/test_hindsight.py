"""Smoothed tracks against the oracle: ancestors by probability, places in between by hand."""

from math import cos, exp, log, nan, sin, sqrt
from types import SimpleNamespace

import numpy as np
import pytest
import scalar_oracle as oracle
from small_area import HEIGHT_M, ON_WAY, SOUTH_M, WEST_M, WIDTH_M, make_area

from mapfilter.filters.contract import Reason, Status
from mapfilter.models.street_motion import STATES, STRETCH, TURN, MotionErrors
from mapfilter.positioning.bayes.beliefs.legs import NO_LEG
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.bayes.beliefs.smoothing import BayesSmoother, Kept
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.estimate_columns import EstimateColumns
from mapfilter.positioning.step_output import Fix, StepOutput

AREA = make_area()
ERRORS = MotionErrors(
    step_sd_m=0.4, typical_step_m=1.6, heading_sd_rad=0.125, white_share=0.64, heading_m=40.0,
    bias_drift_rad_per_sqrt_m=0.006, scale_drift_per_sqrt_m=0.004, stretch_sd=0.03, stretch_m=30.0,
)  # fmt: skip
JITTER = (1.5, 1.5, 0.05, 0.02, 0.0)
# East, north and distance by dead reckoning: a way that bends.
MOVED = [
    (0.0, 0.0, 0.0),
    (6.0, 0.0, 6.0),
    (12.0, 2.5, 12.5),
    (13.0, 10.0, 20.0),
    (20.0, 11.0, 27.0),
]


def cloud(*rows):
    """States of (east, north, bias, log scale)."""
    # Rows lie apart in memory as those of a filter: kernels are compiled anew for others.
    return np.ascontiguousarray(np.array([[*row, 0.0] for row in rows], dtype=np.float32).T)


def kept(epoch, state, weight=None):
    count = state.shape[1]
    log_weight = np.zeros(count) if weight is None else np.log(weight)
    east_m, north_m, travelled_m = MOVED[epoch]
    return Kept(epoch, state, log_weight.astype(np.float32), (east_m, north_m), travelled_m)


def forward_pass():
    nowhere, status = (WEST_M, SOUTH_M, np.zeros((2, 2)), np.zeros(3)), Status.TRACKING
    fixes = [
        Fix(float(k), *nowhere, status, 1, 1.0, 0, 0.0, Reason.USED) for k in range(len(MOVED))
    ]
    return TrackEstimate.of_fixes(AREA.lattice.crs, "bayes", fixes)


def hindsight(*beliefs, paths=200):
    smoother = BayesSmoother(AREA, ERRORS, kept=list(beliefs), moved=MOVED)
    rng = np.random.default_rng(2)
    return smoother.smoothed(forward_pass(), rng, paths=paths, jitter=JITTER)


def places(estimate):
    return np.column_stack([estimate.east_m - WEST_M, estimate.north_m - SOUTH_M])


START = (20.0, 15.0, 0.4, log(1.1))
ENDS = [(45.0, 40.0), (30.0, 38.0)]


@pytest.mark.parametrize("end", ENDS)
def test_between_two_beliefs_a_path_is_bent_to_end_at_the_later_one(end):
    found = places(hindsight(kept(0, cloud(START)), kept(4, cloud((*end, 0.1, 0.0)))))

    def reckoned(epoch):
        length_m = float(np.hypot(*MOVED[epoch][:2]))
        heading_rad = float(np.arctan2(MOVED[epoch][1], MOVED[epoch][0]))
        return np.array(oracle.moved(*START, length_m, heading_rad))

    missed = np.array(end) - reckoned(4)
    for epoch, (_, _, gone_m) in enumerate(MOVED):
        expected = reckoned(epoch) + gone_m / 27.0 * missed
        np.testing.assert_allclose(found[epoch], expected, atol=1e-3)


def test_what_comes_later_moves_the_epochs_in_between():
    one, other = (
        places(hindsight(kept(0, cloud(START)), kept(4, cloud((*end, 0.1, 0.0))))) for end in ENDS
    )
    apart = np.subtract(*ENDS)
    shares = np.array([gone_m / 27.0 for *_, gone_m in MOVED])
    np.testing.assert_allclose(one - other, shares[:, None] * apart, atol=1e-3)


def test_at_the_epoch_of_each_belief_that_is_kept_a_path_is_where_it_was():
    ways = [START, (30.0, 20.0, 0.4, 0.0), (60.0, 30.0, 0.2, 0.0), (70.0, 40.0, 0.1, 0.0)]
    found = places(
        hindsight(*(kept(k, cloud(way)) for k, way in zip((0, 1, 3, 4), ways, strict=True)))
    )
    np.testing.assert_allclose(found[[0, 1, 3, 4]], [way[:2] for way in ways], atol=1e-3)


def test_epochs_before_the_first_belief_stay_those_of_the_forward_pass():
    first, last = kept(2, cloud(START)), kept(4, cloud((*ENDS[0], 0.1, 0.0)))
    found = places(hindsight(first, last))
    np.testing.assert_array_equal(found[:2], 0.0)
    np.testing.assert_allclose(found[2], START[:2], atol=1e-4)
    # Dead reckoning counts from the first belief: 1.0 and 7.5 m of 8.0 and 8.5 m.
    turned = [[cos(0.4), -sin(0.4)], [sin(0.4), cos(0.4)]]
    here, there = (START[:2] + 1.1 * np.array(turned) @ way for way in ([1.0, 7.5], [8.0, 8.5]))
    np.testing.assert_allclose(found[3], here + 7.5 / 14.5 * (ENDS[0] - there), atol=1e-3)


def variances(length_m):
    """Of place, bias and scale: what the motion adds, and how far copies are parted.

    What is new in the deviations adds to the lasting errors; over the way it leads aside by a third
    of the variance, as a drift that grows evenly does.
    """
    steps = length_m / ERRORS.typical_step_m
    along, across = ERRORS.step_sd_m, ERRORS.typical_step_m * oracle.white_of(ERRORS)
    turned = oracle.deviation_of(ERRORS) ** 2 * (1 - exp(-2 * length_m / ERRORS.heading_m))
    stretched = ERRORS.stretch_sd**2 * (1 - exp(-2 * length_m / ERRORS.stretch_m))
    aside = length_m**2 * max(turned, stretched) / 3
    return (
        steps * max(along, across) ** 2 + aside + JITTER[0] ** 2,
        length_m * ERRORS.bias_drift_rad_per_sqrt_m**2 + turned + JITTER[2] ** 2,
        length_m * ERRORS.scale_drift_per_sqrt_m**2 + stretched + JITTER[3] ** 2,
    )


def ancestors(later, earlier):
    """Probability of each hypothesis of an earlier belief, for each of a later one."""
    way_m = tuple(b - a for a, b in zip(earlier.moved_m, later.moved_m, strict=True))
    spread = variances(later.travelled_m - earlier.travelled_m)
    log_jump = log(1e-4 * spread[0] / (WIDTH_M * HEIGHT_M))
    return np.array([
        oracle.ancestor_probabilities(
            one.astype(float), earlier.state, earlier.log_weight, way_m, spread, log_jump
        )
        for one in later.state.T
    ])  # fmt: skip


def test_paths_go_back_by_weight_and_by_fit_over_three_beliefs():
    first = kept(0, cloud((20.0, 15.0, 0.08, 0.0), (24.0, 13.0, -0.04, 0.04)), [0.5, 0.5])
    middle = kept(2, cloud((33.0, 17.0, 0.0, 0.03), (35.5, 16.0, 0.05, -0.02)), [0.7, 0.3])
    last = kept(4, cloud((43.5, 25.5, 0.1, 0.015), (45.0, 24.0, -0.03, 0.03)), [0.4, 0.6])
    paths = 6000
    estimate = hindsight(first, middle, last, paths=paths)
    at_last = np.array([0.4, 0.6])
    at_middle = at_last @ ancestors(last, middle)
    at_first = at_middle @ ancestors(middle, first)
    for epoch, belief, share in ((0, first, at_first), (2, middle, at_middle), (4, last, at_last)):
        assert 0.2 < share[0] < 0.8
        places_m = belief.state[:2].astype(float)
        mean = places_m @ share
        # Five standard errors of a share drawn by so many paths.
        error = sqrt(share[0] * share[1] / paths) * np.abs(places_m[:, 0] - places_m[:, 1])
        assert np.all(np.abs(places(estimate)[epoch] - mean) < 5 * error + 1e-4)
        spread = np.cov(places_m, aweights=share, ddof=0)
        np.testing.assert_allclose(estimate.covariance_m2[epoch], spread, rtol=0.1, atol=0.02)


def test_a_path_that_no_ancestor_reaches_takes_one_by_weight():
    """An unmeasured displacement: the later place tells nothing of the earlier one."""
    first = kept(0, cloud((20.0, 15.0, 0.0, 0.0), (30.0, 15.0, 0.0, 0.0)), [0.3, 0.7])
    estimate = hindsight(first, kept(4, cloud((85.0, 65.0, 0.0, 0.0))), paths=4000)
    share = (places(estimate)[0, 0] - 20.0) / 10.0
    assert abs(share - 0.7) < 5 * sqrt(0.21 / 4000)


def test_a_far_ancestor_counts_by_its_fit_as_long_as_a_jump_is_less_likely():
    """Ten and twelve nats away, where a jump anywhere in the area costs sixteen."""
    first = kept(0, cloud((20.0, 15.0, 0.0, 0.0), (19.0, 15.0, 0.0, 0.0)))
    last = kept(4, cloud((50.92, 26.0, 0.0, 0.0)))
    share = ancestors(last, first)[0, 0]
    assert share == pytest.approx(0.87, abs=0.01)
    estimate = hindsight(first, last, paths=4000)
    assert abs(places(estimate)[0, 0] - 19.0 - share) < 5 * sqrt(share * (1 - share) / 4000)


def test_a_far_ancestor_counts_by_the_sampling_of_the_way_too():
    """Half a kilometre of samples seconds apart: both ancestors fit alike."""
    first = kept(0, cloud((20.0, 15.0, 0.0, 0.0), (19.0, 15.0, 0.0, 0.0)))
    last = kept(4, cloud((50.92, 26.0, 0.0, 0.0)))._replace(sampling_m2=400.0)
    assert places(hindsight(first, last, paths=4000))[0, 0] - 19.0 == pytest.approx(0.5, abs=0.05)


def test_positions_ways_and_masses_are_those_of_the_paths():
    # On the way along row 4, two thirds; off it, too near to be another place.
    last = kept(4, cloud((45.0, 25.0, 0.0, 0.0), (45.0, 5.0, 0.0, 0.0)), [2 / 3, 1 / 3])
    estimate = hindsight(kept(0, cloud(START)), last, paths=300)
    assert ON_WAY[4, 4]
    assert not ON_WAY[6, 4]
    assert (estimate.way_id[4], estimate.way_probability[4]) == (7, pytest.approx(2 / 3, abs=0.01))
    assert estimate.mass_50m[4] == pytest.approx(1.0)
    assert places(estimate)[4].tolist() == pytest.approx([45.0, 25.0 - 20.0 / 3], abs=0.1)


def at(epoch, state, alternative=None, takeovers=0, hold=None, held=(), alone_from_m=nan):
    """The part of the filter's state after an epoch that the history uses."""
    east_m, north_m, travelled_m = MOVED[epoch]
    state = np.vstack([state, np.zeros((STATES - 5, state.shape[1]), np.float32)])
    reckoning = DeadReckoning(travelled_m, east_m, north_m, 0.5 * epoch)
    belief = SimpleNamespace(state=state, log_weight=np.zeros(state.shape[1]))
    return SimpleNamespace(
        reckoning=reckoning,
        belief=belief,
        alternative=alternative,
        takeovers=takeovers,
        hold=hold or Hold(),
        held=held,
        alone_from_m=alone_from_m,
        leg=NO_LEG,
    )


def test_beliefs_are_kept_every_few_metres_and_at_the_end():
    history, before = BayesSmoother(AREA, ERRORS, every_m=20.0), at(0, cloud(START))
    for epoch in range(5):
        after = at(epoch, cloud((20.0 + epoch, 15.0, 0.0, 0.0)))
        history.add(before, after)
        before = after
    assert [k.epoch for k in history.kept] == [0, 3]
    history.close()
    assert [k.epoch for k in history.kept] == [0, 3, 4]
    assert [float(k.state[0, 0]) for k in history.kept] == [20.0, 23.0, 24.0]
    assert [k.moved_m for k in history.kept] == [MOVED[k][:2] for k in (0, 3, 4)]
    assert [k.travelled_m for k in history.kept] == [MOVED[k][2] for k in (0, 3, 4)]
    assert [k.sampling_m2 for k in history.kept] == [0.0, 1.5, 2.0]
    assert history.moved == [(*moved, 0.5 * k) for k, moved in enumerate(MOVED)]


def test_a_grid_that_all_mass_has_left_is_not_kept():
    """No path goes through it; the next belief is kept in its place."""
    history, nothing = BayesSmoother(AREA, ERRORS, every_m=1.0), cloud().reshape(5, 0)
    rival = SimpleNamespace(belief=at(0, nothing).belief, start_m=0.0)
    main = cloud((20.0, 15.0, 0.0, 0.0))
    tracks = [at(0, main), at(1, nothing), at(2, main, rival), at(3, main), at(4, nothing)]
    for before, after in zip([tracks[0], *tracks], tracks, strict=False):
        history.add(before, after)
    found = history.smoothed(forward_pass(), np.random.default_rng(2), paths=20, jitter=JITTER)
    assert [k.epoch for k in history.kept] == [0, 2, 3]
    assert history.alternative == []
    assert np.isfinite(places(found)).all()


def test_what_leads_on_is_the_lasting_error_with_its_deviation():
    state = np.zeros((STATES, 2), dtype=np.float32)
    state[:5] = cloud((1.0, 2.0, 0.3, 0.1), (3.0, 4.0, -0.2, 0.05))
    state[TURN], state[STRETCH] = [0.2, -0.1], [-0.04, 0.02]
    before = state.copy()
    history, then = BayesSmoother(AREA, ERRORS), at(0, cloud((0.0, 0.0, 0.0, 0.0)))
    then.belief = SimpleNamespace(state=state, log_weight=np.log([0.25, 0.75]))
    history.add(then, then)
    (held,) = history.kept
    expected = cloud((1.0, 2.0, 0.5, 0.06), (3.0, 4.0, -0.3, 0.07))
    np.testing.assert_allclose(held.state, expected, rtol=1e-6)
    np.testing.assert_array_equal(state, before)
    np.testing.assert_allclose(np.exp(held.log_weight), [0.25, 0.75], rtol=1e-6)


@pytest.mark.parametrize("won", [False, True])
def test_an_alternative_that_took_over_replaces_what_was_kept_since(won):
    history = BayesSmoother(AREA, ERRORS, every_m=1.0)
    main, other = cloud((1.0, 1.0, 0, 0)), cloud((9.0, 9.0, 0, 0))
    rival = SimpleNamespace(belief=at(0, other).belief, start_m=6.0)
    then = other if won else main
    tracks = [at(0, main), at(1, main, rival), at(2, main, rival)]
    tracks += [at(3, then, takeovers=int(won)), at(4, then, takeovers=int(won))]
    for before, after in zip([tracks[0], *tracks], tracks, strict=False):
        history.add(before, after)
    assert [k.epoch for k in history.kept] == [0, 1, 2, 3, 4]
    expected = [1.0, 9.0, 9.0, 9.0, 9.0] if won else [1.0] * 5
    assert [float(k.state[0, 0]) for k in history.kept] == expected
    assert history.alternative == []


def test_an_alternative_that_was_begun_in_place_of_another_has_none_of_its_beliefs():
    """Two of one time would make paths go back and forth."""
    history = BayesSmoother(AREA, ERRORS, every_m=1.0)
    main, first, last = (cloud((x, 1.0, 0, 0)) for x in (1.0, 5.0, 9.0))
    one, other = (
        SimpleNamespace(belief=at(0, state).belief, start_m=MOVED[epoch][2])
        for epoch, state in ((1, first), (3, last))
    )
    tracks = [at(0, main), at(1, main, one), at(2, main, one), at(3, main, other)]
    tracks += [at(4, last, takeovers=1)]
    for before, after in zip([tracks[0], *tracks], tracks, strict=False):
        history.add(before, after)
    assert [k.epoch for k in history.kept] == [0, 1, 2, 3, 4]
    assert [float(k.state[0, 0]) for k in history.kept] == [1.0, 1.0, 1.0, 9.0, 9.0]


def test_beliefs_whose_phone_was_not_turned_are_dropped_once_it_was():
    """They were those of another way, from the jump of the heading on."""
    history, turned = BayesSmoother(AREA, ERRORS, every_m=1.0), Hold(1.0, 3.0)
    main, other = cloud((1.0, 1.0, 0, 0)), cloud((9.0, 9.0, 0, 0))
    held = (SimpleNamespace(hold=turned, start_m=6.0),)
    tracks = [at(0, main), at(1, main, held=held), at(2, main, held=held)]
    tracks += [at(3, other, takeovers=1, hold=turned), at(4, other, takeovers=1, hold=turned)]
    for before, after in zip([tracks[0], *tracks], tracks, strict=False):
        history.add(before, after)
    assert [k.epoch for k in history.kept] == [0, 3, 4]
    assert [float(k.state[0, 0]) for k in history.kept] == [1.0, 9.0, 9.0]


@pytest.mark.parametrize("takeovers", [0, 1])
def test_headings_that_are_read_as_usual_again(takeovers):
    """By a measured position beliefs stay; by an alternative those since its start are another's.

    No belief with a turned phone has led back to the usual reading.
    """
    history, turned = BayesSmoother(AREA, ERRORS, every_m=1.0), Hold(1.0, 3.0)
    main, other = cloud((1.0, 1.0, 0, 0)), cloud((9.0, 9.0, 0, 0))
    rival = SimpleNamespace(belief=at(0, other).belief, start_m=6.0) if takeovers else None
    tracks = [at(0, main, hold=turned), at(1, main, rival, hold=turned)]
    tracks += [at(2, main, rival, hold=turned), at(3, other, takeovers=takeovers)]
    for before, after in zip([tracks[0], *tracks], tracks, strict=False):
        history.add(before, after)
    assert [k.epoch for k in history.kept] == ([0, 3] if takeovers else [0, 1, 2, 3])
    assert history.alternative == []


@pytest.mark.parametrize("between", [False, True])
def test_an_alternative_that_outlasts_a_takeover_by_a_turned_phone(between):
    """What was kept of it before that is gone, so no part of it is joined to what it takes over."""
    history, turned = BayesSmoother(AREA, ERRORS, every_m=1.0), Hold(1.0, 3.0)
    main, other, last = (cloud((x, 1.0, 0, 0)) for x in (1.0, 5.0, 9.0))
    rival = SimpleNamespace(belief=at(0, last).belief, start_m=MOVED[1][2] - 0.5)
    held = (SimpleNamespace(hold=Hold(), start_m=MOVED[2][2] - 0.5),)
    first = turned if between else Hold()
    tracks = [at(0, main, hold=first), at(1, main, rival, hold=first, held=held)]
    tracks += [at(2, other if between else main, rival, takeovers=int(between))]
    tracks += [at(3, last, takeovers=1 + between), at(4, last, takeovers=1 + between)]
    for before, after in zip([tracks[0], *tracks], tracks, strict=False):
        history.add(before, after)
    assert [k.epoch for k in history.kept] == ([0, 3, 4] if between else [0, 1, 2, 3, 4])
    assert [float(k.state[0, 0]) for k in history.kept][1:] == [9.0] * (2 if between else 4)
    assert history.alternative_is_whole


@pytest.mark.parametrize("ends", [False, True])
def test_beliefs_that_positions_led_away_are_dropped_once_one_without_them_takes_over(ends):
    """Whether or not an alternative ends in the same epoch."""
    history = BayesSmoother(AREA, ERRORS, every_m=1.0)
    main, other = cloud((1.0, 1.0, 0, 0)), cloud((9.0, 9.0, 0, 0))
    rival = SimpleNamespace(belief=at(0, main).belief, start_m=7.0)
    left, since = None if ends else rival, {"takeovers": 1, "alone_from_m": 6.0}
    tracks = [at(0, main), at(1, main), at(2, main, rival)]
    tracks += [at(3, other, left, **since), at(4, other, left, **since)]
    for before, after in zip([tracks[0], *tracks], tracks, strict=False):
        history.add(before, after)
    assert [k.epoch for k in history.kept] == [0, 3, 4]
    # What was kept of the alternative before is not joined to it, as it may have gaps.
    assert history.alternative_is_whole is ends


def test_an_alternative_replaces_what_was_kept_after_such_a_takeover_too():
    history = BayesSmoother(AREA, ERRORS, every_m=1.0)
    main, other = cloud((1.0, 1.0, 0, 0)), cloud((9.0, 9.0, 0, 0))
    rival = SimpleNamespace(belief=at(0, other).belief, start_m=12.0)
    since = {"alone_from_m": 0.0}
    tracks = [at(0, main, **since), at(1, main, **since), at(2, main, rival, **since)]
    tracks += [at(3, other, takeovers=1, **since)]
    for before, after in zip([tracks[0], *tracks], tracks, strict=False):
        history.add(before, after)
    assert [float(k.state[0, 0]) for k in history.kept] == [1.0, 1.0, 9.0, 9.0]


def test_evidence_is_kept_by_epoch():
    tracking, converged = Status.TRACKING, Status.CONVERGED
    cases = [(10.0, tracking), (10.1, tracking), (5.0, converged), (nan, tracking), (9.0, tracking)]
    outputs = [
        StepOutput(
            Fix(float(k), 0.0, 0.0, np.eye(2), np.array([1.0, 2.0, radius_m]), status, 1, 1.0, 0,
                nan, Reason.USED),
            (nan, nan, 0.0, 1.0, -1.0),
        )
        for k, (radius_m, status) in enumerate(cases)
    ]  # fmt: skip
    columns = EstimateColumns()
    for output in outputs:
        columns.add(output)
    found = columns.estimate("EPSG:32629", "bayes").evidence
    assert found.log_evidence.tolist() == [-1.0] * 5
    assert found.entropy_bits.tolist() == [1.0] * 5
