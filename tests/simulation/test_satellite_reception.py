"""What a simulated receiver hears: geometry, clock, echoes, channels, a spoofer."""

import numpy as np
import pandas as pd
import pytest
import shapely

from mapfilter.errors import ConfigError, InputError
from mapfilter.geodesy import unproject
from mapfilter.gnss.almanacs import nominal_gps
from mapfilter.gnss.orbits import gps_time, satellite_positions_m
from mapfilter.gnss.sky import GridFrame, directions, ecef_from_lonlat
from mapfilter.gnss.skyline import Skyline
from mapfilter.simulation.satellites import ReceptionModel, Spoofer, receive
from mapfilter.tracks.log import make_log

CRS, START = "EPSG:32629", 1_700_000_000.0
ALMANAC = nominal_gps(gps_time(START)[0])
TRUTH = pd.DataFrame(
    {"time_s": np.arange(61.0), "east_m": 531_000.0 + 1.4 * np.arange(61.0), "north_m": 4_556_000.0}
)
QUIET = {"zenith_m": 1e-6, "echo_m": 0.0, "relief_m": 0.0, "height_sd_m": 0.0, "antenna_m": 2.0}


def heard(seed=0, skyline=None, spoofer=None, truth=TRUTH, **model):
    rng = np.random.default_rng(seed)
    return receive(truth, CRS, skyline, ALMANAC, START, ReceptionModel(**model), rng, spoofer)


def ranges_of(rows, shift=(0.0, 0.0)):
    east = np.interp(rows["time_s"], TRUTH["time_s"], TRUTH["east_m"]) + shift[0]
    north = np.interp(rows["time_s"], TRUTH["time_s"], TRUTH["north_m"]) + shift[1]
    there = ecef_from_lonlat(*unproject(CRS, east, north), 102.0)
    return np.linalg.norm(rows[["x_m", "y_m", "z_m"]].to_numpy() - there, axis=1)


def test_without_noise_a_pseudorange_is_distance_and_clock():
    rows = heard(**QUIET)
    clock = rows["pseudorange_m"] - ranges_of(rows)
    assert clock.groupby(rows["time_s"]).std().max() < 1e-3
    by_time = clock.groupby(rows["time_s"]).mean()
    assert abs(by_time.iloc[0]) <= 1e5
    # The clock runs at a rate that hardly changes in a second.
    assert np.abs(np.diff(by_time, 2)).max() < 2.0
    # A log takes them as they are.
    log = make_log(CRS, pseudoranges=rows, start_utc_s=START)
    assert len(log.pseudoranges) == len(rows)


def test_more_channels_hear_others_beside_the_same_ones():
    found = {most: heard(most=most) for most in (0, 1, 3, None)}
    assert len(found[0]) == 0
    keys = ["time_s", "satellite", "pseudorange_m"]
    for few, more in ((1, 3), (3, None)):
        merged = found[few].merge(found[more], on=keys)
        assert len(merged) == len(found[few])
    assert found[3].groupby("time_s").size().max() == 3
    assert found[1]["satellite"].nunique() > 1
    highest = heard(most=1, choice="highest")
    assert highest["satellite"].nunique() <= 2


def test_a_street_hides_satellites_and_makes_echoes():
    sides = [shapely.box(530_000, 4_556_008, 532_000, 4_556_060),
             shapely.box(530_000, 4_555_940, 532_000, 4_555_992)]  # fmt: skip
    street = Skyline(sides, [25.0, 25.0])
    quiet = {**QUIET, "clock_m": 0.0, "drift_mps": 0.0}
    inside, outside = heard(skyline=street, **quiet), heard(**quiet)
    assert len(inside) < 0.6 * len(outside)
    echoing = heard(skyline=street, **{**quiet, "echo_m": 3.0})
    excess = echoing["pseudorange_m"] - inside["pseudorange_m"]
    assert excess.min() >= 0
    assert 0.5 < excess.mean() < 8.0
    under = Skyline([shapely.box(530_000, 4_555_900, 532_000, 4_556_100)], [25.0])
    assert heard(skyline=under).empty


def test_a_spoofer_changes_its_own_time_only():
    spoofer = Spoofer(20.0, 15.0, 300.0, -400.0, 70.0)
    honest, spoofed = heard(**QUIET), heard(spoofer=spoofer, **QUIET)
    during = (honest["time_s"] >= 20.0) & (honest["time_s"] < 35.0)
    pd.testing.assert_frame_equal(honest[~during], spoofed[~during])
    clock = honest["pseudorange_m"] - ranges_of(honest)
    false = spoofed["pseudorange_m"] - ranges_of(spoofed, (300.0, -400.0)) - 70.0
    np.testing.assert_allclose(false[during], clock[during], atol=0.1)


def test_equal_seeds_give_equal_bytes():
    pd.testing.assert_frame_equal(heard(3), heard(3), check_exact=True)
    assert not heard(3)["pseudorange_m"].equals(heard(4)["pseudorange_m"])


def test_models_that_make_no_sense():
    with pytest.raises(ConfigError, match=r"most.*\n.*choice"):
        ReceptionModel(most=-1, choice="lowest")
    with pytest.raises(ConfigError, match="mask_deg"):
        ReceptionModel(mask_deg=0.0)
    with pytest.raises(InputError, match="truth"):
        heard(truth=TRUTH.iloc[:0])


@pytest.mark.parametrize(
    ("lasts_s", "north_m", "later_s"),
    [(6 * 3600.0, 4_556_000.0, 0.0), (7000.0, 7_200_000.0, -2800.0), (7000.0, 7_200_000.0, 800.0)],
)
def test_a_long_journey_hears_those_that_rise_on_the_way(lasts_s, north_m, later_s):
    truth = pd.DataFrame(
        {"time_s": [0.0, lasts_s], "east_m": [531_000.0, 532_000.0], "north_m": north_m}
    )
    rng, start_utc_s = np.random.default_rng(0), START + later_s
    rows = receive(truth, CRS, None, ALMANAC, start_utc_s, ReceptionModel(period_s=100.0), rng)
    frame = GridFrame(CRS, 531_000.0, north_m, 100.0)
    week, second = gps_time(start_utc_s)
    for time_s in (0.0, lasts_s):
        places = satellite_positions_m(ALMANAC, second + time_s, week)
        high = directions(frame.local.to_local(places)).elevation_rad > np.radians(10.3)
        told = set(rows.loc[rows["time_s"] == time_s, "satellite"])
        assert set(np.array(ALMANAC.names)[high]) <= told
