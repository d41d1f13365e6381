"""Journeys of the benchmark: routes, reports, unmeasured displacements, satellites, a spoofer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import pandas as pd

from mapfilter._constants import DAY_S
from mapfilter.errors import InputError, fail
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.gnss.almanacs import joined, nominal_galileo, nominal_gps
from mapfilter.gnss.orbits import gps_time
from mapfilter.gnss.skyline import Skyline
from mapfilter.propagation.shadowing import named_rng
from mapfilter.simulation.imu import noisy_motion
from mapfilter.simulation.journeys import JourneyPlan, journey
from mapfilter.simulation.level_samplers import Levels
from mapfilter.simulation.reports import reports
from mapfilter.simulation.routes import route
from mapfilter.simulation.satellites import ReceptionModel, Spoofer, receive
from mapfilter.simulation.simulate import SimulationSettings, at_ticks
from mapfilter.tracks.log import TrackLog, make_log

_BEFORE_M = 800.0
_AFTER_M = 1000.0
_NEAREST_M, _FARTHEST_M = 200.0, 1000.0
_ATTEMPTS = 2000
START_UTC_S = 1_700_000_000.0
SPOOFED_M, SPOOFED_S = 500.0, 60.0
WINDOW_S = 120.0
"""Errors about a spoofer are looked at from its beginning on, for so long."""

HEIGHT_M = 100.0
TOWN_HEIGHT: Mapping[str, float] = MappingProxyType(
    {"antenna_height_m": HEIGHT_M, "antenna_height_sd_m": 20.0}
)
"""Height of the town over the ellipsoid, as a map states it, by options of the filter."""


@dataclass(frozen=True, slots=True)
class Walk:
    """A journey's truth, and what happened on it.

    Parameters
    ----------
    truth : pandas.DataFrame
        time_s, east_m, north_m, way_id.
    displaced_at_s : float
        Time of the last row before a displacement; infinite without.
    fault_at_s, fault_until_s : float
        When a fault of the sensors began and ended; infinite without, or without an end.
    """

    truth: pd.DataFrame
    displaced_at_s: float = float("inf")
    fault_at_s: float = float("inf")
    fault_until_s: float = float("inf")

    @property
    def arrived_at_s(self) -> float:
        """Time of the first row after the displacement; infinite without one."""
        time_s = self.truth["time_s"].to_numpy()
        later_s = time_s[time_s > self.displaced_at_s]
        return float(later_s[0]) if later_s.size else float("inf")


def walk(streets: SweepWorld, plan: JourneyPlan, seed: int, number: int) -> Walk:
    """Walk along a random route, of the plan's length."""
    along = route(streets.network, plan.length_m, named_rng(seed, "route", str(number)))
    return Walk(journey(along, plan, named_rng(seed, "walker", str(number)), streets.inside))


def displaced_walk(streets: SweepWorld, plan: JourneyPlan, seed: int, number: int) -> Walk:
    """Walk 800 m, be carried 200 m to 1 km away without anything being measured, and walk 1 km.

    Both parts lie on one route: the first place behind the cut that is as far away as was drawn.

    Raises
    ------
    InputError
        The streets are too near each other.
    """
    rng = named_rng(seed, "displacement", str(number))
    # Short legs turn back soon; some routes never get as far away as is wanted.
    length_m = _BEFORE_M + 4 * _FARTHEST_M
    for attempt in range(_ATTEMPTS):
        along = route(streets.network, length_m, rng)
        walker = named_rng(seed, "displaced walker", str(number), str(attempt))
        whole = journey(along, replace(plan, length_m=length_m), walker, streets.inside)
        wanted_m = rng.uniform(_NEAREST_M, _FARTHEST_M)
        east, north = whole["east_m"].to_numpy(), whole["north_m"].to_numpy()
        walked_m = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(east), np.diff(north)))])
        cut = int(np.searchsorted(walked_m, _BEFORE_M))
        away = np.hypot(east[cut:] - east[cut], north[cut:] - north[cut]) >= wanted_m
        again = cut + int(np.argmax(away))
        end = int(np.searchsorted(walked_m, walked_m[again] + _AFTER_M))
        if away.any() and end < len(walked_m):
            break
    else:
        expected = f"streets over {_NEAREST_M:g} m and more, to be displaced on"
        got = f"{np.ptp(streets.network.east_m):.0f} x {np.ptp(streets.network.north_m):.0f} m"
        raise fail(InputError, "street network", expected, got, "a small area")
    kept = pd.concat([whole.iloc[: cut + 1], whole.iloc[again:end]], ignore_index=True)
    time_s = float(whole["time_s"].iloc[1]) * np.arange(len(kept))
    return Walk(kept.assign(time_s=time_s), float(time_s[cut]))


