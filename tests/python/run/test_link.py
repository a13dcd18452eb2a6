"""The estimator at the other end of the bus: how long it is waited for, when it rests, what of its answers counts."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import can
import numpy as np
import pytest
from lever_cdkf.can.commander import Commander
from lever_sil.run import loop
from lever_sil.scenarios import scenario
from lever_sil.scenarios.scenario import Scenario
from python.conftest import PuppetBus, estimate, health

Answers = list[tuple[str, dict[str, Any]]]


class Patient(PuppetBus):
    """Notes how long each answer is waited for, by the number of samples that were sent."""

    def __init__(self, answers: Callable[[int], Answers], results: Iterable[str | None] = ()) -> None:
        super().__init__(answers, results)
        self.waited: list[tuple[int, float | None]] = []

    def recv(self, timeout: float | None = None) -> can.Message | None:
        self.waited.append((self._samples, timeout))
        return super().recv(timeout)


def test_the_first_answer_is_waited_for_two_seconds_and_each_other_for_five(short: Scenario) -> None:
    bus = Patient(lambda _sample: [estimate()])
    loop.run(short, bus)
    assert {timeout for samples, timeout in bus.waited if samples <= 1} == {2.0}
    later = {timeout for samples, timeout in bus.waited if samples > 1}
    assert later == {5.0}, "of samples, and of the COMMANDs that keep the dither alive"


def test_twenty_samples_in_a_row_without_an_answer_are_too_many(short: Scenario) -> None:
    def silent(count: int) -> PuppetBus:
        return PuppetBus(lambda sample: [] if 100 <= sample < 100 + count else [estimate()])

    assert loop.run(short, silent(19)).unanswered == 19
    with pytest.raises(loop.NoAnswerError, match="at sample 119: is the firmware running there"):
        loop.run(short, silent(20))
    scattered = PuppetBus(lambda sample: [] if sample % 2 else [estimate()])
    assert loop.run(short, scattered).unanswered == 250


def count(bus: PuppetBus) -> int:
    return sum(identifier == 0x111 for identifier, _ in bus.sent)


def healthy(_sample: int) -> Answers:
    return [health(), estimate()]


def test_one_that_comes_from_another_run_rests_until_it_says_how_it_is(short: Scenario) -> None:
    """For five seconds of samples after a reset, or ten where no HEALTH comes; off the record."""
    for answers, samples in ((healthy, 5001), (lambda _sample: [estimate()], 10_000)):
        bus = PuppetBus(answers, ["sequence"])
        recording = loop.run(short, bus)
        assert count(bus) == samples + 500
        assert len(recording.frames().of(0x111)) == 500
        resting, bases = bus.decoded("LEVER_SAMPLE")[:samples], bus.decoded("BASE_SAMPLE")
        assert len({sample["theta"] for sample in resting}) == 1
        assert {sample["theta_dot"] for sample in resting} == {sample["tau_m"] for sample in resting} == {0.0}
        assert {sample["z_ddot"] for sample in bases[:samples]} == {0.0}
        times = [sample["time_us"] for sample in bases]
        assert times[: samples + 3] == [1000.0 * sample for sample in (*range(samples), 0, 1, 2)]
        commands = bus.decoded("COMMAND")
        assert (commands[1]["request"], commands[1]["dither_rms"]) == (3.0, 0.0)


@pytest.mark.parametrize(("torque", "time_low", "rests"), [(0.1, 0, True), (0.0, 0, False), (0.1, 5, False)])
def test_torque_in_the_answer_to_the_first_sample_is_of_another_run(
    torque: float, time_low: int, rests: bool, short: Scenario
) -> None:
    """Unless it is that of another sample, or whoever sends the COMMANDs knows what ran before."""

    def answers(sample: int) -> Answers:
        return (
            [("MOTOR_COMMAND", {"torque": torque, "dither": torque, "time_low": time_low})] if sample == 0 else []
        ) + healthy(sample)

    bus = PuppetBus(answers)
    loop.run(short, bus)
    assert count(bus) == (1 + 5001 + 500 if rests else 500)
    known = PuppetBus(answers)
    loop.run(short, known, commander=Commander())
    assert count(known) == 500


def test_a_run_among_other_commands_goes_on_in_their_sequence(short: Scenario) -> None:
    bus, commander = PuppetBus(healthy, ["sequence"] * 3), Commander()
    loop.run(short, bus, commander=commander)
    assert count(bus) == 500
    counters = [command["counter"] for command in bus.decoded("COMMAND")]
    assert counters == list(range(len(counters)))
    with pytest.raises(loop.RefusedError):
        loop.run(short, PuppetBus(healthy, ["sequence"] * 16), commander=Commander())


def test_a_later_command_is_not_repeated_and_may_go_unanswered(short: Scenario) -> None:
    """The first is repeated until it is in sequence; a later one that is not is refused."""
    with pytest.raises(loop.RefusedError, match="out of sequence"):
        loop.run(short, PuppetBus(healthy, ["accepted", "sequence"]))
    recording = loop.run(short, PuppetBus(healthy, ["accepted", None]))
    assert recording.unanswered == 0


def test_a_correction_moves_the_blades_for_a_tenth_of_a_second_without_samples() -> None:
    """Of a sample's own correction; of another it is none."""

    def cabin(angle: float, first_lost: str, mine: bool = True) -> np.ndarray[Any, Any]:
        flown = scenario.load(
            "bounce",
            [
                *("duration=0.8 s", "converged_after=0.1 s", "limits={}"),
                f'sensors.dropout=[{{what="base_frame", share="100 %", start="{first_lost}", end="0.7 s"}}]',
            ],
        )

        def answers(_sample: int) -> Answers:
            more = {} if mine else {"time_low": 1}
            return [("CORRECTION", {"mitigation": "notch", "correction": angle, "weight": 1.0, **more}), estimate()]

        return loop.run(flown, PuppetBus(answers)).inputs.z_ddot

    whole, stopped = (cabin(0.02, start) for start in ("0.69 s", "0.3 s"))
    nothing = cabin(0.0, "0.3 s")
    differs = np.flatnonzero(np.abs(whole - stopped) > 1e-9)
    first = np.flatnonzero(np.abs(whole - nothing) > 1e-9)[0]  # moved by the correction after sample 0
    assert differs[0] - first == 400, "answered last at 299, and held up to 399"
    np.testing.assert_array_equal(cabin(0.02, "0.3 s", mine=False), nothing)
