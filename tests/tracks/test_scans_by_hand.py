"""Scans and repeated readings: by their definitions, row by row."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.checks.missing_levels import levels_note
from mapfilter.tracks.checks.repeated_readings import repeated_readings
from mapfilter.tracks.joining.equal_times import in_order, joined_times
from mapfilter.tracks.scans import SCAN_S, advertised, scan_of_rows


def by_definition(rows):
    """Go over the moments one by one, with sets of what was received since the scan began."""
    scans, began_s, received, scan = [], None, set(), -1
    for time_s, moment in rows.groupby("time_s", sort=True):
        own = set()
        for row in moment.itertuples():
            if row.technology == "BLE":
                continue
            if pd.notna(row.cell) or pd.notna(row.arfcn) or pd.notna(row.bsic):
                own.add(("cell", str(row.cell), str(row.arfcn), str(row.bsic)))
            if row.role == "serving":
                own.add(("serving", row.technology))
        for row in moment.itertuples():
            if row.technology == "BLE" and row.role == "serving":
                own.add(("serving", row.technology))
        if began_s is None or time_s - began_s >= SCAN_S or own & received:
            scan, began_s, received = scan + 1, time_s, set()
        received |= own
        scans += [scan] * len(moment)
    return scans


def drawn(seed, count=60):
    rng = np.random.default_rng(seed)
    pick = lambda *some: rng.choice(np.array(some, dtype=object), count)  # noqa: E731
    return pd.DataFrame(
        {
            "time_s": np.cumsum(pick(0.0, 0.0, 0.125, 0.25, 0.5, 1.5)).astype(float),
            "role": pick("serving", "neighbour", "neighbour", "neighbour", "neighbour"),
            "technology": pick("GSM", "LTE", "LTE", "BLE"),
            "cell": pick(None, None, "a", "b", "c", "d", "e", "f"),
            "arfcn": pick(None, 1, 2, 3, 4, 5, 6, 7, 8, 9),
            "bsic": pick(None, 1, 2, 3, 4, 5),
        }
    )


@pytest.mark.parametrize("seed", range(6))
def test_scans_by_definition(seed):
    rows = drawn(seed)
    found = scan_of_rows(rows).tolist()
    assert found == by_definition(rows)
    assert found[-1] > 5
    # Without technologies all rows are of one, and none is a beacon's.
    one = rows.drop(columns="technology")
    assert scan_of_rows(one).tolist() == by_definition(rows.assign(technology=""))
    assert not advertised(one).any()
    assert advertised(rows).tolist() == (rows["technology"] == "BLE").tolist()


def row(time_s, role="neighbour", cell=None, technology="GSM", arfcn=None, bsic=None):
    of_cell = {"cell": cell, "technology": technology, "arfcn": arfcn, "bsic": bsic}
    return {"time_s": time_s, "role": role, **of_cell}


@pytest.mark.parametrize(
    ("rows", "scans"),
    [
        # A second after the first is another scan; also where those between are nearer.
        ([row(0.0, cell="a"), row(0.999, cell="b")], [0, 0]),
        ([row(0.0, cell="a"), row(1.0, cell="b")], [0, 1]),
        ([row(0.0, cell="a"), row(0.5, cell="b"), row(1.0, cell="c")], [0, 0, 1]),
        # The same cell, or a serving one of the technology, is reported again.
        ([row(0.0, cell="a"), row(0.5, cell="a")], [0, 1]),
        ([row(0.0, arfcn=5, bsic=1), row(0.5, arfcn=5, bsic=2)], [0, 0]),
        ([row(0.0, arfcn=5, bsic=1), row(0.5, arfcn=5, bsic=1)], [0, 1]),
        ([row(0.0, bsic=1), row(0.5, bsic=1)], [0, 1]),
        ([row(0.0, arfcn=5), row(0.5, arfcn=5)], [0, 1]),
        ([row(0.0, "serving", "a"), row(0.5, "serving", "b")], [0, 1]),
        ([row(0.0, "serving", "a"), row(0.5, "serving", "b", "LTE")], [0, 0]),
        ([row(0.0, "serving"), row(0.5, "serving")], [0, 1]),
        # Levels alone name no cell, and beacons are received at any time.
        ([row(0.0), row(0.5)], [0, 0]),
        ([row(0.0, cell="a", technology="BLE"), row(0.5, cell="a", technology="BLE")], [0, 0]),
        # Rows of one time are of one scan, whatever they are.
        ([row(0.0, cell="a"), row(0.0, cell="a"), row(0.5, cell="b")], [0, 0, 0]),
        ([row(0.0, cell="a"), row(0.0, cell="a"), row(9.0, cell="a")], [0, 0, 1]),
    ],
)
def test_where_a_scan_ends(rows, scans):
    assert scan_of_rows(pd.DataFrame(rows)).tolist() == scans


def reports(*texts, role="neighbour"):
    """Rows of words such as "s70" or "n80@a": role, level and, behind the @, a cell."""
    rows = []
    for time_s, text in enumerate(texts):
        for word in text.split():
            level, _, cell = word[1:].partition("@")
            kind = "serving" if word[0] == "s" else role
            rows.append((float(time_s), kind, -float(level), cell or None))
    return pd.DataFrame(rows, columns=["time_s", "role", "level_dbm", "cell"])


def left(rows):
    equal = rows.duplicated().to_numpy()
    found = repeated_readings(rows, equal)
    assert not (found & ~equal).any()
    return [
        " ".join(
            f"{one.role[0]}{-one.level_dbm:g}" + (f"@{one.cell}" if pd.notna(one.cell) else "")
            for one in some.itertuples()
        )
        for _, some in rows[~found].groupby("time_s")
    ]


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        # Nothing is delivered twice: two neighbours of one level are two readings.
        (["s70 n80 n80"], ["s70 n80 n80"]),
        (["s70 n80 n80 n80 n90"], ["s70 n80 n80 n80 n90"]),
        # Delivered twice, with one neighbour of the level and with two.
        (["s70 n80 s70 n80"], ["s70 n80"]),
        (["s70 n80 n80 s70 n80 n80"], ["s70 n80 n80"]),
        (["s70 n80 n80 n80 s70 n80 n80 n80"], ["s70 n80 n80 n80"]),
        # An odd number of a report that came twice: what is left over was not delivered twice.
        (["s70 s70 n80 n80 n80"], ["s70 n80 n80"]),
        # Neighbours with an identity are readings of one cell.
        (["s70 n80@a n80@a"], ["s70 n80@a"]),
        (["n80@a n90 n90 n80@a"], ["n80@a n90"]),
        # The serving cell came once, whatever neighbours with a name did.
        (["s70 n80@a n80@a n90 n90"], ["s70 n80@a n90 n90"]),
        # Without any of these: all rows equally often, unless it is one level alone.
        (["n80 n90 n80 n90"], ["n80 n90"]),
        (["n80 n90 n80"], ["n80 n90 n80"]),
        (["n80 n80 n90 n90 n90 n90"], ["n80 n90 n90"]),
        (["n80 n80"], ["n80 n80"]),
        # Each report by itself, in any order.
        (["n80 n90 n80 n90", "s70 n80 n80", "n60 n60", "s70 s70 n80 n80"],
         ["n80 n90", "s70 n80 n80", "n60 n60", "s70 n80"]),
        (["s70 s70", "s70 n80@a n80@a"], ["s70", "s70 n80@a"]),
        (["s70 n80", "s70 n80"], ["s70 n80", "s70 n80"]),
    ],
)  # fmt: skip
def test_readings_that_were_delivered_several_times(given, kept):
    assert left(reports(*given)) == kept
    # Columns that tell neighbours apart may be missing altogether.
    if not any("@" in text for text in given):
        rows = reports(*given).drop(columns="cell")
        found = repeated_readings(rows, rows.duplicated().to_numpy())
        assert len(rows[~found]) == sum(len(text.split()) for text in kept)


@pytest.mark.parametrize("name", ["cell", "ci", "bsic"])
def test_what_tells_neighbours_apart(name):
    rows = reports("s70 n80 n80").drop(columns="cell").assign(**{name: [None, 7, 7]})
    found = repeated_readings(rows, rows.duplicated().to_numpy())
    assert found.tolist() == [False, False, True]
    # A carrier may have several cells.
    rows = rows.rename(columns={name: "arfcn"})
    assert not repeated_readings(rows, rows.duplicated().to_numpy()).any()


def test_tables_without_roles_keep_none_of_what_is_equal():
    rows = reports("n80 n80").drop(columns="role")
    equal = rows.duplicated().to_numpy()
    assert repeated_readings(rows, equal) is equal


@pytest.mark.parametrize("count", [9, 10])
def test_ten_neighbours_without_levels_are_noted(count):
    rows = pd.DataFrame({"role": ["serving"] + ["neighbour"] * count, "level_dbm": np.nan})
    told = levels_note(rows, "radio")
    assert len(told) == (count == 10)
    assert not told or "10 neighbours are of little use" in told[0]
    rows.loc[0, "level_dbm"] = -70.0
    assert levels_note(rows, "radio") == ()


def test_rows_of_one_time_are_joined_in_the_order_of_their_values():
    rows = pd.DataFrame(
        {
            "time_s": [2.0, 1.0, 2.0, 2.0, 1.0],
            "a": [np.nan, 5.0, 6.0, 7.0, np.nan],
            "b": ["x", None, "y", None, "z"],
        }
    )
    found = joined_times(rows)
    assert found.to_dict("list") == {"time_s": [2.0, 1.0], "a": [6.0, 5.0], "b": ["x", "z"]}
    assert list(found.columns) == list(rows.columns)
    assert joined_times(found) is found
    parts = [rows.assign(of=n) for n in range(2)]
    held = in_order(parts)
    assert held["time_s"].tolist() == [1.0] * 4 + [2.0] * 6
    assert held["of"].tolist() == [0, 0, 1, 1] + [0] * 3 + [1] * 3
