"""Clock tree, flash wait states and voltage scale of an STM32F405: RM0090 chapters 3.9, 5.4 and 7.3; limits of the data
sheet (DS8626, 2.7 V to 3.6 V)."""

from __future__ import annotations

from collections.abc import Callable

from target.bxcan.schedule import Schedule, Timers

MHZ = 1_000_000
HSI_HZ = 16 * MHZ
CR, PLLCFGR, CFGR, AHB1ENR, APB1RSTR, APB1ENR, APB2ENR, CSR, END = 0, 4, 8, 0x30, 0x20, 0x40, 0x44, 0x74, 0x88
RESET_VALUES = {CR: 0x83, PLLCFGR: 0x24003010, AHB1ENR: 0x00100000, 0x50: 0x7E6791FF, 0x54: 0xF1, 0x58: 1}
RESET_VALUES |= {0x60: 0x36FEC9FF, 0x64: 0x00075F33, 0x84: 0x24003000}
BITS = {CR: 0x030F00F9, PLLCFGR: 0x0F437FFF, CFGR: 0xFFFFFCF3}
HSION, HSEON, CSSON, PLLON = 1, 1 << 16, 1 << 19, 1 << 24
HSI, HSE, PLL = 0, 1, 2
POWER_ON, SOFTWARE, WATCHDOG = 0x0E000000, 1 << 28 | 1 << 26, 1 << 29 | 1 << 26
"""Reset flags of RCC_CSR; the pin NRST goes low with each of them."""
START_NS = {HSEON: 2_000_000, PLLON: 200_000, HSION: 4_000}
AHB_DIVIDER = dict.fromkeys(range(8), 1) | dict(zip(range(8, 16), (2, 4, 8, 16, 64, 128, 256, 512), strict=True))
APB_DIVIDER = dict.fromkeys(range(4), 1) | {4: 2, 5: 4, 6: 8, 7: 16}


