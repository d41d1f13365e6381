"""The bias of a carried gyroscope, and where it is carried otherwise, with numbers by hand."""

from math import nan, pi, sqrt

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mapfilter.tracks.pdr.attitude import Attitude
from mapfilter.tracks.pdr.carried_bias import CarriedBias, bias_while_carried
from mapfilter.tracks.pdr.remounts import drifts, parted_where_remounted, swings_rad
from mapfilter.tracks.pdr.signals import Signals

HZ = 50
SPIN_DEGPS = np.array([0.0, 0.0, 20.0])
BIAS_DEGPS = np.array([0.2, -0.1, 0.15])
UP, NORTH = np.array([0.0, 0.0, 9.8]), np.array([0.0, 30.0, 0.0])
PRIOR = 1 / 0.5**2
"""Information on each axis, in (deg/s)⁻²: half a degree a second."""


def still(seconds, bias_degps=BIAS_DEGPS, force=UP, field=None, spare=0):
    """A phone that lies still, but for what its gyroscope says."""
    count = seconds * HZ + spare

    def rows(value):
        return None if value is None else np.tile(np.asarray(value, dtype=float), (count, 1))

    return Signals(np.arange(count) / HZ, rows(force), np.radians(rows(bias_degps)), rows(field))


def known(pairs):
    """Information of pairs of equal directions 15 s apart, in (deg/s)⁻².

    Each has an error of half a degree and counts twice, as it has no other; 18 in a row tell the
    same.
    """
    return pairs * 15**2 / 0.5**2 * 2 / 18


def covariance(found):
    return np.degrees(np.degrees(found.covariance))


def test_gravity_shows_the_bias_but_for_that_about_itself():
    """Of 60 means of a second 58 are means of three, and 43 have one 15 s later."""
    found = bias_while_carried([still(60)])
    shown = known(43) / (known(43) + PRIOR)
    expected = BIAS_DEGPS * [shown, shown, 0.0]
    assert np.degrees(found.bias_radps) == pytest.approx(expected, rel=1e-3, abs=1e-6)
    expected = np.diag(1 / (PRIOR + np.array([known(43), known(43), 0.0])))
    assert covariance(found) == pytest.approx(expected, rel=1e-3, abs=1e-6)
    # Less than a second at the end is left out.
    more = bias_while_carried([still(60, spare=49)])
    assert covariance(more) == pytest.approx(covariance(found), rel=1e-3, abs=1e-6)


def test_the_field_shows_the_rest():
    found = bias_while_carried([still(60, field=NORTH)])
    information = PRIOR + known(43) * np.array([2.0, 1.0, 1.0])
    assert covariance(found) == pytest.approx(np.diag(1 / information), rel=1e-3, abs=1e-6)
    assert np.degrees(found.bias_radps) == pytest.approx(BIAS_DEGPS, rel=3e-3)
    gone = bias_while_carried([still(60, field=(nan, nan, nan))])
    assert covariance(gone)[2, 2] == pytest.approx(0.25)


def test_a_minute_in_several_stretches_is_enough():
    parts = [still(30), still(19), still(11)]
    found = bias_while_carried(parts)
    # Of 28, 17 and 9 means; those of the last have none 15 s later.
    information = PRIOR + known(13 + 2)
    assert covariance(found)[0, 0] == pytest.approx(1 / information, rel=1e-3)
    # Stretches add up as if they were as good as each other.
    short = bias_while_carried([still(30), still(29)])
    assert not short.bias_radps.any()
    assert covariance(short) == pytest.approx(np.eye(3) / PRIOR)
    none = [Signals(one.time_s, one.force_mps2) for one in parts]
    assert not bias_while_carried(none).bias_radps.any()


def test_a_second_of_which_less_than_half_is_known_counts_for_nothing():
    whole = covariance(bias_while_carried([still(60, field=NORTH)]))
    parts = {}
    for missing in (25, 26):
        signals = still(60, field=NORTH)
        signals.field_ut[30 * HZ : 30 * HZ + missing, 0] = nan
        parts[missing] = covariance(bias_while_carried([signals]))
    assert parts[25] == pytest.approx(whole, rel=1e-3, abs=1e-6)
    # Three means and their pairs, before and after.
    information = PRIOR + known(43) + known(43 - 6)
    assert parts[26][0, 0] == pytest.approx(1 / information, rel=1e-3)


