"""Plans whose positions are in another CRS than that of the rasters."""

import pytest

import mapfilter as mf
from mapfilter.config.load import load_config
from mapfilter.errors import ConfigError, InputError
from mapfilter.geodesy import project, unproject
from mapfilter.radio.plan_files import read_cell_plan
from mapfilter.workflows.inputs.planned_cells import planned_cells

UTM, GAUSS_KRUEGER = "EPSG:25832", "EPSG:31467"
EAST_M, NORTH_M = 479_700.0, 5_539_300.0
ATOLL = "Transmitter;Site;X;Y;Height (m);Azimuth (°);EIRP (dBm);Frequency Band"


@pytest.fixture
def listed(tmp_path):
    """A planning tool's list in Gauss-Krüger coordinates, with a column of the CRS or without."""

    def of(crs=None):
        east_m, north_m = project(GAUSS_KRUEGER, *unproject(UTM, EAST_M, NORTH_M))
        row = f"A;S;{east_m:.3f};{north_m:.3f};30;0;55;GSM 1800"
        path = tmp_path / "plan.csv"
        path.write_text(f"{ATOLL}\n{row}\n" if crs is None else f"{ATOLL};crs\n{row};{crs}\n")
        return path

    return of


def _place(plan):
    return plan["A"].east_m, plan["A"].north_m


def test_a_plan_is_read_in_the_crs_that_is_named_for_it(listed):
    plan = read_cell_plan(listed(), UTM, layout="atoll", plan_crs=GAUSS_KRUEGER)
    assert _place(plan) == pytest.approx((EAST_M, NORTH_M), abs=0.01)
    assert plan.crs == UTM


def test_a_row_that_states_its_crs_keeps_it(listed):
    plan = read_cell_plan(listed(GAUSS_KRUEGER), UTM, layout="atoll", plan_crs=UTM)
    assert _place(plan) == pytest.approx((EAST_M, NORTH_M), abs=0.01)


def test_a_configuration_names_it(listed):
    settings = [f"cells.plan={listed()}", "cells.layout=atoll", f"cells.crs={GAUSS_KRUEGER}"]
    plan = planned_cells(load_config(None, settings), UTM)
    assert _place(plan) == pytest.approx((EAST_M, NORTH_M), abs=0.01)


def test_without_it_the_message_names_the_setting(listed):
    with pytest.raises(InputError, match=r"Gauss-Krüger \(EPSG:31467\)") as caught:
        read_cell_plan(listed(), UTM, layout="atoll")
    (fault,) = caught.value.faults
    assert fault.expected == f"metres where {UTM} is used, or their CRS in cells.crs"
    with pytest.raises(InputError, match="is used, or their CRS in plan_crs, found"):
        mf.read_cell_plan(listed(), UTM, layout="atoll")


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:0", "UTM"])
def test_one_that_is_none_is_refused(listed, crs):
    with pytest.raises(InputError, match=r"^cells\.crs"):
        read_cell_plan(listed(), UTM, layout="atoll", plan_crs=crs)


def test_one_of_another_type_is_refused(listed):
    with pytest.raises(ConfigError, match="plan_crs"):
        read_cell_plan(listed(), UTM, layout="atoll", plan_crs=31467)


def test_one_for_degrees_is_refused(tmp_path):
    header = "cell,lat,lon,height_m,eirp_dbm,frequency_mhz"
    (tmp_path / "cells.csv").write_text(f"{header}\nA,50.0,8.7,30,55,1800\n")
    with pytest.raises(InputError, match=r"cells\.crs: expected positions as east and north"):
        read_cell_plan(tmp_path / "cells.csv", UTM, plan_crs=GAUSS_KRUEGER)
