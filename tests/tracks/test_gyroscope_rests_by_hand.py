"""Rests of a gyroscope by hand: which seconds are such, their rates, noise, and the notes on it."""

from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.tracks.pdr.gyroscope import Gyroscope, _noise, _rests, error_notes, sample_noise
from mapfilter.tracks.pdr.signals import RATE_HZ

NAN = np.nan
WIDTH = int(RATE_HZ)
BY_TURNS = np.where(np.arange(WIDTH) % 2, 1.0, -1.0)
"""A second of samples whose standard deviation is 1, and whose mean is 0."""


def seconds(*of):
    """Return rates of seconds, of (mean, deviation) about x."""
    x = np.concatenate([mean + deviation * BY_TURNS for mean, deviation in of])
    return np.stack([x, 0.1 * x, 0.0 * x], axis=1)


@pytest.mark.parametrize(
    ("deviation", "noise", "is_rest"),
    [
        # Up to 0.02 rad/s, and one and a half times the noise of a sample, in squares.
        (0.019, 0.0, True),
        (0.021, 0.0, False),
        (0.024, 0.01 / RATE_HZ**0.5, True),
        (0.026, 0.01 / RATE_HZ**0.5, False),
    ],
)
def test_a_second_at_rest_sways_little(deviation, noise, is_rest):
    """√(0.02² + 0.015²) is 0.025."""
    rates = seconds((0.5, 0.0), (0.3, deviation))
    second, mean, sway = _rests(rates, np.ones(2 * WIDTH, dtype=bool), noise)
    assert second.tolist() == [0, 1][: 1 + is_rest]
    assert mean[:, 0].tolist() == pytest.approx([0.5, 0.3][: 1 + is_rest])
    assert mean[:, 1].tolist() == pytest.approx([0.05, 0.03][: 1 + is_rest])
    assert sway.tolist() == pytest.approx([0.0, deviation][: 1 + is_rest], abs=1e-12)


def test_whole_seconds_without_a_movement_are_at_rest():
    quiet = np.ones(4 * WIDTH - 1, dtype=bool)
    quiet[WIDTH] = False
    rates = seconds(*[(0.01, 0.0)] * 4)[:-1]
    assert _rests(rates, quiet, 0.0)[0].tolist() == [0, 2]


@pytest.mark.parametrize(
    ("mean", "deviation", "noise", "expected"),
    [
        # Slower than 0.05 rad/s; as uncertain as it sways, without the noise, and 1e-4 at least.
        (0.04, 0.0, 0.0, (0.04, 1e-4)),
        (-0.04, 0.01, 0.0, (-0.04, 0.01)),
        (0.051, 0.0, 0.0, (NAN, NAN)),
        (-0.051, 0.0, 0.0, (NAN, NAN)),
        # 0.01² less 0.006² of the samples, and 0.006² over a second of them.
        (0.0, 0.01, 0.006 / RATE_HZ**0.5, (0.0, (0.008**2 + 0.006**2 / RATE_HZ) ** 0.5)),
        (0.0, 0.0, 0.006 / RATE_HZ**0.5, (0.0, 0.006 / RATE_HZ**0.5)),
        (0.0, 1.5e-4, 0.0, (0.0, 1.5e-4)),
    ],
)
def test_rates_of_seconds_at_rest(mean, deviation, noise, expected):
    rates = seconds((mean, deviation), (0.0, 0.5), (0.0, 0.0))
    quiet = np.ones(len(rates), dtype=bool)
    found = Gyroscope(noise_rad_per_sqrt_s=noise).rates_at_rest(rates, rates[:, 0], quiet, 2)
    assert found[0].tolist() == pytest.approx([expected[0], NAN], abs=1e-12, nan_ok=True)
    assert found[1].tolist() == pytest.approx([expected[1], NAN], abs=1e-12, nan_ok=True)


def test_noise_by_second_differences():
    """Of samples +a, -a, +a they are 4 a; of white noise their variance is six times its own.

    The median of an absolute normal deviate is 0.6745 standard deviations.
    """
    bends = np.array([0.4, -0.4, 0.4, -0.4])
    assert sample_noise(bends) == pytest.approx(0.4 / 0.6745 / 6**0.5, rel=1e-4)
    two = np.stack([bends, 0.0 * bends], axis=1)
    assert sample_noise(two) == pytest.approx(0.4 / 0.6745 / 12**0.5, rel=1e-4)
    assert sample_noise(np.zeros((0, 3))) == 0


@pytest.mark.parametrize(("count", "shows"), [(52, True), (51, False)])
def test_fifty_samples_at_rest_show_noise(count, shows):
    """Those with a neighbour at rest before and after; here ten a second, in a longer rest."""
    time_s = 5.0 + 0.1 * np.arange(100)
    rate = 0.1 * np.where(np.arange(100) % 2, 1.0, -1.0)[:, None] * [1.0, 1.0, 1.0]
    quiet = np.zeros(int(10 * RATE_HZ), dtype=bool)
    # Samples 20 and on, of a stretch that begins at 5 s.
    begin = round(2.0 * RATE_HZ)
    quiet[begin - 1 : begin + round(0.1 * (count - 1) * RATE_HZ) + 1] = True
    found = _noise(time_s, rate, [SimpleNamespace(time_s=np.array([5.0]))], [quiet])
    expected = 0.4 / 0.6745 / 6**0.5 * 0.1**0.5
    assert found == pytest.approx(expected * shows, rel=1e-4)
    # In two stretches; what is before or beyond one is not of it.
    parts = [SimpleNamespace(time_s=np.array([at])) for at in (2.0, 5.0, 50.0)]
    again = _noise(time_s, rate, parts, [np.ones(10, dtype=bool), quiet, quiet])
    assert again == found


@pytest.mark.parametrize(
    ("walk_deg", "bias_deg", "notes"),
    [
        (0.29, 0.49, ()),
        (0.31, 0.0, ("noise by which headings drift 0.31 deg/sqrt(s)",)),
        (0.0, 0.51, ("a bias of 0.51 deg/s, which is subtracted",)),
        (
            1.26,
            2.04,
            (
                "a bias of 2 deg/s, which is subtracted",
                "noise by which headings drift 1.3 deg/sqrt(s)",
            ),
        ),
    ],
)
def test_notes_on_unusually_large_errors(walk_deg, bias_deg, notes):
    found = error_notes(np.radians(walk_deg), np.radians(bias_deg))
    expected = [f"gyroscope: unusually large errors: {' and '.join(notes)}"] if notes else []
    assert [note.replace(", and ", " and ") for note in found] == expected
    assert error_notes(np.radians(walk_deg), of="wheels") == tuple(
        f"wheels: unusually large errors: {note}" for note in notes if "drift" in note
    )
