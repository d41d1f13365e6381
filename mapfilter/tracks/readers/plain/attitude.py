"""Attitudes in a plain CSV: unit quaternions, or rotation vectors as Android writes them."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.plain.mapped import Mapped, add_rows
from mapfilter.tracks.readers.recorded.reading import Reading

_AXES = ("qx", "qy", "qz")
_UNIT, _MOSTLY = (0.95, 1.05), 0.5


def add_attitude(mapped: Mapped, reading: Reading, time_s: Floats) -> None:
    """Add the rotation from the device to east, north and up; its scalar part may be left out.

    Raises
    ------
    InputError
        Most of the quaternions are none of length 1.
    """
    x, y, z = (mapped.number(axis) for axis in _AXES)
    if mapped.holds("qw"):
        w = mapped.number("qw")
    else:
        reading.note("qx, qy, qz without qw: the scalar part of a rotation vector, not negative")
        w = np.sqrt(np.maximum(1.0 - x**2 - y**2 - z**2, 0.0))
    size = np.sqrt(x**2 + y**2 + z**2 + w**2)
    there = np.isfinite(size)
    unit = there & (size >= _UNIT[0]) & (size <= _UNIT[1])
    # All are 0 where a phone has none.
    given = there & (size > 0)
    if given.any() and unit.sum() < _MOSTLY * given.sum():
        first = np.flatnonzero(given & ~unit)[0]
        where = f"{reading.path} row {mapped.rows.line[first]}, qx, qy, qz, qw"
        hint = "angles for a quaternion; or exchanged columns"
        raise fail(InputError, where, "a quaternion of length 1", f"{size[first]:.4g}", hint)
    reading.refuse(mapped.rows.line[there & ~unit], "qx, qy, qz, qw: no quaternion of length 1")
    with np.errstate(invalid="ignore", divide="ignore"):
        parts = {f"q{axis}": part / size for axis, part in zip("xyzw", (x, y, z, w), strict=True)}
    add_rows(reading, "orientation", {"time_s": time_s, **parts}, mapped.rows, unit)
