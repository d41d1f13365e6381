"""Azimuths of a cell plan against the lobes of its rasters: which mistake explains both."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapfilter.radio.cells import Cell
from mapfilter.radio.lobes import Lobe, best_labels, mean_score

Mistake = Literal[
    "azimuth-radians",
    "azimuth-counter-clockwise",
    "azimuth-off-by-90",
    "azimuth-off-by-180",
    "sector-labels-swapped",
    "azimuth-off-lobe",
]

_FAR_OFF_DEG = 45.0
_WORSE = 0.4
_CLEAR_SCORE = 0.25
_CLEAR_CONTRAST_DB = 6.0
_BETTER = 0.3
_STRAY_SHARE = 0.1

_READINGS: tuple[tuple[Mistake, str, Callable[[float], float]], ...] = (
    ("azimuth-counter-clockwise", "counter-clockwise from north", lambda a: -a),
    ("azimuth-counter-clockwise", "counter-clockwise from east", lambda a: 90 - a),
    ("azimuth-off-by-180", "to be 180° more", lambda a: a + 180),
    ("azimuth-off-by-90", "to be 90° more", lambda a: a + 90),
    ("azimuth-off-by-90", "to be 90° less", lambda a: a - 90),
    ("azimuth-radians", "radians", lambda a: float(np.degrees(a))),
)
"""What azimuths may have been meant to be: as degrees clockwise from north."""


@dataclass(frozen=True, slots=True)
class AzimuthMistake:
    """Azimuths that go against the lobes, and what explains it.

    Parameters
    ----------
    mistake : str
    cells : tuple of str
        Whose azimuths or rasters are concerned.
    reading : str
        What the azimuths seem to be, in words; for swapped labels which raster is whose.
    offset_deg : float
        Median angle between azimuths and lobes of those cells, 0..180.
    offset_read_deg : float
        The same after the mistake is mended.
    """

    mistake: Mistake
    cells: tuple[str, ...]
    reading: str
    offset_deg: float
    offset_read_deg: float


def azimuth_mistakes(
    cells: Sequence[Cell], lobes: Mapping[str, Lobe]
) -> tuple[AzimuthMistake, ...]:
    """Compare the azimuth of each sector with the lobe of its raster.

    A sector counts as wrong where its azimuth is more than 45° from the lobe and explains the
    raster clearly worse. A mistake of the whole plan is preferred where it explains two sites or
    more, then labels exchanged within a site, then single azimuths.

    Parameters
    ----------
    cells : sequence of Cell
    lobes : mapping of cell id to Lobe
        Where they could be found; cells without one are passed over.
    """
    usable = [cell for cell in cells if _is_clear(cell, lobes)]
    azimuth = {cell.id: float(cell.azimuth_deg or 0.0) for cell in usable}
    wrong = [cell for cell in usable if _is_off(lobes[cell.id], azimuth[cell.id])]
    if not wrong:
        return ()
    by_site: dict[str, list[Cell]] = {}
    for cell in usable:
        by_site.setdefault(cell.site, []).append(cell)
    touched = {cell.site for cell in wrong}
    swaps = [swap for site in sorted(touched) if (swap := _swapped(by_site[site], lobes, azimuth))]
    explained = {cell_id for swap in swaps for cell_id in swap.cells}
    one_site_explained = len(touched) == 1 and explained >= {cell.id for cell in wrong}
    whole = None if one_site_explained else _whole_plan(usable, wrong, lobes, azimuth)
    if whole is not None:
        return (whole,)
    rest = tuple(cell.id for cell in wrong if cell.id not in explained)
    if not rest:
        return tuple(swaps)
    alone = AzimuthMistake(
        "azimuth-off-lobe",
        rest,
        ", ".join(f"{i} {azimuth[i]:g}° for {lobes[i].azimuth_deg:g}°" for i in rest[:5]),
        _median_off(rest, lobes, azimuth),
        0.0,
    )
    return (*swaps, alone)


def _is_clear(cell: Cell, lobes: Mapping[str, Lobe]) -> bool:
    lobe = lobes.get(cell.id)
    if lobe is None or cell.azimuth_deg is None or cell.antenna == "omni" or cell.indoor:
        return False
    return lobe.contrast_db >= _CLEAR_CONTRAST_DB and float(lobe.scores.max()) >= _CLEAR_SCORE


def _is_off(lobe: Lobe, azimuth_deg: float) -> bool:
    far = abs(lobe.offset_deg(azimuth_deg)) > _FAR_OFF_DEG
    return far and float(lobe.scores.max()) - lobe.score(azimuth_deg) > _WORSE


def _median_off(
    ids: Sequence[str], lobes: Mapping[str, Lobe], azimuth: Mapping[str, float]
) -> float:
    return float(np.median([abs(lobes[i].offset_deg(azimuth[i])) for i in ids]))


def _whole_plan(
    usable: Sequence[Cell],
    wrong: Sequence[Cell],
    lobes: Mapping[str, Lobe],
    azimuth: Mapping[str, float],
) -> AzimuthMistake | None:
    """Return the mistake that explains the azimuths of all sectors, if one does."""
    if len(usable) < 2 or 2 * len(wrong) < len(usable):
        return None
    ids = [cell.id for cell in usable]
    found = [lobes[i] for i in ids]
    as_given = mean_score(found, [azimuth[i] for i in ids])
    best: tuple[float, Mistake, str, dict[str, float]] | None = None
    for mistake, reading, read in _READINGS:
        meant = {i: read(azimuth[i]) % 360 for i in ids}
        score = mean_score(found, [meant[i] for i in ids])
        stray = sum(_is_off(lobes[i], meant[i]) for i in ids)
        better = score - as_given > _BETTER and stray <= _STRAY_SHARE * len(ids)
        if better and (best is None or score > best[0]):
            best = score, mistake, reading, meant
    if best is None:
        return None
    _, mistake, reading, meant = best
    concerned = tuple(cell.id for cell in wrong)
    return AzimuthMistake(
        mistake,
        concerned,
        reading,
        _median_off(concerned, lobes, azimuth),
        _median_off(concerned, lobes, meant),
    )


def _swapped(
    cells: Sequence[Cell], lobes: Mapping[str, Lobe], azimuth: Mapping[str, float]
) -> AzimuthMistake | None:
    """Return the exchange of labels that explains a site's lobes, if one does."""
    ids = [cell.id for cell in cells]
    if len(ids) < 2:
        return None
    label = best_labels({i: lobes[i] for i in ids}, {i: azimuth[i] for i in ids})
    moved = tuple(i for i in ids if label[i] != i)
    meant = {i: azimuth[label[i]] for i in ids}
    if not moved or any(_is_off(lobes[i], meant[i]) for i in ids):
        return None
    reading = ", ".join(f"{i} is of {label[i]}" for i in moved)
    return AzimuthMistake(
        "sector-labels-swapped",
        moved,
        reading,
        _median_off(moved, lobes, azimuth),
        _median_off(moved, lobes, meant),
    )
