"""``mapfilter learn``: what journeys tell of a database, and the patch that follows."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from mapfilter._io import ensure_writable_folder, replaced_files
from mapfilter._parallel import Progress
from mapfilter._partial import nothing_left
from mapfilter.config.sections import Config
from mapfilter.database.manifest import InputFile
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError, fail
from mapfilter.learning.apply import apply_patch
from mapfilter.learning.patch import read_patch, write_patch
from mapfilter.learning.phone import PhoneNoise
from mapfilter.workflows.inputs.apart import check_out_apart
from mapfilter.workflows.inputs.logs import journeys_of
from mapfilter.workflows.lessons.report import PATCH, older_report, write_report
from mapfilter.workflows.lessons.study import study_logs


@dataclass(frozen=True)
class LearnResult:
    """What was learned.

    Parameters
    ----------
    logs : int
        Journeys.
    used : int
        Of them, located where they were as far as their levels tell.
    findings : tuple of dict
        As in ``findings.csv``.
    notes : tuple of str
    phone : PhoneNoise or None
    patch : Path or None
        Where something is proposed.
    database : Path or None
        Where changes were applied.
    out : Path
        Folder of the report.
    """

    logs: int
    used: int
    findings: tuple[dict[str, Any], ...]
    notes: tuple[str, ...]
    phone: PhoneNoise | None
    patch: Path | None
    database: Path | None
    out: Path
    seconds: float


def run_accept(
    database: Path, patch_file: Path, out: Path, *, progress: Progress | None = None
) -> dict[str, Any]:
    """Write a database with the accepted changes of a patch.

    Raises
    ------
    MapfilterError
        Database or patch are missing, damaged or of different networks, or the output cannot be
        written.
    """
    began_s = time.perf_counter()
    opened = open_database(database, verify="full")
    patch = read_patch(patch_file)
    _check_apart(database, out)
    notes = []
    if patch.database_sha256 != opened.generation:
        notes.append("the patch was learned from another database, or an older state of this one")
    with nothing_left(out.parent):
        ensure_writable_folder(out.parent)
        changed = apply_patch(
            opened,
            patch,
            out,
            inputs=(InputFile.of("patch", patch_file),),
            where=str(patch_file),
            progress=progress,
        )
    accepted = sum(change.accept for change in patch.changes)
    return {
        "changes": accepted,
        "refused": len(patch.changes) - accepted,
        "points": int(changed.manifest["counts"]["points"]),
        "cells": len(changed.cell_ids),
        "notes": notes,
        "database": out,
        "seconds": time.perf_counter() - began_s,
    }


def run_learn(
    config: Config,
    out: Path,
    *,
    accept: bool = False,
    use_truth: bool = True,
    workers: int = 1,
    resume: bool = False,
    progress: Progress | None = None,
) -> LearnResult:
    """Learn from the logs of a configuration what is wrong with its database.

    Parameters
    ----------
    config : Config
        Its database, track (logs) and filter sections count.
    out : Path
        Gets the report; with ``accept`` the changed database, and the report lies beside it.
    accept : bool
        Whether all that is proposed is applied at once.
    use_truth : bool
        Whether journeys with ground truth are placed by it.
    workers : int
        Local processes.
    resume : bool
        Keep the tracks that an interrupted call with the same inputs has finished.
    progress : callable, optional
        Called with journeys located and journeys to locate in all.

    Raises
    ------
    MapfilterError
        The database or a log is missing or damaged, no log has a level, or the output cannot be
        written.
    """
    began_s = time.perf_counter()
    _check_apart(config.database_path, out)
    recorded = *journeys_of(config), *config.track.recordings
    check_out_apart(out, [config.database_path, *recorded])
    report = out.with_name(f"{out.name}-report") if accept else out
    with nothing_left(report):
        ensure_writable_folder(report)
        taught = study_logs(
            config, report, use_truth=use_truth, workers=workers, resume=resume, progress=progress
        )
    proposed, changed = bool(taught.patch.changes), None
    with replaced_files(report, partial(older_report, report)) as new:
        findings = write_report(taught, new)
        if proposed:
            write_patch(taught.patch, new / PATCH)
    if accept and proposed:
        inputs = (InputFile.of("patch", report / PATCH),)
        changed = apply_patch(taught.database, taught.patch, out, inputs=inputs).path
    return LearnResult(
        len(taught.names),
        int(taught.lesson.trusted.sum()),
        findings,
        (*taught.notes, *taught.unused),
        taught.phone,
        report / PATCH if proposed else None,
        changed,
        report,
        time.perf_counter() - began_s,
    )


def _check_apart(database: Path, out: Path) -> None:
    if out.resolve() == database.resolve():
        hint = "a database is never changed in place"
        raise fail(ConfigError, "--out", "another folder than the database", str(out), hint)
