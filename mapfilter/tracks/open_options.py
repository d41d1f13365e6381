"""Options of opening what a person has of a journey; they import nothing that reads it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from mapfilter.tracks.pdr.options import WalkOptions

_NO_EFFECT = "options of recordings have no effect on a track log"


@dataclass(frozen=True)
class CombineOptions:
    """How recordings become a log.

    Parameters
    ----------
    crs : str
        Projected CRS of the log; "" for the UTM zone of its positions.
    origin_deg : (float, float) or None
        Latitude and longitude at which a local frame of metres has its origin.
    about_deg : (float, float) or None
        Latitude and longitude of the area, whose grid convergence turns azimuths of recordings
        without positions.
    truth : collection of Path
        Recordings whose positions are the truth, and no measurements.
    measured : collection of Path
        Those of ``truth`` whose motion and sensors are measurements: they were given as logs, too.
    offsets_s : mapping of Path to float
        Seconds to add to the times of a recording.
    course_motion : bool
        Whether steps are made from the speed and course of a receiver, else from its positions,
        where nothing else gives them.
    walk : WalkOptions or None
        How steps are made of a phone's sensors where nothing else gives them; None for no steps.
    factors : mapping of str to float
        By which columns of motion (``step_m``, ``heading_rad``, ``turn_rad``) are multiplied, also
        those of a track log.
    """

    crs: str = ""
    origin_deg: tuple[float, float] | None = None
    about_deg: tuple[float, float] | None = None
    truth: Collection[Path] = ()
    measured: Collection[Path] = ()
    offsets_s: Mapping[Path, float] = field(default_factory=dict)
    course_motion: bool = False
    walk: WalkOptions | None = field(default_factory=WalkOptions)
    factors: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class OpenOptions:
    """How recordings of other programs are read and joined; track logs need the factors alone.

    Parameters
    ----------
    format : str
        Name of the format of all files; "" to find it by their content.
    zone : str
        Zone of local times that state none.
    columns : mapping of str to str
        For plain CSV: column of each field. Of several files each has those of them that are in it.
    combine : CombineOptions
    """

    format: str = ""
    zone: str = ""
    columns: Mapping[str, str] = field(default_factory=dict)
    combine: CombineOptions = field(default_factory=CombineOptions)

    def unused_by_log(self) -> tuple[str, ...]:
        """Return a note on the options that are given though a track log does not use them.

        Examples
        --------
        >>> OpenOptions(zone="+01:00").unused_by_log()
        ('options of recordings have no effect on a track log: --zone',)
        """
        combine = self.combine
        given = {
            "--format": self.format,
            "--zone": self.zone,
            "--column": self.columns,
            "--origin": combine.origin_deg,
            "--truth": combine.truth,
            "--offset": combine.offsets_s,
            "--course-motion": combine.course_motion,
        }
        names = [name for name, value in given.items() if value]
        return (f"{_NO_EFFECT}: {', '.join(names)}",) if names else ()
