"""Kernels by parts of the particles: the bytes of the whole, and other parts are left alone."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from weighed_reports import weigh_by_absence, weigh_by_levels

from mapfilter.filters.resampling import copy_with_jitter, taken
from mapfilter.models import fingerprint
from mapfilter.models.ageing import Ageing, age, as_it_is
from mapfilter.models.fingerprint import (
    RasterFrame,
    ServingBands,
    ServingWeights,
    bound_table,
    serving_table,
)
from mapfilter.models.level_errors import LevelErrors
from mapfilter.models.level_kernels import LevelTerms, Prediction
from mapfilter.models.record_tiles import kept_in, new_records
from mapfilter.models.report_kernel import Heard, Served, weigh_by_report
from mapfilter.models.street_motion import STATES, MotionErrors, moving
from mapfilter.models.way_map import MapWeights, WayMap, weigh_by_ways

ROWS, COLS, BANDS, SLOTS, PIXEL_M = 12, 9, 6, 4, 5.0
WIDTH = 3 * SLOTS + 1
BLOCK = 1024
FRAME = RasterFrame(0.0, ROWS * PIXEL_M, 1 / PIXEL_M, ROWS, COLS)


class Particles:
    """Particles, and what each kernel is given of them; each time the same numbers."""

    def __init__(self, count, seed=4):
        rng = np.random.default_rng(seed)
        self.count = count
        self.state = rng.normal(0.0, 0.2, (STATES + 1, count)).astype(np.float32)
        self.state[0] = rng.uniform(-20.0, COLS * PIXEL_M + 20.0, count)
        self.state[1] = rng.uniform(-20.0, ROWS * PIXEL_M + 20.0, count)
        self.state[4] = rng.uniform(0.0, 1.0, count)
        self.records = new_records(count, WIDTH)
        self.records[:] = 0.0
        self.kept = kept_in(self.records, WIDTH)
        self.kept[:] = rng.normal(0.0, 4.0, (WIDTH, count))
        self.pixel = rng.integers(ROWS * COLS, size=count).astype(np.int32)
        self.log_weight = rng.normal(0.0, 1.0, count)
        self.weight = rng.random(count).astype(np.float32)
        self.chosen = np.sort(rng.integers(count, size=count)).astype(np.int32)
        self.level_dbm = rng.uniform(-105.0, -60.0, ROWS * COLS * BANDS).astype(np.float32)
        self.rough = rng.integers(0, 60, ROWS * COLS * BANDS).astype(np.uint8)
        self.map = -rng.uniform(0.0, 5.0, (ROWS, COLS)).astype(np.float32)
        gain = rng.uniform(0.0, 0.3, (3, 2 * SLOTS + 1)).astype(np.float32)
        self.terms = LevelTerms(
            np.array([2, 0, 5], dtype=np.int32),
            np.array([1, 3, 0], dtype=np.int32),
            np.array([-80.0, -71.0, -90.0], dtype=np.float32),
            gain,
            np.array([30.0, 21.0, 44.0], dtype=np.float32),
            np.array([-4.0, -3.5, -4.2], dtype=np.float32),
        )


def motion(p):
    errors = replace(MotionErrors(), rate_rad_per_m=0.01, disturbances_per_m=0.02)
    (kernel, *arguments), moved = moving(p.state, 1.3, 0.4, errors, np.uint64(77), 0.1)
    return kernel, arguments, [moved]


def ways(p):
    ways = WayMap(p.map, PIXEL_M, COLS * PIXEL_M, ROWS * PIXEL_M)
    weighed = np.full(p.count, np.nan)
    arguments = [p.state, ways, MapWeights().over(1.3), -0.18, p.log_weight, weighed]
    return weigh_by_ways, arguments, [p.state, weighed]


def pixels(p):
    pixel = np.full(p.count, -1, dtype=np.int32)
    return fingerprint.fill_pixels, [p.state, FRAME, ROWS - 1, COLS - 1, pixel], [pixel]


def ageing(p):
    found = aged(p, np.empty(0, dtype=np.int32))
    return age, [found], [kept_in(found.now, WIDTH)]


def ageing_of_copies(p):
    found = aged(p, p.chosen)
    return age, [found], [kept_in(found.now, WIDTH)]


def aged(p, chosen):
    now = new_records(p.count, WIDTH)
    now[:] = np.nan
    decay = np.linspace(0.1, 0.99, 2 * SLOTS + 1).astype(np.float32)
    return Ageing(p.records, chosen, decay, 0.97, LevelErrors().fault_log_odds, True, now)


def serving(p):
    odds = p.kept[2 * SLOTS + 2].copy()
    bands, table = ServingBands(BANDS, 1, BANDS - 2, BANDS - 1), serving_table(ServingWeights())
    given_ = p.pixel, p.level_dbm, bands, table, 0.3, odds, -0.7
    return fingerprint.weigh_by_serving, [*given_, p.log_weight], [odds, p.log_weight]


def levels(p):
    predicted = Prediction(p.level_dbm, p.rough, BANDS, 0.3)
    arguments = [as_it_is(p.records), p.pixel, predicted, p.terms, 0.35, p.log_weight]
    return weigh_by_levels, arguments, [p.kept, p.log_weight]


def report_of_aged_copies(p):
    predicted, found = Prediction(p.level_dbm, p.rough, BANDS, 0.3), aged(p, p.chosen)
    bands, table = ServingBands(BANDS, 1, BANDS - 2, BANDS - 1), serving_table(ServingWeights())
    served = Served(p.pixel, p.level_dbm, bands, table, 0.3, 2 * SLOTS + 2, -0.7)
    heard, after_serving = Heard(p.pixel, predicted, p.terms), np.full(p.count, np.nan)
    given_ = found, served, *heard, *heard, bound_table(), 0.35, p.log_weight, after_serving
    return weigh_by_report, [*given_], [kept_in(found.now, WIDTH), p.log_weight, after_serving]


def absence(p):
    predicted = Prediction(p.level_dbm, p.rough, BANDS, 0.3)
    arguments = [p.records, p.pixel, predicted, p.terms, bound_table(), 0.35, p.log_weight]
    return weigh_by_absence, arguments, [p.kept, p.log_weight]


def jittered(p):
    copies = np.full_like(p.state, np.nan)
    jitter = np.array([0.5, 0.3, 0.0, 0.1, 0.0, 0.0, 0.2], dtype=np.float32)
    return copy_with_jitter, [p.state, p.chosen, jitter, np.uint64(5), copies], [copies]


def weights_taken(p):
    log_of, weight_of = np.full(p.count, np.nan), np.full(p.count, np.nan, dtype=np.float32)
    return taken, [p.log_weight, p.weight, p.chosen, log_of, weight_of], [log_of, weight_of]


PASSES = [
    motion, ways, pixels, ageing, ageing_of_copies, serving, levels, report_of_aged_copies, absence,
    jittered, weights_taken,
]  # fmt: skip


def by_parts(one, count, cuts):
    """Return the bytes of what a kernel changes, called for parts of the particles, last first."""
    kernel, arguments, changed = one(Particles(count))
    ends = [0, *cuts, count]
    for first, stop in reversed(list(pairwise(ends))):
        kernel(first, stop, *arguments)
    return [array.tobytes() for array in changed]


@pytest.mark.parametrize("one", PASSES)
@settings(max_examples=15, deadline=None)
@given(st.data())
def test_parts_give_the_bytes_of_the_whole(one, data):
    count = data.draw(st.integers(1, 6 * BLOCK))
    inside = range(BLOCK, count, BLOCK)
    cuts = data.draw(st.lists(st.sampled_from(inside), unique=True)) if inside else []
    assert by_parts(one, count, sorted(cuts)) == by_parts(one, count, [])


@pytest.mark.parametrize("one", PASSES)
def test_other_parts_are_left_alone(one):
    count = 3 * BLOCK + 5
    kernel, arguments, changed = one(Particles(count))
    before = [array.copy() for array in changed]
    kernel(BLOCK, 2 * BLOCK, *arguments)
    for array, old in zip(changed, before, strict=True):
        assert not np.array_equal(array, old, equal_nan=array.dtype.kind == "f")
        for rest in (slice(0, BLOCK), slice(2 * BLOCK, None)):
            np.testing.assert_array_equal(array[..., rest], old[..., rest])
