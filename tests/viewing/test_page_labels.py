"""Words of the page that tell things apart: names of runs, and labels beside marks of the map."""

import re

import made_bundle as made
import numpy as np
import pytest
from page_scripts import ran

from mapfilter.viewing.arrays import packed, places, unpacked

DRAWN = """MF.start(bundle); draw();
const run = MF.page.active(); const e = run.epochs; const view = { width: 600, height: 400 };
const camera = MF.makeCamera(() => {}); camera.scale = 1;
[camera.east, camera.north] = [e.east[0], e.north[0]];
"""


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["walk, bayes", "walk, candidate"], ["bayes", "candidate"]),
        (["Monday, bayes", "Tuesday, bayes"], ["Monday", "Tuesday"]),
        (["a, b, bayes", "a, c, bayes"], ["b", "c"]),
        (["a, bayes", "b, candidate"], ["a, bayes", "b, candidate"]),
        (["a, bayes", "a, bayes"], ["bayes", "bayes"]),
        (["a, a", "a, a, a"], ["a", "a, a"]),
        (["walk", "walk, bayes"], ["walk", "walk, bayes"]),
        (["walk, bayes"], ["bayes"]),
    ],
)
def test_names_are_told_apart_by_what_differs(names, words):
    assert ran("return MF.apart(names);", names=names) == words


def test_runs_of_one_log_are_chosen_by_their_filters():
    bundle = made.replay_bundle()
    for run, name in zip(bundle["runs"], ("bayes", "candidate"), strict=True):
        run["name"] = f"a log with a long name, {name}"
    task = """MF.start(bundle);
    const of = (id) => MF.byId("tools").all("select").find((one) => one.attributes.id === id)
      .options.map((one) => [one.textContent, one.attributes.title ?? null]);
    return [of("run"), of("second")];"""
    whole = [[f"{name}", f"a log with a long name, {name}"] for name in ("bayes", "candidate")]
    assert ran(task, bundle=bundle) == [whole, [["one map", None], *whole]]


@pytest.mark.parametrize(
    ("east_m", "north_m", "sides"),
    [
        (30.0, 5.0, {"runner": "start", "estimate": "end"}),
        (-30.0, 5.0, {"runner": "end", "estimate": "start"}),
        (30.0, 60.0, {"runner": "start", "estimate": "start"}),
        (-30.0, 60.0, {"runner": "start", "estimate": "start"}),
        (150.0, 0.0, {"runner": "start", "estimate": "start"}),
    ],
)
def test_labels_of_close_places_look_away_from_each_other(east_m, north_m, sides):
    task = """e.mass[0] = 0.75; e.runner_mass[0] = 0.25;
    e.runner_east[0] = e.east[0] + east; e.runner_north[0] = e.north[0] + north;
    const pen = MF.svgPen(camera, view);
    MF.drawMoment(pen, { ground: MF.page.ground, run, i: 0, density: null, place: null,
      show: { hypotheses: true } });
    return pen.document("made");"""
    drawn = ran(DRAWN + task, bundle=made.replay_bundle(), east=east_m, north=north_m)
    anchors = {words[:2]: side for side, words in re.findall(r'anchor="(\w+)"[^>]*>([^<]*)', drawn)}
    assert {"runner": anchors["25"], "estimate": anchors["75"]} == sides


@pytest.mark.parametrize(("left_m", "side"), [(0.0, "start"), (-180.0, "start"), (-220.0, "end")])
def test_the_start_is_not_written_beneath_the_buttons(left_m, side):
    """The buttons are at the right of a map of 600 pixels."""
    task = """[camera.east, camera.north] = [run.truth.east[0] + left, run.truth.north[0]];
    const pen = MF.svgPen(camera, view); MF.drawTruth(pen, run); return pen.document("made");"""
    drawn = ran(DRAWN + task, bundle=made.replay_bundle(), left=left_m)
    assert re.findall(r'anchor="(\w+)"[^>]*>start<', drawn) == [side]


def test_where_nothing_leads_there_is_nothing_to_compare():
    """Outside of the area the alternative may have a place, and the estimate none."""
    bundle = made.replay_bundle() | {"why": None}
    for run in bundle["runs"]:
        for name in ("east", "north"):
            run["epochs"][name] = places(np.full(made.EPOCHS, np.nan))
        if run["explained"]:
            count = len(unpacked(run["explained"]["lead_sum"]))
            run["explained"]["lead_sum"] = packed(np.full(count, np.nan), "f8")
            run["explained"]["alt_sum"] = packed(np.full(count, -3.0), "f8")
    task = """MF.start(bundle); draw(); press("n"); draw();
    const result = MF.compare(MF.page, MF.page.active(), 10, "alt", null);
    return [result.choices, MF.byId("side").textContent];"""
    choices, side = ran(task, bundle=bundle)
    assert choices == []
    assert "There is no estimate at this moment to compare with." in side
    assert "NaN" not in side
