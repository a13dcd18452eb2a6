"""CAN frames to values and back, by the messages of lever.dbc (through cantools) with E2E protection (autosar-e2e).

Three speeds: encode() and decode() for any frame, with names; encoder() for a loop, positional and prepared once (about
1 µs a frame); encode_columns() and decode_columns() for a whole recording, vectorised.

Values are physical, in the units of the DBC, rounded to the nearest step of their field (ties to even). A value that
does not fit, None and NaN are "not available": the field has a code for that, which decodes to NaN, and the validity
bit of a measured one (theta has theta_valid) is cleared. COMMAND.dither_rms alone has no such code: it saturates at the
value that keeps the dither, and refuses NaN. Whole numbers wrap if they count something ("us", "frames"); codes and
flags, which have no unit, are refused when they do not fit.

Importing takes 0.1 s, most of it cantools.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import cantools.database
from cantools.database.can import Database, Message, Signal
from e2e.crc import calculate_crc8_h2f
from e2e.p02 import e2e_p02_check, e2e_p02_protect

from ..errors import CodecError
from ..runtime.files import native_file

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Value = float | str | None
"""A physical value, the name of a choice ("freeze"), or None for what is not valid."""

_FRAMING = ("crc", "counter")  # written by E2E, no content
_VALID = "_valid"
_NOT_AVAILABLE = "not_available"


@cache
def database() -> Database:
    """lever.dbc as cantools has it."""
    loaded = cantools.database.load_file(native_file("lever.dbc"))
    assert isinstance(loaded, Database)
    return loaded


@cache
def contract() -> int:
    """Return the version of lever.dbc, which an estimator tells in IDENTITY."""
    return int(database().version or 0)


def message(key: str | int) -> Message:
    """Return a message of the DBC by name or identifier. Raise CodecError."""
    messages = _messages()
    if key not in messages:
        names = ", ".join(entry.name for entry in database().messages)
        raise CodecError(f"{key if isinstance(key, str) else hex(key)} is not a message of lever.dbc: {names}")
    return messages[key]


def choices(name: str, signal: str) -> dict[int, str]:
    """Return the words that values of a signal stand for, but for that of what is not available."""
    named = message(name).get_signal_by_name(signal).choices
    return {value: str(word) for value, word in (named or {}).items() if str(word) != _NOT_AVAILABLE}


@cache
def _messages() -> dict[str | int, Message]:
    return {key: entry for entry in database().messages for key in (entry.name, entry.frame_id)}


# --- E2E Profile 2 ---------------------------------------------------------------------------------------------------


@cache
def data_ids(key: str | int) -> bytes:
    """Return the DataIDList of a message: one byte for each counter 0..15."""
    dbc = message(key).dbc
    assert dbc is not None
    base = int(dbc.attributes["E2EDataIdBase"].value)
    return bytes(range(base, base + 16))


def check(identifier: int, data: bytes | bytearray) -> bool:
    """Return whether length and CRC of a received frame are right."""
    return len(data) == message(identifier).length and e2e_p02_check(data, data_ids(identifier))


@cache
def _crc_table() -> NDArray[np.uint8]:
    """Return the CRC register after a byte, by register xor byte.

    The library starts with 0xFF and inverts at the end.
    """
    import numpy as np

    return np.array([calculate_crc8_h2f(bytes([index ^ 0xFF])) ^ 0xFF for index in range(256)], dtype=np.uint8)


def check_columns(name: str, data: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """check() of N frames of one message, data as (N, 8) bytes."""
    right: NDArray[np.bool_] = _crc_columns(name, data) == data[:, 0]
    return right


def _crc_columns(name: str, data: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the CRC that each frame should have."""
    import numpy as np

    table, identifiers = _crc_table(), np.frombuffer(data_ids(name), dtype=np.uint8)
    register = np.full(len(data), 0xFF, dtype=np.uint8)
    for byte in range(1, data.shape[1]):
        register = table[register ^ data[:, byte]]
    crc: NDArray[np.uint8] = table[register ^ identifiers[data[:, 1] & 15]] ^ 0xFF
    return crc


# --- encoding --------------------------------------------------------------------------------------------------------


Quantiser = Callable[[Value], int]
"""From a value to the bits of its field in the 64-bit little-endian word of a frame. Raise CodecError."""


def _quantiser(owner: Message, signal: Signal) -> Quantiser:
    place = f"{owner.name}.{signal.name}"
    if signal.choices and not_available(signal) is None:
        return _choice(signal, place)
    if signal.scale == 1 and signal.offset == 0:
        return _whole(signal, place)
    validity = [other.start for other in owner.signals if other.name == signal.name + _VALID]
    return _physical(signal, place, sum(1 << bit for bit in validity))


def not_available(signal: Signal) -> int | None:
    """Return the raw code of a field that says that there is no value; None where it has no such code."""
    return next((raw for raw, name in (signal.choices or {}).items() if str(name) == _NOT_AVAILABLE), None)


