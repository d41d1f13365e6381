"""Arguments of sweeps and of the contract suite that are none, and runs that a file kept."""

import io
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import pandas as pd
import pytest
from cross_world import CRS

import mapfilter as mf
from mapfilter._arguments import check_arguments, executor_argument
from mapfilter.experiments.sweep.table import SCHEMA
from mapfilter.testing import check_filter


def runs():
    values = {field.name: field.type.to_pandas_dtype()() for field in SCHEMA}
    made = pd.DataFrame([values | {"filter": name} for name in ("a", "a", "b")])
    return made.assign(success=[True, False, True], switched=True, epochs=9, claimed_epochs=4)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([1], r"^Sweep, runs: expected a table such as runs of a sweep, found list$"),
        (None, r"^Sweep, runs: expected a table such as runs of a sweep, found None$"),
        (pd.DataFrame({"success": [True]}), r"^Sweep, runs: expected the columns of .*, found no "),
        (runs().drop(columns="switched"), r"^Sweep, runs: .*SCHEMA, found no switched$"),
    ],
)
def test_what_is_no_table_of_runs(given, message):
    with pytest.raises(mf.MapfilterError, match=message):
        mf.Sweep(given)


def test_runs_that_were_kept_as_text_are_the_same_sweep():
    kept = pd.read_csv(io.StringIO(runs().to_csv(index=False)))
    pd.testing.assert_frame_equal(mf.Sweep(kept).to_dataframe(), mf.Sweep(runs()).to_dataframe())


@pytest.mark.parametrize("kind", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_the_class_of_an_executor_is_none(kind):
    with pytest.raises(mf.MapfilterError, match=rf"executor: .*, found the class {kind.__name__}$"):
        check_arguments("sweep", keywords=[executor_argument(kind)])
    with kind(1) as executor:
        check_arguments("sweep", keywords=[executor_argument(executor), executor_argument(None)])


def test_the_contract_suite_names_exchanged_arguments(database):
    log = mf.make_log(CRS, motion=pd.DataFrame({"time_s": [0.0], "step_m": [1.0]}))
    with pytest.raises(mf.MapfilterError) as caught:
        check_filter("candidate", log, database)
    assert str(caught.value).count("(likely: arguments exchanged; the order is filter_, ") == 2
    with pytest.raises(mf.MapfilterError, match=r"^check_filter, log: .*, found DataFrame$"):
        check_filter("candidate", database, log.motion)
