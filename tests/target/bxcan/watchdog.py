"""The independent watchdog: RM0090 chapter 21; LSI at its typical 32 kHz, or from 17 to 47 kHz (data sheet 5.3.9)."""

from __future__ import annotations

from collections.abc import Callable

from target.bxcan.schedule import Schedule, Timers

KR, PR, RLR, SR = 0, 4, 8, 0xC
UNLOCK, FEED, START = 0x5555, 0xAAAA, 0xCCCC
UPDATE_CYCLES = 5


class Watchdog:
    def __init__(
        self, schedule: Schedule, misuse: Callable[[str], None], expired: Callable[[], None], lsi_hz: int
    ) -> None:
        self.timers, self.schedule = Timers(schedule), schedule
        self.misuse, self.expired = misuse, expired
        self.lsi_hz = lsi_hz
        self.feedings = 0
        self.reset()

    def reset(self) -> None:
        self.timers.cancel()
        self.is_running = self.is_unlocked = False
        self.prescaler, self.reload = 0, 0xFFF
        self.busy_until = {PR: 0, RLR: 0}

    def timeout_ns(self) -> int:
        return (self.reload + 1) * (4 << min(self.prescaler, 6)) * 1_000_000_000 // self.lsi_hz

    def _is_busy(self, register: int) -> bool:
        return self.schedule.now < self.busy_until[register]

    def read(self, offset: int, size: int) -> int:
        return {PR: self.prescaler, RLR: self.reload, SR: self._is_busy(PR) | self._is_busy(RLR) << 1}.get(offset, 0)

    def write(self, offset: int, size: int, value: int) -> None:
        if offset == KR:
            self._key(value & 0xFFFF)
        elif offset not in (PR, RLR):
            self.misuse(f"IWDG: writes the read-only or reserved register {offset:#x}")
        elif not self.is_unlocked:
            self.misuse("IWDG: PR or RLR is written without the key 0x5555")
        elif self._is_busy(offset):
            self.misuse("IWDG: PR or RLR is written while SR says that it is being updated")
        else:
            if offset == PR:
                self.prescaler = value & 7
            else:
                self.reload = value & 0xFFF
            self.busy_until[offset] = self.schedule.now + UPDATE_CYCLES * 1_000_000_000 // self.lsi_hz

    def _key(self, key: int) -> None:
        self.is_unlocked = key == UNLOCK
        if key == START:
            self.is_running = True
        elif key == FEED:
            self.feedings += 1
        elif key != UNLOCK:
            self.misuse(f"IWDG: unknown key {key:#x}")
        if self.is_running and key != UNLOCK:
            self.timers.cancel()
            self.timers.after(self.timeout_ns(), self.expired)
