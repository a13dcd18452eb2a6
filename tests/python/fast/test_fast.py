"""The closed loop in C against the run in Python, sample by sample."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.host_tools.can.bus import LeverBus
from lever_cdkf.host_tools.firmware.native import run_samples
from lever_cdkf.sil import fast
from lever_cdkf.sil.run import loop
from lever_cdkf.sil.scenarios import inputs, scenario
from lever_cdkf.sil.scenarios.scenario import Scenario

SAME = 1e-9
"""[rad], [rad/s]: the C and Python may have different sines."""

LATE_AND_WRONG = (
    "sensors.theta.delay=1.3 ms",
    "sensors.theta.gain_error=1 %",
    "sensors.theta_dot.delay=3 ms",
    "sensors.tau_m.bias=0.02 N m",
    'sensors.theta_dot.fault=[{kind="stuck", start="1 s", end="1.2 s"}]',
    'sensors.theta.fault=[{kind="spikes", share="2 %", size="0.1 rad"}]',
)


def python_run(wanted: Scenario) -> loop.Recording:
    with LeverBus(config=wanted.config) as bus:
        return loop.run(wanted, bus)


@pytest.mark.parametrize("name", scenario.names())
def test_the_lever_moves_as_in_python_whoever_holds_it(name: str) -> None:
    wanted = scenario.load(name, ["duration=3 s"])
    slow, quick = python_run(wanted), fast.run(wanted, through_frames=True, stride=wanted.period)
    assert np.abs(quick.theta - slow.theta).max() < SAME
    assert np.abs(quick.theta_dot - slow.theta_dot).max() < SAME


def test_sensors_that_are_late_and_wrong_read_as_in_python() -> None:
    wanted = scenario.load("steady", ["duration=3 s", *LATE_AND_WRONG])
    slow, quick = python_run(wanted), fast.run(wanted, through_frames=True, stride=wanted.period)
    assert np.abs(quick.theta - slow.theta).max() < SAME  # dither, of the firmware, depends on what it is told


def test_by_structs_the_firmware_gets_what_the_sensors_read() -> None:
    wanted = scenario.load("base_only", ["duration=3 s"])
    known, every = inputs.prepare(wanted), 20
    quick = fast.run(wanted, stride=wanted.period)
    offsets = {name: inputs.readings(wanted, known, name).offsets for name in ("theta", "theta_dot", "tau_m")}
    samples = {
        "time_us": np.arange(len(known.time)) * 1000,
        "theta": quick.theta + offsets["theta"],
        "theta_dot": quick.theta_dot + offsets["theta_dot"],
        "tau_m": offsets["tau_m"],
        "z_ddot": known.z_ddot_measured,
    }
    at = np.arange(0, len(known.time), every)
    expected = run_samples(wanted.config, samples, at)
    run = fast.run(wanted, stride=every * wanted.period)
    assert np.array_equal(run.time, known.time[at])
    for index, name in enumerate(("m_p", "c_p", "k_p")):
        assert np.array_equal(run.estimate[name], expected["parameter"][:, index])
        assert np.array_equal(run.sigma[name], expected["parameter_sigma"][:, index])
        assert np.array_equal(run.truth[name], known.truth.parameters[name][at])
    assert np.array_equal(run.estimate["natural_frequency"], expected["natural_frequency"])
    assert np.array_equal(run.nis, expected["nis"])
    assert np.array_equal(run.faults, expected["faults"])
    assert np.array_equal(run.mode, expected["mode"])
