"""Heave and rotor coning of a hovering helicopter, driven by the collective lever.

z is the height of the cabin, beta the coning angle of the blades, theta_c their collective pitch, all positive up and
about hover; delta the lever's angle about its trim, positive where it is raised, which raises the pitch:

    I_b (beta_ddot + nu^2 W^2 beta) + S_b z_ddot = kappa I_b gamma W^2 / 8 (theta_c - 4 z_dot / (3 W R) - beta_dot / W)
    M z_ddot + N S_b beta_ddot = kappa N I_b gamma W^2 / (6 R) (theta_c - 3 z_dot / (2 W R) - beta_dot / W) + M gust

with W the rotor speed, R its radius, N its blades, I_b the flapping inertia of one and S_b = 3 I_b / (2 R) its first
moment (a uniform blade), nu its rotating flap frequency over W, gamma the Lock number, M the mass of everything, kappa
what dynamic inflow leaves of the lift at some hertz, and gust a vertical force over M. A blade element at r sees the
vertical speed z_dot + r beta_dot; flap moment and thrust are the integrals of r and 1 times its lift over the span:

    lift a length = rho a c / 2 ((W r)^2 theta_c - W r (z_dot + r beta_dot)),      gamma = rho a c R^4 / I_b

(Muscarello, Quaranta, Masarati: The role of rotor coning in helicopter proneness to collective bounce, Aerospace
Science and Technology 36, 2014.) Signs: a cabin that accelerates upwards leaves arm and lever behind, delta falls, and
at low frequency the loop is a negative feedback; the arm beyond its own frequency, the delay and the actuator turn it
round.

A fuselage that bends has modes q beside that (README.md): the hub moves by z + rotor q, the seat by z + seat q, the
accelerometer by z + accelerometer q.

The pitch follows gearing * (delta + correction)(t - delay) as a first-order actuator with limits of rate and travel.
The correction is what the estimator has put out correction_delay and a sample period earlier. With lever_low_pass their
sum passes a first-order low-pass with that corner: what flight control computers do against bounce, to compare with.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.numeric.arrays import ComplexArray

from ..toml_tables import (
    Place,
    Shelf,
    choice,
    parse,
    quantity,
    read,
    read_quantity,
    read_table,
    tables,
    text,
    whole,
)
from . import state_space
from .state_space import GUST, PITCH, SEAT, SENSOR, StateSpace, flyable
from .tabulated import Tabulated, is_response

Z_DOT, BETA, BETA_DOT = range(3)
"""Places in the state of a helicopter [m/s, rad, rad/s]."""

MOST_MODES = 3
"""Of the fuselage."""


@dataclass(frozen=True, kw_only=True)
class Mode:
    """[[mode]]: a bending mode of the fuselage.

    Amplitudes are relative to the heave that the same force at the rotor makes of the rigid aircraft: its modal mass is
    the aircraft's mass, or the amplitudes are scaled so that it is.
    """

    frequency: float = quantity("Hz", above=0.0, greatest=50.0)
    damping: float = quantity("1", 0.03, above=0.0, greatest=1.0)
    """Damping ratio."""
    rotor: float = quantity("1", 1.0, least=-10.0, greatest=10.0)
    seat: float = quantity("1", least=-10.0, greatest=10.0)
    accelerometer: float = quantity("1", 0.0, least=-10.0, greatest=10.0)
    """0: at a node of the mode, as the centre of mass is taken to be."""


@dataclass(frozen=True, kw_only=True)
class Aircraft(ABC):
    """An airframe, and what turns its blades."""

    title: str = text("")
    accelerometer: str = choice("mounted", "seat", default="mounted")
    """Where it sits: where the airframe has it, or at the pilot's seat."""
    seat_transfer_known: str = choice("yes", "no", default="yes")
    """Whether the firmware is told what lies between accelerometer and seat."""
    delay: float = quantity("s", 0.020, least=0.0, greatest=0.2)
    correction_delay: float = quantity("s", 0.0, least=0.0, greatest=0.2)
    lever_low_pass: float = quantity("Hz", 0.0, least=0.0, greatest=1e3)
    actuator_bandwidth: float = quantity("Hz", 8.0, least=0.1, greatest=1e3)
    actuator_rate: float = quantity("rad/s", np.radians(100.0), above=0.0, greatest=100.0)
    actuator_travel: float = quantity("rad", np.radians(8.0), above=0.0, greatest=1.0)

    @abstractmethod
    def mounted(self) -> StateSpace:
        """Return the airframe from pitch and gust to seat and accelerometer.

        Inputs are theta_c [rad] and gust [m/s^2], outputs z_ddot at the seat and at the accelerometer.
        """

    @property
    def has_actuator(self) -> bool:
        """Whether the first-order actuator is one of its own, not a part of the airframe."""
        return True

    def airframe(self) -> StateSpace:
        """Return the same, with the accelerometer where it is to sit."""
        airframe = self.mounted()
        if self.accelerometer == "mounted":
            return airframe
        return StateSpace(airframe.a, airframe.b, airframe.c[[SEAT, SEAT]], airframe.d[[SEAT, SEAT]])

    def response(self, s: ComplexArray, place: int = SEAT) -> ComplexArray:
        """Return z_ddot at one of the places / delta [m/s^2 per rad] at the complex frequencies s [rad/s].

        It is that for a gearing of 1, without limits.
        """
        response = self.airframe().response(s, place, PITCH)
        if self.has_actuator:
            response = response / (1.0 + s / (2.0 * np.pi * self.actuator_bandwidth))
        response = response * np.exp(-s * self.delay)
        return response / (1.0 + s / (2.0 * np.pi * self.lever_low_pass)) if self.lever_low_pass else response

    def seat_transfer(self, s: ComplexArray) -> ComplexArray:
        """z_ddot at the seat over that at the accelerometer [1], as the rotor moves both."""
        airframe = self.airframe()
        transfer: ComplexArray = airframe.response(s, SEAT, PITCH) / airframe.response(s, SENSOR, PITCH)
        return transfer


