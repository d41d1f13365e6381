"""Files that mapfilter writes, requests and logs that are located: good ones, and some damaged."""

import json
from pathlib import Path

import fuzz_command
import pytest

TESTS = Path(__file__).resolve().parents[1]


def test_some_copies_of_each_are_read_or_refused(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    for room in ("roads", "positioning", "experiments"):
        monkeypatch.syspath_prepend(str(TESTS / room))
    from fuzz_stored import stored

    out = tmp_path / "counts.json"
    given = ["--out", str(out), "--mutations", "220", "--batch", "10"]
    assert fuzz_command.main(stored, given) == 0
    known = json.loads(out.read_text())
    assert {one["batches"] for one in known.values()} == {1}
    of = {name.split()[0] for name in known}
    assert {"database", "estimate", "page", "session", "patch", "sweep", "located"} <= of
