"""Frames and filters of the model against numbers from elsewhere: Bosch's and ISO's, and RM0090's figures."""

from __future__ import annotations

import pytest
from target.bxcan.filters import FA1R, FFA1R, FM1R, FMR, FMR_RESET, FS1R, Filters
from target.bxcan.frame import Frame, crc_15, stuffed


def test_crc_of_the_catalogue() -> None:
    """CRC-15/CAN in the CRC RevEng catalogue: check value 0x059E of "123456789"."""
    bits = [byte >> k & 1 for byte in b"123456789" for k in reversed(range(8))]
    assert crc_15(bits) == 0x059E


def test_stuffing_counts_stuff_bits() -> None:
    assert stuffed([0] * 5 + [1] * 4 + [0]) == [0] * 5 + [1] + [1] * 4 + [0] + [0]
    assert stuffed([0, 1] * 8) == [0, 1] * 8


@pytest.mark.parametrize(
    ("frame", "least", "most"),
    [
        (Frame(0x123, bytes(range(8))), 44 + 64, 44 + 64 + (34 + 64 - 1) // 4),
        (Frame(0x123), 44, 44 + (34 - 1) // 4),
        (Frame(0x1234567, bytes(8), extended=True), 64 + 64, 64 + 64 + (54 + 64 - 1) // 4),
    ],
)
def test_length_is_within_the_bounds_of_tindell_and_davis(frame: Frame, least: int, most: int) -> None:
    """R. Davis et al. 2007, equation 1: 44 (64) + 8 n bits without stuffing and intermission, and its worst case."""
    assert least <= len(frame.wire) <= most


def test_arbitration_is_that_of_the_standard() -> None:
    ranked = [
        Frame(0x110),
        Frame(0x110, remote=True),
        Frame(0x110 << 18, extended=True),
        Frame(0x110 << 18, extended=True, remote=True),
        Frame(0x110 << 18 | 1, extended=True),
        Frame(0x111),
    ]
    mixed = [ranked[k] for k in (3, 0, 5, 2, 4, 1)]
    assert sorted(mixed, key=lambda frame: frame.arbitration) == ranked


def filters(**registers: int) -> Filters:
    """Ready filters, from registers by name and banks as bank_0=(FR1 << 32 | FR2)."""

    def refuse(what: str) -> None:
        raise AssertionError(what)

    accepting = Filters(refuse)
    offsets = {"FM1R": FM1R, "FS1R": FS1R, "FFA1R": FFA1R, "FA1R": FA1R}
    for name, value in registers.items():
        if name in offsets:
            accepting.write(offsets[name], value)
        else:
            bank = int(name.removeprefix("bank_"))
            accepting.write(0x240 + 8 * bank, value >> 32)
            accepting.write(0x244 + 8 * bank, value & 0xFFFFFFFF)
    accepting.write(FMR, FMR_RESET & ~1)
    return accepting


def test_list_of_four_16_bit_identifiers() -> None:
    """Figure 342 of RM0090: STID[10:0] RTR IDE EXID[17:15]."""
    accepting = filters(FM1R=1, FA1R=1, bank_0=(0x111 << 21 | 0x110 << 5) << 32 | (0x7FF << 21 | 0x120 << 5))
    assert [accepting.match(Frame(each)) for each in (0x110, 0x111, 0x120, 0x7FF)] == [(0, k) for k in range(4)]
    assert accepting.match(Frame(0x112)) is None
    assert accepting.match(Frame(0x110, remote=True)) is None
    assert accepting.match(Frame(0x110 << 18, extended=True)) is None


def test_nothing_passes_while_filters_are_initialised() -> None:
    accepting = filters(FS1R=1, FA1R=1, bank_0=0)
    assert accepting.match(Frame(1)) == (0, 0)
    accepting.write(FMR, FMR_RESET)
    assert accepting.match(Frame(1)) is None
