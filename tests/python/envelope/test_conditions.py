"""What is asked of the firmware, and in which conditions: as it was required, so that no limit moves unnoticed."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import pytest
from lever_sil.acceptance.result import Limit
from lever_sil.batch.motions import Motion
from lever_sil.batch.sensors import Sensors
from lever_sil.envelope.condition import Condition
from lever_sil.envelope.conditions import CONDITIONS
from lever_sil.envelope.measure import FIGURES
from lever_sil.envelope.rules import RULES
from lever_sil.plants import trajectories
from lever_sil.plants.excitation import GaussMarkov, Noise, Sine
from lever_sil.plants.pilots import HandsOff
from lever_sil.plants.sensors import INVALID, Late, Reads, Scale, Spikes, Stuck
from lever_sil.plants.trajectories import Moves, Ramp, Sinusoid, Steps

ALL = CONDITIONS | RULES
COVERED = ", ".join(f"{name} covered ≥ 90" for name in ("f_n", "zeta", "m_p", "c_p", "k_p"))
FLAGGED, BACK = "; or flagged ≥ 90", "learnt ≤ 0.1, back ≤ 1"
FEEDTHROUGH = "θ/z̈ rms ≤ 10, θ/z̈ covered ≥ 85"
HANDS_OFF = {"hands_off": (HandsOff(start=25.0, end=35.0),), "events": ((25.0, 35.0),), "start": 40.0}
HAND = {"torque": (), "model": "hand"}
FORCE = {"duration": 120.0, "torque": (), "start": 60.0, "z_ddot_gain_sigma": 2e-3}
FORCED = FORCE | {"grip_gain_sigma": 5e-3, "against": "grip_none"}
DRAWN = {"z_ddot_gain_sigma": 0.02, "z_ddot_delay_sigma": 5e-4, "tau_m_gain_sigma": 0.02}
DRAWN |= {"friction_sigma": 0.05, "runs": 4}


BROAD, DITHER = Noise(rms=1.0, low=1.0, high=10.0), Noise(rms=0.3, low=1.0, high=10.0)


def sway(degrees: float, frequency: float) -> Sinusoid:
    return Sinusoid(0.0, math.radians(degrees), frequency, phase=None)


def wander(degrees: float) -> trajectories.Noise:
    return trajectories.Noise(mean=0.0, rms=math.radians(degrees), low=0.05, high=0.5)


def jump(factor: float) -> Steps:
    return Steps(1.0, (30.0,), (factor,))


def grip(factor: float, degrees: float, seconds: float) -> dict[str, Any]:
    arm = Ramp(1.0, factor, 30.0, seconds)
    return {"c_p": arm, "k_p": arm, "either_way": True, "trim": Ramp(0.0, math.radians(degrees), 30.0, seconds)}


def another(start: float, end: float) -> dict[str, Any]:
    arm = Steps(1.0, (end,), (2.0,))
    return {"hands_off": (HandsOff(start=start, end=end),), "c_p": arm, "k_p": arm, "either_way": True}


def paused(start: float, end: float) -> dict[str, Any]:
    base, torque = ((replace(each, end=start), replace(each, start=end)) for each in (BROAD, DITHER))
    return {"base": base, "torque": torque, "gusts": Steps(1.0, (start, end), (0.0, 1.0))}


def largest(sigmas: float) -> str:
    return ", ".join(f"{name} largest ≤ {sigmas:g}" for name in ("f_n", "zeta", "m_p"))


REQUIRED: dict[str, tuple[dict[str, Any], str]] = {
    "steady": ({}, "f_n rms ≤ 1, f_n covered ≥ 90, flagged ≤ 2"),
    "steady_base_only": ({"torque": ()}, "f_n rms ≤ 2, f_n covered ≥ 90, flagged ≤ 2"),
    "sway_2deg_0.3hz": ({"trim": sway(2.0, 0.3)}, "f_n rms ≤ 2, f_n covered ≥ 90"),
    "sway_5deg_0.3hz": ({"trim": sway(5.0, 0.3)}, "f_n rms ≤ 3, f_n covered ≥ 90"),
    "sway_1deg_0.5hz": ({"trim": sway(1.0, 0.5)}, "f_n rms ≤ 2, f_n covered ≥ 90"),
    "wander_1deg": ({"trim": wander(1.0)}, "f_n rms ≤ 1.5, f_n covered ≥ 90"),
    "wander_1deg_base_only": ({"trim": wander(1.0), "torque": ()}, "f_n rms ≤ 1.5, f_n covered ≥ 90"),
    "wander_3deg": ({"trim": wander(3.0)}, "f_n rms ≤ 3, f_n covered ≥ 90"),
    "wander_3deg_base_only": ({"trim": wander(3.0), "torque": ()}, "f_n rms ≤ 3, f_n covered ≥ 90"),
    "retrim": ({"trim": Ramp(0.0, math.radians(8.0), 30.0, 4.0)}, "f_n rms ≤ 1.2"),
    "grip_step": ({**grip(1.3, 1.0, 0.05), "events": ((30.0, 30.0),)}, "settled median ≤ 0.9, settled worst ≤ 2"),
    "grip_slow": (
        {**grip(1.5, 3.0, 0.5), "events": ((30.0, 30.5),), "start": 30.0},
        "settled median ≤ 2, f_n covered ≥ 90",
    ),
    "slow_torque": (
        {"disturbance": (GaussMarkov(rms=1.0, correlation_time=0.3),)},
        "f_n rms ≤ 3, f_n covered ≥ 85" + FLAGGED,
    ),
    "tremor": ({"disturbance": (Noise(rms=0.2, low=3.0, high=5.0),)}, "f_n rms ≤ 3, f_n covered ≥ 85" + FLAGGED),
    "rough_told": ({"process_noise": 0.5}, ""),
    "rough": ({"process_noise": 0.5, "against": "rough_told"}, "zeta ratio ≤ 1.3, zeta covered ≥ 85"),
    "damping_ramp": ({"c_p": Ramp(1.0, 0.43, 20.0, 30.0), "start": 22.0, "end": 50.0}, "c_p covered ≥ 90, lag ≤ 1.5"),
    "rest_20s": (paused(20.0, 40.0), largest(4)),
    "rest_120s": (paused(20.0, 140.0) | {"duration": 160.0}, largest(4)),
    "base_invalid": (
        {"start": 25.0, "events": ((25.0, 25.2), (28.0, 29.0), (33.0, 36.0), (41.0, 51.0))},
        f"{largest(3)}, learnt at once ≤ 0.1",
    ),
    "lever_lost": ({"duration": 40.0, "torque": ()}, largest(3.5)),
    "sample_lost": ({"duration": 40.0, "torque": ()}, largest(3.5)),
    **{
        name: ({"start": 30.0, "end": 48.0, "events": ((30.0, 40.0),)}, f"to flag ≤ 0.5, {BACK}")
        for name in ("base_stuck", "base_zero", "theta_stuck", "theta_dot_stuck")
    },
    "base_sign": (
        {"start": 30.0, "end": 48.0, "events": ((30.0, 40.0),)},
        f"to flag ≤ 2, {BACK.replace('learnt', 'learnt late')}",
    ),
    "spikes": ({"against": "steady"}, "σ ratio ≤ 1.2, f_n rms ≤ 1.5, f_n covered ≥ 90"),
    "only_theta": ({}, "running ≥ 99, f_n rms ≤ 3, f_n covered ≥ 85"),
    "only_rate": ({}, "running ≥ 99, f_n rms ≤ 3, f_n covered ≥ 85"),
    "hands_off": (HANDS_OFF, "to HANDS_OFF ≤ 1, settled ≤ 2"),
    "hands_off_base_only": (HANDS_OFF | {"torque": ()}, "to HANDS_OFF ≤ 1, settled ≤ 2"),
    **{
        name: (
            {"duration": 40.0, **another(*gap), "events": (gap,), "start": gap[1]},
            "settled median ≤ 2, f_n covered ≥ 90",
        )
        for name, gap in (("next_pilot_0.3s", (25.0, 25.3)), ("next_pilot_2s", (25.0, 27.0)))
    },
    "base_gain_up": ({"z_ddot_gain": 1.05}, COVERED + FLAGGED),
    "base_gain_down": ({"z_ddot_gain": 0.95}, COVERED + FLAGGED),
    "base_late_1ms": ({"z_ddot_delay": 1e-3}, COVERED + FLAGGED),
    "base_late_5ms": ({"z_ddot_delay": 5e-3}, COVERED + FLAGGED),
    "torque_gain_up": ({"tau_m_gain": 1.1}, COVERED + FLAGGED),
    "torque_gain_down": ({"tau_m_gain": 0.9}, COVERED + FLAGGED),
    "angle_gain": ({"angle_gain": 1.02}, COVERED + FLAGGED),
    "friction_0.1": ({"friction": 0.1}, COVERED + FLAGGED),
    "friction_0.3": ({"friction": 0.3}, COVERED + FLAGGED),
    "calibration_told": (
        {"friction": 0.2, "z_ddot_gain": 1.05, "z_ddot_delay": 3e-3, "tau_m_gain": 0.9},
        "f_n rms ≤ 2, " + COVERED,
    ),
    "calibration_drawn": (DRAWN, COVERED),
    "calibration_drawn_base_only": (DRAWN | {"torque": ()}, COVERED),
    "locked": ({"friction": 5.0, "start": 2.0}, "unflagged ≤ 3, flagged ≤ 2"),
    "freed": (
        {"friction": Steps(30.0, (30.0,), (0.0,)), "start": 2.0, "events": ((0.0, 30.0),)},
        "unflagged ≤ 3, settled median ≤ 2",
    ),
    **{
        f"friction_{torque:g}": ({"friction": torque, "trim": wander(3.0), "start": 2.0}, "")
        for torque in (5.0, 15.0, 30.0)
    },
    "grip_none": (FORCE, ""),
    "grip_force": (FORCED | {"grip_gain": 1.0}, "σ(k_p) ratio ≤ 0.5, k_p covered ≥ 90"),
    "grip_gain_wrong": (FORCED | {"grip_gain": 1.5}, "k_p ratio ≤ 1"),
    "two_dof": ({"pilot": "two_dof"}, FEEDTHROUGH + "; or mismatch ≥ 90"),
    "mayo_ectomorphic": ({"pilot": "mayo_ectomorphic", "torque": ()}, FEEDTHROUGH + "; or mismatch ≥ 90"),
    "mayo_mesomorphic": ({"pilot": "mayo_mesomorphic", "torque": ()}, FEEDTHROUGH + "; or mismatch ≥ 90"),
    "two_dof_seat": ({"pilot": "two_dof"}, FEEDTHROUGH + "; or mismatch ≥ 90"),
    **{f"{name}_hand": (HAND | {"pilot": name}, FEEDTHROUGH) for name in ("mayo_ectomorphic", "mayo_mesomorphic")},
    "mayo_random_hand": (HAND | {"pilot": "mayo_random"}, FEEDTHROUGH),
    "hysteretic": ({"pilot": "hysteretic"}, ""),
    "reflex": ({"pilot": "reflex"}, ""),
}
SEEN = "silent worst ≤ 1, silent share ≤ 1"
JUMP = {"events": ((30.0, 30.0),), "start": 30.0, "followed": 30.0}
LONG = {"duration": 140.0, "runs": 2}
SLIPS = f"flagged ≥ 90, learnt late ≤ 1, {SEEN}"
SILENT = {"start": 30.0, "events": ((30.0, 40.0),)}
MOVED: dict[str, dict[str, Any]] = {
    "sway": {"trim": sway(5.0, 0.3)},
    "moves": {"trim": Moves(0.0, math.radians(5.0), 4.0, 1.0)},
}
ROTOR = {"base": (BROAD, Sine(rms=0.980665 / math.sqrt(2.0), frequency=17.0)), "z_ddot_delay": 4e-3}
RULES_REQUIRED: dict[str, tuple[dict[str, Any], str]] = {
    "jump_k_1.4": (
        JUMP | {"k_p": jump(1.4)},
        "settled median ≤ 0.5, settled p90 ≤ 1, settled worst ≤ 2.5, silent worst ≤ 1",
    ),
    "jump_ck_1.3_base_only": (
        JUMP | {"c_p": jump(1.3), "k_p": jump(1.3), "torque": ()},
        "settled median ≤ 0.7, settled p90 ≤ 1.8, settled worst ≤ 8, silent worst ≤ 1",
    ),
    "jump_k_0.6": (
        JUMP | {"k_p": jump(0.6)},
        "settled median ≤ 0.8, settled p90 ≤ 1.8, settled worst ≤ 4, silent worst ≤ 1",
    ),
    "rough_begins": (
        LONG | {"gusts": Steps(1.0, (20.0, 40.0, 60.0, 80.0, 100.0, 120.0), (10.0, 1.0, 10.0, 1.0, 10.0, 1.0))},
        "changes ≤ 10, f_n rms ≤ 4, silent share ≤ 1, CALIBRATION share ≤ 5",
    ),
    "rough_throughout": (LONG | {"process_noise": 0.5}, "CALIBRATION share ≤ 5"),
    "retrims": (LONG | {"trim": Moves(0.0, math.radians(3.0), 8.0, 1.0)}, "changes ≤ 90, f_n rms ≤ 1.45"),
    "steady_long": (LONG, "changes ≤ 5.5, f_n rms ≤ 0.86"),
    **{
        f"stick_slip_{torque:g}": ({"friction": torque, "start": 2.0, "events": ((2.0, 60.0),)}, SLIPS)
        for torque in (1.0, 1.5, 2.0)
    },
    "stick_slip_begins": ({"friction": Steps(0.0, (30.0,), (1.5,)), "start": 30.0, "events": ((30.0, 60.0),)}, SLIPS),
    "slow_blocks": ({"duration": 140.0}, "MISMATCH share ≤ 2, f_n rms ≤ 1, f_n covered ≥ 90, flagged ≤ 2"),
    **{f"slow_blocks_{name}_stuck": (SILENT | {"end": 48.0}, "to flag ≤ 0.5") for name in ("theta", "z_ddot")},
    "torque_unknown": (
        {"lever_lost": 0.5},
        "m_p covered ≥ 90, c_p covered ≥ 90, k_p covered ≥ 90, silent share ≤ 1",
    ),
    **{
        f"{name}_{lost}": (motion | {"torque": ()}, SEEN)
        for name, motion in MOVED.items()
        for lost in ("lever_lost", "lever_10ms", "lever_100ms", "sample_100ms")
    },
    "large_sine": ({"base": (BROAD, Sine(rms=0.35 * 9.80665, frequency=3.5))}, "f_n covered ≥ 88, silent share ≤ 1"),
    "large_broadband": ({"base": (replace(BROAD, rms=0.5 * 9.80665),)}, "f_n covered ≥ 88, silent share ≤ 1"),
    **{f"delay_told_{rate}hz": (ROTOR, "CALIBRATION share ≤ 5, f_n rms ≤ 2, f_n covered ≥ 90") for rate in (1000, 500)},
    **dict.fromkeys(("torque_gain_0.7", "base_late_10ms", "clock_1.1"), (SILENT, "silent worst ≤ 1")),
}
TOLD = {
    "rough_told": {"theta_dot_process_noise": 0.5},
    "calibration_told": {"z_ddot_gain": 1.05, "z_ddot_delay": 3e-3, "tau_m_gain": 0.9, "lever_friction": 0.2},
    "two_dof_seat": {"seat_frequency": 4.5},
    **{name: {"learn_period": 0.1} for name in ("slow_blocks", "slow_blocks_theta_stuck", "slow_blocks_z_ddot_stuck")},
    **{f"delay_told_{rate}hz": {"z_ddot_delay": 4e-3, "sample_period": 1.0 / rate} for rate in (1000, 500)},
}
"""Settings that are not the firmware's own, but for standard deviations."""


