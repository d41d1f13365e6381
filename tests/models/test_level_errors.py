"""Errors of levels that last along the path, against Gaussians that are written out whole."""

from dataclasses import replace
from math import exp, log, sqrt

import numpy as np
import pytest
import scalar_oracle as oracle
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm, truncnorm
from weighed_reports import weigh_by_absence, weigh_by_levels

from mapfilter.errors import ConfigError
from mapfilter.models.ageing import Ageing, age, as_it_is
from mapfilter.models.fingerprint import bound_table
from mapfilter.models.level_errors import LevelErrors, LevelReport, roughness
from mapfilter.models.level_kernels import Prediction
from mapfilter.models.level_memory import SLOTS, LevelMemory
from mapfilter.models.record_tiles import kept_in, new_records, records_of

SITE = np.array([0, 0, 1, 1, 1, 2])
PIXELS = 30
# Faults are next to impossible, and what a report says of them is forgotten at once.
SOUND = LevelErrors(
    slow_db=6.0, slow_m=150.0, fast_db=3.5, fast_m=15.0, white_db=2.5, device_db=4.0,
    site_share=0.5, common_share=0.25, roughness=0.0, fault_probability=1e-300, fault_m=1e-3,
    weight=1.0,
)  # fmt: skip


def raster(bands, seed=1):
    """Predicted levels in quarters of a dB, (pixels, bands)."""
    level = np.random.default_rng(seed).uniform(-105.0, -65.0, (PIXELS, bands))
    return (np.round(4 * level) / 4).astype(np.float32)


def report(levels, absent=(), limit_dbm=-120.0, offset_db=0.0):
    cell, level = np.array(list(levels)), np.array(list(levels.values()))
    given = cell.astype(np.int32), level.astype(np.float32), np.array(absent, dtype=np.int32)
    return LevelReport(*given, np.full(len(absent), limit_dbm, dtype=np.float32), offset_db)


def weighed(memory, kept, pixel, table, given, rough_db=None):
    """Weigh hypotheses by one report, as the filter's model does; cells must fit into the slots."""
    errors, log_weight = memory.errors, np.zeros(pixel.size)
    memory, kept = memory.with_cells(np.concatenate([given.cell, given.absent]), kept)
    records = records_of(kept).copy()
    memory, terms = memory.updated(given)
    rough = np.zeros(table.size, np.uint8) if rough_db is None else rough_db.ravel()
    pixel, flat, bands = pixel.astype(np.int32), table.ravel(), table.shape[1]
    predicted = Prediction(flat, rough, bands, errors.roughness)
    as_now = as_it_is(records)
    weigh_by_levels(0, pixel.size, as_now, pixel, predicted, terms, errors.weight, log_weight)
    if given.absent.size:
        absent = memory.absence(given)
        table, weight = bound_table(), errors.weight
        given = pixel, predicted, absent, table, weight, log_weight
        weigh_by_absence(0, pixel.size, records, *given)
    return memory, kept_in(records, memory.width), log_weight


def moved(memory, kept, length_m):
    errors = memory.errors
    memory, decay = memory.after(length_m)
    keep = exp(-length_m / errors.fault_m)
    before, now = records_of(kept), new_records(kept.shape[1], memory.width)
    each_its_own = np.empty(0, dtype=np.int32)
    ageing = Ageing(before, each_its_own, decay, keep, errors.fault_log_odds, True, now)
    age(0, kept.shape[1], ageing)
    return memory, kept_in(now, memory.width)


