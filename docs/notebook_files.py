"""The pages of ``notebooks/`` as .ipynb files, with the outputs that the tests compare."""

from __future__ import annotations

import json
import re
from doctest import DocTestParser, Example
from pathlib import Path
from typing import Any

Cell = dict[str, Any]

_LEVELS = {"=": "#", "-": "##", "~": "###"}
_FENCE = "\0"
_ROLE = re.compile(r":[\w:]+:`~?([^`<]*?)(?: *<[^`>]*>)?`")


def write_all(pages: Path, folder: Path) -> list[Path]:
    """Write every page as a notebook into a folder, and return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for page in sorted(pages.glob("*.rst")):
        path = folder / f"{page.stem}.ipynb"
        text = json.dumps(notebook(page.read_text(encoding="utf-8")), indent=1, ensure_ascii=False)
        path.write_text(text + "\n", encoding="utf-8")
        written.append(path)
    return written


def notebook(page: str) -> dict[str, Any]:
    """Return a page as a notebook: its text as Markdown, its examples as executed cells."""
    cells: list[Cell] = []
    run: list[Example] = []
    count = 0
    for part in DocTestParser().parse(page):
        if isinstance(part, Example):
            run.append(part)
            if part.want or part.exc_msg:
                count += 1
                cells.append(_code(run, count))
                run = []
        elif part.strip():
            if run:
                count += 1
                cells.append(_code(run, count))
                run = []
            cells.append({"cell_type": "markdown", "metadata": {}, "source": _markdown(part)})
    if run:
        cells.append(_code(run, count + 1))
    for number, cell in enumerate(cells):
        cell["id"] = f"cell-{number}"
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {
        "cells": cells,
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def _code(examples: list[Example], count: int) -> Cell:
    outputs = []
    want = examples[-1].want
    if want:
        outputs.append({"output_type": "stream", "name": "stdout", "text": want})
        last = examples[-1].source.lstrip()
        if not last.startswith(("print", "for ", "try:", "with ")):
            result = {"data": {"text/plain": want.rstrip("\n")}, "metadata": {}}
            outputs = [{"output_type": "execute_result", "execution_count": count, **result}]
    return {
        "cell_type": "code",
        "execution_count": count,
        "metadata": {},
        "outputs": outputs,
        "source": "".join(example.source for example in examples).rstrip("\n"),
    }


def _markdown(text: str) -> str:
    """Return reStructuredText of these pages as Markdown: headings, code blocks, roles, links."""
    lines = text.strip("\n").split("\n")
    found: list[str] = []
    fenced = False
    for line in lines:
        rule = line[:1]
        if (
            found
            and rule in _LEVELS
            and line == rule * len(line)
            and len(line) >= len(found[-1]) > 0
        ):
            found[-1] = f"{_LEVELS[rule]} {found[-1]}"
        elif line.startswith(".. code-block::"):
            found.append(_FENCE + line.partition("::")[2].strip())
            fenced = True
        elif fenced and line and not line.startswith(" "):
            found[-1:] = [_FENCE, "", line]
            fenced = False
        elif fenced:
            if line or not found[-1].startswith(_FENCE):
                found.append(line.removeprefix("   "))
        elif not line.startswith((".. ", ":download:")):
            found.append(line)
    if fenced:
        found = [*(found if found[-1] else found[:-1]), _FENCE]
    joined = _ROLE.sub(r"`\1`", "\n".join(found)).replace("``", "`")
    return joined.replace(_FENCE, "```")
