"""Options of the Bayes map filter: defaults, limits, and what becomes of each of them."""

from dataclasses import asdict, replace
from math import radians
from types import SimpleNamespace

import numpy as np
import pytest
from made_town import Town
from small_area import FLOOR_DBM, LATTICE, make_area

from mapfilter.errors import ConfigError
from mapfilter.filters.contract import MotionStep
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes import options as tested
from mapfilter.positioning.bayes import over_survey as surveys
from mapfilter.positioning.bayes.area import opened_area
from mapfilter.positioning.bayes.assembly import assembled
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.radio.cells import CellPlan

TOTAL_DB = 75.89**0.5
"""Of a slow, a fast and a white error of 7, 4 and 3.3 dB: 49 + 16 + 10.89."""


def without_cells(**more):
    """The town's ways as an area without cells, with carriageways, or whatever is given."""
    whole = Town.of(1).area()
    none = np.zeros((*whole.distance_m.shape, 2), dtype=np.float32)
    changes = {"carriageway_m": whole.distance_m + 1.0} | more
    return replace(whole, cell_ids=(), level_dbm=none, carriers={}, **changes)


def test_the_usual_options():
    assert asdict(BayesFilter()) == {
        "vehicle": None, "step_sd_m": 0.3, "heading_sd_deg": 15.0, "bias_sd_deg": 10.0,
        "drift_deg_per_sqrt_m": 0.3, "scale": 0.03, "map_sd_m": 3.0,
        "map_weight_per_m": pytest.approx(0.0833333, abs=1e-6), "off_cost_per_m": 0.04,
        "levels": True, "level_error_db": 8.7, "level_correlation_m": 200.0,
        "device_error_db": 5.0, "fault_probability": 0.06, "level_weight": 0.35,
        "report_spacing_m": 5.0, "max_particles": 20_000, "min_search_particles": 12_000,
        "min_particles": 3000, "switch_mass": 0.995, "switch_hold_m": 20.0,
        "claim_mass": 0.998, "smooth": False,
        "satellite_sd_m": 2.0, "antenna_height_m": 100.0, "antenna_height_sd_m": 200.0,
        "timing_step_m": 553.5, "timing_sd_m": 200.0, "threads": 1,
    }  # fmt: skip
    assert asdict(GridFilter()) == asdict(BayesFilter()) | {"device": "cpu"}


def test_what_options_make_is_a_filter_over_the_area():
    area = Town.of(1).area()
    for options, grid in ((BayesFilter(), False), (GridFilter(), True)):
        found = options.over_area(area)
        assert isinstance(found, BayesPositioner)
        assert (found.area, found.beliefs.grid) == (area, grid)


def test_only_errors_of_fixes_of_vehicles_last_for_some_time():
    area = make_area()
    walker, vehicle = (assembled(BayesFilter(vehicle=one), area) for one in (False, True))
    assert walker.satellites.fix_memory_s == 0.0
    assert vehicle.satellites == replace(walker.satellites, fix_memory_s=14.0)
    for one, made in ((False, walker), (True, vehicle)):
        assert BayesFilter(vehicle=one).over_area(area).satellites == made.satellites


def test_the_usual_motion_of_vehicles():
    model = BayesFilter(vehicle=True).over_area(Town.of(1).area()).model
    motion = model.motion
    assert motion.heading_sd_rad == pytest.approx(np.radians(1.5))
    assert motion.bias_drift_rad_per_sqrt_m == pytest.approx(np.radians(0.25))
    assert motion.rate_rad_per_m == pytest.approx(np.radians(0.01))
    assert (motion.scale_sd, motion.stretch_sd) == (0.02, 0.02)
    # No steel beside a compass, and no phone that is put into another pocket.
    assert (motion.disturbances_per_m, motion.remounts_per_m) == (0.0, 0.0)
    assert (model.weights.leave_per_m, model.weights.off_cost_per_m) == (3e-4, 0.15)


