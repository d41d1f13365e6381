"""The logs of a configuration: track logs, or recordings of other programs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from mapfilter.config.sections import Config
from mapfilter.config.track import Track
from mapfilter.errors import ConfigError, Faults
from mapfilter.geodesy import projected_crs
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.checks.placeless import in_frame
from mapfilter.tracks.joining.named_files import offsets_by_path
from mapfilter.tracks.open_log import OpenedLog, list_journeys, open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.pdr.options import WalkOptions

_OFFSETS = "--offset, track.offsets_s"


def open_options(track: Track) -> OpenOptions:
    """Return how the section reads recordings."""
    origin_deg = None if track.origin is None else (track.origin[1], track.origin[0])
    return OpenOptions(
        format=track.format,
        zone=track.zone,
        columns=track.columns.given,
        combine=CombineOptions(
            origin_deg=origin_deg,
            truth=track.truth,
            course_motion=track.course_motion,
            walk=track.walk.of(WalkOptions) if track.steps else None,
            factors=track.factors.given,
        ),
    )


def journeys_of(config: Config) -> list[Path]:
    """Return what holds one journey each: logs, or the first recording of one."""
    if config.track.recordings:
        return [config.track_path]
    return list_journeys(config.track_path)


def open_journey(
    config: Config, path: Path, area: Lattice | None = None, sites: CellPlan | None = None
) -> OpenedLog:
    """Open a journey, with the recordings that the section adds to it.

    Parameters
    ----------
    area : Lattice, optional
        Of the database, whose CRS recordings have; else that of the configuration's area, else the
        UTM zone of positions. A log without a CRS and positions is one of it.
    sites : CellPlan, optional
        Where a log without positions was made, if there is no database.

    Raises
    ------
    MapfilterError
        As of :func:`mapfilter.tracks.open_log.open_log`; or an offset is of no recording.
    """
    options, placed = open_options(config.track), sites if area is None else area
    given, faults = [path, *config.track.recordings], Faults()
    known = [*given, *config.track.truth]
    offsets_s = offsets_by_path(config.track.offsets_s, known, _OFFSETS, faults)
    faults.raise_if_any(ConfigError)
    options = replace(options, combine=replace(options.combine, offsets_s=offsets_s))
    if placed is not None:
        combine = replace(options.combine, about_deg=placed.middle_deg)
        options = replace(options, combine=combine)
    crs = "" if area is None else area.crs
    if area is None and config.area.crs is not None:
        crs = projected_crs(config.area.crs, "area.crs")
    opened = open_log(given, crs=crs, options=options)
    if placed is None:
        return opened
    return replace(opened, log=in_frame(opened.log, placed.crs, placed.middle_deg))
