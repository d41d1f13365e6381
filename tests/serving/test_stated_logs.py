"""A session that states what a log states gives what a located log gives, to the byte."""

import asyncio
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from asking import SERVING, SMALL, ask, documents, service
from positioning.cross_world import make_plan

import mapfilter as mf
from mapfilter.api.python_words import in_python
from mapfilter.positioning.log_options import LogStatement, fitted_to_statement
from mapfilter.radio.identities import TIMING_STEP_M
from mapfilter.tracks.log import make_log

LTE = {"technology": "LTE"}
BARS = {"level_step_db": 10.0}
CAR = {"vehicle": True}
FIELDS = ("time_s", "east_m", "north_m", "mass_50m", "protection_m")


def stating(stated):
    """The walk on the cross as a log that states something, and its epochs as a client sends."""
    _, log = documents()
    radio, places = log.radio.copy(), log.truth.set_index("time_s")
    if "technology" in stated:
        sites = {cell.id: (cell.east_m, cell.north_m) for cell in make_plan().cells}
        away_m = [
            np.hypot(*(places.loc[time_s, ["east_m", "north_m"]].to_numpy(float) - sites[cell]))
            for time_s, cell in zip(radio["time_s"], radio["cell"], strict=True)
        ]
        steps = np.floor(np.array(away_m) / TIMING_STEP_M["LTE"]).astype(int)
        radio = radio.assign(timing_advance=steps, technology="LTE")
    if "level_step_db" in stated:
        radio = radio.assign(level_step_db=10.0)
    given = make_log(log.crs, motion=log.motion, radio=radio, start_utc_s=log.start_utc_s)
    given = replace(given, vehicle=stated.get("vehicle"))
    rows = {"motion": _by_time(given.motion), "radio": _by_time(given.radio)}
    sent = [
        {"time_s": time_s, **{name: of.get(time_s, []) for name, of in rows.items()}}
        for time_s in sorted({*rows["motion"], *rows["radio"]})
    ]
    return given, sent


def _by_time(table):
    """The known values of a table's rows, by their time."""
    found = {}
    for row in table.to_dict("records"):
        known = {key: value for key, value in row.items() if not pd.isna(value)}
        found.setdefault(known.pop("time_s"), []).append(known)
    return found


def same_fixes(fixes, estimate):
    assert [one["status"] for one in fixes] == list(estimate.status)
    for name in FIELDS:
        found = np.array([one[name] for one in fixes], dtype=np.float64)
        expected = getattr(estimate, name)
        expected = np.where(np.isfinite(expected), expected, np.nan)
        np.testing.assert_array_equal(found, expected)


async def post(app, session, sent):
    answers = []
    for first in range(0, len(sent), 200):
        part = {"epochs": sent[first : first + 200]}
        answers.append(await ask(app, "POST", f"/sessions/{session}/epochs", part))
    return answers


@pytest.mark.parametrize("stated", [LTE, BARS, CAR, LTE | BARS])
def test_a_session_gives_what_locate_gives(positioner, cross, tmp_path, stated):
    log, sent = stating(stated)
    located = mf.locate(log, cross, SMALL, seed=0)
    answers = []
    with service(positioner, cross.plan, tmp_path) as made:

        async def begin():
            app = made.app()
            body = {"seed": 0, "log": stated}
            begun = (await ask(app, "POST", "/sessions", body)).json
            answers.extend(await post(app, begun["id"], sent[:100]))
            await made.sessions.save_all()
            return begun

        begun = asyncio.run(begin())
    assert begun["log"] == {"technology": None, "level_step_db": 0.0, "vehicle": None} | stated
    # Of a service the options are keys of its configuration.
    in_words = [in_python(note) for note in begun["notes"]]
    assert in_words == list(located.log.notes[len(log.notes) :])
    assert begun["notes"]
    with service(positioner, cross.plan, tmp_path) as made:
        answers += asyncio.run(post(made.app(), begun["id"], sent[100:]))
    assert [one.code for one in answers] == [200] * len(answers)
    assert [one.json["notes"] for one in answers] == [[]] * len(answers)
    same_fixes([fix for one in answers for fix in one.json["fixes"]], located.estimate)


