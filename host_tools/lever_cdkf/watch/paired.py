"""The last seconds of base acceleration and lever angle as they were on the bus, and their measured coherence."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..can import codec, fields
from ..numeric.arrays import FloatArray
from ..results.coherence import Coherence

SPAN = 20.0
"""[s] that the coherence is measured over."""
_REFRESH = 1.0  # [s]
_LEVER = codec.message("LEVER_SAMPLE").frame_id
_BASE = codec.message("BASE_SAMPLE").frame_id
_WINDOWS_LEAST = 5


class Measured(NamedTuple):
    """Coherence over frequency [Hz], and what chance alone stays below at 95 % of the frequencies."""

    frequency: FloatArray
    coherence: FloatArray
    chance: float


class Paired:
    """A LEVER_SAMPLE belongs to the next BASE_SAMPLE if that has the same counter. Lost samples are left out."""

    def __init__(self) -> None:
        self._lever: bytes | bytearray | None = None  # that waits for its BASE_SAMPLE
        self._pieces: deque[tuple[float, FloatArray]] = deque()  # when taken [s]; rows of time [us], z_ddot, theta
        self._measured: Measured | None = None
        self._measured_at = -np.inf

    def take(self, frames: Iterable[tuple[int, bytes | bytearray]], now: float) -> None:
        """Take what has come."""
        pairs: list[bytes] = []
        for identifier, data in frames:
            if identifier == _LEVER and len(data) == 8:
                self._lever = data
            elif identifier == _BASE and len(data) == 8:
                if self._lever is not None and (self._lever[1] ^ data[1]) & 15 == 0:
                    pairs.append(bytes(self._lever) + bytes(data))
                self._lever = None
        if pairs:
            self._pieces.append((now, _values(np.frombuffer(b"".join(pairs), dtype=np.uint8).reshape(-1, 16))))
        while self._pieces and now - self._pieces[0][0] > SPAN:
            self._pieces.popleft()

    def coherence(self, now: float) -> Measured | None:
        """Return the coherence of the last SPAN seconds, renewed each second; None while there is too little."""
        if now - self._measured_at >= _REFRESH or now < self._measured_at:
            self._measured_at = now
            self._measured = self._measure()
        return self._measured

    def _measure(self) -> Measured | None:
        if not self._pieces:
            return None
        rows = np.vstack([piece for _, piece in self._pieces])
        period = 1e-6 * float(np.median(np.diff(rows[:, 0]) % 2**32)) if len(rows) > 1 else 0.0
        if period <= 0.0:
            return None
        coherence = Coherence(period)
        coherence.add(rows[:, 1], rows[:, 2])
        return Measured(*coherence.spectrum(), coherence.chance()) if coherence.windows >= _WINDOWS_LEAST else None


def _values(data: NDArray[np.uint8]) -> FloatArray:
    """Return time [us], z_ddot [m/s²] and theta [rad] of pairs of frames; NaN: not valid. A corrupt one has no row."""
    lever, base = np.ascontiguousarray(data[:, :8]), np.ascontiguousarray(data[:, 8:])
    good = codec.check_columns("LEVER_SAMPLE", lever) & codec.check_columns("BASE_SAMPLE", base)
    of_lever, of_base = fields.columns("LEVER_SAMPLE", lever), fields.columns("BASE_SAMPLE", base)
    columns = [of_base["time_us"]]
    for decoded, name in ((of_base, "z_ddot"), (of_lever, "theta")):
        columns.append(np.where(decoded[f"{name}_valid"] != 0.0, decoded[name], np.nan))
    return np.column_stack(columns)[good]
