"""The C codec against cantools: every message and field, limits, beyond them, NaN, and many random values.

Where the C sends "not available", cantools is given that raw value. Fault bits of HEALTH are one member of the struct.
"""

from __future__ import annotations

import math
import random
from typing import Any, cast

import numpy as np
import pytest
from cantools.database.can import Message, Signal
from python.can.codec import DBC, MULTIPLEXED, Codec, is_quantity, limits, not_available, scaled

MESSAGES = [pytest.param(message, id=message.name) for message in DBC.messages]
SWEEP = 500


def fields(message: Message) -> list[Signal]:
    """Return what the codec writes: all but CRC and counter."""
    return [signal for signal in message.signals if signal.name not in ("crc", "counter")]


FIELDS = [(message, signal) for message in DBC.messages for signal in fields(message)]
QUANTITIES = [
    pytest.param(message, signal, id=f"{message.name} {signal.name}")
    for message, signal in FIELDS
    if is_quantity(signal)
]
CODES = [
    pytest.param(message, signal, id=f"{message.name} {signal.name}")
    for message, signal in FIELDS
    if not is_quantity(signal) and message.name not in MULTIPLEXED and not signal.is_multiplexer
    if not signal.name.startswith("fault_")
]


def multiplexer(message: Message) -> str | None:
    """Return the signal that says which others a frame has: model, or page."""
    return next((signal.name for signal in message.signals if signal.is_multiplexer), None)


def signals_of(message: Message, page: int) -> list[Signal]:
    """Return what a frame of this message has, with this value of the multiplexer if there is one."""
    return [signal for signal in message.signals if signal.multiplexer_ids in (None, [page])]


def parameters_of(message: Message, model: int) -> list[str]:
    """Return the multiplexed signals of a model, in their order."""
    return [signal.name for signal in signals_of(message, model) if signal.multiplexer_ids]


def faults_of(values: dict[str, Any]) -> int:
    """Return the fault bits of HEALTH as one number."""
    signals = DBC.get_message_by_name("HEALTH").signals
    return sum(values.get(s.name, 0) << s.start - 16 for s in signals if s.name.startswith("fault_"))


def as_members(message: Message, values: dict[str, Any]) -> dict[str, Any]:
    """Return the members of the struct that has these signals."""
    array = MULTIPLEXED.get(message.name)
    if message.name == "HEALTH":
        others = {name: value for name, value in values.items() if not name.startswith("fault_")}
        return others | {"faults": faults_of(values)}
    if array is None:
        return values
    others = {name: value for name, value in values.items() if name in ("model", "valid")}
    return others | {array: [values.get(name, 0.0) for name in parameters_of(message, values["model"])]}


def as_signals(message: Message, members: dict[str, Any]) -> dict[str, Any]:
    """Return the signals that a struct with these members has."""
    array = MULTIPLEXED.get(message.name)
    if message.name == "HEALTH":
        bits = {s.name: members["faults"] >> s.start - 16 & 1 for s in message.signals if s.name.startswith("fault_")}
        return {name: value for name, value in members.items() if name != "faults"} | bits
    if array is not None:
        names = parameters_of(message, members["model"])
        return {"model": members["model"], "valid": members["valid"]} | dict(zip(names, members[array], strict=True))
    mux = multiplexer(message)
    names = [signal.name for signal in signals_of(message, members[mux] if mux else 0)]
    return {name: value for name, value in members.items() if name in names}


def raw_of(signal: Signal, value: float) -> int:
    """Return the count of a physical value by cantools, or that for not available when it does not fit (COMMAND:
    keep)."""
    least, greatest = (scaled(signal, raw) for raw in limits(signal))
    half = 0.5 * signal.scale
    if math.isnan(value) or not least - half < value < greatest + half:
        return not_available(signal)
    return int(signal.scaled_to_raw(value))


def cantools_encode(message: Message, values: dict[str, Any]) -> bytes:
    """By cantools; signals that are not given are 0."""
    signals = signals_of(message, values.get(multiplexer(message) or "", 0))
    raw = {signal.name: 0 for signal in signals}
    for signal in signals:
        if signal.name in values:
            value = values[signal.name]
            raw[signal.name] = raw_of(signal, value) if is_quantity(signal) else value
    return message.encode(raw, scaling=False, strict=False)


def context(message: Message, signal: Signal) -> dict[str, Any]:
    """Return what must be set for a signal to be sent: its flag, or the model or page that has it."""
    mux = multiplexer(message)
    if mux is not None and signal.multiplexer_ids:
        return {mux: signal.multiplexer_ids[0]}
    flag = f"{signal.name}_valid"
    return {flag: True} if any(other.name == flag for other in message.signals) else {}


def encode_one(codec: Codec, message: Message, signal: Signal, value: float) -> tuple[bytes | None, bytes]:
    """Return what the C and what cantools make of one value."""
    values = {signal.name: value} | context(message, signal)
    return codec.encode(message.name, as_members(message, values)), cantools_encode(message, values)


@pytest.mark.parametrize(("message", "signal"), QUANTITIES)
@pytest.mark.requirement("R16")
def test_limits_and_beyond(codec: Codec, message: Message, signal: Signal) -> None:
    values = [-1e30, 1e30, -math.inf, math.inf, math.nan, 0.0, -0.0]
    for raw in limits(signal):
        limit = scaled(signal, raw)
        values += [limit, limit - signal.scale, limit + signal.scale, 1.01 * limit, 1e5 * limit]
    for value in values:
        got, expected = encode_one(codec, message, signal, float(np.float32(value)))
        refused = message.name == "COMMAND" and not value >= 0.0
        assert got == (None if refused else expected), value


