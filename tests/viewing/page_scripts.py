"""The page's scripts in node, over a document that only remembers what is put into it."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from mapfilter.viewing import page

DOCUMENT = Path(__file__).parent / "page_document.js"
FOLDER = Path(page.__file__).parent / "page"
OPENED = "  MF.startTheme();\n  const opened"


def ran(task, **given):
    """What a piece of JavaScript returns in which ``given`` are constants."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node: the page's scripts cannot run outside a browser")
    script = "".join(one.read_text(encoding="utf-8") for one in sorted(FOLDER.glob("*.js")))
    # A test opens its own page.
    begun, opened, _ = script.rpartition(OPENED)
    assert opened
    names = "".join(f"const {name} = {json.dumps(value)};\n" for name, value in given.items())
    told = f"(async () => {{{task}}})().then((it) => console.log(JSON.stringify(it)));"
    opens = "MF.startTheme(); MF.start = start;\n})();"
    done = subprocess.run(
        [node, "-"],
        input=f"{DOCUMENT.read_text(encoding='utf-8')}\n{begun}{opens}\n{names}{told}",
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.splitlines()[-1])
