"""What each fault of the matrix demands of the firmware: as it was required, so that no demand moves unnoticed."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from lever_sil.faults import table
from lever_sil.faults.rows import KNOWN, ROWS

FLAGS = {"theta": "THETA", "theta_dot": "THETA_DOT", "tau_m": "TORQUE", "z_ddot": "BASE"}


def rows(prefixes: str, names: str) -> list[str]:
    """Return the names of rows: each prefix with each of the names."""
    return [f"{prefix}_{name}" for prefix in prefixes.split() for name in names.split()]


FLIPS = " ".join(f"flip_{byte}" for byte in range(8))
BLIND = "mode coast, no torque after 0.08 s"
STANDS = "CLOCK within 2 samples, mode run or coast, no torque after 0.06 s"
BABBLE = "mode init or align or run or coast or frozen"
INNOVATIONS = "BASE or MISMATCH or INNOVATION or CALIBRATION"
REQUIRED: dict[str, Iterable[str]] = {
    "COMMUNICATION within 2 samples, mode run": [
        *rows("lever grip base", FLIPS),
        *rows("grip", "crc masquerade length_0 length_7 counter_frozen"),
        *rows("lever grip base command", "twice"),
        "command_unknown",
    ],
    f"COMMUNICATION within 2 samples, {BLIND}": rows("lever", "crc masquerade length_0 length_7 counter_frozen"),
    "not a bit changes": [
        *rows("lever grip base command", "extended remote error"),
        *("foreign_load", "command_flood"),
    ],
    "COMMUNICATION at its end, mode run, no torque after 0.08 s": rows("base", "crc masquerade length_0 length_7"),
    "COMMUNICATION at its end, mode run or coast, no torque after 0.08 s": ["base_counter_frozen"],
    "COMMUNICATION within 2 samples, mode run, no torque after 1.06 s": rows(
        "command", f"{FLIPS} crc length_0 length_7 counter_frozen"
    ),
    "COMMUNICATION within 2 samples, mode run, no torque after 2.31 s": ["command_counter_elsewhere"],
    "COMMUNICATION within 20 samples, mode run": ["counters_backwards"],
    "COMMUNICATION within 5 samples, mode run or coast": rows("lever grip base", "swapped"),
    f"THETA within 2 samples, {BLIND}": [
        *rows("lever", "counter_ahead after_base late"),
        *("base_counter_ahead", "outputs_invalid"),
    ],
    f"THETA within 7 samples, {BLIND}": ["base_late"],
    "THETA or THETA_DOT within 500 samples, mode run or coast": ["lever_stale"],
    "mode run": [
        *("grip_counter_ahead", "counters_by_two", "command_counter_skips", "command_lost_50"),
        *rows("grip", "burst_0.05s burst_0.3s burst_2s after_base late"),
        *("all_late", "adaptation_switched", "dither_switched", "dither_most"),
        *rows("theta theta_dot", "step drift gain_half gain_double gain_drift"),
        *rows("tau_m", "step drift gain_drift spikes"),
        *rows("z_ddot", "step drift gain_half gain_double gain_drift spikes"),
        *rows("grip_force", "invalid not_available step drift gain_drift spikes"),
        "clock_wraps",
    ],
    "mode run or coast": rows("grip", "lost_1 lost_5 lost_10 lost_20 lost_50"),
    "mode run or frozen": ["freeze_switched"],
    "mode init or align, no torque after 0.06 s": [
        *("model_switched", "reset_flood", "estimator_switched", "preload_switched"),
    ],
    "mode run, no torque after 1.06 s": ["command_lost"],
    **{f"GAP within {round(1000 * time) + 1} samples, mode run": [f"base_burst_{time:g}s"] for time in (0.05, 0.3, 2)},
    "GAP at its end, mode run, no torque after 0.08 s": ["silence_0.3s", "silence_10s"],
    "GAP within 2 samples, mode run": ["clock_2"],
    "GAP within 1 sample, mode run or align": rows("clock", "jumps_0.1s jumps_1s"),
    "CLOCK within 1 sample, mode run or align": rows("clock", "jumps_1h jumps_back_0.1s jumps_back_10s"),
    "CALIBRATION within 500 samples, mode run": rows("clock", "half 0.9 1.1"),
    "CALIBRATION within 2000 samples, mode run": ["tau_m_gain_0.7"],
    STANDS: ["base_stale", *rows("clock", "stands back crawls")],
    "CALIBRATION within 10000 samples, mode run": [
        "grip_stale",
        *rows("grip_force", "saturated stuck zero sign gain_half gain_double"),
    ],
    f"COMMUNICATION or CLOCK within 50 samples, {BABBLE}": ["babble_10"],
    f"COMMUNICATION or CLOCK within 10 samples, {BABBLE}": ["babble_1"],
    "DUPLICATE within 2 samples, mode run": ["second_estimator"],
    "THETA within 1 sample, mode run": [
        *rows("lever", "burst_0.05s burst_0.3s burst_2s"),
        *rows("theta", "invalid not_available saturated invalid_from_power_on saturated_from_power_on"),
    ],
    **{
        f"{flag} within 1 sample, mode run": rows(
            signal, "invalid not_available saturated invalid_from_power_on saturated_from_power_on"
        )
        for signal, flag in FLAGS.items()
        if signal != "theta"
    },
    **{f"{flag} within 500 samples, mode run": rows(signal, "stuck zero") for signal, flag in FLAGS.items()},
    **{
        f"{flag} within 800 samples, mode run": rows(signal, "stuck_from_power_on zero_from_power_on")
        for signal, flag in FLAGS.items()
    },
    "THETA or BASE or MISMATCH within 2000 samples, mode run": ["theta_sign"],
    "THETA_DOT or BASE or MISMATCH within 2000 samples, mode run": ["theta_dot_sign"],
    "TORQUE within 2000 samples, mode run": rows("tau_m", "sign gain_half gain_double"),
    "BASE within 2000 samples, mode run": ["z_ddot_sign"],
    **{
        f"{flag} or {INNOVATIONS} within 3200 samples, mode run": [f"{signal}_sign_from_power_on"]
        for signal, flag in FLAGS.items()
        if flag != "BASE"
    },
    f"{INNOVATIONS} within 3200 samples, mode run": ["z_ddot_sign_from_power_on"],
    f"BASE within 500 samples, {BLIND}": rows("z_ddot", "stuck_coasting zero_coasting"),
}
"""But for what is lost or spoilt at random: what comes by chance shows as soon as all but one in a million have seen
it."""
MILLIONTH = {
    1: 1375,  # 0.99^1375 < 1e-6 < 0.99^1374, and so on
    5: 270,
    10: 132,
    20: 62,
    50: 20,
}
REQUIRED |= {
    **{
        f"{flag} within {samples + 3} samples, mode run or coast": [f"{name}_lost_{percent}"]
        for name, flag in (("lever", "THETA"), ("base", "GAP"))
        for percent, samples in MILLIONTH.items()
    },
    **{
        f"GAP within {MILLIONTH[percent] + 1} samples, mode run": [f"samples_lost_{percent}"] for percent in (1, 10, 50)
    },
    **{f"{FLAGS[signal]} within 1376 samples, mode run": [f"{signal}_spikes"] for signal in ("theta", "theta_dot")},
}
SIGNALS = (*FLAGS, "grip_force")
HELD = (*("lost", "burst", "silence", "samples_lost", "command_lost", "outputs_invalid", "clock"), *SIGNALS)
"""How names begin of what is flown with parameters that are held, too; `lost` and `burst` are of a message."""
HOLDING = {"run": "frozen", "coast": "frozen", "run or coast": "frozen", "run or align": "frozen or align"}
"""Modes that are demanded, and those with parameters that are held."""
QUICK = {
    *("base_flip_3", "lever_extended", "lever_twice", "lever_lost_10", "silence_10s", "command_lost", "base_stale"),
    *("foreign_load", "command_flood", "model_switched", "theta_stuck", "z_ddot_sign", "tau_m_invalid"),
    *("clock_stands", "clock_wraps"),
}


def is_held(name: str) -> bool:
    """Return whether the row is flown with parameters that are held, too."""
    of_message = name.split("_", 1)[1] if name.startswith(("lever_", "grip_", "base_")) else name
    of_signal = name.startswith("grip_force")
    return (of_signal or of_message.startswith(HELD)) and not name.endswith(("_from_power_on", "_coasting"))


def frozen(demand: str) -> str:
    """Return what is demanded while the parameters are held."""
    flags, _, rest = demand.rpartition("mode ")
    modes, *torque = rest.split(", ")
    return f"{flags}mode {', '.join([HOLDING[modes], *torque])}"


def test_each_row_demands_what_is_required() -> None:
    required = {name: must for must, names in REQUIRED.items() for name in names}
    assert len(required) == sum(len(list(names)) for names in REQUIRED.values())
    required |= {f"{name}_frozen": frozen(must) for name, must in required.items() if is_held(name)}
    assert {name: table.demands(row.requirement) for name, row in ROWS.items()} == required


def test_rows_say_when_and_how_they_are_flown() -> None:
    for name, row in ROWS.items():
        assert row.name == name
        assert row.frozen == (name.endswith("_frozen") and name.removesuffix("_frozen") in ROWS)
        assert row.frozen == row.title.endswith(", parameters frozen")
        assert row.grip == name.startswith("grip_"), name
        from_power_on = name.endswith("_from_power_on")
        assert from_power_on == row.title.endswith(", from power-on")
        begins = 0.0 if from_power_on else 15.0
        lasts = 1.0 if "_jumps_" in name else 0.3 if name.startswith("silence_0.3s") else 10.0
        assert row.time == pytest.approx((begins, begins + lasts)), name
        plain = name.removesuffix("_from_power_on")
        plain = plain.removesuffix("_frozen") if row.frozen else plain
        assert row.quick == (plain in QUICK), name
    assert ROWS.keys() >= QUICK


def test_what_is_known_is_known_of_rows_that_there_are_with_parameters_held_or_not() -> None:
    assert KNOWN.keys() <= ROWS.keys()
    for name in KNOWN.keys() & {name.removesuffix("_frozen") for name in ROWS if name.endswith("_frozen")}:
        assert KNOWN.get(f"{name}_frozen") == KNOWN[name]
