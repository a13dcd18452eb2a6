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

The pitch follows gearing * (delta + correction)(t - delay) as a first-order actuator with limits of rate and travel.
The correction is what the estimator has put out correction_delay and a sample period earlier. With lever_low_pass their
sum passes a first-order low-pass with that corner: what flight control computers do against bounce, to compare with.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from lever_cdkf.arrays import ComplexArray, FloatArray

from ..toml_tables import Place, ScenarioError, Shelf, parse, quantity, read, read_quantity, text, whole

Z_DOT, BETA, BETA_DOT = range(3)
"""Places in the state of the airframe [m/s, rad, rad/s]."""
PITCH, GUST = range(2)
"""Places in its input [rad, m/s^2]."""


@dataclass(frozen=True, kw_only=True)
class Aircraft:
    """What is constant in a helicopter; the files beside this one are such tables."""

    title: str = text("")
    rotor_speed: float = quantity("rad/s", least=5.0, greatest=200.0)
    radius: float = quantity("m", least=1.5, greatest=25.0)
    blades: int = whole(least=2, greatest=10)
    blade_inertia: float = quantity("kg m^2", above=0.0, greatest=1e5)
    lock_number: float = quantity("1", least=1.0, greatest=20.0)
    flap_frequency: float = quantity("1", least=1.0, greatest=2.0)
    mass: float = quantity("kg", least=200.0, greatest=1e5)
    lift_deficiency: float = quantity("1", 0.7, least=0.1, greatest=1.0)
    delay: float = quantity("s", 0.020, least=0.0, greatest=0.2)
    correction_delay: float = quantity("s", 0.0, least=0.0, greatest=0.2)
    lever_low_pass: float = quantity("Hz", 0.0, least=0.0, greatest=1e3)
    actuator_bandwidth: float = quantity("Hz", 8.0, least=0.1, greatest=1e3)
    actuator_rate: float = quantity("rad/s", np.radians(100.0), above=0.0, greatest=100.0)
    actuator_travel: float = quantity("rad", np.radians(8.0), above=0.0, greatest=1.0)

    def matrices(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """A (3, 3), B (3, 2), C (1, 3), D (1, 2) of the airframe: state [z_dot, beta, beta_dot], input [theta_c, gust],
        output z_ddot."""
        w, r, inertia = self.rotor_speed, self.radius, self.blade_inertia
        moment = 1.5 * inertia / r
        flap = self.lift_deficiency * inertia * self.lock_number * w**2 / 8.0
        thrust = self.lift_deficiency * self.blades * inertia * self.lock_number * w**2 / (6.0 * r)
        inertias = np.array(((inertia, moment), (self.blades * moment, self.mass)))  # of beta_ddot, z_ddot
        spring = inertia * (self.flap_frequency * w) ** 2
        by_state = np.array(
            (
                (-flap * 4.0 / (3.0 * w * r), -spring, -flap / w),
                (-thrust * 3.0 / (2.0 * w * r), 0.0, -thrust / w),
            )
        )
        by_input = np.array(((flap, 0.0), (thrust, self.mass)))
        beta_ddot, z_ddot = np.linalg.solve(inertias, np.hstack((by_state, by_input)))
        rows = np.vstack((z_ddot, (0.0, 0.0, 1.0, 0.0, 0.0), beta_ddot))
        return rows[:, :3], rows[:, 3:], z_ddot[None, :3], z_ddot[None, 3:]

    def response(self, s: ComplexArray) -> ComplexArray:
        """z_ddot / delta [m/s^2 per rad] at the complex frequencies s [rad/s], for a gearing of 1, without limits."""
        a, b, c, d = self.matrices()
        resolvent = np.linalg.solve(s[:, None, None] * np.eye(len(a)) - a, b[:, [PITCH]].astype(np.complex128))
        airframe = (c @ resolvent)[:, 0, 0] + d[0, PITCH]
        actuator = 1.0 / (1.0 + s / (2.0 * np.pi * self.actuator_bandwidth))
        response: ComplexArray = airframe * actuator * np.exp(-s * self.delay)
        return response / (1.0 + s / (2.0 * np.pi * self.lever_low_pass)) if self.lever_low_pass else response


GREATEST_GEARING = 100.0
"""Pitch over the lever's angle [1]: 200 times what is in service. `lever bounce` goes beyond 10."""
SHELF = Shelf("aircraft", __package__)
names = SHELF.names


def load(name_or_path: str, **changes: Any) -> Aircraft:
    """The aircraft of that name, or in the file of that path (ending in .toml), with some of its keys changed: values
    as they stand in such a file. Raises ScenarioError."""
    values = parse(SHELF.content(name_or_path), name_or_path)
    aircraft: Aircraft = read(Aircraft, values | changes, Place(name_or_path))
    return aircraft


_OF_SCENARIO = ("model", "gearing")
"""Keys of [aircraft] that are not the aircraft's own."""


def read_aircraft(values: Any, place: Place) -> Coupled:
    """Reader of the table [aircraft] of a scenario: `model` is a name or a file, `gearing` the pitch over the lever's
    angle, and every other key one of the aircraft's."""
    if not isinstance(values, dict):
        raise place.error(f"{values!r} is not a table")
    changes = {name: value for name, value in values.items() if name not in _OF_SCENARIO}
    known = [field.name for field in fields(Aircraft)]
    if unknown := next((name for name in changes if name not in known), None):
        raise place.error(f"unknown key {unknown!r}; allowed: {', '.join((*_OF_SCENARIO, *known))}")
    if not isinstance(values.get("model"), str):
        raise place.at("model").error(f"must be one of {', '.join(names())}, or the path of a .toml file")
    try:
        aircraft = load(values["model"], **changes)
    except ScenarioError as error:
        raise place.error(str(error)) from None
    gearing = read_quantity("1", above=0.0, greatest=GREATEST_GEARING)(values.get("gearing"), place.at("gearing"))
    changed = "".join(f", {key} {value}" for key, value in changes.items())
    return Coupled(aircraft, gearing, f"{values['model']}{changed}, gearing {gearing:g}")


@dataclass(frozen=True)
class Coupled:
    """An aircraft, and how its lever turns the blades."""

    aircraft: Aircraft
    gearing: float
    """Pitch over the lever's angle [1]."""
    name: str = "an aircraft"
    """Which, with what is changed, for people."""

    def response(self, s: ComplexArray) -> ComplexArray:
        """z_ddot / delta [m/s^2 per rad] at the complex frequencies s [rad/s], without limits."""
        response: ComplexArray = self.gearing * self.aircraft.response(s)
        return response
