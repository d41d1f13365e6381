"""The fields of a cell by a row of a list, and what was filled in or left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from mapfilter._words import number_of
from mapfilter.radio.cell_layouts import HELPERS, IMPLIED, Layout
from mapfilter.radio.cell_rules import TECHNOLOGIES, technology_faults
from mapfilter.radio.headings import Heading
from mapfilter.radio.identities import IDENTITY, parse_cgi, parted_network, technology
from mapfilter.radio.reported_power import ASSUMABLE, REPORTED_SHARE_DB, reported_eirp_dbm
from mapfilter.radio.tables import Table
from mapfilter.radio.transmitter_lists import is_inactive, stated_otherwise

MADE_OF = (("frequency_mhz", "band"), ("ci", "cell_number", "enodeb"))
"""Fields, and columns of planning tools that they are made of."""


@dataclass(slots=True)
class RowTally:
    """Counts cells whose values are not those of the list itself.

    Parameters
    ----------
    filled, made : Counter of str
        Usual values, and values made of other columns, by field.
    lowered : Counter of str
        Usual EIRPs that are lowered to what phones report, by technology.
    beyond : list of str
        Technologies whose limits an identity exceeds, in words.
    inactive : list of str
        Cells of rows left out, as they are switched off.
    """

    filled: Counter[str] = field(default_factory=Counter)
    made: Counter[str] = field(default_factory=Counter)
    lowered: Counter[str] = field(default_factory=Counter)
    beyond: list[str] = field(default_factory=list)
    inactive: list[str] = field(default_factory=list)

    def notes_of_values(
        self,
        header: Sequence[str],
        picked: Mapping[str, tuple[int, ...]],
        defaults: Mapping[str, float],
        cells: int,
    ) -> list[str]:
        """Return notes on values that were filled in, and on columns that decide of cells."""
        notes = [
            f"{name} = {defaults[name]:g} for {count} of {cells} cells without one"
            for name, count in sorted(self.filled.items())
        ]
        if self.filled["frequency_mhz"] and "arfcn" in picked:
            carrier = header[picked["arfcn"][0]]
            notes.append(f"frequency_mhz is not taken from {carrier!r}; set cells.frequency_mhz")
        if self.made["frequency_mhz"]:
            some = number_of(self.made["frequency_mhz"], "cell")
            band = header[(picked.get("band") or picked["frequency_mhz"])[0]]
            notes.append(
                f"frequency_mhz of {some} is the number in the name of the band ({band!r})"
            )
        if self.inactive:
            which = header[picked["active"][0]]
            notes.append(f"{number_of(len(self.inactive), 'row')} left out: inactive, by {which!r}")
        return notes

    def notes_of_cells(self) -> list[str]:
        """Return notes on cells whose power or technology is another than that of the list."""
        notes = []
        if self.lowered:
            names = sorted(self.lowered)
            shares = ", ".join(f"{name} {REPORTED_SHARE_DB[name]:g} dB" for name in names)
            some = number_of(self.lowered.total(), "cell")
            notes.append(f"eirp_dbm of {some} is lowered to the reported power ({shares})")
        if self.beyond:
            one = "cell left out, as its identity is"
            many = "cells left out, as their identities are"
            some = number_of(len(self.beyond), one, many)
            notes.append(f"technology of {some} beyond its limits, such as {self.beyond[0]}")
        return notes


@dataclass(frozen=True, slots=True)
class RowRule:
    """How the fields of a cell follow from a row.

    Parameters
    ----------
    table : Table
    layout : {"plan", "atoll", "opencellid"}
    picked : mapping of str to tuple of int
        Places of each field's columns.
    defaults : mapping of str to float
        For fields without a column, or empty ones.
    implied : sequence of str or None
        Technology that a value in each column implies.
    names : tuple of str
        All fields of the arranged table.
    composed : bool
        Whether cells are named by their identities.
    """

    table: Table
    layout: Layout
    picked: Mapping[str, tuple[int, ...]]
    defaults: Mapping[str, float]
    implied: Sequence[str | None]
    names: tuple[str, ...]
    composed: bool

    @classmethod
    def of(
        cls,
        table: Table,
        header: Sequence[str],
        layout: Layout,
        picked: Mapping[str, tuple[int, ...]],
        defaults: Mapping[str, float],
    ) -> RowRule:
        """Return the rule for a table, by the columns that were picked."""
        fields = [*picked, *(name for name in defaults if name not in picked)]
        fields += [name for name in IDENTITY if "cgi" in picked and name not in fields]
        fields += [name for name, by, *_ in MADE_OF if by in picked and name not in fields]
        fields = [name for name in fields if name != "cgi" and name not in HELPERS]
        composed = "cell" not in fields and all(name in fields for name in IDENTITY)
        words = (Heading.of(name).words for name in header)
        implied = [IMPLIED.get(one.replace(" ", "_")) for one in words]
        if any(implied[i] for at in picked.values() for i in at) and "technology" not in fields:
            fields.append("technology")
        if (defaults or layout == "opencellid") and "assumed" not in fields:
            fields.append("assumed")
        names = (*fields, "cell") if composed else tuple(fields)
        return cls(table, layout, picked, defaults, implied, names, composed)

    def values(self, line: int, texts: list[str], tally: RowTally) -> dict[str, str] | None:
        """Return the fields of a row, which is counted; None for an inactive cell."""
        values = {name: _first(texts, at) for name, at in self.picked.items()}
        if is_inactive(values):
            tally.inactive.append(values.get("cell") or self._identity(values))
            return None
        given = (i for at in self.picked.values() for i in at if texts[i].strip())
        _by_technology(values, [self.implied[i] for i in given])
        stated = stated_otherwise(values)
        values |= stated
        tally.made.update(stated.keys())
        if self.layout == "opencellid":
            values["technology"] = self._technology_within_limits(line, values, tally)
        self._fill_in(values, tally)
        if self.composed:
            values["cell"] = self._identity(values)
        return values

    @staticmethod
    def _identity(values: Mapping[str, str]) -> str:
        """Return the name of a cell that has none but its identity."""
        return "-".join(filter(None, (values.get(name) for name in IDENTITY)))

    def _technology_within_limits(
        self, line: int, values: Mapping[str, str], tally: RowTally
    ) -> str:
        known = technology(values.get("technology", ""))
        known = known if known in TECHNOLOGIES else None
        if wrong := _beyond_limits(known, values, self.table):
            # The identity names the cell; its technology is more likely wrong.
            tally.beyond.append(f"row {line}, {wrong}")
            return ""
        return known or ""

    def _fill_in(self, values: dict[str, str], tally: RowTally) -> None:
        """Fill in usual values, and name the fields that have them, in place."""
        unknown = self.layout == "opencellid" and not values.get("azimuth_deg")
        assumed = {"azimuth_deg"} if unknown else set[str]()
        for name, default in self.defaults.items():
            if not values.get(name):
                values[name] = _plain(_usual(name, default, values.get("technology", "")))
                tally.filled[name] += 1
                assumed.add(name)
        values["assumed"] = _assumed(values.get("assumed", ""), assumed)
        if "eirp_dbm" in assumed and float(values["eirp_dbm"]) != self.defaults["eirp_dbm"]:
            tally.lowered[technology(values["technology"]) or ""] += 1


def _plain(value: float) -> str:
    """Return a number as a file has it; a whole one may be part of an identity."""
    return repr(value).removesuffix(".0")


def _assumed(stated: str, filled: set[str]) -> str:
    """Return the fields that hold usual values: those that a row states, and those filled in."""
    names = stated.split()
    if not filled.intersection(ASSUMABLE).difference(names):
        return stated
    others = [name for name in names if name not in ASSUMABLE]
    return " ".join([*(name for name in ASSUMABLE if name in filled.union(names)), *others])


def _usual(name: str, default: float, stated: str) -> float:
    """Return the value of a field that a cell lacks; the EIRP is that of what phones report."""
    family = technology(stated) if stated else None
    if name != "eirp_dbm" or family not in REPORTED_SHARE_DB:
        return default
    return reported_eirp_dbm(default, family)


def _beyond_limits(known: str | None, values: Mapping[str, str], table: Table) -> str:
    """Return what of an identity its technology does not have, or ""."""
    for name, expected, got in technology_faults(
        known, lambda name: table.number(values.get(name, ""))
    ):
        return f"{name}: expected {expected}, found {got:.12g}"
    return ""


def _first(texts: list[str], places: tuple[int, ...]) -> str:
    """Return the first text that is not blank."""
    return next((text for at in places if (text := texts[at].strip())), "")


def _by_technology(values: dict[str, str], implied: list[str | None]) -> None:
    """Fill in the parts of a CGI, and the technology that columns with values imply."""
    identity = parse_cgi(parted_network(values.pop("cgi", "")))
    if identity is not None:
        for name, part in zip(IDENTITY, identity, strict=True):
            values[name] = values.get(name) or ("" if part is None else str(part))
    if not values.get("technology"):
        values["technology"] = next(filter(None, implied), "")
