"""Stages of a pipeline in turn, with their results on stdout."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mapfilter.workflows.outputs.guard import guarded
from mapfilter.workflows.outputs.result_text import to_jsonable
from mapfilter.workflows.outputs.terminal import print_message, print_result
from mapfilter.workflows.replays.text import replay_text

if TYPE_CHECKING:
    from mapfilter.config.sections import Config

Stage = Callable[["Config"], Any]


def run_pipeline(stages: Mapping[str, Stage], file: Path, argv: Sequence[str] | None = None) -> int:
    """Run all stages, print their results, and return the exit code: 0, 2, or 3 for partly done.

    Without ``--json`` results are printed as ``mapfilter replay`` prints its own, notes to stderr.

    Parameters
    ----------
    stages : mapping of str to callable
        Public functions of the workflows, by the name that is printed.
    file : Path
        The pipeline's TOML; ``-c`` names another.
    argv : sequence of str, optional
        Arguments: ``-c FILE``, ``--set section.key=value``, ``--out DIR``, ``--json``; those of
        the process when left out.
    """
    parser = argparse.ArgumentParser(description=f"Stages: {', '.join(stages)}.")
    parser.add_argument("-c", "--config", metavar="FILE", type=Path, default=file)
    parser.add_argument("--set", metavar="SECTION.KEY=VALUE", action="append", default=[])
    parser.add_argument("--out", metavar="DIR", type=Path)
    parser.add_argument("--json", action="store_true", help="one JSON object, last on stdout")
    given = parser.parse_args(argv)
    return guarded(lambda: _run(stages, given))


def _run(stages: Mapping[str, Stage], given: argparse.Namespace) -> int:
    from mapfilter.config.load import load_config

    found: dict[str, Any] = {}
    config = load_config(given.config, given.set, out=given.out)
    for name, stage in stages.items():
        began_s = time.perf_counter()
        found[name] = to_jsonable(stage(config))
        found[name]["seconds"] = round(time.perf_counter() - began_s, 3)
        if not given.json:
            print_result({name: replay_text(found[name])}, as_json=False)
            for note in dict.fromkeys(found[name].get("notes", ())):
                print_message(note, "note: ")
    if given.json:
        print_result(found, as_json=True)
    return 3 if any(stage.get("partial") for stage in found.values()) else 0
