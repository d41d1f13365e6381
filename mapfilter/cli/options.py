"""Options that several commands share, and how they become settings."""

from __future__ import annotations

import json
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mapfilter.errors import (
    ConfigError,
    Fault,
    Faults,
    InputError,
    MapfilterError,
    StoreError,
    fail,
)
from mapfilter.positioning import BUILT_IN, DEFAULT

if TYPE_CHECKING:
    from mapfilter.config.sections import Config

DONE, WRONG, PARTIAL = 0, 2, 3
"""Exit codes."""
_LARGEST_BYTES = 16 << 20
NO_CONFIG = "a configuration (-c FILE), or settings (--set)"


def given_path(path: Path | None) -> Path | None:
    """Refuse what cannot be a path, before anything is opened."""
    from mapfilter._inputs import path_fault, shown

    if path is not None and (wrong := path_fault(path)):
        raise fail(ConfigError, "command line", wrong, shown(str(path)))
    return path


ConfigOption = Annotated[
    Path | None, typer.Option("-c", "--config", metavar="FILE", help="Configuration (TOML).")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="SECTION.KEY=VALUE", help="Change one setting; repeatable."),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Output folder.", callback=given_path),
]
SeedOption = Annotated[int | None, typer.Option("--seed", min=0, help="Seed of what is drawn.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on one line.")]
WorkersOption = Annotated[int, typer.Option("--workers", min=1, help="Local processes.")]
ClusterOption = Annotated[
    str | None,
    typer.Option("--cluster", metavar="ADDRESS", help="A Dask scheduler, or local:N."),
]
ResumeOption = Annotated[bool, typer.Option("--resume", help="Continue an interrupted run.")]
FilterOption = Annotated[
    str | None,
    typer.Option(
        "--filter",
        metavar="NAME",
        help=f"{', '.join(BUILT_IN)}, or a custom filter, package.module:Name. Default: {DEFAULT}.",
    ),
]
DeclinationOption = Annotated[
    float | None,
    typer.Option("--declination", metavar="DEG", help="Magnetic declination, east positive."),
]
StepLengthOption = Annotated[
    float | None,
    typer.Option("--step-length", metavar="M", help="Mean length of a step."),
]
ColumnOption = Annotated[
    list[str] | None,
    typer.Option("--column", metavar="FIELD=COLUMN", help="Column of a plain CSV; repeatable."),
]
TruthOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--truth", metavar="FILE", help="Recording whose positions are the truth; repeatable."
    ),
]
ZoneOption = Annotated[
    str | None, typer.Option("--zone", help="Zone of local times in recordings.")
]
OffsetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--offset", metavar="FILE=S", help="Seconds to add to the times of a file; repeatable."
    ),
]
FactorOption = Annotated[
    list[str] | None,
    typer.Option(
        "--factor",
        metavar="COLUMN=NUMBER",
        help="Multiply step_m, heading_rad or turn_rad of motion (-1 turns it round); repeatable.",
    ),
]
BoxOption = Annotated[
    str | None,
    typer.Option("--bbox", metavar="W,S,E,N", help="Part of the map, in degrees; else all of it."),
]
DryRunOption = Annotated[
    bool, typer.Option("--dry-run", help="Only estimate size or runs, memory and time.")
]
DatabaseArgument = Annotated[Path, typer.Argument(metavar="DB", callback=given_path)]
PathArgument = Annotated[Path, typer.Argument(metavar="PATH", callback=given_path)]


def seeded(settings: list[str] | None, seed: int | None, *keys: str) -> list[str]:
    """Return the settings with a seed for each key, after what was set by name."""
    seeds = [] if seed is None else [f"{key}={seed}" for key in keys]
    return [*(settings or ()), *seeds]


def toml(value: str | list[str]) -> str:
    """Return a text, or a list of texts, as TOML writes it."""
    # Escapes of JSON in the ASCII form are pairs of surrogates, which TOML has not.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


@contextmanager
def named_defaults(config: Path | None, settings: list[str] | None) -> Iterator[None]:
    """Put first, where an input is wrong, that no configuration was given and defaults were taken.

    Raises
    ------
    InputError, StoreError
        As in the block, with one fault more where there was neither a file nor a setting.
    """
    try:
        yield
    except (InputError, StoreError) as error:
        if config is not None or settings:
            raise
        missing = Fault("command line", NO_CONFIG, "none; defaults were taken")
        raise type(error)((missing, *error.faults)) from error


def numbers(text: str | None, count: int, where: str) -> list[float] | None:
    """Return so many numbers that commas separate, or None without a text."""
    if text is None:
        return None
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count:
        raise fail(ConfigError, where, f"{count} numbers with commas between them", repr(text))
    return found


