"""codec.py against cantools, autosar-e2e, a CRC written out here, and the firmware's own receiver."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import cantools
import numpy as np
import pytest
from cantools.database.can import Database, Message, Signal
from e2e.p02 import e2e_p02_check
from lever_cdkf.can import codec
from lever_cdkf.errors import CodecError
from lever_cdkf.runtime.files import native_file

FRAMING = {"crc", "counter"}
DATABASE = cantools.database.load_file(native_file("lever.dbc"))
assert isinstance(DATABASE, Database)
MESSAGES = {message.name: message for message in DATABASE.messages}


def crc(data: bytes) -> int:
    """CRC-8H2F by its definition: polynomial 0x2F, initial value and final xor 0xFF."""
    register = 0xFF
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = (register << 1 ^ 0x2F) & 0xFF if register & 0x80 else register << 1
    return register ^ 0xFF


MODELS = {0: ("m_p", "c_p", "k_p"), 1: ("m", "c", "k"), 2: ("a21", "a22", "b21"), 3: ("k_hand", "c_hand", "c_space")}


def code(signal: Signal) -> float | None:
    """Return what the code for "not available" is when it is scaled like a value; None where there is no such code."""
    for raw, name in (signal.choices or {}).items():
        if str(name) == "not_available":
            return float(raw) * float(signal.scale)
    return None


def contents(message: Message, field: Signal | None = None) -> dict[str, float]:
    """Return a value inside the range of every field but the framing, of the model that has `field` if the message
    has all."""
    ids = (field.multiplexer_ids if field is not None else None) or [0]
    present = [signal for signal in message.signals if signal.multiplexer_ids in (None, ids)]
    values: dict[str, float] = {
        signal.name: int((signal.choices is None or code(signal) is not None) and (signal.maximum or 0) >= 1)
        for signal in present
        if signal.name not in FRAMING
    }
    return values | {signal.name: ids[0] for signal in present if signal.is_multiplexer}


def fields() -> Iterator[tuple[Message, Signal]]:
    """Yield every field that carries a physical value: neither framing, nor flag, nor code."""
    for message in MESSAGES.values():
        for signal in message.signals:
            if float(signal.scale) != 1.0:
                yield message, signal


FIELDS = list(fields())
FIELD_NAMES = [f"{message.name}.{signal.name}" for message, signal in FIELDS]


def by_cantools(message: Message, values: dict[str, float], counter: int) -> bytes:
    """Return the payload without its CRC byte."""
    return message.encode({**values, "crc": 0, "counter": counter}, strict=False)[1:]


def test_crc_of_the_design() -> None:
    assert crc(b"123456789") == 0xDF
    lever = codec.encoder("LEVER_SAMPLE")  # data IDs 1 to 16
    assert lever(0, None, None, None) == bytes([0x0E, 0, 0, 0, 0, 0, 0, 0])
    assert lever(1, None, None, None) == bytes([0x1B, 1, 0, 0, 0, 0, 0, 0])


@pytest.mark.parametrize("name", MESSAGES)
@pytest.mark.parametrize("counter", range(16))
def test_protection(name: str, counter: int) -> None:
    message = MESSAGES[name]
    assert message.dbc is not None
    base = int(message.dbc.attributes["E2EDataIdBase"].value)
    frame = codec.encode(name, counter, contents(message))
    assert frame[1] & 15 == counter
    assert frame[0] == crc(frame[1:] + bytes([base + counter]))
    assert e2e_p02_check(frame, bytes(range(base, base + 16)))
    assert codec.check(message.frame_id, frame)
    assert codec.encode(name, counter + 16, contents(message)) == frame


@pytest.mark.parametrize("name", MESSAGES)
def test_every_flipped_bit_is_found(name: str) -> None:
    message = MESSAGES[name]
    frame = int.from_bytes(codec.encode(name, 5, contents(message)), "big")
    for bit in range(64):
        assert not codec.check(message.frame_id, (frame ^ 1 << bit).to_bytes(8, "big"))
    identifier = codec.data_ids(name)[5:6]
    for length in (2, 7, 9):  # with a CRC that is right for what there is
        content = frame.to_bytes(8, "big")[1:length].ljust(length - 1, b"\0")
        assert not codec.check(message.frame_id, bytes([crc(content + identifier)]) + content)
    assert not codec.check(message.frame_id, b"")


@pytest.mark.parametrize(("message", "signal"), FIELDS, ids=FIELD_NAMES)
@pytest.mark.requirement("R16")
def test_field_against_cantools(message: Message, signal: Signal) -> None:
    assert signal.minimum is not None
    assert signal.maximum is not None
    low, high, step = float(signal.minimum), float(signal.maximum), float(signal.scale)
    span = high - low
    inside = [low + span * part for part in (0.0, 0.1, 0.333333, 0.5, 0.77, 1.0)]
    inside += [low + 1.4 * step, low + 1.6 * step, high - 1.4 * step, high - 0.4 * step, low + 0.4 * step]
    beyond = [low - 0.4 * step, low - step, low - span, -1e30, -math.inf]
    beyond += [high + 0.4 * step, high + step, high + span, 1e30, math.inf]
    for value in inside + beyond:
        values = {**contents(message, signal), signal.name: value}
        expected, absent = {**values, signal.name: min(max(value, low), high)}, code(signal)
        if absent is not None and not low - 0.5 * step < value < high + 0.5 * step:
            expected |= {signal.name: absent} | {flag: 0 for flag in values if flag == f"{signal.name}_valid"}
        frame = codec.encode(message.name, 3, values)
        assert frame[1:] == by_cantools(message, expected, 3), value
        wanted = math.nan if expected[signal.name] == absent else expected[signal.name]
        _, decoded = codec.decode(message.frame_id, frame)
        assert decoded[signal.name] == pytest.approx(wanted, abs=0.5001 * step, nan_ok=True)


@pytest.mark.parametrize(("message", "signal"), FIELDS, ids=FIELD_NAMES)
@pytest.mark.parametrize("value", [math.nan, None])
def test_not_a_number(message: Message, signal: Signal, value: float | None) -> None:
    values: dict[str, float | None] = {**contents(message, signal), signal.name: value}
    flag, absent = f"{signal.name}_valid", code(signal)
    if absent is None:
        with pytest.raises(CodecError, match=f"{message.name}.{signal.name} cannot be"):
            codec.encode(message.name, 0, values)
        return
    frame = codec.encode(message.name, 0, values)
    changed = {signal.name: 0.0, flag: 0} if flag in values else {signal.name: absent}
    assert frame[1:] == by_cantools(message, contents(message, signal) | changed, 0)


def test_counts_and_time_wrap_but_codes_do_not() -> None:
    sample = MESSAGES["BASE_SAMPLE"]
    for time_us in (0, 1, 2**32 - 1):
        expected = by_cantools(sample, {"z_ddot": 1.0, "z_ddot_valid": 1, "time_us": time_us}, 0)
        for turns in (0, 1, 5):
            assert codec.encode("BASE_SAMPLE", 0, {"z_ddot": 1.0, "time_us": time_us + turns * 2**32})[1:] == expected
    lost = contents(MESSAGES["LINK_HEALTH"])
    wrapped = codec.encode("LINK_HEALTH", 0, {**lost, "lost": 2})
    assert codec.encode("LINK_HEALTH", 0, {**lost, "lost": 65538}) == wrapped
    health = contents(MESSAGES["HEALTH"])
    for key, value in (("fault_gap", 2), ("fault_gap", -1), ("mode", 6), ("mode", math.nan), ("restarts", math.nan)):
        with pytest.raises(CodecError, match=f"HEALTH.{key} cannot be"):
            codec.encode("HEALTH", 0, {**health, key: value})


@pytest.mark.parametrize("change", [{"theta": None}, {"speed": 1.0}])
def test_missing_and_unknown_names(change: dict[str, float | None]) -> None:
    values = {"theta": 0.1, "theta_dot": 0.1, "tau_m": 0.1, **change}
    if values["theta"] is None:
        del values["theta"]
    with pytest.raises(CodecError, match=r"LEVER_SAMPLE holds theta, theta_dot, tau_m; given: "):
        codec.encode("LEVER_SAMPLE", 0, values)


def test_multiplexed_message() -> None:
    values = {"m_p": 2.5, "c_p": 42.0, "k_p": 1500.0, "valid": 1}
    frame = codec.encode("PILOT_PARAMETERS", 0, {"model": "lever", **values})
    assert frame == codec.encode("PILOT_PARAMETERS", 0, {"model": 0, **values})
    assert frame[1:] == by_cantools(MESSAGES["PILOT_PARAMETERS"], {"model": 0, **values}, 0)
    with pytest.raises(CodecError, match="multiplexed"):
        codec.encoder("PILOT_PARAMETERS")
    signed = {"a21": -465.0, "a22": -13.7, "b21": -2.2, "valid": 1}
    frame = codec.encode("PILOT_PARAMETERS", 0, {"model": "linear_black_box", **signed})
    counts = [int.from_bytes(frame[start : start + 2], "little", signed=True) for start in (2, 4, 6)]
    assert counts == [-4650, -1370, -2200]
    with pytest.raises(CodecError, match="PILOT_PARAMETERS holds model, valid, a21, a22, b21; given: model, m_p"):
        codec.encode("PILOT_PARAMETERS", 0, {"model": "linear_black_box", **values})


def test_fast_encoders_against_cantools() -> None:
    lever, base = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE")
    valid = {"theta_valid": 1, "theta_dot_valid": 1, "tau_m_valid": 1}
    random = np.random.default_rng(1)
    for counter in range(16):
        theta, theta_dot, tau_m, z_ddot = (float(value) for value in random.normal(size=4) * [1.0, 5.0, 10.0, 10.0])
        values = {"theta": theta, "theta_dot": theta_dot, "tau_m": tau_m, **valid}
        frame = lever(counter, theta, theta_dot, tau_m)
        assert frame[1:] == by_cantools(MESSAGES["LEVER_SAMPLE"], values, counter)
        assert codec.check(0x110, frame)
        values = {"z_ddot": z_ddot, "z_ddot_valid": 1, "time_us": 1000 * counter}
        frame = base(counter, z_ddot, 1000 * counter)
        assert frame[1:] == by_cantools(MESSAGES["BASE_SAMPLE"], values, counter)
        assert codec.check(0x111, frame)
    with pytest.raises(ValueError, match="zip"):
        lever(0, 1.0)


def test_decoding_refuses() -> None:
    frame = codec.encoder("BASE_SAMPLE")(0, 1.0, 0)
    assert codec.decode(0x111, frame) == (
        "BASE_SAMPLE",
        {"crc": frame[0], "counter": 0, "z_ddot_valid": 1, "z_ddot": 1.0, "time_us": 0},
    )
    with pytest.raises(CodecError, match=r"0x7ff is not a message of lever.dbc: LEVER_SAMPLE, "):
        codec.decode(0x7FF, frame)
    with pytest.raises(CodecError, match=r"BASE_SAMPLE \(0x111\) .* is corrupt"):
        codec.decode(0x111, frame[:7])
    with pytest.raises(CodecError, match=r"LEVER_SAMPLE \(0x110\) .* is corrupt"):  # a frame of another message
        codec.decode(0x110, frame)
    other_model = bytearray(codec.encode("PILOT_SIGMA", 0, contents(MESSAGES["PILOT_SIGMA"])))
    other_model[1] |= 7 << 4
    other_model[0] = crc(bytes(other_model[1:]) + codec.data_ids("PILOT_SIGMA")[:1])
    with pytest.raises(CodecError, match=r"PILOT_SIGMA \(0x212\)"):
        codec.decode(0x212, other_model)


@pytest.mark.parametrize("name", MESSAGES)
def test_columns_against_cantools(name: str) -> None:
    message = MESSAGES[name]
    data = np.random.default_rng(2).integers(0, 256, (400, 8), dtype=np.uint8)
    data[:4] = [[0] * 8, [255] * 8, [0, 0x0F, 0, 0x80, 0, 0x80, 0, 0x80], [0, 0x0F, 255, 0x7F, 255, 0x7F, 255, 0x7F]]
    if message.is_multiplexed():
        model = np.arange(200, dtype=np.uint8) % len(MODELS)  # those that there are
        data[::2, 1] = data[::2, 1] & 0x0F | model << 4
    columns = codec.decode_columns(name, data)
    assert set(columns) == {signal.name for signal in message.signals}
    for row, frame in enumerate(data):
        try:
            expected = message.decode_simple(frame.tobytes(), decode_choices=False)
        except cantools.database.DecodeError:
            expected = {}  # of a model that there is not
            assert message.is_multiplexed()
        for signal in message.signals:
            value = columns[signal.name][row]
            if signal.name in expected:
                said = expected[signal.name]
                assert math.isnan(value) if said == code(signal) else value == said
            elif signal.multiplexer_ids is not None:
                assert math.isnan(value)


def test_columns_of_other_layouts() -> None:
    assert codec.decode_columns("HEALTH", np.empty((0, 8), np.uint8))["mode"].shape == (0,)
    wide = np.random.default_rng(3).integers(0, 256, (20, 16), dtype=np.uint8)
    expected = codec.decode_columns("HEALTH", wide[::2, 4:12].copy())
    for key, column in codec.decode_columns("HEALTH", wide[::2, 4:12]).items():
        np.testing.assert_array_equal(column, expected[key])
    wrongs: list[Any] = [np.zeros((3, 7), np.uint8), np.zeros(8, np.uint8), np.zeros((3, 8), np.int64)]
    for wrong in wrongs:
        with pytest.raises(CodecError, match=r"HEALTH: data is .* not uint8 of shape \(N, 8\)"):
            codec.decode_columns("HEALTH", wrong)


@pytest.mark.parametrize("name", MESSAGES)
def test_raw_fields_against_cantools(name: str) -> None:
    message = MESSAGES[name]
    choices = 1 + max(max(signal.multiplexer_ids or [0]) for signal in message.signals)
    for row, frame in enumerate(np.random.default_rng(4).integers(0, 256, (21, 8), dtype=np.uint8)):
        frame[1] = frame[1] & 0x0F | row % choices << 4
        raw = message.decode_simple(frame.tobytes(), decode_choices=False, scaling=False)
        for signal in filter(lambda signal: signal.name in raw, message.signals):
            value = codec.raw_field(name, signal.name)(frame.tobytes())
            assert value == int(raw[signal.name]) % (1 << signal.length)  # type: ignore[arg-type]
