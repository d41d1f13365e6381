"""What the benchmarks read of each data set, in made files of the same layout."""

import gzip
import io
import json
import tarfile
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import shapely

from mapfilter.errors import InputError
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded import belgium, denver, mall, mountain_view, smartloc
from mapfilter.experiments.recorded.benchmark import Task
from mapfilter.experiments.recorded.rows import table_rows
from mapfilter.experiments.recorded.street_graph import StreetGraph, match_points, read_graph
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import project
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix
from mapfilter.tracks.log import make_log

CRS = "EPSG:32613"
WEST, SOUTH, APART = -104.99, 39.74, 0.002


def _graphml(side=4):
    """A grid of streets of about 170 m x 220 m, both directions of each."""
    lines = [
        "<?xml version='1.0' encoding='utf-8'?>",
        '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">',
        '<key id="d1" for="edge" attr.name="geometry" attr.type="string" />',
        '<key id="d2" for="node" attr.name="y" attr.type="string" />',
        '<key id="d3" for="node" attr.name="x" attr.type="string" />',
        '<graph edgedefault="directed">',
    ]
    for i in range(side):
        for j in range(side):
            x, y = WEST + APART * i, SOUTH + APART * j
            lines.append(
                f'<node id="{i}-{j}"><data key="d2">{y}</data><data key="d3">{x}</data></node>'
            )
    for i in range(side):
        for j in range(side):
            for a, b in ((i + 1, j), (i, j + 1)):
                if a < side and b < side:
                    lines.append(f'<edge source="{i}-{j}" target="{a}-{b}" />')
                    lines.append(f'<edge source="{a}-{b}" target="{i}-{j}" />')
    return "\n".join([*lines, "</graph></graphml>"]).encode()


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    folder = tmp_path_factory.mktemp("denver")
    (folder / "small_graph.graphml.gz").write_bytes(gzip.compress(_graphml(), mtime=0))
    # Along the south, then north by the third street, 4 m beside it.
    x = np.concatenate([np.linspace(0.1, 2.0, 30), np.full(30, 2.0)])
    y = np.concatenate([np.zeros(30), np.linspace(0.05, 2.9, 30)])
    off = 4e-5 * np.random.default_rng(1).standard_normal((2, 60))
    rows = {"latitude": SOUTH + APART * y + off[0], "longitude": WEST + APART * x + off[1]}
    pd.DataFrame(rows).to_csv(folder / "made_trace_1.csv", index=False)
    return folder


def test_a_hidden_markov_model_follows_the_streets(town):
    graph = read_graph(town / "small_graph.graphml.gz", CRS)
    assert len(graph.street) == 48
    assert sorted(set(graph.street.tolist())) == list(range(1, 25))
    assert len(graph.ways()) == 24
    places = denver.clipped(denver.read_trace(town / "made_trace_1.csv", CRS), graph)
    edge = match_points(graph, places)
    assert (edge >= 0).all()
    apart_m, right = denver.judged_streets(graph, places, graph.street[edge])
    assert right.mean() > 0.95
    assert np.median(apart_m) < 8
    # A street elsewhere is neither near nor joined.
    far = np.full(len(places), graph.street[edge[0]])
    assert denver.judged_streets(graph, places, far)[1].mean() < 0.5
    assert not denver.judged_streets(graph, places, np.zeros(len(places), int))[1].any()


def test_a_matched_trace_has_a_share_of_points_and_no_interval(town, tmp_path):
    denver.prepare(town, tmp_path)
    task = Task("made_trace_1", "trace", 0, town, tmp_path)
    judged = denver.judge(task, denver.read(task))
    # For the picture of the worst trace.
    assert len(judged.journeys["bayes"].truth.time_s) == 60
    rows = table_rows(judged.found)
    assert [(row.method, row.n) for row in rows] == [("bayes", 60), ("hmm", 60)]
    assert all(row.success > 0.9 for row in rows)
    assert all(np.isnan([row.success_low, row.success_high]).all() for row in rows)


