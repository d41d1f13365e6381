"""RINEX observations: years and times; of version 2 many satellites, events, damaged epochs."""

from datetime import UTC, datetime

import numpy as np
import pytest
from made_recordings import MADE

from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import lines as line_reader

TYPES = ["L1", "L2", "C1", "P2", "D1", "S1", "S2"]
PER_LINE = 5
LEAPS_S = 18


def header(types=TYPES):
    text = f"{len(types):6d}" + "".join(f"    {one}" for one in types)
    return [
        f"{'     2.11           OBSERVATION DATA    M (MIXED)':<60}RINEX VERSION / TYPE",
        f"{text:<60}# / TYPES OF OBSERV",
        f"{'  2026     5     1    10     0    0.0000000     GPS':<60}TIME OF FIRST OBS",
        f"{'':<60}END OF HEADER",
    ]


def epoch(second, names, values, flag=0):
    """Return an epoch; values (satellites, types), NaN is blank."""
    lines = []
    for at in range(0, len(names), 12):
        some = "".join(names[at : at + 12])
        head = f" 26  5  1 10  0 {second:10.7f}  {flag}{len(names):3d}" if at == 0 else " " * 32
        lines.append(head + some)
    for row in values:
        words = [f"{value:14.3f}  " if np.isfinite(value) else " " * 16 for value in row]
        for at in range(0, len(words), PER_LINE):
            lines.append("".join(words[at : at + PER_LINE]).rstrip())
    return lines


def made(count=14, seconds=(0, 1, 2, 3)):
    rng = np.random.default_rng(0)
    names = [f"{'GRE'[i % 3]}{i + 1:02d}" for i in range(count)]
    values = rng.uniform(2e7, 2.5e7, (len(seconds), count, len(TYPES))).round(3)
    values[:, :, 5] = rng.uniform(20, 50, values.shape[:2]).round(3)
    return names, values


@pytest.fixture
def read(tmp_path):
    def of(lines):
        path = tmp_path / "made.26o"
        path.write_text("\n".join(lines) + "\n")
        return read_recording(path)

    return of


@pytest.mark.parametrize("block_bytes", [1 << 21, 700])
def test_lines_of_satellites_and_values_go_on(read, monkeypatch, block_bytes):
    monkeypatch.setattr(line_reader, "_BLOCK_BYTES", block_bytes)
    names, values = made()
    values[1, 4, 2] = np.nan
    values[2, 5, 5] = np.nan
    lines = header() + [line for i in range(4) for line in epoch(i, names, values[i])]
    recording = read(lines)
    rows = recording.tables["satellites"]
    assert len(rows) == 4 * 14 - 1
    for i, moment in enumerate(sorted(rows["time_s"].unique())):
        of = rows[rows["time_s"] == moment].set_index("satellite")
        for k, name in enumerate(names):
            if (i, k) == (1, 4):
                assert name not in of.index
                continue
            assert of.loc[name, "pseudorange_m"] == values[i, k, 2]
            level = of.loc[name, "cn0_dbhz"]
            assert ((i, k) == (2, 5) and np.isnan(level)) or level == values[i, k, 5]
    assert recording.rows == 4 * 15
    # The lines of a satellite's values: two of names in each epoch, then two for each one.
    assert [(one.reason, one.lines) for one in recording.unusable] == [
        ("no code range on L1 (E1, B1)", (4 + 30 + 2 + 2 * 4 + 1,))
    ]


@pytest.mark.parametrize("time", [" 26  5  1 10  0  1.5000000", " " * 26])
@pytest.mark.parametrize("flag", [4, 6])
def test_events_are_skipped_with_their_lines(read, time, flag):
    """Lines of those without a time, and of slips, were refused as epochs."""
    names, values = made(2)
    event = [f"{time}  4  2", f"{'moved':<60}COMMENT", f"{'again':<60}COMMENT"]
    if flag == 6:
        event = [f"{time}  6  2{''.join(names)}", *epoch(0, names, values[2])[1:]]
    lines = [*header(), *epoch(0, names, values[0]), *event, *epoch(2, names, values[1])]
    recording = read(lines)
    assert len(recording.tables["satellites"]) == 4
    assert recording.unusable == ()


def test_a_satellite_without_letter_is_of_gps(read):
    _, values = made(2)
    rows = read([*header(), *epoch(0, [" 07", "G 9"], values[0])]).tables["satellites"]
    assert rows["satellite"].tolist() == ["G07", "G09"]


@pytest.mark.parametrize("count", ["92", "  0", "9 9", "ab "])
def test_an_epoch_with_a_wrong_number_loses_only_itself(read, count):
    names, values = made(3)
    lines = [line for i in range(4) for line in epoch(i, names, values[i])]
    size = len(lines) // 4
    lines[size] = lines[size][:29] + f"{count:>3}" + lines[size][32:]
    recording = read(header() + lines)
    rows = recording.tables["satellites"]
    assert sorted(((rows["time_s"] + LEAPS_S) % 60).unique()) == [0.0, 2.0, 3.0]
    assert len(rows) == 9
    assert recording.unusable_rows == size


