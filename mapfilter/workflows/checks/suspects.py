"""``mapfilter check --logs``: suspects of a database by journeys alone."""

from __future__ import annotations

import tempfile
from pathlib import Path

from mapfilter._parallel import Progress
from mapfilter.check.findings import CheckResult, Findings
from mapfilter.config.sections import Config
from mapfilter.learning.patch import Change
from mapfilter.workflows.lessons.study import study_logs


def run_check_suspects(config: Config, progress: Progress | None = None) -> CheckResult:
    """Return what the logs of a configuration tell against its database; nothing is written.

    Suspects are warnings: cells that are received otherwise than predicted, cells that the database
    lacks, and paths off the map. Journeys that were of no use are named, too.

    Raises
    ------
    MapfilterError
        The database or a log is missing or damaged.
    """
    findings = Findings()
    with tempfile.TemporaryDirectory() as scratch:
        taught = study_logs(config, Path(scratch) / "check", use_truth=False, progress=progress)
    for change in taught.patch.changes:
        code = "journeys-off-map" if change.kind == "way" else "journeys-disagree"
        where = "ways" if change.kind == "way" else f"cells {', '.join(change.cells)}"
        findings.add(code, where, _evidence(change), "warning")
    for one in taught.unlisted:
        evidence = f"It serves in {one.journeys} journeys."
        findings.add("journeys-unlisted-cell", f"cell {one.cell}", evidence, "warning")
    for note in taught.unused:
        # It begins with the name of a log.
        findings.add("journeys-unused", str(config.track_path), f"{note}.", "warning")
    return findings.result()


def checked_together(one: CheckResult, other: CheckResult) -> CheckResult:
    """Return two results as one, errors first."""
    return CheckResult.of((*one.findings, *other.findings))


_SAYS = {
    "offset": "levels are {offset_db:+.1f} dB from the prediction",
    "dead": "never received where predicted",
    "moved": "received as if it stood at {east_m:.0f} m east, {north_m:.0f} m north",
    "turned": "received as if turned by {turn_deg:.0f} degrees",
    "rotated": "all sectors are received as if turned by {turn_deg:.0f} degrees",
    "swapped": "each is received as the other is predicted",
    "way": "a path off the map",
}


def _evidence(change: Change) -> str:
    said = _SAYS[change.kind].format(**vars(change))
    return (
        f"{said[:1].upper()}{said[1:]} (log Bayes factor {change.log_bayes_factor:.1f}, "
        f"{change.agreeing} of {change.journeys} journeys)."
    )
