"""Measurements that are left out of a log: by locate, and by names that are none."""

import pytest
from cross_world import walk_log

import mapfilter as mf
from mapfilter.errors import ConfigError
from mapfilter.tracks.kinds import leave_out


def with_fixes():
    walk = walk_log()
    fixes = walk.truth[["time_s", "east_m", "north_m"]].assign(accuracy_m=3.0)
    return mf.make_log(walk.crs, motion=walk.motion, radio=walk.radio, gnss=fixes)


@pytest.mark.parametrize("kinds", [["gnss"], ("neighbours", "gnss"), {"fixes"}])
def test_locate_leaves_out_what_leave_out_does(kinds, database):
    log = with_fixes()
    found = mf.locate(log, database, without=kinds)
    alone = mf.locate(leave_out(log, kinds), database)
    assert found.estimate == alone.estimate
    assert found.log.notes == alone.log.notes
    assert len(found.log.gnss) == 0 < len(log.gnss)
    assert found.estimate != mf.locate(log, database).estimate


def test_positions_that_are_left_out_may_be_anywhere(database):
    """As those of a receiver that is jammed."""
    log = with_fixes()
    gnss = log.gnss.assign(east_m=log.gnss["east_m"] + 50_000.0)
    off = mf.make_log(log.crs, motion=log.motion, radio=log.radio, gnss=gnss)
    with pytest.raises(mf.MapfilterError, match="expected positions near"):
        mf.locate(off, database)
    assert mf.locate(off, database, without=["gnss"]).estimate.converged_at is not None


@pytest.mark.parametrize(
    ("kinds", "found"),
    [
        (["gns"], "'gns' (likely: gnss)"),
        (["gps"], "'gps'"),
        (["gnss", "serving"], "'serving'"),
        ("gnss", "'gnss' (likely: a text; give a list of it)"),
        (None, "None"),
        ([3], "3"),
    ],
)
def test_names_that_are_none_are_refused(kinds, found, database):
    expected = "a list, each of gnss, fixes, pseudoranges, ta, tdoa, neighbours, radio"
    for call in (
        lambda: leave_out(walk_log(), kinds),
        lambda: mf.locate(walk_log(), database, without=kinds),
    ):
        with pytest.raises(ConfigError) as caught:
            call()
        assert str(caught.value) == f"without: expected {expected}, found {found}"
