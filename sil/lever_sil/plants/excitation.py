"""What shakes the lever: base acceleration [m/s^2], identification torque and disturbances [N m].

Each class is one kind of [[base]], [[torque]] or [[disturbance]] table in a scenario. It acts from `start` to `end`;
outside it is zero.
The rms over that window is exact, whatever the kind and the seed: the waveform is scaled to it. `rms` and `amplitude`
are in the unit of what is excited.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray

from ..toml_tables import SIGNAL, quantity, read_kind, whole, wholes
from .window import Window


@dataclass(frozen=True, kw_only=True)
class Excitation(Window, ABC):
    """Something that acts in its window."""

    def samples(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the signal at the evenly spaced times `time` [s]."""
        first, last = np.searchsorted(time, (self.start, self.end))
        signal = np.zeros_like(time)
        if first < last:
            signal[first:last] = self.scaled(time[first:last] - self.start, rng)
        return signal

    @abstractmethod
    def scaled(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the signal inside its window; `time` [s] counts from the first sample in it."""


@dataclass(frozen=True, kw_only=True)
class Normalised(Excitation):
    """Any waveform, scaled to `rms`."""

    rms: float = quantity(SIGNAL, least=0.0)

    def scaled(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the waveform inside its window, scaled so that its rms is exactly `rms`."""
        wave = self.waveform(time, rng)
        power = float(np.mean(np.square(wave)))
        return wave * (self.rms / math.sqrt(power)) if power > 0.0 else wave

    @abstractmethod
    def waveform(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the signal but for its scale."""


@dataclass(frozen=True, kw_only=True)
class Sine(Normalised):
    """One frequency."""

    frequency: float = quantity("Hz", above=0.0)
    phase: float = quantity("rad", 0.0)

    def waveform(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return a sine of `frequency` [Hz] and `phase` [rad]."""
        return np.sin(2.0 * math.pi * self.frequency * time + self.phase)


@dataclass(frozen=True, kw_only=True)
class Band(Normalised):
    """What fills a band of frequencies."""

    low: float = quantity("Hz", above=0.0)
    high: float = quantity("Hz", above=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.low < self.high:
            raise ValueError(f"low {self.low:g} Hz is not below high {self.high:g} Hz")


@dataclass(frozen=True, kw_only=True)
class Multisine(Band):
    """`lines` equally strong, equally spaced sines from `low` to `high`.

    They have Schroeder's phases phi_n = -pi n (n - 1) / lines (IEEE Trans. Inf. Theory 16, 1970), which keep the crest
    factor near that of one sine.
    """

    lines: int = whole(10, least=2, greatest=1000)

    def waveform(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return cosines evenly spaced in frequency, with Schroeder's phases for a low crest factor."""
        number = np.arange(1, self.lines + 1)
        phase = -math.pi * number * (number - 1) / self.lines
        wave = np.zeros_like(time)
        for frequency, shift in zip(np.linspace(self.low, self.high, self.lines), phase, strict=True):
            wave += np.cos(2.0 * math.pi * frequency * time + shift)
        return wave


@dataclass(frozen=True, kw_only=True)
class Chirp(Band):
    """A sine whose frequency goes from `low` to `high` in `sweep` seconds and back, evenly in its logarithm."""

    sweep: float = quantity("s", above=0.0)

    def waveform(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return a sine whose frequency sweeps up and down exponentially, `sweep` [s] each way."""
        turns = time / self.sweep
        rise = 1.0 - np.abs(1.0 - np.mod(turns, 2.0))
        frequency = self.low * (self.high / self.low) ** rise
        phase = np.zeros_like(time)
        phase[1:] = np.cumsum(math.pi * (frequency[1:] + frequency[:-1]) * np.diff(time))
        return np.sin(phase)


@dataclass(frozen=True, kw_only=True)
class Noise(Band):
    """Gaussian noise, white from `low` to `high` and exactly nothing outside."""

    def waveform(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return Gaussian noise with a flat spectrum from `low` to `high` [Hz]."""
        if len(time) < 2:
            return np.zeros_like(time)
        frequency = np.fft.rfftfreq(len(time), float(time[1] - time[0]))
        band = slice(*np.searchsorted(frequency, (self.low, np.nextafter(self.high, math.inf))))
        real, imaginary = rng.standard_normal((2, len(frequency)))
        spectrum = np.zeros(len(frequency), np.complex128)
        spectrum[band] = real[band] + 1j * imaginary[band]
        return np.fft.irfft(spectrum, len(time))


@dataclass(frozen=True, kw_only=True)
class GaussMarkov(Normalised):
    """First-order Gauss-Markov noise: correlation exp(-|t| / correlation_time); slow, without a lowest frequency."""

    correlation_time: float = quantity("s", above=0.0)

    def waveform(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return a stationary first-order Gauss-Markov process of unit variance."""
        step = float(time[1] - time[0]) if len(time) > 1 else 0.0
        left = math.exp(-step / self.correlation_time)
        white = math.sqrt(1.0 - left * left) * rng.standard_normal(len(time))
        white[0] = rng.standard_normal()
        return np.array(list(accumulate(white, lambda last, new: left * last + new)))


@dataclass(frozen=True, kw_only=True)
class Rotor(Normalised):
    """Vibration at multiples of the rotor's frequency (N/rev), equally strong, each with a phase of its own."""

    rotor_frequency: float = quantity("Hz", above=0.0)
    harmonics: tuple[int, ...] = wholes(1, 64)

    def waveform(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the harmonics of the rotor with equal amplitudes and random phases."""
        wave = np.zeros_like(time)
        for harmonic, phase in zip(self.harmonics, rng.uniform(0.0, 2.0 * math.pi, len(self.harmonics)), strict=True):
            wave += np.sin(2.0 * math.pi * harmonic * self.rotor_frequency * time + phase)
        return wave


@dataclass(frozen=True, kw_only=True)
class Pulses(Excitation):
    """Rectangular pulses of `amplitude` and `width`, one each `period`, in turn up and down."""

    amplitude: float = quantity(SIGNAL)
    width: float = quantity("s", above=0.0)
    period: float = quantity("s", above=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.width > self.period:
            raise ValueError(f"width {self.width:g} s is longer than period {self.period:g} s")

    def scaled(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return pulses of `amplitude`, one a period, with alternating signs."""
        step = float(time[1] - time[0]) if len(time) > 1 else 1.0
        sample = np.arange(len(time))
        period, width = max(1, round(self.period / step)), round(self.width / step)
        sign = np.where((sample // period) % 2 == 0, 1.0, -1.0)
        return self.amplitude * sign * (sample % period < width)


KINDS: dict[str, type[Excitation]] = {
    "sine": Sine,
    "multisine": Multisine,
    "chirp": Chirp,
    "noise": Noise,
    "gauss_markov": GaussMarkov,
    "rotor": Rotor,
    "pulses": Pulses,
}

read_excitation = read_kind(KINDS)


def total(excitations: Sequence[Excitation], time: FloatArray, rngs: Sequence[np.random.Generator]) -> FloatArray:
    """Return the sum of `excitations` at the times `time` [s], each with its own random stream of `rngs`."""
    signal = np.zeros_like(time)
    for excitation, rng in zip(excitations, rngs, strict=True):
        signal += excitation.samples(time, rng)
    return signal