class Walk:
    """Some hypotheses, each with a path of its own over the pixels, and all that was reported."""

    def __init__(self, errors, site, count=8, seed=0):
        self.errors, self.site, self.table = errors, site, raster(len(site))
        self.rng = np.random.default_rng(seed)
        self.memory = LevelMemory.empty(errors, np.asarray(site))
        self.kept, self.at_m = self.memory.start(count), 0.0
        self.log_weight, self.levels = np.zeros(count), [[] for _ in range(count)]
        self.pixel = self.rng.integers(PIXELS, size=count)

    def go(self, length_m):
        self.memory, self.kept = moved(self.memory, self.kept, length_m)
        self.at_m += length_m
        self.pixel = self.rng.integers(PIXELS, size=self.pixel.size)

    def hear(self, bands, offset_db=0.0):
        # Levels near the predictions of one pixel, so that all paths err by many dB.
        wanted = self.table[self.rng.integers(PIXELS), bands] + self.rng.normal(0, 4, len(bands))
        given = report(dict(zip(bands, wanted.tolist(), strict=True)), offset_db=offset_db)
        found = weighed(self.memory, self.kept, self.pixel, self.table, given)
        self.memory, self.kept, gained = found
        self.log_weight += gained
        white = self.errors.white_db**2 + offset_db**2
        for levels, pixel in zip(self.levels, self.pixel, strict=True):
            for band, level in zip(given.cell.tolist(), given.level_dbm.tolist(), strict=True):
                levels.append((band, self.at_m, level - float(self.table[pixel, band]), white))
        return gained

    def expected(self):
        found = [oracle.levels_log_density(self.errors, self.site, one) for one in self.levels]
        return np.array(found)

    def forecasts(self, band):
        """Mean of each hypothesis's next level's error, and their common variance."""
        found = [
            oracle.level_forecast(self.errors, self.site, one, band, self.at_m)
            for one in self.levels
        ]
        mean, variance = np.array(found).T
        return mean, variance[0]

    def held(self, band):
        """The same by the memory."""
        slot, slots = self.memory.slot_of[band], self.memory.slots
        of = [slot, slots + slot, 2 * slots]
        mean = self.kept[of].astype(np.float64).sum(axis=0)
        return mean, self.memory.covariance_db2[np.ix_(of, of)].sum()


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"site_share": 0.0, "common_share": 0.0},
        {"site_share": 0.0, "common_share": 0.9},
        {"device_db": 0.0, "fast_db": 0.0},
        {"slow_db": 0.0, "slow_m": 40.0, "fast_m": 90.0},
    ],
)
def test_innovations_add_up_to_one_gaussian_of_all_levels_of_a_path(changes):
    walk = Walk(replace(SOUND, **changes), SITE)
    for length_m in (0.0, 5.0, 5.0, 12.0, 0.2, 40.0, 5.0, 7.5, 200.0, 5.0, 900.0, 3.0):
        walk.go(length_m)
        count = walk.rng.integers(1, 7)
        walk.hear(walk.rng.permutation(6)[:count].tolist(), offset_db=walk.rng.uniform(0, 4))
        np.testing.assert_allclose(walk.log_weight, walk.expected(), rtol=2e-4, atol=5e-3)
    assert np.ptp(walk.log_weight) > 10
    for band in range(6):
        mean, variance = walk.held(band)
        expected, spread = walk.forecasts(band)
        np.testing.assert_allclose(mean, expected, atol=5e-3)
        assert variance == pytest.approx(spread, rel=1e-9)


def test_levels_of_a_report_count_alike_in_any_order():
    table, pixel = raster(6), np.arange(PIXELS)
    levels = {0: -80.0, 2: -75.5, 3: -91.0, 5: -70.25}
    found = []
    for order in ([0, 2, 3, 5], [5, 3, 0, 2]):
        memory = LevelMemory.empty(SOUND, SITE)
        given = report({band: levels[band] for band in order})
        found.append(weighed(memory, memory.start(PIXELS), pixel, table, given)[2])
    np.testing.assert_allclose(*found, rtol=1e-5, atol=1e-4)


def test_with_more_cells_than_slots_independent_ones_stay_exact():
    """Cells that share only the device: what is forgotten of one says nothing of the others."""
    errors = replace(SOUND, site_share=0.0, common_share=0.0, device_db=0.0)
    walk = Walk(errors, list(range(40)), count=5)
    assert walk.memory.slots == SLOTS == 24
    for first in range(0, 34, 2):
        walk.go(6.0)
        walk.hear(list(range(first, first + 6)))
        np.testing.assert_allclose(walk.log_weight, walk.expected(), rtol=2e-4, atol=5e-3)
    # The last 24 that were heard are those that are held.
    assert set(walk.memory.slot_of) == set(range(14, 38))


def test_the_device_is_remembered_by_all_cells_that_were_forgotten():
    errors = replace(SOUND, site_share=0.0, common_share=0.0)
    walk = Walk(errors, list(range(40)), count=5)
    for first in range(0, 34, 2):
        walk.go(6.0)
        walk.hear(list(range(first, first + 6)))
    np.testing.assert_allclose(walk.log_weight, walk.expected(), rtol=2e-4, atol=5e-3)


