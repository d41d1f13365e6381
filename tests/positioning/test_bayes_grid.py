"""The particle filter against the exact one on a grid: the same model, two ways to sum."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS, WALK, make_plan, truth

from mapfilter.filters.particle import ParticleOptions
from mapfilter.models.level_errors import LevelErrors
from mapfilter.models.street_motion import MotionErrors
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.sources.evidence_options import EvidenceOptions
from mapfilter.positioning.merging import epochs
from mapfilter.tracks.log import make_log

# Wide enough that a pixel of 5 m resolves what one step adds.
ERRORS = MotionErrors(
    step_sd_m=4.0, typical_step_m=5.0, heading_sd_rad=0.7, bias_sd_rad=0.08,
    bias_drift_rad_per_sqrt_m=0.004, scale_sd=0.0, white_share=1.0, stretch_sd=0.0,
    disturbances_per_m=0.0, remounts_per_m=0.0, rate_share=0.0,
)  # fmt: skip
COARSE_M, FINE_M = 50.0, 25.0


@pytest.fixture(scope="module")
def log():
    """Every fourth second of the walk: 5 m steps, with the levels of both cells."""
    time_s, east, north, _ = (column[::4] for column in (*truth(WALK)[:3], truth(WALK)[0]))
    step = np.hypot(np.diff(east), np.diff(north))
    heading = np.arctan2(np.diff(north), np.diff(east))
    cells = make_plan().cells[:2]
    level = np.array([[-50 - 0.1 * np.hypot(e - c.east_m, n - c.north_m) for c in cells]
                      for e, n in zip(east, north, strict=True)])  # fmt: skip
    best = level.argmax(axis=1)
    rows = [
        {"time_s": t, "role": "serving" if k == b else "neighbour", "cell": cells[k].id,
         "level_dbm": float(row[k])}
        for t, row, b in zip(time_s, level, best, strict=True) for k in (b, 1 - b)
    ]  # fmt: skip
    motion = pd.DataFrame({"time_s": time_s[1:], "step_m": step, "heading_rad": heading})
    return make_log(CRS, motion=motion, radio=pd.DataFrame(rows))


def positioner(area, *, grid, count=100_000):
    # What a report counts must not depend on the number of particles.
    levels = LevelErrors(white_db=6.0)
    evidence = EvidenceOptions(levels=levels, spacing_m=4.0, beside_db=0.0)
    model = BayesModel(area, ERRORS, MapWeights(), evidence=evidence, remember=False)
    options = ParticleOptions(
        max_particles=count,
        min_search_particles=count,
        min_particles=count,
        mass_exponent=1.0,
        jitter=(0.0,) * 8,
        searching_jitter=(0.0,) * 8,
    )
    return BayesPositioner(model, options, grid=grid)


def blocks(belief, side_m):
    """Mass by squares."""
    edges = np.arange(-25, 475, side_m)
    place = belief.state[0], belief.state[1]
    return np.histogram2d(*place, bins=(edges, edges), weights=belief.weight)[0]


def beliefs(positioner, log, side_m, seed=0, count=30):
    """Squares of mass after every tenth epoch."""
    rng, track, found = np.random.default_rng(seed), positioner.begin(), []
    for index, epoch in enumerate(epochs(log)[:count]):
        track, _ = positioner.step(track, epoch, rng)
        if index % 10 == 9:
            found.append(blocks(track.belief, side_m))
    return found


def variation(a, b):
    """Total variation distance."""
    return 0.5 * np.abs(a - b).sum()


def without_headings(log):
    """Three steps of 5 m, of which it is not known where to."""
    motion = log.motion.copy()
    motion.loc[11:13, ["heading_rad", "turn_rad"]] = np.nan
    return replace(log, motion=motion)


@pytest.mark.parametrize("change", [lambda log: log, without_headings])
def test_particles_agree_with_the_grid(area, log, change):
    log = change(log)
    exact = beliefs(positioner(area, grid=True), log, COARSE_M)
    for sampled, summed in zip(
        beliefs(positioner(area, grid=False), log, COARSE_M), exact, strict=True
    ):
        assert summed.sum() == pytest.approx(1.0, abs=1e-3)
        assert variation(sampled, summed) <= 0.02


@pytest.mark.long
def test_the_error_falls_with_the_root_of_the_number(area, log):
    reference = beliefs(positioner(area, grid=False, count=1_000_000), log, FINE_M, count=10)[-1]

    def error(count):
        some = positioner(area, grid=False, count=count)
        found = [beliefs(some, log, FINE_M, seed, count=10)[-1] for seed in range(40)]
        return np.mean([variation(one, reference) for one in found])

    assert error(1000) / error(4000) == pytest.approx(2.0, rel=0.1)
