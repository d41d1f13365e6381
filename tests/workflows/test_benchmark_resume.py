"""A benchmark goes on with its own results, and with those of no other one."""

import json

import pytest
from command_line import assert_done, assert_refused, mapfilter, settings

from mapfilter._json_files import sealed

GIVEN = ["--filter", "candidate", "--case", "cell-6", "--runs", 1, "--workers", 1, "--json"]


def test_a_benchmark_is_resumed_on_its_own_map_only(world, tmp_path):
    out = tmp_path / "out"

    def evaluate(*more):
        given = ["-c", world.benchmark_toml, *GIVEN, "--out", out, *more]
        return mapfilter("evaluate", "global-positioning", *given)

    assert_done(evaluate())
    (batch,) = (out / "batches").glob("*.json")
    told = json.loads(batch.read_text())
    told["rows"][0] |= {"success": True, "error_mean_m": 77.0}
    edited = json.dumps(told)
    batch.write_text(json.dumps(sealed(told)))
    assert assert_done(evaluate("--resume")).json["cases"][0]["error_mean_m"] == 77.0
    batch.write_text(edited)
    again = assert_done(evaluate("--resume")).json["cases"][0]["error_mean_m"]
    assert again != 77.0, "a batch that was changed is done again"
    narrower = settings(area__bbox="24.9420,60.1660,24.9490,60.1697")
    assert_refused(evaluate("--resume", *narrower), "benchmark.json", "another world")
    assert_refused(evaluate("--resume", "--seed", 4), "another seed")
    # Begun anew, nothing of an older one is left to be taken for its own.
    (out / "batches" / "000005.json").write_text(batch.read_text())
    assert assert_done(evaluate()).json["cases"][0]["error_mean_m"] != 77.0
    assert list((out / "batches").iterdir()) == [batch]


def test_what_real_sessions_take_no_heed_of_is_refused(tmp_path):
    more = ["--case", "cell-6", "--filter", "grid", *settings(filter__bayes__scale=0.1)]
    told = mapfilter("evaluate", "ottawa", "--data", tmp_path, *more, "--out", tmp_path / "out")
    assert_refused(told, "--case", "--filter", "--set", "ottawa takes none")
    more = ["--seed", 1, "--resume"]
    told = mapfilter("evaluate", "single-reports", "--data", tmp_path, *more, "--out", tmp_path)
    assert_refused(told, "--seed", "--resume", "single-reports takes none")


def test_a_length_is_refused_where_cases_have_their_own(world, tmp_path):
    given = ["-c", world.benchmark_toml, "--out", tmp_path, *settings(journeys__length_m=300.0)]
    told = mapfilter("evaluate", "global-positioning", *given, "--case", "recovery-cell")
    assert_refused(told, "journeys.length_m", "recovery-cell", "--case")


@pytest.mark.long
def test_two_workers_find_what_one_finds(world, tmp_path):
    found = {}
    for workers in (1, 2):
        out = tmp_path / str(workers)
        given = ["--filter", "candidate", "--case", "cell-6", "--case", "satellites-1"]
        # Two routes are a batch.
        given += ["--runs", 3, "--workers", workers, "--out", out, "--json"]
        told = mapfilter("evaluate", "global-positioning", "-c", world.benchmark_toml, *given)
        assert_done(told)
        batches = sorted((out / "batches").glob("*.json"))
        rows = [row for batch in batches for row in json.loads(batch.read_text())["rows"]]
        found[workers] = [{**row, "seconds": None} for row in rows]
    assert len(found[1]) == 6
    assert found[1] == found[2]