@dataclass(frozen=True, kw_only=True)
class Helicopter(Aircraft):
    """By the equations above; the files beside this one are such tables."""

    rotor_speed: float = quantity("rad/s", least=5.0, greatest=200.0)
    radius: float = quantity("m", least=1.5, greatest=25.0)
    blades: int = whole(least=2, greatest=10)
    blade_inertia: float = quantity("kg m^2", above=0.0, greatest=1e5)
    lock_number: float = quantity("1", least=1.0, greatest=20.0)
    flap_frequency: float = quantity("1", least=1.0, greatest=2.0)
    mass: float = quantity("kg", least=200.0, greatest=1e5)
    lift_deficiency: float = quantity("1", 0.7, least=0.1, greatest=1.0)
    mode: tuple[Mode, ...] = tables(read_table(Mode))

    def __post_init__(self) -> None:
        if len(self.mode) > MOST_MODES:
            raise ValueError(f"{len(self.mode)} modes; a fuselage has {MOST_MODES} at most")

    def mounted(self) -> StateSpace:
        """State [z_dot, beta, beta_dot, q and q_dot of each mode]."""
        w, r, inertia, count = self.rotor_speed, self.radius, self.blade_inertia, len(self.mode)
        moment = 1.5 * inertia / r
        flap = self.lift_deficiency * inertia * self.lock_number * w**2 / 8.0
        thrust = self.lift_deficiency * self.blades * inertia * self.lock_number * w**2 / (6.0 * r)
        rotor = np.array([each.rotor for each in self.mode])
        inertias = np.diag([inertia, *(1 + count) * [self.mass]])  # of beta_ddot, z_ddot, q_ddot
        inertias[0, 1:] = moment * np.append(1.0, rotor)
        inertias[1:, 0] = self.blades * moment * np.append(1.0, rotor)
        by_state, by_input = np.zeros((2 + count, 3 + 2 * count)), np.zeros((2 + count, 2))
        by_state[0, :3] = -flap * 4.0 / (3.0 * w * r), -inertia * (self.flap_frequency * w) ** 2, -flap / w
        by_state[1, :3] = -thrust * 3.0 / (2.0 * w * r), 0.0, -thrust / w
        by_state[:2, 4::2] = np.outer(by_state[:2, Z_DOT], rotor)  # the hub moves with the modes
        by_input[:2] = (flap, 0.0), (thrust, self.mass)
        by_state[2:], by_input[2:] = np.outer(rotor, by_state[1]), np.outer(rotor, by_input[1])
        for i, mode in enumerate(self.mode):
            omega = 2.0 * np.pi * mode.frequency
            by_state[2 + i, 3 + 2 * i : 5 + 2 * i] -= self.mass * omega**2, self.mass * 2.0 * mode.damping * omega
        accelerations = np.linalg.solve(inertias, np.hstack((by_state, by_input)))
        size = 3 + 2 * count
        rows = np.zeros((size, size + 2))
        rows[0], rows[2], rows[4::2] = accelerations[1], accelerations[0], accelerations[2:]
        rows[1, BETA_DOT] = 1.0
        rows[range(3, size, 2), range(4, size, 2)] = 1.0
        places = [
            [1.0, *amplitudes] for amplitudes in zip(*((m.seat, m.accelerometer) for m in self.mode), strict=True)
        ]
        outputs = np.array(places or [[1.0], [1.0]]) @ accelerations[1:]
        return StateSpace(rows[:, :size], rows[:, size:], outputs[:, :size], outputs[:, size:])


