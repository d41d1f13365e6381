"""Global positioning from an unknown start, on any map and in any world.

Runs go in batches of a few routes, each with a ground truth of its own; all cases run over the same
journeys, or one of them over each. Finished batches lie on disk, so what was stopped can go on.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from mapfilter._json_files import read_sealed, write_sealed
from mapfilter._parallel import Progress, SerialExecutor, ordered_results
from mapfilter._resume import kept_when_stopped, start_or_resume
from mapfilter.errors import StoreError
from mapfilter.evaluation.stanford import IntegrityOptions
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.benchmarks.journeys import TOWN_HEIGHT, Walk
from mapfilter.experiments.benchmarks.scores import Row, score, score_window
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.loop import locate
from mapfilter.positioning.positioned_track import PositionedTrack
from mapfilter.propagation.shadowing import named_rng
from mapfilter.tracks.log import TrackLog

ROUTES_PER_BATCH = 2
HEAD, BATCHES = "benchmark.json", "batches"
_VERSION = 3


class RunsOfRoute(Protocol):
    """The runs of all cases on one route and in one ground truth."""

    def run(self, case: Any) -> tuple[Walk, TrackLog]:
        """Return truth and log of a case."""

    def filter(self, choice: FilterOptions, case: Any) -> Filter[Any]:
        """Return the filter over the database that a case is given."""

    def window_from_s(self, case: Any, walked: Walk) -> float | None:
        """Return from when on the errors of two minutes are looked at; None for no window."""


class BenchmarkCity(Protocol):
    """A simulated city on disk, with everything that its runs are drawn from."""

    @property
    def seed(self) -> int:
        """Of routes, ground truths and noise."""

    @property
    def sha256(self) -> str:
        """Of all that its runs depend on, but the seed."""

    def case(self, name: str) -> Case:
        """Return a case by its name."""

    def on_route(self, route: int, fixed: frozenset[str] = frozenset()) -> RunsOfRoute:
        """Return the runs on a route; ``fixed`` are errors that were set for all cases."""


@dataclass(frozen=True)
class Batch:
    """Runs of some cases over the routes from ``first`` to before ``end``.

    Parameters
    ----------
    fixed : frozenset of str
        Options of the filter and errors of dead reckoning that were set for all cases.
    integrity : IntegrityOptions
        Risk and alert limit of the protection levels.
    one_case : bool
        Each route has one of the cases, drawn, instead of all.
    """

    city: BenchmarkCity
    choice: FilterOptions
    cases: tuple[str, ...]
    first: int
    end: int
    fixed: frozenset[str] = frozenset()
    integrity: IntegrityOptions = field(default_factory=IntegrityOptions)
    one_case: bool = False

    def cases_on(self, route: int) -> tuple[str, ...]:
        """Return the cases that are run on a route."""
        if not self.one_case:
            return self.cases
        rng = named_rng(self.city.seed, "case", str(route))
        return (self.cases[int(rng.integers(len(self.cases)))],)


@dataclass(frozen=True, eq=False)
class LocatedRun:
    """One run of a case: truth, log and estimate."""

    case: Case
    walked: Walk
    log: TrackLog
    found: PositionedTrack


def run_batch(batch: Batch) -> list[Row]:
    """Do the runs of a batch and return their rows."""
    rows: list[Row] = []
    for route in range(batch.first, batch.end):
        runs = batch.city.on_route(route, batch.fixed)
        for name in batch.cases_on(route):
            one = located_run(batch, runs, name, route)
            row = {**score(one.case, one.walked, one.found, batch.integrity), "route": route}
            from_s = runs.window_from_s(one.case, one.walked)
            if from_s is not None:
                row |= score_window(one.walked, one.found, from_s)
            rows.append(row)
    return rows


def located_run(batch: Batch, runs: RunsOfRoute, name: str, route: int) -> LocatedRun:
    """Return one run of a batch's case, to be scored or drawn.

    Parameters
    ----------
    runs : RunsOfRoute
        Of the route.
    name : str
        Of the case.
    """
    case = batch.city.case(name)
    walked, log = runs.run(case)
    filter_ = runs.filter(informed(batch.choice, case, batch.fixed), case)
    rng = named_rng(batch.city.seed, "filter", name, str(route))
    return LocatedRun(case, walked, log, locate(log, filter_, rng, risk=batch.integrity.risk))


def informed(
    choice: FilterOptions, case: Case, fixed: frozenset[str] = frozenset()
) -> FilterOptions:
    """Return a filter with what the case's data sheet states, of options that are not fixed."""
    if not isinstance(choice, BayesFilter):
        return replace(choice, smooth=case.smooth) if isinstance(choice, KalmanFilter) else choice
    stated = {**case.data_sheet, **(TOWN_HEIGHT if case.satellites is not None else {})}
    known: dict[str, Any] = {name: value for name, value in stated.items() if name not in fixed}
    return replace(choice, smooth=case.smooth, **known)


def run_benchmark(
    whole: Batch,
    out: Path,
    *,
    executor: Executor | None = None,
    in_flight: int = 4,
    resume: bool = False,
    progress: Progress | None = None,
) -> list[Row]:
    """Do all runs in batches, and return their rows in the order of the routes.

    Parameters
    ----------
    whole : Batch
        All runs as one batch.
    out : Path
        Keeps finished batches; those of the same benchmark are not done again where ``resume``.
    in_flight : int
        Batches that are handed to the executor at a time.
    progress : callable, optional
        Called with batches done and batches in all.

    Raises
    ------
    ConfigError
        There is something else to resume.
    """
    head = {
        "version": _VERSION,
        "filter": repr(whole.choice),
        "cases": list(whole.cases),
        "seed": whole.city.seed,
        "fixed": sorted(whole.fixed),
        "integrity": repr(whole.integrity),
        "one_case": whole.one_case,
        "world": whole.city.sha256,
    }
    folder = out / BATCHES
    folder.mkdir(parents=True, exist_ok=True)
    start_or_resume(out / HEAD, head, folder.glob("*.json"), resume=resume)
    parts, tasks = [], []
    for first in range(whole.first, whole.end, ROUTES_PER_BATCH):
        batch = replace(whole, first=first, end=min(first + ROUTES_PER_BATCH, whole.end))
        parts.append(folder / f"{first:06d}.json")
        count = sum(len(batch.cases_on(route)) for route in range(batch.first, batch.end))
        if not (resume and len(_rows(parts[-1])) == count):
            tasks.append((parts[-1], batch))
    results = ordered_results(
        executor or SerialExecutor(),
        run_batch,
        [batch for _, batch in tasks],
        in_flight=in_flight,
        progress=progress,
    )
    with kept_when_stopped("batches"):
        for (part, _), rows in zip(tasks, results, strict=True):
            write_sealed(part, {"rows": rows})
    return [row for part in parts for row in _rows(part)]


def _rows(part: Path) -> list[Any]:
    try:
        found = read_sealed(part).get("rows")
    except StoreError:
        # Missing, cut off or changed: done again.
        return []
    return found if isinstance(found, list) else []
