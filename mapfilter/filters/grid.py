"""The exact filter on a grid: position on a lattice times bins of the lasting heading error.

It sums over all positions where particles sample some, so it is the oracle that the particle filter
is tested against, and a choice for small areas. Mass moves with the mean and the variance of each
displacement; where that falls between pixels, it is smeared over them.

Mass lies on the filter's device (:mod:`mapfilter._device`); summaries are brought back.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite, nan
from typing import Any, Generic, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from mapfilter._device import PROCESSOR, Device, arrays_of, on_host
from mapfilter._types import Floats, Floats32
from mapfilter.filters.array_summary import summarise_arrays
from mapfilter.filters.belief_models import Cloud, PriorT, ReadingT, WeighingModel
from mapfilter.filters.contract import Estimate, MotionStep, Reason, Status, UpdateInfo
from mapfilter.filters.grid_transport import (
    Spread,
    Transport,
    Waiting,
    carried,
    spread_along,
)
from mapfilter.filters.hypotheses import BeliefSummary, Bins, empty_summary, summarise
from mapfilter.filters.particle import ParticleOptions
from mapfilter.filters.switch_rule import switched

_LEAST_MASS = 1e-9
_NOTHING = Waiting()


class GridModel(WeighingModel[ReadingT], Protocol[PriorT, ReadingT]):
    """Motion, map and measurements, as a grid filter needs them."""

    @property
    def bias_rad(self) -> Floats:
        """Middle of each bin of the lasting heading error, shape (B,)."""

    @property
    def circular(self) -> bool:
        """Whether the bins go around the whole circle."""

    def start(self, prior: PriorT) -> tuple[Floats32, Floats32]:
        """Return the first mass on and off the map, shape (B, rows, cols) each."""

    def states(
        self, row: NDArray[np.intp], col: NDArray[np.intp], bias_rad: Floats32, off: Floats32
    ) -> Floats32:
        """Return pixels as states of the particle model, shape (R, N)."""

    def transport(
        self,
        east_m: float,
        north_m: float,
        length_m: float,
        spread_m2: float,
        turned_rad2: float,
    ) -> Transport:
        """Return the effect of a displacement by dead reckoning, of some length.

        ``spread_m2`` is a further variance along each axis, ``turned_rad2`` that of a change of
        heading that was not measured.
        """

    def spread(self, aside_m: float, aside_m2: float) -> Spread:
        """Return the effect of a way to all sides, of some length and variance along each axis."""

    def placed(self, device: Device) -> Self:
        """Return the model with its arrays on a device: itself if they lie there already."""


@dataclass(frozen=True, eq=False)
class GridBelief:
    """Mass on the grid, and the status of the filter.

    Parameters
    ----------
    on, off : ndarray of float32, shape (B, rows, cols)
        Mass of those on and off the map; together they sum to one after an update.
    shared : object
        What the model shares between all pixels after the last reading.
    waiting : Waiting
        Motion that mass has not been moved by yet.
    travelled_m, log_evidence, status, agreement_start_m
        As of :class:`mapfilter.filters.particle.ParticleBelief`.
    """

    on: Floats32
    off: Floats32
    model: GridModel[Any, Any]
    shared: Any = None
    waiting: Waiting = _NOTHING
    travelled_m: float = 0.0
    log_evidence: float = 0.0
    status: Status = Status.SEARCHING
    agreement_start_m: float = nan

    @property
    def bins(self) -> Bins:
        """The area, in bins."""
        return self.model.bins

    @cached_property
    def moved(self) -> GridBelief:
        """The belief with all mass moved by the displacement that waits, and weighed by the map."""
        if self.waiting == _NOTHING:
            return self
        model, waiting = self.model, self.waiting
        on, off = self.on, self.off
        if waiting.length_m > 0 or waiting.turned_rad2 > 0:
            step = model.transport(*waiting[:5])
            # Masses of a restored belief may lie elsewhere than a model that it was given since.
            arrays = arrays_of(step.on)
            on, off = arrays.asarray(on), arrays.asarray(off)
            on, off = carried(on, off, step, circular=model.circular)
        if waiting.aside_m > 0:
            way = model.spread(waiting.aside_m, waiting.aside_m2)
            arrays = arrays_of(way.ways)
            on, off = spread_along(arrays.asarray(on), arrays.asarray(off), way)
        return replace(self, on=on, off=off, waiting=_NOTHING)

    @cached_property
    def _held(self) -> tuple[Any, Any]:
        """Pixels that hold mass, as states, and their weights, on the device."""
        moved = self.moved
        # Until the next update each metre costs some of the mass.
        total = float(moved.on.sum(dtype=np.float64) + moved.off.sum(dtype=np.float64))
        _, mass, state = moved.above(_LEAST_MASS * total)
        return state, (mass / mass.sum()).astype(np.float32)

    def above(self, least: float, *, of_highest: bool = False) -> tuple[Any, Any, Any]:
        """Return indices, masses and states of pixels with more mass, or share of the highest."""
        arrays, both = arrays_of(self.on), self.on + self.off
        at = arrays.nonzero(both > least * (float(both.max()) if of_highest else 1.0))
        mass, (bias, row, col) = both[at], at
        bias_rad = arrays.asarray(self.model.bias_rad)[bias].astype(np.float32)
        return at, mass, self.model.states(row, col, bias_rad, self.off[at] / mass)

    @cached_property
    def _cloud(self) -> tuple[Floats32, Floats32]:
        """The same as NumPy's arrays."""
        state, weight = self._held
        return on_host(state), on_host(weight)

    @property
    def count(self) -> int:
        """Number of pixels that hold mass."""
        return int(self._held[1].size)

    @property
    def state(self) -> Floats32:
        """Pixels that hold mass, shape (R, N)."""
        return self._cloud[0]

    @property
    def weight(self) -> Floats32:
        """Their weights, shape (N,)."""
        return self._cloud[1]

    @property
    def log_weight(self) -> Floats:
        """Logarithms of the weights."""
        return np.log(self.weight.astype(np.float64))

    @cached_property
    def summary(self) -> BeliefSummary:
        """Leading hypothesis, radii and runners-up."""
        state, weight = self._held
        if not weight.size:
            return empty_summary(state.shape[0])
        if isinstance(weight, np.ndarray):
            return summarise(state, weight, self.bins)
        return summarise_arrays(state, weight, self.bins)

    def __getstate__(self) -> dict[str, object]:
        # It is read where there may be no device; the filter's next update places it again.
        kept = {name: self.__dict__[name] for name in self.__dataclass_fields__}
        here = {"on": on_host(self.on), "off": on_host(self.off)}
        return kept | here | {"model": self.model.placed(PROCESSOR)}

    def placed(self, device: Device) -> GridBelief:
        """Return the belief with its mass on a device: itself if it lies there already."""
        on, off, model = device.placed(self.on), device.placed(self.off), self.model.placed(device)
        if on is self.on and off is self.off and model is self.model:
            return self
        return replace(self, on=on, off=off, model=model)


