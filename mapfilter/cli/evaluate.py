"""The command that measures accuracy: simulated on any map, or on recordings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from mapfilter._partial import nothing_left
from mapfilter.cli.options import (
    PARTIAL,
    BoxOption,
    ConfigOption,
    FilterOption,
    JsonOption,
    OutOption,
    ResumeOption,
    SetOption,
    check_custom_filter,
    given_path,
    refuse,
    toml,
)
from mapfilter.workflows.outputs.progress_bars import rate_bar
from mapfilter.workflows.outputs.terminal import print_result


@dataclass(frozen=True, slots=True)
class _Asked:
    """What the command was given, by the names of its arguments."""

    name: str
    map_file: Path | None
    bbox: str | None
    cases: list[str] | None
    one_case: bool
    filter_name: str | None
    world: str | None
    data: Path | None
    runs: int | None
    seed: int
    workers: int | None
    resume: bool
    config: Path | None
    settings: list[str] | None
    out: Path | None

    @property
    def of_runs(self) -> dict[str, Any]:
        """Seed, processes, and whether finished runs are kept."""
        return {"seed": self.seed, "workers": self.workers or 2, "resume": self.resume}

    @property
    def folder(self) -> Path:
        """Where results of recordings go."""
        return (self.out or Path("out") / self.name).absolute()

    @property
    def folders(self) -> tuple[Path, Path]:
        """Those of the recordings and of the results."""
        assert self.data is not None
        return self.data, self.folder

    @property
    def of_simulation(self) -> dict[str, object]:
        """What has no effect on recordings, by option."""
        return {
            "--map": self.map_file,
            "--bbox": self.bbox,
            "--filter": self.filter_name,
            "--world": self.world,
            "--config": self.config,
            "--set": self.settings,
            **self.drawn_case,
        }

    @property
    def drawn_case(self) -> dict[str, object]:
        """Whether each route has one case, by option; None where it was not asked for."""
        return {"--one-case": self.one_case or None}

    @property
    def given(self) -> list[str]:
        """Settings, with those that have an option of their own."""
        given = list(self.settings or ())
        if self.map_file is not None:
            given.append(f"area.map={toml(str(self.map_file))}")
        if self.bbox is not None:
            given.append(f"area.bbox={self.bbox}")
        if self.filter_name is not None:
            given.append(f"filter.name={toml(self.filter_name)}")
        return given


def evaluate(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="Simulated: global-positioning, audit. Of recordings (--data): all, ottawa, "
            "fingerprints, kitti, mall, smartloc, belgium, mountain-view, denver, single-reports.",
        ),
    ],
    map_file: Annotated[
        Path | None,
        typer.Option("--map", metavar="FILE", help="An OpenStreetMap file.", callback=given_path),
    ] = None,
    bbox: BoxOption = None,
    cases: Annotated[
        list[str] | None,
        typer.Option(
            "--case", metavar="NAME", help="A case or set; repeatable. Default: all but satellites."
        ),
    ] = None,
    one_case: Annotated[
        bool,
        typer.Option(
            "--one-case",
            help="Each route has one of the cases, drawn, instead of all: more walks in that time.",
        ),
    ] = False,
    filter_name: FilterOption = None,
    world: Annotated[
        str | None,
        typer.Option(
            "--world",
            metavar="NAME",
            help="Simulated world: plain (default), foreign, harsh, sensors (faults of phones), or "
            "easy (optimistic figures).",
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            "--data", metavar="DIR", help="Folder of the published data sets.", callback=given_path
        ),
    ] = None,
    runs: Annotated[
        int | None,
        typer.Option(
            "--runs",
            min=1,
            help="Routes for each case (20); draws of the noise for each session (3).",
        ),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of what is drawn.")] = 0,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Local processes. Default: 2.")
    ] = None,
    resume: ResumeOption = False,
    config: ConfigOption = None,
    settings: SetOption = None,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Benchmark localization accuracy: simulated on any map, or on real sessions."""
    from mapfilter.workflows.evaluate import OF_DATA, check_benchmark

    check_benchmark(name, data)
    asked = _Asked(
        *(name, map_file, bbox, cases, one_case, filter_name, world, data),
        *(runs, seed, workers, resume, config, settings, out),
    )
    measure = {"ottawa": _ottawa, "all": _all, "single-reports": _single_reports, "audit": _audit}
    usual = _recordings if name in OF_DATA else _simulated
    result, shown = measure.get(name, usual)(asked)
    print_result(result if as_json else shown, as_json)
    if name == "all" and (result.missing or result.failed):
        raise typer.Exit(PARTIAL)


