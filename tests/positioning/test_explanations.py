"""Why is the belief here: contributions of readings, against the filter's own evidence."""

import copy
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite, nan

import numpy as np
import pytest
from made_town import CRS, NAMES, SOUTH_M, WEST_M, Town, walk_log
from report_terms import Place, Report, report_terms
from scipy.special import logsumexp

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import Status
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.area.area_frame import BELOW_FLOOR_DB
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.filter import Hypotheses
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs
from mapfilter.radio.cells import CellPlan
from mapfilter.viewing import explain as module
from mapfilter.viewing.explain import explain
from mapfilter.viewing.page_constants import constants
from mapfilter.viewing.trace import Thinned, TraceRecorder, density

TOWN = Town.of(1)
EVERYWHERE_M = 1e9
OPTIONS = BayesFilter(max_particles=2000, min_search_particles=1500, min_particles=500)


@dataclass(frozen=True, eq=False)
class LteTown(Town):
    """A town whose cells take turns on some carriers."""

    carriers: int = 1

    def plan(self):
        cells = super().plan().cells
        each = ((cell, 6300 + k % self.carriers) for k, cell in enumerate(cells))
        return CellPlan(CRS, tuple(replace(c, technology="LTE", arfcn=n) for c, n in each))


@pytest.fixture(scope="module")
def town_filter():
    return OPTIONS.over_area(TOWN.area())


@pytest.fixture(scope="module")
def walk():
    return walk_log(TOWN, 2, 300.0, error_db=2.0)


@pytest.fixture(scope="module")
def steps(town_filter, walk):
    """States before and after each step, the epoch, the generator before it, and the output."""
    rng, state, found = np.random.default_rng(3), town_filter.begin(), []
    for epoch in epochs(walk):
        before, drawn = state, copy.deepcopy(rng)
        state, output = town_filter.step(before, epoch, rng)
        found.append((before, epoch, drawn, state, output))
    return found


def explained(town_filter, step):
    before, epoch, drawn, _, output = step
    fix, (east_m, north_m) = output.fix, output.evidence[:2]
    lead = fix.east_m - WEST_M, fix.north_m - SOUTH_M
    drawn = copy.deepcopy(drawn)
    return explain(town_filter, before, epoch, drawn, lead, (east_m - WEST_M, north_m - SOUTH_M))


def test_contributions_add_up_to_the_evidence_of_the_filter(town_filter, steps, monkeypatch):
    """Of the set of all particles they are what the filter adds to its log evidence."""
    monkeypatch.setattr(module, "NEAR_M", EVERYWHERE_M)
    compared, total = 0, 0.0
    for step in steps:
        before, _, _, after, output = step
        found = explained(town_filter, step)
        if found is None:
            continue
        # What the map says of steps between two reports waits for the next one.
        total += sum(row.lead for row in found.rows) + found.withheld
        if after.takeovers > before.takeovers or not isfinite(output.fix.east_m):
            total = nan
        gained = after.belief.log_evidence - before.belief.log_evidence
        if gained != 0:
            if isfinite(total):
                assert total == pytest.approx(gained, abs=1e-6)
                compared += 1
            total = 0.0
    assert compared > 5


def test_contributions_to_the_alternative_add_up_to_its_evidence(town_filter, steps):
    compared = 0
    for before, epoch, drawn, _, _ in steps[1:]:
        belief = before.belief
        if belief.summary.mass_50m > 0.8:
            continue
        beside = AlternativeHypothesis(
            belief, before.reckoning.travelled_m, belief.log_evidence, epoch.time_s
        )
        # A belief that has not been weighed since waits with what the map says of it.
        waiting = float(np.log(np.sum(np.exp(belief.log_weight))))
        state = replace(before, alternative=beside)
        after, output = town_filter.step(state, epoch, copy.deepcopy(drawn))
        other = after.alternative
        if other is None or other.belief.log_evidence == belief.log_evidence:
            continue
        found = explained(town_filter, (state, epoch, drawn, after, output))
        gained = other.belief.log_evidence - belief.log_evidence
        total = sum(row.alternative for row in found.rows) + found.alternative_withheld
        assert total + waiting == pytest.approx(gained, abs=2e-6)
        compared += 1
    assert compared > 5


@pytest.fixture(scope="module")
def tracked(town_filter, walk):
    """A state that follows from a known start, the next epoch, the generator, the estimate."""
    rng, start = np.random.default_rng(3), walk.truth.iloc[0]
    state = town_filter.begin_at(start["east_m"], start["north_m"], 5.0, rng)
    *first, epoch = epochs(walk)[:21]
    for one in first:
        state, output = town_filter.step(state, one, rng)
    return state, epoch, rng, output.fix


