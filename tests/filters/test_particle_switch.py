"""When the particle filter switches, refuses and draws anew: particles at two places."""

import pickle
from dataclasses import dataclass, replace
from math import log, nan

import numpy as np
import pytest

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.copies import Copies
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief, ParticleFilter, ParticleOptions


@dataclass(frozen=True)
class Two:
    """Particles at two places far apart; readings weigh the first one."""

    believable: bool = True

    @property
    def bins(self):
        return Bins.over((0.0, 0.0, 400.0, 10.0))

    def start(self, prior, most, rng):  # noqa: ARG002
        state = np.zeros((3, most), dtype=np.float32)
        state[0, most // 2 :] = 300.0
        return Cloud(state, np.empty((0, most), "f4")), np.full(most, float(prior))

    def move(self, state, log_weight, motion, key):  # noqa: ARG002
        return state + np.float32(1.0), log_weight

    def weigh(self, cloud, log_weight, reading):
        if reading is None:
            return cloud, Reason.NO_READING
        log_weight[cloud.state[0] < 150.0] += reading
        return cloud, Reason.USED

    def can_converge(self, summary, reading):  # noqa: ARG002
        return self.believable


STILL = {"jitter": (0.0,), "searching_jitter": (0.0,)}


def updated(reading, **given):
    options = ParticleOptions(
        **STILL | {"max_particles": 64, "min_search_particles": 64, "min_particles": 4} | given
    )
    filter_, rng = ParticleFilter(Two(), options), np.random.default_rng(0)
    return filter_.update(filter_.init(0.0, rng), reading, rng)


def test_particles_are_drawn_anew_where_too_few_carry_the_weight():
    def kept(log_gain, below):
        after, info = updated(log_gain, mass_exponent=1.0, resample_below=below)
        assert info.hypotheses == after.log_weight.size == 64
        return not np.allclose(after.log_weight, -log(64))

    # Weights of 2 and 1: 32² · 3² / (32 · 5) = 57.6 of 64 are effective, nine tenths.
    assert kept(log(2.0), 0.89)
    assert not kept(log(2.0), 0.91)
    # All alike are 64 of 64: no fewer than any share.
    assert updated(0.0, mass_exponent=1.0, resample_below=0.999)[0].weight[0] == 1 / 64


def test_by_flattened_weights_more_particles_count():
    """Masses of 2/3 and 1/3 have roots whose shares are 0.586 and 0.414."""
    root = np.sqrt([2 / 3, 1 / 3])
    share = root / root.sum() / 32
    effective = 1 / (32 * share**2).sum() / 64
    assert effective == pytest.approx(0.9714, abs=1e-4)
    for below, drawn in ((0.97, False), (0.973, True)):
        after, _ = updated(log(2.0), mass_exponent=0.5, resample_below=below)
        copies = np.count_nonzero(after.state[0] < 150.0)
        assert abs(copies - 64 * 32 * share[0]) <= 1 if drawn else copies == 32
        mass = after.weight[after.state[0] < 150.0].sum()
        assert mass == pytest.approx(2 / 3, rel=0.03 if drawn else 1e-5)


class Withholding(Two):
    """Part of the log evidence is not in the weights."""

    def weigh(self, cloud, log_weight, reading):
        cloud, reason = super().weigh(cloud, log_weight, reading)
        return cloud._replace(withheld=-3.0), reason


def test_log_evidence_that_is_withheld_counts():
    filter_, rng = ParticleFilter(Withholding(), ParticleOptions(**STILL)), np.random.default_rng(0)
    once, _ = filter_.update(filter_.init(0.0, rng), log(0.5), rng)
    assert once.log_evidence == pytest.approx(log(0.75) - 3.0, abs=1e-5)
    twice, _ = filter_.update(once, 0.0, rng)
    assert twice.log_evidence == pytest.approx(log(0.75) - 6.0, abs=1e-5)


def test_the_number_of_particles_follows_the_bins_that_are_covered():
    # Two bins of one half each: ten for each of two bins.
    after, info = updated(0.0, mass_exponent=1.0, min_search_particles=4, particles_per_bin=10.0)
    assert (after.state.shape, info.hypotheses) == ((3, 20), 20)
    # Half of what there is is not drawn anew: 32 wanted of 64.
    assert (
        updated(0.0, mass_exponent=1.0, min_search_particles=4, particles_per_bin=16.0)[
            1
        ].hypotheses
        == 64
    )
    assert (
        updated(0.0, mass_exponent=1.0, min_search_particles=4, particles_per_bin=15.6)[
            1
        ].hypotheses
        == 31
    )
    assert (
        updated(0.0, mass_exponent=1.0, min_search_particles=9, particles_per_bin=0.1)[1].hypotheses
        == 9
    )
    # Once it has converged the least number counts.
    options = {
        "switch_mass": 0.4,
        "switch_hold_m": 0.0,
        "mass_exponent": 1.0,
        "particles_per_bin": 0.1,
    }
    after, info = updated(0.0, **options)
    assert (info.status, info.hypotheses) == (Status.CONVERGED, 4)
    assert after.status is Status.CONVERGED
    assert after.agreement_start_m == 0.0
    # What it says is said before it is drawn anew.
    assert after.summary.mass_50m == pytest.approx(0.5)


def test_which_jitter_parts_copies():
    given = {
        "mass_exponent": 1.0,
        "particles_per_bin": 5.0,
        "min_search_particles": 4,
        "jitter": (0.0, 2.0),
        "searching_jitter": (0.0, 0.0, 3.0),
    }
    searching, _ = updated(0.0, **given)
    assert searching.state[1].tolist() == [0.0] * 10
    assert searching.state[2].std() > 1.0
    found, info = updated(0.0, **given, switch_mass=0.4, switch_hold_m=0.0)
    assert info.status is Status.CONVERGED
    assert found.state[2].tolist() == [0.0] * 10
    assert found.state[1].std() > 0.6


class Remembering(Two):
    """Keeps where each particle stands, and counts readings for all of them."""

    def weigh(self, cloud, log_weight, reading):
        cloud, reason = super().weigh(cloud, log_weight, reading)
        kept = np.stack([cloud.state[0], log_weight.astype("f4")])
        return cloud._replace(kept=kept, shared=(cloud.shared or 0) + 1), reason

    def can_converge(self, summary, reading):  # noqa: ARG002
        return reading < 1.0


@pytest.mark.parametrize("mass_exponent", [0.5, 1.0])
def test_what_particles_keep_goes_with_them_when_they_are_drawn_anew(mass_exponent):
    options = ParticleOptions(
        **STILL, max_particles=64, min_search_particles=40, min_particles=4, resample_below=0.99,
        particles_per_bin=1e-3, mass_exponent=mass_exponent,
    )  # fmt: skip
    filter_, rng = ParticleFilter(Remembering(), options), np.random.default_rng(0)
    start = filter_.init(0.0, rng)
    after, info = filter_.update(start, 2.0, rng)
    assert info.hypotheses == 40
    assert after.kept.shape == (2, 40)
    np.testing.assert_array_equal(after.kept[0], after.state[0])
    assert set(after.kept[0].tolist()) == {0.0, 300.0}
    # The logarithm of the weight before: two more at the first place.
    gain = np.where(after.state[0] < 150.0, 2.0, 0.0)
    np.testing.assert_allclose(after.kept[1], gain + start.log_weight[0], rtol=1e-6)
    assert (start.shared, after.shared) == (None, 1)
    moved, _ = filter_.predict(after, MotionStep(1.0, 0.0), rng)
    assert moved.kept is after.kept
    assert filter_.update(moved, 2.0, rng)[0].shared == 2
    # Where no particle is left, what was kept before stays.
    none = replace(moved, log_weight=np.full(40, -np.inf))
    after, info = filter_.update(none, 0.5, rng)
    assert (after, info.reason) == (none, Reason.NO_CANDIDATES_LEFT)


def test_a_belief_may_be_kept_from_converging_by_a_reading():
    options = ParticleOptions(
        **STILL, max_particles=64, min_search_particles=64, min_particles=4, switch_mass=0.4,
        switch_hold_m=0.0,
    )  # fmt: skip
    filter_, rng = ParticleFilter(Remembering(), options), np.random.default_rng(0)
    start = filter_.init(0.0, rng)
    statuses = [filter_.update(start, told, rng)[1].status for told in (0.9, 1.1)]
    assert statuses == [Status.CONVERGED, Status.SEARCHING]


@pytest.mark.parametrize(
    ("split_mass", "status"), [(0.49, Status.TRACKING), (0.52, Status.SEARCHING)]
)
def test_a_belief_that_splits_searches_again(split_mass, status):
    options = ParticleOptions(
        **STILL, max_particles=64, min_search_particles=64, min_particles=64, switch_mass=0.9,
        switch_hold_m=0.0, split_mass=split_mass, mass_exponent=1.0, resample_below=1e-9,
    )  # fmt: skip
    filter_, rng = ParticleFilter(Two(), options), np.random.default_rng(0)
    found, info = filter_.update(filter_.init(0.0, rng), log(99.0), rng)
    assert info.status is Status.CONVERGED
    # The same evidence against the first place: one half each.
    split, info = filter_.update(found, -log(99.0), rng)
    assert split.summary.mass_50m == pytest.approx(0.5, abs=1e-5)
    assert info.status is split.status is status
    assert np.isnan(split.agreement_start_m) == (status is Status.SEARCHING)


def test_particles_without_any_weight():
    filter_, rng = (
        ParticleFilter(Two(), ParticleOptions(max_particles=8, min_particles=4)),
        np.random.default_rng(0),
    )
    start = filter_.init(-np.inf, rng)
    np.testing.assert_allclose(start.log_weight, -log(8))
    after, info = filter_.update(replace(start, log_weight=np.full(8, -np.inf)), 0.0, rng)
    assert (info.reason, info.hypotheses) == (Reason.NO_CANDIDATES_LEFT, 8)
    assert after.log_weight[0] == -np.inf
    same, info = filter_.update(start, None, rng)
    assert same is start
    assert (info.reason, info.status, info.hypotheses) == (Reason.NO_READING, Status.SEARCHING, 8)
    empty = replace(start, state=start.state[:, :0], log_weight=np.empty(0))
    assert np.isnan(filter_.locate(empty).east_m)
    for motion, why in (
        (MotionStep(nan, 0.0), Reason.NO_STEP),
        (MotionStep(0.0, nan), Reason.NO_HEADING),
        (MotionStep(0.0, 1.0), Reason.USED),
    ):
        same, reason = filter_.predict(start, motion, rng)
        assert same is start
        assert reason is why
    moved, reason = filter_.predict(start, MotionStep(-2.0, nan), rng)
    assert (moved.travelled_m, reason) == (2.0, Reason.NO_HEADING)
    assert set(vars(pickle.loads(pickle.dumps(moved)))) == set(type(moved).__dataclass_fields__)


def test_copies_of_what_particles_keep_are_made_when_they_are_read():
    options = ParticleOptions(
        **STILL, max_particles=64, min_search_particles=40, min_particles=4, resample_below=0.99,
        particles_per_bin=1e-3,
    )  # fmt: skip
    filter_, rng = ParticleFilter(Remembering(), options), np.random.default_rng(0)
    after, _ = filter_.update(filter_.init(0.0, rng), 2.0, rng)
    copies = after.kept_unread
    assert isinstance(copies, Copies)
    moved, _ = filter_.predict(after, MotionStep(1.0, 0.0), rng)
    assert moved.kept_unread is after.cloud.kept is copies
    # Whoever stores a belief stores an array.
    stored = pickle.loads(pickle.dumps(after))
    assert isinstance(stored.kept_unread, np.ndarray)
    for belief in (after, moved, stored, replace(moved, travelled_m=9.0)):
        np.testing.assert_array_equal(belief.kept, copies.made())
        assert belief.kept is belief.kept_unread
    # The summary before resampling is not that of the copies.
    assert repr(stored.summary) == repr(after.summary) != repr(replace(after).summary)
    with pytest.raises(TypeError, match="kept"):
        ParticleBelief(after.state, after.log_weight, after.bins)
