"""The page in a browser: opened from disk with the network cut."""

import json
import xml.etree.ElementTree as ET
from contextlib import contextmanager
from math import floor

import made_bundle as made
import numpy as np
import pytest
from browser import Watched, opened
from report_terms import Place, Report, report_terms

from mapfilter.viewing.arrays import packed, places, starts, unpacked
from mapfilter.viewing.page import write_page

NAMELESS = """[...document.querySelectorAll('button, select, input, [role=application]')]
    .filter((one) => !(one.ariaLabel || one.innerText.trim() || one.closest('label'))).length"""


@pytest.fixture(scope="module")
def browser():
    with opened() as found:
        yield found


@pytest.fixture(scope="module")
def replay(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "replay.html"
    write_page(made.replay_bundle(), path)
    return path


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "database.html"
    write_page(made.database_bundle(), path)
    return path


@contextmanager
def page(browser, file, **options):
    watched = Watched(browser, file, **options)
    yield watched
    watched.close()


def place_at(level, east_m, north_m, layer=(0, 0, 0)):
    """What the made map has at a place, by its own rasters."""
    row = floor((made.GRID["north"] - north_m) / made.STEP_M)
    col = floor(east_m / made.STEP_M)
    here = np.where(np.isnan(level[:, row, col]), made.QUIET_DBM, level[:, row, col])
    best, second = (one[list(layer), row, col] for one in made.two_strongest(level, layer))
    return Place(here, np.full(3, 2.0), best, second, made.distances()[row, col])


def test_plays_pauses_steps_and_seeks(browser, replay):
    with page(browser, replay) as view:
        view.press("Space")
        view.until("MF.page.store.state.time > 1")
        view.press("Space")
        assert view.state("playing") is False
        view.press("Home")
        assert view.state("time") == 0
        for _ in range(3):
            view.press("ArrowRight")
        assert view.state("time") == 3
        view.press("ArrowLeft")
        view.press("PageUp")
        assert view.state("time") == 12
        view.page.locator("#time").fill("60.5")
        assert view.state("time") == pytest.approx(60.5, abs=0.01)
        view.settle()
        assert view.page.inner_text("#status") == "tracking"
        assert "1:00 of 1:59" in view.page.get_attribute("#time", "aria-valuetext")
        view.press("End")
        assert "lost" in view.page.inner_text("#live")
        assert view.page.evaluate("location.hash") == "#t=119"


def test_a_link_opens_at_its_moment_run_and_place(browser, replay):
    with page(browser, replay, at="#t=42.5&run=1&at=100,200") as view:
        assert view.state("time") == 42.5
        assert view.state("run") == 1
        assert view.state("place") == {"east": 100, "north": 200}
        view.page.evaluate("location.hash = '#t=nonsense&run=99&at=1'")
        view.settle()
        assert view.state("time") == 42.5


def test_contributions_shown_add_up(browser, replay):
    with page(browser, replay, at="#t=10") as view:
        rows = [
            float(one.get_attribute("data-nats"))
            for one in view.page.query_selector_all(".why tbody tr")
        ]
        shown = float(view.page.get_attribute(".why tfoot tr", "data-sum"))
        found = made.run("", 3.0)["explained"]
        lead, runner = (unpacked(found[key]) for key in ("lead_sum", "runner_sum"))
        assert len(rows) == 4
        assert sum(rows) == pytest.approx(shown, abs=1e-6)
        assert shown == pytest.approx(lead[2] - runner[2], abs=1e-6)
        # A reading that did not count is listed with its reason.
        assert "too near" not in view.page.inner_text(".why")
        view.press("ArrowRight")
        assert "ARFCN 1: too near" in view.page.inner_text("#side")


@pytest.mark.parametrize("layer", [(0, 0, 0), (1, 0, 1), (1, 0, 0), None])
def test_why_not_there_is_what_the_model_says(browser, tmp_path, layer):
    """The serving cell among those of its layer; in pages from before, among all."""
    write_page(made.with_layers(made.replay_bundle(), layer), tmp_path / "replay.html")
    with page(browser, tmp_path / "replay.html", at="#t=80&at=321,222") as view:
        rows = [
            float(one.get_attribute("data-nats"))
            for one in view.page.query_selector_all(".why tbody tr")
        ]
        level = made.level_rasters()
        report = Report(0, [0, 1], [-61.5, -72.0])
        places = (
            place_at(level, *at, layer or (0, 0, 0)) for at in ((240.0, 153.0), (321.0, 222.0))
        )
        here, there = (
            [nats for *_, nats in report_terms(report, place, made.WHY, [0, 1, 2])]
            for place in places
        )
        assert rows == pytest.approx(np.subtract(here, there).tolist(), abs=1e-6)
        shown = float(view.page.get_attribute(".why tfoot tr", "data-sum"))
        assert shown == pytest.approx(sum(here) - sum(there), abs=1e-6)


def test_a_click_on_the_map_asks_why_not_there(browser, replay):
    with page(browser, replay, at="#t=80") as view:
        box = view.page.locator(".sheet").first.bounding_box()
        view.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 3)
        view.settle()
        assert view.state("against") == "place"
        assert view.page.inner_text(".why .verdict").startswith("Taken by itself")
        view.press("Escape")
        assert view.state("place") is None
        view.page.locator(".sheet").first.focus()
        view.press("Enter")
        assert view.state("place") is not None
        view.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        assert "dBm" in view.page.inner_text(".tip >> visible=true")


