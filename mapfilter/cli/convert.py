"""The command that reads recordings of other programs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from mapfilter.cli.options import (
    ColumnOption,
    DeclinationOption,
    FactorOption,
    JsonOption,
    OffsetOption,
    StepLengthOption,
    clock_offsets,
    column_map,
    given_path,
    motion_factors,
    numbers,
    refuse,
    walk_changes,
)
from mapfilter.errors import ConfigError, Faults
from mapfilter.workflows.outputs.terminal import print_result, print_text

if TYPE_CHECKING:
    from mapfilter.tracks.pdr.options import WalkOptions


def convert(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="Recordings of one journey, or their folder."),
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="LOG", help="The log's folder.", callback=given_path)
    ],
    form: Annotated[
        str | None,
        typer.Option("--format", metavar="NAME", help="Format; found by the content otherwise."),
    ] = None,
    truth: Annotated[
        list[Path] | None,
        typer.Option(
            "--truth", metavar="FILE", help="Recording whose positions are the truth; repeatable."
        ),
    ] = None,
    crs: Annotated[
        str | None,
        typer.Option("--crs", metavar="EPSG", help="Projected CRS; else the UTM zone."),
    ] = None,
    origin: Annotated[
        str | None,
        typer.Option("--origin", metavar="LAT,LON", help="Origin of a local frame of metres."),
    ] = None,
    zone: Annotated[
        str | None,
        typer.Option("--zone", help="Zone of local times, such as Europe/Brussels or +01:00."),
    ] = None,
    column: ColumnOption = None,
    offset: OffsetOption = None,
    factor: FactorOption = None,
    course_motion: Annotated[
        bool,
        typer.Option(
            "--course-motion", help="Make motion from speed and course of GNSS, else its positions."
        ),
    ] = False,
    no_steps: Annotated[
        bool, typer.Option("--no-steps", help="Make no motion from the sensors of a phone.")
    ] = False,
    pose: Annotated[
        Literal["auto", "device", "any"] | None,
        typer.Option("--pose", help="Walking direction: the phone's axis, by the steps, or auto."),
    ] = None,
    declination: DeclinationOption = None,
    step_length: StepLengthOption = None,
    as_json: JsonOption = False,
) -> None:
    """Convert recordings of other programs to a track log."""
    from mapfilter.tracks.joining.named_files import check_origin, offsets_by_path
    from mapfilter.tracks.open_options import CombineOptions, OpenOptions
    from mapfilter.workflows.convert import report_lines, run_convert

    given = [given_path(path) or path for path in files]
    true = [given_path(path) or path for path in truth or ()]
    place = numbers(origin, 2, "--origin")
    if no_steps:
        given_beside = {
            "--pose": pose,
            "--declination": declination,
            "--step-length": step_length,
        }
        refuse(given_beside, "--no-steps")
    shifts = clock_offsets(offset)
    faults = Faults()
    if place is not None:
        check_origin((place[0], place[1]), "--origin", faults)
    offsets_s = offsets_by_path(shifts, [*given, *true], "--offset", faults)
    faults.raise_if_any(ConfigError)
    options = OpenOptions(
        format=form or "",
        zone=zone or "",
        columns=column_map(column),
        combine=CombineOptions(
            crs=crs or "",
            origin_deg=None if place is None else (place[0], place[1]),
            truth=true,
            offsets_s=offsets_s,
            course_motion=course_motion,
            walk=None if no_steps else _walk(pose, declination, step_length),
            factors=motion_factors(factor),
        ),
    )
    result = run_convert(given, out, options)
    if as_json:
        print_result(result, as_json)
    else:
        print_text("\n".join(report_lines(result)))


def _walk(
    pose: Literal["auto", "device", "any"] | None,
    declination_deg: float | None,
    step_m: float | None,
) -> WalkOptions:
    from mapfilter.tracks.pdr.options import WalkOptions

    options = replace(WalkOptions(), **walk_changes(declination_deg, step_m))
    return options if pose is None else replace(options, pose=pose)
