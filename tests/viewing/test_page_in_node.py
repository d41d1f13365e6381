"""What the page shows and does, in node: moments, keys, links, numbers, layers."""

import made_bundle as made
import numpy as np
import pytest
from page_scripts import ran

from mapfilter.filters.contract import Reason
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.radio.cells import CellPlan
from mapfilter.viewing.arrays import packed, places, unpacked
from mapfilter.viewing.readings import report_rows, unused_of
from mapfilter.viewing.runs import _share

SIDE = 'const side = () => MF.byId("side").textContent;'
LIVE = """
const live = { run: MF.makeLiveRun(bundle, "phone"), state: "live", listeners: [] };
const fix = (number, status) => {
  live.run.push({ number, time_s: 10 + number, status, reason: "used", hypotheses: 1, way_id: 0,
    unused: [], east_m: null, runner_up_east_m: null,
    detail: { doubt: 0, alternative: null, readings: [], explained: null } });
  for (const one of live.listeners) one("live");
  draw();
  draw();
};
MF.start(bundle, live);
draw();
"""


def live_bundle():
    return made.database_bundle() | {"kind": "live", "place": "Made", "thresholds": {}}


def later(run, by_s):
    """The run with its times later."""
    epochs = run["epochs"] | {"time": packed(np.arange(made.EPOCHS) + by_s, "f8")}
    return run | {"epochs": epochs}


def test_the_first_report_is_shown_when_one_steps_to_it():
    bundle = made.replay_bundle() | {"why": None}
    for run in bundle["runs"]:
        if run["explained"]:
            run["explained"]["epoch"] = packed(np.arange(0, made.EPOCHS, 5) + 1, "u4")
    task = """MF.start(bundle); draw(); const before = side(); press("n"); draw();
    return [before, side()];"""
    before, after = ran(SIDE + task, bundle=bundle)
    assert "No radio report has been used yet" in before
    assert "No radio report has been used yet" not in after
    assert "Runner-up" in after


def test_times_of_a_session_that_are_dates_are_shown_as_dates():
    """They were seconds since 1970. A device's clock may count from its own start as well."""
    found = ran("return [1777629700.2, 95, null, -1].map(MF.moment);")
    assert found == ["2026-05-01 10:01:40 UTC", "95\u202fs", "–", "−1\u202fs"]


@pytest.mark.parametrize(("start_s", "shown"), [(0, ""), (1_777_629_700, " · 10:01:42 UTC")])
def test_the_page_of_a_session_shows_the_time_of_day(start_s, shown):
    live = LIVE.replace("time_s: 10 + number", f"time_s: {start_s} + number")
    task = 'fix(1, "SEARCHING"); fix(2, "LOST"); return MF.byId("transport").textContent;'
    assert ran(live + task, bundle=live_bundle()).endswith(f"0:01 / 0:01{shown}")


def test_the_first_fix_is_shown_and_what_replaces_it():
    task = """const found = [side()]; fix(1, "SEARCHING"); found.push(side());
    fix(1, "LOST"); found.push(side()); return found;"""
    before, first, again = ran(LIVE + SIDE + task, bundle=live_bundle())
    assert before.startswith("This momentwaiting")
    assert "No epoch has come yet" in before
    assert first.startswith("This momentsearching")
    assert "No epoch has come yet" not in first
    assert again.startswith("This momentlost")


@pytest.mark.parametrize(("radius_m", "shown"), [(80.0, "unavailable"), (None, "–")])
def test_a_protection_level_that_is_infinite_is_unavailable(radius_m, shown):
    """As in a replay; without a position there is none."""
    task = """live.run.push({ number: 1, time_s: 1, status: "TRACKING", reason: "used",
      hypotheses: 9, way_id: 0, unused: [], east_m: null, runner_up_east_m: null,
      radius_99_m: radius, protection_m: null });
    for (const one of live.listeners) one("live"); draw(); draw(); return side();"""
    found = ran(LIVE + SIDE + task, bundle=live_bundle(), radius=radius_m)
    assert f"Protection level{shown}Error" in found


@pytest.mark.parametrize("key", ["ArrowLeft", "ArrowRight", " "])
def test_keys_before_the_first_fix_leave_the_page_at_the_newest_one(key):
    task = """press(key); draw(); fix(1, "SEARCHING"); fix(2, "SEARCHING");
    const { follow, time, playing } = MF.page.store.state; return [follow, time, playing];"""
    assert ran(LIVE + task, bundle=live_bundle(), key=key) == [True, 12, False]


def test_a_link_to_a_run_names_it_in_the_tools():
    task = """window.location.hash = "#t=3&run=1"; MF.start(bundle);
    const run = MF.byId("tools").all("select").find((one) => one.attributes.id === "run");
    return [Number(run.value), MF.page.store.state.run];"""
    assert ran(task, bundle=made.replay_bundle()) == [1, 1]


