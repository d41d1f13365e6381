"""Folders with a part deep inside, written and read as a whole."""

from mapfilter._io import atomic_dir


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def write_folder(path, text):
    with atomic_dir(path) as folder:
        (folder / "deep").mkdir()
        (folder / "deep" / "part").write_text(text)


def read_folder(path):
    return {str(p.relative_to(path)): p.read_text() for p in path.rglob("*") if p.is_file()}
