"""Places and clocks of satellites by broadcast ephemerides; delays in the atmosphere."""

import numpy as np
import pandas as pd
import pytest

from mapfilter._constants import LIGHT_MPS
from mapfilter.clocks.times import utc_from_gps_s
from mapfilter.gnss.almanacs import nominal_gps
from mapfilter.gnss.atmosphere import directions, ionosphere_m, receiver_m, troposphere_m
from mapfilter.gnss.broadcast import gps_from_utc_s, place_by_broadcast, satellite_states
from mapfilter.gnss.orbits import EARTH_RATE_RAD_S, satellite_positions_m

WEEK = 2416
TOE_S = WEEK * 604_800.0 + 468_000.0
PERTURBED = ("crs", "delta_n", "cuc", "cus", "cic", "cis", "crc", "idot")


def ephemerides(**changed):
    """Return the nominal constellation as broadcast ephemerides at one time."""
    almanac = nominal_gps(WEEK)
    count = len(almanac.names)
    since = 468_000.0
    mean_motion = np.sqrt(3.986005e14 / almanac.sqrt_a**6)
    table = {
        "satellite": almanac.names,
        "toc_s": TOE_S,
        "toe_s": TOE_S,
        "af0": 0.0,
        "af1": 0.0,
        "af2": 0.0,
        "tgd": 0.0,
        "health": 0.0,
        "m0": almanac.anomaly_rad + mean_motion * since,
        "eccentricity": almanac.eccentricity,
        "sqrt_a": almanac.sqrt_a,
        "omega0": almanac.node_rad,
        "i0": almanac.inclination_rad,
        "omega": almanac.perigee_rad,
        "omega_dot": np.zeros(count),
        **dict.fromkeys(PERTURBED, 0.0),
    }
    return pd.DataFrame({**table, **changed})


def test_without_perturbations_they_are_the_orbits_of_an_almanac():
    table = ephemerides()
    for after_s in (0.0, 1800.0, -3600.0):
        gps_s = np.full(len(table), TOE_S + after_s)
        place, clock = satellite_states(table, np.arange(len(table)), gps_s)
        expected = satellite_positions_m(nominal_gps(WEEK), 468_000.0 + after_s, WEEK)
        assert place == pytest.approx(expected, abs=1e-3)
        assert clock == pytest.approx(0.0, abs=1e-12)


def test_perturbations_move_satellites_as_far_as_they_say():
    one = np.arange(24)
    gps_s = np.full(24, TOE_S)
    plain, _ = satellite_states(ephemerides(), one, gps_s)
    for name, value, most_m in (("crc", 300.0, 300.0), ("cus", 1e-5, 270.0), ("cis", 1e-7, 3.0)):
        moved, _ = satellite_states(ephemerides(**{name: value}), one, gps_s)
        away_m = np.linalg.norm(moved - plain, axis=1)
        assert 0.5 * most_m < away_m.max() <= most_m


def test_clock_polynomial_group_delay_and_relativity():
    table = ephemerides(af0=1e-5, af1=1e-11, tgd=5e-9, eccentricity=0.02)
    _, clock = satellite_states(table, np.arange(24), np.full(24, TOE_S + 100.0))
    rest_s = clock - (1e-5 + 1e-9 - 5e-9)
    # 2 sqrt(mu) e sqrt(A) / c^2 is 46 ns for an eccentricity of 0.02.
    assert np.abs(rest_s).max() == pytest.approx(4.58e-8, rel=0.05)


def test_pseudoranges_of_a_still_receiver_are_its_distances():
    here = receiver_m(60.17, 24.94, 20.0)
    table = ephemerides(af0=np.linspace(-1e-4, 1e-4, 24))
    gps_s = TOE_S + 600.0
    rows = []
    for i, name in enumerate(table["satellite"]):
        way_s = 0.075
        for _ in range(5):
            place, clock = satellite_states(table, np.array([i]), np.array([gps_s - way_s]))
            angle = EARTH_RATE_RAD_S * way_s
            turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0],
                             [0, 0, 1]])  # fmt: skip
            way_s = float(np.linalg.norm(turn @ place[0] - here)) / LIGHT_MPS
        if way_s < 0.086:
            rows.append((name, LIGHT_MPS * (way_s - clock[0])))
    names, ranges = zip(*rows, strict=True)
    given = pd.DataFrame({"time_s": float(utc_from_gps_s(gps_s)), "satellite": names})
    given = given.assign(pseudorange_m=ranges, x_m=np.nan, y_m=np.nan, z_m=np.nan)
    placed, notes = place_by_broadcast(given, table)
    away_m = np.linalg.norm(placed[["x_m", "y_m", "z_m"]].to_numpy() - here, axis=1)
    assert placed["pseudorange_m"].to_numpy() == pytest.approx(away_m, abs=0.05)
    assert notes == (f"pseudoranges: {len(rows)} placed by broadcast ephemerides",)


