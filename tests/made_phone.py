"""Simulated sensors of a phone on a walker, from known steps and headings.

Nothing here is from the package: rotations are matrices, steps are harmonics of a phase.
"""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

GRAVITY = 9.80665
NORTH_UT, DOWN_UT = 30.0, 40.0
FLAT = np.eye(3)
"""A phone that lies flat, its top edge forward: its axes are the body's right, forward and up."""


@dataclass(frozen=True)
class Leg:
    """Some steps in one direction, or a pause (no steps); the turn comes before it."""

    steps: int
    heading_rad: float
    pause_s: float = 2.0


@dataclass(frozen=True, eq=False)
class Phone:
    """How the phone is held and what its sensors do wrong."""

    pose: np.ndarray = field(default_factory=lambda: FLAT)
    rate_hz: float = 100.0
    cadence_hz: float = 1.8
    rise_mps2: float = 3.0
    push_mps2: float = 1.2
    lead_rad: float = np.pi / 4
    sway_rad: float = 0.04
    bias_radps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    force_noise_mps2: float = 0.05
    rate_noise_radps: float = 0.003
    field_noise_ut: float = 0.4
    seed: int = 1


def turn_matrix(angle_rad):
    """Return (N, 3, 3) rotations about the vertical, counter-clockwise."""
    c, s, o = np.cos(angle_rad), np.sin(angle_rad), np.zeros_like(angle_rad)
    rows = [[c, -s, o], [s, c, o], [o, o, o + 1]]
    return np.moveaxis(np.array(rows), 2, 0)


def walk_sensors(legs, phone=None, start_s=1000.0):
    """Return sensor tables of a walk, and the true times and headings of its steps.

    Each leg begins with a turn of 1 s and then, after a pause, has its steps. In a
    step the phase grows by 2π; the body is pushed forward ahead of its rise, by ``lead_rad``.
    """
    phone = phone or Phone()
    rng = np.random.default_rng(phone.seed)
    dt = 1 / phone.rate_hz
    heading, phase, walking, step_at, step_heading = [], [], [], [], []
    now = legs[0].heading_rad
    for leg in legs:
        turned = np.arctan2(np.sin(leg.heading_rad - now), np.cos(leg.heading_rad - now))
        n = int(phone.rate_hz)
        smooth = (1 - np.cos(np.pi * np.arange(n) / n)) / 2
        heading += list(now + turned * smooth)
        now = now + turned
        still = n + int(leg.pause_s * phone.rate_hz)
        heading += [now] * (still - n)
        phase += [0.0] * still
        walking += [False] * still
        lasting = round(leg.steps / phone.cadence_hz * phone.rate_hz)
        for k in range(leg.steps):
            step_at.append(start_s + (len(heading) + (k + 0.5) / leg.steps * lasting) * dt)
            step_heading.append(now)
        phase += list(2 * np.pi * leg.steps * np.arange(lasting) / max(lasting, 1) - np.pi)
        heading += [now] * lasting
        walking += [True] * lasting
    heading, phase, walking = (np.array(part) for part in (heading, phase, walking))
    time = start_s + dt * np.arange(len(heading))
    sway = np.where(walking, phone.sway_rad * np.sin(phase / 2), 0.0)
    up = np.where(walking, phone.rise_mps2 * (np.cos(phase) + 0.3 * np.cos(2 * phase)), 0.0)
    ahead = np.where(walking, phone.push_mps2 * np.cos(phase + phone.lead_rad), 0.0)
    yaw = heading + sway
    # The body's axes: right, forward, up; forward is the heading.
    body = turn_matrix(yaw - np.pi / 2)
    force = np.stack([0 * up, ahead, up + GRAVITY], axis=1)
    rate = np.stack([0 * up, 0 * up, np.gradient(yaw, dt)], axis=1)
    north = np.array([0.0, NORTH_UT, -DOWN_UT])
    magnetic = np.einsum("nji,j->ni", body, north)
    tables = {}
    names = {
        "accelerometer": (force, "mps2", phone.force_noise_mps2, 0.0),
        "gyroscope": (rate, "radps", phone.rate_noise_radps, np.array(phone.bias_radps)),
        "magnetometer": (magnetic, "ut", phone.field_noise_ut, 0.0),
    }
    for name, (values, unit, noise, bias) in names.items():
        seen = values @ phone.pose + bias + noise * rng.standard_normal(values.shape)
        columns = {f"{axis}_{unit}": seen[:, i] for i, axis in enumerate("xyz")}
        tables[name] = pd.DataFrame({"time_s": time, **columns})
    return tables, np.array(step_at), np.array(step_heading)
