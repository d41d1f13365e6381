"""Serving cells and timing advances counted in earlier sessions, as maps.

Where phones report nothing but their serving cell, the levels of the others are unknown, and a
margin over the best other cell is made of extrapolations. Serving cells can be counted. Rows of
sessions are spread by a Gaussian kernel (Nadaraya 1964; Watson 1964): with n rows of any cell about
a place and n_c of one, that one serves with the probability ``(n_c + a p_c) / (n + a)``, with p_c
its share of all rows and a the weight of the prior. On another day another cell of the same site
may serve, of another carrier: a part of the probability goes by how often the site served.

Timing advances get mean and deviation in the same way, a cell's drawn to those of its site:
buildings bend the way of the signal, so that rings about the site, whose position is not known
either, are less informative than what was reported nearby.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Bools, Floats, Floats32, Ints, Ints32
from mapfilter.lattice import Lattice

_CLIP_SD = 4.0


@dataclass(frozen=True, slots=True)
class MeasuredMapOptions:
    """Smoothing of the counts.

    Parameters
    ----------
    reach_m : float
        Standard deviation of the kernel.
    prior_rows : float
        Weight of the prior: so many rows at a place count as much as all rows together.
    site_part : float
        Part of the probability that goes by the site.
    rounding_steps : float
        Standard deviation of a timing advance where all rows agree.
    """

    reach_m: float = 30.0
    prior_rows: float = 1.0
    site_part: float = 0.1
    rounding_steps: float = 0.5


@dataclass(frozen=True, eq=False)
class MeasuredRows:
    """Rows of earlier sessions, shape (N,) each.

    ``cell`` is the band of the serving cell, -1 for a cell that is not of the map; the timing
    advance is in steps, NaN where it was not reported.
    """

    cell: Ints
    east_m: Floats
    north_m: Floats
    timing_advance: Floats


@dataclass(frozen=True, eq=False)
class ServingStatistics:
    """Maps on a lattice of P pixels, of C cells.

    Parameters
    ----------
    log_share : ndarray of float32, shape (C, P)
        Log probability that a cell serves.
    advance_steps, deviation_steps : ndarray of float32, shape (C, P)
        Timing advance; NaN for a cell of which none was reported.
    """

    log_share: Floats32
    advance_steps: Floats32
    deviation_steps: Floats32

    @classmethod
    def of_rows(
        cls, rows: MeasuredRows, lattice: Lattice, site: Ints, options: MeasuredMapOptions
    ) -> ServingStatistics:
        """Count the rows that lie on a lattice.

        ``site`` is the site of each cell, as numbers from 0, shape (C,).
        """
        from scipy.ndimage import gaussian_filter

        row, col = lattice.row_col(rows.east_m, rows.north_m)
        inside = np.asarray(lattice.contains(row, col))
        pixel = (np.asarray(row) * lattice.cols + np.asarray(col))[inside]
        cell, reported = rows.cell[inside], rows.timing_advance[inside]
        sigma = options.reach_m / lattice.resolution_m
        # Scaled so that a row counts as one at its own place.
        scale = 2 * np.pi * max(sigma, 1 / np.sqrt(2 * np.pi)) ** 2
        shape = (lattice.rows, lattice.cols)

        def spread(which: Bools, value: Floats) -> Floats:
            count = np.bincount(pixel[which], value[which], minlength=shape[0] * shape[1])
            smooth = gaussian_filter(count.reshape(shape), sigma, mode="constant", truncate=3.0)
            return np.asarray(scale * smooth, dtype=np.float64).ravel()

        ones, prior = np.ones(cell.size), options.prior_rows
        total = spread(ones > 0, ones) + prior
        place = np.where(cell >= 0, site[cell], -1)
        often = np.bincount(cell[cell >= 0], minlength=site.size) + 0.5
        often /= often.sum()
        maps = np.empty((3, site.size, shape[0] * shape[1]), dtype=np.float32)
        for one in np.unique(site):
            own, bands = place == one, np.flatnonzero(site == one)
            usual = often[bands].sum()
            by_site = (spread(own, ones) + prior * usual) / total
            known = own & np.isfinite(reported)
            steps = reported[known] if known.any() else np.array([np.nan])
            usual_steps = (np.array([steps.mean()]), np.array([np.mean(steps**2)]))
            by_place = _moments(spread, known, reported, usual_steps, prior)
            for band in bands:
                by_cell = (spread(cell == band, ones) + prior * often[band]) / total
                part = options.site_part
                share = (1 - part) * by_cell + part * by_site * often[band] / usual
                maps[0, band] = np.log(share)
                first, second = _moments(spread, known & (cell == band), reported, by_place, prior)
                variance = np.maximum(second - first**2, 0.0) + options.rounding_steps**2
                maps[1, band], maps[2, band] = first, np.sqrt(variance)
        return cls(*maps)

    def log_serving(self, band: int, pixel: Ints32) -> Floats32:
        """Return the log-likelihood of a serving cell at pixels."""
        return np.asarray(self.log_share[band][pixel])

    def log_advance(self, band: int, pixel: Ints32, steps: float) -> Floats32:
        """Return the log-likelihood of a timing advance at pixels; 0 where none was reported."""
        deviation = self.deviation_steps[band][pixel]
        beside = np.abs(steps - self.advance_steps[band][pixel]) / deviation
        found = -0.5 * np.minimum(beside, _CLIP_SD) ** 2 - np.log(deviation)
        return np.asarray(np.nan_to_num(found, nan=0.0), dtype=np.float32)


def _moments(
    spread: Callable[[Bools, Floats], Floats],
    known: Bools,
    reported: Floats,
    otherwise: tuple[Floats, Floats],
    prior: float,
) -> tuple[Floats, Floats]:
    """Return maps of mean and mean square, drawn towards those given otherwise."""
    count = spread(known, np.ones(reported.size)) + prior
    first = (spread(known, reported) + prior * otherwise[0]) / count
    second = (spread(known, reported**2) + prior * otherwise[1]) / count
    return first, second
