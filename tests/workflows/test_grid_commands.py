"""The exact filter on a grid on the full chain."""

import numpy as np
import pytest
from command_line import assert_done, mapfilter, settings

from mapfilter.positioning.estimate_store import read_estimate
from mapfilter.tracks.store import read_log

# The data sheet of the simulated unit, and a switch that a walk of 250 m allows.
STATED = settings(
    filter__bayes__heading_sd_deg=6, filter__bayes__bias_sd_deg=3, filter__bayes__scale=0.01,
    filter__bayes__switch_mass=0.9, filter__bayes__switch_hold_m=10,
)  # fmt: skip


def off_at_the_end_m(estimate, world):
    """Median error over the last quarter of the first journey; 250 m may be too few to converge."""
    truth = read_log(world.journeys / "journey-0000-draw-000").truth
    last = slice(-len(estimate.time_s) // 4, None)
    east, north = (
        np.interp(estimate.time_s, truth["time_s"], truth[name]) for name in ("east_m", "north_m")
    )
    return np.median(np.hypot(estimate.east_m - east, estimate.north_m - north)[last])


def test_a_replay_by_the_grid(world, tmp_path):
    out = tmp_path / "out"
    given = ["--db", world.database, "--log", world.journeys / "journey-0000-draw-000", *STATED]
    found = assert_done(
        mapfilter("replay", *given, "--filter", "grid", "--out", out, "--json")
    ).json
    assert found["filter"] == "grid"
    names = {path.name for path in out.iterdir()}
    assert {"belief.png", "track.png", "error.png", "evidence.png"} <= names
    estimate = read_estimate(out / "estimate.parquet")
    assert estimate.filter == "grid"
    assert off_at_the_end_m(estimate, world) < 20
    assert estimate.way_probability[-1] > 0.2


@pytest.mark.long
def test_a_benchmark_of_the_grid(world, tmp_path):
    given = [
        *settings(area__resolution_m=10),
        "--filter",
        "grid",
        "--runs",
        1,
        "--workers",
        1,
        *STATED,
    ]
    given += ["--world", "easy", *settings(prediction__shadowing_db=6, journeys__length_m=1940)]
    cases = ["--case", "levels-6", "--case", "smooth-6"]
    told = mapfilter(
        "evaluate", "global-positioning", "-c", world.benchmark_toml, *given, *cases,
        "--out", tmp_path, "--json",
    )  # fmt: skip
    plain, smoothed = told.json["cases"]
    assert plain["filter"] == smoothed["filter"] == "grid"
    assert plain["success"] == 1.0
    assert plain["error_mean_m"] < 15


def test_the_grid_smooths_a_track(world, tmp_path):
    given = ["--db", world.database, "--log", world.journeys / "journey-0000-draw-000", *STATED]
    given += ["--filter", "grid", "--out", tmp_path, "--json", *settings(output__pictures="none")]
    plain = assert_done(mapfilter("replay", *given)).json
    first = read_estimate(tmp_path / "estimate.parquet")
    smoothed = assert_done(mapfilter("replay", *given, "--smooth")).json
    assert plain["filter"] == smoothed["filter"] == "grid"
    later = read_estimate(tmp_path / "estimate.parquet")
    # Positions of the whole track, also before the filter has converged.
    assert np.isfinite(later.east_m).all()
    assert off_at_the_end_m(later, world) < 20
    assert (later.east_m != first.east_m).mean() > 0.9
