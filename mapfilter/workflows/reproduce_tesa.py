"""``mapfilter reproduce tesa``: GNSS and GSM power by a Rao-Blackwellised particle filter."""

from __future__ import annotations

import csv
import time
from dataclasses import dataclass
from math import inf
from pathlib import Path

from mapfilter._io import atomic_file, ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.errors import ConfigError, fail
from mapfilter.experiments.papers.tesa import experiment as tesa
from mapfilter.experiments.papers.tesa.models import IDENTITY, KNOWN_BEARING, VELOCITY, Motion
from mapfilter.experiments.papers.tesa.scene import ASSUMPTIONS, BETA_DB
from mapfilter.workflows.sweep import sweep_executor
from mapfilter.workflows.tesa_pictures import draw_tesa

TESA = "tesa"
TRIALS = 50

CLAIMS = (
    "Figs. 6 and 7: with powers of GSM the accuracy improves slightly",
    "Fig. 8: without satellites a position is still available, with a far larger error",
)
"""What the paper says; it prints no figures."""

Interval = tuple[float, float]


@dataclass(frozen=True)
class Scenario1:
    """Mean errors with five satellites all the way, β = 1 dB, by the identity model.

    Errors are norms in three dimensions.

    Parameters
    ----------
    gnss_m, hybrid_m : float
    """

    gnss_m: float
    hybrid_m: float


@dataclass(frozen=True)
class Below:
    """Shares of the outage's epochs with less than 100 m of error, satellites and GSM.

    Parameters
    ----------
    velocity, identity, known_bearing : float
        By the filter's model of motion.
    """

    velocity: float
    identity: float
    known_bearing: float


@dataclass(frozen=True)
class Scenario2:
    """Mean errors over an outage of 200 s, β = 1 dB, and availability.

    Only ``hybrid_known_bearing_outage_m`` uses the true bearing of the road.

    Parameters
    ----------
    hybrid_outage_m : float
        Headline: satellites and GSM by the velocity model.
    hybrid_outage_interval_m : (float, float)
        Its 95 % interval over trials.
    gnss_velocity_outage_m : float
        Satellites alone by the velocity model.
    hybrid_identity_outage_m, gnss_outage_m : float
        Satellites with GSM and satellites alone, by the paper's identity model.
    hybrid_known_bearing_outage_m : float
        Satellites and GSM by an identity model with noise along the true road; a comparison only.
    availability_gnss, availability_hybrid_identity, availability_hybrid : float
        Shares of all 720 s with less than 100 m of error: satellites alone and with GSM by the
        identity model, with GSM by the velocity model.
    outage_below_100m : Below
    """

    hybrid_outage_m: float
    hybrid_outage_interval_m: Interval
    gnss_velocity_outage_m: float
    hybrid_identity_outage_m: float
    gnss_outage_m: float
    hybrid_known_bearing_outage_m: float
    availability_gnss: float
    availability_hybrid_identity: float
    availability_hybrid: float
    outage_below_100m: Below


@dataclass(frozen=True)
class Scenario3:
    """Mean errors over the same outage where the vehicle halts in it, β = 1 dB.

    Not in the paper: at constant speed a velocity model keeps its position even without levels.

    Parameters
    ----------
    hybrid_outage_m, gnss_velocity_outage_m : float
        Satellites with GSM and satellites alone by the velocity model.
    hybrid_identity_outage_m : float
    """

    hybrid_outage_m: float
    gnss_velocity_outage_m: float
    hybrid_identity_outage_m: float


@dataclass(frozen=True)
class TesaRow:
    """One filter over one scenario; intervals of 95 % over trials.

    Parameters
    ----------
    scenario : int
    motion : str
    beta_db : float or None
        None without GSM.
    mean_m, outage_m, below_100m, availability : float
        Error over all epochs and over those of the outage; shares of the outage's epochs and of
        all with less than 100 m.
    mean_interval_m, outage_interval_m, below_interval, availability_interval : (float, float)
    """

    scenario: int
    motion: Motion
    beta_db: float | None
    mean_m: float
    mean_interval_m: Interval
    outage_m: float
    outage_interval_m: Interval
    below_100m: float
    below_interval: Interval
    availability: float
    availability_interval: Interval


@dataclass(frozen=True)
class TesaResult:
    """The scenarios, and all filters by β.

    Parameters
    ----------
    scenario1 : Scenario1
    scenario2 : Scenario2
    scenario3 : Scenario3
    hybrid_less_gnss_m : float
        Of scenario 1, trial by trial; below 0 where GSM helps.
    hybrid_less_gnss_interval_m : (float, float)
    rows : tuple of TesaRow
    claims : tuple of str
        What the paper says; it prints no figures.
    trials : int
    assumptions : tuple of str
    outputs : tuple of Path
    seconds : float
        Wall time.
    """

    scenario1: Scenario1
    scenario2: Scenario2
    scenario3: Scenario3
    hybrid_less_gnss_m: float
    hybrid_less_gnss_interval_m: Interval
    rows: tuple[TesaRow, ...]
    claims: tuple[str, ...]
    trials: int
    assumptions: tuple[str, ...]
    outputs: tuple[Path, ...]
    seconds: float


