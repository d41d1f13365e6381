"""Almanacs: read from a file, or those of the nominal constellations.

GPS has 24 slots in six planes (*GPS Standard Positioning Service Performance Standard*, 4th ed.
2008, Tables A.2-1 and A.2-2, for 0 h UTC on 1 July 1993). Galileo has 27 satellites in three planes
as first designed, a Walker constellation 27/3/1 at 56° (*Galileo OS SIS ICD* gives axis and
inclination).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._inputs import read_input
from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import Faults, InputError

WEEK_S = 604_800.0

_LARGEST_BYTES = 1 << 22
_ROLLOVER_WEEKS = 1024
_KEYS = {
    "id": "prn",
    "health": "health",
    "eccentricity": "eccentricity",
    "time of applicability": "toa_s",
    "orbital inclination": "inclination_rad",
    "rate of right ascen": "node_rate_rad_s",
    "sqrt": "sqrt_a",
    "right ascen at": "node_rad",
    "argument of perigee": "perigee_rad",
    "mean anom": "anomaly_rad",
    "af0": "af0",
    "af1": "af1",
    "week": "week",
}
_RANGES = {
    "week": (0.0, 1e5, "a week number"),
    "toa_s": (0.0, WEEK_S, "seconds of the week, 0..604800"),
    "sqrt_a": (2500.0, 7000.0, "m^½ within 2500..7000"),
    "eccentricity": (0.0, 0.9, "a number within 0..0.9"),
    "inclination_rad": (0.0, np.pi, "radians within 0..π"),
    "node_rad": (-7.0, 7.0, "radians"),
    "node_rate_rad_s": (-1e-6, 1e-6, "radians per second"),
    "perigee_rad": (-7.0, 7.0, "radians"),
    "anomaly_rad": (-7.0, 7.0, "radians"),
}
_HINT = "a file cut off, or an almanac of another kind (SEM, RINEX)"
_GPS_AXIS_M = 26_559_700.0
_GPS_TILT_DEG = 55.0
_GALILEO_PER_PLANE, _GALILEO_PLANES = 9, 3
_GALILEO_AXIS_M = 29_600_318.0
_GALILEO_TILT_DEG = 56.0
_GREENWICH_DEG = 279.0553
"""Sidereal angle of Greenwich at the epoch of the slots."""
_NODE_OF_A_DEG = 272.847
_SLOTS_DEG = (
    (268.126, 161.786, 11.676, 41.806),
    (80.956, 173.336, 309.976, 204.376),
    (111.876, 11.796, 339.666, 241.556),
    (135.226, 265.446, 35.156, 167.356),
    (197.046, 302.596, 66.066, 333.686),
    (238.886, 345.226, 105.206, 135.346),
)
"""Arguments of latitude in planes A to F."""


@dataclass(frozen=True, eq=False)
class Almanac:
    """Kepler elements of S satellites, as IS-GPS-200 (20.3.3.5) names them.

    Parameters
    ----------
    names : tuple of str
        Such as ``G07`` or ``E19``, each once.
    week : (S,) array
        Week in which ``toa_s`` lies; counted on, or modulo 1024 as files of GPS may have it.
    toa_s : (S,) array
        Time of applicability, seconds of the week.
    sqrt_a : (S,) array
        Root of the semi-major axis, m^½.
    node_rad : (S,) array
        Longitude of the ascending node at the beginning of the week.
    perigee_rad, anomaly_rad : (S,) arrays
        Argument of the perigee; mean anomaly at ``toa_s``.
    """

    names: tuple[str, ...]
    week: Floats
    toa_s: Floats
    sqrt_a: Floats
    eccentricity: Floats
    inclination_rad: Floats
    node_rad: Floats
    node_rate_rad_s: Floats
    perigee_rad: Floats
    anomaly_rad: Floats
    healthy: Bools

    def __post_init__(self) -> None:
        faults, count = Faults(), len(self.names)
        for name, value in self.columns().items():
            if value.shape != (count,):
                faults.add(f"almanac, {name}", f"shape ({count},)", value.shape)
        faults.raise_if_any(InputError)
        if len(set(self.names)) < count:
            twice = sorted({name for name in self.names if self.names.count(name) > 1})
            faults.add("almanac", "each satellite once", f"{', '.join(twice)} more often")
        for name, (least, most, unit) in _RANGES.items():
            value = getattr(self, name)
            for index in np.flatnonzero(~((value >= least) & (value <= most))):
                faults.add(f"almanac, {self.names[index]}, {name}", unit, value[index])
        faults.raise_if_any(InputError)

    def columns(self) -> dict[str, Any]:
        """Return all arrays by their names."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "names"}

    def usable(self) -> Almanac:
        """Return the healthy satellites."""
        return self.only(np.flatnonzero(self.healthy))

    def only(self, index: Ints) -> Almanac:
        """Return some of the satellites, by their indices."""
        kept = {name: value[index] for name, value in self.columns().items()}
        return replace(self, names=tuple(self.names[i] for i in index), **kept)

    def in_era(self, near_week: int) -> Almanac:
        """Return the almanac with weeks that were counted modulo 1024 counted on.

        Parameters
        ----------
        near_week : int
            A week, counted on from 6 January 1980, within 512 weeks of the almanac's.

        Examples
        --------
        >>> nominal = Almanac(("G01",), *np.array([[190.0], [0.0], [5153.6], [0.0], [0.96], [0.0],
        ...     [0.0], [0.0], [0.0]]), np.array([True]))
        >>> nominal.in_era(2240).week.tolist()
        [2238.0]
        """
        turns = np.round((near_week - self.week) / _ROLLOVER_WEEKS)
        return replace(self, week=self.week + _ROLLOVER_WEEKS * turns)


