"""The conditions that a real collective meets, and what the firmware must show in each.

0.3 N m of dither, 1 m/s^2 of base motion, default settings and 60 s unless said; estimates are judged from 20 s on.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ..acceptance.result import Limit
from ..batch.firmware import ClosedLoop
from ..batch.motions import BASE, DITHER, EVENT, Excitations, Motion, noise
from ..batch.sensors import Sensors
from ..plants.excitation import GaussMarkov
from ..plants.pilots import HandsOff
from ..plants.sensors import INVALID, Fault, Reads, Scale, Spikes, Stuck
from ..plants.trajectories import Noise, Ramp, Sinusoid, Steps
from .condition import Condition

_PARAMETERS = ("m_p", "c_p", "k_p")


def most(figure: str, value: float, over: str = "all") -> Limit:
    """Return an upper limit of a figure, in the unit of the figure."""
    return Limit(figure, most=value, over=over)


def least(figure: str, value: float) -> Limit:
    """Return a lower limit of a figure over all runs, in the unit of the figure."""
    return Limit(figure, least=value)


def right(rms: float, covered: float = 90.0) -> tuple[Limit, ...]:
    """Return the limits within which the natural frequency is right [%]."""
    return most("f_n rms", rms), least("f_n covered", covered)


def _within(sigmas: float) -> tuple[Limit, ...]:
    """No error is ever larger."""
    return tuple(most(f"{name} largest", sigmas) for name in ("f_n", "zeta", "m_p"))


_FLAGGED = (least("flagged", 90.0),)
QUIET = most("flagged", 2.0)
_ALL_COVERED = tuple(least(f"{name} covered", 90.0) for name in ("f_n", "zeta", *_PARAMETERS))
_OF_PARAMETERS = tuple(f"{name} {what}" for name in _PARAMETERS for what in ("rms", "covered"))
NO_DITHER = Motion(torque=())
FAILING = {"start": EVENT, "end": EVENT + 10.0}
"""When a sensor is wrong [s]."""

_STEADY = (
    Condition("steady", "steady flight", limits=(*right(1.0), QUIET), also=_OF_PARAMETERS, quick=True),
    Condition("steady_base_only", "steady flight, no dither", NO_DITHER, (*right(2.0), QUIET), also=_OF_PARAMETERS),
)


def sway(degrees: float, frequency: float) -> Sinusoid:
    """Return how a pilot moves the lever as a sine of this amplitude and frequency [Hz], from any phase."""
    return Sinusoid(0.0, math.radians(degrees), frequency, phase=None)


def _wander(degrees: float) -> Noise:
    """Return how a pilot moves the lever at random, of this rms."""
    return Noise(mean=0.0, rms=math.radians(degrees), low=0.05, high=0.5)


def _move(degrees: float, seconds: float) -> Ramp:
    """Return how a pilot moves the lever once."""
    return Ramp(0.0, math.radians(degrees), EVENT, seconds)


def _grip(factor: float, degrees: float, seconds: float) -> Motion:
    """Return a pilot who tightens his grip, or eases it, which moves the lever."""
    arm = Ramp(1.0, factor, EVENT, seconds)
    return Motion(c_p=arm, k_p=arm, either_way=True, trim=_move(degrees, seconds))


_MOVEMENT = (
    Condition("sway_2deg_0.3hz", "the pilot moves the lever, ±2° at 0.3 Hz", Motion(trim=sway(2.0, 0.3)), right(2.0)),
    Condition(
        "sway_5deg_0.3hz",
        "the pilot moves the lever, ±5° at 0.3 Hz",
        Motion(trim=sway(5.0, 0.3)),
        right(3.0),
        quick=True,
    ),
    Condition("sway_1deg_0.5hz", "the pilot moves the lever, ±1° at 0.5 Hz", Motion(trim=sway(1.0, 0.5)), right(2.0)),
    Condition("wander_1deg", "random movement, 0.05–0.5 Hz, 1° rms", Motion(trim=_wander(1.0)), right(1.5)),
    Condition(
        "wander_1deg_base_only", "random movement, 1° rms, no dither", Motion(torque=(), trim=_wander(1.0)), right(1.5)
    ),
    Condition("wander_3deg", "random movement, 0.05–0.5 Hz, 3° rms", Motion(trim=_wander(3.0)), right(3.0)),
    Condition(
        "wander_3deg_base_only", "random movement, 3° rms, no dither", Motion(torque=(), trim=_wander(3.0)), right(3.0)
    ),
    Condition("retrim", "re-trim by 8° in 4 s", Motion(trim=_move(8.0, 4.0)), (most("f_n rms", 1.2),), quick=True),
    Condition(
        "grip_step",
        "grip step of 30 % that moves the rest angle by 1° in 50 ms",
        _grip(1.3, 1.0, 0.05),
        (most("settled", 0.9, "median"), most("settled", 2.0, "worst")),
        events=((EVENT, EVENT),),
    ),
    Condition(
        "grip_slow",
        "grip step of 50 % that moves the rest angle by 3° in 0.5 s",
        _grip(1.5, 3.0, 0.5),
        (most("settled", 2.0, "median"), least("f_n covered", 90.0)),
        events=((EVENT, EVENT + 0.5),),
        start=EVENT,
    ),
)

_ROUGH = Motion(process_noise=0.5)
_TORQUES = (
    Condition(
        "slow_torque",
        "unknown torque, 1 N m rms, 0.3 s of correlation",
        Motion(disturbance=(GaussMarkov(rms=1.0, correlation_time=0.3),)),
        right(3.0, 85.0),
        _FLAGGED,
    ),
    Condition(
        "tremor", "tremor of 0.2 N m, 3–5 Hz", Motion(disturbance=noise(0.2, 3.0, 5.0)), right(3.0, 85.0), _FLAGGED
    ),
    Condition("rough_told", "process noise 0.5, as set", _ROUGH, settings={"theta_dot_process_noise": 0.5}),
    Condition(
        "rough",
        "rough air: process noise 0.5, set 0.05",
        _ROUGH,
        (most("zeta ratio", 1.3), least("zeta covered", 85.0)),
        against="rough_told",
    ),
    Condition(
        "damping_ramp",
        "c_p falls to 43 % as a ramp of 30 s",
        Motion(c_p=Ramp(1.0, 0.43, 20.0, 30.0)),
        (least("c_p covered", 90.0), most("lag", 1.5)),
        start=22.0,
        end=50.0,
        also=("c_p rms",),
    ),
)


def _at_rest(start: float, end: float, duration: float = 60.0) -> Motion:
    """Return a motion that pauses: nothing acts on the lever from start to end [s]."""
    base, torque = ((replace(each, end=start), replace(each, start=end)) for each in (*BASE, *DITHER))
    return Motion(duration, base, torque, gusts=Steps(1.0, (start, end), (0.0, 1.0)))


_INVALID = ((25.0, 25.2), (28.0, 29.0), (33.0, 36.0), (41.0, 51.0))
_OUTAGES = (
    Condition("rest_20s", "lever and base at rest for 20 s", _at_rest(20.0, 40.0), _within(4.0), quick=True),
    Condition("rest_120s", "lever and base at rest for 120 s", _at_rest(20.0, 140.0, 160.0), _within(4.0)),
    Condition(
        "base_invalid",
        "z̈ marked invalid for 0.2, 1, 3 and 10 s",
        limits=(*_within(3.0), most("learnt at once", 0.1)),
        sensors=Sensors(
            faults=tuple(("z_ddot", Reads(value=INVALID, start=first, end=last)) for first, last in _INVALID)
        ),
        start=25.0,
        events=_INVALID,
        also=("back",),
        quick=True,
    ),
    Condition(
        "lever_lost",
        "half of the LEVER_SAMPLEs lost while the firmware dithers",
        replace(NO_DITHER, duration=40.0),
        _within(3.5),
        closed_loop=ClosedLoop(),
    ),
    Condition(
        "sample_lost",
        "half of all samples never come while the firmware dithers",
        replace(NO_DITHER, duration=40.0),
        _within(3.5),
        closed_loop=ClosedLoop(whole=True),
    ),
)


def _fault(name: str, title: str, what: str, fault: Fault, soon: float = 0.5, quick: bool = False) -> Condition:
    """Return a sensor that fails for 10 s without saying so."""
    learnt = "learnt" if soon == 0.5 else "learnt late"
    return Condition(
        name,
        title,
        limits=(most("to flag", soon), most(learnt, 0.1), most("back", 1.0)),
        sensors=Sensors(faults=((what, fault),)),
        start=fault.start,
        end=fault.end + 8.0,
        events=((fault.start, fault.end),),
        also=tuple(limit.figure for limit in _within(0.0)),
        quick=quick,
    )


def _missing(name: str, title: str, what: str) -> Condition:
    """Return a sensor that is not there."""
    sensors = Sensors(faults=((what, Reads(value=INVALID)),))
    return Condition(name, title, limits=(least("running", 99.0), *right(3.0, 85.0)), sensors=sensors)


def _hands_off(name: str, title: str, torque: Excitations) -> Condition:
    return Condition(
        name,
        title,
        Motion(torque=torque, hands_off=(HandsOff(start=25.0, end=35.0),)),
        (most("to HANDS_OFF", 1.0), most("settled", 2.0)),
        events=((25.0, 35.0),),
        start=40.0,
        also=("learnt late", "back"),
    )


def _next_pilot(name: str, title: str, seconds: float) -> Condition:
    gap = (25.0, 25.0 + seconds)
    arm = Steps(1.0, gap[1:], (2.0,))
    return Condition(
        name,
        title,
        Motion(40.0, hands_off=(HandsOff(start=gap[0], end=gap[1]),), c_p=arm, k_p=arm, either_way=True),
        (most("settled", 2.0, "median"), least("f_n covered", 90.0)),
        events=(gap,),
        start=gap[1],
    )


_FAULTS = (
    _fault("base_stuck", "z̈ stuck but “valid” for 10 s", "z_ddot", Stuck(**FAILING), quick=True),
    _fault("base_zero", "z̈ zero but “valid” for 10 s", "z_ddot", Reads(value=0.0, **FAILING)),
    _fault("base_sign", "z̈ of the wrong sign for 10 s", "z_ddot", Scale(factor=-1.0, **FAILING), 2.0),
    _fault("theta_stuck", "θ stuck for 10 s", "theta", Stuck(**FAILING), quick=True),
    _fault("theta_dot_stuck", "θ̇ stuck for 10 s", "theta_dot", Stuck(**FAILING)),
    Condition(
        "spikes",
        "1 % of the θ samples off by 0.3 rad",
        limits=(most("σ ratio", 1.2), *right(1.5)),
        sensors=Sensors(faults=(("theta", Spikes(share=0.01, size=0.3)),)),
        against="steady",
        quick=True,
    ),
    _missing("only_theta", "only θ from the start", "theta_dot"),
    replace(_missing("only_rate", "only θ̇ from the start", "theta"), quick=True),
    _hands_off("hands_off", "hands off for 10 s, then on", DITHER),
    _hands_off("hands_off_base_only", "hands off for 10 s, then on, no dither", ()),
    _next_pilot("next_pilot_0.3s", "hands off for 0.3 s, then on by a pilot twice or half as stiff", 0.3),
    _next_pilot("next_pilot_2s", "hands off for 2 s, then on by a pilot twice or half as stiff", 2.0),
)


def _off(name: str, title: str, sensors: Sensors) -> Condition:
    """Return a sensor that is off, and no setting says so."""
    return Condition(name, title, limits=_ALL_COVERED, unless=_FLAGGED, sensors=sensors)


def _rubbing(friction: float) -> Condition:
    title = f"Coulomb friction of {friction:g} N m in the lever"
    return Condition(f"friction_{friction:g}", title, Motion(friction=friction), _ALL_COVERED, _FLAGGED)


_RIGHT_OR_FLAGGED = most("unflagged", 3.0)


def _slipping(friction: float) -> Condition:
    """Return a condition in which the pilot moves a lever that friction holds in between.

    It is nothing that a model of the firmware does.
    """
    title = f"friction of {friction:g} N m, through which the pilot moves the lever, 3° rms"
    also = ("unflagged", "silent")
    return Condition(
        f"friction_{friction:g}", title, Motion(friction=friction, trim=_wander(3.0)), also=also, start=2.0
    )


_STANDING = (
    Condition(
        "locked",
        "lever held by 5 N m of friction or more from power-on",
        Motion(friction=5.0),
        (_RIGHT_OR_FLAGGED, QUIET),
        start=2.0,
    ),
    Condition(
        "freed",
        "lever held by friction from power-on, freed after 30 s",
        Motion(friction=Steps(30.0, (EVENT,), (0.0,))),
        (_RIGHT_OR_FLAGGED, most("settled", 2.0, "median")),
        start=2.0,
        events=((0.0, EVENT),),
        also=("back",),
    ),
    *(_slipping(torque) for torque in (5.0, 15.0, 30.0)),
)


def _drawn(name: str, title: str, torque: Excitations) -> Condition:
    """Return errors drawn from what the settings state."""
    gain, delay, friction = 0.02, 0.5e-3, 0.05
    return Condition(
        name,
        title,
        Motion(friction_sigma=friction, torque=torque),
        _ALL_COVERED,
        sensors=Sensors(z_ddot_gain_sigma=gain, z_ddot_delay_sigma=delay, tau_m_gain_sigma=gain),
        settings={
            "z_ddot_gain_sigma": gain,
            "z_ddot_delay_sigma": delay,
            "tau_m_gain_sigma": gain,
            "lever_friction_sigma": friction,
        },
        also=_OF_PARAMETERS,
        runs=4,
    )


_CALIBRATION = (
    _off("base_gain_up", "accelerometer gain 5 % too high", Sensors(z_ddot_gain=1.05)),
    _off("base_gain_down", "accelerometer gain 5 % too low", Sensors(z_ddot_gain=0.95)),
    _off("base_late_1ms", "accelerometer 1 ms late", Sensors(z_ddot_delay=1e-3)),
    _off("base_late_5ms", "accelerometer 5 ms late", Sensors(z_ddot_delay=5e-3)),
    _off("torque_gain_up", "torque gain 10 % too high", Sensors(tau_m_gain=1.1)),
    _off("torque_gain_down", "torque gain 10 % too low", Sensors(tau_m_gain=0.9)),
    _off("angle_gain", "angle and rate gain 2 % too high", Sensors(angle_gain=1.02)),
    _rubbing(0.1),
    _rubbing(0.3),
    Condition(
        "calibration_told",
        "gain 1.05, delay 3 ms, torque gain 0.9, friction 0.2 N m, as set",
        Motion(friction=0.2),
        (*right(2.0), *_ALL_COVERED[1:]),
        sensors=Sensors(z_ddot_gain=1.05, z_ddot_delay=3e-3, tau_m_gain=0.9),
        settings={"z_ddot_gain": 1.05, "z_ddot_delay": 3e-3, "tau_m_gain": 0.9, "lever_friction": 0.2},
    ),
    _drawn("calibration_drawn", "gains, delay and friction drawn from their stated σ", DITHER),
    _drawn("calibration_drawn_base_only", "gains, delay and friction drawn from their stated σ, no dither", ()),
)


_CALIBRATED = {"z_ddot_gain_sigma": 2e-3, "z_ddot_delay_sigma": 5e-5, "lever_friction_sigma": 5e-3}


def _gripped(
    name: str, title: str, gain: float, limits: tuple[Limit, ...], unless: tuple[Limit, ...] = ()
) -> Condition:
    """With base motion alone, a calibrated accelerometer, and a sensor of the grip force."""
    return Condition(
        name,
        title,
        replace(NO_DITHER, duration=120.0),
        limits,
        sensors=Sensors(z_ddot_gain_sigma=2e-3, grip_gain=gain, grip_gain_sigma=0.005),
        settings={**_CALIBRATED, "grip_force_noise": 0.3, "grip_force_gain_sigma": 0.005},
        start=60.0,
        also=_OF_PARAMETERS,
        against="grip_none",
    )


_GRIP_FORCE = (
    Condition(
        "grip_none",
        "no dither, accelerometer calibrated to 0.2 %, no force sensor",
        replace(NO_DITHER, duration=120.0),
        sensors=Sensors(z_ddot_gain_sigma=2e-3),
        settings=_CALIBRATED,
        start=60.0,
        also=_OF_PARAMETERS,
    ),
    _gripped(
        "grip_force",
        "the same with a sensor of the grip force, gain 0.5 %",
        1.0,
        (most("σ(k_p) ratio", 0.5), least("k_p covered", 90.0)),
    ),
    _gripped("grip_gain_wrong", "the same, its gain 50 % wrong", 1.5, (most("k_p ratio", 1.0),)),
)


def _pilot(name: str, title: str, torque: Excitations) -> Condition:
    """Return a pilot whose arm is not the lever model's."""
    limits = (most("θ/z̈ rms", 10.0), least("θ/z̈ covered", 85.0))
    return Condition(name, title, Motion(pilot=name, torque=torque), limits, (least("mismatch", 90.0),))


