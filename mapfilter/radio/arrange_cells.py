"""Pick the fields of a cell plan from the columns of a list in any layout."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.arranged_rows import MADE_OF, RowRule, RowTally
from mapfilter.radio.cell_layouts import (
    ALIASES,
    HELPERS,
    LAYOUTS,
    LIKELY,
    OFFSETS,
    OPENCELLID_HEADER,
    TRANSLATED,
    USUAL,
    Columns,
    Layout,
)
from mapfilter.radio.headings import Heading, doubtful_units, places_named, resembling, unit_of
from mapfilter.radio.tables import Table

UNUSED_COLUMNS = "columns not used that resemble fields"
"""What the note on such columns begins with."""
_LONGEST_SHOWN = 200
_NOT_RESEMBLED = ("technology", "assumed", "crs", "cgi", *OFFSETS)
_RADIOS = {"GSM", "UMTS", "LTE", "CDMA", "NR"}


@dataclass(frozen=True, slots=True)
class Arranged:
    """A table with the fields of a cell plan as columns.

    ``shown`` names fields in messages, with the file's own column; ``notes`` counts the values that
    were filled in; ``decimal_comma`` allows commas in numbers; ``inactive`` are cells that are
    switched off, of which there are no rows.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]
    shown: Mapping[str, str]
    notes: tuple[str, ...]
    decimal_comma: bool
    inactive: tuple[str, ...] = ()


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
    rule = RowRule.of(table, header, layout, picked, defaults)
    tally, found = RowTally(), []
    for line, texts in table.whole_rows(len(header), faults):
        values = rule.values(line, texts, tally)
        if values is not None:
            found.append((line, [values.get(name, "") for name in rule.names]))
    if tally.inactive and not found:
        got = f"{number_of(len(tally.inactive), 'row')}, all of them inactive"
        raise fail(InputError, str(table.path), "at least one active transmitter", got)
    notes = (*table.notes, *tally.notes_of_values(header, picked, defaults, len(found)))
    for field, *helpers in MADE_OF:
        if not tally.made[field]:
            picked = {name: at for name, at in picked.items() if name not in helpers}
    unused = _unused(header, picked, layout, columns)
    units = doubtful_units([Heading.of(name) for name in header], picked)
    by_itself = {name: at for name, at in picked.items() if name not in columns}
    translated = _translated(header, by_itself) if layout == "atoll" else ""
    notes += (*tally.notes_of_cells(), *filter(None, (translated, units, unused)))
    shown = {
        name: f"{header[at[0]]} ({name})" for name, at in picked.items() if header[at[0]] != name
    }
    comma = table.separator != ","
    return Arranged(rule.names, tuple(found), shown, notes, comma, tuple(tally.inactive))


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
        if at := _places_of(headings, field, names):
            picked.setdefault(field, tuple(at if field in ALIASES else at[:1]))
    if {"lat", "lon", "east", "north"} <= picked.keys():
        surplus = ("lat", "lon") if {"east", "north"} & columns.keys() else ("east", "north")
        picked = {field: at for field, at in picked.items() if field not in surplus}
    for field, used in picked.items():
        _check_unit(table, field, (headings[at] for at in used), faults)
    faults.raise_if_any(InputError)
    return picked


def _places_of(headings: Sequence[Heading], field: str, names: Sequence[str]) -> list[int]:
    """Return which headings are of a field; translated one alone, and no height above the sea."""
    found = places_named(headings, field, names)
    if not found or not _is_translated(field, headings[found[0]]):
        return found
    others = [Heading.of("") if one.is_above_sea else one for one in headings]
    found = places_named(others, field, names)
    return found if len(found) == 1 else []


def _is_translated(field: str, heading: Heading) -> bool:
    return bool(places_named([heading], field, TRANSLATED.get(field, ())))


def _translated(header: Sequence[str], picked: Mapping[str, tuple[int, ...]]) -> str:
    """Return a note on the columns that are read by their names in another language, or ""."""
    columns = ((field, header[places[0]]) for field, places in picked.items())
    found = [(name, field) for field, name in columns if _is_translated(field, Heading.of(name))]
    named = ", ".join(f"{name!r} ({field})" for name, field in found)
    return f"columns read by their French or German names: {named}" if found else ""


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
