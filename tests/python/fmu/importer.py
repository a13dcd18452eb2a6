"""FMUs in FMPy, which is an importer of its own: instances, their messages, and two of them in a loop."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fmpy import extract, read_model_description
from fmpy.fmi3 import FMU3Slave, fmi3LogMessageCallback

CONNECTIONS = (
    *("theta", "theta_valid", "theta_dot", "theta_dot_valid", "z_ddot", "z_ddot_valid", "tau_m", "tau_m_valid"),
    *("grip_force", "grip_force_valid", "sampled", "dither_rms"),
)
"""From the pilot to the controller, by the same names."""
BACK = ("torque", "correction")


@dataclass
class Instance:
    """One instance in step mode, or before it with `start` false."""

    fmu: Path
    """Unpacked."""
    name: str = "instance"
    parameters: Mapping[str, float] = field(default_factory=dict)
    start: bool = True
    events: bool = False
    messages: list[tuple[int, str, str]] = field(default_factory=list)
    """Status, category and text."""

    def __post_init__(self) -> None:
        self.description = read_model_description(self.fmu)
        self.reference = {each.name: each.valueReference for each in self.description.modelVariables}
        self.kind = {each.name: each.type for each in self.description.modelVariables}
        self.period = float(self.description.coSimulation.fixedInternalStepSize)
        self.slave = FMU3Slave(
            guid=self.description.guid,
            unzipDirectory=str(self.fmu),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=self.name,
        )
        self.slave.instantiate(loggingOn=self.events, logMessage=self._log)
        if self.start:
            self.set(self.parameters)
            self.slave.enterInitializationMode(startTime=0.0)
            self.slave.exitInitializationMode()

    def _log(self, _: Any, status: int, category: bytes, message: bytes) -> None:
        self.messages.append((status, category.decode(), message.decode()))

    @property
    def said(self) -> str:
        """The text of the last message."""
        return self.messages[-1][2] if self.messages else ""

    def set(self, values: Mapping[str, float]) -> None:
        for name, value in values.items():
            reference = [self.reference[name]]
            if self.kind[name] == "Float64":
                self.slave.setFloat64(reference, [value])
            elif self.kind[name] == "Boolean":
                self.slave.setBoolean(reference, [bool(value)])
            else:
                self.slave.setInt64(reference, [int(value)])

    def get(self, *names: str) -> dict[str, float]:
        values = {}
        for name in names:
            reference = [self.reference[name]]
            if self.kind[name] == "Float64":
                (values[name],) = self.slave.getFloat64(reference)
            elif self.kind[name] == "Boolean":
                (values[name],) = self.slave.getBoolean(reference)
            else:
                (values[name],) = self.slave.getInt64(reference)
        return values

    def step(self, time: float, step: float | None = None) -> None:
        self.slave.doStep(currentCommunicationPoint=time, communicationStepSize=self.period if step is None else step)

    def outputs(self) -> tuple[str, ...]:
        """Return names of all outputs."""
        return tuple(each.name for each in self.description.modelVariables if each.causality == "output")

    def close(self) -> None:
        self.slave.terminate()
        self.slave.freeInstance()


class Loop:
    """A pilot and a controller, connected: the controller answers a sample before the pilot goes on."""

    def __init__(self, pilot: Instance, controller: Instance) -> None:
        self.pilot, self.controller, self.sample = pilot, controller, 0
        self._from = _grouped(pilot, CONNECTIONS)
        self._back = _grouped(controller, BACK)
        self._to = {kind: [controller.reference[name] for name in names] for kind, (names, _) in self._from.items()}
        self._back_to = [pilot.reference[name] for name in BACK]

    def step(self) -> None:
        pilot, controller, time = self.pilot.slave, self.controller.slave, self.sample * self.pilot.period
        for kind, (_, references) in self._from.items():
            getattr(controller, f"set{kind}")(self._to[kind], getattr(pilot, f"get{kind}")(references))
        self.controller.step(time)
        (_, references) = self._back["Float64"]
        pilot.setFloat64(self._back_to, controller.getFloat64(references))
        self.pilot.step(time)
        self.sample += 1


def _grouped(instance: Instance, names: Iterable[str]) -> dict[str, tuple[list[str], list[int]]]:
    """Return names and value references by type."""
    groups: dict[str, tuple[list[str], list[int]]] = {}
    for name in names:
        group = groups.setdefault(instance.kind[name], ([], []))
        group[0].append(name)
        group[1].append(instance.reference[name])
    return groups


def unpacked(fmu: Path, folder: Path) -> Path:
    """Return the folder with what an FMU holds."""
    return Path(extract(str(fmu), unzipdir=str(folder)))


__all__ = ["Instance", "Loop", "fmi3LogMessageCallback", "unpacked"]