def run_reproduce_tesa(
    out: Path,
    *,
    trials: int | None = None,
    seed: int = 0,
    workers: int = 1,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> TesaResult:
    """Run the paper's two scenarios and a halt; draw its figures and write its table.

    Parameters
    ----------
    out : Path
        Folder of everything.
    trials : int, optional
        50 by default.
    seed : int
    workers, cluster
        As for :func:`mapfilter.workflows.sweep.run_sweep`.
    progress : callable, optional
        Called with trials done and trials in all.

    Raises
    ------
    MapfilterError
        A single trial, which has no interval, or the output cannot be written.
    """
    began_s = time.perf_counter()
    count = TRIALS if trials is None else trials
    if count < 2:
        raise fail(ConfigError, "--trials", "at least 2, for intervals", count)
    ensure_writable_folder(out)
    with sweep_executor(workers, cluster) as (executor, _):
        run = tesa.run_paper(count, seed, executor, progress)
    return summarised(run, out, began_s)


def summarised(run: tesa.PaperRun, out: Path, began_s: float) -> TesaResult:
    """Write figures and table of a run, and return what they say."""
    rows = {key: _row(run, key) for key in tesa.RUNS}
    table = out / "scenarios.csv"
    _write(table, tuple(rows.values()))
    pictures = draw_tesa(run, out)
    gnss, hybrid = tesa.Run(1, "identity"), tesa.Run(1, "identity", BETA_DB)
    gain = tesa.estimate((run.errors_m[hybrid] - run.errors_m[gnss]).mean(axis=1))
    alone, alone_velocity = rows[tesa.Run(2, "identity")], rows[tesa.Run(2, "velocity")]
    velocity, identity, bearing = (
        rows[tesa.Run(2, motion, BETA_DB)] for motion in (VELOCITY, IDENTITY, KNOWN_BEARING)
    )
    return TesaResult(
        Scenario1(rows[gnss].mean_m, rows[hybrid].mean_m),
        Scenario2(
            velocity.outage_m, velocity.outage_interval_m, alone_velocity.outage_m,
            identity.outage_m, alone.outage_m, bearing.outage_m, alone.availability,
            identity.availability, velocity.availability,
            Below(velocity.below_100m, identity.below_100m, bearing.below_100m),
        ),
        Scenario3(
            rows[tesa.Run(3, "velocity", BETA_DB)].outage_m,
            rows[tesa.Run(3, "velocity")].outage_m,
            rows[tesa.Run(3, "identity", BETA_DB)].outage_m,
        ),
        gain.value, (gain.low, gain.high), tuple(rows.values()), CLAIMS,
        len(run.errors_m[gnss]), ASSUMPTIONS, (table, *pictures),
        time.perf_counter() - began_s,
    )  # fmt: skip


def _row(run: tesa.PaperRun, key: tesa.Run) -> TesaRow:
    errors, outage = run.errors_m[key], run.scene.outage
    near = errors < tesa.AVAILABLE_M
    mean, within = (
        tesa.estimate(values.mean(axis=1)).within(0.0, inf)
        for values in (errors, errors[:, outage])
    )
    below, available = (
        tesa.estimate(values.mean(axis=1)).within(0.0, 1.0) for values in (near[:, outage], near)
    )
    return TesaRow(
        key.scenario, key.motion, key.beta_db, mean.value, (mean.low, mean.high), within.value,
        (within.low, within.high), below.value, (below.low, below.high), available.value,
        (available.low, available.high),
    )  # fmt: skip


def _write(path: Path, rows: tuple[TesaRow, ...]) -> None:
    names = ("mean_m", "outage_m", "below_100m", "availability")
    header = ["scenario", "motion", "beta_db"]
    for name in names:
        header += [name, f"{name}_low", f"{name}_high"]
    lines = [header]
    for row in rows:
        beta = "" if row.beta_db is None else f"{row.beta_db:g}"
        line = [str(row.scenario), row.motion, beta]
        for value, interval in (
            (row.mean_m, row.mean_interval_m), (row.outage_m, row.outage_interval_m),
            (row.below_100m, row.below_interval), (row.availability, row.availability_interval),
        ):  # fmt: skip
            line += [f"{number:.4g}" for number in (value, *interval)]
        lines.append(line)
    with (
        atomic_file(path) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as stream,
    ):
        csv.writer(stream, lineterminator="\n").writerows(lines)
