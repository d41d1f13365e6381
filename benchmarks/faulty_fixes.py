"""Kalman-type filters on made journeys whose fixes fail: python benchmarks/faulty_fixes.py.

Even seeds are for choices, odd ones for figures: ``--seeds 1:25:2``.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np
from faulty_fixes_world import CRS, EAST_M, FAULTS, KINDS, NORTH_M, Journey, journey

from mapfilter._types import Floats
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.log_options import fitted_to_log
from mapfilter.positioning.loop import locate
from mapfilter.radio.cells import CellPlan

_AFTER_S, _WRONG_M = 120.0, 50.0
_CLAIMED = ("TRACKING", "CONVERGED")


class Score(NamedTuple):
    """Of a stretch of a journey: shares of its epochs, and medians.

    ``wrong`` is the share of epochs that are claimed more than 50 m off, ``held`` that of claimed
    ones within the 95 % radius, ``held_all`` that of all.
    """

    claimed: float
    wrong: float
    held: float
    held_all: float
    error_m: float
    error95_m: float
    radius_m: float


def scored(made: Journey, method: str) -> tuple[Score, Score, Score]:
    """Return the scores before, in and after the fault."""
    options, _ = fitted_to_log(KalmanFilter(method=method), made.log)
    tracker = options.over_sites(CellPlan(CRS, ()))
    found = locate(made.log, tracker, np.random.default_rng(0)).estimate
    time_s = np.asarray(found.time_s)
    at = np.round(time_s).astype(int)
    place = np.asarray(found.east_m) - EAST_M + 1j * (np.asarray(found.north_m) - NORTH_M)
    error_m = np.abs(place - made.true_m[at])
    radius_m = np.asarray(found.radii_m)[:, 2]
    claimed = np.isin([str(one) for one in found.status], _CLAIMED)
    begun_s = 60.0
    stretches = (
        (time_s >= begun_s) & (time_s < made.from_s),
        (time_s >= max(made.from_s, begun_s)) & (time_s < made.to_s),
        (time_s >= made.to_s) & (time_s < made.to_s + _AFTER_S),
    )
    return tuple(_score(error_m[one], radius_m[one], claimed[one]) for one in stretches)


def _score(error_m: Floats, radius_m: Floats, claimed: np.ndarray) -> Score:
    if not error_m.size:
        return Score(*[np.nan] * 7)
    held = error_m <= radius_m
    return Score(
        float(claimed.mean()),
        float((claimed & (error_m > _WRONG_M)).mean()),
        float(held[claimed].mean()) if claimed.any() else np.nan,
        float(held.mean()),
        float(np.median(error_m)),
        float(np.quantile(error_m, 0.95)),
        float(np.median(radius_m)),
    )


def main() -> None:
    """Print a table of means over journeys, and of the least share that a radius holds."""
    given = argparse.ArgumentParser()
    given.add_argument("--seeds", default="0:16:2")
    given.add_argument("--methods", default="ekf")
    given.add_argument("--cases", default="")
    given.add_argument("--kinds", default=",".join(KINDS))
    options = given.parse_args()
    seeds = range(*map(int, options.seeds.split(":")))
    cases = [name for name in FAULTS if any(one in name for one in options.cases.split(","))]
    print("kind  case  stretch | claimed wrong held held_all error e95 radius | least held_all")
    for method in options.methods.split(","):
        for kind in options.kinds.split(","):
            for name in cases:
                scores = np.array([scored(journey(kind, name, seed), method) for seed in seeds])
                for k, stretch in enumerate(("before", "fault", "after")):
                    rows = scores[:, k]
                    if np.isnan(rows).all():
                        continue
                    share = " ".join(f"{x:.3f}" for x in np.nanmean(rows[:, :4], axis=0))
                    size = " ".join(f"{x:6.1f}" for x in np.nanmean(rows[:, 4:], axis=0))
                    least = np.nanmin(rows[:, 3])
                    print(f"{method} {kind} {name:22} {stretch:6} | {share} {size} | {least:.2f}",
                          flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
