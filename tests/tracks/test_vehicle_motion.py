"""The motion of a vehicle: whose directions it has, which gaps are refused, and by which clock."""

from math import nan, pi
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.joining import drive
from mapfilter.tracks.joining.drive import drive_of, own_turning
from mapfilter.tracks.pdr.turns import turning_of
from mapfilter.tracks.readers.recorded.recording import Clock, Recording

UTC = Clock("utc")
START_S = 1_777_630_000.0
"""2026-05-01 10:06:40 UTC."""


def recording(name="bus.csv", clock=UTC, **tables):
    return Recording(Path("in") / name, "table", "", clock, tables, 1)


def odometry(time_s, *, yaw=nan, heading=nan, compass=nan, speed=8.0):
    rows = pd.DataFrame({"time_s": np.asarray(time_s, float), "speed_mps": speed})
    more = {"yaw_rate_radps": yaw, "speed_sd_mps": nan}
    return rows.assign(**more, heading_rad=heading, compass_deg=compass)


def drive_by(rows, *, turns=(), own=None, sensors=None, clock=UTC, beside=(), **tables):
    tables |= {} if own is None else {"turns": own}
    wheels = recording(clock=clock, odometry=rows, **tables)
    return drive_of(wheels, turns, sensors or {}, 0.0, [wheels, *turns, *beside])


NO_BIAS = "yaw rate: the vehicle never stands, so that the bias could not be learnt"
TIMES_S = START_S + np.arange(30.0)


def test_headings_are_those_of_the_speeds_before_any_turns():
    other = recording("gyro.csv", odometry=odometry(TIMES_S, yaw=0.2))
    found, notes = drive_by(odometry(TIMES_S, yaw=0.1, heading=0.5), turns=[other])
    assert found.rows["heading_rad"].tolist() == pytest.approx([0.5] * 30)
    assert (found.compass, found.imu.turns) == (False, "headings")
    assert notes == ("gyro.csv: yaw rates not used, the speeds have headings",)


@pytest.mark.parametrize("own", [nan, 0.5])
def test_azimuths_of_a_compass_are_headings(own):
    heading = np.full(30, nan)
    heading[3] = own
    found, notes = drive_by(odometry(TIMES_S, heading=heading, compass=90.0 + np.arange(30)))
    assert found.compass == np.isnan(own)
    # The mean of two azimuths a degree apart.
    assert found.rows["heading_rad"].iloc[10] == pytest.approx(-np.radians(9.5))
    assert notes == ()


def test_azimuths_in_another_unit_are_noted():
    """Radians by their name degrees, each of another row than where a time comes twice."""
    azimuth = pi + 2.9 * np.sin(np.arange(400) / 9)
    rows = odometry(START_S + np.arange(400.0), compass=azimuth)
    twice = pd.concat([rows.iloc[:5], rows.iloc[4:]], ignore_index=True)
    (note,) = drive_by(twice)[1]
    assert "radians" in note
    # Where it stands they say nothing.
    assert drive_by(twice.assign(speed_mps=0.0))[1] == ()


def test_yaw_rates_are_turns():
    found, notes = drive_by(odometry(TIMES_S, yaw=0.1))
    assert found.rows["turn_rad"].iloc[1:].tolist() == pytest.approx([0.1] * 29)
    assert (found.compass, notes) == (False, (NO_BIAS,))
    other = recording("gyro.csv", odometry=odometry(TIMES_S, yaw=0.2))
    found, notes = drive_by(odometry(TIMES_S), turns=[other])
    assert found.rows["turn_rad"].iloc[1:].tolist() == pytest.approx([0.2] * 29)
    assert notes == ("odometry: yaw rates are those of gyro.csv", NO_BIAS)


TURNS = pd.DataFrame({"time_s": TIMES_S, "turn_rad": 0.05, "yaw_rate_radps": nan})


def test_turns_from_row_to_row_come_before_those_of_a_phone():
    found, notes = drive_by(odometry(TIMES_S), own=TURNS)
    assert found.rows["turn_rad"].iloc[1:].tolist() == pytest.approx([0.05] * 29)
    assert notes[0] == "bus.csv: turns are those from row to row"
    # Yaw rates, where there are any, come before them.
    found, notes = drive_by(odometry(TIMES_S, yaw=0.1), own=TURNS)
    assert found.rows["turn_rad"].iloc[1:].tolist() == pytest.approx([0.1] * 29)
    assert notes == (NO_BIAS,)
    some = np.full(30, 0.1)
    some[3] = nan
    _, notes = drive_by(odometry(TIMES_S, yaw=some), own=TURNS)
    assert not any("turns are those" in note for note in notes)
    assert own_turning(recording(odometry=odometry(TIMES_S))) is None


def test_without_any_turns_steps_alone_are_known():
    found, notes = drive_by(odometry(TIMES_S))
    assert found.rows["turn_rad"].iloc[1:].isna().all()
    assert found.rows["heading_rad"].isna().all()
    assert found.compass is False
    assert not any("turns are those" in note for note in notes)


