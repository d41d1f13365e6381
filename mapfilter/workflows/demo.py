"""``mapfilter demo``: the whole chain once, on the map and the cell plan that the project ships."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.resources import as_file, files
from pathlib import Path

from mapfilter._io import ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.config.load import load_config
from mapfilter.workflows.build import run_build
from mapfilter.workflows.predict import run_predict
from mapfilter.workflows.replay import ReplayedLog, run_replay
from mapfilter.workflows.simulate import run_simulate

_STAGES = ("predict", "build", "simulate", "replay")
_OLD_FILTER = "candidate"


@dataclass(frozen=True)
class FilterFigures:
    """How a filter found the walk.

    Parameters
    ----------
    switched : bool
        Whether the filter went over to tracking.
    switch_distance_m, error_at_switch_m : float
        After how many metres, and how far off; NaN if it never switched.
    error_mean_m, error_67_m, error_95_m : float
        Over the track from the switch on.
    """

    switched: bool
    switch_distance_m: float
    error_at_switch_m: float
    error_mean_m: float
    error_67_m: float
    error_95_m: float


@dataclass(frozen=True)
class DemoResult:
    """What the demo found: the figures are the Bayes map filter's.

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
    candidate : FilterFigures
        The same walk by the filter of Khalaf-Allah (2007), which takes no levels.
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
    candidate: FilterFigures
    seconds: dict[str, float]
    outputs: tuple[Path, ...]


def run_demo(
    out: Path,
    settings: Sequence[str] = (),
    *,
    seed: int | None = None,
    progress: Progress | None = None,
) -> DemoResult:
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

    Raises
    ------
    MapfilterError
        A setting is wrong, or the output cannot be written.
    """
    ensure_writable_folder(out)
    seeds = [] if seed is None else [f"journeys.seed={seed}"]
    with as_file(files("mapfilter.data")) as data:
        config = load_config(
            data / "demo.toml",
            [*settings, *seeds],
            out=out,
            base=data / "world-plain.toml",
        )
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
        walk = run_replay(config, out / "replay").logs[0]
        old_filter = config.filter.model_copy(update={"name": _OLD_FILTER})
        old_config = config.model_copy(update={"filter": old_filter})
        old = run_replay(old_config, out / _OLD_FILTER).logs[0]
    files_written = [predicted.rasters, predicted.ground_truth, predicted.plan, built.database]
    return DemoResult(
        points=built.points,
        cells=built.cells,
        track_m=simulated.track_m,
        **asdict(_figures(walk)),
        candidate=_figures(old),
        seconds=seconds,
        outputs=(
            *(f for f in files_written if f is not None),
            simulated.path,
            *built.pictures,
            *walk.outputs,
            *old.outputs,
        ),
    )


def _figures(walk: ReplayedLog) -> FilterFigures:
    score = walk.accuracy
    if score is None:
        raise AssertionError("a simulated walk has its truth")
    return FilterFigures(
        score.switched,
        score.switch_distance_m,
        score.error_at_switch_m,
        score.error_mean_m,
        score.error_67_m,
        score.error_95_m,
    )
