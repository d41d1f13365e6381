"""``mapfilter locate``: a position and its region from each report of a log, without motion."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._io import atomic_file, ensure_writable_folder, replaced_files
from mapfilter._json_files import write_json
from mapfilter._parallel import Progress
from mapfilter._partial import nothing_left
from mapfilter._types import Floats
from mapfilter.errors import ConfigError, Faults, InputError, MapfilterError
from mapfilter.evaluation.accuracy import mean_of
from mapfilter.lattice import Lattice
from mapfilter.positioning.fingerprints.located import LocatedReports, figures_of
from mapfilter.positioning.fingerprints.locating import (
    ReportLocator,
    locate_by,
    locator_for,
)
from mapfilter.positioning.fingerprints.matches import locator
from mapfilter.positioning.fingerprints.options import AUTO, Centroid, method_name
from mapfilter.positioning.fingerprints.reports import Reports
from mapfilter.report.canvas import BLUE, GREY
from mapfilter.report.cumulative import Distribution, axis_end_m, plot_cumulative
from mapfilter.report.saving import save
from mapfilter.tracks.checks.misplaced import check_near
from mapfilter.tracks.checks.placeless import is_local_frame
from mapfilter.tracks.joining.named_files import offsets_by_path
from mapfilter.tracks.open_options import OpenOptions
from mapfilter.workflows.inputs.apart import (
    check_in_no_store,
    check_inputs_kept,
    check_out_apart,
)
from mapfilter.workflows.inputs.fingerprints import WITHOUT_STEPS, read_database, read_reports
from mapfilter.workflows.outputs.result_text import to_jsonable
from mapfilter.workflows.outputs.results import (
    FIGURES,
    PICTURE_OF_REPORTS,
    POSITIONS,
    check_figures_of_reports,
    older_reports,
)

_SHARE = 0.95
_AREA_M = 100.0


@dataclass(frozen=True)
class LocateResult:
    """Reports located by themselves.

    Parameters
    ----------
    database_reports, transmitters : int
        Places of the database, and what was received there.
    figures : mapping
        Counts and scores, see :func:`mapfilter.positioning.fingerprints.located.figures_of`.
    centroid_mean_m, centroid_median_m : float
        Errors of the mean place of the serving, or strongest, cell; NaN without ground truth.
    """

    database_reports: int
    transmitters: int
    figures: dict[str, Any]
    centroid_mean_m: float
    centroid_median_m: float
    notes: tuple[str, ...]
    seconds: float
    outputs: tuple[Path, ...]

    @property
    def shown(self) -> dict[str, Any]:
        """All figures in one mapping, as the command prints them."""
        own = asdict(self)
        figures = own.pop("figures")
        return {**figures, **own}


def run_locate(
    database: Path,
    log: Path,
    out: Path,
    *,
    method: str = AUTO,
    crs: str | None = None,
    columns: Mapping[str, str] | None = None,
    zone: str = "",
    truth: Sequence[Path] = (),
    offsets_s: Mapping[str, float] | None = None,
    level_error_db: float | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> LocateResult:
    """Locate every report of a log, write a table, and score it where there is ground truth.

    Parameters
    ----------
    database : Path
        A radio-route database; or fingerprints: a log with ground truth, a folder of such logs,
        recordings of other programs with positions, or a table (CSV).
    log : Path
        A log, a folder of logs, a recording, or a table of fingerprints.
    out : Path
        Gets ``positions.csv``, ``figures.json``, and ``errors.png`` where there is ground truth.
    crs : str, optional
        Of metres in a table.
    columns : mapping of str to str, optional
        Where the log is a plain CSV recording: column of each field.
    zone : str
        Where the log is a recording: zone of local times that state none.
    truth : sequence of Path
        Recordings whose positions are the truth of the log, a recording.
    offsets_s : mapping of str to float, optional
        Seconds to add to the times of a recording, by its name.
    level_error_db : float, optional
        Of the levels of a radio-route database; 6 when left out.
    seed : int
        Of the reports by which regions of a radio-route database are calibrated.

    Raises
    ------
    MapfilterError
        An input is missing or wrong, there is no such method, or the output cannot be written, as
        where it holds the figures of another command; or an option has no effect on the database.
    """
    began_s = time.perf_counter()
    check_out_apart(out, [database, log])
    check_in_no_store(out)
    check_figures_of_reports(out)
    written = [out / name for name in (POSITIONS, FIGURES, PICTURE_OF_REPORTS)]
    check_inputs_kept([database, log, *truth], written)
    faults = Faults()
    shifts = offsets_by_path(offsets_s or {}, [log, *truth], "--offset", faults)
    faults.raise_if_any(ConfigError)
    combine = replace(WITHOUT_STEPS.combine, truth=tuple(truth), offsets_s=shifts)
    options = replace(WITHOUT_STEPS, zone=zone, columns=columns or {}, combine=combine)
    known, (reports, names) = _inputs(database, log, crs, level_error_db, options)
    rng = np.random.default_rng(seed)
    with nothing_left(out):
        ensure_writable_folder(out)
        fitted = locator_for(reports, known, method, rng, progress=progress)
        located = locate_by(fitted, reports)
    baseline_m = _centroid_errors_m(fitted, reports)
    # A picture of an older run does not stay beside the table of this one.
    with replaced_files(out, partial(older_reports, out)) as new:
        outputs = [_write_positions(located, names, reports, new / POSITIONS)]
        if np.isfinite(located.error_m).any():
            outputs.append(_draw(located, baseline_m, new / PICTURE_OF_REPORTS))
        scored = baseline_m[np.isfinite(baseline_m)]
        notes = tuple(dict.fromkeys((*fitted.database.notes, *located.notes, *_advice(fitted))))
        result = LocateResult(
            len(fitted.database),
            len(fitted.database.cell_ids),
            figures_of(located),
            mean_of(scored),
            float(np.median(scored)) if scored.size else float("nan"),
            notes,
            round(time.perf_counter() - began_s, 3),
            tuple(out / name for name in (*outputs, FIGURES)),
        )
        write_json(new / FIGURES, to_jsonable(result.shown))
    return result


def _inputs(
    database: Path,
    log: Path,
    crs: str | None,
    level_error_db: float | None,
    options: OpenOptions,
) -> tuple[Reports, tuple[Reports, Sequence[str]]]:
    """Read both inputs, and report the faults of both."""
    faults = Faults()
    known, query, plan = None, None, None
    try:
        known, plan = read_database(database, crs, level_error_db)
    except MapfilterError as error:
        faults.take(error)
    if plan is not None:
        options = replace(options, combine=replace(options.combine, about_deg=plan.middle_deg))
    try:
        query = read_reports(log, known.crs if known is not None else crs, plan, options)
    except MapfilterError as error:
        faults.take(error)
    if known is not None and query is not None:
        _check_near(log, query[0], known, faults)
    faults.raise_if_any(InputError)
    assert known is not None
    assert query is not None
    return known, query


def _check_near(log: Path, reports: Reports, known: Reports, faults: Faults) -> None:
    """Note positions of reports that all lie far from those of the database."""
    there = np.isfinite(known.east_m) & np.isfinite(known.north_m)
    given = np.isfinite(reports.east_m) & np.isfinite(reports.north_m)
    if is_local_frame(known.crs) or not (there.any() and given.any()):
        return
    west_m, most_east_m = _extent(known.east_m[there])
    south_m, most_north_m = _extent(known.north_m[there])
    bounds_m = (west_m, south_m, most_east_m, most_north_m)
    area = Lattice.covering(known.crs, bounds_m, _AREA_M)
    check_near(str(log), reports.east_m[given], reports.north_m[given], area, faults)


def _extent(values: Floats) -> tuple[float, float]:
    # Those of one place have an extent, too.
    return float(values.min()) - _AREA_M, float(values.max()) + _AREA_M


def _centroid_errors_m(fitted: ReportLocator, reports: Reports) -> Floats:
    plain = locator(Centroid(), fitted.database)
    baseline = ReportLocator(Centroid(), fitted.database, plain, None, ())
    return locate_by(baseline, reports).error_m


def _write_positions(
    located: LocatedReports, names: Sequence[str], reports: Reports, path: Path
) -> str:
    table = located.to_dataframe()
    if len(names) > 1:
        table.insert(0, "log", [names[block] for block in reports.block.tolist()])
    table = table.round({name: 3 for name in table if str(name).endswith("_m")})
    table = table.round({"lon_deg": 8, "lat_deg": 8})
    with atomic_file(path) as temporary:
        table.to_csv(temporary, index=False, lineterminator="\n")
    return path.name


def _draw(located: LocatedReports, baseline_m: Floats, path: Path) -> str:
    curves = []
    given = ((method_name(located.method), located.error_m, BLUE), ("centroid", baseline_m, GREY))
    for name, error_m, colour in given:
        known_m = error_m[np.isfinite(error_m)]
        if known_m.size:
            label = f"{name}, median {np.median(known_m):.3g} m"
            curves.append(Distribution(label, known_m, colour))
    title, most_m = "Errors of single reports, without motion", axis_end_m(curves)
    drawn = plot_cumulative(curves, title=title, most_m=most_m, share=_SHARE, of="reports")
    return save(drawn, path).name


def _advice(fitted: ReportLocator) -> list[str]:
    if fitted.regions is None:
        return ["no radii: fewer than 20 reports of the database can be left out to calibrate them"]
    if fitted.database.predicted:
        return ["radii hold if the database's levels are as accurate as --level-error states"]
    first = fitted.validations[0]
    if first.blocks != "logs":
        more = "on another day, or with another phone, errors are larger"
        return [f"radii are calibrated with {first.blocks} of one survey left out: {more}"]
    return []
