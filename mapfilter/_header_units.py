"""Units in the names of columns, such as ``Speed [km/h]``, and the factors to those of fields."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

from mapfilter._constants import FOOT_M, GRAVITY_MPS2, KMH_MPS, KNOT_MPS, MPH_MPS

_DEGREE = pi / 180

UNITS: Mapping[str, Mapping[str, float]] = {
    "speed": {
        "m/s": 1.0,
        "km/h": KMH_MPS,
        "mph": MPH_MPS,
        "knots": KNOT_MPS,
        "ft/s": FOOT_M,
        "cm/s": 0.01,
        "mm/s": 0.001,
    },
    "rate of turning": {
        "rad/s": 1.0,
        "deg/s": _DEGREE,
        "mrad/s": 0.001,
        "mdeg/s": 0.001 * _DEGREE,
        "deg/h": _DEGREE / 3600,
        "rpm": 2 * pi / 60,
    },
    "angle": {
        "rad": 1.0,
        "deg": _DEGREE,
        "mrad": 0.001,
        "gon": pi / 200,
        "dege7": 1e-7 * _DEGREE,
        "semicircles": pi / 2**31,
    },
    "length": {
        "m": 1.0,
        "km": 1000.0,
        "cm": 0.01,
        "mm": 0.001,
        "ft": FOOT_M,
        "in": 0.0254,
        "mi": 1609.344,
    },
    "level": {"dbm": 1.0},
    "pressure": {
        "hpa": 1.0,
        "mbar": 1.0,
        "pa": 0.01,
        "kpa": 10.0,
        "bar": 1000.0,
        "mmhg": 1.333224,
        "inhg": 33.86389,
    },
    "acceleration": {
        "m/s2": 1.0,
        "g": GRAVITY_MPS2,
        "mg": 0.001 * GRAVITY_MPS2,
        "cm/s2": 0.01,
        "mm/s2": 0.001,
    },
    "magnetic field": {"ut": 1.0, "nt": 0.001, "mt": 1000.0, "gauss": 100.0, "mgauss": 0.1},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
}
"""Units by quantity, as multiples of the first of each."""

_OTHER_NAMES = {
    **dict.fromkeys(("mps", "m_s", "ms-1"), "m/s"),
    **dict.fromkeys(("kmh", "kph", "kmph", "km_h", "kmh-1"), "km/h"),
    **dict.fromkeys(("mi/h", "milesperhour"), "mph"),
    **dict.fromkeys(("kn", "kt", "kts", "knot"), "knots"),
    **dict.fromkeys(("nudos", "noeuds", "nœuds", "knoten", "节", "ノット"), "knots"),
    **dict.fromkeys(("grados", "degrés", "度"), "deg"),
    **dict.fromkeys(("米", "メートル"), "m"),
    **dict.fromkeys(("fps",), "ft/s"),
    **dict.fromkeys(("radps", "rads-1", "rad_s"), "rad/s"),
    **dict.fromkeys(("degps", "dps", "degs-1", "deg_s"), "deg/s"),
    **dict.fromkeys(("degh-1",), "deg/h"),
    **dict.fromkeys(("mdps",), "mdeg/s"),
    **dict.fromkeys(("rev/min", "1/min"), "rpm"),
    **dict.fromkeys(("m/s/s", "ms-2", "mps2"), "m/s2"),
    **dict.fromkeys(("microtesla",), "ut"),
    **dict.fromkeys(("1e-7deg", "e7deg"), "dege7"),
    **dict.fromkeys(("semicircle",), "semicircles"),
}
_WORDS = {
    **dict.fromkeys(("radian", "radians"), "rad"),
    # In German a "Grad" is a degree; gradians are found as "gon", too.
    **dict.fromkeys(("degree", "degrees", "grad"), "deg"),
    **dict.fromkeys(("metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("kilometre", "kilometres", "kilometer", "kilometers"), "km"),
    **dict.fromkeys(("feet", "foot"), "ft"),
    **dict.fromkeys(("mile", "miles"), "mi"),
    **dict.fromkeys(("sec", "second", "seconds"), "s"),
    **dict.fromkeys(("sec2",), "s2"),
    **dict.fromkeys(("hr", "hour", "hours"), "h"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("usec", "microsecond", "microseconds"), "us"),
}
"""Words for units and their parts."""
_SUFFIXES = {
    "_radps": ("rate of turning", "rad/s"),
    "_degps": ("rate of turning", "deg/s"),
    "_mps": ("speed", "m/s"),
    "_kmh": ("speed", "km/h"),
    "_rad": ("angle", "rad"),
    "_deg": ("angle", "deg"),
    "_km": ("length", "km"),
    "_m": ("length", "m"),
    "_dbm": ("level", "dbm"),
    "_hpa": ("pressure", "hpa"),
}
_BEGINNINGS = {
    "acc_": ("acceleration", "m/s2"),
    "gyr_": ("rate of turning", "rad/s"),
    "mag_": ("magnetic field", "ut"),
    "time": ("time", "s"),
}
_BRACKETS = re.compile(r"\[([^\[\]]*)\]\s*$|[(（]([^()（）]*)[)）]\s*$")
_ENDINGS = re.compile(
    r"[_ ](km[_/]?h|kph|mph|mps|m[_/]s|knots|kn|radps|degps|dps|rad[_/]s|deg[_/]s|rad|deg|"
    r"km|cm|mm|m|ft|ms|us|ns|s|dbm|hpa)$"
)
_NO_UNIT = ("", "-", "1", "#")


@dataclass(frozen=True, slots=True)
class HeaderUnit:
    """The unit that a column's name states for a field.

    Parameters
    ----------
    unit : str
        As in :data:`UNITS`; "" where it is none of the field's quantity.
    factor : float
        From its values to the field's.
    written : str
        As the column's name has it.
    quantity : str
        That of the field.
    """

    unit: str
    factor: float
    written: str
    quantity: str

    @property
    def known(self) -> str:
        """The units of the field's quantity, in words."""
        return f"a unit of {self.quantity} ({', '.join(UNITS[self.quantity])})"


