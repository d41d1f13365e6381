"""The table of a sweep: null where undefined, parts that are cut off, memory that stays flat."""

from dataclasses import replace
from math import nan

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mapfilter.errors import StoreError
from mapfilter.evaluation.accuracy import Accuracy
from mapfilter.evaluation.claims import ClaimedRadii
from mapfilter.experiments.sweep.plan import LONGEST_BATCH, Reading, SweepPlan
from mapfilter.experiments.sweep.table import (
    SCHEMA,
    join_parts,
    note_whole,
    read_part,
    read_runs,
    row,
    to_table,
    write_part,
)
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.tracks.imu_noise import ImuNoise

NEVER = Accuracy(False, False, nan, nan, nan, nan, nan, nan, 0)
RIGHT = Accuracy(True, True, 60.0, 84.0, 3.0, 4.0, 5.0, 9.0, 10)
SILENT = ClaimedRadii(12, 0, None, nan)
HELD = ClaimedRadii(12, 10, 9, 21.0)
PLAN = SweepPlan((Reading("set", CandidateFilter()),), draws=25)


def rows(first, end, score=RIGHT):
    return to_table([row(run, score, HELD, "TRACKING") for run in PLAN.select(first, end)])


def test_a_row_tells_run_and_score_and_null_where_there_is_none():
    table = to_table([row(next(PLAN.select(3, 4)), NEVER, SILENT, "SEARCHING")])
    assert table.schema.equals(SCHEMA)
    found = table.to_pylist()[0]
    assert (found["draw"], found["filter"], found["sigma_trans_m"]) == (3, "candidate", 0.2)
    assert found["success"] is False
    assert found["error_mean_m"] is found["switch_distance_m"] is found["update_length_m"] is None
    assert (found["epochs"], found["claimed_epochs"]) == (12, 0)
    assert found["held_95_epochs"] is found["radius_95_median_m"] is None


def test_parts_join_to_the_whole(tmp_path):
    parts = []
    for number, (first, end) in enumerate(PLAN.batches()):
        parts.append(tmp_path / f"{number}.parquet")
        write_part(rows(first, end), parts[-1])
        assert read_part(parts[-1], end - first).equals(rows(first, end))
        assert read_part(parts[-1], end - first + 1) is None
    sizes = [end - first for first, end in PLAN.batches()]
    join_parts(map(read_part, parts, sizes), tmp_path / "runs.parquet")
    found = read_runs(tmp_path / "runs.parquet")
    assert found["draw"].tolist() == list(range(25))
    assert found["success"].all()


def test_what_pandas_notes_of_columns_may_be_damaged(tmp_path):
    frame, path = rows(0, 5).to_pandas(), tmp_path / "runs.parquet"
    table = pa.Table.from_pandas(frame, schema=SCHEMA)
    noted = table.schema.metadata[b"pandas"]
    for damage in (b"", noted[:-40], noted.replace(b'"name"', b'"nome"'), b"\xff\xfe"):
        pq.write_table(table.replace_schema_metadata({b"pandas": damage}), path)
        pd.testing.assert_frame_equal(read_runs(path), frame)


def test_a_part_that_is_cut_off_is_none(tmp_path):
    part = tmp_path / "part.parquet"
    assert read_part(part, 5) is None
    write_part(rows(0, 5), part)
    whole = part.read_bytes()
    part.write_bytes(whole[:-20])
    assert read_part(part, 5) is None
    for place in range(0, len(whole), 7):
        part.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        assert read_part(part, 5) is None
    other = tmp_path / "other.parquet"
    other.write_bytes(whole)
    assert read_part(other, 5) is None, "a part under another's name"
    write_part(rows(0, 5).drop_columns(["draw"]), part)
    assert read_part(part, 5) is None


def test_another_table_is_refused(tmp_path):
    other = tmp_path / "other.parquet"
    with pytest.raises(StoreError, match="expected a readable file"):
        read_runs(other)
    pq.write_table(rows(0, 5).drop_columns(["draw", "route"]), other)
    with pytest.raises(StoreError, match="columns of a sweep"):
        read_runs(other)


def test_a_table_of_an_earlier_version_is_named_as_such(tmp_path):
    older = tmp_path / "runs.parquet"
    pq.write_table(rows(0, 5).drop_columns(["held_95_epochs", "claimed_epochs"]), older)
    note_whole(older, {"version": 1})
    expected = "none of claimed_epochs, held_95_epochs.+an earlier version of mapfilter"
    with pytest.raises(StoreError, match=expected):
        read_runs(older)


@pytest.mark.parametrize(
    ("routes", "draws", "sigmas"), [(3, 2, 40), (3, 1, 1), (100, 1, 3), (7, 5, 7), (1, 90, 9)]
)
def test_batches_hold_all_runs_once_and_whole_journeys_or_shares_of_one(routes, draws, sigmas):
    noises = tuple(ImuNoise(sigma_trans_m=0.01 * n) for n in range(sigmas))
    plan = replace(PLAN, routes=routes, draws=draws, noises=noises)
    batches = list(plan.batches())
    assert [n for first, end in batches for n in range(first, end)] == list(range(plan.runs))
    own = plan.runs // (routes * len(plan.radios) * len(plan.report_periods_s))
    for first, end in batches:
        assert end - first <= LONGEST_BATCH
        assert first // own == (end - 1) // own or first % own == end % own == 0
