"""Protocol of all papers: run, summary, tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
import pandas as pd

from mapfilter._parallel import Progress
from mapfilter._types import Floats
from mapfilter.experiments.sweep.plan import SweepPlan
from mapfilter.models.motion import LinearMotion
from mapfilter.report.canvas import Drawn

Run = TypeVar("Run")

Picture = tuple[str, Drawn]
"""Name of the file, without a suffix, and what is drawn."""


@dataclass(frozen=True)
class PaperSettings:
    """Settings of a paper's experiments.

    Parameters
    ----------
    trials : int
        Trials, or runs in each cell of a grid.
    executor : concurrent.futures.Executor, optional
        Does the independent parts of the work; this process when left out.
    sweep : callable, optional
        Predicts and builds the map that settings (``section.key=value``) describe, runs sweeps over
        it, and returns the map's name and the rows of all runs; only for papers that run on a map,
        which :func:`mapfilter.workflows.reproduce.run_reproduce` gives one.
    progress : callable, optional
        Called with parts of the work done and parts in all.
    layout_file : Path, optional
        TOML of a scene other than the paper's, for papers that take one.
    """

    trials: int
    seed: int = 0
    executor: Executor | None = None
    sweep: Callable[[Sequence[str], Sequence[SweepPlan]], tuple[str, pd.DataFrame]] | None = None
    progress: Progress | None = None
    layout_file: Path | None = None


@dataclass(frozen=True)
class Paper(Generic[Run]):
    """A paper whose experiments can be repeated.

    Parameters
    ----------
    name, title : str
        As on the command line; author, year and subject.
    trials : int
        By default.
    run : callable
        Runs all experiments.
    summary : callable
        Returns the figures of a run by name, ready for JSON; documents them. ``rows``, where there
        are any, are also in a table. ``outputs``, where it is among them, keeps the place of the
        files.
    tables : callable
        Returns the tables of a run by name.
    pictures : callable
        Draws a run, picture by picture, each with its name.
    unit : str
        What ``progress`` counts.
    trial_limits : (int, int or None)
        Least and most trials.
    why : str
        Reason of the limits, for the error message.
    options : tuple of str
        Options of the command line that not all papers take.
    """

    name: str
    title: str
    trials: int
    run: Callable[[PaperSettings], Run]
    summary: Callable[[Run], dict[str, Any]]
    tables: Callable[[Run], Mapping[str, pd.DataFrame]]
    pictures: Callable[[Run], Iterator[Picture]]
    unit: str = "trials"
    trial_limits: tuple[int, int | None] = (1, None)
    why: str = ""
    options: tuple[str, ...] = ()


def true_states(
    motion: LinearMotion, start: Floats, trials: int, steps: int, rng: np.random.Generator
) -> Floats:
    """Draw true states at k = 1 ... K of all trials from one start (n,), shape (T, K, n)."""
    states = np.empty((trials, steps, start.size))
    now = np.tile(start, (trials, 1))
    for k in range(steps):
        now = motion.sample(now, rng)
        states[:, k] = now
    return states


def share_beyond(means: Floats, states: Floats, far_m: float) -> float:
    """Return the share of trials whose position, components 0 and 2, is far off at the end."""
    off_m = (means - states)[:, -1][:, [0, 2]]
    return float(np.mean(np.hypot(*off_m.T) > far_m))


def interval_columns(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row for a table: each interval as two columns named after the figure before it."""
    found: dict[str, Any] = {}
    last = ""
    for name, value in row.items():
        if isinstance(value, tuple):
            found |= {f"{last}_low": value[0], f"{last}_high": value[1]}
        else:
            found[name] = value
            last = name
    return found
