"""Folders with a part deep inside, written and read as a whole."""

import pytest

from mapfilter._io import atomic_dir
from mapfilter.errors import OutputError


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def told(path, write):
    """The one fault of what cannot be written."""
    with pytest.raises(OutputError) as caught:
        write()
    (fault,) = caught.value.faults
    assert fault.where == str(path)
    return fault


def write_folder(path, text):
    with atomic_dir(path) as folder:
        (folder / "deep").mkdir()
        (folder / "deep" / "part").write_text(text)


def read_folder(path):
    return {str(p.relative_to(path)): p.read_text() for p in path.rglob("*") if p.is_file()}
