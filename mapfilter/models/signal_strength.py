"""Received levels: power, path loss over the logarithm of the distance, antenna pattern.

``y = P_t - (A + 10 B log10(d / km) - g(φ)) + v`` (Fritsche & Klein 2009, eqs. 1 to 3), with v the
slow fading in dB. Zhang et al. (2006, eq. 4) measure the loss itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError
from mapfilter.models.gaussian import GaussianTerms, deviations, independent, places, terms
from mapfilter.models.state import StateLayout
from mapfilter.models.terms import ERROR_SLOTS, LEVEL
from mapfilter.radio.antenna import MeasuredAntenna, leaning

SHORTEST_DISTANCE_M = 1.0
"""Nearer, a level is as at this distance, and its slope is 0."""


def levels(
    layout: StateLayout,
    sites_m: ArrayLike,
    sigma_db: ArrayLike,
    *,
    loss_at_km_db: ArrayLike,
    exponent: ArrayLike,
    eirp_dbm: ArrayLike = 0.0,
    boresight_rad: ArrayLike | None = None,
    beamwidth_rad: float = np.pi / 3,
    max_attenuation_db: float = 20.0,
    pattern_db: Floats | None = None,
    quantity: Literal["level", "loss"] = "level",
    shortest_distance_m: float = SHORTEST_DISTANCE_M,
) -> GaussianTerms:
    """Return the model of levels (dBm) or losses (dB), one of each site.

    Parameters
    ----------
    sites_m : (m, 2) or (m, 3) array_like
        Positions of the antennas; without heights distances are horizontal.
    sigma_db : float or (m,) array_like
        Standard deviation of the slow fading.
    loss_at_km_db, exponent : float or (m,) array_like
        A and B of eq. (1): the loss at 1 km, and a tenth of its dB per decade.
    eirp_dbm : float or (m,) array_like
        P_t.
    boresight_rad : float, (m,) array_like or None
        Directions of the antennas, counter-clockwise from east; None for omnidirectional
        antennas.
    beamwidth_rad, max_attenuation_db : float
        φ3dB and A_m of eq. (2), see :func:`mapfilter.radio.antenna.sector_gain_db`.
    pattern_db : (k,) array, optional
        Gains of a measured antenna at k angles, equally spaced counter-clockwise from boresight,
        see :func:`sampled_pattern`; it replaces the formula and is interpolated linearly.
    quantity : {"level", "loss"}
        What is measured.
    shortest_distance_m : float
        Nearer, a level is as at this distance.

    Raises
    ------
    InputError
        With every fault: deviations that are not positive, values that are not finite, sizes that
        do not fit.

    Examples
    --------
    >>> from mapfilter.models.state import POSITION
    >>> model = levels(POSITION, [[0.0, 0.0]], 8.0, loss_at_km_db=132.8, exponent=3.8, eirp_dbm=50)
    >>> model.mean([[1000.0, 0.0], [0.0, 100.0]]).round(9).ravel().tolist()
    [-82.8, -44.8]
    """
    faults = Faults()
    sites = places("sites_m", sites_m, faults)
    size = len(sites)
    sigma = deviations("sigma_db", sigma_db, size, faults)
    given = {"loss_at_km_db": loss_at_km_db, "exponent": exponent, "eirp_dbm": eirp_dbm}
    given["boresight_rad"] = 0.0 if boresight_rad is None else boresight_rad
    value = {name: _numbers(name, found, size, faults) for name, found in given.items()}
    for name, at_least in (("beamwidth_rad", beamwidth_rad), ("shortest", shortest_distance_m)):
        if not (np.isfinite(at_least) and at_least > 0):
            faults.add(name, "a number above 0", at_least)
    if not max_attenuation_db >= 0:
        faults.add("max_attenuation_db", "dB >= 0", max_attenuation_db)
    samples = np.zeros(0) if pattern_db is None else np.asarray(pattern_db, dtype=np.float64)
    if samples.ndim != 1 or samples.size == 1 or not np.isfinite(samples).all():
        faults.add("pattern_db", "two or more finite gains", f"shape {samples.shape}")
    faults.raise_if_any(InputError)
    sign = 1.0 if quantity == "level" else -1.0
    columns = np.zeros((size, 9))
    columns[:, 0] = sign * (value["eirp_dbm"] - value["loss_at_km_db"])
    columns[:, 1] = -sign * 10.0 * value["exponent"]
    columns[:, 2] = 0.0 if boresight_rad is None else sign
    columns[:, 3] = value["boresight_rad"]
    columns[:, 4:6] = beamwidth_rad, max_attenuation_db
    columns[:, 7] = samples.size
    columns[:, 8] = shortest_distance_m
    rows = terms(layout, LEVEL, sites, columns)
    patterns = samples if samples.size else None
    return independent(faults, layout, rows, sigma, quantity, patterns=patterns)


def with_errors(model: GaussianTerms, components: Sequence[tuple[int, int]]) -> GaussianTerms:
    """Return a model whose levels contain errors that are components of the state.

    Parameters
    ----------
    model : GaussianTerms
        Levels first.
    components : sequence of pairs of int
        Two components for each level, in dB; -1 for none.

    Raises
    ------
    InputError
        There are more pairs than levels, or components that the state lacks or that are its
        position or clock.

    Examples
    --------
    >>> from mapfilter.models.state import StateLayout
    >>> plane = StateLayout(3, 0, 1)
    >>> model = levels(plane, [[0.0, 0.0]], 8.0, loss_at_km_db=132.8, exponent=3.8, eirp_dbm=50)
    >>> with_errors(model, [(2, -1)]).mean([1000.0, 0.0, 5.0]).round(9).tolist()
    [-77.8]
    """
    used = tuple(sorted({one for pair in components for one in pair if one >= 0}))
    faults, layout, count = Faults(), model.layout, len(components)
    if (model.rows[:count, 0] != LEVEL).any() or count > model.size:
        levels_first = int((model.rows[:, 0] == LEVEL).cumprod().sum())
        faults.add("components", f"at most a pair for each of {levels_first} levels", count)
    wrong = [one for one in used if one >= layout.size or one in layout.uses]
    if wrong:
        expected = f"components below {layout.size} that are no position or clock"
        faults.add("components", expected, wrong)
    faults.raise_if_any(InputError)
    first = len(layout.uses) + 1
    slot = {one: first + at for at, one in enumerate(used)}
    rows = model.rows.copy()
    for row, pair in zip(rows, components, strict=False):
        row[ERROR_SLOTS] = [slot.get(one, 0) for one in pair]
    return replace(model, rows=rows, errors=used)


def sampled_pattern(
    antenna: MeasuredAntenna,
    depression_rad: float = 0.0,
    downtilt_deg: float | None = None,
    samples: int = 360,
    mechanical_downtilt_rad: float = 0.0,
) -> Floats:
    """Return a measured antenna's gains around it, for ``pattern_db`` of :func:`levels`.

    Parameters
    ----------
    antenna : MeasuredAntenna
        With its horizontal and vertical cuts.
    depression_rad : float
        Angle below the horizon at which receivers are.
    downtilt_deg : float or None
        Electrical downtilt.
    samples : int
        Number of angles; with 360, cuts given by the degree are not interpolated.
    mechanical_downtilt_rad : float
        How far the whole antenna leans forward.

    Returns
    -------
    (samples,) array
        dB relative to the strongest direction, counter-clockwise from boresight.
    """
    offsets = np.arange(samples) * (2 * np.pi / samples)
    own = leaning(offsets, np.full(samples, depression_rad), mechanical_downtilt_rad)
    return antenna.gain_db(*own, downtilt_deg)


def _numbers(name: str, given: ArrayLike, size: int, faults: Faults) -> Floats:
    found = np.asarray(given, dtype=np.float64)
    if found.shape not in ((), (size,)) or not np.isfinite(found).all():
        faults.add(name, f"one finite number or {size}", repr(given)[:60])
        return np.zeros(size)
    return np.broadcast_to(found, (size,))
