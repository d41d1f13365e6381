"""Pseudoranges and time differences in logs: round trips, almanacs, hostile rows."""

import json

import numpy as np
import pandas as pd
import pytest
from made_recordings import START_UTC_S
from made_satellites import rinex3_nav, rinex_obs

from mapfilter.errors import InputError
from mapfilter.gnss.almanacs import Almanac, nominal_gps
from mapfilter.gnss.broadcast import UNPLACED
from mapfilter.gnss.orbits import EARTH_RATE_RAD_S, gps_time, satellite_positions_m
from mapfilter.tracks.kinds import leave_out
from mapfilter.tracks.log import make_log
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.satellites import place_satellites
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.store import read_log, write_log

CRS, START = "EPSG:32629", 1_700_000_000.0
PLACE = ["x_m", "y_m", "z_m"]


def ranges(**changed):
    table = {
        "time_s": [0.0, 0.0, 1.0],
        "satellite": ["G07", "E19", "G07"],
        "pseudorange_m": [2.1e7, np.nan, 2.1e7 + 0.1],
        "sigma_m": [np.nan, 3.5, 2.0],
        "x_m": [2.0e7, 1.0e7, np.nan],
        "y_m": [1.0e7, 2.5e7, np.nan],
        "z_m": [1.3e7, 1.0e7, np.nan],
    }
    return pd.DataFrame({**table, **changed})


DIFFERENCES = pd.DataFrame(
    {"time_s": [0.0, 0.0], "cell": ["A", "B"], "reference": ["C", "C"],
     "difference_m": [120.25, np.nan], "sigma_m": [5.0, np.nan], "reference_sigma_m": [4.0, 4.0]}
)  # fmt: skip


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_ranges_and_differences_round_trip(tmp_path, form):
    log = make_log(CRS, pseudoranges=ranges(), tdoa=DIFFERENCES, start_utc_s=START)
    write_log(log, tmp_path / "log", form)
    again = read_log(tmp_path / "log")
    for table in TABLES:
        pd.testing.assert_frame_equal(getattr(again, table), getattr(log, table), check_exact=True)
    assert len(again.pseudoranges) == 3
    assert np.isnan(again.pseudoranges["pseudorange_m"][1])


def test_a_log_without_them_has_no_such_files(tmp_path):
    write_log(make_log(CRS), tmp_path / "log")
    assert {p.stem for p in (tmp_path / "log").iterdir()} == {
        "log", "motion", "radio", "gnss", "truth",
    }  # fmt: skip
    assert read_log(tmp_path / "log").pseudoranges.empty


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"pseudorange_m": [2.1e7 + 18 * 299_792_458.0] * 3}, r"by hours \(time zone\)"),
        ({"pseudorange_m": [21_000.0] * 3}, "kilometres"),
        ({"pseudorange_m": [np.inf] * 3}, "metres in 1.5e7..6e7"),
        ({"satellite": ["GPS 7", "E19", "G07"]}, "constellation's letter"),
        ({"satellite": ["G07", None, "G07"]}, "satellite: expected a name such as G07"),
        ({"sigma_m": [0.0, 3.0, 1.0]}, "row 1, sigma_m"),
        ({"x_m": [2e4, 1e7, np.nan], "y_m": [1e4, 2e7, np.nan], "z_m": [1e4, 1e7, np.nan]},
         "kilometres for metres"),
        ({"z_m": [1.3e7, np.nan, np.nan]}, "row 2, x_m, y_m, z_m: expected all three"),
        ({"pseudorange_m": ["far", "2.1e7", ""]}, "pseudorange_m"),
        ({"time_s": [0.0, np.nan, 1.0]}, "row 2, time_s"),
    ],
)  # fmt: skip
def test_rows_that_no_receiver_tells_are_refused(changed, told):
    with pytest.raises(InputError, match=told):
        make_log(CRS, pseudoranges=ranges(**changed))


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"difference_m": [4e5, 0.0]}, "nanoseconds"),
        ({"reference": ["C", ""]}, "row 2, reference"),
        ({"sigma_m": [-1.0, 1.0]}, "row 1, sigma_m"),
    ],
)
def test_differences_that_cannot_be_are_refused(changed, told):
    with pytest.raises(InputError, match=told):
        make_log(CRS, tdoa=DIFFERENCES.assign(**changed))


