"""Logs of simulated runs whose noise is known."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from lever_sil.run import buslog, runner
from lever_sil.scenarios import scenario

Simulate = Callable[..., Path]

NOISE = {"theta_noise": 0.5e-3, "theta_dot_noise": 20e-3, "theta_dot_process_noise": 0.03}
"""Of these runs: half, twice and three fifths of the firmware's defaults."""
CALIBRATION = {"gain_error": 0.0, "delay": 0.0, "friction": 0.0}
"""Of the accelerometer [1, s] and the lever [N m]."""
LOADS = {"base": 0.1, "torque": 0.3, "tremor": 0.0}
"""rms of base [g], dither [N m] and a torque that nobody measures [N m]."""
WALK = {"c_p_walk": 0.04, "k_p_walk": 0.06}
"""Of those whose pilot changes [1/sqrt(s)]."""
PILOT = {"c_p": "48 N s/m", "k_p": "1700 N/m"}
CHANGING = {
    name: f'{{ kind = "random_walk", first = "{PILOT[name]}", rate = "{WALK[f"{name}_walk"]} 1/sqrt(s)", '
    f'least = "{least}", greatest = "{greatest}" }}'
    for name, least, greatest in (("c_p", "15 N s/m", "140 N s/m"), ("k_p", "500 N/m", "3900 N/m"))
}
REGRIP = {
    name: f'{{ kind = "steps", first = "{first}", at = ["30 s"], to = ["{then}"] }}'
    for name, first, then in (("c_p", "48 N s/m", "75 N s/m"), ("k_p", "1700 N/m", "2600 N/m"))
}
"""A pilot who tightens his grip."""

_SCENARIO = """
title = "Known noise"
duration = "{duration} s"
converged_after = "5 s"
[pilot]
trim = "20 deg"
m_p = "2.8 kg"
c_p = {c_p}
k_p = {k_p}
process_noise = "{theta_dot_process_noise} rad/s/sqrt(s)"
[[base]]
kind = "noise"
rms = "{base} g"
low = "1 Hz"
high = "10 Hz"
[sensors]
theta = {{ noise = "{theta_noise} rad" }}
theta_dot = {{ noise = "{theta_dot_noise} rad/s" }}
z_ddot = {{ noise = "0.01 m/s^2", gain_error = "{gain_error} 1", delay = "{delay} s" }}
[lever]
lever_friction = "{friction} N m"
[[disturbance]]
kind = "noise"
rms = "{tremor} N m"
low = "3 Hz"
high = "5 Hz"
[[torque]]
kind = "firmware"
rms = "{torque} N m"
"""


@pytest.fixture(scope="session")
def simulate(tmp_path_factory: pytest.TempPathFactory) -> Simulate:
    """simulate(duration, changing=False, rest=False, regrip=False, **others): the bus.log of a run of so many seconds.

    `others` are of NOISE, CALIBRATION and LOADS.
    """

    def run(
        duration: float, *, changing: bool = False, rest: bool = False, regrip: bool = False, **others: float
    ) -> Path:
        folder = tmp_path_factory.mktemp("log")
        pilot = CHANGING if changing else {name: f'"{value}"' for name, value in PILOT.items()}
        pilot = REGRIP if regrip else pilot
        shaken = {"base": 0.0001, "torque": 0.0001} if rest else {}
        values = {**LOADS, **NOISE, **CALIBRATION, **pilot, **shaken, **others}
        (folder / "known.toml").write_text(_SCENARIO.format(duration=duration, **values))
        loaded = scenario.load(str(folder / "known.toml"))
        frames = runner.simulate(loaded).frames
        log = folder / "bus.log"
        log.write_bytes(b"".join(buslog.lines(frames, "vcan0")))
        return log

    return run


@pytest.fixture(scope="session")
def steady_log(simulate: Simulate) -> Path:
    """Forty seconds of a pilot who does not change."""
    return simulate(40.0)
