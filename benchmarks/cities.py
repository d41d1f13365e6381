"""Benchmark results of several cities as one table: python benchmarks/cities.py [KIND] OUT...

Each OUT is the output folder of ``mapfilter evaluate global-positioning`` in one city, all with the
same cases. Figures of each city are separated by slashes; shares are over all cities, with 95 %
intervals over journeys. KIND is --errors (the default), --radii (how often each radius held) or
--sensors (how soon faults of the sensors are noticed).
"""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import Any

from mapfilter._json_files import read_sealed
from mapfilter.evaluation.accuracy import RADII
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.benchmarks.results import CaseResult, summarise

Cities = Sequence[CaseResult]


def rows_of(out: Path) -> list[dict[str, Any]]:
    """Return the runs of a benchmark."""
    parts = sorted((out / "batches").glob("*.json"))
    return [row for part in parts for row in read_sealed(part)["rows"]]


def of_cities(cities: Cities, name: str, digits: int) -> str:
    """Return a figure of each city."""
    shown = (f"{getattr(one, name):.{digits}f}" for one in cities)
    return " / ".join("–" if value == "nan" else value for value in shown)


def share(result: CaseResult, name: str, digits: int = 3) -> str:
    """Return a share over all cities with its interval; none where nothing was claimed."""
    if not isfinite(getattr(result, f"{name}_low")):
        return "–"
    low, high = (getattr(result, f"{name}_{end}") for end in ("low", "high"))
    return f"{getattr(result, name):.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"


def counts(result: CaseResult) -> tuple[str, str]:
    """Return how many runs are right, and how many wrong, with its interval."""
    right, wrong = (round(value * result.runs) for value in (result.success, result.wrong))
    return f"{right} of {result.runs}", f"{wrong} ({result.wrong_low:.2f}–{result.wrong_high:.2f})"


def errors(pooled: CaseResult, cities: Cities) -> dict[str, str]:
    """Return how far positions are off."""
    right, wrong = counts(pooled)
    return {
        "Right": right,
        "Wrong (95 % interval)": wrong,
        "To CONVERGED, m": of_cities(cities, "switch_mean_m", 0),
        "Mean error, m": of_cities(cities, "error_mean_m", 1),
        "95 % error, m": of_cities(cities, "error_95_m", 0),
        "Claimed": f"{pooled.claimed:.2f}",
        "Within the 95 % radius": share(pooled, "coverage_95", 2),
        "Claimed, more than 50 m off": share(pooled, "off_50m"),
        "False LOST per km": f"{pooled.false_lost_per_km:.2f}",
        "Hazardous": f"{pooled.hazardous:.4f}",
    }


def radii(pooled: CaseResult, _cities: Cities) -> dict[str, str]:
    """Return how often each radius held."""
    return {f"{one} %": share(pooled, f"coverage_{one}", 2) for one in RADII}


def sensors(pooled: CaseResult, _cities: Cities) -> dict[str, str]:
    """Return what becomes of positions under faults of the sensors."""
    _, wrong = counts(pooled)
    return {
        "Wrong (95 % interval)": wrong,
        "Claimed": f"{pooled.claimed:.2f}",
        "Claimed, more than 50 m off": share(pooled, "off_50m"),
        "Within the 95 % radius": share(pooled, "coverage_95", 2),
        "Walks with a wrong claim after the fault": f"{pooled.fault_wrong:.2f}",
        "Noticed after: median, s": f"{pooled.fault_noticed_s:.0f}",
        "Never noticed": f"{pooled.fault_unnoticed:.2f}",
    }


KINDS: Mapping[str, Callable[[CaseResult, Cities], dict[str, str]]] = MappingProxyType(
    {"--errors": errors, "--radii": radii, "--sensors": sensors}
)


def main(kind: str, outs: Sequence[Path]) -> None:
    """Print a header, one row for each case, and one for all together."""
    cities = [rows_of(out) for out in outs]
    cases = json.loads((outs[0] / "benchmark.json").read_text())["cases"]
    names = [name for name in cases if any(row["case"] == name for rows in cities for row in rows)]
    for number, name in enumerate([*names, None]):
        chosen = [[row for row in rows if name in (None, row["case"])] for rows in cities]
        case = Case(name or "all")
        pooled = summarise(case, "bayes", [row for rows in chosen for row in rows])
        row = KINDS[kind](pooled, [summarise(case, "bayes", rows) for rows in chosen])
        if number == 0:
            print(", ".join(f'"{column}"' for column in ("Case", *row)))
        print(", ".join([f"``{case.name}``", *row.values()]))


if __name__ == "__main__":
    given = sys.argv[1:]
    chosen_kind = given.pop(0) if given[0] in KINDS else "--errors"
    main(chosen_kind, [Path(name) for name in given])
