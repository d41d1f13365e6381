"""The map filter's model on a grid: the same likelihoods at the pixels of the area's lattice.

On a device the likelihood of the map lies there, and that of a report is computed there; terms of
other sources are computed by the processor, for the pixels that hold mass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, exp, isfinite, pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mapfilter._device import PROCESSOR, Device, arrays_of
from mapfilter._types import Floats, Floats32
from mapfilter.angles import wrap_rad
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import Reason
from mapfilter.filters.grid_transport import Spread, Transport
from mapfilter.filters.hypotheses import BeliefSummary, Bins
from mapfilter.models.street_motion import BIAS, EAST, NORTH, OFF, STATES
from mapfilter.models.way_spread import LEAST_LOG, ways_exponent
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.beliefs.path_start import OFF_AT_START
from mapfilter.positioning.bayes.sources.evidence import RadioReading

if TYPE_CHECKING:
    from mapfilter.positioning.bayes.beliefs.device_step import DeviceStep

_CIRCLE_BINS = 72
_LEAST_START_SD_M = 1e-3
"""Least deviation of a known start: an exact one is the nearest pixel."""


@dataclass(frozen=True)
class StreetGrid:
    """Ways and radio maps of an area on its lattice, times bins of the lasting heading error.

    The step scale is no dimension of the grid, nor are deviations of headings and steps: they widen
    the motion. Errors of levels are not remembered from one report to the next. Without a compass
    the heading error is uniform. Arrays are taken and returned on ``device``.
    """

    model: BayesModel
    compass: bool = True
    bin_rad: float = 0.04
    device: Device = PROCESSOR

    @property
    def bins(self) -> Bins:
        """Bins of 25 m over the area."""
        return self.model.bins

    @property
    def circular(self) -> bool:
        """Whether the bins go around the whole circle."""
        return not self.compass

    @cached_property
    def bias_rad(self) -> Floats:
        """Middles of the bins: three standard deviations to both sides, or the whole circle."""
        if not self.compass:
            return np.asarray(wrap_rad(2 * pi * np.arange(_CIRCLE_BINS) / _CIRCLE_BINS))
        side = ceil(3 * self.model.motion.bias_sd_rad / self.bin_rad)
        return np.asarray(self.bin_rad * np.arange(-side, side + 1), dtype=np.float64)

    @cached_property
    def _log_map(self) -> Any:
        """Log-likelihood of the map at every pixel, on the device."""
        return self.device.placed(self.model.log_map)

    @cached_property
    def _on_device(self) -> DeviceStep:
        # Its kernels take a while to import.
        from mapfilter.positioning.bayes.beliefs.device_step import DeviceStep

        return DeviceStep(self.model, self.device)

    def start(self, prior: Start) -> tuple[Floats32, Floats32]:
        """Return mass on the ways and off them: by the first evidence, or about a known start."""
        area = self.model.whole
        row, col = np.indices(area.on_way.shape).reshape(2, -1)
        zeros = np.zeros(row.size, dtype=np.float32)
        state = self.states(row, col, zeros, zeros)
        log_weight = np.zeros(row.size)
        on_map = area.on_way / max(area.on_way.sum(), 1)
        if isfinite(prior.east_m):
            west, south = area.origin_m
            dx, dy = state[EAST] - (prior.east_m - west), state[NORTH] - (prior.north_m - south)
            log_weight -= (dx**2 + dy**2) / (2 * max(prior.sd_m, _LEAST_START_SD_M) ** 2)
            on_map = np.full(on_map.shape, 1 / row.size)
        if prior.reading is not None:
            nothing = np.empty((0, row.size), np.float32)
            self.model.weigh(Cloud(state, nothing), log_weight, prior.reading)
        likely = np.exp(log_weight - log_weight.max()).reshape(on_map.shape)
        bias = np.ones(self.bias_rad.size)
        if self.compass and self.model.motion.bias_sd_rad > 0:
            bias = np.exp(-0.5 * (self.bias_rad / self.model.motion.bias_sd_rad) ** 2)
        on = (1 - OFF_AT_START) * bias[:, None, None] * on_map * likely
        off = OFF_AT_START * bias[:, None, None] * likely / row.size
        total = on.sum() + off.sum()
        return (on / total).astype(np.float32), (off / total).astype(np.float32)

    def states(
        self, row: NDArray[np.intp], col: NDArray[np.intp], bias_rad: Floats32, off: Floats32
    ) -> Floats32:
        """Return pixels as states of the particle model."""
        lattice = self.model.area.lattice
        state: Floats32 = arrays_of(row).zeros((STATES, row.size), dtype=np.float32)
        state[EAST] = (col + 0.5) * lattice.resolution_m
        state[NORTH] = (lattice.rows - row - 0.5) * lattice.resolution_m
        state[BIAS] = bias_rad
        state[OFF] = off
        return state

    def transport(
        self,
        east_m: float,
        north_m: float,
        length_m: float,
        spread_m2: float,
        turned_rad2: float = 0.0,
    ) -> Transport:
        """Return the transport of the mass of each bin by a displacement of dead reckoning."""
        motion, over = self.model.motion, self.model.weights.over(length_m)
        pixel_m = self.model.area.lattice.resolution_m
        stretch = exp(0.5 * motion.white_rad**2)
        cosine, sine = np.cos(self.bias_rad), np.sin(self.bias_rad)
        right = stretch * (east_m * cosine - north_m * sine) / pixel_m
        up = stretch * (east_m * sine + north_m * cosine) / pixel_m
        steps = length_m / motion.typical_step_m
        along_var = steps * motion.step_sd_m**2 + (motion.scale_sd * length_m) ** 2
        across_var = steps * (motion.typical_step_m * motion.white_rad) ** 2
        # Deviations spread like white noise that has the same variance over a long way.
        along_var += 2 * motion.stretch_m * length_m * motion.stretch_sd**2
        across_var += 2 * motion.heading_m * length_m * motion.turn_sd_rad**2
        heading = np.arctan2(up, right)
        east_var = along_var * np.cos(heading) ** 2 + across_var * np.sin(heading) ** 2 + spread_m2
        north_var = along_var * np.sin(heading) ** 2 + across_var * np.cos(heading) ** 2 + spread_m2
        width_rad = 2 * pi / _CIRCLE_BINS if self.circular else self.bin_rad
        return Transport(
            right,
            -up,
            np.sqrt(east_var) / pixel_m,
            np.sqrt(north_var) / pixel_m,
            sqrt(motion.bias_drift_rad_per_sqrt_m**2 * length_m + turned_rad2) / width_rad,
            self.device.arrays.exp(over.exponent * self._log_map),
            over.off,
            over.leave,
            over.come_back,
        )

    def spread(self, aside_m: float, aside_m2: float) -> Spread:
        """Return the effect of a way to all sides."""
        weights, arrays = self.model.weights, self.device.arrays
        over = weights.over(aside_m)
        log_ways = ways_exponent(weights, sqrt(2 * aside_m2)) * self._log_map
        ways = arrays.exp(arrays.maximum(log_ways, LEAST_LOG))
        sd_px = sqrt(aside_m2) / self.model.area.lattice.resolution_m
        return Spread(sd_px, ways, over.off, over.leave, over.come_back)

    def weigh(
        self, cloud: Cloud, log_weight: Floats, reading: RadioReading
    ) -> tuple[Cloud, Reason]:
        """Add the log-likelihood of a reading, in place."""
        weigher = self.model if self.device.is_host else self._on_device
        return weigher.weigh(cloud, log_weight, reading)

    def placed(self, device: Device) -> StreetGrid:
        """Return the grid with its arrays on a device: itself if they lie there already."""
        return self if device == self.device else replace(self, device=device)

    def __getstate__(self) -> dict[str, object]:
        # The likelihood of the map is computed again where it is needed.
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}

    def can_converge(self, summary: BeliefSummary, reading: RadioReading) -> bool:
        """Return whether the leading hypothesis is on the map, and nothing else is as probable."""
        return self.model.can_converge(summary, reading)
