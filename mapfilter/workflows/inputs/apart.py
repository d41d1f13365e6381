"""Inputs are never written to: outputs of a command are kept apart from what it reads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from mapfilter.config.fields import Section
from mapfilter.config.sections import Config
from mapfilter.database.manifest import MANIFEST, POINTS
from mapfilter.errors import ConfigError, Faults, OutputError, fail
from mapfilter.tracks.log_folders import has_tables, is_log

_ALSO_WRITTEN = (
    "output.dir",
    "rasters.path",
    "rasters.ground_truth",
    "database.path",
    "track.path",
    "sweep.databases",
)
"""Keys of what one command writes and another one reads; these have checks of their own."""

_MEASURED = ("prediction.survey.files", "roads.tracks.files")
"""Keys of folders of which all files are read."""


def input_paths(config: Config) -> dict[str, tuple[Path, ...]]:
    """Return the files and folders that a configuration names as inputs, by their keys."""
    paths = {key: found for key, found in _paths(config, "") if key not in _ALSO_WRITTEN}
    if config.area.map_is_a_file:
        paths["area.map"] = (Path(config.area.map),)
    return paths


def named_inputs(config: Config) -> tuple[Path, ...]:
    """Return the files and folders of :func:`input_paths`."""
    return tuple(path for paths in input_paths(config).values() for path in paths)


def check_no_input_replaced(config: Config, *outputs: Path) -> None:
    """Raise OutputError, with every fault, where an output would replace an input.

    Among measurements of a folder it would be read as one of them.
    """
    faults, hint = Faults(), "give results a folder of their own, by --out"
    inputs = {path.resolve(): key for key, paths in input_paths(config).items() for path in paths}
    for path in outputs:
        place = path.resolve()
        if (key := inputs.get(place)) is not None:
            faults.add(str(path), "another place than an input", f"the file of {key}", hint)
        elif (key := inputs.get(place.parent)) in _MEASURED:
            faults.add(str(path), "another place than an input", f"the folder of {key}", hint)
    faults.raise_if_any(OutputError)


def check_out_apart(out: Path, inputs: Sequence[Path], option: str = "--out") -> None:
    """Raise ConfigError where results would lie in a database, a log, or among recordings.

    They would be read as recordings, too; a folder of their own may lie beside these. ``option``
    names the results in the message.
    """
    faults, place = Faults(), out.resolve()
    for path in dict.fromkeys(inputs):
        if path.is_dir() and _is_in(place, path.resolve()):
            hint = "results need a folder of their own"
            faults.add(option, f"a folder outside {path}, which is an input", str(out), hint)
    faults.raise_if_any(ConfigError)


def check_in_no_store(out: Path, option: str = "--out") -> None:
    """Raise ConfigError where a result would lie in a database or a log, whoever reads it.

    A database holds the files that it lists alone, and all of a log's folder is read. Files of the
    same names that other programs write, without tables beside them, make no store.
    """
    place = out.resolve()
    for folder in (place, *place.parents):
        if what := _store(folder):
            hint = "results need a folder of their own"
            raise fail(ConfigError, option, f"a place outside {folder}, {what}", str(out), hint)


def _store(folder: Path) -> str:
    """Return "a database", "a log", or "" for other folders."""
    if (folder / MANIFEST).is_file() and (folder / POINTS).is_file():
        return "a database"
    return "a log" if is_log(folder) and has_tables(folder) else ""


def check_inputs_kept(inputs: Iterable[Path], replaced: Iterable[Path]) -> None:
    """Raise OutputError, with every fault, where results would replace an input.

    Parameters
    ----------
    inputs : iterable of Path
        Files and folders that are read.
    replaced : iterable of Path
        All that is written, and what is left of older results.
    """
    faults, places = Faults(), {path.resolve() for path in replaced}
    for path in dict.fromkeys(inputs):
        if path.resolve() in places:
            got = "an input that they would replace"
            faults.add(str(path), "no file of the results", got, "give another folder by --out")
    faults.raise_if_any(OutputError)


def _is_in(place: Path, folder: Path) -> bool:
    """Return whether a place lies in a database or log, or is a folder of recordings."""
    if is_log(folder) or (folder / MANIFEST).is_file():
        return place.is_relative_to(folder)
    return place == folder and not any(map(is_log, folder.iterdir()))


def _paths(section: Section, prefix: str) -> Iterator[tuple[str, tuple[Path, ...]]]:
    for name, value in section:
        key = f"{prefix}{name}"
        if isinstance(value, Section):
            yield from _paths(value, f"{key}.")
        elif isinstance(value, Path):
            yield key, (value,)
        elif isinstance(value, tuple):
            yield key, tuple(path for path in value if isinstance(path, Path))
