"""Flights for the blind oracle: a lever with an arm, a list of events, and what can be seen of the estimator meanwhile.

The lever is that of DESIGN section 3, linearised about a trim where gravity cancels, and integrated by RK4. It shares
nothing with the project's plants.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from lever_cdkf.can import codec
from lever_cdkf.firmware.estimator import Estimator
from lever_cdkf.firmware.library import ffi, lib, struct_dtype
from lever_cdkf.firmware.native import Config
from numpy.typing import NDArray

RATE = 1000  # samples a second: sample_period of lever_settings.def
READ = 15  # samples between readings: less than a learn_period, and than a round of the counters of the bus (R19)
STEP_US = 1_000_000 // RATE
DITHER = 0.3  # [N m] rms, what the READMEs call a known torque that settles the scale
KEEP_ALIVE = 250  # samples from COMMAND to COMMAND (R39: at most a second)
TRIM = math.radians(20.0)  # [rad], DESIGN section 3
EVENT = 8 * RATE  # sample of the event in a flight that has settled
FREEZE = 5 * RATE  # sample of the COMMAND that freezes: three seconds before the event
AFTER_GAP = 500  # samples from the end of a gap of a second to the event: aligned again, and not yet settled
SETTLING = 600  # sample of the event in a flight that has just been aligned
LENGTH = 2200  # samples that a fault lasts: the longest time to report one is 2 s (R33)
SHORT = 1000  # samples that one lasts which is reported at once
AFTER = 2100  # samples that are watched after it
LONG = 4500  # samples that are watched of a change that stays
LOOP_NOISE = {"theta": 1e-3, "theta_dot": 1e-2, "tau_m": 2e-3, "z_ddot": 1e-2}  # sil/README: [rad, rad/s, N m, m/s^2]
QUANTA = (1e-4, 5e-4, 1e-3, 1e-3)  # of theta, theta_dot, tau_m and z_ddot on the bus: lever.dbc
BUS = 30.0  # less than what any signal of LEVER_SAMPLE and BASE_SAMPLE but theta can say
TEST_RATIO = 0x21E  # lever.dbc
NO_ANSWER = bytes([0, 0xF0, 0xF, 0, 0, 0, 0, 0])  # no statistic and no verdict
MOTOR_LAG = 2e-3  # [s], sil/README
PROCESS = 0.05  # [rad/s/sqrt(s)], theta_dot_process_noise
OFFSET = 0.1  # [rad], above the 0.03 rad of R33
SPIKES = (0.5, 5.0, 10.0, 20.0)  # [rad, rad/s, N m, m/s^2], far beyond what the lever, motor and cabin do
VIBRATION = 0.981  # [m/s^2] rms: 0.1 g
ARM = (2.5, 42.0, 1500.0)  # m_p [kg], c_p [N s/m], k_p [N/m]: typical, DESIGN section 3
NOBODY = (0.0, 0.0, 0.0)

Reading = list[float | None]  # theta, theta_dot, tau_m, z_ddot; None: marked invalid
Faulty = Callable[[int, Reading, list[Reading]], Reading]  # samples since it began, what is true, all readings so far
ESTIMATE = struct_dtype("lever_estimate_t")


class Lever(NamedTuple):
    """From one sample to the next: x' = transition x + torque (tau_m + disturbance) + base z_ddot."""

    transition: tuple[float, float, float, float]
    torque: tuple[float, float]
    base: tuple[float, float]


def lever(arm: tuple[float, float, float]) -> Lever:
    """Return the lever with an arm, stepped by RK4 over a sample with constant inputs."""
    length, mass, place, inertia, damping, stiffness = 0.45, 1.2, 0.5, 0.020, 0.5, 5.0  # DESIGN section 3
    m_p, c_p, k_p = arm
    total = length**2 * (place**2 * mass + m_p) + inertia
    bend = (length * math.cos(TRIM)) ** 2
    lever_arm = length * (place * mass + m_p) * math.cos(TRIM)
    rates = np.zeros((4, 4))  # of theta - trim, theta_dot, tau_m, z_ddot
    rates[0, 1] = 1.0
    rates[1] = np.array([-(bend * k_p + stiffness), -(bend * c_p + damping), 1.0, -lever_arm]) / total
    step, power = np.eye(4), np.eye(4)
    for order in range(1, 5):  # RK4 of a linear system is its Taylor polynomial of order four
        power = power @ rates / (RATE * order)
        step = step + power
    return Lever(tuple(step[:2, :2].ravel()), tuple(step[:2, 2]), tuple(step[:2, 3]))  # type: ignore[arg-type]


