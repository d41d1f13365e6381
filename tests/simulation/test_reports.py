"""Measurement reports: handover, neighbours, quantisation and noise, by hand and by brute force."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapfilter.errors import ConfigError, InputError
from mapfilter.lattice import Lattice
from mapfilter.radio.rxlev import resolve_neighbours
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.simulation.level_samplers import array_sampler, level_sampler
from mapfilter.simulation.reports import ReportModel, reports, running_mean_db, serving_cells
from mapfilter.tracks.log import make_log

CRS = "EPSG:32629"
EXACT = ReportModel(averaging_s=0.0, fading_db=0.0, quantise=False)


def standing(ticks):
    return pd.DataFrame({"time_s": np.arange(float(ticks)), "east_m": 0.0, "north_m": 0.0})


def told(sequence):
    """Levels that come one row after another, wherever one is."""
    return lambda _east, _north: np.asarray(sequence, dtype=float)


def serving_of(radio):
    return radio.loc[radio["role"] == "serving", "cell"].tolist()


def rng():
    return np.random.default_rng(1)


def test_handover_hysteresis_by_hand(plan_of):
    sequence = [
        (-70, -71),  # the strongest serves first
        (-75, -71),  # exactly 4 dB more is not more than 4 dB
        (-75.1, -71),  # handover
        (-70, -71),  # and no way back within the hysteresis
        (-67.1, -71),  # 3.9 dB
        (-66.9, -71),  # 4.1 dB: back
    ]
    radio = reports(standing(6), told(sequence), plan_of([(0, 0), (9, 9)]), EXACT, rng())
    assert serving_of(radio) == ["C0", "C0", "C1", "C1", "C1", "C0"]


def test_a_lost_serving_cell_is_replaced_at_once_by_the_strongest(plan_of):
    sequence = [
        (-80, -102, -101),
        (-105, -102, -101),  # the serving cell is not heard any more
        (-105, -106, -120),  # nothing is
        (np.nan, -103, -104),  # found again; no hysteresis against what was
    ]
    plan = plan_of([(0, 0), (9, 9), (5, 5)])
    radio = reports(standing(4), told(sequence), plan, EXACT, rng())
    assert serving_of(radio) == ["C0", "C2", "C1"]
    assert radio["time_s"].unique().tolist() == [0, 1, 3]
    assert len(radio) == 3 + 2 + 2


def test_handover_looks_at_means(plan_of):
    # One deep fade of the serving cell: its mean of four stays within 4 dB of the other's.
    sequence = [(-70, -73)] * 4 + [(-84, -73)] + [(-70, -73)] * 4
    plan = plan_of([(0, 0), (9, 9)])
    averaging = ReportModel(averaging_s=4.0, fading_db=0.0)
    assert set(serving_of(reports(standing(9), told(sequence), plan, averaging, rng()))) == {"C0"}
    assert set(serving_of(reports(standing(9), told(sequence), plan, EXACT, rng()))) == {"C0", "C1"}


@given(
    arrays(float, (12, 3), elements=st.floats(-120, -40)),
    st.integers(1, 15),
)
def test_running_mean_is_the_mean_of_the_last(level, count):
    mean = running_mean_db(level, count)
    for i in range(12):
        expected = level[max(0, i + 1 - count) : i + 1].mean(axis=0)
        np.testing.assert_allclose(mean[i], expected)


@given(
    arrays(float, (15, 4), elements=st.floats(-120, -60)),
    st.floats(0, 10),
)
def test_serving_cell_is_never_worse_than_the_hysteresis(mean, hysteresis_db):
    heard = mean > -110
    serving = serving_cells(mean, heard, hysteresis_db)
    for i, now in enumerate(serving):
        assert (now >= 0) == heard[i].any()
        if now >= 0:
            assert heard[i, now]
            assert mean[i][heard[i]].max() <= mean[i, now] + hysteresis_db


def test_six_strongest_neighbours_in_order(plan, levels):
    gone = np.random.default_rng(4).uniform(0, 1400, (2, 60))
    truth = pd.DataFrame(
        {"time_s": np.arange(60.0), "east_m": 530000 + gone[0], "north_m": 4555000 + gone[1]}
    )
    model = ReportModel(fading_db=0.0, quantise=False, sensitivity_dbm=-150)
    radio = reports(truth, levels, plan, model, rng())
    level = levels(truth["east_m"].to_numpy(), truth["north_m"].to_numpy())
    for i, (_, report) in enumerate(radio.groupby("time_s")):
        serving, neighbours = report.iloc[0], report.iloc[1:]
        own = plan.index(serving["cell"])
        assert serving["level_dbm"] == level[i, own]
        expected = sorted((c for c in range(10) if c != own), key=lambda c: -level[i, c])[:6]
        assert neighbours["arfcn"].tolist() == [plan.cells[c].arfcn for c in expected]
        assert neighbours["bsic"].tolist() == [plan.cells[c].bsic for c in expected]
        np.testing.assert_array_equal(neighbours["level_dbm"], level[i, expected])
        assert neighbours["cell"].tolist() == [None] * 6
        assert set(neighbours["role"]) == {"neighbour"}


def test_neighbours_resolve_to_the_cells_they_are(plan, levels):
    truth = pd.DataFrame({"time_s": [0.0], "east_m": [530200.0], "north_m": [4555200.0]})
    radio = reports(truth, levels, plan, ReportModel(fading_db=0.0), rng())
    found = [resolve_neighbours(plan, a, b) for a, b in zip(radio.arfcn, radio.bsic, strict=True)]
    assert found[:3] == [("C0",), ("C8",), ("C5",)]


@pytest.mark.parametrize(
    ("level", "rows"),
    [
        # The stronger of two neighbours with one carrier and BSIC is heard.
        ((-60, -70, -80, -90), [("C0", 1, -60), (None, 2, -70), (None, 3, -90)]),
        ((-60, -80, -70, -90), [("C0", 1, -60), (None, 2, -70), (None, 3, -90)]),
        # The serving cell drowns its twin.
        ((-80, -60, -61, -90), [("C1", 2, -60), (None, 1, -80), (None, 3, -90)]),
    ],
)
def test_cells_that_share_carrier_and_bsic_are_heard_once(plan_of, level, rows):
    twins = plan_of([(0, 0), (1, 1), (2, 2), (3, 3)], [(512, 1), (600, 2), (600, 2), (700, 3)])
    radio = reports(standing(1), told([level]), twins, EXACT, rng())
    got = zip(radio["cell"], radio["bsic"], radio["level_dbm"], strict=True)
    assert list(got) == rows


def test_the_serving_cell_drowns_a_stronger_twin_that_hysteresis_keeps_from_serving(plan_of):
    twins = plan_of([(0, 0), (1, 1), (2, 2), (3, 3)], [(512, 1), (600, 2), (600, 2), (700, 3)])
    sequence = [(-80, -60, -70, -90), (-80, -62, -60, -90)]
    radio = reports(standing(2), told(sequence), twins, EXACT, rng())
    assert serving_of(radio) == ["C1", "C1"]
    assert radio.loc[radio["time_s"] == 1, "bsic"].tolist() == [2, 1, 3]


def test_levels_are_quantised_and_censored(plan_of):
    plan = plan_of([(0, 0), (1, 1), (2, 2), (3, 3)])
    model = ReportModel(fading_db=0.0, sensitivity_dbm=-130)
    radio = reports(standing(1), told([(-47.9, -80.2, -110.0, -110.1)]), plan, model, rng())
    assert radio["level_dbm"].tolist() == [-47.5, -80.5, -109.5, -110.5]
    assert radio["censored"].tolist() == [1, 0, 0, -1]


def test_as_predicted_is_the_strongest_predicted_cell_everywhere(plan, levels):
    gone = np.random.default_rng(4).uniform(0, 1400, (2, 300))
    truth = pd.DataFrame(
        {"time_s": np.arange(300.0), "east_m": 530000 + gone[0], "north_m": 4555000 + gone[1]}
    )
    model = ReportModel(radio="as_predicted", fading_db=9.0, averaging_s=30.0)
    radio = reports(truth, levels, plan, model, rng())
    best = levels(truth["east_m"].to_numpy(), truth["north_m"].to_numpy()).argmax(axis=1)
    assert serving_of(radio) == [plan.ids[i] for i in best]


def test_as_predicted_takes_the_first_of_equals_wherever_one_came_from(plan_of):
    sequence = [(-80, -70), (-70, -70), (-120, -120)]
    model = ReportModel(radio="as_predicted")
    radio = reports(standing(3), told(sequence), plan_of([(0, 0), (1, 1)]), model, rng())
    assert serving_of(radio) == ["C1", "C0"]


def test_fading_has_the_stated_deviation_for_every_cell_and_report(plan_of):
    n = 5000
    model = ReportModel(fading_db=2.0, quantise=False, averaging_s=0.0, hysteresis_db=100.0)
    level = told(np.tile([-60.0, -70.0], (n, 1)))
    radio = reports(standing(n), level, plan_of([(0, 0), (1, 1)]), model, rng())
    both = radio["level_dbm"].to_numpy().reshape(n, 2) - [-60, -70]
    # Four standard errors.
    assert (abs(both.std(axis=0) / 2 - 1) < 4 / np.sqrt(2 * n)).all()
    assert (abs(both.mean(axis=0)) < 4 * 2 / np.sqrt(n)).all()
    assert abs(np.corrcoef(both.T)[0, 1]) < 4 / np.sqrt(n)


def test_reports_come_every_period_between_the_truths_ticks(plan_of):
    truth = pd.DataFrame(
        {"time_s": [10.0, 11.0, 12.4], "east_m": [0.0, 10.0, 10.0], "north_m": [0.0, 0.0, 14.0]}
    )
    seen = []

    def levels(east, north):
        seen.append((east, north))
        return np.full((len(east), 1), -70.0)

    radio = reports(truth, levels, plan_of([(0, 0)]), ReportModel(report_period_s=0.48), rng())
    np.testing.assert_allclose(radio["time_s"], 10 + 0.48 * np.arange(6))
    np.testing.assert_allclose(seen[0][0], [0, 4.8, 9.6, 10, 10, 10])
    np.testing.assert_allclose(seen[0][1], [0, 0, 0, 4.4, 9.2, 14])


def test_the_table_is_a_logs_radio_table(plan, levels, town):
    truth = pd.DataFrame(
        {"time_s": [0.0, 30.0], "east_m": [530000.0, 530040.0], "north_m": 4555000.0}
    )
    radio = reports(truth, levels, plan, ReportModel(), rng())
    log = make_log(town.crs, radio=radio)
    assert log.notes == ()
    pd.testing.assert_frame_equal(log.radio, radio, check_dtype=False)


def test_levels_of_another_plan_are_refused(plan, plan_of, levels):
    with pytest.raises(InputError, match="another plan's cells"):
        reports(standing(2), levels, plan_of([(0, 0)]), EXACT, rng())
    with pytest.raises(InputError, match="at least one row"):
        reports(standing(0), levels, plan, EXACT, rng())


@pytest.mark.parametrize("averaging_s", [481.0, 1e300])
def test_means_over_too_many_reports_are_refused(averaging_s):
    assert ReportModel(report_period_s=0.48, averaging_s=480.0).averaging_s == 480.0
    with pytest.raises(ConfigError, match="averaging_s: expected at most 1000 reports, 480 s"):
        ReportModel(report_period_s=0.48, averaging_s=averaging_s)


def test_more_levels_than_fit_into_memory_are_refused(plan_of):
    truth = pd.DataFrame({"time_s": [0.0, 60.0], "east_m": 0.0, "north_m": 0.0})
    with pytest.raises(ConfigError, match=r"expected at most 1e[+]08 levels per journey"):
        reports(
            truth,
            told([]),
            plan_of([(0, 0), (1, 1)]),
            ReportModel(report_period_s=1e-6, averaging_s=0),
            rng(),
        )


def test_every_wrong_value_is_told():
    with pytest.raises(ConfigError) as caught:
        ReportModel(
            report_period_s=0,
            fading_db=-1,
            hysteresis_db=np.nan,
            sensitivity_dbm=104,
            radio="real",  # type: ignore[arg-type]
        )
    message = str(caught.value)
    for part in ("period_s", "fading_db", "hysteresis_db", "sensitivity_dbm", "as_predicted"):
        assert part in message


@pytest.fixture
def lattice():
    return Lattice(CRS, 530000.0, 4555020.0, 5.0, 4, 3)


def test_sampling_takes_the_pixel_that_holds_the_place(lattice):
    array = -np.arange(24.0, dtype=np.float32).reshape(2, 4, 3)
    levels = array_sampler(array, lattice)
    east = 530000 + np.array([0.1, 14.9, 7.5, -0.1, 7.5])
    north = 4555000 + np.array([19.9, 0.1, 12.5, 10.0, 20.1])
    expected = [[0, -12], [-11, -23], [-4, -16], [np.nan] * 2, [np.nan] * 2]
    np.testing.assert_array_equal(levels(east, north), expected)


def test_sampling_rasters(lattice, tmp_path, plan_of):
    array = -50 - np.arange(24.0, dtype=np.float32).reshape(2, 4, 3)
    path = tmp_path / "levels.tif"
    write_rasters(path, lattice, iter([("C1", array[1]), ("C0", array[0])]), ["C1", "C0"])
    rasters = open_rasters(path)
    east, north = lattice.east_north(*np.indices((4, 3)).reshape(2, -1))
    np.testing.assert_allclose(level_sampler(rasters)(east, north), array[::-1].reshape(2, -1).T)
    plan = plan_of([(0, 0), (1, 1)])
    in_plans_order = level_sampler(rasters, plan.ids)(east, north)
    np.testing.assert_allclose(in_plans_order, array.reshape(2, -1).T)
    bounds_m = (530006.0, 4555006.0, 530011.0, 4555009.0)
    part = level_sampler(rasters, plan.ids, bounds_m)(east, north)
    inside = np.zeros((4, 3), dtype=bool)
    inside[2, 1:] = True
    np.testing.assert_array_equal(np.isfinite(part[:, 0]).reshape(4, 3), inside)
    np.testing.assert_allclose(part[inside.ravel(), 0], array[0, 2, 1:])
    with pytest.raises(InputError, match="rasters over"):
        level_sampler(rasters, None, (0.0, 0.0, 1.0, 1.0))


def test_sampling_losses_needs_the_plan(lattice, tmp_path, plan_of):
    path = tmp_path / "loss.tif"
    loss = np.full((4, 3), 90.0, dtype=np.float32)
    write_rasters(path, lattice, iter([("C0", loss)]), ["C0"], quantity="loss")
    with pytest.raises(InputError, match="losses in dB"):
        level_sampler(open_rasters(path))
    level = level_sampler(open_rasters(path), plan=plan_of([(0, 0)]))
    # 55 dBm EIRP less 90 dB.
    assert level(np.array([530001.0]), np.array([4555001.0])).tolist() == [[-35.0]]
