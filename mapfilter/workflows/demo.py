"""``mapfilter demo``: the whole chain once, on the map and the cell plan that the project ships."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import begun, local_executor, spare_processes, warmed
from mapfilter._partial import nothing_left, remove_left
from mapfilter.config.load import load_config
from mapfilter.config.sections import Config
from mapfilter.workflows.build import draw_database, run_build
from mapfilter.workflows.kernels import WORKERS, begin_kernels, to_compile
from mapfilter.workflows.outputs.track_pictures import get_ready_to_draw
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.replay import run_replay
from mapfilter.workflows.replays.figures import ReplayedLog
from mapfilter.workflows.simulate import run_simulate
from mapfilter.workflows.views import run_view

_STAGES = {
    "predict": "predicting levels (the first run compiles kernels, some 20 s once)",
    "build": "building the database",
    "simulate": "simulating a walk",
    "replay": "replaying it by two filters, with pictures",
    "candidate": "drawing what is left",
    "view": "putting both into one page",
}
"""Names of the stages, and what the bar says of each."""

VIEW_HTML = "replay.html"
_ENDING_S = 3.0

WHAT_ONE_SEES = """\
The page plays the walk. Space starts and stops it, the arrow keys step, the slider seeks.
Shading is the belief: first nearly every street is as likely, then a few, then one.
The line is the estimate, coloured by status, with its 50 and 95 % circles; truth is beside it.
Click a moment: each reading's contribution in nats, to the leading hypothesis and the runner-up.
Click a place on the map to ask why the position is not there; charts and map move together.\
"""
StageProgress = Callable[[int, int, str], None]
"""Called with stages done, stages in all, and what the next one does."""

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
    progress: StageProgress | None = None,
) -> dict[str, Any]:
    """Predict, build, simulate a walk and replay it by two filters, with the pictures of each.

    A page shows both replays side by side. Pictures of the database and the second replay are made
    by other processes meanwhile.

    Parameters
    ----------
    out : Path
        Folder of everything that is written.
    settings : sequence of str
        ``section.key=value``, over the demo's own configuration.
    seed : int, optional
        Another walk with other noise.
    progress : callable, optional
        Called with stages done, stages in all, and what the next one does.

    Returns
    -------
    dict
        Points and cells of the database, length of the walk, whether, where and how accurately the
        Bayes filter switched to tracking, its errors from then on (as in ``Accuracy``), the same
        figures of the candidate filter, wall time of each stage, all files written, and the
        address of the page.
    """
    seeds = [] if seed is None else [f"journeys.seed={seed}"]
    with resources.as_file(resources.files("mapfilter.data")) as data:
        plain = data / "world-plain.toml"
        config = load_config(data / "demo.toml", [*settings, *seeds], out=out, base=plain)
    with nothing_left(out):
        ensure_writable_folder(out)
        return _all_stages(config, out, progress)


def _all_stages(config: Config, out: Path, progress: StageProgress | None) -> dict[str, Any]:
    seconds: dict[str, float] = {}

    @contextmanager
    def stage(name: str, counted: str = "") -> Iterator[None]:
        if progress is not None:
            progress(list(_STAGES).index(name), len(_STAGES), _STAGES[name])
        began_s = time.perf_counter()
        yield
        taken_s = seconds.get(counted or name, 0.0) + time.perf_counter() - began_s
        seconds[counted or name] = round(taken_s, 3)

    undrawn = config.model_copy(
        update={"output": config.output.model_copy(update={"pictures": "none"})}
    )
    old_filter = config.filter.model_copy(update={"name": _OLD_FILTER})
    old_config = config.model_copy(update={"filter": old_filter})
    beside = min(WORKERS, os.cpu_count() or 1)
    others = spare_processes(beside) if beside > 1 else local_executor(1)
    with _cleared(out), others as workers:
        # Workers start here, and import what a replay and its pictures need; on a single processor
        # each task is done when it is handed out.
        warmed(workers, 1, run_replay)
        begun(workers, get_ready_to_draw)
        compiled = begin_kernels(workers) if to_compile() else []
        with stage("predict"):
            predicted = run_predict(config)
        with stage("build"):
            built = run_build(undrawn)
            drawn = begun(workers, partial(draw_database, config))
        with stage("simulate"):
            simulated = run_simulate(config)
        with stage("replay"):
            by_old = partial(run_replay, old_config, out / _OLD_FILTER, html=True)
            replayed = begun(workers, by_old)
            for one in compiled:
                one()
            walk = run_replay(config, out / "replay", html=True).logs[0]
        with stage("candidate", "replay"):
            pictures, old = drawn(), replayed().logs[0]
    with stage("view", "replay"):
        view = run_view([out / "replay", out / _OLD_FILTER], out / VIEW_HTML)
    files = [predicted.rasters, predicted.ground_truth, predicted.plan, built.database]
    walked = (simulated.path, *pictures, *walk.outputs, *old.outputs)
    return {
        "points": built.points,
        "cells": built.cells,
        "track_m": simulated.track_m,
        **_figures(walk),
        "candidate": _figures(old),
        "seconds": seconds,
        "outputs": (*(file for file in files if file is not None), *walked, view["html"]),
        "open": view["open"],
    }


@contextmanager
def _cleared(out: Path) -> Iterator[None]:
    """Remove what workers leave half-written where they are stopped."""
    try:
        yield
    except BaseException:
        remove_left(out, _ENDING_S)
        raise


def _figures(walk: ReplayedLog) -> dict[str, Any]:
    if walk.accuracy is None:
        raise AssertionError("a simulated walk has its truth")
    return {name: getattr(walk.accuracy, name) for name in _FIGURES}
