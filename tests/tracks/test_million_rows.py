"""A million rows of CSV take less than 500 MB, as the documentation states."""

import json
import subprocess
import sys

import numpy as np
import pytest

ROWS = 1_000_000
READ = """
import json, re, sys
from pathlib import Path
from mapfilter.tracks.store import read_log
log = read_log(sys.argv[1])
# Of this process alone: the resident set of resource.getrusage begins with the parent's.
(peak_kb,) = re.findall(r"VmHWM:\\s+([0-9]+) kB", Path("/proc/self/status").read_text())
print(json.dumps([len(log.radio) + len(log.motion), int(peak_kb) / 1024]))
"""


def written(folder, name):
    times = np.arange(ROWS)
    if name == "motion":
        headings = [f"{0.001 * k - 3:.6f}" for k in range(6000)]
        lines = [f"{i}.0,1.4,{headings[i % 6000]}\n" for i in times.tolist()]
        head = "time_s,step_m,heading_rad\n"
    else:
        # Seven cells each second.
        roles = ["serving", *["neighbour"] * 6]
        lines = [
            f"{i // 7}.0,{roles[i % 7]},S{(i * 7919) % 300}A,-{60 + i % 50}\n"
            for i in times.tolist()
        ]
        head = "time_s,role,cell,level_dbm\n"
    (folder / f"{name}.csv").write_text(head + "".join(lines))
    (folder / "log.json").write_text(json.dumps({"crs": "EPSG:32635"}))
    return folder


@pytest.mark.skipif(sys.platform != "linux", reason="/proc tells the peak of memory")
@pytest.mark.parametrize("name", ["motion", "radio"])
def test_a_million_rows_take_less_than_500_mb(name, tmp_path):
    folder = written(tmp_path, name)
    given = [sys.executable, "-c", READ, str(folder)]
    rows, peak_mb = json.loads(subprocess.run(given, capture_output=True, check=True).stdout)
    assert rows > 0.99 * ROWS
    assert peak_mb < 500
