"""What a log's readings mean to Kalman-type filters: sites, levels, steps of timing advance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import atan2, hypot
from typing import TYPE_CHECKING, Annotated

import numpy as np
from annotated_types import Ge

from mapfilter.errors import Faults, InputError
from mapfilter.filters.trials import CompiledMeasurement
from mapfilter.geodesy import grid_convergence_rad, heading_from_azimuth_rad, unproject
from mapfilter.models.gaussian import GaussianTerms, stack
from mapfilter.models.ranging import GSM_STEP_M, timing_advances
from mapfilter.models.signal_strength import levels, sampled_pattern
from mapfilter.models.state import StateLayout
from mapfilter.options import Options, Positive
from mapfilter.propagation.empirical import cost231_hata_db
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cell_rules import ANTENNAS
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.rxlev import resolve_neighbours

_MOBILE_HEIGHT_M = 1.5
_SEEN_FROM_M = 1000.0


@dataclass(frozen=True, slots=True)
class FusionOptions(Options):
    """How sure readings and motion are.

    Parameters
    ----------
    level_sigma_db : float
        Slow fading and errors of the path loss together.
    timing_step_m : float
        Distance of a step of timing advance.
    timing_sigma_m : float
        Deviation of a timing advance but for its rounding.
    level_memory_m, timing_memory_m : float
        How far errors of levels (shadowing, path loss) and of timing advances (rounding) stay the
        same: reports in a row count as one in so many metres. With a correlation of
        ``exp(-d/50 m)`` that is 100 m.
    fix_sigma_m : float
        Deviation of GNSS fixes without one.
    acceleration : float
        Root of the power density of acceleration without dead reckoning, m/s^1.5.
    speed_sigma_mps : float
        Deviation of the first speed.
    step_sigma_m, heading_sigma_rad : float
        Deviations of a step's length and direction by dead reckoning.
    drift_m : float
        What dead reckoning does not see, metres per root second.
    start_sigma_m : float
        Deviation of a start at the serving site, without fix and timing advance.
    start_parts : int
        Into how many parts along east and along north such a start is cut.
    start_spacing_m : float
        Distance of the parts of a start from a timing advance, along its circle.
    reach_m : float
        Farthest that a cell is taken for the neighbour that a carrier and a BSIC identify, from the
        serving site; 63 steps of timing advance in GSM.
    converged_radius_m : float
        95 % radius below which the filter has converged.
    """

    level_sigma_db: Positive = 9.0
    timing_step_m: Positive = GSM_STEP_M
    timing_sigma_m: Positive = 200.0
    level_memory_m: Positive = 100.0
    timing_memory_m: Positive = 500.0
    fix_sigma_m: Positive = 10.0
    acceleration: Positive = 0.7
    speed_sigma_mps: Positive = 8.0
    step_sigma_m: Positive = 0.3
    heading_sigma_rad: Positive = 0.2
    drift_m: Positive = 0.3
    start_sigma_m: Positive = 1500.0
    start_parts: Annotated[int, Ge(1)] = 11
    start_spacing_m: Positive = 600.0
    reach_m: Positive = 35_000.0
    converged_radius_m: Positive = 1000.0


class SiteModels:
    """Measurement models of a cell plan's sites, made when first asked for.

    Path loss is that of COST 231 Hata at the cell's frequency and height, whatever the distance;
    antennas are the plan's sectors by formula, or measured ones, as seen from 1 km.

    Parameters
    ----------
    plan : CellPlan
    options : FusionOptions
    antennas : mapping of str to MeasuredAntenna, optional
        Those that cells name, see :func:`mapfilter.radio.msi.read_antennas`.

    Raises
    ------
    InputError
        A cell names an antenna that is not there.
    """

    def __init__(
        self,
        plan: CellPlan,
        options: FusionOptions,
        antennas: Mapping[str, MeasuredAntenna] | None = None,
    ) -> None:
        self.options, self.plan, self.antennas = options, plan, antennas or {}
        faults = Faults()
        for cell in plan.cells:
            if cell.antenna not in ANTENNAS and cell.antenna not in self.antennas:
                expected = f"{', '.join(ANTENNAS)}, or a pattern that was read"
                hint = "misspelt, or no folder of antennas"
                faults.add(f"cell {cell.id!r}, antenna", expected, repr(cell.antenna), hint)
        faults.raise_if_any(InputError)
        self.cells: Mapping[str, Cell] = {cell.id: cell for cell in plan.cells}
        first = plan.cells[0]
        lon, lat = unproject(plan.crs, first.east_m, first.north_m)
        self.convergence_rad = grid_convergence_rad(plan.crs, float(lon), float(lat))
        self.of = lru_cache(maxsize=4096)(self._of)
        self.level = lru_cache(maxsize=65_536)(self._level)
        self.neighbours = lru_cache(maxsize=65_536)(self._neighbours)

    def _of(
        self, layout: StateLayout, received: tuple[str, ...], timed: tuple[str, ...]
    ) -> GaussianTerms:
        """Return the model of levels of cells, and of timing advances of cells, in this order."""
        parts = [self.level(layout, name) for name in received]
        for name in timed:
            cell, step = self.cells[name], self.options.timing_step_m
            sigma = float(np.hypot(self.options.timing_sigma_m, step / 12**0.5))
            parts.append(timing_advances(layout, [[cell.east_m, cell.north_m]], sigma))
        return stack(parts)

    def _neighbours(
        self, serving: str | None, arfcn: int | None, bsic: int | None
    ) -> tuple[str, ...]:
        """Return the cells that a carrier and a BSIC may mean where another cell serves."""
        found = [name for name in resolve_neighbours(self.plan, arfcn, bsic) if name != serving]
        if serving is not None and serving in self.cells:
            at = self.cells[serving]
            found = [
                name
                for name in found
                if hypot(self.cells[name].east_m - at.east_m, self.cells[name].north_m - at.north_m)
                <= self.options.reach_m
            ]
        return tuple(found)

    def _level(self, layout: StateLayout, name: str) -> GaussianTerms:
        cell = self.cells[name]
        near, far = cost231_hata_db(
            [1000.0, 10_000.0], cell.frequency_mhz, max(cell.height_m, 10.0), _MOBILE_HEIGHT_M,
            False,
        )  # fmt: skip
        measured, boresight, pattern = self.antennas.get(cell.antenna), None, None
        if cell.antenna != "omni" and (measured is not None or cell.azimuth_deg is not None):
            azimuth_deg = cell.azimuth_deg or 0.0
            boresight = float(heading_from_azimuth_rad(azimuth_deg, self.convergence_rad))
        if measured is not None:
            depression_rad = atan2(cell.height_m - _MOBILE_HEIGHT_M, _SEEN_FROM_M)
            pattern = sampled_pattern(
                measured, depression_rad, cell.downtilt_deg or None,
                mechanical_downtilt_rad=float(np.radians(cell.mechanical_downtilt_deg)),
            )  # fmt: skip
        return levels(
            layout, [[cell.east_m, cell.north_m]], self.options.level_sigma_db,
            loss_at_km_db=float(near) + cell.penetration_loss_db * cell.indoor,
            exponent=float(far - near) / 10.0, eirp_dbm=cell.eirp_dbm, boresight_rad=boresight,
            beamwidth_rad=float(np.radians(cell.beamwidth_deg)),
            max_attenuation_db=cell.max_attenuation_db, pattern_db=pattern,
            shortest_distance_m=20.0,
        )  # fmt: skip


if TYPE_CHECKING:
    from mapfilter.models.gaussian import GaussianTerms


def compiled(measurement: GaussianTerms) -> CompiledMeasurement:
    """Return a measurement as the compiled filters take it."""
    from mapfilter.models.terms import measure

    return CompiledMeasurement(
        measure,
        measurement.slots,
        measurement.uses,
        measurement.rows,
        measurement.patterns,
        measurement.covariance(),
    )
