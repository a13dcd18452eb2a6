"""Databases of ten imaginary aircraft: other names, units, byte orders and places of the same signals, among others.

The names are those that such databases have; nobody has asked the proposal which ones it knows.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import numpy as np
from python.signals.flight import GRAVITY, Flight, FloatArray

# message, signal, unit, of each input; a row an aircraft
AIRCRAFT: list[dict[str, tuple[str, str, str]]] = [
    {
        "theta": ("COLL_LVR_SNSR", "CollLvrPosn", "deg"),
        "theta_dot": ("COLL_LVR_SNSR", "CollLvrVel", "deg/s"),
        "z_ddot": ("IRU_BODY_ACC", "BodyNormAcc", "g"),
    },
    {
        "theta": ("InceptorStatus1", "Inc1_Angle", "mrad"),
        "theta_dot": ("InceptorStatus1", "Inc1_AngularRate", "rad/s"),
        "z_ddot": ("AHRS_Accelerations", "acc_z", "m/s^2"),
    },
    {
        "theta": ("ACIS_FBK", "LEVER_POS", "rad"),
        "theta_dot": ("ACIS_FBK", "LEVER_SPD", "rad/s"),
        "z_ddot": ("CABIN_VIB", "SEAT_RAIL_VERT", "m/s2"),
        "tau_m": ("ACIS_MOT", "MOT_TRQ", "Nm"),
    },
    {
        "theta": ("Hebelsensor", "Hebelwinkel", "Grad"),
        "theta_dot": ("Hebelsensor", "Hebelwinkelgeschwindigkeit", "Grad/s"),
        "z_ddot": ("Sitzschiene", "Beschleunigung_Z", "m/s²"),
    },
    {
        "theta": ("FCC_A_429_GW", "COLL_STICK_POSITION", "DEG"),
        "z_ddot": ("ADIRU_GW", "NZ", "G"),
    },
    {
        "theta": ("Msg_0x3A1", "Sig_12", "deg"),
        "theta_dot": ("Msg_0x3A1", "Sig_13", "deg/s"),
        "z_ddot": ("Msg_0x2F0", "Sig_04", "g"),
    },
    {
        "theta": ("StickUnit", "theta", "rad"),
        "theta_dot": ("StickUnit", "thetaDot", "rad/s"),
        "z_ddot": ("Platform", "heaveAccel", "m/s/s"),
        "tau_m": ("StickDrive", "tauMotor", "N.m"),
    },
    {
        "theta": ("LVDT_BOX", "ColLvrAng", ""),
        "theta_dot": ("LVDT_BOX", "ColLvrAngRate", ""),
        "z_ddot": ("ACCEL_BOX", "AccVertFloor", ""),
    },
    {
        "theta": ("PilotControls", "CollectiveDeflection", "°"),
        "theta_dot": ("PilotControls", "CollectiveDeflectionRate", "°/s"),
        "z_ddot": ("InertialData", "VerticalLoadFactor", "g"),
        "grip_force": ("PilotControls", "CollectiveGripForce", "daN"),
    },
    {
        "theta": ("SCS_RX_04", "scs_lh_ang_deg", "deg"),
        "theta_dot": ("SCS_RX_04", "scs_lh_angvel", "deg/s"),
        "z_ddot": ("MEMS_2", "mems2_az", "mg"),
    },
]

OTHERS: list[tuple[str, str, str]] = [
    ("IRU_ATT", "PitchAngle", "deg"),
    ("IRU_ATT", "RollAngle", "deg"),
    ("IRU_RATES", "PitchRate", "deg/s"),
    ("IRU_RATES", "YawRate", "deg/s"),
    ("BODY_ACC_2", "LongAcc", "g"),
    ("BODY_ACC_2", "LatAcc", "g"),
    ("CYCLIC_POS", "CyclicLongPos", "deg"),
    ("CYCLIC_POS", "CyclicLatPos", "deg"),
    ("PEDALS", "PedalPosition", "%"),
    ("ENGINE_1", "EngineTorque", "%"),
    ("ENGINE_1", "MastTorque", "Nm"),
    ("ROTOR", "RotorSpeed", "rpm"),
    ("AIR_DATA", "AirSpeed", "m/s"),
    ("AIR_DATA", "BaroAltitude", "m"),
    ("TEMPS", "MotorTemperature", "degC"),
    ("ALIVE", "AliveCounter", ""),
]

_PER_SI = {
    "deg": 180.0 / math.pi,
    "mrad": 1e3,
    "rad": 1.0,
    "grad": 180.0 / math.pi,
    "°": 180.0 / math.pi,
    "g": 1.0 / GRAVITY,
    "mg": 1e3 / GRAVITY,
    "nm": 1.0,
    "n.m": 1.0,
    "dan": 0.1,
    "": 1.0,
}


@dataclass(frozen=True)
class Field:
    """A signal in its frame."""

    message: str
    name: str
    unit: str
    values: FloatArray


def database(index: int, flight: Flight) -> tuple[str, list[Field], dict[str, str]]:
    """The text of a DBC, the values of its signals, and which are the inputs."""
    chance = random.Random(100 + index)
    noise = np.random.default_rng(100 + index)
    truth = AIRCRAFT[index]
    measured = {
        "theta": flight.theta,
        "theta_dot": flight.theta_dot,
        "z_ddot": flight.z_ddot + GRAVITY,
        "tau_m": noise.normal(0.0, 0.3, len(flight.time)),
        "grip_force": 12.0 + 40.0 * (flight.theta - 0.35) + noise.normal(0.0, 0.2, len(flight.time)),
    }
    fields = [Field(*truth[key], measured[key] * _per_si(truth[key][2])) for key in truth]
    others = chance.sample(OTHERS, chance.randint(8, len(OTHERS)))
    fields += [Field(*other, _other(other[1], flight, noise)) for other in others]
    messages = sorted({field.message for field in fields}, key=lambda _: chance.random())
    identifiers = chance.sample(range(0x100, 0x7F0), len(messages))
    lines = ['VERSION ""', "BU_: A B", ""]
    for identifier, message in zip(identifiers, messages, strict=True):
        inside = [field for field in fields if field.message == message]
        chance.shuffle(inside)
        lines.append(f"BO_ {identifier} {message}: 8 A")
        for place, field in enumerate(inside):
            big = chance.random() < 0.5
            start = 16 * place + 7 if big else 16 * place
            scale = float(f"{2.0 * np.max(np.abs(field.values)) / 32000.0:.1g}") or 1.0
            lines.append(f' SG_ {field.name} : {start}|16@{0 if big else 1}- ({scale:g},0) [0|0] "{field.unit}" B')
        lines.append("")
    return "\n".join(lines), fields, {key: f"{truth[key][0]}.{truth[key][1]}" for key in truth}


def _per_si(unit: str) -> float:
    """What values in SI are multiplied by to be in a unit of AIRCRAFT."""
    return _PER_SI.get(unit.lower().removesuffix("/s"), 1.0)


def _other(name: str, flight: Flight, noise: np.random.Generator) -> FloatArray:
    """Something plausible that has nothing to do with the lever."""
    count = len(flight.time)
    if name == "AliveCounter":
        return np.arange(count, dtype=np.float64) % 1000.0
    slow = np.cumsum(noise.normal(0.0, 0.01, count))
    level = {"RotorSpeed": 380.0, "AirSpeed": 60.0, "BaroAltitude": 500.0, "MotorTemperature": 60.0}.get(name, 0.0)
    size = {"LongAcc": 0.05, "LatAcc": 0.05}.get(name, 1.0)
    values: FloatArray = level + size * (slow + noise.normal(0.0, 0.05, count))
    return values