@pytest.mark.parametrize(
    ("seconds", "clock", "got"),
    [
        ((3600.0,), UTC, None),
        ((3601.0,), UTC, "1.0 h from 2026-05-01 10:06:41 (row 2) to 2026-05-01 11:06:42 (row 3)"),
        ((7200.0, 9000.0), UTC,
         "2.0 h from 2026-05-01 10:06:41 (row 2) to 2026-05-01 12:06:41 (row 3); 2 such gaps"),
        ((7200.0,), Clock("monotonic"), "2.0 h from 101 s (row 2) to 7301 s (row 3)"),
    ],
)  # fmt: skip
def test_an_hour_between_rows_is_the_most(seconds, clock, got):
    begin_s = 100.0 if clock.kind == "monotonic" else START_S
    time_s = [begin_s, begin_s + 1]
    for one in seconds:
        time_s += [time_s[-1] + one, time_s[-1] + one + 1]
    rows = odometry(time_s, yaw=0.0, speed=0.0)
    if got is None:
        assert len(drive_by(rows, clock=clock)[0].rows) == 4
        return
    with pytest.raises(InputError) as refused:
        drive_by(rows, clock=clock)
    (fault,) = refused.value.faults
    assert (fault.where, fault.expected) == ("in/bus.csv, odometry", "rows at most 1 h apart")
    assert fault.got == got
    assert fault.hint == "a recording of several journeys: split it there, convert each alone"


@pytest.mark.parametrize(
    ("clock", "gap_s", "summer"),
    [(Clock("local"), 3601.0, True), (Clock("local"), 3959.0, True),
     (Clock("local"), 3960.0, False),
     (Clock("local", "Europe/Berlin"), 3601.0, False), (UTC, 3601.0, False)],
)  # fmt: skip
def test_a_clock_that_was_set_forward_is_likely_where_its_zone_is_unknown(clock, gap_s, summer):
    rows = odometry([START_S, START_S + gap_s], yaw=0.0)
    with pytest.raises(InputError) as refused:
        drive_by(rows, clock=clock)
    (fault,) = refused.value.faults
    assert fault.hint.startswith("a clock that was set forward for summer: --zone; or") is summer


def of_phone(monkeypatch, shift_s, *, rows=None, names=("phone.csv",), own=False, force=True):
    """Return the times of a phone's turns on the clock of the speeds, and notes."""
    asked = []
    turning = turning_of({"turns": TURNS})[0]

    def shifted(speeds, forces):
        asked.append((speeds, forces))
        return shift_s, 0.914, 0.236

    monkeypatch.setattr(drive, "turning_of_mounted", lambda _: (turning, ("of a gyroscope",)))
    monkeypatch.setattr(drive, "clock_shift_s", shifted)
    monkeypatch.setattr(drive, "check_turning", lambda *given: asked.append(given[2]))
    seen = []

    def reckoned(_, turns):
        seen.append(turns)
        return SimpleNamespace(), None, ("reckoned",)

    monkeypatch.setattr(drive, "reckon_odometry", reckoned)
    axes = {f"{axis}_mps2": [0.0, 9.8] for axis in "xyz"}
    sensors = {"accelerometer": pd.DataFrame({"time_s": [0.0, 1.0], **axes})} if force else {}
    phones = [recording(name, gyroscope=None) for name in names]
    rows = odometry(TIMES_S) if rows is None else rows
    tables = {"gyroscope": None} if own else {}
    _, notes = drive_by(rows, sensors=sensors, beside=phones, **tables)
    return turning, seen[0], notes, asked


def test_a_phones_turns_are_brought_to_the_clock_of_the_speeds(monkeypatch):
    before, after, notes, asked = of_phone(monkeypatch, -2.5, names=("a.csv", "b.csv"))
    assert (after.time_s - before.time_s).tolist() == pytest.approx([-2.5] * len(before.time_s))
    assert notes == (
        "of a gyroscope",
        "a.csv, b.csv: accelerations agree with the speeds of bus.csv best -2.5 s shifted "
        "(explained: 0.91, not 0.24); its turns are shifted, --offset shifts all of it",
        "reckoned",
    )
    ((speeds, _), where) = asked
    assert speeds[0].tolist() == TIMES_S.tolist()
    assert speeds[1].tolist() == [8.0] * 30
    assert where == "bus.csv, a.csv, b.csv"


@pytest.mark.parametrize(
    "given",
    [{"names": ()}, {"names": (), "own": True}, {"force": False},
     {"rows": odometry(TIMES_S[:2])},
     {"rows": odometry(TIMES_S, speed=np.where(np.arange(30) < 2, 8.0, nan))}],
)  # fmt: skip
def test_clocks_are_compared_where_both_show_accelerations(monkeypatch, given):
    before, after, notes, asked = of_phone(monkeypatch, -2.5, **given)
    assert after is before
    assert len(asked) == 1
    assert notes == ("of a gyroscope", "reckoned")


def test_three_speeds_are_enough_and_no_shift_is_none(monkeypatch):
    _, _, notes, asked = of_phone(monkeypatch, 0.0, rows=odometry(TIMES_S[:3]))
    assert len(asked) == 2
    assert notes == ("of a gyroscope", "reckoned")
