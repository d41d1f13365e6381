"""``mapfilter evaluate audit``: the easy world, changed in one respect at a time."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mapfilter._io import write_json
from mapfilter._parallel import Progress, part_of
from mapfilter.errors import ConfigError, Faults
from mapfilter.experiments.benchmarks.scores import CaseResult
from mapfilter.workflows.evaluate import TABLE, load_benchmark, run_global_positioning
from mapfilter.workflows.jsonable import to_jsonable

_GYRO = {
    "imu.turns": "gyro",
    "imu.gyro_noise_deg_per_sqrt_s": "0.2",
    "imu.gyro_bias_deg_per_s": "0.05",
}
_CLUTTER = {"prediction.ground_truth.clutter": "own"}
_HEADING = {"imu.sigma_orient_deg": "10", "imu.heading_correlation_s": "20"}
_BESIDE = {"journeys.beside": "8"}
_SCALE = {"imu.step_scale_wander": "0.1", "imu.step_scale_correlation_s": "15"}
_FADING = {"journeys.fading_db": "4"}
_MODEL = {
    "prediction.ground_truth.model": "tr38901_uma",
    "prediction.ground_truth.offset_db": "5",
    "prediction.ground_truth.street_width_m": "15",
    "prediction.ground_truth.building_separation_m": "50",
    "prediction.ground_truth.default_roof_height_m": "15",
    "prediction.ground_truth.roof_error": "0.2",
}
_LENGTHS = {
    "prediction.ground_truth.local_share": "0.5",
    "prediction.ground_truth.local_correlation_m": "15",
    "prediction.ground_truth.correlation_m": "100",
}


@dataclass(frozen=True)
class Change:
    """One row: a simulated world, changed.

    Parameters
    ----------
    what : str
        The change in words.
    settings : mapping of str to str
        The change as settings.
    world : {"easy", "plain"}
        That is changed.
    case : str
        Of the benchmark.
    """

    name: str
    what: str
    settings: Mapping[str, str]
    world: str = "easy"
    case: str = "levels-6"


CHANGES = {
    change.name: change
    for change in (
        Change("easy", "nothing", {}),
        Change("own-clutter", "the ground truth's clutter is its own", _CLUTTER),
        Change("no-clutter", "prediction without random clutter", {"prediction.shadowing_db": "0"}),
        Change(
            "noisy-truth",
            "the same, and 6 dB more of shadowing in the ground truth",
            {"prediction.shadowing_db": "0", "prediction.ground_truth.level_error_db": "9.22"},
        ),
        Change("heading", "heading error of 10°, correlated over 20 s", _HEADING),
        Change("gyro", "no compass; a gyro's errors accumulate", _GYRO, case="levels-nocompass"),
        Change("beside", "8 m beside the centre line", _BESIDE),
        Change("scale", "step scale wanders by 10 % over 15 s", _SCALE),
        Change("fading", "4 dB of fading", _FADING),
        Change("model", "another propagation model, other streets and roofs", _MODEL),
        Change("lengths", "shadowing of 15 m and of 100 m", _LENGTHS),
        Change("phone", "the phone's levels are off by 4 dB", {"journeys.phone_offset_sd_db": "4"}),
        Change("stops", "a stop of 20 s every 300 m", {"journeys.stop_every_m": "300"}),
        Change(
            "all-but-gyro",
            "own clutter, heading, beside, scale and fading",
            {**_CLUTTER, **_HEADING, **_BESIDE, **_SCALE, **_FADING},
        ),
        Change("plain", "the plain world", {}, "plain"),
        Change(
            "plain-clutter",
            "the plain world, prediction with 6 dB of random clutter",
            {"prediction.shadowing_db": "6"},
            "plain",
        ),
        Change(
            "plain-noisy-truth",
            "the plain world, 6 dB more of shadowing in the ground truth",
            {"prediction.ground_truth.level_error_db": "7.81"},
            "plain",
        ),
    )
}
"""All rows by name, in the order of the table."""


@dataclass(frozen=True)
class AuditRow:
    """One row of the table."""

    name: str
    change: str
    world: str
    case: str
    settings: dict[str, str]
    result: CaseResult


@dataclass(frozen=True)
class AuditResult:
    """What each change does to the benchmark.

    Parameters
    ----------
    map : str
        Name of the map's file.
    seconds : float
        Wall time.
    """

    map: str
    seed: int
    rows: tuple[AuditRow, ...]
    seconds: float
    out: Path


def run_audit(
    config: Path | None,
    settings: Sequence[str],
    out: Path,
    *,
    runs: int,
    seed: int,
    names: Sequence[str] = (),
    workers: int = 2,
    resume: bool = False,
    progress: Progress | None = None,
) -> AuditResult:
    """Run the benchmark in the easy world, with one change at a time.

    Parameters
    ----------
    config, settings
        As for :func:`mapfilter.workflows.evaluate.load_benchmark`; each row's change comes
        after them.
    out : Path
        Gets a folder for each row, and ``table.json``.
    runs, seed, workers, resume
        As for :func:`mapfilter.workflows.evaluate.run_global_positioning`.
    names : sequence of str
        Rows out of :data:`CHANGES`; all, if there is none.
    progress : callable, optional
        Called with batches done and batches in all.

    Raises
    ------
    MapfilterError
        There is no such row, or as the benchmark raises it.
    """
    began_s = time.perf_counter()
    faults = Faults()
    for name in names:
        if name not in CHANGES:
            faults.add("--case", ", ".join(CHANGES), repr(name))
    faults.raise_if_any(ConfigError)
    wanted = [CHANGES[name] for name in dict.fromkeys(names)] or list(CHANGES.values())
    rows, map_name = [], ""
    for number, change in enumerate(wanted):
        given = [*settings, *(f"{key}={value}" for key, value in change.settings.items())]
        loaded, fixed = load_benchmark(change.world, config, given)
        result = run_global_positioning(
            loaded,
            out / change.name,
            runs=runs,
            seed=seed,
            cases=(change.case,),
            workers=workers,
            resume=resume,
            progress=part_of(progress, number, len(wanted)),
            fixed=fixed,
        )
        map_name = result.map
        rows.append(
            AuditRow(
                change.name,
                change.what,
                change.world,
                change.case,
                dict(change.settings),
                result.cases[0],
            )
        )
    audit = AuditResult(map_name, seed, tuple(rows), time.perf_counter() - began_s, out)
    write_json(out / TABLE, to_jsonable(audit))
    return audit
