"""Rows of the estimator's samples as columns of the trace, a piece of the recording at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..can import fields
from ..can.bulk import RECORDED, SLOTS, Rows
from ..can.fields import COUNTS
from ..firmware.library import enum_names
from ..firmware.quantities import recorded_name
from ..numeric.arrays import FloatArray
from ..results.feedthrough import FEEDTHROUGH
from ..results.ratios import TEST_RATIO
from ..results.trace import CORRECTION, ESTIMATED, HEALTH, MEASURED, STABILITY, Trace, quantity_fields
from .timeline import Timeline

Continued = Callable[[str, FloatArray], FloatArray]
"""From the name and values of a field to values that go on from the piece before."""


class Columns:
    """Keeps what goes on from piece to piece: time, held counts."""

    def __init__(
        self,
        timeline: Timeline,
        model: str,
        with_recorded: bool,
        watched: bool,
        rated: bool,
        absent: tuple[str, ...] = (),
    ) -> None:
        """Prepare the columns of `model`.

        `watched`: whether the estimator knows the aircraft; `rated`: whether it sends test ratios; `absent`: faults
        that say only that an input is missing which the mapping does not have.
        """
        self._timeline = timeline
        self._absent = sum(bit for bit, name in enum_names("lever_fault").items() if name in absent)
        optional = (*(STABILITY if watched else ()), *(TEST_RATIO if rated else ()))
        self._fields = (*quantity_fields(model), *FEEDTHROUGH, *HEALTH, *optional)
        self._watched, self._with_recorded = watched, with_recorded
        self._compared = (*ESTIMATED, *quantity_fields(model), *(entry for entry in HEALTH if entry[0] == "mode"))
        self._counts = dict.fromkeys(COUNTS, 0)
        self.misplaced = 0
        """Recorded estimates that belong to another sample than the one before them."""

    def of(self, rows: Rows) -> Trace:
        """Return the columns of trace.csv without truth.

        Those of a recorded estimator, if there is one, are at the end.
        """
        decoded = _Decoded(rows)
        trace: Trace = {"time_s": self._timeline.seconds(rows["time_us"], decoded.fields("BASE_SAMPLE")["time_us"])}
        for column, message, field in (*MEASURED, *ESTIMATED):
            trace[column] = decoded.at_samples(message, field)
        for column, message, field in self._fields:
            trace[column] = decoded.held(message, field, self._unwrapped if field in COUNTS else None)
        if self._watched:
            trace[CORRECTION[0]] = decoded.at_samples(*CORRECTION[1:])
        trace["faults"] = _without(trace["faults"], self._absent)
        trace["dither_N_m"] = np.nan_to_num(decoded.at_samples("MOTOR_COMMAND", "dither"))
        if self._with_recorded:
            recorded = _Decoded(rows, recorded=True)
            self.misplaced += recorded.misplaced("STATE_ESTIMATE")
            for column, message, field in self._compared:
                values = recorded.at_samples if message == "STATE_ESTIMATE" else recorded.held
                trace[recorded_name(column)] = values(message, field)
        return trace

    def _unwrapped(self, name: str, values: FloatArray) -> FloatArray:
        """Beyond the bits of a count, which starts at 0 in an estimator that does."""
        finite = np.isfinite(values)
        steps = np.diff(values[finite], prepend=self._counts[name]) % COUNTS[name]
        values[finite] = self._counts[name] + np.cumsum(steps)
        if finite.any():
            self._counts[name] = int(values[finite][-1])
        return values


def _without(faults: FloatArray, bits: int) -> FloatArray:
    """Return masks without some bits; NaN stays."""
    finite = np.isfinite(faults)
    return np.where(finite, (np.where(finite, faults, 0.0).astype(np.int64) & ~bits).astype(np.float64), np.nan)


class _Decoded:
    """The fields of each slot, decoded when first asked for."""

    def __init__(self, rows: Rows, recorded: bool = False) -> None:
        self._rows = rows
        self._slots = RECORDED if recorded else SLOTS
        self._messages: dict[str, dict[str, FloatArray]] = {}
        self._held: dict[str, tuple[NDArray[np.intp], dict[str, FloatArray]]] = {}

    def misplaced(self, message: str) -> int:
        """Return how many came that are not of their row's sample, by their time_low."""
        return int(np.sum(self._came(message) & ~self._own(message)))

    def fields(self, message: str) -> dict[str, FloatArray]:
        if message not in self._messages:
            self._messages[message] = self._decode(message, slice(None))
        return self._messages[message]

    def at_samples(self, message: str, field: str) -> FloatArray:
        """NaN where the message did not come with the sample, is of another one, or the field is not valid."""
        there = self._came(message)
        if not there.any():
            return np.full(len(there), np.nan)
        decoded = self.fields(message)
        if f"{field}_valid" in decoded:
            there &= decoded[f"{field}_valid"] != 0.0
        if "time_low" in decoded:
            there &= self._own(message)
        return np.where(there, decoded[field], np.nan)

    def _came(self, message: str) -> NDArray[np.bool_]:
        came: NDArray[np.bool_] = (self._rows["fresh"] >> self._slots[message]) & 1 != 0
        return came

    def _own(self, message: str) -> NDArray[np.bool_]:
        return fields.belongs(self.fields(message), self._time_us)

    @cached_property
    def _time_us(self) -> NDArray[np.int64]:
        """Of each sample."""
        base = np.ascontiguousarray(self._rows["data"][:, SLOTS["BASE_SAMPLE"]])
        return fields.columns("BASE_SAMPLE", base)["time_us"].astype(np.int64)

    def held(self, message: str, field: str, continued: Continued | None = None) -> FloatArray:
        """Return a field of a message, held from frame to frame; NaN before the first.

        Only the rows with which the message came are decoded, and the first; what `continued` makes of the values there
        is held.
        """
        if message not in self._held:
            slot = self._slots[message]
            fresh = (self._rows["fresh"] >> slot) & 1 != 0
            fresh[0] = True
            decoded = self._decode(message, fresh)
            if not (self._rows["known"][0] >> slot) & 1:
                for values in decoded.values():
                    values[0] = np.nan
            self._held[message] = np.cumsum(fresh) - 1, decoded
        place, decoded = self._held[message]
        values = decoded[field] if continued is None else continued(field, decoded[field])
        return values[place]

    def _decode(self, message: str, which: Any) -> dict[str, FloatArray]:
        data = np.ascontiguousarray(self._rows["data"][which, self._slots[message]])
        return fields.columns(message, data)


def model_numbers(rows: Rows) -> Iterator[tuple[int, int]]:
    """Yield row and number of the estimator's model, where it is first told and wherever it changes."""
    slot = SLOTS["PILOT_PARAMETERS"]
    fresh = np.flatnonzero((rows["fresh"] >> slot) & 1)
    numbers = (rows["data"][fresh, slot, 1] >> 4) & 7
    for index in np.flatnonzero(np.diff(numbers, prepend=255)):
        yield int(fresh[index]), int(numbers[index])
