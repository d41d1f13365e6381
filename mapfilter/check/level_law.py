"""How levels fall with the distance, against what propagation allows.

In the main lobe, from 300 m on, macrocells lose 20 dB (free space) to about 60 dB per tenfold
distance: 35 by Okumura and Hata (30 m), 35 to 58 as measured in 95 suburban cells, more the lower
the mast and the hillier the land (Erceg et al., IEEE JSAC 17(7), 1999); ridges add some. Nothing
is received much above free space (ITU-R P.525), and where the lobe is strongest hardly 45 dB below
it, or 75 where the EIRP is a carrier's and levels are those of a subcarrier.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.check.findings import REMEDIES, Findings, Severity
from mapfilter.check.plan_gain import PHONE_M, gain_by_plan_db
from mapfilter.check.samples import RasterSample, thinned
from mapfilter.radio.cells import Cell, CellPlan

_FROM_M = 300.0
_RINGS_PER_OCTAVE, LEAST_IN_RING, LEAST_RINGS = 4, 30, 4
_LEAST_DECADES = 0.5
_LEAST_CELLS = 3


class LevelLaw(NamedTuple):
    """Medians of rings in the main lobe of a cell, one ring or more per value.

    Parameters
    ----------
    decades : ndarray of float, shape (rings,)
        Decimal logarithm of the distance in metres.
    level_db : ndarray of float, shape (rings,)
        Levels in dBm, or losses with a minus sign.
    gain_db : ndarray of float, shape (rings,)
        Of the antenna against its boresight, as the plan states it.
    free_db : ndarray of float, shape (rings,)
        Levels of free space, on the scale of ``level_db``.
    """

    decades: Floats
    level_db: Floats
    gain_db: Floats
    free_db: Floats

    def slope_db(self, times: float = 1.0) -> float:
        """Return the loss per tenfold distance (dB) of levels multiplied by a number."""
        return -float(np.polyfit(self.decades, times * self.level_db - self.gain_db, 1)[0])

    def below_free_space_db(self, times: float = 1.0) -> Floats:
        """Return by how much each ring is below free space, of levels multiplied by a number."""
        return self.free_db - times * self.level_db


class _Network(NamedTuple):
    """Medians over cells: loss per tenfold distance, and dB below free space where strongest."""

    slope_db: float
    strongest_db: float


def level_law(sample: RasterSample, cell: Cell, *, losses: bool = False) -> LevelLaw | None:
    """Return how levels of a cell fall with the distance; None where too little is to be seen.

    Parameters
    ----------
    losses : bool
        The sample holds losses with a minus sign, which need no EIRP.
    """
    sample = thinned(sample)
    ground_m, used = lobe(sample, cell)
    if used.sum() < LEAST_RINGS * LEAST_IN_RING:
        return None
    east_m, north_m = sample.positions_m()
    gain_db = gain_by_plan_db(cell, sample.lattice.crs, east_m[used], north_m[used])
    gain_db = np.broadcast_to(0.0 if gain_db is None else gain_db, int(used.sum()))
    ground_m, level_db = ground_m[used], sample.values[used].astype(np.float64)
    distance_km = np.hypot(ground_m, cell.height_m - PHONE_M) / 1000
    free_db = -(32.44 + 20 * np.log10(distance_km) + 20 * np.log10(cell.frequency_mhz)) + gain_db
    free_db += 0.0 if losses else cell.eirp_dbm
    ring = np.floor(_RINGS_PER_OCTAVE * np.log2(ground_m)).astype(np.int64)
    columns = np.array([np.log10(ground_m), level_db, gain_db, free_db])
    rings = [columns[:, ring == number] for number in np.unique(ring)]
    medians = [np.median(one, axis=1) for one in rings if one.shape[1] >= LEAST_IN_RING]
    if len(medians) < LEAST_RINGS:
        return None
    law = LevelLaw(*np.array(medians).T)
    return law if np.ptp(law.decades) >= _LEAST_DECADES else None


_UNITS = (1.0, 1 / 2, 1 / 4, 1 / 8, 1 / 10, 1 / 16, 1 / 32, 1 / 64, 1 / 100, 1 / 256, 1 / 1000)
"""dB per stored unit that programs write."""
_USUAL_UNITS = (1 / 16, 1 / 10, 1.0, *_UNITS)
_UNIT_NAMES = {
    1 / 16: "sixteenths of a dB as Atoll stores them",
    1 / 10: "tenths of a dB",
    1.0: "whole dB",
}
_ROUNDED = 0.01
_LIKELY_TIMES = 1.8
_USUAL_SLOPE_DB, _USUAL_BELOW_DB = (20.0, 60.0), (-5.0, 75.0)
_STEEPEST_DB, _STEEP_BELOW_DB = 65.0, 50.0
_STEEP_DB, _FAR_BELOW_DB = 50.0, 60.0
_ABOVE_DB = -8.0


def check_factor(
    samples: Sequence[RasterSample],
    plan: CellPlan,
    factor: float,
    quantity: str,
    where: str,
    findings: Findings,
) -> None:
    """Check whether another factor than the declared one makes levels that propagation knows.

    Samples are of levels in dBm, or of losses with a minus sign. An error are levels that no
    propagation explains, and a warning those that are unusual, where a usual factor mends either;
    so is a factor that is no unit of dB that programs write.
    """
    laws = _laws(samples, plan, losses=quantity == "loss")
    now = _network(laws)
    unit = any(abs(abs(factor) / one - 1) <= _ROUNDED for one in _UNITS)
    if now is None:
        return
    strange = _strangeness(now, factor)
    if unit and not strange:
        return
    for other in dict.fromkeys(_USUAL_UNITS):
        times = other / abs(factor)
        then = _network(laws, times)
        if then is None or not _is_usual(then) or max(times, 1 / times) > _LIKELY_TIMES:
            continue
        if abs(times - 1) > _ROUNDED:
            of = f"rasters.factor = {factor:g}"
            evidence = f"{of} is no usual unit. " if not unit else ""
            evidence += (
                f"With {of} levels in the main lobes fall by {now.slope_db:.0f} dB per tenfold "
                f"distance and are {_beside(now.strongest_db)} free space where they are strongest "
                f"(median of {len(laws)} cells; usual are 20 to 60, and 0 to 45 dB below). With "
                f"{np.copysign(other, factor):g} it is {then.slope_db:.0f} dB, and "
                f"{_beside(then.strongest_db)} free space."
            )
            likely = f"{np.copysign(other, factor):g}"
            if other in _UNIT_NAMES:
                likely += f", {_UNIT_NAMES[other]}"
            remedy = f"Likely {likely}. {REMEDIES['raster-factor']}"
            severity: Severity = "error" if strange > 1 else "warning"
            findings.add("raster-factor", where, evidence, severity, remedy)
            return


def _laws(samples: Sequence[RasterSample], plan: CellPlan, *, losses: bool) -> list[LevelLaw]:
    cells: Mapping[str, Cell] = {cell.id: cell for cell in plan.cells if is_macro(cell)}
    laws = [
        level_law(sample, cell, losses=losses)
        for sample in samples
        if (cell := cells.get(sample.cell_id)) is not None
        and (losses or "eirp_dbm" not in cell.assumes)
    ]
    return [law for law in laws if law is not None]


def _network(laws: Sequence[LevelLaw], times: float = 1.0) -> _Network | None:
    if len(laws) < _LEAST_CELLS:
        return None
    return _Network(
        float(np.median([law.slope_db(times) for law in laws])),
        float(np.median([law.below_free_space_db(times).min() for law in laws])),
    )


def _strangeness(network: _Network, factor: float) -> int:
    """Return 2 where no propagation explains levels, 1 where they are unusual, else 0."""
    slope_db, strongest_db = network
    if slope_db > _STEEPEST_DB and strongest_db > _STEEP_BELOW_DB:
        return 2
    if slope_db > _STEEP_DB and strongest_db > _FAR_BELOW_DB:
        return 1
    return int(abs(factor) != 1 and strongest_db < _ABOVE_DB)


def _is_usual(network: _Network) -> bool:
    slope, below = _USUAL_SLOPE_DB, _USUAL_BELOW_DB
    falls = slope[0] <= network.slope_db <= slope[1]
    return falls and below[0] <= network.strongest_db <= below[1]


def _beside(below_db: float) -> str:
    return f"{abs(below_db):.0f} dB {'below' if below_db >= 0 else 'above'} those of"


def is_macro(cell: Cell) -> bool:
    """Return whether a cell has a mast of known height outdoors."""
    return not cell.indoor and "height_m" not in cell.assumes


def lobe(sample: RasterSample, cell: Cell) -> tuple[Floats, Bools]:
    """Return the distance of every pixel (m), and which are known and in the main lobe."""
    ground_m, azimuth_deg = sample.seen_from(cell.east_m, cell.north_m)
    used = ~np.isnan(sample.values) & (ground_m >= _FROM_M)
    if cell.azimuth_deg is not None:
        off_deg = (azimuth_deg - cell.azimuth_deg + 180.0) % 360.0 - 180.0
        used &= np.abs(off_deg) <= cell.beamwidth_deg / 2
    return ground_m, used