def multisine(seed: int, low: float, high: float, rms: float, count: int) -> NDArray[np.float64]:
    """Return a sum of 40 sines of random phase between two frequencies [Hz]."""
    random = np.random.default_rng(seed)
    time = np.arange(count) / RATE
    frequencies = np.linspace(low, high, 40) + random.uniform(-0.05, 0.05, 40)
    phases = random.uniform(0.0, 2.0 * np.pi, 40)
    return np.asarray(rms * np.sqrt(2.0 / 40.0) * np.sin(2 * np.pi * np.outer(time, frequencies) + phases).sum(1))


# --- events --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Event:
    """What happens to the lever, a sensor or the clock, from the sample EVENT of a flight on."""

    name: str
    length: int = LENGTH
    """Samples that it lasts."""
    sensor: int | None = None
    """Index into a Reading of the sensor that is at fault."""
    kind: str = "none"
    faulty: Faulty | None = None
    arm: tuple[float, float, float] | None = None
    rest: bool = False
    gap: int = 0
    """Samples that never come."""
    clock_stands: bool = False
    request: str = "none"
    process: float = 1.0
    """Factor of the process noise."""


SENSORS = ("theta", "theta_dot", "tau_m", "z_ddot")


def _missing(at: int) -> Faulty:
    return lambda since, true, past: [None if i == at else value for i, value in enumerate(true)]


def _scaled(at: int, factor: float) -> Faulty:
    def faulty(since: int, true: Reading, past: list[Reading]) -> Reading:
        value = true[at]
        return [(None if value is None else factor * value) if i == at else other for i, other in enumerate(true)]

    return faulty


def _late(at: int, samples: int) -> Faulty:
    """Return the true value of some samples ago; `past` has the true readings."""
    return lambda since, true, past: [past[-samples][at] if i == at else value for i, value in enumerate(true)]


def _stuck(at: int) -> Faulty:
    """Return the reading at which the fault begins, again and again; one that the bus can say."""
    held: list[float | None] = [None]

    def faulty(since: int, true: Reading, past: list[Reading]) -> Reading:
        if since == 0:
            value = true[at]
            held[0] = None if value is None else round(value / QUANTA[at]) * QUANTA[at]
        return [held[0] if i == at else other for i, other in enumerate(true)]

    return faulty


def _offset(at: int, offset: float) -> Faulty:
    def faulty(since: int, true: Reading, past: list[Reading]) -> Reading:
        return [value + offset if i == at and value is not None else value for i, value in enumerate(true)]

    return faulty


def _zero(at: int) -> Faulty:
    return lambda since, true, past: [0.0 if i == at else value for i, value in enumerate(true)]


def _implausible(at: int) -> Faulty:
    """In turn a number that no lever has, and one that is none; both marked valid."""
    values = (1e9, math.nan)
    return lambda since, true, past: [values[since & 1] if i == at else value for i, value in enumerate(true)]