def joint_prior(errors, site, bands):
    """Covariance of slow errors, fast errors, and the device's, without a path."""
    alike = [
        [1.0 if a == b else errors.common_share + errors.site_share * (site[a] == site[b])
         for b in bands] for a in bands
    ]  # fmt: skip
    size = len(bands)
    found = np.zeros((2 * size + 1, 2 * size + 1))
    found[:size, :size] = errors.slow_db**2 * np.array(alike)
    found[size:-1, size:-1] = errors.fast_db**2 * np.array(alike)
    found[-1, -1] = errors.device_db**2
    return found


def test_new_cells_in_the_slots_of_others_follow_from_those_that_stay():
    """By information: the prior of all, and what was learnt of those that stay."""
    site = (np.arange(40) // 3).tolist()
    walk = Walk(SOUND, site, count=6)
    for first in (0, 6, 12, 18):
        walk.go(15.0)
        walk.hear(list(range(first, first + 6)))
    memory, kept = walk.memory, walk.kept
    assert set(memory.slot_of) == set(range(24))
    # A site of three: two of them are held; another site that is all new; one that is asked again.
    wanted = np.array([24, 25, 23, 30], dtype=np.int32)
    after, now = memory.with_cells(wanted, kept)
    gone = set(memory.slot_of) - set(after.slot_of)
    assert gone == {0, 1, 2}
    assert set(after.slot_of) - set(memory.slot_of) == {24, 25, 30}
    stay, new = [b for b in range(24) if b not in gone], [24, 25, 30]

    def rows(of, bands):
        slots = [of.slot_of[band] for band in bands]
        return [*slots, *(of.slots + s for s in slots), 2 * of.slots]

    known = memory.covariance_db2[np.ix_(rows(memory, stay), rows(memory, stay))]
    mean = kept[rows(memory, stay)].astype(np.float64).T
    prior = joint_prior(SOUND, site, stay)
    both = joint_prior(SOUND, site, stay + new)
    size, old = len(stay + new), len(stay)
    inner = [*range(old), *range(size, size + old), 2 * size]
    precision, shift = np.linalg.inv(both), np.zeros((len(mean), 2 * size + 1))
    precision[np.ix_(inner, inner)] += np.linalg.inv(known) - np.linalg.inv(prior)
    shift[:, inner] = np.linalg.solve(known, mean.T).T
    covariance = np.linalg.inv(precision)
    found = after.covariance_db2[np.ix_(rows(after, stay + new), rows(after, stay + new))]
    np.testing.assert_allclose(found, covariance, rtol=1e-6, atol=1e-8)
    held = now[rows(after, stay + new)].T
    np.testing.assert_allclose(held, shift @ covariance, rtol=1e-4, atol=1e-4)
    # Nothing is known of a fault of the new ones; what is known of the others stays.
    odds = slice(2 * after.slots + 1, None)
    slots = [after.slot_of[band] for band in new]
    np.testing.assert_allclose(now[odds][slots], SOUND.fault_log_odds, rtol=1e-6)
    others = [memory.slot_of[band] for band in stay]
    np.testing.assert_array_equal(now[odds][others], kept[odds][others])
    assert memory.with_cells(np.array([3, 5], np.int32), kept) == (memory, kept)


def test_the_memory_before_the_first_report():
    few, many = LevelMemory.empty(SOUND, SITE), LevelMemory.empty(SOUND, np.arange(50))
    assert (few.slots, few.width, many.slots, many.width) == (6, 20, 24, 74)
    assert few.slot_of == {}
    kept = few.start(3)
    assert (kept.shape, kept.dtype) == ((20, 3), np.float32)
    np.testing.assert_array_equal(kept[:13], 0.0)
    np.testing.assert_allclose(kept[13:], log(1e-300), rtol=1e-6)
    np.testing.assert_array_equal(few.beyond_odds(kept), 0.0)
    assert LevelErrors(fault_probability=0.2).fault_log_odds == pytest.approx(log(0.25))
    total = LevelErrors(slow_db=3.0, fast_db=4.0, white_db=12.0).total_db
    assert total == pytest.approx(13.0)


def test_shares_of_errors_leave_one_of_the_cells_own():
    assert LevelErrors(site_share=0.7, common_share=0.29).site_share == 0.7
    for shares in ((0.6, 0.4), (1.0, 0.0), (0.0, 1.0), (0.9, 0.8)):
        with pytest.raises(ConfigError, match=r"expected site_share \+ common_share < 1, found"):
            LevelErrors(site_share=shares[0], common_share=shares[1])


@given(st.lists(st.tuples(st.floats(0, 300), st.sets(st.integers(0, 5), min_size=1)), max_size=8),
       st.floats(0, 200), st.floats(0, 200))  # fmt: skip
def test_the_covariance_forgets_by_the_metre_and_stays_one(ways, one_m, more_m):
    memory = LevelMemory.empty(SOUND, SITE)
    for length_m, bands in ways:
        memory, kept = memory.after(length_m)[0], memory.start(1)
        memory, _ = memory.with_cells(np.array(sorted(bands), np.int32), kept)
        memory, _ = memory.updated(report(dict.fromkeys(sorted(bands), -80.0)))
    covariance = memory.covariance_db2
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-9)
    assert np.linalg.eigvalsh(covariance).min() > -1e-9
    # Nothing that was learnt makes an error larger than it was before.
    held = [memory.slot_of[b] for b in memory.slot_of]
    most = joint_prior(SOUND, SITE, list(memory.slot_of))
    rows = [*held, *(memory.slots + s for s in held), 2 * memory.slots]
    assert np.linalg.eigvalsh(most - covariance[np.ix_(rows, rows)]).min() > -1e-9
    whole = memory.after(one_m + more_m)[0]
    parts = memory.after(one_m)[0].after(more_m)[0]
    for name in ("covariance_db2", "other_dbm", "other_db2"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=1e-9, atol=1e-9)
    far = memory.after(1e6)[0].covariance_db2[np.ix_(rows, rows)]
    np.testing.assert_allclose(far[:-1, :-1], most[:-1, :-1], atol=1e-9)
    # The device stays the same.
    assert far[-1, -1] == covariance[-1, -1]
    np.testing.assert_allclose(far[-1, :-1], 0.0, atol=1e-9)


