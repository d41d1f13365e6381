"""The floor of a database that is not told: that of the technologies of its plan."""

from dataclasses import replace

import pytest
from small_world import CRS, make_plan, make_world

from mapfilter.config.sections import Config
from mapfilter.database.build import build
from mapfilter.database.estimate import dry_run
from mapfilter.database.floor import floor_notes, floor_of, weak_points_note
from mapfilter.radio.cells import CellPlan


def _plan(*technologies):
    plan = make_plan()
    cells = (replace(cell, technology=t) for cell, t in zip(plan.cells, technologies, strict=True))
    return CellPlan(CRS, tuple(cells))


@pytest.mark.parametrize(
    ("technologies", "floor_dbm", "named"),
    [
        ((None, None, None), -104.0, None),
        (("GSM", None, "GSM"), -104.0, None),
        (("UMTS", "GSM", None), -115.0, "UMTS"),
        (("GSM", "UMTS", "LTE"), -125.0, "LTE"),
        (("NR", None, "LTE"), -125.0, "LTE and NR"),
    ],
)
def test_the_lowest_of_the_technologies_counts(technologies, floor_dbm, named):
    plan = _plan(*technologies)
    assert floor_of(plan) == floor_dbm
    note = f"database.floor_dbm = {floor_dbm:g} is taken, the usual one of {named} cells"
    notes = floor_notes(plan)
    assert [text.partition(";")[0] for text in notes] == ([note] if named else [])


def test_technologies_for_which_another_floor_is_usual_are_named():
    (note,) = floor_notes(_plan("GSM", "UMTS", "LTE"))
    assert note.endswith(
        "; it holds for GSM (usually -104) and UMTS (usually -115), too: a database has one floor"
    )
    for alike in ("NR", "LTE", None):
        assert ";" not in floor_notes(_plan("LTE", "NR", alike))[0]


def _levels(database):
    parts = (part for parts in database.level_parts.values() for part in parts)
    return sum(part.rows for part in parts)


def test_a_given_floor_stays_as_it_is():
    for plan in (_plan("LTE", "LTE", "NR"), CellPlan(CRS, ())):
        assert floor_of(plan, -104.0) == -104.0
        assert floor_of(plan, 0) == 0.0
        assert floor_notes(plan, -104.0) == ()


def test_a_configuration_states_none():
    assert Config().database.floor_dbm is None


def test_a_build_takes_and_records_the_floor(tmp_path):
    world, lte = make_world(tmp_path), _plan("LTE", "GSM", None)
    weak = replace(world.rasters, factor=1.3)
    levels = {}
    for name, plan, given in [
        ("unknown", world.plan, {}),
        ("lte", lte, {}),
        ("stated", lte, {"floor_dbm": -104.0}),
    ]:
        made = build(weak, plan, world.routes, tmp_path / name, tile_px=16, **given)
        assert made.manifest["parameters"]["floor_dbm"] == made.floor_dbm
        levels[name] = made.floor_dbm, _levels(made)
        estimate = dry_run(weak, plan, world.routes, tile_px=16, **given)
        assert estimate.levels == levels[name][1]
    assert [floor_dbm for floor_dbm, _ in levels.values()] == [-104.0, -125.0, -104.0]
    assert levels["lte"][1] > levels["unknown"][1] == levels["stated"][1]


def test_points_that_are_too_weak_for_the_floor_are_noted():
    counts = {"points": 1290, "points_below_floor": 2302, "points_without_level": 999}
    (note,) = weak_points_note(counts, -104.0)
    assert note.startswith("2302 of 3592 points left out: all of their levels are below ")
    assert "database.floor_dbm = -104 " in note
    assert "RSRP" in note
    assert weak_points_note(counts | {"points_below_floor": 60}, -104.0) == ()


@pytest.mark.parametrize(("weak", "noted"), [(0, False), (5, False), (6, True), (100, True)])
def test_up_to_five_percent_of_weak_points_are_usual(weak, noted):
    notes = weak_points_note({"points": 100 - weak, "points_below_floor": weak}, -104.0)
    assert [note.partition(" left")[0] for note in notes] == [f"{weak} of 100 points"] * noted
