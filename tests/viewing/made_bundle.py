"""A small bundle made by hand: three cells, a walk of two minutes, hostile names."""

import numpy as np

from mapfilter.viewing.arrays import packed, places, starts

STEP_M, ROWS, COLS = 5.0, 60, 80
SITES_M = ((60.0, 60.0), (340.0, 80.0), (200.0, 260.0))
EPOCHS = 120
HOSTILE = "<img src=x onerror=alert(1)></script><script>alert(2)</script>"
WHY = {
    "slow_db": 7.0,
    "fast_db": 4.0,
    "white_db": 3.3,
    "device_db": 5.0,
    "site_share": 0.6,
    "common_share": 0.2,
    "roughness": 1.0,
    "fault_log_odds": -2.75,
    "absent_db": 3.0,
    "weight": 0.35,
    "offset_db": 2.6,
    "other_dbm": -90.0,
    "other_db2": 225.0,
    "other_rough_db2": 9.2,
    "serving_weight": 1.14,
    "serving_with_levels": 1.0,
    "hysteresis_db": 2.0,
    "sd_db": 9.0,
    "fault_nats": 0.7,
    "map_sd_m": 3.0,
    "map_weight_per_m": 0.083,
    "off_cost_per_m": 0.04,
    "map_m": 25.0,
    "site": [0, 1, 2],
}
GRID = {"west": 0.0, "north": ROWS * STEP_M, "step": STEP_M, "rows": ROWS, "cols": COLS}
DBM = {"scale": 0.5, "offset": -150.0, "none": 255}
QUIET_DBM = -110.0
QUIET = {"scale": 0.3, "offset": QUIET_DBM, "none": 255}


def level_rasters():
    """Level of each cell, (3, ROWS, COLS): less by distance, below the floor in a corner."""
    east = (np.arange(COLS) + 0.5) * STEP_M
    north = GRID["north"] - (np.arange(ROWS) + 0.5) * STEP_M
    away = [np.hypot(east[None] - x, north[:, None] - y) for x, y in SITES_M]
    level = np.clip(-40.0 - 25.0 * np.log10(np.maximum(away, 10.0) / 10.0), QUIET_DBM, -40.0)
    level[2, -6:, :6] = np.nan
    return np.round((level - QUIET_DBM) / 0.3) * 0.3 + QUIET_DBM


def two_strongest(level, layer):
    """Strongest and second strongest level of each layer, (layers, ROWS, COLS) each."""
    filled = np.where(np.isnan(level), QUIET_DBM, level)
    quiet = np.full((1, ROWS, COLS), QUIET_DBM)
    own = [filled[[k for k in range(3) if layer[k] == one]] for one in range(max(layer) + 1)]
    ordered = [np.sort(np.concatenate([quiet, cells]), axis=0) for cells in own]
    return [np.stack([one[-nth] for one in ordered]) for nth in (1, 2)]


def with_layers(bundle, layer):
    """The bundle with cells of these layers; None for a page from before there were any."""
    best, second = two_strongest(level_rasters(), layer or (0, 0, 0))
    levels = dict(bundle["levels"])
    if layer is None:
        del levels["layer"]
        best, second = best[0], second[0]
    else:
        levels["layer"] = list(layer)
    strongest = {"best": packed(best, "u1", **QUIET), "second": packed(second, "u1", **QUIET)}
    return bundle | {"levels": levels | strongest}


def distances():
    return np.abs(np.arange(ROWS)[:, None] - 30) * STEP_M * np.ones((1, COLS))


