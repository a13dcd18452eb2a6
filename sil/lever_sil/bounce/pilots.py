"""The pilots of the flights, as tables [pilot] of a scenario: random arms about the firmware's first guess."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..batch.motions import arms

Table = dict[str, Any]

SLACK = 18.0
"""c_p of an arm that hangs on the lever [N s/m]."""
TAUT = 42.0
WANDERING, GRIPPING, MOVING = range(3)
"""Of steady_or_not()."""


def arm(seed: int, c_p: float | None = None) -> dict[str, float]:
    """m_p [kg], c_p [N s/m], k_p [N/m] and trim [rad] of a pilot; each seed is another."""
    values = dict(zip(("m_p", "c_p", "k_p", "trim"), (float(each[0, 0]) for each in arms([seed])), strict=True))
    return values if c_p is None else values | {"c_p": c_p}


def table(values: Mapping[str, float]) -> Table:
    """With units."""
    units = {"m_p": "kg", "c_p": "N s/m", "k_p": "N/m", "trim": "rad"}
    return {name: f"{value} {units[name]}" for name, value in values.items()}


def relaxing(seed: int, start: float = 10.0, duration: float = 30.0) -> Table:
    """c_p falls."""
    ramp = {"kind": "ramp", "first": f"{TAUT} N s/m", "last": f"{SLACK} N s/m"}
    return table(arm(seed)) | {"c_p": ramp | {"start": f"{start} s", "duration": f"{duration} s"}}


def restless(seed: int, duration: float) -> Table:
    """In turn one whose arm wanders, one who changes his grip each quarter of a minute, and one who moves the lever."""
    pilot, random = arm(seed), np.random.default_rng([seed, 11])
    written, kind = table(pilot), seed % 3
    if kind == WANDERING:
        for name in ("m_p", "c_p", "k_p"):
            unit = written[name].partition(" ")[2]
            least, greatest = f"{0.6 * pilot[name]} {unit}", f"{1.6 * pilot[name]} {unit}"
            written[name] = {"kind": "random_walk", "first": written[name], "rate": "0.03 1/sqrt(s)"}
            written[name] |= {"least": least, "greatest": greatest}
    elif kind == GRIPPING:
        times = [f"{15.0 * (i + 1) + random.uniform(0.0, 5.0)} s" for i in range(int(duration / 15.0))]
        factors = np.exp(random.uniform(np.log(0.6), np.log(1.6), len(times)))
        for name, unit in (("c_p", "N s/m"), ("k_p", "N/m")):
            values = [f"{pilot[name] * factor} {unit}" for factor in factors.tolist()]
            written[name] = {"kind": "steps", "first": written[name], "at": times, "to": values}
    else:
        moves = {"kind": "noise", "mean": written["trim"], "rms": "1.5 deg", "low": "0.05 Hz", "high": "0.5 Hz"}
        written["trim"] = moves
    return written


def gripping(seed: int, at: float, factor: float) -> Table:
    """Return a slack arm that tightens suddenly."""
    pilot = arm(seed, SLACK)
    written = table(pilot)
    for name, unit in (("c_p", "N s/m"), ("k_p", "N/m")):
        ramp = {"kind": "ramp", "first": written[name], "last": f"{factor * pilot[name]} {unit}"}
        written[name] = ramp | {"start": f"{at} s", "duration": "0.05 s"}
    return written
