"""A CAN bus, frame by frame: arbitration, acknowledgement, destroyed frames, short circuit; at 1 Mbit/s.

Whoever is on the bus is a Node. Times are those of the bits on the wire; of frames in conflict only one is seen.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Protocol

from target.bxcan.frame import Frame
from target.bxcan.schedule import Action, Schedule

BIT_NS = 1000
INTERMISSION = 3
ERROR_FRAME = 6 + 8
"""Bits of an error flag and its delimiter (ISO 11898-1:2015, 10.4.4)."""
ERROR_AT = 20
"""Bit of the frame at which a disturbance hits it."""
SUSPEND = 8
"""Bits that an error-passive node waits before it sends again (suspend transmission, 10.8)."""


class Error(IntEnum):
    """What goes wrong with a frame; the values are those of LEC in CAN_ESR (RM0090 32.9.2)."""

    NONE = 0
    STUFF = 1
    FORM = 2
    ACKNOWLEDGE = 3
    BIT_RECESSIVE = 4
    BIT_DOMINANT = 5
    CRC = 6


class Node(Protocol):
    def offer(self) -> Frame | None:
        """Return the frame that this node would send now."""

    def acknowledges(self) -> bool: ...
    def is_passive(self) -> bool: ...
    def starts(self) -> None:
        """Its offer has won the bus."""

    def lost_arbitration(self) -> None: ...
    def sent(self, frame: Frame) -> None: ...
    def send_failed(self, error: Error) -> None: ...
    def received(self, frame: Frame) -> None: ...
    def receive_failed(self, error: Error) -> None: ...


class Bus:
    def __init__(self, schedule: Schedule) -> None:
        self.schedule = schedule
        self.nodes: list[Node] = []
        self.disturb = 0
        """So many of the next frames are destroyed, by noise that makes a recessive bit dominant."""
        self.is_shorted = False
        """CAN_H and CAN_L touch: what is sent as dominant stays recessive."""
        self.is_held = False
        """Some node keeps the bus dominant, so that nobody can begin; for before a board starts."""
        self.sender: Node | None = None
        self.frames = 0
        """Frames that arrived."""
        self.dominant_until = 0
        """Time [ns] of the last dominant bit that is known of."""
        self._is_busy = False

    @property
    def is_busy(self) -> bool:
        return self._is_busy

    def request(self) -> None:
        """Note that a node has something to send."""
        if not self._is_busy and not self.is_held and any(node.offer() for node in self.nodes):
            self._is_busy = True
            self.schedule.at(self.schedule.now + BIT_NS, self._arbitrate)

    def when_recessive(self, runs: int, action: Action) -> None:
        """Acts when so many sequences of 11 recessive bits have gone by (they need not follow each other)."""
        start = max(self.schedule.now, self.dominant_until)

        def look() -> None:
            if self.is_held or self.dominant_until > start:
                self.when_recessive(runs, action)
            elif runs > 1:
                self.when_recessive(runs - 1, action)
            else:
                action()

        self.schedule.at(start + 11 * BIT_NS, look)

    def _arbitrate(self) -> None:
        offers = [(frame.arbitration, k, frame) for k, node in enumerate(self.nodes) if (frame := node.offer())]
        if not offers:
            self._is_busy = False
            return
        _, winner, frame = min(offers)
        self.sender = self.nodes[winner]
        self.sender.starts()
        for _, k, _ in offers:
            if k != winner:
                self.nodes[k].lost_arbitration()
        bits = len(frame.wire)
        if self.is_shorted:
            self.schedule.at(
                self.schedule.now + ERROR_FRAME * BIT_NS, lambda: self._fail(Error.BIT_DOMINANT, Error.NONE)
            )
        elif self.disturb > 0:
            self.disturb -= 1
            self._end_after(ERROR_AT, lambda: self._fail(Error.BIT_RECESSIVE, Error.STUFF))
        elif not any(node.acknowledges() for node in self.nodes if node is not self.sender):
            self._end_after(bits - 8, lambda: self._fail(Error.ACKNOWLEDGE, Error.NONE))
        else:
            self.dominant_until = self.schedule.now + (bits - 8) * BIT_NS
            self.schedule.at(self.schedule.now + bits * BIT_NS, lambda: self._end(frame))

    def _end_after(self, bits: int, fail: Action) -> None:
        """Let an error flag follow those bits, and then its delimiter."""
        end = self.schedule.now + (bits + ERROR_FRAME) * BIT_NS
        self.dominant_until = max(self.dominant_until, end - 8 * BIT_NS)
        self.schedule.at(end, fail)

    def _end(self, frame: Frame) -> None:
        if self.is_shorted:  # since the frame has begun
            self._fail(Error.BIT_DOMINANT, Error.CRC)
            return
        sender = self._take_sender()
        self.frames += 1
        self._intermission(INTERMISSION)
        for node in self.nodes:
            if node is not sender:
                node.received(frame)
        sender.sent(frame)

    def _fail(self, of_sender: Error, of_receivers: Error) -> None:
        sender = self._take_sender()
        self._intermission(INTERMISSION + (SUSPEND if sender.is_passive() else 0))
        for node in self.nodes:
            if node is not sender and of_receivers is not Error.NONE:
                node.receive_failed(of_receivers)
        sender.send_failed(of_sender)

    def _take_sender(self) -> Node:
        assert self.sender is not None
        sender, self.sender = self.sender, None
        return sender

    def _intermission(self, bits: int) -> None:
        def end() -> None:
            self._is_busy = False
            self.request()

        self.schedule.at(self.schedule.now + bits * BIT_NS, end)


class Peer:
    """Another node, on a bus that it joins: sends what is queued, keeps what it receives with the time [ns]."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.queue: list[Frame] = []
        self.heard: list[tuple[int, Frame]] = []
        self.failed = 0
        self.is_connected = True
        bus.nodes.append(self)

    def send(self, *frames: Frame) -> None:
        self.queue += frames
        self.bus.request()

    def frames(self) -> list[Frame]:
        return [frame for _, frame in self.heard]

    def offer(self) -> Frame | None:
        return self.queue[0] if self.queue and self.is_connected else None

    def acknowledges(self) -> bool:
        return self.is_connected

    def is_passive(self) -> bool:
        return False

    def starts(self) -> None:
        pass

    def lost_arbitration(self) -> None:
        pass

    def sent(self, frame: Frame) -> None:
        self.queue.pop(0)

    def send_failed(self, error: Error) -> None:
        self.failed += 1

    def received(self, frame: Frame) -> None:
        if self.is_connected:
            self.heard.append((self.bus.schedule.now, frame))

    def receive_failed(self, error: Error) -> None:
        pass
