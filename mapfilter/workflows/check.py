"""``mapfilter check``: all inputs of a configuration looked at together before anything runs."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import rasterio
from rasterio.errors import RasterioError

from mapfilter._parallel import Progress
from mapfilter.check.findings import CheckResult, Findings, Severity
from mapfilter.check.raster_checks import check_ids, is_surveyed, sampled
from mapfilter.check.site_checks import check_against_sites, check_power
from mapfilter.config.sections import Config
from mapfilter.errors import MapfilterError, listed
from mapfilter.geodesy import Lattice
from mapfilter.propagation.predict import off_frequency
from mapfilter.radio.cell_rules import ANTENNAS
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters, open_rasters
from mapfilter.workflows.check_places import (
    check_pixels,
    check_rasters_place,
    check_same_pixels,
    check_sites,
    check_ways,
)
from mapfilter.workflows.survey import survey_inputs
from mapfilter.workflows.world import World, area_lattice, planned_rasters

_STAGES = 5


@dataclass(frozen=True, slots=True)
class _Inputs:
    """What could be read of a configuration; None where it could not, or is not there yet."""

    config: Config
    lattice: Lattice | None
    rasters: RxLevRasters | None


def run_check(config: Config, progress: Progress | None = None) -> CheckResult:
    """Look at area, map, plan, antennas, rasters, measurements and land use together.

    Rasters that are still to be predicted are passed over. Large rasters are looked at in a square
    of four million pixels about each site.

    Raises
    ------
    MapfilterError
        Nothing that has to do with the inputs: what is wrong with them is a finding.
    """
    findings = Findings()

    def done(stages: int) -> None:
        if progress is not None:
            progress(stages, _STAGES)

    rasters = _rasters(config, findings)
    area = _area(config, rasters, findings)
    placed = area is not None and (
        rasters is None or not _says_where(config) or check_rasters_place(rasters, config, findings)
    )
    done(1)
    lattice = rasters.lattice if rasters is not None else area
    inputs = _Inputs(config, lattice if placed or area is None else None, rasters)
    plan = _plan(inputs, findings)
    done(2)
    if rasters is not None and inputs.lattice is not None:
        _check_rasters(rasters, plan, config, findings)
    elif plan is not None and inputs.lattice is not None:
        where = _plan_name(config)
        check_sites(plan, inputs.lattice, where, findings)
        check_power((), plan, where, findings)
    ground_truth = _ground_truth(config, findings) if area is not None else None
    if ground_truth is not None and (
        not _says_where(config) or check_rasters_place(ground_truth, config, findings)
    ):
        plan_there = _plan(_Inputs(config, ground_truth.lattice, ground_truth), findings)
        _check_rasters(ground_truth, plan_there, config, findings)
    done(3)
    if plan is not None and inputs.lattice is not None:
        _check_antennas(plan, inputs, findings)
    done(4)
    if area is not None and placed:
        _check_roads(inputs, area, findings)
    done(5)
    return findings.result()


def _area(config: Config, rasters: RxLevRasters | None, findings: Findings) -> Lattice | None:
    about = rasters.lattice if rasters is not None else None
    if config.surveyed_plan is not None:
        try:
            about = survey_inputs(config).lattice
        except MapfilterError as error:
            findings.add_faults(error, "measurements-invalid")
            if not config.area.has_extent:
                return None
    if about is not None and not _says_where(config):
        return about
    if findings.found and not config.area.has_extent and config.rasters_path.exists():
        # Why the rasters, which give the area, cannot be read is reported already.
        return None
    try:
        return area_lattice(config.area)
    except MapfilterError as error:
        of_map = all(fault.where.startswith(str(config.area.map)) for fault in error.faults)
        findings.add_faults(error, "map-invalid" if of_map else "area-invalid")
        return None


def _says_where(config: Config) -> bool:
    """Return whether box or map place the rasters; layers and tracks replace the map."""
    area, roads = config.area, config.roads
    replaced = roads.layer is not None or bool(roads.tracks.files)
    return area.has_box or (area.has_extent and not replaced)


def _rasters(config: Config, findings: Findings) -> RxLevRasters | None:
    path = config.rasters_path
    if not path.exists():
        if config.rasters.path is not None:
            findings.add("rasters-missing", str(path), "There is nothing yet.", "warning")
        return None
    return _opened(path, lambda: planned_rasters(config), findings)


def _ground_truth(config: Config, findings: Findings) -> RxLevRasters | None:
    path = config.rasters.ground_truth
    if path is None:
        return None
    if not path.exists():
        findings.add("ground-truth-missing", str(path), "There is nothing.", "warning")
        return None
    return _opened(path, lambda: open_rasters(path), findings)


def _opened(
    path: Path, open_them: Callable[[], RxLevRasters], findings: Findings
) -> RxLevRasters | None:
    try:
        rasters = open_them()
    except MapfilterError as error:
        findings.add_faults(error, "rasters-invalid")
        return None
    if rasters.quantity == "deviation":
        evidence = "The file holds the deviations of a survey, not its levels."
        findings.add("values-implausible", str(path), evidence)
        return None
    return rasters


def _plan(inputs: _Inputs, findings: Findings) -> CellPlan | None:
    surveyed_plan = inputs.config.surveyed_plan
    if inputs.lattice is None or (surveyed_plan is not None and not surveyed_plan.exists()):
        return None
    try:
        return World(inputs.config, inputs.lattice).plan
    except MapfilterError as error:
        findings.add_faults(error, "plan-invalid")
        return None


def _check_rasters(
    rasters: RxLevRasters, plan: CellPlan | None, config: Config, findings: Findings
) -> None:
    check_pixels(rasters, findings)
    before = len(findings.found)
    samples = sampled(rasters, plan, findings)
    as_declared = len(findings.found) == before
    if plan is None:
        return
    name, where = _plan_name(config), str(rasters.path)
    check_ids(rasters, plan, name, findings)
    if config.surveyed_plan is not None and config.cells.plan is None:
        # Antennas were located from the same levels, and may well stand outside.
        return
    outside = check_sites(plan, rasters.lattice, name, findings)
    if is_surveyed(rasters):
        # Measured along some ways only; its lobes say nothing, nor is the plan's EIRP measured.
        return
    in_place = check_against_sites(samples, plan, outside, where, findings)
    levels = in_place if rasters.quantity == "level" and as_declared else []
    check_power(levels, plan, name, findings)


def _check_antennas(plan: CellPlan, inputs: _Inputs, findings: Findings) -> None:
    named = sorted({cell.antenna for cell in plan.cells} - set(ANTENNAS))
    if not named or inputs.lattice is None:
        return
    # Rasters that are there already do not need them.
    severity: Severity = "error" if inputs.rasters is None else "warning"
    if inputs.config.cells.antennas is None:
        evidence = f"It names pattern files ({listed(named)}), and cells.antennas no folder."
        evidence += "".join(_misspelt(named))
        findings.add("antenna-missing", _plan_name(inputs.config), evidence, severity)
        return
    try:
        antennas = World(inputs.config, inputs.lattice).antennas
    except MapfilterError as error:
        findings.add_faults(error, "antenna-invalid", severity)
        return
    for note in off_frequency(plan, antennas):
        findings.add("antenna-frequency", _plan_name(inputs.config), f"{note}.", "warning")


def _misspelt(named: Sequence[str]) -> Iterator[str]:
    """Yield what names that are nearly those of antennas by formula may mean."""
    for name in named:
        for close in difflib.get_close_matches(name.lower(), ANTENNAS, n=1):
            yield f" Did you mean {close!r} in place of {name!r}?"


def _check_roads(inputs: _Inputs, area: Lattice, findings: Findings) -> None:
    config, rasters = inputs.config, inputs.rasters
    lattice = rasters.lattice if rasters is not None and not config.area.has_box else area
    world = World(config, lattice)
    if config.roads.landuse is None:
        try:
            ways = world.ways
        except MapfilterError as error:
            findings.add_faults(error, "roads-invalid")
            return
        if rasters is not None:
            files = (config.roads.layer, *config.roads.tracks.files)
            source = next((str(path) for path in files if path is not None), config.area.map)
            check_ways(ways, rasters, f"{source} and {rasters.path}", findings)
        if gaps := world.streets.gaps:
            findings.add("ways-with-gaps", "roads.half_width_m", f"{_sentence(gaps)}.", "warning")
        return
    try:
        _ = world.landuse
    except MapfilterError as error:
        findings.add_faults(error, "landuse-invalid")
        return
    if rasters is not None:
        _check_landuse_pixels(config.roads.landuse, rasters, findings)


def _check_landuse_pixels(path: Path, rasters: RxLevRasters, findings: Findings) -> None:
    try:
        with rasterio.open(path) as source:
            transform = source.transform
    except RasterioError:
        return
    check_same_pixels(str(path), (transform.c, transform.a, transform.f), rasters, findings)


def _sentence(note: str) -> str:
    return note[:1].upper() + note[1:]


def _plan_name(config: Config) -> str:
    return str(config.surveyed_plan or config.cells.plan or "plan by rule")
