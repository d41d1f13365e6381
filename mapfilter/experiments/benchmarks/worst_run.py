"""The worst run of a case: which one it is, and what went wrong in it, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, position_errors_m
from mapfilter.evaluation.claims import claims_of
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.estimate import TrackEstimate

_BIN_M = 25.0
_FAR_M = 10_000.0


def worst_row(rows: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return the row of the worst run of a case.

    That with the most claimed epochs more than 50 m off; if there are none, one that never found
    itself; else that with the largest mean error over 100 m.
    """

    def badness(row: Mapping[str, Any]) -> tuple[float, ...]:
        off = float(row["claimed"] - row["within_50m"])
        worst_m = row["worst_100m_m"]
        lost = worst_m is None or row["switch_m"] is None
        return off, float(lost), 0.0 if worst_m is None else worst_m, -float(row["route"])

    return max(rows, key=badness)


@dataclass(frozen=True, slots=True)
class WorstEpoch:
    """The worst epoch of a run, and the stretch of claims more than 50 m off around it.

    Parameters
    ----------
    index : int
        Of the epoch: the claimed one with the largest error, or the last one without any claim.
    first, last : int
        Epochs of the stretch; both are ``index`` where no claim is more than 50 m off.
    what : str
        What went wrong, in a few words.
    reason : str
        Epoch, status, error, and what the belief stated, in sentences.
    """

    index: int
    first: int
    last: int
    what: str
    reason: str


def explain(estimate: TrackEstimate, truth: Truth) -> WorstEpoch | None:
    """Return the worst epoch of a run and the reason in words; None without any epoch.

    Parameters
    ----------
    estimate : TrackEstimate
        With at least one epoch within the ground truth, to be explained.
    """
    errors_m = position_errors_m(estimate, truth)
    inside = (estimate.time_s >= truth.time_s[0]) & (estimate.time_s <= truth.time_s[-1])
    if not inside.any():
        return None
    claimed = claims_of(estimate) & np.isfinite(errors_m)
    if not claimed.any():
        index = int(np.flatnonzero(inside)[-1])
        what = "no position was ever claimed"
        return WorstEpoch(index, index, index, what, _searching(estimate, errors_m, truth, index))
    index = int(np.argmax(np.where(claimed, errors_m, -1.0)))
    first = last = index
    if errors_m[index] <= SUCCESS_RADIUS_M:
        what = "no claim is more than 50 m off"
        stretch = ""
    else:
        off = claimed & (errors_m > SUCCESS_RADIUS_M)
        while first > 0 and off[first - 1]:
            first -= 1
        while last + 1 < off.size and off[last + 1]:
            last += 1
        began = first == 0 or not claimed[first - 1]
        before = f" after {estimate.status[first - 1]}" if first else ""
        what = (
            f"a wrong place was claimed ({estimate.status[first]}{before})"
            if began
            else f"the position went astray while {estimate.status[first]}"
        )
        lasted_s = estimate.time_s[last] - estimate.time_s[first]
        stretch = (
            f"More than 50 m off from {estimate.time_s[first]:.0f} s to "
            f"{estimate.time_s[last]:.0f} s ({lasted_s:.0f} s); {_ending(estimate, claimed, last)}."
        )
    worst = (
        f"Worst at {_place(estimate, truth, index)}: {estimate.status[index]}, "
        f"{_distance(float(errors_m[index]))} off."
    )
    return WorstEpoch(
        index, first, last, what, " ".join(filter(None, (stretch, worst, _stated(estimate, index))))
    )


def _ending(estimate: TrackEstimate, claimed: Any, last: int) -> str:
    """Return how a stretch of wrong claims ended."""
    if last + 1 >= len(estimate):
        return "it lasted to the end"
    if not claimed[last + 1]:
        return f"then {estimate.status[last + 1]}"
    return "then within 50 m again"


def _distance(metres: float) -> str:
    """Return a distance in words; logs of another city are many kilometres off."""
    return f"{metres:.0f} m" if metres < _FAR_M else f"{metres / 1000:.0f} km"


def _place(estimate: TrackEstimate, truth: Truth, index: int) -> str:
    time_s = float(estimate.time_s[index])
    return f"{time_s:.0f} s, after {float(truth.distance_at(time_s)):.0f} m"


def _stated(estimate: TrackEstimate, index: int) -> str:
    """Return what the belief stated at an epoch."""
    parts = []
    radius_m = float(estimate.radii_m[index, 2])
    if np.isfinite(radius_m):
        parts.append(f"95 % within {radius_m:.0f} m")
    level_m = float(estimate.protection_m[index])
    if not np.isnan(level_m):
        shown = f"{level_m:.0f} m" if np.isfinite(level_m) else "none"
        parts.append(f"protection level {shown}")
    mass = float(estimate.mass_50m[index])
    if np.isfinite(mass):
        parts.append(f"{100 * mass:.1f} % of the belief within 50 m")
    evidence = estimate.evidence
    if evidence is not None and evidence.runner_up_mass[index] > 0:
        away_m = np.hypot(
            evidence.runner_up_east_m[index] - estimate.east_m[index],
            evidence.runner_up_north_m[index] - estimate.north_m[index],
        )
        parts.append(f"runner-up {100 * evidence.runner_up_mass[index]:.1f} %, {away_m:.0f} m away")
    return f"Stated there: {'; '.join(parts)}." if parts else ""


def _searching(estimate: TrackEstimate, errors_m: Any, truth: Truth, index: int) -> str:
    """Return the state of a run that never claimed a position, at its end."""
    words = [f"At the end, {_place(estimate, truth, index)}: {estimate.status[index]}"]
    if np.isfinite(errors_m[index]):
        words.append(f"leading hypothesis {_distance(float(errors_m[index]))} off")
    evidence = estimate.evidence
    if evidence is not None and np.isfinite(evidence.entropy_bits[index]):
        area_m2 = 2.0 ** float(evidence.entropy_bits[index]) * _BIN_M**2
        words.append(f"the belief covers {area_m2:.0f} m²")
    return f"{', '.join(words)}. {_stated(estimate, index)}".strip()