def _events() -> dict[str, Event]:
    events = [Event("nothing", length=SHORT)]
    for at, name in enumerate(SENSORS):
        wrong = SHORT if at < 2 else LENGTH  # outputs must be found within 0.6 s, the others within 2 s
        scaled = LENGTH if at == 2 else SHORT  # of the base R33 does not promise it
        events += [
            Event(f"{name}_missing", length=SHORT, sensor=at, kind="missing", faulty=_missing(at)),
            Event(f"{name}_implausible", length=SHORT, sensor=at, kind="implausible", faulty=_implausible(at)),
            Event(f"{name}_stuck", length=wrong, sensor=at, kind="stuck", faulty=_stuck(at)),
            Event(f"{name}_half", length=scaled, sensor=at, kind="scaled", faulty=_scaled(at, 0.5)),
            Event(f"{name}_one_and_a_half", length=scaled, sensor=at, kind="scaled", faulty=_scaled(at, 1.5)),
            Event(f"{name}_sign", length=wrong, sensor=at, kind="sign", faulty=_scaled(at, -1.0)),
            Event(f"{name}_late_10ms", length=SHORT, sensor=at, kind="late", faulty=_late(at, 10)),
            Event(f"{name}_late_100ms", length=wrong, sensor=at, kind="very_late", faulty=_late(at, 100)),
        ]
    m_p, c_p, k_p = ARM
    return {
        event.name: event
        for event in [
            *events,
            *(
                Event(f"{name}_spike", length=1, sensor=at, kind="spike", faulty=_offset(at, SPIKES[at]))
                for at, name in enumerate(SENSORS)
            ),
            Event("z_ddot_zero", length=SHORT, sensor=3, kind="zero", faulty=_zero(3)),
            Event("theta_offset", length=SHORT, sensor=0, kind="offset", faulty=_offset(0, OFFSET)),
            Event(
                "outputs_missing",
                length=SHORT,
                kind="outputs",
                faulty=lambda since, true, past: [None, None, *true[2:]],
            ),
            Event("gap_50ms", length=50, gap=50),
            Event("gap_1s", length=1000, gap=1000),
            Event("clock_stands", length=300, clock_stands=True),
            Event("hands_off", arm=NOBODY),
            Event("stiffer", length=LONG, arm=(m_p, c_p, 1.4 * k_p)),
            Event("rest", rest=True),
            Event("rough", length=SHORT, process=10.0),
            Event("freeze", length=SHORT, request="freeze"),
            Event("run", length=SHORT, request="run"),
        ]
    }


EVENTS = _events()


# --- modes -----------------------------------------------------------------------------------------------------------


class Mode(NamedTuple):
    """What the estimator is doing when the event comes, and where torque comes from."""

    state: str
    """run, frozen, after_gap or settling."""
    torque: str
    """foreign: somebody else drives the motor, and its torque is measured; unmeasured: none, and none is measured;
    dither: a COMMAND asks for it, and it is measured."""

    @property
    def begin(self) -> int:
        """Sample at which the event begins."""
        return SETTLING if self.state == "settling" else EVENT


MODES = [
    *(
        Mode(state, torque)
        for state in ("run", "frozen", "after_gap", "settling")
        for torque in ("unmeasured", "dither")
    ),
    Mode("run", "foreign"),
    Mode("frozen", "foreign"),
]


def applies(event: Event, mode: Mode) -> bool:
    """Return whether an event is flown in a mode: where somebody else drives the motor only what is about torque is."""
    return mode.torque != "foreign" or event.sensor in (None, 2)


# --- flights ---------------------------------------------------------------------------------------------------------


@dataclass(eq=False)
class Flight:
    """What was seen of a flight from the outside."""

    event: Event
    mode: Mode
    begin: int
    """Sample at which the event begins."""
    end: int
    """First sample after it."""
    sample: NDArray[np.int64]
    """Number of each sample that came, in sample periods of true time."""
    modes: NDArray[np.uint8]
    faults: NDArray[np.uint32]
    torque: NDArray[np.float32]
    """Of the torque gate [N m]."""
    recoveries: int
    read: NDArray[np.int64]
    """Indices of the samples after which there is a reading."""
    estimate: NDArray[Any]
    """lever_estimate_t of each reading."""
    ratios: NDArray[np.float32]
    """Test ratios of each reading."""
    verdict: NDArray[np.int64]
    evidence: NDArray[np.int64]
    """Which statistic the TEST_RATIO of the reading is of."""
    present: NDArray[np.bool_]
    """Whether that statistic is evidence, as TEST_RATIO says."""


@cache
def noises() -> tuple[list[float], ...]:
    """Vibration, foreign torque, process noise, and the noise of the four sensors, for the longest flight."""
    count = EVENT + 7 * RATE + 2000
    random = np.random.default_rng(20)
    return (
        multisine(1, 1.5, 8.0, VIBRATION, count).tolist(),
        multisine(2, 1.0, 10.0, DITHER, count).tolist(),
        random.normal(0.0, PROCESS / math.sqrt(RATE), count).tolist(),
        *(random.normal(0.0, LOOP_NOISE[name], count).tolist() for name in SENSORS),
    )


class Seen(NamedTuple):
    """What was seen of a flight: a row (sample, mode, faults, torque) a sample, and the readings."""

    rows: NDArray[np.float64]
    read: NDArray[np.int64]
    estimate: NDArray[Any]
    ratios: NDArray[np.float32]
    said: NDArray[np.uint8]
    """TEST_RATIO of each reading."""


