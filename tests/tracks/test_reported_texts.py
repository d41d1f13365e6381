"""Cells as texts: of Android in a column or in logcat, and replies of modems in a log."""

import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.formats import read_recording

START_S = 1_778_659_200  # 2026-05-13T08:00:00Z
NONE = 2147483647
LTE = (
    "CellInfoLte:{{mRegistered={registered} mTimeStampType=oem_ril mTimeStamp=74197255133ns "
    "CellIdentityLte:{{ mCi={ci} mPci={pci} mTac=3021 mEarfcn=1300 mBandwidth=2147483647 mMcc=244 "
    "mMnc=91 mAlphaLong=DNA mAlphaShort=DNA}} CellSignalStrengthLte: rssi=-60 rsrp={rsrp} rsrq=-10 "
    "rssnr=2147483647 cqi=2147483647 ta={ta} level=3}}"
)
SERVING = LTE.format(registered="YES", ci=12345678, pci=100, rsrp=-80, ta=4)
OTHER = LTE.format(registered="NO", ci=NONE, pci=7, rsrp=-95, ta=NONE)
OLD = (
    "CellInfoLte:{mRegistered=YES mTimeStampType=oem_ril mTimeStamp=1ns CellIdentityLte:{ mMcc=242 "
    "mMnc=1 mCi=777 mPci=376 mTac=55} CellSignalStrengthLte: ss=23 rsrp=-94 rsrq=-8 "
    "rssnr=2147483647 cqi=2147483647 ta=2147483647}"
)
NR = (
    "CellInfoNr:{ mRegistered=YES mTimeStamp=1ns CellIdentityNr:{ mPci = 15 mTac = 9 mNrArfcn = "
    "640000 mBands = [78] mMcc = 310 mMnc = 260 mNci = 5000000001 mAlphaLong = x } "
    "CellSignalStrengthNr:{ csiRsrp = 2147483647 csiRsrq = 2147483647 ssRsrp = -95 ssRsrq = -11 } }"
)
UMTS = (
    "CellInfoWcdma:{mRegistered=YES mTimeStamp=1ns CellIdentityWcdma:{ mLac=501 mCid=9000001 "
    "mPsc=33 mUarfcn=10700 mMcc=244 mMnc=91} CellSignalStrengthWcdma: ss=17 ber=99}"
)
GSM = (
    "CellInfoGsm:{mRegistered=YES mTimeStamp=1ns CellIdentityGsm:{ mLac=501 mCid=4321 mArfcn=62 "
    "mBsic=0x3f mMcc=244 mMnc=91} CellSignalStrengthGsm: rssi=-71 ber=0 mTa=3 mLevel=4}"
)


def read(tmp_path, content, name="phone.csv"):
    path = tmp_path / name
    path.write_text(content)
    return read_recording(path)


def test_a_column_of_cells_of_android(tmp_path):
    """It was not used, without a word on what it holds."""
    rows = [f'{START_S + at},60.17{at},24.94,"[{SERVING}, {OTHER}]"' for at in range(3)]
    found = read(tmp_path, "\n".join(["time,lat,lon,cell_info", *rows]))
    radio = found.tables["radio"]
    assert radio["role"].tolist() == ["serving", "neighbour"] * 3
    assert radio["cell"].dropna().unique().tolist() == ["244-91-3021-12345678"]
    assert radio["level_dbm"].tolist() == [-80, -95] * 3
    assert radio["arfcn"].tolist() == [1300] * 6
    assert radio["bsic"].tolist() == [100, 7] * 3
    assert radio["timing_advance"].dropna().tolist() == [4] * 3
    assert found.tables["positions"]["time_s"].tolist() == [START_S + at for at in range(3)]
    assert any("cells of Android read as a table" in note for note in found.notes)
    assert not found.unread


@pytest.mark.parametrize(
    ("text", "technology", "cell", "code", "level"),
    [
        (OLD, "LTE", "242-1-55-777", 376, -94),
        (NR, "NR", "310-260-9-5000000001", 15, -95),
        (UMTS, "UMTS", "244-91-501-9000001", 33, None),  # an ASU of an old version
        (UMTS.replace("ss=17", "ss=-81"), "UMTS", "244-91-501-9000001", 33, -81),
        (UMTS.replace("ber", "rscp=-90 ber"), "UMTS", "244-91-501-9000001", 33, -90),
        (GSM, "GSM", "244-91-501-4321", 63, -71),
    ],
)
def test_cells_of_all_technologies(tmp_path, text, technology, cell, code, level):
    found = read(tmp_path, f'time,info\n{START_S},"{text}"\n').tables["radio"].iloc[0]
    assert (found["technology"], found["cell"], found["bsic"]) == (technology, cell, code)
    assert found["role"] == "serving"
    assert found["level_dbm"] == level or (
        level is None and found["level_dbm"] != found["level_dbm"]
    )


