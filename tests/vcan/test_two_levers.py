"""Two levers on one bus, with identifiers apart: each answers as if it were alone, and takes the other for nothing."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import can
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from vcan import rig

SAMPLES = 700
"""1.4 s: each says who it is a second after the start, too, and whether it is alone after that."""
PERIOD_US = 2000
STATE_ESTIMATE = 0x210
OPTIONS: tuple[list[str], ...] = ([], ["--id-offset", "0x40"], ["--id-base", "0x18FF0000"])
PLACES: tuple[tuple[int, bool], ...] = ((0, False), (0x40, False), (0x18FF0000, True))


def samples(lever: int) -> Iterator[tuple[rig.Frame, rig.Frame]]:
    """Yield the samples of each lever others, 2 ms apart."""
    for k in range(SAMPLES):
        phase = 2.0 * math.pi * (3.0 + 0.5 * lever) * k * PERIOD_US * 1e-6
        theta = {"theta": 0.35 + 0.02 * math.sin(phase), "theta_dot": 0.377 * math.cos(phase), "tau_m": 0.0}
        base = {"z_ddot": 1.5 * math.sin(phase + 0.4), "time_us": PERIOD_US * k}
        yield (
            (0x110, bytes(codec.encode("LEVER_SAMPLE", k, theta))),
            (0x111, bytes(codec.encode("BASE_SAMPLE", k, base))),
        )


def answer(bus: can.BusABC, place: tuple[int, bool]) -> list[rig.Frame]:
    """Return the answer of one lever, up to its STATE_ESTIMATE, with the identifiers of lever.dbc."""
    frames: list[rig.Frame] = []
    while not frames or frames[-1][0] != STATE_ESTIMATE:
        message = bus.recv(rig.PATIENCE_S)
        assert message is not None
        frames.append((message.arbitration_id - place[0], bytes(message.data)))
    return frames


@functools.cache
def alone(lever: int) -> list[rig.Frame]:
    answers: list[rig.Frame] = []
    with LeverBus(settings={**rig.SETTINGS, "sample_period": PERIOD_US * 1e-6}) as bus:
        for frames in samples(lever):
            for identifier, data in frames:
                bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
            answers += answer(bus, (0, False))
    return answers


@pytest.fixture
def together(build_dir: Path, tmp_path: Path, interface: str) -> Iterator[Callable[[Sequence[int]], list[can.BusABC]]]:
    """Yield a function that starts the levers of PLACES with these numbers, and opens a bus to each."""
    with ExitStack() as stack:

        def start(which: Sequence[int]) -> list[can.BusABC]:
            opened = []
            for number in which:
                folder = tmp_path / str(number)
                folder.mkdir()
                options = [*OPTIONS[number], f"--set=sample_period={PERIOD_US * 1e-6}"]
                stack.enter_context(rig.LeverCan(build_dir / "lever_can", interface, options, folder))
                shift, extended = PLACES[number]
                first, last = ((STATE_ESTIMATE & 0x7F0) + shift, 0x1FFFFFF0 if extended else 0x7F0)
                heard = [{"can_id": first, "can_mask": last, "extended": extended}]
                opened.append(stack.enter_context(can.Bus(interface="socketcan", channel=interface, can_filters=heard)))
            return opened

        yield start


@pytest.mark.requirement("R20")
@pytest.mark.parametrize("which", [(0, 1), (0, 2), (1, 2)])
def test_two_levers_on_one_bus_answer_as_each_alone(
    which: Sequence[int], together: Callable[[Sequence[int]], list[can.BusABC]]
) -> None:
    opened = together(which)
    answers: list[list[rig.Frame]] = [[], []]
    for pair in zip(samples(0), samples(1), strict=True):
        for number, frames in enumerate(pair):
            shift, extended = PLACES[which[number]]
            for identifier, data in frames:
                message = can.Message(arbitration_id=identifier + shift, data=data, is_extended_id=extended)
                opened[number].send(message)
        for number, bus in enumerate(opened):
            answers[number] += answer(bus, PLACES[which[number]])
    assert answers[0] == alone(0)
    assert answers[1] == alone(1)
    for identifier, data in (frame for each in answers for frame in each):
        name, fields = codec.decode(identifier, data)
        assert name != "HEALTH" or not fields["fault_duplicate"]