def _physical(signal: Signal, place: str, valid_bit: int) -> Quantiser:
    start, mask = signal.start, (1 << signal.length) - 1
    low, high = (-(mask // 2), mask // 2) if signal.is_signed else (0, mask)
    scale, offset, code = float(signal.scale), float(signal.offset), not_available(signal)
    if code is None:

        def saturate(value: Value) -> int:
            if value is None or value != value:
                raise CodecError(f"{place} cannot be {value}: it has no code for that")
            steps = (value - offset) / scale  # type: ignore[operator]
            return (low if steps <= low else high if steps >= high else round(steps)) << start

        return saturate
    highest = high if signal.is_signed else high - 1
    absent = (code & mask) << start

    def quantise(value: Value) -> int:
        if value is None or value != value:
            return 0 if valid_bit else absent
        steps = (value - offset) / scale  # type: ignore[operator]
        if not low - 0.5 < steps < highest + 0.5:
            return absent
        return valid_bit | (round(steps) & mask) << start

    return quantise


def _whole(signal: Signal, place: str) -> Quantiser:
    start, mask, wraps = signal.start, (1 << signal.length) - 1, bool(signal.unit)

    def quantise(value: Value) -> int:
        try:
            raw = round(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            raise CodecError(f"{place} cannot be {value!r}: it is a whole number") from None
        if not wraps and not 0 <= raw <= mask:
            raise CodecError(f"{place} cannot be {value}: it is a whole number from 0 to {mask}")
        return (raw & mask) << start

    return quantise


def _choice(signal: Signal, place: str) -> Quantiser:
    start = signal.start
    choices = {str(name): raw for raw, name in (signal.choices or {}).items()}

    def quantise(value: Value) -> int:
        raw = choices.get(value) if isinstance(value, str) else value
        if raw not in choices.values():
            raise CodecError(f"{place} cannot be {value!r}; allowed: {', '.join(choices)}")
        return int(raw) << start  # type: ignore[arg-type]

    return quantise


@dataclass(frozen=True)
class _Layout:
    """What encoding a message needs: its contents (all but framing and validity) in DBC order, and their quantisers."""

    contents: dict[str, Signal]
    quantisers: dict[str, Quantiser]
    validity: tuple[str, ...]
    counter_start: int


@cache
def _layout(name: str) -> _Layout:
    definition = message(name)
    signals = {signal.name: signal for signal in definition.signals if signal.name not in _FRAMING}
    validity = tuple(key + _VALID for key in signals if key + _VALID in signals)
    contents = {key: signal for key, signal in signals.items() if key not in validity}
    quantisers = {key: _quantiser(definition, signal) for key, signal in contents.items()}
    return _Layout(contents, quantisers, validity, definition.get_signal_by_name("counter").start)


def _protected(word: int, identifiers: bytes) -> bytes:
    """Return the frame of a 64-bit word that has its counter but no CRC yet."""
    frame = bytearray(word.to_bytes(8, "little"))
    e2e_p02_protect(frame, identifiers, increment_counter=False)
    return bytes(frame)


def encoder(name: str) -> Callable[..., bytes]:
    """Return a fast encoder of a message without multiplexing: counter, then each value in the order of the DBC.

    encoder("LEVER_SAMPLE") takes (counter, theta, theta_dot, tau_m), encoder("BASE_SAMPLE") (counter, z_ddot, time_us).

    Parameters
    ----------
    name
        Of the message in lever.dbc.

    Returns
    -------
    callable
        It takes values in the units of the DBC, NaN for what is not available, and returns 8 bytes. It raises
        CodecError for a value that its field cannot hold.

    Raises
    ------
    CodecError
        There is no such message, or it is multiplexed.
    """
    layout = _layout(name)
    if any(signal.is_multiplexer for signal in layout.contents.values()):
        raise CodecError(f"{name} is multiplexed: use encode()")
    quantisers = tuple(layout.quantisers.values())
    counter_start = layout.counter_start
    identifiers = data_ids(name)

    def encode_frame(counter: int, *values: Value) -> bytes:
        word = (counter & 15) << counter_start
        for quantise, value in zip(quantisers, values, strict=True):
            word |= quantise(value)
        return _protected(word, identifiers)

    return encode_frame


def encode_columns(name: str, counters: NDArray[np.int64], values: Mapping[str, NDArray[Any]]) -> NDArray[np.uint8]:
    """Encode N frames at once, as encoder() does, into (N, 8) bytes.

    `values` are all fields of a message without multiplexing, by name.
    """
    import numpy as np

    definition, layout = message(name), _layout(name)
    words = (np.asarray(counters, np.int64) & 15).astype(np.uint64) << np.uint64(layout.counter_start)
    for key, signal in layout.contents.items():
        mask = (1 << signal.length) - 1
        raw = np.asarray(values[key])
        if (code := not_available(signal)) is not None:
            steps = (raw - float(signal.offset)) / float(signal.scale)
            most = mask // 2 + 0.5
            fits = (steps > -most) & (steps < most)
            absent = np.where(np.isnan(steps) & (key + _VALID in layout.validity), 0.0, float(code))
            raw = np.where(fits, np.rint(np.where(fits, steps, 0.0)), absent)
            for flag in (other for other in definition.signals if other.name == key + _VALID):
                words |= fits.astype(np.uint64) << np.uint64(flag.start)
        words |= (raw.astype(np.int64) & mask).astype(np.uint64) << np.uint64(signal.start)
    data = words.astype("<u8").view(np.uint8).reshape(-1, 8)
    data[:, 0] = _crc_columns(name, data)
    return data


def _present(layout: _Layout, values: Mapping[str, Value]) -> list[str]:
    """Return the contents that a frame with these values holds: those of another multiplexer value are absent."""
    selected = {
        key: layout.quantisers[key](values[key]) >> signal.start
        for key, signal in layout.contents.items()
        if signal.is_multiplexer and key in values
    }
    return [
        key
        for key, signal in layout.contents.items()
        if signal.multiplexer_ids is None or selected.get(signal.multiplexer_signal or "") in signal.multiplexer_ids
    ]


def encode(name: str, counter: int, values: Mapping[str, Value]) -> bytes:
    """Return the frame of a message with all its values by name, protected with `counter` (modulo 16).

    A choice may be given by name ("freeze") or number. With `theta_valid: False` theta is not valid, whatever it is.
    Raises CodecError for a name that is missing or unknown, and for a value that the field cannot hold.
    """
    layout = _layout(name)
    present = _present(layout, values)
    if not set(present) <= values.keys() <= {*present, *layout.validity}:
        raise CodecError(f"{name} holds {', '.join(present)}; given: {', '.join(values)}")
    word = (counter & 15) << layout.counter_start
    for key in present:
        word |= layout.quantisers[key](values[key] if values.get(key + _VALID, True) else None)
    return _protected(word, data_ids(name))


# --- decoding --------------------------------------------------------------------------------------------------------


def decode(identifier: int, data: bytes | bytearray) -> tuple[str, dict[str, float]]:
    """Return what a received frame says.

    Parameters
    ----------
    identifier
        Of the frame.
    data
        Its 8 bytes.

    Returns
    -------
    tuple of str and dict
        Name of the message, and its fields in the units of lever.dbc: choices as numbers, NaN where not available.

    Raises
    ------
    CodecError
        The message is not in lever.dbc, or the frame is corrupt.
    """
    definition = message(identifier)
    if not check(identifier, data):
        raise CodecError(f"{definition.name} ({identifier:#x}) {data.hex(' ')} is corrupt: its length or CRC is wrong")
    try:
        fields = dict(definition.decode_simple(bytes(data), decode_choices=False))
    except cantools.database.DecodeError as error:
        raise CodecError(f"{definition.name} ({identifier:#x}) {data.hex(' ')}: {error}") from None
    absent = _absent(definition.name)
    return definition.name, {
        name: math.nan if value == absent.get(name) else value  # type: ignore[misc]
        for name, value in fields.items()
    }


@cache
def _absent(name: str) -> dict[str, float]:
    """By field, what its code for "not available" is when it is scaled like a value."""
    codes = ((signal, not_available(signal)) for signal in message(name).signals)
    return {signal.name: signal.conversion.raw_to_scaled(code, False) for signal, code in codes if code is not None}  # type: ignore[misc]


def raw_field(name: str, field: str) -> Callable[[bytes | bytearray], int]:
    """Return a fast reader of the unscaled, unsigned bits of one field of an 8-byte frame."""
    signal = message(name).get_signal_by_name(field)
    start, mask = signal.start, (1 << signal.length) - 1
    return lambda data: int.from_bytes(data, "little") >> start & mask


def decode_columns(name: str, data: NDArray[np.uint8]) -> dict[str, NDArray[np.float64]]:
    """Return every field of N frames of one message, data as (N, 8) bytes; CRCs are not checked.

    Equal to cantools to the last bit. Where a multiplexed field is absent, or a value not available, there is NaN.
    """
    import numpy as np

    definition = message(name)
    if data.dtype != np.uint8 or data.ndim != 2 or data.shape[1] != definition.length:
        wanted = f"uint8 of shape (N, {definition.length})"
        raise CodecError(f"{name}: data is {data.dtype} of shape {data.shape}, not {wanted}")
    words = np.ascontiguousarray(data).view("<u8")[:, 0]
    columns: dict[str, NDArray[np.float64]] = {}
    for signal in definition.signals:
        raw = (words >> np.uint64(signal.start) & np.uint64((1 << signal.length) - 1)).astype(np.int64)
        if signal.is_signed:
            raw -= (raw >> (signal.length - 1)) << signal.length
        column = raw.astype(np.float64) * float(signal.scale) + float(signal.offset)
        if (code := not_available(signal)) is not None:
            column[raw == code] = np.nan
        if signal.multiplexer_ids is not None:
            absent = ~np.isin(columns[signal.multiplexer_signal or ""], signal.multiplexer_ids)
            column[absent] = np.nan
        columns[signal.name] = column
    return columns
