"""Speed and memory of reading a million rows of recordings: python benchmarks/readers.py."""

import multiprocessing
import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from mapfilter.tracks.readers.formats import read_recording

ROWS = 1_000_000
_UPLOAD = "mcc,mnc,lac,cellid,lat,lon,signal,measured_at,rating,speed,direction,act,ta,psc,tac,pci"


def rows_of(kind: str) -> str:
    """Return a million rows of one format."""
    ms = (1_777_629_600_000 + 20 * np.arange(ROWS)).tolist()
    lat = np.resize(np.char.mod("%.6f", 60.17 + 1e-6 * np.arange(1000)), ROWS).tolist()
    if kind == "upload.csv":
        rows = [
            f"244,91,3021,1170251,{y},24.94,-87,{t},6.5,2.2,30.5,LTE+,1,,3021,269"
            for t, y in zip(ms, lat, strict=True)
        ]
        return "\n".join([_UPLOAD, *rows])
    if kind == "TotalAcceleration.csv":
        rows = [f"{t}000000,{i},9.81,0.1,0.2" for i, t in enumerate(ms)]
        return "\n".join(["time,seconds_elapsed,z,y,x", *rows])
    if kind == "watch.gpx":
        stamps = np.datetime_as_string(np.array(ms, dtype="datetime64[ms]")).tolist()
        rows = [
            f'<trkpt lat="{y}" lon="24.94">\n<ele>12.5</ele>\n<time>{t}Z</time>\n</trkpt>'
            for t, y in zip(stamps, lat, strict=True)
        ]
        return "\n".join(["<gpx><trk><trkseg>", *rows, "</trkseg></trk></gpx>"])
    if kind == "00.txt":
        return "\n".join(f"1 0 0 {i}.5 0 1 0 0 0 0 1 {i}.25" for i in range(ROWS))
    if kind == "drive.nmf":
        days = (np.array(ms) // 20 + 36_000_000).astype("datetime64[ms]")
        stamps = [text[11:23] for text in np.datetime_as_string(days).tolist()]
        rows = [
            f"CELLMEAS,{t},,7,0,1,9,0,70001,1300,435,-60.6,-89.1,-10.1,302060,118.0" for t in stamps
        ]
        return "\n".join(['#START,10:00:00.000,,"1.5.2026"', *rows])
    head = "time,lat,lon,rsrp,mcc,mnc,lac,ci,technology"
    rows = [f"{t},{y},24.94,-87,244,91,3021,1170251,LTE" for t, y in zip(ms, lat, strict=True)]
    return "\n".join([head, *rows])


def write(path: Path) -> None:
    """Write a million rows of the format that the file's name tells."""
    path.write_text(rows_of(path.name))


def measure(path: Path) -> None:
    """Read one file and print what it took; in a process of its own, started by a small one."""
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began_s = time.process_time()
    recording = read_recording(path)
    took_s = time.process_time() - began_s
    grown_mb = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb) / 1024
    print(f"{path.name}: {recording.rows} rows in {took_s:.1f} CPU-s, {grown_mb:.0f} MB more")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        files = (
            "upload.csv",
            "TotalAcceleration.csv",
            "drive.csv",
            "watch.gpx",
            "00.txt",
            "drive.nmf",
        )
        for name in files:
            path = Path(folder) / name
            # A process begins with the peak of the one that started it.
            for task in (write, measure):
                process = multiprocessing.get_context("spawn").Process(target=task, args=(path,))
                process.start()
                process.join()
