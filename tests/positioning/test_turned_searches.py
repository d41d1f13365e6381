"""A phone that is turned before a position was found: some hypotheses of the search are, too."""

from dataclasses import replace
from math import log, pi

import numpy as np
import pytest
from made_town import Town, walk_log
from true_places import error_m

from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import BIAS, STATES
from mapfilter.positioning.bayes.beliefs.belief_changes import turned_at_jump
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.merging import epochs
from mapfilter.tracks.log import make_log

TOWN = Town.of(1)
AREA = BayesFilter(heading_sd_deg=6.0, claim_mass=0.95).over_area(TOWN.area())
FEW = {
    "claim_mass": 0.95,
    "max_particles": 5000,
    "min_search_particles": 3000,
    "min_particles": 800,
}


def watching(positioner):
    """Rows of the made town are 5 m long."""
    return replace(positioner, holds=replace(positioner.holds, longest_row_m=6.0))


def not_watching(positioner):
    return replace(positioner, holds=HoldRules(watched=False))


SMALL = BayesFilter(heading_sd_deg=6.0, **FEW).over_area(AREA.area)
SEEDS = range(1, 9)


def turned_log(seed, by_rad, turned_s=20.0):
    """A walk of 240 s whose headings are off by an angle from a time on."""
    log = walk_log(TOWN, seed, error_db=3.0)
    motion = log.motion.copy()
    motion.loc[motion["time_s"] > turned_s, "heading_rad"] += by_rad
    motion["heading_rad"] = wrap_rad(motion["heading_rad"].to_numpy())
    return make_log(log.crs, motion=motion, radio=log.radio, truth=log.truth)


def searched(positioner, log, seed):
    """Search for a position; return errors, and whether they are claimed."""
    rng, state, rows = np.random.default_rng(seed), positioner.begin(), []
    for epoch in epochs(log):
        state, output = positioner.step(state, epoch, rng)
        if output is None or output.fix is None:
            continue
        fix = output.fix
        off_m = error_m(log, fix)
        rows.append((off_m, fix.status in (Status.CONVERGED, Status.TRACKING)))
    return np.array(rows).T


# Few hypotheses find too few of the walks that are turned by 2 rad.
@pytest.mark.parametrize(("by_rad", "area"), [(pi, SMALL), (2.0, AREA)], ids=["pi", "2.0"])
def test_a_phone_that_is_turned_during_the_search_is_found_more_often(by_rad, area):
    """Without turned hypotheses no position is found any more, as none fits both headings."""
    claimed, wrong = {}, {}
    for name, positioner in (("turned", watching(area)), ("none", not_watching(area))):
        found = [searched(positioner, turned_log(seed, by_rad), seed) for seed in SEEDS]
        claimed[name] = np.mean([on.mean() for _, on in found])
        wrong[name] = np.mean([(on * (off_m > 50)).mean() for off_m, on in found])
    assert claimed["turned"] > claimed["none"] + 0.05
    assert wrong["turned"] <= wrong["none"] + 0.01


def test_who_really_turns_is_found_as_before():
    """At the town's corners, of 90°, six of a thousand hypotheses walk straight on."""
    watched = watching(SMALL)
    never = replace(watched, holds=replace(watched.holds, probability=1e-9))
    claimed = [
        np.mean([searched(one, walk_log(TOWN, seed, error_db=3.0), seed)[1] for seed in SEEDS])
        for one in (watched, never)
    ]
    assert claimed[0] > claimed[1] - 0.05


def belief_of(count):
    state = np.zeros((STATES, count), np.float32)
    state[BIAS] = 3.0
    weight = np.full(count, -log(count))
    bins = Bins.over((0.0, 0.0, 100.0, 100.0))
    return ParticleBelief(state, weight, bins, np.zeros((1, count), np.float32))


@pytest.mark.parametrize(
    ("changed_rad", "share"),
    [(2.0, 0.1), (-2.0, 0.1), (pi, 0.3), (-2.62, 0.3), (2.61, 0.1), (2 * pi - 2.0, 0.1)],
)
def test_how_many_are_turned_and_by_how_much(changed_rad, share):
    rules = HoldRules(probability=0.1, around_probability=0.3)
    before = belief_of(20_000)
    belief = turned_at_jump(before, rules, changed_rad, np.random.default_rng(1))
    turned = belief.state[BIAS] != np.float32(3.0)
    # Four standard deviations of a binomial share.
    assert turned.mean() == pytest.approx(share, abs=4 * (share * (1 - share) / 20_000) ** 0.5)
    assert belief.state[BIAS, turned] == pytest.approx(float(wrap_rad(3.0 - changed_rad)), abs=1e-6)
    others = [row for row in range(STATES) if row != BIAS]
    assert (belief.state[others] == 0).all()
    assert (before.state[BIAS] == 3.0).all()
