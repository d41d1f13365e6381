"""Motion, map and reports on a graphics processor: no hypotheses ask for none."""

import numpy as np

from mapfilter.models import cuda_motion, cuda_reports
from mapfilter.models.fingerprint import RasterFrame
from mapfilter.models.street_motion import MotionErrors
from mapfilter.models.way_map import MapWeights


def test_no_hypotheses_ask_for_no_device():
    state, none = np.empty((8, 0), np.float32), np.empty(0)
    cuda_motion.move(state, 1.0, 0.0, MotionErrors(), np.uint64(1), state)
    ways, factors = np.zeros((2, 2), np.float32), MapWeights().over(1.0)
    cuda_motion.weigh_by_ways(state, ways, 5.0, (5.0, 5.0), factors, -1.0, none)
    pixel = np.empty(0, np.int32)
    cuda_reports.pixels(state, RasterFrame(0.0, 10.0, 0.2, 2, 2), pixel)
    cuda_reports.age(state, np.ones(3, np.float32), 0.5, -2.0)
