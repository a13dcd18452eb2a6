"""What is wrong is a message of the FMU and a status, never a crash; and the variables are those of the tables."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest
from fmpy.fmi1 import FMICallException
from lever_cdkf.firmware.library import enum_words
from lever_cdkf.firmware.native import settings_table
from python.fmu.importer import Instance

WARNING, DISCARD, ERROR = 1, 2, 3
SIGNALS = {"theta": 0.3, "theta_dot": 0.0, "z_ddot": 0.0, "tau_m": 0.0}


def status_of(call: Callable[[], object]) -> int:
    """Return what FMPy says that a call has returned."""
    with pytest.raises(FMICallException) as caught:
        call()
    return int(caught.value.status)


def test_parameters_are_the_settings(controller: Path) -> None:
    instance = Instance(controller)
    variables = {each.name: each for each in instance.description.modelVariables}
    for row in settings_table():
        variable = variables[row.name]
        said = (variable.causality, variable.unit or "1", variable.description)
        assert said == ("parameter", row.unit, row.meaning)
        assert [float(variable.start), float(variable.min), float(variable.max)] == [
            row.default,
            row.least,
            row.greatest,
        ]
        assert instance.get(row.name)[row.name] == row.default
    faults = {name: each.description for name, each in variables.items() if name.startswith("fault_")}
    assert faults == {f"fault_{name}": words for name, words in enum_words("lever_fault").items()}


def test_every_quantity_has_its_unit(controller: Path, pilot: Path) -> None:
    """Those of the C's tables, as products of SI base units where there are such."""
    for fmu in (controller, pilot):
        description = Instance(fmu).description
        units = {unit.name: unit.baseUnit for unit in description.unitDefinitions}
        assert {each.unit for each in description.modelVariables if each.unit} == units.keys()
        newton_metre = units["N m"]
        assert (newton_metre.kg, newton_metre.m, newton_metre.s, newton_metre.rad) == (1, 2, -2, 0)


@pytest.mark.parametrize("value", [3.0, -1e-9, math.nan, math.inf])
def test_a_parameter_out_of_its_range(value: float, controller: Path) -> None:
    instance = Instance(controller, start=False)
    assert status_of(lambda: instance.set({"k_p_walk": value})) == ERROR
    assert instance.messages[-1][:2] == (ERROR, "logStatusError")
    assert instance.said.startswith(
        f"k_p_walk = {value:g} is out of range: it must be a number from 0 to 1 1/sqrt(s) ("
    )
    assert instance.get("k_p_walk")["k_p_walk"] == 0.02
    instance.close()


@pytest.mark.parametrize(("name", "value"), [("gap_limit", 1e-2), ("preload", 7), ("mitigation", -1)])
def test_a_parameter_that_does_not_go_with_the_others(name: str, value: float, controller: Path) -> None:
    instance = Instance(controller, start=False)
    instance.set({name: value, "sample_period": 0.02})
    assert status_of(lambda: instance.slave.enterInitializationMode(startTime=0.0)) == ERROR
    assert instance.said == f"{name} = {value:g} does not go with the other settings"


def test_a_parameter_is_fixed_once_it_runs(controller: Path) -> None:
    instance = Instance(controller)
    assert status_of(lambda: instance.set({"k_p": 1000.0})) == ERROR
    assert instance.said == "parameter k_p is fixed: set it before the simulation starts"
    assert status_of(lambda: instance.set({"torque": 1.0})) == ERROR
    assert instance.said == "torque is no input and no parameter: it cannot be set"


@pytest.mark.parametrize("step", [0.0015, 0.0004, 0.0, -0.001, math.nan, math.inf])
def test_a_step_that_is_no_multiple(step: float, controller: Path) -> None:
    """It is discarded, and the simulation may go on with another."""
    instance = Instance(controller)
    instance.set(SIGNALS)
    instance.step(0.0)
    assert status_of(lambda: instance.step(0.001, step)) == DISCARD
    assert instance.said == (
        f"a step of {step:.9g} s at 0.001 s: it must be 0.001 s, the sample period, or a whole multiple"
    )
    instance.step(0.001, 0.003)
    assert instance.get("time") == {"time": 0.004}


def test_every_message_is_of_a_category_that_the_description_names(controller: Path) -> None:
    """An importer turns categories on by these names."""
    instance = Instance(controller, events=True)
    instance.step(0.0)  # without inputs
    assert status_of(lambda: instance.step(0.5)) == DISCARD
    assert status_of(lambda: instance.set({"k_p": 1000.0})) == ERROR
    root = ElementTree.parse(controller / "modelDescription.xml")
    assert {category for _, category, _ in instance.messages} == {
        category.get("name") for category in root.iter("Category")
    }


def test_a_step_from_another_time(controller: Path) -> None:
    instance = Instance(controller)
    assert status_of(lambda: instance.step(0.5)) == DISCARD
    assert instance.said == "a step from 0.5 s: this instance is at 0 s"


def test_the_sample_period_is_a_parameter(controller: Path) -> None:
    instance = Instance(controller, parameters={"sample_period": 0.002})
    instance.set(SIGNALS)
    assert status_of(lambda: instance.step(0.0, 0.001)) == DISCARD
    instance.step(0.0, 0.002)


