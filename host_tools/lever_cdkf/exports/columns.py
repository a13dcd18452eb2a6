"""The columns of a trace as files with names, units and comments have them: what lever.dbc says of each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from ..can import codec
from ..firmware.estimator import fault_names
from ..firmware.library import enum_names
from ..firmware.quantities import quantities, recorded_name
from ..numeric.arrays import FloatArray
from ..results.feedthrough import FEEDTHROUGH
from ..results.ratios import TEST_RATIO
from ..results.trace import CORRECTION, ESTIMATED, HEALTH, MEASURED, STABILITY, TRUE_MARGIN, quantity_fields

MEASUREMENT, ESTIMATE, RECORDED, TRUTH = "measurement", "estimate", "recorded", "truth"
"""Kinds of columns; recorded are the estimates of the firmware that ran when a log was recorded."""
TEXT = ("mode", "faults", "mode_recorded", "bounce", "evidence", "verdict")
"""Columns of the trace whose numbers stand for words."""

_DERIVED = {  # unit and comment of fields that are not in lever.dbc (fields.py)
    "nis": ("1", "Normalised innovation squared of theta and theta_dot."),
    "faults": ("", "Faults since the last HEALTH."),
}
_STABILITY_NAMES = {"frequency": "bounce_frequency"}
_TRUTH = (  # column, unit, comment
    ("theta_true_rad", "rad", "Lever angle from the floor."),
    ("theta_dot_true_rad_s", "rad/s", "Lever rate."),
    ("z_ddot_true_m_s2", "m/s^2", "Vertical acceleration of the base, up positive, without gravity."),
    ("tau_m_true_N_m", "N m", "Motor torque acting on the lever."),
    ("trim_true_rad", "rad", "Lever angle at which the pilot holds it."),
    (TRUE_MARGIN, "dB", "By which the loop with the true arm may grow until it is unstable."),
)


@dataclass(frozen=True)
class Column:
    """One of the trace."""

    source: str
    """Its name in the trace, which ends in the unit."""
    name: str
    """Without the unit."""
    field: str
    """Of its message."""
    unit: str
    """Empty for what has none, "1" for a ratio."""
    comment: str
    message: str
    """That it was in; empty for the truth."""
    kind: str
    held: bool = False
    """Whether it comes at a divided rate, and the trace holds it until the next one."""

    def fresh(self, published: NDArray[np.bool_], recorded: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return at which samples there is a new one.

        `published` and `recorded` are those with new estimates of the run and of the recording.
        """
        if not self.held:
            return np.ones(len(published), np.bool_)
        return recorded if self.kind == RECORDED else published


@dataclass(frozen=True)
class Head:
    """What every file of a run says before its samples."""

    columns: list[Column]
    start_us: int
    """Of time_s = 0 [us since 1970]; next to 0 where it is not known, as in a simulation."""
    created: datetime
    properties: Mapping[str, str]
    """Provenance, and the date of the start where it is known."""


def columns(names: Iterable[str], model: str) -> list[Column]:
    """Return those of a trace with an estimator of that model, in the order of the trace without its time."""
    known = {column.source: column for column in _known(model)}
    unknown = {name: Column(name, name, name, "", "", "", MEASUREMENT) for name in names if name != "time_s"}
    return [known.get(name, column) for name, column in unknown.items()]


def words(column: str, number: int) -> str:
    """Return what a number of one of the columns TEXT stands for: "run"; "excitation, torque"."""
    if column == "faults":
        return ", ".join(fault_names(number))
    if column in ("evidence", "verdict"):
        return codec.choices("TEST_RATIO", column).get(number, "")
    return enum_names("lever_bounce" if column == "bounce" else "lever_mode").get(number, "")


def as_words(column: str, values: FloatArray) -> list[str | None]:
    """words() of each value; None for NaN."""
    different, place = np.unique(np.nan_to_num(values, nan=-1.0), return_inverse=True)
    texts = [None if value < 0.0 else words(column, int(value)) for value in different.tolist()]
    return [texts[index] for index in place.tolist()]


def together(described: Iterable[Column], key: Callable[[Column], str]) -> dict[str, list[Column]]:
    """Return columns with the same key."""
    groups: dict[str, list[Column]] = {}
    for column in described:
        groups.setdefault(key(column), []).append(column)
    return groups


def _known(model: str) -> Iterator[Column]:
    for source, message, field in MEASURED:
        yield _of_message(source, f"{field}_measured", message, field, MEASUREMENT)
    estimates = [_of_message(source, f"{field}_estimate", message, field) for source, message, field in ESTIMATED]
    for source, message, field in quantity_fields(model):
        name = field if field.endswith("_sigma") else f"{field}_estimate"
        estimates.append(_of_message(source, name, message, field, held=True))
    health = [_of_message(source, field, message, field, held=True) for source, message, field in HEALTH]
    for column in (*estimates, *(each for each in health if each.field == "mode")):
        yield replace(column, source=recorded_name(column.source), name=recorded_name(column.name), kind=RECORDED)
    yield from (*estimates, *health)
    for source, message, field in FEEDTHROUGH:
        yield _of_message(source, f"feedthrough_{field}", message, field, held=True)
    for source, message, field in STABILITY:
        yield _of_message(source, _STABILITY_NAMES.get(field, field), message, field, held=True)
    for source, message, field in TEST_RATIO:
        yield _of_message(source, source, message, field, held=True)
    yield _of_message(CORRECTION[0], CORRECTION[2], *CORRECTION[1:])
    yield _of_message("dither_N_m", "dither", "MOTOR_COMMAND", "dither")
    for source, unit, comment in _TRUTH:
        name = source[: source.index("_true")]
        yield Column(source, f"{name}_true", name, unit, comment, "", TRUTH)
    for quantity in quantities(model):
        comment = next(column.comment for column in estimates if column.field == quantity.key)
        yield Column(quantity.column("true"), f"{quantity.key}_true", quantity.key, quantity.unit, comment, "", TRUTH)


def _of_message(
    source: str, name: str, message: str, field: str, kind: str = ESTIMATE, *, held: bool = False
) -> Column:
    if field in _DERIVED:
        return Column(source, name, field, *_DERIVED[field], message, kind, held)
    signal = codec.message(message).get_signal_by_name(field)
    return Column(source, name, field, signal.unit or "", signal.comment or "", message, kind, held)
