"""LeverBus as a python-can interface: what comes back, when, with which time, and what is refused."""

from __future__ import annotations

import gc
import logging
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import can
import pytest
from lever_cdkf.can.bus import LeverBus, LeverBusError
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.native import Config, Estimator
from processes import PATIENCE

Frame = tuple[int, bytes]
MakeBus = Callable[..., LeverBus]
Samples = Callable[[int, int], list[tuple[Frame, Frame]]]
Exchange = Callable[[can.BusABC, tuple[Frame, Frame]], list[can.Message]]
ToMessage = Callable[[Frame], can.Message]


def seen(messages: list[can.Message]) -> list[tuple[float, int, bytes]]:
    """Return what a log would show of messages."""
    return [(message.timestamp, message.arbitration_id, bytes(message.data)) for message in messages]


# --- answers ---------------------------------------------------------------------------------------------------------


def test_each_sample_is_answered_as_by_the_firmware(make_bus: MakeBus, samples: Samples, exchange: Exchange) -> None:
    bus, estimator = make_bus("x"), Estimator()
    identifiers = set()
    for lever, base in samples(0, 300):
        answers = exchange(bus, (lever, base))
        estimator.on_frame(*lever)
        estimator.on_frame(*base)
        estimator.step()
        assert [(a.arbitration_id, bytes(a.data)) for a in answers] == list(iter(estimator.next_frame, None))
        assert [a.arbitration_id for a in answers].count(0x210) == 1
        assert answers[-1].arbitration_id == 0x210
        identifiers |= {a.arbitration_id for a in answers}
    assert {0x210, 0x211, 0x212, 0x213, 0x214} <= identifiers
    assert bus.estimator.health() == estimator.health()


# --- receiving -------------------------------------------------------------------------------------------------------


def test_who_has_sent_never_waits(make_bus: MakeBus, samples: Samples, exchange: Exchange) -> None:
    bus = make_bus("x")
    start = time.monotonic()
    assert bus.recv(0.05) is None  # nobody has sent, so somebody may
    assert 0.05 <= time.monotonic() - start < PATIENCE / 2
    exchange(bus, samples(0, 1)[0])
    start = time.monotonic()
    assert bus.recv(PATIENCE) is None
    assert bus.recv() is None
    assert time.monotonic() - start < PATIENCE / 2


def test_a_loop_over_the_bus_gets_every_answer_and_ends(
    make_bus: MakeBus, samples: Samples, message: ToMessage
) -> None:
    """That of can.BusABC would ask for ever for what recv() says will not come."""
    bus, twin = make_bus("x"), make_bus("x")
    for pair in samples(0, 20):
        for frame in pair:
            bus.send(message(frame))
            twin.send(message(frame))
    assert seen(list(bus)) == seen(list(iter(lambda: twin.recv(0.0), None)))
    assert list(bus) == []


def test_own_messages(make_bus: MakeBus, samples: Samples, exchange: Exchange) -> None:
    bus = make_bus("x", receive_own_messages=True)
    (lever, base), *_ = samples(1, 1)
    received = exchange(bus, (lever, base))
    assert [(m.arbitration_id, bytes(m.data), m.is_rx) for m in received[:2]] == [(*lever, False), (*base, False)]
    assert len(received) > 2
    assert all(m.is_rx for m in received[2:])
    assert [m.timestamp for m in received] == [0.0] + [pytest.approx(1e-3)] * (len(received) - 1)
    assert all(m.channel == "x" for m in received)


def test_queue_is_bounded(
    make_bus: MakeBus, samples: Samples, message: ToMessage, caplog: pytest.LogCaptureFixture
) -> None:
    bus, unbounded = make_bus("x", rx_queue_size=5), make_bus("x")
    with caplog.at_level(logging.WARNING):
        for sample in samples(0, 30):
            for frame in sample:
                bus.send(message(frame))
                unbounded.send(message(frame))
    assert seen(list(iter(bus.recv, None))) == seen(list(iter(unbounded.recv, None)))[-5:]
    assert [record.getMessage() for record in caplog.records] == [
        "lever firmware in this process, channel 'x': nobody receives; of 5 frames the oldest are dropped"
    ]


