"""Identities of cells in tables of one's own: hexadecimal, of nodes and sectors, in one text."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.tracks.readers.texts import text

COUNT = 40


@pytest.fixture
def read(tmp_path):
    def of(**columns):
        table = {"time": 1_778_666_400.0 + np.arange(COUNT), "level_dbm": -80.0, **columns}
        pd.DataFrame(table).to_csv(tmp_path / "phone.csv", index=False)
        log = mf.read_log(tmp_path / "phone.csv")
        return log.radio, " ".join(log.notes)

    return of


def numbers(low, high, seed=1):
    return np.random.default_rng(seed).integers(low, high, COUNT)


def test_hexadecimal_numbers_without_a_mark(read):
    """Those of digits alone were read as decimal ones, all others were lost."""
    ci, lac = numbers(4096, 65536), numbers(4096, 65536, 2)
    ci[3], ci[7] = 0x1234, 0x9001
    texts = {"lac": [f"{one:x}" for one in lac], "ci": [f"{one:04X}" for one in ci]}
    radio, notes = read(mcc=244, mnc=91, **texts)
    assert radio["cell"].tolist() == [f"244-91-{a}-{c}" for a, c in zip(lac, ci, strict=True)]
    assert set(radio["role"]) == {"serving"}
    assert "lac: taken for hexadecimal numbers" in notes
    assert "ci: taken for hexadecimal numbers" in notes


@pytest.mark.parametrize("mark", ["", "0x", "0X"])
def test_hexadecimal_numbers_beside_rows_without_one(read, mark):
    """As of neighbours: all of them were lost, and their cells were no serving ones."""
    serves = np.arange(COUNT) % 4 == 0
    ci = numbers(4096, 1 << 28)
    texts = np.where(serves, [f"{mark}{one:X}" for one in ci], "")
    radio, notes = read(mcc=244, mnc=91, lac=np.where(serves, f"{mark}AB", ""), ci=texts)
    cells = [f"244-91-171-{one}" for one in ci[serves]]
    assert radio.loc[radio["role"] == "serving", "cell"].tolist() == cells
    assert "no numbers" not in notes


@pytest.mark.parametrize("missing", ["-", "N/A", "unknown"])
def test_hexadecimal_numbers_beside_words_for_missing_ones(read, missing):
    """They were lost, and those of digits alone read as decimal ones."""
    serves = np.arange(COUNT) % 4 > 0
    ci = np.where(serves, [f"{one:04X}" for one in 0xA000 + np.arange(COUNT)], missing)
    lac = np.where(np.arange(COUNT) % 8 == 1, "1234", "1AB4")
    radio, _ = read(mcc=244, mnc=91, lac=np.where(serves, lac, missing), ci=ci)
    cells = [
        f"244-91-{int(a, 16)}-{int(c, 16)}" for a, c in zip(lac[serves], ci[serves], strict=True)
    ]
    assert radio.loc[radio["role"] == "serving", "cell"].tolist() == cells


def test_hexadecimal_numbers_of_a_later_part_without_letters(read, monkeypatch):
    """Where one stays in a cell for long: it was another one, of a decimal number."""
    monkeypatch.setattr(text, "_PART_BYTES", 1 << 9)
    ci = np.where(np.arange(COUNT) < 20, 0xA000 + np.arange(COUNT), 0x1234)
    radio, _ = read(mcc=244, mnc=91, lac="AB", ci=[f"{one:X}" for one in ci])
    assert radio["cell"].tolist() == [f"244-91-171-{one}" for one in ci]


def test_a_slip_among_decimal_numbers_is_none(read):
    ci = numbers(1000, 9999).astype(str).astype(object)
    ci[5] = "12a4"
    radio, notes = read(mcc=244, mnc=91, lac=7, ci=ci)
    wrong = radio["cell"].isna()
    assert wrong.tolist() == (np.arange(COUNT) == 5).tolist()
    assert radio["cell"][0] == f"244-91-7-{ci[0]}"
    assert "hexadecimal" not in notes


@pytest.mark.parametrize(
    ("node", "cell"), [("enodeb_id", "cell_id"), ("eNB", "sector"), ("enb_id", "local_cell_id")]
)
def test_a_cell_of_a_node_is_not_that_of_another(read, node, cell):
    """All nodes were one cell, by the number of the cell within them."""
    nodes = numbers(100, 900_000)
    radio, notes = read(mcc=244, mnc=91, tac=7, **{node: nodes, cell: 3})
    assert radio["cell"].tolist() == [f"244-91-7-{256 * one + 3}" for one in nodes]
    assert "not used" not in notes


def test_a_whole_identity_beside_its_node_stays(read):
    nodes = numbers(100, 900_000)
    radio, _ = read(mcc=244, mnc=91, tac=7, enodeb=nodes, sector=3, eci=256 * nodes + 4)
    assert radio["cell"].tolist() == [f"244-91-7-{256 * one + 4}" for one in nodes]


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("26201-1234-5678", "262-1-1234-5678"),
        ("262|01|1234|5678", "262-1-1234-5678"),
        ("310410-9751830", "310-410-9751830"),
        ("244-91-9751830", "244-91-9751830"),
    ],
)
def test_one_text_of_an_identity(read, text, cell):
    radio, notes = read(cgi=text)
    assert set(radio["cell"]) == {cell}
    assert "taken as missing" not in notes


def test_a_text_that_is_no_identity_is_counted(read):
    """It was left out without a word, and the rows were neighbours of no name."""
    texts = np.where(np.arange(COUNT) < 30, "24491027DA01", "244-91-7-5")
    _, notes = read(ecgi=texts)
    expected = "ecgi: 30 values are no identities (262-01-1234-5678), taken as missing (first "
    assert expected + "'24491027DA01' in line 2)" in notes


def test_a_table_of_positions_and_identities_alone(tmp_path):
    rows = {"time": 1_778_666_400.0 + np.arange(COUNT), "lat": 60.0, "lon": 25.0}
    table = pd.DataFrame({**rows, "cgi": "244-91-7-5"})
    table.to_csv(tmp_path / "phone.csv", index=False)
    assert set(mf.read_log(tmp_path / "phone.csv").radio["cell"]) == {"244-91-7-5"}


def test_roles_by_a_letter_and_words_that_are_none(read):
    """A neighbour with an identity was a serving cell."""
    words = np.array(["S", "N", "Serving", "neighbour", "", "other"])[np.arange(COUNT) % 6]
    radio, notes = read(mcc=244, mnc=91, lac=7, ci=numbers(1, 999), role=words)
    expected = ["serving", "neighbour", "serving", "neighbour", "serving", "serving"]
    by_time = radio.sort_values("time_s", kind="stable")["role"]
    assert by_time.tolist() == [expected[row % 6] for row in range(COUNT)]
    assert "role: 6 values are no roles (serving, neighbour), taken as missing" in notes


@pytest.mark.parametrize("names", [("A1", "B2", "C3"), ("S1", "S2", "S3"), ("C101", "C102", "F1")])
def test_names_of_a_plan_in_a_column_of_numbers(read, names):
    """They were taken for hexadecimal numbers, or all of them were lost."""
    given = np.resize(names, COUNT)
    radio, notes = read(cell_id=given)
    assert radio["cell"].tolist() == given.tolist()
    assert set(radio["role"]) == {"serving"}
    assert "cell_id: taken for the plan's names of cells" in notes


def test_names_of_a_plan_among_placeholders_and_numbers(read):
    _, notes = read(cell_id=np.resize(["17", "18", "unknown", "19"], COUNT))
    assert "names of cells" not in notes


def test_whole_identities_in_a_column_of_numbers(read):
    radio, notes = read(cell_id=np.resize(["244-91-7-1234", "244-91-7-1235"], COUNT))
    assert radio["cell"].tolist() == ["244-91-7-1234", "244-91-7-1235"] * (COUNT // 2)
    assert "cell_id: taken for identities" in notes
    assert radio["ci"].tolist() == [1234, 1235] * (COUNT // 2)


def test_names_of_a_plan_in_a_file_read_in_parts(read, monkeypatch):
    """A later part may have no name at all, or one that looks like a number."""
    monkeypatch.setattr(text, "_PART_BYTES", 1 << 9)
    given = np.array(["S1"] * 15 + [None] * 15 + ["12"] * 10, dtype=object)
    radio, notes = read(cell_id=given)
    assert radio["cell"].dropna().tolist() == ["S1"] * 15 + ["12"] * 10
    assert notes.count("cell_id: taken for the plan's names of cells") == 1
    assert "ci" not in radio


def test_cells_of_several_technologies_in_columns_of_their_own(read):
    """What a row had in the second of two columns was lost: identities, codes, carriers, levels."""
    lte = np.arange(COUNT) % 2 == 0
    table = {
        "radio": np.where(lte, "LTE", "GSM"),
        "mcc": 244,
        "mnc": 91,
        "lac": np.where(lte, np.nan, 311),
        "tac": np.where(lte, 2048, np.nan),
        "cid": np.where(lte, np.nan, 4711),
        "eci": np.where(lte, 123_456, np.nan),
        "bsic": np.where(lte, np.nan, 21),
        "pci": np.where(lte, 333, -1),
        "arfcn": np.where(lte, np.nan, 62),
        "earfcn": np.where(lte, 1300, np.nan),
    }
    radio, _ = read(**table)
    names = np.where(lte, "244-91-2048-123456", "244-91-311-4711")
    assert radio["cell"].tolist() == names.tolist()
    assert radio["bsic"].tolist() == np.where(lte, 333, 21).tolist()
    assert radio["arfcn"].tolist() == np.where(lte, 1300, 62).tolist()


@pytest.mark.parametrize("missing", ["", "-", "2147483647"])
@pytest.mark.parametrize("of", ["carriers", "identities", "both"])
def test_technologies_by_columns_of_several(read, of, missing):
    """Where a file had columns of two technologies, cells of neither had one."""
    lte = np.arange(COUNT) % 2 == 0
    carriers = {
        "earfcn": np.where(lte, "1300", missing),
        "nr_arfcn": np.where(lte, missing, "634000"),
    }
    identities = {"eci": np.where(lte, "1234", missing), "nci": np.where(lte, missing, "5678")}
    given = {"carriers": carriers, "identities": identities, "both": carriers | identities}[of]
    radio, _ = read(mcc=244, mnc=91, tac=2048, pci=7, **given)
    assert radio["technology"].tolist() == np.where(lte, "LTE", "NR").tolist()


@pytest.mark.parametrize(("family", "column"), [("UMTS", "rscp"), ("GSM", "rssi")])
def test_levels_of_several_technologies_in_columns_of_their_own(tmp_path, family, column):
    """Those of UMTS and GSM were lost beside a column of LTE; an RSSI of LTE is no RSRP."""
    lte, missing = np.arange(COUNT) % 2 == 0, np.arange(COUNT) % 10 == 0
    table = {"time": 1_778_666_400.0 + np.arange(COUNT), "mcc": 244, "mnc": 91, "lac": 3}
    table |= {"rsrp": np.where(lte & ~missing, -97, np.nan), "rssi": -60}
    table |= {column: np.where(lte, np.nan if column == "rscp" else -60, -81)}
    table |= {"ci": 10_000, "radio": np.where(lte, "LTE", family)}
    pd.DataFrame(table).to_csv(tmp_path / "phone.csv", index=False)
    radio = mf.read_log(tmp_path / "phone.csv").radio
    expected = np.where(missing, np.nan, np.where(lte, -97.0, -81.0))
    np.testing.assert_array_equal(radio["level_dbm"], expected)


@pytest.mark.parametrize("empty", ["mnc", "cell", "radio"])
def test_identities_beside_an_empty_column(read, empty):
    """Networks were no MCC, or cells had no name or technology: the empty column was read."""
    given = {"mcc": 24_491, "tac": 2048, "eci": 123_456, "earfcn": 1300}
    radio, notes = read(**given, **{empty: np.nan})
    assert set(radio["cell"]) == {"244-91-2048-123456"}
    assert set(radio["technology"]) == {"LTE"}
    assert "ignored" not in notes


def test_networks_in_one_number_beside_a_column_of_technologies(read):
    """A column ``net`` of words counted as that of network codes."""
    radio, _ = read(plmn=24_491, net="LTE", tac=2048, eci=123_456)
    assert set(radio["cell"]) == {"244-91-2048-123456"}


def test_networks_in_one_number_of_four_digits(read):
    """262 and 1 without a zero between them were 26 and 21."""
    radio, _ = read(plmn=np.where(np.arange(COUNT) < 20, 2621, 310_410), lac=7, ci=8)
    assert radio["cell"].unique().tolist() == ["262-1-7-8", "310-410-7-8"]


@pytest.mark.parametrize(
    ("network", "cell"), [("244-91", "244-91"), ("310/410", "310-410"), ("262 1", "262-1")]
)
def test_networks_in_one_text_beside_areas_of_two_technologies(read, network, cell):
    """Cells had no network, and no area."""
    radio, _ = read(**{"MCC-MNC": network, "LAC/TAC": 7, "Cell ID": 8})
    assert radio["cell"].unique().tolist() == [f"{cell}-7-8"]


def test_small_numbers_of_cells_beside_those_of_nodes(read, monkeypatch):
    """They were names, and those of all nodes the same ones."""
    nodes, cells = 4571 + np.arange(COUNT) // 20, 1 + np.arange(COUNT) % 3
    for size in (1 << 24, 1 << 9):
        monkeypatch.setattr(text, "_PART_BYTES", size)
        radio, notes = read(enb=nodes, cell=cells, tac=7, mcc=244, mnc=91)
        assert radio["cell"].tolist() == [
            f"244-91-7-{256 * node + cell}" for node, cell in zip(nodes, cells, strict=True)
        ]
        assert "cell: taken for the numbers of cells within their nodes" in notes
    # Names of a plan stay.
    radio, _ = read(enb=nodes, cell=[f"N{cell}" for cell in cells], tac=7, mcc=244, mnc=91)
    assert set(radio["cell"]) == {"N1", "N2", "N3"}


@pytest.mark.parametrize("name", ["eci", "nci"])
def test_a_whole_identity_beside_a_cell_of_its_node(read, name):
    """The first column that has a number counted: all nodes were one."""
    whole = 256 * (4571 + np.arange(COUNT) // 20) + 1
    radio, _ = read(mcc=244, mnc=91, tac=7, cid=1, **{name: whole})
    assert radio["cell"].tolist() == [f"244-91-7-{one}" for one in whole]


def test_numbers_that_are_all_zero_are_no_identity(read):
    """As of neighbours in rows of Network Survey: they were one cell 0-0-0-0, without a carrier."""
    serves = np.arange(COUNT) % 2 == 0
    columns = {
        name: np.where(serves, number, 0)
        for name, number in {"mcc": 244, "mnc": 91, "tac": 3021, "eci": 300802}.items()
    }
    radio, _ = read(**columns, earfcn=1300, pci=7 + np.arange(COUNT))
    neighbour = radio["role"] == "neighbour"
    assert neighbour.tolist() == (~serves).tolist()
    assert set(radio.loc[~neighbour, "cell"]) == {"244-91-3021-300802"}
    assert radio.loc[neighbour, "cell"].isna().all()
    assert radio.loc[neighbour, ["mcc", "mnc", "lac", "ci"]].isna().all(axis=None)
    assert (radio["bsic"] == 7 + np.arange(COUNT)).all()


def test_a_cell_of_number_zero_in_a_network_is_one(read):
    radio, _ = read(mcc=244, mnc=91, lac=171, ci=0)
    assert set(radio["cell"]) == {"244-91-171-0"}
    assert set(radio["role"]) == {"serving"}


@pytest.mark.parametrize("node", [True, False])
def test_numbers_of_cells_within_nodes_beside_whole_identities_are_no_names(read, node):
    """All cells with the same number were one, which a plan of numbered cells has as another."""
    nodes, cells = numbers(1000, 9000), numbers(1, 4, 2)
    columns = {"eci": 256 * nodes + cells, "cell": cells} | ({"enb": nodes} if node else {})
    radio, notes = read(mcc=244, mnc=91, tac=7, **columns)
    assert radio["cell"].tolist() == [
        f"244-91-7-{256 * a + b}" for a, b in zip(nodes, cells, strict=True)
    ]
    assert "cell: taken for the numbers of cells within their nodes" in notes


def test_small_names_of_a_plan_beside_other_identities_stay(read):
    names = numbers(1, 40)
    radio, _ = read(mcc=244, mnc=91, lac=7, ci=10_000 + 2 * names, cell=names)
    assert radio["cell"].tolist() == [str(one) for one in names]
