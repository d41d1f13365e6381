"""Radii about the mean of a normal belief that hold given shares of it."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats

_ANGLES = np.pi * (np.arange(256) + 0.5) / 256
_SHARES = np.array([0.50, 0.67, 0.95])


def gaussian_radii_m(covariance_m2: Floats, within_m: float) -> tuple[Floats, float]:
    """Return the radii that hold 50, 67 and 95 %, and the share within a distance.

    In polar coordinates, ``P(r > R) = 1/(π sqrt(ab)) ∫ exp(-R² q / 2) / q dθ`` over half a turn,
    ``q = cos²θ/a + sin²θ/b``, with the eigenvalues a and b of the covariance.

    Parameters
    ----------
    covariance_m2 : (2, 2) array
        East, north.
    within_m : float

    Examples
    --------
    >>> radii, share = gaussian_radii_m(np.diag([100.0, 100.0]), 20.0)
    >>> radii.round(2).tolist(), round(share, 4)
    ([11.77, 14.89, 24.48], 0.8647)
    """
    high, low = _spread(covariance_m2)
    near, far = np.zeros(3), np.full(3, 6.0 * np.sqrt(high))
    for _ in range(40):
        middle = 0.5 * (near + far)
        beyond = _outside(middle, high, low) > 1 - _SHARES
        near, far = np.where(beyond, middle, near), np.where(beyond, far, middle)
    return 0.5 * (near + far), share_within(covariance_m2, within_m)


def share_within(covariance_m2: Floats, within_m: float) -> float:
    """Return the share of a normal belief within a distance of its mean.

    Examples
    --------
    >>> round(share_within(np.diag([100.0, 100.0]), 20.0), 4)
    0.8647
    """
    return float(1 - _outside(np.array([within_m]), *_spread(covariance_m2))[0])


def _spread(covariance_m2: Floats) -> tuple[float, float]:
    values = np.maximum(np.linalg.eigvalsh(covariance_m2), 1e-6)
    # Ratios beyond this are a line as far as any radius can tell.
    return float(values[1]), float(max(values[0], 1e-4 * values[1]))


def _outside(radius_m: Floats, high: float, low: float) -> Floats:
    q = np.cos(_ANGLES) ** 2 / high + np.sin(_ANGLES) ** 2 / low
    inner = np.exp(-0.5 * radius_m[:, None] ** 2 * q) / q
    return np.asarray(inner.mean(axis=1) / np.sqrt(high * low))
