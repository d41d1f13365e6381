"""Predicts the levels of cells, and simulates the ground truth that predictions are tested against.

The prediction of a cell is EIRP + antenna gain - path loss + shadowing, at street height; a raster
of building heights decides where there is line of sight and how high the roofs are.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from mapfilter._parallel import Progress
from mapfilter._types import Bools, Floats, Floats32
from mapfilter.errors import Faults, InputError, listed
from mapfilter.geodesy import Lattice, grid_convergence_rad, heading_from_azimuth_rad, unproject
from mapfilter.propagation.line_of_sight import (
    check_heights,
    line_of_sight,
    mean_roof_height,
    own_building,
)
from mapfilter.propagation.models import (
    GroundTruthErrors,
    PredictionModel,
    needs_sight,
    outside_published_range,
    path_loss_db,
    probability_of_sight,
    shortest_distance_m,
)
from mapfilter.propagation.shadowing import correlated_field, named_rng, site_shadowing
from mapfilter.radio.antenna import (
    MeasuredAntenna,
    combined_gain_db,
    leaning,
    sector_gain_db,
    vertical_gain_db,
)
from mapfilter.radio.cell_rules import ANTENNAS
from mapfilter.radio.cells import Cell, CellPlan

Antennas = Mapping[str, MeasuredAntenna]

_MOST_NAMED = 3
_ROUND_DB = 3.0
_NEAR_FREQUENCY = 0.2
_BLOCK_M = 60.0
_ROOF_RADIUS_M = 100.0
_SLOPE_REFERENCE_M = 100.0
_VERTICAL_BEAMWIDTH_DEG = 10.0


def predict(
    plan: CellPlan,
    lattice: Lattice,
    heights_m: Floats32 | None,
    model: PredictionModel,
    progress: Progress | None = None,
    *,
    antennas: Antennas | None = None,
) -> Iterator[tuple[str, Floats32]]:
    """Predict the level of every cell at every pixel's centre, one cell at a time.

    Parameters
    ----------
    plan : CellPlan
        Brought into the lattice's CRS where it is in another.
    heights_m : ndarray of float32, shape (rows, cols), or None
        Heights of buildings above ground, 0 where there is none. Without them every roof has the
        model's default height, and there is no line of sight or, with TR 38.901, the probability of
        its table.
    progress : callable, optional
        Called with (cells done, cells in all).
    antennas : mapping of str to MeasuredAntenna, optional
        The antennas that cells name, see :func:`mapfilter.radio.msi.read_antennas`.

    Yields
    ------
    (str, ndarray of float32, shape (rows, cols))
        Cell id and level in dBm, at the model's mobile height, outdoors; in the plan's order.

    Raises
    ------
    InputError
        The heights do not fit the lattice, or an antenna is not there.
    """
    plan = plan.to_crs(lattice.crs)
    _check_antennas(plan, antennas)
    surroundings = Surroundings.of(lattice, heights_m, model, antennas)
    fields = [_clutter(plan, lattice, model)]
    yield from _levels(plan, surroundings, fields, lambda cell: (cell, 1.0), 0.0, progress)


def simulate_ground_truth(
    plan: CellPlan,
    lattice: Lattice,
    heights_m: Floats32 | None,
    model: PredictionModel,
    errors: GroundTruthErrors,
    progress: Progress | None = None,
    *,
    antennas: Antennas | None = None,
) -> Iterator[tuple[str, Floats32]]:
    """Simulate the ground truth: true levels that differ from the prediction.

    A filter must not be evaluated on its own prediction. EIRP, azimuth and path-loss slope of each
    cell have uniformly drawn errors; shadowing that is independent of the prediction's is added;
    propagation model, street widths and roofs may differ. Every draw depends on the seed and on
    names only: adding a cell changes no other.

    Parameters
    ----------
    plan, lattice, heights_m, model, progress, antennas
        As for :func:`predict`, and the same as the prediction was made with.

    Yields
    ------
    (str, ndarray of float32, shape (rows, cols))
        As :func:`predict`.

    Raises
    ------
    InputError
        The heights do not fit the lattice, or an antenna is not there.
    ConfigError
        The ground truth's propagation model is not possible.
    """
    plan = plan.to_crs(lattice.crs)
    _check_antennas(plan, antennas)
    true_model = errors.truth_of(model)
    if heights_m is not None and errors.roof_error != 0:
        rng = named_rng(errors.seed, "reality", "roofs")
        factor = np.exp(correlated_field(lattice, errors.roof_error, _BLOCK_M, rng))
        heights_m = np.asarray(heights_m * factor, dtype=np.float32)
    surroundings = Surroundings.of(lattice, heights_m, true_model, antennas)
    if errors.clutter == "shared":
        clutter = _clutter(plan, lattice, model)
    else:
        clutter = _clutter(plan, lattice, replace(model, seed=errors.seed), "reality clutter")
    fields = [clutter, _shadowing(plan, lattice, errors)]

    def perturbed(cell: Cell) -> tuple[Cell, float]:
        rng = named_rng(errors.seed, "reality", "offsets", cell.id)
        eirp, azimuth, slope = rng.uniform(-1, 1, 3)
        azimuth_deg = cell.azimuth_deg
        if azimuth_deg is not None:
            azimuth_deg = (azimuth_deg + errors.azimuth_error_deg * azimuth) % 360.0
        eirp_dbm = cell.eirp_dbm + errors.eirp_error_db * eirp
        real = replace(cell, eirp_dbm=eirp_dbm, azimuth_deg=azimuth_deg)
        return real, 1.0 + errors.slope_error * slope

    yield from _levels(plan, surroundings, fields, perturbed, errors.offset_db, progress)


def _levels(
    plan: CellPlan,
    surroundings: Surroundings,
    fields: list[Iterator[Floats32]],
    perturbed: Callable[[Cell], tuple[Cell, float]],
    offset_db: float,
    progress: Progress | None,
) -> Iterator[tuple[str, Floats32]]:
    """Yield each cell's id and level: its median level and, added to it, what was drawn."""
    sights = surroundings.sights(plan)
    for done, (cell, sight, *drawn) in enumerate(
        zip(plan.cells, sights, *fields, strict=True), start=1
    ):
        level_dbm = surroundings.median_level_dbm(*perturbed(cell), sight) + offset_db
        for field_db in drawn:
            level_dbm = level_dbm + field_db
        if progress is not None:
            progress(done, len(plan))
        yield cell.id, np.asarray(level_dbm, dtype=np.float32)


