"""The tables and constants of the requirements, as they stand in the texts: with units, and where each is from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from blind.flights import RATE

# enum lever_fault and enum lever_mode of lever_cdkf.h
THETA, THETA_DOT, TORQUE, BASE, GAP, INNOVATION, EXCITATION, BOUND = 1, 2, 4, 8, 16, 64, 128, 256
RECOVERED, CHANGE, CLOCK, SETTLING, MISMATCH, CALIBRATION, HANDS_OFF = 512, 1024, 4096, 16384, 32768, 65536, 131072
INIT, ALIGN, RUN, COAST, FROZEN, FAULT = range(6)
# R57
DO_NOT_TRUST = (
    THETA | THETA_DOT | TORQUE | BASE | CLOCK | INNOVATION | MISMATCH | CALIBRATION | BOUND | RECOVERED | HANDS_OFF
)


class Statistic(NamedTuple):
    """A row of the table of evidence that has a test ratio."""

    name: str
    off: float
    """Evidence is withdrawn below this ratio."""
    shows: int
    """Faults that it shows as."""


STATISTICS = (
    Statistic("motor", 0.714, TORQUE),
    Statistic("hands", 0.3, HANDS_OFF),
    Statistic("theta_stuck", 1.0, THETA),
    Statistic("theta_dot_stuck", 1.0, THETA_DOT),
    Statistic("base_stuck", 1.0, BASE),
    Statistic("base", 0.5, BASE),
    Statistic("noise", 0.433, INNOVATION),
    Statistic("change", 1.0, CHANGE),
    Statistic("innovation", 1.0, INNOVATION),
    Statistic("colour", 0.714, MISMATCH),
    Statistic("sticking", 0.6, MISMATCH),
    Statistic("calibration", 0.75, CALIBRATION),
    Statistic("force", -1.0, CALIBRATION),
    Statistic("kinematics", 0.5, THETA | THETA_DOT),
    Statistic("torque_gain", 0.7, CALIBRATION),
    Statistic("clock", 0.6, CALIBRATION),
)
APART = (5, 7)  # base, see shows_base(), and change, which is present from 0.29 s after one on
INDEX = {statistic.name: index for index, statistic in enumerate(STATISTICS)}


class Verdict(NamedTuple):
    """A row of the table of verdicts."""

    name: str
    because: tuple[str, ...]
    learn: bool = False
    torque: bool = True
    entry: str = ""
    exit: str = ""


VERDICTS = (
    Verdict("motor_wrong", ("motor",), torque=False, entry="restore"),
    Verdict("hands_off", ("hands",), torque=False, entry="restore", exit="open"),
    Verdict("sensor_wrong", ("theta_stuck", "theta_dot_stuck", "base_stuck", "base", "kinematics"), entry="restore"),
    Verdict("sticking", ("sticking",), entry="open"),
    Verdict("noise", ("noise",), entry="restore"),
    Verdict("blind", ("missing",)),
    Verdict("settling", ("unsettled",)),
    Verdict("rest", ("rest",)),
    Verdict("unexplained", ("unexplained",), learn=True, entry="open"),
    Verdict("regrip", ("regrip",), entry="inflate", exit="levels"),
    Verdict("new", ("new",), learn=True),
    Verdict("learning", (), learn=True),
)
RANK = {verdict.name: rank for rank, verdict in enumerate(VERDICTS)}
PRIOR = np.array([0.4, 0.6, 0.6])  # m_p_sigma, c_p_sigma, k_p_sigma: relative [1], lever_settings.def
LEAST, GREATEST = np.array([0.3, 2.0, 50.0]), np.array([10.0, 400.0, 6500.0])  # m_p, c_p, k_p: lever_settings.def
FIRST = np.array([2.5, 42.0, 1500.0])  # first guess of m_p, c_p, k_p: lever_settings.def
WALK = np.array([0.0075, 0.02, 0.02])  # m_p_walk, c_p_walk, k_p_walk [1/sqrt(s)]
CHANGE_WALK = 50.0  # [s] change_walk: what a change counts as
BLOCK = 20  # samples of a learn_period
CAUTION = RATE  # samples of caution_time, and "a change was within 1 s"
CONFIRMED = 290  # samples from a change until it counts, R58
REPORTED = 3 * RATE  # samples for which a change is reported, R6
TAKEN_BACK = 2 * RATE  # samples of which what a wrong sensor taught is taken back, R55
ALIGNED = 300  # samples of align_time
MANY = 10  # sentences of one kind that say enough
JUMPED = 1000  # guess: samples for which outputs may be refused that do not go on where the last have been
RESTED = 300  # samples that rest lasts after too little motion, app/README
UNCHANGED = 0.2  # guess: standard deviations by which an estimate may differ that R34 says is not changed
SPIKE = 20  # samples for which an input that has jumped is held, R31
GATE = 50  # samples within which torque ends, R37
LAST_OUTPUT = 20  # samples without an output that is believed until that forbids torque (the façade, app/README)
TORQUE_LIMIT, TORQUE_SLEW = 1.5, 200.0  # [N m], [N m/s] lever_settings.def, R36
FADED_IN = int(2.2 * RATE)  # samples until the dither has faded in (dither_fade 1 s) and a second of it is there

# Samples within which a fault must show. Where no requirement has a time, the time is a guess, and said to be one.
STUCK = 500  # R32
NOT_THE_INTEGRAL = 1000  # R33
NOT_FITTING = 2000  # R33
MOTOR = 2000  # R32; guess for what is not stuck, R55 has none
NOBODY = 2000  # guess: R7 has none; `lever envelope --list` aims at 1 s
GRIPPED = 2000  # guess: R6 has none
AT_REST = 2000  # guess: R56 has none; excitation_time is 1 s
SETTLED = 900  # guess: what it is from power-on; README, Limits, says "a second", R29 "the whole of their time"
