"""Hidden satellites received by reflections: who, how late, for how long; and nothing else."""

import numpy as np
import pandas as pd
import pytest
import shapely

from mapfilter.errors import ConfigError
from mapfilter.geodesy import unproject
from mapfilter.gnss.almanacs import nominal_gps
from mapfilter.gnss.orbits import gps_time
from mapfilter.gnss.sky import ecef_from_lonlat
from mapfilter.gnss.skyline import Skyline
from mapfilter.simulation.reflections import NlosModel, draw_reflections, held_along
from mapfilter.simulation.satellites import ReceptionModel, Spoofer, receive

CRS, START = "EPSG:32629", 1_700_000_000.0
ALMANAC = nominal_gps(gps_time(START)[0])
EPOCHS = 600
TRUTH = pd.DataFrame(
    {
        "time_s": np.arange(float(EPOCHS)),
        "east_m": 531_000.0 + 14.0 * np.arange(EPOCHS),
        "north_m": 4_556_000.0,
    }
)
STREET = Skyline(
    [shapely.box(530_000, 4_556_008, 541_000, 4_556_060),
     shapely.box(530_000, 4_555_940, 541_000, 4_555_992)], [25.0, 25.0],
)  # fmt: skip
KEYS = ["time_s", "satellite"]


def heard(seed=0, nlos=None, skyline=STREET, spoofer=None, truth=TRUTH, **model):
    reception = ReceptionModel(nlos=nlos, **model)
    rng = np.random.default_rng(seed)
    return receive(truth, CRS, skyline, ALMANAC, START, reception, rng, spoofer)


def reflected_rows(nlos, **model):
    """Rows that are received by reflections only, with elevations.

    They are late against the same satellites over the same journey without buildings, which have
    the same clock and the same noise.
    """
    found, seen = heard(nlos=nlos, **model), heard(**model)
    rows = found.merge(seen[KEYS], on=KEYS, how="left", indicator=True)
    rows = rows[rows["_merge"] == "left_only"].drop(columns="_merge")
    direct = heard(skyline=None, **model)[[*KEYS, "pseudorange_m"]]
    rows = rows.merge(direct, on=KEYS, suffixes=("", "_direct"))
    late_m = rows["pseudorange_m"] - rows["pseudorange_m_direct"]
    return rows.assign(late_m=late_m, elevation_rad=elevation_rad(rows))


def elevation_rad(rows):
    east = np.interp(rows["time_s"], TRUTH["time_s"], TRUTH["east_m"])
    lon, lat = unproject(CRS, east, np.full(len(rows), 4_556_000.0))
    here = ecef_from_lonlat(lon, lat, 101.5)
    away = rows[["x_m", "y_m", "z_m"]].to_numpy() - here
    # Two points on one normal of the ellipsoid, 1 m apart.
    up = ecef_from_lonlat(lon, lat, 102.5) - here
    return np.arcsin(np.einsum("ij,ij->i", away, up) / np.linalg.norm(away, axis=1))


def test_without_a_model_nothing_is_drawn_and_results_stay_as_they_were():
    # Figures of the simulator before it knew of reflections.
    truth = TRUTH.iloc[:61].assign(east_m=531_000.0 + 1.4 * np.arange(61))
    rows = heard(5, truth=truth)
    assert len(rows) == 183
    assert rows["pseudorange_m"].mean() == pytest.approx(21_452_648.904143024, abs=1e-4)
    few = heard(5, truth=truth, most=2)
    assert len(few) == 122
    assert few["pseudorange_m"].mean() == pytest.approx(20_907_313.505092923, abs=1e-4)
    pd.testing.assert_frame_equal(heard(5, NlosModel(share=0.0), truth=truth), rows)


def test_satellites_in_line_of_sight_keep_their_bytes():
    seen, more = heard(), heard(nlos=NlosModel())
    assert len(more) > len(seen)
    kept = more.merge(seen[KEYS], on=KEYS)
    pd.testing.assert_frame_equal(kept, seen, check_exact=True)
    # Without buildings nobody is hidden; under a roof nobody is received.
    pd.testing.assert_frame_equal(
        heard(skyline=None, nlos=NlosModel(share=1.0)), heard(skyline=None), check_exact=True
    )
    roof = Skyline([shapely.box(530_000, 4_555_900, 541_000, 4_556_100)], [25.0])
    assert heard(skyline=roof, nlos=NlosModel(share=1.0)).empty


def test_all_over_the_mask_are_received_where_the_share_is_one():
    everyone = heard(nlos=NlosModel(share=1.0, full_share_deg=0.01))
    open_sky = heard(skyline=None)
    pd.testing.assert_frame_equal(everyone[KEYS], open_sky[KEYS])