def test_the_usual_errors_of_vehicles_take_the_place_of_defaults_only():
    found = BayesFilter(vehicle=True, scale=0.05).resolved
    assert (found.step_sd_m, found.heading_sd_deg, found.drift_deg_per_sqrt_m) == (0.05, 1.5, 0.25)
    assert (found.off_cost_per_m, found.scale) == (0.15, 0.05)
    for vehicle in (None, False):
        given = BayesFilter(vehicle=vehicle)
        assert given.resolved == given


def test_the_least_numbers_of_particles():
    found = BayesFilter(min_search_particles=10, min_particles=10, max_particles=100)
    assert (found.min_search_particles, found.min_particles) == (10, 10)
    most = BayesFilter(max_particles=10_000_000, min_particles=10_000_000)
    assert most.min_particles == most.max_particles
    for name, wrong in (("min_particles", 9), ("min_search_particles", 9),
                        ("min_search_particles", 10_000_001)):  # fmt: skip
        with pytest.raises(ConfigError, match=f"{name}: "):
            BayesFilter(**{name: wrong})


def test_as_many_particles_at_least_as_at_most_are_no_fault():
    assert BayesFilter(max_particles=500, min_particles=500).min_particles == 500
    with pytest.raises(ConfigError, match="min_particles <= max_particles"):
        BayesFilter(max_particles=500, min_particles=501)


def test_errors_of_levels_share_what_is_stated():
    given = BayesFilter(level_error_db=2 * TOTAL_DB, level_correlation_m=300.0)
    levels = given.over_area(make_area()).model.evidence.levels
    assert levels.slow_db == pytest.approx(14.0)
    assert levels.fast_db == pytest.approx(8.0)
    assert levels.white_db == pytest.approx(6.6)
    assert (levels.slow_m, levels.fast_m) == (300.0, 30.0)


def test_each_option_reaches_its_part():
    given = BayesFilter(
        map_weight_per_m=0.2, off_cost_per_m=0.09, report_spacing_m=7.0, max_particles=900,
        min_search_particles=800, min_particles=300, switch_mass=0.9, switch_hold_m=33.0,
        smooth=True, satellite_sd_m=3.0, antenna_height_m=55.0, antenna_height_sd_m=66.0,
        timing_step_m=78.1, timing_sd_m=120.0, threads=3,
    )  # fmt: skip
    found = given.over_area(make_area())
    weights, known = found.model.weights, found.options
    assert (weights.weight_per_m, weights.off_cost_per_m) == (0.2, 0.09)
    assert (found.model.evidence.spacing_m, found.model.evidence.use_levels) == (7.0, True)
    assert (known.max_particles, known.min_search_particles, known.min_particles) == (900, 800, 300)
    assert (known.switch_mass, known.switch_hold_m) == (0.9, 33.0)
    gnss, timing = found.satellites, found.timing
    assert (gnss.zenith_m, gnss.height_m, gnss.height_sd_m) == (3.0, 55.0, 66.0)
    assert (timing.step_m, timing.advance_sd_m) == (78.1, 120.0)
    assert (found.smooth, found.model.threads.count, found.grid) == (True, 3, False)
    assert found.positioned is None
    assert found.carriageways is None


@pytest.mark.parametrize("area", [make_area(), without_cells()], ids=["cells", "map alone"])
def test_a_position_is_claimed_as_the_option_says(area):
    for mass in (0.9, 0.9995):
        found = BayesFilter(switch_mass=0.97, claim_mass=mass).over_area(area)
        assert found.rules.claimed_from == mass
    rules = BayesFilter(claim_mass=0.9).over_area(make_area()).rules
    assert (rules.converge_log_odds, rules.map_nats_per_m) == (-12.0, 0.04)


def test_the_map_alone_asks_for_more_particles_more_mass_and_a_longer_way():
    given = BayesFilter(max_particles=500, min_search_particles=400, min_particles=300)
    found = given.over_area(without_cells())
    options, rules = found.options, found.rules
    assert (options.max_particles, options.min_search_particles) == (1500, 1200)
    assert options.min_particles == 300
    assert (options.switch_mass, options.switch_hold_m) == (0.998, 200.0)
    assert (rules.converge_log_odds, rules.map_nats_per_m) == (-8.0, 0.03)
    # Where positions are measured all is as asked for.
    positioned, other = found.positioned
    assert (positioned.max_particles, positioned.min_search_particles) == (500, 400)
    assert (positioned.switch_mass, positioned.switch_hold_m) == (0.995, 20.0)
    assert (other.converge_log_odds, other.map_nats_per_m) == (-12.0, 0.04)
    # Stricter ones stay.
    strict = replace(given, switch_mass=0.9995, switch_hold_m=250.0).over_area(without_cells())
    assert (strict.options.switch_mass, strict.options.switch_hold_m) == (0.9995, 250.0)


