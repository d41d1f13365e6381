"""Claims of a filter, counted by hand on a straight walk of 10 m/s."""

import numpy as np
import pytest

from mapfilter.evaluation.claims import claimed_radii, score_claims
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix

STATUS = {
    "S": Status.SEARCHING,
    "C": Status.CONVERGED,
    "T": Status.TRACKING,
    "U": Status.UNCERTAIN,
    "L": Status.LOST,
}


def truth(seconds):
    time_s = np.arange(seconds + 1.0)
    return Truth(time_s, 10.0 * time_s, np.zeros_like(time_s))


def claims(
    statuses, errors_m, radii_m=(10.0, 20.0, 30.0, 40.0), *, seconds=None, time_s=None, **more
):
    """Score epochs a second apart that are off to the north."""
    end = len(statuses) - 1 if seconds is None else seconds
    return score_claims(track(statuses, errors_m, radii_m, time_s), truth(end), **more)


def track(statuses, errors_m, radii_m, time_s=None):
    count = len(statuses)
    times = np.arange(float(count)) if time_s is None else np.asarray(time_s, dtype=float)
    errors = np.broadcast_to(np.asarray(errors_m, dtype=float), (count,))
    radii = np.broadcast_to(np.asarray(radii_m, dtype=float), (count, 4))
    fixes = [
        Fix(
            times[i], 10.0 * times[i], errors[i], np.eye(2), radii[i, :3], STATUS[statuses[i]],
            1, 1.0, 0, 0.0, Reason.USED, radii[i, 3],
        )
        for i in range(count)
    ]  # fmt: skip
    return TrackEstimate.of_fixes("EPSG:32629", "bayes", fixes)


def test_every_claimed_epoch_counts_and_no_other():
    found = claims("SSCTTLLCT", [5, 5, 5, 60, 5, 5, 5, 49, 51])
    assert (found.epochs, found.claimed, found.within_50m) == (9, 5, 3)
    assert found.km == pytest.approx(0.08)


@pytest.mark.parametrize(
    ("error_m", "radii_m", "covered"),
    [
        (10.0, (10.0, 20.0, 30.0, 40.0), (3, 3, 3, 3)),
        (10.01, (10.0, 20.0, 30.0, 40.0), (0, 3, 3, 3)),
        (20.5, (10.0, 20.0, 30.0, 40.0), (0, 0, 3, 3)),
        # Half as far again as the radius, and less than that, is outside.
        (30.5, (10.0, 20.0, 30.0, 30.4), (0, 0, 0, 0)),
        (38.9, (10.0, 20.0, 30.0, 40.0), (0, 0, 0, 3)),
        (10.0, (8.0, 9.0, 9.5, 9.9), (0, 0, 0, 0)),
        (0.0, (0.0, 0.0, 0.0, 0.0), (3, 3, 3, 3)),
        (5.0, (10.0, 20.0, 30.0, np.nan), (3, 3, 3, 0)),
    ],
)
def test_coverage_is_counted_against_the_radius_itself(error_m, radii_m, covered):
    assert claims("SCTT", error_m, radii_m).covered == covered


def test_coverage_takes_each_epochs_own_radius():
    radii = [(1, 1, 1, 1), (1, 2, 3, 4), (4, 5, 6, 7), (7, 8, 9, 10)]
    assert claims("SCTT", [0, 2, 5.5, 6], radii).covered == (1, 2, 3, 3)


def test_radii_are_counted_where_a_position_is_claimed():
    """Of five epochs with truth three are claimed; UNCERTAIN, LOST and the last one are not."""
    radii = [(1, 2, radius, 9) for radius in (10.0, 20.0, 90.0, 60.0, 80.0, 70.0)]
    found = claimed_radii(track("CTTULT", [10.0, 20.1, 5.0, 0, 0, 0], radii), truth(4))
    assert (found.epochs, found.claimed_epochs, found.held_95_epochs) == (5, 3, 2)
    assert found.radius_95_median_m == 20.0