def test_two_filters_share_their_time(browser, replay):
    with page(browser, replay) as view:
        maps = view.page.locator("article.map")
        assert maps.count() == 2
        view.page.evaluate("MF.page.seek(110)")
        view.settle()
        assert maps.locator(".pill").all_inner_texts() == ["lost", "lost"]
        view.press("2")
        assert view.state("run") == 1
        assert maps.nth(1).get_attribute("data-active") == "true"
        # The second run explains nothing, and has no reports to step through.
        assert view.page.get_by_role("button", name="Next report used").is_disabled()
        view.page.select_option("#second", "-1")
        view.settle()
        assert maps.count() == 1


def test_what_the_map_shows_can_be_switched_off(browser, replay):
    with page(browser, replay, at="#t=70") as view:
        pictures = "(MF.frameSvg(MF.page).match(/<image/g) || []).length"
        with_belief = view.page.evaluate(pictures)
        view.page.locator(".legend").first.evaluate("(one) => { one.open = true; }")
        view.page.get_by_label("belief", exact=True).first.uncheck()
        assert view.page.evaluate(pictures) == with_belief - 1


def test_names_of_others_are_text(browser, replay):
    with page(browser, replay) as view:
        assert view.page.locator("img, iframe, object, embed").count() == 0
        assert made.HOSTILE in view.page.inner_text("#title")
        assert view.page.locator("script").count() == 2


@pytest.mark.parametrize("width", [390, 1280])
def test_fits_a_phone_and_a_desk_light_and_dark(browser, replay, database, width):
    for file in (replay, database):
        with page(browser, file, width=width, scheme="dark", height=844) as view:
            color = "getComputedStyle(document.body.parentElement).backgroundColor"
            wide = "document.documentElement.scrollWidth - innerWidth"
            assert view.page.evaluate(wide) <= 0
            dark = view.page.evaluate(color)
            view.press("d")
            assert view.page.evaluate(color) != dark
            assert view.page.evaluate(wide) <= 0
            assert view.page.evaluate(NAMELESS) == 0


