"""Databases of imaginary aircraft: other names, units, byte orders and places of the same signals, among others.

The names are those that such databases have; each was written before the proposal had seen it.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import numpy as np
from python.signals.flight import GRAVITY, Flight, FloatArray

Aircraft = dict[str, tuple[str, str, str]]
"""Message, signal and unit of each input."""
AIRCRAFT: list[Aircraft] = [
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
WITH_TORQUE: list[Aircraft] = [
    {
        "theta": ("HBL_1", "Hebelstellung", "Grad"),
        "theta_dot": ("HBL_1", "Drehrate_Hebel", "Grad/s"),
        "z_ddot": ("BESCHL_KAB", "Vertikalbeschl", "g"),
        "tau_m": ("ANTR_HBL", "Motormoment", "Nm"),
    },
    {
        "theta": ("MANCHE_PAS_GEN", "Angle_Manche", "deg"),
        "theta_dot": ("MANCHE_PAS_GEN", "Vitesse_Manche", "deg/s"),
        "z_ddot": ("ACCELERO_PLANCHER", "Acc_Verticale", "m/s2"),
        "tau_m": ("VERIN_PAS_GEN", "Couple", "N.m"),
    },
    {
        "theta": ("SRV_ST", "ServoPos", "deg"),
        "theta_dot": ("SRV_ST", "ServoVel", "deg/s"),
        "z_ddot": ("VIBMON", "Ch3_Floor", "g"),
        "tau_m": ("SRV_ST", "ServoMoment", "Nm"),
    },
    {
        "theta": ("ICU_TX1", "COL_POS", "deg"),
        "z_ddot": ("ADC_VIB", "ACC3", "mg"),
        "tau_m": ("ICU_TX1", "TRQ_CMD_FB", "Ncm"),
    },
    {
        "theta": ("EMA_COLL", "ActAngle", "rad"),
        "theta_dot": ("EMA_COLL", "ActSpeed", "rad/s"),
        "z_ddot": ("GNSS_INS", "a_down", "m/s^2"),
        "tau_m": ("EMA_COLL", "ActTorque", "N m"),
    },
    {
        "theta": ("M21", "S1", "deg"),
        "theta_dot": ("M21", "S2", "deg/s"),
        "z_ddot": ("M40", "S9", "g"),
        "tau_m": ("M21", "S3", "Nm"),
    },
    {
        "theta": ("CLTV_STK", "stk_defl", "mrad"),
        "theta_dot": ("CLTV_STK", "stk_defl_rate", "mrad/s"),
        "z_ddot": ("CPIT_ACCEL", "cpit_vert", "ft/s2"),
        "tau_m": ("CLTV_STK", "stk_mot_tq", "mNm"),
    },
    {
        "theta": ("GRIP_ASSY", "LVR_ROT", "deg"),
        "theta_dot": ("GRIP_ASSY", "LVR_ROT_RT", "deg/s"),
        "z_ddot": ("AFT_VIB", "PILOT_SEAT_VERT_G", "g"),
        "tau_m": ("TRIM_MOTOR", "TRIM_TORQUE", "in-lb"),
    },
    {
        "theta": ("ColIncptr", "ColIncptrAg", "deg"),
        "theta_dot": ("ColIncptr", "ColIncptrAgRate", "deg/s"),
        "z_ddot": ("VertAccSens", "VertAccVal", "g"),
        "tau_m": ("ColIncptr", "ColIncptrTq", "Nm"),
    },
    {
        "theta": ("LEVIER", "Ang", ""),
        "theta_dot": ("LEVIER", "Vit", ""),
        "z_ddot": ("CENTRALE", "GammaZ", ""),
        "tau_m": ("LEVIER", "Couple", ""),
    },
]
"""The same with a motor at the lever, under odd names."""

WITHHELD: list[Aircraft] = [
    {
        "theta": ("CPL_UNIT_A", "CPL_DISPL_ANG", "deg"),
        "theta_dot": ("CPL_UNIT_A", "CPL_DISPL_VEL", "deg/s"),
        "z_ddot": ("AMU_3", "AMU3_Z_ACCEL", "g"),
        "tau_m": ("CPL_UNIT_A", "CPL_FF_MOM", "Nm"),
    },
    {
        "theta": ("SidestickLH", "PosPitchAxis", "deg"),
        "theta_dot": ("SidestickLH", "VelPitchAxis", "deg/s"),
        "z_ddot": ("SeatSensor", "AccelUp", "m/s2"),
        "tau_m": ("SidestickLH", "FeelMotorTrq", "Nm"),
    },
    {
        "theta": ("COLLECTIF", "PosLevier", "deg"),
        "theta_dot": ("COLLECTIF", "VitLevier", "deg/s"),
        "z_ddot": ("CABINE", "AccVert", "g"),
        "tau_m": ("COLLECTIF", "CplMoteur", "N.m"),
    },
    {
        "theta": ("Stellhebel", "Winkel_ist", "°"),
        "theta_dot": ("Stellhebel", "Winkelgeschw_ist", "°/s"),
        "z_ddot": ("Schwingung", "a_z", "m/s²"),
        "tau_m": ("Stellhebel", "Drehmoment_ist", "Nm"),
    },
    {
        "theta": ("TLM_07", "CH_A", "deg"),
        "theta_dot": ("TLM_07", "CH_B", "deg/s"),
        "z_ddot": ("TLM_09", "CH_G", "g"),
        "tau_m": ("TLM_08", "CH_F", "Nm"),
    },
    {
        "theta": ("HOTAS_L", "ThrottleLeverAngle", "deg"),
        "theta_dot": ("HOTAS_L", "ThrottleLeverRate", "deg/s"),
        "z_ddot": ("IMU_COCKPIT", "LinAccZ", "m/s^2"),
        "tau_m": ("HOTAS_L", "FFBTorque", "mNm"),
    },
    {
        "theta": ("ECU_INC", "x_deg", "deg"),
        "theta_dot": ("ECU_INC", "v_dps", "deg/s"),
        "z_ddot": ("ECU_VIB", "vib_floor_g", "g"),
        "tau_m": ("ECU_INC", "T_mot", "Ncm"),
    },
    {
        "theta": ("COLLCTL", "POSITION", "mrad"),
        "z_ddot": ("ACCZ", "VALUE", "mg"),
        "tau_m": ("MTRCTL", "TORQUE_ACT", "Nm"),
    },
    {
        "theta": ("LevierPasGen", "Debattement", "deg"),
        "theta_dot": ("LevierPasGen", "VitAngulaire", "deg/s"),
        "z_ddot": ("CentraleInertielle", "FacteurChargeVertical", "g"),
        "tau_m": ("LevierPasGen", "CoupleEffort", "Nm"),
    },
    {
        "theta": ("Act_Coll_1", "shaft_angle", "rad"),
        "theta_dot": ("Act_Coll_1", "shaft_speed", "rad/s"),
        "z_ddot": ("Floor_Accel", "Z", "m/s2"),
        "tau_m": ("Act_Coll_1", "shaft_torque", "Nm"),
    },
]
"""Others, which no word of the proposal was chosen for."""

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
    ("MGB", "InputShaftTorque", "kNm"),
    ("CYCLIC_ACT", "RollServoTorque", "Nm"),
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
    "n m": 1.0,
    "ncm": 100.0,
    "mnm": 1e3,
    "in-lb": 1.0 / (4.4482216152605 * 0.0254),
    "m/s2": 1.0,
    "ft/s2": 1.0 / 0.3048,
    "dan": 0.1,
    "": 1.0,
}


_LEVELS = {
    "MastTorque": 8e3,
    "InputShaftTorque": 1.2,
    "RotorSpeed": 380.0,
    "AirSpeed": 60.0,
    "BaroAltitude": 500.0,
    "MotorTemperature": 60.0,
}


@dataclass(frozen=True)
class Field:
    """A signal in its frame."""

    message: str
    name: str
    unit: str
    values: FloatArray


def database(truth: Aircraft, seed: int, flight: Flight) -> tuple[str, list[Field], dict[str, str]]:
    """Return the text of a DBC, the values of its signals, and which are the inputs."""
    chance = random.Random(seed)
    noise = np.random.default_rng(seed)
    measured = {
        "theta": flight.theta,
        "theta_dot": flight.theta_dot,
        "z_ddot": (flight.z_ddot + GRAVITY) * (-1.0 if "down" in truth["z_ddot"][1] else 1.0),
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
    """Return what values in SI are multiplied by to be in a unit of AIRCRAFT."""
    return _PER_SI.get(unit.lower().removesuffix("/s"), 1.0)


def _other(name: str, flight: Flight, noise: np.random.Generator) -> FloatArray:
    """Something plausible that has nothing to do with the lever."""
    count = len(flight.time)
    if name == "AliveCounter":
        return np.arange(count, dtype=np.float64) % 1000.0
    slow = np.cumsum(noise.normal(0.0, 0.01, count))
    level = _LEVELS.get(name, 0.0)
    size = {"LongAcc": 0.05, "LatAcc": 0.05}.get(name, 1.0)
    values: FloatArray = level + size * (slow + noise.normal(0.0, 0.05, count))
    return values
