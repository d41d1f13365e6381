"""No result is written into a database or a log, also where these are no inputs of the command."""

import pytest
from command_line import ONE, assert_refused, contents, mapfilter

from mapfilter.workflows.inputs.apart import check_in_no_store

STORES = {
    "a database": ("manifest.json", "points.parquet"),
    "a log": ("log.json", "motion.csv"),
}


@pytest.fixture(params=STORES)
def store(request, tmp_path):
    """A folder that others read, which the command does not."""
    (tmp_path / "other").mkdir()
    for name in STORES[request.param]:
        (tmp_path / "other" / name).write_text("{}")
    return tmp_path / "other", request.param


@pytest.mark.parametrize("inner", ["", "within"])
@pytest.mark.parametrize("command", ["bound", "view", "export", "replay", "locate", "film"])
def test_a_result_in_another_store_is_refused(command, inner, store, world, tmp_path):
    folder, what = store
    log = ("--db", world.database, "--log", world.journeys / ONE)
    place = folder / inner
    option, given = (
        "--out",
        {
            "bound": (world.database, "--out", place),
            "view": (world.database, "--out", place / "view.html"),
            "export": (world.database, "--to", place / "points.gpkg"),
            "replay": (*log, "--out", place),
            "locate": (*log, "--out", place),
            "film": (tmp_path / "page.html", "--out", place / "film.gif"),
        }[command],
    )
    option = "--to" if command == "export" else option
    before = contents(folder)
    told = f"{option}: expected a place outside {folder}, {what}, found "
    assert_refused(mapfilter(command, *given), told, "results need a folder of their own")
    assert contents(folder) == before


@pytest.mark.parametrize("name", ["manifest.json", "log.json"])
def test_files_of_other_programs_make_no_store(name, tmp_path):
    """As a web page's manifest, above a folder for results."""
    (tmp_path / name).write_text('{"name": "a page"}')
    check_in_no_store(tmp_path / "out" / "view.html")
