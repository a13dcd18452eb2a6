"""Conditions that pin the rules of the firmware's core: what it takes for a change, a fault, or rough air, and when.

As in conditions.py unless said. Rare events take long to count: runs are longer here, or more for each seed. The limits
are what is wanted of the rules; they are not all kept.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ..acceptance.result import Limit
from ..batch.firmware import ClosedLoop
from ..batch.motions import BASE, EVENT, Motion, noise
from ..batch.sensors import CLOCK, Sensors
from ..plants.excitation import Sine
from ..plants.sensors import Fault, Late, Scale, Stuck
from ..plants.trajectories import Moves, Steps
from .condition import Condition
from .conditions import FAILING, QUIET, least, most, right, sway

_G = 9.80665  # [m/s^2]
_LONG = Motion(duration=140.0)  # 40 seeds, two runs each, from 20 s on: 2.7 h
_SEEN = (most("silent", 1.0, "worst"), most("silent share", 1.0))
_SHARES = ("silent share", "silent", "CALIBRATION share", "MISMATCH share", "CHANGE share")
_OF_ARM = tuple(f"{name} {what}" for what in ("rms", "covered") for name in ("m_p", "c_p", "k_p"))


def _jump(name: str, title: str, motion: Motion, median: float, p90: float, worst: float) -> Condition:
    """Return a condition in which the arm changes at once, and the lever rests where it did.

    Limits are those of the time to 5 % of f_n [s].
    """
    settled = (most("settled", value, over) for value, over in ((median, "median"), (p90, "p90"), (worst, "worst")))
    return Condition(
        name,
        title,
        motion,
        (*settled, most("silent", 1.0, "worst")),
        start=EVENT,
        events=((EVENT, EVENT),),
        followed=motion.duration - EVENT,
        also=("silent share", "CHANGE share"),
    )


def _times(factor: float) -> Steps:
    """Return how a parameter changes at once."""
    return Steps(1.0, (EVENT,), (factor,))


_JUMPS = (
    _jump("jump_k_1.4", "k_p × 1.4 at once", Motion(k_p=_times(1.4)), 0.5, 1.0, 2.5),
    _jump(
        "jump_ck_1.3_base_only",
        "c_p and k_p × 1.3 at once, no dither",
        Motion(torque=(), c_p=_times(1.3), k_p=_times(1.3)),
        0.7,
        1.8,
        8.0,
    ),
    _jump("jump_k_0.6", "k_p × 0.6 at once", Motion(k_p=_times(0.6)), 0.8, 1.8, 4.0),
)


def _long(name: str, title: str, motion: Motion, limits: tuple[Limit, ...]) -> Condition:
    """Return some hours in which no arm changes.

    The limits of re-trims and of steady flight are what was measured on 2026-11-25 with 40 seeds, 78 and 3.4 changes an
    hour, 1.36 and 0.83 % of f_n, plus two standard errors.
    """
    return Condition(name, title, motion, limits, also=("changes", *_SHARES), runs=2)


def _retrims(degrees: float, every: float) -> Moves:
    """Return how a pilot re-trims every so often [s], by up to so much, in a second."""
    return Moves(0.0, math.radians(degrees), every, 1.0)


_SQUALLS = Steps(1.0, (20.0, 40.0, 60.0, 80.0, 100.0, 120.0), (10.0, 1.0) * 3)
_NO_CHANGE = (
    _long(
        "rough_begins",
        "rough air, process noise 0.5, 20 s on and 20 s off",
        replace(_LONG, gusts=_SQUALLS),
        (most("changes", 10.0), most("f_n rms", 4.0), most("silent share", 1.0), most("CALIBRATION share", 5.0)),
    ),
    _long(
        "rough_throughout",
        "rough air, process noise 0.5 from power-on",
        replace(_LONG, process_noise=0.5),
        (most("CALIBRATION share", 5.0),),
    ),
    _long(
        "retrims",
        "re-trim by up to 3° in 1 s, each 8 s",
        replace(_LONG, trim=_retrims(3.0, 8.0)),
        (most("changes", 90.0), most("f_n rms", 1.45)),
    ),
    _long("steady_long", "steady flight", _LONG, (most("changes", 5.5), most("f_n rms", 0.86))),
)


def _stick_slip(name: str, title: str, motion: Motion, start: float) -> Condition:
    """Return a condition in which the base moves a lever that friction holds in between: there is nothing to learn."""
    return Condition(
        name,
        title,
        motion,
        (least("flagged", 90.0), most("learnt late", 1.0), *_SEEN),
        start=start,
        events=((start, motion.duration),),
        also=("zeta rms", "EXCITATION share", *_SHARES),
    )


_FRICTION = (
    *(
        _stick_slip(f"stick_slip_{torque:g}", f"{torque:g} N m of friction from power-on", Motion(friction=torque), 2.0)
        for torque in (1.0, 1.5, 2.0)
    ),
    _stick_slip(
        "stick_slip_begins", "1.5 N m of friction from 30 s on", Motion(friction=Steps(0.0, (EVENT,), (1.5,))), EVENT
    ),
)

_SLOW = {"learn_period": 0.1}
_BLOCKS = (
    Condition(
        "slow_blocks",
        "steady flight, learn_period 0.1 s",
        _LONG,
        (most("MISMATCH share", 2.0), *right(1.0), QUIET),
        settings=_SLOW,
    ),
    *(
        Condition(
            f"slow_blocks_{what}_stuck",
            f"{word} stuck but “valid” for 10 s, learn_period 0.1 s",
            limits=(most("to flag", 0.5),),
            sensors=Sensors(faults=((what, Stuck(**FAILING)),)),
            settings=_SLOW,
            start=EVENT,
            end=EVENT + 18.0,
            events=((EVENT, EVENT + 10.0),),
        )
        for what, word in (("theta", "θ"), ("z_ddot", "z̈"))
    ),
)

_SWAY = Motion(torque=(), trim=sway(5.0, 0.3))
_RETRIM = Motion(torque=(), trim=_retrims(5.0, 4.0))
_BURSTS = {
    "lever_lost": ("half of the LEVER_SAMPLEs lost", ClosedLoop()),
    "lever_10ms": ("a fifth of the LEVER_SAMPLEs lost, 10 ms at a time", ClosedLoop(lost=0.2, lost_for=0.01)),
    "lever_100ms": ("a fifth of the LEVER_SAMPLEs lost, 0.1 s at a time", ClosedLoop(lost=0.2, lost_for=0.1)),
    "sample_100ms": ("a fifth of all samples lost, 0.1 s at a time", ClosedLoop(lost=0.2, lost_for=0.1, whole=True)),
}


def _moved(name: str, title: str, motion: Motion) -> tuple[Condition, ...]:
    """Move the lever fast while samples are lost, and the firmware dithers."""
    return tuple(
        Condition(
            f"{name}_{lost}",
            f"{title}, {words}",
            motion,
            _SEEN,
            closed_loop=loop,
            also=("changes", *_SHARES),
        )
        for lost, (words, loop) in _BURSTS.items()
    )


_LOST = (
    Condition(
        "torque_unknown",
        "half of the LEVER_SAMPLEs lost while another controller drives the motor",
        limits=(*(least(f"{name} covered", 90.0) for name in ("m_p", "c_p", "k_p")), most("silent share", 1.0)),
        sensors=Sensors(lever_lost=0.5),
        also=("silent", *_OF_ARM),
    ),
    *_moved("sway", "±5° at 0.3 Hz", _SWAY),
    *_moved("moves", "re-trim by up to 5° in 1 s, each 4 s", _RETRIM),
)


def _large(name: str, title: str, motion: Motion) -> Condition:
    """Return a condition in which the lever moves so far that a linear model is none."""
    return Condition(
        name, title, motion, (least("f_n covered", 88.0), most("silent share", 1.0)), also=("silent", *_OF_ARM)
    )


_LARGE = (
    _large("large_sine", "base 0.35 g rms at 3.5 Hz besides", Motion(base=(*BASE, Sine(rms=0.35 * _G, frequency=3.5)))),
    _large("large_broadband", "base 0.5 g rms, 1–10 Hz", Motion(base=noise(0.5 * _G))),
)


def _delay(rate: int) -> Condition:
    delay = 4e-3
    return Condition(
        f"delay_told_{rate}hz",
        f"accelerometer 4 ms late, as set, {rate} Hz, rotor vibration of 0.1 g at 17 Hz",
        Motion(base=(*BASE, Sine(rms=0.1 * _G / math.sqrt(2.0), frequency=17.0))),
        limits=(most("CALIBRATION share", 5.0), *right(2.0)),
        sensors=Sensors(z_ddot_delay=delay),
        settings={"z_ddot_delay": delay, "sample_period": 1.0 / rate},
        also=_OF_ARM,
    )


def _silent(name: str, title: str, what: str, fault: Fault) -> Condition:
    return Condition(
        name,
        title,
        limits=(most("silent", 1.0, "worst"),),
        sensors=Sensors(faults=((what, fault),)),
        start=fault.start,
        events=((fault.start, fault.end),),
        also=("to flag", "silent share"),
    )


_SENSORS = (
    _delay(1000),
    _delay(500),
    _silent("torque_gain_0.7", "torque gain 0.7 for 10 s", "tau_m", Scale(factor=0.7, **FAILING)),
    _silent("base_late_10ms", "accelerometer 10 ms late for 10 s", "z_ddot", Late(delay=0.01, **FAILING)),
    _silent("clock_1.1", "the sender's clock 10 % fast for 10 s", CLOCK, Scale(factor=1.1, **FAILING)),
)

RULES = {row.name: row for row in (*_JUMPS, *_NO_CHANGE, *_FRICTION, *_BLOCKS, *_LOST, *_LARGE, *_SENSORS)}
"""All by name, in the order of the table."""