class Simulation:
    """A lever, an arm and an estimator, sample by sample."""

    def __init__(self, mode: Mode) -> None:
        # The verdict is in TEST_RATIO only; with this period each reading has one.
        self.config = Config(settings={"publish_test_ratios": 1.0, "publish_period": 1e-3})
        self.mode = mode
        self.estimator = Estimator(self.config)
        self.sample, self.counter, self.motor = 0, 0, 0.0
        self.state = (0.0, 0.0)
        self.past: list[Reading] = []
        self.clock_lost = 0
        self.rows: list[tuple[int, int, int, float]] = []
        self.readings: list[tuple[int, bytes, bytes, bytes]] = []
        self.answer = b""
        self.before: Seen | None = None
        self.offset = 0

    def seen(self) -> Seen:
        """Return what was seen so far, as columns."""
        rows = np.array(self.rows, float).reshape(-1, 4)
        index, estimates, ratios, answers = zip(*self.readings, strict=True)
        said = np.array([list(answer or NO_ANSWER) for answer in answers], np.uint8)
        seen = Seen(
            rows,
            np.array(index),
            np.frombuffer(b"".join(estimates), ESTIMATE),
            np.frombuffer(b"".join(ratios), np.float32).reshape(-1, lib.LEVER_TEST_RATIOS),
            said,
        )
        if self.before is None:
            return seen
        parts: list[tuple[Any, Any]] = list(zip(self.before, seen, strict=True))
        return Seen(*(np.concatenate(part) for part in parts))

    def branch(self) -> Simulation:
        """Return a copy that goes on by itself."""
        twin = Simulation(self.mode)
        assert twin.estimator.restore(self.estimator.state()), "the state of the warm-up was refused"
        twin.sample, twin.counter, twin.motor, twin.state = self.sample, self.counter, self.motor, self.state
        twin.past = self.past[-200:]
        twin.before, twin.offset = self.seen(), self.offset + len(self.rows)
        return twin

    def fly(self, until: int, event: Event = EVENTS["nothing"]) -> None:
        """Fly to a sample, with an event all the way."""
        vibration, foreign, process, *noise = noises()
        assert until <= len(vibration) - 2
        now = lever(event.arm or ARM)
        (a, b, c, d), (torque_0, torque_1), (base_0, base_1) = now
        estimator, mode = self.estimator, self.mode
        pointer, health, sample = estimator.pointer, ffi.new("lever_health_t *"), ffi.new("lever_sample_t *")
        lag, begin, faulty, kept = math.exp(-1.0 / (RATE * MOTOR_LAG)), self.sample, event.faulty, self.past
        frames = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE")
        motor, (angle, rate), asked = self.motor, self.state, 0.0
        before: Reading = [None]
        unmeasured, dithers, update = mode.torque == "unmeasured", mode.torque == "dither", lib.lever_update
        read_health, rows = lib.lever_health, self.rows
        while self.sample < until:
            k = self.sample
            if dithers and k % KEEP_ALIVE == 0:
                estimator.command(dither_rms=DITHER)
            base = 0.0 if event.rest else vibration[k]
            true: Reading = [TRIM + angle + noise[0][k], rate + noise[1][k], motor + noise[2][k], base + noise[3][k]]
            if unmeasured:
                true[2] = None
            reading = true if faulty is None else faulty(k - begin, true, kept)
            kept.append(true)
            if event.gap:
                if (k - begin) % 5 == 4:
                    estimator.idle(5000)  # the façade: when no sample has come for about 5 ms, and again each 5 ms
                read_health(pointer, health)
                asked = health.torque
            else:
                if event.clock_stands:
                    self.clock_lost += 1
                time_us = (k - self.clock_lost) * STEP_US
                read = k % READ == READ - 1
                if read:
                    self._frames(reading, time_us, frames)
                else:
                    theta, theta_dot, tau_m, z_ddot = reading
                    sample.time_us = time_us
                    if None in reading or None in before:
                        sample.theta_valid, sample.theta_dot_valid = theta is not None, theta_dot is not None
                        sample.tau_m_valid, sample.z_ddot_valid = tau_m is not None, z_ddot is not None
                    sample.theta, sample.theta_dot = theta or 0.0, theta_dot or 0.0
                    sample.tau_m, sample.z_ddot = tau_m or 0.0, z_ddot or 0.0
                    before = reading
                    update(pointer, sample)
                read_health(pointer, health)
                asked = health.torque
                rows.append((k, health.mode, health.faults, asked))
                if read:
                    self._read()
            wanted = foreign[k] if mode.torque == "foreign" and not event.rest else asked
            last, motor = motor, wanted + (motor - wanted) * lag
            torque, shaking = 0.5 * (last + motor), 0.5 * (base + (0.0 if event.rest else vibration[k + 1]))
            push = 0.0 if event.rest else process[k] * event.process
            angle, rate = (
                a * angle + b * rate + torque_0 * torque + base_0 * shaking,
                c * angle + d * rate + torque_1 * torque + base_1 * shaking + push,
            )
            self.sample += 1
        self.motor, self.state = motor, (angle, rate)

    def _frames(self, reading: Reading, time_us: int, frames: tuple[Callable[..., bytes], ...]) -> None:
        """Give the sample as frames, and keep the TEST_RATIO of its answers. A value that the bus cannot say is marked
        invalid."""
        estimator, (lever_sample, base_sample) = self.estimator, frames
        said = [value if value is not None and abs(value) < BUS else None for value in reading]
        estimator.on_frame(0x110, lever_sample(self.counter, *said[:3]))
        estimator.on_frame(0x111, base_sample(self.counter, said[3], time_us))
        self.counter = (self.counter + 1) % 16
        estimator.step()
        while (frame := estimator.next_frame()) is not None:
            if frame[0] == TEST_RATIO:
                self.answer = frame[1]
                break  # the others are replaced by those of the next step

    def _read(self) -> None:
        """Keep estimate, test ratios and TEST_RATIO after the last sample."""
        estimate, ratios = ffi.new("lever_estimate_t *"), ffi.new("float[]", lib.LEVER_TEST_RATIOS)
        lib.lever_estimate(self.estimator.pointer, estimate)
        lib.lever_test_ratios(self.estimator.pointer, ratios)
        self.readings.append(
            (self.offset + len(self.rows) - 1, bytes(ffi.buffer(estimate)), bytes(ffi.buffer(ratios)), self.answer)
        )
        self.answer = b""


