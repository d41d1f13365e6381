"""When a filter says that it has found itself."""

from __future__ import annotations

from math import isfinite, nan

from mapfilter.filters.contract import Status


def switched(
    status: Status, travelled_m: float, agreed_at_m: float, *, agrees: bool, hold_m: float
) -> tuple[Status, float]:
    """Return the status after an update, and since when the switch rule holds.

    Parameters
    ----------
    status : Status
        Before.
    travelled_m : float
    agreed_at_m : float
        Distance travelled when the rule began to hold; NaN where it does not.
    agrees : bool
        Whether it holds now.
    hold_m : float
        For how many metres it must.

    Examples
    --------
    >>> switched(Status.SEARCHING, 100.0, 85.0, agrees=True, hold_m=14.0)
    (<Status.CONVERGED: 'CONVERGED'>, 85.0)
    """
    if status is Status.CONVERGED:
        return Status.TRACKING, agreed_at_m
    if status is not Status.SEARCHING:
        return status, agreed_at_m
    if not agrees:
        return Status.SEARCHING, nan
    since_m = agreed_at_m if isfinite(agreed_at_m) else travelled_m
    if travelled_m - since_m >= hold_m:
        return Status.CONVERGED, since_m
    return Status.SEARCHING, since_m