def test_a_file_that_ends_within_an_epoch_keeps_what_it_has(read):
    names, values = made(4)
    lines = header() + epoch(0, names, values[0]) + epoch(1, names, values[1])[:4]
    recording = read(lines)
    # The last satellite lacks its second line, which has the level.
    last = recording.tables["satellites"].iloc[-1]
    assert (len(recording.tables["satellites"]), last["pseudorange_m"]) == (6, values[1, 1, 2])
    assert np.isnan(last["cn0_dbhz"])


@pytest.mark.parametrize("year", ["6026", "2262", "0000"])
def test_a_year_of_another_age_loses_its_epoch_alone(tmp_path, year):
    path = tmp_path / "phone.26o"
    text = MADE["rinex-obs"][1]
    epochs = text.count("> 2026")
    path.write_text(text.replace("> 2026", f"> {year}", 1))
    rows = read_recording(path).tables["satellites"]
    assert rows["time_s"].nunique() == epochs - 1


@pytest.mark.parametrize(
    ("constellation", "system", "ahead_s"),
    [
        *(("G", "GPS", 18), ("M", "GLO", 0), ("C", "BDT", 4), ("M", "BDT", 4), ("C", "GPS", 18)),
        *(("G", "   ", 18), ("R", "   ", 0), ("C", "   ", 4), ("E", "   ", 18)),
    ],
)
@pytest.mark.parametrize("version", [2, 3])
def test_times_are_those_of_the_time_system(tmp_path, version, constellation, system, ahead_s):
    """GPS time is 18 s ahead of UTC, BeiDou's 4 s; files of one constellation need not name it."""
    letter = "G" if constellation == "M" else constellation
    code = "C2I" if letter == "C" else "C1C"
    types = [f"{letter}    1 {code}", "SYS / # / OBS TYPES"]
    lines = [f"> 2026 05 01 10 00 {30 + ahead_s:10.7f}  0  1", f"{letter}07  22000000.000"]
    if version == 2:
        types = ["     1    C1" if letter != "C" else "     1    C2I", "# / TYPES OF OBSERV"]
        lines = [f" 26  5  1 10  0 {30 + ahead_s:10.7f}  0  1{letter}07", "  22000000.000"]
    first = f"  2026     5     1    10     0   {30 + ahead_s:10.7f}     {system}"
    kind = f"     {version}.00           OBSERVATION DATA    {constellation}"
    head = [[kind, "RINEX VERSION / TYPE"], types, [first, "TIME OF FIRST OBS"]]
    head += [["", "END OF HEADER"]]
    path = tmp_path / "made.26o"
    path.write_text("\n".join([*(f"{a:<60}{b}" for a, b in head), *lines]) + "\n")
    recording = read_recording(path)
    assert recording.tables["satellites"]["time_s"].tolist() == [
        datetime(2026, 5, 1, 10, 0, 30, tzinfo=UTC).timestamp()
    ]
    utc = system == "GLO" or (constellation, system.strip()) == ("R", "")
    assert recording.clock.kind == ("utc" if utc else "gps")


@pytest.mark.parametrize(
    ("version", "event"),
    [
        *((2, f" 26  5  1 10  0  0.5000000  {end}") for end in ("5  0", "5", "2  0")),
        (2, f"{'':28}3  0"),
        (3, "> 2026 05 01 10 00  0.5000000  5  0"),
        (3, f"{'>':31}4  0"),
    ],
)
def test_events_without_lines_or_a_time_are_no_bad_epochs(tmp_path, version, event):
    """Marks of a camera were noted as epochs that cannot be read."""
    types = ["G    1 C1C", "SYS / # / OBS TYPES"]
    lines = ["> 2026 05 01 10 00  {}.0000000  0  1", "G07  22000000.000"]
    if version == 2:
        types = ["     1    C1", "# / TYPES OF OBSERV"]
        lines = [" 26  5  1 10  0  {}.0000000  0  1G07", "  22000000.000"]
    kind = [f"     {version}.00           OBSERVATION DATA    G", "RINEX VERSION / TYPE"]
    head = [f"{a:<60}{b}" for a, b in (kind, types, ["", "END OF HEADER"])]
    body = [lines[0].format(0), lines[1], event, lines[0].format(1), lines[1]]
    path = tmp_path / "made.26o"
    path.write_text("\n".join([*head, *body]) + "\n")
    recording = read_recording(path)
    assert np.diff(recording.tables["satellites"]["time_s"]).tolist() == [1.0]
    assert recording.losses == ()
