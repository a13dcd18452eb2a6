"""Sensors and dropouts: statistics against what the scenario asks for, quantisation against cantools."""

import cantools
import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.runtime.files import native_file
from lever_sil.plants.sensors import Dropout, Fault, Late, Offset, Reads, Scale, Sensor, Spikes, Stuck, missing
from numpy.typing import NDArray
from scipy import stats

PERIOD = 1e-3
TIME = np.arange(200_000, dtype=np.float64) * PERIOD


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_noise_is_white_gaussian_of_the_given_strength() -> None:
    noise = Sensor(noise=2e-3).measure(np.zeros_like(TIME), PERIOD, rng())
    assert np.std(noise) == pytest.approx(2e-3, rel=0.01)
    assert abs(np.mean(noise)) < 4 * 2e-3 / np.sqrt(len(noise))
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.01
    assert stats.kstest(noise / 2e-3, "norm").pvalue > 0.001


def test_bias_and_gain_error_are_applied_to_the_signal() -> None:
    signal = np.sin(TIME)
    measured = Sensor(bias=0.3, gain_error=0.02).measure(signal, PERIOD, rng())
    np.testing.assert_allclose(measured, 1.02 * signal + 0.3)


@pytest.mark.parametrize("delay", [0.0, 1e-3, 2.4e-3, 7.9e-3])
def test_delay_shifts_the_signal_by_any_part_of_a_sample(delay: float) -> None:
    delayed = Sensor(delay=delay).measure(np.sin(2 * np.pi * 3.0 * TIME), PERIOD, rng())
    expected = np.sin(2 * np.pi * 3.0 * np.maximum(TIME - delay, 0.0))
    whole = delay in (0.0, 1e-3)
    limit = 1e-12 if whole else 5e-5  # of linear interpolation: (2 pi 3 Hz 1 ms)^2 / 8
    np.testing.assert_allclose(delayed[10:], expected[10:], rtol=0.0, atol=limit)
    assert np.abs(delayed[:10]).max() < 0.2
    assert delayed[0] == 0.0


@pytest.mark.parametrize(("share", "burst"), [(0.02, 1e-3), (0.1, 20e-3), (0.5, 5e-3), (0.9, 2e-3)])
def test_dropouts_take_their_share_in_bursts_of_their_length(share: float, burst: float) -> None:
    gone = Dropout("theta", share=share, burst=burst).missing(TIME, PERIOD, rng())
    edges = np.flatnonzero(np.diff(np.concatenate(([False], gone, [False])).astype(int)))
    lengths = edges[1::2] - edges[::2]
    assert gone.mean() == pytest.approx(share, rel=0.15)
    expected = max(burst / PERIOD, share / (1 - share))  # a share this large needs longer bursts
    assert lengths.mean() == pytest.approx(expected, rel=0.15)
    if expected > 1.0:
        assert lengths.std() == pytest.approx(np.sqrt(expected * (expected - 1.0)), rel=0.25)  # geometric


def test_only_the_dropouts_of_that_value_count_and_they_add_up() -> None:
    dropouts = [
        Dropout("theta", share=1.0, start=1.0, end=2.0),
        Dropout("z_ddot", share=1.0, start=3.0, end=4.0),
        Dropout("theta", share=1.0, start=5.0, end=6.0),
    ]
    gone = missing(dropouts, "theta", TIME, PERIOD, [rng(i) for i in range(3)])
    assert np.array_equal(gone, ((TIME >= 1) & (TIME < 2)) | ((TIME >= 5) & (TIME < 6)))


def faulty(*faults: Fault) -> NDArray[np.float64]:
    """Return what a sensor with these faults makes of the readings sin(t) + 2."""
    return Sensor(fault=faults).corruption(TIME, PERIOD, rng()).of(np.sin(TIME) + 2.0)


def test_faults_act_in_their_window_and_only_there() -> None:
    right = np.sin(TIME) + 2.0
    inside = (TIME >= 5.0) & (TIME < 7.0)
    window = {"start": 5.0, "end": 7.0}
    for fault, expected in (
        (Stuck(**window), right[4999]),
        (Scale(factor=0.0, **window), 0.0),
        (Scale(factor=-1.0, **window), -right[inside]),
        (Scale(factor=0.5, **window), 0.5 * right[inside]),
        (Scale(factor=3.0, over=2.0, **window), (TIME[inside] - 4.0) * right[inside]),
        (Offset(size=0.25, **window), right[inside] + 0.25),
        (Offset(size=4.0, over=1.0, **window), right[inside] + np.minimum(4.0 * (TIME[inside] - 5.0), 4.0)),
        (Reads(value=1.5, **window), 1.5),
        (Late(delay=0.04, **window), np.sin(TIME[inside] - 0.04) + 2.0),
    ):
        found = faulty(fault)
        assert np.array_equal(found[~inside], right[~inside])
        np.testing.assert_allclose(found[inside], np.broadcast_to(expected, inside.sum()), rtol=1e-12)
    both = faulty(Stuck(**window), Scale(factor=-1.0, start=6.0))
    assert np.all(both[inside] == np.where(TIME[inside] < 6.0, 1.0, -1.0) * right[4999])
    assert np.all(faulty(Stuck(end=1.0))[:1000] == right[0])


def test_spikes_hit_their_share_of_the_samples_up_and_down_alike() -> None:
    off = faulty(Spikes(share=0.01, size=0.3, start=50.0)) - faulty()
    assert not off[:50_000].any()
    hit = off[50_000:][np.abs(off[50_000:]) > 1e-9]
    assert np.abs(hit) == pytest.approx(0.3)
    assert len(hit) == pytest.approx(1500, abs=4 * np.sqrt(1500))
    assert np.sum(hit > 0.0) == pytest.approx(len(hit) / 2, abs=2 * np.sqrt(len(hit)))


def test_what_reaches_the_estimator_is_quantised_or_not_available_as_cantools_has_it() -> None:
    database = cantools.database.load_file(str(native_file("lever.dbc")))
    assert isinstance(database, cantools.database.Database)
    measured = Sensor(noise=1e-3).measure(0.35 + 4.0 * np.sin(TIME[:2000]), PERIOD, rng())
    encode = codec.encoder("LEVER_SAMPLE")
    for value in measured.tolist():
        frame = encode(0, value, None, 0.0)
        decoded = dict(database.decode_message("LEVER_SAMPLE", frame))
        theta = decoded["theta"]
        assert decoded["theta_valid"] == (abs(value) < 3.27675)
        if not decoded["theta_valid"]:
            assert theta == "not_available"
            continue
        assert isinstance(theta, float)
        assert theta == pytest.approx(value, abs=0.5e-4 + 1e-9)
        assert round(theta / 1e-4) * 1e-4 == pytest.approx(theta, abs=1e-12)