@pytest.mark.parametrize(("message", "signal"), CODES)
def test_codes(codec: Codec, message: Message, signal: Signal) -> None:
    _, greatest = limits(signal)
    for value in {0, 1, greatest // 3, greatest - 1, greatest}:
        values = {signal.name: value} | context(message, signal)
        data = codec.encode(message.name, values)
        assert data == cantools_encode(message, values)
        decoded = codec.decode(message.name, data or b"")
        assert decoded is not None
        assert decoded[signal.name] == value


@pytest.mark.parametrize(("message", "signal"), CODES)
def test_codes_that_do_not_fit_are_refused(codec: Codec, message: Message, signal: Signal) -> None:
    """Where the member of the struct can hold more than the signal."""
    member = dict(codec.ffi.typeof(f"message_{message.name.lower()}_t").fields)[signal.name].type
    if member.cname != "_Bool" and 8 * codec.ffi.sizeof(member) > signal.length:
        values = {signal.name: 1 << signal.length} | context(message, signal)
        assert codec.encode(message.name, values) is None
    else:
        assert member.cname == "_Bool" or signal.length == 8 * codec.ffi.sizeof(member)


def random_values(message: Message, dice: random.Random) -> dict[str, Any]:
    """Return values up to 10 % beyond the range of each signal, none within 0.01 counts of a tie (where the rule
    differs)."""
    values: dict[str, Any] = {}
    page = dice.choice([*{signal.multiplexer_ids[0] for signal in message.signals if signal.multiplexer_ids}] or [0])
    for signal in signals_of(message, page)[2:]:
        least, greatest = limits(signal)
        if is_quantity(signal):
            margin = (greatest - least) // 10
            count = dice.randint(least - margin, greatest + margin) + dice.uniform(-0.49, 0.49)
            values[signal.name] = float(np.float32(count * signal.scale))
        else:
            values[signal.name] = dice.randint(least, greatest)
    mux = multiplexer(message)
    if mux is not None:
        values[mux] = page
    if message.name == "COMMAND":
        values["dither_rms"] = abs(values["dither_rms"])
    for name in values:
        if not values.get(f"{name}_valid", True):
            values[name] = 0.0
    return values


@pytest.mark.parametrize("message", MESSAGES)
@pytest.mark.requirement("R16")
def test_random_values_both_ways(codec: Codec, message: Message) -> None:
    dice = random.Random(message.frame_id)
    for _ in range(SWEEP):
        values = random_values(message, dice)
        data = codec.encode(message.name, as_members(message, values))
        assert data == cantools_encode(message, values), values
        decoded = codec.decode(message.name, data or b"")
        assert decoded is not None
        raw = cast(dict[str, int], message.decode(data or b"", decode_choices=False, scaling=False))
        expected = {name: decoded_value(message, name, raw) for name in raw if name not in ("crc", "counter")}
        got = {name: float(value) for name, value in as_signals(message, decoded).items()}
        assert got == pytest.approx(expected, rel=0.0, abs=0.0, nan_ok=True)


def decoded_value(message: Message, name: str, raw: dict[str, int]) -> float:
    """Return what the C makes of raw values: the float nearest to a quantity, no flag without a value."""
    signal = message.get_signal_by_name(name)
    if is_quantity(signal):
        missing = raw[name] == not_available(signal) and message.name != "COMMAND"
        return math.nan if missing else float(np.float32(scaled(signal, raw[name])))
    flagged = next((other for other in message.signals if f"{other.name}_valid" == name), None)
    return 0.0 if flagged and raw[flagged.name] == not_available(flagged) else float(raw[name])


@pytest.mark.parametrize(("value", "count"), [(0.0625, 62), (-0.0625, -62), (0.1875, 188)])
def test_ties_go_to_the_even_count(codec: Codec, value: float, count: int) -> None:
    """62.5 and 187.5 counts exactly."""
    message = DBC.get_message_by_name("MOTOR_COMMAND")
    got, expected = encode_one(codec, message, message.get_signal_by_name("torque"), value)
    assert got == expected
    assert got is not None
    assert int.from_bytes(got[2:4], "little", signed=True) == count


def test_values_without_flag_are_not_read(codec: Codec) -> None:
    assert codec.encode("LEVER_SAMPLE", {"theta": math.nan, "theta_dot": 1.0, "tau_m": -math.inf}) == bytes(8)
    assert codec.encode("BASE_SAMPLE", {"z_ddot": math.nan}) == bytes(8)


@pytest.mark.parametrize("name", MULTIPLEXED)
def test_unknown_model_is_refused(codec: Codec, name: str) -> None:
    for model in range(codec.enum("lever_model")["LEVER_MODEL_COUNT"], 8):
        assert codec.encode(name, {"model": model}) is None
        assert codec.decode(name, bytes([0, model << 4, 0, 0, 0, 0, 0, 0])) is None


@pytest.mark.parametrize("page", range(3, 16))
def test_an_unknown_page_is_refused(codec: Codec, page: int) -> None:
    assert codec.encode("IDENTITY", {"page": page}) is None
    assert codec.decode("IDENTITY", bytes([0, page << 4, 0, 0, 0, 0, 0, 0])) is None


@pytest.mark.parametrize("message", MESSAGES)
def test_another_length_or_identifier_is_refused(codec: Codec, message: Message) -> None:
    assert codec.decode(message.name, bytes(8)) is not None
    for length in range(8):
        assert codec.decode(message.name, bytes(length)) is None
    for other in {0, 1, message.frame_id ^ 1, 0x7FF, *(each.frame_id for each in DBC.messages)} - {message.frame_id}:
        assert codec.decode(message.name, bytes(8), other) is None
