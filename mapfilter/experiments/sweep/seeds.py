"""What is drawn in a run depends on the plan's seed and the run's own coordinates alone.

Names and values are hashed, not places in the grid: another row, another order, another number of
runs change no run that was there before. Filters see the same logs: neither the filter nor the
database enters what a run's unit and phone say.
"""

from __future__ import annotations

import numpy as np

from mapfilter.experiments.sweep.plan import Radio, Run
from mapfilter.radio.shadowing import named_rng


def route_rng(seed: int, route: int) -> np.random.Generator:
    """Return the generator of a route."""
    return named_rng(seed, "route", str(route))


def walker_rng(seed: int, route: int) -> np.random.Generator:
    """Return the generator of how a route is walked."""
    return named_rng(seed, "walker", str(route))


def radio_rng(seed: int, route: int, radio: Radio, report_period_s: float) -> np.random.Generator:
    """Return the generator of what a phone measures along a route: once, as one measures once."""
    return named_rng(seed, "radio", str(route), radio.name, _value(report_period_s))


def imu_rng(seed: int, run: Run) -> np.random.Generator:
    """Return the generator of a run's inertial unit.

    Examples
    --------
    >>> from mapfilter.experiments.sweep.plan import Noise, Reading, Run
    >>> from mapfilter.positioning.locators import FilterChoice
    >>> reading = Reading("as printed", FilterChoice())
    >>> run = Run(Radio(), 1.0, 0, 1.0, Noise(), 0, "database", reading)
    >>> other = Run(Radio(), 1.0, 0, 1.0, Noise(), 0, "another", reading)
    >>> imu_rng(1, run).normal() == imu_rng(1, other).normal()
    True
    """
    noise = run.noise
    values = (
        noise.sigma_trans_m,
        noise.sigma_orient_deg,
        noise.bias_deg,
        noise.drift_deg_per_sqrt_s,
        noise.scale,
        run.imu_period_s,
    )
    return named_rng(seed, "imu", str(run.route), str(run.draw), *map(_value, values))


def filter_rng(seed: int, run: Run) -> np.random.Generator:
    """Return the generator of a run's filter."""
    noise = run.noise
    names = (
        run.radio.name,
        run.database,
        run.reading.name,
        _value(run.reading.update_length_m),
        _value(run.report_period_s),
        _value(run.imu_period_s),
        *map(
            _value,
            (
                noise.sigma_trans_m,
                noise.sigma_orient_deg,
                noise.bias_deg,
                noise.drift_deg_per_sqrt_s,
                noise.scale,
            ),
        ),
    )
    return named_rng(seed, "filter", str(run.route), str(run.draw), *names)


def _value(number: float) -> str:
    # Minus zero is zero, and 3 is 3.0.
    return repr(float(number) + 0.0)
