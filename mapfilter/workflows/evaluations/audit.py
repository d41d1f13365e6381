"""``mapfilter evaluate audit``: the easy world, changed in one respect at a time."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mapfilter._json_files import write_json
from mapfilter._parallel import Progress, part_of
from mapfilter.experiments.benchmarks.results import CaseResult
from mapfilter.workflows.evaluate import TABLE, check_names, main_figures, run_global_positioning
from mapfilter.workflows.evaluations.settings import load_benchmark
from mapfilter.workflows.outputs.result_text import to_jsonable

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
    change : str
        In words.
    world : {"easy", "plain"}
        That is changed.
    case : str
        Of the benchmark.
    settings : dict of str to str
        The change as settings.
    """

    name: str
    change: str
    world: str = "easy"
    case: str = "levels-6"
    settings: dict[str, str] = field(default_factory=dict)


CHANGES = {
    change.name: change
    for change in (
        Change("easy", "nothing"),
        Change("own-clutter", "the ground truth's clutter is its own", settings=_CLUTTER),
        Change(
            "no-clutter",
            "prediction without random clutter",
            settings={"prediction.shadowing_db": "0"},
        ),
        Change(
            "noisy-truth",
            "the same, and 6 dB more of shadowing in the ground truth",
            settings={
                "prediction.shadowing_db": "0",
                "prediction.ground_truth.level_error_db": "9.22",
            },
        ),
        Change("heading", "heading error of 10°, correlated over 20 s", settings=_HEADING),
        Change(
            "gyro",
            "no compass; a gyro's errors accumulate",
            case="levels-nocompass",
            settings=_GYRO,
        ),
        Change("beside", "8 m beside the centre line", settings=_BESIDE),
        Change("scale", "step scale wanders by 10 % over 15 s", settings=_SCALE),
        Change("fading", "4 dB of fading", settings=_FADING),
        Change("model", "another propagation model, other streets and roofs", settings=_MODEL),
        Change("lengths", "shadowing of 15 m and of 100 m", settings=_LENGTHS),
        Change(
            "phone",
            "the phone's levels are off by 4 dB",
            settings={"journeys.phone_offset_sd_db": "4"},
        ),
        Change("stops", "a stop of 20 s every 300 m", settings={"journeys.stop_every_m": "300"}),
        Change(
            "all-but-gyro",
            "own clutter, heading, beside, scale and fading",
            settings=_CLUTTER | _HEADING | _BESIDE | _SCALE | _FADING,
        ),
        Change("plain", "the plain world", "plain"),
        Change(
            "plain-clutter",
            "the plain world, prediction with 6 dB of random clutter",
            "plain",
            settings={"prediction.shadowing_db": "6"},
        ),
        Change(
            "plain-noisy-truth",
            "the plain world, 6 dB more of shadowing in the ground truth",
            "plain",
            settings={"prediction.ground_truth.level_error_db": "7.81"},
        ),
    )
}
"""All rows by name, in the order of the table."""


@dataclass(frozen=True, kw_only=True)
class AuditRow(Change):
    """One row of the table: a change, and the benchmark's result with it."""

    result: CaseResult


@dataclass(frozen=True)
class AuditResult:
    """Results of the audit: the map's file, a row for each change, wall time."""

    map: str
    seed: int
    rows: tuple[AuditRow, ...]
    seconds: float
    out: Path


def audit_table(audit: AuditResult) -> dict[str, Any]:
    """Return the result of an audit with the main figures of each row only."""
    rows = [
        {"name": row.name, "world": row.world, **main_figures(row.result)} for row in audit.rows
    ]
    return {**vars(audit), "rows": rows}


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
        As for :func:`mapfilter.workflows.evaluations.settings.load_benchmark`; each row's change
        comes after them.
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
    wanted = check_names(names, CHANGES) or tuple(CHANGES)
    rows, map_name = [], ""
    for number, change in enumerate(CHANGES[name] for name in wanted):
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
            pictures=False,
        )
        map_name = result.map
        rows.append(AuditRow(**vars(change), result=result.cases[0]))
    audit = AuditResult(map_name, seed, tuple(rows), time.perf_counter() - began_s, out)
    write_json(out / TABLE, to_jsonable(audit))
    return audit