@dataclass(frozen=True, kw_only=True)
class FromFile(Aircraft):
    """One whose airframe was computed or measured elsewhere."""

    system: StateSpace | None = None
    """The airframe, once the file has been read."""

    def mounted(self) -> StateSpace:
        """Return the airframe that the file holds, from pitch and gust to seat and accelerometer."""
        assert self.system is not None
        return self.system


@dataclass(frozen=True, kw_only=True)
class Imported(FromFile):
    """An airframe from a file: state_space.py.

    Numbers of inputs and outputs count from 1; 0: the first and the second of a file that has no more.
    """

    input: str = choice("blade", "actuator", default="blade")
    """What the collective input is: pitch of the blades, or the command of an actuator that is in the file."""
    collective_input: int = whole(0)
    gust_input: int = whole(0)
    seat_output: int = whole(0)
    accelerometer_output: int = whole(0)

    @property
    def has_actuator(self) -> bool:
        """Whether the response is that to the blade, so that the actuator comes on top."""
        return self.input == "blade"

    def picked(self, whole_system: StateSpace, where: str) -> StateSpace:
        """Return two inputs and two outputs of all that a file has; raise LeverError.

        Without a gust there, it accelerates both places alike.
        """
        inputs = _chosen(
            (self.collective_input, self.gust_input), whole_system.d.shape[1], ("collective", "gust"), where
        )
        outputs = _chosen(
            (self.seat_output, self.accelerometer_output), len(whole_system.d), ("seat", "accelerometer"), where
        )
        picked = whole_system.pick(inputs[:1] + inputs[-1:], outputs[:1] + outputs[-1:])
        if len(inputs) == 1:
            picked.b[:, GUST], picked.d[:, GUST] = 0.0, 1.0
        return picked


def _chosen(numbers: tuple[int, int], count: int, names: tuple[str, str], where: str) -> list[int]:
    """Places of one or two columns or rows, from 0."""
    kind = "input" if names[1] == "gust" else "output"
    if count > 2 and not numbers[0]:
        raise LeverError(f"{where}: has {count} {kind}s: say which by {names[0]}_{kind}=N and {names[1]}_{kind}=N")
    if max(numbers) > count or not count:
        raise LeverError(f"{where}: has {count} {kind}s; there is none of number {max(1, *numbers)}")
    given = numbers if numbers[0] or numbers[1] else (1, 2)[:count]
    return [number - 1 for number in given if number]


@dataclass(frozen=True, kw_only=True)
class Fitted(FromFile):
    """An airframe that is fitted to a frequency response from the lever to the seat: tabulated.py."""

    delay: float = quantity("s", 0.001, least=0.0, greatest=0.2)
    """In the response; it is flown as such, the rest by a state space."""
    response_gearing: float = quantity("1", 1.0, above=0.0, greatest=100.0)
    """That is in the response."""

    @property
    def has_actuator(self) -> bool:
        """Always false: the measured response contains the actuator."""
        return False


