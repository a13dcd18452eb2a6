"""The picture: what it shows is what the estimator knows, and what it counts is what was lost."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable

import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.commander import KEEP, result_of
from lever_cdkf.firmware.config import Config, model_parameters
from lever_cdkf.firmware.estimator import TEST_RATIOS
from lever_cdkf.firmware.library import enum_names, enum_words, ffi, lib
from lever_cdkf.watch import status
from lever_cdkf.watch.paired import Paired
from lever_cdkf.watch.picture import ERROR, FOREIGN, ROWS, STALE_AFTER, STEP, Frame, Picture
from python.watch.conftest import Flight


def watch(picture: Picture, flight: Flight, seconds: float) -> None:
    """Take what passes in `seconds` of flight, a tenth of a second at a time."""
    for _ in range(round(10 * seconds)):
        frames = flight.frames(100)
        picture.take(frames, flight.sample * 1e-3)


# --- values ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", enum_names("lever_model").values())
def test_shows_what_the_estimator_knows(name: str, make_flight: Callable[..., Flight]) -> None:
    picture, flight = Picture(), make_flight(Config(model=name, settings={"publish_period": 1e-3}))
    watch(picture, flight, 1.0)
    estimate, health = flight.bus.estimator.estimate(), flight.bus.estimator.health()
    assert picture.model == name
    assert [(entry.key, entry.unit) for entry in picture.parameters()] == list(model_parameters(name))
    for index, entry in enumerate(picture.parameters()):
        signal = codec.message("PILOT_PARAMETERS").get_signal_by_name(entry.key)
        assert entry.value == pytest.approx(estimate.parameter[index], abs=0.51 * float(signal.scale))
        assert entry.sigma == pytest.approx(estimate.parameter_sigma[index], rel=0.01, abs=0.02)
    frequency, damping = picture.dynamics()
    assert frequency.value == pytest.approx(estimate.natural_frequency, abs=0.0006)
    assert damping.value == pytest.approx(estimate.damping_ratio, abs=0.0002)
    assert frequency.sigma == pytest.approx(estimate.natural_frequency_sigma, abs=0.0011)
    assert damping.sigma == pytest.approx(estimate.damping_ratio_sigma, abs=0.0006)
    assert picture.mode == health.mode
    assert picture.field("HEALTH", "excitation") == pytest.approx(health.excitation, abs=0.003)
    assert picture.theta() == pytest.approx(0.35, abs=0.002)


def test_feedthrough_of_every_frequency_is_kept(make_flight: Callable[..., Flight]) -> None:
    picture, flight = Picture(), make_flight(Config(settings={"publish_period": 1e-3}))
    watch(picture, flight, 1.0)
    for frequency, entry in zip(range(2, 9), picture.feedthrough(), strict=True):
        expected = flight.bus.estimator.feedthrough(frequency)
        assert entry.frequency == frequency
        assert entry.response == pytest.approx(expected.response, abs=6e-6 + 0.01 * abs(expected.response))
        assert entry.gain_sigma == pytest.approx(expected.gain_sigma, rel=0.01, abs=0.0012)
        phase_sigma = expected.phase_sigma if expected.phase_sigma < 0.508 else math.nan  # not available
        assert entry.phase_sigma == pytest.approx(phase_sigma, rel=0.01, abs=0.0012, nan_ok=True)
    picture.take([], 10.0)
    assert all(math.isnan(entry.gain_sigma) for entry in picture.feedthrough())


def test_the_nearest_evidence_is_shown_where_it_is_sent(make_flight: Callable[..., Flight]) -> None:
    picture = Picture()
    flight = make_flight(Config(settings={"publish_period": 1e-3, "publish_test_ratios": 1.0}))
    assert status.nearest_evidence(picture) is None
    watch(picture, flight, 3.0)
    said = flight.bus.estimator.test_ratios()
    for index, ratio in picture.test_ratios().items():
        assert ratio == pytest.approx(max(list(said.values())[index], 0.0), abs=0.1)
    shown = picture.test_ratios()
    assert sorted(shown) == list(range(len(TEST_RATIOS)))
    first = sorted(shown, key=shown.__getitem__)[-1]
    text = status.nearest_evidence(picture)
    assert text is not None
    assert text.startswith(f"{TEST_RATIOS[first].replace('_', ' ')} {shown[first]:.2f}, ")
    assert text.count(",") == 2
    picture.take([], 10.0)
    assert status.nearest_evidence(picture) is None


def test_coherence_is_that_of_the_samples_that_came() -> None:
    """Against scipy; where a LEVER_SAMPLE is lost its sample is left out, however many are."""
    signal = pytest.importorskip("scipy.signal")
    rng, count = np.random.default_rng(7), 12_000
    z_ddot = np.round(np.convolve(rng.standard_normal(count), np.ones(40) / 40.0, "same"), 3)
    theta = np.round(0.02 * z_ddot + 0.002 * rng.standard_normal(count), 4)
    there = np.ones(count, dtype=bool)
    there[5000:5100] = False
    lever, base, paired = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE"), Paired()
    for start in range(0, count, 100):
        frames: list[Frame] = []
        for k in range(start, start + 100):
            frames += [(0x110, lever(k, theta[k], 0.0, 0.0))] if there[k] else []
            frames.append((0x111, base(k, z_ddot[k], (2**32 - 5_000_000 + 1000 * k) % 2**32)))
        paired.take(frames, start * 1e-3)
    measured = paired.coherence(12.0)
    assert measured is not None
    frequency, expected = signal.coherence(z_ddot[there], theta[there], 1000.0, nperseg=2000)
    np.testing.assert_allclose(measured.frequency, frequency)
    np.testing.assert_allclose(measured.coherence, expected, rtol=1e-6)
    assert 0.2 < measured.chance < 0.4
    paired.take([], 40.0)
    assert paired.coherence(40.0) is None


def test_dither_is_measured_over_a_window(flight: Flight) -> None:
    picture = Picture()
    watch(picture, flight, 0.5)
    assert picture.dither() == 0.0
    squares = []
    for k in range(60):
        flight.command({"dither_rms": 0.3} if k == 0 else {})
        frames = flight.frames(100)
        picture.take(frames, flight.sample * 1e-3)
        squares += [codec.decode(0x215, data)[1]["dither"] ** 2 for identifier, data in frames if identifier == 0x215]
    expected = math.sqrt(sum(squares[-2000:]) / 2000)
    assert picture.dither() == pytest.approx(expected, rel=0.05)
    assert 0.2 < expected < 0.4


def test_nothing_is_known_before_the_first_frame() -> None:
    picture = Picture()
    picture.take([], 0.0)
    assert picture.parameters() == []
    assert all(math.isnan(entry.value) and math.isnan(entry.sigma) for entry in picture.dynamics())
    assert picture.mode is None
    assert picture.silence() == math.inf
    assert status.condition(picture) == ("watch", "no frame has come yet")


def test_what_is_old_is_not_shown_as_present(flight: Flight) -> None:
    picture = Picture()
    watch(picture, flight, 1.0)
    assert status.condition(picture)[0] in ("good", "watch")
    picture.take([], 1.0 + STALE_AFTER + 0.5)
    assert picture.silence() == pytest.approx(2.5)
    assert all(math.isnan(entry.value) for entry in (*picture.parameters(), *picture.dynamics()))
    assert picture.mode is None
    assert picture.faults() == []
    assert status.condition(picture) == ("bad", "no frame from the estimator for 2 s: what is shown is old")
    assert math.isnan(picture.history["k_p"][-1])


def test_samples_without_an_estimator_are_told(flight: Flight) -> None:
    picture = Picture()
    picture.take([frame for frame in flight.frames(100) if frame[0] < 0x200], 0.1)
    assert status.condition(picture)[1] == "samples pass, but no estimator answers: is the firmware running?"


def test_faults_are_named_and_held_long_enough_to_be_read(flight: Flight) -> None:
    picture = Picture()
    watch(picture, flight, 1.0)
    assert "gap" not in picture.faults()
    flight.sample += 40  # as many samples are missing
    watch(picture, flight, 0.1)
    assert "gap" in picture.faults()
    assert "samples were missing" in status.faults(picture)
    watch(picture, flight, 1.5)
    assert "gap" in picture.faults()
    watch(picture, flight, 1.0)
    assert "gap" not in picture.faults()


def test_health_of_the_machine(flight: Flight) -> None:
    picture = Picture()
    watch(picture, flight, 0.3)
    assert picture.platform_faults() is None
    lever = flight.bus.estimator.pointer
    for overruns in (250, 262):
        report = {"faults": lib.LEVER_PLATFORM_OVERRUN, "transmit_errors": 96, "receive_errors": 3, "bus_offs": 1}
        lib.lever_platform(lever, ffi.new("lever_platform_t *", {**report, "overruns": overruns}))
        watch(picture, flight, 0.3)
    assert picture.platform_faults() == ["overrun"]
    assert picture.counts["overruns"] == 12  # beyond the eight bits of the frame
    assert picture.field("PLATFORM_HEALTH", "transmit_errors") == 96
    assert "platform" in picture.faults()
    assert "machine: received frames have been lost since the last report" in status.faults(picture)
    assert enum_words("lever_fault")["platform"] not in status.faults(picture)  # which is told in more detail


def test_cause_of_the_last_reset() -> None:
    picture = Picture()
    assert status.last_reset(picture) is None
    first: dict[str, codec.Value] = {"cause": "power_on", "resets": 0, "failed": 0, "fault_address": 0}
    second: dict[str, codec.Value] = {"cause": "hard_fault", "resets": 3, "failed": 2 | 4, "fault_address": 0x0800_1234}
    says = "hard fault, 3 since power-on; failed: RAM, stack; hard fault at 0x08001234"
    for k, (values, said) in enumerate([(first, "power on, 0 since power-on"), (second, says)]):
        data = codec.encode("PLATFORM_RESET", k, values)
        picture.take([(codec.message("PLATFORM_RESET").frame_id, data)], float(k))
        assert status.last_reset(picture) == said
    picture.take([], 10.0)
    assert status.last_reset(picture) is None


# --- counts ----------------------------------------------------------------------------------------------------------


def test_rates_are_frames_a_second(flight: Flight) -> None:
    picture = Picture()
    watch(picture, flight, 4.0)
    rates = {name: entry.rate for name, entry in picture.traffic.items() if entry.heard is not None}
    assert rates.pop("LEVER_SAMPLE") == pytest.approx(1000)
    assert rates.pop("BASE_SAMPLE") == pytest.approx(1000)
    assert rates.pop("STATE_ESTIMATE") == pytest.approx(1000)
    assert rates.pop("IDENTITY") == pytest.approx(3, abs=1)
    assert set(rates) == {"PILOT_PARAMETERS", "PILOT_SIGMA", "PILOT_DYNAMICS", "FEEDTHROUGH", "HEALTH", "LINK_HEALTH"}
    assert all(rate == pytest.approx(50) for rate in rates.values())  # publish_period
    picture.take([], 6.1)
    picture.take([], 8.2)
    assert all(entry.rate == 0.0 for entry in picture.traffic.values() if entry.heard is not None)


def test_what_was_taken_away_is_counted_as_lost(flight: Flight) -> None:
    """Frames are removed in runs of up to 14, damaged, and doubled at random, with some good ones between."""
    chance, picture = random.Random(5), Picture()
    frames = [frame for frame in flight.frames(4000) if frame[0] == 0x210]
    passing, lost, corrupt, repeated = frames[:3], 0, 0, 0
    place = 3
    while place < len(frames) - 20:
        identifier, data = frames[place]
        what = chance.choice(("lose", "damage", "repeat", "pass"))
        if what == "lose":
            run = chance.randint(1, 14)
            lost += run
            place += run
        elif what == "damage":
            damaged = bytearray(data)
            damaged[chance.randrange(8)] ^= 1 << chance.randrange(8)
            passing.append((identifier, damaged))
            corrupt += 1
            place += 1
        elif what == "repeat":
            passing += [frames[place]] * 2
            repeated += 1
            place += 1
        passing += frames[place : place + 3]
        place += 3
    for begin in range(0, len(passing), 97):
        picture.take(passing[begin : begin + 97], begin * 1e-3)
    entry = picture.traffic["STATE_ESTIMATE"]
    assert min(lost, corrupt, repeated) > 50
    assert (entry.lost, entry.corrupt, entry.repeated, entry.frames) == (lost, corrupt, repeated, len(passing))
    picture.clear_counts()
    assert (entry.lost, entry.corrupt, entry.repeated, entry.frames) == (0, 0, 0, 0)


def test_counts_of_the_estimator_go_on_beyond_their_bits() -> None:
    picture = Picture()
    faults: dict[str, codec.Value] = {f"fault_{name}": 0 for name in enum_names("lever_fault").values()}
    for k in range(5):
        link: dict[str, codec.Value] = {"model": "lever", "valid": 1, "lost": 0, "corrupt": 30_000 * k, "late": 0}
        health: dict[str, codec.Value] = {"mode": "run", "restarts": 100 * k % 256, "excitation": 0.1, **faults}
        frames = [(0x219, codec.encode("LINK_HEALTH", k, link)), (0x214, codec.encode("HEALTH", k, health))]
        picture.take(frames, 0.1 * k)
    assert (picture.counts["corrupt"], picture.counts["restarts"]) == (120_000, 400)


def test_an_estimator_of_another_contract_is_told(flight: Flight) -> None:
    picture = Picture()
    watch(picture, flight, 1.0)
    assert picture.identity.version == "0.2.0"
    assert picture.identity.choices["estimator"] == "dual"
    version = {"firmware_major": 1, "firmware_minor": 0, "firmware_patch": 0, "contract": 3}
    picture.take([(0x217, codec.encode("IDENTITY", 0, {"page": 0, **version}))], 1.0)
    assert status.condition(picture) == (
        "bad",
        "the estimator speaks contract 3 of lever.dbc, this program 2: what is shown is wrong",
    )


def test_an_estimator_that_does_not_tell_its_contract_is_told(flight: Flight) -> None:
    picture = Picture()
    for _ in range(40):
        picture.take([frame for frame in flight.frames(100) if frame[0] != 0x217], flight.sample * 1e-3)
        shown = status.condition(picture)
        assert (shown[0] == "bad") is (picture.now > 3.1 + 1e-9)
    assert shown[1].startswith("the estimator does not send its version (IDENTITY): ")


def test_a_second_estimator_on_the_bus_is_told(make_flight: Callable[..., Flight]) -> None:
    picture, first, second = Picture(), make_flight(), make_flight()
    watch(picture, first, 1.0)
    for identifier, data in second.frames(10):
        if identifier == 0x217:
            first.send(identifier, bytes(data))
    watch(picture, first, 0.2)
    assert "duplicate" in picture.faults()
    assert enum_words("lever_fault")["duplicate"] in status.condition(picture)[1]


def test_each_acknowledgement_is_taken(flight: Flight) -> None:
    picture = Picture()
    watch(picture, flight, 0.1)
    command = codec.encode("COMMAND", 0, {"request": "none", **KEEP})
    for _ in range(2):
        flight.send(0x120, command)
    watch(picture, flight, 0.1)
    acknowledged = [(ack["command_counter"], result_of(ack)) for ack in picture.acknowledgements]
    assert acknowledged == [(0, "accepted"), (0, "sequence")]


def test_other_traffic_is_counted_and_harmless(flight: Flight) -> None:
    picture = Picture()
    frames: list[Frame] = [(0x123, b"\1\2"), (FOREIGN, b""), (ERROR, b""), (0x210, b"\1"), (0x210, b"")]
    picture.take([*flight.frames(400), *frames], 0.0)
    assert (picture.foreign, picture.error_frames) == (2, 1)
    assert picture.traffic["STATE_ESTIMATE"].corrupt == 2
    assert not math.isnan(picture.parameters()[0].value)


# --- history ---------------------------------------------------------------------------------------------------------


def test_history_has_a_row_a_step_and_is_bounded(flight: Flight, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lever_cdkf.watch.picture.ROWS", ROWS // 10)
    picture, frames = Picture(), flight.frames(50)
    for k in range(2 * ROWS // 10 * 3):
        picture.take(frames if k % 100 == 0 else [], k * STEP / 3)
    lengths = {len(column) for column in picture.history.values()}
    assert lengths == {ROWS // 10}
    times = list(picture.history["time"])
    steps = [after - before for before, after in itertools.pairwise(times)]
    assert steps == pytest.approx([STEP] * len(steps))
