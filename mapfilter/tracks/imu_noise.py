"""The errors of dead reckoning: white and lasting, of steps, headings and turns."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from typing import Any, Literal

from mapfilter.errors import ConfigError, Faults, InputError
from mapfilter.options import Below1, Degrees, NotNegative, Options, Positive
from mapfilter.tracks.deadreckoning import TranslationNoise


@dataclass(frozen=True, slots=True)
class ImuNoise(Options):
    """Errors of dead reckoning: of a simulated unit, or as measured on a recording.

    These errors are what the unit *has*: ``[imu]`` of a configuration simulates them, and a log
    made of raw sensors carries them as its ``imu``. What a filter *assumes* of its unit are options
    of the filter, such as ``[filter.bayes]``. The two white errors are Khalaf-Allah 2007, equations
    (5)-(8); the others are zero in that paper.

    Parameters
    ----------
    period_s : float
        Length of an interval of dead reckoning; white noise is drawn once for each.
    sigma_trans_m : float
        Standard deviation of a step.
    sigma_orient_deg : float
        Standard deviation of a heading.
    bias_sd_deg : float
        Standard deviation of the journey's constant heading error.
    drift_deg_per_sqrt_s : float
        Random walk of the heading error: its standard deviation after t seconds is this times √t.
    scale : float
        The journey's steps are all multiplied by exp(N(0, this)).
    translation_noise : {"zero_mean", "as_printed"}
        See :func:`mapfilter.tracks.deadreckoning.noisy_steps`.
    heading_correlation_s : float
        Time over which heading errors are correlated by 1/e; 0 for white ones.
    step_scale_wander : float
        The step scale also wanders within the journey: standard deviation of its logarithm.
    step_scale_correlation_s : float
        Time over which the wandering step scale is correlated by 1/e.
    turns : {"headings", "gyro"}
        With "headings", a turn is the difference of two reported headings, so that errors cancel
        when turns are added up. A gyro's errors accumulate.
    gyro_noise_deg_per_sqrt_s : float
        Angle random walk of the gyro.
    gyro_bias_deg_per_s : float
        Standard deviation of the gyro's constant rate error in a journey.

    Raises
    ------
    ConfigError
        With every value that is out of range.
    """

    period_s: Positive = 1.0
    sigma_trans_m: NotNegative = 0.2
    sigma_orient_deg: Degrees = 3.0
    bias_sd_deg: Degrees = 0.0
    drift_deg_per_sqrt_s: NotNegative = 0.0
    scale: Below1 = 0.0
    translation_noise: TranslationNoise = "zero_mean"
    heading_correlation_s: NotNegative = 0.0
    step_scale_wander: Below1 = 0.0
    step_scale_correlation_s: NotNegative = 15.0
    turns: Literal["headings", "gyro"] = "headings"
    gyro_noise_deg_per_sqrt_s: NotNegative = 0.0
    gyro_bias_deg_per_s: NotNegative = 0.0


def parse_imu_noise(given: Any, where: str) -> ImuNoise | None:
    """Return the errors that the head of a log states; None where it states none.

    Raises
    ------
    InputError
        A value is out of range, or a name unknown; ``where`` is the place in messages.
    """
    if given is None:
        return None
    faults = Faults()
    known = [field.name for field in fields(ImuNoise)]
    if not isinstance(given, dict):
        faults.add(where, "errors of dead reckoning by their names", repr(given)[:100])
        faults.raise_if_any(InputError)
    for name in given:
        if name not in known:
            near = get_close_matches(str(name), known, 1)
            faults.add(f"{where}.{name}", f"one of {', '.join(known)}", "an unknown key", *near)
    faults.raise_if_any(InputError)
    try:
        return ImuNoise(**given)
    except ConfigError as error:
        named = (
            replace(fault, where=f"{where}.{fault.where.removeprefix('ImuNoise, ')}")
            for fault in error.faults
        )
        raise InputError(tuple(named)) from error