def test_points_beyond_the_streets_are_matched_to_none(town):
    graph = read_graph(town / "small_graph.graphml.gz", CRS)
    away = np.array([[0.0, 0.0], [10.0, 0.0]])
    assert match_points(graph, away).tolist() == [-1, -1]
    assert len(denver.clipped(away, graph)) == 0


def test_where_no_route_leads_on_each_stretch_has_its_own_most_probable_edges():
    ends = [((0, 40), (200, 40)), ((0, 0), (200, 0)), ((1000, 0), (1200, 0))]
    lines = np.array([shapely.LineString(line) for line in ends], dtype=object)
    node, street = np.arange(6), np.arange(1, 4)
    graph = StreetGraph(CRS, 6, node[::2], node[1::2], street, lines)
    near = [[20.0, 1.0], [40.0, 1.0], [60.0, 1.0]]
    assert match_points(graph, np.array(near)).tolist() == [1, 1, 1]
    apart = np.array([*near, [1010.0, 1.0], [1030.0, 1.0]])
    assert match_points(graph, apart).tolist() == [1, 1, 1, 2, 2]
    away = np.array([*near, [600.0, 500.0]])
    assert match_points(graph, away).tolist() == [1, 1, 1, -1]


@pytest.mark.parametrize("data", [b"no graph", b"<graphml></graphml>"])
def test_what_is_no_graph_is_named(tmp_path, data):
    (tmp_path / "g.graphml").write_bytes(data)
    with pytest.raises(InputError, match="a street graph of osmnx"):
        read_graph(tmp_path / "g.graphml", CRS)


def _walk():
    truth = pd.DataFrame(
        {
            "time_s": [0.0, 10.0, 20.0, 30.0, 100.0],
            "east_m": 455000.0 + 10 * np.arange(5),
            "north_m": 5.4e6,
        }
    )
    radio = pd.DataFrame(
        {
            "time_s": [0.0, 10.0, 10.0],
            "role": ["serving", "serving", "neighbour"],
            "cell": ["a", "b", "c"],
            "level_dbm": [-80.0, -85.0, -90.0],
        }
    )
    return make_log(CRS, radio=radio, truth=truth)


def test_the_last_report_is_repeated_as_the_phone_did():
    log = belgium.repeated(_walk())
    assert log.radio["time_s"].tolist() == [0.0, 10.0, 10.0, 20.0, 20.0, 30.0, 30.0, 100.0, 100.0]
    assert log.radio["cell"].tolist()[3:] == ["b", "c"] * 3


@pytest.mark.parametrize(
    ("named_s", "expected_s"), [((30.0, 100.0), 20.0), ((5.0,), np.nan), ((), np.nan)]
)
def test_time_until_a_stale_radio_is_named(named_s, expected_s):
    radii = np.ones(3)
    fixes = [
        Fix(
            t,
            0.0,
            0.0,
            np.eye(2),
            radii,
            Status.SEARCHING,
            1,
            1.0,
            0,
            0.0,
            Reason.STALE_RADIO if t in named_s else Reason.USED,
        )
        for t in (0.0, 5.0, 10.0, 20.0, 30.0, 100.0)
    ]
    estimate = TrackEstimate.of_fixes(CRS, "bayes", fixes)
    found = belgium.stale_after_s(estimate, _walk())
    assert found == pytest.approx(expected_s, nan_ok=True)


@pytest.mark.parametrize(
    ("second_m", "wrong"), [(40.0, False), (60.0, True)], ids=["near", "a second claim far off"]
)
def test_every_claim_in_belgium_is_checked(second_m, wrong):
    claims = {0.0: (0.0, Status.CONVERGED), 1.0: (900.0, Status.LOST)}
    claims |= {2.0: (second_m, Status.CONVERGED), 3.0: (5.0, Status.TRACKING)}
    fixes = [
        Fix(t, off, 0.0, np.eye(2), np.ones(3), status, 1, 1.0, 0, 0.0, Reason.USED)
        for t, (off, status) in claims.items()
    ]
    truth = Truth(np.array([0.0, 3.0]), np.zeros(2), np.zeros(2))
    found = belgium.claimed_wrongly(TrackEstimate.of_fixes(CRS, "bayes", fixes), truth)
    assert found is wrong


