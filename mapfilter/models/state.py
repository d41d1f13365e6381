"""Meaning of the components of a state vector, and the protocol of Gaussian measurements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail


@dataclass(frozen=True, slots=True)
class StateLayout:
    """Where position and receiver clock stand in a state vector.

    Parameters
    ----------
    size : int
        Number of components, n.
    east, north : int
        Their indices.
    up : int or None
        Index of the height; None where the receiver stays at ``height_m``.
    clock : int or None
        Index of the receiver clock's bias in metres, c₀·δt; None where there is none.
    height_m : float
        Height of the receiver where ``up`` is None; 0, with transmitters at 0, for a plane.
    """

    size: int
    east: int
    north: int
    up: int | None = None
    clock: int | None = None
    height_m: float = 0.0

    def __post_init__(self) -> None:
        found = self.uses
        if len(set(found)) != len(found) or not all(0 <= index < self.size for index in found):
            expected = f"different indices in 0..{self.size - 1}"
            raise fail(InputError, "state layout", expected, found)

    @property
    def uses(self) -> tuple[int, ...]:
        """Indices of the components that measurements depend on: east, north, up, clock."""
        optional = (self.up, self.clock)
        return (self.east, self.north, *(index for index in optional if index is not None))

    @property
    def velocity(self) -> tuple[int, ...]:
        """Indices of the velocities, which stand behind their positions."""
        return tuple(i + 1 for i in (self.east, self.north, self.up) if i is not None)


POSITION = StateLayout(2, 0, 1)
"""East, north."""

POSITION_CLOCK_3D = StateLayout(4, 0, 1, 2, 3)
"""East, north, up, clock bias: what a static fix with pseudoranges solves for."""

MOVING = StateLayout(4, 0, 2)
"""East, its rate, north, its rate (Zhang et al. 2006; the GSM method of Fritsche & Klein 2009)."""

MOVING_CLOCK = StateLayout(6, 0, 2, clock=4)
"""East, its rate, north, its rate, clock bias, clock drift (Fritsche & Klein 2009, eq. 8)."""


@runtime_checkable
class GaussianMeasurement(Protocol):
    """A function of the state with additive Gaussian noise.

    One such object serves several uses: simulators draw from it, extended Kalman filters linearise
    it, sigma points go through it, and the Cramér-Rao recursion takes its Fisher information.
    States are (..., n) arrays: every method takes one state or a batch of them. Readings are
    (..., m) arrays; absent components are NaN.
    """

    def mean(self, state: Floats) -> Floats:
        """Return the expected reading, shape (..., m)."""

    def jacobian(self, state: Floats) -> Floats:
        """Return the derivative of the mean by the state, shape (..., m, n)."""

    def covariance(self) -> Floats:
        """Return the covariance of the noise, shape (m, m), in squared units of the reading."""