# --- other frames ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["is_extended_id", "is_remote_frame", "is_error_frame"])
@pytest.mark.requirement("R20")
def test_frames_of_other_kinds_pass_by(make_bus: MakeBus, samples: Samples, message: ToMessage, kind: str) -> None:
    bus = make_bus("x", receive_own_messages=True)
    lever, base = (message(frame) for frame in samples(0, 1)[0])
    setattr(base, kind, True)
    bus.send(lever)
    bus.send(base)
    received = list(iter(bus.recv, None))
    assert len(received) == 2  # both of them own
    assert getattr(received[1], kind) is True
    health = bus.estimator.health()
    assert (health.mode, health.samples, health.corrupt) == ("init", 0, 0)


@pytest.mark.parametrize("frame", [can.Message(is_fd=True, data=bytes(8)), can.Message(data=bytes(12), is_fd=False)])
def test_fd_frames_are_refused(make_bus: MakeBus, frame: can.Message) -> None:
    with pytest.raises(can.CanOperationError, match="interface 'lever' is classic CAN: it has no FD frames"):
        make_bus("x").send(frame)


# --- life ------------------------------------------------------------------------------------------------------------


def test_shutdown(samples: Samples, message: ToMessage, caplog: pytest.LogCaptureFixture) -> None:
    with LeverBus("x") as bus:
        for frame in samples(0, 1)[0]:
            bus.send(message(frame))
    bus.shutdown()
    with pytest.raises(can.CanOperationError, match="channel 'x' is shut down"):
        bus.recv(0.0)
    with pytest.raises(can.CanOperationError, match="channel 'x' is shut down"):
        bus.send(message(samples(0, 1)[0][0]))
    del bus
    gc.collect()
    assert caplog.records == []


def test_shutdown_ends_a_waiting_receiver(make_bus: MakeBus) -> None:
    bus = make_bus("x")
    caught: list[Exception] = []

    def receive() -> None:
        try:
            bus.recv()
        except can.CanOperationError as error:
            caught.append(error)

    receiver = threading.Thread(target=receive)
    receiver.start()
    bus.shutdown()
    receiver.join(PATIENCE)
    assert len(caught) == 1


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"settings": {"m_p": 100.0}}, "m_p = 100.0 is out of range: it must be a number from 0.3 to 10 kg"),
        ({"settings": {"m_q": 1.0}}, "unknown setting 'm_q'; did you mean m_p"),
        ({"settings": {"preload": "no"}}, "preload = 'no' is not known; allowed: fixed, trim"),
        ({"settings": "/none/my.settings"}, "/none/my.settings: cannot be read"),
        ({"settings": {}, "config": Config()}, "takes config or settings, not both"),
        ({"speed": 3}, "interface 'lever' has no option speed; it has config, settings, aircraft, snapshots, rec"),
        ({"fd": True}, "interface 'lever' is classic CAN: it has no fd"),
        ({"rx_queue_size": 0}, "rx_queue_size is 0; it must be a number of frames, at least 1"),
        ({"rx_queue_size": "many"}, "rx_queue_size is 'many'; it must be a number of frames"),
    ],
)
def test_bad_arguments(arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(LeverBusError) as caught:
        LeverBus("x", **arguments)
    assert text in str(caught.value)
    assert isinstance(caught.value, LeverError)
    assert isinstance(caught.value, can.CanInitializationError)


def test_senders_do_not_mix_their_frames(make_bus: MakeBus, samples: Samples, message: ToMessage) -> None:
    bus, ended = make_bus("x"), threading.Event()
    noise = message((0x7FF, b"noise..."))

    def send_noise() -> None:
        while not ended.is_set():
            bus.send(noise)

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    other = threading.Thread(target=send_noise)
    other.start()
    for sample in samples(0, 2000):
        for frame in sample:
            bus.send(message(frame))
    ended.set()
    other.join()
    sys.setswitchinterval(interval)
    health = bus.estimator.health()
    assert (health.samples, health.corrupt, health.lost) == (2000, 0, 0)
