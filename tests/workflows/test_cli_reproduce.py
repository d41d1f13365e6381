"""A paper's experiments from the map to figure and table, on the embedded map, one run a cell."""

import csv
import math
from dataclasses import replace

import pytest
from command_line import assert_done, assert_refused, mapfilter

from mapfilter.evaluation.success_cells import SuccessCell
from mapfilter.experiments.papers import khalaf_allah_2007 as paper
from mapfilter.experiments.sweep.table import read_runs

ASKED = {
    "filter", "reading", "sigma_orient_deg", "sigma_trans_m", "runs", "success", "low", "high",
    "error_mean_m", "error_67_m", "error_95_m", "switch_distance_m",
}  # fmt: skip


def test_figure_table_and_numbers_of_the_paper(tmp_path):
    given = ["--map", "helsinki", "--bbox", "24.938,60.164,24.950,60.170", "--trials", 1]
    found = assert_done(
        mapfilter("reproduce", "khalaf-allah-2007", *given, "--out", tmp_path, "--json")
    ).json
    assert found["runs"] == sum(cell["runs"] for cell in found["success"])
    assert set(found["success"][0]) >= ASKED
    readings = {cell["reading"] for cell in found["success"]}
    assert len(readings) == len(found["fits"]) == 11
    grid = {
        (cell["sigma_trans_m"], cell["sigma_orient_deg"])
        for cell in found["success"]
        if cell["reading"] == paper.MAIN
    }
    assert len(grid) == 36
    assert [fit["misfit"] for fit in found["fits"]] == sorted(f["misfit"] for f in found["fits"])
    with (tmp_path / "table-4.csv").open(encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    assert rows[1] == ["Khalaf-Allah 2007", "15-20", "14-20", "52-56", "> 0.8", "> 0.65"]
    assert {row[0] for row in rows[2:]} == readings
    pictures = [path for path in tmp_path.iterdir() if path.suffix == ".png"]
    assert len(pictures) == 5
    assert all(picture.stat().st_size > 10_000 for picture in pictures)
    one = read_runs(tmp_path / "sweeps" / "2" / "runs.parquet")
    assert set(one["reading"]) == {paper.ONE_ROUTE}


@pytest.mark.parametrize("trials", [1, 7, 40, 100, 400])
def test_plans_hold_as_many_runs_as_asked(trials):
    for plan in paper.plans(trials, 0):
        assert trials <= plan.routes * plan.draws < trials + plan.routes
    main, one, *_ = paper.plans(400, 0)
    assert (main.routes, main.draws, one.routes, one.draws) == (40, 10, 1, 400)


def cell(reading, sigma_deg, success, *errors_m):
    place = dict.fromkeys(SuccessCell.__dataclass_fields__, 0.0)
    place |= {"reading": reading, "sigma_orient_deg": sigma_deg, "success": success}
    place |= {"sigma_trans_m": paper.ONE_SIGMA_TRANS_M}
    place |= dict(zip(paper.TABLE_4_M, errors_m, strict=True))
    return SuccessCell(**place)


def test_a_reading_that_holds_all_claims_fits_best():
    good = [cell("good", s, p, 17, 18, 54) for s, p in ((0, 0.9), (3, 0.82), (6, 0.7), (20, 0.1))]
    short = [replace(one, reading="short", success=one.success - 0.2) for one in good]
    far = [replace(one, reading="far", error_mean_m=40.0) for one in good]
    none = [cell("none", s, 0.0, *[math.nan] * 3) for s in (0, 3, 6)]
    found = paper.fits([*none, *short, *good, *far])
    assert [fit.reading for fit in found] == ["good", "short", "far", "none"]
    assert found[0].misfit == 0
    assert found[1].misfit == pytest.approx((0.18 + 0.15) / 2 / 2)
    assert found[2].misfit == pytest.approx(20 / 20 / 3 / 2)
    assert (found[0].success_3_deg, found[0].success_6_deg) == (0.82, 0.7)


def test_what_is_refused(tmp_path):
    out = ["--out", tmp_path]
    assert_refused(mapfilter("reproduce", "nobody-1900", *out), "khalaf-allah-2007")
    paper_name = "khalaf-allah-2007"
    assert_refused(mapfilter("reproduce", paper_name, "--bbox", "1,2,3", *out), "--bbox")
    assert_refused(mapfilter("reproduce", paper_name, "--map", "gone.osm.pbf", *out), "gone")