def _hand(name: str, title: str) -> Condition:
    """Return a hand as Mayo measured it, and the firmware's model of such hands: no flag excuses it."""
    return replace(_pilot(name, f"{title}, model hand", ()), name=f"{name}_hand", unless=(), model="hand")


def _reported(condition: Condition) -> Condition:
    """Return the same without limits."""
    return replace(condition, limits=(), unless=(), also=tuple(condition.figures))


_PILOTS = (
    _pilot("two_dof", "arm on a trunk on a seat", DITHER),
    _pilot("mayo_ectomorphic", "Mayo's ectomorphic pilot", ()),
    _pilot("mayo_mesomorphic", "Mayo's mesomorphic pilot", ()),
    replace(
        _pilot("two_dof", "arm on a trunk on a seat, whose frequency is set", DITHER),
        name="two_dof_seat",
        settings={"seat_frequency": 4.5},
    ),
    _hand("mayo_ectomorphic", "Mayo's ectomorphic pilot"),
    _hand("mayo_mesomorphic", "Mayo's mesomorphic pilot"),
    _hand("mayo_random", "hands about Mayo's two pilots"),
    _reported(_pilot("hysteretic", "arm with hysteretic damping", DITHER)),
    _reported(_pilot("reflex", "arm with a stretch reflex after 35 ms", DITHER)),
)

CONDITIONS = {
    row.name: row
    for row in (*_STEADY, *_MOVEMENT, *_TORQUES, *_OUTAGES, *_FAULTS, *_CALIBRATION, *_STANDING, *_GRIP_FORCE, *_PILOTS)
}
"""All by name, in the order of the table."""
