"""What a person gives by the names of recordings, and of their local frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path

from mapfilter.errors import Faults, listed
from mapfilter.tracks.log_folders import files_in, is_log
from mapfilter.tracks.readers.texts.zipped import files_in_zip, is_zip
from mapfilter.tracks.zipped_logs import is_zipped_log

_MOST_S = 1e10


def offsets_by_path(
    offsets_s: Mapping[str, float], paths: Sequence[Path], where: str, faults: Faults
) -> dict[Path, float]:
    """Return the offset of each recording, named by its path, its name, or that with its folder.

    Parameters
    ----------
    offsets_s : mapping of str to float
        Seconds to add to the times of a recording.
    paths : sequence of Path
        Recordings, folders or ZIPs of them, and track logs, whose times have no offset.
    where : str
        The option or argument.
    """
    if not offsets_s:
        return {}
    found: dict[Path, float] = {}
    files = [file for path in paths for file in _files_of(path)]
    for name, seconds in offsets_s.items():
        parts = Path(name).parts
        named = [path for path in files if str(path) == name or path.parts[-len(parts) :] == parts]
        if not named:
            expected, hint = "the name of one of the recordings", ""
            if files:
                expected += f" ({listed([path.name for path in files])})"
            elif any(map(_has_logs, paths)):
                hint = "a track log has the times of its tables; offsets are those of recordings"
            faults.add(where, expected, repr(name), hint)
        elif not (isfinite(seconds) and abs(seconds) <= _MOST_S):
            faults.add(f"{where} {name}", f"seconds, at most {_MOST_S:g}", f"{seconds:g}")
        found.update(dict.fromkeys(named, float(seconds)))
    return found


def check_origin(origin_deg: tuple[float, float], where: str, faults: Faults) -> None:
    """Note an origin that is no latitude and longitude in degrees.

    Parameters
    ----------
    where : str
        The option or argument.
    """
    lat_deg, lon_deg = origin_deg
    if abs(lat_deg) <= 90 and abs(lon_deg) <= 180:
        return
    swapped = abs(lon_deg) <= 90 and abs(lat_deg) <= 180
    hint = "longitude and latitude swapped" if swapped else ""
    got = f"{lat_deg:g}, {lon_deg:g}"
    faults.add(where, "a latitude and a longitude in degrees", got, hint)


def _has_logs(path: Path) -> bool:
    """Return whether a path is a track log, or a folder or ZIP of some."""
    return is_zipped_log(path) or (path.is_dir() and any(map(is_log, (path, *path.iterdir()))))


def _files_of(path: Path) -> list[Path]:
    """Return the recordings of a path: tables of a track log are none."""
    if (path.is_dir() and is_log(path)) or is_zipped_log(path):
        return []
    if path.is_dir():
        return files_in(path)
    return files_in_zip(path) if is_zip(path) else [path]