def test_towers_and_their_faults(tmp_path):
    row = {
        "enb_id": 7,
        "latitude": 50.6,
        "longitude": 4.6,
        "pci": 3,
        "earfcn": 1300,
        "azimuth": None,
        "downlink_frequency": "1815 MHz",
    }
    file = tmp_path / "towers.json"
    file.write_text(json.dumps({"1793": row, "1794": {**row, "azimuth": 120}}))
    plan = belgium.read_towers(file, "EPSG:32631")
    assert [(c.id, c.site, c.azimuth_deg, c.frequency_mhz, c.ci) for c in plan.cells] == [
        ("1793", "7", None, 1815.0, 1793),
        ("1794", "7", 120.0, 1815.0, 1794),
    ]
    for broken in ("[]", '{"1": {}}', "{", '{"1": 2}'):
        file.write_text(broken)
        with pytest.raises(InputError, match=r"towers\.json"):
            belgium.read_towers(file, "EPSG:32631")


def test_a_place_has_two_walks_or_more_and_cells_near_them(tmp_path, monkeypatch):
    monkeypatch.setattr(belgium, "read_walk", lambda _: _walk())
    (tmp_path / "walks").mkdir()
    (tmp_path / "tower_data").mkdir()
    row = {"enb_id": 7, "latitude": 48.75, "longitude": -105.61, "pci": 3, "earfcn": 1300}
    row |= {"azimuth": None, "downlink_frequency": "1815 MHz"}
    (tmp_path / "tower_data" / "towers.json").write_text(json.dumps({"1793": row}))
    (tmp_path / "walks" / "small_town_1.txt").write_text("")
    with pytest.raises(InputError, match="two walks of a place or more, found 1"):
        belgium.prepare(tmp_path, tmp_path / "work")
    (tmp_path / "walks" / "small_town_2.txt").write_text("")
    logs, plan = belgium._place_of(tmp_path, "small_town")
    assert (list(logs), plan.ids) == (["small_town_1", "small_town_2"], ("1793",))
    (tmp_path / "tower_data" / "towers.json").write_text(
        json.dumps({"1793": row | {"latitude": 50}})
    )
    with pytest.raises(InputError, match="within 5 km of the walks, found none"):
        belgium.prepare(tmp_path, tmp_path / "work")


def _archive(path, files):
    with tarfile.open(path, "w:xz") as archive:
        for name, data in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))


def test_walks_are_unpacked_by_their_names_alone(tmp_path):
    _archive(tmp_path / "a.tar.xz", {"x/one.txt": b"1", "../../two.txt": b"2", "x/no.py": b"3"})
    mall.unpack(tmp_path / "a.tar.xz", tmp_path / "in" / "walks")
    assert sorted(p.name for p in (tmp_path / "in" / "walks").iterdir()) == ["one.txt", "two.txt"]
    assert not (tmp_path.parent / "two.txt").exists()
    (tmp_path / "b.tar.xz").write_bytes((tmp_path / "a.tar.xz").read_bytes()[:40])
    with pytest.raises(InputError, match="an archive of walks"):
        mall.unpack(tmp_path / "b.tar.xz", tmp_path / "in" / "walks")


def test_walks_are_read_once_for_all_parts(tmp_path, monkeypatch):
    folder, work = tmp_path / "data", tmp_path / "work"
    folder.mkdir()
    work.mkdir()
    _archive(folder / "a_paths.tar.xz", {f"{name}.txt": b"walk" for name in "dbca"})
    opened = []

    def open_walk(file, options):  # noqa: ARG001
        opened.append(file.stem)
        log = replace(_walk(), start_utc_s=1e9 - ord(file.stem))
        return SimpleNamespace(log=log)

    monkeypatch.setattr(mall, "open_log", open_walk)
    monkeypatch.setattr(mall, "walkable", lambda *_: None)
    monkeypatch.setattr(mall, "roads_alone", lambda *_: None)
    monkeypatch.setattr(mall.OpenMap, "open", lambda path: path)
    mall.prepare(folder, work)
    for unit in ("fold-1", "fold-2"):
        logs, _ = mall.read(Task("floor", unit, 0, folder, work))
        assert list(logs) == ["d", "c", "b", "a"]
        pd.testing.assert_frame_equal(logs["a"].truth, _walk().truth)
    assert sorted(opened) == ["a", "b", "c", "d"]
    assert [path.name for path in work.iterdir()] == ["walks"]