# Faults

FAULTY = replace(SOUND, fault_probability=0.1, fault_m=300.0)


def test_levels_of_a_faulty_cell_are_a_process_of_their_own():
    memory, levels, total = LevelMemory.empty(FAULTY, SITE), [], 0.0
    at_m = 0.0
    for length_m, level in ((0, -70.0), (5, -72.5), (60, -99.0), (5, -101.0), (400, -84.0)):
        memory, _ = memory.after(length_m)
        memory, _ = memory.with_cells(np.array([2, 4], np.int32), memory.start(1))
        memory, terms = memory.updated(report({4: -77.0, 2: level}))
        at_m += length_m
        levels.append((at_m, level))
        total += float(terms.other[1])
        assert total == pytest.approx(oracle.other_log_density(levels, FAULTY), rel=1e-6)


def test_levels_of_a_faulty_cell_are_as_noisy_as_others_there():
    memory = LevelMemory.empty(FAULTY, SITE)
    memory, _ = memory.with_cells(np.array([2, 4], np.int32), memory.start(1))
    given = report({4: -77.0, 2: -70.0}, offset_db=2.0)
    rough_db2 = np.array([30.0, 7.0])
    _, terms = memory.updated(given, rough_db2)
    for found, level, more in zip(terms.other, (-77.0, -70.0), rough_db2, strict=True):
        expected = oracle.other_log_density([(0.0, level)], FAULTY, 4.0 + more)
        assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("probability", [0.01, 0.1, 0.6])
def test_one_level_is_the_mixture_over_a_fault(probability):
    errors = replace(FAULTY, fault_probability=probability)
    table, pixel, level = raster(6), np.arange(PIXELS), -74.0
    memory = LevelMemory.empty(errors, SITE)
    after, kept, found = weighed(memory, memory.start(PIXELS), pixel, table, report({3: level}))
    total_db2 = errors.slow_db**2 + errors.fast_db**2 + errors.device_db**2 + errors.white_db**2
    slot = after.slot_of[3]
    for i in range(PIXELS):
        off = level - float(table[i, 3])
        right = (1 - probability) * norm.pdf(off, 0, sqrt(total_db2))
        wrong = (
            probability * exp(oracle.other_log_density([(0.0, level)], errors)) / sqrt(2 * np.pi)
        )
        assert found[i] == pytest.approx(log(right + wrong) + 0.5 * log(2 * np.pi), abs=2e-4)
        odds = float(np.clip(log(wrong / right), -8, 8))
        assert kept[13 + slot, i] == pytest.approx(odds, abs=2e-3)
        # Where the level is not the cell's, it says nothing of the errors.
        sure = right / (right + wrong)
        for row, variance in (
            (slot, errors.slow_db**2),
            (6 + slot, errors.fast_db**2),
            (12, errors.device_db**2),
        ):
            expected = sure * variance / total_db2 * off
            assert kept[row, i] == pytest.approx(expected, rel=2e-3, abs=2e-3)
    before = log(probability / (1 - probability))
    assert kept[13 + slot].min() < before - 0.5 < before + 3 < kept[13 + slot].max()


