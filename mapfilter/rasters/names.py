"""Names of rasters that are ids of a plan: in another Unicode form, or between common texts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from unicodedata import normalize

from mapfilter._words import number_of
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters

_LEAST_SHARE = 0.9
_TRIED = 3


def named_by_plan(rasters: RxLevRasters, plan: CellPlan) -> RxLevRasters:
    """Return rasters with the ids of a plan, where each name is an id between the same texts.

    Planning tools name files such as ``HD0001_1_RSRP.tif`` for the cell ``HD0001_1``. Nothing
    changes where any raster has an id of the plan, or where fewer than nine of ten names fit.

    Before that, names that equal an id of the plan in Unicode's composed form (NFC) become that id
    where there is only one such name and id: macOS and some archives take letters with marks apart.

    Returns
    -------
    RxLevRasters
        With a note where names changed; ``check_against_plan`` finds the names that do not fit.
    """
    # A cell may have rows that are switched off beside others; such rows may have no name.
    ids = _by_form(dict.fromkeys((*plan.ids, *filter(None, plan.inactive))))
    rasters = _composed(rasters, ids)
    held = rasters.cell_ids
    if not held or any(cell_id in plan for cell_id in held):
        return rasters
    forms = {name: normalize("NFC", name) for name in held}
    best: tuple[int, int, str, str] | None = None
    for prefix, suffix in {pair for name in held[:_TRIED] for pair in _around(forms[name], ids)}:
        inner = {_within(form, prefix, suffix) for form in forms.values()}
        fitting = sum(form is not None and form in ids for form in inner)
        # Of equally good ones that with the longest ids.
        rank = (fitting, -len(prefix) - len(suffix), prefix, suffix)
        best = rank if best is None or rank > best else best
    if best is None or best[0] < _LEAST_SHARE * len(held):
        return rasters
    _, _, prefix, suffix = best
    within = {name: _within(form, prefix, suffix) for name, form in forms.items()}
    named = {name: ids[form] for name, form in within.items() if form is not None and form in ids}
    note = f"rasters named {prefix}*{suffix}, where * is a cell of the plan"
    return _renamed(rasters, named, note)


def _composed(rasters: RxLevRasters, ids: Mapping[str, str]) -> RxLevRasters:
    """Return rasters with ids of a plan where names are these in another Unicode form."""
    names = _by_form(rasters.cell_ids)
    named = {name: ids[form] for form, name in names.items() if ids.get(form, name) != name}
    if not named:
        return rasters
    some = number_of(len(named), "raster")
    return _renamed(rasters, named, f"{some} named as in the plan, in another Unicode form")


def _by_form(names: Iterable[str]) -> dict[str, str]:
    """Return names by their composed form, without those of which several have the same."""
    forms = [(normalize("NFC", name), name) for name in names]
    times = Counter(form for form, _ in forms)
    return {form: name for form, name in forms if times[form] == 1}


def _renamed(rasters: RxLevRasters, named: Mapping[str, str], note: str) -> RxLevRasters:
    def new(names: Iterable[str]) -> tuple[str, ...]:
        return tuple(named.get(name, name) for name in names)

    files = tuple(replace(file, cell_ids=new(file.cell_ids)) for file in rasters.files)
    notes = (*rasters.notes, note)
    return replace(rasters, cell_ids=new(rasters.cell_ids), files=files, notes=notes)


def _around(name: str, ids: Iterable[str]) -> list[tuple[str, str]]:
    """Return what stands before and after each id within a name."""
    found = []
    for cell_id in ids:
        at = name.find(cell_id)
        while at >= 0:
            found.append((name[:at], name[at + len(cell_id) :]))
            at = name.find(cell_id, at + 1)
    return found


def _within(name: str, prefix: str, suffix: str) -> str | None:
    fits = name.startswith(prefix) and name.endswith(suffix)
    return name[len(prefix) : len(name) - len(suffix)] if fits else None
