"""``mapfilter reproduce`` for the two papers on the fusion of GPS and GSM."""

from __future__ import annotations

import csv
import time
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._io import atomic_file, ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter.errors import ConfigError, InputError, fail
from mapfilter.experiments.papers.fritsche_klein_2009 import experiment as fritsche_klein
from mapfilter.experiments.papers.fritsche_klein_2009.scene import COMBINATIONS, Layout
from mapfilter.experiments.papers.zhang_2006 import experiment as zhang
from mapfilter.workflows.fusion_pictures import draw_fritsche_klein_2009, draw_zhang_2006

FUSION_PAPERS = ("fritsche-klein-2009", "zhang-2006")

Figures = dict[str, float | None]

MOST_TRIALS = 20_000

_AT = (10, 100, 400)
_OVER_AT = (50, 100, 200, 400)


@dataclass(frozen=True)
class FritscheKleinResult:
    """Averages over time of root mean square errors, as in Table III.

    Parameters
    ----------
    rbukf, ekf, pcrlb, smoothed : dict
        By combination of measurements and quantity; ``smoothed`` is the EKF's track, smoothed.
    published : dict
        Table III, by filter, combination and quantity.
    worst_ratio : float
        Largest deviation of a measured figure from the published one, as a share of it.
    lowest_over_bound : float
        Smallest ratio of a filter's figure and the bound.
    hard : dict
        By filter, the location's average in the hard layout.
    hard_astray : dict
        By filter, the share of trials there more than 500 m off at the end.
    trials : int
    assumptions : tuple of str
    outputs : tuple of Path
    seconds : float
        Wall time.
    """

    rbukf: dict[str, Figures]
    ekf: dict[str, Figures]
    pcrlb: dict[str, Figures]
    smoothed: dict[str, Figures]
    published: dict[str, dict[str, Figures]]
    worst_ratio: float
    lowest_over_bound: float
    hard: dict[str, float]
    hard_astray: dict[str, float]
    trials: int
    assumptions: tuple[str, ...]
    outputs: tuple[Path, ...]
    seconds: float


@dataclass(frozen=True)
class ZhangResult:
    """Bounds and what filters reach of them; indices are k.

    Parameters
    ----------
    bound_m : dict
        By σ_l in dB, combination and k, the bound on the position.
    ekf_over_bound : dict
        By k, the position error of the EKF started from a fix, over the bound; TA and RSS.
    single_over_fusion_bound : dict
        The same of filters with one kind of measurement, over the bound of both (Fig. 3).
    wide_over_bound : dict
        By combination, filter and k, from the start known to 5 km, over the combination's bound.
    wide_astray : dict
        By combination and filter, the share of trials more than 1 km off at the end of that.
    claims : tuple of str
        What the paper says; it prints no figures.
    trials : int
    assumptions : tuple of str
    outputs : tuple of Path
    seconds : float
    """

    bound_m: dict[str, dict[str, dict[str, float]]]
    ekf_over_bound: dict[str, float]
    single_over_fusion_bound: dict[str, dict[str, float]]
    wide_over_bound: dict[str, dict[str, dict[str, float]]]
    wide_astray: dict[str, dict[str, float]]
    claims: tuple[str, ...]
    trials: int
    assumptions: tuple[str, ...]
    outputs: tuple[Path, ...]
    seconds: float


