"""Plans laid out by rule."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from mapfilter.errors import ConfigError, InputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell
from mapfilter.simulation.layout import lay_out_plan

LATTICE = Lattice("EPSG:32629", 531000.0, 4556000.0, 5.0, 600, 600)


def _town() -> NDArray[np.float32]:
    heights = np.zeros((600, 600), dtype=np.float32)
    for row in range(10, 580, 30):
        for col in range(10, 580, 30):
            heights[row : row + 20, col : col + 20] = 12.0
    heights[100:160, 100:160] = 20.0
    heights[400:440, 420:470] = 45.0
    return heights


def _apart_m(cells: list[Cell]) -> float:
    return min(
        float(np.hypot(a.east_m - b.east_m, a.north_m - b.north_m))
        for a, b in combinations(cells, 2)
    )


def test_ids_sectors_and_carriers() -> None:
    plan = lay_out_plan(LATTICE, 2, 3, 4, 1)
    assert plan.ids == ("S1A", "S1B", "S1C", "S2A", "S2B", "S2C", "I1", "I2", "I3", "I4")
    assert [plan[f"S1{s}"].azimuth_deg for s in "ABC"] == [0.0, 120.0, 240.0]
    assert {cell.site for cell in plan.cells} == {"S1", "S2", "I1", "I2", "I3", "I4"}
    assert len(plan.ids_by_carrier) == 10
    assert all(cell.indoor == cell.id.startswith("I") for cell in plan.cells)
    assert plan["S1A"].north_m >= plan["S2A"].north_m


def test_one_site_stands_in_the_middle() -> None:
    cell = lay_out_plan(LATTICE, 1, 1, 0, 7).cells[0]
    assert cell.antenna == "omni"
    assert cell.azimuth_deg is None
    assert abs(cell.east_m - 532500.0) < 5
    assert abs(cell.north_m - 4554500.0) < 5


@pytest.mark.parametrize("sites", [4, 9, 30])
def test_sites_are_spread(sites: int) -> None:
    plan = lay_out_plan(LATTICE, sites, 1, 0, 3)
    # A hexagonal packing of n points keeps them √(2 A / (√3 n)) apart; evenly is 60 % of that.
    closest_m = np.sqrt(2 * 3000.0**2 / (np.sqrt(3) * sites))
    assert _apart_m(list(plan.cells)) > 0.6 * closest_m


def test_many_cells_use_carriers_again() -> None:
    plan = lay_out_plan(LATTICE, 20, 3, 0, 1)
    assert len(plan.ids_by_carrier) == 60
    assert len({cell.arfcn for cell in plan.cells}) == 36


def test_antennas_stand_on_roofs_and_indoor_cells_hang_in_buildings() -> None:
    heights = _town()
    plan = lay_out_plan(LATTICE, 3, 3, 4, 1, heights)
    for cell in plan.cells:
        roof_m = heights[LATTICE.row_col(cell.east_m, cell.north_m)]
        assert roof_m > 0
        if not cell.indoor:
            assert cell.height_m >= roof_m + 3.0
    row, col = LATTICE.row_col(plan["I1"].east_m, plan["I1"].north_m)
    assert 100 <= row < 160
    assert 100 <= col < 160
    assert _apart_m([cell for cell in plan.cells if cell.indoor]) > 500.0


def test_the_highest_roof_nearby_is_taken_but_no_tower() -> None:
    heights = np.zeros((600, 600), dtype=np.float32)
    heights[295:298, 305:308] = 40.0
    heights[300:303, 295:298] = 75.0
    cell = lay_out_plan(LATTICE, 1, 3, 0, 1, heights).cells[0]
    assert heights[LATTICE.row_col(cell.east_m, cell.north_m)] == 40.0
    assert cell.height_m == 43.0


def test_too_few_buildings_leave_open_places() -> None:
    heights = np.zeros((600, 600), dtype=np.float32)
    heights[10:20, 10:20] = 9.0
    plan = lay_out_plan(LATTICE, 1, 3, 3, 1, heights)
    assert sum(cell.indoor for cell in plan.cells) == 3
    assert _apart_m([plan["S1A"], plan["I1"], plan["I2"], plan["I3"]]) > 500.0


def test_seeds_decide() -> None:
    assert lay_out_plan(LATTICE, 5, 3, 2, 1) == lay_out_plan(LATTICE, 5, 3, 2, 1)
    assert lay_out_plan(LATTICE, 5, 3, 2, 1) != lay_out_plan(LATTICE, 5, 3, 2, 2)


@given(
    st.integers(1, 40),
    st.integers(1, 40),
    st.integers(0, 5),
    st.integers(1, 6),
    st.integers(1, 4),
    st.integers(0, 99),
)
@settings(max_examples=40)
def test_every_area_can_be_laid_out(
    rows: int, cols: int, sites: int, sectors: int, indoor: int, seed: int
) -> None:
    lattice = Lattice("EPSG:32629", 531000.0, 4556000.0, 5.0, rows, cols)
    plan = lay_out_plan(lattice, sites, sectors, indoor, seed)
    assert len(plan) == sites * sectors + indoor
    for cell in plan.cells:
        assert lattice.contains(*lattice.row_col(cell.east_m, cell.north_m))


def test_wrong_numbers_are_told_together() -> None:
    with pytest.raises(ConfigError) as caught:
        lay_out_plan(LATTICE, 0, 7, 0, -1)
    for part in ("at least one cell", "sectors", "seed"):
        assert part in str(caught.value)
    with pytest.raises(InputError, match="eirp_dbm"):
        lay_out_plan(LATTICE, 1, 1, 0, 1, eirp_dbm=100.0)
    with pytest.raises(InputError, match="600 x 600"):
        lay_out_plan(LATTICE, 1, 1, 0, 1, np.zeros((2, 2), dtype=np.float32))