def different(of: Motion | Sensors | Condition, plain: Motion | Sensors | Condition) -> dict[str, Any]:
    """Return what is not as usual, but for what is made of others, or words."""
    names = {field.name for field in fields(of)} - {
        "name", "title", "motion", "sensors", "limits", "unless", "settings", "also", "quick", "closed_loop", "faults",
    }  # fmt: skip
    return {name: getattr(of, name) for name in names if getattr(of, name) != getattr(plain, name)}


def test_all_that_is_required_is_in_the_tables() -> None:
    assert CONDITIONS.keys() == REQUIRED.keys()
    assert RULES.keys() == RULES_REQUIRED.keys()


@pytest.mark.parametrize("name", [*REQUIRED, *RULES_REQUIRED])
def test_a_condition_is_as_required(name: str) -> None:
    condition, (changes, must) = ALL[name], (REQUIRED | RULES_REQUIRED)[name]
    usual = Motion(duration=60.0, base=(BROAD,), torque=(DITHER,), process_noise=0.05)
    found = different(condition.motion, usual) | different(condition.sensors, Sensors())
    assert found | different(condition, Condition("", "", start=20.0)) == changes
    limits, unless = (
        ", ".join(f"{limit.figure} {limit}" for limit in of) for of in (condition.limits, condition.unless)
    )
    assert limits + (f"; or {unless}" if unless else "") == must
    assert set(condition.figures) <= set(FIGURES)
    assert condition.against is None or ALL[condition.against].motion == condition.motion
    stated = {
        key: value for key, value in condition.settings.items() if not key.endswith(("_sigma", "grip_force_noise"))
    }
    assert stated == TOLD.get(name, {})
    for key, value in different(condition.sensors, Sensors()).items():
        if key.endswith("_sigma"):
            assert condition.settings[key.replace("grip_gain", "grip_force_gain")] == value


