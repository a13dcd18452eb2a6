"""Scenarios: those that come with the package keep what is promised of them; files that are wrong are refused well."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.native import Estimator
from lever_sil.plants import excitation
from lever_sil.scenarios import scenario
from lever_sil.scenarios.random_streams import stream
from lever_sil.scenarios.scenario import Scenario
from lever_sil.toml_tables import ScenarioError

REQUIRED = {
    "steady", "fatigue_drift", "sudden_grip", "base_only", "base_dither", "poor_excitation", "sensor_dropout",
    "re_trim", "high_noise", "demo", "linear_physical", "linear_black_box", "two_dof", "mayo_ectomorphic",
    "mayo_mesomorphic", "relaxed_hand", "moving_pilot", "grip_moves", "friction", "hands_off", "rough_air",
    "sensor_faults", "unknown_torque", "ramp_of_damping", "hysteretic", "reflex",
}  # fmt: skip
NOTHING_PROMISED = {"moving_pilot", "rough_air", "sensor_faults", "unknown_torque"}
"""Scenarios in which the estimator cannot be right all the time."""
LEAST = """
title = "t"
duration = "1 s"
[pilot]
trim = "20 deg"
m_p = "3 kg"
c_p = "50 N s/m"
k_p = "2000 N/m"
"""
BLACK_BOX = """
title = "t"
duration = "1 s"
[pilot]
model = "linear_black_box"
trim = "20 deg"
a21 = "-500 1/s^2"
a22 = "-9 1/s"
b21 = "2 1"
"""
MAYO = """
title = "t"
duration = "1 s"
[pilot]
model = "hand"
somatotype = "ectomorphic"
trim = '20 deg'
"""
FIRMWARE_TORQUE = "[[torque]]\nkind = 'firmware'\nrms = '1 N m'\n"
SINE_TORQUE = "[[torque]]\nkind = 'sine'\nrms = '1 N m'\nfrequency = '1 Hz'\n"

Load = Callable[..., Scenario]


@pytest.mark.parametrize("name", scenario.names())
def test_a_scenario_says_what_it_is_and_starts_from_a_wrong_guess(name: str) -> None:
    loaded = scenario.load(name)
    assert loaded.name == name
    assert len(loaded.title) > 10
    told = "first guess" in loaded.description.lower()
    assert told, f"{name}: its description does not say how far the pilot is from the first guess; add a sentence on it"
    truth = loaded.truth(loaded.time())
    if loaded.pilot.model == loaded.config.choices["model"]:
        guesses = {name: (loaded.config.settings[name], true[0]) for name, true in truth.parameters.items()}
    else:
        guess = Estimator(loaded.config).estimate().natural_frequency
        guesses = {"natural_frequency": (guess, truth.dynamics.natural_frequency[0])}
    for name, (guess, true) in guesses.items():
        assert abs(guess / true - 1.0) >= 0.2, name
    assert ("natural_frequency" in (loaded.limits or {})) is (loaded.name not in NOTHING_PROMISED)


@pytest.mark.parametrize("name", scenario.names())
def test_the_standard_values_are_used(name: str) -> None:
    loaded = scenario.load(name)
    noise = loaded.base[0]
    assert isinstance(noise, excitation.Noise)
    strength = 0.980665 if loaded.aircraft is None else 0.4903325  # of gusts, which the loop amplifies
    assert (noise.rms, noise.low, noise.high) == pytest.approx((strength, 1.0, 10.0))
    strength = 1.0 if name == "linear_physical" else 0.3
    assert all(dither.rms == strength for dither in loaded.torque if isinstance(dither, scenario.FirmwareDither))
    assert loaded.pilot.process_noise == (0.5 if name == "rough_air" else 0.05)
    times = 5 if name == "high_noise" else 1
    assert (loaded.sensors.theta.noise, loaded.sensors.theta_dot.noise) == (times * 1e-3, times * 1e-2)


def test_settings_are_the_firmwares_but_for_overrides(load: Load) -> None:
    assert load(LEAST).config.settings == Config().settings
    changed = load(LEAST + '[settings]\ntheta_noise = "2 mrad"\nlever_length = "40 cm"\n')
    assert {k for k, v in changed.config.settings.items() if v != Config().settings[k]} == {
        "theta_noise",
        "lever_length",
    }
    assert changed.config.settings["theta_noise"] == 0.002
    assert changed.true_lever.lever_length == 0.4


@pytest.mark.parametrize(("what", "noise"), [("theta", 1e-3), ("theta_dot", 1e-2), ("z_ddot", 0.01), ("tau_m", 2e-3)])
def test_a_sensor_keeps_the_noise_that_its_table_does_not_name(load: Load, what: str, noise: float) -> None:
    sensor = getattr(load(LEAST, f"sensors.{what}.delay=3 ms").sensors, what)
    assert (sensor.noise, sensor.delay) == (noise, 3e-3)


def test_where_he_lets_go_the_lever_keeps_its_place_until_he_takes_it_again(load: Load) -> None:
    moving = 'trim = { kind = "ramp", first = "20 deg", last = "30 deg", start = "0 s", duration = "1 s" }'
    off = 'hands_off = [{ start = "0.3 s", end = "0.5 s" }, { start = "0.8 s" }]\n'
    loaded = load(LEAST.replace('trim = "20 deg"', moving) + off)
    rest = np.degrees(loaded.truth(loaded.time()).rest)
    assert rest[[299, 300, 499, 500, 799, 999]] == pytest.approx([22.99, 22.99, 22.99, 25.0, 27.99, 27.99])
    assert loaded.changes() == (0.0, 0.3, 0.5, 0.8)


def test_each_name_has_a_stream_of_its_own() -> None:
    """Those that are not numbered too; the first numbers are what numpy's SeedSequence makes of seed and place."""
    purposes = ("process", "theta", "m_p", "fault", "k_trunk", "k_trunk2", "grip")
    numbers = [stream(1, purpose, index).random() for purpose in purposes for index in range(3)]
    assert len(set(numbers)) == len(numbers)
    assert numbers == [stream(1, purpose, index).random() for purpose in purposes for index in range(3)]
    assert stream(2, "grip").random() != stream(1, "grip").random()
    for purpose, place in (("process", 0), ("trim", 8), ("fault", 24)):
        numpys = np.random.default_rng(np.random.SeedSequence(7, spawn_key=(place, 3)))
        assert stream(7, purpose, 3).random() == numpys.random()


