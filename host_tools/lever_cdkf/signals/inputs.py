"""Recorded signals as inputs of the firmware: in its units, without gravity, on its clock; and what was guessed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..errors import LeverError
from ..numeric.derivative import derivative_ratio, in_degrees
from ..results.summary import MappedSignal
from ..text.units import GRAVITY
from .mapping import Source
from .recorded import Signal
from .resample import Samples, sample
from .units import KINDS, check_plausible, factor, gravity_in, guess, level_in

_FASTER = 1.5
"""Periods of a signal in one of the samples from which on it is told that some of it is not used."""


@dataclass(frozen=True)
class Input:
    """One input as it was understood."""

    signal: Signal
    """In the firmware's unit."""
    source: Source
    """With everything that was left open decided."""
    notes: tuple[str, ...]
    """What was guessed, for the user to see."""

    def summary(self, samples: Samples, key: str) -> MappedSignal:
        """Return what summary.json says of it."""
        return MappedSignal(
            signal=self.signal.name,
            unit=self.source.unit,
            factor=self.source.factor,
            offset=self.source.offset,
            sign=self.source.sign,
            gravity=self.source.gravity,
            channel=self.source.channel,
            delay_s=self.source.delay,
            rate_hz=float(f"{1.0 / self.signal.period:.4g}"),
            sampled=samples.how[key],
            missing=int(np.isnan(samples.columns[key]).sum()),
        )


def understood(key: str, source: Source, signal: Signal) -> Input:
    """Return a signal as the input `key`. Raise LeverError."""
    name = source.signal
    if not np.isfinite(signal.values).any():
        raise LeverError(f"{key} = {name}: the log has no valid value of it")
    notes: list[str] = []
    unit, scale = _scale(key, source, signal, notes)
    values = signal.values * scale + source.offset
    if key == "z_ddot" and source.factor is None and abs(level_in(values) - 1.0) < 0.15:
        level = level_in(values)
        odd = f"z_ddot = {name}: it is said to be in {unit}, but rests at {level:.2f} m/s², as gravity in g does"
        if not source.unit:
            raise LeverError(f"{odd}: say unit=g, or unit={unit} if that is right")
        notes.append(odd)
    sign, gravity = source.sign or 1, source.gravity
    if key == "z_ddot" and gravity == "auto":
        direction = gravity_in(values)
        gravity = "included" if direction else "none"
        if source.sign is None and direction < 0:
            sign = -1
            notes.append(f"z_ddot = {name}: it rests at {-GRAVITY:.3g} m/s², so it points down and is turned (sign=-1)")
        if direction:
            notes.append(f"z_ddot = {name}: gravity is in it, and is subtracted (gravity=included)")
    values = sign * values
    if gravity == "included":
        values = values - GRAVITY
    check_plausible(key, name, values)
    converted = replace(signal, time=signal.time - source.delay, values=values, unit=KINDS[key][1])
    decided = replace(source, unit=unit, sign=sign, gravity=gravity if key == "z_ddot" else "none")
    return Input(converted, decided, tuple(notes))


def _scale(key: str, source: Source, signal: Signal, notes: list[str]) -> tuple[str, float]:
    """Return the unit of the recorded values, and their factor to the firmware's. Raise LeverError."""
    if source.factor is not None:
        return "", source.factor
    unit = source.unit or signal.unit
    if unit:
        scale = factor(key, unit)
        if scale is None:
            what, si = KINDS[key]
            raise LeverError(
                f"{key} = {source.signal}: it is in {unit}, which is no unit of {what} known here: "
                f"map another signal, or say unit= or factor= (to {si})"
            )
        return unit, scale
    try:
        unit, why = guess(key, signal.values)
    except LeverError as error:
        raise LeverError(f"{key} = {source.signal}: {error}") from None
    scale = factor(key, unit)
    assert scale is not None
    notes.append(f"{key} = {source.signal}: no unit is said; taken as {unit}, since {why}")
    return unit, scale


def recorded_samples(inputs: Mapping[str, Input], clock: str | None = None) -> tuple[Samples, list[str]]:
    """samples_of() a recording, in which every sensor moves. Raises LeverError for one that never does."""
    still = {key: each for key, each in inputs.items() if not each.signal.changes()}
    for key, each in still.items():
        if key != "tau_m":
            level = f"{level_in(each.signal.values):.4g} {KINDS[key][1]}"
            raise LeverError(
                f"{key} = {each.signal.name}: it is {level} throughout, so it is no measurement: map another signal, "
                "or another part of the recording"
            )
    samples, notes = samples_of(inputs, clock)
    return samples, [*(f"{key} = {each.signal.name}: it never changes" for key, each in still.items()), *notes]


def samples_of(inputs: Mapping[str, Input], clock: str | None = None) -> tuple[Samples, list[str]]:
    """Return the samples of all inputs, and notes for the user. Raise LeverError."""
    samples = sample({key: each.signal for key, each in inputs.items()}, clock)
    notes = [note for each in inputs.values() for note in each.notes]
    for key, how in samples.how.items():
        period = inputs[key].signal.period
        rates = f"{key} comes at {1.0 / period:.4g} Hz, {samples.clock} and samples at {1.0 / samples.period:.4g} Hz"
        if how == "slower":
            notes.append(f"{rates}: it is missing in between (--clock {key} samples at its rate)")
        elif period * _FASTER < samples.period:
            notes.append(f"{rates}: its values in between are not used (--clock {key} uses them)")
    if samples.disordered:
        notes.append(
            f"{samples.disordered:,} values are left out, since they come no later than the one before them: the "
            "recorder's time stamps are coarse, or go back"
        )
    return samples, notes + _disagreement(inputs, samples)


def _disagreement(inputs: Mapping[str, Input], samples: Samples) -> list[str]:
    """Return a note where the angular rate is not the slope of the angle: one of their signs or factors is wrong.

    Raise LeverError where one of them is in degrees and is taken as radians.
    """
    if not {"theta", "theta_dot"} <= inputs.keys():
        return []
    if found := in_degrees(inputs["theta"].signal, inputs["theta_dot"].signal):
        key, why = found
        raise LeverError(f"{why}: map {key} with unit={'deg' if key == 'theta' else 'deg/s'}")
    ratio = derivative_ratio(inputs["theta"].signal, inputs["theta_dot"].signal)
    names = f"theta_dot = {inputs['theta_dot'].signal.name} and theta = {inputs['theta'].signal.name}"
    if ratio < 0.0:
        return [f"{names}: the rate is minus the slope of the angle: one of them needs sign=-1"]
    if ratio and not 0.5 < ratio < 2.0:
        return [f"{names}: the rate is {ratio:.3g} times the slope of the angle: one of them is in another unit"]
    return []
