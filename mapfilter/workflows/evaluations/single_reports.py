"""``mapfilter evaluate single-reports``: published fingerprints and Ottawa, without motion."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapfilter._io import ensure_writable_folder
from mapfilter._json_files import write_json
from mapfilter._parallel import Progress
from mapfilter.experiments.benchmarks.ottawa import PARTS
from mapfilter.experiments.benchmarks.ottawa_sessions import read_session
from mapfilter.experiments.benchmarks.single_reports import (
    METHODS,
    WIFI,
    WIFI_FOLDER,
    SingleReportsRow,
    locate_sessions,
    locate_wifi,
    read_wifi,
    row_of,
)
from mapfilter.geodesy import utm_crs_of
from mapfilter.positioning.fingerprints.located import LocatedReports
from mapfilter.positioning.fingerprints.options import AUTO
from mapfilter.report.canvas import BLACK, GREEN, GREY, ORANGE, PURPLE, SKY
from mapfilter.report.cumulative import Distribution, axis_end_m, plot_cumulative
from mapfilter.report.saving import save
from mapfilter.workflows.evaluate import check_names
from mapfilter.workflows.evaluations.ottawa import session_files
from mapfilter.workflows.outputs.result_text import to_jsonable

TABLE = "table.json"
SETS = (*WIFI, *PARTS)
_COLOURS = dict(zip(METHODS, (BLACK, SKY, GREEN, ORANGE, GREY, PURPLE), strict=True))
_SHARE = 0.95
USUAL = tuple(name for name in METHODS if name != "gp")
"""Ten times Gaussian processes of each transmitter take minutes to an hour a set."""


@dataclass(frozen=True)
class SingleReportsResult:
    """A row for each data set and method, and wall time."""

    rows: tuple[SingleReportsRow, ...]
    seconds: float
    out: Path


def run_single_reports(
    data: Path,
    out: Path,
    *,
    sets: Sequence[str] = SETS,
    methods: Sequence[str] = USUAL,
    progress: Progress | None = None,
) -> SingleReportsResult:
    """Locate the reports of published data sets, each report by itself.

    Parameters
    ----------
    data : Path
        Holds the folders ``fingerprint-wifi`` and ``cell-ottawa-lte``.
    out : Path
        Gets ``table.json`` and a picture of the errors of each set that has any.
    sets : sequence of str
        Of :data:`SETS`; all when left out.
    methods : sequence of str
        Of :data:`~mapfilter.experiments.benchmarks.single_reports.METHODS`; all but "gp" when left
        out.
    progress : callable, optional
        Called with runs done and runs in all.

    Raises
    ------
    MapfilterError
        A set is unknown, missing or damaged, or the output cannot be written.
    """
    began_s = time.perf_counter()
    sets = check_names(sets, SETS)
    ensure_writable_folder(out)
    rows: list[SingleReportsRow] = []
    done, count = 0, len(sets) * len(methods)
    for name in sets:
        by_method = _reader(data, name)
        curves = []
        for method in methods:
            parts = by_method(method)
            rows.append(row_of(name, method, parts))
            error_m = np.concatenate([part.error_m for part in parts])
            label = f"{method}, median {rows[-1].median_m:.3g} m"
            known_m = error_m[np.isfinite(error_m)]
            style = "--" if method == AUTO else "-"
            if known_m.size:
                curves.append(Distribution(label, known_m, _COLOURS[method], style))
            done += 1
            if progress is not None:
                progress(done, count)
        if not curves:
            continue
        # What "auto" chose lies on that method's curve: dashed, above it.
        curves.sort(key=lambda curve: curve.style == "--")
        title, most_m = f"{name}: errors of single reports", axis_end_m(curves)
        drawn = plot_cumulative(curves, title=title, most_m=most_m, share=_SHARE, of="reports")
        save(drawn, out / f"{name}.png")
    result = SingleReportsResult(tuple(rows), time.perf_counter() - began_s, out)
    write_json(out / TABLE, to_jsonable(result))
    return result


def _reader(data: Path, name: str) -> Callable[[str], Sequence[LocatedReports]]:
    """Return a function from the name of a method to what it finds in a set."""
    if name in WIFI:
        training, test = read_wifi(data / WIFI_FOLDER, name)
        return lambda method: locate_wifi(training, test, method)
    sessions = [read_session(file) for file in session_files(data, name)]
    starts_deg = np.array([(s.lon_deg[0], s.lat_deg[0]) for s in sessions])
    crs = utm_crs_of(*starts_deg.T)
    return lambda method: list(locate_sessions(sessions, crs, method))
