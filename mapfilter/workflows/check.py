"""``mapfilter check``: all inputs of a configuration checked together before anything runs."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from rasterio.errors import RasterioError

from mapfilter._area_scale import check_scale
from mapfilter._gdal import open_raster
from mapfilter._parallel import Progress
from mapfilter.check.band_law import check_bands
from mapfilter.check.carrier_power import check_carrier_power
from mapfilter.check.datum_shift import plan_by_datum
from mapfilter.check.extent_checks import check_extents
from mapfilter.check.fills import check_fills
from mapfilter.check.findings import CheckResult, Findings, Severity
from mapfilter.check.identity_checks import check_identities
from mapfilter.check.index_order import plan_by_index
from mapfilter.check.level_law import check_factor
from mapfilter.check.raster_checks import check_ids, is_surveyed, sampled, strongest
from mapfilter.check.site_checks import check_against_sites, check_power
from mapfilter.config.sections import Config
from mapfilter.database.floor import floor_of
from mapfilter.errors import InputError, MapfilterError, listed
from mapfilter.lattice import Lattice
from mapfilter.propagation.remarks import high_antennas, off_frequency, upward_tilts
from mapfilter.radio.arrange_cells import UNUSED_COLUMNS
from mapfilter.radio.cell_rules import ANTENNAS
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.atoll import index_of
from mapfilter.rasters.names import named_by_plan
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.survey.measurement_rows import NO_TIME
from mapfilter.survey.measurements import Measurements
from mapfilter.workflows.checks.logs import check_logs
from mapfilter.workflows.checks.places import (
    check_pixels,
    check_rasters_place,
    check_same_pixels,
    check_sites,
    check_ways,
)
from mapfilter.workflows.inputs.stated_power import cells_without_eirp
from mapfilter.workflows.inputs.survey_inputs import survey_inputs
from mapfilter.workflows.inputs.world import World, planned_rasters, roads_lattice

_STAGES = 5


def run_check(config: Config, progress: Progress | None = None) -> CheckResult:
    """Check area, map, plan, antennas, rasters, measurements and land use together.

    Rasters that are still to be predicted are passed over. Of large rasters a square of four
    million pixels about each site is checked.

    Raises
    ------
    MapfilterError
        Not for wrong inputs: their faults are findings.
    """
    check = _Checks(config)
    findings = check.findings

    def done(stages: int) -> None:
        if progress is not None:
            progress(stages, _STAGES)

    rasters = check.rasters()
    area = check.area(rasters)
    placed = area is not None and (rasters is None or check.overlaps(rasters))
    done(1)
    lattice = rasters.lattice if rasters is not None else area
    if area is not None and not placed:
        lattice = None
    plan = check.plan(lattice, rasters)
    if plan is not None:
        check_identities(plan, check.plan_name, findings)
    done(2)
    if rasters is not None and lattice is not None:
        check.check_rasters(rasters, plan)
    elif plan is not None and lattice is not None:
        check_sites(plan, lattice, check.plan_name, findings)
        check_power((), plan, check.plan_name, findings)
    ground_truth = check.ground_truth() if area is not None else None
    if ground_truth is not None and check.overlaps(ground_truth):
        check.check_rasters(ground_truth, check.plan(ground_truth.lattice, rasters))
    done(3)
    if plan is not None and lattice is not None:
        # Rasters that are there already do not need the antennas, be they readable or not.
        predicted = rasters is None and not config.rasters_path.exists()
        check.check_antennas(plan, lattice, "error" if predicted else "warning")
    done(4)
    if area is not None and placed:
        check.check_roads(area, rasters)
    check_logs(config, lattice, plan, findings)
    done(5)
    return findings.result()


class _Checks:
    """The checks of one configuration, and what they found."""

    def __init__(self, config: Config) -> None:
        self.config, self.findings = config, Findings()
        self.plan_name = str(config.surveyed_plan or config.cells.plan or "plan by rule")
        # Layers and tracks replace the map, so that only a box places the rasters.
        replaced = config.roads.replace_map
        self._is_placed = config.area.has_box or (config.area.has_extent and not replaced)

    @contextmanager
    def _reported(self, code: str, severity: Severity = "error") -> Iterator[None]:
        """Turn faults of reading an input into findings, unspecific ones with this code."""
        try:
            yield
        except MapfilterError as error:
            self.findings.add_faults(error, code, severity)

    def rasters(self) -> RxLevRasters | None:
        if not self.config.database.cells:
            return None
        path = self.config.rasters_path
        if path.exists():
            return self._opened(path, lambda: planned_rasters(self.config))
        if self.config.rasters.path is not None:
            self.findings.add("rasters-missing", str(path), "There is nothing yet.", "warning")
        return None

    def ground_truth(self) -> RxLevRasters | None:
        path = self.config.rasters.ground_truth
        if not self.config.database.cells:
            return None
        if path is None or path.exists():
            return None if path is None else self._opened(path, lambda: open_rasters(path))
        self.findings.add("ground-truth-missing", str(path), "There is nothing.", "warning")
        return None

    def _opened(self, path: Path, open_them: Callable[[], RxLevRasters]) -> RxLevRasters | None:
        with self._reported("rasters-invalid"):
            rasters = open_them()
            check_scale(rasters.lattice.crs, rasters.lattice.bounds_m, f"{path}, CRS")
            if rasters.quantity != "deviation":
                return rasters
            evidence = "The file holds the deviations of a survey, not its levels."
            self.findings.add("values-implausible", str(path), evidence)
        return None

    def area(self, rasters: RxLevRasters | None) -> Lattice | None:
        config = self.config
        about = rasters.lattice if rasters is not None else None
        if config.surveyed_plan is not None:
            try:
                inputs = survey_inputs(config)
                about = inputs.lattice
                self._check_times(inputs.measurements)
            except MapfilterError as error:
                self.findings.add_faults(error, "measurements-invalid")
                if not config.area.has_extent:
                    return None
        if about is not None and not self._is_placed:
            return about
        if self.findings.found and not config.area.has_extent and config.rasters_path.exists():
            # Why the rasters, which give the area, cannot be read is reported already.
            return None
        try:
            return roads_lattice(config)
        except MapfilterError as error:
            sources = str(config.area.map), str(config.roads.raster)
            of_map = all(fault.where.startswith(sources) for fault in error.faults)
            self.findings.add_faults(error, "map-invalid" if of_map else "area-invalid")
            return None

    def _check_times(self, measurements: Measurements) -> None:
        """Report sessions without times that can be read."""
        unknown = np.bincount(measurements.session, np.isnan(measurements.time_s))
        lost = np.flatnonzero(unknown == np.bincount(measurements.session))
        if lost.size:
            names = listed([measurements.sessions[i] for i in lost.tolist()])
            evidence = f"No time can be read in {lost.size} of {len(unknown)} sessions ({names})"
            examples = [note for note in measurements.notes if NO_TIME in note]
            evidence += f": {examples[0]}." if examples else "."
            where = ", ".join(map(str, self.config.prediction.survey.files))
            self.findings.add("measurements-without-times", where, evidence, "warning")

    def overlaps(self, rasters: RxLevRasters) -> bool:
        return not self._is_placed or check_rasters_place(rasters, self.config, self.findings)

    def plan(self, lattice: Lattice | None, rasters: RxLevRasters | None) -> CellPlan | None:
        surveyed_plan = self.config.surveyed_plan
        if not self.config.database.cells:
            return None
        if lattice is not None and (surveyed_plan is None or surveyed_plan.exists()):
            with self._reported("plan-invalid"):
                plan = World(self.config, lattice).plan
                for note in plan.notes:
                    if note.startswith(UNUSED_COLUMNS):
                        self.findings.add(
                            "plan-columns",
                            self.plan_name,
                            f"{note[:1].upper()}{note[1:]}.",
                            "warning",
                        )
                given = self.config.rasters
                quantity = given.quantity if rasters is None else rasters.quantity
                if surveyed_plan is None and (given.path is None or quantity == "loss"):
                    check_carrier_power(plan, self.plan_name, self.findings)
                return plan
        return None

    def check_rasters(self, rasters: RxLevRasters, plan: CellPlan | None) -> None:
        config, findings = self.config, self.findings
        rasters = rasters if plan is None else named_by_plan(rasters, plan)
        check_pixels(rasters, findings)
        before = len(findings.found)
        samples = sampled(rasters, plan, config.database.tile_px, findings)
        as_declared = len(findings.found) == before
        if plan is None:
            return
        check_ids(rasters, plan, self.plan_name, findings)
        if without := cells_without_eirp(config, rasters, plan):
            evidence = f"The rasters hold losses, and {len(without)} of {len(plan)} cells have no "
            evidence += f"EIRP to take them from ({listed(without)})."
            findings.add("eirp-missing", self.plan_name, evidence)
        if config.surveyed_plan is not None and config.cells.plan is None:
            # Antennas were located from the same levels, and may well stand outside.
            return
        strongest_dbm = strongest(samples, plan, rasters.quantity) if as_declared else {}
        where, quantity = str(rasters.path), rasters.quantity
        if as_declared and not is_surveyed(rasters):
            floor_dbm = floor_of(plan, config.database.floor_dbm)
            factor, given = rasters.factor, len(findings.found)
            samples = check_fills(samples, plan, factor, quantity, floor_dbm, where, findings)
            if any(one.severity == "error" for one in findings.found[given:]):
                # Of levels that may mean no data, sites are not judged.
                samples = []
        outside = check_sites(plan, rasters.lattice, self.plan_name, findings, strongest_dbm)
        if (index := index_of(rasters.path)) is not None:
            plan = plan_by_index(samples, rasters.cell_ids, plan, index, findings)
        # Where a raster lies elsewhere, it tells nothing of its site.
        outside |= check_extents(rasters, plan, findings)
        if is_surveyed(rasters):
            # Measured along some ways only: without lobes, and without the plan's EIRP.
            return
        plan = plan_by_datum(samples, plan, outside, f"{self.plan_name} and {where}", findings)
        in_place = check_against_sites(samples, plan, outside, where, findings)
        if as_declared:
            check_factor(in_place, plan, rasters.factor, quantity, where, findings)
            check_bands(in_place, plan, quantity, where, findings)
        levels = in_place if rasters.quantity == "level" and as_declared else []
        check_power(levels, plan, self.plan_name, findings)

    def check_antennas(self, plan: CellPlan, lattice: Lattice, severity: Severity) -> None:
        for note in upward_tilts(plan):
            self.findings.add("tilts-upwards", self.plan_name, f"{note}.", "warning")
        for note in high_antennas(plan):
            self.findings.add("feet-for-metres", self.plan_name, f"{note}.", "warning")
        named = sorted({cell.antenna for cell in plan.cells} - set(ANTENNAS))
        if not named:
            return
        if self.config.cells.antennas is None:
            evidence = f"It names pattern files ({listed(named)}), and cells.antennas no folder."
            for name in named:
                for close in difflib.get_close_matches(name.lower(), ANTENNAS, n=1):
                    evidence += f" Did you mean {close!r} in place of {name!r}?"
            self.findings.add("antenna-missing", self.plan_name, evidence, severity)
            return
        with self._reported("antenna-invalid", severity):
            for note in off_frequency(plan, World(self.config, lattice).antennas):
                self.findings.add("antenna-frequency", self.plan_name, f"{note}.", "warning")

    def check_roads(self, area: Lattice, rasters: RxLevRasters | None) -> None:
        config, landuse = self.config, self.config.roads.landuse
        lattice = rasters.lattice if rasters is not None and not config.area.has_box else area
        world = World(config, lattice)
        if landuse is None:
            with self._reported("roads-invalid"):
                ways = world.ways
                if rasters is not None:
                    files = (config.roads.layer, config.roads.raster, *config.roads.tracks.files)
                    source = next(
                        (str(path) for path in files if path is not None), config.area.map
                    )
                    check_ways(ways, rasters, f"{source} and {rasters.path}", self.findings)
                if gaps := world.streets.gaps:
                    sentence = f"{gaps[:1].upper()}{gaps[1:]}."
                    self.findings.add("ways-with-gaps", "roads.half_width_m", sentence, "warning")
            return
        with self._reported("landuse-invalid"):
            _ = world.landuse
            if rasters is not None:
                with suppress(RasterioError, InputError), open_raster(landuse) as source:
                    grid = source.transform.c, source.transform.a, source.transform.f
                    check_same_pixels(str(landuse), grid, rasters, self.findings)
