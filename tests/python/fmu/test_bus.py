"""lever.fmu --bus, driven by FMPy in event mode, is the firmware in this process byte for byte; and the rest of what
FMI-LS-BUS 1.0 asks of a node."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.build import build_platform_binary
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from lever_cdkf.can import codec
from lever_cdkf.firmware.native import Estimator
from lever_sil.run import in_process
from lever_sil.scenarios.scenario import load
from lxml import etree  # type: ignore[import-untyped]
from python.fmu import bus_importer as ls_bus
from python.fmu.bus_importer import BusInstance, Frame, frames, operation, operations, transmit
from python.fmu.importer import unpacked

TO_ESTIMATOR = ("LEVER_SAMPLE", "BASE_SAMPLE", "GRIP_SAMPLE", "COMMAND")
ACTIVE, PASSIVE, OFF = 1, 2, 3
CONFIGURATIONS = [(ls_bus.CONFIGURATION, struct.pack("<BI", 1, 1_000_000)), (ls_bus.CONFIGURATION, bytes((4, 1)))]
"""The bit rate [bit/s], and that the bus buffers and retransmits what loses arbitration."""


@pytest.fixture(scope="session")
def flight() -> list[tuple[list[Frame], list[Frame]]]:
    """Return the flight of each sample of four seconds with dither: frames to the estimator, and what it answers in
    this process."""
    traffic = in_process.run(load("demo", ["duration=4 s"])).traffic
    inputs = {codec.message(name).frame_id for name in TO_ESTIMATOR}
    samples: list[tuple[list[Frame], list[Frame]]] = [([], []) for _ in range(4000)]
    for identifier, sample, data in zip(traffic.identifier, traffic.sample, traffic.data, strict=True):
        frame = (int(identifier), bytes(data[: codec.message(int(identifier)).length]))
        samples[sample][identifier not in inputs].append(frame)
    return samples


def identifiers(sent: Iterable[Frame]) -> set[str]:
    return {codec.message(identifier).name for identifier, _ in sent}


# --- frames ----------------------------------------------------------------------------------------------------------


def test_frames_are_those_of_the_firmware_byte_for_byte(
    bus: Path, flight: list[tuple[list[Frame], list[Frame]]]
) -> None:
    """With commands, torque and every periodic message; and the outputs are what the frames say."""
    instance, seen = BusInstance(bus), set()
    for received, answers in flight:
        sent = frames(instance.exchange(received))
        assert sent == answers
        seen |= identifiers(sent)
    assert {"STATE_ESTIMATE", "PILOT_PARAMETERS", "HEALTH", "IDENTITY", "MOTOR_COMMAND", "COMMAND_ACK"} <= seen
    assert any(np.any(np.frombuffer(data, np.uint8)[:2]) for _, data in sent)
    _, said = codec.decode(*next(frame for frame in reversed(sent) if frame[0] == 0x210))
    assert instance.get("theta_estimate") == pytest.approx(said["theta"], abs=2e-4)
    assert instance.messages == []


@pytest.mark.parametrize("samples", [1, 10, 100])
def test_steps_of_any_length(samples: int, bus: Path, flight: list[tuple[list[Frame], list[Frame]]]) -> None:
    """What has come in one event is answered in its order, at the end of the next step; here 0.75 of a sample long,
    and for the rest of the time nothing is sent."""
    instance = BusInstance(bus)
    for first in range(0, 1000, samples):
        some = flight[first : first + samples]
        sent = instance.exchange([frame for received, _ in some for frame in received], step=0.75e-3)
        assert frames(sent) == [frame for _, answers in some for frame in answers]
        instance.receive(b"")
        assert instance.step(0.25e-3) == b""


def test_the_bus_is_configured_first(bus: Path) -> None:
    instance = BusInstance(bus)
    instance.receive(b"")
    assert list(operations(instance.step(0.001))) == CONFIGURATIONS
    slow = BusInstance(bus, {"can_bit_rate": 500_000})
    slow.receive(b"")
    assert next(operations(slow.step(0.001))) == (ls_bus.CONFIGURATION, struct.pack("<BI", 1, 500_000))


def test_without_samples_the_firmware_is_told(bus: Path, flight: list[tuple[list[Frame], list[Frame]]]) -> None:
    """Each 5 ms, which is LOOP_IDLE_MS of the loop that lever_can runs; the torque fades."""
    instance, estimator = BusInstance(bus), Estimator()
    for received, _ in flight[:3000]:
        instance.exchange(received)
        for frame in received:
            if estimator.on_frame(*frame):
                estimator.step()
            list(iter(estimator.next_frame, None))
    for period in range(1, 101):
        instance.receive(b"")
        sent = frames(instance.step(0.001))
        if period % 5 == 4:
            estimator.idle(5000)
            assert sent == list(iter(estimator.next_frame, None))
        else:
            assert sent == []
    assert instance.get("torque") == 0.0


def test_frames_that_are_not_for_it(bus: Path, flight: list[tuple[list[Frame], list[Frame]]]) -> None:
    """Extended and remote frames, CAN FD, and what others configure pass."""
    instance = BusInstance(bus)
    instance.exchange(flight[0][0])
    strange = [
        *(transmit(*frame, extended=1) for frame in flight[1][0]),
        transmit(0x110, b"", remote=1),
        transmit(0x18FEF100, bytes(8), extended=1),
        operation(0x11, struct.pack("<IBBBH", 0x110, 0, 0, 0, 64) + bytes(64)),
        operation(*CONFIGURATIONS[0]),
        operation(ls_bus.STATUS, bytes((PASSIVE,))),
        operation(0x42, b""),
        operation(ls_bus.CONFIRM, struct.pack("<I", 0x210)),
    ]
    instance.receive(b"".join(strange))
    assert instance.step(0.001) == b""
    for received, answers in flight[1:200]:
        assert frames(instance.exchange(received)) == answers
    assert instance.messages == []


# --- errors ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "wrong",
    [
        b"\x10",
        struct.pack("<II", 0x10, 7),
        struct.pack("<II", 0x10, 4000),
        operation(0x10, struct.pack("<IBBH", 0x110, 0, 0, 8) + bytes(7)),
        operation(0x10, struct.pack("<IBBH", 0x110, 0, 0, 9) + bytes(9)),
        operation(0x10, struct.pack("<IBBH", 0x110, 2, 0, 8) + bytes(8)),
        operation(0x99, b""),
        operation(0x20, bytes(3)),
        operation(0x31, bytes(6)),
    ],
)
def test_what_is_no_operation_is_a_format_error(
    wrong: bytes, bus: Path, flight: list[tuple[list[Frame], list[Frame]]]
) -> None:
    """With its bytes; what came before it is taken."""
    instance = BusInstance(bus)
    instance.exchange([])
    instance.receive(b"".join(transmit(*frame) for frame in flight[0][0]) + wrong)
    sent = instance.step(0.001)
    assert frames(sent) == flight[0][1]
    assert list(operations(sent))[-1] == (ls_bus.FORMAT_ERROR, struct.pack("<H", len(wrong)) + wrong)
    assert [status for status, _ in instance.messages] == [1]
    text = instance.messages[0][1]
    assert "no operation of FMI-LS-BUS for CAN: " in text
    assert ("code is unknown" in text) == (wrong[0] == 0x99)


def bus_error(sender: int, first: int = 1) -> bytes:
    """Return the bus error of a STATE_ESTIMATE, a bit error."""
    return operation(ls_bus.BUS_ERROR, struct.pack("<IBBB", 0x210, 1, first, sender))


def statuses(content: bytes) -> list[int]:
    return [arguments[0] for code, arguments in operations(content) if code == ls_bus.STATUS]


def test_a_node_counts_bus_errors_and_leaves_the_bus(bus: Path, flight: list[tuple[list[Frame], list[Frame]]]) -> None:
    """As ISO 11898-1: passive at 128, off at 256, back after 128 times 11 bits; in PLATFORM_HEALTH, too."""
    instance = BusInstance(bus, {ls_bus.NOTIFICATIONS: True})
    instance.exchange(flight[0][0])
    seen: list[int] = []
    for _ in range(32):
        instance.receive(bus_error(sender=1))
        seen += statuses(instance.step(1e-4))
    assert seen == [PASSIVE, OFF]
    instance.receive(transmit(*flight[1][0][0]) + transmit(*flight[1][0][1]))
    assert instance.step(0.001) == b""
    instance.receive(b"")
    assert statuses(instance.step(0.001)) == [ACTIVE]
    sent = [frame for received, _ in flight[2:1500] for frame in frames(instance.exchange(received))]
    said = [codec.decode(*frame)[1] for frame in sent if frame[0] == codec.message("PLATFORM_HEALTH").frame_id]
    assert said[-1]["bus_offs"] == 1
    assert said[-1]["transmit_errors"] == 0


def test_confirmed_frames_count_errors_down(bus: Path) -> None:
    instance = BusInstance(bus, {ls_bus.NOTIFICATIONS: True})
    instance.exchange([])
    instance.receive(bus_error(sender=1) * 16)
    assert statuses(instance.step(1e-4)) == [PASSIVE]
    instance.receive(operation(ls_bus.CONFIRM, struct.pack("<I", 0x210)))
    assert statuses(instance.step(1e-4)) == [ACTIVE]
    instance.receive(bus_error(sender=0) * 16)
    assert statuses(instance.step(1e-4)) == [PASSIVE]


def test_without_notifications_errors_are_nobodys(bus: Path) -> None:
    instance = BusInstance(bus)
    instance.exchange([])
    instance.receive(bus_error(sender=1) * 40)
    assert instance.step(1e-4) == b""


def refused(call: Callable[[], object]) -> int:
    with pytest.raises(FMICallException) as caught:
        call()
    return int(caught.value.status)


def test_calls_that_are_not_possible(bus: Path) -> None:
    instance = BusInstance(bus)
    reference = instance.reference
    calls = {
        "fmi3DoStep: the instance is in event mode, not in step mode": lambda: instance.slave.doStep(0.0, 0.001),
        "Rx_Data: 65537 bytes, but there is room for 65536": lambda: instance.slave.setBinary(
            [reference["Can.Rx_Data"]], [bytes(65537)]
        ),
        "Tx_Data is no input: it cannot be set": lambda: instance.slave.setBinary([reference["Can.Tx_Data"]], [b"x"]),
        "fmi3GetBinary: Rx_Clock is of another type": lambda: instance.slave.getBinary([reference["Can.Rx_Clock"]]),
        "fmi3GetClock: there is no variable with the value reference 9999": lambda: instance.slave.getClock([9999]),
        "Can_BusNotifications: the instance is in event mode, not in configuration mode": lambda: (
            instance.slave.setBoolean([reference[ls_bus.NOTIFICATIONS]], [True])
        ),
    }
    for text, call in calls.items():
        assert refused(call) == 3
        assert instance.messages[-1][1] == text
    instance.receive(b"")
    assert refused(lambda: instance.slave.getClock([reference["Can.Tx_Clock"]])) == 3
    assert refused(lambda: instance.slave.doStep(0.0, -0.001)) == 2
    assert "it must be above 0 s" in instance.messages[-1][1]


def test_parameters_and_modes_that_do_not_fit(bus: Path) -> None:
    with pytest.raises(FMICallException):
        BusInstance(bus, {"can_bit_rate": 1})
    messages: list[tuple[int, str]] = []
    with pytest.raises(Exception, match="instantiate"):
        BusInstance(bus, messages=messages, has_events=False)
    assert messages == [(3, "this FMU needs event mode, in which its clocks tick: use an importer that has it")]


# --- state -----------------------------------------------------------------------------------------------------------


def test_a_state_between_two_events(bus: Path, flight: list[tuple[list[Frame], list[Frame]]]) -> None:
    """Saved with answers that are not sent yet; restored in it and in another instance."""
    instance, other = BusInstance(bus), BusInstance(bus)
    for received, _ in flight[:2000]:
        instance.exchange(received)
    instance.receive(b"".join(transmit(*frame) for frame in flight[2000][0]))
    content = instance.slave.serializeFMUState(instance.slave.getFMUState())
    for each in (instance, instance, other):
        each.slave.setFMUState(each.slave.deserializeFMUState(content))
        each.time = 2.0
        assert frames(each.step(0.001)) == flight[2000][1]
        for received, answers in flight[2001:2200]:
            assert frames(each.exchange(received)) == answers
    assert refused(lambda: instance.slave.setFMUState(instance.slave.deserializeFMUState(content[:-1]))) == 3


# --- description -----------------------------------------------------------------------------------------------------


def test_fmpy_finds_nothing_wrong_with_it(bus_fmu: Path, bus: Path) -> None:
    """By the schemas of FMI 3.0 and FMPy's checks; the terminal by the schema that FMPy has for it."""
    assert validate_fmu(str(bus_fmu)) == []
    schema = etree.parse(str(Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"))
    etree.XMLSchema(schema).assertValid(etree.parse(str(bus / "terminalsAndIcons/terminalsAndIcons.xml")))


def test_the_manifest_is_that_of_the_standard(bus: Path) -> None:
    """The root is in no namespace, its attributes are; by default it is no bus simulation."""
    root = etree.parse(str(bus / "extra/org.fmi-standard.fmi-ls-bus/fmi-ls-manifest.xml")).getroot()
    place = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-"
    assert root.tag == "fmiLayeredStandardManifest"
    assert root.keys() == [f"{place}{name}" for name in ("name", "version", "description")]
    assert root.values()[:2] == ["org.fmi-standard.fmi-ls-bus", "1.0.0"]


def test_the_terminal_is_that_of_the_standard(bus: Path) -> None:
    terminal = etree.parse(str(bus / "terminalsAndIcons/terminalsAndIcons.xml")).find(".//Terminal")
    assert terminal.get("terminalKind") == "org.fmi-ls-bus.network-terminal"
    assert terminal.get("matchingRule") == "org.fmi-ls-bus.transceiver"
    model = etree.parse(str(bus / "modelDescription.xml"))
    variables = {each.get("name"): each for each in model.find("ModelVariables")}
    members = {each.get("memberName"): variables[each.get("variableName")] for each in terminal}
    for way, causality in (("Rx", "input"), ("Tx", "output")):
        data, clock = members[f"{way}_Data"], members[f"{way}_Clock"]
        assert (data.tag, data.get("causality"), data.get("clocks")) == (
            "Binary",
            causality,
            clock.get("valueReference"),
        )
        assert data.get("mimeType") == 'application/org.fmi-standard.fmi-ls-bus.can; version="1.0.0"'
        assert (clock.tag, clock.get("causality"), clock.get("intervalVariability")) == (
            "Clock",
            causality,
            "triggered",
        )
    notifications = variables[ls_bus.NOTIFICATIONS]
    assert (notifications.get("causality"), notifications.get("start")) == ("structuralParameter", "false")
    assert model.find("CoSimulation").get("hasEventMode") == "true"


def test_sources_that_fmpy_compiles_send_the_same(
    bus_fmu: Path, flight: list[tuple[list[Frame], list[Frame]]], tmp_path: Path
) -> None:
    folder = unpacked(bus_fmu, tmp_path / "bus")
    (library,) = (folder / "binaries").glob("*/*.so")
    library.unlink()
    build = tmp_path / "build"
    build.mkdir()
    build_platform_binary(folder, build, configuration="Debug")
    instance = BusInstance(folder)
    for received, answers in flight[:1000]:
        assert frames(instance.exchange(received)) == answers
