"""A folder of drive tests holds JSON, workbooks, layers and Parquet, read as single files are."""

import json

import geopandas
import pandas as pd
import pytest
import shapely
from made_workbook import workbook

from mapfilter.errors import InputError
from mapfilter.survey.read_measurements import read_measurements
from mapfilter.workflows.inputs.measured import recorded_rows

COUNT = 4
TABLE = pd.DataFrame(
    {
        "time": [f"2026-05-01T10:00:0{at}Z" for at in range(COUNT)],
        "lat": [60.17 + at / 1e4 for at in range(COUNT)],
        "lon": 24.94,
        "rsrp": [-80.0 - at for at in range(COUNT)],
        "mcc": 244,
        "mnc": 91,
        "tac": 7,
        "ci": 123,
    }
)


def read(*paths):
    return read_measurements(paths, "EPSG:32635", recorded=recorded_rows)


def write(folder, name, table=TABLE):
    path = folder / name
    if path.suffix == ".json":
        path.write_text(json.dumps(table.to_dict("records")))
    elif path.suffix == ".parquet":
        table.to_parquet(path)
    elif path.suffix == ".gpkg":
        points = shapely.points(table["lon"], table["lat"])
        rest = table.drop(columns=["lat", "lon"])
        geopandas.GeoDataFrame(rest, geometry=points, crs=4326).to_file(path)
    elif path.suffix == ".xlsx":
        path.write_bytes(workbook([[*table.columns], *table.to_numpy().tolist()]))
    else:
        table.to_csv(path, index=False)
    return path


@pytest.mark.parametrize("name", ["a.json", "a.parquet", "a.gpkg", "a.xlsx", "a.csv"])
def test_a_table_in_a_folder_is_read_as_it_is_alone(tmp_path, name):
    """In a folder they were passed over, or the folder was refused; Parquet was refused alone."""
    alone = read(write(tmp_path, name))
    assert alone.level_dbm.tolist() == TABLE["rsrp"].tolist()
    assert read(tmp_path).level_dbm.tolist() == alone.level_dbm.tolist()


def test_other_tables_of_a_folder_are_left_out_by_name(tmp_path):
    """Settings, positions, a plan and a damaged workbook are no drive tests.

    Their bytes were counted for numbers, and some workbooks and settings had enough of them.
    """
    write(tmp_path, "drive.csv")
    (tmp_path / "settings.json").write_text('{"version": 2, "rate": 1, "mask": 15}')
    places = TABLE[["time", "lat", "lon"]]
    (tmp_path / "way.json").write_text(json.dumps(places.to_dict("records")))
    plan = [["cell", "lat", "lon", "azimuth", "eirp_dbm"], ["A1", 60.0, 24.0, 120, 55]]
    (tmp_path / "plan.xlsx").write_bytes(workbook(plan))
    (tmp_path / "damaged.parquet").write_bytes(b"PAR1 nothing")
    found = read(tmp_path)
    assert found.level_dbm.tolist() == TABLE["rsrp"].tolist()
    assert "4 files without a drive test left out: damaged.parquet, plan.xlsx" in found.notes[0]
    with pytest.raises(InputError, match="levels of cells, and positions, found"):
        read(tmp_path / "way.json")


@pytest.mark.parametrize("name", ["a.json", "a.gpkg", "a.xlsx"])
def test_a_drive_test_whose_dates_are_unclear_is_asked_about_in_a_folder_too(tmp_path, name):
    """It was left out with a note, and its levels were missing in the map."""
    write(tmp_path, "b.csv")
    unclear = TABLE.assign(time=TABLE["time"].str.replace("2026-05-01T", "05/06/2026 ").str[:-1])
    path = write(tmp_path, name, unclear)
    for given in (path, tmp_path):
        with pytest.raises(InputError, match=rf"{name} row 2, time: .*day or month first"):
            read(given)
    path.unlink()
    write(tmp_path, name, unclear.drop(columns="rsrp"))
    assert f"1 file without a drive test left out: {name}" in read(tmp_path).notes[0]
