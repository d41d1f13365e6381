"""``mapfilter reproduce dlr``: satellites and LTE time differences in a street canyon."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from mapfilter._io import atomic_file, ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.errors import ConfigError, fail
from mapfilter.experiments.papers.dlr import experiment as dlr
from mapfilter.experiments.papers.dlr import table as dlr_table
from mapfilter.experiments.papers.dlr.assumptions import ASSUMPTIONS, CLAIMS
from mapfilter.workflows.dlr_pictures import draw_dlr
from mapfilter.workflows.sweep import sweep_executor

DLR = "dlr"
TRIALS = 40
DRAWS = 40
"""Draws of the readings of the one track of Fig. 12."""

Interval = tuple[float, float]
Figures = dict[str, float]


@dataclass(frozen=True)
class Ratio:
    """A ratio of two 90 % errors on the same epochs.

    Parameters
    ----------
    ratio : float
    interval : (float, float)
        95 %, over tracks.
    """

    ratio: float
    interval: Interval


@dataclass(frozen=True)
class DlrRow:
    """One filter on one set of epochs; errors in metres, east and north.

    Parameters
    ----------
    filter, satellites : str
    where : str or None
        Where in the network time differences are taken; None without them.
    above_db : float or None
        SINR below which stations are dropped; None for the three best ones.
    sky : {"canyon", "open"}
    mobility : {"diagonal", "discretised"}
    epochs : {"every", "fixed", "critical", "gps_critical"}
        All; those with a static fix; with fewer than four satellites of both systems; of GPS.
    count : int
    told : float
        Share of them at which a position is told; the others are worse than any error below.
    error_50_m, error_67_m, error_90_m, error_95_m : float
    interval_m : (float, float)
        95 %, of the 90 % error, over tracks.
    """

    filter: str
    satellites: str
    where: str | None
    above_db: float | None
    sky: str
    mobility: str
    epochs: str
    count: int
    told: float
    error_50_m: float
    error_67_m: float
    error_90_m: float
    error_95_m: float
    interval_m: Interval


@dataclass(frozen=True)
class DlrResult:
    """90 % errors in metres, by the paper's comparisons; each compares on the same epochs.

    Parameters
    ----------
    all : dict
        ``static``, ``pkf``, ``ekf``, ``pf`` by GPS and Galileo, on the epochs with a static fix.
    tdoa_only : dict
        ``ekf_edge``, ``pf_edge``, ``pf_near``: time differences of the three best stations alone.
    hybrid : dict
        ``ekf_gnss``, ``ekf_edge``, ``ekf_near``, ``fixed3_edge``, on every epoch.
    critical : dict
        ``gps``, ``gps_galileo``, ``near``, ``edge`` by the EKF, on epochs with fewer than four
        satellites.
    static_availability : float
        Share of the epochs with a static fix.
    every_epoch : dict
        As ``all``, on every epoch; those without a static fix are failures of it.
    critical_share : float
        Share of the epochs with fewer than four satellites.
    intervals : dict
        95 % over tracks, of each of these figures.
    published : dict
        The paper's, where it tells them.
    ratios : dict
    rows : tuple of DlrRow
    claims : tuple of str
        What the paper says.
    trials, epochs : int
        Tracks; epochs of all of them.
    assumptions : tuple of str
    outputs : tuple of Path
    seconds : float
        Wall time.
    """

    all: Figures
    tdoa_only: Figures
    hybrid: Figures
    critical: Figures
    static_availability: float
    every_epoch: Figures
    critical_share: float
    intervals: dict[str, dict[str, Interval]]
    published: dict[str, dict[str, float | None]]
    ratios: dict[str, Ratio]
    rows: tuple[DlrRow, ...]
    claims: tuple[str, ...]
    trials: int
    epochs: int
    assumptions: tuple[str, ...]
    outputs: tuple[Path, ...]
    seconds: float


def run_reproduce_dlr(
    out: Path,
    *,
    trials: int | None = None,
    seed: int = 0,
    workers: int = 1,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> DlrResult:
    """Run all filters over tracks through the canyon; draw the figures and write the table.

    Parameters
    ----------
    out : Path
        Folder of everything.
    trials : int, optional
        Tracks of 290 steps, 40 by default.
    seed : int
    workers, cluster
        As for :func:`mapfilter.workflows.sweep.run_sweep`.
    progress : callable, optional
        Called with tasks done and tasks in all.

    Raises
    ------
    MapfilterError
        A single track, which has no interval, or the output cannot be written.
    """
    began_s = time.perf_counter()
    count = TRIALS if trials is None else trials
    if count < 2:
        raise fail(ConfigError, "--trials", "at least 2, for intervals", count)
    ensure_writable_folder(out)
    with sweep_executor(workers, cluster) as (executor, _):
        run = dlr.run_paper(count, seed, DRAWS, executor, progress)
    return summarised(run, seed, out, began_s)


def summarised(run: dlr.PaperRun, seed: int, out: Path, began_s: float) -> DlrResult:
    """Write figures and table of a run, and return what they say."""
    found = dlr_table.figures(run)
    rows = tuple(_row(row) for row in dlr_table.rows(run))
    table = out / "errors.csv"
    _write(table, _lines(rows))
    pictures = draw_dlr(run, seed, out)
    intervals = {
        group: {name: (one.low, one.high) for name, one in names.items()}
        for group, names in found.items()
    }
    ratios = {
        name: Ratio(one.value, (one.low, one.high)) for name, one in dlr_table.ratios(run).items()
    }
    told = {group: dlr_table.values(found, group) for group in found}
    return DlrResult(
        told["all"], told["tdoa_only"], told["hybrid"], told["critical"], float(run.fixed.mean()),
        told["every_epoch"], float(run.critical.mean()), intervals, dlr_table.PUBLISHED, ratios,
        rows, CLAIMS, len(run.satellites), int(run.every.sum()), ASSUMPTIONS, (table, *pictures),
        time.perf_counter() - began_s,
    )  # fmt: skip


def _row(row: dlr_table.Row) -> DlrRow:
    key = row.run
    p50, p67, p90, p95 = row.percentiles_m
    return DlrRow(
        key.filter, key.satellites, key.where, key.above_db, "open" if key.open_sky else "canyon",
        key.mobility, row.epochs, row.count, row.told, p50, p67, p90, p95, row.interval_m,
    )  # fmt: skip


def _lines(rows: Sequence[DlrRow]) -> Iterator[list[str]]:
    yield [
        "filter", "satellites", "where", "above_db", "sky", "mobility", "epochs", "count", "told",
        "error_50_m", "error_67_m", "error_90_m", "error_95_m", "error_90_low_m", "error_90_high_m",
    ]  # fmt: skip
    for row in rows:
        picked = "" if row.where is None else "three best"
        above = picked if row.above_db is None else f"{row.above_db:g}"
        errors = (row.error_50_m, row.error_67_m, row.error_90_m, row.error_95_m, *row.interval_m)
        yield [
            row.filter, row.satellites, row.where or "", above, row.sky, row.mobility, row.epochs,
            str(row.count), f"{row.told:.4f}", *(f"{error:.4g}" for error in errors),
        ]  # fmt: skip


def _write(path: Path, lines: Iterator[list[str]]) -> None:
    with (
        atomic_file(path) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as stream,
    ):
        csv.writer(stream, lineterminator="\n").writerows(lines)
