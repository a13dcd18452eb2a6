"""A flight of its own, by nothing of the project: pilot and lever in float64, recorded as others record theirs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import can
import cantools.database
import numpy as np
from cantools.database.can import Database
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LENGTH, MASS, CENTRE, INERTIA, OWN_DAMPING, OWN_STIFFNESS = 0.45, 1.2, 0.5, 0.020, 0.5, 5.0
GRAVITY = 9.80665
M_P, C_P, K_P = 2.5, 42.0, 1500.0
TRIM = math.radians(20.0)
NATURAL_FREQUENCY = math.sqrt(
    (LENGTH**2 * K_P * math.cos(TRIM) ** 2 + OWN_STIFFNESS) / (LENGTH**2 * (CENTRE**2 * MASS + M_P) + INERTIA)
) / (2.0 * math.pi)
"""Of the linearised lever at its trim [Hz]."""

FOREIGN = """VERSION ""
BU_: FCC INCEP AHRS

BO_ 2566844926 InceptorPosition: 8 INCEP
 SG_ LvrAngle : 7|16@0- (0.005,0) [-90|90] "deg" FCC
 SG_ LvrRate : 23|16@0- (0.05,0) [-1600|1600] "deg/s" FCC
 SG_ PosStatus : 39|8@0+ (1,0) [0|255] "" FCC

BO_ 837 AhrsAccel: 8 AHRS
 SG_ AccLong : 0|16@1- (0.0005,0) [-16|16] "g" FCC
 SG_ AccLat : 16|16@1- (0.0005,0) [-16|16] "g" FCC
 SG_ AccVert : 32|16@1- (0.0002,0) [-6|6] "g" FCC
 SG_ AccCounter : 48|4@1+ (1,0) [0|15] "" FCC

BO_ 300 EngineData: 8 FCC
 SG_ RotorSpeed : 0|16@1+ (0.01,0) [0|110] "%" FCC
 SG_ Torque : 16|16@1+ (0.01,0) [0|130] "%" FCC

VAL_ 837 AccVert -32768 "SNA" ;
"""
MAPPED = ("theta=InceptorPosition.LvrAngle", "theta_dot=InceptorPosition.LvrRate", "z_ddot=AhrsAccel.AccVert")


@dataclass(frozen=True)
class Flight:
    """What the sensors measured."""

    time: FloatArray
    theta: FloatArray
    theta_dot: FloatArray
    z_ddot: FloatArray

    def every(self, step: int) -> Flight:
        """Return a slower recording of the same."""
        return Flight(*(values[::step] for values in (self.time, self.theta, self.theta_dot, self.z_ddot)))


def fly(duration: float = 20.0, rate: float = 500.0, seed: int = 1) -> Flight:
    """Simulate a flight: base noise of 1 to 10 Hz and 0.15 g, no motor torque, white sensor noise."""
    random = np.random.default_rng(seed)
    substeps = max(1, round(2000.0 / rate))
    count, step = round(duration * rate) * substeps, 1.0 / (rate * substeps)
    spectrum = np.fft.rfft(random.normal(size=count))
    frequency = np.fft.rfftfreq(count, step)
    spectrum[(frequency < 1.0) | (frequency > 10.0)] = 0.0
    base = np.fft.irfft(spectrum, count)
    base *= 0.15 * GRAVITY / np.std(base)
    inertia = LENGTH**2 * (CENTRE**2 * MASS + M_P) + INERTIA
    static = CENTRE * MASS + M_P
    preload = math.sin(TRIM) + GRAVITY * static / (K_P * LENGTH)
    theta, rate_now = TRIM, 0.0
    angles, rates = np.empty(count), np.empty(count)
    for k in range(count):
        angles[k], rates[k] = theta, rate_now
        cos = math.cos(theta)
        torque = -(C_P * LENGTH**2 * cos**2 + OWN_DAMPING) * rate_now - GRAVITY * LENGTH * static * cos
        torque -= LENGTH**2 * K_P * (math.sin(theta) - preload) * cos + OWN_STIFFNESS * (theta - TRIM)
        torque -= LENGTH * static * cos * base[k]
        rate_now += step * torque / inertia
        theta += step * rate_now
    measured = slice(None, None, substeps)
    samples = count // substeps
    return Flight(
        np.arange(samples) / rate,
        angles[measured] + random.normal(0.0, 1e-3, samples),
        rates[measured] + random.normal(0.0, 1e-2, samples),
        base[measured] + random.normal(0.0, 0.02, samples),
    )


def messages(flight: Flight, start: float = 1000.0) -> list[can.Message]:
    """Return the frames of FOREIGN, with other traffic in between."""
    database = cantools.database.load_string(FOREIGN)
    assert isinstance(database, Database)
    frames: list[can.Message] = []
    degrees = np.degrees(np.column_stack((flight.theta, flight.theta_dot)))
    loads = 1.0 + flight.z_ddot / GRAVITY
    for k, time in enumerate((start + flight.time).tolist()):
        position = {"LvrAngle": float(degrees[k, 0]), "LvrRate": float(degrees[k, 1]), "PosStatus": 1}
        load = {"AccLong": 0.02, "AccLat": -0.01, "AccVert": float(loads[k]), "AccCounter": k % 16}
        sent = [("InceptorPosition", position, 0.0), ("AhrsAccel", load, 200e-6)]
        if k % 5 == 0:
            sent.append(("EngineData", {"RotorSpeed": 100.0, "Torque": 55.0}, 400e-6))
        for name, values, later in sent:
            message = database.get_message_by_name(name)
            data = message.encode(values)
            frames.append(_frame(message.frame_id, message.is_extended_frame, data, time + later))
        frames.append(_frame(0x7A1, False, bytes([k & 255] * 5), time + 600e-6))
    return frames


def _frame(identifier: int, extended: bool, data: bytes, time: float) -> can.Message:
    return can.Message(time, identifier, extended, data=data, channel=0)


def write_log(path: Path, frames: list[can.Message]) -> Path:
    """In the format of its name, by python-can."""
    with can.Logger(path) as logger:
        for frame in frames:
            logger(frame)
    return path


def as_decoded(flight: Flight) -> Flight:
    """Return the values after their rounding in the frames of FOREIGN."""
    return Flight(
        flight.time,
        np.radians(0.005 * np.rint(np.degrees(flight.theta) / 0.005)),
        np.radians(0.05 * np.rint(np.degrees(flight.theta_dot) / 0.05)),
        GRAVITY * (0.0002 * np.rint((1.0 + flight.z_ddot / GRAVITY) / 0.0002) - 1.0),
    )
