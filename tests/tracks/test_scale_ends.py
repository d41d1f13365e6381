"""Levels at the end of a scale are bounds, where a log does not state which are."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.radio.rxlev import quantise_level_dbm
from mapfilter.radio.scale_ends import at_scale_end
from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import read_log, write_log

CRS = "EPSG:32635"


def heard(level_dbm, **columns):
    count = len(level_dbm)
    return pd.DataFrame(
        {"time_s": np.arange(float(count)), "role": "serving", "cell": "A", **columns}
        | {"level_dbm": level_dbm}
    )


def walked(spread_db=9.0, strongest_dbm=-38.0, count=4000):
    """Levels of a walk past a mast, before a phone rounds and cuts them."""
    return strongest_dbm - np.abs(np.random.default_rng(5).normal(0.0, spread_db, count))


def by_modem(level_dbm):
    """As modems state them: -113 dBm and 2 dB for each of 31 steps (3GPP TS 27.007, 8.5)."""
    return -113.0 + 2.0 * np.clip(np.floor((level_dbm + 113.0) / 2.0), 0, 31)


def test_levels_of_rxlev_63_are_those_that_were_cut():
    level_dbm, censored = quantise_level_dbm(walked())
    log = make_log(CRS, radio=heard(level_dbm))
    assert (censored == 1).sum() > 500
    assert log.radio["censored"].tolist() == censored.tolist()
    count = f"{(censored == 1).sum()} levels of -47.5 dBm, where a scale ends"
    assert log.notes == (f"radio, level_dbm: {count}: taken for that or more",)


@pytest.mark.parametrize("added", [110.0, 111.0])
def test_so_are_those_of_programs_that_add_another_number(added):
    level_dbm, censored = quantise_level_dbm(walked())
    given = heard(level_dbm + 110.5 - added)
    assert make_log(CRS, radio=given).radio["censored"].tolist() == censored.tolist()


def test_those_of_modems_end_at_51_dbm():
    true_dbm = walked()
    log = make_log(CRS, radio=heard(by_modem(true_dbm)))
    assert log.radio["censored"].tolist() == (true_dbm >= -51.0).astype(int).tolist()


@pytest.mark.parametrize(
    "level_dbm",
    [
        by_modem(walked(strongest_dbm=-54.0)),
        np.round(walked(strongest_dbm=-47.0)),
        np.round(walked(strongest_dbm=-41.0)),
        np.append(by_modem(walked()), -46.0),
        # Past a mast once, at an even pace.
        2 * np.round((-48.0 - np.linspace(-4.6, 4.6, 200) ** 2) / 2),
        np.round(-48.0 - np.linspace(-4.6, 4.6, 200) ** 2),
        np.append(np.full(4, -51.0), np.full(50, -70.0)),
        np.full(50, -60.0),
        np.full(50, np.nan),
        np.array([]),
    ],
    ids=[
        "below", "few at the end", "no scale ends there", "one beyond", "past a mast",
        "past a mast in steps of 1 dB", "four", "steady", "none", "empty",
    ],
)  # fmt: skip
def test_nothing_else_is_a_bound(level_dbm):
    assert not at_scale_end(level_dbm).any()
    assert not make_log(CRS, radio=heard(level_dbm)).radio["censored"].any()


def test_what_a_log_states_is_left_and_noted_once(tmp_path):
    level_dbm = by_modem(walked())
    stated = make_log(CRS, radio=heard(level_dbm, censored=0))
    assert not stated.radio["censored"].any()
    assert stated.notes == ()
    partly = np.where(np.arange(len(level_dbm)) < 2000, 0.0, np.nan)
    found = make_log(CRS, radio=heard(level_dbm, censored=partly)).radio["censored"]
    assert not found[:2000].any()
    assert found[2000:].tolist() == (level_dbm[2000:] == -51.0).astype(int).tolist()
    log = make_log(CRS, radio=heard(level_dbm))
    write_log(log, tmp_path / "walk")
    again = read_log(tmp_path / "walk")
    assert again.notes == log.notes
    assert again.radio["censored"].tolist() == log.radio["censored"].tolist()


def test_notes_on_several_technologies_name_them():
    """Two notes gave different numbers of the same levels."""
    level_dbm = by_modem(walked())
    families = np.where(np.arange(len(level_dbm)) < 2500, "GSM", "UMTS")
    log = make_log(CRS, radio=heard(level_dbm, technology=families))
    ends = [int(np.sum(level_dbm[families == one] == -51.0)) for one in ("GSM", "UMTS")]
    assert log.notes == tuple(
        f"radio, level_dbm of {family}: {count} levels of -51 dBm, where a scale ends: taken for "
        "that or more"
        for family, count in zip(("GSM", "UMTS"), ends, strict=True)
    )


def test_each_technology_has_its_own_end():
    """An LTE level beyond -51 dBm says nothing of the GSM phone beside it."""
    gsm, lte = by_modem(walked()), np.round(walked(strongest_dbm=-45.0))
    given = heard(np.append(gsm, lte), technology=["GSM"] * len(gsm) + ["LTE"] * len(lte))
    found = make_log(CRS, radio=given).radio["censored"]
    assert found[: len(gsm)].tolist() == (gsm == -51.0).astype(int).tolist()
    assert not found[len(gsm) :].any()
