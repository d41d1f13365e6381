"""Fingerprints of a radio-route database, thinned, and reports drawn from predicted levels."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from cross_world import CRS, LATTICE, levels_dbm, make_plan

from mapfilter.database.measured import Readings
from mapfilter.positioning.fingerprints import sources
from mapfilter.positioning.fingerprints.planned import Planned
from mapfilter.positioning.fingerprints.reports import make_reports
from mapfilter.positioning.fingerprints.sources import (
    is_table,
    reports_of_database,
    simulated_reports,
)


def by_place(reports):
    """Levels by cell for each place."""
    found = {}
    for k, place in enumerate(reports.places.tolist()):
        cell, level_dbm = reports.readings(k)
        names = [reports.cell_ids[n] for n in cell]
        found[tuple(place)] = dict(zip(names, level_dbm.tolist(), strict=True))
    return found


def expected_at(row, col):
    return {
        cell.id: pytest.approx(float(levels_dbm(cell)[row, col]), abs=0.01)
        for cell in make_plan().cells
        if levels_dbm(cell)[row, col] > -110
    }


def test_each_point_is_a_report_of_all_cells_that_are_received_there(database):
    found = reports_of_database(database, 4.5)
    points = database.points()
    assert len(found) == len(points)
    east_m, north_m = LATTICE.east_north(points.row, points.col)
    np.testing.assert_allclose(found.places, np.column_stack([east_m, north_m]))
    levels = by_place(found)
    for row, col, x, y in zip(points.row, points.col, east_m, north_m, strict=True):
        assert levels[x, y] == expected_at(row, col)
    assert found.predicted
    assert found.planned is None
    assert np.all(found.sd_db == 4.5)
    assert np.all(found.block == -1)
    assert set(found.cell_ids) == {"W", "E"}


@pytest.mark.parametrize(("most", "step"), [(121, 1), (120, 2), (31, 2), (30, 3), (2, 8)])
def test_a_database_is_thinned_to_a_coarser_lattice(database, monkeypatch, most, step):
    """The 121 points of the cross, of which so many rows and columns are taken."""
    monkeypatch.setattr(sources, "MOST_POINTS", most)
    found, points = reports_of_database(database), database.points()
    assert len(points) == 121
    kept = (points.row % step == 0) & (points.col % step == 0)
    if not kept.any():
        kept[:: step**2] = True
    east_m, north_m = LATTICE.east_north(points.row[kept], points.col[kept])
    np.testing.assert_allclose(found.places, np.column_stack([east_m, north_m]))
    levels = by_place(found)
    for row, col, x, y in zip(points.row[kept], points.col[kept], east_m, north_m, strict=True):
        assert levels[x, y] == expected_at(row, col)


COUNT, CELLS = 4000, ("A", "B", "C", "D")
LEVELS_DBM = np.array([-60.0, -63.0, -66.0, -90.0])


def predicted(planned=None, sd_db=3.0):
    """The same levels at places in a row, with as many cells."""
    report = np.repeat(np.arange(COUNT), 4)
    made = make_reports(
        CRS, report, np.tile(np.array(CELLS), COUNT), np.tile(LEVELS_DBM, COUNT), count=COUNT,
        places=np.column_stack([531_000.0 + np.arange(COUNT), np.full(COUNT, 4_555_900.0)]),
        sd_db=np.full(4 * COUNT, sd_db),
    )  # fmt: skip
    return replace(made, predicted=True, planned=planned)


def table_of(reports):
    """Levels by report and cell, NaN where a cell is not in the report."""
    found = np.full((len(reports), 4), np.nan)
    for k in range(len(reports)):
        cell, level_dbm = reports.readings(k)
        found[k, [CELLS.index(reports.cell_ids[n]) for n in cell]] = level_dbm
    return found


def test_drawn_reports_have_the_stated_errors():
    """Of all cells: independent errors of 3 dB, and one of 5 dB that the cells share."""
    drawn = simulated_reports(predicted(), COUNT, 4, 5.0, np.random.default_rng(1))
    off = table_of(drawn) - LEVELS_DBM
    covariance = np.cov(off.T)
    error = 5 * 34 * (2 / COUNT) ** 0.5
    np.testing.assert_allclose(np.diag(covariance), 34.0, atol=error)
    np.testing.assert_allclose(covariance[~np.eye(4, dtype=bool)], 25.0, atol=error)
    assert np.abs(off.mean(axis=0)).max() < 5 * (34 / COUNT) ** 0.5
    assert np.isnan(drawn.timing_advance).all()
    # Each place once, in any order.
    assert sorted(drawn.east_m - 531_000.0) == list(range(COUNT))
    assert (np.diff(drawn.east_m) < 0).any()
    few = simulated_reports(predicted(), 7, 4, 5.0, np.random.default_rng(1))
    assert len(few) == 7


@pytest.mark.parametrize("strongest", [1, 2, 3])
def test_drawn_reports_have_the_strongest_cells_only(strongest):
    """By the levels as drawn: the second is the strongest of all as often as the errors say."""
    all_ = table_of(simulated_reports(predicted(), COUNT, 4, 0.0, np.random.default_rng(2)))
    some = table_of(simulated_reports(predicted(), COUNT, strongest, 0.0, np.random.default_rng(2)))
    expected = all_.copy()
    rank = np.argsort(np.argsort(-all_, axis=1), axis=1)
    expected[rank >= strongest] = np.nan
    np.testing.assert_array_equal(some, expected)


def planned(layer, step_m=100.0, common_db=0.0):
    sites = np.column_stack([531_000.0 + 700.0 * np.arange(4), np.full(4, 4_555_900.0)])
    return Planned(sites, np.full(4, step_m), np.array(layer, dtype=np.int64), common_db)


def test_layers_besides_that_of_the_serving_cell_are_measured_half_of_the_time():
    """A and B are of one, C and D of others. Layers are measured as a whole, and each may serve."""
    made = predicted(planned([0, 0, 1, 2]), sd_db=1e-6)
    drawn = simulated_reports(made, COUNT, 4, 0.0, np.random.default_rng(3))
    there, serving = np.isfinite(table_of(drawn)), np.array(drawn.cell_ids)[drawn.serving]
    np.testing.assert_array_equal(there[:, 0], there[:, 1])
    for name, column in (("A", 0), ("C", 2), ("D", 3)):
        own = serving == name
        assert abs(own.mean() - 1 / 3) < 5 * (2 / 9 / COUNT) ** 0.5
        assert there[own, column].all()
        others = there[own][:, [k for k in (0, 2, 3) if k != column]].mean(axis=0)
        assert np.all(abs(others - 0.5) < 5 * 0.5 / own.sum() ** 0.5)
    other = replace(made, level_dbm=np.tile(LEVELS_DBM[[1, 0, 2, 3]], COUNT))
    drawn = simulated_reports(other, COUNT, 4, 0.0, np.random.default_rng(3))
    assert set(np.array(drawn.cell_ids)[drawn.serving]) == {"B", "C", "D"}


@pytest.mark.parametrize("timed", [0.0, 0.3, 1.0])
def test_some_reports_have_a_timing_advance_of_the_serving_cell(timed):
    made = predicted(planned([0] * 4), sd_db=1e-6)
    drawn = simulated_reports(made, COUNT, 4, 0.0, np.random.default_rng(4), timed)
    known = np.isfinite(drawn.timing_advance)
    assert abs(known.mean() - timed) <= 5 * (timed * (1 - timed) / COUNT) ** 0.5
    if timed == 1.0:
        away_m = drawn.east_m - 531_000.0
        off_m = 100.0 * (drawn.timing_advance + 0.5) - away_m
        assert abs(np.median(off_m[away_m > 1000])) < 30


def test_the_common_error_of_a_plan_adds_to_that_which_cells_share():
    made = predicted(planned([0] * 4, common_db=4.0), sd_db=1e-6)
    off = table_of(simulated_reports(made, COUNT, 4, 3.0, np.random.default_rng(5))) - LEVELS_DBM
    np.testing.assert_allclose(np.cov(off.T), 25.0, atol=5 * 25 * (2 / COUNT) ** 0.5)


def test_what_may_be_a_table(tmp_path):
    for name, good in (("a.csv", True), ("b.TSV", True), ("c.txt", True), ("d.parquet", False)):
        (tmp_path / name).write_text("x")
        assert is_table(tmp_path / name) is good
    (tmp_path / "folder.csv").mkdir()
    assert not is_table(tmp_path / "folder.csv")
    assert not is_table(tmp_path / "none.csv")


def surveyed(count=3):
    """Readings of a survey: two of the first report, of which the second serves, and so on."""
    report = np.repeat(np.arange(5, 5 + count, dtype=np.int32), 2)
    cell = np.resize(np.array([1, 0], dtype=np.int32), 2 * count)
    serving = np.resize([False, True], 2 * count)
    return Readings(
        ("A", "B"), cell, report, np.asarray(report // 6, np.int32),
        531_000.0 + report, 4_555_900.0 - report, -60.0 - np.arange(2.0 * count) % 100,
        np.where(serving, 3.0 + report, 99.0), serving,
    )  # fmt: skip


def survey_of(readings):
    return SimpleNamespace(
        measured=lambda: SimpleNamespace(readings=readings),
        lattice=SimpleNamespace(crs=CRS),
    )


def test_the_readings_of_a_survey_are_reports_themselves():
    found = reports_of_database(survey_of(surveyed()))
    assert by_place(found) == {
        (531_000.0 + k, 4_555_900.0 - k): {"B": -60.0 - 2 * (k - 5), "A": -61.0 - 2 * (k - 5)}
        for k in (5, 6, 7)
    }
    assert [found.cell_ids[n] for n in found.serving] == ["A", "A", "A"]
    # The timing advance is that of the serving cell; each session is a block of its own.
    assert found.timing_advance.tolist() == [8.0, 9.0, 10.0]
    assert found.block.tolist() == [0, 1, 1]
    assert (found.predicted, found.notes, found.planned) == (False, (), None)
    alone = surveyed()
    alone.serving[:] = False
    without = reports_of_database(survey_of(alone))
    assert without.serving.tolist() == [-1, -1, -1]
    assert np.isnan(without.timing_advance).all()
    several = surveyed()
    several.serving[:] = True
    first = reports_of_database(survey_of(several))
    assert [first.cell_ids[n] for n in first.serving] == ["B", "B", "B"]
    assert first.timing_advance.tolist() == [99.0, 99.0, 99.0]


@pytest.mark.parametrize(("most", "kept"), [(5, [0, 1, 2, 3, 4]), (3, [0, 2, 4]), (2, [0, 4])])
def test_a_large_survey_is_thinned_evenly(monkeypatch, most, kept):
    monkeypatch.setattr(sources, "MOST_POINTS", most)
    found = reports_of_database(survey_of(surveyed(5)))
    assert (found.east_m - 531_005.0).tolist() == kept
    assert found.notes == (() if most == 5 else (f"{most} of 5 reports taken, evenly",))


def test_twenty_thousand_reports_of_a_survey_are_enough():
    found = reports_of_database(survey_of(surveyed(20_001)))
    assert len(found) == 20_000
    assert (found.east_m[0], found.east_m[-1]) == (531_005.0, 551_005.0)


def test_a_cell_whose_plan_lacks_a_value_errs_by_more(database):
    """By 4 dB for an assumed power besides the 3 dB of all levels: 5 dB."""
    cells = tuple(
        replace(cell, assumed="eirp_dbm" if cell.id == "E" else "") for cell in make_plan().cells
    )
    known = replace(database, plan=replace(make_plan(), cells=cells))
    found = reports_of_database(known, 3.0)
    of_cell = np.array(found.cell_ids)[found.cell]
    np.testing.assert_allclose(found.sd_db[of_cell == "W"], 3.0)
    np.testing.assert_allclose(found.sd_db[of_cell == "E"], 5.0)
    assert found.planned is not None
