"""What is wrong with reported levels: fading, the phone's offset, and late handovers."""

import numpy as np
import pandas as pd

from mapfilter.simulation.reports import ReportModel, reports

COUNT = 2000


def standing(ticks):
    return pd.DataFrame({"time_s": np.arange(float(ticks)), "east_m": 0.0, "north_m": 0.0})


def constant(east_m, _):
    return np.tile([-60.0, -70.0, -80.0], (len(east_m), 1))


def measured(plan_of, ticks=COUNT, seed=1, **model):
    """Levels less the true ones, (reports, cells), of three cells far from both ends."""
    plan = plan_of([(0, 0), (9, 9), (5, 5)])
    exact = {"quantise": False, "averaging_s": 1000.0, **model}
    table = reports(
        standing(ticks), constant, plan, ReportModel(**exact), np.random.default_rng(seed)
    )
    index = {(cell.arfcn, cell.bsic): i for i, cell in enumerate(plan.cells)}
    which = [index[key] for key in zip(table["arfcn"], table["bsic"], strict=True)]
    found = np.full((ticks, 3), np.nan)
    found[table["time_s"].astype(int), which] = table["level_dbm"]
    return found - [-60.0, -70.0, -80.0]


def test_fading_has_its_deviation_in_every_cell_and_is_drawn_anew(plan_of):
    error = measured(plan_of, fading_db=3.5)
    assert np.abs(error.std(axis=0) / 3.5 - 1).max() < 4 / np.sqrt(2 * COUNT)
    assert np.abs(error.mean(axis=0)).max() < 4 * 3.5 / np.sqrt(COUNT)
    between = np.corrcoef(error.T)
    assert np.abs(between[np.triu_indices(3, 1)]).max() < 4 / np.sqrt(COUNT)
    after = np.mean(error[1:] * error[:-1], axis=0) / 3.5**2
    assert np.abs(after).max() < 4 / np.sqrt(COUNT)


def test_a_phone_is_off_by_one_number_for_all_cells_and_reports(plan_of):
    error = np.array(
        [measured(plan_of, 3, seed, fading_db=0.0, phone_offset_sd_db=4.0) for seed in range(500)]
    )
    np.testing.assert_allclose(np.ptp(error, axis=(1, 2)), 0.0, atol=1e-9)
    offset = error[:, 0, 0]
    assert abs(offset.mean()) < 4 * 4.0 / np.sqrt(500)
    assert abs(offset.std() / 4.0 - 1) < 4 / np.sqrt(2 * 500)


def test_without_errors_levels_are_the_true_ones(plan_of):
    np.testing.assert_allclose(measured(plan_of, 20, fading_db=0.0), 0.0)


def test_a_phones_offset_hides_weak_cells(plan_of):
    """The offset counts before the sensitivity: a deaf phone hears less."""
    plan = plan_of([(0, 0), (9, 9)])

    def weak(east_m, _):
        return np.tile([-60.0, -103.0], (len(east_m), 1))

    heard = []
    for seed in range(200):
        model = ReportModel(fading_db=0.0, phone_offset_sd_db=4.0)
        table = reports(standing(1), weak, plan, model, np.random.default_rng(seed))
        heard.append(len(table) == 2)
    # Above -104 dBm with an offset of more than -1 dB: Φ(1/4) of the phones.
    assert abs(np.mean(heard) - 0.5987) < 4 * 0.49 / np.sqrt(200)


def test_the_same_draws_scale_with_the_errors(plan_of):
    small, large = (measured(plan_of, 50, fading_db=sd) for sd in (1.0, 2.0))
    np.testing.assert_allclose(large, 2 * small)


def test_as_predicted_has_neither(plan_of):
    plan = plan_of([(0, 0), (9, 9), (5, 5)])
    model = ReportModel(quantise=False, fading_db=9.0, phone_offset_sd_db=9.0, radio="as_predicted")
    table = reports(standing(50), constant, plan, model, np.random.default_rng(1))
    assert set(table.loc[table["role"] == "serving", "level_dbm"]) == {-60.0}
