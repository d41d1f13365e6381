"""What is resumed: nothing of other inputs, other code, or a damaged file."""

import shutil
from pathlib import Path

import pytest

from mapfilter import _code, _resume
from mapfilter._resume import kept_when_stopped, load_part, save_part, start_or_resume
from mapfilter.errors import ConfigError, Stopped


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """A copy of some sources of the package, as the digest sees them."""
    folder = tmp_path / "mapfilter"
    for name in ("_code.py", "errors.py", "database/store.py"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(Path(_code.__file__).parent / name, folder / name)
    monkeypatch.setattr(_code, "__file__", str(folder / "_code.py"))
    return folder


def test_any_change_of_a_source_or_a_library_is_another_code(sources, monkeypatch):
    digest = _code.code_digest.__wrapped__
    digests = [digest()]
    (sources / "database" / "store.py").write_text("# one comment")
    digests.append(digest())
    (sources / "new.py").touch()
    digests.append(digest())
    (sources / "new.py").rename(sources / "other.py")
    digests.append(digest())
    monkeypatch.setattr(_code, "version", lambda name: "0" if name == "numpy" else "1")
    digests.append(digest())
    (sources / "notes.txt").touch()
    assert digest() == digests[-1]
    assert len(set(digests)) == len(digests) == 5


def test_a_computation_of_other_code_is_not_resumed(tmp_path, monkeypatch):
    head, part = tmp_path / "head.json", tmp_path / "part"
    assert not start_or_resume(head, {"seed": 1}, [part], resume=True)
    part.touch()
    assert start_or_resume(head, {"seed": 1}, [part], resume=True)
    monkeypatch.setattr(_resume, "code_digest", lambda: "of other code")
    with pytest.raises(ConfigError, match="found another version of mapfilter") as caught:
        start_or_resume(head, {"seed": 1}, [part], resume=True, names={"seed": "seed"})
    assert "mapfilter or a library was updated since" in str(caught.value)
    with pytest.raises(ConfigError, match="settings changed since"):
        start_or_resume(head, {"seed": 2}, [part], resume=True, names={"seed": "seed"})
    assert part.exists()
    assert not start_or_resume(head, {"seed": 1}, [part], resume=False)
    assert not part.exists()


def test_no_flipped_bit_of_a_part_is_overlooked(tmp_path):
    file = tmp_path / "part-1"
    save_part(file, b"finished")
    whole = file.read_bytes()
    assert load_part(file) == b"finished"
    for place in range(len(whole)):
        for bit in range(8):
            damaged = bytearray(whole)
            damaged[place] ^= 1 << bit
            file.write_bytes(bytes(damaged))
            assert load_part(file) is None
    for size in range(len(whole)):
        file.write_bytes(whole[:size])
        assert load_part(file) is None


def test_two_hosts_write_a_part_beside_each_other(tmp_path, monkeypatch):
    """Their processes may have one number."""
    beside = []
    monkeypatch.setattr(
        type(tmp_path), "write_bytes", lambda self, _: (beside.append(self.name), self.touch())
    )
    for _ in range(2):
        save_part(tmp_path / "part-1", b"finished")
    assert len(set(beside)) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["part-1"]


@pytest.mark.parametrize("error", [KeyboardInterrupt(), Stopped(15)], ids=repr)
def test_who_is_stopped_is_told_what_is_kept(error):
    with pytest.raises(type(error)) as caught, kept_when_stopped("batches"):
        raise error
    assert caught.value.__notes__ == ["finished batches are kept: go on with --resume"]
