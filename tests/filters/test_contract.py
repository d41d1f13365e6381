"""What every filter promises. A new filter joins by a line in ``FILTERS``.

The world is a few streets on a lattice, with a set of points for each cell. Walks have lengths and
headings that no lattice has, so that no position lies halfway between two points.
"""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from math import nan, pi
from typing import Any

import numpy as np
import pytest
from belief_events import Event, run

from mapfilter.angles import wrap_rad
from mapfilter.database.nearest import CellPointIndex
from mapfilter.filters.candidate import CandidateOptions, CandidateSearch
from mapfilter.filters.contract import (
    BeliefFilter,
    Estimate,
    MotionStep,
    Reason,
    Status,
    UpdateInfo,
)
from mapfilter.lattice import Lattice

LATTICE = Lattice("EPSG:32629", 5_000.0, 8_000.0, 5.0, 60, 70)


@dataclass(frozen=True)
class World:
    """Points of each cell, by row and column."""

    lattice: Lattice
    cells: dict[str, np.ndarray]

    def points_of(self, cell: str) -> CellPointIndex | None:
        if cell not in self.cells:
            return None
        return CellPointIndex.of_points(self.lattice, *np.nonzero(self.cells[cell]))


@dataclass(frozen=True)
class Case:
    """One filter: how it is made for a world, what it starts from and what it hears.

    ``turns_count`` says that turning on the spot changes where it thinks that it moved.
    """

    name: str
    make: Callable[[World], BeliefFilter[Any, Any, Any]]
    prior: Any
    readings: tuple[Any, ...]
    turns_count: bool = False


def candidate(name: str, **options: Any) -> Case:
    reading = CandidateOptions(**options)
    return Case(
        name,
        lambda world: CandidateSearch(world.points_of, reading),
        "A",
        ("A", "A", "B", "A"),
        reading.prediction == "last_heading",
    )


FILTERS = [
    candidate("candidate"),
    candidate("candidate-as-printed", update_length_m=5.0, tracking_length_m=0.0,
              prediction="last_heading", switch_check="next_call"),
    candidate("candidate-list", duplicates="list", threshold=10, update_length_m=10.0),
    candidate("candidate-restart", when_empty="reinitialise", update_length_m=0.0),
]  # fmt: skip


@pytest.fixture(params=FILTERS, ids=lambda case: case.name)
def case(request):
    return request.param


def make_world():
    streets = np.zeros((LATTICE.rows, LATTICE.cols), dtype=bool)
    streets[30, 5:64] = True
    streets[6:52, 22] = True
    streets[12, 22:50] = True
    streets[12:31, 49] = True
    col = np.arange(LATTICE.cols)
    return World(LATTICE, {"A": streets & (col < 52), "B": streets & (col > 15)})


WORLD = make_world()


