"""The peripherals of an STM32F405 that the image uses, at their addresses (RM0090 2.3, table 1), and who gates whom.

Anything else that is touched is misuse, as is what a peripheral says of itself. A peripheral whose clock is off in RCC
reads as 0 and ignores writes, and is misused when accessed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from target.bxcan.bus import Bus
from target.bxcan.bxcan import BxCan
from target.bxcan.clocks import AHB1ENR, APB1ENR, HSE, HSI, SOFTWARE, WATCHDOG, Clocks, Flash, Power
from target.bxcan.cortex import NMI, Cortex
from target.bxcan.pins import PORTS, Pins
from target.bxcan.watchdog import Watchdog

CAN1EN, PWREN = 25, 28
CORE_AT, CAN1_AT = 0xE000E000, 0x40006400
SOFTWARE_RESET = "software"
WATCHDOG_RESET = "watchdog"


@dataclass(frozen=True)
class Misuse:
    time_ns: int
    what: str
    where: str

    def __str__(self) -> str:
        return f"{self.time_ns / 1e6:.3f} ms, {self.where}: {self.what}"


class Peripheral(Protocol):
    def read(self, offset: int, size: int) -> int: ...
    def write(self, offset: int, size: int, value: int) -> None: ...


class DebugUnit:
    """DBGMCU (RM0090 38.16): what it freezes does not matter here."""

    def __init__(self) -> None:
        self.registers = {0: 0x10076413}

    def read(self, offset: int, size: int) -> int:
        return self.registers.get(offset, 0)

    def write(self, offset: int, size: int, value: int) -> None:
        if offset:
            self.registers[offset] = value


class Chip:
    """`misuses` is what software has done wrong; `on_reset` and `where` are the machine's."""

    REGIONS = ((0x40000000, 0x80000), (CORE_AT, 0x1000), (0xE0042000, 0x1000))

    def __init__(
        self,
        bus: Bus,
        hse_hz: int = 8_000_000,
        pll_locks: tuple[int, ...] = (HSI, HSE),
        lsi_hz: int = 32_000,
    ) -> None:
        self.schedule = bus.schedule
        self.misuses: list[Misuse] = []
        self.on_reset: Callable[[str], None] = lambda cause: None
        self.where: Callable[[], str] = lambda: "from outside"
        self.clocks = Clocks(self.schedule, self.misuse, hse_hz, pll_locks)
        self.pins = Pins(self.misuse)
        self.watchdog = Watchdog(self.schedule, self.misuse, lambda: self.on_reset(WATCHDOG_RESET), lsi_hz)
        self.cortex = Cortex(self.schedule, self.misuse, self.clocks.hclk_hz, lambda: self.on_reset(SOFTWARE_RESET))
        self.can = BxCan(bus, self)
        self.clocks.on_can_reset = self.can.reset
        self.clocks.on_crystal_failure = lambda: self.cortex.pending.add(NMI)
        self.power = Power(self.clocks)
        self.flash = Flash(self.clocks)
        self._map: dict[int, tuple[Peripheral, tuple[int, int] | None]] = {
            CAN1_AT: (self.can, (APB1ENR, CAN1EN)),
            0x40003000: (self.watchdog, None),
            0x40007000: (self.power, (APB1ENR, PWREN)),
            0x40023800: (self.clocks, None),
            0x40023C00: (self.flash, None),
            CORE_AT: (self.cortex, None),
            0xE0042000: (DebugUnit(), None),
        }
        for k, name in enumerate(PORTS):
            self._map[0x40020000 + 0x400 * k] = (self.pins.ports[name], (AHB1ENR, k))

    def reset(self, cause: str) -> None:
        self.clocks.reset(WATCHDOG if cause == WATCHDOG_RESET else SOFTWARE)
        self.flash.acr, self.power.cr = 0, 0x4000
        for part in (self.pins, self.watchdog, self.cortex, self.can):
            part.reset()

    # --- what CAN1 asks for ------------------------------------------------------------------------------------

    def apb1_hz(self) -> float:
        return self.clocks.apb1_hz()

    def is_can_clocked(self) -> bool:
        return self.clocks.is_enabled(APB1ENR, CAN1EN)

    def can_pin_problem(self) -> str | None:
        return self.pins.can_pin_problem()

    def misuse(self, what: str) -> None:
        self.misuses.append(Misuse(self.schedule.now, what, self.where()))

    # --- the bus of the processor ------------------------------------------------------------------------------

    def _find(self, address: int) -> tuple[Peripheral, int] | None:
        base = CORE_AT if address >> 12 == CORE_AT >> 12 else address & ~0x3FF
        peripheral, gate = self._map.get(base, (None, None))
        if peripheral is None:
            self.misuse(f"accesses {address:#010x}, where this model has nothing")
        elif gate is not None and not self.clocks.is_enabled(*gate):
            self.misuse(f"accesses {address:#010x} while bit {gate[1]} of RCC+{gate[0]:#x} (its clock) is 0")
        else:
            return peripheral, address - base
        return None

    def read(self, address: int, size: int) -> int:
        found = self._find(address)
        return found[0].read(found[1], size) & ((1 << 8 * size) - 1) if found is not None else 0

    def write(self, address: int, size: int, value: int) -> None:
        found = self._find(address)
        if found is not None:
            found[0].write(found[1], size, value)
