"""Buildings and bounds on a page, and the numbers of many cells."""

from dataclasses import replace

import made_bundle as made
import numpy as np
import pytest
import shapely
from browser import Watched, opened
from positioning.cross_world import make_plan, walk_log

from mapfilter.errors import InputError
from mapfilter.evaluation.map_bound import BANDS, write_bound
from mapfilter.filters.contract import Reason, Status
from mapfilter.lattice import Lattice
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.merging import epochs
from mapfilter.radio.cells import CellPlan
from mapfilter.roads.ways import Buildings
from mapfilter.viewing.arrays import cell_numbers, unpacked
from mapfilter.viewing.ground import ViewFrame
from mapfilter.viewing.layers import frame_of, with_bound, with_buildings
from mapfilter.viewing.page import read_page, write_page
from mapfilter.viewing.runs import ViewedRun, run_of
from mapfilter.workflows.views import BOUND_TIF, run_view

CRS = "EPSG:32635"
WEST_M, SOUTH_M = 385_400.0, 6_671_400.0
LATTICE = Lattice(CRS, WEST_M, SOUTH_M + 300.0, 5.0, 60, 80)


def made_buildings(*boxes):
    shapes = np.array([shapely.box(*box) for box in boxes], dtype=object)
    return Buildings(CRS, shapes, np.full(len(shapes), 12.0), 0, 0, len(shapes))


def ramp():
    values = np.full((60, 80), np.nan, dtype=np.float32)
    values[29:31] = np.linspace(40, 400, 80)
    return values


def test_outlines_of_buildings_keep_their_courtyards():
    whole = shapely.box(WEST_M + 10, SOUTH_M + 10, WEST_M + 60, SOUTH_M + 60)
    yard = shapely.box(WEST_M + 30, SOUTH_M + 30, WEST_M + 40, SOUTH_M + 40)
    buildings = replace(
        made_buildings((0, 0, 1, 1)), footprints=np.array([whole - yard], dtype=object)
    )
    found = with_buildings(made.database_bundle(), buildings)["background"]["buildings"]
    first, east = unpacked(found["first"]), unpacked(found["east"])
    assert len(first) == 3
    assert sorted(set(np.round(east).tolist())) == [10, 30, 40, 60]


def test_bounds_are_layers_whose_colors_ignore_extremes():
    values = ramp()
    values[29, 0] = 1e6
    found = with_bound(made.database_bundle(), LATTICE, {"Metres": ("m", values)})
    (one,) = found["background"]["bound"]
    assert one["range"][1] < 400
    grid, shown = one["grid"], unpacked(one["value"])
    assert (grid["west"], grid["north"]) == (0.0, 300.0)
    assert shown[29, 40] == pytest.approx(values[29, 40], abs=0.25)
    assert np.isnan(shown[0, 0])


def test_a_page_shows_buildings_and_bounds(tmp_path):
    bundle = with_bound(made.database_bundle(), LATTICE, {"Metres to convergence": ("m", ramp())})
    box = WEST_M + 100, SOUTH_M + 200, WEST_M + 160, SOUTH_M + 260
    write_page(with_buildings(bundle, made_buildings(box)), tmp_path / "view.html")
    with opened() as browser:
        view = Watched(browser, tmp_path / "view.html")
        view.page.select_option("#layer", label="Metres to convergence")
        view.settle()
        assert "Metres to convergence / m" in view.page.inner_text(".legend")
        at = view.page.locator(".sheet").bounding_box()
        view.page.mouse.move(at["x"] + at["width"] / 2, at["y"] + at["height"] / 2)
        assert "Metres to convergence" in view.page.inner_text(".tip")
        assert view.page.evaluate("MF.page.ground.buildings.first.length") == 2
        view.close()