def test_old_unhealthy_and_missing_ephemerides_place_nothing():
    rows = pd.DataFrame({"satellite": ["G01", "G02", "G31"], "pseudorange_m": 2.2e7})
    rows = rows.assign(time_s=float(utc_from_gps_s(TOE_S)), x_m=np.nan, y_m=np.nan, z_m=np.nan)
    table = ephemerides()
    table.loc[0, "toe_s"] -= 5 * 3600.0
    table.loc[1, "health"] = 1.0
    placed, notes = place_by_broadcast(rows, table)
    assert placed["x_m"].isna().all()
    assert notes == ("pseudoranges: 3 without an ephemeris within 4 h (G01, G02, G31)",)


def test_gps_time_goes_over_every_leap_second():
    for utc in (
        "2015-06-30 23:59:59",
        "2015-07-01",
        "2016-12-31 23:59:59",
        "2017-01-01",
        "2026-05-01",
    ):
        utc_s = pd.Timestamp(utc, tz="UTC").timestamp()
        assert float(utc_from_gps_s(gps_from_utc_s(utc_s))) == utc_s


def test_delays_grow_towards_the_horizon_and_fall_with_the_altitude():
    elevation = np.radians([90.0, 30.0, 10.0, 5.0])
    delay_m = troposphere_m(elevation)
    assert (np.diff(delay_m) > 0).all()
    assert delay_m[0] == pytest.approx(2.4, abs=0.05)
    assert delay_m[1] == pytest.approx(2 * delay_m[0], rel=0.02)
    assert troposphere_m(elevation, 3000.0)[0] < 1.8


def test_ionosphere_is_five_nanoseconds_at_night_and_more_by_day():
    alpha, beta = [1.4e-8, 0.0, -5.96e-8, 5.96e-8], [9.6e4, 0.0, -6.55e4, -1.97e5]
    up = np.array([np.pi / 2, np.pi / 2])
    night, day = ionosphere_m(up, [0.0, 0.0], [7200.0, 50_400.0], 40.0, 0.0, alpha, beta)
    assert night == pytest.approx(5e-9 * LIGHT_MPS, rel=1e-3)
    assert 2 * night < day < 15.0
    low = ionosphere_m([0.1], [0.0], [50_400.0], 40.0, 0.0, alpha, beta)
    assert low[0] > 2 * day


def test_directions_to_places():
    here = (60.17, 24.94, 20.0)
    above = receiver_m(60.17, 24.94, 2e7)
    north = receiver_m(60.18, 24.94, 20.0)
    east = receiver_m(60.17, 24.96, 20.0)
    elevation, azimuth = directions(np.array([above, north, east]), *here)
    assert np.degrees(elevation) == pytest.approx([90.0, 0.0, 0.0], abs=0.02)
    assert np.degrees(azimuth[1:]) == pytest.approx([0.0, 90.0], abs=0.02)


def test_ephemerides_of_another_day_are_said_to_be():
    rows = pd.DataFrame({"satellite": ["G01"], "pseudorange_m": 2.2e7})
    rows = rows.assign(time_s=float(utc_from_gps_s(TOE_S + 30 * 86_400.0)))
    rows = rows.assign(x_m=np.nan, y_m=np.nan, z_m=np.nan)
    (note,) = place_by_broadcast(rows, ephemerides())[1]
    at_s = [float(utc_from_gps_s(TOE_S + days * 86_400)) for days in (0, 30)]
    days = [pd.Timestamp(second, unit="s").date().isoformat() for second in at_s]
    assert f"(G01; the ephemerides are of {days[0]}, the pseudoranges of {days[1]})" in note