def test_pairs_that_are_off_count_less():
    """Gravity leans by 4.5 degrees for a second: by 1.5 in three means, of six pairs.

    That is three times their error: they count for a half, where the others count twice.
    """
    signals = still(60, (0.0, 0.0, 0.0))
    lean = np.radians(4.5)
    signals.force_mps2[30 * HZ : 31 * HZ] = 9.8 * np.array([np.sin(lean), 0.0, np.cos(lean)])
    found = bias_while_carried([signals])
    assert covariance(found)[0, 0] == pytest.approx(1 / (PRIOR + known(37 + 6 / 4)), rel=2e-3)
    assert np.degrees(found.bias_radps) == pytest.approx(np.zeros(3), abs=1e-3)


def test_large_biases_are_found_as_well():
    """Within rounds, as 60 deg in 15 s is no small turn."""
    found = bias_while_carried([still(120, (4.0, -3.0, 2.0), field=NORTH)])
    assert np.degrees(found.bias_radps) == pytest.approx([4.0, -3.0, 2.0], rel=3e-3)


def test_a_turned_phone_has_its_bias_in_its_own_axes():
    pose = Rotation.from_rotvec([0.7, -0.4, 1.1])
    signals = still(60, force=pose.inv().apply(UP), field=pose.inv().apply(NORTH))
    found = bias_while_carried([signals])
    assert np.degrees(found.bias_radps) == pytest.approx(BIAS_DEGPS, rel=3e-3)
    turned = pose.as_matrix() @ covariance(found) @ pose.as_matrix().T
    expected = np.diag(1 / (PRIOR + known(43) * np.array([2.0, 1.0, 1.0])))
    assert turned == pytest.approx(expected, rel=1e-3, abs=1e-6)


def test_what_turns_is_followed():
    """Around the vertical by 20 deg/s: gravity shows the horizontal parts in the phone's axes."""
    found = bias_while_carried([still(60, BIAS_DEGPS + SPIN_DEGPS, field=None)])
    # Of a bias that turns with the phone little is left after three quarters of a turn.
    assert covariance(found)[0, 0] > 2 / known(43)
    count = 60 * HZ
    yaw = np.radians(20.0) * (np.arange(count) + 0.5) / HZ
    pose = Rotation.from_rotvec(np.column_stack([np.zeros((count, 2)), yaw]))
    signals = still(60, BIAS_DEGPS + SPIN_DEGPS)
    signals = Signals(signals.time_s, UP + 0 * signals.force_mps2, signals.rate_radps,
                      pose.inv().apply(np.tile(NORTH, (count, 1))))  # fmt: skip
    found = bias_while_carried([signals])
    assert np.degrees(found.bias_radps) == pytest.approx(BIAS_DEGPS, abs=0.01)


def test_a_bias_acts_by_the_attitude_in_the_middle_of_each_sample():
    """Of a phone that swings about its right: the sums of its attitude over 15 s, by loops."""
    rate = np.where(np.arange(60 * HZ) // (2 * HZ) % 2, -20.0, 20.0)
    middle = np.radians(np.cumsum(rate) - rate / 2) / HZ
    nothing = 0 * middle
    pose = Rotation.from_rotvec(np.column_stack([middle, nothing, nothing]))
    signals = still(60, (0.0, 0.0, 0.0))
    signals.rate_radps[:, 0] = np.radians(rate)
    signals.force_mps2[:] = pose.inv().apply(UP)
    information, crossed_up = PRIOR * np.eye(3), np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]])
    for first in range(1, 44):
        summed = pose[first * HZ : (first + 15) * HZ].as_matrix().sum(axis=0) / HZ
        effect = crossed_up @ summed
        information += effect.T @ effect * 2 / 0.5**2 / 18
    found = bias_while_carried([signals])
    assert covariance(found) == pytest.approx(np.linalg.inv(information), rel=2e-3, abs=1e-5)


@pytest.mark.parametrize(
    ("axis", "degps", "shown"),
    [(0, 0.66, False), (0, 0.69, True), (1, -0.69, True), (2, 0.31, True)],
)
def test_a_bias_is_unusual_beyond_three_deviations_of_a_usual_one(axis, degps, shown):
    """0.1 deg/s of a usual one, and what is not known of it: 0.2 deg/s on two axes."""
    bias, spread = np.zeros(3), np.radians([0.2, 0.2, 0.0]) ** 2
    bias[axis] = np.radians(degps)
    found = CarriedBias(bias, np.diag(spread)).shown_radps
    assert found.tolist() == (bias if shown else np.zeros(3)).tolist()


