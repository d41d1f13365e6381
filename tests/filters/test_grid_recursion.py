"""The grid filter against a forward recursion over every state of a tiny grid."""

from dataclasses import dataclass, field
from itertools import product
from math import cos, exp, log, nan, sin

import numpy as np
import pytest
import scalar_oracle as oracle

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.grid import GridFilter
from mapfilter.filters.grid_transport import Spread, Transport, Waiting
from mapfilter.filters.hypotheses import Bins

ROWS, COLS, PIXEL_M = 4, 5, 10.0
BIAS_RAD = np.array([-0.6, 0.0, 0.6])
STATES = list(product(range(2), range(3), range(ROWS), range(COLS)))
"""Mode (0 on the map, 1 off it), bin of the heading error, row and column."""
LEAVE, COME_BACK, OFF, SD_RIGHT, SD_DOWN, TURNED = 0.15, 0.3, 0.8, 0.35, 0.55, 0.6
RNG = np.random.default_rng(8)
ON = RNG.uniform(0.3, 1.0, (ROWS, COLS))
PRIOR = RNG.dirichlet(np.ones(len(STATES))).reshape(2, 3, ROWS, COLS)
LIKELIHOOD = RNG.uniform(0.1, 1.0, (2, 3, ROWS, COLS))
"""Of two readings, for each bin of the heading error."""


@dataclass(frozen=True)
class Tiny:
    """A made model; nothing of it is smooth, so that a wrong index is seen."""

    circular: bool = False
    asked: list = field(default_factory=list)

    @property
    def bins(self):
        return Bins.over((0.0, 0.0, COLS * PIXEL_M, ROWS * PIXEL_M))

    @property
    def bias_rad(self):
        return BIAS_RAD

    def placed(self, device):
        assert device.is_host
        return self

    def start(self, prior):  # noqa: ARG002
        return PRIOR[0].astype(np.float32), PRIOR[1].astype(np.float32)

    def states(self, row, col, bias_rad, off):
        state = np.zeros((6, row.size), dtype=np.float32)
        state[0], state[1] = (col + 0.5) * PIXEL_M, (ROWS - row - 0.5) * PIXEL_M
        state[2], state[3] = bias_rad, off
        return state

    def transport(self, east_m, north_m, length_m, spread_m2, turned_rad2):
        self.asked.append((east_m, north_m, length_m, spread_m2, turned_rad2))
        way = [displaced(b, east_m, north_m) for b in range(3)]
        right, down = np.array(way).T
        return Transport(
            right,
            down,
            np.full(3, SD_RIGHT),
            np.full(3, SD_DOWN),
            TURNED,
            ON.astype(np.float32),
            OFF,
            LEAVE,
            COME_BACK,
        )

    def spread(self, aside_m, aside_m2):
        self.asked.append((aside_m, aside_m2))
        return Spread(1.0, ON.astype(np.float32), OFF, LEAVE, COME_BACK)

    def weigh(self, cloud, log_weight, reading):
        if reading is None:
            return cloud, Reason.NO_READING
        for i, (east_m, north_m, bias_rad) in enumerate(cloud.state[:3].T):
            row, col = oracle.pixel_of(float(east_m), float(north_m), PIXEL_M, ROWS, COLS)
            b = int(np.argmin(np.abs(BIAS_RAD - bias_rad)))
            log_weight[i] += log(LIKELIHOOD[reading][b, row, col])
        return cloud._replace(shared=reading), Reason.USED

    def can_converge(self, summary, reading):  # noqa: ARG002
        return True


def displaced(b, east_m, north_m):
    """Pixels to the right and down by a displacement under a bin's heading error."""
    angle, length_m = np.arctan2(north_m, east_m) + BIAS_RAD[b], np.hypot(east_m, north_m)
    return length_m * cos(angle) / PIXEL_M, -length_m * sin(angle) / PIXEL_M


def transition(east_m, north_m, *, circular):
    """Probability of each state after each; what leaves the lattice is lost."""
    mode = [[1 - LEAVE, LEAVE], [COME_BACK, 1 - COME_BACK]]
    turn = oracle.three_taps(0.0, TURNED**2)
    matrix = np.zeros((len(STATES), len(STATES)))
    for i, (m, b, row, col) in enumerate(STATES):
        right_px, down_px = displaced(b, east_m, north_m)
        right, down = (
            oracle.three_taps(right_px, SD_RIGHT**2),
            oracle.three_taps(down_px, SD_DOWN**2),
        )
        for j, (m2, b2, row2, col2) in enumerate(STATES):
            turns = [k for k in turn if (b + k - b2) % 3 == 0] if circular else [b2 - b]
            turned = sum(turn.get(k, 0.0) for k in turns)
            way = right.get(col2 - col, 0.0) * down.get(row2 - row, 0.0)
            matrix[i, j] = mode[m][m2] * turned * way
    return matrix


def likelihood(reading):
    gain = [ON[row, col] if m == 0 else OFF for m, _, row, col in STATES]
    told = [LIKELIHOOD[reading][b, row, col] for _, b, row, col in STATES]
    return [g * t for g, t in zip(gain, told, strict=True)]


STEPS = [((8.0, 3.0), 0), ((-4.0, 12.0), 1), ((1.0, -9.0), 1), ((-11.0, -2.0), 0)]


