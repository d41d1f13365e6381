"""One real service: the commands of the page, a crash, a restart, a graceful end."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import textwrap
import time
import urllib.error
import urllib.request
from dataclasses import replace
from pathlib import Path

import pytest
from positioning.cross_world import LATTICE, levels_dbm, make_plan, make_routes

from mapfilter.database.build import build
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.serving.store import LOCK

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "serve.rst"
IDENTITY = {"mcc": 1, "mnc": 1, "lac": 4001}
STARTED_S = 120.0


def page_database(folder):
    """The made cross, with the cells that the page names."""
    plan, names = make_plan(), {"W": ("S1A", 10101), "E": ("S1B", 10102), "NW": ("NW", 10103)}
    cells = tuple(
        replace(cell, id=names[cell.id][0], ci=names[cell.id][1], **IDENTITY) for cell in plan.cells
    )
    plan = replace(plan, cells=cells)
    write_rasters(folder / "rxlev.tif", LATTICE, ((c.id, levels_dbm(c)) for c in cells), plan.ids)
    rasters = open_rasters(folder / "rxlev.tif")
    build(rasters, plan, make_routes(), folder / "database", floor_dbm=-110.0)
    return folder / "database"


class Served:
    """A service in a process of its own, on a free port."""

    def __init__(self, database, *options):
        command = [sys.executable, "-m", "mapfilter", "serve", "--db", database, "--port", "0"]
        self.lines = []
        self.process = subprocess.Popen(
            [*map(str, command), *map(str, options)], stderr=subprocess.PIPE, text=True
        )
        until_s = time.monotonic() + STARTED_S
        while not any("serving" in line for line in self.lines):
            line = self.process.stderr.readline()
            assert line, self.lines
            assert time.monotonic() < until_s
            self.lines.append(line)
        self.port = int(re.search(r"http://127\.0\.0\.1:(\d+)", self.lines[-1])[1])

    def ask(self, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(
            f"http://127.0.0.1:{self.port}{path}", data, {"Content-Type": "application/json"}
        )
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)

    def end(self, number):
        self.process.send_signal(number)
        _, rest = self.process.communicate(timeout=60)
        return self.process.returncode, rest


def epochs(first, last):
    row = {"role": "serving", "cell": "S1A", "level_dbm": -71}
    motion = {"step_m": 1.3, "heading_rad": 0.0}
    return [{"time_s": float(i), "motion": [motion], "radio": [row]} for i in range(first, last)]


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    return page_database(tmp_path_factory.mktemp("served"))


def test_a_crash_and_a_restart_lose_nothing_that_was_saved(database, tmp_path):
    few = ("--set", "filter.bayes.max_particles=1500", "--set", "filter.bayes.min_particles=300")
    options = ("--state", tmp_path / "sessions", "--save-every", "0.1", *few)
    served = Served(database, *options, "--set", "filter.bayes.min_search_particles=800")
    options = (*options, "--set", "filter.bayes.min_search_particles=800")
    try:
        one, two = (served.ask("/sessions", {"seed": 3})["id"] for _ in range(2))
        first = served.ask(f"/sessions/{one}/epochs", {"epochs": epochs(0, 20)})["fixes"]
        whole = served.ask(f"/sessions/{two}/epochs", {"epochs": epochs(0, 40)})["fixes"]
        assert first == whole[:20]
        until_s = time.monotonic() + 30
        while served.ask(f"/sessions/{one}")["saved_time_s"] != 19.0:
            assert time.monotonic() < until_s
            time.sleep(0.05)
    finally:
        code, _ = served.end(signal.SIGKILL)
    assert code == -signal.SIGKILL
    served = Served(database, *options)
    try:
        assert "2 saved sessions" in served.lines[-1]
        rest = served.ask(f"/sessions/{one}/epochs", {"epochs": epochs(20, 40)})["fixes"]
        assert rest == whole[20:]
        address = f"http://127.0.0.1:{served.port}/sessions/{two}"
        urllib.request.urlopen(urllib.request.Request(address, method="DELETE"), timeout=60).close()
    finally:
        code, said = served.end(signal.SIGTERM)
    assert code == 0
    assert said.startswith("mapfilter: stopped by SIGTERM: 1 session saved in ")


@pytest.mark.skipif(shutil.which("curl") is None, reason="the page's commands need curl")
def test_the_commands_of_the_page_work(database, tmp_path):
    text = PAGE.read_text(encoding="utf-8").split("\nFor others on the network\n")[0]
    blocks = re.findall(r"code-block:: console\n\n((?:   .*\n|\n)+)", text)
    lines = [line for block in blocks for line in textwrap.dedent(block).splitlines()]
    commands = [line.removeprefix("$ ") for line in lines if line.startswith("$ curl")]
    assert len(commands) == 7
    served, found = Served(database, "--state", tmp_path), {}
    try:
        for command in commands:
            command = command.replace(":8765", f":{served.port}")
            held = {**os.environ, "ID": found.get("id", "")}
            done = subprocess.run(
                command, shell=True, capture_output=True, env=held, text=True, timeout=60
            )
            assert done.returncode == (28 if "--max-time" in command else 0), command
            if done.stdout.startswith("{"):
                found |= json.loads(done.stdout)
                assert "error" not in found, (command, found)
            elif done.stdout:
                assert "event: fix" in done.stdout
    finally:
        code, said = served.end(signal.SIGINT)
    assert code == 0
    assert said == "mapfilter: stopped by SIGINT: no session was open\n"
    assert found["fixes"][0]["status"] == "SEARCHING"
    assert found["fixes"][0]["unused"] == [{"kind": "motion", "what": "", "reason": "not_started"}]
    assert found["accuracy"] > 0
    assert [path.name for path in tmp_path.iterdir()] == [LOCK]
    with pytest.raises(urllib.error.URLError):
        served.ask("/")
