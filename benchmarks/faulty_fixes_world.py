"""Made drives and walks whose GNSS fixes are good, jammed, spoofed or reflected, with truth.

Nothing here is the filters' own: errors of fixes that last are white noise that is smoothed by a
Gaussian window, headings of a compass err by place, wheels have a wrong circumference, and vehicles
brake before corners and wait at crossings. Figures are those of the literature: gyroscopes and
wheels by Groves (2013, ch. 4 and 6), reflections between houses by Hsu (2018), drags of 1 to 2 m/s
by Humphreys (2013) and Psiaki & Humphreys (2016).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, pi

import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter1d

from mapfilter._types import Floats
from mapfilter.tracks.log import TrackLog, make_log

CRS, EAST_M, NORTH_M = "EPSG:32632", 500_000.0, 5_400_000.0
_HZ = 10
KINDS = ("drive", "walk")


@dataclass(frozen=True)
class Fault:
    """What happens to the fixes of a journey.

    Parameters
    ----------
    jammed_s : float
        Time without any fix, from the start of the fault on.
    drag_mps : float
        Speed by which fixes are led away from the true position, after that.
    drag_s : float
        Time for which they are.
    aside_m, aside_s : float
        How far fixes lie to one side after jamming, and for how long.
    reflected_m, reflected_s : float
        Deviation along each axis of errors that last for some 40 s, and for how long they come.
    rough_m : float
        The same of all fixes of the journey.
    """

    jammed_s: float = 0.0
    drag_mps: float = 0.0
    drag_s: float = 0.0
    aside_m: float = 0.0
    aside_s: float = 0.0
    reflected_m: float = 0.0
    reflected_s: float = 0.0
    rough_m: float = 0.0

    @property
    def lasts_s(self) -> float:
        """Time from its start to its end."""
        return self.jammed_s + max(self.drag_s, self.aside_s, self.reflected_s)


FAULTS = {
    "good": Fault(),
    "drag 0.5 m/s": Fault(drag_mps=0.5, drag_s=300.0),
    "drag 1 m/s": Fault(drag_mps=1.0, drag_s=300.0),
    "drag 2 m/s": Fault(drag_mps=2.0, drag_s=200.0),
    "jam 60 s, 40 m aside": Fault(60.0, aside_m=40.0, aside_s=90.0),
    "jam 300 s": Fault(300.0),
    "jam 300 s, 40 m aside": Fault(300.0, aside_m=40.0, aside_s=90.0),
    "rough, jam 300 s": Fault(300.0, rough_m=7.0),
    "canyon": Fault(reflected_m=20.0, reflected_s=400.0),
    "canyon from the start": Fault(reflected_m=20.0, reflected_s=inf),
}


@dataclass(frozen=True, eq=False)
class Journey:
    """A log, where one was each second (complex, from the frame's corner), and the fault's time."""

    log: TrackLog
    true_m: np.ndarray
    from_s: float
    to_s: float


def journey(kind: str, name: str, seed: int, *, length_s: int = 960) -> Journey:
    """Return a journey with a fault; the same seed makes the same way and sensors for all."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    true_m, gone_m, heading = _driven(rng, length_s) if kind == "drive" else _walked(rng, length_s)
    motion = (_wheels if kind == "drive" else _steps)(gone_m, heading, rng)
    fault, from_s = FAULTS[name], float(rng.integers(360, 420))
    begins_s = 0.0 if fault.reflected_s == inf else from_s
    fixes = _fixes(true_m, fault, begins_s, rng)
    time_s = np.arange(float(length_s))
    truth = pd.DataFrame(
        {"time_s": time_s, "east_m": EAST_M + true_m.real, "north_m": NORTH_M + true_m.imag}
    )
    log = make_log(CRS, motion=motion, gnss=fixes, truth=truth, start_utc_s=1.7e9)
    # Good journeys are looked at where the longest faults are.
    lasts_s = fault.lasts_s if fault != Fault() else 390.0
    return Journey(replace(log, vehicle=kind == "drive"), true_m, begins_s, begins_s + lasts_s)


def _streets(rng: np.random.Generator, length_m: float, radius_m: float) -> tuple[Floats, Floats]:
    """Return headings each decimetre of streets with rounded corners, and where corners are."""
    block_m, headings, corners, heading = rng.uniform(80.0, 220.0, 2), [], [], rng.uniform(-pi, pi)
    count, along = 0, int(rng.integers(2))
    while count < 10 * length_m:
        straight = int(10 * rng.integers(1, 4) * block_m[along])
        # Streets bend a little.
        bent = rng.normal(0.0, 0.08) * np.linspace(0.0, 1.0, straight)
        headings.append(heading + bent)
        heading += bent[-1]
        turn = rng.choice([-1.0, 1.0]) * pi / 2 + rng.normal(0.0, 0.1)
        arc = int(10 * radius_m * abs(turn))
        headings.append(heading + turn * np.linspace(0.0, 1.0, arc))
        corners.append((count + straight, count + straight + arc))
        heading, count, along = heading + turn, count + straight + arc, 1 - along
    return np.concatenate(headings), np.array(corners, dtype=float) / 10


def _driven(rng: np.random.Generator, length_s: int) -> tuple[np.ndarray, Floats, Floats]:
    """Return where a vehicle is each second, how far it has gone, and its heading."""
    headings, corners = _streets(rng, 15.0 * length_s, rng.uniform(8.0, 14.0))
    cruise = rng.uniform(8.0, 14.0, len(corners))
    wait_s = np.where(rng.random(len(corners)) < 0.4, 5.0 + rng.exponential(20.0, len(corners)), 0)
    at_m = speed = 0.0
    k, waited_s, gone = 0, 0.0, []
    for _ in range(length_s * _HZ):
        begins_m, ends_m = corners[k]
        limit = 5.0
        if at_m < begins_m:
            last = 0.0 if waited_s < wait_s[k] else 5.0
            limit = min(cruise[k], np.sqrt(last**2 + 2 * 2.0 * max(begins_m - 1 - at_m, 0.0)))
        if at_m > ends_m:
            k, waited_s = k + 1, 0.0
        speed = min(speed + 1.5 / _HZ, max(limit, speed - 2.5 / _HZ))
        speed = 0.0 if speed < 0.1 and limit < 0.1 else speed
        waited_s += (1 / _HZ) * (speed == 0.0)
        at_m += speed / _HZ
        gone.append(at_m)
    return _placed(np.array(gone), headings)


def _walked(rng: np.random.Generator, length_s: int) -> tuple[np.ndarray, Floats, Floats]:
    """Return where a walker is each second, how far one has gone, and its heading."""
    headings, _ = _streets(rng, 2.0 * length_s, 1.5)
    count = length_s * _HZ
    speed = 1.35 + 0.12 * _smooth(rng, count, 15.0 * _HZ)
    at, rests = 0, np.zeros(count, dtype=bool)
    while at < count:
        at += int(_HZ * rng.exponential(300.0)) + 200
        lasted = int(_HZ * rng.uniform(10.0, 45.0))
        rests[at : at + lasted] = True
        at += lasted
    speed[rests] = 0.0
    return _placed(np.cumsum(speed) / _HZ, headings)


def _placed(gone_m: Floats, headings: Floats) -> tuple[np.ndarray, Floats, Floats]:
    way = np.cumsum(np.exp(1j * headings)) / 10
    every = gone_m[_HZ - 1 :: _HZ]
    # Headings at each tenth of a second, of which a second's turn is the sum.
    turned = np.interp(gone_m, np.arange(len(headings)) / 10, headings)
    index = np.arange(len(way)) / 10
    place = np.interp(every, index, way.real) + 1j * np.interp(every, index, way.imag)
    return place, every, turned[_HZ - 1 :: _HZ]


def _wheels(gone_m: Floats, heading: Floats, rng: np.random.Generator) -> pd.DataFrame:
    """Return rows of an odometer in ticks of 4 cm and of a gyroscope whose bias wanders.

    Sensors are better and worse ones: four times as noisy, three times as much of a scale.
    """
    grade = float(np.exp(rng.uniform(-0.7, 0.7)))
    time_s = np.arange(float(len(gone_m)))
    ticks = np.floor(gone_m * (1 + rng.normal(0, 0.012 * grade)) / 0.04) * 0.04
    bias = rng.normal(0, 0.1 * grade) + 0.02 * grade * _smooth(rng, len(time_s), 200.0)
    noise = rng.normal(0, 0.1 * grade, len(time_s))
    turn = np.diff(heading) * (1 + rng.normal(0, 0.006 * grade)) + np.radians(bias + noise)[1:]
    return pd.DataFrame({"time_s": time_s[1:], "step_m": np.diff(ticks), "turn_rad": turn})


def _steps(gone_m: Floats, heading: Floats, rng: np.random.Generator) -> pd.DataFrame:
    """Return steps whose lengths err by 4 %, and headings of a compass among iron."""
    time_s = np.arange(float(len(gone_m)))
    step_m = np.diff(gone_m)
    scale = 1 + rng.normal(0, 0.03) + 0.02 * _smooth(rng, len(step_m), 60.0)
    step_m = np.maximum(step_m * scale + 0.05 * rng.normal(size=len(step_m)) * (step_m > 0), 0.0)
    by_place = np.interp(
        gone_m, np.arange(int(gone_m[-1]) + 2), _smooth(rng, int(gone_m[-1]) + 2, 25.0)
    )
    off = np.radians(rng.normal(0, 5) + 6 * by_place + rng.normal(0, 3, len(heading)))
    return pd.DataFrame(
        {"time_s": time_s[1:], "step_m": step_m, "heading_rad": (heading + off)[1:]}
    )


def _fixes(
    true_m: np.ndarray, fault: Fault, from_s: float, rng: np.random.Generator
) -> pd.DataFrame:
    """Return fixes each second that state what they usually are off by."""
    count = len(true_m)
    time_s = np.arange(float(count))
    usual = 2.5 * _both(rng, count, 25.0) + rng.normal(size=(2, count)).T @ [1.5, 1.5j]
    reflected = fault.reflected_m * _both(rng, count, 28.0)
    to_side = np.exp(1j * rng.uniform(-pi, pi))
    stated_m = np.where(rng.random(count) < 0.5, 3.0, 3.5)
    since_s = time_s - from_s - fault.jammed_s
    off = usual + to_side * fault.drag_mps * since_s * ((since_s > 0) & (since_s <= fault.drag_s))
    off += to_side * fault.aside_m * ((since_s >= 0) & (since_s < fault.aside_s))
    off += fault.rough_m * _both(rng, count, 28.0)
    off += reflected * ((since_s >= 0) & (since_s < fault.reflected_s))
    seen = true_m + off
    kept = (time_s < from_s) | (since_s >= 0)
    table = {
        "time_s": time_s, "east_m": EAST_M + seen.real, "north_m": NORTH_M + seen.imag,
        "var_east_m2": stated_m**2, "var_north_m2": stated_m**2,
        "cov_east_north_m2": np.zeros(count),
    }  # fmt: skip
    return pd.DataFrame(table)[kept]


def _both(rng: np.random.Generator, count: int, width: float) -> np.ndarray:
    return np.asarray(_smooth(rng, count, width) + 1j * _smooth(rng, count, width))


def _smooth(rng: np.random.Generator, count: int, width: float) -> Floats:
    """Return noise of variance 1 that is smoothed over some samples."""
    wide = int(4 * width)
    found = gaussian_filter1d(rng.normal(size=count + 2 * wide), width)[wide : wide + count]
    # The window's squared weights add up to 1 / (2 sqrt(pi) width).
    return np.asarray(found * np.sqrt(2 * np.sqrt(pi) * width))
