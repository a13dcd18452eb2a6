"""The plant of the envelope against other plants and closed forms, its sensors, and its figures on made-up outcomes."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.config import Config, settings_table
from lever_cdkf.firmware.estimator import DO_NOT_TRUST, Estimator, feed
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.batch import firmware, motions, pilots, plant
from lever_sil.batch.firmware import RESPONSE_STRIDE, Feedthrough, Track
from lever_sil.batch.motions import Motion, Recording, noise
from lever_sil.batch.sensors import CLOCK, SENSORS, Sensors, lost, measured
from lever_sil.envelope import measure
from lever_sil.envelope.measure import FIGURES, Outcome, fault_mask
from lever_sil.plants import lever_plant as sil_plant
from lever_sil.plants.pilots import HandsOff
from lever_sil.plants.sensors import INVALID, Reads, Scale, Spikes, Stuck
from lever_sil.plants.trajectories import Ramp, Steps
from lever_sil.plants.truth import Conditions
from numpy.typing import NDArray

QUIET = Motion(duration=8.0, process_noise=0.0)
SEEDS = range(3)


def lever() -> sil_plant.Lever:
    return sil_plant.Lever.from_settings({row.name: row.default for row in settings_table()})


# --- plant -----------------------------------------------------------------------------------------------------------


def test_plant_is_the_one_of_sil_by_another_integration() -> None:
    given = motions.lanes(replace(QUIET, torque=()), SEEDS)
    theta, theta_dot = plant.run(given)
    for run in SEEDS:
        columns = [np.full(len(theta), getattr(given, name)[0, run]) for name in ("m_p", "c_p", "k_p", "trim")]
        truth = sil_plant.LeverTruth(lever(), sil_plant.Truth(*columns), "trim")
        body = truth.body(Conditions(given.z_ddot[:, run], motions.PERIOD, 0.0, 0.0, np.random.default_rng(1)))
        other = [(body.theta, body.theta_dot)]
        for _ in range(len(theta) - 1):
            body.advance(0.0)
            other.append((body.theta, body.theta_dot))
        np.testing.assert_allclose(np.transpose(other), (theta[:, run], theta_dot[:, run]), atol=2e-4)
        f_n, zeta = (motions.truth(given)[name][0, run] for name in ("f_n", "zeta"))
        assert f_n == pytest.approx(truth.dynamics.natural_frequency[0], rel=1e-12)
        assert zeta == pytest.approx(truth.dynamics.damping_ratio[0], rel=1e-12)


def test_friction_holds_a_lever_that_is_driven_by_less_until_it_is_freed() -> None:
    given = motions.lanes(Motion(duration=2.0, friction=Steps(30.0, (1.0,), (0.0,))), SEEDS)
    theta, theta_dot = plant.run(given)
    held = np.arange(len(theta)) <= 1000
    assert np.all(theta[held] == theta[0])
    assert np.all(theta_dot[held] == 0.0)
    assert np.all(np.std(theta[~held], axis=0) > math.radians(0.1))


def test_friction_takes_its_share_of_each_half_swing() -> None:
    """Coulomb friction T on a spring K: each half swing is smaller by 2 T / K (Den Hartog)."""
    hardware = plant.Hardware(damping=0.0)
    given = motions.lanes(replace(QUIET, duration=2.0, base=(), torque=(), friction=0.05), range(1))
    given = replace(given, c_p=np.zeros((1, 1)), trim=np.full((1, 1), 0.3), hardware=hardware)
    lanes = plant.BatchPlant(given)
    lanes.theta[0] += 0.01
    lanes.move(0, 1500)
    angle = lanes.theta[1:1501, 0] - 0.3
    peaks = np.abs(angle[1:-1][np.diff(np.sign(np.diff(angle))) != 0])
    stiffness = (hardware.length * math.cos(0.3)) ** 2 * given.k_p[0, 0] + hardware.stiffness
    assert len(peaks) > 5
    np.testing.assert_allclose(np.diff(peaks[:6]), -2.0 * 0.05 / stiffness, rtol=0.1)


def test_a_lever_that_nobody_holds_swings_on_its_own_spring() -> None:
    motion = replace(QUIET, base=(), torque=noise(0.05), hands_off=(HandsOff(start=0.0, end=9.0),))
    given = replace(motions.lanes(motion, SEEDS), hardware=plant.Hardware(damping=0.0))
    theta, theta_dot = plant.run(replace(given, tau_m=given.tau_m * (np.arange(8001)[:, None] < 2000)))
    energy = 0.5 * 0.08075 * theta_dot**2 + 0.5 * 5.0 * (theta - given.trim) ** 2
    np.testing.assert_allclose(energy[-1], energy[2001], rtol=1e-6)


@pytest.mark.parametrize("pilot", ["two_dof", "mayo_ectomorphic", "hysteretic", "reflex"])
def test_pilots_of_sil_answer_the_base_as_their_response_says(pilot: str) -> None:
    recording = pilots.record(Motion(duration=20.0, torque=(), process_noise=0.0, pilot=pilot), range(1))
    spectrum = [np.fft.rfft(column[:-1, 0] * np.hanning(20000)) for column in (recording.theta, recording.z_ddot)]
    at = np.arange(2 * 20, 8 * 20 + 1, 5)
    seen = np.array([np.vdot(spectrum[1][i - 3 : i + 4], spectrum[0][i - 3 : i + 4]) for i in at])
    seen /= [np.vdot(spectrum[1][i - 3 : i + 4], spectrum[1][i - 3 : i + 4]).real for i in at]
    assert recording.response is not None
    assert np.linalg.norm(seen - recording.response[0]) < 0.08 * np.linalg.norm(recording.response[0])


# --- motions ---------------------------------------------------------------------------------------------------------


def given(**asked: Any) -> plant.Lanes:
    return motions.lanes(Motion(duration=10.0, **asked), range(4))


def test_what_the_pilot_does_is_as_asked() -> None:
    """Against runs of the same seeds in which he does nothing."""
    still, time = given(), np.arange(10_001)[:, None] * 1e-3
    later, moment = time >= 5.0, np.clip(time - 5.0, 0.0, 1.0)
    step, ramp = Steps(1.0, (5.0,), (1.3,)), Ramp(0.0, 0.1, 5.0, 1.0)
    changed = given(c_p=step, trim=ramp)
    np.testing.assert_allclose(changed.c_p, still.c_p * np.where(later, 1.3, 1.0))
    np.testing.assert_array_equal(changed.k_p, still.k_p)
    np.testing.assert_allclose(changed.trim, still.trim + 0.1 * moment)
    np.testing.assert_array_equal(changed.trim[:1], motions.arms(range(4))[3])
    gripped = given(c_p=step, k_p=step, either_way=True)
    factor = 1.3 ** np.array((-1.0, 1.0, -1.0, 1.0))
    for name in ("c_p", "k_p"):
        np.testing.assert_allclose(getattr(gripped, name), getattr(still, name) * np.where(later, factor, 1.0))
    released = given(hands_off=(HandsOff(start=2.0, end=3.0), HandsOff(start=5.0, end=11.0)))
    held = (time < 2.0) | (time >= 3.0) & ~later
    for name in ("m_p", "c_p", "k_p"):
        np.testing.assert_array_equal(getattr(released, name), getattr(still, name) * held)
    rubbing = given(friction=Steps(0.0, (5.0,), (1.5,))).friction
    np.testing.assert_array_equal(rubbing, 1.5 * later + np.zeros((1, 4)))
    drawn = motions.lanes(Motion(duration=1.0, friction=1.0, friction_sigma=0.05), range(200)).friction - 1.0
    assert np.sqrt(np.mean(drawn**2)) == pytest.approx(0.05, rel=0.15)
    assert (drawn > 0.0).all()


def test_what_moves_the_lever_is_as_asked() -> None:
    """Each run and each excitation draws its own."""
    usual, more = given(), given(base=(*motions.BASE, *noise(2.0, 17.0, 18.0)), disturbance=noise(0.3, 3.0, 5.0))
    for signal, rms, low, high in (
        (usual.z_ddot, 1.0, 1.0, 10.0),
        (usual.tau_m, 0.3, 1.0, 10.0),
        (more.z_ddot - usual.z_ddot, 2.0, 17.0, 18.0),
        (more.disturbance, 0.3, 3.0, 5.0),
    ):
        np.testing.assert_allclose(np.sqrt(np.mean(signal**2, axis=0)), rms)
        power = np.sum(np.abs(np.fft.rfft(signal, axis=0)) ** 2, axis=1)
        frequency = np.fft.rfftfreq(len(signal), 1e-3)
        assert power[(frequency > 0.95 * low) & (frequency < 1.02 * high)].sum() > 0.999999 * power.sum()
    first, second = (more.z_ddot - usual.z_ddot)[:, :2].T
    apart = (usual.z_ddot[:, 0], usual.z_ddot[:, 1], usual.tau_m[:, 0], first, second, more.disturbance[:, 0])
    assert np.abs(np.corrcoef(apart) - np.eye(6)).max() < 0.6
    assert not usual.disturbance.any()
    rough = given(process_noise=0.07, gusts=Steps(1.0, (5.0,), (4.0,))).kick
    assert np.std(rough[:5000]) == pytest.approx(0.07 * math.sqrt(1e-3), rel=0.02)
    assert np.std(rough[5000:]) == pytest.approx(0.28 * math.sqrt(1e-3), rel=0.02)


# --- sensors ---------------------------------------------------------------------------------------------------------


def ramps(runs: int = 3) -> Recording:
    time = np.arange(2001, dtype=np.float64) * motions.PERIOD
    signal = np.outer(time, np.ones(runs))
    return Recording(time, signal, signal, signal, signal, {})


def test_gain_and_delay() -> None:
    clean = measured(ramps(), Sensors(), SEEDS)
    off = measured(ramps(), Sensors(z_ddot_gain=1.1, z_ddot_delay=2.5e-3, tau_m_gain=0.5, angle_gain=1.02), SEEDS)
    expected = {"theta": 1.02, "theta_dot": 1.02, "tau_m": 0.5, "z_ddot": 1.1}
    for name, gain in expected.items():
        late = 2.5e-3 if name == "z_ddot" else 0.0
        np.testing.assert_allclose(
            (off[name] - clean[name])[10:], (gain * (ramps().theta - late) - ramps().theta)[10:], atol=1e-12
        )
        assert np.std(clean[name] - ramps().theta) == pytest.approx(SENSORS[name].noise, rel=0.05)


def test_the_sensor_of_the_grip_force_has_gain_bias_and_noise() -> None:
    force = 10.0 * ramps(40).theta
    held = replace(ramps(40), grip_force=force)
    assert "grip_force" not in measured(held, Sensors(), range(40))
    clean = measured(held, Sensors(grip_gain=1.0), range(40))["grip_force"]
    assert np.mean(clean - force) == pytest.approx(2.0, abs=0.01)
    assert np.std(clean - force) == pytest.approx(0.3, rel=0.02)
    off = measured(held, Sensors(grip_gain=1.5, grip_gain_sigma=0.02), range(40))["grip_force"] - clean
    gains = off[1:] / force[1:]
    np.testing.assert_allclose(gains, np.broadcast_to(gains[-1], gains.shape), atol=1e-9)
    assert np.mean(gains[-1]) == pytest.approx(0.5, abs=0.01)
    assert np.std(gains[-1]) == pytest.approx(0.02, rel=0.4)


def test_faults_act_in_their_signal_in_every_run() -> None:
    clean, window = measured(ramps(), Sensors(), SEEDS), {"start": 0.5, "end": 1.0}
    faults = (
        ("z_ddot", Stuck(**window)),
        ("theta", Reads(value=INVALID, start=1.2)),
        ("z_ddot", Scale(factor=-1.0, start=1.0)),
    )
    spoilt = measured(ramps(), Sensors(faults=faults), SEEDS)
    expected = clean["z_ddot"].copy()
    expected[500:1000], expected[1000:] = expected[499], -expected[1000:]
    np.testing.assert_array_equal(spoilt["z_ddot"], expected)
    np.testing.assert_array_equal(
        np.isnan(spoilt["theta"]), np.broadcast_to(ramps().time[:, None] >= 1.2, (len(expected), 3))
    )
    np.testing.assert_array_equal(spoilt["theta_dot"], clean["theta_dot"])


def test_spikes_are_others_in_each_run() -> None:
    clean = measured(ramps(), Sensors(), SEEDS)["theta"]
    spoilt = measured(ramps(), Sensors(faults=(("theta", Spikes(share=0.1, size=0.3)),)), SEEDS)["theta"]
    hit = np.abs(spoilt - clean) > 0.2
    assert np.all((hit.mean(axis=0) > 0.05) & (hit.mean(axis=0) < 0.15))
    assert not np.array_equal(hit[:, 0], hit[:, 1])


def test_lever_samples_are_lost_at_random_and_in_stretches() -> None:
    clean, thinned = (measured(ramps(), sensors, SEEDS) for sensors in (Sensors(), Sensors(lever_lost=0.3)))
    gone = np.isnan(thinned["theta"])
    np.testing.assert_allclose(gone.mean(axis=0), 0.3, atol=0.05)
    assert not np.array_equal(gone[:, 0], gone[:, 1])
    for name in ("theta", "theta_dot", "tau_m"):
        np.testing.assert_array_equal(thinned[name], np.where(gone, np.nan, clean[name]))
    np.testing.assert_array_equal(thinned["z_ddot"], clean["z_ddot"])
    stretches = lost(range(40), 2003, 0.2, 0.05)
    assert stretches.shape == (2003, 40)
    assert stretches.mean() == pytest.approx(0.2, abs=0.03)
    borders = np.flatnonzero(stretches[1:, 0] != stretches[:-1, 0]) + 1
    assert len(borders) > 5
    assert not np.any(borders % 50)


def test_a_sample_comes_each_sample_period_and_has_the_time_of_its_senders_clock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    signals = measured(ramps(2), Sensors(faults=((CLOCK, Scale(factor=1.1, start=0.5, end=1.0)),)), range(2))
    fed = []

    def note(estimator: Estimator, samples: NDArray[Any], at: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[Any]]:
        fed.append(samples.copy())
        return feed(estimator, samples, at)

    monkeypatch.setattr(firmware, "feed", note)
    track = firmware.estimates(Config(settings={"sample_period": 2e-3}), signals)
    assert len(fed) == 2
    for run, samples in enumerate(fed):
        np.testing.assert_array_equal(samples["theta"], signals["theta"][::2, run].astype(np.float32))
        true = np.arange(0, 2001, 2) * 1e3
        np.testing.assert_allclose(samples["time_us"], true + 0.1 * np.clip(true - 0.5e6, 0.0, 0.5e6), atol=110.0)
        assert samples["z_ddot_valid"].all()
    np.testing.assert_allclose(track.time, np.arange(201) * 0.01)


# --- figures ---------------------------------------------------------------------------------------------------------


def outcome(error: dict[str, FloatArray] | None = None, faults: FloatArray | None = None) -> Outcome:
    """Return two runs of 20 s whose truth is 1 and whose σ is 0.1, with these errors and faults of the first."""
    time, first = np.arange(0.0, 20.0, 0.01), np.array((1.0, 0.0))
    nothing = np.zeros((len(time), 2))
    truth, sigma = (dict.fromkeys(measure.QUANTITIES, nothing + each) for each in (1.0, 0.1))
    errors = dict.fromkeys(measure.QUANTITIES, np.zeros_like(time)) | (error or {})
    value = {name: 1.0 + np.outer(column, first) for name, column in errors.items()}
    shown = nothing.astype(np.uint32)
    if faults is not None:
        shown[:, 0] = faults
    track = Track(time, value, sigma, shown, shown)
    return Outcome(Recording(time, nothing, nothing, nothing, nothing, truth), track, (5.0, 15.0), ((10.0, 12.0),))


TIME = np.arange(0.0, 20.0, 0.01)
STUCK = fault_mask("BASE")


@pytest.mark.parametrize(
    ("figure", "error", "faults", "expected"),
    [
        ("f_n rms", {"f_n": np.where(TIME < 10.0, 0.04, 0.0)}, None, 4.0 / math.sqrt(2.0)),
        ("f_n covered", {"f_n": np.where(TIME < 7.5, 0.21, 0.19)}, None, 75.0),
        ("c_p largest", {"c_p": np.where(TIME < 5.0, 9.0, -0.35 * (TIME > 8.0))}, None, 3.5),
        ("settled", {"f_n": np.where(TIME < 13.5, 0.06, 0.04)}, None, 1.5),
        ("settled", {"f_n": np.full_like(TIME, -0.06)}, None, math.inf),
        ("flagged", None, STUCK * (TIME >= 14.0), 10.0),
        ("flagged", None, DO_NOT_TRUST * (TIME >= 14.0), 10.0),
        ("flagged", None, ~DO_NOT_TRUST * (TIME > 0.0), 0.0),
        ("mismatch", None, fault_mask("MISMATCH") * (TIME < 14.0), 90.0),
        ("CALIBRATION share", None, fault_mask("CALIBRATION") * (TIME >= 14.0), 10.0),
        ("changes", None, fault_mask("CHANGE") * ((TIME < 6.0) | (np.abs(TIME - 9.0) < 1.0) | (TIME > 14.0)), 720.0),
        ("unflagged", {"f_n": np.where(TIME < 9.0, 0.9, 0.4)}, STUCK * (TIME < 9.0), 4.0),
        ("silent", {"zeta": np.where((TIME > 7.005) & (TIME < 8.0), 0.31, 0.29)}, STUCK * (TIME < 7.505), 0.49),
        ("silent share", {"m_p": np.where(TIME < 6.0, 0.31, 0.29)}, STUCK * (TIME < 5.5), 5.0),
        ("to flag", None, STUCK * (TIME >= 10.4), 0.4),
        ("to flag", None, STUCK * (TIME >= 12.4), math.inf),
        ("to HANDS_OFF", None, STUCK * (TIME >= 10.0) + fault_mask("HANDS_OFF") * (TIME >= 11.0), 1.0),
        ("back", None, STUCK * ((TIME < 12.3) | ((TIME >= 12.5) & (TIME < 12.8))), 0.8),
        ("back", None, fault_mask("SETTLING") * (TIME > 0.0), math.inf),
        ("learnt at once", {"m_p": np.where(TIME < 10.04, 0.5, 0.02 * (TIME > 11.0))}, None, 0.2),
        ("learnt", {"m_p": np.where(TIME < 10.5, 0.5, 0.0)}, None, 0.0),
        ("learnt late", {"k_p": np.where(TIME < 11.0, 0.5, 0.0)}, None, 0.0),
    ],
)
def test_figures(figure: str, error: dict[str, FloatArray] | None, faults: FloatArray | None, expected: float) -> None:
    first, second = FIGURES[figure].compute(outcome(error, faults))
    assert first == pytest.approx(expected, abs=1e-6)
    assert second == pytest.approx(
        math.inf if figure.startswith("to ") else 100.0 * figure.endswith("covered"), abs=1e-6
    )


def test_lag_of_a_ramp() -> None:
    late = outcome({"c_p": 0.1 * 1.5 + np.zeros_like(TIME)})
    late.recording.truth["c_p"][:] -= 0.1 * TIME[:, None]
    late.track.value["c_p"][:] -= 0.1 * TIME[:, None]
    np.testing.assert_allclose(FIGURES["lag"].compute(late), (1.5, 0.0), atol=1e-9)


def test_against_a_reference() -> None:
    stated, unstated = outcome({"zeta": np.full_like(TIME, 0.02)}), outcome({"zeta": np.full_like(TIME, 0.05)})
    for case in (stated, unstated):
        case.track.value["zeta"][:, 1] += 0.01
    unstated = replace(unstated, reference=stated)
    np.testing.assert_allclose(FIGURES["zeta ratio"].compute(unstated), (2.5, 1.0))
    unstated.track.sigma["m_p"][:, 0] = 0.3
    np.testing.assert_allclose(FIGURES["σ ratio"].compute(unstated), (3.0, 1.0))


def test_feedthrough() -> None:
    """Off by 6 % in gain and 0.05 rad in phase, in the first run."""
    case = outcome()
    truth = np.exp(1j * np.linspace(0.0, -3.0, 25)) * np.linspace(1.0, 3.0, 25) * np.ones((2, 1))
    response = np.tile(truth, (2000 // RESPONSE_STRIDE, 1, 1))
    response[:, 0] *= 1.06 * np.exp(0.05j)
    sigma = np.full(response.shape, 0.04)
    recording = replace(case.recording, response=truth)
    case = replace(
        case, recording=recording, track=replace(case.track, feedthrough=Feedthrough(response, sigma, sigma))
    )
    expected = 100.0 * abs(1.06 * np.exp(0.05j) - 1.0)
    np.testing.assert_allclose(FIGURES["θ/z̈ rms"].compute(case), (expected, 0.0), atol=1e-9)
    for gain_sigma, phase_sigma, covered in ((0.04, 0.04, 100.0), (0.02, 0.04, 0.0), (0.04, 0.02, 0.0)):
        stated = Feedthrough(response, np.full(response.shape, gain_sigma), np.full(response.shape, phase_sigma))
        stating = replace(case, track=replace(case.track, feedthrough=stated))
        np.testing.assert_array_equal(FIGURES["θ/z̈ covered"].compute(stating), (covered, 100.0))
