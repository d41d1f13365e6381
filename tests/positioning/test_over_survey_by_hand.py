"""What a filter over a survey takes of it, by small records in the place of a database."""

from dataclasses import dataclass
from math import nan
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.positioning.bayes import over_survey as tested
from mapfilter.positioning.bayes.over_survey import (
    SURVEYED,
    SURVEYED_WAYS,
    filled_field,
    over_survey,
    site_of,
)

ON_WAY = np.array([[True, False], [True, False]])


@dataclass(frozen=True)
class Levels:
    white_db: float = 6.0
    slow_db: float = 4.0
    fast_db: float = 3.0


@dataclass(frozen=True)
class Evidence:
    serving: object = None
    levels: Levels = Levels()
    spacing_m: float = 7.0


@dataclass(frozen=True)
class Bound:
    model: object


@dataclass(frozen=True)
class Deviations:
    """Of the first cell at one place, and of the third one at two."""

    deviation_db: np.ndarray
    cell_ids: tuple = ("A", "B", "C")

    @property
    def cell(self):
        return np.array([0, 2, 2])

    def __len__(self):
        return len(self.deviation_db)

    def spread(self, cell_ids, on_way):
        assert (cell_ids, on_way is ON_WAY) == (("A", "C"), True)
        return np.array([[5.0, nan, nan, 2.0], [nan, nan, nan, 3.0]], dtype=np.float32)


@dataclass(frozen=True)
class Readings:
    """Of cells in turn, of which all but the first row are of serving cells."""

    count: int
    cell_ids: tuple = ("C", "gone", "A")

    @property
    def serving(self):
        return np.arange(self.count) > 0

    def some(self, which):
        rows = np.flatnonzero(which)
        return ServedRows(self.cell_ids, rows % 3, 1.0 * rows, 2.0 * rows, 3.0 * rows)


@dataclass(frozen=True)
class ServedRows:
    cell_ids: tuple
    cell: np.ndarray
    east_m: np.ndarray
    north_m: np.ndarray
    timing_advance: np.ndarray

    def __len__(self):
        return len(self.cell)


def lte(ci, technology="LTE", site="named"):
    return SimpleNamespace(mcc=262, mnc=1, ci=ci, technology=technology, site=site)


PLAN = {"A": lte(70_000), "C": lte(69_999)}


def surveyed(monkeypatch, deviations_db=(5.0,), count=22, **more):
    """The model over a survey, and what its statistics are made of."""
    asked = []

    def of_rows(*given):
        asked.append(given)
        return "statistics"

    monkeypatch.setattr(tested, "ServingStatistics", SimpleNamespace(of_rows=of_rows))
    area = SimpleNamespace(
        cell_ids=("A", "C"), on_way=ON_WAY, band_of={"A": 0, "C": 1}, lattice="lattice"
    )
    model = SimpleNamespace(
        whole=area, evidence=Evidence(), motion="motion", weights="weights", remember="remember",
        threads="threads",
    )  # fmt: skip
    measured = SimpleNamespace(
        readings=Readings(count), deviations=Deviations(np.array(deviations_db))
    )
    found = over_survey(Bound(model), SimpleNamespace(plan=PLAN), measured, **more)
    return found.model, asked


def test_what_is_usual_over_a_survey():
    assert SURVEYED == {
        "level_error_db": 5.0, "level_correlation_m": 100.0, "device_error_db": 2.0,
        "level_weight": 0.5, "switch_mass": 0.95, "switch_hold_m": 60.0, "claim_mass": 0.95,
    }  # fmt: skip
    assert SURVEYED_WAYS == {"map_sd_m": 16.0}


