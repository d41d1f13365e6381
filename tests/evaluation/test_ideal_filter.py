"""The ideal filter against its definition in matrices and whole arrays, and hand counts."""

from math import erfc

import numpy as np
import pytest

from mapfilter.evaluation.first_fix_kernels import (
    Judgement,
    Levels,
    _entropy_bits,
    _mass_near,
    _serves,
    _without_hopeless,
    judged_by_cells,
    judged_by_levels,
    walk,
)

RESOLUTION_M = 5.0
SHAPE = (24, 30)
FLOOR_DBM = -100.0


class World:
    """Levels of four cells at two sites, and a journey of a few steps to the east."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        steps = rng.normal(-80, 14, (6, 6, 4)).repeat(4, axis=0).repeat(5, axis=1)
        self.level_dbm = (steps + rng.normal(0, 2, (*SHAPE, 4))).astype(np.float32)
        # Somewhere no cell but one is above the floor.
        self.level_dbm[3, :, 1:] = FLOOR_DBM - 1
        self.level_dbm[..., 0] = np.maximum(self.level_dbm[..., 0], np.float32(-99.0))
        # Every second world has two layers.
        self.layer = np.array([0, 0, 1, 1]) * (seed % 2)
        layers = range(self.layer.max() + 1)
        best = [self.level_dbm[..., self.layer == k].max(axis=2) for k in layers]
        self.near_way = rng.random(SHAPE) < 0.9
        steps = rng.integers(1, 3, 8)
        self.cols = 4 + np.concatenate([[0], np.cumsum(steps)])
        self.rows = 9 + rng.integers(-1, 2, 9).cumsum()
        self.near_way[self.rows, self.cols] = True
        leg_m = np.hypot(np.diff(self.rows), np.diff(self.cols)) * RESOLUTION_M
        self.gone_m = np.concatenate([[0.0], np.cumsum(leg_m)])
        row, col = np.nonzero(self.near_way)
        server = self.level_dbm[self.rows[0], self.cols[0]].argmax()
        own = self.serving(self.level_dbm[row, col], server)
        self.row, self.col = row[own], col[own]
        self.site = np.array([1, 0, 1, 0])
        self.levels = Levels(
            self.near_way, self.level_dbm, np.stack(best, axis=2), self.site, self.layer,
            FLOOR_DBM, 6.0,
        )  # fmt: skip

    def serving(self, level_dbm, server):
        """Return where a cell is strong enough, among those of its layer."""
        own, rivals = level_dbm[..., server], level_dbm[..., self.layer == self.layer[server]]
        return (own > FLOOR_DBM) & (own >= rivals.max(axis=-1) - np.float32(6.0))

    def moved(self, k):
        """Return where each start would be now, and whether one can be there."""
        r = self.row + self.rows[k] - self.rows[0]
        c = self.col + self.cols[k] - self.cols[0]
        inside = (r >= 0) & (c >= 0) & (r < SHAPE[0]) & (c < SHAPE[1])
        r, c = np.where(inside, r, 0), np.where(inside, c, 0)
        return r, c, inside & self.near_way[r, c]

    @property
    def off_px2(self):
        return (self.row - self.rows[0]) ** 2 + (self.col - self.cols[0]) ** 2


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(("near_px", "path_m"), [(10.0, 40.0), (4.0, 1e4), (2.0, 0.0)])
def test_cells_alone_against_the_definition(seed, near_px, path_m):
    world = World(seed)
    alive = np.ones(world.row.size, dtype=bool)
    clear_m, bits = np.inf, None
    for k, gone_m in enumerate(world.gone_m):
        r, c, possible = world.moved(k)
        server = world.level_dbm[world.rows[k], world.cols[k]].argmax()
        alive &= possible & world.serving(world.level_dbm[r, c], server)
        if clear_m == np.inf and (world.off_px2[alive] <= near_px**2).all():
            clear_m = gone_m
        if bits is None and gone_m >= path_m:
            bits = np.log2(alive.size / alive.sum())
    expected = clear_m, np.log2(alive.size / alive.sum()) if bits is None else bits
    found = judged_by_cells(
        world.rows,
        world.cols,
        world.gone_m,
        world.row,
        world.col,
        world.levels,
        near_px,
        path_m,
    )
    assert found == pytest.approx(expected)


def errors_db(rng, world, deviation_db, correlation_m, share):
    """Return errors of all cells at each epoch: Gauss-Markov over the way, part of it shared."""
    own, site = rng.standard_normal(4), rng.standard_normal(2)
    errors = []
    for step_m in [None, *np.diff(world.gone_m)]:
        if step_m is not None:
            kept = np.exp(-step_m / correlation_m)
            own = kept * own + np.sqrt(1 - kept**2) * rng.standard_normal(4)
            site = kept * site + np.sqrt(1 - kept**2) * rng.standard_normal(2)
        shared = np.sqrt(share) * site[world.site] + np.sqrt(1 - share) * own
        errors.append(deviation_db * shared)
    return errors


def levels_by_definition(world, errors, deviation_db, correlation_m, share, options):
    near_px, path_m, apart_px, mass = options
    alive = np.ones(world.row.size, dtype=bool)
    log_weight, apart = np.zeros(alive.size), np.zeros(alive.size)
    clear_m, right, bits, twin, twin_error = np.inf, 0.0, None, -1, 0.0
    for k, gone_m in enumerate(world.gone_m):
        looks = 1.0 if k == 0 else (gone_m - world.gone_m[k - 1]) / (2 * correlation_m)
        truth = world.level_dbm[world.rows[k], world.cols[k]].astype(float)
        of_layer = world.layer == world.layer[truth.argmax()]
        heard = np.flatnonzero((truth > FLOOR_DBM) & of_layer)
        same_site = world.site[heard][:, None] == world.site[heard][None, :]
        covariance = deviation_db**2 * ((1 - share) * np.eye(heard.size) + share * same_site)
        inverse = np.linalg.inv(covariance)
        r, c, possible = world.moved(k)
        alive &= possible
        level = world.level_dbm[r, c][:, heard].astype(float)
        off = truth[heard] + errors[k][heard] - level
        log_weight -= 0.5 * looks * np.einsum("hi,ij,hj->h", off, inverse, off)
        weight = np.where(alive, np.exp(log_weight - log_weight[alive].max()), 0.0)
        weight /= weight.sum()
        if bits is None:
            off = truth[heard] - level
            apart += looks * np.einsum("hi,ij,hj->h", off, inverse, off)
            if gone_m >= path_m or k == world.gone_m.size - 1:
                some = weight[weight > 0]
                bits = np.log2(alive.size) + (some * np.log2(some)).sum()
                far = np.where(alive & (world.off_px2 >= apart_px**2), apart, np.inf)
                if np.isfinite(far.min()):
                    twin = far.argmin()
                    twin_error = 0.5 * erfc(np.sqrt(far.min() / 8))
        if clear_m == np.inf:
            best = weight.argmax()
            off_px2 = (world.row - world.row[best]) ** 2 + (world.col - world.col[best]) ** 2
            if weight[off_px2 <= near_px**2].sum() >= mass:
                clear_m, right = gone_m, float(world.off_px2[best] <= near_px**2)
    return clear_m, right, max(bits, 0.0), twin, twin_error


@pytest.mark.parametrize("seed", range(15))
@pytest.mark.parametrize(
    ("deviation_db", "share", "options"),
    [
        (7.0, 0.4, (4.0, 40.0, 6.0, 0.9)),
        (9.0, 0.0, (2.0, 1e4, 3.0, 0.6)),
        (5.0, 0.7, (3.0, 0.0, 5.0, 0.5)),
    ],
)
def test_levels_against_the_definition(seed, deviation_db, share, options):
    world, correlation_m = World(seed), 30.0
    errors = errors_db(np.random.default_rng(seed), world, deviation_db, correlation_m, share)
    expected = levels_by_definition(world, errors, deviation_db, correlation_m, share, options)
    near_px, path_m, apart_px, mass = options
    number = np.arange(world.row.size) + 1000
    clear_m, right, bits, twin, twin_error = judged_by_levels(
        np.random.default_rng(seed),
        world.rows,
        world.cols,
        world.gone_m,
        world.row,
        world.col,
        number,
        world.levels,
        Judgement(deviation_db, correlation_m, share, near_px, path_m, apart_px, mass),
    )
    assert (clear_m, right) == expected[:2]
    assert bits == pytest.approx(expected[2], abs=1e-5)
    assert twin_error == pytest.approx(expected[4], rel=1e-4, abs=1e-7)
    # One that was hopeless on the way is none, whatever its number.
    if expected[4] > 1e-6:
        assert twin == expected[3] + 1000


def test_serving_is_strictly_above_the_floor_and_within_the_margin():
    assert _serves(-80.0, -74.0, -100.0, 6.0)
    assert not _serves(-80.1, -74.0, -100.0, 6.0)
    assert not _serves(-100.0, -100.0, -100.0, 6.0)


def test_bits_of_four_hypotheses():
    # Weights 1/2, 1/4, 1/8, 1/8: 1.75 bits.
    log_weight = np.log([0.5, 0.25, 0.125, 0.125])
    assert _entropy_bits(log_weight, log_weight.max()) == pytest.approx(1.75)
    assert _entropy_bits(np.full(8, -700.0), -700.0) == pytest.approx(3.0)


def test_mass_near_the_best():
    log_weight = np.log([0.4, 0.3, 0.2, 0.1])
    row, col = np.array([5, 5, 8, 9]), np.array([5, 8, 9, 5])
    # Distances 0, 3, 5 and 4 pixels.
    for near_px, mass in [(2.9, 0.4), (3.0, 0.7), (4.0, 0.8), (5.0, 1.0)]:
        assert _mass_near(log_weight, row, col, 4, 0, near_px) == pytest.approx(mass)
    assert _mass_near(log_weight, row, col, 2, 0, 2.0) == pytest.approx(4 / 7)


@pytest.mark.parametrize(("counts_twins", "kept"), [(True, [0, 1, 3]), (False, [0, 3])])
def test_hopeless_ones_are_dropped_unless_they_may_be_twins(counts_twins, kept):
    log_weight = np.array([-5.0, -35.1, -36.0, -35.0])
    apart = np.array([50.0, 30.0, 30.1, 50.0])
    row, col, number = np.arange(4), np.arange(4) + 10, np.arange(4) + 20
    columns = [values.copy() for values in (log_weight, apart, row, col, number)]
    left = _without_hopeless(*columns, 4, -5.0, counts_twins)
    assert left == len(kept)
    for values, before in zip(columns, (log_weight, apart, row, col, number), strict=True):
        assert values[:left].tolist() == before[kept].tolist()


def first_steps(on_way, row, col, count, steps=1, seed=0):
    """Return how often each move was the last one of so many steps, by (rows, cols)."""
    rng, moves = np.random.default_rng(seed), {}
    for _ in range(count):
        rows, cols, _ = walk(rng, on_way, row, col, RESOLUTION_M, 500.0)
        move = rows[steps] - rows[steps - 1], cols[steps] - cols[steps - 1]
        before = rows[1] - rows[0], cols[1] - cols[0]
        moves.setdefault(before, {}).setdefault(move, 0)
        moves[before][move] += 1
    return moves


def test_a_way_that_goes_on_farther_is_likelier():
    # Three steps are free to the west and six to the east: 3² to 6².
    on_way = np.zeros((3, 40), dtype=bool)
    on_way[1, 2:] = True
    moves = first_steps(on_way, 1, 8, 5000)
    east, west = (sum(moves.get((0, move), {}).values()) for move in (2, -2))
    assert east + west == 5000
    assert east == pytest.approx(5000 * 36 / 45, abs=4 * np.sqrt(5000 * 0.16))


def test_a_street_is_followed_to_its_end_or_to_the_longest_journey():
    on_way = np.zeros((3, 41), dtype=bool)
    on_way[1] = True
    rows, cols, gone_m = walk(np.random.default_rng(1), on_way, 1, 0, RESOLUTION_M, 100.0)
    assert (rows == 1).all()
    assert cols.tolist() == list(range(0, 22, 2))
    assert gone_m.tolist() == list(np.arange(0, 101, 10.0))
    # Only the pixel itself: nowhere to go.
    alone = np.zeros((3, 3), dtype=bool)
    alone[1, 1] = True
    assert walk(np.random.default_rng(1), alone, 1, 1, RESOLUTION_M, 100.0)[0].tolist() == [1]


def test_straight_on_is_likeliest_in_the_open_and_lengths_are_those_of_the_steps():
    on_way = np.ones((81, 81), dtype=bool)
    moves = first_steps(on_way, 40, 40, 20000, steps=2)
    ways = [(-2, 0), (-2, 1), (-2, 2), (-1, 2), (0, 2), (1, 2), (2, 2), (2, 1),
            (2, 0), (2, -1), (2, -2), (1, -2), (0, -2), (-1, -2), (-2, -2), (-2, -1)]  # fmt: skip
    turned = np.zeros(16)
    for before, after in moves.items():
        for move, count in after.items():
            turned[(ways.index(move) - ways.index(before)) % 16] += count
    angle = np.arange(16) * np.pi / 8
    chance = np.where(np.cos(angle) > -0.5, np.exp(2.5 * (np.cos(angle) - 1)), 1e-3)
    chance /= chance.sum()
    sd = np.sqrt(20000 * chance * (1 - chance))
    assert turned.sum() == 20000
    assert (np.abs(turned - 20000 * chance) < 4.5 * sd + 1).all()
    rows, cols, gone_m = walk(np.random.default_rng(3), on_way, 40, 40, RESOLUTION_M, 150.0)
    legs_m = np.hypot(np.diff(rows), np.diff(cols)) * RESOLUTION_M
    assert np.diff(gone_m) == pytest.approx(legs_m)
    assert gone_m[-2] < 150 <= gone_m[-1]


def test_to_the_north_a_hypothesis_at_the_start_is_near_the_truth():
    level_dbm = np.full((*SHAPE, 1), -70.0, dtype=np.float32)
    levels = Levels(
        np.ones(SHAPE, dtype=bool), level_dbm, level_dbm, np.zeros(1, int), np.zeros(1, int),
        FLOOR_DBM, 0.0,
    )  # fmt: skip
    rows, cols, gone_m = np.array([9, 6, 4]), np.array([3, 3, 3]), np.array([0.0, 15.0, 25.0])
    start = rows[:1].astype(np.int32), cols[:1].astype(np.int32)
    found = judged_by_cells(rows, cols, gone_m, *start, levels, 0.5, 10.0)
    assert found == (0.0, 0.0)


def test_where_no_cell_is_received_hypotheses_are_only_moved():
    """Levels below the floor on a part of the way: nothing is told there."""
    world = World(0)
    silent = world.rows[3], world.cols[3]
    world.level_dbm[silent] = FLOOR_DBM - 1
    world.levels.best_dbm[silent] = FLOOR_DBM - 1
    given = world.rows, world.cols, world.gone_m, world.row, world.col, world.levels
    _, bits = judged_by_cells(*given, 0.0, 1e4)
    assert 0 < bits < np.inf
    alive = np.ones(world.row.size, dtype=bool)
    for k in range(len(world.gone_m)):
        r, c, possible = world.moved(k)
        server = world.level_dbm[world.rows[k], world.cols[k]].argmax()
        alive &= possible
        if k != 3:
            alive &= world.serving(world.level_dbm[r, c], server)
    assert bits == pytest.approx(np.log2(alive.size / alive.sum()))
