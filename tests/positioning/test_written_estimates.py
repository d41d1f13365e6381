"""Estimates and logs as files and as objects: written, read, compared, as tables of places."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from cross_world import walk_log

import mapfilter as mf
from mapfilter.errors import OutputError, StoreError


@pytest.fixture(scope="module")
def track(database):
    return mf.locate(walk_log(), database)


def test_a_track_is_written_and_read_back(track, tmp_path):
    path = mf.write_estimate(track, str(tmp_path / "new" / "track.parquet"))
    assert path == tmp_path / "new" / "track.parquet"
    assert mf.read_estimate(path) == track.estimate
    assert mf.read_estimate(mf.write_estimate(track.estimate, tmp_path / "a.parquet")) == (
        track.estimate
    )


@pytest.mark.parametrize(("name", "start"), [("a.gpx", "<?xml"), ("a.GeoJSON", '{"type":')])
def test_positions_are_written_as_commands_write_them(track, name, start, tmp_path):
    assert mf.write_estimate(track, tmp_path / name).read_text().startswith(start)


def test_other_names_and_files_are_refused(track, tmp_path):
    with pytest.raises(OutputError, match=r"ends in \.parquet, \.gpx, \.geojson, found \.csv"):
        mf.write_estimate(track, tmp_path / "track.csv")
    with pytest.raises(StoreError, match="expected a readable file"):
        mf.read_estimate(tmp_path / "none.parquet")
    (tmp_path / "replay").mkdir()
    mf.write_estimate(track, tmp_path / "replay" / "estimate.parquet")
    with pytest.raises(mf.MapfilterError, match=r"found a folder \(likely: name the file: .*quet"):
        mf.read_estimate(tmp_path)


def test_logs_and_scores_are_equal_where_all_they_hold_is(track):
    log, score = walk_log(), mf.score(track, track.log.truth)
    assert log == walk_log() == copy.deepcopy(log)
    shorter = mf.make_log(log.crs, motion=log.motion.iloc[:-1], radio=log.radio, truth=log.truth)
    assert log != shorter
    assert score == mf.score(track, track.log.truth) == copy.deepcopy(score)
    assert score != replace(score, error_m=score.error_m + 1.0)
    assert score != replace(score, within_95=0.5)


def test_single_reports_and_bounds_are_tables_of_places_too(database):
    located, bound = mf.locate_reports(walk_log(), database), mf.bound(database)
    for found in (located, bound):
        table, places = found.to_dataframe(), found.to_geodataframe()
        kept = table[np.isfinite(table["east_m"])]
        assert len(places) == len(kept) > 0
        assert places.crs == database.lattice.crs
        assert places.geometry.x.tolist() == kept["east_m"].tolist()
        assert "<table" in found._repr_html_()
        assert repr(found).split(":")[0] in found._repr_html_()
