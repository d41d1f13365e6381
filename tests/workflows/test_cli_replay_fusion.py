"""``mapfilter replay`` with Kalman-type filters: a cell plan and a log, no map."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from mapfilter.cli import app
from mapfilter.errors import ConfigError, InputError
from mapfilter.filters.gaussian import EKF, METHODS
from mapfilter.models.state import POSITION
from mapfilter.positioning.estimate_store import read_estimate
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.place import gaussian_radii_m
from mapfilter.positioning.loop import locate
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import write_log

CRS = "EPSG:32629"
SITES = {
    "A": (500_000.0, 4_600_000.0),
    "B": (501_500.0, 4_600_200.0),
    "C": (500_600.0, 4_601_400.0),
}
PLAN = CellPlan(
    CRS,
    tuple(
        Cell(name, name, east, north, 30.0, None, 55.0, 1800.0, antenna="omni")
        for name, (east, north) in SITES.items()
    ),
)


def walk(seed=1, steps=200, *, motion=False, gnss=False, timing=True, levels=True):
    """A straight walk at 1.5 m/s, heard every second."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(1.0, steps + 1)
    heading = 0.6
    truth = np.array([500_300.0, 4_600_300.0]) + np.outer(
        1.5 * time_s, [np.cos(heading), np.sin(heading)]
    )
    options = KalmanOptions()
    sites = SiteModels(PLAN, options)
    model = sites.of(POSITION, tuple(SITES), ())
    heard, lasting = model.mean(truth), np.exp(-1.5 / 50)
    error = rng.normal(0, 9, model.size)
    for row in heard:
        # Shadowing lasts for some 50 m.
        error = lasting * error + np.sqrt(1 - lasting**2) * rng.normal(0, 9, model.size)
        row += error
    rows = []
    for k, at in enumerate(time_s):
        for i, name in enumerate(SITES):
            distance = np.hypot(*(truth[k] - SITES[name]))
            rows.append({
                "time_s": at, "role": "serving" if i == 0 else "neighbour", "cell": name,
                "level_dbm": heard[k, i] if levels else np.nan,
                "timing_advance": int(distance / options.timing_step_m)
                if timing and i == 0 else None,
            })  # fmt: skip
    radio = pd.DataFrame(rows)
    radio["timing_advance"] = radio["timing_advance"].astype("Int64")
    tables = {"radio": radio}
    if motion:
        tables["motion"] = pd.DataFrame({
            "time_s": time_s, "step_m": 1.5 + rng.normal(0, 0.1, steps),
            "heading_rad": heading + rng.normal(0, 0.1, steps),
        })  # fmt: skip
    if gnss:
        tables["gnss"] = pd.DataFrame({
            "time_s": time_s[::5], "east_m": truth[::5, 0] + rng.normal(0, 8, len(time_s[::5])),
            "north_m": truth[::5, 1] + rng.normal(0, 8, len(time_s[::5])),
            "var_east_m2": 64.0, "var_north_m2": 64.0, "cov_east_north_m2": 0.0,
        })  # fmt: skip
    tables["truth"] = pd.DataFrame(
        {"time_s": time_s, "east_m": truth[:, 0], "north_m": truth[:, 1]}
    )
    return make_log(CRS, **tables), truth


NO_PICTURES = ["--set", "output.pictures=none"]


def errors_m(log, truth, method=EKF):
    bound = KalmanFilter(method=method.name).over_sites(PLAN)
    track = locate(log, bound, np.random.default_rng(0))
    found = track.estimate
    return np.hypot(found.east_m - truth[:, 0], found.north_m - truth[:, 1]), found


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("motion", [False, True], ids=["no motion", "dead reckoning"])
def test_every_filter_follows(method, motion):
    log, truth = walk(motion=motion, gnss=True)
    error, found = errors_m(log, truth, method)
    assert np.isfinite(error).all()
    assert error[20:].mean() < (7 if motion else 14)
    assert (error <= found.radii_m[:, 2]).mean() > 0.75
    assert str(found.status[-1]) == "TRACKING"


@pytest.mark.parametrize("motion", [False, True], ids=["no motion", "dead reckoning"])
def test_levels_and_timing_advances_alone_say_how_sure_they_are(motion):
    inside, errors = [], []
    for seed in range(8):
        error, found = errors_m(*walk(seed, motion=motion))
        inside.append((error <= found.radii_m[:, 2]).mean())
        errors.append(error[100:].mean())
    assert np.mean(inside) > 0.9
    # The timing advance is rounded to 553 m and stays the same for most of the way, over which the
    # shadowing changes but six times.
    assert np.mean(errors) < (350 if motion else 700)


