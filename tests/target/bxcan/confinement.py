"""Error counters and error states of a node: fault confinement of ISO 11898-1:2015, 10.11; CAN_ESR of RM0090 32.9.2."""

from __future__ import annotations

from target.bxcan.bus import Error

WARNING, PASSIVE, BUS_OFF = 96, 128, 256


class Confinement:
    def __init__(self) -> None:
        self.transmit = 0
        self.receive = 0

    @property
    def is_warning(self) -> bool:
        return max(self.transmit, self.receive) >= WARNING

    @property
    def is_passive(self) -> bool:
        return max(self.transmit, self.receive) >= PASSIVE

    @property
    def is_off(self) -> bool:
        return self.transmit >= BUS_OFF

    def sent(self) -> None:
        self.transmit = max(0, self.transmit - 1)

    def received(self) -> None:
        self.receive = max(0, self.receive - 1) if self.receive < PASSIVE else 120

    def send_failed(self, error: Error) -> None:
        """Handle a missing acknowledgement, which does not drive a passive node, alone on its bus, into bus-off."""
        if not (error is Error.ACKNOWLEDGE and self.is_passive):
            self.transmit = min(BUS_OFF, self.transmit + 8)

    def receive_failed(self) -> None:
        self.receive = min(255, self.receive + 1)

    def clear(self) -> None:
        self.transmit = self.receive = 0

    def register(self) -> int:
        """REC, TEC, BOFF, EPVF, EWGF of CAN_ESR."""
        flags = self.is_off << 2 | self.is_passive << 1 | self.is_warning
        return self.receive << 24 | min(255, self.transmit) << 16 | flags
