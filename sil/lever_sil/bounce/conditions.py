"""What the firmware must show in flight, with each of several aircraft and many pilots."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Any

from ..acceptance.result import Limit
from . import measure, pilots
from .flights import AIRCRAFT, FIVE, Plan
from .measure import FAULT, Measured


@dataclass(frozen=True)
class Condition:
    """A row of the table."""

    name: str
    title: str
    measure: Callable[[str, int], Measured]
    """Of an aircraft and the seed of a pilot."""
    limits: tuple[Limit, ...] = ()
    """All must hold; without any the row is reported only."""
    also: tuple[str, ...] = ()
    """Further figures, reported without a limit."""
    unless: tuple[Limit, ...] = ()
    quick: bool = False
    aircraft: tuple[str, ...] = AIRCRAFT
    in_turn: bool = False
    """Each pilot flies one of the aircraft, in turn, instead of all of them."""

    @property
    def figures(self) -> list[str]:
        """All that are reported."""
        return list(dict.fromkeys((*(limit.figure for limit in self.limits), *self.also)))


def _most(figure: str, value: float, over: str = "all") -> Limit:
    return Limit(figure, most=value, over=over)


def _least(figure: str, value: float, over: str = "all") -> Limit:
    return Limit(figure, least=value, over=over)


_COVERED = _least("margin covered", 90.0)

_ALARMS = (
    Condition(
        "alarm",
        "c_p from 42 to 18 N s/m in 30 s, gearing 1.1 × critical in the end: alarm before the vibration doubles",
        measure.relaxing,
        (_least("alarm lead", 2.0, "worst"), _least("alarm lead", 4.0, "median")),
        ("margin at the alarm",),
        quick=True,
    ),
    Condition(
        "baselines",
        "c_p from 42 to 18 N s/m in 30 s: alarm before those of two detectors without a model",
        measure.relaxing,
        (_least("ahead of ROVER", 2.0, "worst"), _least("ahead of spectrum", 2.0, "worst")),
        ("ROVER lead", "spectrum lead"),
    ),
    Condition(
        "margin",
        "c_p from 42 to 18 N s/m in 30 s: the gain margin",
        measure.relaxing,
        (_COVERED, _most("margin rms", 1.0)),
        ("margin stated",),
        quick=True,
    ),
    Condition(
        "false_alarms",
        "600 s each of pilots who drift, grip or move, gain margin 6 dB or more",
        partial(measure.stable, duration=600.0),
        (_most("false alarms", 0.0), _COVERED),
        (
            "flight time",
            "ROVER level",
            "spectrum level",
            "ROVER false alarms",
            "spectrum false alarms",
            "margin stated",
        ),
    ),
    Condition(
        "false_alarms_short",
        "67 s each of pilots who drift, grip or move, gain margin 6 dB or more",
        partial(measure.stable, duration=67.0),
        (_most("false alarms", 0.0),),
        ("flight time", "ROVER false alarms", "spectrum false alarms"),
        quick=True,
    ),
    Condition(
        "false_alarms_3db",
        "67 s each of pilots who drift, grip or move, gain margin 3 dB or more",
        partial(measure.stable, duration=67.0, ratio=0.708),
        (),
        ("false alarms", "flight time", "ROVER false alarms", "spectrum false alarms"),
    ),
)

CANCELLATION, DAMPING, BOTH, NOTCH = "cancellation", "damping", "cancellation_and_damping", "notch"
LOW_PASS = 1.0
"""What is done against bounce without a model: corner of a low-pass of the lever's angle [Hz]."""
HIGH_CORNER = {"settings": {"cancellation_corner": 1.0}}
MITIGATIONS = (CANCELLATION, DAMPING, BOTH, NOTCH, "notch_and_damping")


def _limit(mitigation: str, title: str, *limits: Limit, suffix: str = "", **changes: Any) -> Condition:
    return Condition(
        f"limit_{mitigation}{suffix}",
        f"largest gearing with {title}",
        partial(measure.largest_gearing, mitigation=mitigation, **changes),
        limits,
        () if limits else ("gearing ÷ critical",),
        quick=mitigation == CANCELLATION and bool(limits),
    )


