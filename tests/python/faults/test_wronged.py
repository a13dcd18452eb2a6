"""What the fault of a row does to the frames of a bus and to the readings of the sensors, as its title says."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_sil.faults.bus import Bus
from lever_sil.faults.readings import Readings
from lever_sil.faults.rows import ROWS
from numpy.typing import NDArray

MESSAGES = {"lever": "LEVER_SAMPLE", "grip": "GRIP_SAMPLE", "base": "BASE_SAMPLE", "command": "COMMAND"}

Frames = NDArray[np.void]

PERIOD = 0.01
TIME = slice(1500, 2500)
"""The samples of a fault."""
COUNT = 3000


def sent(name: str) -> tuple[Bus, Bus]:
    """Return a bus as it should be, and the same with the fault of a row."""
    row = ROWS[name]
    right, wronged = (Bus(COUNT, PERIOD, row.grip, 0.3, np.random.default_rng(1)) for _ in range(2))
    row.on_bus(wronged, row.time)
    return right, wronged


def of(message: str, among: Bus) -> Frames:
    """Return the frames of a message, as they were sent."""
    own: Frames = among.frames[among.frames["id"] == codec.message(message).frame_id]
    return own


def changed(name: str, column: str) -> tuple[Frames, Frames]:
    """Return the frames of the row's message that differ in a column: right, wrong; all others are as they were."""
    right, wronged = sent(name)
    np.testing.assert_array_equal(right.order, wronged.order)
    differ = np.flatnonzero(np.any(right.frames[column].reshape(len(right.order), -1)
                                   != wronged.frames[column].reshape(len(right.order), -1), axis=1))  # fmt: skip
    for other in set(right.frames.dtype.names or ()) - {column}:
        np.testing.assert_array_equal(right.frames[other], wronged.frames[other])
    assert set(right.frames["id"][differ]) == {codec.message(MESSAGES[name.partition("_")[0]]).frame_id}
    return right.frames[differ], wronged.frames[differ]


@pytest.mark.parametrize("short", MESSAGES)
def test_damaged_frames_are_damaged_as_the_row_says(short: str) -> None:
    every = 1 if short == "command" else 10
    usual = of(MESSAGES[short], sent("grip_crc")[0])["of"]
    hit = usual[(usual >= 1500) & (usual < 2500)]
    for byte in range(8):
        right, wrong = changed(f"{short}_flip_{byte}", "change")
        assert wrong["of"].tolist() == hit[::every].tolist()
        bits = np.unpackbits(right["change"] ^ wrong["change"], axis=1).reshape(len(wrong), 8, 8).sum(axis=2)
        assert bits[:, byte].tolist() == [1] * len(wrong)
        assert bits.sum() == len(wrong)
    right, wrong = changed(f"{short}_crc", "change")
    assert (right["change"] ^ wrong["change"]).tolist() == [[0xFF, *[0] * 7]] * len(hit)
    for length in (0, 7):
        assert changed(f"{short}_length_{length}", "length")[1]["length"].tolist() == [length] * len(hit)
    if short != "command":
        assert set(changed(f"{short}_masquerade", "data_id")[1]["data_id"]) == {codec.data_ids("HEALTH")[0]}
        counters = changed(f"{short}_counter_ahead", "counter")[1]
        assert counters["counter"].tolist() == [(sample + 2) % 16 for sample in range(1500, 2500)]
        assert set(changed(f"{short}_counter_frozen", "counter")[1]["counter"]) == {0}