def test_carriageways_locate_vehicles_over_areas_without_cells():
    vehicle = BayesFilter(vehicle=True, switch_mass=0.9, switch_hold_m=30.0)
    lanes = vehicle.over_area(without_cells()).carriageways
    # By what is asked for, and not by the rule of the map alone.
    assert (lanes.options.switch_mass, lanes.options.switch_hold_m) == (0.99, 50.0)
    assert lanes.options.max_particles == 60_000
    assert vehicle.over_area(make_area()).carriageways is None
    assert vehicle.over_area(without_cells(carriageway_m=None)).carriageways is None
    assert BayesFilter().over_area(without_cells()).carriageways is None


@pytest.mark.parametrize(
    ("vehicle", "cells", "watched"),
    [(None, True, True), (False, True, True), (True, True, False), (None, False, False),
     (True, False, False)],
)  # fmt: skip
def test_phones_are_turned_by_walkers_among_cells_only(vehicle, cells, watched):
    area = make_area() if cells else without_cells()
    assert BayesFilter(vehicle=vehicle).over_area(area).holds.watched is watched


def test_a_vehicle_has_its_own_motion_whatever_its_headings_errors_are():
    walker = BayesFilter(heading_sd_deg=30.0).over_area(make_area()).model
    assert walker.motion.disturbances_per_m == pytest.approx(0.004)
    assert (walker.motion.stretch_sd, walker.weights.leave_per_m) == (0.08, 1e-3)
    assert walker.motion.rate_rad_per_m == pytest.approx(radians(0.15))
    driven = BayesFilter(vehicle=True, heading_sd_deg=30.0).over_area(make_area()).model
    assert (driven.motion.heading_sd_rad, driven.motion.disturbances_per_m) == (radians(30.0), 0.0)


def test_only_vehicles_among_cells_may_have_speeds_with_another_scale_after_a_stop():
    among = BayesFilter(vehicle=True).over_area(make_area()).model.motion
    assert (among.rescales_per_m, among.rescaled_sd) == (1 / 1000, pytest.approx(0.06))
    # A smaller error that is stated leaves smaller ones.
    stated = BayesFilter(vehicle=True, scale=0.005).over_area(make_area()).model.motion
    assert stated.rescaled_sd == pytest.approx(0.015)
    for options, area in (
        (BayesFilter(), make_area()),
        (BayesFilter(vehicle=True), without_cells()),
    ):
        assert options.over_area(area).model.motion.rescales_per_m == 0.0


def test_vehicles_are_taken_to_drive_before_their_speed_is_measured():
    driven = BayesFilter(vehicle=True).over_area(make_area()).begin(("serving",)).watch
    walked = BayesFilter().over_area(make_area()).begin(("serving",)).watch
    assert (driven.pace.speed_mps, walked.pace.speed_mps) == (7.0, 1.4)
    assert driven.pace.rows == 0
    positioner, rng = BayesFilter(vehicle=True).over_area(make_area()), np.random.default_rng(1)
    begun = positioner.begin_at(*LATTICE.east_north(4, 3), 5.0, rng)
    assert begun.watch.pace == driven.pace
    assert driven.has_motion is walked.has_motion


@pytest.mark.parametrize(
    ("options", "nats_per_m"),
    [
        (BayesFilter(), 0.04),
        # Else the null hypothesis would gain by each metre that nothing measured.
        (BayesFilter(vehicle=True), 0.04),
        (BayesFilter(off_cost_per_m=0.02), 0.02),
    ],
)
def test_a_way_that_nothing_measured_costs_no_more_than_under_the_null_hypothesis(
    options, nats_per_m
):
    model = options.over_area(make_area()).model
    state, before = np.zeros((STATES, 20), dtype=np.float32), np.full(20, -3.0)
    unmeasured = MotionStep(10.0, np.nan, np.nan, 8.0)
    _, after = model.move(state, before, unmeasured, np.uint64(5))
    np.testing.assert_allclose(before - after, 10.0 * nats_per_m)


