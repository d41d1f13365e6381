"""Pictures of surveys: the data shown, whole files, the same bytes."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from mapfilter.errors import InputError, OutputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.report.basemap import BaseMap
from mapfilter.report.canvas import BLACK
from mapfilter.report.saving import save
from mapfilter.report.survey import SurveyedLevels, plot_left_out, plot_surveyed_levels
from mapfilter.survey.leave_out import LeftOut, leave_out
from mapfilter.survey.measured_map import fit_survey
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.options import SurveyOptions
from mapfilter.survey.survey_rasters import write_survey
from mapfilter.workflows.outputs import served, survey_pictures
from mapfilter.workflows.outputs.survey_pictures import SurveyEvidence, draw_survey

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385_000.0, 6_672_000.0, 5.0, 40, 50)
BASE = BaseMap(LATTICE.bounds_m, attribution="© OpenStreetMap contributors")


def surveyed(cell_id: str = "A", lattice: Lattice = LATTICE) -> SurveyedLevels:
    row, col = np.mgrid[:40, :50]
    level_dbm = -70.0 - 0.5 * col
    deviation_db = np.where(row > 20, 4.0, np.nan)
    places = np.array([25, 30, 35])
    east_m, north_m = LATTICE.east_north(places, places)
    return SurveyedLevels(
        cell_id,
        lattice,
        np.where(row > 20, level_dbm, np.nan),
        deviation_db,
        east_m,
        north_m,
        -70.0 - 0.5 * places,
    )


def test_same_data_give_same_bytes(tmp_path):
    rng = np.random.default_rng(1)
    measured_dbm = rng.uniform(-110, -60, 300)
    predicted_dbm = measured_dbm + rng.normal(0, 4, 300)
    for name in "ab":
        folder = tmp_path / name
        cells = [surveyed("A"), surveyed("B")]
        save(plot_surveyed_levels(cells, BASE), folder / "levels.png")
        save(
            plot_left_out(
                measured_dbm, predicted_dbm, trend_dbm=measured_dbm + 6.0, attribution="somebody's"
            ),
            folder / "left-out.png",
        )
    for picture in ("levels.png", "left-out.png"):
        one, other = ((tmp_path / name / picture).read_bytes() for name in "ab")
        assert one[:8] == b"\x89PNG\r\n\x1a\n"
        assert one == other
    assert len(list(tmp_path.rglob("*.*"))) == 4


def test_all_cells_are_shown_in_one_extent_that_holds_them():
    far = surveyed("B")._replace(deviation_db=np.where(np.mgrid[:40, :50][1] > 40, 4.0, np.nan))
    figure = plot_surveyed_levels([surveyed("A"), far], BASE)
    maps = [axes for axes in figure.axes if axes.get_xlabel().startswith("east")]
    assert len(maps) == 4
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in maps}) == 1
    (low, high), (bottom, top) = maps[0].get_xlim(), maps[0].get_ylim()
    assert (low, bottom) <= (0.0, 0.0)
    assert (high, top) >= (250.0, 200.0)


def test_measured_points_have_a_dark_rim_under_them():
    left = plot_surveyed_levels([surveyed()], BASE).axes[0]
    under, over = sorted(left.collections, key=lambda drawn: drawn.get_zorder())[-2:]
    assert under.get_sizes()[0] > over.get_sizes()[0]
    assert to_rgb(under.get_facecolor()[0][:3]) == to_rgb(BLACK)
    assert over.get_array().size == 3


def test_survey_pictures_are_checked(tmp_path):
    path = tmp_path / "s.png"
    for cells in ([], [surveyed()] * 5):
        with pytest.raises(InputError, match="1 to 4"):
            save(plot_surveyed_levels(cells, BASE), path)
    small = Lattice(CRS, 0.0, 0.0, 5.0, 4, 5)
    with pytest.raises(InputError, match="4 x 5 pixels"):
        save(plot_surveyed_levels([surveyed("A", small)], BASE), path)
    with pytest.raises(InputError, match="3 of them"):
        save(plot_left_out(np.zeros(3), np.zeros(2)), path)
    for bad in (np.empty(0), np.array([np.nan])):
        with pytest.raises(InputError, match="finite levels"):
            save(plot_left_out(bad, bad), path)
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        save(plot_left_out(np.zeros(3), np.zeros(3)), tmp_path / "file" / "s.png")
    assert not path.exists()


def walks(sessions: int) -> Measurements:
    """Two cells heard along a line, with a fixed disturbance per reading."""
    rng = np.random.default_rng(5)
    count = 120
    row, col = np.full(count, 20), rng.integers(2, 48, count)
    east_m, north_m = LATTICE.east_north(row, col)
    cell = (np.arange(count) % 2).astype(np.int32)
    level_dbm = -60.0 - 0.3 * col - 10.0 * cell + rng.normal(0, 3, count)
    session = (np.arange(count) * sessions // count).astype(np.int32)
    return Measurements(
        CRS,
        ("A", "B"),
        {},
        tuple(str(i) for i in range(sessions)),
        cell,
        session,
        np.arange(count, dtype=float),
        east_m,
        north_m,
        level_dbm,
        np.full(count, 5.0),
    )


@pytest.mark.parametrize(("sessions", "folds"), [(1, 5), (3, 3)])
def test_a_survey_gets_its_pictures(sessions, folds, tmp_path):
    measured, options = walks(sessions), SurveyOptions(method="knn", trend="mean")
    survey = fit_survey(measured, options)
    paths = tmp_path / "mean.tif", tmp_path / "deviation.tif"
    write_survey(survey, LATTICE, *paths)
    left_out = leave_out(measured, options)
    told = leave_out(measured, options).validation
    assert told == left_out.validation
    assert (len(left_out), left_out.folds) == (told.predicted, folds)
    error_db = left_out.measured_dbm - left_out.predicted_dbm
    assert np.sqrt(np.mean(error_db**2)) == pytest.approx(told.rmse_db)
    rasters = [open_rasters(path) for path in paths]
    evidence = SurveyEvidence(measured, options.reach_m, *rasters, left_out)
    drawn = draw_survey(evidence, tmp_path / "out")
    assert [path.name for path in drawn] == ["survey-levels.png", "survey-left-out.png"]
    nothing = LeftOut(folds, sessions, len(measured), *np.empty((5, 0)))
    for told_nothing in (None, nothing):
        evidence = SurveyEvidence(measured, options.reach_m, *rasters, told_nothing)
        assert len(draw_survey(evidence, tmp_path / "one")) == 1


def test_readings_beside_the_lattice_are_drawn_and_large_areas_thinned(tmp_path, monkeypatch):
    """All of one cell's readings lie beside the area that was asked for, in reach of it."""
    measured, options = walks(1), SurveyOptions(method="knn", trend="mean")
    survey = fit_survey(measured, options)
    paths = tmp_path / "mean.tif", tmp_path / "deviation.tif"
    north = LATTICE.window(0, 0, 15, 50)
    write_survey(survey, north, *paths)
    monkeypatch.setattr(served, "MOST_PX", 20)
    drawn = []
    monkeypatch.setattr(
        survey_pictures, "plot_surveyed_levels", lambda cells, *_: drawn.extend(cells) or Figure()
    )
    rasters = [open_rasters(path) for path in paths]
    draw_survey(SurveyEvidence(measured, options.reach_m, *rasters), tmp_path / "out")
    assert [cell.cell_id for cell in drawn] == ["A", "B"]
    assert {cell.level_dbm.shape for cell in drawn} == {(5, 17)}
    assert all(np.isfinite(cell.level_dbm).any() for cell in drawn)


def test_a_survey_of_other_cells_is_told(tmp_path):
    level_dbm = np.full((40, 50), -70.0, np.float32)
    write_rasters(tmp_path / "other.tif", LATTICE, [("S1A", level_dbm)], ["S1A"])
    rasters = open_rasters(tmp_path / "other.tif")
    evidence = SurveyEvidence(walks(2), 100.0, rasters, rasters)
    with pytest.raises(InputError, match="measurements of cells"):
        draw_survey(evidence, tmp_path)