def joined(first: Almanac, second: Almanac) -> Almanac:
    """Return the satellites of two almanacs together; raise InputError for one in both."""
    other = second.columns()
    both = {name: np.concatenate([value, other[name]]) for name, value in first.columns().items()}
    return replace(first, names=first.names + second.names, **both)


def read_yuma(path: str | Path) -> Almanac:
    """Read an almanac of GPS in the YUMA format.

    Satellites whose health is not 0 are kept and marked; see :meth:`Almanac.usable`. The clock
    terms are not kept: they are known to users of broadcast messages, and cancel in simulations.

    Raises
    ------
    InputError
        With every fault: the file cannot be read, holds no almanac, is cut off, has a satellite
        twice, or values that no satellite has.
    """
    path = Path(path)
    text = read_input(path, _LARGEST_BYTES, "a YUMA almanac").decode("ascii", "replace")
    faults = Faults()
    blocks = _blocks(text, path, faults)
    if not blocks and not faults.found:
        faults.add(str(path), "a YUMA almanac", "no satellite in it", _HINT)
    for line, block in blocks:
        missing = [key for key, name in _KEYS.items() if name not in block]
        if missing:
            where = f"{path}, line {line}"
            faults.add(where, "13 values of a satellite", f"none for {', '.join(missing)}", _HINT)
        elif not (block["prn"].is_integer() and 1 <= block["prn"] <= 63):
            faults.add(f"{path}, line {line}, ID", "a whole number in 1..63", block["prn"])
    faults.raise_if_any(InputError)
    columns = {name: np.array([block[name] for _, block in blocks]) for name in _RANGES}
    names = tuple(f"G{int(block['prn']):02d}" for _, block in blocks)
    healthy = np.array([block["health"] == 0 for _, block in blocks])
    try:
        return Almanac(names, healthy=healthy, **columns)
    except InputError as error:
        for fault in error.faults:
            faults.add(f"{path}: {fault.where}", fault.expected, fault.got, fault.hint)
        raise InputError(tuple(faults.found)) from None


def _blocks(text: str, path: Path, faults: Faults) -> list[tuple[int, dict[str, float]]]:
    """Return the line at which each satellite begins, and its values; each begins with stars."""
    blocks: list[tuple[int, dict[str, float]]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.lstrip().startswith("****"):
            blocks.append((number, {}))
            continue
        label, colon, given = line.partition(":")
        start = label.strip().lower()
        name = next((name for key, name in _KEYS.items() if start.startswith(key)), None)
        if not colon or name is None or not blocks:
            if line.strip():
                where, got = f"{path}, line {number}", repr(line)[:60]
                faults.add(where, "a line of a YUMA almanac", got, _HINT)
            continue
        try:
            # Some writers have Fortran's exponent.
            plain = given.isascii() and "_" not in given
            value = float(given.strip().replace("D", "E") if plain else "?")
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            faults.add(f"{path}, line {number}, {label.strip()}", "a finite number", repr(given))
        elif name in blocks[-1][1]:
            faults.add(f"{path}, line {number}, {label.strip()}", "one line of it", "a second one")
        else:
            blocks[-1][1][name] = value
            continue
        blocks[-1][1].setdefault(name, np.nan)
    return blocks


def nominal_gps(week: int = 0) -> Almanac:
    """Return the 24 slots of GPS, G01 to G24, plane by plane; their epoch is second 0 of a week.

    Examples
    --------
    >>> len(nominal_gps().names)
    24
    """
    latitude = np.array(_SLOTS_DEG)
    node = np.repeat(_NODE_OF_A_DEG - _GREENWICH_DEG + 60.0 * np.arange(6), 4)
    return _circular("G", _GPS_AXIS_M, _GPS_TILT_DEG, node, latitude.ravel(), week)


def nominal_galileo(week: int = 0) -> Almanac:
    """Return 27 satellites of Galileo, E01 to E27, plane by plane; epoch as for GPS.

    Examples
    --------
    >>> len(nominal_galileo().names)
    27
    """
    plane = np.repeat(np.arange(_GALILEO_PLANES), _GALILEO_PER_PLANE)
    slot = np.tile(np.arange(_GALILEO_PER_PLANE), _GALILEO_PLANES)
    phase = 360.0 / (_GALILEO_PER_PLANE * _GALILEO_PLANES)
    latitude = 360.0 / _GALILEO_PER_PLANE * slot + phase * plane
    node = 360.0 / _GALILEO_PLANES * plane
    return _circular("E", _GALILEO_AXIS_M, _GALILEO_TILT_DEG, node, latitude, week)


def _circular(
    system: str,
    axis_m: float,
    tilt_deg: float,
    node_deg: np.ndarray,
    latitude_deg: np.ndarray,
    week: int,
) -> Almanac:
    count = latitude_deg.size
    zero = np.zeros(count)
    return Almanac(
        names=tuple(f"{system}{index:02d}" for index in range(1, count + 1)),
        week=zero + week,
        toa_s=zero,
        sqrt_a=np.full(count, np.sqrt(axis_m)),
        eccentricity=zero,
        inclination_rad=np.full(count, np.radians(tilt_deg)),
        node_rad=np.radians(np.mod(node_deg + 180.0, 360.0) - 180.0),
        node_rate_rad_s=zero,
        perigee_rad=zero,
        anomaly_rad=np.radians(latitude_deg),
        healthy=np.ones(count, dtype=np.bool_),
    )