def test_a_grid_is_on_the_device_that_is_asked_for():
    found = GridFilter().over_area(make_area())
    assert (found.grid, found.device.name) == (True, "cpu")


@pytest.mark.parametrize(
    ("rows", "cells", "whole", "tiled"),
    [
        # 1000 columns; a level of each cell and two more: 10⁸ of them are held whole.
        (20_000, 3, False, False),
        (20_001, 3, False, True),
        (20_001, 3, True, False),
        (33_334, 1, False, True),
        (33_333, 1, False, False),
        # Without levels there is nothing to hold by tiles.
        (90_000, 0, False, False),
    ],
)
def test_which_areas_are_held_by_tiles(monkeypatch, rows, cells, whole, tiled):
    lattice, plan = SimpleNamespace(rows=rows, cols=1000), CellPlan("EPSG:32632", ())
    database = SimpleNamespace(
        lattice=lattice, field=lambda: "field", plan=plan, floor_dbm=FLOOR_DBM
    )
    monkeypatch.setattr(opened_area, "received_cells", lambda _: ("A", "B", "C")[:cells])
    by_tiles = SimpleNamespace(of_database=lambda one: ("tiles", one))
    monkeypatch.setattr(opened_area, "TiledArea", by_tiles)
    held = SimpleNamespace(of_field=lambda *given: given)
    monkeypatch.setattr(opened_area, "AreaMap", held)
    expected = ("tiles", database) if tiled else ("field", plan, FLOOR_DBM)
    assert opened_area.open_area(database, whole=whole) == expected
    if not whole:
        assert opened_area.open_area(database) == expected
    # So it is at the front door; an exact grid needs the whole of it.
    given = SimpleNamespace(**vars(database), measured=lambda: None)
    opened = []
    monkeypatch.setattr(tested.BayesFilter, "over_area", lambda _, area: opened.append(area))
    for one in (BayesFilter(), GridFilter()):
        one.over(given)
    assert opened[1] == ("field", plan, FLOOR_DBM)
    if not whole:
        assert (opened[0][0] == "tiles") is tiled


class Surveyed:
    """A database of measured levels, whose inputs had some roles."""

    lattice, plan, floor_dbm = LATTICE, "plan", FLOOR_DBM

    def __init__(self, *roles):
        self.manifest = {"inputs": [{"role": role} for role in roles]}

    def measured(self):
        return "measured"

    def field(self):
        return "field"


@pytest.mark.parametrize(
    ("roles", "map_sd_m"),
    [(("tracks", "levels"), 16.0), (("tracks", "map"), 3.0), (("tracks", "roads"), 3.0),
     (("levels",), 3.0), (("map",), 3.0)],
)  # fmt: skip
def test_options_that_are_not_given_are_those_of_surveys_over_one(monkeypatch, roles, map_sd_m):
    monkeypatch.setattr(tested, "filled_field", lambda field, measured: (field, measured))
    held = SimpleNamespace(of_field=lambda *given: (given, make_area())[1])
    monkeypatch.setattr(tested, "AreaMap", held)
    asked = []
    over_survey = lambda bound, *given: (asked.append(given), bound)[1]  # noqa: E731
    monkeypatch.setattr(surveys, "over_survey", over_survey)
    database = Surveyed(*roles)
    bound = BayesFilter(level_weight=0.8).over(database)
    assert asked == [(database, "measured")]
    assert bound.made_of == BayesFilter(level_weight=0.8)
    assert bound.model.weights.sd_m == map_sd_m
    assert bound.model.evidence.levels.weight == 0.8
    assert bound.model.evidence.levels.device_db == 2.0
    assert (bound.options.switch_mass, bound.options.switch_hold_m) == (0.95, 60.0)
