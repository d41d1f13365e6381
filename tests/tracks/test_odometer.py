"""Counters of the way as a source of lengths: units, wraps, resets, and coarse counts."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording

START_S = 1_778_666_400.0
TIME_S = np.arange(0.0, 600.0)
PHASE = TIME_S % 60
SPEED_MPS = np.interp(PHASE, [0, 8, 40, 48, 60], [0, 13, 11, 0, 0])
RATE_RADPS = np.where((PHASE > 14) & (PHASE < 20), 0.2, -0.01) * (SPEED_MPS > 0) + 0.003
WAY_M = np.append(0.0, np.cumsum((SPEED_MPS[1:] + SPEED_MPS[:-1]) / 2))


@pytest.fixture
def read(tmp_path):
    def of(columns, **own):
        path = tmp_path / "drive.csv"
        given = {"time": START_S + TIME_S, "yaw_rate_radps": RATE_RADPS}
        pd.DataFrame(given | columns).to_csv(path, index=False)
        return mf.read_log(path, columns=own)

    return of


def along_m(log):
    """Return the way by the log at its times, and the true one."""
    return np.cumsum(log.motion["step_m"].to_numpy()), np.interp(
        log.motion["time_s"], TIME_S, WAY_M
    )


@pytest.mark.parametrize(
    ("name", "of_a_metre"),
    [
        ("odometer_m", 1.0),
        ("odometer_km", 0.001),
        ("Odometer [km]", 0.001),
        ("Odometer (mi)", 1 / 1609.344),
        ("Odometer reading [m]", 1.0),
        ("Mileage (km)", 0.001),
    ],
)
def test_lengths_are_those_by_which_it_grows(name, of_a_metre, read):
    log = read({name: (123_456_789.0 + WAY_M) * of_a_metre})
    own, true = along_m(log)
    assert np.abs(own - true).max() < 3
    assert own[-1] == pytest.approx(WAY_M[-1], abs=1)
    assert log.vehicle
    assert any(note.startswith("yaw rate: bias +0.1") for note in log.notes)
    assert any("an odometer, speeds are those by which it grows" in note for note in log.notes)


def test_a_column_may_be_named(read):
    log = read({"weg": WAY_M / 1000}, odometer_km="weg")
    assert along_m(log)[0][-1] == pytest.approx(WAY_M[-1], abs=1)


@pytest.mark.parametrize("end_m", [655.36, 1000.0, 100.0])
def test_a_counter_that_wraps_goes_on(end_m, read):
    counted = np.round((WAY_M + 50.0) % end_m, 2)
    log = read({"odometer_m": counted})
    own, true = along_m(log)
    assert int(np.sum(np.diff(counted) < 0)) > 3
    if end_m > 500:
        assert np.abs(own - true).max() < 3
        assert any("it wraps around" in note for note in log.notes)
    else:
        # Too short to be told from one that begins anew: those intervals are means.
        assert any("it begins anew or jumps" in note for note in log.notes)
        assert np.abs(own - true).max() < 60


def test_a_counter_that_begins_anew_or_jumps_loses_little(read):
    counted = 5000.0 + WAY_M
    counted[205:] -= counted[205]
    counted[330] = 0.0
    counted[450] = 4e9
    log = read({"odometer_m": counted})
    own, true = along_m(log)
    assert np.abs(own - true).max() < 15
    assert log.motion["step_m"].between(-1, 27).all()
    assert any("it begins anew or jumps 5 times" in note for note in log.notes)


@pytest.mark.parametrize("backing", [True, False])
def test_a_counter_that_falls_slowly_backs_up(backing, read):
    speed = np.where((TIME_S > 200) & (TIME_S < 210), -2.0 if backing else 0.0, SPEED_MPS)
    counted = 900.0 + np.append(0.0, np.cumsum((speed[1:] + speed[:-1]) / 2))
    log = read({"odometer_m": counted})
    went = log.motion["step_m"].to_numpy()[203:209].sum()
    assert went == pytest.approx(-12.0 if backing else 0.0, abs=0.1)
    assert not any("begins anew" in note for note in log.notes)


@pytest.mark.parametrize("least_m", [0.1, 1.0, 10.0, 100.0])
def test_coarse_counts_are_spread_over_the_way(least_m, read):
    log = read({"odometer_m": 20_000 + np.floor(WAY_M / least_m) * least_m})
    own, true = along_m(log)
    known = np.isfinite(own)
    assert np.ptp((own - true)[known]) < 3 + 2.5 * least_m
    assert log.motion["step_m"].max() < 20
    assert (log.imu.sigma_trans_m > 1) == (least_m >= 10)
    stands = any(note.startswith("yaw rate: bias") for note in log.notes)
    # A vehicle that waits between two counts of 100 m may creep as well.
    assert stands == (least_m < 2)


def test_speeds_of_the_wheels_go_first(read):
    log = read({"wheel_speed_mps": SPEED_MPS, "odometer_m": 2 * WAY_M})
    assert along_m(log)[0][-1] == pytest.approx(WAY_M[-1], abs=1)
    assert any("odometer_m: not used beside the speeds of the wheels" in n for n in log.notes)


def test_an_odometer_is_used_beside_positions(tmp_path):
    places = {"lat_deg": 60.0 + WAY_M / 111_000, "lon_deg": 24.0}
    columns = {"time": START_S + TIME_S, **places, "odometer_m": WAY_M, "yaw_rate_radps": 0.001}
    path = tmp_path / "drive.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    log = mf.read_log(path)
    assert len(log.gnss) > 100
    assert log.motion["step_m"].sum() == pytest.approx(WAY_M[-1], abs=1)


@pytest.mark.parametrize("column", ["odometer", "mileage", "distance_m", "Trip distance (km)"])
def test_a_counter_without_a_unit_or_of_unknown_meaning_is_named(column, tmp_path):
    """An error said that there are no rows of a journey, and not which column is one."""
    path = tmp_path / "drive.csv"
    columns = {"time": START_S + TIME_S, "yaw_rate_radps": RATE_RADPS, column: WAY_M}
    pd.DataFrame(columns).to_csv(path, index=False)
    (text,) = [n for n in read_recording(path, options=ReadOptions()).notes if "not used" in n]
    assert "odometer_m" in text
    with pytest.raises(InputError, match="yaw rates without speeds or an odometer") as error:
        mf.read_log(path)
    assert f"one of the columns not used ({column.lower()} (" in error.value.faults[0].hint