@pytest.mark.parametrize(("distrusts", "rows"), [("belief", 1), ("alternative", 2)])
def test_a_fix_that_only_the_belief_or_its_alternative_uses(town_filter, tracked, distrusts, rows):
    """Where readings have led one of them away they are on trial; the other one uses them."""
    before, epoch, rng, fix = tracked
    own, others = (
        {**before.sources, "gnss": replace(before.sources["gnss"], distrusted=distrusts == one)}
        for one in ("belief", "alternative")
    )
    made_of = before.reckoning.travelled_m, before.belief.log_evidence, epoch.time_s
    beside = AlternativeHypothesis(before.belief, *made_of, sources=others)
    state = replace(before, sources=own, alternative=beside)
    alone = replace(epoch, radio=(), gnss=GnssFix(fix.east_m, fix.north_m, 25.0, 25.0, 0.0))
    after, output = town_filter.step(state, alone, copy.deepcopy(rng))
    found = explained(town_filter, (state, alone, rng, after, output))
    assert [row.what for row in found.rows] == ["streets", "gnss"][:rows]
    assert [row.alternative for row in found.rows[1:]] == [0.0] * (rows - 1)


def test_differences_add_up_to_the_change_of_log_odds(town_filter, steps):
    """Independently: each particle's whole likelihood at once, and sums of weights."""
    compared = 0
    for step in steps:
        before, epoch, drawn, _, output = step
        found = explained(town_filter, step)
        if found is None or np.isnan([row.runner for row in found.rows]).any():
            continue
        state, updates, measured = town_filter.evidence_at(before, epoch, copy.deepcopy(drawn))
        reading = next((update.radio for update in updates if update.radio is not None), None)
        if reading is None:
            continue
        belief = state.belief
        weighed = np.zeros(belief.log_weight.size)
        tracked = measured and belief.status is Status.TRACKING
        town_filter.model.weigh(belief.cloud, weighed, replace(reading, tracked=tracked))
        odds = []
        for east_m, north_m in (
            (output.fix.east_m, output.fix.north_m),
            output.evidence[:2],
        ):
            apart_m = np.hypot(
                belief.state[0] - (east_m - WEST_M), belief.state[1] - (north_m - SOUTH_M)
            )
            near = apart_m <= 50.0
            prior = np.exp(before.belief.log_weight[near].astype(np.longdouble))
            after = np.exp((belief.log_weight + weighed)[near].astype(np.longdouble))
            odds.append(float(np.log(after.sum()) - np.log(prior.sum())))
        shown = sum(row.lead - row.runner for row in found.rows)
        assert shown == pytest.approx(odds[0] - odds[1], abs=1e-6)
        compared += 1
    assert compared > 5


def test_contributions_are_those_by_which_the_step_itself_weighs(town_filter, walk, monkeypatch):
    """The weights are caught inside the step: of a belief that is tracked levels count less."""
    caught, weigh = [], BayesModel.weigh

    def catching(model, cloud, log_weight, reading):
        before = log_weight.copy()
        answer = weigh(model, cloud, log_weight, reading)
        caught.append((cloud.state.copy(), before, log_weight.copy()))
        return answer

    monkeypatch.setattr(module, "NEAR_M", 8.0)
    compared, rng, start = 0, np.random.default_rng(3), walk.truth.iloc[0]
    after = town_filter.begin_at(start["east_m"], start["north_m"], 5.0, rng)
    for epoch in epochs(walk):
        before, drawn = after, copy.deepcopy(rng)
        caught.clear()
        with monkeypatch.context() as patch:
            patch.setattr(BayesModel, "weigh", catching)
            after, output = town_filter.step(before, epoch, rng)
        if before.belief.status is not Status.TRACKING:
            continue
        lead_m = output.fix.east_m - WEST_M, output.fix.north_m - SOUTH_M
        runner_m = lead_m[0] + 10.0, lead_m[1]
        found = explain(town_filter, before, epoch, copy.deepcopy(drawn), lead_m, runner_m)
        if not caught or len(found.rows) < 2:
            continue
        state, prior, posterior = caught[0]
        odds = []
        for east_m, north_m in (lead_m, runner_m):
            near = np.hypot(state[0] - east_m, state[1] - north_m) <= 8.0
            odds.append(logsumexp(posterior[near]) - logsumexp(prior[near]))
        shown = sum(row.lead - row.runner for row in found.rows[1:])
        if not isfinite(odds[0] - odds[1]):
            continue
        assert shown == pytest.approx(odds[0] - odds[1], abs=1e-6)
        compared += 1
    assert compared > 5


def test_every_reading_has_its_row(town_filter, steps):
    somewhere = (step for step in steps[10:] if isfinite(step[4].fix.east_m))
    used = ((step, explained(town_filter, step)) for step in somewhere)
    step, found = next(one for one in used if len(one[1].rows) > 1)
    rows = list(step[1].radio)
    assert [row.what for row in found.rows][:2] == ["streets", "serving"]
    levels = [row for row in found.rows if row.what == "level"]
    assert [NAMES[row.cell] for row in levels] == [row.cell for row in rows]
    assert [row.measured_dbm for row in levels] == pytest.approx(
        [row.level_dbm for row in rows], abs=1e-4
    )
    fix = step[4].fix
    # Beyond the town its edge counts.
    place = np.clip([fix.east_m - WEST_M, fix.north_m - SOUTH_M], 0.1, 899.9)
    at = _pixel(town_filter.area.level_dbm, place)
    assert [row.lead_dbm for row in levels] == [float(at[row.cell]) for row in levels]


