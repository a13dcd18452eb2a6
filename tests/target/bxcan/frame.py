"""Classic CAN frames as they are on the wire: ISO 11898-1:2015, 10.4."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

CRC_15 = 0x4599


def _bits(value: int, count: int) -> list[int]:
    return [(value >> k) & 1 for k in reversed(range(count))]


def crc_15(bits: list[int]) -> int:
    remainder = 0
    for bit in bits:
        feedback = bit ^ (remainder >> 14)
        remainder = (remainder << 1) & 0x7FFF
        if feedback:
            remainder ^= CRC_15
    return remainder


def stuffed(bits: list[int]) -> list[int]:
    """After five equal bits, stuff bits included, one of the other kind."""
    out: list[int] = []
    run = 0
    for bit in bits:
        run = run + 1 if out and bit == out[-1] else 1
        out.append(bit)
        if run == 5:
            out.append(1 - bit)
            run = 1
    return out


@dataclass(frozen=True)
class Frame:
    identifier: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False
    dlc: int = -1
    """Only a remote frame says another length than that of its data; -1: that of its data."""

    @property
    def length(self) -> int:
        return self.dlc if self.dlc >= 0 else len(self.data)

    @cached_property
    def arbitration(self) -> list[int]:
        """The arbitration field; of two frames the lesser one wins the bus (0 is dominant)."""
        if self.extended:
            base, extension = self.identifier >> 18, self.identifier & 0x3FFFF
            return [*_bits(base, 11), 1, 1, *_bits(extension, 18), int(self.remote)]
        return [*_bits(self.identifier, 11), int(self.remote), 0]

    @cached_property
    def wire(self) -> list[int]:
        """All bits from start to end of frame, stuffed, as a receiver that acknowledges makes them."""
        reserved = [0, 0] if self.extended else [0]
        content = [] if self.remote else [bit for byte in self.data for bit in _bits(byte, 8)]
        bits = [0, *self.arbitration, *reserved, *_bits(self.length, 4), *content]
        delimiter, acknowledge, end = 1, 0, [1] * 8  # the latter: acknowledge delimiter, end of frame; none is stuffed
        return [*stuffed([*bits, *_bits(crc_15(bits), 15)]), delimiter, acknowledge, *end]