def test_changes_and_dithers_are_listed_in_order_of_time(load: Load) -> None:
    loaded = load(
        LEAST.replace(
            '"3 kg"', '{ kind = "steps", first = "3 kg", at = ["0.7 s", "9 s"], to = ["4 kg", "5 kg"] }'
        ).replace('"2000 N/m"', '{ kind = "steps", first = "2 N/m", at = ["0.5 s"], to = ["3 N/m"] }')
        + '[[torque]]\nkind = "firmware"\nrms = "0.3 N m"\nend = "0.4 s"\n'
        + '[[torque]]\nkind = "firmware"\nrms = "0.2 N m"\nstart = "0.6 s"\n'
    )
    assert loaded.changes() == (0.0, 0.5, 0.7)
    assert loaded.dithers() == [(0.0, 0.3), (0.4, 0.0), (0.6, 0.2)]


def test_overrides_replace_values_with_or_without_quotes(load: Load) -> None:
    base = '[[base]]\nkind = "sine"\nrms = "0.1 g"\nfrequency = "3 Hz"\n'
    loaded = load(
        LEAST + base, "duration=2 s", 'base.0.rms="1 m/s^2"', "settings.m_p=3 kg", "seed=9", "pilot.m_p='4 kg'"
    )
    assert (loaded.duration, loaded.seed, loaded.config.settings["m_p"]) == (2.0, 9, 3.0)
    assert loaded.base[0].rms == 1.0  # type: ignore[attr-defined]
    assert loaded.truth(loaded.time()).parameters["m_p"][0] == 4.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            LEAST.replace("k_p", "k_q"),
            r"made.toml: pilot: unknown key 'k_q'; did you mean k_p",
        ),
        (LEAST.replace('m_p = "3 kg"', ""), "pilot: key 'm_p' is missing"),
        (LEAST.replace('trim = "20 deg"', ""), "pilot: key 'trim' is missing"),
        (LEAST.replace('"3 kg"', "3"), "pilot.m_p: 3 is not a quantity"),
        (LEAST.replace('"3 kg"', '"3 g/s"'), "pilot.m_p: '3 g/s' has unit 'g/s'; allowed: kg, g"),
        (LEAST.replace('"1 s"', '"2 h"'), "duration: '2 h' is out of range; it must be above 0 and at most 3600 s"),
        (LEAST.replace('"3 kg"', '"-3 kg"'), "pilot.m_p: falls to -3; it must stay above 0"),
        (LEAST.replace("20 deg", "-95 deg"), "pilot.trim: moves by 95 deg; it must stay below 90 deg"),
        (BLACK_BOX.replace("-9 1/s", "1 1/s"), "pilot.a22: rises to 1; it must stay below 0"),
        (BLACK_BOX + SINE_TORQUE, "torque: no torque acts on a pilot of model linear_black_box; remove it"),
        (MAYO + SINE_TORQUE, "torque: no torque acts on a pilot of model hand; remove it"),
        (MAYO + FIRMWARE_TORQUE, "torque: no torque acts on a pilot of model hand"),
        (MAYO + SINE_TORQUE.replace("torque", "disturbance"), "disturbance: no torque acts on a pilot of model hand"),
        (
            MAYO.replace("ecto", "endo"),
            "pilot.somatotype: 'endomorphic' is not known; allowed: ectomorphic, mesomorphic",
        ),
        (MAYO.replace("trim = '20 deg'", "preload = 'fixed'"), "pilot.preload: 'fixed' is not known; allowed: trim"),
        (LEAST + "model = 'two_dof'\nk_t = '-1 N/m'", "pilot.k_t: falls to -1; it must stay above 0"),
        (BLACK_BOX + "[limits]\na21 = '5 %'", "limits.a21: this run has no true value of it"),
        (LEAST + "[limits]\nm_q = '5 %'", "limits: unknown key 'm_q'; did you mean m_p"),
        (LEAST + 'preload = "loose"', "pilot.preload: 'loose' is not known; allowed: trim, fixed"),
        (LEAST + 'preload = "fixed"', "'trim' goes with preload trim"),
        (LEAST + "[estimator]\nadaptation = 'magic'", "allowed: fixed, annealing, robbins_monro, forgetting"),
        (LEAST + "[settings]\ntheta_nose = '1 rad'", "settings: unknown key 'theta_nose'; did you mean theta_noise"),
        (LEAST + "[settings]\ntheta_noise = '9 rad'", "made.toml: settings: theta_noise = 9.0 is out of range"),
        (LEAST + "[lever]\ntheta_noise = '9 rad'", "lever: unknown key 'theta_noise'; allowed: lever_length"),
        (LEAST + "[lever]\nlever_friction = '-1 N m'", "lever.lever_friction: '-1 N m' is out of range; it must be at"),
        (LEAST + "hands_off = [{ end = '1 s' }]", r"pilot.hands_off\[0\]: key 'start' is missing"),
        (LEAST + "hands_off = [{ start = '2 s', end = '1 s' }]", r"hands_off\[0\]: start 2 s is not before end 1 s"),
        (
            LEAST.replace('trim = "20 deg"', "preload = 'fixed'\nhands_off = [{ start = '1 s' }]"),
            "pilot: 'hands_off' goes with preload trim",
        ),
        (
            LEAST + "[sensors]\ntheta = { fault = [{ kind = 'spikes', share = '1 %', size = '1 g' }] }",
            r"sensors.theta.fault\[0\].size: '1 g' has unit 'g'; allowed: rad",
        ),
        (
            LEAST + "[sensors]\ntheta = { fault = [{ kind = 'loose' }] }",
            r"sensors.theta.fault\[0\]: must be a table with kind = one of stuck, reads, late, scale, offset, spikes",
        ),
        (LEAST + "[[torque]]\nkind = 'sine'\nrms = '1 g'\nfrequency = '1 Hz'", r"torque\[0\].rms: '1 g' has unit 'g'"),
        (LEAST + "[[sensors.dropout]]\nwhat = 'all'\nshare = '1 %'", r"sensors.dropout\[0\].what: 'all' is not known"),
        (
            LEAST + "[[sensors.dropout]]\nwhat = 'theta'\nshare = '1 %'\nstart = '2 s'\nend = '1 s'",
            r"sensors.dropout\[0\]: start 2 s is not before end 1 s",
        ),
        (LEAST + "[sensors]\ntheta = { noise = '1 m' }", "sensors.theta.noise: '1 m' has unit 'm'; allowed: rad, mrad"),
        (LEAST + "[base]\nkind = 'sine'", "base: must be a list"),
        ("title =", "made.toml: not TOML"),
        (f"seed = {'9' * 5000}", "made.toml: not TOML"),
    ],
)
def test_what_is_wrong_is_refused_with_file_key_and_remedy(load: Load, text: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        load(text)


@pytest.mark.parametrize("value", ["[" * 3000 + "]" * 3000, "{a=" * 3000 + "1" + "}" * 3000], ids=["list", "table"])
def test_what_is_nested_too_deeply_is_refused(load: Load, value: str) -> None:
    for text, overrides in ((f"title = {value}", ()), (LEAST, (f"title={value}",))):
        with pytest.raises(ScenarioError, match=r": its tables or lists are nested too deeply"):
            load(text, *overrides)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("duration", "must be KEY=VALUE"),
        ("pilot.m_p.first=3 kg", "the scenario has no 'pilot.m_p.first'"),
        ("title.x=3", "the scenario has no 'title.x'"),
        ("colour=red", "^--set colour=red: unknown key 'colour'"),
        ("durration=3", "^--set durration=3: unknown key 'durration'; did you mean duration?"),
        (
            "pilot.colour=red",
            "pilot: unknown key 'colour'; allowed: trim, preload, process_noise, m_p, c_p, k_p, hands_off",
        ),
        ("duration=2 h", "^--set duration=2 h: duration: '2 h' is out of range"),
        ("theta_noise=9 rad", "^--set theta_noise=9 rad: settings: theta_noise = 9.0 is out of range"),
        (
            "torque.1={kind='firmware',rms='1 N m'}",
            r"no 'torque.1'; torque has 0 entries, .* torque.0=\{...\} appends one",
        ),
        ("aircraft={name='uh60_like'}", "aircraft: unknown key 'name'; allowed: model, gearing, title, accelerometer"),
    ],
)
def test_a_wrong_override_is_refused(load: Load, override: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        load(LEAST, "seed=3", override, "converged_after=1 s")


def test_what_is_no_toml_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "steady.log").touch()
    for path, what in ((tmp_path, "a folder"), (tmp_path / "steady.log", r"no \.toml file")):
        with pytest.raises(ScenarioError, match=rf"is {what}: give the \.toml file of one scenario, or base_dither, "):
            scenario.load(path)


