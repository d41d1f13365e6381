"""Logs from tables in memory: timestamps, and what is not a table of a log."""

from dataclasses import fields
from typing import get_args

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.schema import TABLES, Kind, Without

CRS = "EPSG:32635"
NOON_UTC_S = 1_767_268_800.0
HOURS = ["2026-01-01 13:00:00.25+01:00", "2026-01-01 12:00:01+00:00"]
TIMES = pd.to_datetime(HOURS, utc=True, format="ISO8601")
STEPS = {"step_m": [1.5, 1.4]}


@pytest.mark.parametrize("name", ["time", "time_s"])
@pytest.mark.parametrize("unit", ["ns", "ms"])
def test_timestamps_become_seconds_since_the_first_of_all(name, unit):
    walk = pd.DataFrame({name: TIMES.as_unit(unit), **STEPS})
    fixes = pd.DataFrame({name: TIMES[1:], "east_m": 1e5, "north_m": 2e5})
    log = make_log(CRS, motion=walk, gnss=fixes)
    assert log.start_utc_s == NOON_UTC_S + 0.25
    assert log.motion["time_s"].tolist() == [0.0, 0.75]
    assert log.gnss["time_s"].tolist() == [0.75]
    assert not log.notes


def test_timestamps_beside_a_start_count_from_it():
    walk = pd.DataFrame({"time": TIMES, **STEPS})
    fixes = pd.DataFrame({"time_s": [0.5], "east_m": 1e5, "north_m": 2e5})
    log = make_log(CRS, motion=walk, gnss=fixes, start_utc_s=NOON_UTC_S)
    assert log.motion["time_s"].tolist() == [0.25, 1.0]
    assert log.start_utc_s == NOON_UTC_S


@pytest.mark.parametrize("zone", ["UTC", "Europe/Helsinki"])
def test_timestamps_of_arrow(zone):
    """They were refused, as if they had no zone."""
    times = TIMES.tz_convert(zone).to_series().reset_index(drop=True)
    walk = pd.DataFrame({"time": times, **STEPS}).convert_dtypes(dtype_backend="pyarrow")
    assert isinstance(walk["time"].dtype, pd.ArrowDtype)
    log = make_log(CRS, motion=walk)
    assert (log.start_utc_s, log.motion["time_s"].tolist()) == (NOON_UTC_S + 0.25, [0.0, 0.75])
    none = walk.assign(time=TIMES.tz_localize(None).astype("timestamp[ns][pyarrow]"))
    with pytest.raises(InputError, match="expected timestamps with a time zone, found none"):
        make_log(CRS, motion=none)


@pytest.mark.parametrize("as_kept", [list, lambda times: [one.to_pydatetime() for one in times]])
def test_timestamps_of_several_offsets(as_kept):
    """Summer time ends between them; pandas keeps such columns as objects."""
    texts = ("2026-10-25T03:59:59.25+03:00", "2026-10-25T03:00:00+02:00")
    walk = pd.DataFrame({"time": as_kept([pd.Timestamp(one) for one in texts]), **STEPS})
    assert walk["time"].dtype == object
    log = make_log(CRS, motion=walk)
    assert log.motion["time_s"].tolist() == [0.0, 0.75]
    assert log.start_utc_s == pd.Timestamp(texts[0]).timestamp()
    one_lacks = walk.assign(time=[walk["time"][0], walk["time"][1].replace(tzinfo=None)])
    with pytest.raises(InputError, match=r"^motion"):
        make_log(CRS, motion=one_lacks)


def test_a_missing_timestamp_among_several_offsets_is_named():
    texts = ("2026-10-25T03:59:59.25+03:00", "2026-10-25T03:00:00+02:00")
    walk = pd.DataFrame({"time": [pd.Timestamp(texts[0]), pd.NaT], "step_m": [1.0, 1.0]})
    more = pd.DataFrame({"time": [pd.Timestamp(texts[1])], "step_m": [1.0]})
    several = pd.concat([walk, more], ignore_index=True).astype({"time": object})
    with pytest.raises(InputError, match=r"^motion row 2, time_s: expected seconds, found nan$"):
        make_log(CRS, motion=several)


def test_ids_of_bytes_are_texts_and_complex_numbers_are_none():
    radio = pd.DataFrame(
        {"time_s": [0.0, 1.0], "role": "serving", "cell": [b"S1A", np.bytes_("B")]}
    )
    assert make_log(CRS, radio=radio).radio["cell"].tolist() == ["S1A", "B"]
    walk = pd.DataFrame({"time_s": [0.0, 1.0], "step_m": [1.0 + 0j, 1.0 + 0j]})
    with pytest.raises(InputError, match=r"motion row 1, step_m: expected metres, found \(1\+0j\)"):
        make_log(CRS, motion=walk)