_LIMITS = (
    _limit("none", "no mitigation"),
    _limit(CANCELLATION, "cancellation", _least("gearing ÷ critical", 4.5, "worst")),
    _limit(BOTH, "cancellation and lever damping", _least("gearing ÷ critical", 6.0, "worst")),
    _limit(DAMPING, "lever damping"),
    _limit(NOTCH, "the notch"),
    _limit("notch_and_damping", "notch and lever damping"),
    _limit("none", "no mitigation, but a low-pass of the lever's angle at 1 Hz", suffix="_low_pass", low_pass=LOW_PASS),
    _limit(CANCELLATION, "cancellation, its corner at 1 Hz", suffix="_1hz", more=HIGH_CORNER),
    _limit(BOTH, "cancellation and lever damping, corner at 1 Hz", suffix="_1hz", more=HIGH_CORNER),
    _limit(CANCELLATION, "cancellation, gusts of 0.1 g", suffix="_0.1g", gust=0.1),
    _limit(BOTH, "cancellation and lever damping, gusts of 0.1 g", suffix="_0.1g", gust=0.1),
    _limit(CANCELLATION, "cancellation that comes 5 ms later", suffix="_5ms", correction_delay=5e-3),
    _limit(CANCELLATION, "cancellation that comes 10 ms later", suffix="_10ms", correction_delay=10e-3),
    _limit(
        CANCELLATION,
        "cancellation that comes 10 ms later, as the firmware knows",
        suffix="_10ms_told",
        correction_delay=10e-3,
        told_delay=11e-3,
    ),
)


def _cancelled(mitigation: str, *limits: Limit, title: str = "", suffix: str = "", **changes: Any) -> Condition:
    return Condition(
        f"involuntary_{mitigation}{suffix}",
        f"involuntary part at twice the critical gearing, {title or mitigation.replace('_', ' ')}",
        partial(measure.cancelled, mitigation=mitigation, **changes),
        limits,
        ("involuntary cancelled", "back after a grip"),
        quick=bool(limits) and mitigation == CANCELLATION,
    )


_AWAY = (
    _least("involuntary cancelled", 90.0, "median"),
    _least("involuntary cancelled", 80.0, "worst"),
    _most("back after a grip", 2.0, "worst"),
)


def _voluntary(
    mitigation: str, *limits: Limit, in_flight: bool = False, title: str = "", suffix: str = "", **changes: Any
) -> Condition:
    where = "in the loop, gain margin 6 dB" if in_flight else "a cabin that only gusts shake"
    return Condition(
        f"voluntary_{mitigation}{suffix}{'_in_flight' if in_flight else ''}",
        f"the pilot's input at 0.5 Hz, {where}, {title or mitigation.replace('_', ' ')}",
        partial(measure.voluntary, mitigation=mitigation, ratio=measure.STABLE if in_flight else 0.0, **changes),
        limits,
        ("gain changed", "phase changed"),
        quick=bool(limits),
    )


_UNTOUCHED = (_most("gain changed", 1.0, "worst"), _most("phase changed", 2.0, "worst"))


def _more(**tables: Any) -> Callable[[Plan], Plan]:
    """With further tables of a scenario."""
    return lambda plan: replace(plan, more={**plan.more, **tables})


def _stuck_with(name: str, factor: float) -> Callable[[Plan], Plan]:
    """Let the firmware take a parameter for so many times what it is, and learn nothing.

    It takes the others for what they are.
    """

    def spoil(plan: Plan) -> Plan:
        arm = pilots.arm(plan.seed, pilots.SLACK)
        settings = {each: arm[each] * (factor if each == name else 1.0) for each in ("m_p", "c_p", "k_p")}
        settings |= dict.fromkeys(("m_p_sigma", "c_p_sigma", "k_p_sigma"), 1e-3)
        settings |= dict.fromkeys(("m_p_walk", "c_p_walk", "k_p_walk"), 0.0)
        return _more(settings=settings, estimator={"adaptation": "fixed"})(plan)

    return spoil


def _held_by(pilot: Mapping[str, Any]) -> Callable[[Plan], Plan]:
    """By one whose arm is another."""
    return lambda plan: replace(plan, pilot={**pilot, "trim": plan.pilot["trim"]}, dither=_dither_of(pilot, plan))


def _dither_of(pilot: Mapping[str, Any], plan: Plan) -> float:
    return 0.0 if pilot["model"] == "hand" else plan.dither


def _wrong(name: str, title: str, spoil: Callable[[Plan], Plan], quick: bool = False) -> Condition:
    return Condition(
        f"wrong_{name}",
        f"{title}, gearing 0.7 × critical",
        partial(measure.wrong, mitigations=MITIGATIONS, spoil=spoil),
        (_most("destabilised", 0.0),),
        ("vibration ÷ passive", "angle ÷ passive"),
        quick=quick,
    )


def _left(name: str, title: str, spoil: Callable[[Plan], Plan]) -> Condition:
    return Condition(
        f"limit_{name}",
        f"largest gearing with cancellation, {title}",
        partial(measure.largest_gearing, mitigation=CANCELLATION, spoil=spoil),
        also=("gearing ÷ critical",),
    )