def _ottawa(asked: _Asked) -> tuple[Any, Any]:
    from mapfilter.workflows.evaluations.ottawa import RUNS, run_ottawa

    other = None if asked.filter_name == "bayes" else asked.filter_name
    unused = {"--map": asked.map_file, "--bbox": asked.bbox, "--case": asked.cases}
    unused |= {"--filter": other, "--world": asked.world, "--config": asked.config}
    refuse(unused | {"--set": asked.settings} | asked.drawn_case, asked.name)
    with nothing_left(asked.folder), rate_bar("evaluate", "sessions") as progress:
        result = run_ottawa(
            *asked.folders, runs=asked.runs or RUNS, progress=progress, **asked.of_runs
        )
    return result, result


def _all(asked: _Asked) -> tuple[Any, Any]:
    from mapfilter.workflows.evaluations.recorded import run_all

    refuse(asked.of_simulation, asked.name)
    with nothing_left(asked.folder), rate_bar("evaluate", "runs") as progress:
        refuse({"--case": asked.cases, "--runs": asked.runs}, asked.name)
        result = run_all(*asked.folders, progress=progress, **asked.of_runs)
    return result, _without_units(result)


def _recordings(asked: _Asked) -> tuple[Any, Any]:
    from mapfilter.workflows.evaluations.recorded import run_recorded

    refuse(asked.of_simulation, asked.name)
    with nothing_left(asked.folder), rate_bar("evaluate", "runs") as progress:
        result = run_recorded(
            asked.name,
            *asked.folders,
            parts=asked.cases or (),
            runs=asked.runs,
            progress=progress,
            **asked.of_runs,
        )
    return result, _without_units(result)


def _without_units(result: Any) -> dict[str, Any]:
    """Return results without units, of which there may be hundreds, and without intervals."""
    return {key: value for key, value in vars(result).items() if key not in ("units", "intervals")}


def _single_reports(asked: _Asked) -> tuple[Any, Any]:
    from mapfilter.workflows.evaluations.single_reports import SETS, run_single_reports

    refuse(asked.of_simulation, asked.name)
    unused = {"--runs": asked.runs, "--seed": asked.seed or None, "--resume": asked.resume or None}
    refuse(unused | {"--workers": asked.workers}, asked.name)
    with nothing_left(asked.folder), rate_bar("evaluate", "runs") as progress:
        result = run_single_reports(*asked.folders, sets=asked.cases or SETS, progress=progress)
    return result, result


def _audit(asked: _Asked) -> tuple[Any, Any]:
    from mapfilter.workflows.evaluate import RUNS
    from mapfilter.workflows.evaluations.audit import audit_table, run_audit
    from mapfilter.workflows.evaluations.settings import load_benchmark

    refuse({"--data": asked.data, "--world": asked.world, **asked.drawn_case}, asked.name)
    given = asked.given
    loaded, _ = load_benchmark("easy", asked.config, given)
    check_custom_filter(loaded)
    folder = (asked.out or loaded.output.dir / asked.name).absolute()
    with nothing_left(folder), rate_bar("evaluate", "batches") as progress:
        result = run_audit(
            asked.config,
            given,
            folder,
            names=asked.cases or (),
            runs=asked.runs or RUNS,
            progress=progress,
            **asked.of_runs,
        )
    return result, audit_table(result)


def _simulated(asked: _Asked) -> tuple[Any, Any]:
    from mapfilter.workflows.evaluate import RUNS, main_table, run_global_positioning
    from mapfilter.workflows.evaluations.foreign import load_foreign, other_world, run_foreign
    from mapfilter.workflows.evaluations.settings import load_benchmark

    refuse({"--data": asked.data}, asked.name)
    foreign = other_world(asked.world)
    if foreign:
        loaded, fixed = load_foreign(asked.config, asked.given)
    else:
        loaded, fixed = load_benchmark(asked.world or "plain", asked.config, asked.given)
    check_custom_filter(loaded)
    folder = (asked.out or loaded.output.dir / asked.name).absolute()
    with nothing_left(folder), rate_bar("evaluate", "batches") as progress:
        common: dict[str, Any] = {"cases": asked.cases or (), "fixed": fixed, "progress": progress}
        common |= {"runs": asked.runs or RUNS, "one_case": asked.one_case} | asked.of_runs
        if foreign:
            result = run_foreign(loaded, foreign, folder, **common)
        else:
            result = run_global_positioning(loaded, folder, **common)
    return result, main_table(result)