def header_unit(field: str, column: str) -> HeaderUnit | None:
    """Return the unit that a column's name states for a field; None where it states none.

    A unit stands at the end, in brackets, or after an underscore or a blank. What stands in round
    brackets and is no unit may be a remark.

    Examples
    --------
    >>> header_unit("wheel_speed_mps", "Speed [km/h]")
    HeaderUnit(unit='km/h', factor=0.2777777777777778, written='km/h', quantity='speed')
    >>> header_unit("level_dbm", "RSRQ [dB]").unit
    ''
    >>> header_unit("level_dbm", "RSRP (serving)"), header_unit("ci", "Cell [eci]")
    (None, None)
    """
    of = _unit_of_field(field)
    if of is None:
        return None
    quantity, own = of
    found = _BRACKETS.search(column)
    if found is None:
        ending = _ENDINGS.search(column.lower().rstrip())
        name = _normal(ending[1]) if ending is not None else ""
        if ending is None or name not in UNITS[quantity]:
            return None
        return HeaderUnit(name, UNITS[quantity][name] / UNITS[quantity][own], ending[1], quantity)
    square, round_ = found[1], found[2]
    written = (square if square is not None else round_).strip()
    name = _normal(written)
    if name in UNITS[quantity]:
        return HeaderUnit(name, UNITS[quantity][name] / UNITS[quantity][own], written, quantity)
    is_unit = any(name in units for units in UNITS.values()) or "/" in written or "db" in name
    # A zone stands there, too.
    if quantity == "time" or name in _NO_UNIT or not (square is not None or is_unit):
        return None
    return HeaderUnit("", float("nan"), written, quantity)


def parted_unit(column: str) -> tuple[str, str]:
    """Return a column's name without the unit at its end, and that unit as in :data:`UNITS`.

    Both are in small letters; the unit is "" where the name states none that is known.

    Examples
    --------
    >>> parted_unit("Speed (OBD)(km/h)"), parted_unit("yaw_rate_deg_s"), parted_unit("velocity")
    (('speed (obd)', 'km/h'), ('yaw_rate', 'deg/s'), ('velocity', ''))
    """
    text = column.lower().rstrip()
    bracket = _BRACKETS.search(text)
    ending = bracket or _ENDINGS.search(text)
    if ending is None:
        return text, ""
    written = next(part for part in ending.groups() if part is not None)
    name = _normal(written)
    if not any(name in units for units in UNITS.values()):
        return text, ""
    return text[: ending.start()].rstrip(" _"), name


def quantity_of(field: str) -> str:
    """Return the quantity of a field with a unit, as in :data:`UNITS`; "" of others."""
    of = _unit_of_field(field)
    return "" if of is None else of[0]


def _unit_of_field(field: str) -> tuple[str, str] | None:
    for end, unit in _SUFFIXES.items():
        if field.endswith(end):
            return unit
    return next((unit for begin, unit in _BEGINNINGS.items() if field.startswith(begin)), None)


def _normal(text: str) -> str:
    """Return a unit in small letters, by its usual name."""
    plain = text.strip().lower().replace("°", "deg").replace("µ", "u").replace("μ", "u")
    plain = plain.replace("²", "2").replace("⁻¹", "-1").replace("⁻²", "-2").replace("⁻2", "-2")
    plain = re.sub(r"[\s^*·.]", "", plain.replace(" per ", "/"))
    plain = "/".join(_WORDS.get(part, part) for part in plain.split("/"))
    return _OTHER_NAMES.get(plain, plain)