def database_bundle(title="Made database"):
    level = level_rasters()
    filled = np.where(np.isnan(level), QUIET_DBM, level)
    ordered = np.sort(filled, axis=0)
    best, second = two_strongest(level, (0, 0, 0))
    cells = [
        {
            "id": name,
            "site": f"site {name}",
            "east": x,
            "north": y,
            "height_m": 30.0,
            "azimuth_deg": azimuth,
            "arfcn": 60 + i,
            "bsic": i,
            "label": name,
        }
        for i, (name, (x, y), azimuth) in enumerate(
            zip(("A", "B", HOSTILE), SITES_M, (45.0, None, 180.0), strict=True)
        )
    ]
    return {
        "format": "mapfilter-view",
        "version": 1,
        "kind": "database",
        "title": title,
        "mapfilter": "0",
        "database": "made",
        "attribution": "made by hand",
        "notes": [],
        "frame": {
            "crs": "EPSG:32635",
            "origin": [385400.0, 6671400.0],
            "size": [400.0, 300.0],
            "corners": [[24.9, 60.1], [24.91, 60.1], [24.91, 60.11], [24.9, 60.11]],
        },
        "statuses": ["SEARCHING", "CONVERGED", "TRACKING", "LOST", "OUTSIDE"],
        "reasons": ["used", "not_moved_enough"],
        "words": {"used": "used", "not_moved_enough": "too near to the last report"},
        "cells": cells,
        "background": {
            "streets": {
                "first": starts([2]),
                "east": places([0, 400]),
                "north": places([150, 150]),
                "way": packed([1], "u4"),
            },
            "ways": [{"id": "7", "name": HOSTILE}],
            "points": None,
            "buildings": None,
            "best": {
                "grid": GRID,
                "server": packed(filled.argmax(axis=0), "i2"),
                "level": packed(ordered[-1], "u1", scale=0.5, offset=-140.0, none=255),
                "margin": packed(ordered[-1] - ordered[-2], "u1", scale=0.25, none=255),
            },
            "bound": None,
        },
        "levels": {
            "grid": GRID,
            "cells": [0, 1, 2],
            "layer": [0, 0, 0],
            "level": packed(level, "u1", **QUIET),
            "rough": packed(np.full(level.shape, 2.0), "u1", scale=0.25),
            "quiet_dbm": QUIET_DBM,
            "best": packed(best, "u1", **QUIET),
            "second": packed(second, "u1", **QUIET),
            "distance": packed(distances(), "u1", none=255),
            "complete": True,
        },
        "why": WHY,
        "runs": [],
    }


def run(name, offset_m=0.0, *, explained=True):
    """A walk east along the street: searching, tracking, lost at the end."""
    every = np.arange(EPOCHS)
    east, north = 40.0 + 2.5 * every, np.full(EPOCHS, 150.0 + offset_m)
    none = np.full(EPOCHS, np.nan)
    status = np.where(every < 20, 0, np.where(every < 100, 2, 3))
    epochs = {
        "count": EPOCHS,
        "every": 1,
        "time": packed(every.astype(float), "f8"),
        "east": places(east),
        "north": places(north),
        "status": packed(status, "u1"),
        "reason": packed(np.where(every % 5, 1, 0), "u1"),
    }
    for key, values in {
        "r50": 8 + 0 * every,
        "r95": 20 + 0 * every,
        "r99": 30 + 0 * every,
        "protection": np.where(every < 20, np.inf, 45.0),
        "entropy": 6 - 0.02 * every,
        "log_evidence": -every,
        "runner_mass": np.where(every < 60, 0.25, 0.0),
        "doubt": 0.1 * every - 6,
        "travelled": 2.5 * every,
        "alt_lead": none,
        "error": np.abs(offset_m) + 0 * every,
    }.items():
        epochs[key] = packed(np.asarray(values, float), "f4")
    for key in ("alt_east", "alt_north"):
        epochs[key] = places(none)
    epochs["runner_east"] = places(np.where(every < 60, east, np.nan))
    epochs["runner_north"] = places(np.where(every < 60, 230.0, np.nan))
    epochs["truth_east"], epochs["truth_north"] = places(east), places(0 * every + 150.0)
    share = {"scale": 1 / 250, "none": 255}
    epochs |= {
        "mass": packed(0.75 + 0 * every, "u1", **share),
        "alt_mass": packed(none, "u1", **share),
        "way_p": packed(none, "u1", **share),
        "hypotheses": packed(3000 + 0 * every, "u4"),
        "way": packed(1 + 0 * every, "u4"),
        "serving": packed(0 * every, "i2"),
    }
    cell = np.tile([0, 0, 1, -1], EPOCHS)
    measured = np.tile([np.nan, -61.5, -72.0, -90.0], EPOCHS)
    readings = {
        "first": starts(np.full(EPOCHS, 4)),
        "cell": packed(cell, "i2"),
        "what": packed(np.tile([0, 0, 1, 2], EPOCHS), "u4"),
        "role": packed(np.tile([0, 1, 1, 1], EPOCHS), "u1"),
        "level": packed(measured, "u1", **DBM),
        "predicted": packed(measured + 3, "u1", **DBM),
        "use": packed(np.where((np.repeat(every, 4) % 5 == 0) & (cell >= 0), 0, 1), "u1"),
    }
    return {
        "name": name,
        "filter": "bayes",
        "log": "made",
        "notes": [HOSTILE],
        "figures": {"mean error, m": "3.0"},
        "start_utc_s": 1.7e9,
        "epochs": epochs,
        "truth": {
            "time": packed(every.astype(float), "f8"),
            "east": places(east),
            "north": places(0 * every + 150.0),
        },
        "thresholds": {"start_log_odds": -1.0, "lost": 8.0},
        "readings": readings,
        "roles": ["serving", "neighbour"],
        "whats": ["A", "B", "ARFCN 1"],
        "kinds": ["motion"],
        "unused": {
            "epoch": packed([3], "u4"),
            "kind": packed([0], "u1"),
            "what": packed([0], "u4"),
            "reason": packed([1], "u1"),
            "count": packed([2], "u4"),
        },
        "belief": belief(east, north),
        "explained": explanations() if explained else None,
        "smoothed": False,
    }


