"""The closed loop in C against the run in Python, sample by sample."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.can.commander import KEEP, Commander
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.native import lib, run_samples
from lever_sil.aircraft import aircraft
from lever_sil.aircraft.aircraft import Coupled
from lever_sil.aircraft.flight import Flight
from lever_sil.fast import aircraft as fast_aircraft
from lever_sil.fast import plants
from lever_sil.fast.library import Struct
from lever_sil.fast.library import lib as loop_lib
from lever_sil.run import in_process, loop
from lever_sil.scenarios import inputs, scenario
from lever_sil.scenarios.scenario import Scenario
from python.fast.flown import fly

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
    with LeverBus(config=wanted.config, aircraft=wanted.known_aircraft) as bus:
        return loop.run(wanted, bus)


@pytest.mark.parametrize("name", scenario.names())
def test_the_lever_moves_as_in_python_whoever_holds_it(name: str) -> None:
    wanted = scenario.load(name, ["duration=1.5 s"])
    slow, quick = python_run(wanted), fly(wanted, by_frames=True, stride=wanted.period)
    assert np.abs(quick.theta - slow.theta).max() < SAME
    assert np.abs(quick.theta_dot - slow.theta_dot).max() < SAME


@pytest.mark.parametrize("period", [1e-3, 2.5e-3])
def test_an_aircraft_flies_as_in_python(period: float) -> None:
    """To the bit, also at the actuator's limits and with a correction that comes late."""
    craft = aircraft.load("puma_like", correction_delay="5 ms")
    delta, correction, gust = np.random.default_rng(1).standard_normal((3, 400)).cumsum(axis=1) * 0.05
    flight, struct, put_out = Flight(Coupled(craft, 0.6), period, gust), Struct("aircraft_t"), np.zeros(400)
    fast_aircraft.fill(struct, struct.pointer, flight, put_out)
    for sample in range(399):
        given = float(delta[sample]), float(correction[sample])
        assert loop_lib.aircraft_advance(struct.pointer, sample, *given) == flight.advance(*given)
    assert np.array_equal(put_out[:399], correction[:399])


def test_sensors_that_are_late_and_wrong_read_as_in_python() -> None:
    wanted = scenario.load("steady", ["duration=2 s", *LATE_AND_WRONG])
    slow, quick = python_run(wanted), fly(wanted, by_frames=True, stride=wanted.period)
    assert np.abs(quick.theta - slow.theta).max() < SAME  # dither, of the firmware, depends on what it is told


def test_by_structs_the_firmware_gets_what_the_sensors_read() -> None:
    wanted = scenario.load("base_only", ["duration=3 s"])
    known, every = inputs.prepare(wanted), 20
    quick = fly(wanted, stride=wanted.period)
    assert np.abs(quick.theta - python_run(wanted).theta).max() < SAME
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
    run = fly(wanted, stride=every * wanted.period)
    assert np.array_equal(run.time, known.time[at])
    for index, name in enumerate(("m_p", "c_p", "k_p")):
        assert np.array_equal(run.estimate[name], expected["parameter"][:, index])
        assert np.array_equal(run.sigma[name], expected["parameter_sigma"][:, index])
        assert np.array_equal(run.truth[name], known.truth.parameters[name][at])
    assert np.array_equal(run.estimate["natural_frequency"], expected["natural_frequency"])
    assert np.array_equal(run.nis, expected["nis"])
    assert np.array_equal(run.faults, expected["faults"])
    assert np.array_equal(run.mode, expected["mode"])


MITIGATED = ("duration=6 s", "aircraft.gearing=0.3 1", "estimator.mitigation=cancellation_and_damping")
GAPS = 'sensors.dropout=[{what="base_frame", share="60 %", burst="150 ms", start="2 s"}]'


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        *(
            (name, ["duration=4.5 s"])  # 18 commands, whose counter begins anew after 16
            for name in ("steady", "grip_force", "sensor_dropout", "sensor_faults", "mayo_ectomorphic")
        ),
        ("bounce", MITIGATED),
        ("bounce", (*MITIGATED, "aircraft.correction_delay=5 ms", "aircraft.lever_low_pass=5 Hz", GAPS)),
    ],
)
def test_a_run_in_process_has_the_frames_of_one_over_a_bus(name: str, overrides: Sequence[str]) -> None:
    wanted = scenario.load(name, overrides)
    slow, quick = python_run(wanted), in_process.run(wanted)
    for column, expected in vars(slow.frames()).items():
        assert np.array_equal(vars(quick.frames())[column], expected)
    assert (quick.unanswered, quick.misplaced) == (slow.unanswered, slow.misplaced)
    assert quick.identity.settings_crc == wanted.config.settings_crc


def test_what_is_beyond_the_range_of_a_frame_is_not_available_by_structs_either() -> None:
    sensors = [
        f"sensors.{name}.fault=[{{kind='spikes', start='1 s', share='20 %', size='{size}'}}]"
        for name, size in (("theta", "4 rad"), ("theta_dot", "20 rad/s"), ("tau_m", "40 N m"), ("z_ddot", "40 m/s^2"))
    ]
    wanted = scenario.load("steady", ["duration=3 s", "limits={}", *sensors])
    missing = lib.LEVER_FAULT_THETA | lib.LEVER_FAULT_THETA_DOT | lib.LEVER_FAULT_TORQUE
    by_structs, by_frames = (fly(wanted, framed, stride=1e-3) for framed in (False, True))
    assert np.array_equal(by_structs.faults & missing, by_frames.faults & missing)
    assert all((by_structs.faults & fault).any() for fault in (missing, lib.LEVER_FAULT_BASE))


LOSSY = 'sensors.dropout=[{what="base_frame", share="50 %", burst="20 ms", start="1 s"}]'


def test_unanswered_samples_are_counted_and_too_many_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = scenario.load("steady", ["duration=2 s", LOSSY])
    assert 0 < in_process.run(wanted).unanswered == python_run(wanted).unanswered
    monkeypatch.setattr(loop, "MOST_UNANSWERED", 1)
    places = []
    for run in (python_run, in_process.run):
        with pytest.raises(loop.NoAnswerError, match="no STATE_ESTIMATE") as silent:
            run(wanted)
        places.append(re.findall(r"at sample (\d+)", str(silent.value)))
    assert places[0] == places[1]


def test_a_command_that_is_refused_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = scenario.load("steady", ["duration=1 s"])
    first = codec.encode("COMMAND", 0, {"request": "reset", **KEEP})
    monkeypatch.setattr(inputs, "commands", lambda *_: {0: {"request": "reset"}, 100: {}})
    monkeypatch.setattr(Commander, "send", lambda _, values, put: put(0x120, first))
    with pytest.raises(loop.RefusedError, match="its counter is out of sequence"):
        in_process.run(wanted)
    monkeypatch.setattr(inputs, "commands", lambda *_: {0: {"request": "reset", "dither_rms": -1.0}})
    with pytest.raises(LeverError, match="refuses COMMAND"):
        fly(wanted)


def test_who_has_no_plant_in_c_runs_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = scenario.load("base_only", ["duration=1 s"])
    quick = in_process.run(wanted)
    monkeypatch.setattr(plants, "has", lambda _: False)
    assert in_process.run(wanted).frames().data.tobytes() == quick.frames().data.tobytes()
    with pytest.raises(LeverError, match="in Python only"):
        fly(wanted)
