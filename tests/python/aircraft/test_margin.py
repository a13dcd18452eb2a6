"""The margins that the firmware works out, against those of the linearised loop in double precision."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.aircraft import AircraftResponse, Stability
from lever_cdkf.firmware.native import Config, Estimator
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.aircraft import aircraft
from lever_sil.aircraft.aircraft import Coupled
from lever_sil.aircraft.flight import Flight
from lever_sil.plants import lever_plant
from lever_sil.scenarios import inputs, scenario
from python.aircraft.loops import Margins, decibels, loop_of, margins
from python.plants.motion import TRIM

NAMES = ("m_p", "c_p", "k_p")
LEVER = lever_plant.Lever.from_settings(Config().settings)
FREQUENCY = np.geomspace(1.5, 8.0, 24)


def table(coupled: Coupled, gain_sigma: float = 0.0, phase_sigma: float = 0.0, **limits: Any) -> AircraftResponse:
    response = coupled.response(2j * np.pi * FREQUENCY.astype(np.complex128))
    return AircraftResponse(
        FREQUENCY.tolist(), response.tolist(), gain_sigma=gain_sigma, phase_sigma=phase_sigma, **limits
    )


def said(arm: FloatArray, sigma: float, watched: AircraftResponse) -> Stability:
    """Return what the firmware says that has this arm for its first guess, and has seen nothing but a lever at rest."""
    settings = dict(zip(NAMES, arm.tolist(), strict=True)) | {f"{name}_sigma": sigma for name in NAMES}
    estimator = Estimator(Config(settings={**settings, "publish_period": 1e-3}))
    estimator.watch(watched)
    for sample in range(3):
        estimator.update(1000 * sample, theta=TRIM, theta_dot=0.0, tau_m=0.0, z_ddot=0.0)
    return estimator.stability()


def expected(arm: FloatArray, coupled: Coupled, factor: complex = 1.0) -> Margins:
    columns = (np.full(1, value) for value in (*arm, TRIM))
    transfer = lever_plant.LeverTruth(LEVER, lever_plant.Truth(*columns), "trim").transfer(np.array([0]))

    loop = loop_of(coupled, transfer, 0)
    return margins(lambda s: factor * loop(s))


@pytest.mark.parametrize("name", aircraft.names())
@pytest.mark.requirement("R42")
def test_margins_are_those_of_the_linearised_loop(name: str) -> None:
    random, craft = np.random.default_rng(3), aircraft.load(name)
    for _ in range(30):
        arm = random.uniform((1.5, 15.0, 800.0), (4.5, 90.0, 3000.0))
        coupled = Coupled(craft, random.uniform(0.2, 1.2))
        known, found = expected(arm, coupled), said(arm, 1e-3, table(coupled))
        assert 2.0 < known.frequency < 7.0
        assert found.gain_margin == pytest.approx(decibels(known.gain), abs=0.1)
        assert found.frequency == pytest.approx(known.frequency, rel=0.005)
        if 0.0 < decibels(known.gain) < 10.0:
            assert found.modulus == pytest.approx(known.modulus, abs=0.02)
        elif decibels(known.gain) < 0.0:
            assert found.modulus < 0.0


@pytest.mark.requirement("R42")
def test_standard_deviations_are_those_of_drawn_arms() -> None:
    """400 arms with independent log-normal errors of 10 %."""
    arm, coupled = np.array((2.5, 30.0, 1500.0)), Coupled(aircraft.load("uh60_like"), 0.5)
    found = said(arm, 0.1, table(coupled))
    random = np.random.default_rng(4)
    drawn = [expected(arm * np.exp(0.1 * random.standard_normal(3)), coupled) for _ in range(400)]
    assert found.gain_margin_sigma == pytest.approx(np.std([decibels(each.gain) for each in drawn]), rel=0.1)
    assert found.frequency_sigma == pytest.approx(np.std([each.frequency for each in drawn]), rel=0.1)
    assert found.modulus_sigma == pytest.approx(np.std([each.modulus for each in drawn]), rel=0.15)


@pytest.mark.requirement("R42")
def test_what_the_table_is_off_by_is_in_the_standard_deviations() -> None:
    arm, coupled = np.array((2.5, 30.0, 1500.0)), Coupled(aircraft.load("uh60_like"), 0.5)
    exact, known = said(arm, 1e-3, table(coupled)), expected(arm, coupled)
    gain = said(arm, 1e-3, table(coupled, gain_sigma=0.1))
    assert exact.gain_margin_sigma < 0.02
    assert gain.gain_margin_sigma == pytest.approx(decibels(1.1), rel=0.01)
    phase = said(arm, 1e-3, table(coupled, phase_sigma=0.1))
    rotated = expected(arm, coupled, complex(1.0, 0.1))
    of_gain = math.sqrt(phase.gain_margin_sigma**2 - exact.gain_margin_sigma**2)
    of_frequency = math.sqrt(phase.frequency_sigma**2 - exact.frequency_sigma**2)
    moved = abs(decibels(rotated.gain) - decibels(known.gain))
    assert of_gain == pytest.approx(moved, abs=0.02)  # the table is linear between
    assert of_frequency == pytest.approx(abs(rotated.frequency - known.frequency), rel=0.05)


@pytest.mark.requirement("R43")
def test_the_alarm_comes_before_the_vibration_grows() -> None:
    """The shipped scenario with the firmware's own dither: the pilot relaxes from 10 s on."""
    wanted = scenario.load("bounce", ["duration=42 s"])
    assert wanted.aircraft is not None
    known, firmware = inputs.prepare(wanted), Estimator(wanted.config)
    z_ddot, flight = known.z_ddot, Flight(wanted.aircraft, wanted.period, known.z_ddot.copy())
    body = known.truth.body(inputs.conditions(wanted, known))
    firmware.watch(table(wanted.aircraft, 0.05, 0.05, warning=3.0, alarm=1.5))
    noise = np.random.default_rng(5).standard_normal((len(z_ddot), 4)) * (1e-3, 1e-2, 2e-3, 1e-2)
    rest, states, stated = body.theta, [], []
    z_ddot[0] = flight.z_ddot
    for sample in range(len(z_ddot) - 1):
        if sample % 500 == 0:
            firmware.command(dither_rms=0.3)
        signals = np.array((body.theta, body.theta_dot, body.tau_m, z_ddot[sample])) + noise[sample]
        firmware.update(1000 * sample, *signals.tolist())
        if sample % 20 == 0:
            said_now = firmware.stability()
            states.append(said_now.state)
            stated.append((said_now.gain_margin, said_now.gain_margin_sigma))
        z_ddot[sample + 1] = flight.advance(body.theta - rest)
        body.advance(firmware.health().torque)
    at = np.arange(0, len(z_ddot) - 1, 20)
    transfer = known.truth.transfer(at)
    true = np.array([decibels(margins(loop_of(wanted.aircraft, transfer, i)).gain) for i in range(0, len(at), 10)])
    gain, sigma = np.array(stated).T[:, ::10]
    judged = (at[::10] > 5000) & (true > -1.0)
    assert np.mean(np.abs(gain - true)[judged] < 2.0 * sigma[judged]) > 0.9
    assert np.sqrt(np.mean((gain - true)[judged] ** 2)) < 1.0
    assert "alarm" not in states[: 25 * 50]  # until there the true margin is 2.5 dB or more
    alarm = 0.02 * states.index("alarm")
    loudness = np.array([np.std(z_ddot[end - 1000 : end]) for end in range(1000, len(z_ddot), 50)])
    steady = np.median(loudness[:180])
    doubled = 0.05 * (20 + int(np.argmax(loudness > 2.0 * steady)))
    assert alarm < doubled - 2.0
    assert set(states[states.index("alarm") :]) == {"alarm"}