def belief(east_m, north_m, squares=20_000):
    """One frame an epoch; the first one as large as frames may be."""
    counts = [squares] + [400] * (EPOCHS - 1)
    side = [int(np.ceil(np.sqrt(count))) for count in counts]
    cols, rows, masses = [], [], []
    for i, (count, wide) in enumerate(zip(counts, side, strict=True)):
        at = np.arange(count)
        col, row = at % wide - wide // 2, at // wide - wide // 2
        cols.append(col + round(east_m[i] / 2.5))
        rows.append(row + round(north_m[i] / 2.5))
        masses.append(255 * np.exp(-0.5 * np.hypot(col, row) ** 2 / (wide / 5) ** 2))
    return {
        "epoch": packed(np.arange(EPOCHS), "u4"),
        "first": starts(counts),
        "step": packed(np.full(EPOCHS, 2.5), "f4"),
        "col": packed(np.concatenate(cols), "i2"),
        "row": packed(np.concatenate(rows), "i2"),
        "mass": packed(np.concatenate(masses).astype(int), "u1"),
        "peak": packed(np.full(EPOCHS, 0.01), "f4"),
        "which": "density",
    }


def explanations():
    """Every fifth epoch a report of four rows, with a runner-up up to the sixtieth."""
    epoch = np.arange(0, EPOCHS, 5)
    size = 4 * len(epoch)
    rng = np.random.default_rng(5)
    lead, runner = rng.normal(-2, 1, size), rng.normal(-3, 1, size)
    runner[np.repeat(epoch, 4) >= 60] = np.nan
    sums = [values.reshape(-1, 4).sum(axis=1) for values in (lead, runner)]
    level = packed(np.tile([np.nan, np.nan, -61.5, -72.0], len(epoch)), "u1", **DBM)
    return {
        "terms": ["streets", "serving", "level"],
        "epoch": packed(epoch, "u4"),
        "first": starts(np.full(len(epoch), 4)),
        "what": packed(np.tile([0, 1, 2, 2], len(epoch)), "u1"),
        "cell": packed(np.tile([-1, 0, 0, 1], len(epoch)), "i2"),
        "measured": level,
        "lead_predicted": level,
        "runner_predicted": level,
        "lead": packed(lead, "f8"),
        "runner": packed(runner, "f8"),
        "alt": packed(np.full(size, np.nan), "f8"),
        "lead_sum": packed(sums[0], "f8"),
        "runner_sum": packed(sums[1], "f8"),
        "alt_sum": packed(np.full(len(epoch), np.nan), "f8"),
        "runner_east": places(0.0 * epoch),
        "runner_north": places(0.0 * epoch),
        "runner_prior": packed(0.5 + 0.0 * epoch, "f4"),
    }


def replay_bundle():
    found = database_bundle(f"Made replay {HOSTILE}")
    runs = [run("walk, bayes", 3.0), run(HOSTILE, -12.0, explained=False)]
    return found | {"kind": "replay", "runs": runs}
