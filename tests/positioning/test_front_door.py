"""The front door: names, laziness, how objects are shown, errors."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from cross_world import (
    LATTICE,
    WALK,
    levels_dbm,
    make_database,
    make_plan,
    make_routes,
    walk_log,
)
from matplotlib.figure import Figure
from recording_filter import Recording

import mapfilter as mf
from mapfilter.database.build import build
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.locators import as_filter
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters


@pytest.mark.parametrize("name", mf.__all__)
def test_every_name_loads_and_is_documented(name):
    assert getattr(mf, name).__doc__


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = mf.nothing


def test_importing_it_loads_no_library():
    code = (
        "import sys, mapfilter; "
        "print(sorted({'numpy', 'pandas', 'geopandas', 'numba', 'pydantic'} & set(sys.modules)))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.fixture(scope="module")
def track(database):
    return mf.locate(walk_log(), database, "candidate")


def test_objects_are_shown_in_two_lines(database, track):
    bayes = mf.locate(walk_log(), database).estimate
    scored = mf.score(track, walk_log().truth)
    for one in (database, walk_log(), track, track.estimate, bayes, bayes.evidence, scored):
        lines = repr(one).splitlines()
        assert 1 <= len(lines) <= 2, one
        assert max(map(len, lines)) <= 130, one


def test_a_track_as_tables_and_a_picture(track, database):
    table, places = track.to_dataframe(), track.to_geodataframe()
    assert len(table) == len(track)
    assert {"time_s", "east_m", "north_m", "radius_95_m", "status", "reason"} <= set(table)
    assert len(places) == table["east_m"].notna().sum() < len(table)
    assert places.crs == database.lattice.crs
    assert track.plot().get_title()
    assert "<table" in track._repr_html_()


def test_a_picture_is_saved_as_the_commands_save_theirs(track, tmp_path):
    """Also one of several in a figure, whose axes have a part of it as their figure."""
    path = mf.save_picture(track.plot(), str(tmp_path / "new" / "track.png"))
    assert path == tmp_path / "new" / "track.png"
    again = mf.save_picture(track.plot(), tmp_path / "again.png")
    assert path.read_bytes() == again.read_bytes()
    figure = Figure()
    left, _ = figure.subfigures(1, 2)
    mf.save_picture(track.plot(left.subplots()), tmp_path / "parts.svg")
    assert (tmp_path / "parts.svg").read_text().startswith("<?xml")
    with pytest.raises(mf.MapfilterError, match=r"\.png, \.svg or \.pdf"):
        mf.save_picture(figure, tmp_path / "track.bmp")


@pytest.mark.parametrize("filter_", ["ekf", mf.KalmanFilter(), mf.KalmanFilter], ids=str)
def test_a_filter_without_a_map_needs_no_database(filter_, tmp_path):
    walk = walk_log(WALK[:2])
    fixes = walk.truth[["time_s", "east_m", "north_m"]]
    log = mf.make_log(walk.crs, motion=walk.motion, gnss=fixes, truth=walk.truth)
    found = mf.locate(log, None, filter_)
    assert found.database is None
    assert mf.score(found, log.truth).error_mean_m < 20
    assert any(one.get_text() == "end" for one in found.plot().texts)
    assert found.view() is not None
    mf.write_log(log, tmp_path / "log")
    by_path = mf.locate(tmp_path / "log", filter=filter_)
    pd.testing.assert_frame_equal(by_path.to_dataframe(), found.to_dataframe())


def test_a_filter_without_a_map_may_have_sites_of_its_own(database):
    over_sites = mf.KalmanFilter().over_sites(database.plan)
    found = mf.locate(walk_log(), filter=over_sites).to_dataframe()
    by_database = mf.locate(walk_log(), database, over_sites).to_dataframe()
    pd.testing.assert_frame_equal(found, by_database)
    still = mf.make_log(walk_log().crs, motion=walk_log().motion)
    for filter_ in ("ekf", over_sites):
        (note,) = mf.locate(still, filter=filter_).log.notes
        assert note == "nothing is located: no positions and no radio to start from"


def test_cells_without_sites_are_left_out_where_there_are_fixes():
    walk = walk_log(WALK[:2])
    fixes = walk.truth[["time_s", "east_m", "north_m"]]
    placed = mf.make_log(walk.crs, motion=walk.motion, radio=walk.radio, gnss=fixes)
    found = mf.locate(placed, filter="ekf")
    note, _ = found.log.notes
    assert note.startswith(f"{len(walk.radio)} rows of cells (radio) left out: ")
    assert "KalmanFilter().over_sites(plan)" in note
    bare = mf.locate(mf.make_log(walk.crs, motion=walk.motion, gnss=fixes), filter="ekf")
    pd.testing.assert_frame_equal(bare.to_dataframe(), found.to_dataframe())


@pytest.mark.parametrize("filter_", [mf.CandidateFilter(), "candidate"], ids=str)
def test_a_filter_is_given_by_options_or_name(filter_, database, track):
    found = mf.locate(walk_log(), database, filter_)
    pd.testing.assert_frame_equal(found.to_dataframe(), track.to_dataframe())


def test_a_track_says_what_a_log_lacks_that_was_not_located(database):
    walk = walk_log(WALK[:2])
    fixes = walk.truth[["time_s", "east_m", "north_m"]]
    still = mf.make_log(walk.crs, radio=walk.radio, truth=walk.truth)
    (note,) = mf.locate(still, database).log.notes
    assert note.startswith("nothing is located: no motion (mf.read_log makes it of")
    assert note.endswith("mf.locate_reports needs none)")
    placed = mf.make_log(walk.crs, radio=walk.radio, gnss=fixes)
    lost = mf.locate(placed, database, "candidate")
    (note,) = lost.log.notes[-1:]
    assert note.startswith("nothing is located: no motion")
    assert note.endswith('filter="ekf" needs none beside positions)')
    for kept in ({"gnss": fixes}, {"gnss": fixes, "radio": walk.radio}):
        fixed = mf.make_log(walk.crs, **kept)
        (note,) = mf.locate(fixed, database).log.notes[-1:]
        assert note.startswith("no motion: positions alone are followed (mf.read_log makes it of")
        assert mf.locate(fixed, database, "ekf").estimate.converged_at is not None
    alone = mf.make_log(walk.crs, motion=walk.motion[:40])
    notes = mf.locate(alone, database).log.notes
    assert any("never converged in" in one for one in notes)
    assert mf.locate(walk, database, "candidate").log.notes == walk.notes


def test_a_score_has_the_error_of_each_epoch(track):
    score = mf.score(track, walk_log().truth)
    assert score.switched
    assert score.error_m.shape == (len(track),)
    assert list(score.to_dataframe()["success"]) == [score.success]
    assert repr(mf.score(track.estimate, walk_log().truth)) == repr(score)


def test_a_score_takes_ground_truth_in_any_order_and_each_row_once(track):
    truth = walk_log().truth
    expected = repr(mf.score(track, truth))
    for other in (truth.sample(frac=1, random_state=0), pd.concat([truth, truth]), truth[::-1]):
        assert repr(mf.score(track, other)) == expected
        assert repr(mf.score(track, Truth.of_table(other))) == expected
    with pytest.raises(mf.MapfilterError, match="truth row 6, east_m"):
        mf.score(track, truth.assign(east_m=truth["east_m"].where(truth.index != 5)))


def test_a_score_has_the_share_within_the_radius(track):
    truth = walk_log().truth
    assert np.isnan(mf.score(track, truth).within_95)
    wide_m = np.where(np.arange(len(track.estimate)) % 4, 1e6, 1e-6)
    radii_m = np.repeat(wide_m[:, None], 3, axis=1)
    score = mf.score(replace(track.estimate, radii_m=radii_m), truth)
    begin = track.estimate.converged_at
    scored = np.flatnonzero(np.isfinite(score.error_m))
    expected = np.mean(scored[scored >= begin] % 4 > 0)
    assert score.within_95 == score.to_dataframe()["within_95"][0] == expected
    assert repr(score).endswith(f" m at 95 %; the 95 % radius holds {expected:.2f}")


def test_a_score_says_what_the_ground_truth_does_not_tell(track):
    truth = walk_log().truth
    whole = mf.score(track, truth)
    late = mf.score(track, truth[truth["time_s"] > whole.switch_time_s])
    assert (late.switched, late.success) == (True, None)
    begins = "Score: converged where there is no ground truth; then "
    assert repr(late).startswith(begins + f"{late.error_mean_m:.1f} m on average")
    other = mf.score(track, truth.assign(time_s=truth["time_s"] + 1e6))
    assert repr(other).splitlines() == [
        "Score: converged where there is no ground truth; no error is known",
        f"  {other.notes[0]}",
    ]
    assert "covers no epoch of the log" in other.notes[0]
    assert other.notes[0].endswith("another clock or time zone?")
    assert whole.notes == ()
    assert "notes" not in other.to_dataframe()


def test_a_ground_truth_of_elsewhere_is_refused(track, database):
    log = walk_log()
    degrees = log.truth.assign(east_m=-8.61, north_m=41.15)
    likely = "degrees given for metres"
    with pytest.raises(mf.MapfilterError, match=f"truth: expected positions near .+{likely}"):
        mf.score(track, degrees)
    far = mf.make_log(log.crs, motion=log.motion, radio=log.radio, truth=degrees)
    with pytest.raises(mf.MapfilterError, match=f"log, truth: expected positions near .+{likely}"):
        mf.locate(far, database)


def test_a_log_of_unknown_cells_says_which(database):
    log = walk_log()
    radio = log.radio.assign(cell="X" + log.radio["cell"].astype(str))
    found = mf.locate(mf.make_log(log.crs, motion=log.motion, radio=radio), database)
    (note,) = [one for one in found.log.notes if "nothing is located" in one]
    first = radio.loc[radio["role"] == "serving", "cell"].value_counts().index[0]
    assert f"(the log has {first}" in note
    assert f"the database has {database.cell_ids[0]}, " in note
    assert len(found.log.notes) == 1
    assert "capitals" not in note
    assert repr(found).endswith("; 1 note in log.notes")
    small = log.radio.assign(cell=log.radio["cell"].str.lower())
    found = mf.locate(mf.make_log(log.crs, motion=log.motion, radio=small), database)
    (note,) = [one for one in found.log.notes if "nothing is located" in one]
    assert "some differ by capitals alone)" in note


@pytest.mark.parametrize(
    ("name", "likely"),
    [("Bayes", "bayes"), ("bays", "bayes"), ("EKF", "ekf"), ("my.module.Mine", "my.module:Mine")],
)
def test_a_wrong_name_of_a_filter_names_the_likely_one(database, name, likely):
    with pytest.raises(mf.MapfilterError) as caught:
        mf.locate(walk_log(), database, name)
    assert str(caught.value).endswith(f"(likely: {likely})")


def test_the_embedded_map_in_other_letters_is_named(rasters):
    with pytest.raises(mf.MapfilterError, match='the embedded map "helsinki"'):
        mf.read_routes("Helsinki", rasters.lattice)


def test_what_is_no_ground_truth_is_refused(track):
    with pytest.raises(mf.MapfilterError, match="columns time_s, east_m and north_m, found x"):
        mf.score(track, pd.DataFrame({"x": [1.0]}))
    with pytest.raises(mf.MapfilterError, match="two positions or more, found 1"):
        mf.score(track, walk_log().truth.iloc[:1])
    blind = mf.make_log(walk_log().crs, motion=walk_log().motion)
    with pytest.raises(mf.MapfilterError, match="the log has no ground truth"):
        mf.score(track, blind.truth)


def test_an_unknown_filter_is_refused(database):
    with pytest.raises(mf.MapfilterError, match="filter: expected bayes"):
        mf.locate(walk_log(), database, "bays")


@pytest.mark.parametrize("given", [Recording, f"{__name__}:Recording"], ids=["class", "name"])
def test_a_custom_filter_is_the_same_by_class_and_by_name(given, database):
    with pytest.raises(mf.MapfilterError, match=r"recording_filter.py line \d+, in step.*no idea"):
        mf.locate(walk_log(), database, given)
    bound = as_filter(given, database)
    assert bound.uses == ("gnss",)


def test_the_class_of_options_means_its_defaults(database):
    assert as_filter(mf.CandidateFilter, database).filter.options == mf.CandidateFilter()


@pytest.fixture(scope="module")
def rasters(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rasters")
    make_database(folder)
    return mf.open_rasters(next(folder.rglob("*.tif")), "level")


def test_single_reports_are_named_by_the_plan_as_replays_are(tmp_path):
    plan = make_plan()
    numbered = [
        replace(cell, mcc=262, mnc=1, lac=7, ci=100 + k) for k, cell in enumerate(plan.cells)
    ]
    plan = replace(plan, cells=tuple(numbered))
    items = ((cell.id, levels_dbm(cell)) for cell in plan.cells)
    write_rasters(tmp_path / "rxlev.tif", LATTICE, items, plan.ids)
    known = build(open_rasters(tmp_path / "rxlev.tif"), plan, make_routes(), tmp_path / "database")
    walk = walk_log()
    number = {cell.id: cell.ci for cell in plan.cells}
    radio = walk.radio.assign(
        mcc=262, mnc=1, lac=7, ci=walk.radio["cell"].map(number).astype("Int64"), cell=None
    )
    nameless = mf.make_log(walk.crs, motion=walk.motion, radio=radio, truth=walk.truth)
    found = mf.locate_reports(nameless, known, "knn").to_dataframe()
    named = mf.locate_reports(walk, known, "knn").to_dataframe()
    assert len(named) > 50
    pd.testing.assert_frame_equal(found, named)