def test_the_share_received_is_that_of_their_elevations():
    nlos = NlosModel(share=0.6, full_share_deg=50.0, memory_m=14.0)
    hidden = reflected_rows(NlosModel(share=1.0, full_share_deg=0.01))
    received = reflected_rows(nlos)
    expected = np.sum(nlos.probability(hidden["elevation_rad"]))
    # Runs of two epochs on the average, some 2 500 hidden: a deviation of 3 %.
    assert len(hidden) > 2400
    assert len(received) == pytest.approx(expected, rel=0.07)
    low = hidden["elevation_rad"] < np.radians(25.0)
    few = received["elevation_rad"] < np.radians(25.0)
    assert few.sum() == pytest.approx(
        np.sum(nlos.probability(hidden["elevation_rad"][low])), rel=0.15
    )


def test_delays_are_exponential_and_shrink_with_the_cosine_of_the_elevation():
    nlos = NlosModel(share=1.0, full_share_deg=0.01, delay_m=30.0, delay_memory_m=5.0)
    rows = reflected_rows(nlos, zenith_m=1e-6)
    assert rows["late_m"].min() > -1e-3
    horizontal = rows["late_m"] / np.cos(rows["elevation_rad"])
    # 2 400 delays and more, hardly correlated over 14 m: the mean's deviation is 0.6 m.
    assert horizontal.mean() == pytest.approx(30.0, abs=2.5)
    assert np.mean(horizontal > 60.0) == pytest.approx(np.exp(-2.0), abs=0.025)
    assert np.mean(horizontal < 30.0) == pytest.approx(1 - np.exp(-1.0), abs=0.035)


def test_delays_last_along_the_path():
    elevation = np.full((4000, 1), np.radians(60.0))
    for step_m, lasts in ((1.0, np.exp(-0.1)), (10.0, np.exp(-1.0)), (100.0, 0.0)):
        _, late_m = draw_reflections(
            NlosModel(), step_m * np.arange(4000.0), elevation, np.random.default_rng(2)
        )
        # Of exponential numbers made of normal ones the correlation is a little smaller.
        found = np.corrcoef(late_m[1:, 0], late_m[:-1, 0])[0, 1]
        assert lasts - 0.12 < found < lasts + 0.06


def test_reception_holds_for_metres_and_where_one_stands():
    rng = np.random.default_rng(4)
    level = held_along(5.0 * np.arange(20_000.0), 1, 20.0, rng)[:, 0]
    # exp(-5 / 20) of the steps, less what 20 000 draws scatter.
    same = level[1:] == level[:-1]
    assert same.mean() == pytest.approx(np.exp(-0.25), abs=0.01)
    assert level.mean() == pytest.approx(0.5, abs=0.025)
    assert np.mean(level < 0.2) == pytest.approx(0.2, abs=0.025)
    standing = held_along(np.zeros(50), 3, 20.0, rng)
    assert (standing == standing[0]).all()
    assert len(np.unique(standing[0])) == 3


def test_a_reflection_is_noisier():
    nlos = NlosModel(share=1.0, full_share_deg=0.01, delay_m=0.0, noise_factor=3.0)
    rows = reflected_rows(nlos)
    # Three times the same white noise, once of which the direct signal has: twice 2 m overhead.
    more_m = rows["late_m"] * np.sin(rows["elevation_rad"])
    assert more_m.std() == pytest.approx(4.0, rel=0.06)
    assert more_m.mean() == pytest.approx(0.0, abs=0.3)


@pytest.mark.parametrize("choice", ["random", "highest"])
def test_channels_are_filled_out_of_all_that_are_received(choice):
    nlos = NlosModel(share=1.0)
    everyone, few = heard(nlos=nlos), heard(nlos=nlos, most=4, choice=choice)
    assert len(few.merge(everyone)) == len(few)
    received = everyone.groupby("time_s").size()
    assert (few.groupby("time_s").size() == np.minimum(received, 4)).all()
    assert len(few) > len(few.merge(heard()[KEYS], on=KEYS))


def test_a_spoofer_sends_all_of_them_without_a_delay():
    spoofer = Spoofer(100.0, 200.0, 0.0, 0.0)
    rows = reflected_rows(NlosModel(share=1.0, full_share_deg=0.01), spoofer=spoofer)
    during = (rows["time_s"] >= 100.0) & (rows["time_s"] < 300.0)
    assert (rows["late_m"][during] == 0.0).all()
    assert rows["late_m"][~during].mean() > 10.0


def test_models_that_make_no_sense():
    with pytest.raises(ConfigError, match=r"share.*\n.*full_share_deg.*\n.*memory_m.*\n.*delay_m"):
        NlosModel(share=1.1, full_share_deg=0.0, memory_m=0.0, delay_m=-1.0)
    with pytest.raises(ConfigError, match=r"delay_memory_m.*\n.*noise_factor"):
        NlosModel(delay_memory_m=np.nan, noise_factor=0.5)
