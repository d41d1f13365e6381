"""``python -m tests.fuzz``: mutations over all readers, with counts; it goes on where it stopped.

Each batch runs in a process of its own, so that a crash or a hang of a library costs one batch, is
counted and can be repeated: the same reader and batch give the same copies.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import signal
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any

from fuzz import fuzz
from fuzz_readers import Target, targets

BATCH = 1000
_MEMORY = Path("/dev/shm")
"""Where it is there, copies are written to it: a file system in memory."""
_LONGEST_BATCH_S = 1200.0
"""Of processor time."""
_WAITING_S = 300.0
"""A child that has used no processor time for so long waits for ever."""
_KEYS = ("read", "refused", "longest_s")


def main(arguments: list[str] | None = None) -> int:
    """Run batches in turn over the readers until each had its share; return 1 for faults."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument(
        "--mutations", type=int, default=1_000_000, help="in all, with earlier ones"
    )
    parser.add_argument("--out", type=Path, default=Path("fuzz.json"), help="counts, by reader")
    parser.add_argument("--only", default="", help="readers whose names contain this")
    parser.add_argument("--batch", type=int, default=BATCH)
    given = parser.parse_args(arguments)
    counts: dict[str, Any] = json.loads(given.out.read_text()) if given.out.exists() else {}
    within = _MEMORY if _MEMORY.is_dir() else None
    with tempfile.TemporaryDirectory(prefix="mapfilter-fuzz-", dir=within) as folder:
        every = [one for one in targets(Path(folder)) if given.only in one.name]
        for one in every:
            one.read(one.path)
        samples = {one.name: one.path.read_bytes() for one in every}
        batches = -(-given.mutations // (given.batch * len(every)))
        for number in range(batches):
            for target in every:
                known = counts.setdefault(target.name, _nothing())
                if known["batches"] > number:
                    continue
                _add(known, number, _apart(target, samples[target.name], number, given.batch))
                _keep(given.out, counts)
    return report(counts)


def report(counts: dict[str, Any]) -> int:
    """Print a line for each reader, and the sum; return 1 where there are faults."""
    faults = 0
    for name, known in sorted(counts.items()):
        faults += len(known["faults"])
        of = f"{known['read']} read, {known['refused']} refused, {known['longest_s']:.3g} s at most"
        say(f"{name:32s} {of}, {len(known['faults'])} faults")
        for fault in known["faults"]:
            say(f"    batch {fault['batch']}: {fault['what'].splitlines()[-1]}")
    done = sum(known["read"] + known["refused"] for known in counts.values())
    say(f"{done} mutations over {len(counts)} readers, {faults} faults")
    return int(faults > 0)


def say(line: str) -> None:
    sys.stdout.write(line + "\n")


def _nothing() -> dict[str, Any]:
    return {"batches": 0, "read": 0, "refused": 0, "longest_s": 0.0, "faults": []}


def _add(known: dict[str, Any], number: int, found: dict[str, Any]) -> None:
    known["batches"] = number + 1
    if "fault" in found:
        known["faults"].append({"batch": number, "what": found["fault"]})
        return
    known["read"] += found["read"]
    known["refused"] += found["refused"]
    known["longest_s"] = max(known["longest_s"], found["longest_s"])


def _keep(path: Path, counts: dict[str, Any]) -> None:
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    temporary.write_text(json.dumps(counts, indent=1))
    temporary.replace(path)


def _apart(target: Target, sample: bytes, number: int, count: int) -> dict[str, Any]:
    """Run a batch in a child; its end without an answer is a fault, too."""
    fork = multiprocessing.get_context("fork")
    answers, answer = fork.Pipe(duplex=False)
    child = fork.Process(target=_batch, args=(target, sample, number, count, answer))
    child.start()
    answer.close()
    found: dict[str, Any] = {}
    if _answered(answers, child.pid):
        try:
            found = answers.recv()
        except EOFError:
            child.join()
            code = child.exitcode or 0
            what = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            found = {"fault": f"the process ended: {what}"}
    else:
        found = {"fault": f"no answer after {_used_s(child.pid):.0f} s of processor time"}
        child.kill()
    child.join()
    target.path.write_bytes(sample)
    return found


def _answered(answers: Any, pid: int) -> bool:
    """Wait for a child's answer, as long as it is at work."""
    used_s, since_s = 0.0, time.monotonic()
    while not answers.poll(5.0):
        now_s = _used_s(pid)
        if now_s > _LONGEST_BATCH_S:
            return False
        if now_s > used_s:
            used_s, since_s = now_s, time.monotonic()
        elif time.monotonic() - since_s > _WAITING_S:
            return False
    return True


def _used_s(pid: int) -> float:
    """Return a process's processor time; elsewhere than under Linux, the time of the clock."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return time.monotonic()
    user, system = fields[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def _batch(target: Target, sample: bytes, number: int, count: int, answer: Any) -> None:
    def read(data: bytes) -> None:
        target.path.write_bytes(data)
        target.read(target.path)

    try:
        tally = fuzz(sample, read, count, seed=number)
        found = {key: getattr(tally, key) for key in _KEYS}
    except BaseException:
        found = {"fault": traceback.format_exc()[-4000:]}
    answer.send(found)
    answer.close()