@pytest.mark.parametrize("short", MESSAGES)
def test_frames_come_besides_as_the_row_says(short: str) -> None:
    usual = of(MESSAGES[short], sent("grip_crc")[0])["of"]
    hit = usual[(usual >= 1500) & (usual < 2500)].tolist()
    for kind, mark in (("extended", 1 << 31), ("remote", 1 << 30), ("error", 1 << 29)):
        right, wronged = sent(f"{short}_{kind}")
        more = wronged.frames[len(right.frames) :]
        assert set(more["id"]) == {codec.message(MESSAGES[short]).frame_id | mark}
        assert more["of"].tolist() == hit
        assert not np.array_equal(more["change"][:, 2:], np.zeros((len(hit), 6)))
        assert not more["change"][:, :2].any() or short == "command"
        assert np.all(np.isin(np.floor(wronged.order[len(right.order) :]), hit))
    right, wronged = sent(f"{short}_twice")
    twice = of(MESSAGES[short], wronged)["of"].tolist()
    assert twice == [*usual.tolist(), *hit]


def numbers(name: str, message: str) -> list[int]:
    return list(of(message, sent(name)[1])["counter"][TIME])


def test_counters_of_all_samples_count_as_the_row_says() -> None:
    for message in ("LEVER_SAMPLE", "BASE_SAMPLE"):
        assert numbers("counters_by_two", message) == [2 * sample % 16 for sample in range(1500, 2500)]
        assert numbers("counters_backwards", message) == [-sample % 16 for sample in range(1500, 2500)]


def arrive(name: str, message: str) -> list[int]:
    """Return which samples of a message arrive, in their order."""
    delivered = sent(name)[1].delivered()
    return [int(sample) for sample in delivered["of"][delivered["id"] == codec.message(message).frame_id]]


def missing(name: str, message: str) -> list[int]:
    return sorted(set(range(COUNT)) - set(arrive(name, message)))


@pytest.mark.parametrize("short", ["lever", "grip", "base"])
def test_frames_are_missing_as_the_row_says(short: str) -> None:
    message = MESSAGES[short]
    for percent in (1, 5, 10, 20, 50):
        gone = missing(f"{short}_lost_{percent}", message)
        assert len(gone) == pytest.approx(10 * percent, abs=5.0 * math.sqrt(10 * percent))
        assert 1500 <= gone[0] <= gone[-1] < 2500
    for length, every in ((0.05, 0.5), (0.3, 2.0), (2.0, 20.0)):
        bursts = [sample for sample in range(1500, 2500) if (sample - 1500) % round(every / PERIOD) < length / PERIOD]
        assert missing(f"{short}_burst_{length:g}s", message) == bursts


def test_samples_commands_and_all_are_missing_as_the_row_says() -> None:
    for percent in (1, 10, 50):
        gone = missing(f"samples_lost_{percent}", "LEVER_SAMPLE")
        assert gone == missing(f"samples_lost_{percent}", "BASE_SAMPLE")
        assert len(gone) == pytest.approx(10 * percent, abs=5.0 * math.sqrt(10 * percent))
    for name, samples in (("silence_0.3s", 30), ("silence_10s", 1000)):
        for message in ("LEVER_SAMPLE", "BASE_SAMPLE"):
            assert missing(name, message) == list(range(1500, 1500 + samples))
    assert arrive("silence_10s", "COMMAND") == [*range(0, 1500, 250), 2500, 2750]
    assert arrive("command_lost", "COMMAND") == [*range(0, 1500, 250), 2500, 2750]
    assert 8 < len(arrive("command_lost_50", "COMMAND")) < 12
    assert missing("command_lost_50", "LEVER_SAMPLE") == []


def at(name: str, message: str) -> dict[int, tuple[int, int]]:
    """Return when each sample of a message arrives, and its place among all frames of that sample."""
    delivered = sent(name)[1].delivered()
    place = np.arange(len(delivered)) - np.searchsorted(delivered["at"], delivered["at"])
    own = delivered["id"] == codec.message(message).frame_id
    return {
        int(frame["of"]): (int(frame["at"]), int(where))
        for frame, where in zip(delivered[own], place[own], strict=True)
    }


