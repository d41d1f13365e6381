"""Ways from repeated tracks, against the streets that made tracks were walked on."""

import numpy as np
import pytest
import shapely

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.roads.corridors import Positions, corridors
from mapfilter.roads.network import street_network
from mapfilter.roads.route_points import route_lattice

CRS = "EPSG:32618"
MAIN = shapely.LineString([(0, 0), (400, 0), (400, 300)])
CROSS = shapely.LineString([(200, -150), (200, 150)])
BESIDE = shapely.LineString([(0, 60), (150, 60)])
STREETS = shapely.union_all([MAIN, CROSS, BESIDE])


def walk(street, rng, noise_m, accuracy_m=5.0, step_m=7.0, back=False):
    """Positions along a street with smooth errors, as receivers make them."""
    at_m = np.arange(0.0, street.length, step_m)
    places = shapely.get_coordinates(shapely.line_interpolate_point(street, at_m))
    slow = np.repeat(rng.normal(0, noise_m, (len(at_m) // 10 + 2, 2)), 10, axis=0)[: len(at_m)]
    places = (places + slow + rng.normal(0, noise_m / 3, places.shape))[:: -1 if back else 1]
    return Positions(places[:, 0], places[:, 1], np.full(len(at_m), accuracy_m))


@pytest.fixture
def town():
    rng = np.random.default_rng(5)
    return [
        walk(street, rng, 3.0, back=back)
        for _ in range(3)
        for street, back in ((MAIN, False), (CROSS, True), (BESIDE, False), (MAIN, True))
    ]


def test_streets_come_out_where_they_are(town):
    found = corridors(CRS, town, 12.0)
    made = shapely.union_all(found.ways.geometry)
    assert shapely.hausdorff_distance(made, STREETS) < 12.0
    samples = shapely.line_interpolate_point(STREETS, np.arange(0, STREETS.length, 5.0))
    off_m = shapely.distance(samples, made)
    assert np.mean(off_m) < 2.5
    assert made.length < 1.15 * STREETS.length
    assert found.ways.class_names == ("corridor",)
    assert found.ways.way_id.tolist() == list(range(1, len(found.ways) + 1))
    assert found.sessions.max() >= 6
    assert "12 m" in found.notes[0]


def test_repeated_tracks_are_better_than_one(town):
    def error_m(sessions):
        made = shapely.union_all(corridors(CRS, sessions, 12.0).ways.geometry)
        return shapely.distance(shapely.line_interpolate_point(MAIN, np.arange(20, 680, 5)), made)

    one, all_six = error_m(town[:1]), error_m([town[i] for i in (0, 3, 4, 7, 8, 11)])
    assert all_six.mean() < 0.7 * one.mean()


def test_ways_that_cross_join(town):
    crossing = [session for i, session in enumerate(town) if i % 4 != 2]
    network = street_network(corridors(CRS, crossing, 12.0).ways)
    assert network.length_m.sum() > 0.97 * (MAIN.length + CROSS.length)


def test_the_corridor_is_the_lattice_within_its_half_width(town):
    found = corridors(CRS, town, 12.0)
    lattice = Lattice(CRS, -50.0, 350.0, 5.0, 110, 110)
    routes = route_lattice(found.ways, None, None, lattice, found.half_width_m)
    made = shapely.union_all(found.ways.geometry)
    row, col = np.divmod(np.arange(lattice.rows * lattice.cols), lattice.cols)
    points = shapely.points(*lattice.east_north(row, col))
    np.testing.assert_array_equal(routes.point, np.flatnonzero(shapely.dwithin(made, points, 12.0)))


def test_the_way_back_is_the_same_way():
    there = np.arange(0.0, 500.0, 6.0)
    loop = np.concatenate([there, there[::-1]])
    found = corridors(CRS, [Positions(loop, np.full(loop.size, 3.0))], 10.0)
    assert shapely.length(found.ways.geometry).sum() == pytest.approx(
        498, abs=20
    )  # it turns within two half widths
    round_trip = shapely.Point(0, 0).buffer(100).exterior
    ring = shapely.get_coordinates(round_trip.segmentize(5))
    closed = corridors(CRS, [Positions(*ring.T)], 10.0)
    assert shapely.get_num_geometries(shapely.line_merge(shapely.union_all(closed.ways.geometry)))
    assert shapely.length(closed.ways.geometry).sum() == pytest.approx(round_trip.length, rel=0.02)


def test_accurate_tracks_count_for_more():
    east = np.arange(0.0, 300.0, 5.0)
    good = Positions(east, np.zeros(60), np.full(60, 2.0))
    poor = Positions(east, np.full(60, 8.0), np.full(60, 20.0))
    found = corridors(CRS, [poor, good], 10.0)
    assert len(found.ways) == 1
    assert abs(shapely.get_coordinates(found.ways.geometry)[:, 1]).max() < 0.5


def test_standing_still_gaps_and_poor_positions():
    rng = np.random.default_rng(1)
    east = np.concatenate([np.arange(0.0, 100.0, 5.0), np.full(200, 100.0), np.arange(400, 500, 5)])
    jitter = np.where(east == 100, rng.normal(0, 1.0, east.size), 0.0)
    accuracy_m = np.full(east.size, np.nan)
    accuracy_m[3] = 500.0
    north = jitter.copy()
    north[3] = 400.0
    found = corridors(CRS, [Positions(east + jitter, north, accuracy_m)], 10.0)
    assert len(found.ways) == 2
    assert shapely.bounds(found.ways.geometry)[:, 3].max() < 5
    assert found.notes[1:] == ("1 position left out: less accurate than max_accuracy_m = 50 m",)


def test_positions_that_are_left_out_are_counted_by_their_cause():
    """Alone, not accurate, or both: a gap of 200 m is no matter of accuracy."""
    apart = np.arange(0.0, 2000.0, 200.0)
    near = np.arange(5000.0, 5100.0, 5.0)
    east = np.concatenate([apart, near])
    accuracy_m = np.full(east.size, 3.0)
    accuracy_m[[0, 12]] = 80.0
    positions = Positions(east, np.zeros(east.size), accuracy_m)
    assert corridors(CRS, [positions], 10.0).notes[1:] == (
        "2 positions left out: less accurate than max_accuracy_m = 50 m",
        "9 positions left out: more than max_gap_m = 100 m from the others, or standing",
        "ways interrupted at 9 of 27 steps from position to position, longer than "
        "max_gap_m = 100 m (median step 5 m): raise max_gap_m",
    )


def test_a_track_of_sparse_positions_is_interrupted_and_the_remedy_is_named():
    """A car's positions every 9 s, 80 to 120 m apart: half of the way is missing at 100 m."""
    east = np.cumsum(np.tile([80.0, 120.0, 80.0], 10))
    sparse = Positions(east, np.zeros(east.size))
    broken, whole = (corridors(CRS, [sparse], 10.0, max_gap_m=m) for m in (100.0, 150.0))
    assert "at 10 of 29 steps" in broken.notes[-1]
    assert "median step 80 m): raise max_gap_m" in broken.notes[-1]
    assert len(broken.ways) > 1
    assert len(whole.ways) == 1
    assert not any("interrupted" in note for note in whole.notes)


def test_ways_of_few_sessions_are_left_out_on_request(town):
    lonely = walk(shapely.LineString([(0, -100), (150, -100)]), np.random.default_rng(2), 1.0)
    found = corridors(CRS, [*town, lonely], 12.0, min_sessions=2)
    assert shapely.distance(shapely.union_all(found.ways.geometry), shapely.Point(75, -100)) > 60
    assert found.sessions.min() >= 1
    with pytest.raises(InputError, match="2 sessions"):
        corridors(CRS, [lonely], 12.0, min_sessions=2)


def test_the_same_anywhere_and_again(town):
    moved = [Positions(p.east_m + 4e5, p.north_m + 5e6, p.accuracy_m) for p in town]
    here, there = corridors(CRS, town, 12.0), corridors(CRS, moved, 12.0)
    again = corridors(CRS, town, 12.0)
    assert shapely.equals_exact(here.ways.geometry, again.ways.geometry).all()
    total = shapely.length(here.ways.geometry).sum()
    assert shapely.length(there.ways.geometry).sum() == pytest.approx(total, rel=0.02)


def test_what_does_not_fit_is_refused():
    fine = Positions(np.arange(5.0), np.zeros(5))
    with pytest.raises(InputError, match=r"half_width_m.*\n.*max_gap_m.*\n.*min_sessions"):
        corridors(CRS, [fine], 0.0, max_gap_m=np.nan, min_sessions=0)
    with pytest.raises(InputError, match=r"session 1: .*one length.*\n.*session 2: .*finite"):
        corridors(
            CRS,
            [Positions(np.arange(5.0), np.zeros(4)), Positions(np.full(5, np.nan), np.zeros(5))],
        )
    for nothing in ([], [Positions(np.empty(0), np.empty(0))], [fine]):
        with pytest.raises(InputError, match="tracks"):
            corridors(CRS, nothing, 20.0)


def test_real_sessions(shared_data):
    from mapfilter.survey.read_measurements import read_measurements

    read = read_measurements([shared_data / "cell-ottawa-lte" / "carling"])
    sessions = [
        Positions(read.east_m[own], read.north_m[own], read.accuracy_m[own])
        for own in (read.session == number for number in range(len(read.sessions)))
    ]
    found = corridors(read.crs, sessions)
    near = np.array([shapely.dwithin(
        shapely.union_all(found.ways.geometry), shapely.points(s.east_m, s.north_m), 15.0
    ).mean() for s in sessions])  # fmt: skip
    assert near.min() > 0.9
    assert found.sessions.max() >= 3
    assert street_network(found.ways).length_m.sum() > 3000
