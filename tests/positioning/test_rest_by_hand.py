"""Rests by their levels: blocks, serving cells, bounds and the doubt, by hand."""

from dataclasses import replace
from math import exp, nan

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.sensors.reported_levels import levels_of
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.rest_levels import added_nats, carried_nats_of, left_nats_of
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched


def row(cell, level_dbm, role="neighbour", censored=0, **more):
    return ReportRow(role, cell, more.get("arfcn"), more.get("bsic"), level_dbm, censored)


def test_levels_by_their_cells_or_carriers():
    rows = (row("A", -70.0), row(None, -80.0, arfcn=12, bsic=3), row("B", nan),
            row("C", -99.0, censored=-1), row(None, -81.0, arfcn=12))  # fmt: skip
    assert levels_of(rows) == [("A", -70.0), ("12/3", -80.0), ("12/None", -81.0)]


def test_a_cell_that_serves_is_compared_with_itself_as_a_neighbour():
    """A report names the cell that serves; neighbours have a carrier and a code alone."""
    serves, beside = {"cell": "A", "role": "serving"}, {"cell": None, "role": "neighbour"}
    code = {"arfcn": 12, "bsic": 3}
    named, coded = (levels_of((row(level_dbm=-70.0, **own, **code),)) for own in (serves, beside))
    assert named == coded == [("12/3", -70.0)]
    assert levels_of((row("A", -70.0, arfcn=12),)) == [("A", -70.0)]


@pytest.mark.parametrize("measured_m", [0.0, 6.0])
@pytest.mark.parametrize("way_m", [0.0, 8.0, 60.0, 500.0])
@pytest.mark.parametrize("changes", [(3.0,), (2.0, -9.0), (8.0, 7.5, 9.0)])
def test_likelihoods_of_ways_and_rests_are_those_of_normal_vectors(changes, way_m, measured_m):
    """Means of two and of three levels; half of the log-likelihood ratio counts."""
    names = "ABCD"[: len(changes)]
    first = dict.fromkeys(names, (2 * -80.0, 2))
    now = {name: (3 * (-80.0 + x), 3) for name, x in zip(names, changes, strict=True)}
    count = len(changes)
    at_rest = 2.7**2 + 3.3**2 * (1 / 2 + 1 / 3)
    on_way, as_measured = (at_rest + 10.5**2 * (1 - exp(-m / 60)) for m in (way_m, measured_m))

    def ratio(seen):
        one, other = (
            multivariate_normal.logpdf(
                seen, np.zeros(count), own * np.eye(count) + 36.0 * np.ones((count, count))
            )
            for own in (on_way, as_measured)
        )
        return 0.5 * (one - other)

    found = left_nats_of(first, {**now, "Z": (-50.0, 1)}, way_m, measured_m)
    expected = (ratio(changes), ratio([0.0] * count)) if way_m else (0.0, 0.0)
    assert found == pytest.approx(expected)
    assert left_nats_of(first, {"Z": (-50.0, 1)}, way_m, measured_m) == (0.0, 0.0)


def test_levels_elsewhere_differ_by_nine_decibels_and_by_less_along_the_way_measured():
    first, now = {"A": (-240.0, 3), "B": (-90.0, 1)}, {"A": (-146.0, 2), "B": (-98.0, 1)}
    changes = (7.0, -8.0)
    for measured_m in (0.0, 20.0, 60.0, 900.0):
        as_measured = 4.0**2 + 10.5**2 * (1 - exp(-measured_m / 60)) / 2
        one, other = (
            multivariate_normal.logpdf(changes, np.zeros(2), own * np.eye(2) + 36.0)
            for own in (81.0, as_measured)
        )
        assert carried_nats_of(first, now, measured_m) == pytest.approx(0.5 * (one - other))
    # Other cells say nothing.
    assert carried_nats_of(first, {"C": (-50.0, 1)}, 0.0) == 0.0


def test_what_is_measured_is_added_up_and_no_doubt():
    rest = Rest(0.0, pace_mps=1.0, left_nats=-0.9, still_nats=-2.5)
    assert rest.heard(20.0, (), 4.0).heard(40.0, (), 5.0).measured_m == 9.0
    assert rest.heard(53.9, (), 9.0).is_doubtful is False
    assert rest.heard(54.1, (), 9.0).is_doubtful is True


def test_what_a_block_gains_is_bounded_and_so_is_the_sum_below():
    assert added_nats(1.0, 2.0) == 3.0
    assert added_nats(1.0, 9.0) == 4.0
    assert added_nats(1.0, -9.0) == -2.0
    assert added_nats(-11.0, -2.0) == -13.0
    assert added_nats(-20.0, -2.0) == -21.0
    assert added_nats(100.0, 1.0) == 101.0


