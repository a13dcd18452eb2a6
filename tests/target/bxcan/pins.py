"""GPIO ports: RM0090 chapter 8. What they are configured as matters here, not their levels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

PORTS = "ABCDEFGHI"
MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFRL, AFRH = range(0, 0x28, 4)
RESET_VALUES = {"A": {MODER: 0xA8000000, PUPDR: 0x64000000}, "B": {MODER: 0x280, OSPEEDR: 0xC0, PUPDR: 0x100}}
ALTERNATE, CAN1 = 2, 9
RX_PINS, TX_PINS = ("A11", "B8", "D0", "I9"), ("A12", "B9", "D1", "H13")
"""Where CAN1 can be (data sheet, table 9)."""


@dataclass
class Port:
    name: str
    misuse: Callable[[str], None]
    registers: dict[int, int] = field(init=False)

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self.registers = dict.fromkeys(range(0, 0x28, 4), 0) | RESET_VALUES.get(self.name, {})

    def read(self, offset: int, size: int) -> int:
        word = self.registers[ODR] if offset & ~3 == IDR else self.registers.get(offset & ~3, 0)
        return word >> 8 * (offset & 3)

    def write(self, offset: int, size: int, value: int) -> None:
        if offset == BSRR:
            self.registers[ODR] = (self.registers[ODR] & ~(value >> 16) | value) & 0xFFFF
        elif size == 4 and offset in self.registers and offset not in (IDR, LCKR):
            self.registers[offset] = value
        else:
            self.misuse(f"GPIO{self.name}: writes {size} bytes at {offset:#x}")

    def function(self, pin: int) -> int | None:
        """Return the alternate function of a pin, if it has one."""
        if self.registers[MODER] >> 2 * pin & 3 != ALTERNATE:
            return None
        return self.registers[AFRL if pin < 8 else AFRH] >> 4 * (pin % 8) & 15

    def is_open_drain(self, pin: int) -> bool:
        return bool(self.registers[OTYPER] >> pin & 1)


class Pins:
    def __init__(self, misuse: Callable[[str], None]) -> None:
        self.ports = {name: Port(name, misuse) for name in PORTS}

    def reset(self) -> None:
        for port in self.ports.values():
            port.reset()

    def can_pins(self) -> tuple[list[str], list[str]]:
        """Pins that are CAN1_RX, and CAN1_TX."""
        receive, transmit = (
            [pin for pin in pins if self.ports[pin[0]].function(int(pin[1:])) == CAN1] for pins in (RX_PINS, TX_PINS)
        )
        return receive, transmit

    def can_pin_problem(self) -> str | None:
        receive, transmit = self.can_pins()
        if len(receive) != 1 or len(transmit) != 1:
            return f"of {RX_PINS + TX_PINS} those with AF9 are {receive} for CAN1_RX, {transmit} for CAN1_TX"
        if self.ports[transmit[0][0]].is_open_drain(int(transmit[0][1:])):
            return f"CAN1_TX on {transmit[0]} is open-drain"
        return None
