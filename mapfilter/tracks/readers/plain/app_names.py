"""Names of columns that mean something in the tables of one app only."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from mapfilter.tracks.readers.texts.columns import Columns

_FORCES = ("gfx", "gfy", "gfz")
_PHYSICS_TOOLBOX = {
    **{name: f"acc_{name[-1]} [g]" for name in _FORCES},
    **{f"b{axis}": f"mag_{axis} [ut]" for axis in "xyz"},
    "p": "pressure [hpa]",
}
"""Forces in g, the magnetic field in µT, the pressure in hPa."""


def full_names(names: Sequence[str], own: Collection[str] = ()) -> tuple[str, ...]:
    """Return names of columns with those of an app in words; those of ``own`` stay.

    Examples
    --------
    >>> full_names(["time", "gfx", "gfy", "gfz", "p"])
    ('time', 'acc_x [g]', 'acc_y [g]', 'acc_z [g]', 'pressure [hpa]')
    >>> full_names(["time", "p"])
    ('time', 'p')
    """
    if not set(_FORCES) <= set(names):
        return tuple(names)
    return tuple(name if name in own else _PHYSICS_TOOLBOX.get(name, name) for name in names)


def with_full_names(rows: Columns, own: Collection[str]) -> Columns:
    """Return columns of which the names of an app are in words, with a note."""
    names = full_names(rows.names, own)
    if names == rows.names:
        return rows
    rows.reading.note("gfx, gfy, gfz: taken for forces in g, as of Physics Toolbox")
    return replace(rows, names=names)