_TRUNK = {"model": "two_dof", "m_p": "3.2 kg", "c_p": "30 N s/m", "k_p": "2100 N/m"}
SPOILT: tuple[tuple[str, str, Callable[[Plan], Plan]], ...] = (
    *(
        (f"{name}_{word}", f"{name} {sign} 30 %, and held there", _stuck_with(name, factor))
        for name in ("m_p", "c_p", "k_p")
        for word, sign, factor in (("high", "+", 1.3), ("low", "−", 0.7))
    ),
    ("mayo_ectomorphic", "Mayo's ectomorphic pilot", _held_by({"model": "hand", "somatotype": "ectomorphic"})),
    ("mayo_mesomorphic", "Mayo's mesomorphic pilot", _held_by({"model": "hand", "somatotype": "mesomorphic"})),
    ("two_dof", "arm on a trunk on a seat", _held_by(_TRUNK)),
    ("base_late", "accelerometer 5 ms late", _more(sensors={"z_ddot": {"noise": "0.01 m/s^2", "delay": "5 ms"}})),
    ("friction", "Coulomb friction of 0.3 N m", _more(lever={"lever_friction": "0.3 N m"})),
)
_WRONG = (
    *(_wrong(name, title, spoil, quick=name == "k_p_low") for name, title, spoil in SPOILT),
    *(_left(name, title, spoil) for name, title, spoil in SPOILT),
)


def _fault(name: str, title: str, spoil: Callable[[Plan], Plan], quick: bool = False) -> Condition:
    return Condition(
        f"fault_{name}",
        f"{title} in mid-mitigation, twice the critical gearing",
        partial(measure.faulty, mitigation=BOTH, spoil=spoil),
        (_most("to zero", 0.1, "worst"), _most("jump", 0.2, "worst")),
        quick=quick,
    )


def _sensor(what: str, noise: str, **fault: str) -> Callable[[Plan], Plan]:
    return _more(sensors={what: {"noise": noise, "fault": [{**fault, "start": f"{FAULT} s"}]}})


def _dropped(*what: str) -> Callable[[Plan], Plan]:
    gone = [{"what": each, "share": "100 %", "start": f"{FAULT} s"} for each in what]
    return _more(sensors={"dropout": gone})


_FAULTS = (
    _fault("base_invalid", "z̈ marked invalid", _dropped("z_ddot"), quick=True),
    _fault("lever_invalid", "θ and θ̇ marked invalid", _dropped("theta", "theta_dot")),
    _fault("lever_lost", "LEVER_SAMPLE lost", _dropped("lever_frame")),
    _fault("sample_lost", "samples never come", _dropped("lever_frame", "base_frame"), quick=True),
    _fault("clock", "the sample clock stands", lambda plan: replace(plan, clock_stops=FAULT), quick=True),
    _fault("base_stuck", "z̈ stuck but “valid”", _sensor("z_ddot", "0.01 m/s^2", kind="stuck"), quick=True),
    _fault("base_zero", "z̈ zero but “valid”", _sensor("z_ddot", "0.01 m/s^2", kind="scale", factor="0 %")),
    _fault("theta_stuck", "θ stuck but “valid”", _sensor("theta", "1 mrad", kind="stuck")),
)

_WRONG_SIGN = Condition(
    "fault_base_sign",
    "z̈ of the wrong sign in mid-mitigation, twice the critical gearing: how long the correction adds to the motion",
    partial(
        measure.harmful,
        mitigation=CANCELLATION,
        spoil=_sensor("z_ddot", "0.01 m/s^2", kind="scale", factor="-100 %"),
    ),
    (_most("adds for", 0.5, "worst"),),
    ("jump",),
)

# --- between accelerometer and pilot ---------------------------------------------------------------------------------

AT_4_5, AT_6, AT_5_5 = (
    {"mode": [{"frequency": f"{frequency} Hz", "damping": "3 %", "rotor": f"{rotor} 1", "seat": "1 1"}]}
    for frequency, rotor in ((4.5, 0.1), (6.0, 0.3), (5.5, 0.1))
)
UNTOLD = {"seat_transfer_known": "no"}
SLOW_ACTUATOR = {"actuator_rate": "30 deg/s"}


def _airframe(**keys: Any) -> Callable[[Plan], Plan]:
    return lambda plan: replace(plan, airframe={**plan.airframe, **keys})


