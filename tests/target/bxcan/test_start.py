"""How the image starts: initialisation sequence, clock, bit timing, filters; also without crystal, and without PLL."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from lever_cdkf.firmware.native import lib
from target.bxcan import bxcan, filters
from target.bxcan.board import MS, Board
from target.bxcan.bxcan import ABOM, INAK, INRQ, NART, RFLM, TTCM, TXFP
from target.bxcan.clocks import HSE, HSI, MHZ, PLL
from target.bxcan.frame import Frame
from target.bxcan.talk import INPUTS, Talk, is_estimate

MakeBoard = Callable[..., Board]
REGISTERS = {bxcan.MCR: "MCR", bxcan.BTR: "BTR", bxcan.IER: "IER", filters.FMR: "FMR", filters.FA1R: "FA1R"}


def note_writes(board: Board) -> list[tuple[str, int]]:
    """Note each write to a register of CAN1 by its name, with the value."""
    written: list[tuple[str, int]] = []
    write = board.can.write

    def noting(offset: int, size: int, value: int) -> None:
        written.append((REGISTERS.get(offset, hex(offset)), value))
        write(offset, size, value)

    board.can.write = noting  # type: ignore[method-assign]
    return written


def test_initialisation_sequence(make_board: MakeBoard) -> None:
    """32.4.1 and 32.7.4. The model has checked each access by itself, and that INAK was waited for."""
    board = make_board()
    written = note_writes(board)
    board.start()
    names = [name for name, _ in written]
    assert written[0][0] == "MCR"
    assert written[0][1] & INRQ
    assert names.count("BTR") == 1
    filter_modes = [value & 1 for name, value in written if name == "FMR"]
    assert filter_modes[0] == 1
    assert filter_modes[-1] == 0
    last = next(k for k, (name, value) in enumerate(written) if name == "MCR" and not value & INRQ)
    assert max(k for k, name in enumerate(names) if name in ("BTR", "FMR", "FA1R", "IER")) < last
    assert not board.can.mode & INAK
    assert board.can.mcr & (ABOM | RFLM | TXFP | NART | TTCM) == ABOM | RFLM | TXFP


def test_nothing_is_sent_before_a_sample_has_come(board: Board) -> None:
    board.run(200 * MS)
    assert board.bus.frames == 0
    assert board.machine.resets == []


def test_joins_a_busy_bus(make_board: MakeBoard) -> None:
    """Between two frames, which leave no more than the 11 recessive bits that it takes."""
    board = make_board()
    board.machine.run(15 * MS)
    board.peer.send(*[Frame(0x050, bytes(8))] * 400)
    board.start()
    assert board.peer.queue, "the bus has fallen silent before"
    with Talk(board) as talk:
        del board.peer.queue[1:]
        assert is_estimate(talk.ask()[-1])


def test_waits_for_a_dead_bus_without_hanging(make_board: MakeBoard) -> None:
    board = make_board()
    board.bus.is_held = True
    board.run(500 * MS)
    assert not board.can.acknowledges()
    assert board.machine.resets == []
    board.bus.is_held = False
    board.start()
    with Talk(board) as talk:
        assert is_estimate(talk.ask()[-1])


def test_the_processor_sleeps_while_there_is_nothing_to_do(board: Board) -> None:
    asleep = 0
    for _ in range(200):
        board.run(137_000)  # at all times between two ticks
        asleep += board.machine.is_asleep
    assert asleep > 190


@pytest.mark.parametrize(
    ("options", "source", "pll_source", "hclk_mhz", "apb1_mhz"),
    [
        pytest.param({}, PLL, HSE, 168, 42, id="crystal"),
        pytest.param({"hse_hz": 0}, PLL, HSI, 168, 42, id="no crystal"),
        pytest.param({"pll_locks": (HSI,)}, PLL, HSI, 168, 42, id="no PLL on the crystal"),
        pytest.param({"pll_locks": ()}, HSI, HSI, 16, 16, id="no PLL"),
    ],
)
def test_bit_timing_from_the_clock_that_is_there(
    make_board: MakeBoard, options: dict[str, Any], source: int, pll_source: int, hclk_mhz: int, apb1_mhz: int
) -> None:
    """As the model computes them from RCC and BTR. The sample point of CiA 301 at 1 Mbit/s is 75 to 90 %."""
    board = make_board(**options)
    board.start()
    clocks = board.chip.clocks
    assert clocks.source == source
    assert clocks.registers[4] >> 22 & 1 == pll_source
    assert clocks.hclk_hz() == hclk_mhz * MHZ
    assert clocks.apb1_hz() == apb1_mhz * MHZ
    assert board.can.bit_time_ns() == 1000.0
    assert 0.75 <= board.can.sample_point() <= 0.9
    with Talk(board) as talk:
        report, health = talk.report("PLATFORM_HEALTH"), talk.report("HEALTH")
    assert report["faults"] == (0 if options == {} else lib.LEVER_PLATFORM_CLOCK)
    assert board.machine.resets == []
    assert health["fault_platform"] == (options != {})


def test_start_without_pll_does_not_outlast_the_fastest_watchdog(make_board: MakeBoard) -> None:
    """LSI at 47 kHz; twice that, as an instruction takes one cycle here and nearly two in a Cortex-M4F."""
    board = make_board(pll_locks=(), lsi_hz=2 * 47_000)
    board.start()
    with Talk(board) as talk:
        assert talk.report("PLATFORM_HEALTH")["faults"] == lib.LEVER_PLATFORM_CLOCK
    assert board.machine.resets == []


def test_crystal_that_has_failed_is_not_trusted_until_power_on(talk: Talk, board: Board) -> None:
    board.chip.clocks.break_crystal()
    board.chip.clocks.hse_hz = 8 * MHZ
    board.run(100 * MS)
    assert [reset.cause for reset in board.machine.resets] == ["software"]
    assert board.chip.clocks.registers[4] >> 22 & 1 == HSI
    assert talk.report("PLATFORM_HEALTH")["faults"] == lib.LEVER_PLATFORM_CLOCK


@pytest.mark.requirement("R20")
def test_filters_pass_our_identifiers_and_nothing_else(board: Board) -> None:
    """Every standard identifier there is, and extended ones that look like ours in one half."""
    passes = board.can.filters.match
    assert {each for each in range(0x800) if passes(Frame(each))} == INPUTS
    assert not [each for each in range(0x800) if passes(Frame(each, remote=True))]
    for each in range(0x800):
        for extended in (each, each << 18, each << 18 | 0x110, each << 15, 0x110 << 18 | each << 7):
            assert passes(Frame(extended, extended=True)) is None
            assert passes(Frame(extended, extended=True, remote=True)) is None
    assert len({(passes(Frame(each)) or (None,))[0] for each in INPUTS}) == 1, "one FIFO, so that order is kept"


def test_foreign_frames_never_reach_software(talk: Talk, board: Board) -> None:
    foreign = [Frame(each, bytes(8)) for each in (0x10F, 0x113, 0x121, 0x210, 0x7FF, 0)]
    foreign += [Frame(each, remote=True, dlc=8) for each in INPUTS]
    foreign += [Frame(each << 18, bytes(8), extended=True) for each in INPUTS]
    foreign += [Frame(each, bytes(8), extended=True) for each in INPUTS]
    for _ in range(3):
        board.peer.send(*foreign)
        talk.ask()
    board.run(5 * MS)
    assert board.bus.frames > 3 * len(foreign)
    assert [fifo.taken for fifo in board.can.fifos] == [2 * 3, 0]
    assert [len(fifo.messages) for fifo in board.can.fifos] == [0, 0]
