"""Load and fault test of the service: ``python -m tests.serve_load [--sessions N]``.

It builds a made city, serves it on a free port of this machine, and prints one JSON object: a
thousand sessions that search and track, slow clients, cut connections, hostile bodies, ``kill -9``
and a restart. It ends with exit code 1 where something went wrong.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

CALLERS = 40
IDLE_S = 20.0
HOSTILE = (b"[" * 50_000, b'{"epochs": NaN}', b'{"a":1,"a":2}', b"\xff\xfe", b'"\\ud800"')


class Client:
    """One kept-alive connection; small enough not to be what is measured."""

    def __init__(self, port: int) -> None:
        self.port, self.reader, self.writer, self.used_s = port, None, None, 0.0

    async def ask(self, method: str, path: str, body: bytes = b"") -> tuple[int, bytes]:
        if time.monotonic() - self.used_s > IDLE_S:
            # The service closes connections that are idle for a minute.
            self.close()
        self.used_s = time.monotonic()
        if self.writer is None:
            self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self.port)
        head = f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        self.writer.write(f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body)
        head = await self.reader.readuntil(b"\r\n\r\n")
        length = re.search(rb"content-length: (\d+)", head)
        body = await self.reader.readexactly(int(length[1])) if length else b""
        self.used_s = time.monotonic()
        if b"connection: close" in head.lower():
            self.close()
        return int(head.split(b" ", 2)[1]), body

    def close(self) -> None:
        if self.writer is not None:
            self.writer.close()
        self.reader = self.writer = None


class Served:
    """The service in a process of its own."""

    def __init__(self, database: Path, folder: Path, *options: str) -> None:
        began_s = time.monotonic()
        command = [sys.executable, "-m", "mapfilter", "serve", "--db", str(database), "--port", "0"]
        command += ["--state", str(folder), "--rate", "100000", *options]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        line = ""
        while "http://" not in line:
            line = self.process.stderr.readline()
            assert line, "the service did not start"
        self.said, self.seconds = line.strip(), time.monotonic() - began_s
        self.port = int(re.search(r":(\d+)(;|$)", self.said)[1])

    def memory_mib(self) -> float:
        text = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", text)[1]) / 1024

    def cpu_s(self) -> float:
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(") ")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self, number: int) -> tuple[int, str]:
        self.process.send_signal(number)
        _, said = self.process.communicate(timeout=300)
        return self.process.returncode, said.strip()


async def spread(work, items) -> list:
    """Do work for each item by some callers at a time."""
    waiting, found = list(reversed(list(items))), []

    async def caller() -> None:
        while waiting:
            found.append(await work(waiting.pop()))

    await asyncio.gather(*(caller() for _ in range(CALLERS)))
    return found


async def begin(port: int, count: int) -> list[str]:
    async def one(number: int) -> str:
        client = Client(port)
        code, body = await client.ask("POST", "/sessions", b'{"seed": %d}' % number)
        client.close()
        assert code == 201, body
        return json.loads(body)["id"]

    return await spread(one, range(count))


async def round_of(port: int, ids: list[str], body: bytes, held: dict) -> dict:
    """Post the same epochs to all sessions; return how long requests took."""

    async def one(session: str) -> tuple[float, str]:
        client = held.setdefault(session, Client(port))
        began_s = time.monotonic()
        code, answer = await client.ask("POST", f"/sessions/{session}/epochs", body)
        assert code == 200, answer
        return time.monotonic() - began_s, json.loads(answer)["fixes"][-1]["status"]

    began_s = time.monotonic()
    found = await spread(one, ids)
    took_s, wall_s = sorted(seconds for seconds, _ in found), time.monotonic() - began_s
    statuses = [status for _, status in found]
    sys.stderr.write(f"{len(ids)} sessions: {wall_s:.1f} s\n")
    return {
        "wall_s": wall_s,
        "median_s": statistics.median(took_s),
        "p99_s": took_s[int(0.99 * len(took_s))],
        "statuses": {one: statuses.count(one) for one in sorted(set(statuses))},
    }


async def faults(port: int, ids: list[str]) -> dict:
    """Slow, cut and hostile clients beside an honest one; it must not notice."""
    found: dict[str, object] = {}
    slow = [socket.create_connection(("127.0.0.1", port)) for _ in range(100)]
    for index, one in enumerate(slow):
        path = f"/sessions/{ids[index % len(ids)]}/events"
        if index % 2:
            one.sendall(b"POST /sessions HTTP/1.1\r\nHost: local")
        else:
            one.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    for _ in range(200):
        _, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(b"POST /sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99\r\n\r\n{")
        writer.transport.abort()
    codes: dict[int, int] = {}
    client = Client(port)
    for body in HOSTILE * 20:
        code, _ = await client.ask("POST", f"/sessions/{ids[0]}/epochs", body)
        codes[code] = codes.get(code, 0) + 1
    found["hostile_codes"] = codes
    code, _ = await Client(port).ask("POST", "/sessions", b" " * 1_100_000)
    found["huge_code"] = code
    took = []
    for _ in range(200):
        began_s = time.monotonic()
        assert (await client.ask("GET", f"/sessions/{ids[0]}"))[0] == 200
        took.append(time.monotonic() - began_s)
    found["honest_median_ms"] = 1000 * statistics.median(took)
    found["honest_worst_ms"] = 1000 * max(took)
    for one in slow:
        one.close()
    return found


def city(folder: Path) -> tuple[Path, list[dict]]:
    """A made city with its database, and the epochs of a walk in it."""
    from mapfilter.positioning.merging import epochs
    from mapfilter.tracks.store import read_log
    from mapfilter.workflows.demo import run_demo

    run_demo(folder, ("output.pictures=none",))
    log = read_log(next((folder / "journeys").iterdir()))
    sent = []
    for epoch in epochs(log):
        motion = [{"step_m": m.step_m, "heading_rad": m.heading_rad} for m in epoch.motion]
        rows = [
            {k: v for k, v in (("role", r.role), ("cell", r.cell), ("arfcn", r.arfcn),
             ("bsic", r.bsic), ("level_dbm", r.level_dbm)) if v is not None and v == v}
            for r in epoch.radio
        ]  # fmt: skip
        sent.append({"time_s": epoch.time_s, "motion": motion, "radio": rows})
    return folder / "database", sent


def body_of(sent: list[dict], first: int, last: int) -> bytes:
    """Return the body of a request with some epochs."""
    return json.dumps({"epochs": sent[first:last]}).encode()


async def measure(count: int, folder: Path, database: Path, sent: list[dict]) -> dict:
    """Run all parts, and return the figures."""
    served = Served(database, folder, "--save-every", "5")
    try:
        found, states, tracked = await loaded(served, count, sent)
    finally:
        served.end(signal.SIGKILL)
    again = Served(database, folder)
    try:
        found["restart_s"] = again.seconds
        _, data = await Client(again.port).ask("GET", "/sessions")
        restored = {one["id"]: one for one in json.loads(data)["sessions"]}
        found["lost_by_kill"] = sum(
            restored.get(key, {}).get("epochs") != one["epochs"] for key, one in states.items()
        )
        found["after_restart"] = await round_of(again.port, tracked, body_of(sent, 235, 236), {})
    finally:
        code, said = again.end(signal.SIGTERM)
    found["end"] = {"code": code, "said": said.splitlines()[-1]}
    return found


async def loaded(
    served: Served, count: int, sent: list[dict]
) -> tuple[dict, dict[str, dict], list[str]]:
    """Begin sessions and post to them; return figures, all that is saved, and who has tracked."""
    found: dict[str, object] = {"start_s": served.seconds, "empty_mib": served.memory_mib()}
    began_s = time.monotonic()
    ids = await begin(served.port, count)
    found["begin_s"] = time.monotonic() - began_s
    held: dict[str, Client] = {}
    for name, first, last in (("first", 0, 1), ("searching", 1, 5)):
        found[name] = await round_of(served.port, ids, body_of(sent, first, last), held)
        found[f"{name}_mib"] = served.memory_mib()
    tracked = ids[: max(1, count // 10)]
    before_s = served.cpu_s()
    found["walk"] = await round_of(served.port, tracked, body_of(sent, 5, 205), held)
    found["walk_epochs_per_cpu_s"] = 200 * len(tracked) / (served.cpu_s() - before_s)
    found["walk_mib"] = served.memory_mib()
    before_s = served.cpu_s()
    found["tracking"] = await round_of(served.port, tracked, body_of(sent, 205, 235), held)
    found["tracking_epochs_per_cpu_s"] = 30 * len(tracked) / (served.cpu_s() - before_s)
    found["faults"] = await faults(served.port, ids)
    await asyncio.sleep(1)
    states: dict[str, dict] = {}
    began_s = time.monotonic()
    while time.monotonic() < began_s + 300:
        _, data = await Client(served.port).ask("GET", "/sessions")
        states = {one["id"]: one for one in json.loads(data)["sessions"]}
        if all(one["saved_time_s"] == one["time_s"] for one in states.values()):
            break
        await asyncio.sleep(1)
    found["all_saved_after_s"] = time.monotonic() - began_s
    return found, states, tracked


def main() -> int:
    """Run, print the figures, and return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--sessions", type=int, default=1000)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        database, sent = city(folder / "city")
        found = asyncio.run(measure(given.sessions, folder / "sessions", database, sent))
    sys.stdout.write(json.dumps(found, indent=1) + "\n")
    hostile = found["faults"]
    right = found["lost_by_kill"] == 0 and found["end"]["code"] == 0
    return 0 if right and set(hostile["hostile_codes"]) == {400} else 1


if __name__ == "__main__":
    sys.exit(main())