def test_levels_are_added_up_by_blocks_of_ten_seconds():
    rest = Rest(0.0, pace_mps=1.4)
    for time_s, level_dbm in ((5.0, -70.0), (9.0, -72.0), (14.9, -74.0)):
        rest = rest.heard(time_s, (row("A", level_dbm),))
    assert (rest.block_s, rest.began_s, rest.first) == (5.0, 5.0, {})
    assert rest.present == {"A": (-216.0, 3)}
    assert rest.heard_s == 14.9
    rest = rest.heard(15.0, (row("A", -90.0), row("B", -60.0)))
    assert (rest.block_s, rest.began_s) == (15.0, 5.0)
    assert rest.first == {"A": (-216.0, 3)}
    assert rest.present == {"A": (-90.0, 1), "B": (-60.0, 1)}
    rest = rest.heard(25.0, ())
    # The first mean of each cell stays; others come in with theirs.
    assert rest.first == {"A": (-216.0, 3), "B": (-60.0, 1)}
    assert rest.present == {}
    # The way to the second block at the pace before.
    gained, unchanged = left_nats_of({"A": (-216.0, 3)}, {"A": (-90.0, 1)}, 14.0, 0.0)
    assert (rest.left_nats, rest.still_nats) == pytest.approx((gained, unchanged))
    assert gained > 0 > unchanged


def serving(cell):
    return (row(cell, nan, "serving"),)


def test_three_cells_serve_at_rest_and_each_further_one_counts():
    rest, found = Rest(0.0), []
    for k, cell in enumerate("ABCDAE"):
        rest = rest.heard(float(k), serving(cell))
        found.append(rest.carried_nats)
    assert found[:3] == [0.0, 0.0, 0.0]
    # What is forgotten in a second is a three-hundredth.
    assert found[3:] == pytest.approx([2.5, 2.5 - 1 / 300, 5.0 - 2 / 300])
    assert rest.served == {"A": 4.0, "B": 1.0, "C": 2.0, "D": 3.0, "E": 5.0}
    assert not rest.is_carried
    last = rest.heard(6.0, serving("F"))
    assert last.carried_nats == 6.0
    assert last.is_carried
    assert last.heard(7.0, serving("G")) is last


def test_cells_that_served_long_ago_are_forgotten():
    rest = Rest(0.0, served={"A": 0.0, "B": 100.0, "C": 100.0})
    assert rest.heard(600.0, serving("D")).carried_nats == 2.5
    late = rest.heard(600.1, serving("D"))
    assert late.carried_nats == 0.0
    assert set(late.served) == {"B", "C", "D"}
    # Neighbours and rows without a cell are no serving cells.
    other = rest.heard(1.0, (row("X", -70.0), row(None, -70.0, "serving"), row("Y", -70.0)))
    assert set(other.served) == {"A", "B", "C"}


def test_the_sum_forgets_to_zero_and_no_further():
    rest = Rest(0.0, carried_nats=1.0, heard_s=0.0)
    assert rest.heard(150.0, ()).carried_nats == pytest.approx(0.5)
    assert rest.heard(900.0, ()).carried_nats == 0.0
    assert replace(rest, heard_s=nan).heard(900.0, ()).carried_nats == 1.0


@pytest.mark.parametrize(
    ("time_s", "left", "still", "doubtful", "expected"),
    [
        (45.0, -0.9, -2.5, False, True),
        (44.9, -0.9, -2.5, False, False),
        (45.0, -0.9, -2.4, False, False),
        (45.0, -1.0, -2.5, False, False),
        # A doubt lasts until more is shown.
        (45.0, -1.0, -2.5, True, True),
        (45.0, -4.9, -2.5, True, True),
        (45.0, -5.0, -2.5, True, False),
    ],
)
def test_when_a_rest_is_in_doubt(time_s, left, still, doubtful, expected):
    rest = Rest(0.0, pace_mps=1.0, left_nats=left, still_nats=still, is_doubtful=doubtful)
    assert rest.heard(time_s, ()).is_doubtful == expected
    carried = replace(rest, carried_nats=5.9, served=dict.fromkeys("ABC", time_s))
    assert not carried.heard(time_s, serving("D")).is_doubtful


def test_a_rest_lasts_since_the_last_step():
    rest = Rest(100.0, pace_mps=1.0, left_nats=-0.9, still_nats=-2.5)
    assert not rest.heard(144.9, ()).is_doubtful
    assert rest.heard(145.0, ()).is_doubtful


