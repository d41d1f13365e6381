"""Whole journeys: what is shared, what is drawn anew, and that equal seeds give equal logs."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import ConfigError, InputError
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.simulate import SimulationSettings, simulate_journeys
from mapfilter.tracks.deadreckoning import dead_reckon
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.store import read_log, write_log

SETTINGS = SimulationSettings(journeys=2, draws=2, journey=JourneyPlan(length_m=400.0))


def made(town, levels, plan, settings=SETTINGS, seed=11):
    return dict(simulate_journeys(town, levels, plan, settings, seed))


def assert_same(a, b, tables=TABLES):
    for table in tables:
        pd.testing.assert_frame_equal(getattr(a, table), getattr(b, table), check_exact=True)


def test_names_tables_and_times(town, levels, plan):
    logs = made(town, levels, plan, replace(SETTINGS, start_utc_s=1e9))
    assert list(logs) == [
        "journey-0000-draw-000",
        "journey-0000-draw-001",
        "journey-0001-draw-000",
        "journey-0001-draw-001",
    ]
    for log in logs.values():
        assert log.notes == ()
        assert log.start_utc_s == 1e9
        assert log.motion["time_s"].tolist() == log.truth["time_s"].tolist()[1:]
        assert len(log.gnss) == 0
        assert (log.radio["role"] == "serving").sum() == len(log.truth)
        assert set(log.truth["way_id"]) <= set(town.way_id.tolist())


def test_equal_levels_of_neighbours_without_carriers_stay_in_the_log(town, levels, plan):
    cells = tuple(replace(cell, arfcn=None, bsic=None) for cell in plan.cells)
    unnamed = replace(plan, cells=cells)
    settings = replace(SETTINGS, reports=ReportModel(radio="as_predicted", sensitivity_dbm=-150))
    for log in made(town, levels, unnamed, settings).values():
        neighbours = log.radio[log.radio["role"] == "neighbour"]
        assert neighbours.duplicated().any()
        assert (neighbours.groupby("time_s").size() == 6).all()
        assert log.notes == ()


def test_draws_share_the_route_and_differ_in_noise(town, levels, plan):
    first, second, other, _ = made(town, levels, plan).values()
    assert_same(first, second, ["truth"])
    assert not np.allclose(first.motion["step_m"], second.motion["step_m"])
    assert not first.radio["level_dbm"].equals(second.radio["level_dbm"])
    assert not first.truth["east_m"].equals(other.truth["east_m"])


def test_more_journeys_and_draws_change_no_other(town, levels, plan):
    few = made(town, levels, plan)
    many = made(town, levels, plan, replace(SETTINGS, journeys=3, draws=4))
    for name, log in few.items():
        assert_same(many[name], log)


def test_other_errors_change_neither_truth_nor_radio(town, levels, plan):
    one = made(town, levels, plan)
    noisier = made(
        town,
        levels,
        plan,
        replace(SETTINGS, imu=ImuNoise(sigma_trans_m=0.5, sigma_orient_deg=17.0, bias_sd_deg=6.0)),
    )
    louder = made(town, levels, plan, replace(SETTINGS, reports=ReportModel(fading_db=3.0)))
    for name, log in one.items():
        assert_same(noisier[name], log, ["truth", "radio"])
        assert_same(louder[name], log, ["truth", "motion"])


def test_other_seeds_give_other_journeys(town, levels, plan):
    one, other = made(town, levels, plan), made(town, levels, plan, seed=12)
    name = "journey-0000-draw-000"
    assert not one[name].truth["east_m"].equals(other[name].truth["east_m"])


def test_a_perfect_journey_reckons_back_to_its_end(town, levels, plan):
    settings = SimulationSettings(imu=ImuNoise(sigma_trans_m=0.0, sigma_orient_deg=0.0))
    (log,) = made(town, levels, plan, settings).values()
    start = log.truth.iloc[0]
    east, north = dead_reckon(
        start["east_m"], start["north_m"], log.motion["step_m"], log.motion["heading_rad"]
    )
    end = log.truth.iloc[-1]
    assert east[-1] == pytest.approx(end["east_m"], abs=1e-6)
    assert north[-1] == pytest.approx(end["north_m"], abs=1e-6)


def test_driving(town, levels, plan):
    settings = replace(
        SETTINGS, journeys=1, draws=1, journey=JourneyPlan(length_m=2000.0, profile="driving")
    )
    (log,) = made(town, levels, plan, settings).values()
    assert 150 < log.duration_s < 400
    assert log.vehicle is True


def test_walks_do_not_state_whose_motion_it_is(town, levels, plan):
    assert {log.vehicle for log in made(town, levels, plan).values()} == {None}


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_equal_seeds_give_equal_files_that_read_back(town, levels, plan, tmp_path, form):
    for folder in ("a", "b"):
        for name, log in made(town, levels, plan).items():
            write_log(log, tmp_path / folder / name, form)
            assert_same(read_log(tmp_path / folder / name), log)
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.*"))
    assert len(files) == 4 * 5
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_plan_and_streets_in_different_systems(town, levels, plan):
    with pytest.raises(InputError, match="cell plan, crs"):
        made(town, levels, plan.to_crs("EPSG:32630"))


def test_no_journeys():
    with pytest.raises(ConfigError, match="at least 1"):
        SimulationSettings(journeys=0)
    with pytest.raises(ConfigError, match="at least 1"):
        SimulationSettings(draws=0)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"journey": JourneyPlan(length_m=1e12)}, "journeys, period_s"),
        ({"journey": JourneyPlan(length_m=1e12, profile="driving")}, "journeys, period_s"),
        ({"journey": JourneyPlan(speed_mps=1e-9)}, "journeys, period_s"),
        ({"imu": ImuNoise(period_s=1e-9)}, "imu, period_s"),
        (
            {"reports": ReportModel(report_period_s=1e-9, averaging_s=0.0)},
            "journeys, report_period_s",
        ),
    ],
)
def test_journeys_that_would_never_end_are_refused(changes, told):
    with pytest.raises(ConfigError, match=f"{told}: expected at most 1e[+]07 times per journey"):
        SimulationSettings(**changes)
