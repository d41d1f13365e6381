"""Tables whose columns have German, French, Spanish, Chinese or Japanese names."""

import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.formats import format_of, read_recording

START_S = pd.Timestamp("2026-05-13T10:00:00Z").timestamp()
CHINESE = "时间,经度,纬度,速度(km/h),海拔"
JAPANESE = "日時,緯度,経度,高度,速度(km/h)"


def read(folder, header, rows, encoding="utf-8"):
    path = folder / "log.csv"
    path.write_bytes("\n".join([header, *rows, ""]).encode(encoding))
    return read_recording(path)


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("Datum;Uhrzeit;Breitengrad;Längengrad;Geschwindigkeit (km/h);Höhe (m)",
         "13.05.2026;10:00:0{};60,17{};24,94;36;20"),
        ("Fecha,Hora,Latitud,Longitud,Velocidad (nudos),Rumbo (grados)",
         "2026-05-13,10:00:0{},60.17{},24.94,19.43844,90"),
        ("Fecha,Hora,Latitud,Longitud,Proveedor,Precision (m),Velocidad (km/h)",
         "2026-05-13,10:00:0{},60.17{},24.94,gps,5,36"),
        ("Date;Heure;Latitude;Longitude;Vitesse (km/h);Cap (degrés)",
         "13/05/2026;10:00:0{};60,17{};24,94;36;90"),
        (CHINESE, "2026-05-13 10:00:0{},24.94,60.17{},36,20"),
        ("日期,时间,经度,纬度,速度（km/h）", "2026-05-13,10:00:0{},24.94,60.17{},36"),
        (JAPANESE, "2026/05/13 10:00:0{},60.17{},24.94,20,36"),
    ],
)  # fmt: skip
def test_names_in_other_languages(tmp_path, header, row):
    """They needed --column."""
    found = read(tmp_path, header, [row.format(at, at) for at in range(3)])
    places = found.tables["positions"]
    assert places["time_s"].tolist() == [START_S, START_S + 1, START_S + 2]
    assert places["lat_deg"].tolist() == pytest.approx([60.170, 60.171, 60.172])
    assert places["lon_deg"].tolist() == [24.94] * 3
    assert places["speed_mps"].tolist() == pytest.approx([10.0] * 3, rel=1e-5)
    assert any("names of columns in another language" in note for note in found.notes)


@pytest.mark.parametrize(
    ("header", "encoding"), [(CHINESE, "gb18030"), (JAPANESE, "cp932"), (CHINESE, "utf-16")]
)
def test_encodings_of_spreadsheets(tmp_path, header, encoding):
    """They were said to be binary files."""
    rows = [f"2026-05-13 10:00:0{at},24.94,40.17,36,20" for at in range(3)]
    found = read(tmp_path, header, rows, encoding)
    assert len(found.tables["positions"]) == 3
    if encoding != "utf-16":
        assert f"no UTF-8; read as {encoding.upper()}" in found.notes


@pytest.mark.parametrize(
    "header", ["Länge,Breite,Zeit,Wert", "Betreiber,Breitengrad,Längengrad,Straße"]
)
def test_words_of_several_meanings_and_lists_are_no_logs(tmp_path, header):
    with pytest.raises(InputError, match="a recording in a known format"):
        read(tmp_path, header, ["1,2,3,4"] * 3)
    assert format_of(tmp_path / "log.csv") is None