def test_a_fault_is_forgotten_over_the_metres_that_it_lasts():
    memory = LevelMemory.empty(FAULTY, SITE)
    kept = memory.start(4)
    usual = log(0.1 / 0.9)
    kept[13:] = np.array([-8.0, -3.0, 0.5, 8.0], dtype=np.float32)
    kept[:13] = np.arange(13.0)[:, None]
    memory.keep_beyond_odds(kept, slice(None), np.array([-8.0, 0.0, 0.5, 8.0], np.float32))
    memory, now = moved(memory, kept, 120.0)
    share = exp(-120 / 300)
    expected = usual + share * (np.array([-8.0, -3.0, 0.5, 8.0]) - usual)
    np.testing.assert_allclose(now[13:-1], np.tile(expected, (6, 1)), rtol=1e-5)
    odds = share * np.array([-8.0, 0.0, 0.5, 8.0])
    np.testing.assert_allclose(memory.beyond_odds(now), odds, rtol=1e-5, atol=1e-6)
    decay = [exp(-120 / 150)] * 6 + [exp(-120 / 15)] * 6 + [1.0]
    np.testing.assert_allclose(now[:13].T, np.tile(np.arange(13) * decay, (4, 1)), rtol=1e-5)
    # Hypotheses keep their own copies.
    assert kept[12, 0] == 12.0


def test_the_odds_of_a_fault_are_bounded_so_that_it_may_end():
    errors = replace(FAULTY, fault_m=1e9)
    table = np.full((2, 6), -80.0, dtype=np.float32)
    table[1] = -20.0
    memory, pixel = LevelMemory.empty(errors, SITE), np.arange(2)
    kept, totals = memory.start(2), []
    for _ in range(12):
        memory, kept = moved(memory, kept, 50.0)
        memory, kept, gained = weighed(memory, kept, pixel, table, report({1: -80.0}))
        totals.append(gained)
    slot = 13 + memory.slot_of[1]
    assert kept[slot, 0] < -3
    assert kept[slot, 1] == 8.0
    # Where it is certainly faulty, the level has the likelihood of the other process.
    one = LevelMemory.empty(errors, SITE)
    for _ in range(12):
        one, _ = one.after(50.0)
        one, _ = one.with_cells(np.array([1], np.int32), one.start(1))
        one, terms = one.updated(report({1: -80.0}))
    assert totals[-1][1] == pytest.approx(float(terms.other[0]), abs=1e-3)


@pytest.mark.parametrize("off_db", [0.0, 30.0, 60.0, 150.0])
def test_however_far_a_level_is_off_it_costs_no_more_than_that_of_a_faulty_cell(off_db):
    table = np.full((1, 6), -90.0 + off_db, dtype=np.float32)
    memory = LevelMemory.empty(FAULTY, SITE)
    found = weighed(memory, memory.start(1), np.zeros(1, int), table, report({2: -90.0}))[2]
    lasting = FAULTY.slow_db**2 + FAULTY.fast_db**2 + FAULTY.device_db**2
    right = norm.logpdf(off_db, 0, sqrt(lasting + FAULTY.white_db**2))
    right += 0.5 * log(2 * np.pi)
    wrong = oracle.other_log_density([(0.0, -90.0)], FAULTY)
    expected = np.logaddexp(log(0.9) + right, log(0.1) + wrong)
    assert found[0] == pytest.approx(expected, abs=2e-4)


