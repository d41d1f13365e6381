"""The walk as drive tests of Nemo and of TEMS Investigation."""

from made_walk import COUNT, LAT_DEG, LEVEL_DBM, LON_DEG, clock

_LOCAL_S = 3 * 3600.0
_HEAD = """\
#PRODUCT,,,"NEMO OUTDOOR","7.8.0.8"
#FF,,,"2.27"
#DN,,,"Qualcomm, 1"
#START,13:00:00.000,,"1.5.2026"
GAA,13:00:00.000,1,2,7
SEI,13:00:00.000,,7,1,,244,91,,,32768,88,"D0CB"
SEI,13:00:00.000,,5,1,3021,244,91,"A4","D1",32768,88,"D0CB"
SEI,13:00:00.000,,1,1,3021,244,91
CHI,13:00:00.000,,7,70001,2,25,1300,435,117025,174,23.0,3,1,,1
CHI,13:00:00.000,,5,50001,1,10588,4464,3021,3.0,320
RRCSM,13:00:00.000,,7,2,"Paging","PCCH",1300,435,"40018F"
"""


def nemo() -> str:
    """Return LTE with a neighbour each row; UMTS, GSM and Wi-Fi in turns; GPS."""
    rows = []
    for i in range(COUNT):
        at, level = f"{clock(i, '%H:%M:%S', _LOCAL_S)}.250", LEVEL_DBM[i]
        rows.append(f"GPS,{at},,{LON_DEG[i]:.6f},{LAT_DEG[i]:.6f},13,{i},1,9,8,2.0,1.1,1.7,1")
        rows.append(
            f"CELLMEAS,{at},,7,0,2,9,0,70001,1300,435,-60.6,{level}.5,-10.1,302060,118.0,"
            f"2,70001,1300,365,-61.8,{level - 9}.0,-14.4,,"
        )
        if i % 3 == 0:
            rows.append(
                f"CELLMEAS,{at},,5,0,1,3,10588,-69.6,50001,3,17,0,50001,10588,24,-11.0,,{level},0,"
                f",,,,,,0,148.4,,1,50001,10588,248,-11.1,0,{level - 5},0,,,,,,,0,308.4,,"
                "1,50001,10588,33,-24.0,,,,,,,,,,,,158.0"
            )
        elif i % 3 == 1:
            rows.append(
                f"CELLMEAS,{at},,1,0,2,16,1,10900,61,42,{level},{level + 1},20,20,,,,,117,3021,1,,"
                f"0,10900,77,13,{level - 7},,12,12,,,,,,,,"
            )
        else:
            rows.append(
                f'CELLMEAS,{at},,20,0,2,10,1,200001,,1,{level}.0,"Shop, 2","0a:74:9c:2e:af:01",4,,'
                f'"0.0.0.0",0,200001,,6,{level - 3}.0,"x","00:00:00:00:00:00",6,,'
            )
    return _HEAD + "\n".join(rows) + "\n"


def tems() -> str:
    """Return GSM, with time stamps; every other row is a message without measurements."""
    head = "Timestamp MS Direction Message@Type All-Latitude All-Longitude All-Altitude@(m) All-LAC"
    head += " All-Cell@Id All-BSIC@(Num) All-ARFCN@BCCH All-RxLev@Full@(dBm) All-RxLev@Sub@(dBm)"
    for name in ("LAC", "Cell Id", "BSIC (Num)", "ARFCN", "RxLev (dBm)"):
        head += f" All-Neighbor@{name.replace(' ', '@')}@(Sorted)[1]"
    lines = [head.replace(" ", "\t").replace("@", " ")]
    for i in range(COUNT):
        at = clock(i, "%d/%m/%Y %H:%M:%S.500", _LOCAL_S)
        level = LEVEL_DBM[i]
        row = [at, "MS1", "UL", "Measurement Report", f"{LAT_DEG[i]:.6f}", f"{LON_DEG[i]:.6f}"]
        row += ["12.5", "3021", f"1170{i // 10}", "42", "61", str(level - 1), str(level)]
        row += ["3021", "4464", "13", "77", str(level - 9)]
        lines.append("\t".join(row))
        lines.append("\t".join([at, "MS1", "DL", "Paging", *[""] * 14]))
    return "\n".join(lines) + "\n"


def tems_lte() -> str:
    """Return LTE, with times of day; the cell's identity in the first row only."""
    names = "Serving Cell DL EARFCN,Serving Cell Identity,Serving Cell RSRP (dBm),"
    names += "Neighbor Cell DL EARFCN,Neighbor Cell Identity,Neighbor Cell RSRP (dBm)"
    head = ["Time", "EQ", "Frame Number", "Message Type", "EventInfo"]
    head += ["All-Latitude Decimal Degree", "All-Longitude Decimal Degree"]
    head += [f"All-{name}[1]" for name in names.split(",")]
    head += ["All-Cell Identity (eNB Part)", "All-Cell Identity (Cell Part)"]
    lines = ["", "", "\t".join(head)]
    for i in range(COUNT):
        at, level = clock(i, "%H:%M:%S.500", _LOCAL_S), LEVEL_DBM[i]
        row = [at, "EQ1", "", "ML1 Connected Mode", "", f"{LAT_DEG[i]:.6f}", f"{LON_DEG[i]:.6f}"]
        row += ["1300", "435", f"{level}.5", "1300", "365", f"{level - 9}"]
        row += ["457", "33"] if i == 0 else ["", ""]
        lines.append("\t".join(row))
    return "\n".join(lines) + "\n"