@pytest.mark.parametrize("short", ["lever", "grip"])
def test_frames_before_the_base_come_after_it_or_late(short: str) -> None:
    behind, base = at(f"{short}_after_base", MESSAGES[short]), at(f"{short}_after_base", "BASE_SAMPLE")
    late = at(f"{short}_late", MESSAGES[short])
    for sample in (1499, 1500, 2499, 2500):
        within = 1500 <= sample < 2500
        assert (behind[sample] > base[sample]) == within
        assert behind[sample][0] == sample
        assert late[sample][0] == sample + 5 * within


def test_frames_are_late_or_swapped_as_the_row_says() -> None:
    assert at("base_late", "BASE_SAMPLE")[2000][0] == 2005
    assert at("base_late", "LEVER_SAMPLE")[2000][0] == 2000
    assert at("all_late", "BASE_SAMPLE")[2000][0] == at("all_late", "LEVER_SAMPLE")[2000][0] == 2020
    for short in ("lever", "grip", "base"):
        order = arrive(f"{short}_swapped", MESSAGES[short])
        assert order[1498:1504] == [1498, 1499, 1501, 1500, 1503, 1502]
        old = of(MESSAGES[short], sent(f"{short}_stale")[1])
        assert set(old["of"][TIME]) == {1500}
        assert old["counter"][TIME].tolist() == [sample % 16 for sample in range(1500, 2500)]


# --- commands and other senders --------------------------------------------------------------------------------------


def commands(name: str) -> Frames:
    """Return the COMMANDs that arrive."""
    delivered = sent(name)[1].delivered()
    own: Frames = delivered[delivered["id"] == codec.message("COMMAND").frame_id]
    return own


def asked(frame: np.void) -> dict[str, str]:
    """Return what a COMMAND asks for, by name."""
    layout = codec.message("COMMAND")
    _, values = codec.decode(layout.frame_id, bytes(frame["change"]))
    names: dict[str, dict[int, Any]] = {signal.name: dict(signal.choices or {}) for signal in layout.signals}
    return {name: str(names[name].get(int(value), value)) for name, value in values.items() if name != "crc"}


SWITCHED: dict[str, tuple[str, tuple[str, ...]]] = {
    "model_switched": ("model", ("lever", "linear_physical", "linear_black_box", "hand")),
    "reset_flood": ("request", ("reset",)),
    "estimator_switched": ("estimator", ("joint", "dual")),
    "preload_switched": ("preload", ("fixed", "trim")),
    "adaptation_switched": ("adaptation", ("annealing", "forgetting")),
    "freeze_switched": ("request", ("freeze", "run")),
    "dither_switched": ("dither_rms", ("0.0", "0.3")),
    "dither_most": ("dither_rms", ("60.0",)),
}
RIGHT = {"model": "lever", "preload": "trim", "estimator": "dual", "adaptation": "robbins_monro", "dither_rms": "0.3"}


@pytest.mark.parametrize("name", SWITCHED)
def test_commands_of_a_flood_take_turns_and_the_next_one_sets_things_right(name: str) -> None:
    frames = commands(name)
    assert frames["at"].tolist() == [*range(0, 1500, 250), *range(1500, 2500), 2500, 2750]
    signal, values = SWITCHED[name]
    for i in range(20):
        assert asked(frames[6 + i])[signal] == values[i % len(values)]
    restored = asked(frames[-2])
    assert {each: restored[each] for each in RIGHT} == RIGHT
    runs = name.endswith("_switched") and name != "model_switched"
    assert restored["request"] == ("run" if runs else "none")


def test_commands_that_change_nothing_come_ten_at_a_time() -> None:
    frames = commands("command_flood")
    assert frames["at"][6:-2].tolist() == [sample for sample in range(1500, 2500) for _ in range(10)]
    contents = {tuple(sorted({**asked(frame), "counter": ""}.items())) for frame in frames[6:106]}
    ((*content,),) = contents
    nothing = {"request": "none", **dict.fromkeys((*RIGHT, "mitigation"), "keep")}
    assert {name: value for name, value in content if name not in ("counter", "dither_rms")} == {
        name: value for name, value in nothing.items() if name != "dither_rms"
    }


