"""When the grid filter switches and refuses, and how mass moves: a model of five pixels."""

import pickle
from dataclasses import dataclass
from math import log, nan

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.grid import GridBelief, GridFilter
from mapfilter.filters.grid_transport import Transport, Waiting, shifted, taps, turned
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleOptions

EAST = MotionStep(7.0, 0.0)
LOG_GAIN = -2.0


@dataclass(frozen=True)
class Places:
    """Five pixels of 10 m in a row, one or more headings, and readings that weigh all alike."""

    right_px: float = 0.0
    headings: int = 1
    believable: bool = True
    turned_bins: float = 0.0

    @property
    def bins(self):
        return Bins.over((0.0, 0.0, 50.0, 10.0))

    @property
    def bias_rad(self):
        return np.arange(self.headings) * 0.1

    @property
    def circular(self):
        return False

    def start(self, prior, *_):
        mass = np.zeros((self.headings, 1, 5), dtype=np.float32)
        mass[0, 0] = prior
        return 0.75 * mass, 0.25 * mass

    def states(self, row, col, bias_rad, off):
        state = np.zeros((5, row.size), dtype=np.float32)
        state[0], state[1], state[2], state[3] = 10.0 * col + 5.0, 5.0, bias_rad, off
        return state

    def transport(self, *_):
        still = np.zeros(self.headings)
        return Transport(
            still + self.right_px,
            still,
            still,
            still,
            self.turned_bins,
            np.ones((1, 5), dtype=np.float32),
            1.0,
            0.0,
            0.0,
        )

    def weigh(self, cloud, log_weight, reading):
        log_weight += reading
        return cloud, Reason.USED

    def can_converge(self, summary, reading):  # noqa: ARG002
        return self.believable

    def placed(self, device):  # noqa: ARG002
        return self


ONE = [0.0, 0.0, 1.0, 0.0, 0.0]


def followed(filter_, prior, steps, motion=EAST):
    rng = np.random.default_rng(0)
    belief, news = filter_.init(prior, rng), []
    for _ in range(steps):
        belief, _ = filter_.predict(belief, motion, rng)
        belief, info = filter_.update(belief, LOG_GAIN, rng)
        news.append(info)
    return belief, news


def test_a_grid_switches_after_the_metres_that_it_must_hold():
    belief, news = followed(GridFilter(Places()), ONE, 5)
    # Agreed at 7 m: 14 m later it has converged.
    statuses = [info.status for info in news]
    assert statuses == [
        Status.SEARCHING,
        Status.SEARCHING,
        Status.CONVERGED,
        Status.TRACKING,
        Status.TRACKING,
    ]
    assert {info.hypotheses for info in news} == {1}
    assert belief.agreement_start_m == 7.0
    assert belief.travelled_m == 35.0
    assert belief.log_evidence == pytest.approx(5 * LOG_GAIN, abs=1e-5)
    found = GridFilter(Places()).locate(belief)
    assert (found.east_m, found.north_m) == (25.0, 5.0)


def test_a_grid_that_is_not_believed_or_spread_goes_on_searching():
    for model, prior in ((Places(believable=False), ONE), (Far(), [0.6, 0, 0, 0, 0.4])):
        _, news = followed(GridFilter(model), prior, 5)
        assert {info.status for info in news} == {Status.SEARCHING}


@pytest.mark.parametrize(
    ("split_mass", "status"), [(0.59, Status.CONVERGED), (0.61, Status.SEARCHING)]
)
def test_a_grid_that_splits_searches_again(split_mass, status):
    options = ParticleOptions(switch_mass=0.5, switch_hold_m=0.0, split_mass=split_mass)
    belief, news = followed(GridFilter(Far(), options), [0.6, 0, 0, 0, 0.4], 1)
    assert news[0].status is belief.status is status
    assert np.isnan(belief.agreement_start_m) == (status is Status.SEARCHING)


class Far(Places):
    """The same pixels a hundred metres apart."""

    @property
    def bins(self):
        return Bins.over((0.0, 0.0, 500.0, 10.0))

    def states(self, row, col, bias_rad, off):
        return super().states(row, 10 * col, bias_rad, off)


def test_a_share_of_exactly_the_switch_mass_agrees():
    options = ParticleOptions(switch_mass=0.5, switch_hold_m=0.0)
    _, news = followed(GridFilter(Far(), options), [0.5, 0, 0, 0, 0.5], 1)
    assert news[0].status is Status.CONVERGED


def test_mass_that_has_left_the_grid_is_told():
    filter_, rng = GridFilter(Places(right_px=9.0)), np.random.default_rng(0)
    belief, _ = filter_.predict(filter_.init(ONE, rng), EAST, rng)
    after, info = filter_.update(belief, LOG_GAIN, rng)
    assert after is belief
    assert (info.reason, info.status, info.hypotheses) == (
        Reason.NO_CANDIDATES_LEFT,
        Status.SEARCHING,
        0,
    )
    assert np.isnan(filter_.locate(belief).east_m)
    assert belief.summary.mass_50m == 0.0


def test_motion_of_a_grid_that_is_absent_or_nothing():
    filter_, rng = GridFilter(Places()), np.random.default_rng(0)
    start = filter_.init(ONE, rng)
    for motion, why in (
        (MotionStep(nan, 0.0), Reason.NO_STEP),
        (MotionStep(0.0, nan), Reason.NO_HEADING),
        (MotionStep(0.0, 1.0), Reason.USED),
    ):
        assert filter_.predict(start, motion, rng) == (start, why)
    assert start.moved is start
    assert (start.travelled_m, start.log_evidence, start.status) == (0.0, 0.0, Status.SEARCHING)
    assert np.isnan(start.agreement_start_m)
    assert start.waiting == Waiting()
    np.testing.assert_allclose(np.exp(start.log_weight), start.weight)
    assert start.state[3].tolist() == [0.25]


