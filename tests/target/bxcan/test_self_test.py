"""Self tests that go on while the image runs, the watchdog that finished steps feed, reset causes on the bus."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from lever_cdkf.can import codec
from lever_cdkf.firmware.native import lib
from target.bxcan import memory
from target.bxcan.board import MS, Board
from target.bxcan.bxcan import RX0_IRQ, TX_IRQ
from target.bxcan.chip import SOFTWARE_RESET, WATCHDOG_RESET
from target.bxcan.cortex import CSR
from target.bxcan.memory import Bit
from target.bxcan.talk import Talk, answers, is_estimate, sample
from target.bxcan.test_trouble import HANG, UNDEFINED
from unicorn import UC_HOOK_CODE, Uc
from unicorn import arm_const as arm

RAM = 0x2000_0000
SLICE_BYTES = 32
RETURN_DONE = b"\x01\x20\x70\x47"
"""movs r0, #1; bx lr: a function that does nothing, and says that it has."""
STACK_FAILED = 4
"""Of enum message_self_test (can/messages.h)."""
CAUSES = {
    str(name): raw for raw, name in (codec.message("PLATFORM_RESET").get_signal_by_name("cause").choices or {}).items()
}


def failed(board: Board) -> int:
    """Return what PLATFORM_RESET will say."""
    return board.machine.word("reset", 4) >> 16 & 0xFF


def without_framing(values: dict[str, float]) -> dict[str, float]:
    return {name: value for name, value in values.items() if name not in ("crc", "counter")}


def report_of_start(board: Board) -> dict[str, float]:
    """PLATFORM_RESET after a start; it comes with the first sample."""
    board.start()
    with Talk(board) as talk:
        return without_framing(talk.report("PLATFORM_RESET"))


# --- memory --------------------------------------------------------------------------------------------------------


def test_sound_memory_passes(board: Board) -> None:
    """A second, with samples and without: all of ROM, and all of RAM more than twice."""
    with Talk(board) as talk:
        for _ in range(300):
            talk.ask()
        talk.expected()
        board.run(1150 * MS)
        talk.ask()
        assert answers([frame for _, frame in board.peer.heard[-1:]]) == talk.expected()[-1:]
    assert failed(board) == 0
    assert board.machine.word("ram_passes") >= 3
    assert board.machine.word("rom", 20) >= 2, "passes, with the one at power-on"


@pytest.mark.requirement("R45")
def test_flipped_bit_of_flash_is_found_while_the_image_runs(talk: Talk, board: Board) -> None:
    """In the golden vector, which nothing reads after power-on."""
    assert talk.report("PLATFORM_HEALTH")["faults"] == 0
    address = board.machine.image.symbols["golden_input"] + 100
    board.machine.cpu.mem_write(address, bytes([board.machine.cpu.mem_read(address, 1)[0] ^ 8]))
    assert board.machine.run(2000 * MS, lambda: failed(board) != 0)
    assert talk.report("PLATFORM_HEALTH")["faults"] == lib.LEVER_PLATFORM_ROM
    assert board.machine.resets == []


def test_the_march_reaches_all_of_ram_in_use(board: Board) -> None:
    """In any two passes; its own stack from another depth in each."""
    image, cpu = board.machine.image, board.machine.cpu
    reached: set[int] = set()

    def note(cpu: Uc, *_: object) -> None:
        address, stack = cpu.reg_read_batch([arm.UC_ARM_REG_R0, arm.UC_ARM_REG_SP])
        assert not stack - 256 < address < stack, "the march would step on its own stack"
        assert cpu.reg_read(arm.UC_ARM_REG_PRIMASK), "an interrupt could see it"
        reached.add(address)

    march = image.symbols["ram_test_slice"]
    hook = cpu.hook_add(UC_HOOK_CODE, note, None, march, march)
    first = board.machine.word("ram_passes")
    assert board.machine.run(2000 * MS, lambda: board.machine.word("ram_passes") >= first + 3)
    cpu.hook_del(hook)
    end = image.symbols["image_ram_used_end"]
    assert end > max(image.symbols[name] for name in ("image_bss_end", "fault_last", "crystal_state", "resets"))
    assert reached == set(range(RAM, end, SLICE_BYTES))


@pytest.mark.parametrize(
    ("place", "offset", "bit", "value"),
    [
        pytest.param("image_ram", 0x400, 30, 1, id="stack that is not in use"),
        pytest.param("receive_bytes", 0, 30, 1, id="ring of received frames"),
        pytest.param("memory", 100, 3, 1, id="the estimator's memory"),
        pytest.param("ram_at", 0, 30, 1, id="where the test is"),
        pytest.param("ram_passes", 0, 0, 1, id="from how deep it tests"),
        pytest.param("reset", 4, 17, 0, id="where it is noted"),
    ],
)
@pytest.mark.requirement("R45")
def test_stuck_bit_of_ram_is_found_while_the_image_runs(
    talk: Talk, board: Board, place: str, offset: int, bit: int, value: int
) -> None:
    """Within two passes; also if it is one that the test needs itself."""
    assert talk.report("PLATFORM_HEALTH")["faults"] == 0
    memory.stuck(board.machine.cpu, Bit((board.machine.image.symbols[place] + offset) & ~3, bit), value)
    board.run(600 * MS)
    assert talk.report("PLATFORM_HEALTH")["faults"] == lib.LEVER_PLATFORM_SELF_TEST
    assert board.machine.resets == []


