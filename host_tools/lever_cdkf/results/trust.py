"""Whether the estimates of a run may be believed, why not, and what to do, in a line: what a reader sees first."""

from __future__ import annotations

from collections.abc import Mapping

from ..firmware.estimator import DO_NOT_TRUST, fault_names
from ..firmware.library import enum_words
from ..text.counts import in_percent
from .faults import LITTLE

MOST = 0.5
"""Share of the judged time with a warning, from which on the run as a whole is not to be trusted."""

TUNE = "tune"
_STEPS = {
    "clock": "check the time of the samples, and sample_period",
    "theta": "check the sensor of theta, its unit and its limits",
    "theta_dot": "check the sensor of theta_dot, its unit and its limits",
    "base": "check sign, unit and gravity of z_ddot",
    "torque": "check sign and unit of tau_m",
    "recovered": "check settings and first guess: the filter was restarted",
    "hands_off": "take the part in which somebody holds the lever (--start, --length)",
    "calibration": TUNE,
    "mismatch": TUNE,
    "innovation": TUNE,
    "bound": TUNE,
}
"""What to do about each of DO_NOT_TRUST, causes before what follows from them; TUNE stands for a command."""
EVIDENCE = {
    "clock": _STEPS["clock"],
    "torque_gain": "check the gain of the torque sensor (tau_m_gain), and whether the motor does what it is asked",
    "force": "check the gain of the grip sensor (grip_force_gain)",
    "calibration": TUNE,
}
"""The steps to take about each evidence that shows as calibration."""


def warning(shares: Mapping[str, float], warned: float | None, evidence: Mapping[str, float] | None = None) -> str:
    """Return what the estimator says against its estimates; empty where that is little.

    `shares` (0 to 1) are those of the judged time with each fault, `warned` that with any of DO_NOT_TRUST; `evidence`
    is that of calibration, as ratios.behind_calibration() says.
    """
    causes = _causes(shares)
    if not causes or warned is None or warned <= LITTLE:
        return ""
    listed = "; ".join(in_words(name, evidence, f"{in_percent(shares[name]):g} % of the time") for name in causes)
    part = "" if warned >= MOST else f" {in_percent(warned):g} % of the time"
    return f"Do not trust the estimates{part}: {listed}."


def in_words(fault: str, evidence: Mapping[str, float] | None, *more: str) -> str:
    """Return a fault in words, with `more` in brackets; of calibration also its evidence, or how to have that told."""
    notes = list(more)
    if fault == "calibration" and evidence is None:
        notes.append("set publish_test_ratios=1 to see the evidence")
    elif fault == "calibration" and evidence:
        notes.append(f"evidence: {', '.join(name.replace('_', ' ') for name in _greatest_first(evidence))}")
    return enum_words("lever_fault")[fault] + (f" ({'; '.join(notes)})" if notes else "")


def next_step(shares: Mapping[str, float], tune_command: str = "", evidence: Mapping[str, float] | None = None) -> str:
    """Return what to do about the first cause; `tune_command` tunes the log. Empty where there is nothing to do."""
    steps = _STEPS | ({"calibration": EVIDENCE[_greatest_first(evidence)[0]]} if evidence else {})
    causes = _causes(shares)
    greatest = max((shares[name] for name in causes), default=0.0)
    step = next((steps[name] for name in causes if shares[name] >= 0.5 * greatest), "")
    return tune_command if step == TUNE else step


def _greatest_first(evidence: Mapping[str, float]) -> list[str]:
    return sorted(evidence, key=lambda name: -evidence[name])


def _causes(shares: Mapping[str, float]) -> list[str]:
    return [name for name in _STEPS if shares.get(name, 0.0) > LITTLE]


assert set(_STEPS) == set(fault_names(DO_NOT_TRUST))
