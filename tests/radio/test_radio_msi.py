"""Antenna files of MSI Planet: made by the format's rules, and damaged."""

from pathlib import Path

import numpy as np
import pytest
from fuzz import fuzz
from msi_files import cut, panel, panel_losses

from mapfilter.errors import InputError
from mapfilter.radio.msi import read_antennas, read_msi


def write(folder: Path, text: str | bytes, name: str = "panel.msi") -> Path:
    file = folder / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode("latin-1"))
    return file


def fault(folder: Path, text: str | bytes) -> str:
    with pytest.raises(InputError) as caught:
        read_msi(write(folder, text))
    return str(caught.value)


def test_header_and_cuts(tmp_path: Path) -> None:
    antenna = read_msi(write(tmp_path, panel(downtilt_deg=6.0)))
    assert (antenna.name, antenna.frequency_mhz) == ("Panel 65/7", 1855.0)
    assert antenna.gain_dbi == pytest.approx(17.65)
    assert antenna.downtilt_deg == 6.0
    assert antenna.notes == ()
    horizontal, vertical = panel_losses(6.0)
    np.testing.assert_allclose(antenna.horizontal_loss_db, horizontal, atol=0.005)
    np.testing.assert_allclose(antenna.vertical_loss_db, vertical, atol=0.005)
    np.testing.assert_array_equal(antenna.vertical_deg, np.arange(360.0))


@pytest.mark.parametrize(
    ("line", "dbi"),
    [
        ("GAIN 15.5", 17.65),
        ("GAIN 15.5 dBd", 17.65),
        ("GAIN 17.65dBi", 17.65),
        ("gain 17.65 (dBi)", 17.65),
        ("GAIN -2 DBI", -2.0),
        ("COMMENT none", None),
    ],
)
def test_gain_is_dbd_unless_dbi(tmp_path: Path, line: str, dbi: float | None) -> None:
    gain = read_msi(write(tmp_path, panel(f"NAME A\n{line}\n"))).gain_dbi
    assert gain == (None if dbi is None else pytest.approx(dbi))


@pytest.mark.parametrize(
    ("line", "mhz"),
    [
        ("FREQUENCY 1855", 1855.0),
        ("FREQUENCY 0.9 GHz", 900.0),
        ("FREQUENCY 1710-1880 MHz", 1795.0),
        ("FREQUENCY", None),
    ],
)
def test_frequency(tmp_path: Path, line: str, mhz: float | None) -> None:
    assert read_msi(write(tmp_path, panel(f"NAME A\n{line}\n"))).frequency_mhz == mhz


@pytest.mark.parametrize(
    ("lines", "tilt_deg"),
    [
        ("TILT ELECTRICAL\nELECTRICAL_TILT 5", 5.0),
        ("TILT 4 degrees", 4.0),
        ("TILT ELECTRICAL", 6.0),
        ("TILT MECHANICAL", 0.0),
        ("COMMENT -", 0.0),
    ],
)
def test_electrical_downtilt(tmp_path: Path, lines: str, tilt_deg: float) -> None:
    antenna = read_msi(write(tmp_path, panel(f"NAME A\n{lines}\n", downtilt_deg=6.0)))
    assert antenna.downtilt_deg == tilt_deg


def test_sections_in_any_order_angles_in_any_order_and_odd_bytes(tmp_path: Path) -> None:
    horizontal, vertical = panel_losses()
    rows = [f"{angle} {loss:.2f}" for angle, loss in enumerate(horizontal)]
    turned = [f"{angle} {horizontal[angle % 360]:.2f}" for angle in range(-180, 180)]
    text = cut(vertical, "vertical") + "COMMENT 65\xb0 \xe9\nHorizontal  360\n"
    marked = "\ufeffNAME A\n" + text + "\n".join(rows)
    first = read_msi(write(tmp_path, marked.encode("utf-8")))
    assert first.name == "A"
    second = read_msi(write(tmp_path, (text + "\r\n".join(turned)).encode("latin-1")))
    assert second.name == "panel"
    np.testing.assert_array_equal(first.horizontal_loss_db, second.horizontal_loss_db)
    np.testing.assert_array_equal(second.horizontal_deg, np.arange(360.0))


def test_361_points_and_half_degrees(tmp_path: Path) -> None:
    horizontal, vertical = panel_losses()
    closed = np.append(horizontal, horizontal[0])
    halves = np.repeat(vertical, 2)
    rows = "".join(f"{i / 2} {loss:.2f}\n" for i, loss in enumerate(halves))
    text = cut(closed, "HORIZONTAL") + f"VERTICAL 720\n{rows}"
    antenna = read_msi(write(tmp_path, text))
    assert antenna.horizontal_deg.size == 360
    assert antenna.vertical_deg.size == 720


