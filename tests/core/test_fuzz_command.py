"""The command that counts what readers make of hostile files."""

import json
import os
import time
from pathlib import Path

import fuzz_command
import pytest

from mapfilter.errors import InputError, fail


def _refuses_some(path: Path) -> None:
    if len(path.read_bytes()) % 2:
        raise fail(InputError, str(path), "an even number of bytes", "an odd one")


def _ends(path: Path) -> None:
    if path.read_bytes() != b"good":
        os._exit(7)


def _breaks(path: Path) -> None:
    if path.read_bytes() != b"good":
        raise KeyError("a fault")


def _leaves(path: Path) -> None:
    if path.read_bytes() != b"good":
        path.with_suffix(".lock").touch()


def _waits(path: Path) -> None:
    if path.read_bytes() != b"good":
        time.sleep(60)


def _main(reads, out: Path, *given: str) -> int:
    def targets(folder: Path):
        for name, read in reads.items():
            (folder / name).mkdir()
            path = folder / name / "file"
            path.write_bytes(b"good")
            yield fuzz_command.Target(name, path, read)

    return fuzz_command.main(targets, ["--out", str(out), *given])


def _counts(out: Path) -> dict[str, dict]:
    return {
        name: {key: known[key] for key in ("batches", "read", "refused")}
        for name, known in json.loads(out.read_text()).items()
    }


def test_it_goes_on_where_it_stopped_and_workers_change_nothing(tmp_path) -> None:
    reads = {"one": _refuses_some, "two": _refuses_some}
    first, whole = tmp_path / "first.json", tmp_path / "whole.json"
    for mutations in ("40", "80"):
        assert _main(reads, first, "--batch", "10", "--mutations", mutations) == 0
    given = ["--batch", "10", "--mutations", "80", "--workers", "3"]
    assert _main(reads, whole, *given) == 0
    assert _counts(first) == _counts(whole)
    assert _counts(first)["one"]["batches"] == 4
    assert sum(_counts(first)["one"][key] for key in ("read", "refused")) == 40
    assert _counts(first)["one"]["refused"] > 5


def test_another_seed_has_other_copies_and_a_file_of_counts_one_seed(tmp_path) -> None:
    found, given = [], ["--batch", "200", "--mutations", "200", "--seed"]
    for seed in ("0", "1"):
        out = tmp_path / f"{seed}.json"
        _main({"one": _refuses_some}, out, *given, seed)
        found.append(_counts(out)["one"]["read"])
    assert found[0] != found[1]
    with pytest.raises(SystemExit):
        _main({"one": _refuses_some}, out, *given, "0")


@pytest.mark.parametrize(
    ("read", "word"),
    [(_ends, "exit code 7"), (_breaks, "KeyError"), (_leaves, "left behind: ['file.lock']")],
)
def test_what_ends_breaks_or_leaves_files_is_a_fault(read, word, tmp_path, capsys) -> None:
    out = tmp_path / "out.json"
    reads = {"good": _refuses_some, "bad": read}
    assert _main(reads, out, "--batch", "20", "--mutations", "40") == 1
    assert word in capsys.readouterr().out
    assert _counts(out)["bad"] == {"batches": 1, "read": 0, "refused": 0}
    assert _counts(out)["good"]["read"] > 0


def test_who_waits_for_ever_is_ended(monkeypatch, tmp_path, capsys) -> None:
    monkeypatch.setattr(fuzz_command, "_WAITING_S", 0.5)
    monkeypatch.setattr(fuzz_command, "_LOOKING_S", 0.1)
    out = tmp_path / "out.json"
    assert _main({"bad": _waits}, out, "--batch", "20", "--mutations", "20") == 1
    assert "no answer after" in capsys.readouterr().out
