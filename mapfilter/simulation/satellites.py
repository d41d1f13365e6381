"""Simulated pseudoranges of a journey: visible satellites, ranges, clock, echoes, a spoofer.

Satellites are seen past the buildings by geometry. A pseudorange is the distance, the receiver's
clock, noise that grows towards the horizon, and echoes, which only make it longer and last for
metres. Hidden satellites may be received by reflections
(:mod:`~mapfilter.simulation.reflections`). A spoofer may put a receiver elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from annotated_types import Ge, Gt, Lt

from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import unproject
from mapfilter.gnss.almanacs import Almanac
from mapfilter.gnss.noise import correlated_along, multipath_bias_m
from mapfilter.gnss.orbits import gps_time, satellite_positions_m
from mapfilter.gnss.sky import Directions, GridFrame, directions, ecef_from_lonlat
from mapfilter.gnss.skyline import Skyline
from mapfilter.models.motion import clock_noise
from mapfilter.options import NotNegative, Options, Positive
from mapfilter.simulation.journeys import ticks_s
from mapfilter.simulation.reflections import NlosModel, draw_reflections
from mapfilter.tracks.satellites import sent_from_m
from mapfilter.tracks.schema import PLACE


@dataclass(frozen=True, slots=True)
class ReceptionModel(Options):
    """Reception of satellites by a simulated receiver.

    Parameters
    ----------
    period_s : float
        Between two epochs of pseudoranges.
    most : int or None
        Channels: satellites that are received at a time; None for all that can be.
    choice : {"random", "highest"}
        Which of those that can be, reflections alike; with "random" the order is drawn anew every
        ``hold_s``.
    mask_deg : float
        Lower satellites are not received.
    zenith_m : float
        White noise overhead; it grows as one over the sine of the elevation.
    echo_m : float
        Mean of the echoes where half of the satellites over the mask are hidden, or more; in the
        open there are none.
    clock_m, drift_mps : float
        First error of the clock, uniform to both sides; deviation of its first rate.
    antenna_m : float
        Above ground.
    height_m, height_sd_m : float
        Of the ground over the ellipsoid, and by how much it differs from that as a whole.
    relief_m, relief_memory_m : float
        By how much, and over how many metres, the ground rises and falls.
    nlos : NlosModel or None
        How satellites behind buildings are received by reflections; None: they are not. Where
        nothing is in line of sight, as under a roof, they are not either.
    """

    period_s: Positive = 1.0
    most: Annotated[int, Ge(0)] | None = None
    choice: Literal["random", "highest"] = "random"
    hold_s: Positive = 20.0
    mask_deg: Annotated[float, Gt(0), Lt(90)] = 10.0
    zenith_m: Positive = 2.0
    echo_m: NotNegative = 3.0
    echo_memory_m: Positive = 10.0
    clock_m: NotNegative = 1e5
    drift_mps: NotNegative = 30.0
    antenna_m: NotNegative = 1.5
    height_m: float = 100.0
    height_sd_m: NotNegative = 10.0
    relief_m: NotNegative = 5.0
    relief_memory_m: Positive = 300.0
    nlos: NlosModel | None = None


@dataclass(frozen=True, slots=True)
class Spoofer:
    """Signals as if the receiver were elsewhere.

    Parameters
    ----------
    east_m, north_m : float
        How far off it seems to be.
    clock_m : float
        How much later all of its signals are.
    """

    from_s: float
    lasts_s: float
    east_m: float
    north_m: float
    clock_m: float = 0.0


def receive(
    truth: pd.DataFrame,
    crs: str,
    skyline: Skyline | None,
    almanac: Almanac,
    start_utc_s: float,
    model: ReceptionModel,
    rng: np.random.Generator,
    spoofer: Spoofer | None = None,
) -> pd.DataFrame:
    """Return the table of pseudoranges of one journey.

    Noise, clock and the order of choice do not depend on how many are received, nor on reflections
    or a spoofer: journeys of one seed differ in these alone.

    Parameters
    ----------
    truth : pandas.DataFrame
        time_s, east_m, north_m.
    crs : str
        Of the truth.
    skyline : Skyline or None
        Buildings in the same CRS; None for an open sky.
    almanac : Almanac
        Its weeks as those of the start.
    start_utc_s : float
        UTC seconds at ``time_s`` = 0.

    Raises
    ------
    InputError
        There is no truth, or the almanac is of another time.
    """
    if truth.empty:
        raise fail(InputError, "truth", "at least one row", "none")
    time, east, north = (truth[name].to_numpy() for name in ("time_s", "east_m", "north_m"))
    tick_s = ticks_s(time, model.period_s)
    count = len(tick_s)
    place = np.stack([np.interp(tick_s, time, axis) for axis in (east, north)], axis=1)
    gone_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))])
    relief = correlated_along(gone_m, 1, model.relief_memory_m, rng)[:, 0]
    ground_m = model.height_m + model.height_sd_m * rng.standard_normal() + model.relief_m * relief
    up_m = ground_m + model.antenna_m
    week, second = gps_time(start_utc_s + float(tick_s[0]))
    tow_s = second + (tick_s - tick_s[0])
    east_m, north_m = place[count // 2].tolist()
    frame = GridFrame(crs, east_m, north_m, float(model.height_m))
    usable = _over_horizon(almanac.usable(), week, tow_s[_moments(count, model)], frame, model)
    clock_m = _clock_m(count, model, rng)
    every = range(len(usable.names))
    white = rng.standard_normal((count, len(every)))
    memory_m = model.echo_memory_m
    echo = multipath_bias_m(gone_m, len(every), rng, mean_m=1.0, correlation_m=memory_m)
    slot = (tick_s // model.hold_s - tick_s[0] // model.hold_s).astype(int)
    order = rng.random((int(slot[-1]) + 1, len(every)))
    there = _ecef(crs, place, up_m)
    satellites = np.stack([_places(usable, i, week, tow_s, there) for i in every], axis=1)
    seen = directions(frame.local.to_local(satellites), frame.local.to_local(there)[:, None])
    open_sky, echo_m = _sky(seen, place, skyline, frame, model)
    range_m = np.linalg.norm(satellites - there[:, None], axis=2)
    sigma_m = model.zenith_m / np.sin(np.maximum(seen.elevation_rad, 0.05))
    measured_m = range_m + clock_m[:, None] + sigma_m * white + echo_m[:, None] * echo
    audible = open_sky
    if model.nlos is not None:
        # Drawn last: nothing else changes.
        mirrored, delay_m = draw_reflections(model.nlos, gone_m, seen.elevation_rad, rng)
        hidden = seen.above(model.mask_deg) & ~open_sky & open_sky.any(axis=1, keepdims=True)
        late_m = model.nlos.noise_factor * sigma_m * white + delay_m
        measured_m = np.where(hidden, range_m + clock_m[:, None] + late_m, measured_m)
        audible = open_sky | (hidden & mirrored)
    if spoofer is not None:
        shift = np.array([spoofer.east_m, spoofer.north_m])
        elsewhere = _ecef(crs, place + shift, up_m)
        false_m = np.linalg.norm(satellites - elsewhere[:, None], axis=2)
        on = (tick_s >= spoofer.from_s) & (tick_s < spoofer.from_s + spoofer.lasts_s)
        false_m = false_m + (clock_m + spoofer.clock_m)[:, None] + sigma_m * white
        measured_m = np.where(on[:, None], false_m, measured_m)
    prefer = seen.elevation_rad if model.choice == "highest" else order[slot]
    row, column = np.nonzero(_received(audible, prefer, model.most))
    return pd.DataFrame(
        {
            "time_s": tick_s[row],
            "satellite": np.array(usable.names, dtype=object)[column],
            "pseudorange_m": measured_m[row, column],
            **dict(zip(PLACE, satellites[row, column].T, strict=True)),
        }
    )


def _moments(count: int, model: ReceptionModel) -> Ints:
    """Return epochs to look at the sky: at most an hour apart, none farther than half an hour.

    A journey of an hour or less has one, in its middle.
    """
    hour = max(int(3600 / model.period_s), 1)
    found = np.arange(count // 2 % hour, count, hour)
    return found if count <= hour else np.union1d(found, [0, count - 1])


def _over_horizon(
    almanac: Almanac, week: int, tow_s: Floats, frame: GridFrame, model: ReceptionModel
) -> Almanac:
    """Return the satellites that may rise above the mask within half an hour of some moments."""
    above = np.full(len(almanac.names), -np.inf)
    for moment_s in tow_s.tolist():
        turns = int(moment_s // 604_800.0)
        there = satellite_positions_m(almanac, moment_s - 604_800.0 * turns, week + turns)
        above = np.maximum(above, directions(frame.local.to_local(there)).elevation_rad)
    return almanac.only(np.flatnonzero(above > np.radians(model.mask_deg) - 0.35))


def _places(almanac: Almanac, index: int, week: int, tow_s: Floats, there: Floats) -> Floats:
    """Return where one satellite was when it sent what is received, (K, 3)."""
    one = almanac.only(np.array([index]))
    first = sent_from_m(one, week, tow_s, np.full(tow_s.size, np.nan))
    return sent_from_m(one, week, tow_s, np.linalg.norm(first - there, axis=1))


def _ecef(crs: str, place: Floats, up_m: Floats) -> Floats:
    return ecef_from_lonlat(*unproject(crs, place[:, 0], place[:, 1]), up_m)


def _clock_m(count: int, model: ReceptionModel, rng: np.random.Generator) -> Floats:
    """Draw the clock's error at each epoch: its rate wanders, too."""
    noise = np.linalg.cholesky(clock_noise(model.period_s, cross_term="textbook"))
    steps = noise @ rng.standard_normal((2, count))
    rate = model.drift_mps * rng.standard_normal() + np.cumsum(steps[1])
    first = rng.uniform(-model.clock_m, model.clock_m)
    before = np.concatenate([[0.0], rate[:-1]])
    return np.asarray(first + np.cumsum(model.period_s * before + steps[0]))


