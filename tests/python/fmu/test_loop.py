"""pilot.fmu and lever.fmu, co-simulated by FMPy, are `lever sim` to the bit; and what FMPy says of them."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.library import enum_names
from lever_sil.run import in_process
from lever_sil.scenarios.scenario import Scenario, load
from python.fast.flown import fly
from python.fmu.importer import Instance, Loop, unpacked

ESTIMATES = ("m_p", "c_p", "k_p", "natural_frequency", "damping_ratio")
TRUE = ("true_theta", "true_theta_dot", "true_tau_m")
CONTROLLED = (*(f"{name}_estimate" for name in ESTIMATES[:3]), *ESTIMATES[3:])
SIGMA = (*(f"{name}_estimate_sigma" for name in ESTIMATES[:3]), *(f"{name}_sigma" for name in ESTIMATES[3:]))


@pytest.mark.parametrize("name", ["lever.fmu", "pilot.fmu"])
def test_fmpy_finds_nothing_wrong(name: str, fmus: Path) -> None:
    """By the XML schemas of FMI 3.0, and by its own checks of names, units, start values and structure."""
    assert validate_fmu(str(fmus / name)) == []


def compared(scenario: Scenario, loop: Loop, seconds: float = math.inf) -> list[str]:
    """Return what differs from `lever sim` in a whole run, or in so much of it."""
    count = round(min(seconds, scenario.duration) / scenario.period)
    true, estimate = np.empty((count, len(TRUE))), np.empty((count, len(CONTROLLED) + len(SIGMA) + 1))
    references = [loop.pilot.reference[name] for name in TRUE]
    estimated = [loop.controller.reference[name] for name in (*CONTROLLED, *SIGMA, "nis")]
    for sample in range(count):
        true[sample] = loop.pilot.slave.getFloat64(references)
        loop.step()
        estimate[sample] = loop.controller.slave.getFloat64(estimated)
    recording = in_process.run(scenario)
    wanted = fly(scenario, by_frames=True, stride=scenario.period)
    columns = {name: (true[:, i], getattr(recording, name.removeprefix("true_"))) for i, name in enumerate(TRUE)}
    for i, name in enumerate(ESTIMATES):
        columns[name] = (estimate[:, i], wanted.estimate[name])
        columns[f"{name}_sigma"] = (estimate[:, len(CONTROLLED) + i], wanted.sigma[name])
    columns["nis"] = (estimate[:, -1], wanted.nis)
    return [name for name, (own, other) in columns.items() if not np.array_equal(own, other[:count])]


def test_a_minute_with_dither_is_lever_sim_to_the_bit(controller: Path, pilot: Path) -> None:
    scenario = load("demo")
    assert (len(scenario.time()), scenario.dithers()) == (60_000, [(0.0, 0.3)])
    loop = Loop(Instance(pilot), Instance(controller))
    assert compared(scenario, loop) == []
    assert loop.pilot.get("true_tau_m")["true_tau_m"] != 0.0
    assert loop.controller.messages == loop.pilot.messages == []


def test_another_seed_is_another_run(controller: Path, pilot: Path) -> None:
    scenario = load("demo", ["seed=11"])
    loop = Loop(Instance(pilot, parameters={"seed": 11}), Instance(controller))
    assert compared(scenario, loop, seconds=20.0) == []


@pytest.mark.parametrize("name", ["two_dof", "hysteretic", "reflex", "grip_force"])
def test_other_pilots_too(name: str, controller: Path, tmp_path: Path) -> None:
    """The controller with the settings of the scenario as parameters."""
    scenario = load(name, ["duration=6 s"])
    fmu = tmp_path / "pilot.fmu"
    assert main(["fmu", "pilot", "-o", str(fmu), "--scenario", name, "--set", "duration=6 s"]) == 0
    own = Instance(controller, parameters=scenario.config.settings)
    assert compared(scenario, Loop(Instance(unpacked(fmu, tmp_path / "pilot")), own)) == []


def bounce(mitigation: str, *changes: str) -> tuple[Scenario, list[str]]:
    """Return six seconds of the scenario bounce with these changes, and the options that make them."""
    overrides = ["duration=6 s", f"mitigation={mitigation}", *changes]
    return load("bounce", overrides), [text for each in overrides for text in ("--set", each)]


@pytest.fixture(scope="module")
def watching(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a controller with the aircraft and all settings of the scenario bounce, unpacked."""
    folder = tmp_path_factory.mktemp("watching")
    config = bounce("cancellation_and_damping")[0].config
    own = [f"{name}={value}" for name, value in {**config.choices, **config.settings}.items()]
    options = [*(text for each in own for text in ("--set", each)), "--aircraft", "uh60_like,gearing=0.5"]
    assert main(["fmu", "controller", "-o", str(folder / "c.fmu"), *options]) == 0
    return unpacked(folder / "c.fmu", folder / "c")


@pytest.mark.parametrize(
    ("changed", "parameters"),
    [
        (["cancellation_and_damping"], []),
        (["cancellation", 'torque=[{kind="firmware", rms="0 N m"}]'], ["mitigation"]),
    ],
)
def test_a_helicopter_with_mitigation_too(
    changed: list[str], parameters: list[str], watching: Path, tmp_path: Path
) -> None:
    """The scenario's aircraft moves the cabin; the controller watches the margin, corrects and, with dither, damps. A
    correction by itself needs commands as well, or it ends after a second."""
    scenario, options = bounce(*changed)
    assert main(["fmu", "pilot", "-o", str(tmp_path / "p.fmu"), "--scenario", "bounce", *options]) == 0
    numbers = {name: number for number, name in enum_names("lever_mitigation").items()}
    own = {name: numbers[scenario.config.choices[name]] for name in parameters}
    controller = Instance(watching, parameters=own)
    loop = Loop(Instance(unpacked(tmp_path / "p.fmu", tmp_path / "p")), controller)
    assert compared(scenario, loop) == []
    values = controller.get("gain_margin", "correction", "bounce_state")
    assert values["gain_margin"] > 0.0
    assert values["correction"] != 0.0
    assert values["bounce_state"] > 0