def test_a_cell_that_is_off_by_itself_stops_counting_while_others_go_on():
    """One that errs by 40 dB: named as faulty, and what the others tell stays as it was."""
    table = np.full((1, 6), -80.0, dtype=np.float32)
    levels = {0: -79.0, 2: -81.0, 3: -120.0, 5: -80.0}
    pixel, found = np.zeros(1, int), {}
    for probability in (0.03, 1e-300):
        errors = replace(SOUND, fault_probability=probability, fault_m=300.0)
        memory = LevelMemory.empty(errors, SITE)
        kept, total = memory.start(1), 0.0
        for _ in range(8):
            memory, kept = moved(memory, kept, 20.0)
            memory, kept, gained = weighed(memory, kept, pixel, table, report(levels))
            total += float(gained[0])
        error_db = {
            band: float(kept[[slot, 6 + slot, 12], 0].sum())
            for band, slot in memory.slot_of.items()
        }
        odds = {band: float(kept[13 + slot, 0]) for band, slot in memory.slot_of.items()}
        found[probability] = total, error_db, odds
    (total, error_db, odds), (without, _, _) = found.values()
    assert odds[3] > 3
    assert max(odds[band] for band in (0, 2, 5)) < -2
    assert total > without + 20
    # Those of its site, too, are judged by their own levels.
    for band in (0, 2, 5):
        assert abs(error_db[band] - (levels[band] + 80.0)) < 1.0


# Roughness, weight, and cells that are absent


def test_roughness_widens_a_level_at_its_pixel():
    errors = replace(SOUND, roughness=0.7)
    table, pixel = raster(6), np.arange(PIXELS)
    rough_db = np.random.default_rng(3).integers(0, 120, table.shape).astype(np.uint8)
    memory = LevelMemory.empty(errors, SITE)
    after, kept, found = weighed(
        memory, memory.start(PIXELS), pixel, table, report({3: -74.0}), rough_db
    )
    lasting = errors.slow_db**2 + errors.fast_db**2 + errors.device_db**2
    variance = lasting + errors.white_db**2 + 0.7 * (0.1 * rough_db[:, 3].astype(float)) ** 2
    off = -74.0 - table[:, 3].astype(float)
    expected = norm.logpdf(off, 0, np.sqrt(variance)) + 0.5 * log(2 * np.pi)
    np.testing.assert_allclose(found, expected, atol=2e-4)
    held = kept[[after.slot_of[3], 6 + after.slot_of[3], 12]].sum(axis=0)
    np.testing.assert_allclose(held, lasting / variance * off, rtol=1e-3, atol=1e-3)


def test_a_weight_is_an_exponent_and_changes_nothing_that_is_kept():
    table, pixel = raster(6), np.arange(PIXELS)
    given = report({0: -80.0, 3: -74.0}, absent=[5], limit_dbm=-90.0)
    found = []
    for weight in (1.0, 0.35):
        memory = LevelMemory.empty(replace(FAULTY, weight=weight), SITE)
        found.append(weighed(memory, memory.start(PIXELS), pixel, table, given))
    np.testing.assert_allclose(found[1][2], 0.35 * found[0][2], rtol=1e-6)
    np.testing.assert_array_equal(found[1][1], found[0][1])
    np.testing.assert_array_equal(found[1][0].covariance_db2, found[0][0].covariance_db2)


def test_an_absent_cell_is_below_the_limit_and_its_errors_are_those_of_a_truncated_normal():
    # In all 8 dB of deviation, so that whole dB lie on the steps of the table.
    errors = replace(SOUND, slow_db=4.0, fast_db=3.0, device_db=2.0, white_db=3.0, absent_db=1.0)
    offset_db = sqrt(64 - 16 - 9 - 4 - 9 - 1)
    table, pixel, limit_dbm = np.round(raster(6)), np.arange(PIXELS), -88.0
    given = report({}, absent=[2], limit_dbm=limit_dbm, offset_db=offset_db)
    memory = LevelMemory.empty(errors, SITE)
    after, kept, found = weighed(memory, memory.start(PIXELS), pixel, table, given)
    edge = (limit_dbm - table[:, 2].astype(float)) / 8.0
    np.testing.assert_allclose(found, norm.logcdf(edge), rtol=1e-5, atol=1e-6)
    mean_db = truncnorm.mean(-np.inf, edge, scale=8.0)
    slot = after.slot_of[2]
    for row, variance in ((slot, 16.0), (6 + slot, 9.0), (12, 4.0)):
        expected = variance / 64.0 * mean_db
        np.testing.assert_allclose(kept[row], expected, rtol=1e-3, atol=2e-4)
    # Nothing is learnt of the covariance.
    held = after.covariance_db2
    assert (held[slot, slot], held[-1, -1]) == pytest.approx((16.0, 4.0))
    np.testing.assert_array_equal(np.delete(held[slot], [slot]), 0.0)