@cache
def warmed_up(mode: Mode) -> Simulation:
    """Fly to the sample of the event."""
    simulation = Simulation(mode)
    if mode.state == "settling":
        simulation.fly(SETTLING)
    elif mode.state == "frozen":
        simulation.fly(FREEZE)
        simulation.estimator.command("freeze")
        simulation.fly(EVENT)
    elif mode.state == "after_gap":
        simulation.fly(EVENT - AFTER_GAP - 1000)
        simulation.fly(EVENT - AFTER_GAP, EVENTS["gap_1s"])
        simulation.fly(EVENT)
    else:
        simulation.fly(EVENT)
    return simulation


@cache
def flight(name: str, mode: Mode) -> Flight:
    """Fly an event in a mode."""
    event = EVENTS[name]
    if mode.torque == "unmeasured" and event.sensor == 2 and event.kind != "implausible":
        return replace(flight("nothing", mode), event=event)  # there is no reading that could be wrong
    simulation = warmed_up(mode).branch()
    begin = simulation.sample
    if event.request != "none":
        simulation.estimator.command(event.request)
    simulation.fly(begin + event.length, event)
    if event.request != "none":
        simulation.estimator.command("freeze" if mode.state == "frozen" else "run")
    simulation.fly(min(begin + event.length + AFTER, begin + LONG))
    seen = simulation.seen()
    said = seen.said
    return Flight(
        event,
        mode,
        begin,
        begin + event.length,
        seen.rows[:, 0].astype(np.int64),
        seen.rows[:, 1].astype(np.uint8),
        seen.rows[:, 2].astype(np.uint32),
        seen.rows[:, 3].astype(np.float32),
        simulation.estimator.health().recoveries,
        seen.read,
        seen.estimate,
        seen.ratios,
        (said[:, 2] & 0xF).astype(np.int64),
        (said[:, 1] >> 4).astype(np.int64),
        (said[:, 2] & 0x10) != 0,
    )