def counters(name: str) -> list[int]:
    return [int(float(asked(frame)["counter"])) for frame in commands(name)]


def test_counters_of_commands_are_as_the_row_says() -> None:
    assert counters("foreign_load") == list(range(12))
    assert counters("command_counter_frozen") == [0, 1, 2, 3, 4, 5, 5, 5, 5, 5, 10, 11]
    assert counters("command_counter_elsewhere") == [0, 1, 2, 3, 4, 5, 0, 0, 0, 0, 10, 11]
    assert counters("command_counter_skips") == [0, 1, 2, 3, 4, 5, 0, 5, 10, 15, 10, 11]


def test_commands_for_a_model_that_is_not_there_come_besides() -> None:
    """A hundred in a second of a thousand samples."""
    frames = commands("command_unknown")
    unknown = [int(frame["at"]) for frame in frames if asked(frame)["model"] in ("9", "9.0")]
    assert unknown == list(range(1500, 2500, 10))
    assert len(frames) == len(unknown) + 12


def others(name: str) -> Frames:
    right, wronged = sent(name)
    np.testing.assert_array_equal(right.frames, wronged.frames[: len(right.frames)])
    return wronged.frames[len(right.frames) :]


def test_other_senders_send_what_the_row_says() -> None:
    inputs = {codec.message(name).frame_id for name in MESSAGES.values()}
    load = others("foreign_load")
    assert load["of"].tolist() == [sample for sample in range(1500, 2500) for _ in range(8)]
    assert not inputs & set(load["id"].tolist())
    assert codec.message("IDENTITY").frame_id not in load["id"]
    assert codec.message("STATE_ESTIMATE").frame_id in load["id"]
    assert load["id"].max() < 0x7F0
    for every, name in ((10, "babble_10"), (1, "babble_1")):
        random = others(name)
        assert random["of"].tolist() == list(range(1500, 2500, every))
        assert set(random["id"].tolist()) == inputs
        assert len({bytes(each) for each in random["change"]}) == len(random)
    identities = others("second_estimator")
    assert set(identities["id"].tolist()) == {codec.message("IDENTITY").frame_id}
    assert identities["of"].tolist() == list(range(1500, 2500, round(1.0 / PERIOD)))
    assert [codec.decode(int(each["id"]), bytes(each["change"]))[1]["counter"] for each in identities] == list(
        range(10)
    )


# --- readings --------------------------------------------------------------------------------------------------------

UNIT = {"theta": "θ", "theta_dot": "θ̇", "tau_m": "τ_m", "z_ddot": "z̈", "grip_force": "grip force"}
STEPS = {"theta": 0.1, "theta_dot": 0.2, "tau_m": 0.5, "z_ddot": 2.0, "grip_force": 20.0}
SPIKES = {"theta": 0.3, "theta_dot": 3.0, "tau_m": 1.5, "z_ddot": 10.0, "grip_force": 100.0}
"""[rad, rad/s, N m, m/s^2, N]"""
TOLD = {
    "invalid": "marked invalid", "not_available": "NaN-coded but marked valid", "saturated": "saturated",
    "stuck": "stuck", "zero": "zero", "step": "off by a step", "drift": "off by a ramp to the same",
    "sign": "of the wrong sign", "gain_half": "half as large", "gain_double": "twice as large",
    "gain_drift": "gain going to 1.5", "spikes": "1 % of the values far off",
}  # fmt: skip


def read(name: str) -> Readings:
    """Return the readings with the fault of a row from sample 10 to 1,010 of 1,020, a hundredth of a second apart."""
    wronged = Readings.right(1020, PERIOD, np.random.default_rng(1))
    ROWS[name].on_readings(wronged, np.arange(10, 1010))
    return wronged


