"""What oracles are given: true starts, and the true size of errors."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded import locating, smartloc
from mapfilter.experiments.recorded.locating import OpenMap, with_white_ranges
from mapfilter.experiments.recorded.oracles import (
    NOISE,
    START,
    motion_errors,
    range_errors_m,
    with_fix_errors,
    with_range_errors,
    with_start,
    with_true_motion,
)
from mapfilter.geodesy import project, unproject
from mapfilter.gnss.sky import ecef_from_lonlat
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.gnss.biases import Biases, reflection_deviations_m
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.sky import Sky, range_sigma_m
from mapfilter.positioning.log_options import fitted_to_log
from mapfilter.tracks.log import make_log

CRS = "EPSG:32633"
LON, LAT, HEIGHT_M = 13.37, 52.51, 80.0


def _truth(count=100):
    east, north = (float(part[0]) for part in project(CRS, [LON], [LAT]))
    return Truth(np.arange(float(count)), east + 5.0 * np.arange(count), np.full(count, north))


def _table(truth):
    return pd.DataFrame({"time_s": truth.time_s, "east_m": truth.east_m, "north_m": truth.north_m})


def test_a_known_start_is_the_first_thirty_metres():
    truth = _truth()
    log = make_log(
        CRS, motion=pd.DataFrame({"time_s": truth.time_s, "step_m": 5.0}), truth=_table(truth)
    )
    found = with_start(log, truth).gnss
    assert found["time_s"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert found["east_m"].tolist() == truth.east_m[:7].tolist()
    assert set(found["var_east_m2"]) == {1.0}


def test_true_motion_are_the_chords_of_the_true_way():
    time_s = np.arange(6.0)
    motion = pd.DataFrame({"time_s": time_s, "step_m": 9.0, "heading_rad": 1.0, "turn_rad": 0.5})
    motion = motion.assign(sampling_sd_m=4.0)
    # North, at rest, east; not known after 4 s.
    truth = Truth(
        np.arange(5.0), np.array([0.0, 0, 0, 3, 6]) + 5e5, np.array([0.0, 2, 2, 2, 2]) + 5e6
    )
    found = with_true_motion(make_log(CRS, motion=motion), truth).motion
    assert found["step_m"].tolist() == pytest.approx([0, 2, 0, 3, 3, 9])
    quarter = np.pi / 2
    assert found["heading_rad"].tolist() == pytest.approx([quarter, quarter, quarter, 0, 0, 1])
    assert found["turn_rad"].isna().tolist() == [True] * 5 + [False]
    assert found["sampling_sd_m"].tolist() == [0.0] * 5 + [4.0]


def test_errors_of_motion_over_a_hundred_metres():
    rng = np.random.default_rng(4)
    perfect = pd.DataFrame({"step_m": np.full(20_000, 1.0), "turn_rad": np.zeros(20_000)})
    turn = np.radians(0.2) * rng.standard_normal(20_000)
    scale, drift_deg = motion_errors(perfect.assign(step_m=1.03, turn_rad=turn), perfect)
    assert scale == pytest.approx(0.03)
    assert drift_deg == pytest.approx(0.2, rel=0.1)
    assert motion_errors(perfect, perfect) == (0.001, 0.05)
    assert motion_errors(perfect.iloc[:10], perfect.iloc[:10]) == (0.001, 0.05)


def test_fixes_state_their_error():
    truth = _truth()
    gnss = pd.DataFrame({"time_s": [10.0, 20.0, 500.0]})
    gnss = gnss.assign(east_m=truth.east_m[10], north_m=truth.north_m[0], var_east_m2=4.0)
    gnss = gnss.assign(var_north_m2=4.0, cov_east_north_m2=0.0)
    log = make_log(CRS, gnss=gnss, truth=_table(truth))
    found = with_fix_errors(log, truth).gnss
    # Exact, 50 m off, and not known.
    assert found["var_east_m2"].tolist() == [1.0, 1250.0, 4.0]


def _ranges(truth, late_m):
    """Eight satellites, of which the one at 20° of elevation is late; the clock drifts."""
    lon, lat = np.radians(LON), np.radians(LAT)
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    north = np.cross(up, east)
    rows = []
    for time_s in truth.time_s[::10]:
        at = int(time_s)
        (lon_deg,), (lat_deg,) = unproject(CRS, truth.east_m[at : at + 1], truth.north_m[:1])
        here = ecef_from_lonlat(lon_deg, lat_deg, HEIGHT_M)
        for number, elevation in enumerate((20, 35, 50, 60, 70, 45, 80, 55)):
            tilt, turn = np.radians(elevation), np.radians(45 * number)
            level = np.cos(turn) * north + np.sin(turn) * east
            sat = here + 2.2e7 * (np.sin(tilt) * up + np.cos(tilt) * level)
            away = np.linalg.norm(sat - here) + 1000 + 3 * time_s + (late_m if number == 0 else 0.0)
            rows.append((time_s, f"G{number + 1:02d}", away, 8.0, *sat))
    columns = ["time_s", "satellite", "pseudorange_m", "sigma_m", "x_m", "y_m", "z_m"]
    return pd.DataFrame(rows, columns=columns)


def test_errors_of_pseudoranges_without_clock_and_height():
    truth = _truth()
    rows = _ranges(truth, 60.0)
    error_m = range_errors_m(rows, truth, CRS)
    late = (rows["satellite"] == "G01").to_numpy()
    assert error_m[late] == pytest.approx(60.0, abs=1.0)
    assert np.abs(error_m[~late]).max() < 1.0
    beyond = rows.assign(time_s=rows["time_s"] + 1000.0)
    assert np.isnan(range_errors_m(beyond, truth, CRS)).all()
    log = make_log(CRS, pseudoranges=rows, truth=_table(truth))
    sigma_m = with_range_errors(log, truth).pseudoranges["sigma_m"].to_numpy()
    assert sigma_m[late] == pytest.approx(60.0, abs=1.0)
    assert (sigma_m[~late] < 1.5).all()


def test_errors_of_known_size_are_white_and_of_that_size():
    usual = GnssOptions(zenith_m=3.0, height_m=50.0)
    white = with_white_ranges(usual)
    assert (white.zenith_m, white.height_m, white.gate) == (3.0, 50.0, usual.gate)
    elevation_rad, names = np.radians([20.0, 50.0, 80.0]), ("G01", "G02", "G03")
    for stated_m in ([60.0, 1.0, np.nan], [np.nan] * 3):
        sigma_m = np.array(stated_m)
        lasting = Biases(names, reflection_deviations_m(white, elevation_rad, sigma_m))
        assert lasting.means_m(white).tolist() == [0.0, 0.0, 0.0]
        assert lasting.variances_m2(white).tolist() == [0.0, 0.0, 0.0]
        assert (reflection_deviations_m(usual, elevation_rad, sigma_m) > 0).all()
    sigma_m = np.array([60.0, 1.0, 7.0])
    sky = Sky(names, np.zeros((3, 3)), elevation_rad, np.zeros(3), sigma_m, (0.0, 0.0), np.eye(2))
    assert range_sigma_m(white, sky, 0.0).tolist() == [60.0, 1.0, 7.0]


def test_smartloc_locates_the_oracle_of_noise_alone_with_white_errors(monkeypatch, tmp_path):
    truth = _truth()
    log = make_log(CRS, pseudoranges=_ranges(truth, 60.0), truth=_table(truth))
    usual = GnssOptions(zenith_m=3.0, height_m=50.0)
    database = SimpleNamespace(lattice=SimpleNamespace(crs=CRS), plan=None, cell_ids=())
    own = BayesPositioner(None, satellites=usual)
    over = OpenMap(database, tmp_path, {(fitted_to_log(BayesFilter(), log)[0], False): own})
    found = {}
    for method in ("bayes", START, NOISE):
        monkeypatch.setattr(
            locating, "locate", lambda _, by, __, name=method: found.update({name: by.satellites})
        )
        smartloc.located_by(method, log, over, np.random.default_rng(0))
    assert found == {"bayes": usual, START: usual, NOISE: with_white_ranges(usual)}


def test_oracles_of_smartloc_are_those_of_the_parts_with_a_target():
    truth = _truth(200)
    log = make_log(CRS, pseudoranges=_ranges(truth, 60.0), truth=_table(truth))
    assert smartloc.by_oracles("satellites-2", log, truth, []) == {}
    found = smartloc.by_oracles(smartloc.ALL, log, truth, [])
    assert list(found) == [START, NOISE]
    assert found[START].gnss["time_s"].max() == 60.0
    assert found[START].pseudoranges["time_s"].min() > 60.0
    with_outage = smartloc.by_oracles(smartloc.OUTAGES, log, truth, [(80.0, 140.0)])[START]
    assert with_outage.pseudoranges.empty
    times = with_outage.gnss["time_s"].to_numpy()
    assert not np.any((times > 80) & (times <= 140))
    assert {80.0, 141.0} <= set(times.tolist())