@pytest.mark.parametrize("circular", [False, True])
def test_belief_and_log_evidence_are_those_of_the_recursion(circular):
    steps = [(transition(*way, circular=circular), likelihood(told)) for way, told in STEPS]
    beliefs, log_evidence = oracle.forward(PRIOR.ravel(), steps)
    filter_, rng = GridFilter(Tiny(circular)), np.random.default_rng(0)
    belief = filter_.init(None, rng)
    for (way, told), expected in zip(STEPS, beliefs, strict=True):
        motion = MotionStep(float(np.hypot(*way)), float(np.arctan2(way[1], way[0])))
        belief, _ = filter_.predict(belief, motion, rng)
        belief, info = filter_.update(belief, told, rng)
        assert info.reason is Reason.USED
        found = np.stack([belief.on, belief.off])
        np.testing.assert_allclose(found.ravel(), expected, rtol=2e-4, atol=1e-8)
    assert belief.log_evidence == pytest.approx(log_evidence, abs=2e-5)


def test_the_hypotheses_are_the_pixels_with_their_probability_of_being_off():
    belief = GridFilter(Tiny()).init(None, np.random.default_rng(0))
    expected = {}
    for b, row, col in product(range(3), range(ROWS), range(COLS)):
        on, off = PRIOR[:, b, row, col]
        place = (round((col + 0.5) * PIXEL_M), round((ROWS - row - 0.5) * PIXEL_M), b)
        expected[place] = (on + off, off / (on + off))
    assert belief.weight.size == len(expected)
    for (east_m, north_m, bias_rad, off, *_), weight in zip(
        belief.state.T, belief.weight, strict=True
    ):
        b = int(np.argmin(np.abs(BIAS_RAD - bias_rad)))
        assert (weight, off) == pytest.approx(expected[round(east_m), round(north_m), b], rel=1e-5)


def test_the_model_weighs_pixels_with_their_probability_of_being_off_and_shares_its_memory():
    given = []

    class Curious(Tiny):
        def weigh(self, cloud, log_weight, reading):
            given.append(cloud)
            return super().weigh(cloud, log_weight, reading)

        def can_converge(self, summary, reading):
            given.append(reading)
            return super().can_converge(summary, reading)

    filter_, rng = GridFilter(Curious()), np.random.default_rng(0)
    belief, _ = filter_.update(filter_.init(None, rng), 1, rng)
    cloud = given[0]
    on, off = PRIOR.reshape(2, -1)
    np.testing.assert_allclose(cloud.state[3], off / (on + off), rtol=1e-5)
    assert (cloud.kept.shape, cloud.shared) == ((0, 3 * ROWS * COLS), None)
    assert belief.shared == 1
    assert filter_.predict(belief, MotionStep(1.0, 0.0), rng)[0].shared == 1
    # The switch rule may depend on the reading; it is asked where the mass agrees only.
    assert given[1:] in ([], [1])


def test_steps_wait_for_a_reading_and_are_summed():
    model, rng = Tiny(), np.random.default_rng(0)
    filter_ = GridFilter(model)
    belief = filter_.init(None, rng)
    for motion in (MotionStep(3.0, 0.0), MotionStep(4.0, np.pi / 2), MotionStep(-1.0, 0.0)):
        belief, _ = filter_.predict(belief, motion, rng)
    same, info = filter_.update(belief, None, rng)
    assert same is belief
    assert info.reason is Reason.NO_READING
    weighed, _ = filter_.update(belief, 1, rng)
    assert model.asked[-1] == pytest.approx((2.0, 4.0, 8.0, 0.0, 0.0))
    assert weighed.waiting == Waiting()
    assert weighed.travelled_m == belief.travelled_m == 8.0
    one = oracle.forward(PRIOR.ravel(), [(transition(2.0, 4.0, circular=False), likelihood(1))])
    np.testing.assert_allclose(np.stack([weighed.on, weighed.off]).ravel(), one[0][0], rtol=2e-4)


def test_steps_without_a_heading_wait_as_a_variance_to_all_sides():
    model, rng = Tiny(), np.random.default_rng(0)
    filter_ = GridFilter(model)
    belief, reasons = filter_.init(None, rng), []
    turned = MotionStep(4.0, nan, turned_sd_rad=0.3)
    for motion in (MotionStep(3.0, 0.0), turned, MotionStep(-2.0, nan)):
        belief, reason = filter_.predict(belief, motion, rng)
        reasons.append(reason)
    assert reasons == [Reason.USED, Reason.NO_HEADING, Reason.NO_HEADING]
    assert belief.travelled_m == 9.0
    filter_.update(belief, 1, rng)
    # The mean square of each step's distance is that of the step: a half of it on each axis.
    measured, aside = model.asked[-2:]
    assert measured == pytest.approx((3.0, 0.0, 3.0, 0.0, 0.09))
    assert aside == pytest.approx((6.0, 8.0 + 2.0))
    same, reason = filter_.predict(belief, MotionStep(0.0, nan), rng)
    assert same is belief
    assert reason is Reason.NO_HEADING


def test_a_reading_without_motion_weighs_only():
    filter_, rng = GridFilter(Tiny()), np.random.default_rng(0)
    belief, _ = filter_.update(filter_.init(None, rng), 0, rng)
    joint = PRIOR * LIKELIHOOD[0]
    assert exp(belief.log_evidence) == pytest.approx(joint.sum(), rel=1e-5)
    np.testing.assert_allclose(np.stack([belief.on, belief.off]), joint / joint.sum(), rtol=1e-4)
