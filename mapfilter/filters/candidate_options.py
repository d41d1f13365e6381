"""What Khalaf-Allah (2007) leaves open in Tables 2 and 3, as named options."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Literal

from mapfilter.errors import ConfigError, Faults


@dataclass(frozen=True, slots=True)
class CandidateOptions:
    """Readings of what the paper leaves open.

    Parameters
    ----------
    resolution_m : float
        ``DB_res``: a candidate survives if its match is at most this far away (line 15).
    update_length_m : float
        Distance after which candidates are updated (line 8). The paper uses ``DB_res``; 0 updates
        at every step. On a 5 m lattice steps of 1.4 m snap back to the point they came from; about
        22 m fit the paper's Fig. 5 best.
    tracking_length_m : float or None
        The same for Table 3, which as printed matches at every step (0); None takes
        ``update_length_m``.
    prediction : {"last_heading", "displacement"}
        Line 10 projects the whole travelled distance along the last heading, as printed;
        "displacement" adds up the steps as vectors.
    duplicates : {"set", "list"}
        Whether candidates matched to the same point become one.
    threshold : int
        α: the filter switches when no more candidates are left. With a set 1, with a list about 10.
    at_threshold : {"switch", "stall"}
        n = α is covered by neither branch of Table 2: it switches, or, as printed, nothing happens.
    switch_check : {"next_call", "same_call"}
        As printed, Table 2 finds out at the next call that few are left and gives up that call's
        motion, 22 m where a call is that long; "same_call" looks right after the update, which
        alone gives errors as small as the paper's Table 4.
    when_empty : {"fail", "reinitialise"}
        With no candidate left the run has failed, or starts again from the serving cell's points.
    """

    resolution_m: float = 5.0
    update_length_m: float = 22.0
    tracking_length_m: float | None = None
    prediction: Literal["last_heading", "displacement"] = "displacement"
    duplicates: Literal["set", "list"] = "set"
    threshold: int = 1
    at_threshold: Literal["switch", "stall"] = "switch"
    switch_check: Literal["next_call", "same_call"] = "same_call"
    when_empty: Literal["fail", "reinitialise"] = "fail"

    def __post_init__(self) -> None:
        faults = Faults()
        if not (isfinite(self.resolution_m) and self.resolution_m > 0):
            faults.add("resolution_m", "metres > 0", self.resolution_m)
        for name in ("update_length_m", "tracking_length_m"):
            length_m = getattr(self, name)
            if length_m is not None and not (isfinite(length_m) and length_m >= 0):
                faults.add(name, "metres >= 0", length_m)
        if self.threshold < 1:
            faults.add("threshold", "at least 1", self.threshold)
        faults.raise_if_any(ConfigError)