def test_the_deviation_about_axes_is_the_root_of_their_mean_square():
    found = CarriedBias(np.zeros(3), np.diag([1.0, 4.0, 9.0]))
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]])
    assert found.sd_about_radps(axes) == pytest.approx(sqrt((1 + 0.36 * 4 + 0.64 * 9) / 2))


def attitude_of(to_level, section, yaw_rad=None):
    count = len(to_level)
    reference = Rotation.from_rotvec([[0.1 * k, 0.0, 0.0] for k in range(section.max() + 1)])
    yaw = np.zeros(count) if yaw_rad is None else yaw_rad
    return Attitude(to_level, yaw, section, reference)


def test_what_is_parted_has_mean_attitudes_turned_back_by_the_yaw():
    """A jump in the second of three postures; the others keep their references."""
    section = np.repeat([0, 1, 2], [700, 2400, 800])
    yaw = 0.001 * np.arange(3900.0)
    lies = np.where(np.arange(3900) < 1900, 0.5, -1.0)
    # Two samples of each second count.
    lies[np.arange(3900) % 25 != 0] = 0.9
    about = np.zeros(3900)
    to_level = Rotation.from_rotvec(np.column_stack([about, about, yaw])) * Rotation.from_rotvec(
        np.column_stack([lies, about, about])
    )
    forward = np.exp(1j * np.where(np.arange(3900) < 1900, 0.0, 2.0))
    turned = attitude_of(to_level, section, yaw)
    parted = parted_where_remounted(turned, forward, np.ones(3900, bool))
    assert np.flatnonzero(np.diff(parted.section)).tolist() == [699, 1899, 3099]
    assert parted.section.dtype == np.int64
    expected = [[0.0, 0, 0], [0.5, 0, 0], [-1.0, 0, 0], [0.2, 0, 0]]
    assert parted.reference.as_rotvec() == pytest.approx(np.array(expected), abs=1e-9)
    assert parted.to_level is to_level
    # A posture's own walk shows its jumps: between two of them there is none.
    apart = attitude_of(to_level, np.repeat([0, 1], [1900, 2000]), yaw)
    assert parted_where_remounted(apart, forward, np.ones(3900, bool)) is apart


def jumps_of(*parts, walking=None, weight=None):
    angle = np.concatenate([np.full(count, np.radians(degrees)) for count, degrees in parts])
    forward = np.exp(1j * angle) * (1.0 if weight is None else weight)
    turned = attitude_of(Rotation.identity(len(angle)), np.zeros(len(angle), dtype=np.int64))
    walks = np.ones(len(angle), bool) if walking is None else walking
    return np.flatnonzero(np.diff(parted_where_remounted(turned, forward, walks).section)) + 1


@pytest.mark.parametrize(
    ("parts", "cuts"),
    [
        # Ten seconds on either side, and not less.
        (((500, 0.0), (500, 61.0)), [500]),
        (((500, 0.0), (499, 61.0)), []),
        (((500, 0.0), (500, 59.0)), []),
        (((500, 0.0), (500, -61.0)), [500]),
        (((500, 90.0), (500, 150.05)), [500]),
        (((600, 170.0), (600, -120.0)), [600]),
        (((600, 0.0), (700, 90.0), (600, 0.0)), [600, 1300]),
        (((600, 0.0), (600, 90.0), (600, 180.0), (600, 270.0)), [600, 1200, 1800]),
    ],
)
def test_jumps_of_60_degrees_between_walks_of_ten_seconds(parts, cuts):
    assert jumps_of(*parts).tolist() == cuts


def test_only_walks_count():
    walking = np.ones(2000, bool)
    walking[900:1300] = False
    found = jumps_of((900, 0.0), (1100, 90.0), walking=walking)
    # It begins where walking goes on.
    assert found.tolist() == [1300]
    walking[:1000] = False
    assert jumps_of((900, 0.0), (1100, 90.0), walking=walking).size == 0


