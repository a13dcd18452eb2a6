"""A conversation with the image in lock-step, beside the same one with the firmware in this process."""

from __future__ import annotations

import math

import can
from lever_cdkf.can import codec
from target.bxcan.board import Board
from target.bxcan.frame import Frame

LEVER_SAMPLE, BASE_SAMPLE, GRIP_SAMPLE, COMMAND, STATE_ESTIMATE, HEALTH = (
    codec.message(name).frame_id
    for name in ("LEVER_SAMPLE", "BASE_SAMPLE", "GRIP_SAMPLE", "COMMAND", "STATE_ESTIMATE", "HEALTH")
)
OF_MACHINE = [codec.message(name).frame_id for name in ("PLATFORM_HEALTH", "PLATFORM_RESET")]
IDENTITY = 0x217
INPUTS = {LEVER_SAMPLE, BASE_SAMPLE, GRIP_SAMPLE, COMMAND, IDENTITY}
_encode_lever, _encode_base = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE")


def sample(k: int) -> tuple[Frame, Frame]:
    """Return the two frames of sample k of a lever that swings, at 1 kHz."""
    phase = 2.0 * math.pi * 3.0 * k * 1e-3
    theta, theta_dot = 0.35 + 0.02 * math.sin(phase), 0.02 * 6.0 * math.pi * math.cos(phase)
    lever = _encode_lever(k, theta, theta_dot, 0.3 * math.cos(2.3 * phase))
    return Frame(LEVER_SAMPLE, lever), Frame(BASE_SAMPLE, _encode_base(k, 0.8 * math.sin(phase + 1.0), 1000 * k))


def is_estimate(frame: Frame) -> bool:
    return frame.identifier == STATE_ESTIMATE


def answers(frames: list[Frame]) -> list[Frame]:
    """Without what the firmware in this process does not send."""
    return [frame for frame in frames if frame.identifier not in OF_MACHINE]


class Talk:
    def __init__(self, board: Board) -> None:
        self.board = board
        self.next = 0
        """The sample that comes next."""
        self.reference = can.Bus(interface="lever", channel="reference")

    def __enter__(self) -> Talk:
        return self

    def __exit__(self, *_: object) -> None:
        self.reference.shutdown()

    def send(self) -> None:
        """Send the next sample to both."""
        self.tell(*sample(self.next))
        self.next += 1

    def tell(self, *frames: Frame) -> None:
        """Any frames, to both."""
        self.board.peer.send(*frames)
        self.tell_reference(*frames)

    def tell_reference(self, *frames: Frame) -> None:
        for frame in frames:
            self.reference.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False))

    def expected(self) -> list[Frame]:
        """Return what the firmware in this process has answered since the last call."""
        messages = list(iter(lambda: self.reference.recv(0), None))
        return [Frame(message.arbitration_id, bytes(message.data)) for message in messages if message is not None]

    def ask(self) -> list[Frame]:
        """Send a sample and return what the image answers, up to its STATE_ESTIMATE."""
        heard = self.board.peer.heard
        before = len(heard)
        self.send()
        answered = self.board.machine.run(20_000_000, lambda: any(is_estimate(frame) for _, frame in heard[before:]))
        assert answered, f"sample {self.next - 1} has no answer"
        return [frame for _, frame in heard[before:]]

    def report(self, name: str) -> dict[str, float]:
        """Goes on until the image sends this message, and return its values."""
        identifier = codec.message(name).frame_id
        for _ in range(1000):
            for frame in self.ask():
                if frame.identifier == identifier:
                    return codec.decode(identifier, frame.data)[1]
        raise AssertionError(f"no {name} in 1000 samples")