def test_levels_alone_in_a_column(tmp_path):
    """Of several technologies the primary one counts."""
    lte = "CellSignalStrengthLte: rssi=-51 rsrp=-81 rsrq=-9 rssnr=2 cqi=2147483647 ta=1 level=4"
    nr = "CellSignalStrengthNr:{ csiRsrp = 2147483647 ssRsrp = -99 }"
    none = f"CellSignalStrengthGsm: rssi={NONE} ber={NONE} mTa={NONE}"
    both = f"SignalStrength:{{mGsm={none},mLte={lte},mNr={nr},primary=CellSignalStrengthNr}}"
    head = "time,mcc,mnc,tac,ci,signal"
    rows = [f'{START_S},244,91,1,7,"{lte}"', f'{START_S + 1},244,91,1,7,"{both}"']
    rows += [f'{START_S + 2},244,91,1,7,"{none}"']
    radio = read(tmp_path, "\n".join([head, *rows])).tables["radio"]
    assert radio["cell"].tolist() == ["244-91-1-7"] * 3
    assert radio["level_dbm"].tolist()[:2] == [-81.0, -99.0]
    assert radio["level_dbm"].isna().tolist() == [False, False, True]


@pytest.mark.parametrize("stamp", ["1778659200.123", "2026-05-13 08:00:00.123 +0000"])
def test_lines_of_logcat(tmp_path, stamp):
    lines = ["--------- beginning of main", f"{stamp}  1793  1793 D Own: [{SERVING}, {OTHER}]"]
    lines += [f"{stamp}  1793  1793 D Other: nothing"]
    radio = read(tmp_path, "\n".join(lines), "log.txt").tables["radio"]
    assert radio["time_s"].tolist() == [START_S + 0.123] * 2
    assert radio["role"].tolist() == ["serving", "neighbour"]


def test_a_logcat_without_years_is_refused_with_a_remedy(tmp_path):
    with pytest.raises(InputError, match="log with -v epoch"):
        read(tmp_path, f"05-13 11:00:00.123  1793  1793 D Own: [{SERVING}]\n", "log.txt")
    with pytest.raises(InputError, match="write a time before each line"):
        read(tmp_path, f"[{SERVING}]\n", "log.txt")


QENG = '+QENG: "servingcell","NOCONN","LTE","FDD",244,91,BC614E,100,1300,3,5,5,BCD,-80,-10,-60,15,-'
SA = '+QENG: "servingcell","NOCONN","NR5G-SA","TDD",310,260,12A05F201,15,9,640000,78,12,-95,-11,20'


def test_replies_of_a_modem(tmp_path):
    """Such a log was none of the known formats."""
    lines = [
        f"[2026-05-13 11:00:00.500] {QENG}",
        '[2026-05-13 11:00:00.600] +QENG: "neighbourcell intra","LTE",1300,7,-12,-95,-70,0,37,7',
        '2026-05-13 11:00:01 AT+QENG="servingcell"',
        SA,
        "OK",
        '+QENG: "servingcell","SEARCH"',
        '2026-05-13 11:00:02 +QENG: "servingcell","CONNECT"',
        '+QENG: "LTE","FDD",244,91,BC614E,100,1300,3,5,5,BCD,-81,-10,-60,15,-',
    ]
    found = read(tmp_path, "\n".join(lines) + "\n", "modem.log")
    radio = found.tables["radio"]
    assert (radio["time_s"] - START_S - 10_800).tolist() == pytest.approx(
        [0.5, 0.6, 1, 2], abs=1e-6
    )
    assert radio["role"].tolist() == ["serving", "neighbour", "serving", "serving"]
    named = ["244-91-3021-12345678", None, "310-260-9-5000000001", "244-91-3021-12345678"]
    assert radio["cell"].astype(object).fillna("").tolist() == [name or "" for name in named]
    assert radio["level_dbm"].tolist() == [-80, -95, -95, -81]
    assert radio["technology"].tolist() == ["LTE", "LTE", "NR", "LTE"]
    assert radio["bsic"].tolist() == [100, 7, 15, 100]
    assert radio["arfcn"].tolist() == [1300, 1300, 640000, 1300]


def test_other_logs_of_modems_are_named(tmp_path):
    csq = "2026-05-13 11:00:00 AT+CSQ\n+CSQ: 18,99\nOK\n+CREG: 2,1\n"
    with pytest.raises(InputError, match=r"replies to other commands are not read: log AT\+QENG"):
        read(tmp_path, csq, "modem.log")
    with pytest.raises(InputError, match="write date and time before each line"):
        read(tmp_path, f"AT+QENG\n{QENG}\nOK\n", "modem.log")
