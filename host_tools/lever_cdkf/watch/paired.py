"""The last seconds of base acceleration and lever angle as they were on the bus, and their measured coherence."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..can import codec
from ..can.bulk import FRAME
from ..can.estimator_frames import Pairing
from ..numeric.arrays import FloatArray
from ..results.coherence import Coherence

SPAN = 20.0
"""[s] that the coherence is measured over."""
_REFRESH = 1.0  # [s]
_SAMPLES = [codec.message(name).frame_id for name in ("LEVER_SAMPLE", "BASE_SAMPLE")]
_WINDOWS_LEAST = 5


class Measured(NamedTuple):
    """Coherence over frequency [Hz], and what chance alone stays below at 95 % of the frequencies."""

    frequency: FloatArray
    coherence: FloatArray
    chance: float


class Paired:
    """Samples with their angle; what has none, because its LEVER_SAMPLE was lost or not valid, is left out."""

    def __init__(self) -> None:
        self._pairing = Pairing()
        self._pieces: deque[tuple[float, FloatArray]] = deque()  # when taken [s]; rows of time [us], z_ddot, theta
        self._measured: Measured | None = None
        self._measured_at = -np.inf

    def take(self, frames: Iterable[tuple[int, bytes | bytearray]], now: float) -> None:
        """Take what has come."""
        samples = [(identifier, data) for identifier, data in frames if identifier in _SAMPLES and len(data) == 8]
        packed = np.zeros(len(samples), FRAME)
        packed["id"], packed["length"] = [identifier for identifier, _ in samples], 8
        packed["data"] = np.frombuffer(b"".join(data for _, data in samples), np.uint8).reshape(-1, 8)
        columns = self._pairing.add(packed)
        rows = np.column_stack([columns[name] for name in ("time_us", "z_ddot", "theta")])
        if len(rows):
            self._pieces.append((now, rows[np.isfinite(rows[:, 2])]))
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
        period = 1e-6 * float(np.median(np.diff(rows[:, 0]))) if len(rows) > 1 else 0.0
        if period <= 0.0:
            return None
        coherence = Coherence(period)
        coherence.add(rows[:, 1], rows[:, 2])
        return Measured(*coherence.spectrum(), coherence.chance()) if coherence.windows >= _WINDOWS_LEAST else None
