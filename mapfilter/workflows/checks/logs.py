"""Checks of the logs or recordings that a configuration names, against plan and area."""

from __future__ import annotations

from pathlib import Path

from mapfilter._words import number_of
from mapfilter.check.findings import Findings, Severity
from mapfilter.config.sections import Config
from mapfilter.errors import MapfilterError, listed
from mapfilter.geodesy import same_crs
from mapfilter.lattice import Lattice, outside_m
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.checks.foreign_cells import other_networks
from mapfilter.tracks.checks.misplaced import AWAY_M
from mapfilter.tracks.checks.motion_fault import fault_notes
from mapfilter.tracks.checks.placeless import LOCAL_FRAME, LOCAL_FRAME_HINT
from mapfilter.tracks.checks.range_units import range_notes
from mapfilter.tracks.checks.refused_motion import mirrored_notes, refused_faults
from mapfilter.tracks.checks.rounded_degrees import rounded_notes
from mapfilter.tracks.checks.speeds import speed_fault
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import OpenedLog
from mapfilter.tracks.schema import SERVING
from mapfilter.workflows.inputs.logs import journeys_of, open_journey

_MANY = 0.2
_OF_COLUMNS = {"heading_rad": "log-headings", "turn_rad": "log-turns", "step_m": "log-steps"}


def check_logs(
    config: Config, lattice: Lattice | None, plan: CellPlan | None, findings: Findings
) -> None:
    """Check every log or recording of ``[track]``, if it names any."""
    if config.track.path is None:
        return
    try:
        paths = journeys_of(config)
    except MapfilterError as error:
        findings.add_faults(error, "log-invalid")
        return
    for path in paths:
        try:
            opened = open_journey(config, path, lattice)
        except MapfilterError as error:
            findings.add_faults(error, "log-invalid")
            continue
        _check_recordings(opened, findings)
        refused = refused_faults(opened.log, config.track.factors.given)
        for column, code in _OF_COLUMNS.items():
            for note in fault_notes(opened.log.notes, column):
                severity: Severity = "error" if column in refused else "warning"
                findings.add(code, str(path), f"{note}.", severity)
        for note in rounded_notes(opened.log.notes):
            findings.add("log-degrees-rounded", str(path), f"{note}.", "warning")
        for note in mirrored_notes(opened.log):
            severity = "error" if "heading_rad" in refused else "warning"
            findings.add("log-mirrored", str(path), note, severity)
        whose = config.filter.bayes.of(BayesFilter).vehicle, opened.log.vehicle, opened.log.imu
        # Positions say more of the lengths of steps than their speed does.
        in_doubt = all(one is None for one in whose) and not fault_notes(opened.log.notes, "step_m")
        if in_doubt and (fault := speed_fault(opened.log.motion)):
            findings.add("log-speeds", str(path), f"Motion: {fault}.", "warning")
        log = opened.log
        near = lattice is not None and _is_near(path, log, lattice, findings)
        # Motion without any reports is located by the streets alone.
        if near and plan and (len(log.radio) or log.motion.empty):
            _check_cells(path, name_by_plan(log, plan), plan, findings)
        if near and plan:
            for note in range_notes(name_by_plan(log, plan), plan):
                findings.add("log-ranges", str(path), f"{note}.", "warning")


def _check_recordings(opened: OpenedLog, findings: Findings) -> None:
    """Report recordings of which many rows cannot be used, and those without motion."""
    for recording in opened.recordings:
        lost = recording.unusable_rows
        if lost > _MANY * recording.rows:
            reasons = "; ".join(str(found) for found in recording.unusable[:2])
            evidence = f"{lost} of {recording.rows} rows cannot be used: {reasons}."
            findings.add("log-rows-unused", str(recording.path), evidence, "warning")
    if opened.log.motion.empty:
        held = [name for name in ("radio", "gnss") if len(getattr(opened.log, name))]
        evidence = (
            f"There is no motion (rows of {', '.join([*held, *opened.sensors]) or 'nothing'})."
        )
        findings.add("log-without-motion", opened.name, evidence, "warning")


def _is_near(path: Path, log: TrackLog, lattice: Lattice, findings: Findings) -> bool:
    if not same_crs(log.crs, lattice.crs):
        evidence = f"The log is in {LOCAL_FRAME}: {LOCAL_FRAME_HINT}."
        findings.add("crs-mixed", str(path), evidence)
        return False
    for table in ("truth", "gnss"):
        places = getattr(log, table)
        if places.empty:
            continue
        away_m = outside_m(places["east_m"].to_numpy(), places["north_m"].to_numpy(), lattice)
        if away_m.min() > AWAY_M:
            evidence = f"All positions ({table}) lie {away_m.min() / 1000:.0f} km or more outside."
            findings.add("log-outside-area", str(path), evidence)
            return False
    return True


def _check_cells(path: Path, log: TrackLog, plan: CellPlan, findings: Findings) -> None:
    """Report serving cells that the plan lacks, and logs without serving cells."""
    rows = log.radio[(log.radio["role"] == SERVING).to_numpy() & log.radio["cell"].notna()]
    serving = rows["cell"]
    if serving.empty:
        evidence = f"No serving cell is named in {number_of(len(log.radio), 'row')} of reports."
        findings.add("log-cells-unknown", str(path), evidence, "warning")
        return
    unknown = ~serving.isin(plan.ids).to_numpy()
    if unknown.any():
        # The most frequent first.
        ids = serving[unknown].value_counts().index.astype(str).tolist()
        evidence = f"{int(unknown.sum())} of {number_of(len(serving), 'report')} are of "
        evidence += f"{number_of(len(ids), 'serving cell')} that the plan lacks: {listed(ids)}"
        others = other_networks(rows[unknown], plan)
        evidence += f"; {others}." if others else "."
        severity: Severity = "error" if unknown.all() else "warning"
        findings.add("log-cells-unknown", str(path), evidence, severity)
