"""What is wrong with the command is said before anything is served."""

import sys
from contextlib import closing

import pytest
from workflows.command_line import assert_refused, mapfilter

from mapfilter.database.build import build_roads
from mapfilter.lattice import Lattice
from mapfilter.serving.server import listen
from mapfilter.serving.store import SessionStore
from mapfilter.workflows.bench import made_routes


@pytest.fixture(scope="module")
def database(cross):
    return cross.path


@pytest.fixture(autouse=True)
def _no_token(monkeypatch):
    monkeypatch.delenv("MAPFILTER_TOKEN", raising=False)


def test_without_the_extra_there_is_one_plain_message(database, monkeypatch):
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    for name in ("mapfilter.workflows.serve", "mapfilter.serving.server"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    outcome = mapfilter("serve", "--db", database)
    assert_refused(outcome, "pip install 'mapfilter[serve]'")


def test_other_machines_are_not_served_without_a_token(database):
    outcome = mapfilter("serve", "--db", database, "--host", "0.0.0.0", "--port", 0)
    assert_refused(outcome, "--host", "a token for other hosts")


def test_limits_are_checked_together(database):
    outcome = mapfilter(
        "serve", "--db", database, "--port", 70_000, "--sessions", 0, "--rate", "nan",
        "--idle", -1, "--body", 0,
    )  # fmt: skip
    assert_refused(outcome, "--port", "--sessions", "--rate", "--idle", "--body")


@pytest.mark.parametrize("token", ["short", "", "two words and more", "ümlaut" * 4, "a" * 5000])
def test_tokens_are_long_and_plain(database, tmp_path, token):
    (tmp_path / "token").write_text(token, encoding="utf-8")
    outcome = mapfilter("serve", "--db", database, "--token-file", tmp_path / "token")
    assert_refused(outcome, "token")
    if token not in ("",):
        assert token not in outcome.err


def test_only_states_that_can_be_saved_are_served(database):
    outcome = mapfilter("serve", "--db", database, "--port", 0, "--set", "filter.name=grid")
    assert_refused(outcome, "filter", "bayes")


def test_a_port_that_is_taken_is_named(database):
    with listen("127.0.0.1", 0, "") as taken:
        port = taken.getsockname()[1]
        assert_refused(mapfilter("serve", "--db", database, "--port", port), f"127.0.0.1:{port}")


def test_a_folder_in_use_by_another_service_is_named(database, tmp_path):
    with closing(SessionStore.in_folder(tmp_path, "another")):
        outcome = mapfilter("serve", "--db", database, "--port", 0, "--state", tmp_path)
    assert_refused(outcome, "--state", str(tmp_path), "in use")


def test_savings_need_a_folder(database):
    outcome = mapfilter("serve", "--db", database, "--port", 0, "--save-every", 5)
    assert_refused(outcome, "--save-every: expected nothing, as serve without --state takes none")


def test_over_roads_alone_no_report_is_located(tmp_path):
    lattice = Lattice("EPSG:32635", 385_000.0, 6_672_000.0, 5.0, 100, 100)
    build_roads(made_routes(lattice, 1000), tmp_path / "roads")
    given = ["--method", "knn", "--level-error", 7]
    outcome = mapfilter("serve", "--db", tmp_path / "roads", "--port", 0, *given)
    assert_refused(outcome, "--method", "--level-error", "without cells locates no reports")
