"""Options and measurement models of Kalman-type filters: levels and timing advances of sites."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import atan2, hypot, sqrt
from typing import Annotated

import numpy as np
from annotated_types import Ge, Le

from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.errors import Faults, InputError
from mapfilter.filters.trials import CompiledMeasurement
from mapfilter.geodesy import grid_convergence_rad, unproject
from mapfilter.models.gaussian import GaussianTerms, stack
from mapfilter.models.ranging import GSM_STEP_M, timing_advances
from mapfilter.models.signal_strength import levels, sampled_pattern
from mapfilter.models.state import StateLayout
from mapfilter.models.terms import measure_kernel
from mapfilter.options import NotNegative, Options, Positive
from mapfilter.positioning.epochs import FIX_SD_M
from mapfilter.positioning.kalman.lasting import LEAST_WHITE
from mapfilter.positioning.kalman.level_errors import LastingLevels
from mapfilter.propagation.empirical import cost231_hata_db
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cell_rules import ANTENNAS
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.rxlev import resolve_neighbours

_MOBILE_HEIGHT_M = 1.5
_SEEN_FROM_M = 1000.0


@dataclass(frozen=True, slots=True)
class KalmanOptions(Options):
    """Assumed errors of measurements and of motion, and the start of the belief.

    Parameters
    ----------
    level_error_db : float
        Assumed deviation of a cell's levels from the path loss: antenna, streets and buildings.
    level_memory_m : float
        Distance after which the correlation of that error is 1/e.
    level_offset_db : float
        Assumed deviation of the error that all cells share: of the formula and the receiver.
    level_offset_memory_m : float
        Distance after which the correlation of that error is 1/e.
    level_noise_db : float
        Assumed deviation of levels besides: fading and obstacles that are passed.
    level_noise_memory_m : float
        Distance for which that noise lasts: reports in a row count as one over it.
    timing_step_m : float
        Distance of a step of timing advance: 553.5 m in GSM, 78.1 m in LTE.
    timing_sd_m : float
        Assumed deviation of a timing advance besides its rounding.
    timing_memory_m : float
        Distance for which errors of timing advances last.
    fix_sd_m : float
        Assumed deviation of a GNSS fix without one.
    fix_lasting_share : float
        Assumed share of a fix's variance that lasts over later fixes, a Gauss-Markov process; 0:
        fixes are independent of each other.
    fix_lasting_m : float
        Assumed deviation of that part along one axis, whatever fixes state; 0: by their variances.
        :func:`mapfilter.positioning.fingerprints.lasting.lasting_error` finds that of Wi-Fi.
    fix_lasting_s : float
        Time after which the correlation of that part is 1/e.
    step_sd_m : float
        Assumed deviation of a step's length.
    heading_sd_deg : float
        Assumed deviation of a heading, white; 0.2 rad.
    bias_sd_deg : float
        Assumed deviation of a heading's error that lasts, at the start.
    drift_deg_per_sqrt_m : float
        Assumed random walk of that error of a compass.
    turn_drift_deg_per_sqrt_m : float
        Assumed random walk of headings that are sums of turns: of wheels that slip, of cameras that
        shake, and of the noise of gyroscopes.
    turn_rate_sd_deg_per_s : float
        Assumed deviation of the lasting error of a rate of turns, where headings are their sums.
    scale : float
        Assumed deviation of the share by which steps are too short; 0.09 for walkers whose step
        length nobody measured.
    drift_m_per_sqrt_s : float
        Assumed random walk of the position besides dead reckoning.
    acceleration_mps_per_sqrt_s : float
        Assumed random walk of the speed, where there is no dead reckoning.
    speed_sd_mps : float
        Assumed deviation of the first speed from 0, where there is no dead reckoning.
    start_sd_m : float
        Assumed deviation of a start at the serving site, without fix and timing advance.
    start_parts : int
        Parts along east and along north into which such a start is cut, and at most a start from a
        fix of a larger deviation than ``start_spacing_m``.
    start_spacing_m : float
        Distance between the parts of a start on a timing advance's circle, or about such a fix.
    reach_m : float
        Farthest that a neighbour of unknown identity is searched for from the serving site by its
        carrier and BSIC; 63 steps of timing advance in GSM.
    converged_radius_m : float
        95 % radius below which the filter has converged.
    """

    level_error_db: Positive = 12.0
    level_memory_m: Positive = 300.0
    level_offset_db: Positive = 10.0
    level_offset_memory_m: Positive = 3000.0
    level_noise_db: Positive = 8.0
    level_noise_memory_m: Positive = 40.0
    timing_step_m: Positive = GSM_STEP_M
    timing_sd_m: Positive = 200.0
    timing_memory_m: Positive = 500.0
    fix_sd_m: Positive = FIX_SD_M
    fix_lasting_share: Annotated[float, Ge(0), Le(1 - LEAST_WHITE)] = 0.7
    fix_lasting_m: NotNegative = 0.0
    fix_lasting_s: Positive = 30.0
    step_sd_m: Positive = 0.3
    heading_sd_deg: Positive = 11.459155902616464
    bias_sd_deg: NotNegative = 10.0
    drift_deg_per_sqrt_m: NotNegative = 0.6
    turn_drift_deg_per_sqrt_m: NotNegative = 0.3
    turn_rate_sd_deg_per_s: NotNegative = 0.05
    scale: NotNegative = 0.03
    drift_m_per_sqrt_s: Positive = 0.3
    acceleration_mps_per_sqrt_s: Positive = 0.7
    speed_sd_mps: Positive = 8.0
    start_sd_m: Positive = 1500.0
    start_parts: Annotated[int, Ge(1), Le(100)] = 21
    start_spacing_m: Positive = 600.0
    reach_m: Positive = 35_000.0
    converged_radius_m: Positive = 1000.0

    @property
    def has_lasting_fixes(self) -> bool:
        """Whether errors of fixes last."""
        return self.fix_lasting_m > 0 or self.fix_lasting_share > 0

    def lasting_fix_m(self, variance_m2: float) -> float:
        """Return the deviation of the lasting error of fixes with a variance along one axis."""
        return self.fix_lasting_m or sqrt(self.fix_lasting_share * variance_m2)

    @property
    def lasting_levels(self) -> LastingLevels:
        """Errors of levels that last."""
        common = self.level_offset_db, self.level_offset_memory_m
        return LastingLevels(*common, self.level_error_db, self.level_memory_m)


class SiteModels:
    """Measurement models of a cell plan's sites, made at their first use.

    Path loss is that of COST 231 Hata at the cell's frequency and height, whatever the distance;
    antennas are the plan's sectors by formula, or the measured ones that cells name
    (:func:`mapfilter.radio.msi.read_antennas`), as seen from 1 km. A plan without cells is one for
    fixes and dead reckoning alone.

    Raises
    ------
    InputError
        A cell names an antenna that is not there.
    """

    def __init__(
        self,
        plan: CellPlan,
        options: KalmanOptions,
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
        self.convergence_rad = 0.0
        for first in plan.cells[:1]:
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
            sigma = float(np.hypot(self.options.timing_sd_m, step / 12**0.5))
            parts.append(timing_advances(layout, [[cell.east_m, cell.north_m]], sigma))
        return stack(parts)

    def _neighbours(
        self, serving: str | None, arfcn: int | None, bsic: int | None
    ) -> tuple[str, ...]:
        """Return the cells that a carrier and a BSIC may mean where another cell serves."""
        at, reach_m = self.cells.get(serving or ""), self.options.reach_m
        others = [self.cells[one] for one in resolve_neighbours(self.plan, arfcn, bsic)]
        return tuple(
            cell.id
            for cell in others
            if cell.id != serving
            and (at is None or hypot(cell.east_m - at.east_m, cell.north_m - at.north_m) <= reach_m)
        )

    def _level(self, layout: StateLayout, name: str) -> GaussianTerms:
        cell, measured = self.cells[name], self.antennas.get(self.cells[name].antenna)
        height_m = max(cell.height_m, 10.0)
        near, far = cost231_hata_db(
            [1000.0, 10_000.0], cell.frequency_mhz, height_m, _MOBILE_HEIGHT_M, False
        )
        boresight, pattern = None, None
        if cell.antenna != "omni" and (measured is not None or cell.azimuth_deg is not None):
            azimuth_deg = cell.azimuth_deg or 0.0
            boresight = float(heading_from_azimuth_rad(azimuth_deg, self.convergence_rad))
        if measured is not None:
            depression_rad = atan2(cell.height_m - _MOBILE_HEIGHT_M, _SEEN_FROM_M)
            leaning_rad = float(np.radians(cell.mechanical_downtilt_deg))
            pattern = sampled_pattern(
                measured,
                depression_rad,
                cell.downtilt_deg or None,
                mechanical_downtilt_rad=leaning_rad,
            )
        return levels(
            layout,
            [[cell.east_m, cell.north_m]],
            self.options.level_noise_db,
            loss_at_km_db=float(near) + cell.penetration_loss_db * cell.indoor,
            exponent=float(far - near) / 10.0,
            eirp_dbm=cell.eirp_dbm,
            boresight_rad=boresight,
            beamwidth_rad=float(np.radians(cell.beamwidth_deg)),
            max_attenuation_db=cell.max_attenuation_db,
            pattern_db=pattern,
            shortest_distance_m=20.0,
        )


def compiled(measurement: GaussianTerms) -> CompiledMeasurement:
    """Return a measurement as the compiled filters take it."""
    return CompiledMeasurement(
        measure_kernel(),
        measurement.slots,
        measurement.uses,
        measurement.rows,
        measurement.patterns,
        measurement.noise,
    )