@pytest.mark.parametrize(
    ("statuses", "radius_m", "claimed", "held"),
    [("SSU", 9.0, 0, None), ("CTT", np.nan, 3, None), ("CTT", np.inf, 3, 3), ("", 9.0, 0, None)],
)
def test_what_has_no_radius_is_held_by_none(statuses, radius_m, claimed, held):
    found = claimed_radii(track(statuses, 5.0, (1.0, 2.0, radius_m, 9.0)), truth(9))
    assert (found.epochs, found.claimed_epochs, found.held_95_epochs) == (
        len(statuses), claimed, held,
    )  # fmt: skip
    assert np.isnan(found.radius_95_median_m) == (held is None)


def test_an_epoch_without_a_radius_among_others_holds_nothing():
    radii = [(1, 2, radius, 9) for radius in (30.0, np.nan, 50.0)]
    found = claimed_radii(track("CTT", 5.0, radii), truth(9))
    assert (found.claimed_epochs, found.held_95_epochs, found.radius_95_median_m) == (3, 2, 40.0)


def test_every_converged_counts_also_after_lost():
    found = claims("SCTTLLCTLC", [900, 60, 5, 5, 5, 5, 49, 80, 5, 51])
    assert (found.converged, found.wrong_converged) == (3, 2)
    assert claims("SSCTC", [5, 5, 60, 5, 60], until_s=3.0).converged == 1


def test_the_limit_of_50_m_belongs_to_what_is_near():
    assert claims("CT", [50.0, 50.001]).within_50m == 1


def test_false_starts_are_claims_that_begin_far_off():
    # Begins wrong; goes wrong later; begins wrong again after LOST.
    assert claims("SCTTLCT", [0, 51, 0, 0, 0, 80, 80]).false_starts == 2
    assert claims("SCTTT", [0, 10, 60, 60, 60]).false_starts == 0
    assert claims("CTT", [51, 51, 51]).false_starts == 1
    assert claims("SSS", 100).false_starts == 0


def test_lost_begins_once_and_is_false_right_after_a_good_position():
    found = claims("SCTLLTTLSL", [0, 0, 10, 0, 0, 90, 90, 0, 0, 0])
    assert (found.lost, found.false_lost) == (3, 1)
    # The position counts that was claimed last, not the one reported with LOST.
    found = claims("CTLCTL", [0, 40, 200, 0, 200, 10])
    assert (found.lost, found.false_lost) == (2, 1)


def test_uncertain_positions_are_no_claims_but_may_be_lost_falsely():
    found = claims("SCTUUTU", [0, 0, 10, 60, 10, 60, 60])
    assert (found.claimed, found.within_50m, found.lost) == (3, 2, 0)
    # What goes on after it begins no claim.
    assert (found.false_starts, found.covered) == (0, (2, 2, 2, 2))
    assert claims("SUTLUT", [60, 60, 60, 0, 60, 60]).false_starts == 0
    assert claims("SUTLT", [60, 60, 60, 0, 60]).false_starts == 1
    found = claims("CTUULULUL", [0, 0, 0, 40, 40, 60, 60, 10, 10])
    assert (found.lost, found.false_lost) == (3, 2)


def test_nothing_counts_after_a_given_time():
    errors = [0, 0, 0, 0, 90, 90, 90]
    whole = claims("SCTTLTT", errors)
    assert (whole.claimed, whole.lost, whole.false_starts) == (5, 1, 1)
    until = claims("SCTTLTT", errors, until_s=3.0)
    assert (until.epochs, until.claimed, until.within_50m) == (4, 3, 3)
    assert (until.lost, until.false_starts, until.covered) == (0, 0, (3, 3, 3, 3))
    assert until.km == pytest.approx(0.03)
    assert until.worst_100m_m == 0.0


def test_epochs_without_truth_do_not_count():
    found = claims("CTTT", 5.0, seconds=2, time_s=[-1.0, 0.0, 2.0, 3.0])
    assert (found.epochs, found.claimed, found.covered) == (2, 2, (2, 2, 2, 2))
    assert found.km == pytest.approx(0.02)