@pytest.mark.parametrize(("other", "cut"), [(0.19, True), (0.2, False), (0.21, False)])
def test_six_tenths_of_accelerations_have_one_direction(other, cut):
    """A share of them points backward: of 1 - 2 s of all is left."""
    weight = np.where(np.arange(1000) % 100 < 100 * other, -1.0, 1.0)
    assert bool(jumps_of((500, 0.0), (500, 90.0), weight=weight).size) is cut
    for half in (slice(500), slice(500, None)):
        one = np.ones(1000)
        one[half] = weight[half]
        assert bool(jumps_of((500, 0.0), (500, 90.0), weight=one).size) is cut


def test_drifts_are_read_between_the_middles_of_seconds():
    """A direction that turns for ten minutes, but for its ends."""
    count = 600 * HZ
    angle = np.radians(0.1) * np.arange(count) / HZ
    walking = np.ones(count, bool)
    turned = attitude_of(Rotation.identity(count), np.zeros(count, dtype=np.int64))
    found = drifts(turned, np.exp(1j * angle), walking)
    inner = slice(150 * HZ, 450 * HZ)
    mean = np.angle(np.exp(1j * angle).sum())
    assert found[inner] == pytest.approx(angle[inner] - mean, abs=2e-4)
    # It goes on beyond half a turn.
    wide = drifts(turned, np.exp(8j * angle), walking)
    assert np.ptp(wide[inner]) == pytest.approx(8 * np.ptp(angle[inner]), rel=0.01)
    # Those who stand show none, whatever they do.
    walking[200 * HZ : 210 * HZ] = False
    swung = np.where(walking, angle, angle + 2.0)
    assert drifts(turned, np.exp(1j * swung), walking)[inner] == pytest.approx(
        found[inner], abs=np.radians(0.5)
    )


def test_the_width_of_a_drift_is_half_a_minute():
    """After a jump in the middle it is that of a Gaussian's share."""
    count = 400 * HZ
    angle = np.where(np.arange(count) < count / 2, -0.5, 0.5)
    turned = attitude_of(Rotation.identity(count), np.zeros(count, dtype=np.int64))
    found = drifts(turned, np.exp(1j * angle), np.ones(count, bool))
    # 30 s after it 84 % have the new direction.
    share = 0.8413
    later = np.angle(share * np.exp(0.5j) + (1 - share) * np.exp(-0.5j))
    assert found[230 * HZ] == pytest.approx(later, abs=0.01)
    assert found[170 * HZ] == pytest.approx(-later, abs=0.01)


def test_swings_are_from_the_mean_of_three_seconds():
    """Tilted by 0.2 rad to one side and to the other, each second for half of it."""
    lean = np.where(np.arange(3000) % HZ < HZ // 2, 0.2, -0.2)
    still_after = np.where(np.arange(3000) < 2000, lean, 0.0)
    to_level = Rotation.from_rotvec(np.outer(still_after, [1.0, 0.0, 0.0]))
    section = np.repeat([0, 1, 2], [2000, 500, 500])
    walking = np.arange(3000) < 2500
    found = swings_rad(attitude_of(to_level, section), walking)
    # The mean is upright, 2 sin 0.1 away at a chord, but for its length cos 0.2.
    assert found[0] == pytest.approx(np.sin(0.2), rel=1e-3)
    assert found[1:] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert found.shape == (3,)


def test_a_slow_sway_is_no_swing():
    """Of 6 s: of a mean over half of it one is a half away, in the median."""
    lean = np.where(np.arange(6000) // 150 % 2, 0.2, -0.2)
    turned = attitude_of(Rotation.from_rotvec(np.outer(lean, [0, 1.0, 0])), np.zeros(6000, int))
    assert swings_rad(turned, np.ones(6000, bool)) == pytest.approx([np.sin(0.2) / 2], rel=0.03)


def test_a_posture_swings_as_it_does_while_walking():
    lean = np.where(np.arange(3000) % HZ < HZ // 2, 0.2, -0.2)
    walking = np.arange(3000) < 800
    quiet = np.where(walking, lean, 0.0)
    turned = attitude_of(Rotation.from_rotvec(np.outer(quiet, [0, 1.0, 0])), np.zeros(3000, int))
    assert swings_rad(turned, walking) == pytest.approx([np.sin(0.2)], rel=1e-3)
    assert pi > swings_rad(turned, ~walking)[0] == pytest.approx(0.0, abs=1e-9)
