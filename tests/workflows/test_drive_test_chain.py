"""From drive tests to a database by configuration alone: no map, no cell plan, no box."""

import shutil

import numpy as np
import pytest
from command_line import assert_done, assert_refused, mapfilter, settings

from mapfilter.database.store import open_database
from mapfilter.geodesy import unproject

CRS = "EPSG:32618"
WEST, SOUTH = 445_000.0, 5_030_000.0
ANTENNAS = {"1-1-7-11": (-60.0, 40.0), "1-1-7-12": (300.0, 460.0), "1-1-7-13": (520.0, -40.0)}
TOML = """[area]
map = "none"
[prediction]
model = "survey"
[prediction.survey]
files = ["drive-tests"]
reach_m = 60
[roads]
half_width_m = 12
[roads.tracks]
files = ["drive-tests"]
[database]
floor_dbm = -125
[output]
dir = "out"
pictures = "none"
"""


def ride(seed, start_s):
    """A ride around a block of 400 m as OpenCellID takes it, with fixed shadowing along the way."""
    rng = np.random.default_rng(seed)
    along_m = np.arange(0.0, 1600.0, 8.0)
    corners = np.array([[0, 0], [400, 0], [400, 400], [0, 400], [0, 0]], dtype=float)
    sides = np.arange(0.0, 2000.0, 400.0)
    place_m = np.column_stack([np.interp(along_m, sides, axis) for axis in corners.T])
    seen_m = place_m + rng.normal(0, 2, place_m.shape)
    lon, lat = unproject(CRS, WEST + seen_m[:, 0], SOUTH + seen_m[:, 1])
    yield "mcc,mnc,lac,cellid,lat,lon,signal,measured_at,rating,speed,direction,act,ta,psc,tac,pci"
    for number, (name, antenna) in enumerate(ANTENNAS.items()):
        cell = name.replace("-", ",")
        distance_m = np.hypot(*(place_m - antenna).T)
        shadow_db = 5 * np.sin(along_m / 60 + number)
        level_dbm = -30 - 33 * np.log10(distance_m + 20) + shadow_db + rng.normal(0, 2, len(lon))
        for i in range(number, len(lon), 2):
            when_ms = round(1000 * (start_s + 2 * i))
            yield (
                f"{cell},{lat[i]:.7f},{lon[i]:.7f},{level_dbm[i]:.0f},{when_ms},6,4,0,LTE,0,,7,{i}"
            )


@pytest.fixture(scope="module")
def rides(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rides")
    (folder / "drive-tests").mkdir()
    for seed in range(3):
        lines = "".join(f"{line}\n" for line in ride(seed, 1.6e9 + 86_400 * seed))
        (folder / "drive-tests" / f"ride-{seed}.csv").write_text(lines)
    (folder / "survey.toml").write_text(TOML)
    return folder


def chain(config, *more):
    """Check, predict, build and check; return what predict and build tell."""
    found = []
    for command in ("check", "predict", "build", "check"):
        found.append(assert_done(mapfilter(command, "-c", config, *more, "--json")).json)
    before, predicted, built, after = found
    assert before == after == {"ok": True, "findings": []}
    return predicted, built


def test_drive_tests_become_a_database_without_any_map(rides, tmp_path):
    drawn = settings(output__pictures="first")
    predicted, built = chain(rides / "survey.toml", f"--set=output.dir={tmp_path}", *drawn)
    assert (predicted["cells"], predicted["sessions"]) == (3, 3)
    told = predicted["validation"]
    assert told["by_session"]
    assert told["rmse_db"] < 0.8 * told["trend_rmse_db"] < 0.8 * told["mean_rmse_db"]
    assert "3 antennas located from their levels" in predicted["notes"]
    # 1 600 m, 24 m wide, points every 5 m.
    assert built["points"] == pytest.approx(1600 * 24 / 25, rel=0.2)
    assert not any("buildings" in note for note in built["notes"])
    names = {path.stem for path in (tmp_path / "pictures").iterdir()}
    # There is neither a site of several cells nor land use.
    network = {"coverage", "best-server", "margin", "points-per-cell"}
    assert names == network | {"survey-levels", "survey-left-out"}
    database = open_database(tmp_path / "database")
    roles = [entry["role"] for entry in database.manifest["inputs"]]
    assert sorted(roles) == ["plan", "rasters", "tracks", "tracks", "tracks"]
    east, north = database.lattice.east_north(database.points().row, database.points().col)
    x, y = east - WEST, north - SOUTH
    off_m = np.minimum.reduce([abs(x), abs(x - 400), abs(y), abs(y - 400)])
    assert off_m.max() < 20
    for cell_id, (x, y) in ANTENNAS.items():
        cell = database.plan[cell_id]
        assert np.hypot(cell.east_m - WEST - x, cell.north_m - SOUTH - y) < 150


def test_real_walks_become_a_database(shared_data, tmp_path):
    """Three walks of Ottawa, as they were uploaded."""
    (tmp_path / "drive-tests").mkdir()
    for file in sorted((shared_data / "cell-ottawa-lte" / "carling").glob("*.csv"))[1:4]:
        shutil.copy(file, tmp_path / "drive-tests")
    (tmp_path / "survey.toml").write_text(TOML.replace("reach_m = 60", ""))
    predicted, built = chain(tmp_path / "survey.toml")
    assert predicted["sessions"] == 3
    assert predicted["validation"]["rmse_db"] < 6.0
    assert predicted["validation"]["rmse_db"] < predicted["validation"]["mean_rmse_db"]
    assert built["points"] > 1000
    assert built["cells"] == predicted["cells"] >= 5


def test_check_reads_the_measurements(rides, tmp_path):
    def findings(*more):
        found = mapfilter(
            "check", "-c", rides / "survey.toml", f"--set=output.dir={tmp_path}", "--json", *more
        )
        return found.code, {finding["code"] for finding in found.json["findings"]}

    assert findings() == (0, set())
    missing = settings(prediction__survey__files="absent.csv")
    assert findings(*missing) == (2, {"measurements-invalid"})
    elsewhere = settings(area__bbox="24.9420,60.1660,24.9495,60.1697")
    assert "lon-lat-swapped" not in findings(*settings(prediction__survey__max_accuracy_m=1))[1]
    assert findings(*elsewhere)[0] == 2


def test_without_a_map_something_must_say_where_the_area_is(rides, tmp_path):
    """Measurements do, a prediction does not."""
    asked = "area: expected bbox, or southwest with size_m, where map is none"
    more = settings(prediction__model="friis", prediction__survey__files="[]")
    config = rides / "survey.toml"
    assert_refused(mapfilter("predict", "-c", config, "--out", tmp_path, *more), asked)
    checked = mapfilter("check", "-c", config, *more, "--json")
    assert (checked.code, checked.json["findings"][0]["code"]) == (2, "area-invalid")
    built = mapfilter("build", "-c", config, "--out", tmp_path)
    assert_refused(built, "rxlev.tif: expected rasters", "run mapfilter predict first")
