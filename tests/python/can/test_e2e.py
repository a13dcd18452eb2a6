"""E2E Profile 2 of the C against the package autosar-e2e, and its receiver against a reference of the standard.

autosar-e2e covers the CRC and the counter of a sender; what a receiver concludes from the counters it leaves to the
user. So `Reference` is that part of AUTOSAR FO PRS E2EProtocol, and takes the CRC's verdict from the package.
"""

from __future__ import annotations

import random
from dataclasses import dataclass

import e2e
import pytest
from python.can.codec import DBC, TO_NAME, Codec, data_id_base

BASE = 17
DATA_IDS = bytes(range(BASE, BASE + 16))
BASES = [data_id_base(message) for message in DBC.messages]


@pytest.mark.requirement("R17")
def test_protect(codec: Codec) -> None:
    dice = random.Random(1)
    for base in BASES:
        data_ids = bytes(range(base, base + 16))
        for counter in range(16):
            for _ in range(50):
                data = dice.randbytes(8)
                expected = bytearray(data)
                expected[1] = (expected[1] & 0xF0) | counter
                e2e.p02.e2e_p02_protect(expected, data_ids, increment_counter=False)
                assert codec.protect(data, base, counter) == expected


def test_a_frame_is_only_right_for_its_own_message(codec: Codec) -> None:
    for counter in range(16):
        for sender in BASES:
            data = codec.protect(bytes(8), sender, counter)
            accepting = [base for base in BASES if codec.check(codec.receiver(base, 1, 15, 0), data)[0] == "INITIAL"]
            assert accepting == [sender]


@pytest.mark.parametrize("length", range(8))
def test_another_length_is_an_error(codec: Codec, length: int) -> None:
    data = codec.protect(bytes(8), BASE, 0)[:length]
    assert codec.check(codec.receiver(BASE, 1, 15, 0), data)[0] == "CRC_ERROR"


def test_what_may_be_used(codec: Codec) -> None:
    usable = {name for status, name in TO_NAME.items() if codec.lib.e2e_is_usable(status)}
    assert usable == {"OK", "SOME_LOST", "INITIAL"}


@dataclass
class Reference:
    """Check of Profile 2, in the words of the standard."""

    MaxDeltaCounterInit: int
    MaxNoNewOrRepeatedData: int
    SyncCounterInit: int
    MaxDeltaCounter: int = 0
    LastValidCounter: int | None = None
    NoNewOrRepeatedDataCounter: int = 0
    SyncCounter: int = 0

    def check(self, data: bytes | None) -> tuple[str, int]:
        """Status, and LostData as far as the status gives it a meaning."""
        self.MaxDeltaCounter = min(self.MaxDeltaCounter + 1, 15)
        if data is None:
            self.NoNewOrRepeatedDataCounter = min(self.NoNewOrRepeatedDataCounter + 1, 15)
            return "NO_NEW_DATA", 0
        if not e2e.p02.e2e_p02_check(data, DATA_IDS):
            return "CRC_ERROR", 0
        received, last = data[1] % 16, self.LastValidCounter
        if last is None:
            self.LastValidCounter, self.MaxDeltaCounter = received, self.MaxDeltaCounterInit
            return "INITIAL", 0
        delta = (received - last) % 16
        if delta == 0:
            self.NoNewOrRepeatedDataCounter = min(self.NoNewOrRepeatedDataCounter + 1, 15)
            return "REPEATED", 0
        if delta > self.MaxDeltaCounter:
            self.NoNewOrRepeatedDataCounter, self.SyncCounter = 0, self.SyncCounterInit
            if self.SyncCounterInit > 0:
                self.LastValidCounter, self.MaxDeltaCounter = received, self.MaxDeltaCounterInit
            return "WRONG_SEQUENCE", 0
        self.LastValidCounter, self.MaxDeltaCounter = received, self.MaxDeltaCounterInit
        late = self.NoNewOrRepeatedDataCounter > self.MaxNoNewOrRepeatedData
        self.NoNewOrRepeatedDataCounter = 0
        if late:
            self.SyncCounter = self.SyncCounterInit
            return "SYNC", delta - 1
        if self.SyncCounter > 0:
            self.SyncCounter -= 1
            return "SYNC", delta - 1
        return ("OK" if delta == 1 else "SOME_LOST"), delta - 1


class Channel:
    """A sender by autosar-e2e, and a bus that loses, repeats, delays, corrupts and is silent."""

    def __init__(self, dice: random.Random) -> None:
        self.dice = dice
        self.sent = bytearray(8)
        self.trouble = dice.choice([0.02, 0.2, 0.6])

    def send(self) -> bytes:
        self.sent[2:] = self.dice.randbytes(6)
        e2e.p02.e2e_p02_protect(self.sent, DATA_IDS)
        return bytes(self.sent)

    def receive(self) -> bytes | None:
        """Return what arrives in the next cycle."""
        if self.dice.random() >= self.trouble:
            return self.send()
        match self.dice.choice(["lose", "repeat", "old", "corrupt", "silent"]):
            case "lose":
                for _ in range(self.dice.randint(1, 16)):
                    self.send()
                return self.send()
            case "repeat":
                return bytes(self.sent)
            case "old":
                old = bytearray(self.sent)
                old[1] = (old[1] - self.dice.randint(1, 15)) % 16
                e2e.p02.e2e_p02_protect(old, DATA_IDS, increment_counter=False)
                return bytes(old)
            case "corrupt":
                corrupt = bytearray(self.send())
                corrupt[self.dice.randrange(8)] ^= self.dice.randint(1, 255)
                return bytes(corrupt)
        return None


@pytest.mark.requirement("R17")
def test_receiver_over_random_sequences(codec: Codec) -> None:
    dice = random.Random(3)
    seen: set[str] = set()
    for _ in range(400):
        tolerance = dice.randint(0, 15), dice.choice([0, 1, 2, 15]), dice.choice([0, 1, 2, 15])
        receiver, reference, channel = codec.receiver(BASE, *tolerance), Reference(*tolerance), Channel(dice)
        for step in range(200):
            data = channel.receive()
            got, expected = codec.check(receiver, data), reference.check(data)
            assert got == expected, (tolerance, step)
            seen.add(got[0])
    assert seen == {"OK", "NO_NEW_DATA", "CRC_ERROR", "SYNC", "INITIAL", "REPEATED", "SOME_LOST", "WRONG_SEQUENCE"}


def test_the_tolerance_stops_at_fifteen(codec: Codec) -> None:
    receiver = codec.receiver(BASE, 1, 15, 0)
    codec.check(receiver, codec.protect(bytes(8), BASE, 0))
    for _ in range(300):
        codec.check(receiver, None)
        assert receiver.max_delta <= 15
        assert receiver.no_new_or_repeated <= 15