def test_a_cut_counted_upwards_is_turned_over_and_told(tmp_path: Path) -> None:
    up = panel("NAME A\nELECTRICAL_TILT 6\n", downtilt_deg=-6.0)
    antenna = read_msi(write(tmp_path, up))
    assert "upwards" in antenna.notes[0]
    _, vertical = panel_losses(6.0)
    np.testing.assert_allclose(antenna.vertical_loss_db, vertical, atol=0.005)


def test_faults_are_told(tmp_path: Path) -> None:
    whole = panel()
    assert "a line HORIZONTAL 360" in fault(tmp_path, "NAME x\n")
    assert "cut off" in fault(tmp_path, whole[: len(whole) // 2])
    assert "cut off" in fault(tmp_path, whole[:-20])
    assert "gains given for losses" in fault(tmp_path, whole.replace("\t", "\t-"))
    assert "decimal comma" in fault(tmp_path, whole.replace("10\t0.28", "10\t0,28"))
    assert "finite" in fault(tmp_path, whole.replace("10\t0.28", "10\tnan"))
    assert "row 16" in fault(tmp_path, whole.replace("10\t0.28", "10\t1e300"))
    assert "36..7200 points" in fault(tmp_path, whole.replace("HORIZONTAL 360", "HORIZONTAL 9e9"))
    assert "361 lines" in fault(tmp_path, whole.replace("HORIZONTAL 360", "HORIZONTAL 361"))
    assert "GAIN" in fault(tmp_path, whole.replace("15.5 dBd", "15.5 dBm"))
    assert "FREQUENCY" in fault(tmp_path, whole.replace("1855", "1.855"))
    assert "half a cut" in fault(
        tmp_path, cut(np.zeros(180), "HORIZONTAL") + cut(np.zeros(360), "VERTICAL")
    )
    assert "another" in fault(tmp_path, whole + whole)
    assert "NUL" in fault(tmp_path, whole.encode("utf-16"))
    assert "larger" in fault(tmp_path, b"A" * (5 << 20))
    assert "a line HORIZONTAL 360" in fault(tmp_path, b"")
    with pytest.raises(InputError, match="readable"):
        read_msi(tmp_path / "absent.msi")


def test_all_faults_of_a_file_are_told_together(tmp_path: Path) -> None:
    text = fault(tmp_path, panel().replace("15.5 dBd", "x").replace("1855", "y")[:-20])
    assert all(part in text for part in ("GAIN", "FREQUENCY", "VERTICAL"))


def test_antennas_are_found_by_name(tmp_path: Path) -> None:
    write(tmp_path, panel(), "A.msi")
    write(tmp_path, panel(), "b.PLN")
    found = read_antennas(tmp_path, ["A", "a.msi", "B", "omni", "sector", "3gpp", "A"])
    assert set(found) == {"A", "a.msi", "B"}
    assert read_antennas(tmp_path, ["omni"]) == {}


def test_no_name_leads_out_of_the_folder(tmp_path: Path) -> None:
    inside = tmp_path / "in"
    inside.mkdir()
    outside = write(tmp_path, panel(), "secret.msi")
    (inside / "link.msi").symlink_to(outside)
    for name in ("../secret.msi", "..", str(outside), "..\\secret.msi", "a/b", "x\0y"):
        with pytest.raises(InputError, match="in one folder"):
            read_antennas(inside, [name])
    with pytest.raises(InputError, match="a link out of it"):
        read_antennas(inside, ["link"])


def test_missing_antennas_are_told_together_with_what_is_near(tmp_path: Path) -> None:
    write(tmp_path, panel(), "panel_t06.msi")
    write(tmp_path, "NAME x\n", "broken.msi")
    with pytest.raises(InputError) as caught:
        read_antennas(tmp_path, ["panel_t6.msi", "broken"])
    assert "panel_t06.msi meant" in str(caught.value)
    assert "HORIZONTAL" in str(caught.value)
    with pytest.raises(InputError, match="a folder"):
        read_antennas(tmp_path / "nowhere", ["A"])


def test_damaged_files_are_refused_or_read_in_peace(tmp_path: Path, mutation_count: int) -> None:
    around_rad = np.linspace(-np.pi, np.pi, 7)

    def read(data: bytes) -> None:
        antenna = read_msi(write(tmp_path, data))
        gain_db = antenna.gain_db(around_rad, around_rad / 2, 4.0)
        assert np.isfinite(gain_db).all()
        assert (gain_db <= 0).all()

    tally = fuzz(panel(downtilt_deg=6.0).encode(), read, mutation_count)
    assert tally.read > 0
    assert tally.refused > 0
