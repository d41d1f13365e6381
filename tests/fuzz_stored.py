"""Damaged files that mapfilter itself writes, requests that reach it, and logs that are located.

What has a checksum has a stricter oracle: a damaged copy is refused, or reads as what was written.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from cross_world import CRS, make_database, walk_log
from fuzz_command import Target
from grid_town import CRS as TOWN_CRS
from grid_town import network, plan

import mapfilter as mf
from mapfilter.database.rewrite import levels_of, routes_of
from mapfilter.database.store import open_database
from mapfilter.errors import InputError, fail
from mapfilter.experiments.recorded.rows import Found, read_found, write_found
from mapfilter.experiments.recorded.worst_report import (
    WorstReport,
    read_worst_report,
    write_worst_report,
)
from mapfilter.experiments.sweep.table import SCHEMA, read_runs
from mapfilter.experiments.sweep.world import SweepWorld, open_world, write_world
from mapfilter.lattice import Lattice
from mapfilter.learning.patch import Change, Patch, read_patch, write_patch
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.estimate_store import read_estimate, write_estimate
from mapfilter.positioning.fingerprints.locating import fit_locator
from mapfilter.positioning.fingerprints.sources import reports_of_database
from mapfilter.positioning.merging import epochs
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_names import PlanNames
from mapfilter.serving.documents import RequestError, read_object
from mapfilter.serving.epoch_rows import read_epochs
from mapfilter.serving.geolocate import geolocator
from mapfilter.serving.state_file import encode, read_session
from mapfilter.tracks.store import write_log
from mapfilter.viewing.page import read_page

_SMALL = BayesFilter(max_particles=600, min_search_particles=300, min_particles=200)
_EPOCHS = 40
_VARIANCES = {"var_east_m2": 100.0, "var_north_m2": 100.0, "cov_east_north_m2": 0.0}


def stored(folder: Path) -> Iterator[Target]:
    """Write a good file of each kind, and yield it with its reader."""
    own = folder / "stored"
    own.mkdir()
    database = make_database(own)
    yield from _databases(database)
    yield from _results(own, database)
    yield from _experiments(own)
    yield from _requests(own, database)
    yield from _located(own, database)


def _same(read: Callable[[Path], object]) -> Callable[[Path], None]:
    """Return a reader that fails where it reads anything but what it read at first."""
    first: list[bytes] = []

    def checked(path: Path) -> None:
        found = _content(read(path))
        if not first:
            first.append(found)
        assert found == first[0], "another content than what was written"

    return checked


def _content(value: object) -> bytes:
    """Return the contents of arrays, in mappings, too, and the text of all else."""
    if isinstance(value, dict):
        return b"".join(f"{key}:".encode() + _content(one) for key, one in value.items())
    if isinstance(value, np.ndarray):
        return f"{value.dtype.str}{value.shape}".encode() + value.tobytes()
    return repr(value).encode()


def _databases(database: mf.RadioRouteDatabase) -> Iterator[Target]:
    def content(_: Path) -> object:
        read = open_database(database.path)
        routes = routes_of(read)
        places = {name: getattr(routes, name) for name in ("row", "col", "way_id")}
        cells = [repr(cell) for cell in read.plan.cells]
        return places | {"levels": levels_of(read), "cells": cells, "lattice": repr(read.lattice)}

    for file in sorted(database.path.rglob("*")):
        if file.is_file():
            name = file.relative_to(database.path).as_posix()
            yield Target(f"database {name}", file, _same(content))


def _results(folder: Path, database: mf.RadioRouteDatabase) -> Iterator[Target]:
    log = walk_log()
    track = mf.locate(log, database, _SMALL, record=True)
    path = folder / "estimate.parquet"
    write_estimate(track.estimate, path)
    yield Target("estimate", path, read_estimate)
    path = folder / "replay.html"
    track.view().save(path)
    yield Target("page", path, _same(read_page))
    path = folder / "one.session"
    positioner, state = _SMALL.over(database), None
    rng = np.random.default_rng(0)
    for epoch in epochs(log)[:_EPOCHS]:
        state, _ = positioner.step(positioner.begin() if state is None else state, epoch, rng)
    path.write_bytes(encode({"state": state}))
    yield Target("session", path, _same(lambda path: encode(read_session(path))))
    path = folder / "patch.toml"
    changes = (
        Change("offset", ("W",), offset_db=3.5, probability=0.9),
        Change("moved", ("E",), east_m=531_100.0, north_m=4_555_900.0),
        Change("way", (), line_m=((531_000.0, 4_556_000.0), (531_050.0, 4_556_000.0)),
               half_width_m=5.0),
    )  # fmt: skip
    write_patch(Patch(CRS, "0" * 64, 3, changes), path)
    yield Target("patch", path, read_patch)


def _experiments(folder: Path) -> Iterator[Target]:
    path = folder / "runs.parquet"
    columns = {field.name: ["" if str(field.type) == "string" else 1] * 20 for field in SCHEMA}
    pd.DataFrame(columns).to_parquet(path)
    yield Target("sweep table", path, read_runs)
    world = folder / "world"
    lattice = Lattice(TOWN_CRS, 0.0, 600.0, 10.0, 60, 60)
    levels = np.linspace(-120, -60, 10 * 3600, dtype=np.float32).reshape(10, 60, 60)
    write_world(SweepWorld(network(), plan(), lattice, {"prediction": levels}), world)

    def opened(_: Path) -> object:
        found = open_world(world)
        return {"east": found.network.east_m, "levels": dict(found.levels_dbm)}

    for file in sorted(world.iterdir()):
        yield Target(f"sweep world {file.name}", file, opened if file.suffix == ".json" else
                     _same(opened))  # fmt: skip
    path = folder / "found.json"
    some = Found("part", "bayes", "walk", True, True, False, np.ones(9), np.ones(9, np.bool_))
    write_found((some,), path)
    yield Target("scores", path, _same(lambda path: repr(read_found(path))))
    path = folder / "worst.json"
    points = np.arange(6.0).reshape(3, 2)
    worst = WorstReport(1, 9.0, 5.0, points[0], points[1], points, points, np.ones(3), ("far",))
    write_worst_report(worst, path)
    yield Target("worst report", path, _same(lambda path: repr(read_worst_report(path))))


def _requests(folder: Path, database: mf.RadioRouteDatabase) -> Iterator[Target]:
    positioner, names = _SMALL.over(database), PlanNames(database.plan)

    def step(path: Path) -> None:
        state, rng = positioner.begin(), np.random.default_rng(0)
        with _refusing():
            for epoch in read_epochs(read_object(path.read_bytes()), names, float("nan")):
                state, _ = positioner.step(state, epoch, rng)

    rows = [
        {
            "time_s": float(i),
            "motion": [{"step_m": 1.25, "heading_rad": 0.01 * i}],
            "radio": [{"role": "serving", "cell": "W", "level_dbm": -70.0 - i % 5}],
            "gnss": [{"east_m": 531_100.0 + i, "north_m": 4_555_850.0, **_VARIANCES}],
        }
        for i in range(1, _EPOCHS)
    ]
    path = folder / "epochs.json"
    path.write_text(json.dumps({"epochs": rows}))
    yield Target("epochs sent", path, step)
    known = reports_of_database(database)
    first, *others = database.plan.cells
    locate = geolocator(
        fit_locator(known, "probabilistic", np.random.default_rng(0), validated=100),
        CellPlan(CRS, (replace(first, mcc=244, mnc=91, lac=1, ci=3), *others)),
    )

    def answer(path: Path) -> None:
        with _refusing():
            json.dumps(locate.answer(read_object(path.read_bytes())), allow_nan=False)

    path = folder / "geolocate.json"
    points = [{"macAddress": "02:00:00:00:00:01", "signalStrength": -60}]
    tower = {"mobileCountryCode": 244, "mobileNetworkCode": 91, "locationAreaCode": 1,
             "cellId": 3, "signalStrength": -70, "timingAdvance": 2}  # fmt: skip
    asked = {"radioType": "gsm", "cellTowers": [tower], "wifiAccessPoints": points}
    path.write_text(json.dumps(asked))
    yield Target("geolocation asked", path, answer)


@contextmanager
def _refusing() -> Iterator[None]:
    """Turn the refusal of a request into that of an input."""
    try:
        yield
    except RequestError as error:
        json.dumps(error.document)
        raise fail(InputError, "body", "a request", error) from error


def _located(folder: Path, database: mf.RadioRouteDatabase) -> Iterator[Target]:
    log = walk_log()
    radio = log.radio.assign(level_dbm=-70.0 - np.arange(len(log.radio)) % 9)
    time_s = log.motion["time_s"].to_numpy()[::7]
    gnss = pd.DataFrame({"time_s": time_s, "east_m": 531_100.0, "north_m": 4_555_850.0}
                        | _VARIANCES)  # fmt: skip
    log = walk_log(motion=log.motion.iloc[:_EPOCHS], radio=radio.iloc[:_EPOCHS],
                   gnss=gnss.iloc[:5])  # fmt: skip
    log = replace(log, truth=log.truth.iloc[:_EPOCHS])
    own = folder / "log"
    write_log(log, own, "csv")
    # Without the checksums, which would refuse each copy.
    (own / "log.json").write_text(json.dumps({"crs": CRS, "notes": ["made"]}))
    for file in sorted(own.glob("*.csv")):
        yield Target(f"located {file.name}", file, lambda _: _locate(own, database))


def _locate(log: Path, database: mf.RadioRouteDatabase) -> None:
    track = mf.locate(log, database, _SMALL)
    estimate = track.estimate
    held = np.isfinite(estimate.east_m)
    assert np.isfinite(estimate.north_m[held]).all()
    assert (estimate.radius_99_m[held] >= 0).all()