def test_an_almanac_places_satellites_at_the_moment_they_sent():
    week, second = gps_time(START)
    almanac = nominal_gps(week)
    rows = ranges(satellite=["G07", "G01", "G07"])
    log = make_log(CRS, pseudoranges=rows, almanac=almanac, start_utc_s=START)
    way_s = (2.1e7 + 0.1) / 299_792_458.0
    there = satellite_positions_m(almanac, second + 1.0 - way_s, week)[almanac.names.index("G07")]
    angle = EARTH_RATE_RAD_S * way_s
    turned = [
        there[0] * np.cos(angle) + there[1] * np.sin(angle),
        there[1] * np.cos(angle) - there[0] * np.sin(angle),
        there[2],
    ]
    np.testing.assert_allclose(log.pseudoranges[PLACE].to_numpy()[2], turned, atol=1e-3)
    # What the rows tell themselves stays.
    np.testing.assert_array_equal(log.pseudoranges[PLACE].to_numpy()[:2], rows[PLACE][:2])


def test_places_run_on_over_the_end_of_a_week():
    last = START + 604_800.0 - gps_time(START)[1]
    week, _ = gps_time(last - 1.0)
    bare = ranges(satellite=["G07"] * 3, time_s=[-1.0, 0.0, 1.0], pseudorange_m=[2.1e7] * 3,
                  **dict.fromkeys(PLACE, np.nan))  # fmt: skip
    placed, _ = place_satellites(bare, nominal_gps(week), last)
    steps_m = np.linalg.norm(np.diff(placed[PLACE].to_numpy(), axis=0), axis=1)
    assert steps_m[0] == pytest.approx(steps_m[1], rel=1e-4)


def test_an_almanac_that_counts_weeks_modulo_1024_is_counted_on():
    week, _ = gps_time(START)
    bare = ranges(satellite=["G07"] * 3, **dict.fromkeys(PLACE, np.nan))
    one, other = (place_satellites(bare, nominal_gps(w), START)[0] for w in (week, week % 1024))
    pd.testing.assert_frame_equal(one, other)


def test_an_almanac_of_another_time_is_refused():
    bare = ranges(satellite=["G07"] * 3, **dict.fromkeys(PLACE, np.nan))
    week, _ = gps_time(START)
    with pytest.raises(InputError, match="days off"):
        make_log(CRS, pseudoranges=bare, almanac=nominal_gps(week - 60), start_utc_s=START)
    with pytest.raises(InputError, match="start_utc_s"):
        make_log(CRS, pseudoranges=bare, almanac=nominal_gps(week))


def test_satellites_without_any_place_are_noted():
    log = make_log(CRS, pseudoranges=ranges(**dict.fromkeys(PLACE, np.nan)))
    (note,) = log.notes
    assert note.startswith("pseudoranges: 3 rows without the place")
    assert "navigation file" in note
    placed = ranges(x_m=2.0e7, y_m=1.0e7, z_m=1.3e7)
    assert not make_log(CRS, pseudoranges=placed).notes
    # One who gave a file of another day is not told to give one.
    given = f"pseudoranges: 3 {UNPLACED} (G07)"
    bare = ranges(**dict.fromkeys(PLACE, np.nan))
    assert make_log(CRS, pseudoranges=bare, notes=[given]).notes == (given,)


