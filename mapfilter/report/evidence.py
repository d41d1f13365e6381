"""How sure a filter says it is, along the way."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, Truth
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.report.canvas import BLUE, ORANGE, VERMILLION, bottom_legend, picture
from mapfilter.report.errors import shade_searching_and_lost

_SIZE_IN = (9.0, 5.6)
_MOST_COLUMNS = 5


def plot_evidence(
    estimate: TrackEstimate, truth: Truth | None, path: Path, *, title: str = ""
) -> None:
    """Draw entropy, the leading hypothesis's and the runner-up's shares, and the status.

    Over the metres really travelled; over seconds where the truth is not known.

    Parameters
    ----------
    estimate : TrackEstimate
        With evidence.
    truth : Truth or None
    path : Path
        PNG to write.
    title : str
        Above the picture; without one, the filter's name.

    Raises
    ------
    InputError
        The filter holds no probabilities, or there is no epoch.
    OutputError
        The picture cannot be written.
    """
    evidence = estimate.evidence
    if evidence is None or not len(estimate):
        raise fail(InputError, "estimate, evidence", "epochs with probabilities", "none")
    known = truth is not None and truth.time_s.size > 0
    along = truth.distance_at(estimate.time_s) if truth is not None and known else estimate.time_s
    with picture(path, *_SIZE_IN) as figure:
        above, below = figure.subplots(2, 1, sharex=True)
        above.plot(along, evidence.entropy_bits, color=BLUE, linewidth=1.5, label="entropy")
        above.set_ylabel("entropy over 25 m squares / bit")
        above.set_ylim(bottom=0.0)
        mass = 100 * estimate.mass_50m
        within = f"within {SUCCESS_RADIUS_M:.0f} m of the leading hypothesis"
        below.plot(along, mass, color=VERMILLION, linewidth=1.5, label=within)
        runner_up = 100 * evidence.runner_up_mass
        below.plot(along, runner_up, color=ORANGE, linewidth=1.2, label="runner-up")
        below.set_ylabel("probability / %")
        below.set_ylim(0.0, 104.0)
        below.set_xlabel("distance travelled / m" if known else "time / s")
        end = max(float(np.max(along)), float(along[0]) + 1.0)
        below.set_xlim(float(along[0]), end)
        for axes in (above, below):
            shade_searching_and_lost(axes, estimate, along, named=axes is above)
            axes.spines[["top", "right"]].set_visible(False)
        above.set_title(title or f"Filter: {estimate.filter}")
        bottom_legend(figure, _MOST_COLUMNS)