def run_reproduce_fusion(
    name: str,
    out: Path,
    *,
    layout_file: Path | None = None,
    trials: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> FritscheKleinResult | ZhangResult:
    """Run a paper's experiments; draw its figures and write its tables.

    Parameters
    ----------
    name : str
        ``fritsche-klein-2009`` or ``zhang-2006``.
    out : Path
        Folder of everything.
    layout_file : Path, optional
        TOML with fields of
        :class:`mapfilter.experiments.papers.fritsche_klein_2009.scene.Layout`.
    trials : int, optional
        By default as in the paper: 500 or 1000.
    seed : int
    progress : callable, optional
        Called with parts done and parts in all.

    Raises
    ------
    MapfilterError
        There is no such paper, there are too many trials, the layout is wrong, or the output
        cannot be written.
    """
    if name not in FUSION_PAPERS:
        raise fail(ConfigError, "reproduce", f"one of {', '.join(FUSION_PAPERS)}", repr(name))
    if trials is not None and not 1 <= trials <= MOST_TRIALS:
        hint = "all trials are in memory at once"
        raise fail(ConfigError, "--trials", f"a number in 1..{MOST_TRIALS}", trials, hint)
    if name == "zhang-2006":
        if layout_file is not None:
            raise fail(ConfigError, "--layout", "fritsche-klein-2009", name)
        ensure_writable_folder(out)
        return _zhang(out, trials or 1000, seed, progress)
    layout = Layout() if layout_file is None else read_layout(layout_file)
    ensure_writable_folder(out)
    return _fritsche_klein(layout, out, trials or 500, seed, progress)


def read_layout(path: Path) -> Layout:
    """Read a layout; fields left out are as by default.

    Raises
    ------
    InputError
        The file cannot be read, is no TOML, or holds what is no layout.
    """
    try:
        given: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise fail(InputError, str(path), "TOML", error) from error
    known = [field.name for field in fields(Layout)]
    if unknown := sorted(set(given) - set(known)):
        raise fail(InputError, str(path), f"keys among {', '.join(known)}", ", ".join(unknown))
    try:
        if "sites_m" in given:
            given["sites_m"] = tuple((float(e), float(n)) for e, n in given["sites_m"])
        for name in ("boresights_deg", "satellite_azimuths_deg"):
            if name in given:
                given[name] = tuple(float(value) for value in given[name])
        return Layout(**given)
    except (TypeError, ValueError) as error:
        raise fail(
            InputError, str(path), "numbers, and pairs of them for sites_m", error
        ) from error


def _fritsche_klein(
    layout: Layout, out: Path, trials: int, seed: int, progress: Progress | None
) -> FritscheKleinResult:
    began_s = time.perf_counter()
    run = fritsche_klein.run_paper(layout, trials, seed, progress)
    found: dict[str, dict[str, Figures]] = {
        name: {kind: run.nominal[kind].averages(name) for kind in COMBINATIONS}
        for name in ("rbukf", "ekf", "pcrlb", "smoothed")
    }
    published = {
        name: {
            kind: dict(zip(fritsche_klein.QUANTITIES, row, strict=True))
            for kind, row in table.items()
        }
        for name, table in fritsche_klein.TABLE_III.items()
    }
    apart, over = [0.0], [np.inf]
    for name in ("rbukf", "ekf"):
        for kind in COMBINATIONS:
            for quantity, value in found[name][kind].items():
                told, bound = published[name][kind][quantity], found["pcrlb"][kind][quantity]
                if value is not None and told is not None and bound is not None:
                    apart.append(abs(value / told - 1))
                    over.append(value / bound)
    table = out / "table-3.csv"
    _write_rows(table, _table_3(found, published))
    hard = {name: float(own["location_m"].mean()) for name, own in run.hard.curves.items()}
    pictures = draw_fritsche_klein_2009(run, trials, out)
    return FritscheKleinResult(
        found["rbukf"], found["ekf"], found["pcrlb"], found["smoothed"], published, max(apart),
        float(min(over)), hard, run.hard.astray, trials, fritsche_klein.ASSUMPTIONS,
        (table, *pictures), time.perf_counter() - began_s,
    )  # fmt: skip


def _table_3(
    found: dict[str, dict[str, Figures]], published: dict[str, dict[str, Figures]]
) -> Iterable[Sequence[str]]:
    yield ("algorithm", "method", *fritsche_klein.QUANTITIES, *(
        f"published_{name}" for name in fritsche_klein.QUANTITIES
    ))  # fmt: skip
    for name, rows in found.items():
        for kind, row in rows.items():
            told = published.get(name, {}).get(kind, {})
            measured = [row[quantity] for quantity in fritsche_klein.QUANTITIES]
            beside = [told.get(quantity) for quantity in fritsche_klein.QUANTITIES]
            yield (name, kind, *(_text(value) for value in (*measured, *beside)))


def _zhang(out: Path, trials: int, seed: int, progress: Progress | None) -> ZhangResult:
    began_s = time.perf_counter()
    run = zhang.run_paper(trials, seed, progress)
    bound = {
        sigma: {kind: zhang.position_bound_m(own) for kind, own in kinds.items()}
        for sigma, kinds in run.bounds.items()
    }
    own_bound = bound[zhang.SIGMA_RSS_DB]
    over = {kind: error / own_bound["fusion"] for kind, error in run.from_fix.items()}
    wide = {
        kind: {name: _at(error / own_bound[kind], _AT) for name, error in filters.items()}
        for kind, filters in run.wide.items()
    }
    table = out / "bounds.csv"
    rows = [
        (f"{sigma:g}", kind, *(_text(value) for value in _at(own, _AT).values()))
        for sigma, kinds in bound.items()
        for kind, own in kinds.items()
    ]
    _write_rows(table, [("sigma_l_db", "method", *(f"bound_m_{k}" for k in _AT)), *rows])
    pictures = draw_zhang_2006(run, trials, out)
    return ZhangResult(
        {f"{s:g}": {kind: _at(own, _AT) for kind, own in kinds.items()}
         for s, kinds in bound.items()},
        _at(over["fusion"], _OVER_AT),
        {kind: _at(over[kind], _OVER_AT) for kind in ("ta", "rss")},
        wide, run.astray, zhang.PUBLISHED, trials, zhang.ASSUMPTIONS, (table, *pictures),
        time.perf_counter() - began_s,
    )  # fmt: skip


def _at(curve: np.ndarray, indices: Iterable[int]) -> dict[str, float]:
    return {str(k): float(curve[k - 1]) for k in indices}


def _text(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"


def _write_rows(path: Path, rows: Iterable[Sequence[str]]) -> None:
    with (
        atomic_file(path) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as stream,
    ):
        csv.writer(stream, lineterminator="\n").writerows(rows)
