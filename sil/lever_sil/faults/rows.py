"""The matrix: each received message and each signal with each fault, and what the firmware must then do.

The fault lasts from 15 to 25 s of a flight of 40 s. Unless a row says otherwise the firmware estimates through it, in
mode RUN. Demands follow from firmware/REQUIREMENTS.md, or from what a user must know to do without the estimate. What
is not met is in KNOWN.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from lever_cdkf.can import codec

from ..batch.motions import PERIOD, Motion
from ..plants import sensors
from ..plants.sensors import INVALID, Offset, Reads, Scale, Spikes, Stuck
from . import bus, readings
from .bus import Interval
from .judge import Requirement
from .readings import wrong

MOTION = Motion(duration=40.0, torque=())
"""The firmware makes the dither."""
TIME = (15.0, 25.0)
"""Of the faults [s]."""
_LASTS = TIME[1] - TIME[0]
MESSAGES = (*bus.SAMPLES, "COMMAND")
FROZEN = "_frozen"
"""End of the name of a row that is flown with frozen parameters."""
FROM_POWER_ON = "_from_power_on"
"""End of the name of a row whose fault begins with the first sample."""
_SHORT = {"LEVER_SAMPLE": "lever", "BASE_SAMPLE": "base", "GRIP_SAMPLE": "grip", "COMMAND": "command"}
_SIGNAL = {"theta": "θ", "theta_dot": "θ̇", "tau_m": "τ_m", "z_ddot": "z̈", "grip_force": "grip force"}
_FLAG = {
    "theta": ("THETA",),
    "theta_dot": ("THETA_DOT",),
    "tau_m": ("TORQUE",),
    "z_ddot": ("BASE",),
    "grip_force": ("CALIBRATION",),
}
_COMMUNICATION = ("COMMUNICATION",)
_LOST: dict[str, tuple[str, ...]] = {"LEVER_SAMPLE": ("THETA",), "BASE_SAMPLE": ("GAP",), "GRIP_SAMPLE": ()}
"""What says that a message is missing; a sensor of the grip force is optional."""
_STUCK, _WRONG = 500, 2000
"""A signal that is stuck, or a base acceleration that does not fit, is flagged within so many samples: R32, R33."""
_RATE = 500
"""A sample clock at another rate than the setting: R30."""
_ALIGNED, _JUDGED = 300, 1200
"""Samples until ALIGN ends after power-on, and until the levels have settled."""
_GRIP_WRONG = 10_000
"""A grip force that is far off changes no estimate, so that it is enough to say so in time for maintenance."""
_COAST_ENDS = 0.08
"""20 ms until an output is too old, 50 ms to close, and what a port waits for samples [s]."""
_ABANDONED_ENDS = 1.06
"""A second after the last COMMAND that was accepted, and 50 ms to close [s]."""
_BLIND = Requirement(("THETA",), 2, mode=("coast",), torque_ends=_COAST_ENDS)
"""No LEVER_SAMPLE."""
_STANDS = Requirement(("CLOCK",), 2, mode=("run", "coast"), torque_ends=0.06)
"""The sample clock does not advance."""
_SILENCE = Requirement(after=("GAP",), torque_ends=_COAST_ENDS)
"""No sample at all: nothing is sent, which says it, and the next sample what happened."""
_HEADLESS = Requirement(torque_ends=_ABANDONED_ENDS)
"""No COMMAND."""
_ALONE: dict[str, Requirement] = {
    "LEVER_SAMPLE": _BLIND,
    "BASE_SAMPLE": _SILENCE,
    "GRIP_SAMPLE": Requirement(),
    "COMMAND": _HEADLESS,
}
"""When nothing of a message comes through."""


_SPIKES = {"theta": Requirement(("THETA",), 1376), "theta_dot": Requirement(("THETA_DOT",), 1376)}
"""1 % of the samples: but for one in a million there is one in so many."""


@dataclass(frozen=True)
class Row:
    """One fault."""

    name: str
    title: str
    requirement: Requirement = field(default_factory=Requirement)
    on_bus: bus.Fault = bus.nothing
    on_readings: readings.Fault = readings.nothing
    time: Interval = TIME
    grip: bool = False
    """There is a sensor of the grip force."""
    frozen: bool = False
    """The parameters are held, from before the fault on."""
    quick: bool = False


def _refused(message: str) -> Requirement:
    """Nothing of a message comes through, and it says so."""
    alone = _ALONE[message]
    if message == "BASE_SAMPLE":
        return replace(alone, after=_COMMUNICATION)  # without a sample it can only say so afterwards
    return Requirement(_COMMUNICATION, 2, mode=alone.mode, torque_ends=alone.torque_ends)


def _first(share: float) -> int:
    """Return samples in which something that happens to this share at random has happened, but for one in a million."""
    return math.ceil(math.log(1e-6) / math.log(1.0 - share))


def _damaged() -> Iterator[Row]:
    for message in MESSAGES:
        short, grip = _SHORT[message], message == "GRIP_SAMPLE"
        for byte in range(8):
            requirement = _refused(message) if message == "COMMAND" else Requirement(_COMMUNICATION, 2)
            title = f"{message}: a bit of byte {byte} flipped in every {'' if message == 'COMMAND' else 'tenth '}frame"
            quick = byte == 3 and message == "BASE_SAMPLE"
            yield Row(f"{short}_flip_{byte}", title, requirement, bus.flipped(message, byte), grip=grip, quick=quick)
        refused = _refused(message)
        yield Row(f"{short}_crc", f"{message}: every CRC wrong", refused, bus.wrong_crc(message), grip=grip)
        if message != "COMMAND":
            yield Row(
                f"{short}_masquerade", f"{message}: CRC of another message", refused, bus.masquerade(message), grip=grip
            )
        for length in (0, 7):
            title = f"{message}: {length} bytes long"
            yield Row(f"{short}_length_{length}", title, refused, bus.short(message, length), grip=grip)
        for kind, mark in (("extended", bus.EXTENDED), ("remote", bus.REMOTE), ("error", bus.ERROR)):
            title = f"{message}: {kind} frames with its identifier besides"
            requirement = Requirement(unaffected=True)
            quick = (message, kind) == ("LEVER_SAMPLE", "extended")
            yield Row(f"{short}_{kind}", title, requirement, bus.marked(message, mark), grip=grip, quick=quick)


def _counters() -> Iterator[Row]:
    for message in MESSAGES:
        short, grip = _SHORT[message], message == "GRIP_SAMPLE"
        title = f"{message}: each frame twice"
        yield Row(
            f"{short}_twice", title, Requirement(_COMMUNICATION, 2), bus.repeated(message), grip=grip,
            quick=message == "LEVER_SAMPLE",
        )  # fmt: skip
    for message in bus.SAMPLES:
        short, grip = _SHORT[message], message == "GRIP_SAMPLE"
        alone = _ALONE[message]
        frozen = _refused(message)
        if message == "BASE_SAMPLE":
            frozen = replace(frozen, mode=("run", "coast"))
        title = f"{message}: the counter stands"
        yield Row(f"{short}_counter_frozen", title, frozen, bus.counting(message, lambda i: 0 * i), grip=grip)
        title = f"{message}: the counter is two ahead of the others"
        skipped = alone if message != "BASE_SAMPLE" else _BLIND
        yield Row(f"{short}_counter_ahead", title, skipped, bus.counting(message, lambda i: i + 2), grip=grip)
    by_two = bus.counting(bus.SAMPLES, lambda i: 2 * i)
    yield Row("counters_by_two", "all samples: the counter skips every second number", Requirement(), by_two)
    back = bus.counting(bus.SAMPLES, lambda i: -i)
    yield Row("counters_backwards", "all samples: the counter runs backwards", Requirement(_COMMUNICATION, 20), back)
    hangs = Requirement(_COMMUNICATION, 2, torque_ends=_ABANDONED_ENDS)
    yield Row("command_counter_frozen", "COMMAND: the last one again and again", hangs, bus.hanging_command())
    other = bus.commands(lambda _: bus.command(0))
    once = replace(hangs, torque_ends=_ABANDONED_ENDS + 1.25)  # its first one is that of a new sender
    yield Row("command_counter_elsewhere", "COMMAND: the counter jumps and then stands", once, other)
    ahead = bus.commands(lambda i: bus.command(5 * i))
    yield Row("command_counter_skips", "COMMAND: the counter skips four of five", Requirement(), ahead)


def _missing() -> Iterator[Row]:
    for message in bus.SAMPLES:
        short, grip = _SHORT[message], message == "GRIP_SAMPLE"
        for percent in (1, 5, 10, 20, 50):
            title = f"{message}: {percent} % lost at random"
            quick = (message, percent) == ("LEVER_SAMPLE", 10)
            within = _first(percent / 100) + 3
            requirement = Requirement(_LOST[message], within, mode=("run", "coast"))
            yield Row(
                f"{short}_lost_{percent}", title, requirement, bus.lost(message, percent / 100), grip=grip, quick=quick
            )
        for length, every in ((0.05, 0.5), (0.3, 2.0), (2.0, 20.0)):
            title = f"{message}: lost for {length:g} s at a time"
            within = 1 + round(length / PERIOD) if message == "BASE_SAMPLE" else 1
            requirement = Requirement(_LOST[message], within)
            yield Row(f"{short}_burst_{length:g}s", title, requirement, bus.bursts(message, length, every), grip=grip)
    for percent in (1, 10, 50):
        name, title = f"samples_lost_{percent}", f"{percent} % of all samples lost at random"
        requirement = Requirement(("GAP",), _first(percent / 100) + 1)
        yield Row(name, title, requirement, bus.samples_lost(percent / 100))
    yield Row("silence_0.3s", "nothing arrives for 0.3 s", _SILENCE, bus.bursts(MESSAGES, 1.0, 20.0), time=(15.0, 15.3))
    silence = bus.bursts(MESSAGES, 20.0, 20.0)
    yield Row("silence_10s", "nothing arrives for 10 s", _SILENCE, silence, quick=True)
    yield Row("command_lost_50", "COMMAND: half of them lost", Requirement(), bus.lost("COMMAND", 0.5))
    yield Row("command_lost", "COMMAND: none arrives", _HEADLESS, bus.lost("COMMAND", 1.1), quick=True)


def _late() -> Iterator[Row]:
    for message in bus.SAMPLES[:2]:
        short, grip = _SHORT[message], message == "GRIP_SAMPLE"
        requirement = _BLIND if message == "LEVER_SAMPLE" else Requirement()
        yield Row(
            f"{short}_after_base", f"{message}: after its BASE_SAMPLE", requirement, bus.late(message, 0.25), grip=grip
        )
        yield Row(f"{short}_late", f"{message}: 5 samples late", requirement, bus.late(message, 5.0), grip=grip)
    for message in bus.SAMPLES:
        short, grip = _SHORT[message], message == "GRIP_SAMPLE"
        title = f"{message}: each second frame after the next"
        requirement = Requirement(_COMMUNICATION, 5, mode=("run", "coast"))
        yield Row(f"{short}_swapped", title, requirement, bus.late(message, 1.05, 2), grip=grip)
    yield Row("base_late", "BASE_SAMPLE: 5 samples late", replace(_BLIND, within=7), bus.late("BASE_SAMPLE", 5.0))
    yield Row("all_late", "all samples 20 ms late", Requirement(), bus.late(bus.SAMPLES, 20.0))
    yield Row(
        "lever_stale",
        "LEVER_SAMPLE: old content, counter goes on",
        Requirement(("THETA", "THETA_DOT"), _STUCK, mode=("run", "coast")),
        bus.stale("LEVER_SAMPLE"),
    )
    yield Row(
        "base_stale", "BASE_SAMPLE: old content and time, counter goes on",
        _STANDS, bus.stale("BASE_SAMPLE"), quick=True,
    )  # fmt: skip
    still = Requirement(_FLAG["grip_force"], _GRIP_WRONG)
    yield Row("grip_stale", "GRIP_SAMPLE: old content, counter goes on", still, bus.stale("GRIP_SAMPLE"), grip=True)


def _other_senders() -> Iterator[Row]:
    load = Requirement(unaffected=True)
    babbling = Requirement(
        (*_COMMUNICATION, "CLOCK"), 50, mode=("init", "align", "run", "coast", "frozen")
    )  # a CRC in 256 is right
    yield Row("foreign_load", "100 % bus load of other identifiers", load, bus.foreign_load(), quick=True)
    yield Row("babble_10", "100 frames/s of random data with our identifiers", babbling, bus.babble(10))
    yield Row("babble_1", "1,000 frames/s of the same", replace(babbling, within=10), bus.babble(1))
    yield Row("second_estimator", "another estimator on the bus", Requirement(("DUPLICATE",), 2), bus.duplicate())


def _commands() -> Iterator[Row]:
    right: dict[str, codec.Value] = {
        "model": "lever",
        "preload": "trim",
        "estimator": "dual",
        "adaptation": "robbins_monro",
    }
    models: list[dict[str, codec.Value]] = [
        {"model": name} for name in ("lever", "linear_physical", "linear_black_box", "hand")
    ]
    anew = Requirement(mode=("init", "align"), torque_ends=0.06)
    yield Row(
        "command_flood", "10 COMMANDs in each sample that change nothing", Requirement(unaffected=True),
        bus.flood([{}], {}, 10), quick=True,
    )  # fmt: skip
    yield Row("model_switched", "COMMAND: another model in each sample", anew, bus.flood(models, right), quick=True)
    yield Row("reset_flood", "COMMAND: a reset in each sample", anew, bus.flood([{"request": "reset"}], right))
    toggles: dict[str, tuple[list[dict[str, codec.Value]], Requirement]] = {
        "estimator_switched": ([{"estimator": "joint"}, {"estimator": "dual"}], anew),
        "preload_switched": ([{"preload": "fixed"}, {"preload": "trim"}], anew),
        "adaptation_switched": ([{"adaptation": "annealing"}, {"adaptation": "forgetting"}], Requirement()),
        "freeze_switched": ([{"request": "freeze"}, {"request": "run"}], Requirement(mode=("run", "frozen"))),
        "dither_switched": ([{"dither_rms": 0.0}, {"dither_rms": 0.3}], Requirement()),
    }
    for name, (values, requirement) in toggles.items():
        title = f"COMMAND: {name.removesuffix('_switched')} switched in each sample"
        yield Row(name, title, requirement, bus.flood(values, {"request": "run", **right}))
    most = bus.flood([{"dither_rms": 60.0}], right)
    yield Row("dither_most", "COMMAND: 60 N m of dither", Requirement(), most)
    unknown = bus.commands(bus.unknown_command, 10, True)
    yield Row(
        "command_unknown",
        "COMMAND: 100 in a second that ask for a model that is not there",
        Requirement(_COMMUNICATION, 2),
        unknown,
    )


def _readings() -> Iterator[Row]:
    for signal, word in _SIGNAL.items():
        grip = signal == "grip_force"
        own = _FLAG[signal]
        gone, still = Requirement(own, 1), Requirement(own, _STUCK)
        sign, gain = Requirement((*own, "BASE", "MISMATCH"), _WRONG), Requirement()
        if signal == "z_ddot":
            sign = Requirement(own, _WRONG)
        if signal == "tau_m":
            sign = gain = Requirement(own, _WRONG)
        if grip:
            gone, still, sign, gain = Requirement(), *[Requirement(own, _GRIP_WRONG)] * 3
        # what moves the lever may be a step or a drift of an output, and a pilot's grip what a gain of it may be; what
        # the motor does is known
        greatest, offset = readings.GREATEST[signal], readings.STEP[signal]
        spikes = Spikes(share=0.01, size=readings.SPIKE[signal])
        faults: dict[str, tuple[str, sensors.Fault, Requirement]] = {
            "invalid": ("marked invalid", Reads(value=INVALID), gone),
            "not_available": ("NaN-coded but marked valid", Reads(value=math.inf), gone),
            "saturated": ("saturated", Reads(value=greatest), still if grip else gone),
            "stuck": ("stuck", Stuck(), still),
            "zero": ("zero", Reads(value=0.0), still),
            "step": ("off by a step", Offset(size=offset), Requirement()),
            "drift": ("off by a ramp to the same", Offset(size=offset, over=_LASTS), Requirement()),
            "sign": ("of the wrong sign", Scale(factor=-1.0), sign),
            "gain_half": ("half as large", Scale(factor=0.5), gain),
            "gain_double": ("twice as large", Scale(factor=2.0), gain),
            "gain_drift": ("gain going to 1.5", Scale(factor=1.5, over=_LASTS), Requirement()),
            "spikes": ("1 % of the values far off", spikes, _SPIKES.get(signal, Requirement())),
        }
        if signal == "tau_m":
            faults["gain_0.7"] = ("0.7 of what it is", Scale(factor=0.7), Requirement(("CALIBRATION",), _WRONG))
        for name, (title, fault, requirement) in faults.items():
            quick = (signal, name) in (("theta", "stuck"), ("z_ddot", "sign"), ("tau_m", "invalid"))
            yield Row(
                f"{signal}_{name}",
                f"{word} {title}",
                requirement,
                on_readings=wrong(fault, signal),
                grip=grip,
                quick=quick,
            )
    neither = wrong(Reads(value=INVALID), "theta", "theta_dot")
    yield Row("outputs_invalid", "θ and θ̇ marked invalid", _BLIND, on_readings=neither)


def _clocks() -> Iterator[Row]:
    clock = readings.clock
    moving, stands = ("CLOCK",), _STANDS
    yield Row("clock_stands", "the sender's clock stands", stands, on_readings=clock(lambda t: 0.0 * t), quick=True)
    yield Row("clock_back", "the sender's clock runs backwards", stands, on_readings=clock(lambda t: -t))
    yield Row("clock_crawls", "the sender's clock runs at a tenth", stands, on_readings=clock(lambda t: 0.1 * t))
    rate = Requirement(("CALIBRATION",), _RATE)
    yield Row("clock_half", "the sender's clock runs at half its rate", rate, on_readings=clock(lambda t: 0.5 * t))
    yield Row("clock_0.9", "the sender's clock is 10 % slow", rate, on_readings=clock(lambda t: 0.9 * t))
    yield Row("clock_1.1", "the sender's clock is 10 % fast", rate, on_readings=clock(lambda t: 1.1 * t))
    yield Row(
        "clock_2",
        "the sender's clock is twice as fast",
        Requirement(("GAP",), 2),
        on_readings=clock(lambda t: 2.0 * t),
    )
    yield Row(
        "clock_wraps", "the sender's clock passes 2³² µs", Requirement(), on_readings=readings.clock_wraps, quick=True
    )
    jumps = {"0.1s": 0.1, "1s": 1.0, "1h": 3600.0, "back_0.1s": -0.1, "back_10s": -10.0}
    for name, seconds in jumps.items():
        flag = ("GAP",) if 0.0 < seconds < 2000.0 else moving  # half a turn of 32 bits is the past
        requirement = Requirement(flag, 1, mode=("run", "align"))
        title = f"the sender's clock jumps by {seconds:g} s"
        yield Row(
            f"clock_jumps_{name}", title, requirement, on_readings=readings.clock_offset(seconds), time=(15.0, 16.0)
        )


def _frozen(row: Row) -> Row:
    """Return the same rows while the parameters are held, which hides no fault."""
    mode = tuple(dict.fromkeys("frozen" if name in ("run", "coast") else name for name in row.requirement.mode))
    return replace(
        row,
        name=f"{row.name}{FROZEN}",
        title=f"{row.title}, parameters frozen",
        requirement=replace(row.requirement, mode=mode),
        frozen=True,
    )


def _from_power_on(row: Row) -> Row:
    """Return the same fault from the first sample on, in ALIGN already.

    What is stuck shows half a second after ALIGN at the latest; what only the innovations show, any way, two seconds
    after the first that may be judged.
    """
    requirement, wrong = row.requirement, row.requirement.within == _WRONG
    later = _JUDGED if wrong else _ALIGNED if row.requirement.within == _STUCK else 0
    more = ("BASE", "MISMATCH", "INNOVATION", "CALIBRATION") if wrong else ()
    flags = tuple(dict.fromkeys((*requirement.flags, *more)))
    return replace(
        row,
        name=f"{row.name}{FROM_POWER_ON}",
        title=f"{row.title}, from power-on",
        requirement=replace(requirement, flags=flags, within=requirement.within + later),
        time=(0.0, _LASTS),
    )


def _failing() -> Iterator[Row]:
    """Yield signals that fail for good."""
    kinds = ("invalid", "saturated", "stuck", "zero", "sign")
    names = {f"{signal}_{kind}" for signal in _SIGNAL if signal != "grip_force" for kind in kinds}
    yield from (row for row in _readings() if row.name in names)


def _coasting() -> Iterator[Row]:
    """Yield faults of the base acceleration while no lever signal comes, for its own stillness is all that shows them.

    Torque has ended, and cannot be compared.
    """
    requirement = replace(_BLIND, flags=("BASE",), within=_STUCK)
    for name, fault in {"stuck": Stuck(), "zero": Reads(value=0.0)}.items():
        title = f"z̈ {name} while no LEVER_SAMPLE comes"
        yield Row(f"z_ddot_{name}_coasting", title, requirement, bus.lost("LEVER_SAMPLE", 1.1), wrong(fault, "z_ddot"))


def _table() -> Iterator[Row]:
    for part in (_damaged, _counters, _missing, _late, _other_senders, _commands, _readings, _clocks):
        yield from part()
    for part in (_missing, _readings, _clocks):
        yield from map(_frozen, part())
    yield from map(_from_power_on, _failing())
    yield from _coasting()


ROWS = {row.name: row for row in _table()}
"""All by name, in the order of the table."""

_DRIFT = "angle and rate are compared; a gain that drifts slowly is found when it is off by 6 to 10 %"
_OFFSET = "a step passes the high-passes; for some pilots it is taken for a change of the arm"
_TORQUE = "takes a second: a shorter memory takes other torque of a frequency near the dither's for a wrong gain"
_BASE = "without torque a gain of z̈ is a scale of the arm, which no innovation tells from it; dither tells in seconds"
_LEVELS = "its levels are off by the whole angle when it is right again: BASE and INNOVATION go after up to 3.6 s"
_RATE_ALONE = "learnt from the rate alone, some pilots' arm is off by over 3 sigma for 2 s after the angle is back"
_TRIM = "f_n is that at the angle shown, which drifts off, and k_p that is held does not make up for it"
KNOWN: dict[str, str] = {
    "lever_stale": "angle and rate that stand together are those of a lever at rest; BASE shows after 0.8 s",
    "theta_zero": _LEVELS,
    "theta_sign": _LEVELS,
    "theta_gain_drift": _DRIFT,
    "theta_invalid_from_power_on": _RATE_ALONE,
    "theta_saturated_from_power_on": _RATE_ALONE,
    "theta_drift_frozen": _TRIM,
    "theta_dot_gain_half": "angle and rate tell in half a second; until then some arms are off by over 3 sigma",
    "theta_dot_gain_double": _LEVELS,
    "tau_m_stuck": _TORQUE,
    "tau_m_zero": _TORQUE,
    "tau_m_gain_0.7": "what was learnt with it is off, and unflagged, for up to 2 s after it is right again",
    "theta_dot_step": _OFFSET,
    "z_ddot_step": _OFFSET,
    "z_ddot_drift": _OFFSET,
    "z_ddot_sign": "where the base moves the lever little, it is not seen to be right again, and BASE stays",
    "z_ddot_sign_from_power_on": "an arm is learnt that fits it, until BASE shows it after 2.3 to 2.8 s",
    "z_ddot_gain_half": _BASE,
    "z_ddot_gain_double": _BASE,
    "z_ddot_gain_drift": _BASE,
    "grip_force_saturated": "a constant force passes no high-pass: it counts as none",
    "grip_force_gain_half": "CALIBRATION shows a gain that is too large sooner than one that is too small",
    "babble_1": "one random frame in 256 has a right CRC and is taken; COMMUNICATION shows, but flags no estimate",
}
KNOWN |= {
    name: KNOWN[name.removesuffix(FROZEN)]
    for name in ROWS
    if name.endswith(FROZEN) and name.removesuffix(FROZEN) in KNOWN
}
"""Rows that some pilot's flight does not meet, and why."""
