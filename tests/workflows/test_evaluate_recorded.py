"""``mapfilter evaluate`` on recordings: units are kept, faults are named, rows are put together."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command_line import assert_refused, mapfilter
from scipy.io import savemat

from mapfilter.errors import ConfigError, InputError, Stopped, fail
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded import wifi
from mapfilter.experiments.recorded.benchmark import Benchmark, Journey, Judged, Task
from mapfilter.experiments.recorded.rows import Found
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix
from mapfilter.workflows.evaluations import recorded as evaluate_recorded
from mapfilter.workflows.evaluations.recorded import run_all, run_recorded


def _estimate(off_m):
    def fix(k):
        radii, covariance = np.array([1.0, 2.0, 3.0]), np.eye(2)
        place = (500.0 + 10 * k, 500.0 + off_m)
        status = Status.CONVERGED if k == 3 else Status.TRACKING if k > 3 else Status.SEARCHING
        return Fix(float(k), *place, covariance, radii, status, 9, 1.0, 0, 0.0, Reason.USED)

    return TrackEstimate.of_fixes("EPSG:32632", "bayes", [fix(k) for k in range(9)])


class _Fake:
    """A benchmark of two parts that counts what it located."""

    def __init__(self):
        self.done, self.stop_at, self.drawn = [], None, False

    def units(self, folder):
        names = sorted(path.stem for path in folder.glob("*.txt"))
        return [(name, "unit", 2) for name in names]

    def judge(self, task, _):
        if len(self.done) == self.stop_at:
            raise Stopped(15)
        self.done.append(task.name)
        error = np.array([float(task.run + 1)])
        found = Found(task.part, "bayes", task.unit, True, True, False, error, error <= 1.0)
        times = np.arange(9.0)
        truth = Truth(times, 500.0 + 10 * times, np.full(9, 500.0))
        journey = Journey(_estimate(float(task.run)), truth)
        return Judged((found,), {"bayes": journey} if self.drawn else {})

    def benchmark(self):
        return Benchmark("fake", "fake-data", ("*.txt",), self.units, self.judge)


@pytest.fixture
def fake(tmp_path, monkeypatch):
    made = _Fake()
    (tmp_path / "fake-data").mkdir()
    for name in ("one", "two"):
        (tmp_path / "fake-data" / f"{name}.txt").write_text("data\n")
    monkeypatch.setattr(evaluate_recorded, "BENCHMARKS", {"fake": made.benchmark()})
    return made


def test_rows_table_and_pictures(fake, tmp_path):
    fake.drawn = True
    result = run_recorded("fake", tmp_path, tmp_path / "out")
    assert [(row.part, row.n, row.mean_m, row.coverage_95) for row in result.rows] == [
        ("one", 2, 1.5, 0.5),
        ("two", 2, 1.5, 0.5),
    ]
    table = json.loads((tmp_path / "out" / "table.json").read_text())
    assert table["rows"][0]["published_m"] is None
    assert [path.name for path in result.pictures] == [
        "one-bayes-worst.png",
        "two-bayes-worst.png",
    ]
    assert all(path.stat().st_size > 10_000 for path in result.pictures)
    worst = table["worst"]
    assert [(one["part"], one["method"], one["run"]) for one in worst] == [
        ("one", "bayes", 1),
        ("two", "bayes", 1),
    ]
    assert worst[0]["what"] == "no claim is more than 50 m off"
    assert worst[0]["picture"].endswith("one-bayes-worst.png")


def test_finished_runs_are_kept_and_damaged_ones_done_again(fake, tmp_path):
    fake.stop_at = 3
    with pytest.raises(Stopped) as stopped:
        run_recorded("fake", tmp_path, tmp_path / "out")
    assert "--resume" in stopped.value.__notes__[0]
    first, fake.done, fake.stop_at = fake.done, [], None
    done = []
    run_recorded(
        "fake", tmp_path, tmp_path / "out", resume=True, progress=lambda *a: done.append(a)
    )
    assert first == ["one-unit-0", "one-unit-1", "two-unit-0"]
    assert fake.done == ["two-unit-1"]
    assert done == [(3, 4), (4, 4)]
    file = tmp_path / "out" / "units" / "one-unit-1.json"
    file.write_text(file.read_text()[:50])
    fake.done = []
    run_recorded("fake", tmp_path, tmp_path / "out", resume=True)
    assert fake.done == ["one-unit-1"]


def _prepared(fake, monkeypatch):
    """Let the benchmark prepare two files, between which it can be stopped."""
    state = {"stop": False, "count": 0}

    def prepare(folder, work):
        state["count"] += 1
        work.mkdir(parents=True, exist_ok=True)
        for file in sorted(folder.glob("*.txt")):
            (work / file.name).write_text(file.read_text())
            if state["stop"]:
                raise Stopped(15)

    made = replace(fake.benchmark(), prepare=prepare)
    monkeypatch.setattr(evaluate_recorded, "BENCHMARKS", {"fake": made})
    return state


def _work(tmp_path):
    files = (tmp_path / "out" / "work").glob("*.txt")
    return {file.name: file.read_text() for file in files}


@pytest.mark.parametrize("resume", [True, False])
def test_a_preparation_that_was_stopped_is_done_again(fake, tmp_path, monkeypatch, resume):
    state = _prepared(fake, monkeypatch)
    state["stop"] = True
    with pytest.raises(Stopped):
        run_recorded("fake", tmp_path, tmp_path / "out")
    assert not _work(tmp_path)
    state["stop"] = False
    run_recorded("fake", tmp_path, tmp_path / "out", resume=resume)
    assert _work(tmp_path) == {"one.txt": "data\n", "two.txt": "data\n"}
    run_recorded("fake", tmp_path, tmp_path / "out", resume=True)
    assert state["count"] == 2


def test_work_of_other_data_is_not_mixed_in(fake, tmp_path, monkeypatch):
    state = _prepared(fake, monkeypatch)
    run_recorded("fake", tmp_path, tmp_path / "out")
    (tmp_path / "fake-data" / "one.txt").rename(tmp_path / "fake-data" / "three.txt")
    # Stopped with the head of the new data, and the work of the old ones, in place.
    state["stop"] = True
    with pytest.raises(Stopped):
        run_recorded("fake", tmp_path, tmp_path / "out")
    state["stop"] = False
    run_recorded("fake", tmp_path, tmp_path / "out", resume=True)
    assert set(_work(tmp_path)) == {"three.txt", "two.txt"}


@pytest.mark.usefixtures("fake")
def test_other_data_are_not_resumed(tmp_path):
    run_recorded("fake", tmp_path, tmp_path / "out")
    (tmp_path / "fake-data" / "one.txt").write_text("other\n")
    with pytest.raises(ConfigError, match="another data"):
        run_recorded("fake", tmp_path, tmp_path / "out", resume=True)


def test_parts_and_runs_are_chosen(fake, tmp_path):
    run_recorded("fake", tmp_path, tmp_path / "out", parts=["two"], runs=1)
    assert fake.done == ["two-unit-0"]
    with pytest.raises(ConfigError, match="one, two"):
        run_recorded("fake", tmp_path, tmp_path / "out", parts=["three"])


def test_what_runs_share_is_read_once_and_from_the_file_as_it_is(fake, tmp_path, monkeypatch):
    given = []

    def read(task):
        return (task.data / f"{task.part}.txt").read_text()

    def judge(task, shared):
        given.append((task.part, task.run, shared))
        return fake.judge(task, None)

    reads = []
    made = replace(fake.benchmark(), read=lambda task: reads.append(task.part) or read(task))
    monkeypatch.setattr(evaluate_recorded, "BENCHMARKS", {"fake": replace(made, judge=judge)})
    one = tmp_path / "fake-data" / "one.txt"
    one.write_text("before")
    run_recorded("fake", tmp_path, tmp_path / "first", parts=["one"])
    one.write_text("after")
    run_recorded("fake", tmp_path, tmp_path / "then", parts=["one"])
    assert given == [("one", run, text) for text in ("before", "after") for run in (0, 1)]
    assert reads == ["one", "one"]


@pytest.mark.parametrize(
    ("by_part", "most", "sizes"), [(False, 5, [2, 2]), (False, 1, [1] * 4), (True, 5, [4])]
)
def test_tasks_that_share_what_is_read_run_together(fake, tmp_path, by_part, most, sizes):
    made = replace(fake.benchmark(), shared_by_part=by_part)
    tasks = [Task("one", unit, run, tmp_path, tmp_path) for unit in ("a", "b") for run in (0, 1)]
    some = made.together(tasks, most)
    assert [len(each) for each in some] == sizes
    assert [task for each in some for task in each] == tasks


def test_all_names_what_is_missing_or_failed_and_keeps_the_rest(fake, tmp_path, monkeypatch):
    def damaged_walk(task, _):
        raise fail(InputError, f"{task.part}.txt", "a walk", "half of one")

    absent = replace(fake.benchmark(), name="absent", folder="absent-data")
    damaged = replace(fake.benchmark(), name="damaged", judge=damaged_walk)
    known = {"fake": fake.benchmark(), "absent": absent, "damaged": damaged}
    monkeypatch.setattr(evaluate_recorded, "BENCHMARKS", known)
    result = run_all(tmp_path, tmp_path / "out", names=("fake", "absent", "damaged"))
    # What comes last is in the file as well.
    written = json.loads((tmp_path / "out" / "table.json").read_text())
    assert [row["part"] for row in written["rows"]] == ["fake/one", "fake/two"]
    (missing,), (failed,) = written["missing"], written["failed"]
    assert missing.startswith("absent: ")
    assert "absent-data" in missing
    assert failed.startswith("damaged: ")
    assert "one.txt: expected a walk, found half of one" in failed
    assert (result.missing, result.failed) == ((missing,), (failed,))
    with pytest.raises(InputError, match="absent-data"):
        run_all(tmp_path, tmp_path / "out", names=("absent",))
    assert json.loads((tmp_path / "out" / "table.json").read_text()) == written
    # Where nothing is there, nothing is written; what is there and cannot be judged is told.
    with pytest.raises(InputError, match="absent-data"):
        run_all(tmp_path, tmp_path / "new", names=("absent",))
    assert not (tmp_path / "new").exists()
    with pytest.raises(InputError, match="half of one"):
        run_all(tmp_path, tmp_path / "new", names=("damaged",))
    assert json.loads((tmp_path / "new" / "table.json").read_text())["rows"] == []


def test_an_empty_folder_is_named(tmp_path):
    (tmp_path / "fingerprint-wifi").mkdir()
    with pytest.raises(InputError, match=r"UJI1\.mat"):
        run_recorded("fingerprints", tmp_path, tmp_path / "out")


def _wifi_set(rng, count):
    beacons = rng.uniform(0, 60, (8, 2))
    places = rng.uniform(0, 60, (count, 2))
    away = 1 + np.hypot(*(places[:, None] - beacons).transpose(2, 0, 1))
    levels = np.round(-40 - 25 * np.log10(away) + rng.normal(0, 2, away.shape))
    labels = np.column_stack([places, np.zeros((count, 3))])
    return levels, labels


def test_wifi_sets_by_the_command(tmp_path):
    folder = tmp_path / "fingerprint-wifi"
    folder.mkdir()
    for seed, name in enumerate(wifi.WIFI):
        levels, labels = _wifi_set(np.random.default_rng(seed), 160)
        database = {
            "trainingMacs": levels[:120],
            "trainingLabels": labels[:120],
            "testMacs": levels[120:],
            "testLabels": labels[120:],
        }
        savemat(folder / f"{name}.mat", {"database": database})
    out = tmp_path / "out"
    where = ("--data", tmp_path, "--out", out, "--workers", 1)
    done = mapfilter("evaluate", "fingerprints", *where, "--json")
    assert done.code == 0, done.err
    rows = done.json["rows"]
    assert [row["part"] for row in rows if row["method"] == "locate"] == list(wifi.WIFI)
    assert all(row["unit_count"] == row["n"] == 40 for row in rows)
    assert all(row["mean_m"] < 15 and row["success"] is None for row in rows)
    by = {(row["part"], row["method"]): row for row in rows}
    assert by["TUT1", "locate"]["baseline_m"] == by["TUT1", "3-nn"]["mean_m"]
    worst = done.json["worst"]
    assert len(worst) == len(rows) == len(list((out / "pictures").glob("*.png")))
    assert all(" m off; the 95 % radius of " in one["what"] for one in worst)


def test_single_reports_refuse_a_seed_and_going_on_as_nothing_is_drawn_or_kept(tmp_path):
    told = mapfilter(
        *("evaluate", "single-reports", "--data", tmp_path, "--seed", 1, "--resume"),
        *("--out", tmp_path / "out"),
    )
    assert_refused(told, "--seed", "--resume")
