"""What a Cortex-M4 has beside its instructions: NVIC, system control block, SysTick (ARMv7-M, DDI 0403E).

The core itself is Unicorn's, which knows no interrupts: entering and leaving them is in machine.py.
"""

from __future__ import annotations

from collections.abc import Callable

from target.bxcan.schedule import Schedule, Timers

SYSTICK, CSR, RVR, CVR = 15, 0x010, 0x014, 0x018
ISER, ICER, ISPR, ICPR, IABR, IPR, IPR_END = 0x100, 0x180, 0x200, 0x280, 0x300, 0x400, 0x4F0
CPUID, ICSR, VTOR, AIRCR, CCR, SHPR, CFSR, HFSR = 0xD00, 0xD04, 0xD08, 0xD0C, 0xD14, 0xD18, 0xD28, 0xD2C
CPACR, FPCCR = 0xD88, 0xF34
VECTKEY, SYSRESETREQ = 0x05FA, 4
NMI, HARD_FAULT = 2, 3
THREAD_PRIORITY = 256
"""Lower than that of any interrupt."""


class Cortex:
    """Registers at 0xE000E000. `hclk` gives the frequency [Hz]."""

    def __init__(
        self,
        schedule: Schedule,
        misuse: Callable[[str], None],
        hclk: Callable[[], float],
        request_reset: Callable[[], None],
    ) -> None:
        self.schedule, self.timers = schedule, Timers(schedule)
        self.misuse, self.hclk, self.request_reset = misuse, hclk, request_reset
        self.reset()

    def reset(self) -> None:
        self.timers.cancel()
        self.registers: dict[int, int] = {CPUID: 0x410FC241, VTOR: 0, AIRCR: 0xFA050000, CCR: 0x200, FPCCR: 0xC0000000}
        self.enabled: set[int] = set()
        self.pending: set[int] = set()
        self.active: list[int] = []
        self.priorities = bytearray(240)
        self.system_priorities = bytearray(12)
        self.tick_at = 0
        self.is_tick_flagged = False

    # --- exceptions --------------------------------------------------------------------------------------------

    def priority(self, exception: int) -> int:
        """Return the priority of an exception (interrupts from 16 on); four bits are there."""
        if exception in (NMI, HARD_FAULT):
            return exception - 4
        return self.priorities[exception - 16] if exception >= 16 else self.system_priorities[exception - 4]

    def execution_priority(self) -> int:
        return min((self.priority(exception) for exception in self.active), default=THREAD_PRIORITY)

    def ask(self, interrupts: set[int]) -> None:
        """Interrupts whose line is active now."""
        self.pending |= {16 + number for number in interrupts} - set(self.active)

    def next_exception(self) -> int | None:
        """Return the pending exception that would be taken if none were masked."""
        ready = [each for each in self.pending if each < 16 or each - 16 in self.enabled]
        first = min(ready, key=lambda each: (self.priority(each), each), default=None)
        return first if first is not None and self.priority(first) < self.execution_priority() else None

    def enter(self, exception: int) -> None:
        self.pending.discard(exception)
        self.active.append(exception)

    def leave(self) -> None:
        self.active.pop()

    # --- registers ---------------------------------------------------------------------------------------------

    def read(self, offset: int, size: int) -> int:
        word = self._word(offset & ~3)
        return word >> 8 * (offset & 3) & ((1 << 8 * size) - 1)

    def _word(self, offset: int) -> int:
        if offset in (CSR, CVR):
            return self._systick(offset)
        bank = offset & 0x1C
        if ISER <= offset < ICER + 0x20:
            return _mask(self.enabled, bank * 8)
        if ISPR <= offset < IABR + 0x20:
            chosen = self.active if offset >= IABR else self.pending
            return _mask({each - 16 for each in chosen}, bank * 8)
        if IPR <= offset < IPR_END:
            return int.from_bytes(self.priorities[offset - IPR : offset - IPR + 4], "little")
        if SHPR <= offset < SHPR + 12:
            return int.from_bytes(self.system_priorities[offset - SHPR : offset - SHPR + 4], "little")
        if offset == ICSR:
            return (self.active[-1] if self.active else 0) | (SYSTICK in self.pending) << 26
        return self.registers.get(offset, 0)

    def write(self, offset: int, size: int, value: int) -> None:
        raw = value.to_bytes(size, "little")
        if IPR <= offset < IPR_END:
            self.priorities[offset - IPR : offset - IPR + size] = bytes(byte & 0xF0 for byte in raw)
        elif SHPR <= offset < SHPR + 12:
            self.system_priorities[offset - SHPR : offset - SHPR + size] = bytes(byte & 0xF0 for byte in raw)
        elif ISER <= offset < IABR:
            self._write_nvic(offset, {offset % 0x20 * 8 + k for k in range(32) if value >> k & 1})
        elif offset in (CSR, RVR, CVR):
            self._write_systick(offset, value)
        elif offset == AIRCR:
            self._write_aircr(value)
        elif offset == ICSR:
            self.pending |= {SYSTICK} if value >> 26 & 1 else set()
            self.pending -= {SYSTICK} if value >> 25 & 1 else set()
        elif offset in (CFSR, HFSR):
            self.registers[offset] = self.registers.get(offset, 0) & ~value
        else:
            self.registers[offset] = value

    def _write_nvic(self, offset: int, numbers: set[int]) -> None:
        exceptions = {16 + number for number in numbers}
        if offset < ICER:
            self.enabled |= numbers
        elif offset < ISPR:
            self.enabled -= numbers
        elif offset < ICPR:
            self.pending |= exceptions
        else:
            self.pending -= exceptions

    def _write_aircr(self, value: int) -> None:
        if value >> 16 != VECTKEY:
            self.misuse(f"SCB: AIRCR is written without its key: {value:#010x}")
        elif value & SYSRESETREQ:
            self.request_reset()

    # --- SysTick (B3.3) ----------------------------------------------------------------------------------------

    def _tick_ns(self, ticks: int) -> int:
        """Return time of so many ticks; the reference clock is HCLK/8 (RM0090 6.2)."""
        divider = 1 if self.registers.get(CSR, 0) & 4 else 8
        return round(ticks * divider * 1e9 / self.hclk())

    def _systick(self, offset: int) -> int:
        if offset == CSR:
            value = self.registers.get(CSR, 0) | self.is_tick_flagged << 16
            self.is_tick_flagged = False
            return value
        if not self.registers.get(CSR, 0) & 1:
            return 0
        return int(max(0, self.tick_at - self.schedule.now) / max(1e-9, self._tick_ns(1000) / 1000))

    def _write_systick(self, offset: int, value: int) -> None:
        if offset == CVR:
            self.is_tick_flagged = False
        else:
            self.registers[offset] = value & (7 if offset == CSR else 0xFFFFFF)
        if offset in (CSR, CVR):
            self.timers.cancel()
            if self.registers.get(CSR, 0) & 1 and self.registers.get(RVR, 0):
                self._count_down(self.schedule.now)

    def _count_down(self, start: int) -> None:
        self.tick_at = start + self._tick_ns(self.registers[RVR] + 1)
        self.timers.at(self.tick_at, self._tick)

    def _tick(self) -> None:
        self.is_tick_flagged = True
        if self.registers[CSR] & 2:
            self.pending.add(SYSTICK)
        self._count_down(self.tick_at)


def _mask(numbers: set[int], first: int) -> int:
    return sum(1 << number - first for number in numbers if first <= number < first + 32)