def test_what_more_is_measured_makes_it_better():
    plain = errors_m(*walk())[0][100:].mean()
    with_gnss = errors_m(*walk(gnss=True))[0][20:].mean()
    both = errors_m(*walk(gnss=True, motion=True))[0][20:].mean()
    assert both < 0.6 * with_gnss < 0.1 * plain


def test_nothing_to_go_on_is_labelled_and_never_a_number():
    log, truth = walk(timing=False, levels=False)
    error, found = errors_m(log, truth)
    assert np.isnan(error).all()
    assert {str(status) for status in found.status} == {"SEARCHING"}
    assert {str(reading.reason) for reading in found.unused} == {"not_used_by_filter"}


def test_strange_readings_are_labelled():
    log, truth = walk()
    radio = log.radio.copy()
    radio.loc[radio["time_s"] <= 20, "cell"] = "Z"
    radio.loc[radio["time_s"] == 50, "cell"] = None
    strange = make_log(CRS, radio=radio, truth=log.truth)
    error, found = errors_m(strange, truth)
    assert np.isnan(error[:20]).all()
    assert np.isfinite(error[20:]).all()
    reasons = [str(reading.reason) for reading in found.unused]
    assert reasons.count("unknown_cell") == 60
    assert reasons.count("no_cell") == 3


def test_fixes_with_a_broken_covariance_count_as_of_usual_quality():
    log, truth = walk(gnss=True, timing=False, levels=False)
    gnss = log.gnss.copy()
    gnss["cov_east_north_m2"] = 64.0
    gnss.loc[:3, ["var_east_m2", "cov_east_north_m2"]] = 0.0
    gnss.loc[4:8, ["var_north_m2", "cov_east_north_m2"]] = np.nan
    broken = make_log(CRS, radio=log.radio, gnss=gnss, truth=log.truth)
    error, _ = errors_m(broken, truth)
    assert np.isfinite(error).all()
    assert error[20:].mean() < 14


def test_a_log_of_another_zone_is_refused():
    log, _ = walk()
    elsewhere = KalmanFilter().over_sites(replace(PLAN, crs="EPSG:32630"))
    with pytest.raises(InputError, match="another area or zone"):
        locate(log, elsewhere, np.random.default_rng(0))


def test_radii_hold_their_shares():
    covariance = np.array([[400.0, 150.0], [150.0, 100.0]])
    drawn = np.random.default_rng(1).multivariate_normal([0, 0], covariance, 200_000)
    distance = np.hypot(*drawn.T)
    radii, share = gaussian_radii_m(covariance, 20.0)
    for radius, expected in zip(radii, (0.50, 0.67, 0.95), strict=True):
        assert (distance <= radius).mean() == pytest.approx(expected, abs=0.005)
    assert share == pytest.approx((distance <= 20).mean(), abs=0.005)


PLAN_CSV = "cell,east,north,height_m,eirp_dbm,frequency_mhz,antenna\n" + "".join(
    f"{name},{east},{north},30,55,1800,omni\n" for name, (east, north) in SITES.items()
)


