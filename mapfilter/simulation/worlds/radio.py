"""The levels at which cells are received: path loss, antennas, street canyons, shadowing.

A level is EIRP + antenna gain - path loss + guiding by the street + shadowing, everywhere in the
plane. Shadowing has three independent parts:

*area*
    of blocks and terrain, the same for all sectors of a site, and in part for all sites. Studies
    of LTE put the correlation between sites at 0.5 and that between the sectors of a site at 1
    (SEAMCAT handbook, section 9.11, after 3GPP TR 36.942).
*street*
    of the street's own facades: one field for each street and site, read at the foot on the centre
    line, so that it changes along a street, not across it, and from street to street. Where streets
    meet, their fields are mixed by nearness.
*own*
    of each cell's own reflections.

Fields are sums of sinusoids (:mod:`mapfilter.simulation.worlds.sinusoids`). Streets that point to
the site guide the wave: levels there are higher than in streets across, by 10 to 20 dB at 850 MHz
close to the site and less farther away (Reudink, in Jakes 1974, *Microwave Mobile Communications*,
section 2.2.3.3); here by ``guiding_db`` without line of sight.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from annotated_types import Ge, Le

from mapfilter._types import Floats, Floats32, Ints
from mapfilter.angles import heading_from_azimuth_rad
from mapfilter.geodesy import grid_convergence_rad, unproject
from mapfilter.lattice import Lattice
from mapfilter.options import NotNegative, Options, Positive, Share
from mapfilter.propagation.shadowing import named_rng
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.simulation.worlds.path_loss import (
    Mast,
    fresnel_parameter,
    knife_edge_db,
    pattern_db,
    roof_loss_db,
    sight_loss_db,
    street_loss_db,
)
from mapfilter.simulation.worlds.sinusoids import SinusoidField
from mapfilter.simulation.worlds.street_lines import Feet, StreetLines

_STREET_REACH_M = 40.0
_STREET_SD_M = 8.0
_BETWEEN_STREETS = 0.05
_BELOW_ROOFS_M = 8.0
_SLOPE_FROM_M = 100.0
_RECEIVED_DBM = -104.0


@dataclass(frozen=True, slots=True)
class RadioModel(Options):
    """How the cells of a plan are received; defaults are those of the foreign world.

    Parameters
    ----------
    area_sd_db : float
        Standard deviation of the shadowing of blocks and terrain.
    area_length_m : float
        Its correlation length.
    between_sites : float
        Its correlation between two sites, 0..1.
    street_sd_db : float
        Standard deviation of the shadowing of streets.
    street_length_m : float
        Its correlation length along a street.
    own_sd_db : float
        Standard deviation of each cell's own shadowing.
    own_length_m : float
        Its correlation length.
    guiding_db : float
        By how much levels in a street that points to the site exceed those in one across, without
        line of sight.
    eirp_sd_db : float
        Standard deviation of a cell's EIRP about the plan's: cables, ageing, power steps.
    azimuth_sd_deg : float
        Standard deviation of a sector's azimuth about the plan's.
    slope_sd : float
        Standard deviation of a site's path-loss slope, as a fraction of it.

    Raises
    ------
    ConfigError
        With every value that is out of range.
    """

    area_sd_db: NotNegative = 4.0
    area_length_m: Positive = 90.0
    between_sites: Share = 0.5
    street_sd_db: NotNegative = 3.5
    street_length_m: Positive = 40.0
    own_sd_db: NotNegative = 2.0
    own_length_m: Positive = 12.0
    guiding_db: NotNegative = 6.0
    eirp_sd_db: NotNegative = 1.5
    azimuth_sd_deg: NotNegative = 4.0
    slope_sd: Annotated[float, Ge(0), Le(0.5)] = 0.03


@dataclass(frozen=True, eq=False)
class Radio:
    """The cells of a plan as they are received in one city.

    Parameters
    ----------
    plan : CellPlan
        As it was planned; what is received differs from it.
    lattice : Lattice
        Of the buildings.
    heights_m : (rows, cols) array or None
        Of buildings.
    streets : StreetLines
    model : RadioModel
    seed : int
        Of every draw, each from a stream of its own: adding a cell changes no other.
    offsets_db : tuple of float
        Added to the levels of outdoor and of indoor cells: the means by which the path loss differs
        from that of a prediction, which drive tests would have taken out, see
        :func:`planners_offsets_db`.
    """

    plan: CellPlan
    lattice: Lattice
    heights_m: Floats32 | None
    streets: StreetLines
    model: RadioModel
    seed: int
    offsets_db: tuple[float, float] = (0.0, 0.0)

    def levels_dbm(self, east_m: Floats, north_m: Floats) -> Floats:
        """Return the local mean levels at positions, shape (N, cells), fast fading averaged out."""
        return self.median_dbm(east_m, north_m) + self.shadowing_db(east_m, north_m)

    def median_dbm(self, east_m: Floats, north_m: Floats) -> Floats:
        """Return the levels without shadowing, shape (N, cells)."""
        feet = self._feet(east_m, north_m)
        edges: dict[tuple[Mast, float], Floats] = {}
        found = np.empty((east_m.size, len(self.plan)))
        for column, cell in enumerate(self.plan.cells):
            mast = Mast(cell.east_m, cell.north_m, cell.height_m)
            key = mast, cell.frequency_mhz
            if key not in edges:
                fresnel = fresnel_parameter(
                    self.heights_m, self.lattice, mast, east_m, north_m, cell.frequency_mhz
                )
                edges[key] = knife_edge_db(fresnel)
            found[:, column] = self._median_of(cell, edges[key], feet, east_m, north_m)
        offsets_db = np.array([self.offsets_db[cell.indoor] for cell in self.plan.cells])
        return np.asarray(found + offsets_db)

    def shadowing_db(self, east_m: Floats, north_m: Floats) -> Floats:
        """Return the shadowing at positions, shape (N, cells)."""
        model = self.model
        feet = self._feet(east_m, north_m)
        area, street = {}, {}
        for site in dict.fromkeys(cell.site for cell in self.plan.cells):
            area[site] = model.area_sd_db * self._area(site, east_m, north_m)
            street[site] = model.street_sd_db * self._street(site, feet, east_m, north_m)
        found = np.empty((east_m.size, len(self.plan)))
        for column, cell in enumerate(self.plan.cells):
            own = self._field(model.own_length_m, "own", cell.id).at(east_m, north_m)
            found[:, column] = area[cell.site] + street[cell.site] + model.own_sd_db * own
        return found

    def _median_of(
        self, cell: Cell, edge_db: Floats, feet: Feet, east_m: Floats, north_m: Floats
    ) -> Floats:
        model, rng = self.model, named_rng(self.seed, "foreign", "cell", cell.id)
        eirp_db, azimuth_deg = rng.standard_normal(2) * [model.eirp_sd_db, model.azimuth_sd_deg]
        ripple_rad = float(rng.uniform(0.0, 2 * np.pi))
        site_rng = named_rng(self.seed, "foreign", "slope", cell.site)
        slope = 1.0 + model.slope_sd * float(site_rng.standard_normal())
        right, up = east_m - cell.east_m, north_m - cell.north_m
        distance = _SLOPE_FROM_M * (np.hypot(right, up) / _SLOPE_FROM_M) ** slope
        sight_db = sight_loss_db(distance, cell.frequency_mhz, cell.height_m)
        low = cell.height_m <= _BELOW_ROOFS_M
        hidden = street_loss_db if low else roof_loss_db
        hidden_db = hidden(distance, cell.frequency_mhz)
        excess_db = np.clip(edge_db, 0.0, np.maximum(hidden_db - sight_db, 0.0))
        level = cell.eirp_dbm + eirp_db - sight_db - excess_db
        bearing_rad = np.arctan2(up, right)
        if not low:
            level += self._guiding_db(feet, bearing_rad) * np.minimum(edge_db / 6.0, 1.0)
        if cell.indoor:
            level -= cell.penetration_loss_db
        if cell.azimuth_deg is not None and cell.antenna != "omni":
            boresight = self._heading_rad(cell, cell.azimuth_deg + float(azimuth_deg))
            offset = bearing_rad - boresight
            offset = (offset + np.pi) % (2 * np.pi) - np.pi
            level += pattern_db(offset, cell.beamwidth_deg, cell.max_attenuation_db, ripple_rad)
        return np.asarray(level)

    def _heading_rad(self, cell: Cell, azimuth_deg: float) -> float:
        lon_deg, lat_deg = unproject(self.lattice.crs, cell.east_m, cell.north_m)
        convergence = grid_convergence_rad(self.lattice.crs, float(lon_deg), float(lat_deg))
        return float(heading_from_azimuth_rad(azimuth_deg % 360.0, convergence))

    def _feet(self, east_m: Floats, north_m: Floats) -> Feet:
        return self.streets.near(east_m, north_m, _STREET_REACH_M)

    def _guiding_db(self, feet: Feet, bearing_rad: Floats) -> Floats:
        """Return the guiding by the streets near by: + half along the path, - half across it."""
        angle = self.streets.direction_rad[feet.edge] - bearing_rad[feet.position]
        weight = _nearness(feet.distance_m)
        total = np.full(bearing_rad.shape, _BETWEEN_STREETS)
        guided = np.zeros(bearing_rad.shape)
        np.add.at(total, feet.position, weight)
        np.add.at(guided, feet.position, weight * np.cos(2 * angle))
        return np.asarray(0.5 * self.model.guiding_db * guided / total)

    def _area(self, site: str, east_m: Floats, north_m: Floats) -> Floats:
        share, length_m = self.model.between_sites, self.model.area_length_m
        common = self._field(length_m, "area").at(east_m, north_m)
        own = self._field(length_m, "area", site).at(east_m, north_m)
        return np.asarray(np.sqrt(share) * common + np.sqrt(1.0 - share) * own)

    def _street(self, site: str, feet: Feet, east_m: Floats, north_m: Floats) -> Floats:
        """Return the shadowing of the streets near by, of unit variance."""
        length_m = self.model.street_length_m
        power = np.full(east_m.shape, _BETWEEN_STREETS**2)
        found = _BETWEEN_STREETS * self._field(length_m, "between", site).at(east_m, north_m)
        for way, which in self._by_way(feet):
            field = self._field(length_m, "street", site, str(way))
            position = feet.position[which]
            weight = _nearness(feet.distance_m[which])
            found[position] += weight * field.at(feet.east_m[which], feet.north_m[which])
            power[position] += weight**2
        return np.asarray(found / np.sqrt(power))

    def _by_way(self, feet: Feet) -> Iterator[tuple[int, Ints]]:
        """Yield each way and, for each position near it, its nearest foot."""
        way = self.streets.network.way_id[feet.edge]
        order = np.lexsort((feet.distance_m, feet.position, way))
        first = np.ones(order.size, dtype=bool)
        first[1:] = (np.diff(way[order]) != 0) | (np.diff(feet.position[order]) != 0)
        order = order[first]
        starts = np.flatnonzero(np.diff(way[order], prepend=-1))
        for which in np.split(order, starts[1:]):
            if which.size:
                yield int(way[which[0]]), which

    def _field(self, length_m: float, *names: str) -> SinusoidField:
        key: tuple[float | str, ...] = (length_m, *names)
        if key not in self._fields:
            rng = named_rng(self.seed, "foreign", *names)
            self._fields[key] = SinusoidField.draw(length_m, rng)
        return self._fields[key]

    @cached_property
    def _fields(self) -> dict[tuple[float | str, ...], SinusoidField]:
        return {}


def planners_offsets_db(
    plan: CellPlan,
    lattice: Lattice,
    heights_m: Floats32 | None,
    streets: StreetLines,
    predicted_dbm: Floats,
    east_m: Floats,
    north_m: Floats,
) -> tuple[float, float]:
    """Return by how much predictions exceed the world's median levels on average.

    Planners tune a model's constant with drive tests, outdoor and indoor cells apart. Nothing that
    is drawn at random goes in.

    Parameters
    ----------
    predicted_dbm : (N, cells) array
        Levels predicted from the true plan at the positions; NaN where there are none.
    east_m, north_m : (N,) arrays
        Positions on the streets.

    Returns
    -------
    outdoor_db, indoor_db : float
    """
    plainly = RadioModel(guiding_db=0.0, eirp_sd_db=0.0, azimuth_sd_deg=0.0, slope_sd=0.0)
    radio = Radio(plan, lattice, heights_m, streets, plainly, seed=0)
    median_dbm = radio.median_dbm(east_m, north_m)
    received = (median_dbm >= _RECEIVED_DBM) & (predicted_dbm >= _RECEIVED_DBM)
    found = []
    for kind in (False, True):
        own = received & np.array([cell.indoor == kind for cell in plan.cells])
        excess_db = (predicted_dbm - median_dbm)[own]
        found.append(float(np.mean(excess_db)) if excess_db.size else 0.0)
    return found[0], found[1]


def _nearness(distance_m: Floats) -> Floats:
    return np.asarray(np.exp(-0.5 * (distance_m / _STREET_SD_M) ** 2))
