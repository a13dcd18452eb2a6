"""What the tests of host_tools share: buses, and samples of a lever that moves."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from importlib import metadata

import can
import pytest
from lever_cdkf.host_tools import codec
from lever_cdkf.host_tools.bus import LeverBus

Frame = tuple[int, bytes]
Samples = Callable[[int, int], list[tuple[Frame, Frame]]]


@pytest.fixture
def samples() -> Samples:
    """samples(first, count): the LEVER_SAMPLE and BASE_SAMPLE of a swinging lever, at 1 kHz from sample `first`."""
    lever, base = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE")

    def make(first: int, count: int) -> list[tuple[Frame, Frame]]:
        frames = []
        for k in range(first, first + count):
            phase = 2.0 * math.pi * 3.0 * k * 1e-3
            theta, theta_dot = 0.35 + 0.02 * math.sin(phase), 0.02 * 6.0 * math.pi * math.cos(phase)
            motion = lever(k, theta, theta_dot, 0.3 * math.cos(2.3 * phase))
            frames.append(((0x110, motion), (0x111, base(k, 0.8 * math.sin(phase + 1.0), 1000 * k))))
        return frames

    return make


@pytest.fixture
def make_bus() -> Iterator[Callable[..., LeverBus]]:
    """LeverBus, shut down after the test."""
    made: list[LeverBus] = []

    def make(*args: object, **kwargs: object) -> LeverBus:
        made.append(LeverBus(*args, **kwargs))  # type: ignore[arg-type]
        return made[-1]

    yield make
    for bus in made:
        bus.shutdown()


def _message(frame: Frame) -> can.Message:
    return can.Message(arbitration_id=frame[0], is_extended_id=False, data=frame[1])


@pytest.fixture
def message() -> Callable[[Frame], can.Message]:
    """A frame as a can.Message."""
    return _message


@pytest.fixture
def exchange() -> Callable[[can.BusABC, tuple[Frame, Frame]], list[can.Message]]:
    """exchange(bus, sample): sends both frames and receives all that comes back."""

    def both(bus: can.BusABC, sample: tuple[Frame, Frame]) -> list[can.Message]:
        for frame in sample:
            bus.send(_message(frame))
        return list(iter(bus.recv, None))

    return both


@pytest.fixture(scope="session")
def installed() -> str:
    """The version of the installed package; without it the test is skipped."""
    try:
        return metadata.version("lever-cdkf")
    except metadata.PackageNotFoundError:
        pytest.skip("the package is not installed: pip install .")
