"""A position from one report, in the shape of geolocation services.

Requests have the fields of Google's Geolocation API, which Mozilla's and others share:
``cellTowers`` and ``wifiAccessPoints``; the answer has ``location`` and ``accuracy``, here the
radius that holds 95 % of the true positions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import unproject
from mapfilter.positioning.fingerprints.locating import ReportLocator, locate_by
from mapfilter.positioning.fingerprints.reports import Reports, make_reports
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.identities import LIMITS, technology
from mapfilter.radio.plan_names import PlanNames, ReportedCell
from mapfilter.serving.documents import (
    RequestError,
    as_json,
    check_keys,
    number,
    rows_of,
    text,
    whole,
)
from mapfilter.tracks.schema import NEIGHBOUR, SERVING

_MOST = 100
_BODY = (
    "cellTowers",
    "wifiAccessPoints",
    "homeMobileCountryCode",
    "homeMobileNetworkCode",
    "radioType",
    "carrier",
    "considerIp",
)
_TOWER = (
    "cellId",
    "newRadioCellId",
    "mobileCountryCode",
    "mobileNetworkCode",
    "locationAreaCode",
    "radioType",
    "signalStrength",
    "timingAdvance",
    "age",
    "primaryScramblingCode",
    "psc",
)
_POINT = ("macAddress", "signalStrength", "age", "channel", "signalToNoiseRatio", "ssid")
_LARGEST_AREA, _LARGEST_CI = 2**24 - 1, 2**36 - 1


@dataclass(frozen=True, eq=False)
class Geolocator:
    """Locates single reports by a database; see :func:`mapfilter.serving.geolocate.geolocator`.

    Parameters
    ----------
    fitted : ReportLocator
        The method, over the database.
    names : PlanNames
        Gives cells the ids of the database.
    access_points : mapping of str to str
        Id of each transmitter of the database that is a MAC address, by its hexadecimal digits.
    """

    fitted: ReportLocator
    names: PlanNames
    access_points: Mapping[str, str]

    def answer(self, document: Mapping[str, Any]) -> dict[str, Any]:
        """Return the answer to a request.

        Raises
        ------
        RequestError
            The request has faults (400), or no transmitter in it is in the database (404).
        """
        report = self.report(document)
        located = locate_by(self.fitted, report)
        east_m, north_m = float(located.east_m[0]), float(located.north_m[0])
        if not isfinite(east_m):
            raise RequestError(404, "notFound", f"no position: {located.reason[0]}")
        lon_deg, lat_deg = unproject(located.crs, east_m, north_m)
        radius_m = float(located.radii_m[0, 2])
        return {
            "location": {"lat": float(lat_deg), "lng": float(lon_deg)},
            "accuracy": radius_m if isfinite(radius_m) else None,
        }

    def report(self, document: Mapping[str, Any]) -> Reports:
        """Return a request as a report; the first cell tower is the serving one."""
        faults = Faults()
        check_keys(document, _BODY, "body", faults)
        radio = _radio_type(document.get("radioType"), "radioType", faults)
        home = {"mcc": _code(document, "homeMobileCountryCode", "", faults)}
        home["mnc"] = _code(document, "homeMobileNetworkCode", "", faults)
        ids: list[str] = []
        levels: list[float] = []
        serving, advance = "", nan
        for index, one in enumerate(
            rows_of(document.get("cellTowers"), "cellTowers", faults, _MOST)
        ):
            where = f"cellTowers[{index}]"
            role = NEIGHBOUR if index else SERVING
            cell, level, steps = _tower(one, where, role, radio, home, self.names, faults)
            if cell is not None:
                ids.append(cell)
                levels.append(level)
                if role == SERVING:
                    serving, advance = cell, steps
        points = rows_of(document.get("wifiAccessPoints"), "wifiAccessPoints", faults, _MOST)
        for index, one in enumerate(points):
            digits, level = _access_point(one, f"wifiAccessPoints[{index}]", faults)
            ids.append(self.access_points.get(digits, digits))
            levels.append(level)
        if not ids and not faults.found:
            expected = "at least one entry, as positions are never looked up by address"
            faults.add("cellTowers, wifiAccessPoints", expected, "none")
        if faults.found:
            raise RequestError.of(InputError(tuple(faults.found)))
        return make_reports(
            self.fitted.database.crs,
            np.zeros(len(ids), dtype=np.int64),
            np.array(ids, dtype=str),
            levels,
            count=1,
            serving=[serving],
            timing_advance=[advance],
        )


def geolocator(fitted: ReportLocator, plan: CellPlan) -> Geolocator:
    """Return what answers requests by a fitted method.

    Parameters
    ----------
    plan : CellPlan
        Of the database.
    """
    ids = (*plan.ids, *fitted.database.cell_ids)
    points = {digits: name for name in ids if (digits := _mac_digits(name))}
    return Geolocator(fitted, PlanNames(plan), points)


def _tower(
    one: Mapping[str, Any],
    where: str,
    role: str,
    radio: str | None,
    home: Mapping[str, int | None],
    names: PlanNames,
    faults: Faults,
) -> tuple[str | None, float, float]:
    """Return a tower's id in the database, its level and its timing advance."""
    check_keys(one, _TOWER, where, faults)
    family = _radio_type(one.get("radioType"), f"{where}.radioType", faults) or radio
    mcc = _code(one, "mobileCountryCode", where, faults)
    mnc = _code(one, "mobileNetworkCode", where, faults)
    limits = LIMITS.get(family or "", {})
    lac = None
    if one.get("locationAreaCode") is not None:
        most = limits.get("lac", _LARGEST_AREA)
        place, expected = f"{where}.locationAreaCode", f"a whole number in 0..{most}"
        lac = whole(one["locationAreaCode"], place, expected, faults, 0, most)
    key = "newRadioCellId" if one.get("newRadioCellId") is not None else "cellId"
    most = limits.get("ci", _LARGEST_CI)
    ci = whole(one.get(key), f"{where}.{key}", f"a whole number in 0..{most}", faults, 0, most)
    steps = nan
    if one.get("timingAdvance") is not None:
        place, most = f"{where}.timingAdvance", limits.get("timing_advance", 3846)
        steps = number(one["timingAdvance"], place, f"steps in 0..{most}", faults, 0, most) or 0.0
    level = _level(one, where, faults)
    if ci is None:
        return None, level, steps
    mcc = home["mcc"] if mcc is None else mcc
    mnc = home["mnc"] if mnc is None else mnc
    cell = names.name(ReportedCell(role, None, family, mcc, mnc, lac, ci, None, None))
    return cell, level, steps


