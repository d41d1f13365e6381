"""A log in another projected CRS than its own: positions, their errors, and headings."""

from __future__ import annotations

from dataclasses import replace
from math import degrees

import numpy as np
import pandas as pd

from mapfilter._crs_reach import project_within
from mapfilter._types import Bools, Floats
from mapfilter.angles import wrap_rad
from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import grid_convergence_rad, same_grid, short_crs, unproject
from mapfilter.tracks.checks.beyond_crs import without_beyond
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.stated_crs import placed_in

_PLACED = ("truth", "gnss")


def projected_log(
    log: TrackLog, crs: str, about_deg: tuple[float, float] | None = None
) -> TrackLog:
    """Return a log in another projected CRS, with a note; as it is where headings have no place.

    Headings turn by the difference of the grid convergences in the middle of the positions, and so
    do covariances of fixes. Steps and turns are those of the ground, and stay.

    Parameters
    ----------
    log : TrackLog
        In a CRS of known place.
    crs : str
        Projected CRS, as :func:`mapfilter.geodesy.projected_crs` returns it.
    about_deg : (float, float) or None
        Latitude and longitude near a log without positions.

    Raises
    ------
    InputError
        The CRS covers none of the positions of a table.
    """
    degrees_of = {
        name: unproject(log.crs, *getattr(log, name)[["east_m", "north_m"]].to_numpy().T)
        for name in _PLACED
    }
    middle_deg = next(filter(None, map(_middle, degrees_of.values())), about_deg)
    headed = bool(log.motion["heading_rad"].notna().any())
    if middle_deg is None and headed:
        return log
    turned_rad, faults, tables, notes = 0.0, Faults(), dict[str, pd.DataFrame](), list[str]()
    if middle_deg is not None:
        lat_deg, lon_deg = middle_deg
        turned_rad = grid_convergence_rad(crs, lon_deg, lat_deg)
        turned_rad -= grid_convergence_rad(log.crs, lon_deg, lat_deg)
    for name, (lon, lat) in degrees_of.items():
        rows = getattr(log, name)
        if rows.empty:
            continue
        east_m, north_m, beyond = project_within(crs, lon, lat)
        note = without_beyond(f"log, {name}", crs, lon, lat, beyond, faults)
        notes += [note] if note else []
        tables[name] = _moved(rows, east_m, north_m, ~beyond, turned_rad)
    faults.raise_if_any(InputError)
    tables = {name: placed_in(crs, rows) for name, rows in tables.items()}
    told = ["positions"] if tables else []
    if headed:
        heading_rad = wrap_rad(log.motion["heading_rad"] + turned_rad)
        tables["motion"] = log.motion.assign(heading_rad=heading_rad)
        told.append(f"headings by {degrees(turned_rad):.2f} degrees (grid convergence)")
    what = f": {', '.join(told)}" if told else ""
    first = f"projected from {short_crs(log.crs)} to {short_crs(crs)}{what}"
    return replace(log, crs=crs, **tables, notes=(*log.notes, first, *notes))


def truth_in(crs: str, truth: pd.DataFrame, own: str) -> pd.DataFrame:
    """Return ground truth in a CRS, projected where it states another one.

    Parameters
    ----------
    crs : str
        Of the track that it is compared with.
    truth : pandas.DataFrame
    own : str
        CRS that it states; "" where it states none, and is returned as it is.

    Raises
    ------
    InputError
        The CRS covers none of its positions.
    """
    faults = Faults()
    if not own or truth.empty or same_grid(own, crs):
        return truth
    lon_deg, lat_deg = unproject(own, *truth[["east_m", "north_m"]].to_numpy().T)
    east_m, north_m, beyond = project_within(crs, lon_deg, lat_deg)
    without_beyond("truth", crs, lon_deg, lat_deg, beyond, faults)
    faults.raise_if_any(InputError)
    return truth.assign(east_m=east_m, north_m=north_m)[~beyond]


def _middle(places_deg: tuple[Floats, Floats]) -> tuple[float, float] | None:
    """Return latitude and longitude in the middle of places; None without any."""
    lon_deg, lat_deg = places_deg
    known = np.isfinite(lon_deg) & np.isfinite(lat_deg)
    if not known.any():
        return None
    return float(np.median(lat_deg[known])), float(np.median(lon_deg[known]))


def _moved(
    rows: pd.DataFrame, east_m: Floats, north_m: Floats, kept: Bools, turned_rad: float
) -> pd.DataFrame:
    """Return rows at their new places, with covariances turned as headings are."""
    moved = rows.assign(east_m=east_m, north_m=north_m)
    if "var_east_m2" in rows:
        cos, sin = np.cos(turned_rad), np.sin(turned_rad)
        east, north = rows["var_east_m2"], rows["var_north_m2"]
        both = rows["cov_east_north_m2"]
        # Of errors along a line, one variance may be less than nothing by rounding.
        moved = moved.assign(
            var_east_m2=(cos**2 * east - 2 * cos * sin * both + sin**2 * north).clip(lower=0),
            var_north_m2=(sin**2 * east + 2 * cos * sin * both + cos**2 * north).clip(lower=0),
            cov_east_north_m2=cos * sin * (east - north) + (cos**2 - sin**2) * both,
        )
    return moved[kept].reset_index(drop=True)