def test_a_loop_of_ones_own_gives_what_locate_gives(cross):
    log, _ = stating(LTE | BARS)
    options, notes = fitted_to_statement(SMALL, LogStatement(**LTE, **BARS))
    bayes, rng = options.over(cross), np.random.default_rng(0)
    state, east_m = bayes.begin(), []
    for epoch in mf.epochs(log):
        state, output = bayes.step(state, epoch, rng)
        east_m.append(output.fix.east_m)
    located = mf.locate(log, cross, SMALL, seed=0)
    np.testing.assert_array_equal(east_m, located.estimate.east_m)
    assert notes == located.log.notes[len(log.notes) :]


def epoch(**row):
    return {"epochs": [{"time_s": 1.0, "radio": [{**SERVING, **row}]}]}


def answer_to(positioner, cross, stated, body):
    with service(positioner, cross.plan) as made:

        async def run():
            app = made.app()
            session = (await ask(app, "POST", "/sessions", {"log": stated})).json["id"]
            return await ask(app, "POST", f"/sessions/{session}/epochs", body)

        return asyncio.run(run())


@pytest.mark.parametrize(
    ("stated", "technology", "hint"),
    [({}, "LTE", '"log": {"technology": "LTE"}'), (LTE, "GSM", "leave it out"), ({}, "NR", "")],
)
def test_timing_advances_in_other_steps_are_refused(positioner, cross, stated, technology, hint):
    answer = answer_to(positioner, cross, stated, epoch(technology=technology, timing_advance=2))
    (fault,) = answer.json["error"]["errors"]
    assert (answer.code, fault["location"]) == (400, "epochs[0].radio[0].timing_advance")
    assert hint in fault["message"]
    for row in ({"technology": technology}, {"timing_advance": 2}):
        assert answer_to(positioner, cross, stated, epoch(**row)).code == 200


def test_words_for_technologies_are_understood_as_in_a_log(positioner, cross):
    sent = epoch(technology="4G", timing_advance=2)
    assert answer_to(positioner, cross, LTE, sent).code == 200
    assert "those of 'LTE'" in answer_to(positioner, cross, {}, sent).json["error"]["message"]


def test_steps_of_levels_that_no_session_states_are_noted(positioner, cross):
    row = {"level_step_db": 10.0}
    (note,) = answer_to(positioner, cross, {}, epoch(**row)).json["notes"]
    assert "levels in steps of 10 dB count as exact" in note
    assert '"log": {"level_step_db": 10}' in note
    assert answer_to(positioner, cross, BARS, epoch(**row)).json["notes"] == []
    assert answer_to(positioner, cross, {}, epoch(censored=-1, **row)).json["notes"] == []


@pytest.mark.parametrize(
    ("given", "where"),
    [
        (1, "log"),
        ({"technolgy": "LTE"}, "log"),
        ({"technology": "UMTS"}, "log.technology"),
        ({"technology": []}, "log.technology"),
        ({"level_step_db": -1}, "log.level_step_db"),
        ({"level_step_db": "10"}, "log.level_step_db"),
        ({"vehicle": 1}, "log.vehicle"),
    ],
)
def test_what_a_log_cannot_state_is_refused(positioner, cross, given, where):
    with service(positioner, cross.plan) as made:
        answer = asyncio.run(ask(made.app(), "POST", "/sessions", {"log": given}))
    (fault,) = answer.json["error"]["errors"]
    assert (answer.code, fault["location"]) == (400, where)


def test_nothing_stated_is_the_usual_filter(positioner, cross):
    log, sent = stating({})
    located = mf.locate(log, cross, SMALL, seed=0)
    nothing = {"technology": None, "level_step_db": 0, "vehicle": None}
    with service(positioner, cross.plan) as made:

        async def run():
            app = made.app()
            begun = (await ask(app, "POST", "/sessions", {"seed": 0, "log": nothing})).json
            assert made.sessions.all[begun["id"]].stated == LogStatement()
            return begun, await post(app, begun["id"], sent)

        begun, answers = asyncio.run(run())
    assert begun["notes"] == []
    same_fixes([fix for one in answers for fix in one.json["fixes"]], located.estimate)
