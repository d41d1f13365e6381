"""The smoother of Rauch, Tung & Striebel (1965): what later readings say of earlier states.

``G = P Φᵀ M⁻¹``, ``x_s = x + G (x_s⁺ - Φ x)``, with M the covariance predicted. It takes the
means and covariances of any filter whose motion is linear, and goes backwards over them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Smoothed beliefs of T trials over K steps.

    Parameters
    ----------
    means : (T, K, n) array
    covariances : (T, K, n, n) array
    """

    means: Floats
    covariances: Floats


def smooth(transition: Floats, process: Floats, means: Floats, covariances: Floats) -> Smoothed:
    """Smooth what a filter found.

    The covariance takes the form ``(I - GΦ) P (I - GΦ)ᵀ + G (P_s⁺ + Q) Gᵀ``, a sum of what cannot
    be negative.

    Parameters
    ----------
    transition, process : (n, n) or (K - 1, n, n) arrays
        Φ and Q, the same for all steps or from each step to the next.
    means : (T, K, n) array
    covariances : (T, K, n, n) array
        Of the updated beliefs.

    Raises
    ------
    InputError
        Sizes that do not fit.
    """
    trials, steps, n = means.shape
    if covariances.shape != (trials, steps, n, n) or transition.shape[-2:] != (n, n):
        faults = Faults()
        faults.add("covariances", f"shape {(trials, steps, n, n)}", covariances.shape)
        faults.raise_if_any(InputError)
    phi = np.broadcast_to(transition, (max(steps - 1, 0), n, n))
    noise = np.broadcast_to(process, (max(steps - 1, 0), n, n))
    smoothed, spread = means.copy(), covariances.copy()
    for k in range(steps - 2, -1, -1):
        own = covariances[:, k]
        predicted = phi[k] @ own @ phi[k].T + noise[k]
        # Scaled to correlations: a clock's bias may be known a million times worse than a speed.
        scale = np.sqrt(np.maximum(np.diagonal(predicted, axis1=-2, axis2=-1), 1e-300))
        unit = predicted / (scale[:, :, None] * scale[:, None, :])
        cross = (phi[k] @ own) / scale[:, :, None]
        gain = np.swapaxes(np.linalg.solve(unit, cross), -1, -2) / scale[:, None, :]
        ahead = smoothed[:, k + 1] - means[:, k] @ phi[k].T
        smoothed[:, k] = means[:, k] + np.einsum("tij,tj->ti", gain, ahead)
        rest = np.eye(n) - gain @ phi[k]
        later = spread[:, k + 1] + noise[k]
        both = rest @ own @ np.swapaxes(rest, -1, -2) + gain @ later @ np.swapaxes(gain, -1, -2)
        spread[:, k] = 0.5 * (both + np.swapaxes(both, -1, -2))
    return Smoothed(smoothed, spread)