def test_one_heading_does_not_turn():
    """With one bin of the heading error nothing is lost at its sides; with more it goes there."""
    belief, _ = followed(GridFilter(Places(turned_bins=0.6)), ONE, 1)
    assert belief.log_evidence == pytest.approx(LOG_GAIN, abs=1e-5)
    belief, _ = followed(GridFilter(Places(headings=3, turned_bins=0.6)), ONE, 1)
    shares = (belief.on + belief.off).sum(axis=(1, 2))
    # The first bin of three: 0.36 / 2 go to either side, and one side is lost.
    np.testing.assert_allclose(shares, np.array([0.64, 0.18, 0.0]) / 0.82, rtol=1e-4)
    assert belief.log_evidence == pytest.approx(LOG_GAIN + log(0.82), abs=1e-5)
    belief, _ = followed(GridFilter(Places(headings=2, turned_bins=0.6)), ONE, 1)
    shares = (belief.on + belief.off).sum(axis=(1, 2))
    np.testing.assert_allclose(shares, np.array([0.64, 0.18]) / 0.82, rtol=1e-4)


def test_what_is_stored_of_a_grid_is_what_it_was_made_of():
    belief, _ = followed(GridFilter(Places()), ONE, 2)
    moved, _ = GridFilter(Places()).predict(belief, EAST, np.random.default_rng(0))
    assert moved.summary.mean[0] == 25.0
    again = pickle.loads(pickle.dumps(moved))
    assert set(vars(again)) == set(GridBelief.__dataclass_fields__)
    np.testing.assert_array_equal(again.on, moved.on)


def test_pixels_of_next_to_no_mass_are_left_out():
    prior = [1e-10, 0.0, 1.0, 3e-9, 0.0]
    filter_, rng = GridFilter(Places()), np.random.default_rng(0)
    belief = filter_.init(prior, rng)
    assert belief.weight.size == 2
    after, info = filter_.update(belief, 0.0, rng)
    assert info.hypotheses == 2
    assert after.on[0, 0, 0] == 0.0


def test_taps_by_hand():
    first, share = taps(2.25, 0.5)
    assert first == 1
    # Variance 0.25 about 2.25: square 0.3125 about 2.
    np.testing.assert_allclose(share, [0.03125, 0.6875, 0.28125], rtol=1e-6)
    first, share = taps(0.0, 1.0)
    assert (first, share.tolist()) == (-1, [0.5, 0.0, 0.5])
    first, share = taps(-3.5, 0.0)
    assert first + np.arange(3) @ share == pytest.approx(-3.5)
    for shift_px, sd_px in ((0.0, 2.0), (0.3, 1.5), (-7.6, 5.0)):
        first, share = taps(shift_px, sd_px)
        place = first + np.arange(share.size)
        # A Gaussian under a tent of two pixels, summed finely.
        fine = np.linspace(-1, 1, 4001)
        tent = (1 - np.abs(fine)) * (fine[1] - fine[0])
        narrow = sd_px**2 - 1 / 6
        off = place[:, None] + fine - shift_px
        expected = (tent * np.exp(-0.5 * off**2 / narrow)).sum(axis=1) / np.sqrt(2 * np.pi * narrow)
        np.testing.assert_allclose(share, expected, atol=1e-6)
        assert share[0] < 1e-4
        assert share[-1] < 1e-4
        assert share.sum() == pytest.approx(1.0, abs=3e-5)


@pytest.mark.parametrize("axis", [0, 1])
def test_mass_is_shifted_as_one_by_one(axis):
    rng = np.random.default_rng(1)
    mass = rng.random((4, 5)).astype(np.float32)
    for first, count in ((-6, 13), (-2, 3), (3, 2), (4, 1), (-4, 1)):
        share = rng.random(count).astype(np.float32)
        share[0] = 1e-8
        expected = np.zeros((4, 5))
        for k, tap in enumerate(share, start=first):
            for row in range(4):
                for col in range(5):
                    to = (row + k, col) if axis == 0 else (row, col + k)
                    if 0 <= to[0] < 4 and 0 <= to[1] < 5:
                        expected[to] += float(tap) * mass[row, col]
        np.testing.assert_allclose(shifted(mass, first, share, axis=axis), expected, atol=1e-6)


def test_turning_goes_around_or_ends():
    mass = np.arange(1.0, 9.0, dtype=np.float32).reshape(4, 2)
    share = np.array([0.25, 0.5, 0.125], dtype=np.float32)
    around = turned(mass, -1, share, circular=True)
    wide = np.random.default_rng(3).random(2 * len(mass) + 5).astype(np.float32)
    by_hand = sum(np.roll(mass, k - 7, axis=0) * tap for k, tap in enumerate(wide))
    np.testing.assert_allclose(turned(mass, -7, wide, circular=True), by_hand, rtol=1e-5)
    assert around.dtype == np.float32
    for b in range(4):
        from_ahead, own, from_behind = mass[(b + 1) % 4], mass[b], mass[b - 1]
        np.testing.assert_allclose(around[b], 0.25 * from_ahead + 0.5 * own + 0.125 * from_behind)
    ended = turned(mass, -1, share, circular=False)
    np.testing.assert_allclose(ended[0], 0.25 * mass[1] + 0.5 * mass[0])
    np.testing.assert_allclose(ended[3], 0.5 * mass[3] + 0.125 * mass[2])
