"""lever.fmu --bus in FMPy: bus operations by the layout of FMI-LS-BUS 1.0, written here from the standard."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fmpy import read_model_description
from fmpy.fmi3 import FMU3Slave

FORMAT_ERROR, TRANSMIT, CONFIRM, BUS_ERROR, CONFIGURATION, STATUS = 0x01, 0x10, 0x20, 0x31, 0x40, 0x41
Frame = tuple[int, bytes]
NOTIFICATIONS = "org.fmi_standard.fmi_ls_bus.Can_BusNotifications"


def operation(code: int, arguments: bytes) -> bytes:
    """Return code and length, 4 bytes each, little-endian; the length is that of the whole operation."""
    return struct.pack("<II", code, 8 + len(arguments)) + arguments


def transmit(identifier: int, data: bytes, extended: int = 0, remote: int = 0) -> bytes:
    """CAN Transmit: ID (4 bytes), Ide, Rtr (1), Data Length (2), Data."""
    return operation(TRANSMIT, struct.pack("<IBBH", identifier, extended, remote, len(data)) + data)


def operations(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield code and arguments of each operation."""
    while content:
        code, length = struct.unpack_from("<II", content)
        assert 8 <= length <= len(content)
        yield code, content[8:length]
        content = content[length:]


def frames(content: bytes) -> list[Frame]:
    """Return what CAN Transmit operations hold: data frames with identifiers of 11 bits."""
    found = []
    for code, arguments in operations(content):
        if code == TRANSMIT:
            identifier, extended, remote, length = struct.unpack_from("<IBBH", arguments)
            assert (extended, remote, length) == (0, 0, len(arguments) - 8)
            found.append((identifier, arguments[8:]))
    return found


@dataclass
class BusInstance:
    """One instance, in event mode after initialization; `parameters` are structural, or of type Float64."""

    fmu: Path
    parameters: Mapping[str, float] = field(default_factory=dict)
    messages: list[tuple[int, str]] = field(default_factory=list)
    """Status and text."""
    time: float = 0.0
    has_events: bool = True

    def __post_init__(self) -> None:
        description = read_model_description(self.fmu)
        self.reference = {each.name: each.valueReference for each in description.modelVariables}
        self.slave = FMU3Slave(
            guid=description.guid,
            unzipDirectory=str(self.fmu),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="bus",
        )
        self.slave.instantiate(eventModeUsed=self.has_events, logMessage=self._log)
        if NOTIFICATIONS in self.parameters:
            self.slave.enterConfigurationMode()
            self.slave.setBoolean([self.reference[NOTIFICATIONS]], [bool(self.parameters[NOTIFICATIONS])])
            self.slave.exitConfigurationMode()
        for name, value in self.parameters.items():
            if name == "can_bit_rate":
                self.slave.setInt64([self.reference[name]], [int(value)])
            elif name != NOTIFICATIONS:
                self.slave.setFloat64([self.reference[name]], [value])
        self.slave.enterInitializationMode(startTime=0.0)
        self.slave.exitInitializationMode()

    def _log(self, _: Any, status: int, category: bytes, message: bytes) -> None:
        self.messages.append((status, message.decode()))

    def receive(self, content: bytes) -> None:
        """In event mode: Rx_Clock ticks; then on to step mode."""
        if content:
            self.slave.setClock([self.reference["Can.Rx_Clock"]], [True])
            self.slave.setBinary([self.reference["Can.Rx_Data"]], [content])
        assert self.slave.updateDiscreteStates() == (False, False, False, False, False, 0.0)
        self.slave.enterStepMode()

    def step(self, step: float) -> bytes:
        """Return ends in event mode, with what the FMU sends: nothing, unless its clock ticks."""
        event, terminate, early, time = self.slave.doStep(
            currentCommunicationPoint=self.time, communicationStepSize=step
        )
        self.time += step
        assert (terminate, early) == (False, False)
        assert abs(time - self.time) < 1e-9
        self.slave.enterEventMode()
        (ticks,) = self.slave.getClock([self.reference["Can.Tx_Clock"]])
        assert ticks == event
        assert self.slave.getClock([self.reference["Can.Tx_Clock"]]) == [False]
        (sent,) = self.slave.getBinary([self.reference["Can.Tx_Data"]])
        assert bool(sent) == event
        return bytes(sent)

    def exchange(self, received: Iterable[Frame], step: float = 0.001) -> bytes:
        """Return what the FMU sends at the end of a step at whose beginning it has received frames."""
        self.receive(b"".join(transmit(*frame) for frame in received))
        return self.step(step)

    def get(self, name: str) -> float:
        return float(self.slave.getFloat64([self.reference[name]])[0])
