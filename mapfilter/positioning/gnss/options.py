"""Options of GNSS, timing advances and time differences in the map filter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le, Lt

from mapfilter.models.ranging import GSM_STEP_M
from mapfilter.options import Below1, NotNegative, Options, Positive


@dataclass(frozen=True, slots=True)
class GnssOptions(Options):
    """Errors of pseudoranges and fixes, receiver's clock and height, and rejection.

    Parameters
    ----------
    zenith_m : float
        Standard deviation of a pseudorange overhead where the log has none; grows as one over the
        sine of the elevation.
    echo_m : float
        Standard deviation of each satellite's lasting error in the open.
    echo_memory_m, echo_memory_s : float
        Distance and time over which lasting errors are correlated by 1/e.
    reflection_m : float
        Standard deviation of lasting errors by reflections at an elevation of 45 degrees, where the
        log has no deviations; in proportion to the cotangent of the elevation.
    reflection_times : float
        The same where it has: times the deviation, times its ratio to the least one of the epoch.
    lateness : float
        Mean of the errors by reflections over their deviation: reflections are late.
    fix_memory_m, fix_memory_s : float
        Distance and time for which errors of fixes last; fixes in a row count as one over it,
        whichever takes longer; 0 s: by the distance alone.
    spacing_m, pause_s : float
        Satellites are used with each radio report that is used; without one after this distance,
        or after this time at a standstill.
    mask_deg : float
        Elevation below which satellites are left out.
    height_m, height_sd_m : float
        Height of the antenna over the ellipsoid before the first pseudorange.
    slope : float
        Standard deviation of the change of height, metres per root metre travelled.
    clock_sd_m, drift_sd_mps : float
        Of the clock's error and rate before the first pseudorange.
    outliers : float
        Share of the readings that carry no information.
    gate, search_gate : float
        Readings are rejected where their log-likelihood is lower than usual by more than this:
        after convergence, and while searching.
    probation_s : float
        Time after a rejection of all satellites in which none is used.
    trust : float
        Bound of the logarithm of the Bayes factor that satellites alone give an alternative.
    trust_grows_s : float
        Time in which ``trust`` grows by one, as spoofing is temporary.
    agreed_trust, agreed_nats : float
        The same bound, and what a fix gives, where the way of the rejected fixes goes on from those
        that were used before.
    dispute_s : float
        Duration of a rejection after which an alternative is started.
    trial_m : float
        Distance for which readings that have led away must agree before they are used again.
    """

    zenith_m: Positive = 2.0
    echo_m: NotNegative = 4.0
    echo_memory_m: Positive = 100.0
    echo_memory_s: Positive = 120.0
    reflection_m: NotNegative = 4.0
    reflection_times: NotNegative = 2.0
    lateness: NotNegative = 1.0
    fix_memory_m: Positive = 20.0
    fix_memory_s: NotNegative = 0.0
    spacing_m: NotNegative = 10.0
    pause_s: NotNegative = 10.0
    mask_deg: Annotated[float, Ge(0), Lt(90)] = 5.0
    height_m: Annotated[float, Ge(-1e4), Le(1e4)] = 100.0
    height_sd_m: NotNegative = 200.0
    slope: NotNegative = 0.3
    clock_sd_m: Positive = 3e5
    drift_sd_mps: NotNegative = 100.0
    outliers: Below1 = 0.05
    gate: NotNegative = 8.0
    search_gate: NotNegative = 16.0
    probation_s: NotNegative = 5.0
    trust: NotNegative = 3.0
    trust_grows_s: Positive = 120.0
    agreed_trust: NotNegative = 12.0
    agreed_nats: NotNegative = 2.0
    dispute_s: NotNegative = 10.0
    trial_m: NotNegative = 100.0


@dataclass(frozen=True, slots=True)
class TimingOptions(Options):
    """Errors of timing advances and time differences of arrival.

    Parameters
    ----------
    step_m : float
        Distance of one step of timing advance: GSM; 78.1 m in LTE.
    advance_sd_m : float
        Standard deviation of a timing advance before rounding.
    advance_memory_m, difference_memory_m : float
        Distance for which errors of timing advances and of differences last.
    difference_sd_m : float
        Standard deviation of a time of arrival, as a distance, where the log has none.
    clip_sd : float
        Largest innovation in standard deviations; outliers count as this.
    height_m : float
        Of the phone above ground; a site's height is its cell's.
    """

    step_m: Positive = GSM_STEP_M
    advance_sd_m: Positive = 200.0
    advance_memory_m: Positive = 500.0
    difference_memory_m: Positive = 20.0
    difference_sd_m: Positive = 30.0
    clip_sd: Positive = 3.0
    height_m: Positive = 1.5