def test_the_floor_is_what_the_shops_leave(tmp_path):
    def square(west, south, east, north):
        ring = [[west, south], [east, south], [east, north], [west, north], [west, south]]
        return {"geometry": {"type": "Polygon", "coordinates": [ring]}}

    # 40 m x 20 m, of which the western half is a shop.
    whole, shop = square(120.0, 30.0, 120.0004, 30.0002), square(120.0, 30.0, 120.0002, 30.0002)
    (tmp_path / "geojson_map.json").write_text(json.dumps({"features": [whole, shop]}))
    info = {"map_info": {"width": 40.0, "height": 20.0}}
    (tmp_path / "floor_info.json").write_text(json.dumps(info))
    floor = mall.walkable(tmp_path, CRS)
    east, north = floor.east_north_m
    assert len(floor) == 20 * 20
    assert (east.min(), east.max(), north.min(), north.max()) == (20.5, 39.5, 0.5, 19.5)
    (tmp_path / "floor_info.json").write_text("{}")
    with pytest.raises(InputError, match="floor outline"):
        mall.walkable(tmp_path, CRS)


def test_units_of_the_other_sets(tmp_path):
    assert mall.units(tmp_path) == [("floor", "fold-1", 1), ("floor", "fold-2", 1)]
    assert {part for part, _, _ in mountain_view.units(tmp_path)} == {"1-minute", "3-minutes"}
    for name in ("A_Input.txt.gz", "RTKLIB_A_Input.txt.gz", "A_GT.txt.gz"):
        (tmp_path / name).write_bytes(b"")
    drives = {unit for _, unit, _ in smartloc.units(tmp_path)}
    assert drives == {"A"}
    (tmp_path / "walks").mkdir()
    (tmp_path / "walks" / "small_town_3.txt").write_text("")
    assert belgium.units(tmp_path) == [("small_town", "small_town_3", 1)]


def test_the_highest_satellites_are_left():
    rows = pd.DataFrame(
        [
            (float(t), name, 2.2e7, *place)
            for t in (0, 100)
            for name, place in (
                ("G01", (2.6e7, 0.0, 0.0)),
                ("G02", (0.0, 2.6e7, 0.0)),
                ("G03", (1.9e7, 0.0, 1.8e7)),
            )
        ],
        columns=["time_s", "satellite", "pseudorange_m", "x_m", "y_m", "z_m"],
    )
    east, north = project("EPSG:32631", [0.1], [0.1])
    truth = pd.DataFrame(
        {"time_s": [0.0, 100.0], "east_m": float(east[0]), "north_m": float(north[0])}
    )
    log = make_log("EPSG:32631", truth=truth, pseudoranges=rows)
    kept = smartloc.highest(log, 2, 60.0)
    assert kept["satellite"].tolist() == ["G01", "G02", "G03", "G01", "G03"]
    assert len(smartloc.highest(replace(log), 0, 60.0)) == 3


@pytest.mark.parametrize("data", [b"", b"a,b\n1,2\n", b"longitude,latitude\n", b"\xff\x00"])
def test_what_is_no_trace_is_named(tmp_path, data):
    (tmp_path / "x_trace.csv").write_bytes(data)
    with pytest.raises(InputError, match=r"x_trace\.csv"):
        denver.read_trace(tmp_path / "x_trace.csv", CRS)


@pytest.mark.parametrize("one", [mall, belgium], ids=["mall", "belgium"])
def test_no_figure_of_another_statistic_counts_as_published(one):
    """A range, and root mean squares, are published: the table has medians and means."""
    assert one.BENCHMARK.published_m == {}
