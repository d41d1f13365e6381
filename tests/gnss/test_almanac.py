"""YUMA files, good and damaged, and constellations."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.gnss.almanacs import joined, nominal_galileo, nominal_gps, read_yuma
from mapfilter.gnss.orbits import satellite_positions_m
from mapfilter.gnss.sky import LocalFrame, directions

BLOCK = """******** Week 190 almanac for PRN-{prn:02d} ********
ID:                         {prn:02d}
Health:                     {health:03d}
Eccentricity:               0.5200000000E-002
Time of Applicability(s):  405504.0000
Orbital Inclination(rad):   0.9655
Rate of Right Ascen(r/s):  -0.8000000000E-008
SQRT(A)  (m 1/2):           5153.600000
Right Ascen at Week(rad):   0.1230000000E+001
Argument of Perigee(rad):   0.770000000
Mean Anom(rad):            -0.2100000000E+001
Af0(s):                     0.1621246338E-003
Af1(s/s):                   0.0000000000E+000
week:                        190

"""
GOOD = BLOCK.format(prn=1, health=0) + BLOCK.format(prn=7, health=63)


def written(tmp_path, text):
    path = tmp_path / "almanac.alm"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_a_yuma_file(tmp_path):
    found = read_yuma(written(tmp_path, GOOD))
    assert found.names == ("G01", "G07")
    assert found.healthy.tolist() == [True, False]
    assert found.usable().names == ("G01",)
    assert found.week.tolist() == [190, 190]
    assert found.toa_s.tolist() == [405504, 405504]
    assert found.sqrt_a[0] == 5153.6
    assert found.node_rate_rad_s[0] == -8e-9


def test_line_ends_and_older_labels_make_no_difference(tmp_path):
    text = GOOD.replace("\n", "\r\n").replace("Ascen at Week", "Ascen at TOA").replace("PRN", "SV")
    text = text.replace("0.5200000000E-002", "5.2D-03")
    found, plain = read_yuma(written(tmp_path, text)), read_yuma(written(tmp_path, GOOD))
    assert found.eccentricity.tolist() == plain.eccentricity.tolist()


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda _: "", "no satellite in it"),
        (lambda text: text[: len(text) - 60], "none for week"),
        (lambda text: text.replace("5153.600000", "nan"), "finite number"),
        (lambda text: text.replace("5153.600000", "26560000.0"), "sqrt_a"),
        (lambda text: text.replace("0.5200000000E-002", "1.5"), "eccentricity"),
        (lambda text: text.replace("405504.0000", "605504.0"), "seconds of the week"),
        (lambda text: text.replace("ID:                         07", "ID:  01"), "each satellite"),
        (lambda text: text.replace("ID:                         07", "ID:  7.5"), "whole number"),
        (lambda text: text.replace("Health", "Mean Anom"), "a second one"),
        (lambda _: "31  almanac.sem\n 190 405504\n", "line of a YUMA almanac"),
        (lambda _: bytes(range(256)) * 20, "line of a YUMA almanac"),
        (lambda text: text.replace("0.9655", "0_9655"), "finite number"),
    ],
)
def test_damaged_files_are_refused_with_their_place(tmp_path, damage, told):
    with pytest.raises(InputError, match=r"almanac\.alm") as caught:
        read_yuma(written(tmp_path, damage(GOOD)))
    assert told in str(caught.value)


def test_a_file_cut_off_anywhere_is_an_error_or_a_shorter_almanac(tmp_path):
    whole = len(GOOD.rstrip())
    for end in range(0, whole - 1, 7):
        try:
            found = read_yuma(written(tmp_path, GOOD[:end]))
        except InputError:
            continue
        assert set(found.names) <= {"G01", "G07"}


def test_no_file_and_a_huge_one(tmp_path):
    with pytest.raises(InputError, match="readable"):
        read_yuma(tmp_path / "none.alm")
    with pytest.raises(InputError, match="4 MiB"):
        read_yuma(written(tmp_path, b"*" * (1 << 23)))


def test_weeks_counted_modulo_1024(tmp_path):
    found = read_yuma(written(tmp_path, GOOD))
    assert found.in_era(2245).week.tolist() == [2238, 2238]
    assert found.in_era(190).week.tolist() == [190, 190]
    with pytest.raises(InputError, match="in_era"):
        satellite_positions_m(found, 0.0, 2238)
    satellite_positions_m(found.in_era(2245), 0.0, 2238)


def test_nominal_constellations():
    gps, galileo = nominal_gps(), nominal_galileo()
    both = joined(gps, galileo)
    assert len(both.names) == 51
    with pytest.raises(InputError, match="each satellite once"):
        joined(gps, gps)
    place = satellite_positions_m(both, np.arange(0.0, 86400.0, 600.0))
    radius = np.linalg.norm(place, axis=-1)
    np.testing.assert_allclose(radius[:, :24], 26_559_700.0)
    np.testing.assert_allclose(radius[:, 24:], 29_600_318.0)
    latitude = np.arcsin(place[..., 2] / radius)
    assert np.degrees(latitude[:, :24].max()) == pytest.approx(55.0, abs=0.3)
    assert np.degrees(latitude[:, 24:].max()) == pytest.approx(56.0, abs=0.3)
    # No two satellites of one constellation meet.
    for part in (place[:, :24], place[:, 24:]):
        apart = np.linalg.norm(part[:, :, None] - part[:, None], axis=-1)
        assert apart[:, ~np.eye(part.shape[1], dtype=bool)].min() > 5e6


@pytest.mark.parametrize("lat_deg", [-50.0, 0.0, 43.5, 60.0])
def test_the_nominal_constellations_serve_every_place_at_every_time(lat_deg):
    frame = LocalFrame(4.86, lat_deg, 20.0)
    for almanac, fewest, usual in ((nominal_gps(), 4, 6.5), (nominal_galileo(), 5, 7)):
        place = satellite_positions_m(almanac, np.arange(0.0, 86400.0, 900.0))
        count = directions(frame.to_local(place)).above(5.0).sum(axis=1)
        assert count.min() >= fewest
        assert usual < count.mean() < 12