def test_view_takes_the_result_of_bound_and_refuses_that_of_others(tmp_path):
    write_page(made.replay_bundle(), tmp_path / "replay.html")
    for name, lattice in (("own", LATTICE), ("other", replace(LATTICE, crs="EPSG:32632"))):
        (tmp_path / name).mkdir()
        rasters = {band: ramp() for band, _ in BANDS}
        write_bound(rasters, lattice, tmp_path / name / BOUND_TIF)
    out = tmp_path / "view.html"
    run_view([tmp_path / "replay.html", tmp_path / "own"], out)
    assert len(read_page(out)["background"]["bound"]) == 3
    with pytest.raises(InputError, match="the bound of another database"):
        run_view([tmp_path / "replay.html", tmp_path / "other"], out)
    (tmp_path / "own" / BOUND_TIF).write_bytes(b"II*\0")
    with pytest.raises(InputError, match="bound"):
        run_view([tmp_path / "replay.html", tmp_path / "own"], out)


def test_a_map_of_another_area_is_named(tmp_path):
    write_page(made.replay_bundle() | {"frame": far_away()}, tmp_path / "replay.html")
    with pytest.raises(InputError, match="another area"):
        run_view([tmp_path / "replay.html"], tmp_path / "view.html", "helsinki")


def far_away():
    return made.database_bundle()["frame"] | {"origin": [385_400.0, 6_000_000.0]}


def test_cells_above_two_bytes_keep_their_numbers(tmp_path):
    many = 40_000
    cells = [
        {"id": f"c{i}", "site": "", "east": 0.0, "north": 0.0, "azimuth_deg": None, "label": ""}
        for i in range(many)
    ]
    bundle = made.database_bundle() | {"kind": "replay", "cells": cells}
    run = made.run("many cells")
    last = np.full(4 * made.EPOCHS, many - 1)
    run["readings"]["cell"] = cell_numbers(last)
    run["epochs"]["serving"] = cell_numbers(np.full(made.EPOCHS, many - 1))
    best = bundle["background"]["best"] | {"server": cell_numbers(np.full((60, 80), many - 1))}
    bundle["background"] = bundle["background"] | {"best": best}
    write_page(bundle | {"runs": [run]}, tmp_path / "many.html")
    with opened() as browser:
        view = Watched(browser, tmp_path / "many.html", at="#t=50")
        assert "c39999 serving" in view.page.inner_text(".radio")
        found = view.page.evaluate("MF.page.ground.bestAt(100, 100).cell")
        assert found == many - 1
        view.close()


def test_runs_over_many_cells():
    """A replay over a plan of more cells than two bytes count."""
    many, log, cell = 33_000, walk_log(), make_plan().cells[0]
    plan = CellPlan(log.crs, tuple(replace(cell, id=f"c{i}") for i in range(many)))
    last = f"c{many - 1}"
    log = replace(log, radio=log.radio.assign(cell=last))
    count = len(epochs(log))
    estimate = a_track(log, count)
    frame = ViewFrame(log.crs, 0.0, 0.0)
    run = run_of(ViewedRun("walk", estimate, log), frame, plan, {}, nowhere)
    assert unpacked(run["readings"]["cell"]).max() == many - 1
    assert unpacked(run["epochs"]["serving"]).max() == many - 1


def nowhere(east_m, north_m, cells):  # noqa: ARG001
    return np.full(len(cells), np.nan)


def a_track(log, count):
    nothing = np.full(count, np.nan)
    return TrackEstimate(
        crs=log.crs,
        filter="made",
        start_utc_s=np.nan,
        time_s=np.array([one.time_s for one in epochs(log)]),
        east_m=nothing,
        north_m=nothing,
        covariance_m2=np.full((count, 2, 2), np.nan),
        radii_m=np.full((count, 3), np.nan),
        status=(Status.SEARCHING,) * count,
        hypotheses=np.zeros(count, dtype=np.int64),
        mass_50m=nothing,
        way_id=np.zeros(count, dtype=np.int64),
        way_probability=nothing,
        reason=(Reason.USED,) * count,
        radius_99_m=nothing,
        protection_m=nothing,
    )


def test_frame_of_a_view():
    frame, bounds = frame_of(made.database_bundle())
    assert (frame.crs, bounds) == (CRS, (WEST_M, SOUTH_M, WEST_M + 400.0, SOUTH_M + 300.0))