def test_nothing_to_explain_before_the_first_belief(town_filter, steps):
    assert steps[0][0].belief is None
    assert explained(town_filter, steps[0]) is None


def test_recording_changes_nothing_and_keeps_every_status(town_filter, walk):
    plain = locate(walk, town_filter, np.random.default_rng(3)).estimate
    recorder = TraceRecorder(town_filter)
    seen = locate(walk, town_filter, np.random.default_rng(3), recorder=recorder).estimate
    assert np.array_equal(plain.east_m, seen.east_m, equal_nan=True)
    assert np.array_equal(plain.radii_m, seen.radii_m, equal_nan=True)
    assert (plain.status, plain.unused) == (seen.status, seen.unused)
    assert len(recorder.moments) == len(seen)
    changes = [k for k, (a, b) in enumerate(pairwise(seen.status), start=1) if a is not b]
    assert set(changes) <= set(recorder.frames.kept)


@pytest.mark.parametrize("carriers", [1, 2, 6])
def test_a_report_by_itself_is_as_the_model_has_it(walk, carriers):
    """The page's arithmetic against the model's kernels, for a report without any before it."""
    filter_ = OPTIONS.over_area(replace(LteTown.of(1), carriers=carriers).area())
    model, area = filter_.model, filter_.area
    rng, why = np.random.default_rng(8), constants(model)
    start, first = filter_.begin(), next(iter(epochs(walk)))
    _, updates, _ = filter_.evidence_at(start, first, np.random.default_rng(0))
    reading = next(update.radio for update in updates if update.radio is not None)
    reading = replace(reading, levels=reading.levels.with_absent([]))
    # Pixels of even predictions, so that the share of roughness under a fault hardly matters.
    place_m = rng.uniform(20, 880, (2, 40)).astype(np.float32)
    state = np.zeros((STATES, 40), dtype=np.float32)
    state[:2] = place_m
    cloud = Cloud(state, np.empty((0, 40), dtype=np.float32))
    weighed = np.zeros(40)
    model.weigh(cloud, weighed, reading)
    report = Report(
        reading.serving, reading.levels.cell.tolist(), reading.levels.level_dbm.tolist()
    )
    rough_db = 0.1 * area.flat_rough_db.reshape(area.level_dbm.shape)
    mean = np.mean([_pixel(rough_db, at)[report.cells] ** 2 for at in place_m.T], axis=0)
    why["other_rough_db2"] = float(np.mean(mean))
    for at, expected in zip(place_m.T, weighed, strict=True):
        levels = _pixel(area.level_dbm, at)[: len(NAMES)].astype(np.float64)
        quiet_dbm = area.floor_dbm - BELOW_FLOOR_DB
        of_layer = [np.sort([quiet_dbm, *levels[k % carriers :: carriers]]) for k in range(6)]
        best_dbm, second_dbm = (np.array([one[-nth] for one in of_layer]) for nth in (1, 2))
        place = Place(levels, _pixel(rough_db, at)[: len(NAMES)], best_dbm, second_dbm, 0.0)
        rows = report_terms(report, place, why, area.site_of.tolist())
        # The tables of the kernels have quarters of a dB.
        assert sum(nats for what, _, nats in rows if what != "streets") == pytest.approx(
            expected, abs=0.05
        )


def _pixel(values, at):
    rows = values.shape[0]
    return values[rows - 1 - int(at[1] // 5.0), int(at[0] // 5.0)]


def test_a_density_holds_all_mass_that_is_seen():
    rng = np.random.default_rng(1)
    east_m, north_m = rng.normal(500_000, 300, 20_000), rng.normal(4_500_000, 300, 20_000)
    weight = rng.exponential(size=20_000)
    frame = density(7, Hypotheses(east_m, north_m, weight / weight.sum()))
    assert frame.col.size <= 1000
    mass = (frame.shade / 255.0) ** 2 * frame.peak
    assert mass.sum() == pytest.approx(1.0, abs=0.02)
    middle = np.sum(mass * (frame.col + 0.5)) / mass.sum() * frame.step_m
    assert middle == pytest.approx(np.sum(weight * east_m) / weight.sum(), abs=5.0)


def test_thinning_keeps_even_steps_and_what_must_stay():
    thinned = Thinned(10)
    for epoch in range(100):
        if thinned.due(epoch) or epoch == 37:
            thinned.add(epoch, str(epoch), always=epoch == 37)
    assert len(thinned.kept) <= 10
    assert 37 in thinned.kept
    assert all(epoch % thinned.every == 0 for epoch in thinned.kept if epoch != 37)