def test_without_a_pace_before_nothing_is_in_doubt_and_nothing_is_at_first():
    known = {"left_nats": -0.9, "still_nats": -2.5}
    assert not Rest(0.0, **known).heard(1e4, ()).is_doubtful
    assert not Rest(0.0, pace_mps=1.0, left_nats=-1.0, still_nats=-2.5).heard(45.0, ()).is_doubtful


@pytest.mark.parametrize(
    ("measured_m", "usual"), [(29.9, 3), (30.0, 4), (59.9, 4), (60.0, 5), (90.0, 6)]
)
def test_along_a_way_one_more_cell_serves_for_each_thirty_metres(measured_m, usual):
    rest, found = Rest(0.0, measured_m=measured_m), []
    for cell in "ABCDEFG"[: usual + 1]:
        rest = rest.heard(0.0, serving(cell))
        found.append(rest.carried_nats)
    assert found == [0.0] * usual + [2.5]


@pytest.mark.parametrize(
    ("before", "change_db", "bounds"),
    [(1.0, 8.0, None), (1.0, 0.0, None), (0.1, 0.0, 0.0), (1.0, 60.0, 6.0), (0.0, 14.0, None)],
)
def test_half_of_what_a_block_says_of_being_elsewhere_counts(before, change_db, bounds):
    """Within the sum's bounds: 0, and 6 from which on the phone is carried."""
    elsewhere, at_rest = (
        multivariate_normal.logpdf(change_db, 0.0, sd_db**2 + 6.0**2) for sd_db in (9.0, 4.0)
    )
    levels = {"first": {"A": (-80.0, 1)}, "present": {"A": (-80.0 + change_db, 1)}}
    rest = Rest(0.0, block_s=10.0, began_s=0.0, heard_s=20.0, carried_nats=before, **levels)
    expected = before + (elsewhere - at_rest) / 2 if bounds is None else bounds
    assert rest.heard(20.0, ()).carried_nats == pytest.approx(expected)


def test_the_probability_of_having_left():
    assert Rest(0.0).left_probability == 0.5
    assert Rest(0.0, left_nats=2.0).left_probability == pytest.approx(1 / (1 + exp(-2)))


@pytest.mark.parametrize(
    ("changes", "ride"),
    [
        ({}, True),
        ({"since_s": 41.0}, False),
        ({"carried_nats": 5.9}, False),
        ({"pace_mps": 2.6}, False),
        ({"carried_mps": 4.0}, False),
    ],
)
def test_a_walker_who_is_carried_for_a_minute_may_be_anywhere(changes, ride):
    """Not in a vehicle, and not where positions show how fast it goes."""
    given = {"since_s": 40.0, "carried_nats": 6.0, "pace_mps": 2.5, **changes}
    assert Rest(**given).was_ride(100.0) is ride


def turning(rest, turns_rad, *, period_s=1.0, heading_rad=nan):
    """The rest after rows of turns without a way."""
    for k, turn_rad in enumerate(turns_rad):
        rest = rest.turned(k * period_s, (MotionStep(0.0, heading_rad, turn_rad),))
    return rest


def test_a_vehicle_that_takes_a_corner_does_not_stand():
    """Turns of the last seconds count: those of 10 s before with 1/e."""
    car = Rest(0.0, pace_mps=9.0, braked_mps2=9.0)
    assert turning(car, [0.2] * 4).turned_rad == pytest.approx(
        0.2 * sum(exp(-k / 10) for k in range(4))
    )
    assert not turning(car, [0.2] * 4).is_carried
    assert turning(car, [0.2] * 5).is_carried
    assert turning(car, [-0.2] * 5).is_carried
    carried = turning(car, [0.2] * 5)
    assert carried.heard(9.0, ()).is_carried
    assert carried.turned(9.0, (MotionStep(0.0, nan, 9.0),)) is carried


@pytest.mark.parametrize(
    ("pace_mps", "braked_mps2", "turns_rad", "heading_rad"),
    [
        # A walker turns at rest, courses of a receiver do, and the bias of a gyroscope adds up.
        (1.4, 9.0, [0.5] * 9, nan),
        (9.0, 9.0, [0.5] * 9, 1.0),
        (9.0, 9.0, [0.05] * 900, nan),
        (9.0, 9.0, [nan] * 9, nan),
        (9.0, 9.0, [0.6, -0.6] * 9, nan),
        # Wheel sensors read zero while a car rolls out into a parking lot.
        (9.0, 4.9, [0.5] * 9, nan),
    ],
)
def test_turns_that_are_no_corner(pace_mps, braked_mps2, turns_rad, heading_rad):
    rest = Rest(0.0, pace_mps=pace_mps, braked_mps2=braked_mps2)
    assert not turning(rest, turns_rad, heading_rad=heading_rad).is_carried


