"""Findings of a check: fault, place, evidence and remedy."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import groupby
from operator import attrgetter
from typing import Literal, Self, get_args

from mapfilter.errors import Fault, MapfilterError
from mapfilter.radio.cell_places import ZONE_IN_FRONT

Severity = Literal["error", "warning", "note"]
"""The worst one first."""

_MOST_ALIKE = 3

REMEDIES = {
    "antenna-frequency": "Name the pattern measured for the cell's band.",
    "antenna-invalid": "Correct the pattern file, or take another.",
    "antenna-missing": "Put the pattern file into the folder cells.antennas, or correct the name.",
    "area-invalid": "Correct the area; a box is west, south, east, north in degrees.",
    "area-outside-map": 'Take a map of the area, correct the area, or set area.map = "none" where '
    "layers, tracks or land use replace it.",
    "axes-swapped": "Export the rasters anew with rows from north to south and columns from west "
    "to east.",
    "azimuth-counter-clockwise": "Turn the azimuths into degrees clockwise from true north.",
    "azimuth-off-by-90": "Count azimuths from true north (0), with east at 90.",
    "azimuth-off-by-180": "Give the direction into which the antenna radiates, clockwise from "
    "true north.",
    "azimuth-off-lobe": "Correct the azimuth, or take the raster that belongs to the cell.",
    "azimuth-gons": "Turn the azimuths into degrees: 0.9 times as many.",
    "azimuth-radians": "Turn the azimuths into degrees.",
    "band-labels-swapped": "Exchange the labels of the rasters of the two bands, or correct "
    "frequency or EIRP in the plan.",
    "cell-without-raster": "Add the rasters, or take the cells out of the plan.",
    "code-reused-nearby": "Correct carrier (arfcn) or code (bsic) of one of them, or take out "
    "the cell that is no more; filters weigh a neighbour less that may be either.",
    "crs-mixed": "Set the CRS that the numbers were made in (cells.crs, rasters.crs, "
    "area.crs), or project the file.",
    "datum-shifted": "Name the CRS that the numbers were made in: cells.crs, "
    "rasters.crs (ED50: EPSG:4230, in UTM zones EPSG:230xx).",
    "degrees-for-metres": "Name columns of degrees lat and lon, or give metres in a projected CRS; "
    "of rasters by gdalwarp -t_srs EPSG:….",
    "duplicate-id": "Give each cell an id of its own.",
    "east-north-swapped": "Exchange the columns east and north.",
    "eirp-missing": "Name the column of the EIRP in cells.columns.eirp_dbm, or set cells.eirp_dbm, "
    "which is then taken for all cells without one.",
    "eirp-of-carrier": "Give the EIRP of one subcarrier, as phones report it: that of the carrier "
    "less 10 log10 of the number of subcarriers, 28 to 35 dB. Levels are too high by that.",
    "eirp-watts": "Turn watts into dBm, 10 log10(1000 W), antenna gain included.",
    "feet-for-metres": "Give metres: a foot is 0.3048 m, and a US survey foot 0.3048006 m.",
    "field-strength": "Export received levels in dBm, not field strengths (dBµV/m).",
    "frequency-unit": "Give the frequency in MHz.",
    "half-pixel-shift": "Find out whether the exporter wrote centres for corners of pixels; if so, "
    "move the raster by half a pixel.",
    "identity-repeated": "Correct mcc, mnc, lac or ci of all but one, or take out the cell "
    "that is no more.",
    "identical-rasters": "Export the raster of each cell anew (likely: one was copied over the "
    "other), or correct the plan, by which they differ.",
    "index-shifted": "Move FILE_NAME and the columns after it by one row.",
    "journeys-disagree": "Look at the cell; mapfilter learn proposes a patch with the evidence.",
    "journeys-off-map": "Add the way to the map; mapfilter learn proposes a patch.",
    "journeys-unlisted-cell": "Add the cell to the plan, and build again.",
    "journeys-unused": "Take logs with levels and motion, along ways of the map; mapfilter learn "
    "lists the trust in each.",
    "landuse-classes": "Add the classes to the table, or export the raster without blending.",
    "landuse-invalid": "Correct the land-use raster or its table.",
    "landuse-outside": "Take the land-use raster of this area.",
    "level-as-loss": 'Set rasters.quantity = "level".',
    "levels-without-sign": 'Levels in dBm whose sign was lost: set rasters.quantity = "level" and '
    "rasters.factor = -1. Losses that include the gain of the antenna: take it out of the plan's "
    "EIRP, too.",
    "levels-above-eirp": "Check the EIRP, or what the rasters hold.",
    "log-cells-unknown": "Take the plan of the network that was received, with mcc, mnc, lac and "
    "ci, or name the cells in the log by the plan's ids. Cells of another network, as of a second "
    "SIM, are not used.",
    "log-degrees-rounded": "Export positions with five decimals or more of a degree; with three "
    "they lie in steps of 100 m.",
    "log-headings": "Give headings in radians counter-clockwise from grid east: pi/2 minus a "
    "compass azimuth in radians; mapfilter convert reads a column of degrees as compass_deg. "
    "track.factors.heading_rad = 1 takes them as they are.",
    "log-invalid": "Correct the log or recording, or its settings in [track].",
    "log-mirrored": "Correct the sign or the order of latitude and longitude, or give azimuths "
    "clockwise from north. track.factors.heading_rad = 1 takes them as they are.",
    "log-outside-area": "Take a log of this area, or the area of this log.",
    "log-ranges": "Give differences in metres, how much farther the cell is than the other one, "
    "and timing advances in steps, with the technology.",
    "log-rows-unused": "Look at the lines named; mapfilter convert lists all reasons.",
    "log-speeds": "Give lengths in metres; if a vehicle moved, set filter.bayes.vehicle = true.",
    "log-steps": "Give the metres moved in each interval: lengths in metres, not speeds and not in "
    "feet; a recording with a column speed_kmh or speed_mps is read as such by mapfilter convert. "
    "track.factors.step_m multiplies them; 1 takes them as they are.",
    "log-turns": "Give the change of heading in each interval, in radians, counter-clockwise "
    "positive; mapfilter convert reads columns turn_deg, yaw_rate_radps and yaw_rate_degps. "
    "track.factors.turn_rad multiplies them: -1 turns them round, 1 takes them as they are.",
    "log-without-motion": "Add a recording of steps, odometry or a fused track (track.recordings), "
    "or set track.course_motion; without motion only GNSS locates.",
    "lon-lat-swapped": "Exchange longitude and latitude.",
    "loss-as-level": 'Set rasters.quantity = "loss"; levels are then taken from the EIRP.',
    "map-invalid": "Correct area.map.",
    "measurements-invalid": "Correct the files of prediction.survey, or their settings.",
    "measurements-without-times": "Write times in ISO 8601 or as Unix seconds; without them "
    "sessions are not told apart, and tracks have no order.",
    "metres-for-degrees": "Name columns of metres east and north, or give degrees.",
    "nodata-as-level": "Set rasters.nodata, or write the raster with its nodata value.",
    "plan-invalid": "Correct the field.",
    "quantity-unknown": "Set rasters.quantity: level (dBm) or loss (dB).",
    "raster-constant": "Export the raster anew.",
    "raster-displaced": "Export the raster anew, or correct the corner in its header.",
    "raster-empty": "Export the raster anew, or take the cell out.",
    "raster-upside-down": "Write row 0 in the north and column 0 in the west.",
    "plan-columns": "Name the columns that are of use in [cells.columns].",
    "raster-factor": "Set rasters.factor to the dB per stored unit, as the planning tool's export "
    "states it; if it is right, check the EIRP in the plan.",
    "raster-without-cell": "Add the cells to the plan, or move the rasters to another folder: "
    "those of terrain or clutter are none of a cell.",
    "rasters-invalid": "Correct or export the raster anew.",
    "rasters-missing": "Run `mapfilter predict`, or correct rasters.path.",
    "ground-truth-missing": "Correct rasters.ground_truth, or leave it out and predict.",
    "roads-invalid": "Correct the layer of roads, or its settings.",
    "roads-outside-rasters": "Take rasters, map and area of the same place; build leaves out roads "
    "without rasters.",
    "rxlev-as-level": "Turn RXLEV into dBm (RXLEV - 110.5), or export levels.",
    "rxlev-as-loss": "Turn RXLEV into dBm (RXLEV - 110.5) and set quantity level.",
    "sector-labels-swapped": "Exchange the labels of the rasters, or the azimuths in the plan.",
    "site-labels-swapped": "Exchange the labels of the rasters, or the positions in the plan.",
    "site-off-peak": "Correct the site's position, or take the raster that belongs to the cell.",
    "site-outside-area": "Leave cells in the plan that are received in the area from beyond it; "
    "correct positions that are wrong.",
    "tilts-upwards": "Change the sign of the tilts: downtilts are positive below the horizon.",
    "values-implausible": "Check rasters.factor and rasters.quantity.",
    "ways-with-gaps": "Read the rasters on pixels of 10 m or less (rasters.resolution_m; of those "
    "that mapfilter predicts, area.resolution_m). Half widths of half a pixel close the gaps, but "
    "the filter bayes does not follow ways on coarser pixels.",
}
"""Remedies by code."""

_BY_HINT = {
    "longitude and latitude swapped": "lon-lat-swapped",
    "metres given for degrees": "metres-for-degrees",
    "degrees given for metres": "degrees-for-metres",
    "east and north swapped": "east-north-swapped",
    ZONE_IN_FRONT: "crs-mixed",
    "another CRS": "crs-mixed",
    "feet given for metres": "feet-for-metres",
    "gons given for degrees": "azimuth-gons",
    "radians given for degrees": "azimuth-radians",
    "watts or milliwatts given for dBm": "eirp-watts",
    "GHz given for MHz": "frequency-unit",
    "Hz given for MHz": "frequency-unit",
    "a row given twice": "duplicate-id",
    "a cell of several carriers or antennas; give each its own id, or keep one": "duplicate-id",
    "a cell of another place, or another CRS": "crs-mixed",
    "two systems mixed up": "crs-mixed",
    "another zone": "crs-mixed",
    "the CRS of the rasters, or of the area, is of another zone": "crs-mixed",
    "raster of another zone": "crs-mixed",
    "a CRS of another region": "crs-mixed",
    "a CRS of another region, or Web Mercator": "crs-mixed",
    "east and north exchanged: systems may name north first, files hold east": "axes-swapped",
    "a raster upside down or mirrored; gdalwarp turns it": "raster-upside-down",
    "set quantity = level or loss": "quantity-unknown",
    "misspelt, or no folder of antennas": "antenna-missing",
    "a class left out, or colours blended by compression or resampling": "landuse-classes",
    "wrong table": "landuse-classes",
    "raster of another area": "landuse-outside",
    "the area lies outside the map; name another, or none where other files replace it": (
        "area-outside-map"
    ),
    "no folder of antennas there": "antenna-missing",
    "half a pixel: a corner where the header has to hold the pixel's centre": "half-pixel-shift",
}
_BY_EXPECTED = {
    "each cell once": "duplicate-id",
    "a pattern file": "antenna-missing",
}
_OF_HEADER = "Correct the header, or name its columns in [cells.columns]."
_OF_FILES = {
    "a readable file": "Correct the path, or put the file there.",
    "a header line and rows": "Take another file, or export this one anew.",
    "at least one cell": "Take another file, or export this one anew.",
}
"""Remedies by what was expected of a whole file."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault, or a suspected fault, of the inputs of a configuration.

    Parameters
    ----------
    code : str
        A short name that programs can rely on.
    severity : {"error", "warning", "note"}
        Errors stop a command or spoil its result; what a note says is usual.
    where : str
        File, cells or fields.
    evidence : str
        What was found, in numbers.
    """

    code: str
    severity: Severity
    where: str
    evidence: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.severity} {self.code}: {self.where}: {self.evidence} {self.remedy}"


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The findings of a check, errors first, and whether none of them is an error."""

    ok: bool
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, findings: Iterable[Finding]) -> Self:
        """Put findings in order, those that are alike as they came."""
        severities = get_args(Severity)
        ordered = sorted(findings, key=lambda finding: severities.index(finding.severity))
        return cls(all(finding.severity != "error" for finding in ordered), tuple(ordered))