def test_an_error_of_the_file_is_not_blamed_on_an_override(load: Load) -> None:
    with pytest.raises(ScenarioError, match=r"^[^-].*made\.toml: title: 1 is not a string"):
        load(LEAST.replace('"t"', "1"), "seed=3")


def test_an_override_appends_to_a_list(load: Load) -> None:
    """One that the scenario has, and one that it has not."""
    entry = "{kind='sine',rms='0.05 g',frequency='3 Hz'}"
    loaded = load(LEAST, f"base.0={entry}", f"base.1={entry}", "base.1.frequency=5 Hz")
    assert [each.frequency for each in loaded.base if isinstance(each, excitation.Sine)] == [3.0, 5.0]


def test_a_number_of_unit_1_needs_no_unit(load: Load) -> None:
    loaded = load(LEAST + "[aircraft]\nmodel = 'uh60_like'\ngearing = 0.5\nlock_number = '7'\n")
    assert loaded.aircraft is not None
    assert loaded.aircraft.gearing == 0.5
    assert getattr(loaded.aircraft.aircraft, "lock_number", None) == 7.0


def test_an_unknown_scenario_or_file_is_refused_with_what_there_is() -> None:
    with pytest.raises(ScenarioError, match="no scenario 'nope'; there are base_dither, base_only"):
        scenario.load("nope")
    with pytest.raises(ScenarioError, match=r"nope\.toml: no such file"):
        scenario.load("nope.toml")
