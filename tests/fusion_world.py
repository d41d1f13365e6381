"""The reference cases, and the hybrid problem that they are about."""

import json
from pathlib import Path

import numpy as np

from mapfilter.models.gaussian import stack
from mapfilter.models.motion import constant_velocity
from mapfilter.models.ranging import position_fix, pseudoranges, timing_advances
from mapfilter.models.signal_strength import levels
from mapfilter.models.state import MOVING, MOVING_CLOCK, StateLayout

# East, north, up and the clock's bias, each followed by its rate.
MOVING_3D, MOVING_CLOCK_3D = StateLayout(6, 0, 2, 4), StateLayout(8, 0, 2, 4, 6)
CASES = json.loads((Path(__file__).parent / "fusion_cases.json").read_text(encoding="utf-8"))
LAYOUT = CASES["fk_layout"]
PHI = np.array(CASES["fk_process"]["Phi"])
Q = np.array(CASES["fk_process"]["GQGt_filter"])


def log_likelihood(model, state, reading):
    """Log density of a reading in states; NaN components are absent."""
    present = np.isfinite(reading)
    off = (reading - model.mean(state))[..., present]
    noise = 2 * np.pi * model.covariance()[np.ix_(present, present)]
    square = np.einsum("...i,ij,...j->...", off, 2 * np.pi * np.linalg.inv(noise), off)
    return -0.5 * (square + np.linalg.slogdet(noise)[1])


def information(model, state):
    """Fisher information of a reading in states."""
    slope = model.jacobian(state)
    return np.swapaxes(slope, -1, -2) @ np.linalg.solve(model.covariance(), slope)


def hybrid(satellites):
    """Pseudoranges, timing advance and levels of Fritsche & Klein (2009)."""
    state = MOVING_CLOCK if satellites else MOVING
    parts = [
        timing_advances(state, LAYOUT["bs"][:1], LAYOUT["s_ta"]),
        levels(
            state, LAYOUT["bs"], LAYOUT["s_rss"], loss_at_km_db=LAYOUT["A"], exponent=LAYOUT["B"],
            eirp_dbm=LAYOUT["Pt"], boresight_rad=np.radians(LAYOUT["boresight_deg_ccw_from_east"]),
            beamwidth_rad=np.radians(LAYOUT["phi3"]), max_attenuation_db=LAYOUT["Am"],
        ),
    ]  # fmt: skip
    if satellites:
        parts.insert(0, pseudoranges(state, LAYOUT["sats"][:satellites], LAYOUT["s_pr"]))
    return stack(parts)


def zhang(combination, sigma_db=4.0):
    """Timing advances and losses of Zhang et al. (2006)."""
    sites, parts = CASES["zhang"]["bts"], []
    if combination in ("both", "ta"):
        parts.append(timing_advances(MOVING, sites, 288.0))
    if combination in ("both", "rss"):
        parts.append(
            levels(MOVING, sites, sigma_db, loss_at_km_db=132.85, exponent=3.8, quantity="loss")
        )
    return stack(parts)


def linear_problem(trials=5, steps=40):
    """Fixes with correlated noise, some absent."""
    motion = constant_velocity(1.0, 0.3)
    model = position_fix(MOVING, [[9.0, 3.0], [3.0, 16.0]])
    rng = np.random.default_rng(7)
    states = np.empty((trials, steps, 4))
    now = np.zeros((trials, 4))
    for k in range(steps):
        now = motion.sample(now, rng)
        states[:, k] = now
    readings = model.sample(states, rng)
    readings[rng.random(readings.shape) < 0.2] = np.nan
    return motion, model, readings


def hybrid_readings(steps, trials=1):
    model = hybrid(2)
    states = np.zeros((trials, steps, 6))
    states[:, :, [0, 2]] = (-200 + 8.84 * 0.48 * np.arange(1, steps + 1))[:, None]
    states[:, :, [1, 3]] = 8.84
    return model, states, model.sample(states, np.random.default_rng(11))


FIRST = np.array([-120.0, 3.0, -260.0, 14.0, 90.0, 4.0])
FIRST_COVARIANCE = np.diag([200.0, 10.0, 200.0, 10.0, 300 / 3**0.5, 10 / 3**0.5]) ** 2