def test_the_frame_as_svg_and_png(browser, replay):
    with page(browser, replay, at="#t=70") as view:
        root = ET.fromstring(view.page.evaluate("MF.frameSvg(MF.page)"))
        words = " ".join(root.itertext())
        assert "walk, bayes · 1:10 · tracking" in words
        assert "made by hand" in words
        with view.page.expect_download() as waiting:
            view.page.get_by_role("button", name="Save the frame as PNG").click()
        assert waiting.value.suggested_filename == "walk-bayes-70s.png"
        assert waiting.value.path().read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_a_database_shows_levels_at_a_place(browser, database):
    with page(browser, database) as view:
        assert view.page.is_hidden("#transport")
        view.page.select_option("#layer", "level 1")
        view.page.evaluate("MF.page.store.set({ place: { east: 340.5, north: 81 } })")
        view.settle()
        level = made.level_rasters()[1, floor((300 - 81) / 5), 68]
        assert f"{level:.1f}".replace("-", "−") in view.page.inner_text(".levels tbody tr >> nth=0")
        assert "Predicted level of B" in view.page.inner_text(".legend")


@pytest.mark.parametrize("streets", [True, False])
def test_a_database_in_a_corner_of_its_area_is_shown_large(browser, tmp_path, streets):
    """As where a planner's rasters cover a country, and are empty but for a town."""
    bundle = made.database_bundle()
    bundle["frame"] |= {"size": [30_000.0, 30_000.0]}
    if not streets:
        none = {"first": starts([]), "east": places([]), "north": places([])}
        bundle["background"]["streets"] |= none | {"way": packed([], "u4")}
    write_page(bundle, tmp_path / "database.html")
    with page(browser, tmp_path / "database.html") as view:
        width_m = view.page.evaluate("MF.page.maps[0].view.width / MF.page.camera.scale")
        assert 400 < width_m < 1200


def test_without_a_map_and_cells_the_legend_names_neither(browser, tmp_path):
    bundle = made.replay_bundle() | {"cells": [], "levels": None, "why": None}
    none = {"first": starts([]), "east": places([]), "north": places([]), "way": packed([], "u4")}
    bundle["background"] |= {"streets": none, "points": None, "best": None}
    one = made.run("walk, ekf", explained=False) | {"filter": "ekf", "belief": None}
    epochs = one["epochs"] | {"runner_mass": packed(np.zeros(made.EPOCHS), "f4")}
    bundle["runs"] = [one | {"epochs": epochs, "readings": None}]
    write_page(bundle, tmp_path / "ekf.html")
    with page(browser, tmp_path / "ekf.html") as view:
        view.page.locator(".legend").first.evaluate("(one) => { one.open = true; }")
        text = view.page.locator(".legend").first.inner_text()
        assert "estimate, tracking" in text
        assert "ground truth" in text
        for words in ("cell", "site", "runner-up", "belief"):
            assert words not in text
        assert view.page.is_hidden("#layer")


def test_a_damaged_page_says_so(browser, replay, tmp_path):
    text = replay.read_text()
    at = text.index('type="text/plain">') + 2000
    (tmp_path / "cut.html").write_text(text[:at] + "A" * 40 + text[at + 40 :])
    context = browser.new_context(offline=True)
    view = context.new_page()
    view.goto((tmp_path / "cut.html").as_uri())
    view.wait_for_selector("html[data-ready=failed]")
    assert "could not be opened" in view.inner_text("[role=alert]")
    context.close()


def test_the_bundle_is_what_the_contract_names():
    """The made bundle is JSON, as those of runs are."""
    assert json.loads(json.dumps(made.replay_bundle(), allow_nan=False))["version"] == 1


def test_a_run_of_another_filter_says_why_nothing_is_explained(browser, tmp_path):
    one = made.run("walk, ekf", explained=False) | {"filter": "ekf"}
    epochs = one["epochs"] | {"hypotheses": packed(np.ones(made.EPOCHS, int), "u4")}
    bundle = made.replay_bundle() | {"why": None, "runs": [one | {"epochs": epochs}]}
    write_page(bundle, tmp_path / "ekf.html")
    with page(browser, tmp_path / "ekf.html") as view:
        text = view.page.inner_text(".why")
        assert "filter “ekf”, which holds one Gaussian" in text
        assert "--filter bayes --html" in text
        assert view.page.is_hidden(".why .segments")
