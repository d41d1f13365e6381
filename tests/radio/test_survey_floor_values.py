"""Floors of receivers and fillers of tables in drive tests: found, and no levels of a map."""

import numpy as np
import pytest

from mapfilter.survey.floor_values import without_floor_values
from mapfilter.survey.measured_map import fit_survey
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SurveyOptions

CRS = "EPSG:32635"
WEST_M, SOUTH_M, SIDE_M = 385_000.0, 6_670_000.0, 1500.0
ANTENNAS_M = np.array([[100.0, 1300.0], [1450.0, 1200.0], [700.0, -150.0]])
OFFSETS_DB = (4.0, -3.0, 1.0)
SENSITIVITY_DBM = -98.0


def predicted_dbm(cell, east_m, north_m):
    distance_m = np.hypot(*(np.column_stack([east_m - WEST_M, north_m - SOUTH_M]) - cell).T)
    return -5.0 - 34.0 * np.log10(distance_m + 30.0)


def drives(seed, count=3, technologies=None):
    """All three cells every 10 m along streets, at their true levels with 6 dB of shadowing."""
    rng = np.random.default_rng(seed)
    tables = []
    for session in range(count):
        for street in range(4):
            along_m = np.arange(0.0, SIDE_M, 10.0)
            across_m = np.full(along_m.size, rng.integers(1, 15) * 100.0)
            place = (along_m, across_m) if street % 2 else (across_m, along_m)
            east_m, north_m = WEST_M + place[0], SOUTH_M + place[1]
            for cell, antenna in enumerate(ANTENNAS_M):
                level = predicted_dbm(antenna, east_m, north_m) + OFFSETS_DB[cell]
                wave_m = place[0] / 90 + place[1] / 70 + cell
                level = level + 6 * np.sin(wave_m) + rng.normal(0, 2, level.size)
                time_s = 1e9 + 1e5 * session + 1e3 * street + along_m / 5
                table = np.column_stack([time_s, east_m, north_m, np.round(level)])
                tables.append(np.insert(table, 0, [[cell], [session]], axis=1))
    rows = np.concatenate(tables)
    ids = ("A", "B", "C")
    return Measurements(
        CRS,
        ids,
        {},
        tuple(f"drive {i}" for i in range(count)),
        rows[:, 0].astype(np.int32),
        rows[:, 1].astype(np.int32),
        *rows[:, 2:].T,
        np.full(len(rows), 5.0),
        technologies=technologies or {},
    )


def with_levels(measurements, level_dbm):
    columns = {**vars(measurements), "level_dbm": np.asarray(level_dbm, dtype=np.float64)}
    return Measurements(**columns)


def offset_errors_db(measurements):
    """How far a calibration is off the true levels where a cell can be received."""
    predicted = {
        name: lambda east_m, north_m, at=antenna: predicted_dbm(at, east_m, north_m)
        for name, antenna in zip("ABC", ANTENNAS_M, strict=True)
    }
    survey = fit_survey(measurements, SurveyOptions(most_points=300), predicted=predicted)
    grid = np.mgrid[100:1500:100, 100:1500:20].reshape(2, -1) + np.array([[WEST_M], [SOUTH_M]])
    found = []
    for cell, (name, antenna) in enumerate(zip("ABC", ANTENNAS_M, strict=True)):
        truth = predicted_dbm(antenna, *grid) + OFFSETS_DB[cell]
        level, _ = survey.cells[name].predict(*grid)
        found.append((level - truth)[truth > SENSITIVITY_DBM + 5])
    return np.concatenate(found)


@pytest.mark.parametrize("floor_dbm", [-140.0, SENSITIVITY_DBM])
def test_a_calibration_is_that_of_the_levels_that_were_received(floor_dbm):
    rows = drives(7)
    level = rows.level_dbm.copy()
    level[level < SENSITIVITY_DBM] = floor_dbm
    given = with_levels(rows, level)
    left = without_floor_values(given)
    at_floor = level == level.min()
    assert len(left) == np.count_nonzero(~at_floor)
    (note,) = left.notes
    assert note.startswith(f"{at_floor.sum()} of {len(rows)} rows left out: the lowest level")
    assert f"{level.min():g} dBm ({at_floor.sum()})" in note
    before, after = offset_errors_db(given), offset_errors_db(left)
    assert abs(after.mean()) < 0.5
    assert np.sqrt(np.mean(after**2)) < 3.5
    if floor_dbm == -140.0:
        assert np.sqrt(np.mean(before**2)) > 6.0


def test_levels_as_they_were_received_are_kept():
    rows = drives(8)
    assert without_floor_values(rows) is rows
    weakest = rows.level_dbm.min()
    # A weakest level in a few places is one like others.
    few = rows.level_dbm.copy()
    few[np.argsort(few)[:9]] = weakest - 1
    assert len(without_floor_values(with_levels(rows, few))) == len(rows)


def test_who_stands_still_in_a_weak_place_has_no_floor():
    rows = drives(9, count=1)
    level, east_m, north_m = rows.level_dbm.copy(), rows.east_m.copy(), rows.north_m.copy()
    level[:200], east_m[:200], north_m[:200] = -139.0, east_m[0], north_m[0]
    columns = {**vars(rows), "level_dbm": level, "east_m": east_m, "north_m": north_m}
    still = Measurements(**{**columns, "cell": np.where(np.arange(len(rows)) < 200, 0, rows.cell)})
    assert without_floor_values(still) is still


def test_bars_of_a_phone_are_levels():
    rows = drives(10)
    bars = np.array([-113.0, -103.0, -97.0, -89.0, -70.0])
    level = bars[np.clip(np.searchsorted(bars, rows.level_dbm) - 1, 0, 4)]
    level[rows.level_dbm < -95] = -113.0
    assert len(without_floor_values(with_levels(rows, level))) == len(rows)


def test_each_session_and_technology_has_its_own_floor_and_may_have_two():
    rows = drives(11, technologies={"A": "LTE", "B": "LTE", "C": "UMTS"})
    level = rows.level_dbm.copy()
    scanner = rows.session == 1
    level[scanner & (level < -104.0)] = -104.0
    filled = scanner & (rows.cell == 0) & (np.arange(len(rows)) % 5 == 0)
    level[filled] = -140.0
    umts = rows.cell == 2
    level[umts & (rows.session == 2) & (level < -100.0)] = -100.0
    left = without_floor_values(with_levels(rows, level))
    expected = scanner & (level == -104.0) | filled
    expected |= umts & (rows.session == 2) & (level == -100.0)
    assert len(left) == np.count_nonzero(~expected)
    kept = with_levels(rows, level).where(~expected)
    np.testing.assert_array_equal(left.level_dbm, kept.level_dbm)
    np.testing.assert_array_equal(left.session, kept.session)
    for text in ("-140 dBm (", "-104 dBm (", "-100 dBm ("):
        assert text in left.notes[0]
