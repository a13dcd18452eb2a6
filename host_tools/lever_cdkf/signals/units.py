"""Units of the signals, in the many ways that people write them, as factors to SI; and what values look like."""

from __future__ import annotations

import math
import re

import numpy as np

from ..errors import LeverError
from ..numeric.arrays import FloatArray
from ..text.units import GRAVITY

KINDS = {
    "time": ("time", "s"),
    "theta": ("angle", "rad"),
    "theta_dot": ("angular rate", "rad/s"),
    "z_ddot": ("acceleration", "m/s²"),
    "tau_m": ("torque", "N m"),
    "grip_force": ("force", "N"),
}
"""What each input of the firmware is, and its unit there."""
INPUTS = tuple(name for name in KINDS if name != "time")

_DEGREE, _INCH, _FOOT, _POUND = math.pi / 180.0, 0.0254, 0.3048, 4.4482216152605
_FACTORS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "angle": {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": _DEGREE, "gon": math.pi / 200.0, "rev": 2.0 * math.pi},
    "acceleration": {"m/s2": 1.0, "mm/s2": 1e-3, "cm/s2": 1e-2, "ft/s2": _FOOT, "in/s2": _INCH, "g": GRAVITY},
    "torque": {"nm": 1.0, "mnm": 1e-3, "ncm": 1e-2, "knm": 1e3, "lbft": _POUND * _FOOT, "lbin": _POUND * _INCH},
    "force": {"n": 1.0, "mn": 1e-3, "dan": 10.0, "kn": 1e3, "lb": _POUND, "kgf": GRAVITY},
}
_FACTORS["acceleration"] |= {"g0": GRAVITY, "mg": 1e-3 * GRAVITY, "ug": 1e-6 * GRAVITY}
_FACTORS["torque"] |= {"ftlb": _POUND * _FOOT, "inlb": _POUND * _INCH}
_FACTORS["angular rate"] = {f"{angle}/s": factor for angle, factor in _FACTORS["angle"].items()}
_FACTORS["angular rate"] |= {"rpm": 2.0 * math.pi / 60.0, "deg/min": _DEGREE / 60.0}

_SPELLINGS = (
    (r"[\s\[\](){}·*._]|\^|⋅|(?<=[a-z])-(?=[a-z])", ""),
    (r"²", "2"),
    (r"s(-|⁻)(1|¹)", "/s"),
    (r"s(-|⁻)2", "/s2"),
    (r"µ|μ|micro", "u"),
    (r"°|º|degrees?|degs|degrés?|\bgrad\b", "deg"),
    (r"radians?|rads", "rad"),
    (r"milli", "m"),
    (r"seconds?|secs?", "s"),
    (r"newtonmet(er|re)s?", "nm"),
    (r"newtons?", "n"),
    (r"met(er|re)s?", "m"),
    (r"revolutions?|turns?", "rev"),
    (r"1/min|rev/min|u/min", "rpm"),
    (r"lbs?f?(?!t)", "lb"),
    (r"^dps$", "deg/s"),
    (r"(deg|rad|m)ps(2?)$", r"\1/s\2"),
    (r"/s/s", "/s2"),
    (r"per", "/"),
    (r"//", "/"),
)


def normal(unit: str) -> str:
    """Return a unit in one spelling: "m/s2" for "m/s^2", "[m/s²]" and "m/s/s"."""
    for pattern, spelling in _SPELLINGS:
        unit = re.sub(pattern, spelling, unit.lower())
    return unit


def factor(key: str, unit: str) -> float | None:
    """Return what values in `unit` are multiplied by to be in the firmware's.

    None for a unit that is none of this kind.
    """
    return _FACTORS[KINDS[key][0]].get(normal(unit))


def is_unit(unit: str) -> bool:
    """Return whether it is a unit of any kind."""
    return any(normal(unit) in factors for factors in _FACTORS.values())


