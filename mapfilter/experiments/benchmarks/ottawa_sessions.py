"""Sessions of a phone that logged its serving cell: measurements and ground truth.

Speed and bearing by GNSS stand in for steps and headings, after stated errors have been added;
positions are truth alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._inputs import open_input
from mapfilter._types import Floats
from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import grid_convergence_rad, project
from mapfilter.tracks.joining.sampling import sampling_sd_m
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.schema import SERVING

LONGEST_GAP_S = 30.0
"""Over a longer silence the way is not known."""
_MOST_STEPS = 1282
_GOOD_M, _MOVED_M = 20.0, 4.0
_IDENTITY = ("mcc", "mnc", "lac", "cellid")
_GNSS = ("lat", "lon", "measured_at", "rating", "speed", "direction")
_COLUMNS = (*_IDENTITY, *_GNSS, "signal", "ta")


@dataclass(frozen=True, slots=True)
class ReckoningErrors:
    """Errors that are added to speed and bearing.

    Parameters
    ----------
    step_share : float
        White noise of a step, as a share of it.
    heading_sd_rad : float
        White noise of a heading.
    bias_rad : float
        Of all headings of a session, to one side or the other.
    """

    step_share: float = 0.10
    heading_sd_rad: float = radians(6.0)
    bias_rad: float = radians(5.0)


@dataclass(frozen=True, eq=False)
class Session:
    """One session, in the order of time; N rows.

    Parameters
    ----------
    time_s : ndarray of float64, shape (N,)
        Unix seconds.
    lon_deg, lat_deg, accuracy_m : ndarray
        By GNSS.
    speed_mps, azimuth_deg : ndarray
        By GNSS; clockwise from north.
    cell : tuple of str
        Serving.
    level_dbm : ndarray
        RSRP.
    timing_advance : ndarray
        Steps; NaN where it was not reported.
    """

    name: str
    path: Path
    time_s: Floats
    lon_deg: Floats
    lat_deg: Floats
    accuracy_m: Floats
    speed_mps: Floats
    azimuth_deg: Floats
    cell: tuple[str, ...]
    level_dbm: Floats
    timing_advance: Floats

    def __len__(self) -> int:
        return self.time_s.size

    def places(self, crs: str) -> Floats:
        """Return east and north by GNSS, shape (N, 2)."""
        return np.column_stack(project(crs, self.lon_deg, self.lat_deg))


def read_session(path: Path) -> Session:
    """Read a session from a file in OpenCellID's columns; of rows of one time the first counts.

    Raises
    ------
    InputError
        The file cannot be read, a column is missing, or there are not two rows.
    """
    try:
        with open_input(path) as stream:
            table = pd.read_csv(stream, usecols=list(_COLUMNS))
    except (OSError, ValueError) as error:
        expected = f"CSV with the columns {', '.join(_COLUMNS)}"
        raise fail(InputError, str(path), expected, error) from error
    numbers = table.apply(pd.to_numeric, errors="coerce")
    numbers = numbers.replace([np.inf, -np.inf], np.nan)
    numbers = numbers.dropna(subset=[*_IDENTITY, "lat", "lon", "measured_at", "signal"])
    numbers = numbers.drop_duplicates("measured_at").sort_values("measured_at", kind="stable")
    if len(numbers) < 2:
        raise fail(InputError, str(path), "two rows or more", len(numbers))
    steps = _column(numbers, "ta")
    reported = (steps >= 0) & (steps <= _MOST_STEPS)
    identity = numbers[list(_IDENTITY)].astype(np.int64)
    return Session(
        path.stem,
        path,
        _column(numbers, "measured_at") / 1000,
        _column(numbers, "lon"),
        _column(numbers, "lat"),
        _column(numbers, "rating"),
        _column(numbers, "speed"),
        _column(numbers, "direction"),
        tuple("-".join(map(str, row)) for row in identity.itertuples(index=False)),
        _column(numbers, "signal"),
        np.where(reported, steps, np.nan),
    )


def session_log(
    session: Session,
    crs: str,
    errors: ReckoningErrors,
    rng: np.random.Generator,
    *,
    step_factor: float = 1.0,
) -> TrackLog:
    """Return the log, in a CRS, of a phone without GNSS, with the ground truth.

    Between two rows, speed and bearing are those of the first for half of the time, then those of
    the second. Over a silence of more than 30 s no step is known. All steps are multiplied by the
    factor that :func:`step_factor_of` learns from other sessions.
    """
    time_s = session.time_s - session.time_s[0]
    half_s = np.diff(time_s) / 2
    ends = np.column_stack([time_s[:-1] + half_s, time_s[1:]]).ravel()
    step_m, heading = _reckoned(session, crs)
    bias = errors.bias_rad * rng.choice([-1.0, 1.0])
    step_m = step_factor * step_m * (1 + errors.step_share * rng.standard_normal(ends.size))
    measured = heading + bias + errors.heading_sd_rad * rng.standard_normal(ends.size)
    motion = pd.DataFrame(
        {
            "time_s": ends,
            "step_m": step_m,
            "heading_rad": np.angle(np.exp(1j * measured)),
            "sampling_sd_m": step_factor * _sampling_sd_m(session),
        }
    )
    radio = pd.DataFrame(
        {
            "time_s": time_s,
            "role": SERVING,
            "cell": session.cell,
            "level_dbm": session.level_dbm,
            "timing_advance": session.timing_advance,
        }
    )
    east_m, north_m = session.places(crs).T
    truth = pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": north_m})
    return make_log(crs, motion=motion, radio=radio, truth=truth, start_utc_s=session.time_s[0])


def step_factor_of(others: Sequence[Session], crs: str) -> float:
    """Return how many times longer true ways are than speed times time, which GNSS smooths.

    It is the median over all intervals with motion between good fixes, of sessions of the same
    receiver other than the one that is to be found.
    """
    ratios = []
    for other in others:
        step_m, heading = _reckoned(other, crs)
        halves_m = step_m[:, np.newaxis] * np.column_stack([np.cos(heading), np.sin(heading)])
        reckoned_m = np.hypot(*(halves_m[0::2] + halves_m[1::2]).T)
        true_m = np.hypot(*np.diff(other.places(crs), axis=0).T)
        good = np.maximum(other.accuracy_m[:-1], other.accuracy_m[1:]) <= _GOOD_M
        moved = good & (reckoned_m > _MOVED_M)
        ratios.append(true_m[moved] / reckoned_m[moved])
    every = np.concatenate([np.empty(0), *ratios])
    return float(np.median(every)) if every.size else 1.0


def _reckoned(session: Session, crs: str) -> tuple[Floats, Floats]:
    """Return steps in metres and headings in radians of the two halves of each interval."""
    lon_deg, lat_deg = float(np.median(session.lon_deg)), float(np.median(session.lat_deg))
    heading = heading_from_azimuth_rad(
        session.azimuth_deg, grid_convergence_rad(crs, lon_deg, lat_deg)
    )
    half_s = np.diff(session.time_s) / 2
    # Rows 0, 1, 1, 2, 2, ...: each interval's halves belong to its two ends.
    of = np.column_stack([np.arange(half_s.size), np.arange(1, half_s.size + 1)]).ravel()
    length_s = np.repeat(half_s, 2)
    step_m = np.where(2 * length_s <= LONGEST_GAP_S, session.speed_mps[of] * length_s, np.nan)
    return step_m, heading[of]


def _sampling_sd_m(session: Session) -> Floats:
    """Return the deviation of both halves of each interval; all of it is that of the longer one."""
    speed_mps, azimuth = session.speed_mps, np.radians(session.azimuth_deg)
    velocity = speed_mps * np.sin(azimuth), speed_mps * np.cos(azimuth)
    both_m = sampling_sd_m(session.time_s, *velocity)
    first_longer = speed_mps[:-1] >= speed_mps[1:]
    return np.column_stack([both_m * first_longer, both_m * ~first_longer]).ravel()


def centroids(others: Sequence[Session], crs: str, accuracy_m: float) -> dict[str, Floats]:
    """Return the mean place of each cell's rows in sessions, of fixes that are good enough."""
    places = np.concatenate([other.places(crs) for other in others])
    good = np.concatenate([other.accuracy_m for other in others]) <= accuracy_m
    cell = np.array([name for other in others for name in other.cell])
    return {str(name): places[good & (cell == name)].mean(axis=0) for name in np.unique(cell[good])}


def _column(table: pd.DataFrame, name: str) -> Floats:
    return np.asarray(table[name], dtype=np.float64)
