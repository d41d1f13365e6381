"""Pages that commands write: replays, several side by side, and databases."""

from itertools import pairwise

import numpy as np
import pytest
from command_line import ONE, assert_done, assert_refused, mapfilter, settings

import mapfilter as mf
from mapfilter.positioning.estimate_store import read_estimate
from mapfilter.viewing.arrays import unpacked
from mapfilter.viewing.page import read_page

NAMES = ("bayes", "candidate")


@pytest.fixture(scope="module")
def replays(world, tmp_path_factory):
    """The first log by two filters, each with its page."""
    out = tmp_path_factory.mktemp("views")
    for name in NAMES:
        given = ["--db", world.database, "--log", world.journeys / ONE, "--filter", name]
        particles = {
            "filter__bayes__max_particles": 2000,
            "filter__bayes__min_search_particles": 1500,
            "filter__bayes__min_particles": 500,
        }
        few = settings(output__pictures="none", **particles)
        assert_done(mapfilter("replay", *given, "--html", "--out", out / name, *few))
    return out


@pytest.fixture(scope="module")
def bundle(replays):
    return read_page(replays / "bayes" / "replay.html")


def test_several_databases_are_refused_as_such(world, tmp_path):
    done = mapfilter("view", world.database, world.database, "--out", tmp_path / "view.html")
    assert_refused(done, "one database alone, found a database beside others", "mapfilter merge")
    assert not (tmp_path / "view.html").exists()


def test_only_older_pages_are_replaced(world, replays, tmp_path):
    """Files of other programs, pages that are shown and databases were, without a word."""
    page, own = tmp_path / "view.html", "<p>A report of my own.</p>"
    page.write_text(own)
    view = ("view", world.database, "--out")
    assert_refused(mapfilter(*view, page), "nothing yet, or an older page", "another program")
    assert page.read_text() == own
    assert_done(mapfilter(*view, tmp_path / "other.html"))
    assert_done(mapfilter(*view, tmp_path / "other.html"))
    shown = replays / NAMES[0] / "replay.html"
    before = shown.read_bytes()
    both = [replays / name for name in NAMES]
    assert_refused(mapfilter("view", *both, "--out", shown), "another place than an input")
    assert shown.read_bytes() == before
    inside = world.database / "view.html"
    assert_refused(mapfilter(*view, inside), "which is an input")
    assert not inside.exists()


def test_epochs_are_those_of_the_estimate(bundle, replays):
    estimate = read_estimate(replays / "bayes" / "estimate.parquet")
    (run,) = bundle["runs"]
    found, (east, north) = run["epochs"], bundle["frame"]["origin"]
    assert found["count"] == len(estimate)
    assert np.array_equal(unpacked(found["time"]), estimate.time_s)
    assert unpacked(found["east"]) + east == pytest.approx(estimate.east_m, abs=0.051, nan_ok=True)
    assert unpacked(found["north"]) + north == pytest.approx(
        estimate.north_m, abs=0.051, nan_ok=True
    )
    status = [bundle["statuses"][code] for code in unpacked(found["status"])]
    assert status == [str(one) for one in estimate.status]
    assert unpacked(found["r95"]) == pytest.approx(estimate.radii_m[:, 2], rel=1e-5, nan_ok=True)


def test_sums_of_contributions_are_those_of_their_rows(bundle):
    found = bundle["runs"][0]["explained"]
    first = unpacked(found["first"])
    for name in ("lead", "runner", "alt"):
        rows, sums = unpacked(found[name]), unpacked(found[f"{name}_sum"])
        parts = [rows[a:b] for a, b in pairwise(first)]
        assert sums == pytest.approx([part.sum() for part in parts], abs=1e-6, nan_ok=True)
    assert np.isfinite(unpacked(found["lead_sum"])).sum() > 10
    terms = {found["terms"][code] for code in unpacked(found["what"])}
    assert {"streets", "serving", "level"} <= terms