def test_a_loop_that_never_turns_has_the_largest_margin() -> None:
    arm = np.array((2.5, 42.0, 1500.0))
    quiet = AircraftResponse(FREQUENCY.tolist(), [1e-4 + 0j] * 24, gain_sigma=0.0, phase_sigma=0.0)
    found = said(arm, 0.1, quiet)
    assert (found.gain_margin, found.gain_margin_sigma) == (40.0, 0.0)
    assert found.modulus == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("frequency", "response", "options"),
    [
        ([2.0, 2.0, 3.0], [1j] * 3, {}),
        ([0.0, 2.0, 3.0], [1j] * 3, {}),
        ([1.0, 2.0, 3.0], [1j, complex(math.nan, 0.0), 1j], {}),
        ([1.0, 2.0, math.inf], [1j] * 3, {}),
        ([1.0, 2.0, 3.0], [1j] * 3, {"gain_sigma": -0.1}),
        ([1.0, 2.0, 3.0], [1j] * 3, {"phase_sigma": math.nan}),
        ([1.0, 2.0, 3.0], [1j] * 3, {"warning": 1.0, "alarm": 2.0}),
    ],
)
def test_a_table_that_is_not_usable_is_refused(
    frequency: list[float], response: list[complex], options: dict[str, Any]
) -> None:
    estimator = Estimator(Config())
    good = table(Coupled(aircraft.load("uh60_like"), 0.5))
    estimator.watch(good)
    with pytest.raises(LeverError, match="refused the response of the aircraft"):
        estimator.watch(AircraftResponse(frequency, response, **{"gain_sigma": 0.0, "phase_sigma": 0.0, **options}))
    with pytest.raises(LeverError, match="3 to 24 frequencies"):
        AircraftResponse([1.0, 2.0], [1j, 1j], gain_sigma=0.0, phase_sigma=0.0)


def test_without_an_aircraft_nothing_is_known() -> None:
    estimator = Estimator(Config())
    assert estimator.stability() == Stability("unknown", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    estimator.watch(table(Coupled(aircraft.load("uh60_like"), 0.5)))
    estimator.watch(None)
    for sample in range(100):
        estimator.update(1000 * sample, theta=TRIM, theta_dot=0.0, tau_m=0.0, z_ddot=0.0)
    assert estimator.stability().state == "unknown"