@pytest.mark.requirement("R45")
def test_stack_that_has_reached_its_end_is_found_and_told_each_second(talk: Talk, board: Board) -> None:
    """PLATFORM_HEALTH has SELF_TEST, at which torque ends; PLATFORM_RESET says which."""
    first = talk.report("PLATFORM_RESET")
    start = board.schedule.now
    board.machine.cpu.mem_write(RAM + 28, bytes(4))
    board.run(2 * MS)
    assert failed(board) == STACK_FAILED
    assert talk.report("PLATFORM_HEALTH")["faults"] == lib.LEVER_PLATFORM_SELF_TEST
    board.run(900 * MS)
    second = talk.report("PLATFORM_RESET")
    assert board.schedule.now - start == pytest.approx(1000 * MS, abs=5 * MS)
    assert (first["failed"], second["failed"]) == (0, STACK_FAILED)
    assert (first["counter"], second["counter"]) == (0, 1)
    identifier = codec.message("PLATFORM_RESET").frame_id
    reports = [frame for frame in board.peer.frames() if frame.identifier == identifier]
    assert [codec.check(identifier, frame.data) for frame in reports] == [True, True]


# --- watchdog ------------------------------------------------------------------------------------------------------


def expect_watchdog(board: Board, samples: bool = True) -> None:
    """Go on until the watchdog resets."""
    since = board.schedule.now
    if samples:
        for k in range(150):
            board.schedule.at(since + k * MS, lambda k=k: board.peer.send(*sample(k)))  # type: ignore[misc]
    assert board.machine.run(150 * MS, lambda: bool(board.machine.resets))
    assert [reset.cause for reset in board.machine.resets] == [WATCHDOG_RESET]
    assert board.schedule.now - since <= 100 * MS
    board.run(150 * MS)


@pytest.mark.parametrize("function", ["lever_step", "lever_idle", "periodic_test_step", "transport_receive"])
@pytest.mark.requirement("R46")
def test_a_function_that_hangs_is_reset(board: Board, function: str) -> None:
    board.run(20 * MS)
    assert board.machine.resets == []
    repair = board.machine.patch(function, HANG)
    board.peer.send(*sample(0))
    assert board.machine.run(150 * MS, lambda: bool(board.machine.resets))
    repair()
    report = report_of_start(board)
    assert (report["cause"], report["resets"]) == (CAUSES["watchdog"], len(board.machine.resets))
    assert {reset.cause for reset in board.machine.resets} == {WATCHDOG_RESET}


@pytest.mark.requirement("R46")
def test_a_loop_that_goes_round_and_finishes_nothing_is_reset(board: Board) -> None:
    repair = board.machine.patch("loop_turn", RETURN_DONE)
    expect_watchdog(board, samples=False)
    repair()


@pytest.mark.parametrize("interrupt", [RX0_IRQ, TX_IRQ])
@pytest.mark.requirement("R46")
def test_an_interrupt_of_the_bus_that_comes_no_more_is_reset(board: Board, interrupt: int) -> None:
    """The loop goes round, and tells the estimator that no sample comes; but one has."""
    board.chip.cortex.enabled.discard(interrupt)
    expect_watchdog(board)
    with Talk(board) as talk:
        assert is_estimate(talk.ask()[-1])


@pytest.mark.parametrize("samples", [True, False])
def test_a_clock_that_stands_is_reset(board: Board, samples: bool) -> None:
    board.chip.cortex.write(CSR, 4, 0)
    expect_watchdog(board, samples)


# --- reset causes --------------------------------------------------------------------------------------------------


def by_fault(board: Board) -> None:
    repair = board.machine.patch("lever_step", UNDEFINED)
    board.peer.send(*sample(0))
    board.machine.run(20 * MS, lambda: bool(board.machine.resets))
    repair()


@pytest.mark.parametrize(
    ("cause", "make"),
    [
        ("software", lambda board: board.chip.on_reset(SOFTWARE_RESET)),
        ("clock_failure", lambda board: board.chip.clocks.break_crystal()),
        ("hard_fault", by_fault),
    ],
)
@pytest.mark.requirement("R46")
def test_cause_of_a_reset_is_told_with_the_first_sample_and_not_again(
    board: Board, cause: str, make: Callable[[Board], None]
) -> None:
    with Talk(board) as talk:
        first = without_framing(talk.report("PLATFORM_RESET"))
    assert first == {"cause": CAUSES["power_on"], "resets": 0, "failed": 0, "fault_address": 0}
    make(board)
    board.run(5 * MS)
    assert len(board.machine.resets) == 1
    fault = board.machine.image.symbols["lever_step"] if cause == "hard_fault" else 0
    assert report_of_start(board) == {"cause": CAUSES[cause], "resets": 1, "failed": 0, "fault_address": fault}
    board.chip.on_reset(SOFTWARE_RESET)
    board.run(5 * MS)
    assert report_of_start(board) == {"cause": CAUSES["software"], "resets": 2, "failed": 0, "fault_address": fault}


@pytest.mark.parametrize(("flags", "cause"), [(1 << 25 | 1 << 26, "brown_out"), (1 << 26, "pin"), (0, "unknown")])
def test_flags_of_the_hardware(board: Board, flags: int, cause: str) -> None:
    """RM0090 7.3.21: BORRSTF, and PINRSTF, which comes with every reset."""
    board.chip.clocks.reset(0)
    board.chip.on_reset(SOFTWARE_RESET)
    board.machine.run(1)
    board.chip.clocks.registers[0x74] = flags
    assert report_of_start(board)["cause"] == CAUSES[cause]