@dataclass(frozen=True, slots=True)
class GridFilter(Generic[PriorT, ReadingT]):
    """The exact filter for a model; its switch rule is the particle filter's, with its options.

    The model takes and returns arrays of ``device``.
    """

    model: GridModel[PriorT, ReadingT]
    options: ParticleOptions = field(default_factory=ParticleOptions)
    device: Device = PROCESSOR

    def init(self, prior: PriorT, rng: np.random.Generator) -> GridBelief:  # noqa: ARG002
        """Return the first belief; nothing is drawn."""
        on, off = self.model.start(prior)
        return GridBelief(on, off, self.model).placed(self.device)

    def predict(
        self,
        belief: GridBelief,
        motion: MotionStep,
        rng: np.random.Generator,  # noqa: ARG002
    ) -> tuple[GridBelief, Reason]:
        """Add a step to the displacement that waits for the next reading.

        Without a heading mass spreads to all sides, as far as the step is long.
        """
        if not isfinite(motion.step_m):
            return belief, Reason.NO_STEP
        reason = Reason.USED if isfinite(motion.heading_rad) else Reason.NO_HEADING
        if motion.step_m == 0:
            return belief, reason
        waiting = belief.waiting.after(motion)
        travelled_m = belief.travelled_m + abs(motion.step_m)
        return replace(belief, waiting=waiting, travelled_m=travelled_m), reason

    def update(
        self,
        belief: GridBelief,
        reading: ReadingT,
        rng: np.random.Generator,  # noqa: ARG002
    ) -> tuple[GridBelief, UpdateInfo]:
        """Move the mass by what waits, weigh it, and apply the switch rule."""
        arrays, before = self.device.arrays, belief.placed(self.device).moved
        at, mass, state = before.above(_LEAST_MASS, of_highest=True)
        if not mass.size:
            return belief, UpdateInfo(Reason.NO_CANDIDATES_LEFT, belief.status, 0)
        log_weight = arrays.zeros(mass.size)
        nothing = arrays.empty((0, mass.size), dtype=np.float32)
        cloud, reason = self.model.weigh(Cloud(state, nothing), log_weight, reading)
        if reason is not Reason.USED:
            return belief, UpdateInfo(reason, belief.status, int(mass.size))
        highest = float(log_weight.max())
        likelihood = arrays.exp(log_weight - highest).astype(np.float32)
        on, off = arrays.zeros_like(before.on), arrays.zeros_like(before.off)
        on[at] = before.on[at] * likelihood
        off[at] = before.off[at] * likelihood
        total = float(on.sum(dtype=np.float64) + off.sum(dtype=np.float64))
        if not total > 0:
            return belief, UpdateInfo(Reason.NO_CANDIDATES_LEFT, belief.status, int(mass.size))
        weighed = replace(
            before,
            on=(on / np.float32(total)).astype(np.float32),
            off=(off / np.float32(total)).astype(np.float32),
            shared=cloud.shared,
            log_evidence=before.log_evidence + highest + float(np.log(total)),
        )
        status, agreement_start_m = switched(
            belief.status,
            belief.travelled_m,
            belief.agreement_start_m,
            agrees=weighed.summary.mass_50m >= self.options.switch_mass
            and self.model.can_converge(weighed.summary, reading),
            splits=weighed.summary.mass_50m < self.options.split_mass,
            hold_m=self.options.switch_hold_m,
        )
        now = replace(weighed, status=status, agreement_start_m=agreement_start_m)
        return now, UpdateInfo(Reason.USED, status, int(mass.size))

    def locate(self, belief: GridBelief) -> Estimate:
        """Return the leading hypothesis."""
        return belief.summary.estimate
