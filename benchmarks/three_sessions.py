"""What three sessions can say about radii of 95 %: python benchmarks/three_sessions.py DATA.

Of every three sessions of a part of the Ottawa data, each is located by the other two, which also
calibrate the radii. Printed are the mean and the quantiles, over all such triples, of the share of
reports within the 95 % radius.
"""

import sys
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from mapfilter.experiments.benchmarks.ottawa_sessions import read_session
from mapfilter.experiments.benchmarks.single_reports import locate_sessions, row_of
from mapfilter.geodesy import utm_crs
from mapfilter.workflows.evaluations.ottawa import session_files

_SHARES = (5, 25, 50, 75, 95)


def shares_of_triples(data: Path, part: str, method: str) -> np.ndarray:
    """Return the share within the 95 % radius of each triple whose sessions all have radii."""
    sessions = [read_session(file) for file in session_files(data, part)]
    lon_deg, lat_deg = np.median([(s.lon_deg[0], s.lat_deg[0]) for s in sessions], axis=0)
    crs = utm_crs(float(lon_deg), float(lat_deg))
    found = []
    for three in combinations(sessions, 3):
        located = list(locate_sessions(three, crs, method))
        # Two sessions without a cell in common calibrate nothing.
        if all(len(one.validations) for one in located):
            found.append(row_of(part, method, located).within_95)
    return np.array(found)


def main(arguments: Sequence[str]) -> None:
    """Print a line for each part and method."""
    for part in arguments[1:] or ("lacolyoc", "carling"):
        for method in ("probabilistic", "knn"):
            share = shares_of_triples(Path(arguments[0]), part, method)
            quantiles = " ".join(f"{one:.3f}" for one in np.percentile(share, _SHARES))
            within = np.mean((share >= 0.93) & (share <= 0.97))
            print(
                f"{part}, {method}: {len(share)} triples, mean {share.mean():.3f}, "
                f"5/25/50/75/95 %: {quantiles}; {within:.0%} in 0.93-0.97"
            )


if __name__ == "__main__":
    main(sys.argv[1:])
