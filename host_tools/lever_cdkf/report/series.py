"""Columns made fit for a page: fewer points, spectra, changes, and the bands that chance alone would give."""

import base64

import numpy as np
from numpy.typing import NDArray

from ..numeric.arrays import Array
from ..numeric.windows import Windows, hann, transform


def packed(values: Array) -> dict[str, object]:
    """Return a column as plotly.js reads typed arrays: four bytes a value instead of ten characters; NaN is a gap."""
    array = np.asarray(values, dtype="<f4")
    text = base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
    spec: dict[str, object] = {"dtype": "f4", "bdata": text}
    if array.ndim == 2:
        spec["shape"] = f"{array.shape[0]},{array.shape[1]}"
    return spec


def coarse(values: Array, bits: int = 14) -> Array:
    """To so many binary digits, for colours: what compresses well."""
    mantissa, exponent = np.frexp(values)
    rounded: Array = np.ldexp(np.round(np.ldexp(mantissa, bits)), exponent - bits)
    return rounded


def spread_indices(count: int, most: int, keep: NDArray[np.intp] | None = None) -> NDArray[np.intp]:
    """At most `most` evenly spread indices of 0 … count-1, and `keep` with the one before each."""
    even: NDArray[np.intp] = np.linspace(0, count - 1, min(count, most)).round().astype(np.intp)
    if keep is None or not keep.size:
        return even
    return np.unique(np.concatenate((even, keep, np.maximum(keep - 1, 0))))


def envelope(time: Array, values: Array, buckets: int = 1000) -> tuple[Array, Array]:
    """Return least and greatest value of each of `buckets` stretches of time, in turn: a dense curve as seen from afar.

    A short column is returned as it is. A stretch without any value gives NaN.
    """
    size = -(-len(values) // buckets)
    if size < 3:
        return time, values
    padding = -len(values) % size
    rows = np.concatenate((values, np.full(padding, np.nan))).reshape(-1, size)
    empty = np.isnan(rows).all(axis=1)
    low = np.where(empty, np.nan, np.fmin.reduce(rows, axis=1))
    high = np.where(empty, np.nan, np.fmax.reduce(rows, axis=1))
    start = time[::size]
    return np.repeat(start, 2), np.column_stack((low, high)).ravel()


def jumps(time: Array, columns: list[Array], relative: float = 0.02, apart: float = 0.05) -> list[float]:
    """Return times [s] at which a column steps by more than `relative` in one sample.

    Steps closer than `apart` are one.
    """
    if len(time) < 2:
        return []
    stepped = np.zeros(len(time) - 1, dtype=bool)
    for column in columns:
        scale = np.maximum(np.abs(column[:-1]), np.finfo(np.float64).tiny)
        stepped |= np.abs(np.diff(column)) > relative * scale
    moments: list[float] = []
    for moment in time[1:][stepped].tolist():
        if not moments or moment - moments[-1] > apart:
            moments.append(moment)
    return moments


class Welch:
    """One-sided power spectral density [unit²/Hz] of samples as they come: the mean over windows."""

    def __init__(self, sample_period: float, seconds: float = 4.0) -> None:
        self._period = sample_period
        self._windows = Windows(1, max(1, round(seconds / sample_period)))
        self._power = np.zeros(self._windows.length // 2 + 1)

    def add(self, values: Array) -> None:
        """Further samples."""
        self._power += (np.abs(self._windows.add(values)[0]) ** 2).sum(axis=0)

    def spectrum(self) -> tuple[Array, Array]:
        """Return frequencies [Hz] and density; of what there is, if that is shorter than a window."""
        length, power = self._windows.length, self._power / max(self._windows.count, 1)
        if not self._windows.count:
            length, power = self._windows.rest.shape[1], np.abs(transform(self._windows.rest)[0]) ** 2
        density = power * (self._period / float(np.sum(hann(length) ** 2)))
        density[1 : (length + 1) // 2] *= 2.0
        return np.fft.rfftfreq(length, self._period).astype(np.float64), density


def welch(values: Array, sample_period: float, seconds: float = 4.0) -> tuple[Array, Array]:
    """Return frequencies [Hz] and power spectral density of a whole column, by Welch."""
    averaged = Welch(sample_period, seconds)
    averaged.add(values)
    return averaged.spectrum()
