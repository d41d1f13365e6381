"""Reasons for unused readings, in words."""

from __future__ import annotations

from collections.abc import Mapping

from mapfilter.filters.contract import Reason

REASONS: Mapping[Reason, str] = {
    Reason.USED: "used",
    Reason.NOT_MOVED_ENOUGH: "too near to the last one that was used",
    Reason.NO_SERVING_CELL: "the report has no serving cell",
    Reason.SECOND_SERVING_CELL: "a second serving cell in one report; the first counts",
    Reason.UNKNOWN_CELL: "the database does not have this cell",
    Reason.NO_CELL: "neither cell nor carrier is reported",
    Reason.NO_POINTS_IN_CELL: "the database has the cell, but no point where it is received",
    Reason.NO_CANDIDATES_LEFT: "no hypothesis agrees with it",
    Reason.NO_HEADING: "no heading for the step, or turns that fixes have not aligned yet",
    Reason.NO_STEP: "the length of the step is unknown",
    Reason.NO_READING: "nothing was measured",
    Reason.MOTION_MISSING: "motion is missing for a while",
    Reason.MOTION_STUCK: "no motion, but levels change: a ride, or a sensor that stands still",
    Reason.HEADING_STUCK: "the heading repeats itself while one walks",
    Reason.IMPOSSIBLE_STEP: "a step is longer than anything can go in that time",
    Reason.PHONE_TURNED: "headings fit better as those of a phone that was turned or mirrored",
    Reason.OTHER_UNIT: "lengths of steps are read in another unit from here on",
    Reason.DELIVERED_TWICE: "the same rows of motion were delivered again",
    Reason.STALE_RADIO: "the modem repeats an old report",
    Reason.NOT_STARTED: "came before the first reading that the filter can start from",
    Reason.NOT_USED_BY_FILTER: "this filter does not use readings of this kind",
    Reason.AMBIGUOUS_CELL: "several cells of the database fit",
    Reason.UPDATE_FAILED: "the filter's update failed",
    Reason.UNKNOWN_SATELLITE: "the satellite's place is unknown",
    Reason.BELOW_HORIZON: "the satellite is below the horizon",
    Reason.SECOND_READING: "a second reading of the same satellite or cell",
    Reason.REJECTED_BY_EVIDENCE: "contradicts the position that the other readings give",
    Reason.ON_PROBATION: "was wrong before, and has to agree for a while first",
    Reason.REPEATED_FIX: "the receiver repeats its last position",
}
