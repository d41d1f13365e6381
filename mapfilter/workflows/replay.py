"""``mapfilter replay``: locates one log, or every log of a folder, and scores it against truth."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path

from mapfilter._inputs import shown
from mapfilter._io import replaced_files
from mapfilter._json_files import write_json
from mapfilter._parallel import Progress, SerialExecutor
from mapfilter.config.sections import Config
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, fail, noted
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.filter import FilterOptions
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.workflows.inputs.apart import (
    check_in_no_store,
    check_inputs_kept,
    check_out_apart,
    named_inputs,
)
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.kernels import compiled_beside
from mapfilter.workflows.outputs.result_text import to_jsonable
from mapfilter.workflows.outputs.results import (
    SUMMARY,
    check_figures_of_replay,
    older_results,
    replaced_by_replay,
)
from mapfilter.workflows.outputs.track_pictures import drawn_beside
from mapfilter.workflows.replays.baseline import Baselines
from mapfilter.workflows.replays.figures import ReplayResult, summary_figures, summary_of
from mapfilter.workflows.replays.filters import ReplayFilters
from mapfilter.workflows.replays.located_log import LogReplay
from mapfilter.workflows.replays.logs import ReplayLogs


def run_replay(
    config: Config,
    out: Path,
    *,
    html: bool = False,
    beside: bool = False,
    drawers: Executor | None = None,
    progress: Progress | None = None,
    on_notes: Callable[[tuple[str, ...]], None] | None = None,
) -> ReplayResult:
    """Locate the log or logs of a configuration and write estimates, figures and pictures.

    Parameters
    ----------
    config : Config
        Its database (for Kalman-type filters its cells), track, filter, integrity and output
        sections count.
    out : Path
        Folder of the results; one log writes straight into it, several into a folder each.
    html : bool
        Whether a page is written that shows each log's replay (``replay.html``).
    beside : bool
        Whether other processes may compile and draw meanwhile. They import the main module of the
        program again, so a script says so below ``if __name__ == "__main__"`` only.
    drawers : Executor, optional
        What draws, where it was started before (``workflows.drawer``).
    progress : callable, optional
        Called with logs done and logs in all.
    on_notes : callable, optional
        Called before a log is located with its notes known then; not where there are several logs.

    Raises
    ------
    MapfilterError
        The database, the cell plan, an antenna or a log is missing or damaged, or the output
        cannot be written.
    """
    options = filter_choice(config.filter)
    compiles = beside and isinstance(options, BayesFilter)
    with compiled_beside() if compiles else nullcontext():
        database = _database(config, options)
        journeys = ReplayLogs(config, database)
    filters = ReplayFilters(config, database)
    own = [database.path] if database is not None else []
    # Several logs are folders of these names.
    several = journeys.paths if len(journeys.paths) > 1 else []
    for folder in (out, *(out / path.name for path in several)):
        check_out_apart(folder, [*own, *journeys.paths, *config.track.recordings])
        check_figures_of_replay(folder)
        check_inputs_kept([*journeys.paths, *named_inputs(config)], replaced_by_replay(folder))
    check_in_no_store(out)
    if not filters.has_sites:
        journeys.check_siteless()
    journeys.check(None if database is None else database.lattice)
    if database is not None:
        filters.over(database.lattice.crs, options, cells=True)
    wanted, count = config.output.pictures, len(journeys.paths)
    place: AbstractContextManager[Executor] = nullcontext(drawers or SerialExecutor())
    if drawers is None and beside and wanted != "none":
        place = drawn_beside()
    # Older results stay until all of these are whole.
    with place as drawing, replaced_files(out, partial(older_results, out)) as new:
        baselines = Baselines(database, config.journeys.seed)
        replay = LogReplay(config, options, filters, baselines, drawing, html)
        logs = []
        for index, path in enumerate(journeys.paths):
            opened = journeys.open(path)
            drawn = wanted == "all" or (wanted == "first" and not index)
            into, first_told = (new, on_notes) if count == 1 else (new / opened.name, None)
            with noted(opened.log.notes):
                log = replay.replayed(opened, into, drawn=drawn, on_notes=first_told)
            logs.append(replace(log, outputs=tuple(out / f.relative_to(new) for f in log.outputs)))
            if progress is not None:
                progress(index + 1, count)
        result = ReplayResult(config.filter.name, tuple(logs), summary_of(logs), out)
        if count > 1:
            write_json(new / SUMMARY, to_jsonable(summary_figures(result)))
    return result


def unnamed_database(config: Config) -> Path | None:
    """Return the database of a replay where no setting names it, nor the folder that it lies in."""
    needs_none = isinstance(filter_choice(config.filter), KalmanFilter)
    is_named = config.database.path is not None or config.output.dir != Path.cwd() / "out"
    if needs_none or is_named or not config.database_path.exists():
        return None
    return config.database_path


def _database(config: Config, options: FilterOptions) -> RadioRouteDatabase | None:
    """Open the database, unless the filter only needs sites, or not even these."""
    stated = config.database.path is not None
    if isinstance(options, KalmanFilter) and (config.cells.plan is not None or not stated):
        return None
    if not (stated or config.database_path.exists()):
        found = f"none, and nothing at {shown(str(config.database_path))}"
        hint = (
            "give --db; mapfilter build makes one, of streets alone with --roads-only; without "
            "any, mapfilter locate takes logs, and --filter ekf positions"
        )
        raise fail(ConfigError, "database.path", "a radio-route database", found, hint)
    return open_database(config.database_path, verify="full")
