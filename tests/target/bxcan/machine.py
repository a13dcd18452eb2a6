"""An STM32F405 that runs an image: Unicorn's Cortex-M4F in the simulated chip, on a simulated CAN bus.

Unicorn has instructions and memory, and nothing else. Here are time (one cycle for an instruction, a few for an access
to a peripheral), interrupts (DDI 0403E B1.5), WFI, reset and hard faults. Every run is the same to the bit.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from target.bxcan.chip import Chip
from target.bxcan.cortex import CPACR, HARD_FAULT, HFSR, VTOR
from target.bxcan.elf import FLASH, Image
from unicorn import (
    UC_ARCH_ARM,
    UC_HOOK_CODE,
    UC_HOOK_INTR,
    UC_MODE_MCLASS,
    UC_MODE_THUMB,
    UC_PROT_EXEC,
    UC_PROT_READ,
    Uc,
    UcError,
)
from unicorn import arm_const as arm

SLICE = 2000
"""Instructions run at a time when nothing is due before. Interrupts that software itself causes come at the end of a
slice, all others at their time."""
ACCESS_CYCLES, EXCEPTION_CYCLES = 4, 12
STORM = 1000
"""So many exceptions within a millisecond are a cause that nobody clears; the image has some ten."""
WFI, CPSIE = b"\x30\xbf", b"\x62\xb6"
EXCEPTION_EXIT = 8
"""Number by which Unicorn tells that an EXC_RETURN value was loaded into the program counter."""
EXC_RETURN_THREAD, EXC_RETURN_HANDLER = 0xFFFFFFE9, 0xFFFFFFE1
"""Both with a floating-point frame: once the FPU is on, every frame is one here, as with LSPEN = 0."""
CORE = (arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3, arm.UC_ARM_REG_R12)
CORE_AND_LINK = [*CORE, arm.UC_ARM_REG_LR]
FLOATS = [arm.UC_ARM_REG_S0 + k for k in range(16)] + [arm.UC_ARM_REG_FPSCR]
FRAME = struct.Struct("<8I18I")
XPSR_FLAGS, XPSR_THUMB, XPSR_ALIGN = 0xF80F0000, 1 << 24, 1 << 9
NOWHERE = 0xFFFFFFFE


class MachineError(Exception):
    """The machine has done what this model cannot follow."""


@dataclass(frozen=True)
class Reset:
    time_ns: int
    cause: str


class Machine:
    """`chip` holds the peripherals; `resets` what has happened beside power-on."""

    def __init__(self, elf: Path, chip: Chip) -> None:
        self.chip, self.schedule = chip, chip.schedule
        self.image = Image(elf)
        self.resets: list[Reset] = []
        self.faults: list[int] = []
        """Addresses of the instructions that have made a hard fault."""
        self.is_asleep = False
        self.sleeps = set(self.image.find(WFI))
        self._recent: deque[int] = deque(maxlen=STORM)
        self._wants_exit = False
        self._reset_cause: str | None = None
        chip.on_reset = self._request_reset
        chip.where = self._where
        self.cpu = self._make_cpu()
        self.cpu.mem_write(FLASH, self.image.flash)
        for address in self.image.find(CPSIE):
            self.cpu.hook_add(UC_HOOK_CODE, self._unmasked, None, address + 2, address + 2)
        self._start()

    def _make_cpu(self) -> Uc:
        cpu = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        cpu.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        cpu.mem_map(FLASH, 1 << 20, UC_PROT_READ | UC_PROT_EXEC)
        cpu.mem_map(0x20000000, 128 << 10)
        for base, size in self.chip.REGIONS:
            cpu.mmio_map(base, size, self._read, base, self._write, base)
        cpu.hook_add(UC_HOOK_INTR, self._interrupted)
        return cpu

    # --- reset -------------------------------------------------------------------------------------------------

    def _start(self) -> None:
        stack, entry = struct.unpack("<II", self.cpu.mem_read(FLASH, 8))
        self.chip.cortex.registers[VTOR] = FLASH
        for register in (*CORE_AND_LINK, arm.UC_ARM_REG_PRIMASK):
            self.cpu.reg_write(register, 0)
        self.cpu.reg_write(arm.UC_ARM_REG_XPSR, XPSR_THUMB)
        self.cpu.reg_write(arm.UC_ARM_REG_MSP, stack)
        self.cpu.reg_write(arm.UC_ARM_REG_SP, stack)
        self.cpu.reg_write(arm.UC_ARM_REG_PC, entry)
        self.is_asleep = False

    def _request_reset(self, cause: str) -> None:
        """At the end of the slice: stopped within an access to a peripheral, Unicorn would repeat it."""
        self._reset_cause = cause

    def _reset(self, cause: str) -> None:
        self._reset_cause = None
        self.resets.append(Reset(self.schedule.now, cause))
        self.chip.reset(cause)
        self._start()

    # --- running -----------------------------------------------------------------------------------------------

    def run(self, time_ns: int, until: Callable[[], bool] = lambda: False) -> bool:
        """Run so long, or until it is so after some slice; return whether it has become so."""
        end = self.schedule.now + time_ns
        while not until():
            if self.schedule.now >= end:
                return False
            self._step(end)
        return True

    def _step(self, end: int) -> None:
        self.schedule.advance(self.schedule.now)
        if self._reset_cause is not None:
            self._reset(self._reset_cause)
        cortex = self.chip.cortex
        cortex.ask(self.chip.can.interrupts())
        exception = cortex.next_exception()
        if exception is not None:
            self.is_asleep = False
            if exception <= HARD_FAULT or not self.cpu.reg_read(arm.UC_ARM_REG_PRIMASK):
                self._enter(exception)
        due = min(end, self.schedule.next_ns() or end)
        if self.is_asleep:
            self.schedule.advance(due)
        else:
            self._run_slice(due)

    def _run_slice(self, due: int) -> None:
        start, cycle_ns = self.schedule.now, 1e9 / self.chip.clocks.hclk_hz()
        count = max(1, min(SLICE, int((due - start) / cycle_ns)))
        pc = self.cpu.reg_read(arm.UC_ARM_REG_PC)
        try:
            self.cpu.emu_start(pc | 1, NOWHERE, count=count)
        except UcError as error:
            self._fault(error)
        pc = self.cpu.reg_read(arm.UC_ARM_REG_PC)
        if self._wants_exit:
            self._wants_exit = False
            self._leave()
        elif pc - 2 in self.sleeps:
            self.is_asleep = True
        else:
            self.schedule.advance(start + max(1, round(count * cycle_ns)))

    def _read(self, cpu: Uc, offset: int, size: int, base: int) -> int:
        self._pass_time(ACCESS_CYCLES)
        return self.chip.read(base + offset, size)

    def _write(self, cpu: Uc, offset: int, size: int, value: int, base: int) -> None:
        self._pass_time(ACCESS_CYCLES)
        self.chip.write(base + offset, size, value)

    def _pass_time(self, cycles: int) -> None:
        step = int(cycles * 1e9 / self.chip.clocks.hclk_hz())
        self.schedule.advance(self.schedule.now + step)

    def _unmasked(self, cpu: Uc, address: int, size: int, data: object) -> None:
        """After the instruction that lets interrupts in: those that wait come at once."""
        cortex = self.chip.cortex
        cortex.ask(self.chip.can.interrupts())
        if cortex.next_exception() is not None:
            cpu.emu_stop()

    def _where(self) -> str:
        return self.image.describe(self.cpu.reg_read(arm.UC_ARM_REG_PC))

    # --- exceptions (DDI 0403E B1.5.6 to B1.5.8) ---------------------------------------------------------------

    def _interrupted(self, cpu: Uc, number: int, data: object) -> None:
        if number != EXCEPTION_EXIT:
            raise MachineError(f"exception {number} of QEMU's core is not modelled, {self._where()}")
        self._wants_exit = True
        cpu.emu_stop()

    def _enter(self, exception: int) -> None:
        cpu, cortex = self.cpu, self.chip.cortex
        if not cortex.registers.get(CPACR, 0):
            raise MachineError(f"exception {exception} before the FPU is on")
        stack, pc, xpsr = cpu.reg_read_batch([arm.UC_ARM_REG_SP, arm.UC_ARM_REG_PC, arm.UC_ARM_REG_XPSR])
        self._recent.append(self.schedule.now)
        if len(self._recent) == STORM and self.schedule.now - self._recent[0] < 1_000_000:
            raise MachineError(f"exception {exception} comes again and again, {self._where()}")
        pad = stack & 4
        state = xpsr & (XPSR_FLAGS | 0x1FF) | XPSR_THUMB | (XPSR_ALIGN if pad else 0)
        frame = FRAME.pack(*cpu.reg_read_batch(CORE_AND_LINK), pc, state, *cpu.reg_read_batch(FLOATS), 0)
        stack -= FRAME.size + pad
        try:
            cpu.mem_write(stack, frame)
        except UcError:
            if exception != HARD_FAULT:
                raise MachineError(f"no memory for the stack at {stack:#x}, {self._where()}") from None
        cpu.reg_write(arm.UC_ARM_REG_SP, stack)
        cpu.reg_write(arm.UC_ARM_REG_LR, EXC_RETURN_HANDLER if cortex.active else EXC_RETURN_THREAD)
        cortex.enter(exception)
        self._pass_time(EXCEPTION_CYCLES)
        cpu.reg_write(arm.UC_ARM_REG_XPSR, XPSR_THUMB | exception)
        (handler,) = struct.unpack("<I", cpu.mem_read(cortex.registers[VTOR] + 4 * exception, 4))
        if not handler & 1:
            raise MachineError(f"exception {exception} has no handler in the vector table")
        cpu.reg_write(arm.UC_ARM_REG_PC, handler)

    def _leave(self) -> None:
        cpu, cortex = self.cpu, self.chip.cortex
        if not cortex.active:
            raise MachineError("return from an exception in none")
        cortex.leave()
        self._pass_time(EXCEPTION_CYCLES)
        stack = cpu.reg_read(arm.UC_ARM_REG_SP)
        values = FRAME.unpack(cpu.mem_read(stack, FRAME.size))
        for register, value in zip((*CORE_AND_LINK, *FLOATS), (*values[:6], *values[8:25]), strict=True):
            cpu.reg_write(register, value)
        pc, xpsr = values[6:8]
        cpu.reg_write(arm.UC_ARM_REG_SP, stack + FRAME.size + (4 if xpsr & XPSR_ALIGN else 0))
        cpu.reg_write(arm.UC_ARM_REG_XPSR, xpsr & ~XPSR_ALIGN)
        cpu.reg_write(arm.UC_ARM_REG_PC, pc | 1)

    def _fault(self, error: UcError) -> None:
        self.faults.append(self.cpu.reg_read(arm.UC_ARM_REG_PC))
        self.chip.cortex.registers[HFSR] = 1 << 30
        if HARD_FAULT in self.chip.cortex.active:
            raise MachineError(f"lock-up: {error}, {self._where()}")
        self.chip.cortex.pending.add(HARD_FAULT)

    # --- tampering ---------------------------------------------------------------------------------------------

    def patch(self, symbol: str, code: bytes) -> Callable[[], None]:
        """Replace the beginning of a function; return what undoes it."""
        address = self.image.symbols[symbol]
        before = bytes(self.cpu.mem_read(address, len(code)))

        def write(content: bytes) -> None:
            self.cpu.mem_write(address, content)
            self.cpu.ctl_remove_cache(address, address + len(content))

        write(code)
        return lambda: write(before)

    def answer(self, symbol: str, value: int) -> None:
        """Make a function return this at once, as long as the machine lasts."""

        def instead(cpu: Uc, *_: object) -> None:
            cpu.reg_write(arm.UC_ARM_REG_R0, value)
            cpu.reg_write(arm.UC_ARM_REG_PC, cpu.reg_read(arm.UC_ARM_REG_LR))

        address = self.image.symbols[symbol]
        self.cpu.hook_add(UC_HOOK_CODE, instead, None, address, address)

    # --- looking in --------------------------------------------------------------------------------------------

    def word(self, symbol: str, offset: int = 0) -> int:
        """32 bits of a variable of the image."""
        return int.from_bytes(self.cpu.mem_read(self.image.symbols[symbol] + offset, 4), "little")