def towed(rest, turns_rad, levels_dbm):
    """The rest after seconds of a turn each, and reports of four cells."""
    for k, (turn_rad, level_dbm) in enumerate(zip(turns_rad, levels_dbm, strict=True)):
        apart = (level_dbm, -80.0, -90.0 - level_dbm / 4, -85.0)
        rows = tuple(row(cell, dbm) for cell, dbm in zip("ABCD", apart, strict=True))
        rest = rest.heard(float(k), rows).turned(float(k), (MotionStep(0.0, nan, turn_rad),))
    return rest


def test_turns_after_a_usual_stop_count_beside_levels():
    """A tow: two corners, and levels that change from the third block on."""
    car, turns = Rest(0.0, pace_mps=9.0, braked_mps2=1.3), ([0.0] * 15 + [0.25] * 6) * 2
    stood, changed = [-70.0] * 42, [-70.0] * 20 + [-88.0] * 22
    assert not towed(car, [0.0] * 42, changed).is_carried
    assert not towed(car, turns, stood).is_carried
    assert towed(car, turns, changed).is_carried
    # Half a degree a second is the bias of a gyroscope; a walker turns at rest.
    assert not towed(car, [np.radians(0.5)] * 42, changed).is_carried
    assert not towed(replace(car, pace_mps=1.4), turns, changed).is_carried


def test_turns_alone_never_outweigh_a_usual_stop():
    """Each turn of 45 degrees adds 2, to 5 at most; levels that say more stay as they are."""
    car = Rest(0.0, pace_mps=9.0, braked_mps2=5.0)
    sums = [turning(car, [0.8] * k).carried_nats for k in range(5)]
    assert sums == [0.0, 2.0, 4.0, 5.0, 5.0]
    assert turning(replace(car, carried_nats=5.5), [0.8]).carried_nats == 5.5
    assert turning(car, [0.8, 0.1]).turned_rad == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("speeds_mps", "braked_mps2"),
    [([8.0, 8.0, 8.0], 8.0), ([8.0, 6.0, 3.0], 3.0), ([8.0, 5.0, 2.4], 0.0), ([1.4] * 3, 0.0)],
)
def test_how_a_rest_began(speeds_mps, braked_mps2):
    watch = SensorWatch()
    for k, step_m in enumerate([speeds_mps[0]] * 40 + speeds_mps + [0.0]):
        watch, _, _ = watched(watch, Epoch(float(k), (MotionStep(step_m, nan, 0.0),)))
    assert watch.rest.braked_mps2 == pytest.approx(braked_mps2)


def test_turns_are_kept_while_reports_come():
    rest = turning(Rest(0.0, pace_mps=9.0, braked_mps2=9.0), [0.2] * 3)
    heard = rest.heard(3.0, (row("A", -70.0),))
    assert (heard.turned_rad, heard.turned_s) == (rest.turned_rad, 2.0)


LATE = Rest(100.0, pace_mps=1.25, left_nats=-5.0, still_nats=-2.5)
"""From 120 s on one may be 25 m away."""


@pytest.mark.parametrize(
    ("rest", "time_s", "share"),
    [
        # One in twenty such rests is none, e times fewer at a sum of -5, and e² at -10.
        (LATE, 120.0, 0.05 * exp(-1)),
        (replace(LATE, left_nats=-10.0), 120.0, 0.05 * exp(-2)),
        (replace(LATE, left_nats=3.0), 500.0, 0.05),
        (LATE, 119.9, 0.0),
        (replace(LATE, measured_m=5.0), 120.0, 0.0),
        (replace(LATE, measured_m=5.0), 124.0, 0.05 * exp(-1)),
        # Levels could not show it yet, but speak against it.
        (replace(LATE, still_nats=-2.0, left_nats=3.0), 120.0, 0.05),
        # Levels cannot show it, or have shown it; or it is known to be none; or a vehicle stands.
        (replace(LATE, still_nats=-2.4), 500.0, 0.0),
        (replace(LATE, still_nats=0.0, left_nats=0.0), 500.0, 0.0),
        (replace(LATE, left_nats=-19.5), 500.0, 0.0),
        (replace(LATE, left_nats=-19.4), 500.0, 0.05 * exp(-19.4 / 5)),
        (replace(LATE, carried_nats=6.0), 500.0, 0.0),
        (replace(LATE, pace_mps=2.6), 500.0, 0.0),
    ],
)
def test_a_walker_may_have_left_unnoticed_until_levels_show_the_rest(rest, time_s, share):
    odds = share / 0.95
    assert rest.left_share(time_s) == pytest.approx(odds / (1 + odds), rel=1e-12)