def _access_point(one: Mapping[str, Any], where: str, faults: Faults) -> tuple[str, float]:
    check_keys(one, _POINT, where, faults)
    expected = "a MAC address, such as 01:23:45:67:89:ab"
    given = text(one.get("macAddress"), f"{where}.macAddress", expected, faults)
    digits = _mac_digits(given or "")
    if given is not None and not digits:
        faults.add(f"{where}.macAddress", expected, repr(given))
    return digits, _level(one, where, faults)


def _level(one: Mapping[str, Any], where: str, faults: Faults) -> float:
    """Return a level in dBm, NaN where it is not stated."""
    if one.get("signalStrength") is None:
        return nan
    place = f"{where}.signalStrength"
    found = number(one["signalStrength"], place, "dBm in -200..0", faults, -200, 0)
    return nan if found is None else found


def _code(one: Mapping[str, Any], key: str, where: str, faults: Faults) -> int | None:
    if one.get(key) is None:
        return None
    place = f"{where}.{key}" if where else key
    return whole(one[key], place, "a whole number in 0..999", faults, 0, 999)


def _radio_type(value: object, where: str, faults: Faults) -> str | None:
    if value is None:
        return None
    family = technology(value) if isinstance(value, str) else None
    if family is None:
        faults.add(where, "gsm, wcdma, lte or nr", as_json(value))
    return family


def _mac_digits(name: str) -> str:
    """Return the twelve hexadecimal digits of a MAC address, or an empty text.

    Examples
    --------
    >>> _mac_digits("01-23:45:67:89:AB"), _mac_digits("cell-1")
    ('0123456789ab', '')
    """
    digits = name.lower().replace(":", "").replace("-", "").replace(".", "")
    known = len(digits) == 12 and all(one in "0123456789abcdef" for one in digits)
    return digits if known and len(name) in (12, 14, 17) else ""
