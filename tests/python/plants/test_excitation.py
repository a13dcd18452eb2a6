"""Excitations: rms exact, spectra where they should be (scipy's Welch), reproducible and independent of each other."""

import math
from typing import Any

import numpy as np
import pytest
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.plants import excitation
from lever_sil.toml_tables import Place, ScenarioError
from scipy import signal

PERIOD = 1e-3
TIME = np.arange(60_000, dtype=np.float64) * PERIOD
BAND: dict[str, Any] = {"rms": "0.1 g", "low": "1 Hz", "high": "10 Hz"}
NORMALISED: list[dict[str, Any]] = [
    {"kind": "sine", "rms": "0.1 g", "frequency": "3.7 Hz", "phase": "40 deg"},
    {"kind": "multisine", **BAND, "lines": 17},
    {"kind": "chirp", **BAND, "sweep": "7 s"},
    {"kind": "noise", **BAND},
    {"kind": "rotor", "rms": "0.1 g", "rotor_frequency": "395 rpm", "harmonics": [1, 4]},
    {"kind": "gauss_markov", "rms": "0.1 g", "correlation_time": "0.3 s"},
]


def sampled(table: dict[str, Any], seed: int = 0, unit: str = "m/s^2") -> FloatArray:
    read = excitation.read_excitation(table, Place("x.toml", "base[0]", unit))
    samples: FloatArray = read.samples(TIME, np.random.default_rng(seed))
    return samples


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def share_of_power(values: FloatArray, low: float, high: float) -> float:
    frequency, power = signal.welch(values, 1 / PERIOD, nperseg=8192)
    return float(power[(frequency >= low) & (frequency <= high)].sum() / power.sum())


@pytest.mark.parametrize("table", NORMALISED, ids=lambda table: table["kind"])
@pytest.mark.parametrize("window", [{}, {"start": "3.2105 s", "end": "20 s"}], ids=["whole", "window"])
def test_rms_is_exact_inside_the_window_and_zero_outside(table: dict[str, Any], window: dict[str, str]) -> None:
    values = sampled(table | window)
    inside = (TIME >= 3.2105) & (TIME < 20.0) if window else np.ones(len(TIME), dtype=bool)
    assert rms(values[inside]) == pytest.approx(0.980665, rel=1e-12)
    assert not values[~inside].any()


@pytest.mark.parametrize("kind", ["multisine", "chirp", "noise"])
def test_power_lies_in_the_band(kind: str) -> None:
    table = next(table for table in NORMALISED if table["kind"] == kind)
    assert share_of_power(sampled(table), 0.85, 10.2) > 0.995


def test_noise_is_flat_in_its_band_gaussian_and_nothing_outside() -> None:
    values = sampled({"kind": "noise", **BAND})
    frequency, power = signal.welch(values, 1 / PERIOD, nperseg=8192)
    density = 0.980665**2 / 9.0  # one-sided, over the 9 Hz of the band
    for low, high in ((1.5, 4.0), (4.0, 7.0), (7.0, 9.5)):
        assert power[(frequency > low) & (frequency < high)].mean() == pytest.approx(density, rel=0.2)
    spectrum = np.abs(np.fft.rfft(values)) ** 2
    lines = np.fft.rfftfreq(len(values), PERIOD)
    assert spectrum[(lines < 0.999) | (lines > 10.001)].sum() < 1e-20 * spectrum.sum()
    kurtosis = np.mean(values**4) / np.mean(values**2) ** 2
    assert kurtosis == pytest.approx(3.0, abs=0.5)


def test_gauss_markov_noise_has_its_variance_and_its_correlation() -> None:
    """Mean over 20 seeds of the autocorrelation, unscaled, against exp(-t / T) and the variance 1."""
    kind = excitation.GaussMarkov(rms=1.0, correlation_time=0.3)
    waves = np.stack([kind.waveform(TIME, np.random.default_rng(seed)) for seed in range(20)])
    for lag in (0, 100, 300, 600):
        products = waves[:, lag:] * waves[:, : len(TIME) - lag]
        assert products.mean() == pytest.approx(math.exp(-lag * PERIOD / 0.3), abs=0.05)
    assert np.var(waves[:, 0]) == pytest.approx(1.0, rel=0.6)  # stationary from the first sample on