def test_epochs_in_a_gap_of_the_truth_do_not_count():
    """The truth is at 0 and 40 s only, 400 m apart."""
    record = Truth(np.array([0.0, 40.0]), np.array([0.0, 400.0]), np.zeros(2))
    fixes = [
        Fix(
            time, 0.0, 0.0, np.eye(2), np.full(3, 1e3), status, 1, 1.0, 0, 0.0, Reason.USED, 1e3
        )
        for time, status in ((0.0, Status.TRACKING), (20.0, Status.CONVERGED), (40.0, Status.LOST))
    ]  # fmt: skip
    found = score_claims(TrackEstimate.of_fixes("EPSG:32629", "bayes", fixes), record)
    assert (found.epochs, found.claimed, found.converged, found.within_50m) == (2, 1, 0, 1)


@pytest.mark.parametrize(
    ("statuses", "begun"),
    [
        ("TTTTT", (1, 0)),
        ("SSTTT", (0, 0)),
        ("SSSTT", (1, 0)),
        ("LLLTT", (1, 1)),
        ("SSLLL", (0, 0)),
        ("TTLLL", (1, 0)),
        ("TTTTL", (1, 1)),
    ],
)
def test_what_goes_on_over_a_gap_of_the_truth_does_not_begin_anew_behind_it(statuses, begun):
    """All claims are 80 m off; the third of five epochs lies in a gap of 400 m."""
    time_s, east_m = [1.0, 2.0, 20.0, 42.0, 43.0], [0.0, 0.0, 0.0, 400.0, 400.0]
    record = Truth(
        *(np.array([one[k] for k in (0, 1, 3, 4)]) for one in (time_s, east_m)), np.zeros(4)
    )
    fixes = [
        Fix(
            time, east, 80.0, np.eye(2), np.full(3, 9.0), STATUS[letter],
            1, 1.0, 0, 0.0, Reason.USED, 9.0,
        )
        for time, east, letter in zip(time_s, east_m, statuses, strict=True)
    ]  # fmt: skip
    found = score_claims(TrackEstimate.of_fixes("EPSG:32629", "bayes", fixes), record)
    assert (found.epochs, found.false_starts, found.lost) == (4, *begun)


def test_a_track_without_a_claim():
    found = claims("SSLS", 5.0)
    assert (found.claimed, found.within_50m, found.covered) == (0, 0, (0, 0, 0, 0))
    assert np.isnan(found.worst_100m_m)


def test_the_worst_100_m_by_hand():
    # 11 epochs reach back 100 m: of epochs 5 to 15 all are 33 m off, of others some.
    errors = np.zeros(41)
    errors[5:16] = 33.0
    assert claims("C" + 40 * "T", errors).worst_100m_m == pytest.approx(33.0)
    errors[10] = 0.0
    assert claims("C" + 40 * "T", errors).worst_100m_m == pytest.approx(30.0)


def test_the_worst_100_m_begins_with_the_first_claim_and_goes_on_while_lost():
    errors = np.full(31, 500.0)
    errors[11:] = 10.0
    statuses = 11 * "S" + "C" + 19 * "T"
    assert claims(statuses, errors).worst_100m_m == pytest.approx(10.0)
    errors[20:] = 100.0
    statuses = 11 * "S" + "C" + 8 * "T" + 11 * "L"
    assert claims(statuses, errors).worst_100m_m == pytest.approx(100.0)


def test_the_worst_100_m_of_less_than_100_m_is_the_mean():
    assert claims("SSCTT", [900, 900, 10, 20, 60]).worst_100m_m == pytest.approx(30.0)


def test_the_worst_100_m_on_an_uneven_walk():
    """Against a double loop, with standing, jumps in time and positions that are not known."""
    rng = np.random.default_rng(3)
    time_s = np.cumsum(rng.uniform(0.1, 4.0, 120))
    errors = rng.exponential(30.0, 120)
    statuses = "".join(rng.choice(list("SCTL"), 120, p=[0.2, 0.1, 0.6, 0.1]))
    found = claims(statuses, errors, seconds=400, time_s=time_s).worst_100m_m
    first = min(statuses.index("C"), statuses.index("T"))
    means = []
    for end in range(first, 120):
        if 10.0 * (time_s[end] - time_s[first]) < 100.0:
            continue
        inside = [
            errors[i] for i in range(first, end + 1) if 10.0 * (time_s[end] - time_s[i]) <= 100.0
        ]
        means.append(sum(inside) / len(inside))
    assert found == pytest.approx(max(means))
