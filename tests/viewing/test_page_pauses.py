"""A run without an epoch for a while, as of a receiver that is jammed: the page says so."""

import made_bundle as made
import numpy as np
import pytest
from page_scripts import ran

from mapfilter.viewing.arrays import packed

SILENT_S = 120.0
LATE = made.EPOCHS // 2


@pytest.fixture(scope="module")
def bundle():
    """A replay whose second half is two minutes later."""
    found = made.replay_bundle()
    (run, *_) = found["runs"]
    time_s = np.arange(made.EPOCHS) + np.where(np.arange(made.EPOCHS) < LATE, 0.0, SILENT_S)
    late = run | {"epochs": run["epochs"] | {"time": packed(time_s, "f8")}}
    return found | {"why": None, "runs": [late]}


TASK = f"""
MF.start(bundle); draw();
const run = MF.page.active();
const at = [{LATE - 1}, {LATE} + 30, {LATE} + {SILENT_S}];
"""


def test_the_status_before_a_pause_does_not_go_on(bundle):
    """It was TRACKING all the way through two minutes without a measurement."""
    before, within, after = ran(TASK + "return at.map(run.statusAt);", bundle=bundle)
    assert within == "NO DATA"
    assert "NO DATA" not in (before, after)


def test_the_panel_and_the_slider_say_so(bundle):
    task = """return at.map((time) => { MF.page.seek(time); draw();
      return [MF.byId("side").textContent, MF.byId("transport").textContent]; });"""
    (before, _), (within, _), (after, _) = ran(TASK + task, bundle=bundle)
    assert within.startswith("This momentno data")
    assert "(last position, at " in within
    for one in (before, after):
        assert not one.startswith("This momentno data")
        assert "last position" not in one


def test_usual_times_between_epochs_are_no_pause():
    run = made.replay_bundle()["runs"][0]
    slow = run | {"epochs": run["epochs"] | {"time": packed(60.0 * np.arange(made.EPOCHS), "f8")}}
    found = made.replay_bundle() | {"why": None, "runs": [slow]}
    task = "MF.start(bundle); draw(); return MF.page.active().statusAt(90);"
    assert ran(task, bundle=found) != "NO DATA"


@pytest.mark.parametrize(("silent_s", "lines"), [(SILENT_S, 2), (0.0, 1)])
def test_the_track_is_cut_there(silent_s, lines):
    """It led straight on to where the next epoch was, through houses."""
    run = made.replay_bundle()["runs"][0]
    count = made.EPOCHS
    time_s = np.arange(count) + np.where(np.arange(count) < LATE, 0.0, silent_s)
    epochs = run["epochs"] | {"time": packed(time_s, "f8")}
    epochs |= {"status": packed(np.full(count, 2), "u1")}
    for name in ("east", "north"):
        epochs[name] = packed(np.linspace(0, 50, count), "f4")
    found = made.replay_bundle() | {"why": None, "runs": [run | {"epochs": epochs}]}
    task = """MF.start(bundle); draw();
    let drawn = 0;
    const camera = { x: (value) => 10 * value, y: (value) => -10 * value, scale: 10 };
    const pen = { camera, view: {}, path: (points) => { if (points.length > 1) drawn += 1; } };
    const run = MF.page.active();
    MF.drawTrack(pen, run, 0, run.count - 1, {});
    return drawn;"""
    assert ran(task, bundle=found) == lines


CHARTS = """const drawn = [];
const Before = globalThis.uPlot;
globalThis.uPlot = class extends Before {
  constructor(options, data, host) {
    super(options, data, host);
    drawn.push({ names: options.series.map((one) => one.label), data });
  }
};
MF.start(bundle); draw();
"""


def test_the_error_of_another_run_does_not_go_on_through_its_pause(bundle):
    """Beside a run with all epochs, its last error was drawn as if it were known."""
    (late,) = bundle["runs"]
    count = made.EPOCHS + int(SILENT_S)
    time_s = np.linspace(0, count - 1, made.EPOCHS)
    steady = late | {"name": "all", "epochs": late["epochs"] | {"time": packed(time_s, "f8")}}
    task = """const isOther = (name) => /^error, /.test(name);
    const { names, data } = drawn.find((one) => one.names.some(isOther));
    return [data[0], data[names.findIndex(isOther)]];"""
    found = ran(CHARTS + task, bundle=bundle | {"runs": [steady, late]})
    at_s, error_m = (np.array(one, dtype=float) for one in found)
    within = (at_s > LATE) & (at_s < LATE + SILENT_S - 1)
    assert within.any()
    assert np.isnan(error_m[within]).all()
    assert np.isfinite(error_m[~within]).any()


def test_a_cell_that_is_received_seldom_has_no_gaps():
    """Of a cell received every 40 s each stretch was cut, and no line was left."""
    task = """const page = { active: () => MF.page.active(), clock: String };
    const times = [0, 40];
    const series = [{ label: "a cell", values: [1, 2] }];
    MF.makeChart(page, { title: "levels", data: () => ({ times, series }) }).build();
    return drawn[drawn.length - 1].data[0];"""
    run = made.replay_bundle()["runs"][0]
    time_s = np.linspace(0, 40, made.EPOCHS)
    often = run | {"epochs": run["epochs"] | {"time": packed(time_s, "f8")}}
    found = made.replay_bundle() | {"why": None, "runs": [often]}
    assert ran(CHARTS + task, bundle=found) == [0, 40]