def log_of(
    case: Case,
    walked: Walk,
    levels: Levels,
    streets: SweepWorld,
    settings: SimulationSettings,
    seed: int,
    number: int,
    fixed: frozenset[str] = frozenset(),
) -> TrackLog:
    """Return the log of a walk, route ``number`` of the benchmark, in the ground truth's levels.

    Cases of one noise have the same noise, and all the same reports. ``fixed`` are errors of dead
    reckoning that the case does not change.
    """
    truth, plan = walked.truth, streets.plan
    radio = reports(truth, levels, plan, settings.reports, named_rng(seed, "radio", str(number)))
    if not case.levels:
        serving = radio[radio["role"] == "serving"]
        radio = serving.assign(level_dbm=np.nan, censored=np.int8(0)).reset_index(drop=True)
    errors = case.errors_in(settings.imu, fixed)
    ticks = at_ticks(_as_walked(walked), settings.imu.period_s)
    motion = noisy_motion(ticks, errors, named_rng(seed, "imu", str(number)))
    # Whoever is carried makes no steps, not even noisy ones.
    ends_s = ticks["time_s"].to_numpy()[1:]
    begins_s = ticks["time_s"].to_numpy()[:-1]
    carried = (begins_s >= walked.displaced_at_s) & (ends_s <= walked.arrived_at_s)
    motion.loc[carried, "step_m"] = 0.0
    if not case.compass:
        motion["heading_rad"] = np.nan
    log = make_log(streets.network.crs, motion=motion, radio=radio)
    # The truth of a displacement is no path.
    return replace(log, truth=truth)


def _as_walked(walked: Walk) -> pd.DataFrame:
    """Return the truth as if one had stood still while one was displaced."""
    truth = walked.truth
    after = truth["time_s"].to_numpy() > walked.displaced_at_s
    if not after.any():
        return truth
    first = int(np.argmax(after))
    moved = {
        name: np.where(after, axis - (axis[first] - axis[first - 1]), axis)
        for name, axis in ((name, truth[name].to_numpy()) for name in ("east_m", "north_m"))
    }
    return truth.assign(**moved)


def spoofer_of(walked: Walk, seed: int, number: int) -> Spoofer:
    """Return who puts a walk elsewhere: at a random time after 40 % of it, to a random side."""
    rng = named_rng(seed, "spoofer", str(number))
    time_s = walked.truth["time_s"].to_numpy()
    first_s, last_s = 0.4 * time_s[-1], max(time_s[-1] - WINDOW_S, 0.4 * time_s[-1])
    angle = rng.uniform(0.0, 2 * np.pi)
    return Spoofer(
        float(rng.uniform(first_s, last_s)),
        SPOOFED_S,
        SPOOFED_M * float(np.cos(angle)),
        SPOOFED_M * float(np.sin(angle)),
        float(rng.normal(0.0, 100.0)),
    )


def with_satellites(
    case: Case,
    log: TrackLog,
    walked: Walk,
    skyline: Skyline | None,
    seed: int,
    number: int,
    model: ReceptionModel | None = None,
) -> TrackLog:
    """Return a walk's log with pseudoranges to as many satellites as the case has.

    All cases of a walk see the same sky, clock and noise; those of more satellites receive others
    beside the same ones. The height is always the benchmark's; without a model nothing is
    reflected.
    """
    if case.satellites is None:
        return log
    rng = named_rng(seed, "satellites", str(number))
    start_utc_s = START_UTC_S + float(rng.uniform(0.0, DAY_S))
    week, _ = gps_time(start_utc_s)
    received_as = replace(model or ReceptionModel(), most=case.satellites, height_m=HEIGHT_M)
    ranges: pd.DataFrame = receive(
        walked.truth,
        log.crs,
        skyline,
        joined(nominal_gps(week), nominal_galileo(week)),
        start_utc_s,
        received_as,
        rng,
        spoofer_of(walked, seed, number) if case.spoofed else None,
    )
    checked = make_log(log.crs, pseudoranges=ranges, start_utc_s=start_utc_s)
    return replace(log, pseudoranges=checked.pseudoranges, start_utc_s=start_utc_s)
