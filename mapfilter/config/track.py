"""The section ``[track]`` and its parts: a log, or recordings of other programs."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from mapfilter.config.fields import (
    Columns,
    FilePath,
    Files,
    Pair,
    Section,
    with_columns,
    with_options,
)
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.readers.plain.fields import FIELDS as RECORDED_FIELDS
from mapfilter.tracks.schema import Without


def _format_name(value: str) -> str:
    """Check the name of a format of recordings; "" is none."""
    if not value:
        return value
    # Here, as few commands name one, and it imports all readers.
    from mapfilter.tracks.readers.formats import FORMATS

    if value not in (names := [known.name for known in FORMATS]):
        raise ValueError(f"one of {', '.join(names)}")
    return value


def _no_zero(value: float) -> float:
    if value == 0:
        raise ValueError("a number other than 0")
    return value


Factor = Annotated[float, AfterValidator(_no_zero)]


@with_columns(*RECORDED_FIELDS)
class TrackColumns(Columns):
    """``[track.columns]``: names of the columns of a plain CSV recording.

    Each key is a field; its value is the name of its column in the file.
    """


class TrackFactors(Columns):
    """``[track.factors]``: numbers by which columns of motion are multiplied.

    For turns that run clockwise (-1) or lengths in another unit (0.3048 for feet). 1 takes a column
    as it is, although the positions of the log contradict it. They count for track logs, too.

    Parameters
    ----------
    step_m : float, optional
        Factor of the lengths of steps.
    heading_rad : float, optional
        Factor of headings.
    turn_rad : float, optional
        Factor of turns, or of those made of yaw rates.
    """

    step_m: Factor | None = None
    heading_rad: Factor | None = None
    turn_rad: Factor | None = None


@with_options(WalkOptions)
class TrackWalk(Section):
    """``[track.walk]``: steps and headings made of the raw sensors of a walker's phone."""


class Track(Section):
    """``[track]``: a log, a folder of logs, or recordings of other programs.

    All keys but ``path``, ``without`` and ``factors`` are for recordings.

    Parameters
    ----------
    path : Path, optional
        The log, a folder of logs, a recording, or a folder of recordings of one journey; by default
        ``journeys`` in the output folder.
    without : list of str
        What the filter does not receive.
    recordings : list of Path
        Further recordings of the same journey.
    truth : list of Path
        Recordings whose positions are the truth, and no measurements.
    format : str
        Format of the recordings, as for ``mapfilter convert``; found by their content otherwise.
    zone : str
        Zone of local times that state none, such as "Europe/Brussels" or "+01:00".
    origin : (float, float), optional
        Longitude and latitude at which a local frame of metres has its origin.
    offsets_s : dict of str to float
        Seconds to add to the times of recordings, by the name of each file; also of those of
        ``truth``.
    course_motion : bool
        Make motion from the speed and course of a receiver, else from its positions, where nothing
        else gives it.
    steps : bool
        Make steps and headings of the raw sensors of a phone where nothing else gives motion.
    """

    path: FilePath | None = None
    without: Annotated[tuple[Without, ...], Field(strict=False)] = ()
    recordings: Files = ()
    truth: Files = ()
    format: Annotated[str, AfterValidator(_format_name)] = ""
    zone: str = ""
    origin: Pair | None = None
    offsets_s: dict[str, float] = Field(default_factory=dict)
    course_motion: bool = False
    steps: bool = True
    walk: TrackWalk = TrackWalk()
    columns: TrackColumns = TrackColumns()
    factors: TrackFactors = TrackFactors()
