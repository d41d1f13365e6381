"""Inputs are never written to: outputs of a command are kept apart from what it reads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from mapfilter.config.fields import Section
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError, Faults, OutputError

_ALSO_WRITTEN = (
    "output.dir",
    "rasters.path",
    "rasters.ground_truth",
    "database.path",
    "track.path",
    "sweep.databases",
)
"""Keys of what one command writes and another one reads; these have checks of their own."""


def input_paths(config: Config) -> dict[str, tuple[Path, ...]]:
    """Return the files and folders that a configuration names as inputs, by their keys."""
    paths = {key: found for key, found in _paths(config, "") if key not in _ALSO_WRITTEN}
    if config.area.map_is_a_file:
        paths["area.map"] = (Path(config.area.map),)
    return paths


def check_no_input_replaced(config: Config, *outputs: Path) -> None:
    """Raise OutputError, with every fault, where an output would replace an input."""
    faults = Faults()
    inputs = {path.resolve(): key for key, paths in input_paths(config).items() for path in paths}
    for path in outputs:
        key = inputs.get(path.resolve())
        if key is not None:
            hint = "give results a folder of their own, by --out"
            faults.add(str(path), "another place than an input", f"the file of {key}", hint)
    faults.raise_if_any(OutputError)


def check_out_apart(out: Path, inputs: Sequence[Path], option: str = "--out") -> None:
    """Raise ConfigError where results would lie in a database, a log, or another input folder.

    ``option`` names them in the message.
    """
    faults, place = Faults(), out.resolve()
    for path in dict.fromkeys(inputs):
        if path.is_dir() and place.is_relative_to(path.resolve()):
            hint = "results need a folder of their own"
            faults.add(option, f"a folder outside {path}, which is an input", str(out), hint)
    faults.raise_if_any(ConfigError)


def _paths(section: Section, prefix: str) -> Iterator[tuple[str, tuple[Path, ...]]]:
    for name, value in section:
        key = f"{prefix}{name}"
        if isinstance(value, Section):
            yield from _paths(value, f"{key}.")
        elif isinstance(value, Path):
            yield key, (value,)
        elif isinstance(value, tuple):
            yield key, tuple(path for path in value if isinstance(path, Path))