def _late(milliseconds: float, told: bool = False) -> Callable[[Plan], Plan]:
    """Return the correction; at most 20 ms can be told."""

    def spoil(plan: Plan) -> Plan:
        seconds = 1e-3 * milliseconds
        told_delay = min(seconds + 1e-3, 20e-3) if told else plan.told_delay
        return replace(plan, correction_delay=seconds, told_delay=told_delay)

    return spoil


def _base_late(milliseconds: float) -> Callable[[Plan], Plan]:
    return _more(sensors={"z_ddot": {"noise": "0.01 m/s^2", "delay": f"{milliseconds} ms"}})


def _softening(plan: Plan) -> Plan:
    """Have the grip lose 40 % of its stiffness at 45 s."""
    k_p = pilots.arm(plan.seed, pilots.SLACK)["k_p"]
    ramp = {"kind": "ramp", "first": f"{k_p} N/m", "last": f"{0.6 * k_p} N/m", "start": "45 s", "duration": "0.05 s"}
    return replace(plan, pilot={**plan.pilot, "k_p": ramp})


def _all_of(*spoils: Callable[[Plan], Plan]) -> Callable[[Plan], Plan]:
    return lambda plan: reduce(lambda spoilt, spoil: spoil(spoilt), spoils, plan)


_REFLEX = {
    "model": "reflex",
    "m_p": "2.5 kg",
    "c_p": "30 N s/m",
    "k_p": "1500 N/m",
    "k_r": "300 N/m",
    "c_r": "10 N s/m",
    "delay": "35 ms",
}
_TOGETHER = (_airframe(**AT_4_5, **UNTOLD, **SLOW_ACTUATOR), _late(10.0), _base_late(10.0))
FLOOR = (_least("gearing ÷ critical", 2.0, "median"), _least("gearing ÷ critical", 1.0, "worst"))
TOLD = (_least("gearing ÷ critical", 4.0, "median"), _least("gearing ÷ critical", 2.5, "worst"))
BETWEEN: tuple[tuple[str, str, Callable[[Plan], Plan], tuple[str, ...], tuple[Limit, ...]], ...] = (
    ("rigid", "rigid cabin", _all_of(), ("none", NOTCH, CANCELLATION), FLOOR),
    ("late_10", "correction 10 ms late, not told", _late(10.0), (CANCELLATION,), FLOOR),
    ("late_20", "correction 20 ms late, not told", _late(20.0), (CANCELLATION,), FLOOR),
    ("late_20_told", "correction 19 ms late, told", _late(19.0, told=True), (CANCELLATION,), FLOOR),
    ("base_late_10", "z̈ 10 ms late", _base_late(10.0), (CANCELLATION,), FLOOR),
    ("base_late_20", "z̈ 20 ms late", _base_late(20.0), (CANCELLATION,), FLOOR),
    ("softer", "grip k_p × 0.6 at 45 s", _softening, (CANCELLATION,), FLOOR),
    ("friction", "friction of 1.5 N m", _more(lever={"lever_friction": "1.5 N m"}), (CANCELLATION,), FLOOR),
    ("trunk", "trunk on a seat", _held_by(_TRUNK), ("none", NOTCH, CANCELLATION), FLOOR),
    (
        "mode_4_5",
        "mode at 4.5 Hz, +0.1 at the seat, accelerometer at the centre of mass",
        _airframe(**AT_4_5, **UNTOLD),
        ("none", NOTCH, CANCELLATION),
        FLOOR,
    ),
    (
        "mode_6",
        "mode at 6 Hz, +0.3 at the seat, accelerometer at the centre of mass",
        _airframe(**AT_6, **UNTOLD),
        ("none", NOTCH, CANCELLATION),
        FLOOR,
    ),
    (
        "mode_4_5_told",
        "the same mode at 4.5 Hz, seat transfer told within 10 %",
        _airframe(**AT_4_5),
        (CANCELLATION,),
        TOLD,
    ),
    ("mode_6_told", "the same mode at 6 Hz, seat transfer told within 10 %", _airframe(**AT_6), (CANCELLATION,), TOLD),
    (
        "mode_6_seat",
        "the same mode at 6 Hz, accelerometer at the seat",
        _airframe(**AT_6, accelerometer="seat"),
        (CANCELLATION,),
        TOLD,
    ),
    (
        "together_trunk",
        "trunk, mode at 4.5 Hz, both delays of 10 ms, actuator of 30°/s",
        _all_of(_held_by(_TRUNK), *_TOGETHER),
        ("none", NOTCH, CANCELLATION),
        FLOOR,
    ),
    (
        "together_reflex",
        "stretch reflex, mode at 4.5 Hz, both delays of 10 ms, actuator of 30°/s",
        _all_of(_held_by(_REFLEX), *_TOGETHER),
        ("none", NOTCH, CANCELLATION),
        FLOOR,
    ),
)
_BETWEEN = tuple(
    Condition(
        f"between_{name}_{mitigation}",
        f"largest gearing, {title}, {mitigation}",
        partial(measure.largest_gearing, mitigation=mitigation, spoil=spoil),
        limits if mitigation == CANCELLATION else (),
        also=("gearing ÷ critical",),
        quick=name == "mode_6" and mitigation == CANCELLATION,
        aircraft=FIVE,
        in_turn=True,
    )
    for name, title, spoil, mitigations, limits in BETWEEN
    for mitigation in mitigations
)

