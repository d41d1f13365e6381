"""Runs of a sweep share what is equal among them, and give what each gives by itself."""

import numpy as np
import pandas as pd
import pytest

from mapfilter._io import sha256_file
from mapfilter.config.load import load_config
from mapfilter.database.store import open_database
from mapfilter.evaluation.accuracy import accuracy
from mapfilter.evaluation.claims import claimed_radii
from mapfilter.experiments.sweep import table
from mapfilter.experiments.sweep.journeys import filter_rng, radio_log, sensed, true_path, truth_of
from mapfilter.experiments.sweep.run import sweep_runs
from mapfilter.experiments.sweep.world import opened_filter, scored_filter
from mapfilter.positioning.loop import locate
from mapfilter.workflows.build import run_build
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.sweep import load_sweep
from mapfilter.workflows.sweeps.plan import sweep_plans, sweep_world

TOWN = [
    "area.map=helsinki",
    "area.bbox=24.938,60.164,24.950,60.170",
    "journeys.radio=as_predicted",
    "journeys.length_m=500",
    "filter.name=bayes",
    "filter.bayes.max_particles=1500",
    "filter.bayes.min_search_particles=800",
    "filter.bayes.min_particles=300",
    "sweep.sigma_orient_deg=0,10",
    "sweep.routes=2",
    "sweep.draws=1",
    "output.pictures=none",
]


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A plan of four runs, its world and its databases."""
    folder = tmp_path_factory.mktemp("town")
    config = load_config(None, TOWN, out=folder)
    run_predict(config)
    run_build(config)
    config = load_sweep(None, TOWN, out=folder)
    (plan,), databases = sweep_plans(config)
    return plan, sweep_world(config, plan.radios), databases


def by_itself(plan, world, database, run):
    """Do a run with a filter, a route and reports of its own, and with all outputs."""
    truth = true_path(world, plan, run.route)
    log = sensed(
        plan, radio_log(world, plan, truth, run.route, run.radio, run.report_period_s), run
    )
    filter_ = run.reading.choice.over(open_database(database.path))
    found = locate(log, filter_, filter_rng(plan.seed, run)).estimate
    figures = accuracy(found, truth_of(truth)), claimed_radii(found, truth_of(truth))
    return found, table.row(run, *figures, str(found.status[-1]))


def test_runs_of_a_sweep_are_those_of_filters_of_their_own(prepared):
    plan, world, databases = prepared
    found = sweep_runs(plan, world, databases)
    alone = [
        by_itself(plan, world, databases[run.database], run)[1] for run in plan.select(0, plan.runs)
    ]
    pd.testing.assert_frame_equal(found, table.to_table(alone).to_pandas(), check_exact=True)
    assert found["switched"].any(), "runs that only search have no errors to compare"


def test_only_sweeps_leave_out_protection_levels(prepared):
    """Benchmarks open the same filters, and score how often errors exceed their levels."""
    plan, world, databases = prepared
    run = next(plan.select(0, 1))
    database = databases[run.database].path
    sha256 = sha256_file(database / "manifest.json")
    truth = true_path(world, plan, run.route)
    log = radio_log(world, plan, truth, run.route, run.radio, run.report_period_s)
    for opened, levels in ((opened_filter, True), (scored_filter, False)):
        filter_ = opened(database, sha256, run.reading.choice)
        found = locate(sensed(plan, log, run), filter_, filter_rng(plan.seed, run)).estimate
        assert np.isfinite(found.radius_99_m).any() == levels