@pytest.mark.parametrize("name", ["time", "time_s", "logged", "step_m", None])
def test_timestamps_and_seconds_in_the_index(name):
    walk = pd.DataFrame(STEPS, index=TIMES.rename(name))
    log = make_log(CRS, motion=walk)
    assert (log.start_utc_s, log.motion["time_s"].tolist()) == (NOON_UTC_S + 0.25, [0.0, 0.75])
    seconds = pd.DataFrame(STEPS, index=pd.Index([1.0, 2.5], name="time_s"))
    assert make_log(CRS, motion=seconds).motion["time_s"].tolist() == [1.0, 2.5]


@pytest.mark.parametrize(
    ("times", "told"),
    [
        (HOURS, r"found texts such as '2.*pd\.to_datetime"),
        (["28.05.2026 12:00", "28.05.2026 12:01"], r"found texts such as '28\.05"),
        (pd.to_timedelta([1, 2], "s"), r"found durations .*total_seconds"),
    ],
)
def test_times_of_another_type_are_named(times, told):
    with pytest.raises(InputError, match="motion, time: .*" + told):
        make_log(CRS, motion=pd.DataFrame({"time": times, **STEPS}))
    seconds = pd.DataFrame({"time_s": ["1.5", "2.25"], **STEPS})
    assert make_log(CRS, motion=seconds).motion["time_s"].tolist() == [1.5, 2.25]


@pytest.mark.parametrize("kind", [float, object])
def test_whole_numbers_of_cells_beside_missing_ones_are_no_fractions(kind):
    """A merge of pandas makes floats of them: cell 10303.0 is in no plan."""
    cells = pd.Series([10303.0, np.nan, 7.5], dtype=kind)
    radio = pd.DataFrame({"time_s": [0.0, 1.0, 2.0], "role": "serving", "cell": cells})
    assert make_log(CRS, radio=radio.assign(level_dbm=-80)).radio["cell"].tolist() == [
        "10303",
        None,
        "7.5",
    ]


def test_timestamps_of_any_zone_and_as_objects():
    walk = pd.DataFrame({"time": [pd.Timestamp(hour).tz_convert("Asia/Tokyo") for hour in HOURS]})
    log = make_log(CRS, motion=walk.astype(object).assign(**STEPS))
    assert log.motion["time_s"].tolist() == [0.0, 0.75]


def test_a_missing_timestamp_is_told_by_its_row():
    walk = pd.DataFrame({"time": [TIMES[0], pd.NaT], **STEPS})
    with pytest.raises(InputError, match="motion row 2, time_s: expected seconds, found nan"):
        make_log(CRS, motion=walk)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"motion": {"time": TIMES.tz_localize(None), **STEPS}}, r"motion, time: .*time zone"),
        (
            {
                "motion": {"time": TIMES, **STEPS},
                "gnss": {"time_s": [1.0], "east_m": 1e5, "north_m": 2e5},
            },
            "log, time_s: expected timestamps in every table, or a start, found seconds in gnss",
        ),
        ({"motion": {"time_s": ["noon", "later"], **STEPS}}, "motion row 1, time_s: .* noon"),
        ({"motion": {"time_s": [0.0, 1.0], "step_m": TIMES}}, "motion row 1, step_m: .*metres"),
        ({"motion": {"time_s": [[0, 1], []], **STEPS}}, "motion row 1, time_s: expected seconds"),
    ],
)
def test_other_times_are_refused(tables, message):
    with pytest.raises(InputError, match=message):
        make_log(CRS, **{table: pd.DataFrame(rows) for table, rows in tables.items()})


def test_what_is_no_table_is_refused():
    walk = pd.DataFrame({"time_s": [0.0, 1.0], **STEPS})
    with pytest.raises(InputError, match=r"log, crs: .* make_log\(crs, motion=…\)"):
        make_log(walk)
    with pytest.raises(InputError, match=r"motion: expected a pandas.DataFrame, found dict"):
        make_log(CRS, motion=dict(walk))
    twice = pd.DataFrame(np.zeros((2, 2)), columns=["time_s", "time_s"])
    with pytest.raises(InputError, match="motion: expected each column once, found time_s"):
        make_log(CRS, motion=twice)


def test_a_log_shows_itself_in_a_line():
    log = make_log(CRS, motion=pd.DataFrame({"time_s": [2.0, 1.0], **STEPS}))
    assert repr(log) == "TrackLog(EPSG:32635, 1.0 s; rows: motion 2; 1 note)"
    assert repr(make_log(CRS)) == "TrackLog(EPSG:32635, 0.0 s; rows: none)"


def test_every_kind_and_part_of_a_log_belongs_to_one_table():
    kinds = [kind for table in TABLES.values() for kind in table.kinds]
    assert sorted(kinds) == sorted(get_args(Kind))
    assert set(TABLES) == {field.name for field in fields(TrackLog)} - {
        "crs",
        "start_utc_s",
        "notes",
        "imu",
        "vehicle",
    }


def test_every_table_of_measurements_but_motion_can_be_left_out():
    measured = {name for name, table in TABLES.items() if table.kinds}
    assert measured - {"motion"} <= set(get_args(Without))
    assert set(get_args(Without)) - measured == {"fixes", "ta", "neighbours"}
