"""Pick the fields of a cell plan from the columns of a list in any layout."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.cell_layouts import (
    ALIASES,
    HELPERS,
    IMPLIED,
    LAYOUTS,
    LIKELY,
    OFFSETS,
    OPENCELLID_HEADER,
    USUAL,
    Columns,
    Layout,
)
from mapfilter.radio.cell_rules import TECHNOLOGIES, technology_faults
from mapfilter.radio.headings import Heading, doubtful_units, places_named, resembling, unit_of
from mapfilter.radio.identities import IDENTITY, parse_cgi, parted_network, technology
from mapfilter.radio.reported_power import ASSUMABLE, REPORTED_SHARE_DB, reported_eirp_dbm
from mapfilter.radio.tables import Table
from mapfilter.radio.transmitter_lists import is_inactive, stated_otherwise

UNUSED_COLUMNS = "columns not used that resemble fields"
"""What the note on such columns begins with."""
_LONGEST_SHOWN = 200
_NOT_RESEMBLED = ("technology", "assumed", "crs", "cgi", *OFFSETS)
_RADIOS = {"GSM", "UMTS", "LTE", "CDMA", "NR"}
_MADE_OF = (("frequency_mhz", "band"), ("ci", "cell_number", "enodeb"))
"""Fields, and columns of planning tools that they are made of."""


@dataclass(frozen=True, slots=True)
class Arranged:
    """A table with the fields of a cell plan as columns.

    ``shown`` names fields in messages, with the file's own column; ``notes`` counts the values that
    were filled in; ``decimal_comma`` allows commas in numbers.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]
    shown: Mapping[str, str]
    notes: tuple[str, ...]
    decimal_comma: bool


def arrange(
    table: Table,
    layout: Layout,
    columns: Mapping[str, str],
    defaults: Mapping[str, float],
    faults: Faults,
) -> Arranged:
    """Pick the columns of a cell plan from a list of another layout.

    Parameters
    ----------
    layout : {"plan", "atoll", "opencellid"}
        Names the columns that ``columns`` does not.
    columns : mapping of str to str
        Column of the file, by field.
    defaults : mapping of str to float
        For fields without a column, or empty ones. An EIRP is that of a carrier: cells of a known
        technology get that of what phones report.
    faults : Faults
        Rows of another length are added, and left out.
    """
    header = table.header
    if layout == "opencellid" and header and header[0].upper() in _RADIOS:
        table = replace(table, rows=((1, list(header)), *table.rows))
        header = OPENCELLID_HEADER
    picked = _pick(table, header, layout, columns)
    headings = [Heading.of(name) for name in header]
    fields = [*picked, *(name for name in defaults if name not in picked)]
    fields += [name for name in IDENTITY if "cgi" in picked and name not in fields]
    fields += [name for name, by, *_ in _MADE_OF if by in picked and name not in fields]
    fields = [name for name in fields if name != "cgi" and name not in HELPERS]
    composed = "cell" not in fields and all(name in fields for name in IDENTITY)
    implied = [IMPLIED.get(heading.words.replace(" ", "_")) for heading in headings]
    if any(implied[i] for at in picked.values() for i in at) and "technology" not in fields:
        fields.append("technology")
    if (defaults or layout == "opencellid") and "assumed" not in fields:
        fields.append("assumed")
    names = (*fields, "cell") if composed else tuple(fields)
    filled: Counter[str] = Counter()
    lowered, beyond, found = Counter[str](), list[str](), []
    made, inactive = Counter[str](), 0
    for line, texts in table.whole_rows(len(header), faults):
        values = {name: _first(texts, at) for name, at in picked.items()}
        if is_inactive(values):
            inactive += 1
            continue
        _by_technology(
            values, [implied[i] for at in picked.values() for i in at if texts[i].strip()]
        )
        stated = stated_otherwise(values)
        values |= stated
        made.update(stated.keys())
        if layout == "opencellid":
            known = technology(values.get("technology", ""))
            known = known if known in TECHNOLOGIES else None
            values["technology"] = known or ""
            if wrong := _beyond_limits(known, values, table):
                # The identity names the cell; its technology is more likely wrong.
                values["technology"] = ""
                beyond.append(f"row {line}, {wrong}")
        unknown = layout == "opencellid" and not values.get("azimuth_deg")
        assumed = {"azimuth_deg"} if unknown else set[str]()
        for name, default in defaults.items():
            if not values.get(name):
                values[name] = _plain(_usual(name, default, values.get("technology", "")))
                filled[name] += 1
                assumed.add(name)
        values["assumed"] = _assumed(values.get("assumed", ""), assumed)
        if "eirp_dbm" in assumed and float(values["eirp_dbm"]) != defaults["eirp_dbm"]:
            lowered[technology(values["technology"]) or ""] += 1
        if composed:
            parts = (values[name] for name in IDENTITY)
            values["cell"] = "-".join(part for part in parts if part)
        found.append((line, [values.get(name, "") for name in names]))
    if inactive and not found:
        got = f"{number_of(inactive, 'row')}, all of them inactive"
        raise fail(InputError, str(table.path), "at least one active transmitter", got)
    notes = table.notes + tuple(
        f"{name} = {defaults[name]:g} for {count} of {len(found)} cells without one"
        for name, count in sorted(filled.items())
    )
    if filled["frequency_mhz"] and "arfcn" in picked:
        carrier = header[picked["arfcn"][0]]
        notes += (f"frequency_mhz is not taken from {carrier!r}; set cells.frequency_mhz",)
    if made["frequency_mhz"]:
        some, band = number_of(made["frequency_mhz"], "cell"), header[picked["band"][0]]
        notes += (f"frequency_mhz of {some} is the number in the name of the band ({band!r})",)
    if inactive:
        which = header[picked["active"][0]]
        notes += (f"{number_of(inactive, 'row')} left out: inactive, by {which!r}",)
    for field, *helpers in _MADE_OF:
        if not made[field]:
            picked = {name: at for name, at in picked.items() if name not in helpers}
    unused = _unused(header, picked, layout, columns)
    if lowered:
        shares = ", ".join(f"{name} {REPORTED_SHARE_DB[name]:g} dB" for name in sorted(lowered))
        some = number_of(lowered.total(), "cell")
        notes += (f"eirp_dbm of {some} is lowered to the reported power ({shares})",)
    if beyond:
        one, many = "cell left out, as its identity is", "cells left out, as their identities are"
        some = number_of(len(beyond), one, many)
        notes += (f"technology of {some} beyond its limits, such as {beyond[0]}",)
    notes += tuple(filter(None, (doubtful_units(headings, picked), unused)))
    shown = {
        name: f"{header[at[0]]} ({name})" for name, at in picked.items() if header[at[0]] != name
    }
    return Arranged(names, tuple(found), shown, notes, table.separator != ",")


