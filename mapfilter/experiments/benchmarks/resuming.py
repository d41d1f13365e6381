"""Going on with a benchmark that was cut short, and never with the results of another one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from mapfilter._io import read_json, write_json
from mapfilter.errors import ConfigError, OutputError, fail


def begin(file: Path, head: Mapping[str, object], results: Iterable[Path], *, resume: bool) -> None:
    """Write which benchmark a folder holds, after older results have been removed.

    Parameters
    ----------
    file : Path
        Gets ``head``.
    head : dict
        What makes the benchmark, as JSON holds it.
    results : iterable of Path
        Files of finished parts. They stay where the same benchmark is resumed.
    resume : bool

    Raises
    ------
    ConfigError
        There is something else to resume.
    OutputError
        An older result cannot be removed, or the file cannot be written.
    """
    if resume and file.is_file():
        found = read_json(file)
        changed = [name for name in head if found.get(name) != head[name]]
        if changed:
            expected = f"the same {', '.join(head)} to resume"
            hint = "begin without --resume, or in another folder"
            raise fail(ConfigError, str(file), expected, f"another {', '.join(changed)}", hint)
    else:
        try:
            for result in results:
                result.unlink(missing_ok=True)
        except OSError as error:
            expected = "older results that can be removed"
            raise fail(OutputError, str(file), expected, error.strerror or error) from error
    write_json(file, head)
