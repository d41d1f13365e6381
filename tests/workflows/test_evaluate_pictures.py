"""Pictures and integrity of ``evaluate global-positioning``: of each case, or none."""

import json

import pytest
from command_line import assert_refused, mapfilter

from mapfilter.evaluation.stanford import REGIONS
from mapfilter.experiments.sweep.world import open_world
from mapfilter.workflows.evaluate import run_global_positioning
from mapfilter.workflows.evaluations import foreign as evaluate_foreign
from mapfilter.workflows.evaluations.foreign import load_foreign, run_foreign
from mapfilter.workflows.evaluations.runs import street_base
from mapfilter.workflows.evaluations.settings import load_benchmark

SMALL = [
    'area.map="manhattan"',
    "area.size_m=600,600",
    "area.resolution_m=10",
    "cells.sites=2",
    "cells.indoor=1",
    "journeys.length_m=250",
    "filter.bayes.max_particles=4000",
    "filter.bayes.switch_mass=0.8",
    "filter.bayes.switch_hold_m=5",
    "filter.bayes.min_search_particles=4000",
]
CASES = ("levels-6", "levels-bias10")


def foreign(out, *settings, **more):
    config, fixed = load_foreign(None, [*SMALL, *settings])
    return run_foreign(
        config, "foreign", out, runs=2, seed=1, cases=CASES, workers=1, fixed=fixed, **more
    )


def drawn(out):
    return {path.name for path in (out / "pictures").glob("*")}


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    out = tmp_path_factory.mktemp("usual")
    return out, foreign(out)


def test_each_case_has_its_diagram_and_its_worst_run(usual):
    out, _ = usual
    each = {f"{name}-{kind}.png" for name in CASES for kind in ("stanford", "worst")}
    assert drawn(out) == each | {"coverage.png"}


def test_a_case_that_no_route_has_drawn_has_neither_row_nor_picture(tmp_path):
    """Of one route with one case each there is one, with the worst run that is its only one."""
    config, fixed = load_foreign(None, SMALL)
    given = {"runs": 1, "seed": 1, "workers": 1, "fixed": fixed, "one_case": True}
    (case,) = run_foreign(config, "foreign", tmp_path, cases=CASES, **given).cases
    assert case.runs == 1
    of_it = {f"{case.name}-{kind}.png" for kind in ("stanford", "worst")}
    assert drawn(tmp_path) == of_it | {"coverage.png"}


def test_the_table_has_the_counts_and_all_intervals(usual):
    out, result = usual
    rows = json.loads((out / "table.json").read_text())["cases"]
    for row, case in zip(rows, result.cases, strict=True):
        regions = [row[f"epochs_{name}"] for name in REGIONS]
        assert sum(regions) > 0
        assert row["available"] == pytest.approx(row["epochs_available"] / sum(regions))
        shares = ("coverage_50", "coverage_67", "coverage_95", "coverage_99", "off_50m")
        for name in (*shares, "wrong_converged", "hazardous", "exceeded", "false_lost_per_km"):
            low, high = row[f"{name}_low"], row[f"{name}_high"]
            # One run alone has no interval, and two with one converged have none of it.
            if row[name] is not None and low is not None:
                assert low <= row[name] <= high, name
        assert case.protection_m > 0


def test_no_pictures_where_none_are_wanted(tmp_path):
    foreign(tmp_path / "none", 'output.pictures="none"')
    assert not (tmp_path / "none" / "pictures").exists()


def test_the_alert_limit_and_the_risk_are_part_of_the_benchmark(tmp_path, usual):
    _, plain = usual
    wide = foreign(
        tmp_path, "integrity.alert_limit_m=1e5", "integrity.risk=1e-2", 'output.pictures="none"'
    )
    for one, other in zip(plain.cases, wide.cases, strict=True):
        assert other.protection_m <= one.protection_m
        assert other.coverage_95 == one.coverage_95
        assert other.exceeded >= one.exceeded
        assert other.epochs_unavailable < one.epochs_unavailable
    given = [arg for setting in SMALL for arg in ("--set", setting)]
    again = mapfilter(
        "evaluate", "global-positioning", "--world", "foreign", *given, "--runs", 2, "--seed", 1,
        "--case", CASES[0], "--case", CASES[1], "--out", tmp_path, "--resume", "--workers", 1,
    )  # fmt: skip
    assert_refused(again, "benchmark.json", "integrity")


def test_the_plain_world_has_them_too(tmp_path):
    config, fixed = load_benchmark("plain", None, SMALL)
    result = run_global_positioning(
        config, tmp_path, runs=1, seed=1, cases=("cell-6",), workers=1, fixed=fixed
    )
    assert drawn(tmp_path) == {"coverage.png", "cell-6-stanford.png", "cell-6-worst.png"}
    assert result.cases[0].runs == 1


def test_maps_name_the_owner_of_their_streets(usual):
    out, _ = usual
    streets = open_world(out / "world" / "streets")
    base = street_base(streets, "© somebody")
    assert base.attribution == "© somebody"
    assert base.bounds_m == streets.lattice.bounds_m
    assert len(base.streets) == streets.network.node_a.size
    first = base.streets[0]
    ends = streets.network.node_a[0], streets.network.node_b[0]
    assert [tuple(end) for end in first] == [
        (streets.network.east_m[end], streets.network.north_m[end]) for end in ends
    ]


def test_the_map_of_a_run_is_that_of_its_area(tmp_path, monkeypatch):
    given = []

    def record(*_, base, **__):
        given.append(base)
        return []

    monkeypatch.setattr(evaluate_foreign, "run_cases", record)
    box = "area.bbox=24.9410,60.1650,24.9490,60.1700"
    for settings in (["area.map=helsinki", box], SMALL[:5]):
        config, fixed = load_foreign(None, settings)
        run_foreign(
            config, "foreign", tmp_path / str(len(given)), runs=1, seed=1, cases=CASES[:1],
            workers=1, fixed=fixed,
        )  # fmt: skip
    assert "OpenStreetMap" in given[0].attribution
    assert given[1].attribution == ""
