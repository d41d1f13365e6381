"""``mapfilter demo``: the whole chain once, on the map and the cell plan that the project ships."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.workflows.build import run_build
from mapfilter.workflows.config import load_config
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.replay import run_replay
from mapfilter.workflows.simulate import run_simulate

_STAGES = ("predict", "build", "simulate", "replay")


@dataclass(frozen=True)
class DemoResult:
    """What the demo found.

    Parameters
    ----------
    points, cells : int
        Of the radio-route database.
    track_m : float
        Length of the walk.
    switched : bool
        Whether the filter went over to tracking.
    switch_distance_m, error_at_switch_m : float
        After how many metres, and how far off; NaN if it never switched.
    error_mean_m, error_67_m, error_95_m : float
        Over the track from the switch on.
    seconds : dict
        Wall time of each stage.
    outputs : tuple of Path
        What was written; look at the pictures.
    """

    points: int
    cells: int
    track_m: float
    switched: bool
    switch_distance_m: float
    error_at_switch_m: float
    error_mean_m: float
    error_67_m: float
    error_95_m: float
    seconds: dict[str, float]
    outputs: tuple[Path, ...]


def run_demo(
    out: Path,
    settings: Sequence[str] = (),
    *,
    seed: int | None = None,
    progress: Progress | None = None,
) -> DemoResult:
    """Predict, build, simulate a walk and replay it, with the pictures of each.

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

    Raises
    ------
    MapfilterError
        A setting is wrong, or the output cannot be written.
    """
    ensure_writable_folder(out)
    seeds = [] if seed is None else [f"journeys.seed={seed}"]
    with as_file(files("mapfilter.data")) as data:
        config = load_config(data / "demo.toml", [*settings, *seeds], out=out)
    seconds: dict[str, float] = {}

    @contextmanager
    def stage(name: str) -> Iterator[None]:
        began_s = time.perf_counter()
        yield
        seconds[name] = round(time.perf_counter() - began_s, 3)
        if progress is not None:
            progress(len(seconds), len(_STAGES))

    with stage("predict"):
        predicted = run_predict(config)
    with stage("build"):
        built = run_build(config)
    with stage("simulate"):
        simulated = run_simulate(config)
    with stage("replay"):
        replayed = run_replay(config, out / "replay")
    walk = replayed.logs[0]
    if walk.accuracy is None:
        raise AssertionError("a simulated walk has its truth")
    files_written = [predicted.rasters, predicted.reality, predicted.plan, built.database]
    return DemoResult(
        built.points,
        built.cells,
        simulated.track_m,
        walk.accuracy.switched,
        walk.accuracy.switch_distance_m,
        walk.accuracy.error_at_switch_m,
        walk.accuracy.error_mean_m,
        walk.accuracy.error_67_m,
        walk.accuracy.error_95_m,
        seconds,
        (
            *(f for f in files_written if f is not None),
            simulated.path,
            *built.pictures,
            *walk.outputs,
        ),
    )
