"""Whatever comes on the bus: lever.fmu --bus, lever_can and the firmware in this process send the same, to the byte."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import can
import e2e.p02
import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.can.commander import KEEP, result_of
from lever_cdkf.can.protocol_ahead import read_ahead
from lever_cdkf.firmware.config import CHOICES
from python.fmu.bus_importer import BusInstance, frames
from vcan import rig
from vcan.rig import Frame

GROUPS = 4000
IDENTITY = {"page": 0, "firmware_major": 9, "firmware_minor": 8, "firmware_patch": 7, "contract": 1}
CHOSEN = {
    name: [str(each) for each in (codec.message("COMMAND").get_signal_by_name(name).choices or {}).values()]
    for name in CHOICES
}
ANSWERS = {
    "STATE_ESTIMATE", "PILOT_PARAMETERS", "PILOT_SIGMA", "PILOT_DYNAMICS", "HEALTH", "IDENTITY", "MOTOR_COMMAND",
    "COMMAND_ACK", "LINK_HEALTH", "FEEDTHROUGH", "CORRECTION",
}  # fmt: skip


def frame(name: str, counter: int, values: Mapping[str, codec.Value]) -> Frame:
    return codec.message(name).frame_id, codec.encode(name, counter, values)


class Traffic:
    """Frames of a node that is not careful, beside others: some are lost, corrupt, repeated, unknown or short."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.commands = 0
        self.lost = False

    def chance(self, probability: float) -> bool:
        return bool(self.random.random() < probability)

    def command(self) -> Frame:
        """Mostly one that asks for torque or for nothing new; else another choice, request or an unknown number."""
        values: dict[str, codec.Value] = {"request": "none", **KEEP}
        if self.chance(0.8):
            values["dither_rms"] = float(self.random.choice([0.0, 0.3, 0.3, 0.3, math.inf]))
        if self.chance(0.1):
            values["request"] = str(self.random.choice(["run", "run", "freeze", "reset"]))
        if self.chance(0.1):
            name = str(self.random.choice(list(CHOSEN)))
            values[name] = str(self.random.choice(CHOSEN[name]))
        self.commands += 1 if self.chance(0.95) else 3
        identifier, data = frame("COMMAND", self.commands, values)
        if self.chance(0.05):
            unknown = bytearray(data)
            unknown[2] = 0xF7
            e2e.p02.e2e_p02_protect(unknown, codec.data_ids("COMMAND"), increment_counter=False)
            data = bytes(unknown)
        return identifier, data

    def sample(self, k: int) -> list[Frame]:
        (_, lever), (_, base) = next(rig.samples(k, 1))
        grip = {"grip_force": float(self.random.normal(0.0, 5.0)), "grip_force_valid": self.chance(0.9)}
        whole = [(0x110, lever), (0x111, base)]
        if self.chance(0.02):
            invalid = {"theta_valid": False, "theta": 0.0, "theta_dot": 0.1, "tau_m": 0.0}
            whole[0] = frame("LEVER_SAMPLE", k, invalid)
        return [frame("GRIP_SAMPLE", k, grip), *whole] if k >= GROUPS // 2 else whole

    def between(self) -> Iterator[Frame]:
        """Besides samples."""
        if self.chance(0.02):
            command = self.command()
            yield command
            if self.chance(0.1):
                yield command
        if self.chance(0.005):
            yield frame("IDENTITY", int(self.random.integers(16)), IDENTITY)
        if self.chance(0.02):
            identifier = int(self.random.choice([0x0FF, 0x110, 0x111, 0x112, 0x120, 0x210, 0x217, 0x7FF]))
            yield identifier, self.random.bytes(int(self.random.integers(9)))

    def groups(self) -> Iterator[list[Frame]]:
        """Yield what is sent in each millisecond; no two samples in a row are lost, so that nobody tells of silence."""
        for k in range(GROUPS):
            sample = self.sample(k)
            self.lost = not self.lost and self.chance(0.01)
            if self.lost:
                at = int(self.random.integers(len(sample)))
                identifier, data = sample[at]
                spoilt = (identifier, bytes((data[0] ^ 1, *data[1:])))
                sample[at : at + 1] = [spoilt] if self.chance(0.5) else []
            yield [*self.between(), *sample]


@pytest.fixture(scope="module")
def answered() -> list[tuple[list[Frame], list[Frame]]]:
    """Return the answered of each group: its frames, and what the firmware in this process answers."""
    said = []
    with LeverBus(settings=rig.SETTINGS) as bus:
        for received in Traffic(seed=1).groups():
            for identifier, data in received:
                bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
            messages = [message for message in iter(lambda: bus.recv(0), None) if message is not None]
            said.append((received, [(message.arbitration_id, bytes(message.data)) for message in messages]))
    return said


@pytest.mark.requirement("R49")
def test_the_fmu_and_lever_can_answer_as_the_firmware_in_this_process(
    bus: Path, answered: list[tuple[list[Frame], list[Frame]]], build_dir: Path, tmp_path: Path
) -> None:
    """COMMANDs, losses, corrupt frames and those of others, too; lever_can in lock-step, as the FMU's time is that of
    the simulation."""
    instance = BusInstance(bus, rig.SETTINGS)
    link = tmp_path / "lever0"
    with rig.LeverCan(build_dir / "lever_can", str(link), [], tmp_path, "pty"):
        line = can.Bus(interface="slcan", channel=read_ahead(str(link)), sleep_after_open=0.0, bitrate=1_000_000)
        host = rig.Host(line)
        for number, (received, answers) in enumerate(answered):
            assert frames(instance.exchange(received)) == answers, f"the FMU, millisecond {number}"
            for each in received:
                host.send(each)
            messages = [line.recv(rig.PATIENCE_S) for _ in answers]
            heard = [(message.arbitration_id, bytes(message.data)) for message in messages if message is not None]
            assert heard == answers, f"lever_can, millisecond {number}"
        assert host.nothing_more()
        line.shutdown()


def test_the_traffic_has_everything_in_it(answered: list[tuple[list[Frame], list[Frame]]]) -> None:
    """Otherwise equality would say little."""
    said = [codec.decode(*each) for _, answers in answered for each in answers]
    assert {name for name, _ in said} >= ANSWERS
    results = {result_of(values) for name, values in said if name == "COMMAND_ACK"}
    assert {"accepted", "sequence", "unknown_value"} <= results
    modes = {values["mode"] for name, values in said if name == "HEALTH"}
    assert len(modes) >= 3
    assert any(values["torque"] != 0.0 for name, values in said if name == "MOTOR_COMMAND")
    assert any(values["lost"] > 0 for name, values in said if name == "LINK_HEALTH")
    assert any(values["corrupt"] > 0 for name, values in said if name == "LINK_HEALTH")
