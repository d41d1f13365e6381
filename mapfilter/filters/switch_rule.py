"""The switch rule: when a search has converged, and when it begins again."""

from __future__ import annotations

from math import isfinite, nan

from mapfilter.filters.contract import Status


def switched(
    status: Status,
    travelled_m: float,
    agreement_start_m: float,
    *,
    agrees: bool,
    splits: bool,
    hold_m: float,
) -> tuple[Status, float]:
    """Return the status after an update, and at which distance the switch rule began to hold.

    The distance is NaN where the rule does not hold.

    Parameters
    ----------
    agrees : bool
        Whether the rule holds now; counts only in a search.
    splits : bool
        Whether so little of the belief lies in one place that a search begins again.
    hold_m : float
        For how many metres the rule must hold.

    Examples
    --------
    >>> switched(Status.SEARCHING, 100.0, 85.0, agrees=True, splits=False, hold_m=14.0)
    (<Status.CONVERGED: 'CONVERGED'>, 85.0)
    """
    if status is Status.SEARCHING:
        if not agrees:
            return status, nan
        since_m = agreement_start_m if isfinite(agreement_start_m) else travelled_m
        # A distance that is not known does not hold.
        if not travelled_m - since_m >= hold_m:
            return status, since_m
        status, agreement_start_m = Status.CONVERGED, since_m
    elif status is Status.CONVERGED:
        status = Status.TRACKING
    return (Status.SEARCHING, nan) if splits else (status, agreement_start_m)
