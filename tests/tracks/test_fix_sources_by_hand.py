"""Position sources by hand: which fixes repeat those of another file, and which are held."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.joining.position_sources import (
    _near,
    _precedence,
    _rank,
    _same,
    _stays,
    fixes_of,
    measured_positions,
    of_one_receiver,
    without_held,
)
from mapfilter.tracks.readers.recorded.recording import Clock, Recording

NAN = np.nan


def recording(name="a.csv", of="csv", **tables):
    made = {table: pd.DataFrame(rows) for table, rows in tables.items()}
    return Recording(Path(name), of, "", Clock("utc"), made, 0)


def by(*providers, name="a.csv", of="csv"):
    return recording(
        name, of, positions={"time_s": np.arange(float(len(providers))), "provider": providers}
    )


def way(time_s, east_m=0.0, north_m=0.0, **more):
    return pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": north_m, **more})


@pytest.mark.parametrize(
    ("providers", "kept", "note"),
    [
        (["GPS", "network", None, "gps"], [0, 3], "2 fixes of other providers than gps"),
        (["nlp", "FLP", "network"], [1], "2 fixes of other providers than flp"),
        (["network", "nlp"], [0], "1 fix of other providers than network"),
        (["fused", "flp", "fused"], [0, 2], "1 fix of other providers than fused"),
        (["gps", "gps"], [0, 1], ""),
        (["other", None], [0, 1], ""),
        ([None, None], [0, 1], ""),
    ],
)
def test_positions_of_the_best_provider_are_measured(providers, kept, note):
    rows, found = measured_positions(by(*providers))
    assert rows["time_s"].tolist() == kept
    assert rows.index.tolist() == list(range(len(kept)))
    assert found == (f"a.csv: {note} left out" if note else "")


def test_positions_may_be_metres_or_none():
    places = {"time_s": [0.0], "east_m": [1.0], "north_m": [2.0]}
    rows, note = measured_positions(recording(places=places))
    assert (rows["north_m"].tolist(), note) == ([2.0], "")
    assert measured_positions(recording(steps={"time_s": [0.0]})) == (None, "")


@pytest.mark.parametrize(
    ("providers", "rank"),
    [
        (["gps", None], 0),
        (["FUSED", "FUSED"], 1),
        (["flp"], 2),
        (["network"], 3),
        (["nlp"], 4),
        # Of several, of unknown ones and of none nothing is known.
        (["network", "nlp"], 0),
        (["other"], 0),
        ([None], 0),
    ],
)
def test_the_rank_of_a_file_is_that_of_its_only_provider(providers, rank):
    assert _rank(by(*providers)) == rank


def test_the_order_in_which_files_are_taken():
    """By provider, then those that state an accuracy, then the larger ones."""
    stated = way(np.arange(2.0), var_east_m2=[NAN, 4.0])
    unstated = way(np.arange(3.0), var_east_m2=NAN)
    assert _precedence((by("nlp"), stated)) == (4, False, -2)
    assert _precedence((by("gps"), unstated)) == (0, True, -3)
    assert _precedence((recording(), way(np.arange(5.0)))) == (0, True, -5)


@pytest.mark.parametrize(
    ("time_s", "at_s", "near"),
    [
        # Within 2 s, or one and a half intervals: 15 s of one in 10 s, by the median.
        (range(6), [-2.1, -2.0, 2.5, 7.0, 7.1], [False, True, True, True, False]),
        ([0, 10, 20], [-15.1, -15, 35, 35.1], [False, True, True, False]),
        ([0, 1, 2, 30], [4, 4.1, 27.9, 28], [True, False, False, True]),
        ([5], [2.9, 3, 7, 7.1], [False, True, True, False]),
    ],
)
def test_moments_near_those_of_another_file(time_s, at_s, near):
    found = _near(way(np.array(time_s, dtype=float)), way(np.array(at_s, dtype=float)))
    assert found.tolist() == near


def pair(count=20, off_m=0.0, apart_s=0.0, step_m=3.0, share=1.0):
    """Return two tables of a way along the parallel; a share of the second is off to the north."""
    time_s = np.arange(float(count))
    north = np.where(np.arange(count) < round(share * count), off_m, 0.0)
    return way(time_s, step_m * time_s), way(time_s + apart_s, step_m * (time_s + apart_s), north)


@pytest.mark.parametrize(
    ("tables", "same"),
    [
        # Twenty of them within half a metre, over more than 50 m.
        (pair(), True),
        (pair(count=19), False),
        (pair(step_m=2.7), True),
        (pair(step_m=2.6), False),
        (pair(off_m=0.49), True),
        (pair(off_m=0.51), False),
        # But for one in ten.
        (pair(off_m=9.0, share=0.05), True),
        (pair(off_m=9.0, share=0.2), False),
        # Between two moments by a straight line.
        (pair(apart_s=0.5), True),
        # Half of the shorter one at least has to be in common.
        (pair(count=60, apart_s=30.0), True),
        (pair(count=60, apart_s=34.0), False),
    ],
)
def test_positions_that_two_files_have(tables, same):
    assert _same(*tables) == same
    turned = (rows.rename(columns={"east_m": "north_m", "north_m": "east_m"}) for rows in tables)
    assert _same(*turned) == same


def placed(name, rows, provider=None, of="csv"):
    tables = {} if provider is None else {"positions": {"provider": [provider]}}
    return recording(name, of, **tables), rows


def kept(*given):
    """Return names and numbers of positions that are kept, and the notes."""
    found, notes = of_one_receiver(given)
    return [(one.path.name, len(rows)) for one, rows in found], notes


LINE = way(np.arange(100.0), 5 * np.arange(100.0))


def test_of_equal_positions_one_file_is_kept():
    part = LINE[40:60].reset_index(drop=True)
    found, notes = kept(placed("a.csv", part), placed("b.csv", LINE))
    assert found == [("b.csv", 100)]
    assert notes == ("a.csv: 20 positions left out beside b.csv, as they are the same",)
    # The one that states an accuracy; of the other one what is 2 s or more from it.
    found, notes = kept(placed("a.csv", part.assign(var_east_m2=4.0)), placed("b.csv", LINE))
    assert found == [("a.csv", 20), ("b.csv", 76)]
    assert notes == ("b.csv: 24 positions left out beside a.csv, as they are the same",)
    # Nor do equal places of two moments make one receiver: none are in common.
    fast = LINE.assign(time_s=LINE["time_s"] / 100)
    found, notes = kept(
        placed("a.csv", fast), placed("b.csv", fast.assign(time_s=fast["time_s"] + 1.5))
    )
    assert (found, notes) == ([("a.csv", 100), ("b.csv", 100)], ())
    # Two receivers.
    found, notes = kept(placed("a.csv", LINE), placed("b.csv", LINE.assign(north_m=1.0)))
    assert (found, notes) == ([("a.csv", 100), ("b.csv", 100)], ())


def test_of_providers_of_one_program_the_best_is_kept():
    other, late = LINE.assign(north_m=30.0), LINE.assign(time_s=LINE["time_s"] + 500)
    files = placed("n.csv", other, "network", "x"), placed("g.csv", LINE, "gps", "x")
    found, notes = kept(*files)
    assert found == [("g.csv", 100)]
    assert notes == ("n.csv: 100 positions left out beside g.csv, as they are of another provider",)
    # Not those of another program, nor of other times.
    assert kept(placed("n.csv", other, "network", "y"), files[1])[0] == [
        ("n.csv", 100),
        ("g.csv", 100),
    ]
    assert kept(placed("n.csv", late, "network", "x"), files[1]) == (
        [("n.csv", 100), ("g.csv", 100)],
        (),
    )
    # What two better ones leave.
    rows = pd.concat([other, late], ignore_index=True)
    third = placed("f.csv", late, "fused", "x")
    found, notes = kept(placed("n.csv", rows, "network", "x"), files[1], third)
    assert found == [("g.csv", 100), ("f.csv", 100)]
    assert [note[:30] for note in notes] == [
        "n.csv: 100 positions left out ",
        "n.csv: 100 positions left out ",
    ]


def held(first, last, count=60, step_m=10.0, **more):
    """Return fixes of each second that stay from one row to another, and motion."""
    at = np.arange(count)
    at = np.where((at > first) & (at <= last), first, at)
    time_s = np.arange(float(count))
    return without_held(way(time_s, 10.0 * at), way(time_s, step_m=step_m), **more)


@pytest.mark.parametrize(
    ("first", "last", "step_m", "left_out"),
    [
        # More than 10 s, in which motion goes more than 50 m.
        (20, 30, 10.0, 0),
        (20, 31, 10.0, 11),
        (20, 31, -10.0, 11),
        (20, 40, 2.5, 0),
        (20, 40, 2.6, 20),
        (0, 20, 10.0, 20),
        (40, 59, 10.0, 19),
    ],
)
def test_positions_that_stay_while_motion_goes_on(first, last, step_m, left_out):
    rows, note = held(first, last, step_m=step_m)
    assert len(rows) == 60 - left_out
    # The first one stays, and the next that moves.
    assert set(rows["time_s"]).isdisjoint(range(first + 1, first + 1 + left_out))
    seconds = last - first
    assert note == (
        f"gnss: {left_out} positions left out, as they stay the same for up to {seconds} s while "
        f"motion goes {abs(step_m) * seconds:.0f} m (likely: held by a receiver without satellites)"
        if left_out
        else ""
    )


def test_positions_of_rounded_degrees_stay_on_two_steps():
    """Of 111 m: 222 m, beside 20 s of motion at 11.0 or 11.2 m/s."""
    assert held(20, 40, step_m=11.0, rounded_m=111.0)[1] == ""
    assert len(held(20, 40, step_m=11.2, rounded_m=111.0)[0]) == 40
    assert held(20, 40, step_m=1.0, rounded_m=1.0)[1] == ""


def test_nothing_is_held_without_motion_or_beside_missing_steps():
    rows = way(np.arange(60.0), 5.0)
    assert without_held(rows, None) == (rows, "")
    assert without_held(rows[:1], way([0.0], step_m=[5.0]))[1] == ""
    assert without_held(rows, way(np.arange(60.0), step_m=NAN))[1] == ""
    # A missing step is none; those of a whole minute.
    steps = np.where(np.arange(60) % 2, NAN, 2.0)
    kept_rows, note = without_held(rows, way(np.arange(60.0), step_m=steps))
    assert kept_rows["time_s"].tolist() == [0]
    assert "for up to 59 s while motion goes 58 m" in note


def wandering(count=60, first=20, last=40, off_m=2.9):
    """Positions of each second of 10 m/s that stay within some metres of one place."""
    at = np.arange(float(count))
    east = np.where(at <= first, 10 * at, 10 * first)
    east = np.where(at > last, 10 * at, east)
    return way(at, east, np.where((at > first) & (at <= last) & (at % 2 == 1), off_m, 0.0))


@pytest.mark.parametrize(
    ("off_m", "step_m", "driven", "left_out"),
    [
        # Within 3 m, over more than 100 m, of wheels alone.
        (2.9, 10.0, True, 20),
        (3.1, 10.0, True, 0),
        (2.9, 10.0, False, 0),
        (2.9, 5.1, True, 20),
        (2.9, 4.9, True, 0),
    ],
)
def test_positions_that_stay_within_3_m_while_wheels_turn(off_m, step_m, driven, left_out):
    motion = way(np.arange(60.0), step_m=step_m)
    rows, note = without_held(wandering(off_m=off_m), motion, driven=driven)
    assert len(rows) == 60 - left_out
    assert ("as they stay within 3 m for up to 20 s while motion goes" in note) == bool(left_out)


def test_noise_of_wheels_at_rest_is_no_way():
    """Slower than 0.3 m/s; in steps of 20 s, 5.9 and 6.1 m."""
    time_s = 20.0 * np.arange(60.0)
    rows = wandering().assign(time_s=time_s)
    for step_m, left_out in ((5.9, 0), (6.1, 20)):
        steps = np.where((np.arange(60) > 20) & (np.arange(60) <= 40), step_m, 10.0)
        found, _ = without_held(rows, way(time_s, step_m=steps), driven=True)
        assert len(found) == 60 - left_out


def stays(places, time_s=None, way_m=None, moved_m=100.0):
    places = np.asarray(places, dtype=complex)
    time_s = np.arange(float(len(places))) if time_s is None else np.asarray(time_s, dtype=float)
    way_m = 10.0 * np.arange(float(len(places))) if way_m is None else np.asarray(way_m)
    first, last = _stays(time_s, places, way_m, moved_m)
    return list(zip(first.tolist(), last.tolist(), strict=True))


def test_stretches_that_stay_near_their_first_place():
    moving = 10.0 * np.arange(20)
    still = np.full(20, 200.0)
    on = 210 + moving
    assert stays([*moving, *still, *on]) == [(20, 39)]
    assert stays([*still, *on]) == [(0, 19)]
    assert stays([*moving, *still]) == [(20, 39)]
    # Up to the first that is more than 3 m away, after which a new one may begin.
    assert stays([*moving, *still, *(still + 3), *(still + 3.1)]) == [(20, 59), (60, 79)]
    assert stays(moving) == []
    assert stays(still[:11]) == []
    # 100 m on: 11 rows have 100 m between them, 12 rows 110 m.
    assert stays(np.full(12, 1.0)) == [(0, 11)]


def test_who_comes_back_has_not_stayed():
    """A way round of 120 m, to the place where it began."""
    way_round = [0, 10, 20, 30, 30 + 10j, 30 + 20j, 30 + 30j, 20 + 30j, 10 + 30j, 30j, 20j, 10j]
    assert stays([*way_round, *way_round]) == []
    # Nor who has positions hours apart.
    places, way_m = np.zeros(5), 1000.0 * np.arange(5)
    assert stays(places, 60.0 * np.arange(5), way_m) == [(0, 4)]
    assert stays(places, 60.1 * np.arange(5), way_m) == []
    # Or only two of them; three in more than 10 s.
    assert stays(np.zeros(2), [0, 50], way_m[:2]) == []
    assert stays(np.zeros(3), [0, 5, 10], way_m[:3]) == []
    assert stays(np.zeros(3), [0, 5, 10.1], way_m[:3]) == [(0, 2)]


def test_fixes_have_variances_of_their_accuracy():
    """68 % of errors lie within 1.515 standard deviations: 3.03 m are two of 1 m."""
    at = np.arange(3.0)
    places = {"time_s": at, "east_m": 5 * at, "north_m": -at, "accuracy_m": [3.03, 0.0, NAN]}
    one, notes = recording(places=places), []
    frame = SimpleNamespace(east_north=lambda rows, _: (rows["east_m"], rows["north_m"]))
    found = fixes_of([recording("b.csv", steps={"time_s": [0.0]}), one], frame, None, notes)
    assert found["var_east_m2"].tolist() == pytest.approx([4, NAN, NAN], nan_ok=True)
    assert found["var_north_m2"].tolist() == pytest.approx([4, NAN, NAN], nan_ok=True)
    assert found["cov_east_north_m2"].tolist() == pytest.approx([0, NAN, NAN], nan_ok=True)
    assert found["east_m"].tolist() == [0, 5, 10]
    assert found["north_m"].tolist() == [0, -1, -2]
    assert notes == []
    assert fixes_of([recording(steps={"time_s": [0.0]})], frame, None, notes) is None
    unstated = recording(places=dict(list(places.items())[:3]))
    assert fixes_of([unstated], frame, None, notes)["var_east_m2"].isna().all()