def likely_names(layout: Layout, has: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Return the names that columns of other fields than some may have, by field."""
    there = {*has, *_NOT_RESEMBLED}
    there |= {"east", "north"} if {"lat", "lon"} <= there else set()
    there |= {"lat", "lon"} if {"east", "north"} <= there else set()
    likely = {"atoll": LIKELY, "plan": USUAL}.get(layout, {})
    wanted = {
        field: (
            *names,
            *likely.get(field, ()),
            field.rpartition("_")[0] if unit_of(field) else field,
        )
        for field, names in LAYOUTS[layout].items()
        if field not in there and field not in HELPERS
    }
    return {field: tuple(filter(None, names)) for field, names in wanted.items()}


def none_of(header: Sequence[str]) -> str:
    """Return what was found in place of a column: the columns that there are."""
    shown = ", ".join(header)
    shown = f"{shown[:_LONGEST_SHOWN]}, …" if len(shown) > _LONGEST_SHOWN else shown
    return f"none (columns: {shown})"


def recognised(header: Sequence[str], columns: Columns) -> list[str]:
    """Return the headings that are among the names of some columns."""
    headings = [Heading.of(name) for name in header]
    found = {at for field, names in columns.items() for at in places_named(headings, field, names)}
    return [header[at] for at in sorted(found)]


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


def _pick(
    table: Table, header: tuple[str, ...], layout: Layout, columns: Mapping[str, str]
) -> dict[str, tuple[int, ...]]:
    """Return the places of each field's column, or columns."""
    faults = Faults()
    headings = [Heading.of(name) for name in header]
    # A name without its unit does where it is clear.
    titles = Counter(heading.title for heading in headings)
    places = {h.title: at for at, h in enumerate(headings) if titles[h.title] == 1}
    places |= {name: at for at, name in reversed(list(enumerate(header)))}
    picked: dict[str, tuple[int, ...]] = {}
    for field, name in columns.items():
        if name in places:
            picked[field] = (places[name],)
        else:
            near = difflib.get_close_matches(name, header, n=1, cutoff=0.5)
            hint = f"{near[0]} meant" if near else ""
            got = none_of(header)
            faults.add(f"{table.path} header", f"a column {name} ({field})", got, hint)
    faults.raise_if_any(InputError)
    for field, names in LAYOUTS[layout].items():
        at = places_named(headings, field, names)
        if at:
            picked.setdefault(field, tuple(at if field in ALIASES else at[:1]))
    if {"lat", "lon", "east", "north"} <= picked.keys():
        surplus = ("lat", "lon") if {"east", "north"} & columns.keys() else ("east", "north")
        picked = {field: at for field, at in picked.items() if field not in surplus}
    for field, used in picked.items():
        _check_unit(table, field, (headings[at] for at in used), faults)
    faults.raise_if_any(InputError)
    return picked


def _check_unit(table: Table, field: str, used: Iterable[Heading], faults: Faults) -> None:
    """Note headings that state another unit than that of the field."""
    for heading in used:
        if heading.has_other_unit(field):
            hint = f"another unit; convert the column to {unit_of(field)}"
            expected = f"{field} in {unit_of(field)}"
            faults.add(f"{table.path} header", expected, repr(heading.name), hint)


def _unused(
    header: tuple[str, ...],
    picked: Mapping[str, tuple[int, ...]],
    layout: Layout,
    columns: Mapping[str, str],
) -> str:
    """Return a note on columns that are ignored and resemble a field that has no column, or ""."""
    if layout == "opencellid" or (layout == "plan" and not columns):
        return ""
    wanted = likely_names(layout, picked)
    used = {at for places in picked.values() for at in places}
    found = resembling([Heading.of(name) for name in header], used, wanted)
    named = ", ".join(f"{name!r} ({field})" for name, field in found)
    return f"{UNUSED_COLUMNS}: {named}" if found else ""
