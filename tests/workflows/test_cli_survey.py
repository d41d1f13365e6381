"""The model "survey" on the command line: drives through the small world's rasters become a map."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest
import rasterio
from command_line import assert_done, assert_refused, contents, mapfilter, settings

from mapfilter.geodesy import unproject
from mapfilter.rasters.opening import open_rasters

OF_SURVEY = ("readings.parquet", "deviation.tif")
HEADER = "cell,lat,lon,level_dbm,time,accuracy_m\n"


def drive(rasters, seed, count=150):
    """Readings of all cells at random places, in the order of a walk of five minutes."""
    rng = np.random.default_rng(seed)
    lattice, levels = rasters.lattice, rasters.read()
    row, col = rng.integers(0, [lattice.rows, lattice.cols], (count, 2)).T
    lon, lat = unproject(lattice.crs, *lattice.east_north(row, col))
    lines = [
        f"{cell_id},{lat[i]:.7f},{lon[i]:.7f},{level + rng.normal(0, 2):.1f},{1.6e9 + 2 * i},5\n"
        for i in range(count)
        for cell_id, level in zip(rasters.cell_ids, levels[:, row[i], col[i]], strict=True)
    ]
    return HEADER + "".join(lines)


@pytest.fixture(scope="module")
def survey(world, tmp_path_factory):
    """A folder with three drives and a configuration without an area."""
    folder = tmp_path_factory.mktemp("survey")
    (folder / "drives").mkdir()
    rasters = open_rasters(world.rasters)
    for seed in range(3):
        (folder / "drives" / f"drive-{seed}.csv").write_text(drive(rasters, seed))
    (folder / "cells.csv").write_bytes(world.plan.read_bytes())
    (folder / "survey.toml").write_text(
        '[cells]\nplan = "cells.csv"\n[prediction]\nmodel = "survey"\n'
        '[prediction.survey]\nfiles = ["drives"]\nreach_m = 60\n[output]\ndir = "out"\n'
        'pictures = "none"\n'
    )
    return folder


def test_cells_that_a_calibration_loses_and_drives_that_do_not_meet_are_noted(
    survey, world, tmp_path
):
    """Two drives, each with the cell C alone, in opposite corners."""
    rasters = open_rasters(world.rasters)
    lattice = rasters.lattice
    for number, corner in enumerate(((0, 0), (lattice.rows - 10, lattice.cols - 10))):
        row, col = (np.mgrid[:10, :10].reshape(2, -1).T + corner).T
        lon, lat = unproject(lattice.crs, *lattice.east_north(row, col))
        level = rasters.read(cells=("C",))[0, row, col]
        lines = [
            f"C,{lat[i]:.7f},{lon[i]:.7f},{level[i]:.1f},{1.6e9 + 2 * i},5\n" for i in range(100)
        ]
        (tmp_path / f"drive-{number}.csv").write_text(HEADER + "".join(lines))
    more = settings(
        prediction__survey__files=json.dumps([str(tmp_path)]),
        prediction__survey__calibrate=world.rasters,
        prediction__survey__reach_m=20,
    )
    config = survey / "survey.toml"
    found = assert_done(
        mapfilter("predict", "-c", config, "--out", tmp_path / "out", "--json", *more)
    ).json
    assert found["cells"] == 1
    assert found["validation"]["predicted"] == 0
    notes = " ".join(found["notes"])
    assert "2 of 3 cells of the prediction are not in the result" in notes
    assert "rarely or never: A, B (prediction.survey.fill keeps and corrects those" in notes
    assert "not validated: no two sessions have measurements of one cell within 20 m" in notes
    filled = [*more, *settings(prediction__survey__fill="true")]
    out = tmp_path / "filled"
    found = assert_done(mapfilter("predict", "-c", config, "--out", out, "--json", *filled)).json
    assert found["cells"] == 3
    notes = " ".join(found["notes"])
    assert "2 of 3 cells of the prediction were measured too rarely or never, and are" in notes
    assert "not in the result" not in notes
    corrected = open_rasters(out / "rxlev.tif")
    change_db = corrected.read(cells=("A",)) - rasters.read(cells=("A",))
    assert f"A by {np.nanmedian(change_db):+.1f} ± " in notes


def test_what_fills_the_rows_of_cells_that_were_not_received_is_no_level(survey, tmp_path):
    drives = tmp_path / "drives"
    drives.mkdir()
    filled = 0
    for path in sorted((survey / "drives").iterdir()):
        lines = path.read_text().splitlines()
        for number, line in enumerate(lines[1:], start=1):
            fields = line.split(",")
            if float(fields[3]) < -70:
                filled += 1
                lines[number] = ",".join([*fields[:3], "-140", *fields[4:]])
        (drives / path.name).write_text("\n".join(lines) + "\n")
    more = settings(prediction__survey__files=json.dumps([str(drives)]))
    config = survey / "survey.toml"
    found = assert_done(
        mapfilter("predict", "-c", config, "--out", tmp_path / "out", "--json", *more)
    ).json
    assert filled > 100
    assert found["measurements"] == 1350 - filled
    assert any(f"{filled} of 1350 rows left out" in note for note in found["notes"])
    level = open_rasters(tmp_path / "out" / "rxlev.tif").read()
    assert np.nanmin(level) > -90
    readings = pq.read_table(tmp_path / "out" / "rxlev-readings.parquet")
    assert min(readings["level_dbm"].to_pylist()) > -75


def test_a_survey_becomes_rasters_and_a_database(survey, world, tmp_path):
    config = survey / "survey.toml"
    drawn = settings(output__pictures="first")
    found = assert_done(
        mapfilter("predict", "-c", config, "--out", tmp_path, "--json", *drawn)
    ).json
    names = {path.name for path in tmp_path.iterdir()}
    files = {"rxlev.tif", "rxlev-deviation.tif", "rxlev-readings.parquet", "cells.csv"}
    assert names == files | {"pictures"}
    pictures = [tmp_path / "pictures" / f"survey-{name}.png" for name in ("levels", "left-out")]
    assert found["pictures"] == [str(path) for path in pictures]
    assert sorted((tmp_path / "pictures").iterdir()) == sorted(pictures)
    assert (found["cells"], found["sessions"], found["measurements"]) == (3, 3, 1350)
    assert found["ground_truth"] is None
    told = found["validation"]
    assert told["by_session"]
    assert told["rmse_db"] < 0.85 * told["trend_rmse_db"]
    assert told["predicted"] > 1300
    mean, truth = open_rasters(tmp_path / "rxlev.tif"), open_rasters(world.rasters)
    assert mean.cell_ids == ("A", "B", "C")
    assert mean.lattice.crs == truth.lattice.crs
    top, left = mean.lattice.row_col(*truth.lattice.east_north(0, 0))
    size = truth.lattice.rows, truth.lattice.cols
    error = mean.read((top, left, *size)) - truth.read()
    off = open_rasters(tmp_path / "rxlev-deviation.tif").read((top, left, *size))
    assert np.isfinite(error).mean() > 0.9
    assert np.sqrt(np.nanmean(error**2)) < np.nanmean(off)
    info = assert_done(mapfilter("info", tmp_path / "rxlev-deviation.tif", "--json")).json
    assert info["quantity"] == "deviation"
    built = assert_done(
        mapfilter(
            "build",
            "-c",
            config,
            "--out",
            tmp_path,
            "--json",
            *settings(cells__plan=tmp_path / "cells.csv"),
        )
    ).json
    assert built["points"] > 1000


def test_readings_of_another_survey_or_damaged_ones_are_refused(survey, tmp_path):
    """One flipped bit of the footer could end the process in the Parquet library."""
    config, folders = survey / "survey.toml", (tmp_path / "one", tmp_path / "other")
    fast = settings(prediction__survey__cross_validate="false")
    for folder, seed in zip(folders, (0, 1), strict=True):
        drives = settings(prediction__survey__files=f'["{survey}/drives/drive-{seed}.csv"]')
        assert_done(mapfilter("predict", "-c", config, "--out", folder, *drives, *fast))
    one, other = folders
    build = "build", "-c", config, "--out", one, *settings(cells__plan=one / "cells.csv")
    whole = {name: (one / f"rxlev-{name}").read_bytes() for name in OF_SURVEY}
    flipped = bytearray(whole["readings.parquet"])
    flipped[-6] ^= 4
    for name, data in (
        ("readings.parquet", bytes(flipped)),
        ("readings.parquet", (other / "rxlev-readings.parquet").read_bytes()),
        ("deviation.tif", (other / "rxlev-deviation.tif").read_bytes()),
    ):
        (one / f"rxlev-{name}").write_bytes(data)
        assert_refused(mapfilter(*build), f"rxlev-{name}", "run mapfilter predict again")
        (one / f"rxlev-{name}").write_bytes(whole[name])
    assert_done(mapfilter(*build))


def test_a_survey_calibrates_a_prediction(survey, world, tmp_path):
    more = settings(prediction__survey__calibrate=world.rasters, prediction__survey__fill="true")
    config = survey / "survey.toml"
    found = assert_done(mapfilter("predict", "-c", config, "--out", tmp_path, "--json", *more)).json
    lattice = open_rasters(world.rasters).lattice
    assert (found["rows"], found["cols"]) == (lattice.rows, lattice.cols)
    values = open_rasters(tmp_path / "rxlev.tif").read()
    assert np.isfinite(values).all()
    error = values - open_rasters(world.rasters).read()
    assert np.sqrt(np.mean(error**2)) < 1.5
    assert found["validation"]["rmse_db"] < 2.5


def test_levels_far_from_the_prediction_are_not_calibrated_away_silently(survey, world, tmp_path):
    """As of a receiver behind an attenuator of 20 dB."""
    header, *rows = (survey / "drives" / "drive-0.csv").read_text().splitlines()
    fields = [row.split(",") for row in rows]
    weak = [",".join([*row[:3], f"{float(row[3]) - 20:.1f}", *row[4:]]) for row in fields]
    (tmp_path / "weak.csv").write_text("\n".join([header, *weak]))
    more = settings(
        prediction__survey__calibrate=world.rasters,
        prediction__survey__files=tmp_path / "weak.csv",
        prediction__survey__cross_validate="false",
    )
    given = "predict", "-c", survey / "survey.toml", "--out", tmp_path / "out", "--json", *more
    (note,) = [one for one in assert_done(mapfilter(*given)).json["notes"] if "calibrated" in one]
    assert note.startswith("levels are 20 dB below the prediction (median of 3 cells)")


def test_what_is_said_of_rasters_is_said_of_those_to_calibrate(survey, world, tmp_path):
    """Levels as tenths of dB, without the unit that would tell it."""
    rasters = open_rasters(world.rasters)
    tenths, lattice = tmp_path / "tenths.tif", rasters.lattice
    with rasterio.open(
        tenths,
        "w",
        driver="GTiff",
        count=3,
        dtype="float32",
        crs=lattice.crs,
        height=lattice.rows,
        width=lattice.cols,
        transform=rasterio.Affine.from_gdal(*lattice.gdal_transform),
    ) as target:
        target.write(rasters.read() * 10)
        target.descriptions = rasters.cell_ids
    more = settings(
        prediction__survey__calibrate=tenths,
        prediction__survey__cross_validate="false",
        prediction__survey__fill="true",
        rasters__quantity="level",
        rasters__factor=0.1,
    )
    for name, elsewhere in [("rxlev", ()), ("made", settings(rasters__path=tmp_path / "made.tif"))]:
        out = tmp_path / ("out" if name == "rxlev" else "other")
        given = ("-c", survey / "survey.toml", "--out", out, *more, *elsewhere)
        assert_done(mapfilter("predict", *given))
        made = out / "rxlev.tif" if name == "rxlev" else tmp_path / "made.tif"
        error = open_rasters(made).read() - rasters.read()
        assert np.sqrt(np.mean(error**2)) < 1.5
        assert assert_done(mapfilter("build", *given, "--json")).json["points"] > 1000


def test_surveyed_cells_far_off_are_refused(survey, tmp_path):
    plan = tmp_path / "cells.csv"
    plan.write_text((survey / "cells.csv").read_text().replace("60.16890", "61.16890"))
    out = tmp_path / "out"
    given = ("-c", survey / "survey.toml", "--out", out, *settings(cells__plan=plan))
    told = f"{plan}: expected cells within 50 km of the area, found 1 of 3 up to"
    assert_refused(mapfilter("predict", *given), told, "(C)")


def test_equal_surveys_give_equal_bytes(survey, tmp_path):
    """And files given one by one on the command line are the folder."""
    files = sorted((survey / "drives").iterdir())
    config = survey / "survey.toml"
    given = f"--set=prediction.survey.files={json.dumps([str(path) for path in files])}"
    quick = settings(prediction__survey__cross_validate="false")
    for name, more in (("a", ()), ("b", (given,))):
        out = tmp_path / name
        assert_done(mapfilter("predict", "-c", config, "--out", out, *quick, *more))
    one, two = (sorted(contents(tmp_path / name).items()) for name in "ab")
    assert [digest for _, digest in one] == [digest for _, digest in two]


def test_an_area_cuts_the_survey_and_a_column_map_is_taken(survey, tmp_path):
    renamed = (survey / "drives" / "drive-0.csv").read_text().replace("level_dbm", "rsrp", 1)
    (tmp_path / "renamed.csv").write_text(renamed + "A,60.1,24.9\n")
    more = settings(
        prediction__survey__files=tmp_path / "renamed.csv",
        prediction__survey__columns__level_dbm="rsrp",
        prediction__survey__method="knn",
        area__bbox="24.9440,60.1670,24.9470,60.1690",
    )
    config = survey / "survey.toml"
    found = assert_done(
        mapfilter("predict", "-c", config, "--out", tmp_path / "out", "--json", *more)
    ).json
    assert found["rows"] * 5 < 260
    assert not found["validation"]["by_session"]
    assert found["notes"][0].startswith("renamed.csv: 1 of 451 rows left out: ")
    assert "row 452, fields: expected 6, found 3" in found["notes"][0]


def test_what_cannot_be_surveyed_is_told(survey, tmp_path):
    def refused(*told, **given):
        more = settings(**given)
        config = survey / "survey.toml"
        assert_refused(mapfilter("predict", "-c", config, "--out", tmp_path, *more), *told)

    refused("prediction.survey.files", "measurement files", prediction__survey__files="[]")
    refused("absent.csv", "a readable file", prediction__survey__files="absent.csv")
    refused("method", "'gp', 'knn', or 'trend'", prediction__survey__method="svm")
    refused("positions accurate to 1 m", prediction__survey__max_accuracy_m=1.0)
    refused("received in at least 900 squares", prediction__survey__min_points=900)
    refused("measurements", "some in the area", area__bbox="24.99,60.19,25.0,60.2")
    refused("longitude and latitude swapped", area__bbox="60.166,24.942,60.1697,24.9495")
    far = tmp_path / "far.csv"
    far.write_text(HEADER + "A,60.16,24.94,-70,1,5\n" * 3 + "A,50.0,10.0,-70,2,5\n")
    refused("a position far off the others", prediction__survey__files=far)
    lost = tmp_path / "deviations.tif"
    quick = settings(prediction__survey__cross_validate="false")
    given = "-c", survey / "survey.toml", "--out", tmp_path / "good"
    assert_done(mapfilter("predict", *given, *quick))
    (tmp_path / "good" / "rxlev-deviation.tif").rename(lost)
    refused("levels or losses", "deviations", prediction__survey__calibrate=lost)


def test_measurements_of_another_network_are_told(survey, world, tmp_path):
    """Cells that the plan lacks are located from their levels: nobody may take them for its own."""
    rows = (survey / "drives" / "drive-0.csv").read_text().splitlines()[1:]
    identity = {"A": "244,5,3021,11701", "B": "244,5,3021,11702", "C": "244,5,3021,11703"}
    lines = [",".join([identity[row[0]], row[2:]]) for row in rows]
    foreign = tmp_path / "foreign.csv"
    foreign.write_text("mcc,mnc,lac,ci," + HEADER.partition(",")[2] + "\n".join(lines))
    more = settings(prediction__survey__files=foreign, prediction__survey__cross_validate="false")
    given = "predict", "-c", survey / "survey.toml", "--out", tmp_path / "out", "--json", *more
    (note,) = [one for one in assert_done(mapfilter(*given)).json["notes"] if "received is" in one]
    assert note.startswith("none of 3 cells received is in ")
    assert "they are such as 244-5-3021-11701 and 2 more, the plan's such as A" in note
    assert "(likely: " in note
    calibrate = settings(prediction__survey__calibrate=world.rasters)
    told = "expected cells of the prediction, such as A, found none in 3 cells, such as 244-5-3021"
    assert_refused(mapfilter(*given, *calibrate), told)
