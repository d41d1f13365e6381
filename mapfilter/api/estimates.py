"""Write what was located to a file, and read it again."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from mapfilter._arguments import Argument, check_arguments, path_argument
from mapfilter.api.located import Track
from mapfilter.errors import OutputError, fail
from mapfilter.positioning import estimate_store
from mapfilter.positioning.estimate import TrackEstimate

_WRITERS: dict[str, Callable[[TrackEstimate, Path], None]] = {
    ".parquet": estimate_store.write_estimate,
    ".gpx": estimate_store.write_gpx,
    ".geojson": estimate_store.write_geojson,
}


def write_estimate(track: Track | TrackEstimate, path: Path | str | os.PathLike[str]) -> Path:
    """Write the estimate of a track, as ``mapfilter replay`` does; a missing folder is made.

    Parameters
    ----------
    path : path
        By its suffix: all of it as GeoParquet (``.parquet``), which :func:`read_estimate` reads
        back; or the positions that are followed, in degrees (``.gpx``, ``.geojson``).

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    ConfigError
        It is no track, or no path.
    OutputError
        The suffix is another one, or the file cannot be written.
    """
    check_arguments(
        "write_estimate",
        Argument("track", track, Track | TrackEstimate, "a track of locate, or its estimate"),
        path_argument("path", path),
    )
    file = Path(path)
    write = _WRITERS.get(file.suffix.lower())
    if write is None:
        expected = f"a name that ends in {', '.join(_WRITERS)}"
        raise fail(OutputError, str(file), expected, file.suffix or "no suffix")
    write(track.estimate if isinstance(track, Track) else track, file)
    return file


def read_estimate(path: Path | str | os.PathLike[str]) -> TrackEstimate:
    """Read an estimate that :func:`write_estimate` or ``mapfilter replay`` wrote as GeoParquet.

    Raises
    ------
    ConfigError
        It is no path.
    StoreError
        The file is missing, cut off, no estimate or of a newer version.
    """
    check_arguments("read_estimate", path_argument("path", path))
    return estimate_store.read_estimate(Path(path))
