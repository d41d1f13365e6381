"""Reports of several sources as one."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from mapfilter._words import number_of
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import same_crs, shown_crs
from mapfilter.positioning.fingerprints.reports import Reports, make_reports

_COUNTED = re.compile(r"(\d{1,18}) (reading|report|row)s?( left out: .*)", re.DOTALL)


def joined_reports(parts: Sequence[Reports]) -> Reports:
    """Return the reports of several sources as one; blocks of -1 stay, others are renumbered.

    Raises
    ------
    InputError
        There is none, or they are in several CRS.
    """
    if not parts:
        raise fail(InputError, "reports", "at least one log", "none")
    for part in parts:
        if not same_crs(part.crs, parts[0].crs):
            expected = f"all reports in {shown_crs(parts[0].crs)}"
            raise fail(
                InputError, "reports, crs", expected, shown_crs(part.crs), "logs of several zones"
            )
    offset, base = 0, 0
    report, cell, blocks, serving = [], [], [], []
    for part in parts:
        names = np.array([*part.cell_ids, ""], dtype=str)
        report.append(part.report + offset)
        cell.append(names[part.cell])
        serving.append(names[part.serving])
        blocks.append(np.where(part.block < 0, -1, part.block + base))
        offset += len(part)
        base += int(part.block.max(initial=-1)) + 1
    return make_reports(
        parts[0].crs,
        np.concatenate(report),
        np.concatenate(cell),
        np.concatenate([part.level_dbm for part in parts]),
        count=offset,
        places=np.concatenate([part.places for part in parts]),
        time_s=np.concatenate([part.time_s for part in parts]),
        block=np.concatenate(blocks),
        serving=np.concatenate(serving),
        timing_advance=np.concatenate([part.timing_advance for part in parts]),
        sd_db=np.concatenate([part.sd_db for part in parts]),
        censored=np.concatenate([part.censored for part in parts]),
        notes=_joined_notes(parts),
    )


def _joined_notes(parts: Sequence[Reports]) -> tuple[str, ...]:
    """Return the notes of all parts, each once; counts of what was left out are added up."""
    counts: dict[tuple[str, str], int] = {}
    for note in (note for part in parts for note in part.notes):
        found = _COUNTED.fullmatch(note)
        (what, text), count = ((found[2], found[3]), int(found[1])) if found else (("", note), 0)
        counts[what, text] = counts.get((what, text), 0) + count
    return tuple(
        f"{number_of(count, what)}{text}" if what else text
        for (what, text), count in counts.items()
    )
