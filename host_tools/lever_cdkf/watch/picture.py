"""The picture of the estimator that its frames make: last values, how old they are, counts, and a bounded history."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..can import codec, fields
from ..can.identity import Identity
from ..can.message_counts import MessageCounter
from ..firmware import quantities
from ..firmware.estimator import FEEDTHROUGH_FREQUENCIES, fault_names
from ..firmware.library import enum_names
from .paired import Measured, Paired

Frame = tuple[int, bytes | bytearray]
"""Identifier and data. Not the identifier of a classic data frame: FOREIGN and ERROR."""
FOREIGN, ERROR = -1, -2

NAN = math.nan
STEP = 0.1
"""[s] between two rows of the history."""
ROWS = 3000
"""Of the history: five minutes."""
STALE_AFTER = 2.0
"""[s] after which a value is not shown as present any more."""
FAULT_HOLD = 2.0
"""[s] that a fault stays, so that a short one can be read."""
_MEAN_WINDOW = 2.0  # [s] of the means and rms
_PATIENCE = 3.0  # [s] for an IDENTITY, which comes each second
_PLATFORM_COUNTS = dict.fromkeys(("bus_offs", "overruns", "dropped"), 1 << 8)
_WRAPS = fields.COUNTS | _PLATFORM_COUNTS
# Of the others the last frame tells all.
_EVERY = (
    *("STATE_ESTIMATE", "FEEDTHROUGH", "TEST_RATIO", "MOTOR_COMMAND", "HEALTH", "PLATFORM_HEALTH", "IDENTITY"),
    "COMMAND_ACK",
)


class Estimated(NamedTuple):
    """One of the things estimated; NaN is not known or too old."""

    key: str
    unit: str
    """"1" without one."""
    value: float
    sigma: float


class Feedthrough(NamedTuple):
    """θ/z̈ at one frequency; NaN is not known or too old."""

    frequency: int
    """[Hz]"""
    response: complex
    """[rad/(m/s²)]"""
    gain_sigma: float
    """Relative [1]."""
    phase_sigma: float
    """[rad]"""


class Picture:
    """Frames in by take(), the state of things out by its attributes; one thread.

    Times are seconds of the caller's, who says with every call what time it is.
    """

    def __init__(self) -> None:
        self.traffic = {entry.name: MessageCounter(entry.name) for entry in codec.database().messages}
        self._by_identifier = {entry.identifier: entry for entry in self.traffic.values()}
        self.clear_counts()
        self.now = 0.0
        self.model: str | None = None
        self.values: dict[str, dict[str, float]] = {}
        """The last value of every field, by message and field."""
        self.history: dict[str, deque[float]] = {}
        """Columns of equal length, a row each STEP: time, <key> and <key>_sigma of what is estimated, nis (mean),
        excitation, dither (rms), theta (mean)."""
        self._restart_history()
        self._faults: dict[str, float] = {}  # name: when last seen
        self._platform_faults: dict[str, float] = {}
        self._last_counts: dict[str, float] = {}
        self._windows = {name: _Window() for name in ("nis", "theta", "dither")}
        self.identity = Identity()
        """What the estimator says of itself."""
        self.acknowledgements: deque[dict[str, float]] = deque(maxlen=16)
        """Fields of each COMMAND_ACK; to be taken from here."""
        self._first_estimate: float | None = None
        self._ratios: dict[int, tuple[float, float]] = {}  # by evidence: when heard, and what
        self._feedthrough: dict[int, tuple[float, Feedthrough]] = {}  # by frequency: when heard, and what
        self._paired = Paired()

    def clear_counts(self) -> None:
        """All counts start again from 0."""
        for entry in self.traffic.values():
            entry.clear()
        self.foreign = 0
        self.error_frames = 0
        self.counts = dict.fromkeys(_WRAPS, 0)
        """What the estimator and its machine have counted since then."""

    def take(self, frames: Iterable[Frame], now: float) -> None:
        """Take what has come since the last call; also to be called when that is nothing."""
        self.now = now
        groups: dict[int, list[bytes | bytearray]] = {}
        frames = list(frames)
        self._paired.take(frames, now)
        for identifier, data in frames:
            groups.setdefault(identifier, []).append(data)
        for identifier, group in groups.items():
            entry = self._by_identifier.get(identifier)
            if entry is not None:
                good = entry.take(group, now)
                if good:
                    self._decode(entry.name, good)
            elif identifier == ERROR:
                self.error_frames += len(group)
            else:
                self.foreign += len(group)
        for entry in self.traffic.values():
            entry.tick(now)
        times = self.history["time"]
        if not times or now - times[-1] >= 0.99 * STEP or now < times[-1]:
            self._add_row()

    # --- what there is to see ----------------------------------------------------------------------------------------

    def age(self, name: str) -> float:
        """[s] since the last good frame of a message; infinite when there was none."""
        heard = self.traffic[name].heard
        return math.inf if heard is None else self.now - heard

    def is_fresh(self, name: str) -> bool:
        """Return whether a message has come within STALE_AFTER."""
        return self.age(name) <= STALE_AFTER

    def silence(self) -> float:
        """[s] since the estimator was heard; infinite: never."""
        return min(self.age(entry.name) for entry in self.traffic.values() if entry.sender == "ESTIMATOR")

    def field(self, message: str, name: str) -> float:
        """Return the last value of a field; NaN when there is none or it is too old."""
        return self.values[message][name] if self.is_fresh(message) and message in self.values else NAN

    def wrong_contract(self) -> str | None:
        """Return why what is shown may be misread.

        The estimator speaks another version of lever.dbc, or an unknown one.
        """
        contract = self.identity.contract
        if contract is not None:
            mismatch = f"contract {contract} of lever.dbc, this program {codec.contract()}: what is shown is wrong"
            return None if contract == codec.contract() else f"the estimator speaks {mismatch}"
        if self._first_estimate is None or self.now - self._first_estimate <= _PATIENCE:
            return None
        return "the estimator does not send its version (IDENTITY): if it is an old one, what is shown is wrong"

    def parameters(self) -> list[Estimated]:
        """Return the parameters of the model; none before it is known."""
        if self.model is None:
            return []
        return self._estimated(quantities.parameters(self.model), "PILOT_PARAMETERS", "PILOT_SIGMA")

    def dynamics(self) -> list[Estimated]:
        """Return natural frequency and damping ratio."""
        return self._estimated(quantities.DYNAMICS, "PILOT_DYNAMICS", "PILOT_DYNAMICS")

    def _estimated(self, shown: Iterable[quantities.Quantity], values: str, sigmas: str) -> list[Estimated]:
        return [
            Estimated(each.key, each.unit, self.field(values, each.key), self.field(sigmas, f"{each.key}_sigma"))
            for each in shown
        ]

    def feedthrough(self) -> list[Feedthrough]:
        """θ/z̈ at each frequency that is sent."""
        entries = []
        for frequency in FEEDTHROUGH_FREQUENCIES:
            heard, entry = self._feedthrough.get(frequency, (-math.inf, None))
            fresh = self.now - heard <= STALE_AFTER
            entries.append(entry if entry and fresh else Feedthrough(frequency, complex(NAN, NAN), NAN, NAN))
        return entries

    def test_ratios(self) -> dict[int, float]:
        """Return the statistics that were sent lately over their thresholds, by the number of their evidence."""
        return {key: ratio for key, (heard, ratio) in self._ratios.items() if self.now - heard <= STALE_AFTER}

    def coherence(self) -> Measured | None:
        """Measured, of base acceleration and lever angle over the last seconds; None while there is too little."""
        return self._paired.coherence(self.now)

    @property
    def mode(self) -> str | None:
        """A name of enum lever_mode; None when the estimator says nothing."""
        raw = self.field("HEALTH", "mode")
        return None if math.isnan(raw) else enum_names("lever_mode").get(int(raw), f"mode {int(raw)}")

    def faults(self) -> list[str]:
        """Return names of enum lever_fault that were seen lately."""
        return _recent(self._faults, self.now) if self.is_fresh("HEALTH") else []

    def platform_faults(self) -> list[str] | None:
        """Return names of enum lever_platform_fault that were seen lately; None when the machine reports nothing."""
        return _recent(self._platform_faults, self.now) if self.is_fresh("PLATFORM_HEALTH") else None

    def nis(self) -> float:
        """Return mean normalised innovation squared [1]."""
        return self._windows["nis"].mean(self.now)

    def theta(self) -> float:
        """Return mean lever angle [rad], about which the arm moves."""
        return self._windows["theta"].mean(self.now)

    def dither(self) -> float:
        """Rms of the identification torque [N m]; 0 when none is asked for."""
        mean_square = self._windows["dither"].mean(self.now)
        return 0.0 if math.isnan(mean_square) else math.sqrt(mean_square)

    # --- frames to values --------------------------------------------------------------------------------------------

    def _decode(self, name: str, frames: list[bytes | bytearray]) -> None:
        chosen = frames if name in _EVERY else frames[-1:]
        data = np.frombuffer(b"".join(chosen), dtype=np.uint8).reshape(-1, 8)
        columns = fields.columns(name, data)
        self.values[name] = {key: float(column[-1]) for key, column in columns.items()}
        if name == "PILOT_PARAMETERS":
            self._follow_model(int(self.values[name]["model"]))
        elif name == "STATE_ESTIMATE":
            self._first_estimate = self.now if self._first_estimate is None else self._first_estimate
            self._windows["nis"].add(self.now, columns["nis"])
            self._windows["theta"].add(self.now, columns["theta"])
        elif name == "MOTOR_COMMAND":
            self._windows["dither"].add(self.now, columns["dither"] ** 2)
        elif name == "HEALTH":
            self._note(self._faults, fault_names(_any_bit(columns["faults"])))
            self._count(("restarts",), columns)
        elif name == "LINK_HEALTH":
            self._count(("lost", "corrupt", "late"), columns)
        elif name in ("IDENTITY", "COMMAND_ACK", "FEEDTHROUGH", "TEST_RATIO"):
            for row in range(len(data)):
                self._take_once(name, {key: float(column[row]) for key, column in columns.items()})
        elif name == "PLATFORM_HEALTH":
            seen = _any_bit(columns["faults"])
            self._note(
                self._platform_faults, [n for bit, n in enum_names("lever_platform_fault").items() if seen & bit]
            )
            self._count(_PLATFORM_COUNTS, columns)

    def _take_once(self, name: str, values: dict[str, float]) -> None:
        if name == "IDENTITY":
            self.identity.take(values)
        elif name == "FEEDTHROUGH":
            frequency, response = int(values["frequency"]), complex(values["real"], values["imaginary"])
            sigmas = values["gain_sigma"], values["phase_sigma"]
            self._feedthrough[frequency] = self.now, Feedthrough(frequency, response, *sigmas)
        elif name == "TEST_RATIO":
            self._ratios[int(values["evidence"])] = self.now, values["ratio"]
        else:
            self.acknowledgements.append(values)

    def _follow_model(self, number: int) -> None:
        model = enum_names("lever_model").get(number)
        if model != self.model:
            self.model = model
            self._restart_history()

    def _note(self, faults: dict[str, float], names: Iterable[str]) -> None:
        faults.update(dict.fromkeys(names, self.now))

    def _count(self, names: Iterable[str], columns: dict[str, np.ndarray]) -> None:
        for name in names:
            raw = columns[name]
            last = self._last_counts.get(name, raw[0])
            self.counts[name] += int(np.sum(np.diff(raw, prepend=last) % _WRAPS[name]))
            self._last_counts[name] = float(raw[-1])

    # --- history -----------------------------------------------------------------------------------------------------

    def _restart_history(self) -> None:
        shown = quantities.quantities(self.model) if self.model else quantities.DYNAMICS
        estimated = [name for each in shown for name in (each.key, f"{each.key}_sigma")]
        names = ("time", *estimated, "nis", "excitation", "dither", "theta")
        self.history = {name: deque(maxlen=ROWS) for name in names}

    def _add_row(self) -> None:
        row = {"time": self.now, "nis": self.nis(), "theta": self.theta(), "dither": self.dither()}
        row["excitation"] = self.field("HEALTH", "excitation")
        for entry in (*self.parameters(), *self.dynamics()):
            row[entry.key], row[f"{entry.key}_sigma"] = entry.value, entry.sigma
        for name, column in self.history.items():
            column.append(row[name])


class _Window:
    """The mean over the last _MEAN_WINDOW seconds, from sums of batches."""

    def __init__(self) -> None:
        self._batches: deque[tuple[float, float, int]] = deque(maxlen=1000)  # time, sum, count

    def add(self, now: float, values: np.ndarray) -> None:
        finite = values[np.isfinite(values)]
        self._batches.append((now, float(np.sum(finite)), len(finite)))

    def mean(self, now: float) -> float:
        while self._batches and now - self._batches[0][0] > _MEAN_WINDOW:
            self._batches.popleft()
        count = sum(count for _, _, count in self._batches)
        return sum(total for _, total, _ in self._batches) / count if count else NAN


def _recent(faults: dict[str, float], now: float) -> list[str]:
    return [name for name, seen in faults.items() if now - seen <= FAULT_HOLD]


def _any_bit(faults: np.ndarray) -> int:
    return int(np.bitwise_or.reduce(faults.astype(np.int64)))
