"""Times of arrival: the bound and wrong peaks against a correlator that is really run."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.simulation.lte_network import ArrivalModel, arrival_errors_m, detour_m

C = 299_792_458.0


def test_the_bound_by_hand():
    model = ArrivalModel(1e6, 1000, 3000.0, 0.0)
    # c √12 / (B √(8 π² N SINR)) at 0 dB.
    assert model.sigma_m(0.0) == pytest.approx(C * np.sqrt(12 / (8 * np.pi**2 * 1000)) / 1e6)
    np.testing.assert_allclose(model.sigma_m(-20.0), 10 * model.sigma_m(0.0))
    assert ArrivalModel(floor_m=3.0).sigma_m(60.0) == pytest.approx(3.0, abs=1e-2)


def test_a_correlator_attains_the_bound():
    """Carriers of one second of a flat spectrum in noise; the peak found by a parabola."""
    rng = np.random.default_rng(8)
    carriers, symbols, spacing_hz, snr_db, trials = 62, 40, 15e3, -5.0, 1500
    frequency = (np.arange(carriers) - (carriers - 1) / 2) * spacing_hz
    power = 10 ** (snr_db / 10)
    scale = np.sqrt(0.5 / (symbols * power))
    noise = scale * (
        rng.standard_normal((trials, carriers)) + 1j * rng.standard_normal((trials, carriers))
    )
    delay_m = np.linspace(-60.0, 60.0, 241)
    steering = np.exp(2j * np.pi * np.outer(delay_m / C, frequency))
    height = ((1 + noise) @ steering.T).real
    found = delay_m[np.argmax(height, axis=1)]
    model = ArrivalModel(carriers * spacing_hz, carriers * symbols, 3000.0, 0.0)
    # 1500 trials tell a deviation to 4 %.
    assert found.std() == pytest.approx(float(model.sigma_m(snr_db)), rel=0.06)


@pytest.mark.parametrize("gain_db", [3.0, 8.0, 11.0])
def test_wrong_peaks_are_as_many_as_noise_makes(gain_db):
    rng = np.random.default_rng(9)
    model = ArrivalModel()
    sinr_db = gain_db - 10 * np.log10(model.samples)
    drawn = rng.standard_normal((40_000, model.cells, 2)) / np.sqrt(2)
    drawn[:, 0, 0] += 10 ** (gain_db / 20)
    height = np.hypot(drawn[..., 0], drawn[..., 1])
    share = np.mean(np.argmax(height, axis=1) > 0)
    assert model.wrong_peak(sinr_db) == pytest.approx(share, abs=0.008)


def test_wrong_peaks_at_the_ends():
    model = ArrivalModel()
    assert model.wrong_peak(0.0) == pytest.approx(0.0, abs=1e-12)
    assert model.wrong_peak(-80.0) == pytest.approx(1 - 1 / model.cells, abs=1e-3)
    share = model.wrong_peak(np.linspace(-40.0, 0.0, 50))
    assert (np.diff(share) <= 1e-12).all()


def test_errors_are_those_of_the_model():
    model, rng = ArrivalModel(), np.random.default_rng(10)
    error = arrival_errors_m(model, np.full((20_000, 2), [-10.0, -28.0]), rng)
    assert error[:, 0].std() == pytest.approx(float(model.sigma_m(-10.0)), rel=0.03)
    far = np.abs(error[:, 1]) > 5 * model.sigma_m(-28.0)
    expected = model.wrong_peak(-28.0) * (1 - 10 * model.sigma_m(-28.0) / model.window_m)
    assert far.mean() == pytest.approx(float(expected), abs=0.015)
    assert np.abs(error[far, 1]).max() <= model.window_m / 2


def test_detours():
    travelled = np.arange(0.0, 20_000.0, 2.0)
    hidden = np.ones((travelled.size, 3), dtype=bool)
    hidden[:, 2] = False
    drawn = detour_m(travelled, hidden, np.random.default_rng(11), mean_m=15.0, shared=0.5)
    assert (drawn >= 0).all()
    assert (drawn[:, 2] == 0).all()
    assert drawn[:, :2].mean() == pytest.approx(15.0, abs=1.2)
    # What is common leaves differences smaller than those of strangers.
    assert np.std(drawn[:, 0] - drawn[:, 1]) < 0.85 * 15 * np.sqrt(2)
    apart = detour_m(travelled, hidden, np.random.default_rng(11), mean_m=15.0, shared=0.0)
    assert np.std(apart[:, 0] - apart[:, 1]) == pytest.approx(15 * np.sqrt(2), rel=0.08)


def test_what_is_no_model():
    with pytest.raises(InputError) as raised:
        ArrivalModel(-1.0, 0, np.inf, -2.0)
    assert len(raised.value.faults) == 4
    with pytest.raises(InputError, match="resolution cells"):
        ArrivalModel(window_m=300.0)
