"""``mapfilter demo``: the whole chain once, on the map and the cell plan that the project ships."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.config.load import load_config
from mapfilter.workflows.build import run_build
from mapfilter.workflows.kernels import compiled_beside
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.replay import ReplayedLog, run_replay
from mapfilter.workflows.simulate import run_simulate

_STAGES = ("predict", "build", "simulate", "replay")
_OLD_FILTER = "candidate"
_FIGURES = (
    "switched",
    "switch_distance_m",
    "error_at_switch_m",
    "error_mean_m",
    "error_67_m",
    "error_95_m",
)


def run_demo(
    out: Path,
    settings: Sequence[str] = (),
    *,
    seed: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Predict, build, simulate a walk and replay it by two filters, with the pictures of each.

    Parameters
    ----------
    out : Path
        Folder of everything that is written.
    settings : sequence of str
        ``section.key=value``, over the demo's own configuration.
    seed : int, optional
        Another walk with other noise.
    progress : callable, optional
        Called with stages done and stages in all.

    Returns
    -------
    dict
        Points and cells of the database, length of the walk, whether, where and how accurately the
        Bayes filter switched to tracking, its errors from then on (as in ``Accuracy``), the same
        figures of the candidate filter, wall time of each stage, and all files written.
    """
    ensure_writable_folder(out)
    seeds = [] if seed is None else [f"journeys.seed={seed}"]
    with resources.as_file(resources.files("mapfilter.data")) as data:
        plain = data / "world-plain.toml"
        config = load_config(data / "demo.toml", [*settings, *seeds], out=out, base=plain)
    seconds: dict[str, float] = {}

    @contextmanager
    def stage(name: str) -> Iterator[None]:
        began_s = time.perf_counter()
        yield
        seconds[name] = round(time.perf_counter() - began_s, 3)
        if progress is not None:
            progress(len(seconds), len(_STAGES))

    with compiled_beside():
        with stage("predict"):
            predicted = run_predict(config)
        with stage("build"):
            built = run_build(config)
        with stage("simulate"):
            simulated = run_simulate(config)
    with stage("replay"):
        walk = run_replay(config, out / "replay").logs[0]
        old_filter = config.filter.model_copy(update={"name": _OLD_FILTER})
        old_config = config.model_copy(update={"filter": old_filter})
        old = run_replay(old_config, out / _OLD_FILTER).logs[0]
    files = [predicted.rasters, predicted.ground_truth, predicted.plan, built.database]
    pictures = (simulated.path, *built.pictures, *walk.outputs, *old.outputs)
    return {
        "points": built.points,
        "cells": built.cells,
        "track_m": simulated.track_m,
        **_figures(walk),
        "candidate": _figures(old),
        "seconds": seconds,
        "outputs": (*(file for file in files if file is not None), *pictures),
    }


def _figures(walk: ReplayedLog) -> dict[str, Any]:
    if walk.accuracy is None:
        raise AssertionError("a simulated walk has its truth")
    return {name: getattr(walk.accuracy, name) for name in _FIGURES}
