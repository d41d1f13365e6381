"""Figures of one command are never replaced by those of another."""

import json
import shutil

import pytest
from command_line import ONE, assert_done, assert_refused, contents, mapfilter, settings

from mapfilter.workflows.replays import located_log as replay_log


@pytest.fixture(scope="module")
def commands(world):
    """Each command on the same log, with its results in the same folder."""

    def replay(log, *out):
        given = "-c", world.toml, "--db", world.database, *settings(output__pictures="none")
        return mapfilter("replay", *given, "--log", log, *out)

    def locate(log, *out):
        # The method that is fitted soonest.
        given = "--db", world.database, "--method", "centroid"
        return mapfilter("locate", *given, "--log", log, *out)

    return {"replay": replay, "locate": locate}


@pytest.fixture(scope="module")
def found(world, commands, tmp_path_factory):
    """Results of each command for the same log; nobody may change them."""
    folder = tmp_path_factory.mktemp("found")
    for name, command in commands.items():
        assert_done(command(world.journeys / ONE, "--out", folder / name))
    return folder


@pytest.mark.parametrize(
    ("first", "second", "told"),
    [
        (
            "replay",
            "locate",
            "expected figures of mapfilter locate, or nothing yet, found those of",
        ),
        ("locate", "replay", "expected figures of a replay, or nothing yet, found those of mapfi"),
    ],
)
def test_a_folder_of_another_command_is_refused(
    first, second, told, commands, found, world, tmp_path
):
    out, log = ("--out", tmp_path / "located"), world.journeys / ONE
    shutil.copytree(found / first, tmp_path / "located")
    before = contents(tmp_path / "located")
    assert_refused(commands[second](log, *out), "figures.json: ", told, "another folder by --out")
    assert contents(tmp_path / "located") == before
    assert_done(commands[first](log, *out))


def test_figures_of_nobody_are_left_as_they_are(commands, log, tmp_path):
    folder = tmp_path / "located"
    folder.mkdir()
    (folder / "figures.json").write_text("mine", encoding="utf-8")
    for command in commands.values():
        assert_refused(command(log, "--out", folder), "or nothing yet, found others")
    assert (folder / "figures.json").read_text(encoding="utf-8") == "mine"


def test_the_folder_of_one_log_of_several_is_looked_at_too(commands, world, found, tmp_path):
    shutil.copytree(found / "locate", tmp_path / "all" / ONE)
    before = contents(tmp_path / "all")
    assert_refused(commands["replay"](world.journeys, "--out", tmp_path / "all"), f"{ONE}/figures")
    assert contents(tmp_path / "all") == before


def test_the_folders_of_all_logs_are_looked_at_before_the_first_is_located(
    commands, world, tmp_path, monkeypatch
):
    last = max(path.name for path in world.journeys.iterdir() if path.is_dir())
    assert last != ONE
    (tmp_path / "all" / last).mkdir(parents=True)
    (tmp_path / "all" / last / "figures.json").write_text('{"mine": 1}', encoding="utf-8")
    located = []
    monkeypatch.setattr(replay_log, "locate", lambda *given, **_: located.append(given))
    out = "--out", tmp_path / "all"
    assert_refused(commands["replay"](world.journeys, *out), f"{last}/figures.json", "found others")
    assert not located


def test_results_of_several_logs_are_replaced_by_those_of_another_replay(commands, world, tmp_path):
    for _ in range(2):
        assert_done(commands["replay"](world.journeys, "--out", tmp_path / "all"))


@pytest.mark.parametrize("damage", ["", '{"log": "my-wa'])
@pytest.mark.parametrize("command", ["replay", "locate"])
def test_damaged_figures_beside_files_of_the_command_are_replaced(
    command, damage, commands, found, world, tmp_path
):
    folder, log = tmp_path / "located", world.journeys / ONE
    shutil.copytree(found / command, folder)
    whole = (folder / "figures.json").read_text(encoding="utf-8")
    (folder / "figures.json").write_text(damage, encoding="utf-8")
    other = "locate" if command == "replay" else "replay"
    assert_refused(commands[other](log, "--out", folder), "or nothing yet, found others")
    assert_done(commands[command](log, "--out", folder))
    again = json.loads((folder / "figures.json").read_text(encoding="utf-8"))
    assert again.keys() == json.loads(whole).keys()


def test_the_default_folders_differ(commands, log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert_done(commands["replay"](log, "--out", "located"))
    assert_done(commands["locate"](log))
    assert (tmp_path / "located-reports" / "positions.csv").is_file()