def random_walk(seed, count=60):
    rng = np.random.default_rng(seed)
    step_m, heading = rng.uniform(2, 9, count), np.repeat(rng.uniform(-3, 3, count // 10), 10)
    noise = rng.normal(0, 0.1, count)
    return [MotionStep(s, h, nan) for s, h in zip(step_m, heading + noise, strict=True)]


def street_walk(seed, count=60):
    """East along the long street and north at the first corner, with a little noise."""
    rng = np.random.default_rng(seed)
    along = np.where(np.arange(count) < 20, 0.0, pi / 2)
    moves = zip(rng.normal(5, 0.05, count), along + rng.normal(0, 0.01, count), strict=True)
    return [MotionStep(s, h, nan) for s, h in moves]


WALKS = {"random": random_walk, "street": street_walk}


@pytest.fixture(params=[(kind, seed) for kind in WALKS for seed in (1, 2)], ids=str)
def walk(request):
    kind, seed = request.param
    return WALKS[kind](seed)


def events_of(case, walk):
    readings = case.readings
    return [Event(float(i), m, readings[i % len(readings)]) for i, m in enumerate(walk)]


def follow(case, world, walk, seed=3):
    filter_, rng = case.make(world), np.random.default_rng(seed)
    steps = list(run(filter_, filter_.init(case.prior, rng), events_of(case, walk), rng))
    return filter_, steps


def same(a, b):
    """Return whether two beliefs, estimates or news are equal to the last bit."""
    if is_dataclass(a):
        return type(a) is type(b) and all(
            same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a)
        )
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    return a == b or (a != a and b != b)


def beliefs_on_the_way(case, walk):
    """The first belief, one from the search and the last."""
    filter_, steps = follow(case, WORLD, walk)
    first = filter_.init(case.prior, np.random.default_rng(3))
    return filter_, [first, steps[len(steps) // 3].belief, steps[-1].belief]


def test_functions_answer_with_the_types_of_the_contract(case, walk):
    filter_, steps = follow(case, WORLD, walk)
    assert any(taken.info.reason is Reason.USED for taken in steps)
    for taken in steps:
        assert isinstance(taken.info, UpdateInfo)
        assert isinstance(taken.motion_reason, Reason)
        assert taken.info.hypotheses >= 0
        located = filter_.locate(taken.belief)
        assert isinstance(located, Estimate)
        assert isinstance(located.east_m, float)
        assert isinstance(located.north_m, float)
        assert (located.covariance_m2.shape, located.radii_m.shape) == ((2, 2), (3,))
        assert np.isnan(located.east_m) == np.isnan(located.north_m)


def test_statuses_follow_each_other_as_the_contract_says(case, walk):
    _, steps = follow(case, WORLD, walk)
    now = [taken.info.status for taken in steps]
    for before, after in zip([Status.SEARCHING, *now], now, strict=False):
        if after is Status.TRACKING:
            assert before in (Status.CONVERGED, Status.TRACKING, Status.LOST)
        if after is Status.CONVERGED:
            assert before in (Status.SEARCHING, Status.LOST)


def test_a_step_of_nothing_changes_nothing(case, walk):
    filter_, steps = follow(case, WORLD, walk)
    events = events_of(case, walk)
    turned_rad = 0.0 if case.turns_count else 2.0
    for index in (0, 7, 20, 59):
        belief, moved = steps[index].belief, walk[index]
        still = MotionStep(0.0, moved.heading_rad + turned_rad, 0.0)
        after, reason = filter_.predict(belief, still, np.random.default_rng(0))
        assert reason is Reason.USED
        assert same(filter_.locate(after), filter_.locate(belief))
        ways_on = (
            run(filter_, start, events[index + 1 :], np.random.default_rng(0))
            for start in (belief, after)
        )
        for a, b in zip(*ways_on, strict=True):
            assert same(a.info, b.info)
            assert same(filter_.locate(a.belief), filter_.locate(b.belief))


@pytest.mark.parametrize(
    ("motion", "reason"),
    [(MotionStep(nan, 0.3), Reason.NO_STEP), (MotionStep(2.0, nan), Reason.NO_HEADING)],
)
def test_absent_motion_changes_nothing_and_is_told(case, walk, motion, reason):
    filter_, beliefs = beliefs_on_the_way(case, walk)
    for belief in beliefs:
        moved, why = filter_.predict(belief, motion, np.random.default_rng(0))
        assert same(moved, belief)
        assert why is reason


def test_an_absent_reading_changes_nothing(case, walk):
    filter_, beliefs = beliefs_on_the_way(case, walk)
    for belief in beliefs:
        (taken,) = run(filter_, belief, [Event(0.0)], np.random.default_rng(0))
        assert taken.belief is belief


def test_a_reading_that_says_nothing_changes_nothing_and_is_told(case, walk):
    filter_, beliefs = beliefs_on_the_way(case, walk)
    for belief in beliefs:
        weighed, info = filter_.update(
            belief, "a cell of another network", np.random.default_rng(0)
        )
        assert same(weighed, belief)
        assert info.reason is not Reason.USED


def test_beliefs_are_never_changed_in_place(case, walk):
    filter_, rng = case.make(WORLD), np.random.default_rng(3)
    belief, kept = filter_.init(case.prior, rng), []
    for event in events_of(case, walk):
        kept.append((belief, copy.deepcopy(belief)))
        moved, _ = filter_.predict(belief, event.motion, rng)
        kept.append((moved, copy.deepcopy(moved)))
        belief, _ = filter_.update(moved, event.reading, rng)
        filter_.locate(belief)
    for seen, as_it_was in kept:
        assert same(seen, as_it_was)


def test_the_world_is_never_changed_in_place(case, walk):
    world = make_world()
    points = {cell: world.points_of(cell) for cell in world.cells}
    before = copy.deepcopy(points)
    shared = replace(case, make=lambda _: replace(case.make(world), points_of=points.get))
    follow(shared, world, walk)
    assert all(same(points[cell], before[cell]) for cell in points)


def test_everything_is_determined_by_the_generator(case, walk):
    first, second = follow(case, WORLD, walk)[1], follow(case, make_world(), walk)[1]
    for a, b in zip(first, second, strict=True):
        assert same(a.belief, b.belief)
        assert same(a.info, b.info)
        assert a.motion_reason is b.motion_reason


def test_a_belief_stored_and_loaded_goes_on_as_before(case, walk):
    events, filter_, rng = events_of(case, walk), case.make(WORLD), np.random.default_rng(3)
    *_, halfway = run(filter_, filter_.init(case.prior, rng), events[:20], rng)
    loaded, other_rng = pickle.loads(pickle.dumps((halfway.belief, rng)))
    on = run(filter_, halfway.belief, events[20:], rng)
    for a, b in zip(on, run(filter_, loaded, events[20:], other_rng), strict=True):
        assert same(a.belief, b.belief)
        assert same(a.info, b.info)


def assert_moved_world(case, world, walk, other_world, other_walk, move):
    """Assert that another world gives the same news and moved positions."""
    filter_, steps = follow(case, world, walk)
    other_filter, other_steps = follow(case, other_world, other_walk)
    for here, there in zip(steps, other_steps, strict=True):
        assert there.info == here.info
        a, b = filter_.locate(here.belief), other_filter.locate(there.belief)
        expected = move(a.east_m, a.north_m)
        assert (b.east_m, b.north_m) == pytest.approx(expected, abs=1e-6, nan_ok=True)
        if hasattr(here.belief, "east_m"):
            moved = np.column_stack(move(here.belief.east_m, here.belief.north_m))
            found = np.column_stack([there.belief.east_m, there.belief.north_m])
            assert np.allclose(sorted(found.tolist()), sorted(moved.tolist()), rtol=0, atol=1e-6)


@pytest.mark.parametrize(("east_m", "north_m"), [(5.0, -10.0), (-123_457.0, 4_000_003.0)])
def test_a_translated_world_gives_the_translated_result(case, walk, east_m, north_m):
    lattice = replace(LATTICE, west_m=LATTICE.west_m + east_m, north_m=LATTICE.north_m + north_m)
    moved = World(lattice, WORLD.cells)
    assert_moved_world(case, WORLD, walk, moved, walk, lambda e, n: (e + east_m, n + north_m))


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_world_turned_by_quarters_gives_the_turned_result(case, walk, quarters):
    cells = {cell: np.rot90(mask, quarters) for cell, mask in WORLD.cells.items()}
    rows, cols = cells["A"].shape
    lattice = replace(LATTICE, rows=rows, cols=cols)
    headings = [wrap_rad(move.heading_rad + quarters * pi / 2).item() for move in walk]
    turned = [replace(m, heading_rad=h) for m, h in zip(walk, headings, strict=True)]

    def centre(of):
        west, south, east, north = of.bounds_m
        return (west + east) / 2, (south + north) / 2

    (ce, cn), (te, tn) = centre(LATTICE), centre(lattice)
    cos, sin = round(np.cos(quarters * pi / 2)), round(np.sin(quarters * pi / 2))

    def turn(e, n):
        return te + cos * (e - ce) - sin * (n - cn), tn + sin * (e - ce) + cos * (n - cn)

    assert_moved_world(case, WORLD, walk, World(lattice, cells), turned, turn)


def test_a_walk_along_the_streets_is_found(case):
    """The properties above would also hold for a filter that never finds anything."""
    _, steps = follow(case, WORLD, street_walk(1))
    statuses = [taken.info.status for taken in steps]
    assert statuses[0] is Status.SEARCHING
    assert Status.CONVERGED in statuses
    assert statuses[-1] is Status.TRACKING