def test_replay_needs_a_plan_and_no_map(tmp_path):
    log, truth = walk(gnss=True)
    write_log(log, tmp_path / "walk")
    (tmp_path / "cells.csv").write_text(PLAN_CSV, encoding="utf-8")
    words = ["replay", "--filter", "rbukf", "--log", str(tmp_path / "walk"), "--json"]
    plan = ["--set", f"cells.plan={tmp_path / 'cells.csv'}", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, [*words, *plan], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["filter"] == "rbukf"
    assert told["error_mean_m"] < 14
    estimate = read_estimate(tmp_path / "out" / "estimate.parquet")
    assert np.hypot(estimate.east_m - truth[:, 0], estimate.north_m - truth[:, 1])[-1] < 20
    assert {"track.png", "error.png"} == {file.name for file in (tmp_path / "out").glob("*.png")}
    more = ["--smooth", *NO_PICTURES]
    done = CliRunner().invoke(app, [*words, *plan, *more], catch_exceptions=False)
    assert json.loads(done.stdout.splitlines()[-1])["error_mean_m"] < told["error_mean_m"]


def test_timing_advances_are_in_steps_of_the_technology_that_the_plan_states(tmp_path):
    log, _ = walk(gnss=True, steps=10)
    write_log(log, tmp_path / "walk")
    rows = PLAN_CSV.replace("antenna\n", "antenna,technology\n").replace(",omni\n", ",omni,LTE\n")
    (tmp_path / "cells.csv").write_text(rows.replace(",55,", ",25,"), encoding="utf-8")
    words = ["replay", "--filter", "ekf", "--log", str(tmp_path / "walk"), "--json", *NO_PICTURES]
    words += ["--set", f"cells.plan={tmp_path / 'cells.csv'}", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, words, catch_exceptions=False)
    notes = json.loads(done.stdout.splitlines()[-1])["notes"]
    assert "timing advance: steps of 78.07 m, by technology" in notes


def test_fixes_and_steps_are_replayed_without_the_sites_of_the_cells(tmp_path):
    log, _ = walk(motion=True, gnss=True)
    write_log(log, tmp_path / "walk")
    words = ["replay", "--filter", "ekf", "--log", str(tmp_path / "walk"), "--json", *NO_PICTURES]
    told, radio = {}, len(log.radio)
    for name, more in (("all", []), ("less", ["--without", "radio,tdoa"])):
        given = [*words, *more, "--out", str(tmp_path / name)]
        done = CliRunner().invoke(app, given, catch_exceptions=False)
        assert done.exit_code == 0, done.output
        told[name] = json.loads(done.stdout.splitlines()[-1])
    note = f"{radio} rows of cells (radio) left out: their sites are unknown without a cell plan"
    assert [one for one in told["all"]["notes"] if "left out" in one] == [
        f"{note} (cells.plan) or a database (--db)"
    ]
    assert [one for one in told["less"]["notes"] if "left out" in one] == [
        f"radio: {radio} left out"
    ]
    assert told["all"]["error_mean_m"] == told["less"]["error_mean_m"]
    # Nothing is left to start from.
    with pytest.raises(ConfigError, match=r"cells\.plan.*'walk' has no positions"):
        CliRunner().invoke(app, [*words, "--without", "gnss"], catch_exceptions=False)


@pytest.mark.parametrize("table", ["gnss", "motion"])
def test_a_replay_without_map_and_truth_draws_the_track_where_it_has_a_position(tmp_path, table):
    log, _ = walk(motion=True, gnss=True, steps=20)
    write_log(make_log(CRS, **{table: getattr(log, table)}), tmp_path / "walk")
    words = ["replay", "--filter", "ekf", "--log", str(tmp_path / "walk")]
    CliRunner().invoke(app, [*words, "--out", str(tmp_path / "out")], catch_exceptions=False)
    drawn = [file.name for file in (tmp_path / "out").glob("*.png")]
    assert drawn == (["track.png"] if table == "gnss" else [])


def test_replay_takes_antennas_from_their_files(tmp_path):
    log, _ = walk(gnss=True, steps=10)
    write_log(log, tmp_path / "walk")
    rows = PLAN_CSV.replace("antenna\n", "antenna,azimuth_deg\n").replace(",omni\n", ",panel,30\n")
    (tmp_path / "cells.csv").write_text(rows, encoding="utf-8")
    words = ["replay", "--filter", "ukf", "--log", str(tmp_path / "walk"), "--json", *NO_PICTURES]
    words += ["--set", f"cells.plan={tmp_path / 'cells.csv'}", "--out", str(tmp_path / "out")]
    with pytest.raises(InputError, match="no folder of antennas"):
        CliRunner().invoke(app, words, catch_exceptions=False)
    (tmp_path / "antennas").mkdir()
    cut = "".join(f"{angle} {min(12 * (min(angle, 360 - angle) / 65) ** 2, 25):.1f}\n"
                  for angle in range(360))  # fmt: skip
    (tmp_path / "antennas" / "panel.msi").write_text(
        f"NAME panel\nFREQUENCY 1800\nGAIN 15 dBi\nHORIZONTAL 360\n{cut}VERTICAL 360\n{cut}",
        encoding="utf-8",
    )
    words += ["--set", f"cells.antennas={tmp_path / 'antennas'}"]
    done = CliRunner().invoke(app, words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout.splitlines()[-1])["filter"] == "ukf"


def test_a_filter_that_is_none_is_refused_with_those_that_are(tmp_path):
    words = ["replay", "--filter", "kalman", "--log", str(tmp_path), "--out", str(tmp_path / "o")]
    with pytest.raises(ConfigError, match=r"filter\.name.*'ekf', 'iekf', 'rbukf', 'ukf', 'ckf'"):
        CliRunner().invoke(app, words, catch_exceptions=False)
    words[2] = "candidate"
    with pytest.raises(ConfigError, match="--smooth"):
        CliRunner().invoke(app, [*words, "--smooth"], catch_exceptions=False)