@dataclass(slots=True)
class Findings:
    """Collects findings."""

    found: list[Finding] = field(default_factory=list)

    def add(
        self,
        code: str,
        where: str,
        evidence: str,
        severity: Severity = "error",
        remedy: str = "",
    ) -> None:
        """Note one finding; its remedy is the one of its code, where no other one is given."""
        finding = Finding(code, severity, where, evidence, remedy or REMEDIES[code])
        if finding not in self.found:
            self.found.append(finding)

    def add_faults(
        self, error: MapfilterError, otherwise: str, severity: Severity = "error"
    ) -> None:
        """Note the faults of reading an input; ``otherwise`` is the code of unspecific ones."""
        for fault in error.faults:
            hint = f" ({fault.hint})" if fault.hint else ""
            evidence = f"Expected {fault.expected}, found {fault.got}{hint}."
            code = _code(fault, otherwise)
            self.add(code, fault.where, evidence, severity, _remedy(code, fault))

    def result(self) -> CheckResult:
        """Return everything found, errors first."""
        return CheckResult.of(self.found)


def paragraphs(result: CheckResult) -> Iterable[str]:
    """Yield one paragraph for each finding, or a single one when there is none.

    Of many alike, such as the same mistake in each row of a table, only the first few are shown.
    """
    if not result.findings:
        yield "Nothing found that looks wrong."
    kind = attrgetter("severity", "code", "remedy")
    for _, alike in groupby(result.findings, kind):
        found = list(alike)
        yield from map(str, found[:_MOST_ALIKE])
        if more := found[_MOST_ALIKE:]:
            last = f", the last of them {more[-1].where}" if len(more) > 1 else f": {more[0].where}"
            yield f"{more[0].severity} {more[0].code}: {len(more)} more{last}."


def _code(fault: Fault, otherwise: str) -> str:
    if fault.hint in _BY_HINT:
        return _BY_HINT[fault.hint]
    known = (code for start, code in _BY_EXPECTED.items() if fault.expected.startswith(start))
    return next(known, otherwise)


def _remedy(code: str, fault: Fault) -> str:
    """Return the remedy of a fault of a whole file or of its header, or ""."""
    if code == "plan-invalid" and fault.where.endswith(" header"):
        return _OF_HEADER
    section, _, setting = fault.where.rpartition(".")
    if setting == "crs" and section.isidentifier():
        return f"Set {fault.where} to the projected CRS of the numbers, in metres."
    known = (remedy for start, remedy in _OF_FILES.items() if fault.expected.startswith(start))
    return next(known, "")