# --- a table of the aircraft that is wrong ---------------------------------------------------------------------------


def _table(gain: float, sigma: float) -> Callable[[Plan], Plan]:
    return lambda plan: replace(plan, table_gain=gain, table_sigma=sigma)


_IN_TIME = (_most("missed", 0.0),)
STATED: tuple[tuple[str, str, Callable[[Plan], Plan], tuple[Limit, ...]], ...] = (
    ("right_5", "table right, ±5 % stated", _table(1.0, 0.05), _IN_TIME),
    ("low_20_told_5", "table 20 % too low, ±5 % stated", _table(0.8, 0.05), ()),
    ("low_20_told_20", "table 20 % too low, ±20 % stated", _table(0.8, 0.2), _IN_TIME),
    ("low_40_told_40", "table 40 % too low, ±40 % stated", _table(0.6, 0.4), _IN_TIME),
    ("mode_5_5", "mode at 5.5 Hz, accelerometer at the centre of mass, not told", _airframe(**AT_5_5, **UNTOLD), ()),
    ("mode_5_5_told", "the same, seat transfer told within 10 %", _airframe(**AT_5_5), _IN_TIME),
)
FALSE: tuple[tuple[str, str, Callable[[Plan], Plan], tuple[Limit, ...]], ...] = (
    ("right_10", "table right, ±10 % stated", _table(1.0, 0.1), (_most("false alarms", 1.0),)),
    ("high_10_told_10", "table 10 % too high, ±10 % stated", _table(1.1, 0.1), (_most("false alarms", 1.0),)),
    ("high_25_told_25", "table 25 % too high, ±25 % stated", _table(1.25, 0.25), ()),
)
_STATED = (
    *(
        Condition(
            f"alarm_{name}",
            f"a pilot relaxes, {title}",
            partial(measure.relaxing, spoil=spoil),
            limits,
            ("alarm lead", "missed"),
        )
        for name, title, spoil, limits in STATED
    ),
    Condition(
        "alarm_sudden",
        "a pilot relaxes within 0.2 s",
        partial(measure.relaxing, spoil=lambda plan: replace(plan, pilot=pilots.relaxing(plan.seed, 25.0, 0.2))),
        (),
        ("alarm lead", "missed"),
    ),
    *(
        Condition(
            f"false_alarms_{name}",
            f"600 s each of pilots who drift, grip or move, gain margin 6 dB or more, {title}",
            partial(measure.stable, duration=600.0, spoil=spoil),
            limits,
            ("false alarms", "flight time"),
        )
        for name, title, spoil, limits in FALSE
    ),
)

_LOW_PASSED: dict[str, Any] = {"title": "a low-pass at 1 Hz", "suffix": "_low_pass", "low_pass": LOW_PASS}
_AT_1_HZ: dict[str, Any] = {"title": "cancellation, its corner at 1 Hz", "suffix": "_1hz", "more": HIGH_CORNER}

CONDITIONS = {
    row.name: row
    for row in (
        *_BETWEEN,
        *_ALARMS,
        *_STATED,
        *_LIMITS,
        _cancelled(CANCELLATION, *_AWAY),
        _cancelled(BOTH),
        _cancelled(NOTCH),
        _cancelled(CANCELLATION, **_AT_1_HZ),
        _voluntary(CANCELLATION, *_UNTOUCHED),
        _voluntary(DAMPING),
        _voluntary(BOTH),
        _voluntary(NOTCH),
        _voluntary(CANCELLATION, in_flight=True),
        _voluntary(BOTH, in_flight=True),
        _voluntary(NOTCH, in_flight=True),
        _voluntary("none", **_LOW_PASSED),
        _voluntary("none", in_flight=True, **_LOW_PASSED),
        _voluntary(CANCELLATION, **_AT_1_HZ),
        _voluntary(CANCELLATION, in_flight=True, **_AT_1_HZ),
        *_WRONG,
        *_FAULTS,
        _WRONG_SIGN,
    )
}
"""All by name, in the order of the table."""
