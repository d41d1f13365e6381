"""Handovers by hand-made examples."""

import numpy as np
import pytest

from mapfilter.simulation.worlds.handover import (
    HandoverModel,
    filtered_db,
    load_offsets_db,
    serving_cells,
)

STEADY = HandoverModel(hysteresis_db=3.0, time_to_trigger_s=0.4, load_sd_db=0.0, ping_pong=0.0)


def served(level, model=STEADY, offset_db=None, seed=0):
    level = np.asarray(level, dtype=float)
    offsets = np.zeros(level.shape[1]) if offset_db is None else np.array(offset_db)
    rng = np.random.default_rng(seed)
    return serving_cells(level, np.isfinite(level), offsets, model, rng).tolist()


def test_within_the_hysteresis_nothing_is_handed_over():
    assert served([[-70, -80], *[[-80, -77.0]] * 50]) == [0] * 51


def test_beyond_the_hysteresis_after_the_time_to_trigger():
    """The event holds from tick 1 on; 0.4 s later is tick 3."""
    assert served([[-70, -80], *[[-80, -76.9]] * 5]) == [0, 0, 0, 1, 1, 1]


def test_a_break_starts_the_time_to_trigger_again():
    level = [[-70, -80], [-80, -76], [-80, -76], [-80, -78], *[[-80, -76]] * 3]
    assert served(level) == [0, 0, 0, 0, 0, 0, 1]


def test_without_a_time_to_trigger_at_once():
    model = HandoverModel(hysteresis_db=3.0, time_to_trigger_s=0.0, ping_pong=0.0)
    assert served([[-70, -80], [-80, -76]], model) == [0, 1]


def test_the_strongest_of_those_due_takes_over():
    assert served([[-70, -80, -80], *[[-80, -75, -74]] * 3])[-1] == 2


def test_load_offsets_hold_back_and_attract():
    """4 dB against the neighbour keep the phone; 4 dB for it hand it over sooner."""
    level = [[-70, -80], *[[-80, -75]] * 5]
    assert served(level, offset_db=[0.0, -4.0]) == [0] * 6
    assert served([[-70, -80], *[[-80, -79]] * 5], offset_db=[0.0, 4.0])[-1] == 1


def test_a_lost_cell_is_replaced_at_once_by_the_strongest():
    lost = -np.inf
    assert served([[-70, -80, -75], [lost, -80, -75], [lost] * 3, [-90, lost, lost]]) == [
        0,
        2,
        -1,
        0,
    ]


def test_ping_pong_comes_back_within_four_seconds():
    model = HandoverModel(hysteresis_db=3.0, time_to_trigger_s=0.0, ping_pong=1.0)
    level = [[-70, -80], *[[-80, -70]] * 40]
    back = []
    for seed in range(200):
        found = np.array(served(level, model, seed=seed))
        assert found[1] == 1
        back.append(0.2 * (int(np.argmax(found[1:] == 0))))
    assert 1.0 <= min(back) < 1.5
    assert 3.5 < max(back) <= 4.0


def test_the_share_of_ping_pongs():
    """Many handovers, one after another; interval of four standard errors."""
    model = HandoverModel(hysteresis_db=3.0, time_to_trigger_s=0.0, ping_pong=0.3)
    number = 400
    period = 50
    level = np.tile([[-80.0, -70.0]], (number * period, 1))
    for i in range(1, number, 2):
        level[i * period : (i + 1) * period] = [-70.0, -80.0]
    found = np.array(served(level, model)).reshape(number, period)
    # A handover at the start of a stretch; a return makes the stretch mixed after the first second.
    mixed = (found[1:, 2:] != found[1:, 1:2]).any(axis=1).mean()
    assert abs(mixed - 0.3) < 4 * np.sqrt(0.21 / number)


def test_layer_three_is_an_exponential_filter():
    level = np.array([[-60.0], [-80.0], [-90.0]])
    kept = 1 - 0.5**2.0
    second = kept * -60 + (1 - kept) * -80
    expected = [-60.0, second, kept * second + (1 - kept) * -90]
    assert filtered_db(level, 8.0).ravel().tolist() == pytest.approx(expected)


def test_a_filter_starts_anew_after_a_gap():
    level = np.array([[-60.0], [-np.inf], [-90.0]])
    assert filtered_db(level, 4.0).ravel().tolist() == [-60.0, -np.inf, -90.0]


def test_load_offsets_have_their_step_limit_and_deviation():
    model = HandoverModel(load_sd_db=1.5)
    drawn = load_offsets_db(20_000, model, np.random.default_rng(1))
    assert set(np.round(drawn * 2) - drawn * 2) == {0.0}
    assert np.abs(drawn).max() <= 6.0
    # Rounding to 0.5 dB adds a variance of 0.5² / 12.
    assert drawn.std() == pytest.approx(np.sqrt(1.5**2 + 0.25 / 12), rel=4 / np.sqrt(40_000))
