"""A million rows of CSV: below 5 s of processor time and 500 MB, as the documentation states."""

import json
import subprocess
import sys

import numpy as np
import pytest

ROWS = 1_000_000
READ = """
import json, resource, sys, time
from mapfilter.tracks.store import read_log
began_s = time.process_time()
log = read_log(sys.argv[1])
peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
rows = len(log.radio) + len(log.motion)
print(json.dumps([rows, time.process_time() - began_s, peak_mb]))
"""


def written(folder, name):
    times = np.arange(ROWS)
    if name == "motion":
        lines = [f"{i}.0,1.4,{0.001 * (i % 6000) - 3:.6f}\n" for i in times.tolist()]
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


@pytest.mark.skipif(sys.platform != "linux", reason="the peak of memory is in kB there only")
@pytest.mark.parametrize("name", ["motion", "radio"])
def test_a_million_rows_take_below_5_s_and_500_mb(name, tmp_path):
    folder = written(tmp_path, name)
    given = [sys.executable, "-c", READ, str(folder)]
    rows, used_s, peak_mb = json.loads(
        subprocess.run(given, capture_output=True, check=True).stdout
    )
    assert rows > 0.99 * ROWS
    assert used_s < 5.0
    assert peak_mb < 500