def test_aircraft_closes_the_loop_of_a_scenario_without_one(controller: Path, tmp_path: Path) -> None:
    """The cabin of the pilot answers to the lever, as in the scenario with that table."""
    sets = ("--scenario", "steady", "--set", "duration=2 s")
    assert main(["fmu", "pilot", "-o", str(tmp_path / "p.fmu"), *sets, "--aircraft", "uh60_like,gearing=0.4"]) == 0
    scenario = load("steady", ["duration=2 s", "aircraft.model=uh60_like", "aircraft.gearing=0.4 1"])
    recording = in_process.run(scenario)
    pilot = Instance(unpacked(tmp_path / "p.fmu", tmp_path / "p"))
    loop = Loop(pilot, Instance(controller))
    z_ddot = []
    for _ in range(len(recording.theta)):
        z_ddot.append(pilot.get("true_z_ddot")["true_z_ddot"])
        loop.step()
    assert np.array_equal(z_ddot, recording.inputs.z_ddot)


def test_two_instances_of_each_do_not_meet(controller: Path, pilot: Path) -> None:
    """In one importer, turn by turn, with other seeds and settings: each as it is alone."""

    def made(seed: int, k_p: float) -> Loop:
        return Loop(Instance(pilot, parameters={"seed": seed}), Instance(controller, parameters={"k_p": k_p}))

    def state(loop: Loop) -> list[dict[str, float]]:
        return [each.get(*each.outputs()) for each in (loop.pilot, loop.controller)]

    alone = []
    for arguments in ((10, 1500.0), (11, 2000.0)):
        loop = made(*arguments)
        for _ in range(3000):
            loop.step()
        alone.append(state(loop))
    together = [made(10, 1500.0), made(11, 2000.0)]
    for _ in range(3000):
        for loop in together:
            loop.step()
    assert [state(loop) for loop in together] == alone
    assert alone[0] != alone[1]


def test_a_state_taken_in_flight_goes_on_as_if_nothing_had_been(controller: Path, pilot: Path) -> None:
    """Both restored in place, and from their bytes in other instances: the same outputs to the bit."""
    loop = Loop(Instance(pilot), Instance(controller))
    for _ in range(5000):
        loop.step()
    states = [each.slave.getFMUState() for each in (loop.pilot, loop.controller)]
    pairs = zip((loop.pilot, loop.controller), states, strict=True)
    kept = [each.slave.serializeFMUState(state) for each, state in pairs]

    def flown(loop: Loop) -> list[dict[str, float]]:
        loop.sample = 5000
        seen = []
        for _ in range(2000):
            loop.step()
            seen.append(loop.controller.get(*CONTROLLED, "torque") | loop.pilot.get(*TRUE))
        return seen

    first = flown(loop)
    loop.pilot.slave.setFMUState(states[0])
    loop.controller.slave.setFMUState(states[1])
    assert flown(loop) == first
    others = Loop(Instance(pilot, parameters={"seed": 11}), Instance(controller, parameters={"k_p": 2000.0}))
    for each, content in zip((others.pilot, others.controller), kept, strict=True):
        each.slave.setFMUState(each.slave.deserializeFMUState(content))
    assert flown(others) == first


def test_sources_that_fmpy_compiles_are_the_same(fmus: Path, pilot: Path, tmp_path: Path) -> None:
    """By buildDescription.xml, with FMPy's own build and headers; not optimised, as those in the FMU are."""
    for name in ("lever", "pilot"):
        folder = unpacked(fmus / f"{name}.fmu", tmp_path / name)
        (library,) = (folder / "binaries").glob("*/*.so")
        library.unlink()
        build = tmp_path / f"{name}_build"
        build.mkdir()
        build_platform_binary(folder, build, configuration="Debug")
    loops = [Loop(Instance(tmp_path / "pilot"), Instance(tmp_path / "lever"))]
    loops.append(Loop(Instance(pilot), Instance(unpacked(fmus / "lever.fmu", tmp_path / "again"))))
    for _ in range(2000):
        for loop in loops:
            loop.step()
    one, other = ([each.get(*each.outputs()) for each in (loop.pilot, loop.controller)] for loop in loops)
    assert one == other


def test_size_and_speed(
    fmus: Path, controller: Path, pilot: Path, record_property: Callable[[str, object], None]
) -> None:
    """At least 50 times as fast as real time, by processor time: steps of 0.1 s, so that FMPy's own part is small."""
    for folder, name in ((controller, "lever.fmu"), (pilot, "pilot.fmu")):
        instance = Instance(folder)
        inputs = [each.name for each in instance.description.modelVariables if each.causality == "input"]
        instance.set({each: 0.3 for each in inputs if instance.kind[each] == "Float64"})
        start = clock.process_time()
        for step in range(100):
            instance.step(0.1 * step, 0.1)
        factor = 10.0 / (clock.process_time() - start)
        record_property(f"{name} times real time", round(factor))
        record_property(f"{name} MB", (fmus / name).stat().st_size / 1e6)
        assert factor >= 50.0
    assert (fmus / "lever.fmu").stat().st_size < 1e6