@pytest.mark.parametrize(
    ("deviations_db", "slow_db", "fast_db"),
    # White noise is of 3 dB. Of 5 dB 4 last, as 4 and 3 parts of 5; of 3 dB at least 1.
    [((5.0,), 3.2, 2.4), ((1.0, 5.0, 90.0), 3.2, 2.4), ((3.0,), 0.8, 0.6), ((), 4.0, 3.0)],
)
def test_errors_that_last_are_what_noise_leaves(monkeypatch, deviations_db, slow_db, fast_db):
    model, _ = surveyed(monkeypatch, deviations_db)
    levels = model.evidence.levels
    assert (levels.white_db, levels.slow_db, levels.fast_db) == pytest.approx(
        (3.0, slow_db, fast_db)
    )


def test_all_else_stays_as_it_was_bound(monkeypatch):
    model, _ = surveyed(monkeypatch)
    assert (model.area.lattice, model.motion, model.weights) == ("lattice", "motion", "weights")
    assert (model.remember, model.threads) == ("remember", "threads")
    assert model.evidence.spacing_m == 7.0
    assert model.evidence.serving.weight_per_m == 1 / 150
    # Where a cell was not measured a level errs by 8 dB.
    np.testing.assert_array_equal(model.level_sd_db, [[5, 8, 8, 2], [8, 8, 8, 3]])
    assert model.level_sd_db.dtype == np.float32


@pytest.mark.parametrize(("count", "told"), [(20, False), (21, True)])
def test_statistics_are_those_of_twenty_reports_or_more(monkeypatch, count, told):
    model, asked = surveyed(monkeypatch, count=count, serving_map="options")
    assert model.serving_model == ("statistics" if told else None)
    if not told:
        assert not asked
        return
    ((rows, lattice, sites, options),) = asked
    assert (lattice, options) == ("lattice", "options")
    # Rows 1 to 20 are of a cell without a map, of A and of C in turn.
    assert rows.cell.tolist() == [(-1, 0, 1)[k % 3] for k in range(20)]
    assert rows.east_m.tolist() == list(range(1, 21))
    assert rows.north_m.tolist() == list(range(2, 42, 2))
    assert rows.timing_advance.tolist() == list(range(3, 63, 3))
    # Both cells are of one site.
    assert sites.tolist() == [0, 0]


def test_the_usual_options_of_a_serving_map(monkeypatch):
    _, ((*_, options),) = surveyed(monkeypatch)
    assert options.site_part == 0.1


@pytest.mark.parametrize(
    ("cell", "site"),
    [
        (lte((1 << 16) - 1), "named"), (lte(1 << 16), "262-1-256"), (lte(66_000), "262-1-257"),
        (lte((1 << 28) - 1), "262-1-1048575"), (lte(1 << 28), "named"),
        (lte(66_000, None), "262-1-257"), (lte(66_000, "UMTS"), "named"), (lte(None), "named"),
    ],
)  # fmt: skip
def test_sites_of_lte_are_256_cells_each(cell, site):
    assert site_of(cell) == site


@dataclass(frozen=True)
class Field:
    cell_ids: tuple
    on_way: np.ndarray
    level_dbm: np.ndarray


def test_gaps_are_filled_with_the_mean_level_on_ways():
    """Of cells that were measured somewhere: not of the second one, nor of the fourth."""
    level_dbm = np.full((2, 2, 4), -90.0)
    level_dbm[0, 0], level_dbm[1, 0] = [-60.0, -70.0, -80.0, -50.0], [-64.0, nan, nan, nan]
    level_dbm[0, 1, 0], level_dbm[1, 1, 2] = nan, nan
    field = Field(("A", "B", "C", "D"), ON_WAY, level_dbm.copy())
    measured = SimpleNamespace(deviations=Deviations(np.zeros(3)))
    found = filled_field(field, measured)
    expected = level_dbm.copy()
    expected[0, 1, 0] = -62.0
    expected[1, 0, 2] = expected[1, 1, 2] = -80.0
    np.testing.assert_array_equal(found.level_dbm, expected)
    np.testing.assert_array_equal(field.level_dbm, level_dbm)