def test_unknown_and_unhealthy_satellites_are_noted():
    week, _ = gps_time(START)
    almanac = nominal_gps(week)
    healthy = almanac.healthy.copy()
    healthy[almanac.names.index("G07")] = False
    sick = Almanac(*[getattr(almanac, name) for name in Almanac.__dataclass_fields__][:-1], healthy)
    bare = ranges(**dict.fromkeys(PLACE, np.nan))
    log = make_log(CRS, pseudoranges=bare, almanac=sick, start_utc_s=START)
    assert log.pseudoranges[PLACE].isna().all(axis=None)
    assert [note.partition(": ")[2] for note in log.notes] == [
        "E19 is not in the almanac, 1 row without a place",
        "G07 is not healthy, 2 rows without a place",
    ]


YUMA = """******** Week 220 almanac for PRN-07 ********
ID:                         07
Health:                     000
Eccentricity:               0.1E-001
Time of Applicability(s):   503808.0
Orbital Inclination(rad):   0.96
Rate of Right Ascen(r/s):  -0.79E-008
SQRT(A)  (m 1/2):           5153.6
Right Ascen at Week(rad):   0.5
Argument of Perigee(rad):   0.3
Mean Anom(rad):             0.1
Af0(s):                     0.1E-003
Af1(s/s):                   0.0
week:                       {week}
"""


def test_an_almanac_beside_the_tables_is_read(tmp_path):
    week, _ = gps_time(START)
    head = {"crs": CRS, "start_utc_s": START}
    (tmp_path / "log.json").write_text(json.dumps(head))
    (tmp_path / "pseudoranges.csv").write_text("time_s,satellite,pseudorange_m\n0,G07,2.1e7\n")
    (tmp_path / "almanac.txt").write_text(YUMA.format(week=week % 1024))
    log = read_log(tmp_path)
    assert log.notes == ()
    assert np.isfinite(log.pseudoranges[PLACE]).all(axis=None)
    (tmp_path / "almanac.txt").write_text(YUMA.format(week=week % 1024)[:300])
    with pytest.raises(InputError, match="cut off"):
        read_log(tmp_path)


def test_kinds_are_left_out_one_by_one():
    fix = pd.DataFrame({"time_s": [0.0], "east_m": [5e5], "north_m": [4e6]})
    log = make_log(CRS, gnss=fix, pseudoranges=ranges(), tdoa=DIFFERENCES,
                   radio=pd.DataFrame({"time_s": [0.0], "role": ["serving"]}))  # fmt: skip
    tables = ("gnss", "pseudoranges", "tdoa", "radio")
    counts = {
        kind: [len(getattr(leave_out(log, [kind]), table)) for table in tables]
        for kind in ("gnss", "fixes", "pseudoranges", "tdoa", "radio", "ta")
    }  # fmt: skip
    assert counts == {
        "gnss": [0, 0, 2, 1], "fixes": [0, 3, 2, 1], "pseudoranges": [1, 0, 2, 1],
        "tdoa": [1, 3, 0, 1], "radio": [1, 3, 2, 0], "ta": [1, 3, 2, 1],
    }  # fmt: skip
    assert leave_out(log, ["gnss"]).notes[-2:] == (
        "gnss: 1 left out",
        "pseudoranges: 3 left out",
    )
    assert leave_out(make_log(CRS, gnss=fix), ["tdoa", "ta", "radio"]).notes == ()


def test_the_middle_of_a_journey_across_180_degrees_is_there(tmp_path):
    """Clocks of constellations, and delays in the atmosphere, are judged from it."""
    for name, text in (("ranges.obs", rinex_obs()), ("day.nav", rinex3_nav())):
        (tmp_path / name).write_text(text)
    table = pd.DataFrame({"time": START_UTC_S + np.arange(20.0), "lat": -17.5})
    found = []
    for lon in (179.99999, np.where(np.arange(20) < 10, 179.99999, -179.99999)):
        table.assign(lon=lon).to_csv(tmp_path / "places.csv", index=False)
        found.append(open_log(tmp_path).log.pseudoranges["pseudorange_m"])
    np.testing.assert_allclose(*found, rtol=0, atol=1.0)