def _clutter(
    plan: CellPlan, lattice: Lattice, model: PredictionModel, stream: str = "prediction"
) -> Iterator[Floats32]:
    drawn = (model.shadowing_db, model.shadowing_correlation_m, model.site_share, model.seed)
    for _, field_db in site_shadowing(plan, lattice, *drawn, stream=stream):
        yield field_db


def _shadowing(plan: CellPlan, lattice: Lattice, errors: GroundTruthErrors) -> Iterator[Floats32]:
    """Draw the ground truth's shadowing of each cell: a part that lasts, and a local one."""
    parts = (
        (1.0 - errors.local_share, errors.correlation_m, "reality"),
        (errors.local_share, errors.local_correlation_m, "reality local"),
    )
    fields = []
    for share, correlation_m, stream in parts:
        if share > 0:
            drawn = (errors.level_error_db * share**0.5, correlation_m, errors.site_share)
            fields.append(site_shadowing(plan, lattice, *drawn, errors.seed, stream=stream))
    for both in zip(*fields, strict=True):
        yield np.sum([field_db for _, field_db in both], axis=0, dtype=np.float32)


@dataclass(frozen=True)
class Surroundings:
    """The buildings of an area, and the model by which cells are received there."""

    lattice: Lattice
    heights_m: Floats32 | None
    roof_height_m: Floats32
    model: PredictionModel
    antennas: Antennas = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        lattice: Lattice,
        heights_m: Floats32 | None,
        model: PredictionModel,
        antennas: Antennas | None = None,
    ) -> Surroundings:
        """Check the heights, and average the roofs around every pixel."""
        default_m = model.default_roof_height_m
        if heights_m is None:
            roofs = np.full((lattice.rows, lattice.cols), default_m, dtype=np.float32)
            return cls(lattice, None, roofs, model, antennas or {})
        heights = check_heights(heights_m, lattice)
        roofs = mean_roof_height(heights, lattice, _ROOF_RADIUS_M, default_m)
        return cls(lattice, heights, roofs, model, antennas or {})

    def sights(self, plan: CellPlan) -> Iterator[Floats32]:
        """Yield the line of sight of each cell, computed once for all cells of a mast."""
        masts = [(cell.east_m, cell.north_m, cell.height_m) for cell in plan.cells]
        waiting = Counter(masts)
        known: dict[tuple[float, float, float], Floats32] = {}
        for mast in masts:
            if mast not in known:
                known[mast] = self.sight(mast)
            waiting[mast] -= 1
            yield known[mast] if waiting[mast] else known.pop(mast)

    def sight(self, mast: tuple[float, float, float]) -> Floats32:
        """Return 1 where there is line of sight to a mast, 0 elsewhere, or its probability."""
        if not needs_sight(self.model):
            return np.zeros((self.lattice.rows, self.lattice.cols), dtype=np.float32)
        if self.heights_m is None or self.model.line_of_sight == "probability":
            probability = probability_of_sight(self.model, np.hypot(*self._offsets_m(*mast[:2])))
            return np.asarray(probability, dtype=np.float32)
        seen = line_of_sight(self.heights_m, self.lattice, mast, self.model.mobile_height_m)
        return seen.astype(np.float32)

    def median_level_dbm(self, cell: Cell, slope_factor: float, sight: Floats32) -> Floats:
        """Return the level without shadowing.

        Parameters
        ----------
        slope_factor : float
            Multiplies the path loss per decade of distance; the loss at 100 m stays.
        sight : ndarray of float32, shape (rows, cols)
            From :meth:`sight`.
        """
        right_m, up_m = self._offsets_m(cell.east_m, cell.north_m)
        distance_m = np.maximum(np.hypot(right_m, up_m), shortest_distance_m(self.model))
        # The loss goes by lg d, so stretching lg(d / 100 m) stretches its slope alone.
        stretched_m = _SLOPE_REFERENCE_M * (distance_m / _SLOPE_REFERENCE_M) ** slope_factor
        loss_db = path_loss_db(
            self.model, stretched_m, cell.frequency_mhz, cell.height_m, self.roof_height_m, sight
        )
        level_dbm = cell.eirp_dbm - loss_db + self._gain_db(cell, right_m, up_m)
        if cell.indoor:
            inside: Bools = np.zeros((self.lattice.rows, self.lattice.cols), dtype=np.bool_)
            if self.heights_m is not None:
                inside = own_building(self.heights_m, self.lattice, cell.east_m, cell.north_m)
            level_dbm -= np.where(inside, 0.0, cell.penetration_loss_db)
        return np.asarray(level_dbm)

    def _offsets_m(self, east_m: float, north_m: float) -> tuple[Floats, Floats]:
        """Return how far east and north of a place the columns and rows are."""
        column_m, _ = self.lattice.east_north(0, np.arange(self.lattice.cols))
        _, row_m = self.lattice.east_north(np.arange(self.lattice.rows), 0)
        return (column_m - east_m)[None, :], (row_m - north_m)[:, None]

    def _gain_db(self, cell: Cell, right_m: Floats, up_m: Floats) -> Floats:
        """Return the antenna's gain against its boresight."""
        if cell.antenna == "omni":
            return np.zeros(())
        lon_deg, lat_deg = unproject(self.lattice.crs, cell.east_m, cell.north_m)
        convergence = grid_convergence_rad(self.lattice.crs, float(lon_deg), float(lat_deg))
        # Without an azimuth the antenna is round, and any boresight will do.
        heading_rad = heading_from_azimuth_rad(cell.azimuth_deg or 0.0, convergence)
        offset_rad = np.arctan2(up_m, right_m) - heading_rad
        below_m = cell.height_m - self.model.mobile_height_m
        depression_rad = np.arctan2(below_m, np.hypot(right_m, up_m))
        own = leaning(offset_rad, depression_rad, np.radians(cell.mechanical_downtilt_deg))
        measured = self.antennas.get(cell.antenna)
        if measured is not None:
            return measured.gain_db(*own, cell.downtilt_deg or None)
        beamwidth_rad = np.radians(cell.beamwidth_deg)
        vertical_deg = cell.vertical_beamwidth_deg
        if vertical_deg is None and cell.antenna == "3gpp":
            vertical_deg = _VERTICAL_BEAMWIDTH_DEG
        if vertical_deg is None:
            return sector_gain_db(offset_rad, beamwidth_rad, cell.max_attenuation_db)
        tilt_rad, vertical_rad = np.radians(cell.downtilt_deg), np.radians(vertical_deg)
        return combined_gain_db(
            sector_gain_db(own[0], beamwidth_rad, cell.max_attenuation_db),
            vertical_gain_db(own[1], tilt_rad, vertical_rad, cell.side_lobe_db),
            cell.max_attenuation_db,
        )