def column_map(texts: list[str] | None) -> dict[str, str]:
    """Read ``--column``: the column of each field of a plain CSV.

    Raises
    ------
    ConfigError
        A text is no ``FIELD=COLUMN``, or a field does not exist.
    """
    if not texts:
        return {}
    from mapfilter.tracks.readers.plain.fields import check_fields
    from mapfilter.workflows.convert import parse_pairs

    columns, faults = parse_pairs(texts, "--column"), Faults()
    check_fields(columns, faults)
    faults.raise_if_any(ConfigError)
    return columns


def clock_offsets(texts: list[str] | None) -> dict[str, float]:
    """Read ``--offset``: the seconds to add to the times of each recording, by its name.

    Raises
    ------
    ConfigError
        A text is no ``FILE=S``.
    """
    if not texts:
        return {}
    from mapfilter.workflows.convert import parse_pairs

    return {
        name: (numbers(text, 1, f"--offset {name}") or [0.0])[0]
        for name, text in parse_pairs(texts, "--offset").items()
    }


def motion_factors(texts: list[str] | None) -> dict[str, float]:
    """Read ``--factor``: the number by which each column of motion is multiplied.

    Raises
    ------
    ConfigError
        A text is no ``COLUMN=NUMBER``, a column is none of motion, or a number is 0.
    """
    if not texts:
        return {}
    from mapfilter.tracks.motion_factors import check_factors
    from mapfilter.workflows.convert import parse_pairs

    pairs, faults = parse_pairs(texts, "--factor"), Faults()
    found = {
        name: (numbers(text, 1, f"--factor {name}") or [0.0])[0] for name, text in pairs.items()
    }
    check_factors(found, "--factor", faults)
    faults.raise_if_any(ConfigError)
    return found


def walk_changes(declination_deg: float | None, step_m: float | None) -> dict[str, Any]:
    """Return what ``--declination`` and ``--step-length`` set of the options of a walk.

    Raises
    ------
    ConfigError
        One of them is out of range.
    """
    faults = Faults()
    if declination_deg is not None and not abs(declination_deg) <= 180:
        faults.add("--declination", "degrees in -180..180", declination_deg)
    if step_m is not None and not 0 < step_m < 3:
        hint = "centimetres" if step_m >= 3 else ""
        faults.add("--step-length", "metres above 0 and below 3", step_m, hint)
    faults.raise_if_any(ConfigError)
    given = {"declination_deg": declination_deg, "step_m": step_m}
    return {name: value for name, value in given.items() if value is not None}


def undrawn(config: Path | None, settings: Sequence[str]) -> bool:
    """Return whether settings or the file ask for no pictures, before either is checked."""
    from mapfilter._inputs import read_input

    key = "output.pictures"
    said = [text for name, _, text in (s.partition("=") for s in settings) if name.strip() == key]
    if said:
        return said[-1].strip().strip("\"'") == "none"
    if config is None or not config.is_file():
        return False
    try:
        text = read_input(config, _LARGEST_BYTES, "a TOML file", ConfigError).decode("utf-8-sig")
        return bool(tomllib.loads(text)["output"]["pictures"] == "none")
    except (MapfilterError, ValueError, RecursionError, KeyError, TypeError):
        # What is wrong with it is told when it is loaded.
        return False


def check_custom_filter(config: Config) -> None:
    """Let a custom filter be imported from the working folder, after all other places."""
    names = [config.filter.name, *(reading.filter or "" for reading in config.sweep.readings)]
    folder = str(Path.cwd())
    if any(":" in name for name in names) and folder not in sys.path:
        sys.path.append(folder)


@contextmanager
def named_options(options: Mapping[str, str]) -> Iterator[None]:
    """Name the option beside the setting or argument that it made, where that is wrong.

    Parameters
    ----------
    options : mapping of str to str
        Option of each place that faults name.
    """
    try:
        yield
    except (ConfigError, InputError) as error:
        faults = []
        for fault in error.faults:
            # Another path may begin with the same letters.
            where = f"{fault.where} "
            of = (
                option
                for place, option in options.items()
                if where.startswith(tuple(f"{place}{end}" for end in " ,.["))
            )
            option = next(of, "")
            faults.append(replace(fault, where=f"{option}, {fault.where}") if option else fault)
        raise type(error)(tuple(faults)) from None


def refuse(given: Mapping[str, object], whom: str) -> None:
    """Refuse options that would have no effect."""
    faults = Faults()
    for option, value in given.items():
        if value is not None and value != []:
            faults.add(option, f"nothing, as {whom} takes none", value)
    faults.raise_if_any(ConfigError)
