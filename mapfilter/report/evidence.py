"""The evidence of a filter along a track: entropy, and the shares of its hypotheses."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.report.canvas import (
    BLUE,
    ORANGE,
    VERMILLION,
    bottom_legend,
    new_figure,
    styled,
    tidy,
)
from mapfilter.report.errors import covers, shade_statuses
from mapfilter.report.pauses import broken_at_pauses

_EVIDENCE_IN = (9.0, 5.6)
_SQUARE_M, _SQUARE_S = 25.0, 20.0


@styled
def plot_evidence(estimate: TrackEstimate, truth: Truth | None, *, title: str = "") -> Figure:
    """Draw entropy, the leading hypothesis's and the runner-up's shares, and the status.

    Over the true distance travelled; over seconds where the truth is not known, or that of a part
    only. The entropy is counted over squares of 25 m and rises by up to a bit wherever the belief
    lies across two of them, so its mean over as long a way (or over 20 s) is drawn. Without a title
    it is the filter's name.

    Raises
    ------
    InputError
        The filter holds no probabilities, or there is no epoch.
    """
    evidence = estimate.evidence
    if evidence is None or not len(estimate):
        raise fail(InputError, "estimate, evidence", "epochs with probabilities", "none")
    along, across, window, mean = estimate.time_s, "time / s", _SQUARE_S, f"{_SQUARE_S:g} s"
    if truth is not None and truth.time_s.size and covers(truth, estimate):
        along, across = truth.distance_at(estimate.time_s), "distance travelled / m"
        window, mean = _SQUARE_M, f"{_SQUARE_M:g} m"
    figure = new_figure(*_EVIDENCE_IN)
    above, below = figure.subplots(2, 1, sharex=True)
    entropy_bits = running_mean(along, evidence.entropy_bits, window)
    at, entropy_bits, mass, runner_up = broken_at_pauses(
        estimate, along, entropy_bits, 100 * estimate.mass_50m, 100 * evidence.runner_up_mass
    )
    above.plot(at, entropy_bits, color=BLUE, linewidth=1.5, label=f"entropy, mean over {mean}")
    above.set_ylabel("entropy over 25 m squares / bit")
    above.set_ylim(bottom=0.0)
    within = f"within {SUCCESS_RADIUS_M:.0f} m of the leading hypothesis"
    below.plot(at, mass, color=VERMILLION, linewidth=1.5, label=within)
    below.plot(at, runner_up, color=ORANGE, linewidth=1.2, label="runner-up")
    below.set(xlabel=across, ylabel="probability / %", ylim=(0.0, 104.0))
    below.set_xlim(float(along[0]), max(float(np.max(along)), float(along[0]) + 1.0))
    for axes in (above, below):
        shade_statuses(axes, estimate, along, named=axes is above)
        tidy(axes, grid=False)
    above.set_title(title or f"Filter: {estimate.filter}")
    bottom_legend(figure, 5)
    return figure


def running_mean(along: Floats, values: Floats, width: float) -> Floats:
    """Return the mean of the values within half a width to both sides of each place.

    ``along`` does not decrease. Values that are not finite count nowhere, and their places and
    those without any other are NaN.

    Examples
    --------
    >>> running_mean(np.arange(5.0), np.array([0.0, 3.0, 0.0, 3.0, 0.0]), 2.0).tolist()
    [1.5, 1.0, 2.0, 1.0, 1.5]
    """
    finite = np.isfinite(values)
    sums = np.concatenate([[0.0], np.cumsum(np.where(finite, values, 0.0))])
    counts = np.concatenate([[0], np.cumsum(finite)])
    low = np.searchsorted(along, along - width / 2, side="left")
    high = np.searchsorted(along, along + width / 2, side="right")
    with np.errstate(invalid="ignore"):
        means = (sums[high] - sums[low]) / (counts[high] - counts[low])
    return np.where(finite, means, np.nan)