def test_faults_are_as_required() -> None:
    faults = {name: condition.sensors.faults for name, condition in ALL.items() if condition.sensors.faults}
    failing = {"start": 30.0, "end": 40.0}
    outages = CONDITIONS["base_invalid"].events
    assert faults.pop("base_invalid") == tuple(
        ("z_ddot", Reads(value=INVALID, start=first, end=last)) for first, last in outages
    )
    assert faults.pop("only_theta") == (("theta_dot", Reads(value=INVALID)),)
    assert faults.pop("only_rate") == (("theta", Reads(value=INVALID)),)
    assert faults == {
        name: (fault,)
        for name, fault in {
            "base_stuck": ("z_ddot", Stuck(**failing)),
            "base_zero": ("z_ddot", Reads(value=0.0, **failing)),
            "base_sign": ("z_ddot", Scale(factor=-1.0, **failing)),
            "theta_stuck": ("theta", Stuck(**failing)),
            "theta_dot_stuck": ("theta_dot", Stuck(**failing)),
            "spikes": ("theta", Spikes(share=0.01, size=0.3)),
            "slow_blocks_theta_stuck": ("theta", Stuck(**failing)),
            "slow_blocks_z_ddot_stuck": ("z_ddot", Stuck(**failing)),
            "torque_gain_0.7": ("tau_m", Scale(factor=0.7, **failing)),
            "base_late_10ms": ("z_ddot", Late(delay=0.01, **failing)),
            "clock_1.1": ("clock_rate", Scale(factor=1.1, **failing)),
        }.items()
    }
    loops = {name: condition.closed_loop for name, condition in ALL.items() if condition.closed_loop}
    lost = {
        "lever_lost": (0.3, 0.5, 1e-3, False),
        "lever_10ms": (0.3, 0.2, 0.01, False),
        "lever_100ms": (0.3, 0.2, 0.1, False),
        "sample_100ms": (0.3, 0.2, 0.1, True),
    }
    assert {name: (of.dither, of.lost, of.lost_for, of.whole) for name, of in loops.items()} == {
        "lever_lost": (0.3, 0.5, 1e-3, False),
        "sample_lost": (0.3, 0.5, 1e-3, True),
        **{f"{motion}_{name}": of for motion in MOVED for name, of in lost.items()},
    }


@pytest.mark.parametrize(
    ("limit", "kept", "broken"), [(Limit("lag", most=1.5), 1.5, 1.6), (Limit("f_n covered", least=90.0), 90.0, 89.0)]
)
def test_limits(limit: Limit, kept: float, broken: float) -> None:
    assert limit.holds(kept)
    assert not limit.holds(broken)
    assert not limit.holds(math.nan)