def outside_validity(plan: CellPlan, lattice: Lattice, model: PredictionModel) -> tuple[str, ...]:
    """Return remarks on what lies outside the model's published range, and for which cells."""
    alike: dict[tuple[float, float], list[Cell]] = defaultdict(list)
    for cell in plan.to_crs(lattice.crs).cells:
        alike[cell.frequency_mhz, cell.height_m].append(cell)
    west, south, east, north = lattice.bounds_m
    ids: dict[str, list[str]] = defaultdict(list)
    for (frequency_mhz, height_m), cells in alike.items():
        east_m, north_m = np.array([(cell.east_m, cell.north_m) for cell in cells]).T
        beside_m, below_m = east_m - east_m.clip(west, east), north_m - north_m.clip(south, north)
        across_m = np.maximum(abs(east_m - west), abs(east_m - east))
        along_m = np.maximum(abs(north_m - south), abs(north_m - north))
        used = {
            "frequency_mhz": frequency_mhz,
            "base_height_m": height_m,
            "mobile_height_m": model.mobile_height_m,
            "distance_m": round(float(np.hypot(across_m, along_m).max())),
        }
        closest_m = round(float(np.hypot(beside_m, below_m).min()))
        nearest_m = max(closest_m, shortest_distance_m(model))
        for note in outside_published_range(model.model, used, nearest_m):
            ids[note].extend(cell.id for cell in cells)
    return tuple(f"{_named(names)}: {note}" for note, names in ids.items())