@pytest.mark.parametrize("missing", SIGNALS)
def test_an_input_that_is_missing_is_reported_once(missing: str, controller: Path) -> None:
    instance = Instance(controller)
    instance.set({name: value for name, value in SIGNALS.items() if name != missing})
    for sample in range(3):
        instance.step(0.001 * sample)
    text = f"input {missing} has never been set: it counts as invalid; connect it, or set {missing}_valid to false"
    assert instance.messages == [(WARNING, "logStatusWarning", text)]
    flag = {"z_ddot": "fault_base", "tau_m": "fault_torque"}.get(missing, f"fault_{missing}")
    assert instance.get(flag) == {flag: True}


def test_an_input_that_is_no_number(controller: Path) -> None:
    """Reported as often as it begins to be none; nothing that comes out is not a number."""
    instance = Instance(controller)
    for sample in range(1000):
        bad = 500 <= sample < 510 or 700 <= sample < 710
        instance.set({**SIGNALS, "theta": math.nan if bad else 0.3, "dither_rms": 0.3})
        instance.step(0.001 * sample)
    assert [text for _, _, text in instance.messages] == ["input theta is not a number: it counts as invalid"] * 2
    assert all(math.isfinite(value) for value in instance.get(*instance.outputs()).values())


def test_a_dither_that_is_refused(controller: Path) -> None:
    instance = Instance(controller)
    instance.set({**SIGNALS, "dither_rms": -1.0})
    instance.step(0.0)
    assert instance.said == "the estimator refuses dither_rms = -1 N m, freeze = 0, reset = 0 in this mode"


def test_modes_and_faults_are_events(controller: Path) -> None:
    """With debug logging on; frozen, run on and reset by inputs."""
    instance = Instance(controller, events=True)
    for sample in range(900):
        instance.set({**SIGNALS, "freeze": 500 <= sample < 600, "reset": sample >= 700, "sampled": sample != 800})
        instance.step(0.001 * sample)
    said = [text for _, category, text in instance.messages if category == "logEvents" and text.startswith("mode")]
    assert said == [f"mode {mode}" for mode in (
        "align at 0 s", "run at 0.3 s", "frozen at 0.5 s", "run at 0.6 s", "align at 0.7 s"
    )]  # fmt: skip
    assert ("fault_gap raised at 0.801 s") in [text for _, _, text in instance.messages]


def test_calls_that_are_not_possible(controller: Path) -> None:
    instance = Instance(controller, start=False)
    calls = {
        "fmi3DoStep: the instance is instantiated, not in step mode": lambda: instance.step(0.0),
        "fmi3GetFloat64: there is no variable with the value reference 99999": lambda: instance.slave.getFloat64(
            [99999]
        ),
        "fmi3GetFloat64: mode is of another type": lambda: instance.slave.getFloat64([instance.reference["mode"]]),
        "fmi3GetFloat32: this FMU has no such thing": lambda: instance.slave.getFloat32([1]),
        "fmi3EnterEventMode: this FMU has no such thing": instance.slave.enterEventMode,
    }
    for text, call in calls.items():
        assert status_of(call) == ERROR
        assert instance.said.startswith(text)


@pytest.mark.parametrize("damage", ["cut", "longer", "empty", "other", "bit"])
def test_a_state_that_is_none(damage: str, controller: Path, pilot: Path) -> None:
    """Refused where it is read, whatever its bytes; the instance goes on."""
    instances = Instance(controller), Instance(pilot)
    instances[0].set(SIGNALS)
    instances[1].set({"torque": 0.0})
    for sample in range(100):
        for instance in instances:
            instance.step(0.001 * sample)
    contents = [each.slave.serializeFMUState(each.slave.getFMUState()) for each in instances]
    for instance, content, other in zip(instances, contents, reversed(contents), strict=True):
        wrong = {"cut": [content[:-1]], "longer": [content + b"\0"], "empty": [b""], "other": [other]}
        places = range(0, len(content), max(1, len(content) // 200))
        flipped = [content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1 :] for at in places]
        for state in wrong.get(damage, flipped):
            assert status_of(lambda: instance.slave.deserializeFMUState(state)) == ERROR  # noqa: B023
            assert instance.said.startswith(f"{len(state)} bytes are no state of this FMU: ")
        if damage == "other":
            assert "another FMU" in instance.said
        instance.slave.setFMUState(instance.slave.deserializeFMUState(content))
        instance.step(0.1)


def test_a_seed_that_there_is_not(pilot: Path) -> None:
    instance = Instance(pilot, start=False)
    instance.set({"seed": 7})
    assert status_of(lambda: instance.slave.enterInitializationMode(startTime=0.0)) == ERROR
    assert instance.said == (
        "seed = 7: this FMU was made with the seeds 10 to 11; make one with it by `lever fmu pilot --seed 7`"
    )


def test_the_end_of_a_scenario(pilot: Path) -> None:
    instance = Instance(pilot)
    instance.set({"torque": 0.0})
    instance.step(0.0, 60.0)
    assert instance.get("sampled") == {"sampled": False}
    theta = instance.get("true_theta")
    instance.step(60.0, 1.0)
    assert instance.get("true_theta") == theta
    end = "the scenario has ended, after 60 s: the lever stays where it is, and there are no samples"
    assert [text for _, _, text in instance.messages] == [end]


def test_a_pilot_without_torque(pilot: Path) -> None:
    instance = Instance(pilot)
    instance.step(0.0)
    assert instance.said == "input torque has never been set: no torque acts on the lever"
