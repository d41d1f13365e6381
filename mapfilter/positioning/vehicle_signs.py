"""Whose motion a log without headings has: a vehicle's, or a person's on foot or on a bicycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._constants import MAD_TO_SD
from mapfilter._types import Floats
from mapfilter.tracks.log import TrackLog

_USUAL_S, _TOP_SHARE = 10.0, 0.9
_PERSON_MPS, _MOTOR_MPS = 5.0, 12.0
_GAIN_S, _GAIN_MPS, _GAINS = 3.0, 4.0, 3
_SWAY_S, _SWAY_MPS = 0.5, 3.0
_STEADY_RADPS = np.radians(1.5)
_MOVING_MPS = 0.5
_MOST_SPANS = 1_000_000
_SHARP_M, _SHARP_RAD = 5.0, np.pi / 2


@dataclass(frozen=True)
class VehicleSigns:
    """Signs of a motor vehicle in turns without headings.

    Parameters
    ----------
    top_mps : float
        Speed, as a mean over 10 s, that is exceeded a tenth of the time. Above 5 m/s it is no
        walker's, above 12 m/s no cyclist's.
    gains : int
        How often speed grows by 4 m/s or more within 3 s, as motors do and cyclists do not.
    sway_radps : float
        How much the yaw rate of half a second usually differs from the mean of those before and
        after it, at more than 3 m/s: 0.3 to 0.9 deg/s in the cars of smartLoc and KITTI; bicycles
        steer to stay upright, about once a second. NaN where intervals are longer.
    sharpest_rad : float
        The largest turn within 5 m. Cars turn on circles of 4 m and more, by 70 degrees or so.
    """

    top_mps: float
    gains: int
    sway_radps: float
    sharpest_rad: float

    @property
    def fast(self) -> bool:
        """Whether it is faster than a walker."""
        return self.top_mps > _PERSON_MPS

    @property
    def vehicle(self) -> bool:
        """Whether it is fast, and neither sways nor turns as no motor vehicle does."""
        motor = self.top_mps > _MOTOR_MPS or self.gains >= _GAINS
        # Where the sway is not known, motion that has turns and no compass is most often a car's.
        sways = self.sway_radps > _STEADY_RADPS and not motor
        return self.fast and not sways and self.sharpest_rad < _SHARP_RAD

    def __str__(self) -> str:
        sway = f"sway of {np.degrees(self.sway_radps):.1f} deg/s, " if self.sway_radps >= 0 else ""
        return (
            f"up to {self.top_mps:.0f} m/s, gains of 4 m/s in 3 s: {self.gains}, {sway}turns of up "
            f"to {np.degrees(self.sharpest_rad):.0f} deg in 5 m"
        )


def vehicle_signs(log: TrackLog) -> VehicleSigns | None:
    """Return the signs of a vehicle in a log's motion; None where it has headings, or no turns."""
    motion = log.motion
    # The first row turns by nothing.
    if motion["turn_rad"].notna().sum() <= 1 or motion["heading_rad"].notna().any():
        return None
    rows = motion[motion["step_m"].notna()]
    time_s, step_m, turn_rad = (
        rows[name].to_numpy(dtype=np.float64) for name in ("time_s", "step_m", "turn_rad")
    )
    along_m = np.cumsum(np.abs(step_m))
    usual = _mean_rates(time_s, along_m, _USUAL_S)
    top_mps = float(np.quantile(usual, _TOP_SHARE)) if usual.size else 0.0
    speed = _mean_rates(time_s, along_m, 1.0)
    span = round(_GAIN_S)
    # Means of a second are those of its middle. Gains are counted apart from each other.
    fast_s = np.flatnonzero(speed[span:] - speed[:-span] >= _GAIN_MPS)
    gains = int(1 + np.sum(np.diff(fast_s) > span)) if fast_s.size else 0
    sway = _sway_radps(time_s, along_m, np.cumsum(np.nan_to_num(turn_rad)))
    return VehicleSigns(top_mps, gains, sway, _sharpest_rad(time_s, step_m, turn_rad))


def _mean_rates(time_s: Floats, total: Floats, span_s: float) -> Floats:
    """Return mean rates of a sum over spans of time, one after the other; of a million at most."""
    if not time_s.size:
        return np.zeros(0)
    at_s = np.arange(time_s[0], min(time_s[-1], time_s[0] + _MOST_SPANS * span_s), span_s)
    return np.asarray(np.diff(np.interp(at_s, time_s, total)) / span_s)


def _sway_radps(time_s: Floats, along_m: Floats, heading_rad: Floats) -> float:
    """Return the usual change of the yaw rate from half a second to the next, NaN if not known."""
    if len(time_s) < 2 or np.median(np.diff(time_s)) > _SWAY_S:
        return float("nan")
    speed = _mean_rates(time_s, along_m, _SWAY_S)
    rate = _mean_rates(time_s, heading_rad, _SWAY_S)
    moving = speed > _SWAY_MPS
    change = np.abs(rate[1:-1] - (rate[:-2] + rate[2:]) / 2)
    change = change[moving[1:-1] & moving[:-2] & moving[2:]]
    return MAD_TO_SD * float(np.median(change)) if change.size else float("nan")


def _sharpest_rad(time_s: Floats, step_m: Floats, turn_rad: Floats) -> float:
    """Return the largest turn, one way, within 5 m; turns of a gyroscope at rest do not count."""
    lasted_s = np.diff(time_s, prepend=time_s[:1])
    moving = np.abs(step_m) > _MOVING_MPS * lasted_s
    heading = np.cumsum(np.where(moving, np.nan_to_num(turn_rad), 0.0))
    along_m = np.cumsum(np.abs(step_m))
    if not along_m.size or along_m[-1] < _SHARP_M:
        return 0.0
    # The end of each interval; a turn in one of more than 5 m is no sharp one.
    begin = np.searchsorted(along_m, along_m - _SHARP_M, side="left")
    turned = np.abs(heading - heading[np.minimum(begin, np.arange(len(heading)))])
    return float(np.max(turned))