def test_a_level_of_one_cell_tells_how_probably_another_is_absent():
    """Cells of one site err together: one that is loud makes the other expected."""
    table, pixel, limit_dbm = raster(6), np.arange(PIXELS), -95.0
    given = report({3: -80.0}, absent=[4], limit_dbm=limit_dbm)
    memory = LevelMemory.empty(SOUND, SITE)
    _, _, found = weighed(memory, memory.start(PIXELS), pixel, table, given)
    for i in range(PIXELS):
        heard = [(3, 0.0, -80.0 - float(table[i, 3]), SOUND.white_db**2)]
        mean, variance = oracle.level_forecast(SOUND, SITE, heard, 4, 0.0)
        sd_db = sqrt(variance + SOUND.white_db**2 + SOUND.absent_db**2)
        edge = (limit_dbm - float(table[i, 4]) - mean) / sd_db
        expected = oracle.levels_log_density(SOUND, SITE, heard) + norm.logcdf(edge)
        # The table has steps of 1/32 of a deviation.
        hazard = exp(norm.logpdf(edge) - norm.logcdf(edge))
        assert found[i] == pytest.approx(expected, abs=hazard / 64 + 2e-3)


@pytest.mark.parametrize("predicted_dbm", [-60.0, -85.0, -110.0])
def test_an_absent_cell_may_be_faulty(predicted_dbm):
    errors = replace(FAULTY, fault_probability=0.2)
    table = np.full((1, 6), predicted_dbm, dtype=np.float32)
    given = report({}, absent=[1], limit_dbm=-90.0)
    memory = LevelMemory.empty(errors, SITE)
    after, kept, found = weighed(memory, memory.start(1), np.zeros(1, int), table, given)
    lasting = errors.slow_db**2 + errors.fast_db**2 + errors.device_db**2
    sd_db = sqrt(lasting + errors.white_db**2 + errors.absent_db**2)
    edge = (-90.0 - predicted_dbm) / sd_db
    right, wrong = 0.8 * norm.cdf(edge), 0.2 * 0.7
    rounding = exp(norm.logpdf(edge) - norm.logcdf(edge)) / 64 + 1e-3
    assert found[0] == pytest.approx(log(right + wrong), abs=rounding)
    slot = after.slot_of[1]
    assert kept[13 + slot, 0] == pytest.approx(log(wrong / right), abs=rounding)
    mean_db = truncnorm.mean(-np.inf, edge, scale=sd_db) * right / (right + wrong)
    held = kept[[slot, 6 + slot, 12], 0].sum()
    assert held == pytest.approx(lasting / sd_db**2 * mean_db, rel=0.03, abs=1e-3)


def test_an_absence_that_was_certain_says_nothing_and_an_impossible_one_is_finite():
    table = np.array([[-200.0] * 6, [0.0] * 6], dtype=np.float32)
    memory = LevelMemory.empty(SOUND, SITE)
    given = report({}, absent=[0], limit_dbm=-100.0)
    _, kept, found = weighed(memory, memory.start(2), np.arange(2), table, given)
    assert found[0] == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_array_equal(kept[:13, 0], 0.0)
    # Beyond eight deviations the probability is that of eight.
    assert found[1] == pytest.approx(norm.logcdf(-8.0), abs=1e-4)
    assert np.isfinite(kept[:, 1]).all()


@pytest.mark.parametrize("resolution_m", [2.5, 5.0, 10.0, 30.0])
def test_roughness_is_the_deviation_of_a_square_about_a_pixel(resolution_m):
    rng = np.random.default_rng(5)
    level = rng.normal(-80.0, 6.0, (25, 31, 2)).astype(np.float32)
    found = roughness(level, resolution_m)
    assert (found.shape, found.dtype) == (level.shape, np.float32)
    # All pixels whose middles lie within 17.5 m, rounded to whole pixels.
    reach = max(round(17.5 / resolution_m), 1)
    padded = np.pad(level.astype(float), ((reach, reach), (reach, reach), (0, 0)), "symmetric")
    for row, col in ((0, 0), (12, 15), (24, 30), (3, 29)):
        square = padded[row : row + 2 * reach + 1, col : col + 2 * reach + 1]
        np.testing.assert_allclose(found[row, col], square.std(axis=(0, 1)), rtol=1e-4)
    assert roughness(np.full((4, 4, 1), -90.0, np.float32), resolution_m).max() < 1e-3
