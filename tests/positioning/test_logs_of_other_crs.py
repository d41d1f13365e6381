"""A log in another projected CRS than the database is located and scored as in the same one."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS, walk_log, walk_tables

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.geodesy import grid_convergence_rad, project, unproject

LOCAL = "+proj=tmerc +lat_0=0 +lon_0=0 +type=crs"
OTHERS = ("EPSG:32630", "EPSG:3763", "EPSG:23029")
"""The next zone, a national grid, and another datum, whose numbers differ by 200 m alone."""


def stated_in(crs, *, gnss=False):
    """The walk over the cross as a program that works in another CRS writes it."""
    tables = walk_tables()
    places = tables["truth"]
    lon_deg, lat_deg = unproject(CRS, places["east_m"], places["north_m"])
    east_m, north_m = project(crs, lon_deg, lat_deg)
    turned_rad = np.subtract(
        *(grid_convergence_rad(one, lon_deg.mean(), lat_deg.mean()) for one in (crs, CRS))
    )
    motion = tables["motion"]
    tables["motion"] = motion.assign(heading_rad=motion["heading_rad"] + turned_rad)
    tables["truth"] = places.assign(east_m=east_m, north_m=north_m)
    if gnss:
        errors = {"var_east_m2": 9.0, "var_north_m2": 100.0, "cov_east_north_m2": 0.0}
        tables["gnss"] = tables["truth"].iloc[::20].assign(**errors)
    return mf.make_log(crs, **tables, start_utc_s=1_700_000_000.0)


@pytest.fixture(scope="module")
def usual(database):
    log = walk_log()
    return mf.score(mf.locate(log, database, "candidate"), log.truth)


@pytest.mark.parametrize("crs", OTHERS)
def test_a_log_is_located_where_it_was(crs, database, usual):
    log = stated_in(crs)
    track = mf.locate(log, database, "candidate")
    assert track.estimate.crs == track.log.crs == CRS
    assert any(note.startswith(f"projected from {crs} to {CRS}: ") for note in track.log.notes)
    score = mf.score(track, track.log.truth)
    assert score.error_mean_m == pytest.approx(usual.error_mean_m, abs=0.5)
    assert score.success


@pytest.mark.parametrize("crs", OTHERS)
def test_a_score_is_never_that_of_numbers_of_another_crs(crs, database, usual):
    log = stated_in(crs)
    track = mf.locate(log, database, "candidate")
    later = log.truth[log.truth["time_s"] > 100.0]
    for truth in (log, log.truth, track.log, later):
        for located in (track, track.estimate):
            assert mf.score(located, truth).error_mean_m == pytest.approx(
                usual.error_mean_m, abs=0.5
            )


def test_a_log_that_is_written_and_read_is_scored_alike(database, usual, tmp_path):
    mf.write_log(stated_in("EPSG:32630"), tmp_path / "log")
    track = mf.locate(tmp_path / "log", database, "candidate")
    score = mf.score(track, mf.read_log(tmp_path / "log"))
    assert score.error_mean_m == pytest.approx(usual.error_mean_m, abs=0.5)


def test_read_log_projects_a_track_log(tmp_path):
    mf.write_log(stated_in("EPSG:32630", gnss=True), tmp_path / "log")
    log = mf.read_log(tmp_path / "log", crs=CRS)
    wanted = walk_log()
    assert log.crs == CRS
    for name in ("east_m", "north_m"):
        np.testing.assert_allclose(log.truth[name], wanted.truth[name], atol=1e-6)
    heading_rad = log.motion["heading_rad"] - wanted.motion["heading_rad"]
    np.testing.assert_allclose(np.sin(heading_rad), 0.0, atol=1e-6)
    # An error ellipse turns with the grid: it has the same axes, and its long one is true north's.
    fix = log.gnss.iloc[0]
    both = fix["cov_east_north_m2"]
    covariance_m2 = [[fix["var_east_m2"], both], [both, fix["var_north_m2"]]]
    values, axes = np.linalg.eigh(covariance_m2)
    np.testing.assert_allclose(values, [9.0, 100.0])
    turned_rad = np.arctan2(*axes[::-1, 1]) - np.pi / 2
    lon_deg, lat_deg = unproject(CRS, fix["east_m"], fix["north_m"])
    apart_rad = np.subtract(
        *(grid_convergence_rad(one, float(lon_deg), float(lat_deg)) for one in (CRS, "EPSG:32630"))
    )
    assert abs(np.degrees(apart_rad)) > 3
    np.testing.assert_allclose(np.sin(turned_rad), np.sin(apart_rad), atol=1e-5)


def test_unknown_errors_of_fixes_stay_unknown(tmp_path):
    log = stated_in("EPSG:32630")
    fixes = log.truth[["time_s", "east_m", "north_m"]].iloc[::20]
    mf.write_log(mf.make_log(log.crs, gnss=fixes, truth=log.truth), tmp_path / "log")
    moved = mf.read_log(tmp_path / "log", crs=CRS)
    assert moved.gnss[["var_east_m2", "var_north_m2", "cov_east_north_m2"]].isna().all(axis=None)


def test_headings_without_a_place_are_turned_about_the_database(database):
    log = stated_in("EPSG:32630")
    bare = mf.make_log(log.crs, motion=log.motion, radio=log.radio)
    track = mf.locate(bare, database, "candidate")
    apart_rad = track.log.motion["heading_rad"] - walk_log().motion["heading_rad"]
    np.testing.assert_allclose(np.sin(apart_rad), 0.0, atol=1e-4)


def test_headings_without_any_place_keep_their_crs(tmp_path):
    log = stated_in("EPSG:32630")
    mf.write_log(mf.make_log(log.crs, motion=log.motion), tmp_path / "log")
    kept = mf.read_log(tmp_path / "log", crs=CRS)
    assert kept.crs == "EPSG:32630"
    assert kept.notes[-1].startswith(f"crs = {CRS} has no effect: headings in EPSG:32630 turn by ")


def test_positions_that_a_crs_does_not_cover_are_left_out(tmp_path):
    log = stated_in("EPSG:32630")
    places = log.truth[["time_s", "east_m", "north_m"]]
    far_m = np.ravel(project(log.crs, 60.0, 41.0))
    lost = pd.DataFrame({"time_s": [500.0], "east_m": far_m[:1], "north_m": far_m[1:]})
    fixes = pd.concat([places.iloc[::20], lost])
    mf.write_log(mf.make_log(log.crs, gnss=fixes), tmp_path / "log")
    moved = mf.read_log(tmp_path / "log", crs=CRS)
    assert len(moved.gnss) == len(fixes) - 1
    assert any("gnss: 1 position left out: EPSG:32629 has no such" in note for note in moved.notes)


def walk_log_with(levels_dbm):
    log = walk_log()
    return dataclasses.replace(log, radio=log.radio.assign(level_dbm=levels_dbm))


def test_single_reports_of_a_log_in_another_crs(database):
    def reports(log):
        levels = np.where(log.radio["cell"] == "W", -60.0, -70.0)
        return dataclasses.replace(log, radio=log.radio.assign(level_dbm=levels))

    same, other = reports(walk_log()), reports(stated_in("EPSG:32630"))
    found = [mf.locate_reports(one, database, "knn") for one in (same, other)]
    np.testing.assert_allclose(found[1].error_m, found[0].error_m, atol=1e-4)
    found = [mf.locate_reports(same, [same, one], "knn") for one in (same, other)]
    np.testing.assert_allclose(found[1].east_m, found[0].east_m, atol=1e-4)


def test_single_reports_of_a_log_of_another_crs_need_no_positions(database, tmp_path):
    """Headings, which they have no use for, kept the log in its CRS, and it was refused."""
    log = stated_in("EPSG:32630")
    levels = np.where(log.radio["cell"] == "W", -60.0, -70.0)
    bare = mf.make_log(log.crs, motion=log.motion, radio=log.radio.assign(level_dbm=levels))
    mf.write_log(bare, tmp_path / "log")
    found, read = (mf.locate_reports(one, database, "knn") for one in (bare, tmp_path / "log"))
    placed = mf.locate_reports(walk_log_with(levels), database, "knn")
    np.testing.assert_allclose(found.east_m, placed.east_m, atol=1e-6)
    np.testing.assert_allclose(read.east_m, placed.east_m, atol=1e-6)


def test_epochs_are_in_the_crs_of_the_filter_that_takes_them():
    log, same = stated_in("EPSG:32630", gnss=True), walk_log()
    found = [epoch.gnss for epoch in mf.epochs(log, CRS) if epoch.gnss is not None]
    places = same.truth.iloc[::20]
    np.testing.assert_allclose([fix.east_m for fix in found], places["east_m"], atol=1e-6)
    np.testing.assert_allclose([fix.north_m for fix in found], places["north_m"], atol=1e-6)
    own = next(epoch.gnss for epoch in mf.epochs(log) if epoch.gnss is not None)
    assert own.east_m == log.gnss["east_m"].iloc[0]


def test_a_truth_that_was_projected_by_hand_is_taken_as_it_is(database, usual):
    """It keeps the attributes of the table that it was made of."""
    log = stated_in("EPSG:23029")
    track = mf.locate(log, database, "candidate")
    east_m, north_m = project(CRS, *unproject(log.crs, log.truth["east_m"], log.truth["north_m"]))
    by_hand = log.truth.assign(east_m=east_m, north_m=north_m)
    assert by_hand.attrs
    assert mf.score(track, by_hand).error_mean_m == pytest.approx(usual.error_mean_m, abs=0.5)


def test_epochs_of_a_log_that_cannot_be_projected_are_refused():
    log = stated_in("EPSG:32630")
    headed = mf.make_log(log.crs, motion=log.motion)
    with pytest.raises(InputError, match="found headings in EPSG:32630, and no position"):
        mf.epochs(headed, CRS)
    own = mf.make_log(LOCAL, gnss=log.truth[["time_s", "east_m", "north_m"]])
    with pytest.raises(InputError, match=f"expected {CRS}, found a local frame"):
        mf.epochs(own, CRS)
    assert len(mf.epochs(own)) == len(mf.epochs(own, LOCAL)) == len(own.gnss)
