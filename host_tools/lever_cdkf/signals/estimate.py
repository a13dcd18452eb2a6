"""estimate(): the firmware's estimator on whatever holds samples in Python."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import LeverError
from ..firmware.config import Config, given
from ..firmware.estimator import run_samples
from ..numeric.derivative import in_degrees
from .arrays import columns_of, signals_by_input
from .inputs import recorded_samples, understood
from .mapping import Source
from .recorded import Signal
from .resample import at_period
from .result import Result
from .units import KINDS, guess


def estimate(
    samples: Any,
    config: Config | None = None,
    units: Mapping[str, str] | None = None,
    *,
    names: Mapping[str, str] | None = None,
) -> Result:
    """Return the pilot's parameters, with their standard deviations, from recorded samples.

    Parameters
    ----------
    samples
        A frame of pandas or polars, a Dataset of xarray, or a mapping of arrays, with the columns time [s], theta
        [rad], theta_dot [rad/s], z_ddot [m/s²], tau_m [N m], grip_force [N]; z_ddot and one of theta and theta_dot are
        needed. NaN and null are missing. Time may be an index or coordinate, and dates. Gravity in z_ddot is recognised
        and subtracted.
    config
        The estimator's; its sample_period becomes that of the samples, unless it has one that is not the default.
    units
        Of columns that are not in SI, {"theta": "deg", "z_ddot": "g", "time": "ms"}. A unit in a column's name
        (theta_deg, "theta [deg]") or in xarray's attribute `units` counts too.
    names
        Of columns that are called otherwise, {"theta": "LvrAngle"}.

    Returns
    -------
    Result
        All estimates at each sample, named, with units and standard deviations.

    Raises
    ------
    LeverError
        An input is missing, or plainly in another unit than is said, or than SI where none is said; it is named.
    """
    config = given(config)
    for option, value in (("units", units), ("names", names)):
        if not isinstance(value, Mapping | None):
            raise LeverError(f"{option} = {value!r}: give them by input, as {{'theta': …}}")
    columns = columns_of(samples)
    for key, name in (names or {}).items():
        if key not in KINDS or name not in columns:
            raise LeverError(f"names: {key} = {name}: keys are {', '.join(KINDS)}, and columns {', '.join(columns)}")
        columns[key] = columns.pop(name)
    signals = signals_by_input(columns, units or {})
    signals = {key: signal for key, signal in signals.items() if np.isfinite(signal.values).any()}
    if "z_ddot" not in signals or not signals.keys() & {"theta", "theta_dot"}:
        raise LeverError(
            f"samples have values of {', '.join(signals) or 'no input'}: z_ddot and one of theta and theta_dot are "
            f"needed; names={{'theta': 'column'}} says which they are, of {', '.join(columns)}"
        )
    _check_units(signals)
    sources = {key: Source(signal.name, signal.unit or KINDS[key][1]) for key, signal in signals.items()}
    taken, notes = recorded_samples({key: understood(key, sources[key], signal) for key, signal in signals.items()})
    config = at_period(config, taken.period)
    return Result(config, taken.time_us, run_samples(config, taken.arrays()), tuple(notes))


def _check_units(signals: Mapping[str, Signal]) -> None:
    """Raise LeverError for values without a unit that do not look like SI."""
    unsaid = {key: signal for key, signal in signals.items() if not signal.unit}
    for key in ("theta", "theta_dot", "z_ddot"):
        if key in unsaid and np.isfinite(unsaid[key].values).any():
            _check_unit(key, unsaid[key])
    if {"theta", "theta_dot"} <= unsaid.keys() and (found := in_degrees(signals["theta"], signals["theta_dot"])):
        key, why = found
        unit = {"theta": "deg", "theta_dot": "deg/s"}[key]
        raise LeverError(f"{why}: units={{'{key}': '{unit}'}} says so")


def _check_unit(key: str, signal: Signal) -> None:
    try:
        unit, why = guess(key, signal.values)
    except LeverError:  # an acceleration without gravity may well be in SI
        return
    if unit not in (KINDS[key][1], "m/s^2"):
        word = {"deg": "degrees", "deg/s": "degrees a second", "g": "g"}[unit]
        raise LeverError(f"{signal.name}: {why}: it looks like {word}: units={{'{key}': '{unit}'}} says so")
