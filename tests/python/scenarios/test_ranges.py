"""What a number of a scenario, an aircraft or a campaign may be, and what it is where nobody says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import MISSING
from typing import Any

import pytest
from lever_sil.aircraft.aircraft import Coupled, Fitted, Helicopter, Mode, read_aircraft
from lever_sil.campaign.axis import Axis
from lever_sil.campaign.spec import Failure, Spec
from lever_sil.plants import excitation, mayo_plant, trajectories
from lever_sil.plants.pilots import HandsOff, HystereticPilot, LeverPilot, ReflexPilot
from lever_sil.plants.sensors import Dropout, Gradual, Late, Sensor, Spikes
from lever_sil.plants.window import Window
from lever_sil.scenarios import scenario
from lever_sil.scenarios.scenario import FirmwareDither, Motor, Scenario
from lever_sil.toml_tables import Place, ScenarioError

Load = Callable[..., Scenario]
INF = math.inf
NEEDED = MISSING
"""There is no default."""

# The lowest and the highest value, in a bracket that is taken and in a parenthesis that is refused; and the default.
RANGES: list[tuple[type, str, str, str, Any]] = [
    (Scenario, "duration", "(0", "3600] s", NEEDED),
    (Scenario, "converged_after", "[0", "inf s", 15.0),
    (Scenario, "seed", "[0", "9223372036854775807]", 1),
    (Motor, "lag", "[0", "inf s", 2e-3),
    (FirmwareDither, "rms", "[0", "inf N m", NEEDED),
    (LeverPilot, "process_noise", "[0", "inf rad/s/sqrt(s)", 0.05),
    (HandsOff, "start", "(0", "inf s", NEEDED),
    (HystereticPilot, "loss_factor", "(0", "2] 1", NEEDED),
    (ReflexPilot, "delay", "[0.02", "0.2] s", 0.035),
    (Window, "start", "[0", "inf s", 0.0),
    (Window, "end", "(0", "inf s", INF),
    (excitation.Sine, "rms", "[0", "inf N m", NEEDED),
    (excitation.Sine, "frequency", "(0", "inf Hz", NEEDED),
    (excitation.Noise, "low", "(0", "inf Hz", NEEDED),
    (excitation.Noise, "high", "(0", "inf Hz", NEEDED),
    (excitation.Multisine, "lines", "[2", "1000]", 10),
    (excitation.Chirp, "sweep", "(0", "inf s", NEEDED),
    (excitation.GaussMarkov, "correlation_time", "(0", "inf s", NEEDED),
    (excitation.Rotor, "rotor_frequency", "(0", "inf Hz", NEEDED),
    (excitation.Pulses, "width", "(0", "inf s", NEEDED),
    (excitation.Pulses, "period", "(0", "inf s", NEEDED),
    (Late, "delay", "(0", "inf s", NEEDED),
    (Gradual, "over", "[0", "inf s", 0.0),
    (Spikes, "share", "(0", "1] 1", NEEDED),
    (Spikes, "size", "(0", "inf N m", NEEDED),
    (Sensor, "noise", "[0", "inf N m", 0.0),
    (Sensor, "bias", "-inf", "inf N m", 0.0),
    (Sensor, "gain_error", "(-1", "inf 1", 0.0),
    (Sensor, "delay", "[0", "inf s", 0.0),
    (Dropout, "share", "(0", "1] 1", NEEDED),
    (Dropout, "burst", "(0", "inf s", 1e-3),
    (trajectories.Ramp, "start", "[0", "inf s", NEEDED),
    (trajectories.Ramp, "duration", "(0", "inf s", NEEDED),
    (trajectories.Fatigue, "start", "[0", "inf s", 0.0),
    (trajectories.Fatigue, "time_constant", "(0", "inf s", NEEDED),
    (trajectories.Sinusoid, "frequency", "(0", "inf Hz", NEEDED),
    (trajectories.Moves, "greatest", "[0", "inf N m", NEEDED),
    (trajectories.Moves, "every", "(0", "inf s", NEEDED),
    (trajectories.Moves, "duration", "(0", "inf s", NEEDED),
    (trajectories.RandomWalk, "first", "(0", "inf N m", NEEDED),
    (trajectories.RandomWalk, "rate", "[0", "inf 1/sqrt(s)", NEEDED),
    (trajectories.RandomWalk, "least", "(0", "inf N m", NEEDED),
    (trajectories.RandomWalk, "greatest", "(0", "inf N m", NEEDED),
    (Mode, "frequency", "(0", "50] Hz", NEEDED),
    (Mode, "damping", "(0", "1] 1", 0.03),
    (Mode, "rotor", "[-10", "10] 1", 1.0),
    (Mode, "seat", "[-10", "10] 1", NEEDED),
    (Mode, "accelerometer", "[-10", "10] 1", 0.0),
    (Helicopter, "delay", "[0", "0.2] s", 0.02),
    (Helicopter, "correction_delay", "[0", "0.2] s", 0.0),
    (Helicopter, "lever_low_pass", "[0", "1000] Hz", 0.0),
    (Helicopter, "actuator_bandwidth", "[0.1", "1000] Hz", 8.0),
    (Helicopter, "actuator_rate", "(0", "100] rad/s", math.radians(100.0)),
    (Helicopter, "actuator_travel", "(0", "1] rad", math.radians(8.0)),
    (Helicopter, "rotor_speed", "[5", "200] rad/s", NEEDED),
    (Helicopter, "radius", "[1.5", "25] m", NEEDED),
    (Helicopter, "blades", "[2", "10]", NEEDED),
    (Helicopter, "blade_inertia", "(0", "100000] kg m^2", NEEDED),
    (Helicopter, "lock_number", "[1", "20] 1", NEEDED),
    (Helicopter, "flap_frequency", "[1", "2] 1", NEEDED),
    (Helicopter, "mass", "[200", "100000] kg", NEEDED),
    (Helicopter, "lift_deficiency", "[0.1", "1] 1", 0.7),
    (Fitted, "delay", "[0", "0.2] s", 0.001),
    (Fitted, "response_gearing", "(0", "100] 1", 1.0),
    (Failure, "error", "(0", "inf 1", 0.2),
    (Failure, "coverage", "[0", "1] 1", 0.8),
    (Spec, "every", "(0", "inf s", 0.1),
    (Spec, "points", "[1", "10000000000]", None),
    (Spec, "seeds", "[1", "10000000000]", 1),
    (Spec, "seed", "[0", "9223372036854775807]", 1),
    (Spec, "chunk", "[1", "9223372036854775807]", None),
    (Axis, "steps", "[2", "1000000]", None),
]  # fmt: skip


def beyond(edge: str, way: int) -> tuple[str, str]:
    """Return the last number that is taken at an edge of a range, and the first that is not."""
    number = float(edge.strip("[]()"))
    further = number + way * 1e-9 * max(1.0, abs(number))
    return (repr(2.0 * number - further), repr(number)) if edge[0] == "(" else (repr(number), repr(further))


@pytest.mark.parametrize(
    ("table", "key", "low", "high", "default"), RANGES, ids=[f"{table.__name__}.{key}" for table, key, *_ in RANGES]
)
def test_a_number_is_taken_in_its_range_alone(table: Any, key: str, low: str, high: str, default: Any) -> None:
    field = table.__dataclass_fields__[key]
    assert field.default == (pytest.approx(default) if isinstance(default, float) else default)
    edge, _, unit = high.partition(" ")
    read, place = field.metadata["read"], Place("file", key, unit or "1")

    def value(number: str) -> Any:
        return f"{number} {unit}" if unit else int(float(number)) if "." in number or "e" in number else int(number)

    for side, way in ((low, -1), (edge, 1)):
        if "inf" in side:
            assert read(value("1e9" if way > 0 else "-1e9"), place) in (1e9, -1e9)
            continue
        taken, refused = beyond(side, way) if unit else (side.strip("[]"), str(int(side.strip("[]")) + way))
        assert read(value(taken), place) == pytest.approx(float(taken), rel=1e-12)
        with pytest.raises(ScenarioError, match=f"file: {key}: "):
            read(value(refused), place)


def test_what_a_step_may_be_is_the_same_for_each_of_a_list() -> None:
    for table, key in ((trajectories.Steps, "at"), (trajectories.Sequence, "at")):
        read = table.__dataclass_fields__[key].metadata["read"]
        assert read(["1e-9 s", "7 s"], Place("file")) == (1e-9, 7.0)
        for wrong in (["1 s", "0 s"], []):
            with pytest.raises(ScenarioError):
                read(wrong, Place("file", key))
    read = excitation.Rotor.__dataclass_fields__["harmonics"].metadata["read"]
    assert read([1, 64], Place("file")) == (1, 64)
    for wrong_order in ([0], [65]):
        with pytest.raises(ScenarioError, match="from 1 to 64"):
            read(wrong_order, Place("file", "harmonics"))


@pytest.mark.parametrize(("gearing", "taken"), [("0 1", False), ("1e-9 1", True), ("100 1", True), ("100.1 1", False)])
def test_a_gearing_is_above_0_and_at_most_100(gearing: str, taken: bool) -> None:
    place = Place("file", "aircraft")
    if taken:
        coupled = read_aircraft({"model": "puma_like", "gearing": gearing}, place)
        assert isinstance(coupled, Coupled)
        assert coupled.gearing == float(gearing.split()[0])
        return
    with pytest.raises(ScenarioError, match=r"file: aircraft.gearing: .* is out of range"):
        read_aircraft({"model": "puma_like", "gearing": gearing}, place)


def test_limits_are_above_0_and_coverage_is_at_most_all(load: Load) -> None:
    text = scenario.SHELF.content("steady").decode().partition("[limits]")[0]
    assert load(text + "[limits]\ncoverage = 1\nm_p = '1e-9'\n").limits == {"coverage": 1.0, "m_p": 1e-9}
    for wrong in ("coverage = 1.01", "coverage = 0", "m_p = 0", "theta = 1"):
        with pytest.raises(ScenarioError, match="limits"):
            load(f"{text}[limits]\n{wrong}\n")


@pytest.mark.parametrize("blamed", range(3))
def test_the_override_that_is_wrong_is_blamed_among_others(blamed: int) -> None:
    """Whatever comes before it and after it."""
    overrides = ["duration=21 s", "seed=7", "motor.lag=1 ms"]
    overrides.insert(blamed, "pilot.m_p=3")
    with pytest.raises(ScenarioError) as refused:
        scenario.load("steady", overrides)
    assert str(refused.value).startswith("--set pilot.m_p=3: pilot.m_p: 3 is not")


def test_angles_of_a_lever_may_be_below_0_and_nothing_else(load: Load) -> None:
    text = scenario.SHELF.content("steady").decode()
    assert load(text, "lever.lever_preload_angle=-0.1 rad").true_lever.lever_preload_angle == -0.1
    with pytest.raises(ScenarioError, match=r"lever\.lever_friction"):
        load(text, "lever.lever_friction=-0.1 N m")


MINIMAL = """
title = "t"
duration = "1 s"
[pilot]
trim = "20 deg"
m_p = "2 kg"
c_p = "50 N s/m"
k_p = "2000 N/m"
"""


def test_what_a_scenario_does_not_say_is_as_the_readme_has_it(load: Load) -> None:
    plain = load(MINIMAL)
    assert (plain.seed, plain.converged_after, plain.motor.lag, plain.description) == (1, 15.0, 2e-3, "")
    assert (plain.pilot.model, plain.pilot.preload, plain.pilot.process_noise) == ("lever", "trim", 0.05)
    assert (plain.base, plain.torque, plain.disturbance, plain.aircraft, plain.limits) == ((), (), (), None, None)
    sensors = plain.sensors
    noise = {name: getattr(sensors, name).noise for name in ("theta", "theta_dot", "z_ddot", "tau_m")}
    assert noise == {"theta": 1e-3, "theta_dot": 0.01, "z_ddot": 0.01, "tau_m": 2e-3}
    assert (sensors.grip_force, sensors.dropout) == (None, ())
    seated: Any = load(MINIMAL.replace("[pilot]", '[pilot]\nmodel = "two_dof"')).pilot
    assert [each.value for each in (seated.m_t, seated.c_t, seated.k_t)] == [45.0, 1000.0, 36000.0]
    reflex = MINIMAL.replace("[pilot]", '[pilot]\nmodel = "reflex"\nk_r = "300 N/m"\nc_r = "10 N s/m"')
    pilot: Any = load(reflex).pilot
    assert pilot.delay == 0.035


def test_hands_are_those_of_mayo() -> None:
    """R. Mayo, The involuntary participation of a human pilot in a helicopter collective control loop (1989)."""
    assert {name: (hand.damping, hand.lead, hand.stiffness) for name, hand in mayo_plant.HANDS.items()} == {
        "ectomorphic": (13.70, 5.19, 452.3),
        "mesomorphic": (13.31, 4.02, 555.4),
    }
    assert mayo_plant.HANDS["ectomorphic"].outside == pytest.approx(8.51)