@pytest.mark.parametrize("by_s", [0.3454, 1234567.1234567])
def test_a_link_opens_at_its_own_epoch(by_s):
    bundle = made.replay_bundle()
    bundle["runs"] = [later(run, by_s) for run in bundle["runs"]]
    task = """MF.start(bundle); draw(); press("ArrowRight"); draw();
    const { time } = MF.page.store.state; const found = MF.readAddress(MF.page).time;
    return [MF.page.active().at(time), MF.page.active().at(found)];"""
    assert ran(task, bundle=bundle) == [1, 1]


def test_a_link_that_is_copied_twice_keeps_its_name():
    task = """MF.start(bundle); draw();
    const later = []; globalThis.setTimeout = (task) => later.push(task);
    const link = MF.byId("tools").all("button").find((one) => one.textContent === "Link");
    for (let i = 0; i < 2; i += 1) { link.listeners.click({ currentTarget: link });
    await new Promise(setImmediate); }
    const between = link.textContent; for (const one of later) one();
    return [between === "Link", link.textContent];"""
    assert ran(task, bundle=made.replay_bundle()) == [False, "Link"]


@pytest.mark.parametrize("modifier", ["ctrlKey", "metaKey", "altKey"])
def test_the_browser_s_own_keys_do_not_zoom_a_map(modifier):
    task = """MF.start(bundle); draw(); const { sheet } = MF.page.maps[0];
    const { scale } = MF.page.camera;
    const pressed = (more) => { let stopped = false;
      sheet.listeners.keydown({ key: "+", target: sheet, preventDefault() { stopped = true;
    }, stopPropagation() {}, ...more });
      return [stopped, MF.page.camera.scale > scale]; };
    return [pressed({ [modifier]: true }), pressed({})];"""
    found = ran(task, bundle=made.replay_bundle(), modifier=modifier)
    assert found == [[False, False], [True, True]]


def test_space_ticks_a_box_that_has_the_focus():
    task = """MF.start(bundle); draw(); const box = new Node("input");
    box.closest = (names) => (names.includes("[type=checkbox]") ? box : null);
    return [press(" ", box), MF.page.store.state.playing, press(" "),
      MF.page.store.state.playing];"""
    assert ran(task, bundle=made.replay_bundle()) == [False, False, True, True]


def test_times_of_day_are_those_of_the_log():
    """A log's start is that of its time 0, which need not be that of an epoch."""
    bundle = made.replay_bundle()
    bundle["runs"] = [later(run, 60.3) for run in bundle["runs"]]
    task = 'MF.start(bundle); draw(); return MF.byId("transport").textContent;'
    assert "22:14:20 UTC" in ran(task, bundle=bundle)


def test_whole_seconds_are_not_lost_by_rounding():
    task = """return [MF.clock(4.1 - 0.1), MF.clock(59.9), MF.clock(-60), MF.clock(3600 - 1e-9),
      MF.clock(59.96, 1)];"""
    assert ran(task) == ["0:04", "0:59", "−1:00", "1:00:00", "1:00.0"]


def test_shares_near_one():
    given = [0.9981, 0.996, 0.98, 1.0]
    task = "return values.map(MF.share);"
    shown = ran(task, values=unpacked(_share(given)).tolist())
    assert shown == ["99.8\u202f%", "99.6\u202f%", "98\u202f%", "> 99.9\u202f%"]


def test_where_one_cell_is_received_there_is_no_margin():
    bundle = made.database_bundle()
    best = bundle["background"]["best"]
    best["margin"] = packed(np.full((made.ROWS, made.COLS), 63.0), "u1", scale=0.25, none=255)
    task = """MF.start(bundle); draw(); MF.page.store.set({ place: { east: 100, north: 100 } });
    draw(); return side();"""
    shown = ran(SIDE + task, bundle=bundle)
    assert "no second cell" in shown
    assert "63" not in shown.partition("Best server")[2].partition(".")[0]


def test_degrees_of_a_map_across_180_degrees():
    bundle = made.database_bundle()
    south, north = ([[lon, lat] for lon in (179.9, -179.9)] for lat in (-17.5, -17.4))
    bundle["frame"] |= {"corners": [*south, *reversed(north)]}
    task = """MF.start(bundle); const [width, height] = bundle.frame.size;
    return [0.25, 0.75].map((u) => MF.page.ground.lonLat(u * width, height / 2));"""
    west, east = ran(task, bundle=bundle)
    assert (west["lon"], west["lat"]) == pytest.approx((179.95, -17.45))
    assert (east["lon"], east["lat"]) == pytest.approx((-179.95, -17.45))


def test_a_bound_that_is_the_same_everywhere_is_drawn():
    bundle = made.database_bundle()
    value = packed(np.full((made.ROWS, made.COLS), 25.0), "u2", scale=0.5, none=65_535)
    one = {"grid": made.GRID, "value": value, "name": "b", "unit": "m", "range": [25.0, 25.0]}
    bundle["background"]["bound"] = [one]
    task = 'MF.start(bundle); return MF.page.layers("bound", 0).canvas.pixels[0];'
    assert ran(task, bundle=bundle) > 0


