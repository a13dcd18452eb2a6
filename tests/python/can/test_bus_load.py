"""What part of a bus of 1 Mbit/s the messages take, bit by bit: the table of firmware/can/README.md."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from pathlib import Path

import pytest
from can import Message
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.can.commander import KEEP_ALIVE, Commander
from lever_cdkf.firmware.aircraft import AircraftResponse

README = Path(__file__).parents[3] / "firmware/can/README.md"
START, SECONDS, BIT_RATE = 1.0, 2.0, 1_000_000
"""Time left to the alignment, in which nothing is driven [s]; what is counted after it [s]; bits each second."""
BEHIND_CRC = 1 + 2 + 7 + 3
"""Delimiter of the CRC, acknowledgement, end of frame, interframe space: not stuffed."""
FREQUENCIES = [1.5 + 0.5 * i for i in range(14)]
HELICOPTER = AircraftResponse(
    FREQUENCIES, [20.0 / (1.0 + 1j * each / 3.0) for each in FREQUENCIES], gain_sigma=0.1, phase_sigma=0.1
)


def crc15(bits: Iterable[int]) -> int:
    """ISO 11898-1."""
    crc = 0
    for bit in bits:
        crc = ((crc << 1) & 0x7FFF) ^ (0x4599 if bit ^ (crc >> 14) else 0)
    return crc


def bits_of(identifier: int, data: bytes) -> int:
    """Return the bits of of a classic frame with an 11-bit identifier on the bus, with its stuff bits."""
    content = f"0{identifier:011b}000{len(data):04b}" + "".join(f"{byte:08b}" for byte in data)
    content += f"{crc15(map(int, content)):015b}"
    stuffed, last, same = 0, "", 0
    for bit in content:
        same = same + 1 if bit == last else 1
        last = bit
        if same == 5:
            stuffed, last, same = stuffed + 1, "10"[int(bit)], 1
    return len(content) + stuffed + BEHIND_CRC


def test_bits_are_those_of_known_frames() -> None:
    """34 zeros, the CRC among them, have six stuff bits; eight bytes take 111 bits at least, and 135 at most."""
    assert bits_of(0, b"") == 34 + 6 + 13
    assert all(111 <= bits_of(identifier, bytes([identifier & 0xFF] * 8)) <= 135 for identifier in range(0x800))
    assert crc15([1]) == 0x4599


def load(period: float, only_estimate: bool, snapshots: float | None) -> float:
    """Return the part of the bus [%] that a lever takes that is shaken, and dithered by a motor that obeys."""
    settings: dict[str, str | float] = {"sample_period": period}
    if not only_estimate:
        settings["mitigation"] = "cancellation_and_damping"
    bits, torque, commander = 0, 0.0, Commander()
    with LeverBus(
        settings=settings,
        aircraft=None if only_estimate else HELICOPTER,
        snapshots=snapshots,
        receive_own_messages=True,
    ) as bus:

        def send(identifier: int, data: bytes) -> None:
            bus.send(Message(arbitration_id=identifier, data=data, is_extended_id=False))

        for k in range(round((START + SECONDS) / period)):
            time = k * period
            phase = 2.0 * math.pi * 3.0 * time
            if not only_estimate:
                if k % round(KEEP_ALIVE / period) == 0:
                    commander.send({"dither_rms": 0.3}, send)
                send(0x112, codec.encode("GRIP_SAMPLE", k, {"grip_force": 5.0 * math.sin(phase)}))
            swing = {"theta": 0.35 + 0.02 * math.sin(phase), "theta_dot": 0.377 * math.cos(phase), "tau_m": torque}
            send(0x110, codec.encode("LEVER_SAMPLE", k, swing))
            base = {"z_ddot": 1.5 * math.sin(phase + 0.4), "time_us": round(time * 1e6)}
            send(0x111, codec.encode("BASE_SAMPLE", k, base))
            for message in bus:
                name = codec.message(message.arbitration_id).name
                if name == "MOTOR_COMMAND":
                    torque = codec.decode(message.arbitration_id, message.data)[1]["torque"]
                counted = ("LEVER_SAMPLE", "BASE_SAMPLE", "STATE_ESTIMATE")
                if time >= START and (not only_estimate or name in counted):
                    bits += bits_of(message.arbitration_id, bytes(message.data))
    return 100.0 * bits / (SECONDS * BIT_RATE)


def rows() -> dict[str, tuple[float, float]]:
    """Return the table as it stands: at 1 kHz and at 500 Hz [%]."""
    found = re.findall(r"^\| (.*?) \| (\d+) % \| (\d+) % \|$", README.read_text(encoding="utf-8"), re.MULTILINE)
    return {name: (float(fast), float(slow)) for name, fast, slow in found}


@pytest.mark.parametrize(
    ("row", "only_estimate", "snapshots"),
    [
        ("samples and `STATE_ESTIMATE` alone", True, None),
        ("everything: grip force, aircraft, dither, correction", False, None),
        ("everything, and a snapshot each 0.5 s", False, 0.5),
    ],
)
def test_the_table_says_what_it_takes(row: str, only_estimate: bool, snapshots: float | None) -> None:
    for stated, period in zip(rows()[row], (1e-3, 2e-3), strict=True):
        taken = load(period, only_estimate, snapshots)
        print(f"{row}: {taken:.1f} % at {1.0 / period:.0f} Hz")
        assert stated == pytest.approx(taken, abs=1.0), f"{taken:.1f} % at {1.0 / period:.0f} Hz"