def test_readings_have_cells_levels_and_reasons(bundle, world):
    run = bundle["runs"][0]
    radio = mf.read_log(world.journeys / ONE).radio
    found = run["readings"]
    assert unpacked(found["first"])[-1] == len(radio)
    cells = [bundle["cells"][at]["id"] for at in unpacked(found["cell"])]
    plan = mf.open_database(world.database).plan
    by_carrier = {(cell.arfcn, cell.bsic): cell.id for cell in plan.cells}
    carriers = zip(radio["arfcn"], radio["bsic"], radio["cell"], strict=True)
    assert sorted(cells) == sorted(
        cell if cell is not None else by_carrier[arfcn, bsic] for arfcn, bsic, cell in carriers
    )
    used = {bundle["reasons"][code] for code in unpacked(found["use"])}
    assert used <= {"used", "not_moved_enough"}
    assert set(bundle["words"]) == set(bundle["reasons"])
    near = unpacked(found["level"]) - unpacked(found["predicted"])
    assert np.nanmedian(np.abs(near)) < 15


def test_beliefs_hold_their_mass(bundle):
    found = bundle["runs"][0]["belief"]
    first, shade = unpacked(found["first"]), unpacked(found["mass"]).astype(float)
    peak = unpacked(found["peak"])
    for k in range(len(peak)):
        mass = np.sum((shade[first[k] : first[k + 1]] / 255) ** 2) * peak[k]
        assert mass == pytest.approx(1.0, abs=0.1)


def test_two_filters_side_by_side(replays, tmp_path):
    out = tmp_path / "both.html"
    paths = [replays / name for name in NAMES]
    found = assert_done(mapfilter("view", *paths, "--out", out, "--json")).json
    assert found["html"] == str(out)
    both = read_page(out)
    assert [run["name"] for run in both["runs"]] == [f"{ONE}, {name}" for name in NAMES]
    assert both["why"] is not None
    assert both["runs"][1]["explained"] is None
    assert out.stat().st_size < 5e6


def test_a_database(world, tmp_path):
    out = tmp_path / "db.html"
    assert_done(mapfilter("view", world.database, "--out", out))
    found = read_page(out)
    database = mf.open_database(world.database)
    assert (found["kind"], found["runs"]) == ("database", [])
    assert [cell["id"] for cell in found["cells"]] == list(database.cell_ids)
    server = unpacked(found["background"]["best"]["server"])
    assert set(server[server >= 0]) == set(database.points().best_server)
    levels, grid = found["levels"], found["levels"]["grid"]
    assert unpacked(levels["level"]).shape == (3, grid["rows"], grid["cols"])
    assert np.nanmax(np.abs(unpacked(levels["best"]) - np.nanmax(unpacked(levels["level"]), 0))) < 1
    lines = found["background"]["streets"]
    assert unpacked(lines["first"])[-1] == unpacked(lines["east"]).size > 10


def test_what_cannot_be_shown_is_named(world, tmp_path):
    refused = mapfilter("view", world.journeys, tmp_path / "none", "--out", tmp_path / "v.html")
    assert_refused(refused, "run mapfilter replay with --html", "nothing there")
    assert not (tmp_path / "v.html").exists()
    (tmp_path / "bound").mkdir()
    (tmp_path / "bound" / "bound.tif").touch()
    refused = mapfilter("view", tmp_path / "bound", "--out", tmp_path / "v.html")
    assert_refused(refused, "a result of mapfilter bound: name its database beside it")
    broken = tmp_path / "broken.html"
    broken.write_text("<html>")
    assert_refused(mapfilter("view", broken, "--out", tmp_path / "v.html"), "no bundle in it")


def test_notebooks_show_tables_and_pages(world):
    database, log = mf.open_database(world.database), mf.read_log(world.journeys / ONE)
    assert "<table>" in database._repr_html_()
    assert "rows of radio" in log._repr_html_()
    few = mf.BayesFilter(max_particles=1000, min_search_particles=800, min_particles=300)
    track = mf.locate(log, database, few, record=True)
    page = track.view()
    assert page.bundle["runs"][0]["explained"] is not None
    assert page._repr_html_().startswith("<iframe")
    plain = mf.locate(log, database, few)
    assert np.array_equal(plain.estimate.east_m, track.estimate.east_m, equal_nan=True)
    assert plain.view().bundle["runs"][0]["belief"] is None