def test_lines_that_cross_a_saved_frame_are_in_it():
    task = """MF.start(bundle); const view = { width: 300, height: 200 };
    const pen = MF.svgPen(MF.page.camera, view);
    const { camera } = MF.page; camera.east = 0; camera.north = 0; camera.scale = 1;
    const at = (values) => ({ first: [0, 2], east: [-values, values], north: [0, 0] });
    pen.lines(at(5000), { stroke: "#000" });
    pen.lines({ first: [0, 2], east: [-9, 9], north: [900, 950] }, { stroke: "#000" });
    return [...pen.document("t").matchAll(/ d="([^"]*)"/g)].map((one) => one[1]);"""
    assert ran(task, bundle=made.replay_bundle()) == ["M-4850 100L5150 100", ""]


def test_a_vehicle_with_few_epochs_has_a_track():
    """What is more than a leap of a second may be a way of several."""
    bundle = made.replay_bundle()
    run = bundle["runs"][0]
    every = np.arange(made.EPOCHS)
    run["epochs"] |= {"time": packed(5.0 * every, "f8"), "east": places(100.0 * every)}
    run["epochs"]["status"] = packed(0 * every, "u1")
    task = """MF.start(bundle); const sizes = [];
    const pen = { view: { width: 300, height: 300 }, camera: MF.page.camera,
      path: (points) => sizes.push(points.length) };
    MF.page.camera.scale = 1; MF.drawTrack(pen, MF.page.runs[0], 0, 9, {});
    MF.page.runs[0].epochs.east[5] += 5000; MF.drawTrack(pen, MF.page.runs[0], 0, 9, {});
    return sizes.filter((one) => one > 1);"""
    assert ran(task, bundle=bundle) == [10, 5, 4]


def test_charts_show_no_value_before_the_first_one():
    """Levels of a cell that comes late, and a run that begins later than another."""
    bundle = made.replay_bundle()
    bundle["runs"][1] = later(bundle["runs"][1], 40)
    task = """MF.start(bundle); draw(); MF.page.store.set({ run: 1 }); draw();
    const before = MF.byId("charts").textContent; MF.page.seek(50); draw();
    return [before, MF.byId("charts").textContent];"""
    before, after = ran(task, bundle=bundle)
    assert "95 % radius–" in before
    assert "95 % radius20\u202fm" in after


def test_why_not_here_counts_a_cell_once_and_no_end_of_the_scale():
    bundle = made.replay_bundle()
    size = 4 * made.EPOCHS
    rows = {
        "cell": np.tile([0, 0, 1, 0], made.EPOCHS),
        "use": np.zeros(size, np.int64),
        "censored": np.tile([0, 0, -1, 0], made.EPOCHS),
    }
    packed_rows = {name: packed(one, "i1") for name, one in rows.items()}
    bundle["runs"][0]["readings"] |= packed_rows
    task = "MF.start(bundle); return MF.reportOf(MF.page, MF.page.runs[0], 0);"
    assert ran(task, bundle=bundle) == {"serving": 0, "bands": [0], "levels": [-61.5]}


def test_rows_of_a_report_tell_which_levels_are_ends_of_the_scale():
    ends = (0, -1, 1)
    report = tuple(ReportRow("neighbour", "A", None, None, -110.0, end) for end in ends)
    plan = CellPlan("EPSG:32635", ())
    rows = report_rows(Epoch(0.0, (), report), Reason.USED, ({}, frozenset()), plan, {})
    assert tuple(row.censored for row in rows) == ends


def test_of_rows_of_one_cell_the_last_ones_are_those_that_are_not_used():
    """Two reports of one second: the first serving cell counts."""
    report = tuple(ReportRow("serving", "A", None, None, level, 0) for level in (-70.0, -71.0))
    second = UnusedReading(0.0, "serving", "A", Reason.SECOND_SERVING_CELL)
    plan = CellPlan("EPSG:32635", ())
    for unused, uses in (
        ([second], [Reason.USED, second.reason]),
        ([second] * 2, [second.reason] * 2),
    ):
        rows = report_rows(Epoch(0.0, (), report), Reason.USED, unused_of(unused), plan, {})
        assert [row.use for row in rows] == uses


def test_a_narrow_scale_in_the_legend_has_three_numbers():
    bundle = made.database_bundle()
    task = """MF.start(bundle); const legend = new Node("details");
    const layer = { title: "b", unit: "m", range: [0.4, 1.3] };
    MF.fillLegend(legend, { bundle, run: null, layer, store: MF.page.store });
    return legend.all("span").slice(0, 3).map((one) => one.textContent);"""
    assert ran(task, bundle=bundle) == ["0.4", "0.9", "1.3"]
