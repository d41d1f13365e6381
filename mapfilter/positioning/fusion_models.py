"""What a log's readings mean to Kalman-type filters: sites, levels, steps of timing advance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import grid_convergence_rad, heading_from_azimuth_rad, unproject
from mapfilter.models.gaussian import GaussianTerms, stack
from mapfilter.models.signal_strength import levels
from mapfilter.models.state import StateLayout
from mapfilter.models.timing_advance import GSM_STEP_M, timing_advances
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.pathloss_hata import cost231_hata_db

_MOBILE_HEIGHT_M = 1.5


@dataclass(frozen=True, slots=True)
class FusionOptions:
    """How sure readings and motion are.

    Parameters
    ----------
    level_sigma_db : float
        Slow fading and errors of the path loss together.
    timing_step_m : float
        Distance of a step of timing advance.
    timing_sigma_m : float
        Deviation of a timing advance but for its rounding.
    level_memory_s, timing_memory_s : float
        How long errors of levels (shadowing, path loss) and of timing advances (rounding) stay the
        same: reports in a row count as one in so many seconds.
    fix_sigma_m : float
        Deviation of GNSS fixes that tell none.
    acceleration : float
        Root of the power density of acceleration without dead reckoning, m/s^1.5.
    speed_sigma_mps : float
        Deviation of the first speed.
    step_sigma_m, heading_sigma_rad : float
        Deviations of a step's length and direction by dead reckoning.
    drift_m : float
        What dead reckoning does not see, metres per root second.
    start_sigma_m : float
        Deviation of a start at the serving site.
    settled_m : float
        A 95 % radius below which the filter says that it has converged.
    """

    level_sigma_db: float = 9.0
    timing_step_m: float = GSM_STEP_M
    timing_sigma_m: float = 200.0
    level_memory_s: float = 15.0
    timing_memory_s: float = 60.0
    fix_sigma_m: float = 10.0
    acceleration: float = 0.7
    speed_sigma_mps: float = 8.0
    step_sigma_m: float = 0.3
    heading_sigma_rad: float = 0.2
    drift_m: float = 0.3
    start_sigma_m: float = 1500.0
    settled_m: float = 1000.0

    def __post_init__(self) -> None:
        faults = Faults()
        for name in self.__slots__:
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                faults.add(f"fusion, {name}", "a number above 0", value)
        faults.raise_if_any(InputError)


class SiteModels:
    """Measurement models of a cell plan's sites, made when first asked for.

    Path loss is that of COST 231 Hata at the cell's frequency and height, whatever the distance;
    antennas are the plan's sectors by formula.
    """

    def __init__(self, plan: CellPlan, options: FusionOptions) -> None:
        self.options = options
        self.cells: Mapping[str, Cell] = {cell.id: cell for cell in plan.cells}
        first = plan.cells[0]
        lon, lat = unproject(plan.crs, first.east_m, first.north_m)
        self.convergence_rad = grid_convergence_rad(plan.crs, float(lon), float(lat))
        self.of = lru_cache(maxsize=4096)(self._of)

    def _of(self, layout: StateLayout, heard: tuple[str, ...], timed: str | None) -> GaussianTerms:
        """Return the model of levels of cells, and of the timing advance of one, in this order."""
        parts = [self._level(layout, self.cells[name]) for name in heard]
        if timed is not None:
            cell, step = self.cells[timed], self.options.timing_step_m
            sigma = float(np.hypot(self.options.timing_sigma_m, step / 12**0.5))
            parts.append(timing_advances(layout, [[cell.east_m, cell.north_m]], sigma))
        return stack(parts)

    def _level(self, layout: StateLayout, cell: Cell) -> GaussianTerms:
        near, far = cost231_hata_db(
            [1000.0, 10_000.0], cell.frequency_mhz, max(cell.height_m, 10.0), _MOBILE_HEIGHT_M,
            False,
        )  # fmt: skip
        boresight = None
        if cell.azimuth_deg is not None:
            boresight = float(heading_from_azimuth_rad(cell.azimuth_deg, self.convergence_rad))
        return levels(
            layout, [[cell.east_m, cell.north_m]], self.options.level_sigma_db,
            loss_at_km_db=float(near) + cell.penetration_loss_db * cell.indoor,
            exponent=float(far - near) / 10.0, eirp_dbm=cell.eirp_dbm, boresight_rad=boresight,
            beamwidth_rad=float(np.radians(cell.beamwidth_deg)),
            max_attenuation_db=cell.max_attenuation_db, shortest_distance_m=20.0,
        )  # fmt: skip

    def known(self, names: Sequence[str | None]) -> tuple[str, ...]:
        """Return those of some cells that the plan has."""
        return tuple(name for name in names if name is not None and name in self.cells)