class Clocks:
    """`hse_hz` 0: a crystal that does not start; `pll_locks`: on which of HSI and HSE the PLL does."""

    def __init__(
        self, schedule: Schedule, misuse: Callable[[str], None], hse_hz: int, pll_locks: tuple[int, ...]
    ) -> None:
        self.timers = Timers(schedule)
        self.misuse = misuse
        self.hse_hz, self.pll_locks = hse_hz, pll_locks
        self.on_can_reset: Callable[[], None] = lambda: None
        self.on_crystal_failure: Callable[[], None] = lambda: None
        self.registers: dict[int, int] = {}
        self.reset(POWER_ON)

    def reset(self, cause: int) -> None:
        self.timers.cancel()
        kept = self.registers.get(CSR, 0) & 0xFE000000
        self.registers = dict.fromkeys(range(0, END, 4), 0) | RESET_VALUES | {CSR: kept | cause}
        self.ready = HSION
        self.source = HSI
        self.latency = 0
        self.vos = 1

    # --- frequencies -------------------------------------------------------------------------------------------

    def _pll_source(self) -> int:
        return HSE if self.registers[PLLCFGR] >> 22 & 1 else HSI

    def pll_hz(self) -> float:
        value = self.registers[PLLCFGR]
        source = self.hse_hz if value >> 22 & 1 else HSI_HZ
        divider = value & 0x3F
        return source / divider * (value >> 6 & 0x1FF) / (2 * (value >> 16 & 3) + 2) if divider else 0.0

    def sysclk_hz(self) -> float:
        return (HSI_HZ, self.hse_hz, self.pll_hz())[self.source]

    def hclk_hz(self) -> float:
        return self.sysclk_hz() / AHB_DIVIDER[self.registers[CFGR] >> 4 & 15]

    def apb1_hz(self) -> float:
        return self.hclk_hz() / APB_DIVIDER[self.registers[CFGR] >> 10 & 7]

    def apb2_hz(self) -> float:
        return self.hclk_hz() / APB_DIVIDER[self.registers[CFGR] >> 13 & 7]

    def is_enabled(self, register: int, bit: int) -> bool:
        return bool(self.registers[register] >> bit & 1)

    # --- RCC ---------------------------------------------------------------------------------------------------

    def read(self, offset: int, size: int) -> int:
        value = self.registers[offset & ~3]
        if offset == CR:
            value |= (self.ready & (HSEON | PLLON | HSION)) << 1
        elif offset == CFGR:
            value = value & ~0xC | self.source << 2
        elif offset == CSR:
            value |= (value & 1) << 1
        return value

    def write(self, offset: int, size: int, value: int) -> None:
        unknown = value & ~BITS.get(offset, 0xFFFFFFFF) & ~RESET_VALUES.get(offset, 0) & ~self.read(offset, 4)
        if unknown:
            self.misuse(f"RCC: sets reserved bits {unknown:#x} of the register at {offset:#x}")
        before, self.registers[offset] = self.registers[offset], value
        if offset == CR:
            self.registers[CR] = value & BITS[CR]
            self._switch(before, value)
        elif offset == PLLCFGR and self.registers[CR] & PLLON:
            self.misuse("RCC: PLLCFGR is written while the PLL is on (7.3.2)")
        elif offset == CFGR:
            self._select(value & 3)
        elif offset == APB1RSTR and value >> 25 & 1:
            self.on_can_reset()
        elif offset == CSR:
            self.registers[CSR] = value & 1 | (0 if value >> 24 & 1 else before & 0xFE000000)

    def _switch(self, before: int, after: int) -> None:
        """Oscillators and PLL on, which takes time, or off."""
        if after & ~before & PLLON:
            self._check_pll()
        for bit in (HSION, HSEON, PLLON):
            if after & ~before & bit:
                if (bit != HSEON or self.hse_hz) and (bit != PLLON or self._pll_source() in self.pll_locks):
                    self.timers.after(START_NS[bit], lambda bit=bit: self._becomes_ready(bit))  # type: ignore[misc]
            elif not after & bit:
                self.ready &= ~bit
                if bit == (HSION, HSEON, PLLON)[self.source]:
                    self.misuse("RCC: the clock that the system runs on is switched off")

    def _becomes_ready(self, bit: int) -> None:
        if self.registers[CR] & bit:
            self.ready |= bit

    def break_crystal(self) -> None:
        """Stop the crystal. The clock security system notices (7.2.7): HSI takes over, and an NMI says so."""
        self.hse_hz = 0
        self.ready &= ~HSEON
        if self.registers[CR] & CSSON:
            self.registers[CR] &= ~(HSEON | PLLON)
            self.ready &= ~PLLON
            self.source = HSI
            self.on_crystal_failure()

    def _check_pll(self) -> None:
        value = self.registers[PLLCFGR]
        source = self._pll_source()
        if not self.ready & (HSION, HSEON)[source]:
            self.misuse("RCC: the PLL is switched on before its source is ready")
        divider = max(1, value & 0x3F)
        comparison = (HSI_HZ, self.hse_hz)[source] / divider
        vco = comparison * (value >> 6 & 0x1FF)
        if not (1 * MHZ <= comparison <= 2 * MHZ and 100 * MHZ <= vco <= 432 * MHZ):
            self.misuse(f"RCC: PLL compares at {comparison / MHZ} MHz (1 to 2), VCO at {vco / MHZ} MHz (100 to 432)")

    def _select(self, source: int) -> None:
        if source != self.source:
            if source > PLL or not self.ready & (HSION, HSEON, PLLON)[source]:
                self.misuse(f"RCC: SW selects clock {source}, which is not ready")
                return
            self.source = source
        self.check_limits()

    def check_limits(self) -> None:
        hclk = self.hclk_hz()
        limit = (144 if self.vos == 0 else 168) * MHZ
        for name, frequency, greatest in (
            ("HCLK", hclk, limit),
            ("APB1", self.apb1_hz(), limit / 4),
            ("APB2", self.apb2_hz(), limit / 2),
        ):
            if frequency > greatest:
                self.misuse(f"RCC: {name} runs at {frequency / MHZ} MHz; at most {greatest / MHZ}")
        if hclk > 30 * MHZ * (self.latency + 1):
            self.misuse(f"FLASH: {self.latency} wait states are too few at {hclk / MHZ} MHz (3.5.1)")


class Flash:
    """FLASH_ACR; programming is not there."""

    def __init__(self, clocks: Clocks) -> None:
        self.clocks = clocks
        self.acr = 0

    def read(self, offset: int, size: int) -> int:
        return self.acr if offset == 0 else 0

    def write(self, offset: int, size: int, value: int) -> None:
        if offset != 0 or value & ~0x1F07:
            self.clocks.misuse(f"FLASH: writes {value:#x} to offset {offset:#x}")
            return
        self.acr = value
        self.clocks.latency = value & 7
        self.clocks.check_limits()


class Power:
    """PWR_CR and PWR_CSR, of which VOS matters."""

    def __init__(self, clocks: Clocks) -> None:
        self.clocks = clocks
        self.cr = 0x4000

    def read(self, offset: int, size: int) -> int:
        return self.cr if offset == 0 else 0x4000

    def write(self, offset: int, size: int, value: int) -> None:
        if offset == 0:
            self.cr = value
            self.clocks.vos = value >> 14 & 1
            self.clocks.check_limits()