def off_frequency(plan: CellPlan, antennas: Antennas) -> tuple[str, ...]:
    """Return remarks on cells whose antenna was measured at a frequency far from theirs."""
    ids: dict[str, list[str]] = defaultdict(list)
    for cell in plan.cells:
        measured = antennas.get(cell.antenna)
        if measured is None or measured.frequency_mhz is None:
            continue
        if abs(cell.frequency_mhz / measured.frequency_mhz - 1) > _NEAR_FREQUENCY:
            note = f"antenna {cell.antenna!r} was measured at {measured.frequency_mhz:g} MHz"
            ids[note].append(cell.id)
    return tuple(f"{_named(names)}: {note}" for note, names in ids.items())


def _named(ids: list[str]) -> str:
    if len(ids) == 1:
        return f"cell {ids[0]!r}"
    return f"{len(ids)} cells ({listed([repr(name) for name in ids], _MOST_NAMED)})"


def _check_antennas(plan: CellPlan, antennas: Antennas | None) -> None:
    """Check that every antenna is there, and that those that point have an azimuth."""
    faults = Faults()
    for cell in plan.cells:
        if cell.antenna in ANTENNAS:
            continue
        where = f"cell {cell.id!r}, antenna"
        measured = (antennas or {}).get(cell.antenna)
        if measured is None:
            expected = f"{', '.join(ANTENNAS)}, or a pattern that was read"
            faults.add(where, expected, repr(cell.antenna), "misspelt, or no folder of antennas")
        elif cell.azimuth_deg is None and np.ptp(measured.horizontal_loss_db) > _ROUND_DB:
            expected = "an azimuth, as the antenna is not alike all around"
            faults.add(f"cell {cell.id!r}, azimuth_deg", expected, "nothing")
    faults.raise_if_any(InputError)