def _sky(
    seen: Directions,
    place: Floats,
    skyline: Skyline | None,
    frame: GridFrame,
    model: ReceptionModel,
) -> tuple[Bools, Floats]:
    """Return which satellites are in sight at each epoch, (K, S), and the mean of echoes, (K,)."""
    above = seen.above(model.mask_deg)
    if skyline is None:
        return above, np.zeros(len(place))
    # Buildings stand on the map's grid, whose north is not the true one.
    true = np.stack([np.sin(seen.azimuth_rad), np.cos(seen.azimuth_rad)])
    east, north = np.einsum("ij,jks->iks", np.linalg.inv(frame.true_from_grid), true)
    up = np.where(above, seen.elevation_rad, -0.1)
    grid = Directions(up, np.mod(np.arctan2(east, north), 2 * np.pi))
    heights = np.full((len(place), 1), model.antenna_m)
    free = above & skyline.seen(np.hstack([place, heights]), grid)
    hidden = 1.0 - free.sum(axis=1) / np.maximum(above.sum(axis=1), 1)
    return free, model.echo_m * np.minimum(2.0 * hidden, 1.0)


def _received(audible: Bools, prefer: Floats, most: int | None) -> Bools:
    if most is None:
        return audible
    wanted = np.where(audible, prefer, -np.inf)
    rank = np.argsort(np.argsort(-wanted, axis=1, kind="stable"), axis=1, kind="stable")
    return audible & (rank < most)