GREATEST_GEARING = 100.0
"""Pitch over the lever's angle [1]: 200 times what is in service. `lever bounce` goes beyond 10."""
SHELF = Shelf("aircraft", __package__)
names = SHELF.names
WORST_FIT = 0.2
"""Relative error of a fit to a frequency response that may fly [1]."""
FILES = (".mat", ".npz", ".csv")
"""Of airframes that were computed or measured elsewhere."""


def load(name_or_path: str, **changes: Any) -> Aircraft:
    """Return the aircraft of that name, or in a file, with some of its keys changed; raise LeverError.

    The path of a file ends in .toml, .mat, .npz or .csv; `changes` are values as they stand in a .toml file.
    """
    path, place = Path(name_or_path), Place(name_or_path)
    if path.suffix.lower() not in FILES:
        values = parse(SHELF.content(name_or_path), name_or_path)
        helicopter: Helicopter = read(Helicopter, values | changes, place)
        return helicopter
    if is_response(path):
        fitted: Fitted = read(Fitted, changes, place)
        response = Tabulated.load(path)
        system, error = response.fitted(fitted.response_gearing, fitted.delay)
        if error > WORST_FIT:
            raise place.error(
                f"a state space fits the response to {100.0 * error:.0f} % only, which does not fly; it must to "
                f"{100.0 * WORST_FIT:.0f} %: give more frequencies, or less noise"
            )
        return replace(fitted, title=fitted.title or path.name, system=flyable(system, name_or_path))
    imported: Imported = read(Imported, changes, place)
    system = flyable(imported.picked(state_space.read(path), name_or_path), name_or_path)
    return replace(imported, title=imported.title or path.name, system=system)


_OF_SCENARIO = ("model", "gearing")
"""Keys of [aircraft] that are not the aircraft's own."""


def keys(model: str) -> list[str]:
    """Return what may be said of the aircraft of that name or file."""
    path = Path(model)
    kind: type[Aircraft] = Helicopter
    if path.suffix.lower() in FILES:
        kind = Fitted if is_response(path) else Imported
    return [field.name for field in fields(kind) if "read" in field.metadata]


def read_aircraft(values: Any, place: Place) -> Coupled:
    """Read the table [aircraft] of a scenario.

    `model` is a name or a file, `gearing` the pitch over the lever's angle, and every other key one of the aircraft's.
    """
    if not isinstance(values, dict):
        raise place.error(f"{values!r} is not a table")
    changes = {name: value for name, value in values.items() if name not in _OF_SCENARIO}
    model = values.get("model")
    known = keys(model if isinstance(model, str) else "")
    if unknown := next((name for name in changes if name not in known), None):
        raise place.error(f"unknown key {unknown!r}; allowed: {', '.join((*_OF_SCENARIO, *known))}")
    if not isinstance(model, str):
        raise place.at("model").error(
            f"must be one of {', '.join(names())}, or the path of a .toml, .mat, .npz or .csv"
        )
    try:
        aircraft = load(model, **changes)
    except LeverError as error:
        raise place.error(str(error)) from None
    gearing = read_quantity("1", above=0.0, greatest=GREATEST_GEARING)(values.get("gearing"), place.at("gearing"))
    changed = "".join(f", {key} {value}" for key, value in changes.items())
    return Coupled(aircraft, gearing, f"{model}{changed}, gearing {gearing:g}")


@dataclass(frozen=True)
class Coupled:
    """An aircraft, and how its lever turns the blades."""

    aircraft: Aircraft
    gearing: float
    """Pitch over the lever's angle [1]."""
    name: str = "an aircraft"
    """Which, with what is changed, for people."""

    def response(self, s: ComplexArray, place: int = SEAT) -> ComplexArray:
        """z_ddot at one of the places / delta [m/s^2 per rad] at the complex frequencies s [rad/s], without limits."""
        response: ComplexArray = self.gearing * self.aircraft.response(s, place)
        return response
