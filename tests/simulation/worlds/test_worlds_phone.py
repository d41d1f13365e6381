"""Reports of the foreign world: fading, the body, scales, periods, stale reports, cars.

Intervals are four standard errors.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from blocks_town import SOUTH_M, WEST_M, plan
from scipy.special import polygamma

from mapfilter.errors import ConfigError
from mapfilter.simulation.worlds.handover import HandoverModel
from mapfilter.simulation.worlds.phone import (
    PhoneModel,
    body_loss_db,
    fast_fading_db,
    headings_rad,
    report_table,
    report_ticks,
)
from mapfilter.simulation.worlds.quantised import SCALES, in_1_db, in_2_db, in_bars
from mapfilter.tracks.log import make_log

CLEAN = PhoneModel(
    offset_sd_db=0.0,
    measurement_sd_db=0.0,
    body_db=0.0,
    diversity=1e9,
    handover=HandoverModel(load_sd_db=0.0, ping_pong=0.0),
)


def walk(seconds=120, speed_mps=1.4):
    time = np.arange(seconds + 1.0)
    east = WEST_M + 100.0 + speed_mps * time
    return pd.DataFrame({"time_s": time, "east_m": east, "north_m": SOUTH_M + 250.0})


def reported(model, level_dbm=None, *, loss_db=0.0, truth=None, seed=0, cells=None):
    truth = walk() if truth is None else truth
    cells = cells or plan()
    levels = np.empty((len(truth), len(cells)))
    levels[:] = -60.3 - 5.0 * np.arange(len(cells)) if level_dbm is None else level_dbm
    losses = np.full(len(truth), loss_db)
    rng = np.random.default_rng(seed)
    return report_table(truth, levels, losses, cells, model, rng)


def serving(table):
    return table[table["role"] == "serving"]


def test_a_clean_phone_reports_the_local_means():
    table = reported(CLEAN)
    assert len(table) == 121 * 7
    first = table[table["time_s"] == 0.0]
    assert first["cell"].tolist() == ["S1A"] + [None] * 6
    assert first["level_dbm"].tolist() == [-60.5 - 5.0 * i for i in range(7)]
    assert first["arfcn"].tolist() == [cell.arfcn for cell in plan().cells]
    assert (first["censored"] == 0).all()


def test_tables_make_a_log():
    log = make_log(plan().crs, radio=reported(PhoneModel(scale="bars", period_s=10.0)))
    assert set(log.radio["role"]) == {"serving", "neighbour"}


@pytest.mark.parametrize("period_s", [1.0, 5.0, 10.0])
def test_periods(period_s):
    times = serving(reported(replace(CLEAN, period_s=period_s)))["time_s"]
    assert np.diff(times) == pytest.approx(period_s)
    assert times.iloc[0] == 0.0


@pytest.mark.parametrize("scale", list(SCALES))
def test_scales_are_monotone_and_censored_at_their_ends_only(scale):
    level = np.arange(-130.0, -30.0, 0.25)
    shown, censored = SCALES[scale](level)
    assert (np.diff(shown) >= 0).all()
    assert (np.diff(censored) >= 0).all()
    assert (shown[censored == -1] == shown[0]).all()
    assert (shown[censored == 1] == shown[-1]).all()


@pytest.mark.parametrize(("scale", "step_db"), [(in_1_db, 1.0), (in_2_db, 2.0)])
def test_steps_are_centred(scale, step_db):
    level = np.random.default_rng(1).uniform(-105, -55, 10_000)
    error = scale(level)[0] - level
    assert np.abs(error).max() <= step_db / 2
    assert error.std() == pytest.approx(step_db / np.sqrt(12), rel=0.03)


def test_four_bars_are_four_values():
    shown, censored = in_bars(np.arange(-130.0, -30.0))
    assert sorted(set(shown)) == [-103.0, -100.0, -93.0, -89.0]
    # A censored limit is true: the level is below the first, or above the last.
    level = np.arange(-130.0, -30.0)
    assert (level[censored == -1] < -103.0).all()
    assert (level[censored == 1] >= -89.0).all()


def test_walls_take_off_their_loss():
    inside, outside = (serving(reported(CLEAN, loss_db=loss)) for loss in (15.0, 0.0))
    difference = outside["level_dbm"].to_numpy() - inside["level_dbm"].to_numpy()
    assert difference == pytest.approx(15.0)


def test_cells_that_are_not_on_air_are_not_reported():
    level = np.full((121, 7), -60.0)
    level[:, 0] = -np.inf
    table = reported(CLEAN, level)
    assert "S1A" not in set(table["cell"])
    assert plan()["S1A"].arfcn not in set(table["arfcn"])


def test_weak_cells_are_not_received():
    level = np.full((121, 7), -60.0)
    level[:, 6] = -104.5
    assert plan()["I1"].arfcn not in set(reported(CLEAN, level)["arfcn"])
    assert reported(CLEAN, np.full((121, 7), -110.0)).empty


def test_of_a_shared_carrier_only_the_strongest_is_reported():
    cells = plan()
    same = replace(cells.cells[2], arfcn=cells.cells[1].arfcn, bsic=cells.cells[1].bsic)
    cells = replace(cells, cells=(*cells.cells[:2], same, *cells.cells[3:]))
    table = reported(CLEAN, cells=cells)
    first = table[table["time_s"] == 0.0]
    assert len(first) == 6
    assert first["level_dbm"].tolist() == [-60.5, -65.5, -75.5, -80.5, -85.5, -90.5]


def test_the_offset_of_a_journey_is_one_number():
    """Drawn for each journey; alike for all cells and reports."""
    model = replace(CLEAN, offset_sd_db=3.0)
    clean = reported(CLEAN)["level_dbm"].to_numpy()
    offsets = []
    for seed in range(300):
        offset = reported(model, seed=seed, truth=walk(2))["level_dbm"].to_numpy() - clean[:21]
        assert np.ptp(offset) <= 1.0
        offsets.append(offset.mean())
    assert np.std(offsets) == pytest.approx(3.0, rel=4 / np.sqrt(600))


def test_a_car_takes_off_its_loss():
    model = replace(CLEAN, carried="car")
    level = np.full((3, 7), -60.3)
    found = [
        -60.5 - reported(model, level, seed=seed, truth=walk(2))["level_dbm"].mean()
        for seed in range(300)
    ]
    # N(9, 5) cut at 0 has a mean of 9.07 dB.
    assert np.mean(found) == pytest.approx(9.07, abs=4 * 5 / np.sqrt(300))
    assert min(found) >= -0.5


@pytest.mark.parametrize("speed_mps", [0.7, 1.4])
def test_what_is_left_of_fading_has_the_moments_of_a_gamma_power(speed_mps):
    count = 40_000
    moved = speed_mps * 0.2
    east = moved * np.arange(count)
    frequency = np.array([900.0])
    fade = fast_fading_db(east, np.zeros(count), frequency, 2.0, np.random.default_rng(2))[1:, 0]
    degrees = 2.0 + moved / (0.5 * 299_792_458.0 / 900e6)
    deviation = 10 / np.log(10) * np.sqrt(polygamma(1, degrees))
    assert fade.std() == pytest.approx(deviation, rel=0.04)
    # The mean of the logarithm is taken out up to the second order of 1 / M.
    assert abs(fade.mean()) < 0.1 + 4 * deviation / np.sqrt(count)


def test_at_rest_a_fade_lasts():
    moved = np.concatenate([np.full(50, 0.28), np.zeros(100), np.full(50, 0.28)])
    fade = fast_fading_db(
        np.cumsum(moved), np.zeros(200), np.array([1800.0, 900.0]), 2.0, np.random.default_rng(3)
    )
    assert (fade[51:150] == fade[50]).all()
    assert (np.diff(fade[:50], axis=0) != 0).all()
    assert (fade[151] != fade[149]).all()


def test_the_body_is_behind_the_phone():
    """Walking east; S2 lies ahead to the north-east, S1 behind once it is passed."""
    east = WEST_M + 290.0 + 10_000.0 + np.arange(5.0)
    loss = body_loss_db(east, np.full(5, SOUTH_M + 310.0), plan(), 6.0)
    assert loss[:, :3] == pytest.approx(6.0)
    ahead = body_loss_db(east - 20_000.0, np.full(5, SOUTH_M + 310.0), plan(), 6.0)
    assert ahead[:, :3] == pytest.approx(0.0, abs=1e-9)


def test_headings_stay_at_rest():
    heading = headings_rad(np.array([0.0, 1.0, 1.0, 1.0]), np.array([0.0, 0.0, 0.0, 1.0]))
    assert heading == pytest.approx([0.0, 0.0, 0.0, np.pi / 2])
    assert headings_rad(np.zeros(3), np.zeros(3)).tolist() == [0.0, 0.0, 0.0]


def test_stale_reports_repeat_the_one_before():
    model = replace(PhoneModel(), stale_every_s=30.0, stale_s=12.0)
    table = reported(model, truth=walk(1200), seed=4)
    lines = {t: tuple(rows["level_dbm"]) for t, rows in table.groupby("time_s")}
    rng = np.random.default_rng(5)
    at, source = report_ticks(0.2 * np.arange(6001), model, rng)
    assert (source <= at).all()
    stale = source != at
    runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], stale, [0]]))))[::2]
    assert 0.15 < stale.mean() < 0.5
    assert runs.max() > 5
    repeated = [lines[t] == lines[t + 1] for t in sorted(lines)[:-1]]
    assert 0.1 < np.mean(repeated) < 0.6
    fresh = reported(replace(model, stale_every_s=0.0), truth=walk(1200), seed=4)
    lines = {t: tuple(rows["level_dbm"]) for t, rows in fresh.groupby("time_s")}
    assert np.mean([lines[t] == lines[t + 1] for t in sorted(lines)[:-1]]) < 0.02


def test_the_duration_of_stale_stretches():
    """Seldom enough not to overlap, a share of duration over distance in time."""
    model = PhoneModel(stale_every_s=400.0, stale_s=12.0)
    tick_s = 0.2 * np.arange(50_001)
    shares = []
    for seed in range(40):
        at, source = report_ticks(tick_s, model, np.random.default_rng(seed))
        shares.append(np.mean(source != at))
    assert np.mean(shares) == pytest.approx(12.0 / 400.0, rel=0.12)


def test_settings_out_of_range_are_refused():
    with pytest.raises(ConfigError, match="period_s"):
        PhoneModel(period_s=0.0)
    with pytest.raises(ConfigError, match="ping_pong"):
        HandoverModel(ping_pong=1.5)