def greatest(signal: str) -> float:
    """Return the largest value that a frame can carry."""
    layouts = [each for name in MESSAGES.values() for each in codec.message(name).signals]
    return max(float(each.maximum or 0.0) for each in layouts if each.name == signal)


@pytest.mark.parametrize("signal", UNIT)
def test_readings_are_wrong_as_the_row_says(signal: str) -> None:
    reading = np.sin(np.arange(1020.0))
    ramp, inside = np.arange(1000) / 1000.0, slice(10, 1010)
    expected = {
        "invalid": np.full(1000, np.nan),
        "not_available": np.full(1000, np.inf),
        "saturated": np.full(1000, greatest(signal)),
        "stuck": np.full(1000, reading[9]),
        "zero": np.zeros(1000),
        "step": reading[inside] + STEPS[signal],
        "drift": reading[inside] + STEPS[signal] * ramp,
        "sign": -reading[inside],
        "gain_half": 0.5 * reading[inside],
        "gain_double": 2.0 * reading[inside],
        "gain_drift": (1.0 + 0.5 * ramp) * reading[inside],
    }
    if signal == "tau_m":
        expected["gain_0.7"] = 0.7 * reading[inside]
    for what, values in expected.items():
        wronged = read(f"{signal}_{what}").of
        np.testing.assert_allclose(wronged[signal].of(reading), [*reading[:10], *values, *reading[1010:]])
        assert all(np.array_equal(each.of(reading), reading) for name, each in wronged.items() if name != signal)
    off = read(f"{signal}_spikes").of[signal].of(reading) - reading
    assert 2 < np.count_nonzero(off) < 25
    np.testing.assert_allclose(np.abs(off[off != 0.0]), SPIKES[signal])
    assert {what: ROWS[f"{signal}_{what}"].title for what in TOLD} == {
        what: f"{UNIT[signal]} {words}" for what, words in TOLD.items()
    }


def test_both_outputs_are_invalid_or_one_reading_while_no_lever_sample_comes() -> None:
    both = read("outputs_invalid").of
    assert [name for name, each in both.items() if np.isnan(each.of(np.ones(1020))).any()] == ["theta", "theta_dot"]
    for name, value in (("stuck", 9.0), ("zero", 0.0)):
        assert set(read(f"z_ddot_{name}_coasting").of["z_ddot"].of(np.arange(1020.0))[10:1010]) == {value}
        assert missing(f"z_ddot_{name}_coasting", "LEVER_SAMPLE") == list(range(1500, 2500))


@pytest.mark.parametrize(
    ("name", "rate"),
    [("stands", 0.0), ("back", -1.0), ("crawls", 0.1), ("half", 0.5), ("0.9", 0.9), ("1.1", 1.1), ("2", 2.0)],
)
def test_a_clock_goes_at_the_rate_that_the_row_says(name: str, rate: float) -> None:
    time = read(f"clock_{name}").time_us
    right = 10_000 * np.arange(1020)
    np.testing.assert_allclose(time[10:1010], right[10] + rate * (right[10:1010] - right[10]), atol=1.0)
    np.testing.assert_array_equal(time[1010:], right[1010:])


@pytest.mark.parametrize(
    ("name", "seconds"),
    [("0.1s", 0.1), ("1s", 1.0), ("1h", 3600.0), ("back_0.1s", -0.1), ("back_10s", -10.0)],
)
def test_a_clock_jumps_as_the_row_says(name: str, seconds: float) -> None:
    ahead = read(f"clock_jumps_{name}").time_us - 10_000 * np.arange(1020)
    np.testing.assert_array_equal(ahead, np.where(np.arange(1020) < 10, 0, round(1e6 * seconds)))
    assert f"{seconds:g} s" in ROWS[f"clock_jumps_{name}"].title


def test_a_clock_passes_32_bits() -> None:
    assert read("clock_wraps").time_us[10] == 2**32