def test_chirp_sweeps_its_band_evenly_in_the_logarithm() -> None:
    values = sampled({"kind": "chirp", "rms": "1 m/s^2", "low": "1 Hz", "high": "16 Hz", "sweep": "30 s"})
    crossings = TIME[1:][np.diff(np.signbit(values).astype(int)) == -1]  # upwards: one a cycle
    middles, frequency = 0.5 * (crossings[1:] + crossings[:-1]), 1.0 / np.diff(crossings)
    expected = 16.0 ** (1.0 - np.abs(1.0 - middles / 30.0))
    assert frequency == pytest.approx(expected, rel=0.03)


def test_rotor_vibration_is_lines_of_equal_strength_at_the_harmonics() -> None:
    values = sampled({"kind": "rotor", "rms": "1 m/s^2", "rotor_frequency": "6.5 Hz", "harmonics": [1, 4]})
    amplitude = 2.0 * np.abs(np.fft.rfft(values)) / len(values)
    strongest = np.sort(np.fft.rfftfreq(len(values), PERIOD)[np.argsort(amplitude)[-2:]])
    assert strongest == pytest.approx([6.5, 26.0])
    assert np.sort(amplitude)[-2:] == pytest.approx([1.0, 1.0], rel=1e-3)  # 2 x (1/sqrt 2)^2 = 1 of mean square


def test_pulses_have_their_amplitude_width_and_period_and_alternate() -> None:
    values = sampled({"kind": "pulses", "amplitude": "2 m/s^2", "width": "50 ms", "period": "1 s", "start": "10 s"})
    assert set(np.unique(values)) == {-2.0, 0.0, 2.0}
    starts = TIME[1:][(values[1:] != 0.0) & (values[:-1] == 0.0)]
    assert starts == pytest.approx(np.arange(10.0, 60.0, 1.0))
    assert np.count_nonzero(values) == 50 * 50
    assert np.all(values[10_000:10_050] == 2.0)
    assert np.all(values[11_000:11_050] == -2.0)


@pytest.mark.parametrize("period", ["1 ms", "0.6 ms", "0.1 ms"])
def test_pulses_shorter_than_a_sample_are_one_a_sample(period: str) -> None:
    values = sampled({"kind": "pulses", "amplitude": "2 m/s^2", "width": period, "period": period})
    width = float(period.removesuffix(" ms")) > 0.5
    assert np.all(values[0::2] == (2.0 if width else 0.0))
    assert np.all(values[1::2] == (-2.0 if width else 0.0))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kind": "noise", "rms": "0.1 g", "low": "10 Hz", "high": "1 Hz"}, "low 10 Hz is not below high 1 Hz"),
        (
            {"kind": "noise", "rms": "0.1", "low": "1 Hz", "high": "2 Hz"},
            r"x.toml: base\[0\].rms: .* no unit; allowed: m/s",
        ),
        ({"kind": "sine", "rms": "1 g", "frequency": "0 Hz"}, "out of range; it must be above 0 Hz"),
        ({"kind": "sine", "rms": "1 g", "frequency": "1 Hz", "start": "2 s", "end": "1 s"}, "start 2 s is not before"),
        ({"kind": "noise", **BAND, "colour": "pink"}, "unknown key 'colour'; allowed: .*low, high"),
        ({"kind": "quake", "rms": "1 g"}, "kind = one of sine, multisine, chirp, noise, gauss_markov, rotor, pulses"),
        ({"kind": "sine", "rms": "1 g"}, "key 'frequency' is missing"),
        (
            {"kind": "pulses", "amplitude": "1 g", "width": "2 s", "period": "1 s"},
            "width 2 s is longer than period 1 s",
        ),
        (
            {"kind": "rotor", "rms": "1 g", "rotor_frequency": "6 Hz", "harmonics": [0]},
            "0 is not a whole number from 1",
        ),
    ],
)
def test_nonsense_is_refused_with_place_and_remedy(table: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        sampled(table)
