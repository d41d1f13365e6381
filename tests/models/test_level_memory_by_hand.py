"""What is known of the errors of levels, by hand: whose slots are taken, and what is expected."""

from math import log

import numpy as np
import pytest

from mapfilter.models.level_errors import LevelErrors, LevelReport, roughness_px
from mapfilter.models.level_memory import SLOTS, LevelMemory

ERRORS = LevelErrors(
    slow_db=6.0, fast_db=3.0, device_db=4.0, site_share=0.5, common_share=0.25,
    fault_probability=0.2,
)  # fmt: skip


def bands(*numbers):
    return np.array(numbers, dtype=np.int32)


def reported(memory, *cells):
    """Return the memory after a report of cells that have slots."""
    level = np.full(len(cells), -80.0, dtype=np.float32)
    report = LevelReport(bands(*cells), level, bands(), np.zeros(0, dtype=np.float32), 0.0)
    return memory.updated(report)[0]


def full():
    """Return the memory of 28 cells of sites of their own, the first 24 of which have slots."""
    memory = LevelMemory.empty(ERRORS, np.arange(28))
    assert memory.slots == SLOTS == 24
    return memory.with_cells(bands(*range(24)), memory.start(1))


def test_cells_that_were_unused_for_longest_lose_their_slots():
    memory, kept = full()
    for cells in ((0, 1, 2), (0, 3), (1, 4)):
        memory = reported(memory, *cells)
    # Cells 0 and 3 are of report 1, 1 and 4 of report 2; 2 and all from 5 on of report 0.
    memory, kept = memory.with_cells(bands(24, 25), kept)
    assert memory.band.tolist() == [0, 1, 24, 3, 4, 25, *range(6, 24)]
    # Those that are asked for stay, and all that were just given.
    memory, kept = memory.with_cells(bands(26, 6, 24), kept)
    assert memory.band.tolist() == [0, 1, 24, 3, 4, 25, 6, 26, *range(8, 24)]
    for cells in (range(8, 16), range(16, 24), (6, 24, 25, 26)):
        memory = reported(memory, *cells)
    memory, _ = memory.with_cells(bands(27, 2), kept)
    assert memory.band.tolist() == [27, 1, 24, 2, 4, 25, 6, 26, *range(8, 24)]
    assert memory.slot_of == {int(band): slot for slot, band in enumerate(memory.band)}


def test_cells_that_have_slots_change_nothing():
    memory, kept = full()
    again, same = memory.with_cells(bands(3, 0), kept)
    assert again is memory
    assert same is kept
    assert memory.has_slots(bands(0, 23))
    assert not memory.has_slots(bands(0, 24))


def test_the_prior_of_two_cells_of_a_site_and_one_beside():
    """Correlated by 0.75 and 0.25; slow errors of 6 dB, fast ones of 3, the device's of 4."""
    memory = LevelMemory.empty(ERRORS, np.array([7, 7, 9]))
    memory, kept = memory.with_cells(bands(0, 1, 2), memory.start(2))
    correlation = np.array([[1, 0.75, 0.25], [0.75, 1, 0.25], [0.25, 0.25, 1]])
    expected = np.zeros((7, 7))
    expected[:3, :3], expected[3:6, 3:6], expected[6, 6] = 36 * correlation, 9 * correlation, 16
    np.testing.assert_allclose(memory.prior_db2, expected, rtol=1e-12)
    np.testing.assert_allclose(memory.covariance_db2, expected, rtol=1e-12)
    # No error is expected, odds of a fault of one to four, and even ones beyond the area.
    assert kept.shape == (11, 2)
    assert kept[:7].tolist() == [[0, 0]] * 7
    assert kept[7:].tolist() == pytest.approx(np.full((4, 2), log(0.25)), rel=1e-6)
    kept[8] = 1.5
    assert memory.fault_odds(1, kept).tolist() == [1.5, 1.5]
    assert memory.beyond_odds(kept).tolist() == pytest.approx([0.0, 0.0], abs=1e-6)
    memory.keep_beyond_odds(kept, np.array([1]), np.float32(0.5))
    assert memory.beyond_odds(kept).tolist() == pytest.approx([0.0, 0.5], abs=1e-6)


def test_a_new_cell_s_error_is_expected_from_the_others():
    """By their correlation: 0.75 of the error of a cell of its site."""
    memory = LevelMemory.empty(ERRORS, np.array([7, 7]))
    memory, kept = memory.with_cells(bands(0), memory.start(1))
    kept[0], kept[2] = 8.0, -4.0
    memory, now = memory.with_cells(bands(1), kept)
    assert now[:4, 0].tolist() == pytest.approx([8, 6, -4, -3])
    assert kept[:4, 0].tolist() == [8, 0, -4, 0]
    expected = 36 * np.array([[1, 0.75], [0.75, 1]])
    np.testing.assert_allclose(memory.covariance_db2[:2, :2], expected, rtol=1e-12)
    assert memory.with_cells(bands(0), kept)[1] is kept


def test_a_new_cell_in_place():
    memory = LevelMemory.empty(ERRORS, np.array([7, 9]))
    memory, kept = memory.with_cells(bands(0), memory.start(1))
    kept[0] = 8.0
    _, now = memory.with_cells(bands(1), kept, in_place=True)
    assert now is kept
    assert kept[:2, 0].tolist() == pytest.approx([8, 2])


@pytest.mark.parametrize(
    ("resolution_m", "side"), [(5.0, 9), (10.0, 5), (35.0, 3), (12.0, 3), (11.0, 5), (100.0, 3)]
)
def test_squares_of_roughness(resolution_m, side):
    """35 m are 7 pixels of 5 m: half of that, rounded, to each side of one; one at least."""
    assert roughness_px(resolution_m) == side