def fitting(unit: str) -> set[str]:
    """Return the inputs that may be in this unit."""
    return {key for key in INPUTS if factor(key, unit) is not None}


def split_name(label: str) -> tuple[str, str]:
    """Return name and unit of a column's label: "Angle [deg]", "Angle (deg)", "angle_deg"; "" without."""
    label = label.strip()
    if bracketed := re.fullmatch(r"(.*\S)\s*[\[({](.*)[\])}]", label):
        return bracketed[1].strip(), bracketed[2].strip()
    parts = re.split(r"_+|\s+|/(?=\D*$)", label)
    for first in range(1, len(parts)):
        for joint in ("/", " "):
            unit = joint.join(parts[first:])
            if is_unit(unit) and (len(unit) > 1 or unit in "gsN"):
                return label, unit
    return label, ""


_SHAKEN = 0.7
"""Of the 99th percentile of an acceleration without a unit: above it g is not likely, below it m/s² is not."""

# --- what values look like -------------------------------------------------------------------------------------------


def guess(key: str, values: FloatArray) -> tuple[str, str]:
    """Return the unit that values without one are most likely in, and why. Raise LeverError where no guess is safe."""
    present = values[np.isfinite(values)]
    size = float(np.percentile(np.abs(present), 99.0)) if len(present) else 0.0
    level = abs(level_in(values))
    if key == "theta":
        return ("deg", f"angles reach {size:.3g}") if size > math.pi else ("rad", f"angles stay below {size:.2g}")
    if key == "theta_dot":
        return ("deg/s", f"rates reach {size:.3g}") if size > 20.0 else ("rad/s", f"rates stay below {size:.2g}")
    if key == "z_ddot":
        if abs(level - 1.0) < 0.15:
            return "g", f"it rests at {level:.2f}, which is gravity in g"
        if abs(level - GRAVITY) < 0.15 * GRAVITY:
            return "m/s^2", f"it rests at {level:.2f}, which is gravity in m/s²"
        raise LeverError("it has no unit and shows no gravity to tell it by: say unit=g or unit=m/s^2")
    return KINDS[key][1], "none is said"


def likely(key: str, values: FloatArray) -> tuple[str, str]:
    """As guess(), but where that refuses, the unit that a flight most likely has, for a person to confirm."""
    try:
        return guess(key, values)
    except LeverError:
        size = float(np.nanpercentile(np.abs(values), 99.0))
        in_si = size > _SHAKEN
        unit, other = ("m/s^2", "g") if in_si else ("g", "m/s^2")
        much = "more than a cabin shakes" if in_si else "less than anything can be learnt from"
        return unit, f"{size:.2g} {other} would be {much}"


def level_in(values: FloatArray) -> float:
    """Return what a signal rests at: its median."""
    present = values[np.isfinite(values)]
    return float(np.median(present)) if len(present) else 0.0


def gravity_in(values: FloatArray) -> int:
    """1 where an acceleration [m/s²] holds gravity, -1 where it does and points down, 0 where not."""
    level = level_in(values)
    return int(np.sign(level)) if abs(abs(level) - GRAVITY) < 0.15 * GRAVITY else 0


def check_plausible(key: str, name: str, values: FloatArray) -> None:
    """Raise LeverError for values [SI] that no lever and no aircraft has: the unit is another one."""
    present = values[np.isfinite(values)]
    if not len(present):
        return
    greatest, other = {
        "theta": (math.pi, "degrees (unit=deg)"),
        "theta_dot": (20.0, "degrees a second (unit=deg/s)"),
        "z_ddot": (80.0, "another unit, or not scaled"),
        "tau_m": (1000.0, "N mm, or not scaled"),
        "grip_force": (10000.0, "mN, or not scaled"),
    }[key]
    share = float(np.mean(np.abs(present) > greatest))
    if share > 0.01:
        raise LeverError(
            f"{key} = {name}: {100.0 * share:.0f} % of it is beyond ±{greatest:.3g} {KINDS[key][1]}: is it in {other}?"
        )
