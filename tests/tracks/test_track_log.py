"""The door of track logs: what is mended, what is told, what is refused."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.geodesy import projected_crs
from mapfilter.radio.level_quantity import TENTHS
from mapfilter.tracks.checks.placeless import is_local_frame
from mapfilter.tracks.log import make_log

CRS = "EPSG:32629"


def motion(**columns):
    return pd.DataFrame({"time_s": [1.0, 2.0, 3.0], "step_m": [1.4, 1.5, 1.3]} | columns)


def truth(**columns):
    table = {
        "time_s": [0.0, 30.0, 60.0],
        "east_m": [531000.0, 531040.0, 531080.0],
        "north_m": [4555000.0, 4555001.0, 4555000.0],
    }
    return pd.DataFrame(table | columns)


def faults_of(**tables):
    with pytest.raises(InputError) as caught:
        make_log(tables.pop("crs", CRS), **tables)
    return str(caught.value)


def test_absent_tables_are_empty_and_absent_fields_missing():
    log = make_log(CRS, motion=motion())
    assert log.motion["heading_rad"].isna().all()
    assert list(log.radio.columns) == [
        "time_s",
        "role",
        "cell",
        "arfcn",
        "bsic",
        "level_dbm",
        "censored",
        "timing_advance",
    ]
    assert len(log.radio) == len(log.gnss) == len(log.truth) == 0
    assert log.notes == ()
    assert log.duration_s == 2.0
    assert log.truth_length_m == 0.0


def test_equal_logs_have_one_hash():
    motion = pd.DataFrame({"time_s": [0.0, 1.0], "step_m": [1.0, np.nan]})
    logs = [make_log(CRS, motion=motion) for _ in range(2)]
    assert logs[0] == logs[1]
    assert len({*logs, make_log(CRS, motion=motion.iloc[:1])}) == 2


def test_absent_tables_of_two_logs_are_not_one():
    first, second = make_log(CRS, motion=motion()), make_log(CRS, motion=motion())
    first.truth.loc[0, "east_m"] = 1.0
    assert second.truth.empty
    assert make_log(CRS, motion=motion()).truth.empty
    assert list(second.truth.columns) == list(first.truth.columns)
    given = make_log(CRS, motion=motion(), truth=second.truth).truth
    pd.testing.assert_frame_equal(given, second.truth)


def test_duration_and_truth_length_by_hand():
    track = truth(east_m=[0.0, 30.0, 30.0], north_m=[1000.0, 1040.0, 1050.0])
    log = make_log(CRS, truth=track, motion=motion())
    assert log.duration_s == 60.0
    assert log.truth_length_m == 60.0


def test_a_row_with_a_missing_field_is_kept():
    radio = pd.DataFrame(
        {"time_s": [1.0, 1.0], "role": ["serving", "neighbour"], "level_dbm": [np.nan, -80.5]}
    )
    log = make_log(CRS, radio=radio, motion=motion(step_m=[1.0, np.nan, 1.0]))
    assert len(log.radio) == 2
    assert log.radio["cell"].tolist() == [None, None]
    assert log.radio["censored"].tolist() == [0, 0]
    assert log.radio["arfcn"].isna().all()
    assert len(log.motion) == 3


def test_unsorted_rows_are_sorted_and_duplicates_counted():
    table = pd.DataFrame({"time_s": [2.0, 1.0, 2.0, 2.0], "step_m": [5.0, 4.0, 5.0, 6.0]})
    log = make_log(CRS, motion=table, notes=["read from a file"])
    assert log.motion["time_s"].tolist() == [1.0, 2.0, 2.0]
    # Rows of equal time keep their order.
    assert log.motion["step_m"].tolist() == [4.0, 5.0, 6.0]
    assert log.motion.index.tolist() == [0, 1, 2]
    assert log.notes == (
        "read from a file",
        "motion: 1 exact duplicate row dropped",
        "motion: out of order in 1 place, sorted by time",
    )


def test_the_callers_table_is_not_changed():
    table = motion(heading_rad=[4.0, 0.0, 1.0])
    before = table.copy(deep=True)
    log = make_log(CRS, motion=table)
    pd.testing.assert_frame_equal(table, before)
    assert log.motion["heading_rad"][0] == pytest.approx(4.0 - 2 * np.pi)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("column", ["time_s", "east_m", "north_m"])
def test_times_and_coordinates_must_be_finite(column, bad):
    table = truth()
    table.loc[1, column] = bad
    assert f"truth row 2, {column}" in faults_of(truth=table)


def test_all_faults_of_all_tables_are_told_together():
    message = faults_of(
        crs="EPSG:4326",
        motion=motion(heading_rad=[90.0, 180.0, 45.0], step_m=["1.4", "fast", "1"]),
        radio=pd.DataFrame({"time_s": [0.0], "role": ["server"], "level_dbm": [35.0]}),
        gnss=pd.DataFrame({"time_s": [0.0], "north_m": [1.0]}),
        truth=truth(north_m=[np.nan, 0.0, 0.0]),
        start_utc_s=1.7e12,
    )
    for part in (
        "degrees given for metres",
        "motion row 1, heading_rad: expected radians in -2π..2π, found 90.0 "
        "(likely: degrees given for radians)",
        "motion row 2, step_m: expected metres, found fast",
        "radio row 1, role: expected serving or neighbour, found server",
        "radio row 1, level_dbm: expected dBm in -200..0, found 35.0 "
        "(likely: raw RXLEV given for dBm)",
        "gnss: expected a column east_m, found none",
        "truth row 1, north_m: expected metres north, found nan",
        "log, start_utc_s: expected UTC seconds, found 1700000000000.0 "
        "(likely: milliseconds for s)",
    ):
        assert part in message


def test_levels_in_tenths_are_told():
    levels = {"time_s": [0.0, 1.0], "role": "serving", "cell": "A", "level_dbm": [-780.0, -1012.0]}
    assert f"found -780.0 (likely: {TENTHS})" in faults_of(radio=pd.DataFrame(levels))


def long_motion(heading_rad):
    time_s = np.arange(float(len(heading_rad)))
    return pd.DataFrame({"time_s": time_s, "step_m": 1.4, "heading_rad": heading_rad})


@given(
    first=st.floats(-6.2, 6.2),
    changes=st.lists(st.floats(-0.5, 3.0), min_size=3, max_size=20),
)
def test_unwrapped_headings_are_read(first, changes):
    heading = first + np.cumsum([0.0, *changes])
    # Whole numbers are degrees.
    assume((heading % 1 != 0).any())
    log = make_log("EPSG:32635", motion=long_motion(heading))
    off = np.exp(1j * (log.motion["heading_rad"].to_numpy() - heading))
    np.testing.assert_allclose(off, 1.0, atol=1e-9)
    beyond = bool((np.abs(heading) > 2 * np.pi + 1e-9).any())
    assert any("beyond a turn, wrapped (unwrapped)" in note for note in log.notes) == beyond


def test_headings_that_may_be_unwrapped_or_degrees_are_refused_as_either():
    heading = 10.28 + 0.9 * np.sin(np.arange(40) / 5)
    assert "unwrapped headings that begin beyond a turn, or degrees given" in faults_of(
        motion=long_motion(heading)
    )
    # Those that jump are degrees.
    message = faults_of(motion=long_motion((350.3 + 7.1 * np.arange(40)) % 360))
    assert "(likely: degrees given for radians)" in message
    assert "unwrapped" not in message


def test_many_bad_rows_are_counted():
    message = faults_of(truth=truth(east_m=[np.nan] * 3).loc[[0, 1, 2, 0, 1]])
    assert message.count("truth row") == 3
    assert "2 more rows like these" in message


def test_degrees_for_metres():
    table = truth(east_m=[-8.6235, -8.6231, -8.6227], north_m=[41.1325, 41.1325, 41.1326])
    assert "likely: degrees given for metres" in faults_of(truth=table)
    assert "likely: degrees given for metres" in faults_of(gnss=table)


@pytest.mark.parametrize(
    ("extent", "lasted_s", "east", "is_fault"),
    [
        *((0.0, 60.0, 3.0, False), (1e-9, 60.0, 3.0, True)),
        *((0.499, 60.0, 3.0, True), (0.5, 60.0, 3.0, False)),
        *((0.01, 10.0, 3.0, True), (0.01, 9.9, 3.0, False)),
        *((0.01, 60.0, 179.99, True), (0.01, 60.0, 180.0, False)),
        *((0.01, 60.0, -180.0, True), (0.01, 60.0, -180.01, False)),
    ],
)
@pytest.mark.parametrize("turned", [False, True])
def test_degrees_lie_within_half_of_one_for_10_s_and_move(extent, lasted_s, east, is_fault, turned):
    names = ("north_m", "east_m") if turned else ("east_m", "north_m")
    columns = {names[0]: [east, east + extent], names[1]: [4.0, 4.0]}
    table = pd.DataFrame({"time_s": [0.0, lasted_s], **columns})
    if is_fault:
        assert "likely: degrees given for metres" in faults_of(truth=table)
    else:
        assert len(make_log(CRS, truth=table).truth) == 2


def test_a_small_local_frame_is_not_taken_for_degrees():
    table = truth(east_m=[0.0, 40.0, 80.0], north_m=[0.0, 1.0, 0.0])
    assert make_log(CRS, truth=table).truth_length_m > 80


@pytest.mark.parametrize("start", [0.0, 1.7e12])
def test_milliseconds_for_seconds(start):
    time = start + np.arange(25) * 1000.0
    steps = pd.DataFrame({"time_s": time, "step_m": 1.4})
    path = pd.DataFrame(
        {"time_s": time, "east_m": 531000 + 1.4 * np.arange(25), "north_m": 4555000.0}
    )
    assert "likely: milliseconds for s" in faults_of(motion=steps)
    assert "likely: milliseconds for s" in faults_of(truth=path)
    assert "convert them; a recording (CSV) may have a column time_ms" in faults_of(truth=path)
    micro = pd.DataFrame({"time_s": 1e6 * np.arange(60.0), "east_m": 3.0 * np.arange(60)})
    told = faults_of(truth=micro.assign(north_m=0.0))
    assert "microseconds for s; convert them; a recording (CSV) may have a column time_us" in told


def test_rare_fixes_of_a_moving_car_are_not_taken_for_milliseconds():
    path = pd.DataFrame(
        {"time_s": [0.0, 60.0, 120.0], "east_m": [0.0, 700.0, 1400.0], "north_m": 0.0}
    )
    assert len(make_log(CRS, gnss=path).gnss) == 3


def test_a_parked_car_is_not_taken_for_milliseconds():
    rng = np.random.default_rng(0)
    east, north = 531000 + rng.normal(0, 2, (2, 500))
    path = pd.DataFrame({"time_s": 30.0 * np.arange(500), "east_m": east, "north_m": north})
    assert len(make_log(CRS, gnss=path).gnss) == 500


def test_a_misspelt_column_is_a_fault_and_a_strange_one_a_note():
    table = motion().rename(columns={"step_m": "step"})
    assert "motion, column step" in faults_of(motion=table)
    assert "likely: heading_rad" in faults_of(motion=motion(heading_deg=[1.0, 2.0, 3.0]))
    log = make_log(CRS, motion=motion(battery=[1, 2, 3]))
    assert log.notes == ("motion: column battery is not used",)


def test_covariance_must_be_one():
    table = truth(var_east_m2=[4.0] * 3, var_north_m2=[1.0] * 3, cov_east_north_m2=[2.0, -2.1, 0.0])
    assert "gnss row 2, cov_east_north_m2" in faults_of(gnss=table)
    assert "gnss row 1, var_east_m2" in faults_of(gnss=truth(var_east_m2=[-1.0, 1.0, 1.0]))


@pytest.mark.parametrize("name", ["var_east_m2", "var_north_m2", "cov_east_north_m2"])
def test_variances_are_those_of_places(name):
    variances = {"var_east_m2": [1.0] * 3, "var_north_m2": [1.0] * 3, "cov_east_north_m2": [0] * 3}
    for value in (1.1e16, 1e300):
        table = truth(**(variances | {name: [0.0, value, 0.0]}))
        assert f"gnss row 2, {name}" in faults_of(gnss=table)
    unknown = truth(var_east_m2=[1e16] * 3, var_north_m2=[1e16] * 3, cov_east_north_m2=[1e16] * 3)
    assert len(make_log(CRS, gnss=unknown).gnss) == 3


@pytest.mark.parametrize("value", [1e300, np.inf, -np.inf])
def test_of_places_that_are_refused_no_heading_is_compared(value):
    time_s = np.arange(1.0, 60.0)
    walk = pd.DataFrame({"time_s": time_s, "step_m": 1.4, "heading_rad": 0.02 * time_s})
    places = pd.DataFrame({"time_s": time_s, "east_m": 531000.0 + time_s, "north_m": 4555000.0})
    places.loc[30, "east_m"] = value
    told = faults_of(motion=walk, truth=places)
    assert told.startswith("truth row 31, east_m: expected metres east")
    assert told.count("expected") == 1


@pytest.mark.parametrize(
    ("column", "bad"), [("bsic", 2000), ("arfcn", 12.5), ("censored", 2), ("timing_advance", -1)]
)
def test_radio_fields_have_ranges(column, bad):
    radio = pd.DataFrame({"time_s": [0.0], "role": ["serving"], column: [bad]})
    assert f"radio row 1, {column}" in faults_of(radio=radio)


def test_way_ids_keep_all_their_digits():
    ids = [2**62 + 1, 2**53 + 1, None]
    table = truth(way_id=pd.array(ids, dtype="Int64"))
    assert make_log(CRS, truth=table).truth["way_id"].tolist()[:2] == ids[:2]


@pytest.mark.parametrize("way_id", [2.0**63, -(2.0**63), 1e300])
def test_way_ids_that_no_int64_holds_are_refused(way_id):
    assert "truth row 1, way_id" in faults_of(truth=truth(way_id=[way_id, 1.0, 2.0]))


times = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=20)


@given(times, st.randoms())
def test_order_of_the_rows_does_not_matter(time, random):
    table = pd.DataFrame({"time_s": time, "turn_rad": np.arange(len(time)) / 5})
    table = table.drop_duplicates("time_s")
    shuffled = table.sample(frac=1.0, random_state=random.randrange(2**32))
    once = make_log(CRS, motion=table).motion
    pd.testing.assert_frame_equal(make_log(CRS, motion=shuffled).motion, once)
    pd.testing.assert_frame_equal(make_log(CRS, motion=once).motion, once)
    assert once["time_s"].is_monotonic_increasing


def test_only_an_unplaced_frame_is_local():
    assert is_local_frame(projected_crs("+proj=tmerc +lat_0=0 +lon_0=0 +type=crs"))
    for placed in ("+proj=utm +zone=35 +datum=WGS84", "+proj=tmerc +lat_0=60 +lon_0=25"):
        assert not is_local_frame(placed)
        assert not is_local_frame(projected_crs(f"{placed} +type=crs"))


@pytest.mark.parametrize(("back_s", "rows"), [(20.0, 50), (4.5, 50), (30.0, 97)])
def test_a_clock_that_was_set_back_is_named_and_its_rows_go_on(back_s, rows):
    """Sorted rows would be those of two moments, in turns."""
    time_s = np.arange(100.0)
    time_s[rows:] -= back_s
    steps = {"step_m": np.arange(100) % 7 / 5, "heading_rad": 0.0}
    log = make_log(CRS, motion=pd.DataFrame({"time_s": time_s, **steps}))
    said = f"motion: time goes back by {back_s - 1:g} s after {rows - 1} s, as when a clock"
    assert [note.startswith(said) for note in log.notes] == [True]
    assert log.motion["time_s"].to_list() == list(range(100))
    assert log.motion["step_m"].to_list() == (np.arange(100) % 7 / 5).tolist()


def test_rows_out_of_order_are_no_clock():
    time_s = np.arange(100.0)
    time_s[[40, 41]] = time_s[[41, 40]]
    steps = {"step_m": 1.0, "heading_rad": 0.0}
    swapped = make_log(CRS, motion=pd.DataFrame({"time_s": time_s, **steps}))
    assert swapped.notes == ("motion: out of order in 1 place, sorted by time",)
    shuffled = np.random.default_rng(0).permutation(100).astype(float)
    log = make_log(CRS, motion=pd.DataFrame({"time_s": shuffled, "step_m": 1.0}))
    assert "out of order" in log.notes[0]
    two = np.concatenate([np.arange(50.0, 100.0), np.arange(50.0)])
    log = make_log(CRS, motion=pd.DataFrame({"time_s": two, "step_m": 1.0}))
    assert "out of order" in log.notes[0]
